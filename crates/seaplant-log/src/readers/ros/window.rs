//! A window that moves over a file from front to back.

use std::io::{self, Read, Seek, SeekFrom};

use crate::content::Seekable;

/// Number of bytes read at once.
const STEP: usize = 1 << 18;

/// A file with one stretch in memory.
pub(crate) struct Window {
    file: Seekable,
    length: u64,
    buffer: Vec<u8>,
    /// Start of the window in the buffer and in the file.
    start: usize,
    at: u64,
}

impl Window {
    /// Opens a window at the start of a file.
    ///
    /// # Errors
    /// Those of seeking.
    pub(crate) fn new(mut file: Seekable) -> io::Result<Self> {
        let length = file.seek(SeekFrom::End(0))?;
        let mut window = Self { file, length, buffer: Vec::new(), start: 0, at: 0 };
        window.go(0)?;
        Ok(window)
    }

    pub(crate) fn at(&self) -> u64 {
        self.at
    }

    /// Returns the number of bytes from the window's start to the end of the file.
    pub(crate) fn left(&self) -> u64 {
        self.length.saturating_sub(self.at)
    }

    /// Moves to any position.
    ///
    /// # Errors
    /// Those of seeking.
    pub(crate) fn go(&mut self, to: u64) -> io::Result<()> {
        self.at = self.file.seek(SeekFrom::Start(to))?;
        self.buffer.clear();
        self.start = 0;
        Ok(())
    }

    /// Returns the next `count` bytes without moving, or fewer at the end of the file.
    ///
    /// # Errors
    /// Those of reading.
    pub(crate) fn look(&mut self, count: u64) -> io::Result<&[u8]> {
        let count = count.min(self.left()) as usize;
        let held = self.buffer.len() - self.start;
        if held < count {
            self.buffer.drain(..self.start);
            self.start = 0;
            let more = (count - held).max(STEP) as u64;
            (&mut self.file).take(more).read_to_end(&mut self.buffer)?;
        }
        let end = self.buffer.len().min(self.start + count);
        Ok(&self.buffer[self.start..end])
    }

    /// Moves ahead, but not past the end of the file.
    ///
    /// # Errors
    /// Those of seeking.
    pub(crate) fn skip(&mut self, count: u64) -> io::Result<()> {
        let count = count.min(self.left());
        if count <= (self.buffer.len() - self.start) as u64 {
            self.start += count as usize;
            self.at += count;
            return Ok(());
        }
        self.go(self.at + count)
    }
}
