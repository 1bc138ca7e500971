//! PX4 ULog files.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn ulog_files() {
    let Some(made) = made("ulog") else { return };
    let seed = std::fs::read(made.file("seed.ulg")).unwrap();
    hammer("ulog", &seed, &ReadOptions::default(), Limits::default(), |_| {});
}

#[test]
fn ulog_files_of_several_parts() {
    let Some(made) = made("ulog") else { return };
    let seed = std::fs::read(made.file("appended.ulg")).unwrap();
    hammer("ulog-appended", &seed, &ReadOptions::default(), Limits::default(), |_| {});
}
