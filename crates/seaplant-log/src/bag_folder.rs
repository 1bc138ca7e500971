//! Reads the folder of a ROS 2 bag, whose recordings follow one another, as one log.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sha2::{Digest, Sha256};

use crate::Error;
use crate::log::{Channel, LeftOut, Log, Source};

/// Index file that a recorder writes next to its recordings.
const INDEX: &str = "metadata.yaml";

/// Size limit of an index: the index of ten thousand recordings has a mebibyte.
const LONGEST_INDEX: u64 = 16 << 20;

/// Returns the recordings in the folder of a bag, in order; `None` for any other path.
///
/// They are those that its `metadata.yaml` lists under `relative_file_paths`.
pub(crate) fn recordings(path: &Path) -> Option<Vec<PathBuf>> {
    let index = path.join(INDEX);
    // Reading a pipe would wait for a writer.
    if !path.is_dir() || !index.is_file() {
        return None;
    }
    let mut text = String::new();
    File::open(index).ok()?.take(LONGEST_INDEX).read_to_string(&mut text).ok()?;
    let listed: Vec<PathBuf> = listed(&text).map(|name| path.join(name)).collect();
    (!listed.is_empty()).then_some(listed)
}

/// Returns whether a path is the folder of a ROS 2 bag, which [`read()`](crate::read()) takes as
/// one log.
pub fn is_bag(path: &Path) -> bool {
    recordings(path).is_some()
}

/// Lists the file names under `relative_file_paths`; of a path that leads elsewhere only the name
/// is used.
fn listed(index: &str) -> impl Iterator<Item = &str> {
    let lines = index.lines().map(str::trim);
    let after = lines.skip_while(|line| *line != "relative_file_paths:").skip(1);
    let items = after.map_while(|line| line.strip_prefix("- "));
    items.filter_map(|item| {
        let name = item.trim().trim_matches(['"', '\'']);
        Path::new(name).file_name()?.to_str()
    })
}

/// Joins the logs of a folder's recordings, in order, into one log whose source is the folder.
///
/// # Errors
/// The first of the recordings'; [`Error::Directory`] without any.
pub(crate) fn join(
    folder: &Path,
    recordings: impl Iterator<Item = Result<Log, Error>>,
) -> Result<Log, Error> {
    let mut all: Option<Log> = None;
    for next in recordings {
        let next = next?;
        all = Some(match all {
            Some(before) => follow(before, next),
            None => next,
        });
    }
    let mut log = all.ok_or_else(|| Error::Directory { path: folder.to_owned() })?;
    log.sources = vec![source(folder, &log.sources)];
    Ok(log)
}

/// Describes the folder as a source: its hash is that of the hashes of its files, each on a line,
/// as `sha256sum FILES | cut -c1-64 | sha256sum` gives it.
fn source(folder: &Path, parts: &[Source]) -> Source {
    let lines: String = parts.iter().map(|part| format!("{}\n", part.sha256)).collect();
    let digest = Sha256::digest(lines);
    let first = parts.first();
    let format = first.map_or("", |part| &part.format);
    Source {
        path: folder.to_owned(),
        bytes: parts.iter().map(|part| part.bytes).sum(),
        sha256: digest.iter().map(|byte| format!("{byte:02x}")).collect(),
        format: format!("{format}, {} files", parts.len()),
        epoch: first.map(|part| part.epoch).unwrap_or_default(),
    }
}

/// Appends one log to another: channels of the same column are joined in time order.
fn follow(mut log: Log, next: Log) -> Log {
    let mut joined: Vec<Joined> = Vec::new();
    for channel in next.channels {
        let same =
            |known: &&mut Channel| known.column == channel.column && known.unit == channel.unit;
        match log.channels.iter_mut().find(same) {
            Some(known) => extend(known, &channel, &mut joined),
            None => log.channels.push(Channel { source: 0, ..channel }),
        }
    }
    for left_out in next.left_out {
        let is_known = |column: &String| *column == left_out.column;
        let mut known = log.left_out.iter().map(|of| &of.column);
        if !known.any(is_known) && !log.channels.iter().any(|of| is_known(&of.column)) {
            log.left_out.push(LeftOut { source: 0, ..left_out });
        }
    }
    log.sources.extend(next.sources);
    log.notes.extend(next.notes);
    log.settings.extend(next.settings);
    log
}

/// Merged times of two channels, shared by other channels with the same times.
struct Joined {
    of: [Arc<[f64]>; 2],
    time_s: Arc<[f64]>,
    /// Index of each of them in the first channel's samples followed by the second's.
    places: Vec<usize>,
}

impl Joined {
    fn new(of: [Arc<[f64]>; 2]) -> Self {
        let all: Vec<f64> = of.iter().flat_map(|times| times.iter().copied()).collect();
        let mut places: Vec<usize> = (0..all.len()).collect();
        // Stable, so that of equal times the first recording's sample stays.
        places.sort_by(|a, b| all[*a].total_cmp(&all[*b]));
        places.dedup_by(|later, first| all[*later] == all[*first]);
        let time_s = places.iter().map(|place| all[*place]).collect();
        Self { of, time_s, places }
    }
}

fn extend(known: &mut Channel, next: &Channel, all: &mut Vec<Joined>) {
    let is_it = |joined: &Joined| {
        Arc::ptr_eq(&joined.of[0], &known.time_s) && Arc::ptr_eq(&joined.of[1], &next.time_s)
    };
    let at = all.iter().position(is_it).unwrap_or_else(|| {
        all.push(Joined::new([Arc::clone(&known.time_s), Arc::clone(&next.time_s)]));
        all.len() - 1
    });
    let Joined { time_s, places, .. } = &all[at];
    let values = |place: &usize| match place.checked_sub(known.values.len()) {
        Some(of_next) => next.values[of_next],
        None => known.values[*place],
    };
    let values = places.iter().map(values).collect();
    known.values = values;
    known.time_s = Arc::clone(time_s);
    known.missing += next.missing;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unit;

    const INDEX_TEXT: &str = "rosbag2_bagfile_information:\n  files:\n  - path: other.mcap\n  \
        relative_file_paths:\n    - bag_0.mcap\n    - \"sub/bag_1.mcap\"\n    - ../../bag_2.mcap\n  \
        version: 5\n";

    fn channel(column: &str, samples: &[(f64, f64)]) -> Channel {
        Channel {
            name: column.to_owned(),
            column: column.to_owned(),
            unit: Unit::parse("m").ok(),
            source: 0,
            missing: 1,
            time_s: samples.iter().map(|sample| sample.0).collect(),
            values: samples.iter().map(|sample| sample.1).collect(),
            portion: None,
        }
    }

    #[test]
    fn recordings_are_those_that_the_index_lists() {
        assert!(listed(INDEX_TEXT).eq(["bag_0.mcap", "bag_1.mcap", "bag_2.mcap"]));
        assert_eq!(listed("relative_file_paths: []\n- a\n").count(), 0);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path();
        assert_eq!(recordings(path), None);
        std::fs::write(path.join(INDEX), INDEX_TEXT).expect("written");
        let found = recordings(path).expect("a bag");
        assert_eq!(found[1], path.join("bag_1.mcap"));
        assert_eq!(recordings(&path.join(INDEX)), None);
    }

    #[test]
    fn channels_go_on_in_the_next_recording() {
        let log = |channels| Log { channels, ..Log::default() };
        let first = log(vec![channel("/a/x", &[(0.0, 1.0), (1.0, 2.0)])]);
        // A message stamped before the recorder changed files, and one that both files hold.
        let late = [(0.5, 3.0), (1.0, 4.0), (2.0, 5.0)];
        let next = log(vec![channel("/a/x", &late), channel("/b/y", &[(2.0, 6.0)])]);
        let log = follow(first, next);
        let [x, y] = log.channels() else { panic!("{:?}", log.channels()) };
        assert_eq!(x.time_s(), [0.0, 0.5, 1.0, 2.0]);
        assert_eq!(x.values(), [1.0, 3.0, 2.0, 5.0]);
        assert_eq!((x.missing, y.values()), (2, &[6.0][..]));
    }
}
