//! Gzip archives of any log.

use flate2::bufread::MultiGzDecoder;

use crate::Error;
use crate::content::Content;

/// Returns whether bytes start like a gzip archive.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x1f\x8b")
}

/// Unpacks a gzip archive.
///
/// # Errors
/// As [`Content::unpack`].
pub(crate) fn unpack(content: Content) -> Result<Content, Error> {
    content.unpack("gzip", |packed| Ok(Box::new(MultiGzDecoder::new(packed))))
}
