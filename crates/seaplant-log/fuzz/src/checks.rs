//! Code shared by the fuzzer and the robustness tests: checksum repair, and invariants of every log
//! that was read.

use seaplant_log::Channel;

/// Recomputes the checksums of formats that have one for each record, so that damage reaches the
/// decoder.
pub fn mend(bytes: &mut [u8]) {
    match bytes {
        [0x7f, 0x7f, ..] => mend_ensembles(bytes),
        [_, _, _, _, _, _, _, _, 0xfd | 0xfe, ..] => mend_frames(bytes),
        _ => mend_sentences(bytes),
    }
}

/// Recomputes the checksum of each complete PD0 ensemble.
fn mend_ensembles(bytes: &mut [u8]) {
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

/// Recomputes the checksum of each NMEA 0183 sentence that has one.
fn mend_sentences(bytes: &mut [u8]) {
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

/// Recomputes the checksum of each MAVLink frame whose message is known.
fn mend_frames(bytes: &mut [u8]) {
    let mut at = 0;
    while at < bytes.len() {
        let Some((number, end)) = frame(&bytes[at..]) else {
            at += 1;
            continue;
        };
        if let Some(seed) = seed(number) {
            let right = crc_16_mcrf4xx(&bytes[at + 9..at + end], seed);
            bytes[at + end..at + end + 2].copy_from_slice(&right);
        }
        at += end + 2;
    }
}

/// Returns the message number of a frame and the index of its checksum, if a frame starts here.
fn frame(bytes: &[u8]) -> Option<(u32, usize)> {
    let (header, number) = match *bytes.get(8)? {
        0xfe => (6, u32::from(*bytes.get(13)?)),
        0xfd => {
            let three: [u8; 3] = bytes.get(15..18)?.try_into().ok()?;
            (10, u32::from_le_bytes([three[0], three[1], three[2], 0]))
        }
        _ => return None,
    };
    let end = 8 + header + usize::from(*bytes.get(9)?);
    (end + 2 <= bytes.len()).then_some((number, end))
}

/// Returns the seed byte of a message's checksum, from the reader's table.
fn seed(number: u32) -> Option<u8> {
    const TABLE: &str = include_str!("../../src/readers/tlog/messages.txt");
    let line = TABLE
        .lines()
        .find(|line| line.split_once(' ').is_some_and(|(first, _)| first.parse() == Ok(number)))?;
    line.split(' ').nth(2)?.parse().ok()
}

/// Computes CRC-16/MCRF4XX bit by bit.
fn crc_16_mcrf4xx(bytes: &[u8], seed: u8) -> [u8; 2] {
    let mut crc = !0u16;
    for byte in bytes.iter().chain([&seed]) {
        crc ^= u16::from(*byte);
        for _ in 0..8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0x8408 } else { crc >> 1 };
        }
    }
    crc.to_le_bytes()
}

/// Checks that the channels of a log hold numbers at increasing times.
///
/// # Errors
/// Which channel does not, in words.
pub fn channels_are_sound(channels: &[Channel]) -> Result<(), String> {
    for channel in channels {
        let (time_s, values) = (channel.time_s(), channel.values());
        let finite = time_s.iter().chain(values).all(|x| x.is_finite());
        let increasing = time_s.windows(2).all(|w| w[0] < w[1]);
        if !finite || !increasing || time_s.len() != values.len() || values.is_empty() {
            return Err(format!("channel {:?} is not in order", channel.column));
        }
    }
    Ok(())
}
