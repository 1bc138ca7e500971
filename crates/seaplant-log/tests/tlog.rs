//! MAVLink telemetry logs.

use std::path::Path;

use seaplant_log::{Log, ReadOptions, Stamp, read, read_bytes};

use crate::common::python::made;
use crate::common::{data, notes};

/// Resolution of today's Unix time in a double, s.
const RESOLUTION_S: f64 = 1e-6;

fn open(path: &Path, stamp: Stamp) -> Log {
    let options = ReadOptions { stamp, ..ReadOptions::default() };
    read(path, &options).unwrap_or_else(|error| panic!("{error}"))
}

fn read_log(bytes: &[u8]) -> Log {
    let options = ReadOptions { stamp: Stamp::Receive, ..ReadOptions::default() };
    let log = read_bytes(Path::new("log.tlog"), bytes, &options);
    log.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_log_of_a_ground_station_is_read_as_pymavlink_reads_it() {
    let Some(path) = data("formats/ardusub/small.tlog") else { return };
    let Some(made) = made("ardusub") else { return };
    let log = open(&path, Stamp::Receive);
    made.agrees("small.tlog", &log, RESOLUTION_S);
    assert_eq!(log.sources()[0].format, "MAVLink telemetry");
    assert_eq!(log.settings()["FRAME_CONFIG"], 2.0);
    // pymavlink also finds four stretches of bad data.
    assert_eq!(
        notes(&log)[0],
        "small.tlog: 4 stretches are damaged, the first at byte 11888; 315 bytes skipped"
    );
    assert_eq!(
        notes(&log)[1],
        "small.tlog: times are seconds since the Unix epoch by the receiver's clock, of receipt"
    );
}

#[test]
fn every_message_of_either_version_is_read_as_pymavlink_reads_it() {
    let Some(made) = made("tlog") else { return };
    for name in ["every.tlog", "senders.tlog"] {
        let log = open(&made.file(name), Stamp::Receive);
        made.agrees(name, &log, RESOLUTION_S);
    }
}

#[test]
fn senders_and_instances_are_distinguished() {
    let Some(made) = made("tlog") else { return };
    let log = open(&made.file("senders.tlog"), Stamp::Receive);
    for column in [
        "HEARTBEAT[255.190].type",
        "NAMED_VALUE_FLOAT[CamTilt].value",
        "BATTERY_STATUS[1].voltages[9]",
        "SERVO_OUTPUT_RAW.servo8_raw",
    ] {
        assert_eq!(log.channel(column).unwrap().len(), 100, "{column}");
    }
    assert_eq!(log.settings()["FRAME_CONFIG"], 2.0);
}

#[test]
fn stamps_of_the_vehicle_are_laid_on_the_clock_of_receipt() {
    let Some(made) = made("tlog") else { return };
    let log = open(&made.file("stamps.tlog"), Stamp::Header);
    for expected in made.expected("stamps.tlog") {
        let channel = log.channel(&expected.column).unwrap();
        assert_eq!(channel.values(), expected.values, "{}", expected.column);
        // Stamps are in milliseconds.
        for (found, wanted) in channel.time_s().iter().zip(&expected.time_s) {
            assert!((found - wanted).abs() < 2e-6, "{}: {found} for {wanted}", expected.column);
        }
    }
    assert_eq!(
        notes(&log)[0],
        "stamps.tlog: times are seconds since the Unix epoch by the receiver's clock: the senders' \
         own stamps, laid on it by the quickest message of each; of messages without, of receipt"
    );
}

#[test]
fn messages_that_are_not_known_are_counted() {
    let Some(made) = made("tlog") else { return };
    let log = open(&made.file("private.tlog"), Stamp::Receive);
    assert_eq!(log.channel("HEARTBEAT.custom_mode").unwrap().len(), 20);
    assert_eq!(
        notes(&log)[1],
        "private.tlog: 5 messages are of no known kind; passed over: number \"12345\""
    );
}

#[test]
fn a_truncated_log_gives_what_precedes_the_end() {
    let Some(made) = made("tlog") else { return };
    let bytes = std::fs::read(made.file("private.tlog")).unwrap();
    // A frame of HEARTBEAT takes 29 bytes, and an unknown one 23.
    let log = read_log(&bytes[..29 * 4 + 23 + 12]);
    assert_eq!(log.channel("HEARTBEAT.custom_mode").unwrap().len(), 4);
    assert_eq!(
        notes(&log)[0],
        "log.tlog: the file is cut off in the record at byte 139, after 1700000003.250 s; all before \
         was read"
    );
}

#[test]
fn damaged_stretches_are_skipped_and_counted() {
    let Some(made) = made("tlog") else { return };
    let mut bytes = std::fs::read(made.file("private.tlog")).unwrap();
    // The second frame has a wrong checksum, the third lost bytes, and noise precedes the sixth.
    bytes[29 + 23 + 20] ^= 1;
    bytes.splice(29 * 5 + 23 * 2..29 * 5 + 23 * 2, *b"noise\0");
    bytes.drain(29 * 2 + 23 + 10..29 * 2 + 23 + 15);
    let log = read_log(&bytes);
    let mode = log.channel("HEARTBEAT.custom_mode").unwrap();
    // An unknown message is accepted only if a frame follows it; here it precedes noise.
    let kept: Vec<f64> = (0..20).filter(|k| ![1, 2].contains(k)).map(f64::from).collect();
    assert_eq!(mode.values(), kept);
    assert_eq!(
        notes(&log)[0],
        "log.tlog: 2 stretches are damaged, the first at byte 52; 82 bytes skipped"
    );
}
