//! Hashes the bytes of a file as they are read.

use std::io::{self, Read};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use sha2::{Digest, Sha256};

use crate::progress;

struct Raw {
    raw: Box<dyn Read + Send>,
    hash: Sha256,
    bytes: u64,
}

/// A file's bytes, counted and hashed as they are read; clones share them and continue where others
/// stopped.
#[derive(Clone)]
pub(crate) struct Hashed(Arc<Mutex<Raw>>);

impl Hashed {
    pub(crate) fn new(raw: Box<dyn Read + Send>) -> Self {
        Self(Arc::new(Mutex::new(Raw { raw, hash: Sha256::new(), bytes: 0 })))
    }

    /// Returns the number of bytes read so far.
    pub(crate) fn passed(&self) -> u64 {
        self.lock().bytes
    }

    /// Returns the SHA-256 of the bytes so far, in hexadecimal.
    pub(crate) fn sha256(&self) -> String {
        let digest = self.lock().hash.clone().finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn lock(&self) -> MutexGuard<'_, Raw> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Read for Hashed {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let mut raw = self.lock();
        let read = raw.raw.read(buffer)?;
        raw.hash.update(&buffer[..read]);
        raw.bytes += read as u64;
        progress::add_read(read as u64);
        Ok(read)
    }
}
