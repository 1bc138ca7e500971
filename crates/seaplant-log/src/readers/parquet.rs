//! Apache Parquet files.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a Parquet file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"PAR1")
}

/// Reads a Parquet file.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
