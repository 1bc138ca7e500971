//! Summarises a log channel by channel, with its irregularities.

use schemars::JsonSchema;
use seaplant_log::{Channel, Figure, Gap, Log, Note, Survey, SurveyedChannel};
use serde::{Deserialize, Serialize};

mod clocks;

pub use clocks::{InspectedEpoch, InspectedOffset};

use crate::remarks::remarks_within;

/// Summary of a log.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Inspection {
    /// The files.
    pub files: Vec<InspectedFile>,
    /// Offsets of the other files' clocks to the first's.
    #[serde(default)]
    pub offsets: Vec<InspectedOffset>,
    /// Their channels, in the order of the files and of their columns.
    pub channels: Vec<ChannelSummary>,
    /// Notes on what the reader decided or dropped.
    pub notes: Vec<String>,
}

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InspectedFile {
    /// Path.
    pub path: String,
    /// Its size.
    pub bytes: u64,
    /// SHA-256 of its content, hexadecimal; absent for a file that was read in part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sha256: Option<String>,
    /// Format, such as "comma-separated text".
    pub format: String,
    /// True if only parts of it were read: the numbers listed under `estimated` of its channels are
    /// estimates, and smallest and largest values and remarks refer to these parts.
    pub surveyed: bool,
    /// Number of parts read; 1 for a file that was read completely.
    pub parts: usize,
    /// Number of bytes read.
    pub bytes_read: u64,
    /// Epoch of its times.
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
    /// Number of samples.
    pub count: u64,
    /// Number of samples read.
    pub read: usize,
    /// Number of rows without a value, among those read.
    pub missing: usize,
    /// Samples per second: 1 / median interval; absent for a single sample.
    pub rate_hz: Option<f64>,
    /// The time of the first sample, s, in the file's clock.
    pub first_s: f64,
    /// The time of the last sample, s, in the file's clock.
    pub last_s: f64,
    /// Number of intervals longer than five median ones and half a second; absent if only parts
    /// were read.
    pub gaps: Option<usize>,
    /// The longest of them, s.
    pub longest_gap_s: Option<f64>,
    /// The smallest value that was read, in the channel's unit.
    pub min: f64,
    /// The largest value that was read, in the channel's unit.
    pub max: f64,
    /// Irregularities of the values that were read, in plain words.
    pub remarks: Vec<String>,
    /// Names of those of `count`, `rate_hz`, `first_s` and `last_s` that are estimates.
    pub estimated: Vec<String>,
}

/// Inspects every channel of a log.
pub fn inspect(log: &Log) -> Inspection {
    let files = log.sources().iter().enumerate().map(|(file, source)| InspectedFile {
        path: source.path.display().to_string(),
        bytes: source.bytes,
        sha256: Some(source.sha256.clone()),
        format: source.format.clone(),
        surveyed: false,
        parts: 1,
        bytes_read: source.bytes,
        epoch: InspectedEpoch::from_epoch(source.epoch),
        span_s: clocks::span_s(log, file),
    });
    let files = files.collect();
    let channels = log.channels().iter().filter_map(Seen::complete);
    Inspection { offsets: clocks::offsets(log), ..inspection(files, channels, log.notes()) }
}

/// Inspects every channel of files that were surveyed: large ones were read in part, and then the
/// clocks of files are not compared.
pub fn inspect_survey(survey: Survey) -> Inspection {
    let survey = match survey.into_log() {
        Ok(log) => return inspect(&log),
        Err(survey) => survey,
    };
    let files = (0..survey.files().len()).map(|file| inspected(&survey, file)).collect();
    let channels = survey.channels().iter().map(|channel| {
        let parts = survey.files()[channel.read.source].parts;
        Seen::surveyed(channel, parts.map_or(f64::INFINITY, |parts| parts.pause_s))
    });
    inspection(files, channels, survey.notes())
}

fn inspected(survey: &Survey, place: usize) -> InspectedFile {
    let file = &survey.files()[place];
    let of_file = survey.channels().iter().filter(|channel| channel.read.source == place);
    let ends = of_file.map(|channel| [channel.first_s.value(), channel.last_s.value()]);
    InspectedFile {
        path: file.path.display().to_string(),
        bytes: file.bytes,
        sha256: file.sha256.clone(),
        format: file.format.clone(),
        surveyed: file.parts.is_some(),
        parts: file.parts.map_or(1, |parts| parts.count),
        bytes_read: file.parts.map_or(file.bytes, |parts| parts.bytes),
        epoch: InspectedEpoch::from_epoch(file.epoch),
        span_s: ends.reduce(clocks::around),
    }
}

fn inspection<'a>(
    files: Vec<InspectedFile>,
    channels: impl Iterator<Item = Seen<'a>>,
    notes: &[Note],
) -> Inspection {
    let channels = channels.filter_map(|seen| seen.summarise(&files)).collect();
    let notes = notes.iter().map(ToString::to_string).collect();
    Inspection { channels, files, notes, offsets: Vec::new() }
}

/// Regressions cut a trial at intervals longer than these.
const GAP_PERIODS: f64 = 5.0;
const GAP_SECONDS: f64 = 0.5;

/// A channel, and the knowledge of it.
struct Seen<'a> {
    channel: &'a Channel,
    count: Figure<u64>,
    rate_hz: Option<Figure<f64>>,
    first_s: Figure<f64>,
    last_s: Figure<f64>,
    /// Longer intervals than this, s, may be stretches that were not read.
    pause_s: f64,
}

impl<'a> Seen<'a> {
    /// Creates one of a complete channel; `None` for a channel without samples.
    fn complete(channel: &'a Channel) -> Option<Self> {
        Some(Self {
            channel,
            count: Figure::Exact(channel.len() as u64),
            rate_hz: channel.rate_hz().map(Figure::Exact),
            first_s: Figure::Exact(*channel.time_s().first()?),
            last_s: Figure::Exact(*channel.time_s().last()?),
            pause_s: f64::INFINITY,
        })
    }

    fn surveyed(channel: &'a SurveyedChannel, pause_s: f64) -> Self {
        let SurveyedChannel { read, count, first_s, last_s, rate_hz, .. } = channel;
        let (count, rate_hz, first_s, last_s) = (*count, *rate_hz, *first_s, *last_s);
        Self { channel: read, count, rate_hz, first_s, last_s, pause_s }
    }

    /// Summarises the channel; `None` for a channel without samples.
    fn summarise(&self, files: &[InspectedFile]) -> Option<ChannelSummary> {
        let channel = self.channel;
        let file = &files[channel.source];
        let gaps = (!file.surveyed).then(|| long_gaps(channel));
        let estimates = [
            ("count", self.count.is_estimate()),
            ("rate_hz", self.rate_hz.is_some_and(Figure::is_estimate)),
            ("first_s", self.first_s.is_estimate()),
            ("last_s", self.last_s.is_estimate()),
        ];
        let estimated = estimates.iter().filter(|(_, is)| *is).map(|(name, _)| (*name).to_owned());
        let remarks = remarks_within(channel, self.pause_s);
        Some(ChannelSummary {
            file: file.path.clone(),
            column: channel.column.clone(),
            unit: channel.unit.as_ref().map(|unit| unit.symbol().to_owned()),
            count: self.count.value(),
            read: channel.len(),
            missing: channel.missing,
            rate_hz: self.rate_hz.map(Figure::value),
            first_s: self.first_s.value(),
            last_s: self.last_s.value(),
            gaps: gaps.as_ref().map(Vec::len),
            longest_gap_s: gaps.and_then(|gaps| gaps.into_iter().reduce(f64::max)),
            min: channel.min()?,
            max: channel.max()?,
            remarks: remarks.iter().map(ToString::to_string).collect(),
            estimated: estimated.collect(),
        })
    }
}

/// Returns the lengths of significant gaps, s.
fn long_gaps(channel: &Channel) -> Vec<f64> {
    let length = |gap: &Gap| gap.to_s - gap.from_s;
    let gaps = channel.gaps(GAP_PERIODS);
    gaps.iter().map(length).filter(|gap| *gap > GAP_SECONDS).collect()
}
