//! Files that other software writes, and their expected content.
//!
//! `tests/reference/make_NAME.py FOLDER` writes files and, by `expected.py`, their content. It is
//! run by the interpreter in `SEAPLANT_PYTHON`, which `scripts/python-env` makes; without that
//! variable the tests report that they are skipped.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

use seaplant_log::Log;

/// Files of one script.
pub struct Made {
    folder: PathBuf,
    expected: Vec<Expected>,
}

/// A channel as the script wrote it.
pub struct Expected {
    pub file: String,
    pub column: String,
    pub unit: Option<String>,
    pub time_s: Vec<f64>,
    pub values: Vec<f64>,
}

/// Runs `tests/reference/make_NAME.py`, once for any number of tests; `None` without Python.
pub fn made(name: &str) -> Option<Made> {
    static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
    let Some(python) = std::env::var_os("SEAPLANT_PYTHON") else {
        eprintln!("skipped: SEAPLANT_PYTHON is not set; scripts/check sets it");
        return None;
    };
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("made").join(name);
    let scripts = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
    let script = scripts.join(format!("make_{name}.py"));
    let text = |path: PathBuf| std::fs::read_to_string(path).expect("the script is there");
    let shared = ["expected.py", "dataflash.py", "tlog.py", "requirements.txt"];
    let shared = shared.map(|name| text(scripts.join(name))).concat();
    let recipe = text(script.clone()) + &shared;
    let stamp = folder.join("recipe.txt");
    if std::fs::read_to_string(&stamp).ok().as_ref() != Some(&recipe) {
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("the target folder can be written");
        let run = Command::new(&python)
            .arg("-B")
            .arg(&script)
            .arg(&folder)
            .env("SEAPLANT_DATA", super::data_folder())
            .output();
        let run = run.unwrap_or_else(|error| panic!("{} cannot run: {error}", python.display()));
        let error = String::from_utf8_lossy(&run.stderr).into_owned();
        assert!(run.status.success(), "{} failed: {error}", script.display());
        std::fs::write(stamp, recipe).expect("the target folder can be written");
    }
    let expected = expected(&folder);
    Some(Made { folder, expected })
}

impl Made {
    /// Returns the path of a file that the script wrote.
    pub fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Returns the expected channels of a file, in order.
    pub fn expected(&self, name: &str) -> Vec<&Expected> {
        let found: Vec<&Expected> = self.expected.iter().filter(|e| e.file == name).collect();
        assert!(!found.is_empty(), "the script says nothing of {name}");
        found
    }

    /// Checks that a log has exactly the channels that the script wrote to `name`: the same
    /// columns, units, and values to the last bit; times within `time_s`.
    pub fn agrees(&self, name: &str, log: &Log, time_s: f64) {
        let expected = self.expected(name);
        let mut found: Vec<&str> = log.channels().iter().map(|c| c.column.as_str()).collect();
        let mut wanted: Vec<&str> = expected.iter().map(|e| e.column.as_str()).collect();
        found.sort_unstable();
        wanted.sort_unstable();
        assert_eq!(found, wanted, "{name}");
        for expected in expected {
            let column = &expected.column;
            let channel = log.channels().iter().find(|c| c.column == *column).unwrap();
            let unit = channel.unit.as_ref().map(|unit| unit.symbol().to_owned());
            assert_eq!(unit, expected.unit, "{name}: {column}");
            assert_eq!(channel.len(), expected.values.len(), "{name}: {column}");
            for (k, (found, wanted)) in channel.values().iter().zip(&expected.values).enumerate() {
                assert!(found == wanted, "{name}: {column}, sample {k}: {found} for {wanted}");
            }
            for (k, (found, wanted)) in channel.time_s().iter().zip(&expected.time_s).enumerate() {
                let near = (found - wanted).abs() <= time_s;
                assert!(near, "{name}: {column}, time {k}: {found} for {wanted}");
            }
        }
    }
}

fn expected(folder: &Path) -> Vec<Expected> {
    let bytes = std::fs::read(folder.join("expected.f64")).expect("the script wrote its values");
    let numbers = bytes.chunks_exact(8).map(|eight| f64::from_le_bytes(eight.try_into().unwrap()));
    let numbers: Vec<f64> = numbers.collect();
    let text = std::fs::read_to_string(folder.join("expected.json")).unwrap();
    let entries: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    let channel = |entry: &serde_json::Value| {
        let text = |key: &str| entry[key].as_str().map(str::to_owned);
        let number = |key: &str| entry[key].as_u64().unwrap() as usize;
        let (start, count) = (number("start"), number("count"));
        Expected {
            file: text("file").unwrap(),
            column: text("column").unwrap(),
            unit: text("unit"),
            time_s: numbers[start..start + count].to_vec(),
            values: numbers[start + count..start + 2 * count].to_vec(),
        }
    };
    entries.iter().map(channel).collect()
}
