//! MAVLink telemetry logs.

use crate::content::Content;
use crate::{Error, Log, ReadOptions, format};

/// Whether bytes start like a MAVLink telemetry log.
pub(crate) fn recognises(head: &[u8]) -> bool {
    // Eight bytes of time, then a start mark.
    head.len() > 8 && head[0] == 0 && matches!(head[8], 0xfe | 0xfd)
}

/// Reads a MAVLink telemetry log.
pub(crate) fn read(content: Content, _options: &ReadOptions) -> Result<Log, Error> {
    Err(format::unsupported(&content))
}
