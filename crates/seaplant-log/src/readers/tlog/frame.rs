//! Parses frames: the time of receipt, a header, a payload, a checksum.

use super::messages::{Message, find};

/// Length of the time of receipt.
const STAMP: usize = 8;
/// Maximum length of a stamp, a version 2 header, a payload, a checksum and a signature, and the
/// start of the next frame.
pub(super) const LONGEST: usize = STAMP + 10 + PAYLOAD + 2 + 13 + STAMP + 1;
/// Maximum length of a payload.
const PAYLOAD: usize = 255;
const VERSION_1: u8 = 0xfe;
const VERSION_2: u8 = 0xfd;

/// Content that follows.
pub(super) enum Next<'a> {
    Frame(Frame<'a>),
    /// A frame of an unknown message: its number, and the frame's length.
    Unknown(u32, usize),
    /// Bytes that are no frame, this many.
    Damage(usize),
    /// A frame that the end of the file truncates.
    Cut,
    End,
}

/// A frame with a valid checksum.
pub(super) struct Frame<'a> {
    pub(super) length: usize,
    /// Time of receipt, in microseconds since the Unix epoch.
    pub(super) stamp_us: u64,
    pub(super) sender: Sender,
    pub(super) message: &'static Message,
    /// Payload, possibly without its trailing zeros.
    pub(super) payload: &'a [u8],
}

/// System and component numbers.
pub(super) type Sender = [u8; 2];

/// Positions in a frame, before its checksum is verified.
struct Parts {
    number: u32,
    sender: Sender,
    /// Range of the payload, and end of the frame.
    payload: [usize; 2],
    end: usize,
}

/// Parses what the bytes start with.
pub(super) fn next(ahead: &[u8]) -> Next<'_> {
    if ahead.is_empty() {
        return Next::End;
    }
    let damage = || Next::Damage(1 + to_start(&ahead[1..]));
    if !may_start(ahead) {
        return damage();
    }
    let Some(parts) = parts(ahead) else { return Next::Cut };
    if parts.end > ahead.len() {
        return Next::Cut;
    }
    let [from, to] = parts.payload;
    let Some(message) = find(parts.number) else {
        // Its checksum cannot be verified, but the next frame can.
        let followed = ahead.len() == parts.end || may_start(&ahead[parts.end..]);
        return if followed { Next::Unknown(parts.number, parts.end) } else { damage() };
    };
    let checksum = seal(seal(!0, &ahead[STAMP + 1..to]), &[message.seed]);
    if ahead[to..to + 2] != checksum.to_le_bytes() {
        return damage();
    }
    let stamp = ahead.first_chunk().map_or(0, |bytes| u64::from_be_bytes(*bytes));
    let (length, sender, payload) = (parts.end, parts.sender, &ahead[from..to]);
    Next::Frame(Frame { length, stamp_us: stamp, sender, message, payload })
}

/// Returns the positions in a frame; `None` if its header is truncated.
fn parts(ahead: &[u8]) -> Option<Parts> {
    /// Flag of a signed frame.
    const SIGNED: u8 = 1;
    match *ahead.get(STAMP..)? {
        [VERSION_1, size, _, system, component, number, ..] => {
            let from = STAMP + 6;
            let to = from + usize::from(size);
            let (sender, number) = ([system, component], number.into());
            Some(Parts { number, sender, payload: [from, to], end: to + 2 })
        }
        [VERSION_2, size, flags, _, _, system, component, low, middle, high, ..] => {
            let from = STAMP + 10;
            let to = from + usize::from(size);
            let signature = if flags & SIGNED == SIGNED { 13 } else { 0 };
            let number = u32::from_le_bytes([low, middle, high, 0]);
            let end = to + 2 + signature;
            Some(Parts { number, sender: [system, component], payload: [from, to], end })
        }
        _ => None,
    }
}

/// Returns whether bytes, as far as available, may start a frame: until eight centuries after the
/// epoch, a stamp starts with 0.
pub(super) fn may_start(bytes: &[u8]) -> bool {
    let mark = bytes.get(STAMP).is_none_or(|mark| [VERSION_1, VERSION_2].contains(mark));
    bytes.first() == Some(&0) && mark
}

/// Returns the distance to the next possible start of a frame.
fn to_start(bytes: &[u8]) -> usize {
    (0..bytes.len()).find(|at| may_start(&bytes[*at..])).unwrap_or(bytes.len())
}

/// Computes CRC-16/MCRF4XX, a byte at a time.
fn seal(start: u16, bytes: &[u8]) -> u16 {
    let step = |crc: u16, byte: &u8| crc >> 8 ^ STEPS[usize::from((crc as u8) ^ byte)];
    bytes.iter().fold(start, step)
}

const STEPS: [u16; 256] = {
    let mut steps = [0; 256];
    let mut k = 0;
    while k < 256 {
        let mut crc = k as u16;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 { crc >> 1 ^ 0x8408 } else { crc >> 1 };
            bit += 1;
        }
        steps[k] = crc;
        k += 1;
    }
    steps
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_the_catalogue() {
        // G. Cook's catalogue of CRC algorithms: CRC-16/MCRF4XX of "123456789".
        assert_eq!(seal(!0, b"123456789"), 0x6f91);
    }
}
