//! Excel workbooks.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like an Excel workbook.
pub(crate) fn recognises(head: &[u8]) -> bool {
    let holds = |name: &[u8]| head.windows(name.len()).any(|window| window == name);
    head.starts_with(b"PK\x03\x04") && (holds(b"[Content_Types].xml") || holds(b"xl/"))
}

/// Reads an Excel workbook.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
