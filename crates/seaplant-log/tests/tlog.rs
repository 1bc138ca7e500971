//! MAVLink telemetry logs.

mod common;

use std::path::Path;

use common::python::made;
use common::{data, notes};
use seaplant_log::{Log, ReadOptions, Stamp, read};

/// Doubles resolve today's Unix time to less than this, s.
const RESOLUTION_S: f64 = 1e-6;

fn open(path: &Path, stamp: Stamp) -> Log {
    let options = ReadOptions { stamp, ..ReadOptions::default() };
    read(path, &options).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_log_of_a_ground_station_is_read_as_pymavlink_reads_it() {
    let Some(path) = data("formats/ardusub/small.tlog") else { return };
    let Some(made) = made("ardusub") else { return };
    let log = open(&path, Stamp::Receive);
    eprintln!("{:#?}", notes(&log));
    made.agrees("small.tlog", &log, RESOLUTION_S);
    assert_eq!(log.sources()[0].format, "MAVLink telemetry");
    assert_eq!(log.settings()["FRAME_CONFIG"], 1.0);
}
