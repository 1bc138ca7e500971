//! Apache Arrow IPC files, which Feather version 2 files are.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like an Arrow file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"ARROW1")
}

/// Reads an Arrow file.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
