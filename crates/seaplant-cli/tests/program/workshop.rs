//! A folder with a small campaign to modify, and the program to run on it.

use std::path::{Path, PathBuf};

use assert_cmd::Command;
use serde_json::Value;
use tempfile::TempDir;

/// Returns the program.
pub fn seaplant() -> Command {
    assert_cmd::cargo::cargo_bin_cmd!("seaplant")
}

/// A folder that is deleted on drop.
pub struct Workshop(TempDir);

pub const VEHICLE: &str = r#"name = "sled"
[[thruster]]
name = "prop"
position_m = [0.0, 0.0, 0.0]
direction = [1.0, 0.0, 0.0]
curve = { kind = "quadratic", forward = 0.04, reverse = 0.04 }
"#;

pub const CAMPAIGN: &str = r#"vehicle = "vehicle.toml"
[[trial]]
name = "run 1"
log = "log.csv"
dof = ["surge"]

[channels]
"thruster.prop.speed" = { column = "prop" }
"velocity.surge" = { column = "speed" }
"#;

/// Mass of the sled, kg, and its drag, N/(m/s)².
pub const SLED: (f64, f64) = (500.0, 150.0);

const HEADER: &str = "time [s],prop [rpm],speed [m/s]";

/// Simulates two minutes of the sled at 10 Hz, its propeller at `speed(t)` rad/s.
pub fn log(speed: impl Fn(f64) -> f64) -> String {
    const SUBSTEPS: usize = 20;
    const STEP_S: f64 = 0.1;
    let (mass, drag) = SLED;
    let mut text = format!("{HEADER}\n");
    let mut v: f64 = 0.0;
    for k in 0..1200_u32 {
        let t = f64::from(k) * STEP_S;
        let omega = speed(t);
        let rpm = omega * 30.0 / std::f64::consts::PI;
        let jitter = 0.002 * (f64::from(k) * 12.9898).sin();
        text += &format!("{t:.1},{rpm:.3},{:.5}\n", v + jitter);
        for _ in 0..SUBSTEPS {
            let force = 0.04 * omega * omega.abs();
            v += (force - drag * v * v.abs()) / mass * STEP_S / SUBSTEPS as f64;
        }
    }
    text
}

/// Returns a propeller speed in both directions, fast and slow.
pub fn lively(t: f64) -> f64 {
    120.0 * (0.5 * t).sin() + 60.0 * (0.17 * t + 1.0).sin()
}

impl Workshop {
    /// Creates one with the sled's vehicle.toml, campaign.toml and log.csv.
    pub fn new() -> Self {
        let workshop = Self::empty();
        workshop.write("vehicle.toml", VEHICLE);
        workshop.write("campaign.toml", CAMPAIGN);
        workshop.write("log.csv", log(lively));
        workshop
    }

    /// Creates one with only the fastest method, for tests to which the method does not matter.
    pub fn quick() -> Self {
        let workshop = Self::new();
        let method = "methods = [\"equation-error\"]\n[[trial]]";
        workshop.change("campaign.toml", "[[trial]]", method);
        workshop
    }

    pub fn empty() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder can be made"))
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }

    pub fn join(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.join(name);
        std::fs::create_dir_all(path.parent().expect("in a folder")).expect("a folder");
        std::fs::write(path, content).expect("a file can be written");
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Replaces text in a file; the file must change.
    pub fn change(&self, name: &str, from: &str, to: &str) {
        let text = self.read(name);
        assert!(text.contains(from), "{name} does not hold {from:?}");
        self.write(name, text.replace(from, to));
    }

    /// Returns the program with arguments, in this folder.
    pub fn seaplant(&self, words: &[&str]) -> Command {
        let mut command = seaplant();
        command.current_dir(self.path()).args(words);
        command
    }

    /// Returns the standard output of a command that succeeds.
    pub fn success(&self, words: &[&str]) -> String {
        let output = self.seaplant(words).assert().success().stderr("").get_output().clone();
        String::from_utf8(output.stdout).expect("UTF-8")
    }

    /// Returns the JSON that a command prints.
    pub fn json(&self, words: &[&str]) -> Value {
        let text = self.success(words);
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error} in {text}"))
    }

    /// Returns the standard error of a command that fails, without `error: `; the command must not
    /// write files.
    pub fn failure(&self, words: &[&str]) -> String {
        let before = self.everything();
        let output = self.seaplant(words).assert().code(1).stdout("").get_output().clone();
        assert_eq!(self.everything(), before, "something was written");
        let text = String::from_utf8(output.stderr).expect("UTF-8");
        let message = text.strip_prefix("error: ").unwrap_or_else(|| panic!("{text}"));
        message.trim_end().to_owned()
    }

    /// Returns [`Self::failure`] of `identify campaign.toml`.
    pub fn refusal(&self) -> String {
        self.failure(&["identify", "campaign.toml", "--out", "out"])
    }

    /// Returns every file and folder, with the content of files.
    pub fn everything(&self) -> Vec<(PathBuf, Vec<u8>)> {
        self.everything_in("")
    }

    /// Returns [`Self::everything`] in a folder.
    pub fn everything_in(&self, folder: &str) -> Vec<(PathBuf, Vec<u8>)> {
        let mut found = Vec::new();
        let mut folders = vec![self.join(folder)];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.is_dir() {
                    folders.push(path.clone());
                    found.push((path, Vec::new()));
                } else {
                    let bytes = std::fs::read(&path).expect("a file");
                    found.push((path, bytes));
                }
            }
        }
        found.sort();
        found
    }
}

/// Returns a number in JSON by its path: `plants.surge.by_axis.surge.mass.value`.
pub fn number(json: &Value, path: &str) -> f64 {
    let found = path.split('.').fold(json, |json, key| &json[key]);
    found.as_f64().unwrap_or_else(|| panic!("{path} is {found}"))
}

/// Returns what a plant of one axis, or its score, has of this axis.
pub fn only_axis(of: &Value) -> &Value {
    let axes = of["by_axis"].as_object().unwrap_or_else(|| panic!("no axes in {of}"));
    assert_eq!(axes.len(), 1, "{of}");
    axes.values().next().expect("one")
}

/// Asserts that a value is right within a relative tolerance.
#[track_caller]
pub fn assert_within(name: &str, value: f64, right: f64, part: f64) {
    let off = value / right - 1.0;
    assert!(off.abs() <= part, "{name} is {value}, off {right} by {:.2} %", 100.0 * off);
}

/// Returns the caveats of a plant: code, severity, message.
pub fn caveats(plant: &Value) -> Vec<(&str, &str, &str)> {
    let all = plant["caveats"].as_array().expect("caveats");
    all.iter()
        .map(|caveat| {
            let text = |key: &str| caveat[key].as_str().expect("text");
            (text("code"), text("severity"), text("message"))
        })
        .collect()
}

/// Returns the message of a caveat, which must be present.
#[track_caller]
pub fn caveat<'a>(plant: &'a Value, code: &str) -> &'a str {
    let all = caveats(plant);
    let found = all.iter().find(|(found, _, _)| *found == code);
    found.unwrap_or_else(|| panic!("no caveat {code} in {all:?}")).2
}
