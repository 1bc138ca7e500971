//! Progress of reading files, for a program that displays it.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of log files, counted since the program started.
///
/// Formats with random access are counted twice: once when read, once when hashed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// Bytes read.
    pub read: u64,
    /// Bytes of all files that were opened.
    pub of: u64,
}

static READ: AtomicU64 = AtomicU64::new(0);
static OF: AtomicU64 = AtomicU64::new(0);

/// Returns the progress of reading all files of this process.
pub fn progress() -> Progress {
    Progress { read: READ.load(Ordering::Relaxed), of: OF.load(Ordering::Relaxed) }
}

/// Resets the progress to `since`: what was read since then is read again completely.
pub(crate) fn take_back(since: Progress) {
    let now = progress();
    READ.fetch_sub(now.read - since.read, Ordering::Relaxed);
    OF.fetch_sub(now.of - since.of, Ordering::Relaxed);
}

pub(crate) fn add_read(bytes: u64) {
    READ.fetch_add(bytes, Ordering::Relaxed);
}

pub(crate) fn add_opened(bytes: u64) {
    OF.fetch_add(bytes, Ordering::Relaxed);
}
