//! HDF5 files: MATLAB 7.3 and others.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like an HDF5 file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x89HDF") || head.starts_with(b"MATLAB 7.3")
}

/// Reads an HDF5 file.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
