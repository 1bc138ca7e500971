//! PD0 files, damaged with and without valid checksums.

use seaplant_log::ReadOptions;

use crate::checks::mend;
use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn pd0_files() {
    let Some(made) = made("pd0") else { return };
    let seed = std::fs::read(made.file("seed.pd0")).unwrap();
    hammer("pd0", &seed, &ReadOptions::default(), Limits::default(), |bytes| mend(bytes));
}
