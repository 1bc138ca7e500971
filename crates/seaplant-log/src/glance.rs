//! Logs of parts of a file.

use crate::Log;

/// Amount of a file that a survey reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thoroughness {
    /// Files up to this size are read completely.
    pub whole_up_to: u64,
    /// Number of parts of a larger file, spread from its first byte to its last.
    pub parts: usize,
    /// Approximate size of a part.
    pub part_bytes: usize,
}

impl Default for Thoroughness {
    /// Chooses amounts that are read in an instant: 64 MiB completely, 8 MiB of parts.
    fn default() -> Self {
        Self { whole_up_to: 64 << 20, parts: 16, part_bytes: 512 << 10 }
    }
}

/// A log of parts of a file, and the reader's knowledge of the rest.
pub(crate) struct Glance {
    pub(crate) log: Log,
    pub(crate) parts: usize,
    pub(crate) bytes: u64,
    /// See [`Parts::pause_s`](crate::Parts::pause_s).
    pub(crate) pause_s: f64,
    /// True if the parts hold the first and the last record of every channel, whatever their times.
    pub(crate) has_ends: bool,
}

/// Returns half the time between two parts of a file that was written at an even rate, s; all parts
/// together are a `portion` of the file.
pub(crate) fn half_a_hole(log: &Log, parts: usize, portion: f64) -> f64 {
    let ends = log.channels.iter().filter_map(|c| Some((*c.time_s.first()?, *c.time_s.last()?)));
    let (from_s, to_s) = ends
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), (a, b)| (from.min(a), to.max(b)));
    0.5 * (to_s - from_s) * (1.0 - portion) / (parts.max(2) - 1) as f64
}
