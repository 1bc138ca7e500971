//! How far the reading of files got, for a program that shows it.

use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes of log files, counted since the program started.
///
/// Formats that are read here and there pass twice: once to be read, once to be hashed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Progress {
    /// Those that were read.
    pub read: u64,
    /// Those of all files that were opened.
    pub of: u64,
}

static READ: AtomicU64 = AtomicU64::new(0);
static OF: AtomicU64 = AtomicU64::new(0);

/// How far the reading of all files of this process got.
pub fn progress() -> Progress {
    Progress { read: READ.load(Ordering::Relaxed), of: OF.load(Ordering::Relaxed) }
}

/// Forgets what was read and opened since: it is read again, as a whole.
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
