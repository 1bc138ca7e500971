//! Reads the index at the end of a ROS 1 bag, as far as a survey needs it.

use std::collections::HashMap;

use super::header::Header;
use crate::glance::Thoroughness;
use crate::readers::bytes::Bytes;
use crate::readers::ros::{Choice, Chunk, choose};

/// Chunks and message counts from the index of a complete bag.
#[derive(Default)]
pub(super) struct Index {
    /// Position of the index, and number of chunks.
    pub(super) at: u64,
    pub(super) count: u64,
    pub(super) chunks: Vec<Chunk>,
    /// Number of messages of each connection.
    pub(super) counts: HashMap<u32, u64>,
}

impl Index {
    /// Adds a chunk information record; `None` if it is invalid.
    pub(super) fn chunk(&mut self, header: Header<'_>, data: &[u8]) -> Option<()> {
        let time = |name| {
            let mut time = Bytes(header.field(name)?);
            Some(u64::from(time.u32()?) * 1_000_000_000 + u64::from(time.u32()?))
        };
        let (at, from_ns, to_ns) =
            (header.number("chunk_pos")?, time("start_time")?, time("end_time")?);
        let mut channels = Vec::new();
        let mut counts = Bytes(data);
        while let (Some(connection), Some(count)) = (counts.u32(), counts.u32()) {
            let all = self.counts.entry(connection).or_default();
            *all = all.saturating_add(count.into());
            channels.push(connection);
        }
        self.chunks.push(Chunk { at, bytes: 0, from_ns, to_ns, channels });
        Some(())
    }

    /// Chooses chunks for a survey, if the index covers all of them.
    pub(super) fn choose(&mut self, how: Thoroughness) -> Option<Choice> {
        if self.chunks.is_empty() || self.chunks.len() as u64 != self.count {
            return None;
        }
        self.chunks.sort_by_key(|chunk| chunk.at);
        let ends = self.chunks.iter().skip(1).map(|chunk| chunk.at).chain([self.at]);
        let ends: Vec<u64> = ends.collect();
        for (chunk, end) in self.chunks.iter_mut().zip(ends) {
            chunk.bytes = end.checked_sub(chunk.at)?;
        }
        choose(&self.chunks, how)
    }
}
