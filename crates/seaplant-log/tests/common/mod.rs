//! Small files to read.

pub mod mcap;
pub mod python;

use std::path::{Path, PathBuf};

use seaplant_log::{Error, Log, ReadOptions, TimeColumn, read};

/// A file in a folder that is deleted on drop.
pub struct Sample {
    folder: tempfile::TempDir,
    path: PathBuf,
}

impl Sample {
    pub fn new(name: &str, content: impl AsRef<[u8]>) -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let path = folder.path().join(name);
        std::fs::write(&path, content).expect("a temporary file can be written");
        Self { folder, path }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn folder(&self) -> &Path {
        self.folder.path()
    }
}

/// Reads `content` as a file `log.csv`, with time recognised by its name.
pub fn read_text(content: impl AsRef<[u8]>) -> Result<Log, Error> {
    read(Sample::new("log.csv", content).path(), &ReadOptions::default())
}

/// Reads a file with the default options.
pub fn open(path: &Path) -> Log {
    read(path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

pub fn options(column: &str, unit: Option<&str>) -> ReadOptions {
    let time = TimeColumn { column: Some(column.to_owned()), unit: unit.map(str::to_owned) };
    ReadOptions { time: Some(time), ..ReadOptions::default() }
}

/// Returns the messages of a log's notes, without folders.
pub fn notes(log: &Log) -> Vec<String> {
    log.notes().iter().map(|note| without_folder(&note.to_string(), note.path())).collect()
}

/// Returns a message as if the file were in the working folder.
pub fn without_folder(message: &str, path: &Path) -> String {
    let folder = path.parent().map(|p| format!("{}/", p.display())).unwrap_or_default();
    message.replace(&folder, "")
}

/// Returns the message of reading `content` as `log.csv`, without folders.
pub fn failure(content: impl AsRef<[u8]>) -> String {
    failure_with(content, &ReadOptions::default())
}

/// Returns the message of reading `content` as `log.csv` with `options`, without folders.
pub fn failure_with(content: impl AsRef<[u8]>, options: &ReadOptions) -> String {
    let sample = Sample::new("log.csv", content);
    let error = read(sample.path(), options).expect_err("this file cannot be a log");
    without_folder(&error.to_string(), sample.path())
}

/// Returns the folder of third-party logs: the one in `SEAPLANT_DATA`, relative to the workspace,
/// else `../shared/data`.
pub fn data_folder() -> PathBuf {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let named = std::env::var_os("SEAPLANT_DATA").map(PathBuf::from);
    workspace.join(named.unwrap_or_else(|| PathBuf::from("../shared/data")))
}

/// Returns a file or folder of the data, if it exists.
pub fn data(name: &str) -> Option<PathBuf> {
    let path = data_folder().join(name);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}
