//! Parts of a file that is read from front to back, cut where its records end.

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use crate::Error;
use crate::content::Content;
use crate::format::Format;
use crate::note::Note;
use crate::readers::{dataflash, pd0, tlog};
use crate::survey::Thoroughness;

/// Parts of a file, in order, the first of which starts it and the last of which ends it.
pub(crate) struct Excerpt {
    /// Where each of them is, in bytes.
    pub(crate) pieces: Vec<Range<u64>>,
    /// The bytes of the file.
    pub(crate) size: u64,
    /// Lines in the first piece of a text.
    lines: u64,
}

impl Excerpt {
    /// The bytes of all pieces.
    pub(crate) fn length(&self) -> u64 {
        self.pieces.iter().map(|piece| piece.end - piece.start).sum()
    }

    /// Where in the file a byte of the excerpt is.
    fn byte(&self, mut byte: u64) -> u64 {
        for piece in &self.pieces {
            let length = piece.end - piece.start;
            if byte < length {
                return piece.start + byte;
            }
            byte -= length;
        }
        self.size
    }

    /// A note on the excerpt as one on the file: a line behind the first piece cannot be told.
    pub(crate) fn place(&self, mut note: Note) -> Note {
        if let Note::Truncated { byte, .. } = &mut note {
            *byte = self.byte(*byte);
        }
        match note.line() {
            Some(line) if line > self.lines => Note::InPart(Box::new(note)),
            _ => note,
        }
    }
}

/// Finds parts of a file that can be read by the reader of the whole; `None` where they cannot be
/// told to be whole records.
///
/// # Errors
/// [`Error::Io`].
pub(crate) fn of(
    content: &Content,
    format: Format,
    how: Thoroughness,
) -> Result<Option<Excerpt>, Error> {
    let Some(size) = content.file_length() else { return Ok(None) };
    let part = how.part_bytes as u64;
    let count = how.parts.max(2) as u64;
    if size < part.saturating_mul(count + 1) {
        return Ok(None);
    }
    let failed = |error| Error::io(content.path(), error);
    let mut file = std::fs::File::open(content.path()).map_err(failed)?;
    let mut bytes = vec![0; how.part_bytes];
    let mut framing = None;
    let mut excerpt = Excerpt { pieces: Vec::new(), size, lines: 0 };
    for k in 0..count {
        let start = (u128::from(size - part) * u128::from(k) / u128::from(count - 1)) as u64;
        file.seek(SeekFrom::Start(start)).map_err(failed)?;
        file.read_exact(&mut bytes).map_err(failed)?;
        let framing = framing.get_or_insert_with(|| Framing::of(format, &bytes));
        let Some(whole) = framing.as_ref().and_then(|framing| framing.records(&bytes, k == 0))
        else {
            return Ok(None);
        };
        let end = if k + 1 == count { size } else { start + whole.end as u64 };
        excerpt.pieces.push(start + whole.start as u64..end);
        if k == 0 {
            excerpt.lines = bytes[whole].iter().filter(|&&byte| byte == b'\n').count() as u64;
        }
    }
    Ok(Some(excerpt))
}

/// What parts records.
enum Framing {
    /// The end of a line.
    Lines,
    /// The length of the record that bytes start with.
    Records(Box<Length>),
}

/// The length of the record that bytes start with; `None` where they start with none.
type Length = dyn Fn(&[u8]) -> Option<usize>;

impl Framing {
    /// How a file of a format is framed that starts with `head`.
    fn of(format: Format, head: &[u8]) -> Option<Self> {
        match format {
            Format::Text if encoding_rs::Encoding::for_bom(head).is_none() => Some(Self::Lines),
            Format::DataFlash => Some(Self::Records(Box::new(dataflash::framing(head)?))),
            Format::Tlog => Some(Self::Records(Box::new(tlog::record_length))),
            Format::Pd0 => Some(Self::Records(Box::new(pd0::record_length))),
            _ => None,
        }
    }

    /// The whole records within bytes, which start with one if they are the `first` of the file.
    fn records(&self, bytes: &[u8], first: bool) -> Option<Range<usize>> {
        match self {
            Self::Lines => lines(bytes, first),
            Self::Records(length) => {
                let found = records(bytes, length)?;
                Some(if first { 0..found.end } else { found })
            }
        }
    }
}

/// The whole lines within bytes, unless a quoted cell may run over several.
fn lines(bytes: &[u8], first: bool) -> Option<Range<usize>> {
    let end = 1 + bytes.iter().rposition(|&byte| byte == b'\n')?;
    let start = if first { 0 } else { 1 + bytes.iter().position(|&byte| byte == b'\n')? };
    let rows = bytes.get(start..end).filter(|rows| !rows.is_empty())?;
    let paired = |line: &[u8]| line.iter().filter(|&&byte| byte == b'"').count() % 2 == 0;
    rows.split(|&byte| byte == b'\n').all(paired).then_some(start..end)
}

/// The whole records within bytes, from the first of a row of several that follow each other: one
/// alone may be chance.
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
            // Damage: the reader tells of it.
            None => at += 1,
        }
    }
    Some(start..end)
}

/// What reads the pieces one after the other.
pub(crate) fn stream(path: &Path, excerpt: &Excerpt) -> std::io::Result<Box<dyn Read + Send>> {
    let mut all: Box<dyn Read + Send> = Box::new(std::io::empty());
    for piece in &excerpt.pieces {
        let mut file = std::fs::File::open(path)?;
        file.seek(SeekFrom::Start(piece.start))?;
        all = Box::new(all.chain(file.take(piece.end - piece.start)));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records of 0xaa, their length, and as many bytes more as it says.
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

    #[test]
    fn bytes_of_the_excerpt_are_found_in_the_file() {
        let excerpt = Excerpt { pieces: vec![0..10, 50..60, 90..100], size: 100, lines: 0 };
        let places = [0, 9, 10, 19, 20, 29, 30].map(|byte| excerpt.byte(byte));
        assert_eq!(places, [0, 9, 50, 59, 90, 99, 100]);
        assert_eq!(excerpt.length(), 30);
    }
}
