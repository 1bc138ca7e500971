//! Teledyne RDI PD0 files.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a PD0 file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x7f\x7f")
}

/// Reads a PD0 file.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
