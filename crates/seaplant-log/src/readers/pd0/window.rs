//! A sliding window over a stream.

use std::io::{self, Read};

/// Number of bytes read at once.
const CHUNK: usize = 256 * 1024;

/// Bytes of a stream from some position on.
pub(super) struct Window<R> {
    stream: R,
    bytes: Vec<u8>,
    /// Number of `bytes` that are consumed.
    passed: usize,
    /// Position of `bytes` in the stream.
    start: u64,
    ended: bool,
}

impl<R: Read> Window<R> {
    pub(super) fn new(stream: R) -> Self {
        Self { stream, bytes: Vec::new(), passed: 0, start: 0, ended: false }
    }

    /// Reads on until `count` bytes are available, or the stream ends.
    pub(super) fn fill(&mut self, count: usize) -> io::Result<()> {
        if self.ended || self.bytes().len() >= count {
            return Ok(());
        }
        self.bytes.drain(..self.passed);
        self.start += self.passed as u64;
        self.passed = 0;
        let wanted = CHUNK.max(count) as u64;
        let read = self.stream.by_ref().take(wanted).read_to_end(&mut self.bytes)?;
        self.ended = (read as u64) < wanted;
        Ok(())
    }

    /// Returns the available bytes.
    pub(super) fn bytes(&self) -> &[u8] {
        &self.bytes[self.passed..]
    }

    /// Returns the position of the first of them in the stream.
    pub(super) fn position(&self) -> u64 {
        self.start + self.passed as u64
    }

    /// Consumes the first `count` bytes.
    pub(super) fn pass(&mut self, count: usize) {
        self.passed += count;
    }
}
