//! Logs for tests.

use std::path::{Path, PathBuf};

use seaplant_log::{Log, ReadOptions, read};
use tempfile::TempDir;

/// A folder of logs that is deleted on drop.
pub struct Folder(TempDir);

impl Folder {
    pub fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder can be made"))
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn write(&self, name: &str, content: &str) -> PathBuf {
        let path = self.path().join(name);
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).expect("a folder can be made");
        }
        std::fs::write(&path, content).expect("a file can be written");
        path
    }
}

pub fn open(files: &[PathBuf]) -> Log {
    let files: Vec<_> = files.iter().map(|f| (f.clone(), ReadOptions::default())).collect();
    Log::open(&files).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns a log of one column sampled at 10 Hz.
pub fn column(header: &str, values: &[f64]) -> Log {
    let times: Vec<f64> = (0..values.len()).map(|k| k as f64 / 10.0).collect();
    timed(header, &times, values)
}

/// Returns a log of one column.
pub fn timed(header: &str, times: &[f64], values: &[f64]) -> Log {
    let rows = times.iter().zip(values).map(|(t, x)| format!("{t},{x}\n"));
    let folder = Folder::new();
    let path = folder.write("log.csv", &format!("time [s],{header}\n{}", rows.collect::<String>()));
    read(&path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Writes CSV of columns that are functions of time, at `rate_hz` for `span_s`.
pub fn csv(rate_hz: f64, span_s: f64, columns: &[(&str, &dyn Fn(f64) -> f64)]) -> String {
    let mut text = "time [s]".to_owned();
    columns.iter().for_each(|(header, _)| text += &format!(",{header}"));
    for k in 0..=(span_s * rate_hz) as usize {
        let t = k as f64 / rate_hz;
        text += &format!("\n{t}");
        columns.iter().for_each(|(_, value)| text += &format!(",{}", value(t)));
    }
    text + "\n"
}

/// Returns deterministic noise from −1 to 1.
pub fn noise(k: usize) -> f64 {
    let x = (k as u64).wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    ((x >> 11) as f64) / (1u64 << 52) as f64 - 1.0
}

/// Returns a file of third-party data in the folder in `SEAPLANT_DATA`, relative to the workspace,
/// else in `../shared/data`; prints a note if it is absent.
pub fn data(name: &str) -> Option<PathBuf> {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let named = std::env::var_os("SEAPLANT_DATA").map(PathBuf::from);
    let path = workspace.join(named.unwrap_or_else(|| "../shared/data".into())).join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// Returns an error's message without its folders and without the excerpt of the file, which the
/// tests of `excerpt` and of the program check.
pub fn said(error: &seaplant_campaign::Error, folder: &Folder) -> String {
    let words = error.to_string();
    let words = match error {
        seaplant_campaign::Error::Value { excerpt, .. } => {
            words.strip_suffix(excerpt.as_str()).expect("its end")
        }
        _ => &words,
    };
    words.replace(&format!("{}/", folder.path().display()), "")
}
