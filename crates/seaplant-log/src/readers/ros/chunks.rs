//! Chooses the chunks of a bag that a survey reads.

use std::collections::{BTreeMap, BTreeSet};

use crate::glance::Thoroughness;

/// A chunk in the index of a bag.
pub(crate) struct Chunk {
    /// Position and length of its record, bytes.
    pub(crate) at: u64,
    pub(crate) bytes: u64,
    /// First and last time of receipt in it, ns.
    pub(crate) from_ns: u64,
    pub(crate) to_ns: u64,
    /// Channels or connections with messages in it.
    pub(crate) channels: Vec<u32>,
}

/// The chunks to be read.
pub(crate) struct Choice {
    /// Their indices among all, in order.
    pub(crate) places: Vec<usize>,
    pub(crate) bytes: u64,
    /// Half the shortest time between two of them, s.
    pub(crate) pause_s: f64,
}

/// Chooses chunks: the first and the last with messages of each channel, and some spread between;
/// `None` where these are most of the bag.
pub(crate) fn choose(chunks: &[Chunk], how: Thoroughness) -> Option<Choice> {
    /// First and last messages may cost this multiple of what a survey reads.
    const TIMES: u64 = 8;
    let most = (how.parts as u64).saturating_mul(how.part_bytes as u64);
    let mut ends: BTreeMap<u32, [usize; 2]> = BTreeMap::new();
    for (place, chunk) in chunks.iter().enumerate() {
        for channel in &chunk.channels {
            ends.entry(*channel).or_insert([place, place])[1] = place;
        }
    }
    let mut places: BTreeSet<usize> = ends.into_values().flatten().collect();
    let bytes_of = |places: &BTreeSet<usize>| places.iter().map(|&k| chunks[k].bytes).sum::<u64>();
    let whole: u64 = chunks.iter().map(|chunk| chunk.bytes).sum();
    if places.is_empty() || bytes_of(&places) > most.saturating_mul(TIMES).min(whole / 2) {
        return None;
    }
    let mean = whole / chunks.len() as u64;
    let spread = (most / mean.max(1)).clamp(2, how.parts.max(2) as u64) as usize;
    places.extend((0..spread).map(|k| k * (chunks.len() - 1) / (spread - 1)));
    let bytes = bytes_of(&places);
    let places: Vec<usize> = places.into_iter().collect();
    let apart = places.windows(2).filter(|w| w[1] > w[0] + 1);
    let holes = apart.map(|w| chunks[w[1]].from_ns.saturating_sub(chunks[w[0]].to_ns));
    let pause_s = 0.5e-9 * holes.min().unwrap_or(u64::MAX) as f64;
    Some(Choice { places, bytes, pause_s })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(k: u64, channels: &[u32]) -> Chunk {
        let (from_ns, to_ns) = (10_000_000_000 * k, 10_000_000_000 * k + 9_000_000_000);
        Chunk { at: 100 * k, bytes: 100, from_ns, to_ns, channels: channels.to_vec() }
    }

    #[test]
    fn the_ends_of_each_channel_are_among_the_chosen() {
        let chunks: Vec<Chunk> = (0..100)
            .map(|k| chunk(k, if (33..=36).contains(&k) { &[1, 2] } else { &[1] }))
            .collect();
        let how = Thoroughness { whole_up_to: 0, parts: 3, part_bytes: 100 };
        let choice = choose(&chunks, how).unwrap();
        assert_eq!(choice.places, [0, 33, 36, 49, 99]);
        assert_eq!(choice.bytes, 500);
        // The gap between chunks 33 and 36 has 21 s.
        assert_eq!(choice.pause_s, 10.5);
    }

    #[test]
    fn a_bag_of_which_most_would_be_read_is_not_surveyed() {
        let chunks: Vec<Chunk> = (0..10).map(|k| chunk(k, &[k as u32])).collect();
        let how = Thoroughness { whole_up_to: 0, parts: 3, part_bytes: 100 };
        assert!(choose(&chunks, how).is_none());
        assert!(choose(&[], how).is_none());
    }
}
