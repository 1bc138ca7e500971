//! Finds record boundaries among bytes from anywhere in a file.

use std::ops::Range;

/// Separation of records.
pub(crate) enum Framing {
    /// By the end of a line.
    Lines,
    /// By the length of the record that the bytes start with.
    Records(Box<Length>),
}

/// Returns the length of the record that the bytes start with; `None` if they start with no record.
pub(crate) type Length = dyn Fn(&[u8]) -> Option<usize>;

/// Determines from the first bytes of a file how its records are framed.
pub(crate) type Frame = fn(&[u8]) -> Option<Framing>;

impl Framing {
    /// Returns the range of complete records within bytes, which start with a record if they are
    /// the `first` of the file.
    pub(crate) fn records(&self, bytes: &[u8], first: bool) -> Option<Range<usize>> {
        match self {
            Self::Lines => lines(bytes, first),
            Self::Records(length) => {
                let found = records(bytes, length)?;
                Some(if first { 0..found.end } else { found })
            }
        }
    }
}

/// Returns the range of complete lines within bytes, unless a quoted cell may span several.
fn lines(bytes: &[u8], first: bool) -> Option<Range<usize>> {
    let end = 1 + bytes.iter().rposition(|&byte| byte == b'\n')?;
    let start = if first { 0 } else { 1 + bytes.iter().position(|&byte| byte == b'\n')? };
    let rows = bytes.get(start..end).filter(|rows| !rows.is_empty())?;
    let paired = |line: &[u8]| line.iter().filter(|&&byte| byte == b'"').count() % 2 == 0;
    rows.split(|&byte| byte == b'\n').all(paired).then_some(start..end)
}

/// Returns the range of complete records within bytes, from the first of several consecutive ones:
/// a single one may be chance.
fn records(bytes: &[u8], length: impl Fn(&[u8]) -> Option<usize>) -> Option<Range<usize>> {
    const ROW: usize = 8;
    let follows = |start: &usize| {
        let step = |at: usize| Some(at + length(&bytes[at..])?);
        (0..ROW).try_fold(*start, |at, _| step(at)).is_some()
    };
    let start = (0..bytes.len()).find(follows)?;
    let (mut at, mut end) = (start, start);
    while at < bytes.len() {
        match length(&bytes[at..]) {
            Some(length) => {
                at += length;
                end = at;
            }
            // Damage: the reader reports it.
            None => at += 1,
        }
    }
    Some(start..end)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the length of a record that starts with 0xaa and its length.
    fn length(bytes: &[u8]) -> Option<usize> {
        let length = 2 + usize::from(*bytes.get(1)?);
        (bytes[0] == 0xaa && length <= bytes.len()).then_some(length)
    }

    #[test]
    fn records_that_are_cut_are_left_out_at_both_ends() {
        let record = [0xaa, 3, 1, 2, 3];
        let mut bytes = record[2..].to_vec();
        for _ in 0..9 {
            bytes.extend(record);
        }
        bytes.extend(&record[..4]);
        assert_eq!(records(&bytes, length), Some(3..48));
        assert_eq!(records(&bytes[..30], length), None, "too few to be sure");
    }

    #[test]
    fn lines_that_are_cut_are_left_out() {
        assert_eq!(lines(b"5,6\n7,8\n9,1", false), Some(4..8));
        assert_eq!(lines(b"t,u\n7,8\n9,1", true), Some(0..8));
        assert_eq!(lines(b"7,8", false), None);
        assert_eq!(lines(b"7\n8,\"a\nb\",9\n1\n", false), None);
    }
}
