//! Excerpts of a file that is read from front to back, cut at record boundaries.

use std::io::{Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;

use crate::Error;
use crate::content::Content;
use crate::framing::Frame;
use crate::glance::Thoroughness;
use crate::note::Note;

/// Pieces of a file, in order; the first starts the file and the last ends it.
pub(crate) struct Excerpt {
    /// Byte range of each piece.
    pub(crate) pieces: Vec<Range<u64>>,
    /// Size of the file in bytes.
    pub(crate) size: u64,
    /// Number of lines in the first piece of a text.
    lines: u64,
}

impl Excerpt {
    /// Returns the number of bytes in all pieces.
    pub(crate) fn length(&self) -> u64 {
        self.pieces.iter().map(|piece| piece.end - piece.start).sum()
    }

    /// Converts a byte position in the excerpt to one in the file.
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

    /// Converts a note on the excerpt to one on the file: a line after the first piece has no known
    /// number.
    pub(crate) fn place(&self, mut note: Note) -> Note {
        if let Note::Truncated { byte, .. } = &mut note {
            *byte = self.byte(*byte);
        }
        match note.line() {
            Some(line) if line > self.lines => Note::InPart(Box::new(note)),
            _ => note,
        }
    }

    /// Returns the pieces one after the other, in place of the file.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub(crate) fn content(&self, whole: Content) -> Result<Content, Error> {
        let path = whole.path().to_owned();
        let pieces = self.stream(&path).map_err(|error| Error::io(&path, error))?;
        whole.in_part(pieces, self.size)
    }

    fn stream(&self, path: &Path) -> std::io::Result<Box<dyn Read + Send>> {
        let mut all: Box<dyn Read + Send> = Box::new(std::io::empty());
        for piece in &self.pieces {
            let mut file = std::fs::File::open(path)?;
            file.seek(SeekFrom::Start(piece.start))?;
            all = Box::new(all.chain(file.take(piece.end - piece.start)));
        }
        Ok(all)
    }
}

/// Finds pieces of a file that the file's reader can read; `None` where they cannot be shown to be
/// complete records.
///
/// # Errors
/// [`Error::Io`].
pub(crate) fn choose(
    content: &Content,
    frame: Frame,
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
        let framing = framing.get_or_insert_with(|| frame(&bytes));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_the_excerpt_are_found_in_the_file() {
        let excerpt = Excerpt { pieces: vec![0..10, 50..60, 90..100], size: 100, lines: 0 };
        let places = [0, 9, 10, 19, 20, 29, 30].map(|byte| excerpt.byte(byte));
        assert_eq!(places, [0, 9, 50, 59, 90, 99, 100]);
        assert_eq!(excerpt.length(), 30);
    }
}
