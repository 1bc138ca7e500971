//! NMEA 0183 sentences, damaged with and without their checksums put right.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn nmea_sentences() {
    let Some(made) = made("nmea") else { return };
    for name in ["seed.log", "seed-bare.log"] {
        let seed = std::fs::read(made.file(name)).unwrap();
        hammer(name, &seed, &ReadOptions::default(), Limits::default(), |bytes| repair(bytes));
    }
}

/// Puts the checksum of every sentence right that has one.
fn repair(bytes: &mut [u8]) {
    for line in bytes.split_mut(|&byte| byte == b'\n') {
        let start = line.iter().position(|&byte| byte == b'$');
        let star = line.iter().rposition(|&byte| byte == b'*');
        if let (Some(start), Some(star)) = (start, star)
            && start < star
            && let Some(digits) = star.checked_add(3).filter(|&end| end <= line.len())
        {
            let sum = line[start + 1..star].iter().fold(0, |sum, byte| sum ^ byte);
            line[star + 1..digits].copy_from_slice(format!("{sum:02X}").as_bytes());
        }
    }
}
