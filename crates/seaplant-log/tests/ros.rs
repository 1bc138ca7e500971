//! Bags of ROS 1 and ROS 2.

mod common;

use common::python::made;

use seaplant_log::{Log, ReadOptions, read};

/// Seconds since 1970 in a double, of a stamp and a receipt in nanoseconds.
const RESOLUTION_S: f64 = 2.5e-7;

fn open(path: &std::path::Path) -> Log {
    read(path, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn mcap_files_are_read_as_independent_software_wrote_them() {
    let Some(made) = made("ros") else { return };
    for name in [
        "zstd.mcap",
        "lz4.mcap",
        "plain.mcap",
        "unchunked.mcap",
        "big.mcap",
        "rosbags.mcap",
        "ros1.mcap",
    ] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, "MCAP");
    }
}

#[test]
fn sqlite_bags_are_read_as_independent_software_wrote_them() {
    let Some(made) = made("ros") else { return };
    for name in ["iron.db3", "packed.db3", "foxy.db3"] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, "ROS 2 bag (SQLite)");
    }
}

#[test]
fn ros_1_bags_are_read_as_independent_software_wrote_them() {
    let Some(made) = made("ros") else { return };
    for name in ["plain.bag", "bz2.bag", "lz4.bag"] {
        let log = open(&made.file(name));
        made.agrees(name, &log, RESOLUTION_S);
        assert_eq!(log.sources()[0].format, "ROS 1 bag");
    }
}
