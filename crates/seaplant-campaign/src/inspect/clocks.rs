//! Compares the clocks of several files.

use schemars::JsonSchema;
use seaplant::{ClockOffset, Error, Vehicle};
use seaplant_log::{Epoch, Log, Source};
use serde::{Deserialize, Serialize};

use crate::clocks::{Alignment, line, recordings};
use crate::columns::are_alike;

/// Epoch of a file's times.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum InspectedEpoch {
    /// The start of 1970, UTC.
    Unix,
    /// Midnight of an unknown day.
    Midnight,
    /// The start of the vehicle's computer.
    Start,
    /// The file states no epoch.
    #[default]
    Unstated,
}

impl InspectedEpoch {
    pub(super) fn from_epoch(epoch: Epoch) -> Self {
        match epoch {
            Epoch::Unix => Self::Unix,
            Epoch::Midnight => Self::Midnight,
            Epoch::Start { .. } => Self::Start,
            _ => Self::Unstated,
        }
    }

    /// Returns the epoch in words that follow "seconds since".
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unix => "1970",
            Self::Midnight => "midnight",
            Self::Start => "the autopilot started",
            Self::Unstated => "a start that is not stated",
        }
    }
}

/// Offset of a file's clock to that of the first.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InspectedOffset {
    /// The file.
    pub file: String,
    /// The first file.
    pub against: String,
    /// Overlap of both with the recorded clocks, s; below zero the time between them.
    pub overlap_s: f64,
    /// True if both count from the same instant, as far as they state it.
    pub same_epoch: bool,
    /// Seconds to add to the clock of the file, from the satellite time in an autopilot's log;
    /// accurate to a second.
    pub by_satellite_s: Option<f64>,
    /// Lag of the clock of the file, estimated from the data.
    pub clock: Option<ClockOffset>,
    /// Reason why it cannot be estimated; also absent if the files have no comparable signals.
    pub refused: Option<String>,
    /// Line for campaign.toml under `[[trial]]`; absent if the clocks agree.
    pub campaign_line: Option<String>,
}

/// Returns the offsets of all files' clocks to the first's; files of the same columns are
/// recordings of other times, and left out.
pub(super) fn offsets(log: &Log) -> Vec<InspectedOffset> {
    let others: Vec<usize> =
        (1..log.sources().len()).filter(|&file| !are_alike(log, 0, file)).collect();
    if others.is_empty() {
        return Vec::new();
    }
    let is_aligned = (0..log.sources().len()).map(|file| file == 0).collect();
    let recordings = recordings(log);
    let mut alignment = Alignment { vehicle: &Vehicle::default(), recordings, is_aligned };
    others.into_iter().filter_map(|file| offset(log, &mut alignment, file)).collect()
}

fn offset(log: &Log, alignment: &mut Alignment<'_>, file: usize) -> Option<InspectedOffset> {
    let [here, there] = [0, file].map(|file| span_s(log, file));
    let (here, there) = (here?, there?);
    let [reference, source] = [0, file].map(|file| &log.sources()[file]);
    let (clock, refused) = match alignment.estimate(file) {
        Ok(clock) => (Some(clock), None),
        Err(Error::ClockOffset { pairs: 0, .. }) => (None, None),
        Err(error) => (None, Some(error.to_string())),
    };
    if let Some(clock) = &clock {
        alignment.move_by(file, clock.offset_s);
    }
    let by_satellite_s = since_1970_s(source).zip(since_1970_s(reference)).map(|(b, a)| b - a);
    let by_satellite_s = by_satellite_s.filter(|offset_s| *offset_s != 0.0);
    let told = clock.as_ref().filter(|clock| !agrees(clock)).map(|clock| clock.offset_s);
    let wanted = if clock.is_some() { told } else { by_satellite_s };
    Some(InspectedOffset {
        file: source.path.display().to_string(),
        against: reference.path.display().to_string(),
        overlap_s: here[1].min(there[1]) - here[0].max(there[0]),
        same_epoch: InspectedEpoch::from_epoch(reference.epoch)
            == InspectedEpoch::from_epoch(source.epoch),
        by_satellite_s,
        clock,
        refused,
        campaign_line: wanted.map(|offset_s| line(&source.path, offset_s)),
    })
}

/// Returns whether two clocks agree within the accuracy of the data.
fn agrees(clock: &ClockOffset) -> bool {
    /// Tolerance on instruments' differences in time stamping, s.
    const CLOSE_S: f64 = 0.02;
    clock.offset_s.abs() < CLOSE_S + 3.0 * clock.std_s
}

/// Returns the first and the last time of a file, s; `None` for one without channels.
pub(super) fn span_s(log: &Log, file: usize) -> Option<[f64; 2]> {
    let of_file = log.channels().iter().filter(|channel| channel.source == file);
    let ends = of_file.filter_map(|c| Some([*c.time_s().first()?, *c.time_s().last()?]));
    ends.reduce(around)
}

/// Returns the span of both.
pub(super) fn around(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].min(other[0]), one[1].max(other[1])]
}

/// Returns the time at which the clock of a file was at zero, s since 1970.
pub(super) fn since_1970_s(source: &Source) -> Option<f64> {
    match source.epoch {
        Epoch::Unix => Some(0.0),
        Epoch::Start { since_1970_s } => since_1970_s,
        _ => None,
    }
}
