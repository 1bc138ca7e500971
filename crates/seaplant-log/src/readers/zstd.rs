//! Zstandard archives of any log.

use zstd::stream::read::Decoder;

use crate::Error;
use crate::content::Content;

/// Returns whether bytes start like a zstd archive.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x28\xb5\x2f\xfd")
}

/// Unpacks a zstd archive.
///
/// # Errors
/// As [`Content::unpack`].
pub(crate) fn unpack(content: Content) -> Result<Content, Error> {
    content.unpack("zstd", |packed| Ok(Box::new(Decoder::with_buffer(packed)?)))
}
