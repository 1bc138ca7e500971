//! A file seen through a window that moves from front to back.

use std::io::{self, Read, Seek, SeekFrom};

use crate::content::Seekable;

/// How much is read at once.
const STEP: usize = 1 << 18;

/// A file, of which a stretch is in memory.
pub(crate) struct Window {
    file: Seekable,
    length: u64,
    buffer: Vec<u8>,
    /// Where in the buffer the window starts, and where in the file.
    start: usize,
    at: u64,
}

impl Window {
    /// A window at the start of a file.
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

    /// Bytes from the window's start to the end of the file.
    pub(crate) fn left(&self) -> u64 {
        self.length.saturating_sub(self.at)
    }

    /// Moves anywhere.
    ///
    /// # Errors
    /// Those of seeking.
    pub(crate) fn go(&mut self, to: u64) -> io::Result<()> {
        self.at = self.file.seek(SeekFrom::Start(to))?;
        self.buffer.clear();
        self.start = 0;
        Ok(())
    }

    /// The next bytes, without moving: `count` of them, or fewer where the file ends.
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

    /// Moves ahead, to the end of the file at most.
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
