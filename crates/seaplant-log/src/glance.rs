//! Logs of parts of a file.

use crate::Log;

/// How much of a file a survey reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thoroughness {
    /// Files up to so many bytes are read whole.
    pub whole_up_to: u64,
    /// How many parts of a larger one are read, spread from its first byte to its last.
    pub parts: usize,
    /// How many bytes each of them has, about.
    pub part_bytes: usize,
}

impl Default for Thoroughness {
    /// What takes a blink: 64 MiB whole, 8 MiB of parts.
    fn default() -> Self {
        Self { whole_up_to: 64 << 20, parts: 16, part_bytes: 512 << 10 }
    }
}

/// A log of parts of a file, and what its reader knows of the rest.
pub(crate) struct Glance {
    pub(crate) log: Log,
    pub(crate) parts: usize,
    pub(crate) bytes: u64,
    /// See [`Parts::pause_s`](crate::Parts::pause_s).
    pub(crate) pause_s: f64,
    /// Whether the parts hold the first and the last record of every channel, whenever these are.
    pub(crate) has_ends: bool,
}

/// Half the time between two of so many parts of a file that was written at an even rate, s; all
/// parts together are a `portion` of it.
pub(crate) fn half_a_hole(log: &Log, parts: usize, portion: f64) -> f64 {
    let ends = log.channels.iter().filter_map(|c| Some((*c.time_s.first()?, *c.time_s.last()?)));
    let (from_s, to_s) = ends
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(from, to), (a, b)| (from.min(a), to.max(b)));
    0.5 * (to_s - from_s) * (1.0 - portion) / (parts.max(2) - 1) as f64
}
