//! SQLite databases: ROS 2 bags.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like an SQLite database.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"SQLite format 3")
}

/// Reads an SQLite database.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
