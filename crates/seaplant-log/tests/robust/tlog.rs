//! MAVLink telemetry logs, every other time with checksums made right again.

use std::collections::HashMap;

use seaplant_log::{ReadOptions, Stamp};

use crate::common::python::made;
use crate::harness::{Limits, hammer};

/// Where a frame's payload is, what its message is called, and where it ends, if one starts here.
fn frame(bytes: &[u8]) -> Option<(usize, [u8; 3], usize)> {
    let header = match *bytes.get(8)? {
        0xfe => 6,
        0xfd => 10,
        _ => return None,
    };
    let number = match header {
        6 => [*bytes.get(13)?, 0, 0],
        _ => bytes.get(15..18)?.try_into().ok()?,
    };
    let end = 8 + header + usize::from(*bytes.get(9)?);
    (end + 2 <= bytes.len()).then_some((end, number, end + 2))
}

/// CRC-16/MCRF4XX, bit by bit.
fn checksum(bytes: &[u8], seed: u8) -> [u8; 2] {
    let mut crc = !0u16;
    for byte in bytes.iter().chain([&seed]) {
        crc ^= u16::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0x8408 } else { crc >> 1 };
        }
    }
    crc.to_le_bytes()
}

/// The seed that makes each message's checksum right.
fn seeds(sound: &[u8]) -> HashMap<[u8; 3], u8> {
    let (mut found, mut at) = (HashMap::new(), 0);
    while let Some((end, number, next)) = frame(&sound[at..]) {
        let fits =
            |seed: &u8| checksum(&sound[at + 9..at + end], *seed) == sound[at + end..at + next];
        found.insert(number, (0..=255).find(fits).unwrap());
        at += next;
    }
    found
}

fn mend(bytes: &mut [u8], seeds: &HashMap<[u8; 3], u8>) {
    let mut at = 0;
    while at < bytes.len() {
        let Some((end, number, next)) = frame(&bytes[at..]) else {
            at += 1;
            continue;
        };
        if let Some(seed) = seeds.get(&number) {
            let right = checksum(&bytes[at + 9..at + end], *seed);
            bytes[at + end..at + next].copy_from_slice(&right);
        }
        at += next;
    }
}

#[test]
fn telemetry_logs() {
    let Some(made) = made("tlog") else { return };
    let seed = std::fs::read(made.file("seed.tlog")).unwrap();
    let seeds = seeds(&seed);
    // Zeros at the end of a payload are not sent.
    let limits = Limits { samples_per_byte: 8.0, ..Limits::default() };
    for stamp in [Stamp::Header, Stamp::Receive] {
        let options = ReadOptions { stamp, ..ReadOptions::default() };
        hammer("tlog", &seed, &options, limits, |bytes| mend(bytes, &seeds));
    }
}
