//! What a log holds, channel by channel, and what is odd about it.

use schemars::JsonSchema;
use seaplant_log::{Channel, Gap, Log};
use serde::{Deserialize, Serialize};

mod clocks;
mod remarks;
mod runs;

pub use clocks::{InspectedEpoch, InspectedOffset};
pub(crate) use remarks::{Remark, looks_like_degrees, remarks, short};

/// What a log holds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Inspection {
    /// The files.
    pub files: Vec<InspectedFile>,
    /// How the clocks of the other files lie to the first's.
    #[serde(default)]
    pub offsets: Vec<InspectedOffset>,
    /// Their channels, in the order of the files and of their columns.
    pub channels: Vec<ChannelSummary>,
    /// What the reader decided or dropped.
    pub notes: Vec<String>,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InspectedFile {
    /// Where.
    pub path: String,
    /// Its size.
    pub bytes: u64,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
    /// What it is, such as "comma-separated text".
    pub format: String,
    /// What its times count from.
    #[serde(default)]
    pub epoch: InspectedEpoch,
    /// The first and the last time of any of its channels, s, in the file's clock.
    #[serde(default)]
    pub span_s: Option<[f64; 2]>,
}

/// One channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChannelSummary {
    /// The path of its file.
    pub file: String,
    /// Its header.
    pub column: String,
    /// The unit that the header states.
    pub unit: Option<String>,
    /// How many samples it has.
    pub count: usize,
    /// Rows without a value.
    pub missing: usize,
    /// Samples in a second: 1 over the median interval; absent of a single sample.
    pub rate_hz: Option<f64>,
    /// The time of the first sample, s, in the file's clock.
    pub first_s: f64,
    /// The time of the last sample, s, in the file's clock.
    pub last_s: f64,
    /// Intervals longer than five median ones and half a second.
    pub gaps: usize,
    /// The longest of them, s.
    pub longest_gap_s: Option<f64>,
    /// The smallest value, in the channel's unit.
    pub min: f64,
    /// The largest value, in the channel's unit.
    pub max: f64,
    /// What is odd about the values, in plain words.
    pub remarks: Vec<String>,
}

/// Looks at every channel of a log.
pub fn inspect(log: &Log) -> Inspection {
    let files = log.sources().iter().enumerate().map(|(file, source)| InspectedFile {
        path: source.path.display().to_string(),
        bytes: source.bytes,
        sha256: source.sha256.clone(),
        format: source.format.clone(),
        epoch: InspectedEpoch::of(source),
        span_s: clocks::span_s(log, file),
    });
    Inspection {
        files: files.collect(),
        offsets: clocks::offsets(log),
        channels: log.channels().iter().filter_map(|channel| summarise(log, channel)).collect(),
        notes: log.notes().iter().map(ToString::to_string).collect(),
    }
}

/// Regressions cut a trial at intervals longer than these.
const GAP_PERIODS: f64 = 5.0;
const GAP_SECONDS: f64 = 0.5;

/// `None` of a channel without samples.
fn summarise(log: &Log, channel: &Channel) -> Option<ChannelSummary> {
    let lengths = |gap: &Gap| gap.to_s - gap.from_s;
    let gaps: Vec<f64> = channel.gaps(GAP_PERIODS).iter().map(lengths).collect();
    let gaps: Vec<f64> = gaps.into_iter().filter(|gap| *gap > GAP_SECONDS).collect();
    Some(ChannelSummary {
        file: log.sources()[channel.source].path.display().to_string(),
        column: channel.column.clone(),
        unit: channel.unit.as_ref().map(|unit| unit.symbol().to_owned()),
        count: channel.len(),
        missing: channel.missing,
        rate_hz: channel.rate_hz(),
        first_s: *channel.time_s().first()?,
        last_s: *channel.time_s().last()?,
        gaps: gaps.len(),
        longest_gap_s: gaps.iter().copied().reduce(f64::max),
        min: channel.min()?,
        max: channel.max()?,
        remarks: remarks(channel).iter().map(ToString::to_string).collect(),
    })
}
