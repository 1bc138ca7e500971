//! ROS 1 bags.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a ROS 1 bag.
pub(crate) fn recognises(head: &[u8]) -> bool {
    head.starts_with(b"#ROSBAG")
}

/// Reads a ROS 1 bag.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
