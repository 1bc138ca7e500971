//! Unpacks archives as far as possible.

use std::io::{self, Read};
use std::sync::{Arc, Mutex, PoisonError};

use crate::error::TooMuch;
use crate::hashed::Hashed;

/// Number of bytes that any archive may hold, however small.
const ALWAYS: u64 = 16 << 20;
/// Maximum compression ratio: tables compress to a tenth, zeros to a thousandth.
const TIMES: u64 = 200;

/// Returns the maximum plausible unpacked size of this many packed bytes.
pub(crate) fn limit(packed: u64) -> u64 {
    ALWAYS.saturating_add(packed.saturating_mul(TIMES))
}

/// Outcome of unpacking, shared with readers.
pub(crate) struct Unpacking {
    packing: &'static str,
    cut: Mutex<Option<(u64, String)>>,
}

impl Unpacking {
    /// Returns the kind of archive: "gzip".
    pub(crate) fn packing(&self) -> &'static str {
        self.packing
    }

    /// Returns the position in the content at which it was truncated or damaged, and the reason.
    pub(crate) fn cut(&self) -> Option<(u64, String)> {
        self.cut.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Content of an archive; damage ends it and is recorded.
pub(crate) struct Unpacked {
    unpacker: Option<Box<dyn Read + Send>>,
    raw: Hashed,
    bytes: u64,
    state: Arc<Unpacking>,
}

impl Unpacked {
    pub(crate) fn new(
        packing: &'static str,
        raw: Hashed,
        unpacker: io::Result<Box<dyn Read + Send>>,
    ) -> (Self, Arc<Unpacking>) {
        let state = Arc::new(Unpacking { packing, cut: Mutex::new(None) });
        let mut unpacked = Self { unpacker: None, raw, bytes: 0, state: Arc::clone(&state) };
        match unpacker {
            Ok(unpacker) => unpacked.unpacker = Some(unpacker),
            Err(error) => unpacked.end(&error),
        }
        (unpacked, state)
    }

    fn end(&mut self, error: &io::Error) {
        self.unpacker = None;
        let reason = match error.kind() {
            io::ErrorKind::UnexpectedEof => "is cut off".to_owned(),
            _ => format!("is damaged ({error})"),
        };
        let mut cut = self.state.cut.lock().unwrap_or_else(PoisonError::into_inner);
        *cut = Some((self.bytes, reason));
    }
}

impl Read for Unpacked {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(unpacker) = &mut self.unpacker else { return Ok(0) };
        let read = match unpacker.read(buffer) {
            Ok(read) => read,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => return Err(error),
            // The error is that of an inner archive, or of the disk.
            Err(error) if is_too_much(&error) || error.raw_os_error().is_some() => {
                return Err(error);
            }
            Err(error) => {
                self.end(&error);
                return Ok(0);
            }
        };
        self.bytes += read as u64;
        let packed = self.raw.passed();
        if self.bytes > limit(packed) {
            return Err(io::Error::other(TooMuch { unpacked: self.bytes, packed }));
        }
        Ok(read)
    }
}

fn is_too_much(error: &io::Error) -> bool {
    error.get_ref().is_some_and(|inner| inner.is::<TooMuch>())
}
