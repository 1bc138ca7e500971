//! PX4 ULog files.

use std::path::Path;

use seaplant_log::{ReadOptions, read_bytes};

use crate::common::python::made;
use crate::common::{data, notes, open};

/// Times are stored in microseconds.
const RESOLUTION_S: f64 = 1e-9;

#[test]
fn every_kind_of_field_is_read_as_pyulog_reads_it() {
    let Some(made) = made("ulog") else { return };
    let log = open(&made.file("all.ulg"));
    made.agrees("all.ulg", &log, RESOLUTION_S);
    assert_eq!(log.sources()[0].format, "PX4 ULog");
    assert_eq!(log.settings()["CA_ROTOR_COUNT"], 6.0);
    assert_eq!(log.settings()["MPC_XY_P"], f64::from(0.95_f32));
    assert_eq!(
        notes(&log),
        [
            "all.ulg: times are seconds since the autopilot started",
            "all.ulg: each of 3 fields is text; left out: \"every.parts[0].label\", \"every.parts[1].label\", \"every.text\"",
        ]
    );
}

#[test]
fn logs_of_px4_are_read_as_pyulog_reads_them() {
    let Some(made) = made("ulog") else { return };
    for name in ["sample_log_small.ulg", "sample_appended_multiple.ulg"] {
        let Some(path) = data(&format!("formats/ulog/{name}")) else { return };
        made.agrees(name, &open(&path), RESOLUTION_S);
    }
}

#[test]
fn appended_data_are_read_after_an_incomplete_message() {
    let Some(made) = made("ulog") else { return };
    let log = open(&made.file("appended.ulg"));
    let x = log.channel("sensor.x").unwrap();
    assert_eq!(x.values(), (0..15).map(f64::from).collect::<Vec<_>>());
    assert_eq!((x.time_s()[9], x.time_s()[14]), (11.0, 16.0));
    assert_eq!(notes(&log).len(), 1);
}

#[test]
fn a_truncated_log_gives_what_precedes_the_end() {
    let Some(made) = made("ulog") else { return };
    let bytes = std::fs::read(made.file("seed.ulg")).unwrap();
    let log = read_bytes(Path::new("log.ulg"), &bytes[..bytes.len() - 5], &ReadOptions::default());
    let log = log.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(log.channel("sensor.x").unwrap().len(), 12);
    assert_eq!(log.channel("vehicle_attitude.q[0]").unwrap().len(), 11);
    assert!(notes(&log)[1].contains("is cut off in the record at byte"), "{:?}", notes(&log));
}

#[test]
fn damage_costs_the_messages_that_it_hits() {
    let Some(made) = made("ulog") else { return };
    let mut bytes = std::fs::read(made.file("seed.ulg")).unwrap();
    let from = bytes.len() - 200;
    bytes[from..from + 20].fill(0xff);
    let log = read_bytes(Path::new("log.ulg"), &bytes, &ReadOptions::default()).unwrap();
    let kept = log.channel("sensor.x").unwrap().len();
    assert!((9..12).contains(&kept), "{kept}");
    assert!(notes(&log)[1].contains("damaged"), "{:?}", notes(&log));
}
