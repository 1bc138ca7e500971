//! MAVLink telemetry logs, every other time with recomputed checksums.

use seaplant_log::{ReadOptions, Stamp};

use crate::checks::mend;
use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn telemetry_logs() {
    let Some(made) = made("tlog") else { return };
    let seed = std::fs::read(made.file("seed.tlog")).unwrap();
    // Zeros at the end of a payload are not transmitted.
    let limits = Limits { samples_per_byte: 8.0, ..Limits::default() };
    for stamp in [Stamp::Header, Stamp::Receive] {
        let options = ReadOptions { stamp, ..ReadOptions::default() };
        hammer("tlog", &seed, &options, limits, |bytes| mend(bytes));
    }
}
