//! ArduPilot DataFlash logs.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a DataFlash log.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\xa3\x95\x80")
}

/// Reads a DataFlash log.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
