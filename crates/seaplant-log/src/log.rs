//! Logs: named, timed, unit-bearing channels.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::figure::Portion;
use crate::lookup::{self, Candidate};
use crate::note::Note;
use crate::{Epoch, Error, Unit};

/// The channels of one or several files, each at its own times.
#[derive(Debug, Clone, Default)]
pub struct Log {
    pub(crate) channels: Vec<Channel>,
    pub(crate) sources: Vec<Source>,
    pub(crate) notes: Vec<Note>,
    pub(crate) left_out: Vec<LeftOut>,
    pub(crate) settings: BTreeMap<String, f64>,
}

/// A file that a log was read from.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Path of the file.
    pub path: PathBuf,
    /// Size of the file.
    pub bytes: u64,
    /// The SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
    /// Format, such as "comma-separated text".
    pub format: String,
    /// Epoch of its times.
    pub epoch: Epoch,
}

/// One measured or commanded quantity over time.
///
/// Every value is finite; times are finite, strictly increasing, and in the file's own clock.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Name without the unit.
    pub name: String,
    /// Header text.
    pub column: String,
    /// Unit that the header states.
    pub unit: Option<Unit>,
    /// Source file: an index into [`Log::sources`].
    pub source: usize,
    /// Number of rows without a value.
    pub missing: usize,
    pub(crate) time_s: Arc<[f64]>,
    pub(crate) values: Vec<f64>,
    /// Part of the records that the channel covers, if only parts of a file were read and the
    /// reader knows their total.
    pub(crate) portion: Option<Portion>,
}

/// A stretch without samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Time of the last sample before it, s.
    pub from_s: f64,
    /// Time of the first sample after it, s.
    pub to_s: f64,
}

/// A column without numbers, kept to explain why it is unavailable.
#[derive(Debug, Clone)]
pub(crate) struct LeftOut {
    pub(crate) column: String,
    pub(crate) name: String,
    pub(crate) source: usize,
    pub(crate) rows: usize,
    pub(crate) reason: Reason,
}

/// Reason why a column is no channel.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reason {
    /// It holds no value.
    Missing,
    /// It holds text, such as this.
    Text { line: u64, text: String },
    /// It holds ambiguous numbers such as this, which may have decimals or thousands.
    Ambiguous { line: u64, text: String },
    /// Its kind is not a series of numbers, in words that follow its name.
    Kind(&'static str),
}

impl LeftOut {
    /// Returns the error of requesting this column.
    pub(crate) fn error(&self, path: &Path) -> Error {
        let (path, column) = (path.to_owned(), self.column.clone());
        match self.reason.clone() {
            Reason::Missing => Error::AllMissing { path, column, rows: self.rows },
            Reason::Text { line, text } => Error::AllText { path, column, line, text },
            Reason::Ambiguous { line, text } => Error::AmbiguousNumber { path, column, line, text },
            Reason::Kind(why) => Error::LeftOut { path, column, why },
        }
    }
}

impl Log {
    /// Combines the channels of two logs, those of `other` last; equal times are stored once.
    #[must_use]
    pub fn merge(mut self, mut other: Self) -> Self {
        let shift = self.sources.len();
        let bases = self.time_bases();
        for channel in &mut other.channels {
            channel.source += shift;
            if let Some(base) = bases.iter().find(|base| **base == channel.time_s) {
                channel.time_s = Arc::clone(base);
            }
        }
        for left_out in &mut other.left_out {
            left_out.source += shift;
        }
        self.channels.append(&mut other.channels);
        self.sources.append(&mut other.sources);
        self.notes.append(&mut other.notes);
        self.left_out.append(&mut other.left_out);
        self.settings.append(&mut other.settings);
        self
    }

    /// Shifts the times of one file, given as an index into [`Log::sources`]. Channels continue to
    /// share times.
    pub fn shift(&mut self, source: usize, offset_s: f64) {
        let mut moved: Vec<[Arc<[f64]>; 2]> = Vec::new();
        for channel in self.channels.iter_mut().filter(|channel| channel.source == source) {
            let known = moved.iter().find(|[before, _]| Arc::ptr_eq(before, &channel.time_s));
            let times = match known {
                Some([_, times]) => Arc::clone(times),
                None => {
                    let times = channel.time_s.iter().map(|time| time + offset_s).collect();
                    moved.push([Arc::clone(&channel.time_s), Arc::clone(&times)]);
                    times
                }
            };
            channel.time_s = times;
        }
    }

    /// Returns every allocation of times, once.
    fn time_bases(&self) -> Vec<Arc<[f64]>> {
        let mut bases: Vec<Arc<[f64]>> = Vec::new();
        for Channel { time_s, .. } in &self.channels {
            if !bases.iter().any(|base| Arc::ptr_eq(base, time_s)) {
                bases.push(Arc::clone(time_s));
            }
        }
        bases
    }

    /// Returns all channels, in the order of the files and of their columns.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Consumes the log and returns its channels.
    pub fn into_channels(self) -> Vec<Channel> {
        self.channels
    }

    /// Returns the files that the channels were read from.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// Returns the notes on what the reader decided or dropped.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Returns the vehicle's settings, if the log has them: ArduPilot's parameters by name, with
    /// their last values.
    pub fn settings(&self) -> &BTreeMap<String, f64> {
        &self.settings
    }

    /// Returns the channel of that name.
    ///
    /// `name` is matched with the header's text, then with the name without the unit, then with
    /// either regardless of case and spacing. `FILE:COLUMN` looks in one file only, FILE being its
    /// name, its name without extension, or its path.
    ///
    /// # Errors
    /// [`Error::NoChannel`], [`Error::Ambiguous`]; [`Error::AllMissing`] and [`Error::AllText`]
    /// where the column is in the file without a number in it.
    pub fn channel(&self, name: &str) -> Result<&Channel, Error> {
        Ok(&self.channels[self.place(name)?])
    }

    /// Returns the index in [`Log::channels`] of the channel of that name.
    ///
    /// # Errors
    /// As [`Log::channel`].
    pub fn place(&self, name: &str) -> Result<usize, Error> {
        let path = |source: usize| self.sources[source].path.as_path();
        let filled = self.channels.iter().map(|c| Candidate {
            column: &c.column,
            name: &c.name,
            path: path(c.source),
            empty: false,
        });
        let left_out = self.left_out.iter().map(|c| Candidate {
            column: &c.column,
            name: &c.name,
            path: path(c.source),
            empty: true,
        });
        let candidates: Vec<Candidate<'_>> = filled.chain(left_out).collect();
        let found = lookup::find(name, &candidates)?;
        match found.checked_sub(self.channels.len()).map(|place| &self.left_out[place]) {
            Some(left_out) => Err(left_out.error(path(left_out.source))),
            None => Ok(found),
        }
    }
}

impl Channel {
    /// Returns the times of the samples, s, in the file's clock.
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// Returns the values of the samples, in the channel's unit.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the times, which other channels may share, and the values.
    pub fn into_samples(self) -> (Arc<[f64]>, Vec<f64>) {
        (self.time_s, self.values)
    }

    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns whether there are no samples; always false for a channel that was read from a file.
    pub fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    /// Returns whether two channels share one time base in memory, as those of one file mostly do.
    pub fn shares_time_with(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.time_s, &other.time_s)
    }

    /// Returns the time from the first sample to the last, s.
    pub fn span_s(&self) -> f64 {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Returns the median time between samples, s; `None` for fewer than two.
    pub fn period_s(&self) -> Option<f64> {
        median_period(&self.time_s)
    }

    /// Returns samples per second: 1 / median period; `None` for fewer than two samples.
    pub fn rate_hz(&self) -> Option<f64> {
        self.period_s().map(|period| 1.0 / period)
    }

    /// Returns the intervals longer than `factor` median periods.
    pub fn gaps(&self, factor: f64) -> Vec<Gap> {
        let Some(period) = self.period_s() else { return Vec::new() };
        let pairs = self.time_s.windows(2).map(|w| Gap { from_s: w[0], to_s: w[1] });
        pairs.filter(|gap| gap.to_s - gap.from_s > factor * period).collect()
    }

    /// Returns whether all values are equal.
    pub fn is_constant(&self) -> bool {
        self.values.windows(2).all(|w| w[0] == w[1])
    }

    /// Returns the smallest value; `None` without samples.
    pub fn min(&self) -> Option<f64> {
        self.values.iter().copied().reduce(f64::min)
    }

    /// Returns the largest value; `None` without samples.
    pub fn max(&self) -> Option<f64> {
        self.values.iter().copied().reduce(f64::max)
    }
}

/// Returns the median of the intervals between increasing times; `None` for fewer than two.
pub(crate) fn median_period(time_s: &[f64]) -> Option<f64> {
    let mut periods: Vec<f64> = time_s.windows(2).map(|w| w[1] - w[0]).collect();
    if periods.is_empty() {
        return None;
    }
    let middle = periods.len() / 2;
    let (below, &mut median, _) = periods.select_nth_unstable_by(middle, f64::total_cmp);
    if below.len() * 2 + 1 == time_s.len() - 1 {
        return Some(median);
    }
    let lower = below.iter().copied().fold(f64::MIN, f64::max);
    Some(0.5 * (lower + median))
}
