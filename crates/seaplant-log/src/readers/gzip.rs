//! Gzip archives of any log.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a gzip archive.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x1f\x8b")
}

/// Reads a gzip archive.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
