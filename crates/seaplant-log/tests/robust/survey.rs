//! Logs long enough to be surveyed in parts.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn surveyed_logs() {
    let Some(made) = made("survey") else { return };
    for name in ["small.csv", "small.BIN", "small.tlog", "small.mcap", "small.bag", "small.db3"] {
        let seed = std::fs::read(made.file(name)).unwrap();
        hammer(name, &seed, &ReadOptions::default(), Limits::default(), |_| {});
    }
}
