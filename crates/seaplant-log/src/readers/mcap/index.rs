//! Reads the summary at the end of an MCAP file, as far as a survey needs it.

use std::collections::{HashMap, HashSet};

use crate::glance::Thoroughness;
use crate::readers::bytes::Bytes;
use crate::readers::ros::{Choice, Chunk, choose};

/// Chunks and message counts from the summary.
#[derive(Default)]
pub(super) struct Index {
    pub(super) chunks: Vec<Chunk>,
    /// Number of messages of each channel.
    pub(super) counts: HashMap<u16, u64>,
    /// Number of chunks and of messages in the file.
    totals: Option<(u32, u64)>,
}

impl Index {
    /// Adds a chunk index record; `None` if it is invalid.
    pub(super) fn chunk(&mut self, record: &[u8]) -> Option<()> {
        let mut bytes = Bytes(record);
        let (from_ns, to_ns) = (bytes.u64()?, bytes.u64()?);
        let (at, length) = (bytes.u64()?, bytes.u64()?);
        let size = bytes.u32()? as usize;
        let mut offsets = Bytes(bytes.take(size)?);
        let mut channels = Vec::new();
        while let Some(channel) = offsets.u16() {
            offsets.u64()?;
            channels.push(channel.into());
        }
        self.chunks.push(Chunk { at, bytes: length, from_ns, to_ns, channels });
        Some(())
    }

    /// Reads the statistics record; `None` if it is invalid.
    pub(super) fn count(&mut self, record: &[u8]) -> Option<()> {
        let mut bytes = Bytes(record);
        let messages = bytes.u64()?;
        bytes.take(2 + 4 + 4 + 4)?;
        let chunks = bytes.u32()?;
        bytes.take(16)?;
        let size = bytes.u32()? as usize;
        let mut counts = Bytes(bytes.take(size)?);
        while let Some(channel) = counts.u16() {
            self.counts.insert(channel, counts.u64()?);
        }
        self.totals = Some((chunks, messages));
        Some(())
    }

    /// Chooses chunks for a survey, if chunks hold all messages of the file, whose size is
    /// `length`.
    pub(super) fn choose(&mut self, length: u64, how: Thoroughness) -> Option<Choice> {
        self.chunks.sort_by_key(|chunk| chunk.at);
        let (chunks, messages) = self.totals?;
        let apart =
            self.chunks.windows(2).all(|w| w[0].at.checked_add(w[0].bytes) <= Some(w[1].at));
        let last = self.chunks.last()?;
        let inside = last.at.checked_add(last.bytes)? <= length;
        let counted = self.counts.values().try_fold(0_u64, |sum, count| sum.checked_add(*count))?;
        let in_chunks: HashSet<u32> =
            self.chunks.iter().flat_map(|c| &c.channels).copied().collect();
        let all = self
            .counts
            .iter()
            .all(|(channel, count)| *count == 0 || in_chunks.contains(&u32::from(*channel)));
        let whole = chunks as usize == self.chunks.len() && counted == messages;
        (apart && inside && whole && all).then(|| choose(&self.chunks, how))?
    }
}
