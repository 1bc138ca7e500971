//! A window over a stream with look-ahead, which accounts for damaged bytes.

use std::io::{self, Read};
use std::path::Path;

use crate::note::Note;

/// Number of bytes read at a time.
const CHUNK: usize = 1 << 20;

/// A position in a stream, and the bytes after it.
pub(crate) struct Window<R> {
    stream: R,
    /// Bytes read and not consumed are in `buffer[from..to]`.
    buffer: Vec<u8>,
    from: usize,
    to: usize,
    ended: bool,
    /// Number of bytes consumed.
    byte: u64,
    damage: Damage,
}

/// Unreadable stretches.
#[derive(Default)]
struct Damage {
    count: usize,
    first_byte: u64,
    bytes: u64,
    /// End of the last one.
    end: Option<u64>,
}

impl<R: Read> Window<R> {
    pub(crate) fn new(stream: R) -> Self {
        let (buffer, damage) = (vec![0; CHUNK], Damage::default());
        Self { stream, buffer, from: 0, to: 0, ended: false, byte: 0, damage }
    }

    /// Returns the bytes that follow: at least `count` unless the stream ends before, possibly many
    /// more.
    ///
    /// # Errors
    /// Those of the stream.
    pub(crate) fn ahead(&mut self, count: usize) -> io::Result<&[u8]> {
        debug_assert!(count <= CHUNK / 2, "a record is far shorter than what is read at a time");
        if self.to - self.from < count && !self.ended {
            self.buffer.copy_within(self.from..self.to, 0);
            self.to -= self.from;
            self.from = 0;
            while self.to < count && !self.ended {
                match self.stream.read(&mut self.buffer[self.to..]) {
                    Ok(0) => self.ended = true,
                    Ok(read) => self.to += read,
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(&self.buffer[self.from..self.to])
    }

    /// Consumes a record of `count` bytes, which must have been looked at.
    pub(crate) fn take(&mut self, count: usize) {
        self.from += count;
        self.byte += count as u64;
    }

    /// Skips `count` bytes that are no record.
    pub(crate) fn skip(&mut self, count: usize) {
        let damage = &mut self.damage;
        if damage.end != Some(self.byte) {
            damage.count += 1;
            if damage.count == 1 {
                damage.first_byte = self.byte;
            }
        }
        damage.bytes += count as u64;
        damage.end = Some(self.byte + count as u64);
        self.take(count);
    }

    /// Returns the position of the next byte.
    pub(crate) fn byte(&self) -> u64 {
        self.byte
    }

    /// Returns the note on the damage.
    pub(crate) fn note(&self, path: &Path) -> Option<Note> {
        let Damage { count, first_byte, bytes, .. } = self.damage;
        let path = path.to_owned();
        (count > 0).then_some(Note::CorruptRecords { path, count, first_byte, bytes })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream that yields a few bytes at a time.
    struct Drops(Vec<u8>);

    impl Read for Drops {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            let count = self.0.len().min(buffer.len()).min(3);
            buffer[..count].copy_from_slice(&self.0[..count]);
            self.0.drain(..count);
            Ok(count)
        }
    }

    #[test]
    fn bytes_are_looked_at_and_taken() {
        let mut window = Window::new(Drops((0..10).collect()));
        assert!(window.ahead(4).unwrap().starts_with(&[0, 1, 2, 3]));
        window.take(3);
        assert!(window.ahead(5).unwrap().starts_with(&[3, 4, 5, 6, 7]));
        window.take(5);
        assert_eq!(window.ahead(5).unwrap(), [8, 9]);
        assert_eq!(window.byte(), 8);
        assert!(window.note(Path::new("a")).is_none());
    }

    #[test]
    fn damage_side_by_side_is_one_stretch() {
        let mut window = Window::new(Drops((0..20).collect()));
        for (skip, count) in [(false, 2), (true, 1), (true, 3), (false, 1), (true, 2)] {
            window.ahead(count).unwrap();
            if skip { window.skip(count) } else { window.take(count) }
        }
        let note = window.note(Path::new("a.BIN")).unwrap();
        assert_eq!(
            note.to_string(),
            "a.BIN: 2 stretches are damaged, the first at byte 2; 6 bytes skipped"
        );
    }
}
