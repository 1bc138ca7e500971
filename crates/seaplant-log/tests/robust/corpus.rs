//! Seed files of the fuzzer, and files with which it found failures: every reader must handle all
//! of them. `scripts/fuzz` searches further.

use std::path::{Path, PathBuf};

use seaplant_log::ReadOptions;

use crate::checks::mend;
use crate::harness::{Limits, replay};

/// Folders, one for each reader, and the format of a log that it read.
const READERS: &[(&str, &str)] = &[
    ("arrow", "Arrow IPC"),
    ("bag", "ROS 1 bag"),
    ("dataflash", "ArduPilot DataFlash"),
    ("db3", "ROS 2 bag (SQLite)"),
    ("gzip", "comma-separated text, gzip"),
    ("hdf5", "HDF5"),
    ("mat5", "MATLAB"),
    ("mcap", "MCAP"),
    ("nmea", "NMEA 0183"),
    ("parquet", "Parquet"),
    ("pd0", "Teledyne RDI PD0"),
    ("text", "comma-separated text"),
    ("tlog", "MAVLink telemetry"),
    ("ulog", "PX4 ULog"),
    ("xlsx", "Excel workbook"),
    ("zstd", "comma-separated text, zstd"),
];

/// Maximum total size of a reader's files in bytes, because they are in the repository.
const SIZE: usize = 20 << 10;

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus")
}

/// Lists the files and folders in a folder, in order.
fn within(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut found: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    found.sort();
    found
}

#[test]
fn every_reader_has_a_corpus() {
    let folders: Vec<String> = within(&corpus())
        .iter()
        .map(|folder| folder.file_name().unwrap().to_string_lossy().into_owned())
        .collect();
    let readers: Vec<&str> = READERS.iter().map(|(reader, _)| *reader).collect();
    assert_eq!(folders, readers);
}

#[test]
fn every_reader_handles_its_corpus() {
    // Archives, zeros at the end of a frame and constant columns take less than a byte per sample.
    let limits = Limits { samples_per_byte: 100.0, ..Limits::default() };
    for (reader, format) in READERS {
        let (mut size, mut reads) = (0, 0);
        for file in within(&corpus().join(reader)) {
            let bytes = std::fs::read(&file).unwrap();
            let name = format!("{reader}-{}", file.file_name().unwrap().to_string_lossy());
            size += bytes.len();
            let log = replay(&name, &bytes, &ReadOptions::default(), limits);
            reads +=
                usize::from(log.is_some_and(|log| log.sources()[0].format.starts_with(format)));
            let equal = ReadOptions { equal_sampling_hz: Some(10.0), ..ReadOptions::default() };
            replay(&name, &bytes, &equal, limits);
            let mut mended = bytes.clone();
            mend(&mut mended);
            replay(&name, &mended, &ReadOptions::default(), limits);
        }
        assert!(size <= SIZE, "{reader}: {size} bytes");
        assert!(reads >= 2, "{reader}: {reads} files are read as {format}");
    }
}
