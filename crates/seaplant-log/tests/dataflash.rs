//! ArduPilot DataFlash logs.

use std::path::Path;

use seaplant_log::{Log, ReadOptions, read_bytes};

use crate::common::python::made;
use crate::common::{data, notes, open};

/// Times are stored in microseconds.
const RESOLUTION_S: f64 = 1e-9;

fn read_log(bytes: &[u8]) -> Log {
    let log = read_bytes(Path::new("log.BIN"), bytes, &ReadOptions::default());
    log.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_kind_of_field_is_read_as_pymavlink_reads_it() {
    let Some(made) = made("dataflash") else { return };
    let log = open(&made.file("all.BIN"));
    made.agrees("all.BIN", &log, RESOLUTION_S);
    assert_eq!(
        notes(&log),
        [
            "all.BIN: times are seconds since the autopilot started",
            "all.BIN: each of 3 fields holds text; left out: \"TEXT.N\", \"TEXT.Z\", \"TEXT.n\"",
            "all.BIN: \"TEXT.a\" is a list of numbers of one moment; left out",
        ]
    );
}

#[test]
fn a_log_of_ardusub_is_read_as_pymavlink_reads_it() {
    let Some(path) = data("formats/ardusub/small.BIN") else { return };
    let Some(made) = made("ardusub") else { return };
    let log = open(&path);
    made.agrees("small.BIN", &log, RESOLUTION_S);
    assert_eq!(log.sources()[0].format, "ArduPilot DataFlash");
    assert_eq!(log.settings()["FRAME_CONFIG"], 1.0);
    assert_eq!(log.settings()["MOT_1_DIRECTION"], -1.0);
    // Of 876 records, five repeat a setting.
    assert_eq!(log.settings().len(), 871);
}

#[test]
fn later_starts_of_the_autopilot_follow_at_a_distance() {
    let Some(made) = made("dataflash") else { return };
    let log = open(&made.file("starts.BIN"));
    made.agrees("starts.BIN", &log, 1e-6);
    assert_eq!(
        notes(&log)[1],
        "starts.BIN: the autopilot was started anew 2 times, and its clock with it; what follows \
         is moved to 106.900 s, 211.800 s: the time between is not known"
    );
}

#[test]
fn a_truncated_log_gives_what_precedes_the_end() {
    let Some(made) = made("dataflash") else { return };
    let bytes = std::fs::read(made.file("starts.BIN")).unwrap();
    // FMT of itself and of ATT are 89 bytes each; an ATT record takes 13.
    let log = read_log(&bytes[..89 * 2 + 13 * 20 + 7]);
    let roll = log.channel("ATT.Roll").unwrap();
    assert_eq!((roll.len(), roll.time_s()[19]), (20, 3.9));
    assert_eq!(
        notes(&log)[1],
        "log.BIN: the file is cut off in the record at byte 438, after 3.900 s; all before was read"
    );
}

#[test]
fn damaged_stretches_are_skipped_and_counted() {
    let Some(made) = made("dataflash") else { return };
    let bytes = std::fs::read(made.file("starts.BIN")).unwrap();
    let whole = read_log(&bytes[..89 * 2 + 13 * 50]);
    let start = |record: usize| 89 * 2 + 13 * record;
    // Record 10 loses five bytes, the marks of record 30 are overwritten, and noise precedes record
    // 40.
    let mut damaged = bytes[..start(50)].to_vec();
    damaged.splice(start(40)..start(40), *b"noise\xa3\x95");
    damaged[start(30)] = 0;
    damaged.drain(start(10) + 4..start(10) + 9);
    let log = read_log(&damaged);
    let (found, sound) = (log.channel("ATT.Roll").unwrap(), whole.channel("ATT.Roll").unwrap());
    // A record is accepted if another follows it.
    let lost = [10, 29, 30, 39];
    let kept: Vec<f64> = (0..50).filter(|k| !lost.contains(k)).map(|k| sound.values()[k]).collect();
    assert_eq!(found.values(), kept);
    assert_eq!(
        notes(&log)[1],
        "log.BIN: 3 stretches are damaged, the first at byte 308; 54 bytes skipped"
    );
}

#[test]
fn erased_memory_after_the_last_record_is_no_damage() {
    let Some(made) = made("dataflash") else { return };
    let bytes = std::fs::read(made.file("starts.BIN")).unwrap();
    for fill in [0, 0xff] {
        let mut padded = bytes[..89 * 2 + 13 * 50].to_vec();
        padded.resize(padded.len() + 300, fill);
        let log = read_log(&padded);
        assert_eq!(log.channel("ATT.Roll").unwrap().len(), 50);
        assert_eq!(notes(&log).len(), 1);
    }
}

#[test]
fn unreadable_parts_are_reported_and_the_rest_is_read() {
    let Some(made) = made("dataflash") else { return };
    let log = open(&made.file("odd.BIN"));
    made.agrees("odd.BIN", &log, RESOLUTION_S);
    assert_eq!(
        notes(&log),
        [
            "odd.BIN: times are seconds since the autopilot started, which was \
             2022-03-09T23:59:32Z by satellite",
            "odd.BIN: \"NEW\" has fields of an unknown type; left out",
            "odd.BIN: \"BARE\" has no time of its own; left out",
            "odd.BIN: \"LONG\" is of a type whose fields contradict its length; left out",
        ]
    );
}
