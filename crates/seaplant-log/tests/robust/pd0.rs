//! PD0 files: damaged with and without their checksums put right.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn pd0_files() {
    let Some(made) = made("pd0") else { return };
    let seed = std::fs::read(made.file("seed.pd0")).unwrap();
    hammer("pd0", &seed, &ReadOptions::default(), Limits::default(), |bytes| repair(bytes));
}

/// Puts the checksum of every ensemble right that is whole.
fn repair(bytes: &mut [u8]) {
    let mut at = 0;
    while at + 4 < bytes.len() {
        let size = usize::from(u16::from_le_bytes([bytes[at + 2], bytes[at + 3]]));
        if !bytes[at..].starts_with(&[0x7f, 0x7f]) || size < 6 || at + size + 2 > bytes.len() {
            at += 1;
            continue;
        }
        let sum = bytes[at..at + size].iter().fold(0_u16, |sum, b| sum.wrapping_add((*b).into()));
        bytes[at + size..at + size + 2].copy_from_slice(&sum.to_le_bytes());
        at += size + 2;
    }
}
