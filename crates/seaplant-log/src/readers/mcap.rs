//! MCAP files: ROS 2 bags and others.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like an MCAP file.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"\x89MCAP")
}

/// Reads an MCAP file.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
