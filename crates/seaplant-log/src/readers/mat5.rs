//! MATLAB files up to version 7.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a MATLAB file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"MATLAB 5.0")
}

/// Reads a MATLAB file.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
