//! ArduPilot DataFlash logs.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn dataflash_logs() {
    let Some(made) = made("dataflash") else { return };
    let seed = std::fs::read(made.file("seed.BIN")).unwrap();
    hammer("dataflash", &seed, &ReadOptions::default(), Limits::default(), |_| {});
}

#[test]
fn dataflash_logs_of_several_starts() {
    let Some(made) = made("dataflash") else { return };
    let seed = std::fs::read(made.file("starts.BIN")).unwrap();
    hammer("dataflash-starts", &seed, &ReadOptions::default(), Limits::default(), |_| {});
}
