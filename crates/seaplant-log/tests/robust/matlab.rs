//! MATLAB files of both kinds.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn matlab_files_of_version_5() {
    let Some(made) = made("matlab") else { return };
    for (name, file) in [("mat5", "seed5.mat"), ("mat7", "seed7.mat")] {
        let seed = std::fs::read(made.file(file)).unwrap();
        hammer(name, &seed, &ReadOptions::default(), Limits::default(), |_| {});
        let equal = ReadOptions { equal_sampling_hz: Some(10.0), ..ReadOptions::default() };
        hammer(name, &seed, &equal, Limits::default(), |_| {});
    }
}

#[test]
fn matlab_files_of_version_7_3() {
    let Some(made) = made("matlab") else { return };
    let seed = std::fs::read(made.file("seed73.mat")).unwrap();
    hammer("mat73", &seed, &ReadOptions::default(), Limits::default(), |_| {});
}
