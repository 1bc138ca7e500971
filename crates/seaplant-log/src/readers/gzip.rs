//! Gzip archives of any log.

use flate2::bufread::MultiGzDecoder;

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a gzip archive.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x1f\x8b")
}

/// What a gzip archive holds.
///
/// # Errors
/// As [`Content::unpack`].
pub(crate) fn unpack(content: Content) -> Result<Content, Error> {
    content.unpack("gzip", |packed| Ok(Box::new(MultiGzDecoder::new(packed))))
}

/// Reads the log in a gzip archive.
///
/// # Errors
/// Those of [`unpack`], and of the format within.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    format::read(unpack(content)?, options)
}
