//! NMEA 0183 sentences, damaged with and without valid checksums.

use seaplant_log::ReadOptions;

use crate::checks::mend;
use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn nmea_sentences() {
    let Some(made) = made("nmea") else { return };
    for name in ["seed.log", "seed-bare.log"] {
        let seed = std::fs::read(made.file(name)).unwrap();
        hammer(name, &seed, &ReadOptions::default(), Limits::default(), |bytes| mend(bytes));
    }
}
