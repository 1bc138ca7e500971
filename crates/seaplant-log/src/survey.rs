//! Surveys a large file from its index and from parts of it.

use std::path::{Path, PathBuf};

use crate::content::Content;
use crate::excerpt;
use crate::figure::{Figure, Portion};
use crate::format::{Format, read_as};
use crate::glance::{Glance, Thoroughness, half_a_hole};
use crate::log::{Channel, Source};
use crate::note::Note;
use crate::progress::{progress, take_back};
use crate::readers::{mcap, parquet, rosbag1, sqlite};
use crate::{Epoch, Error, Log, ReadOptions, bag_folder, read};

/// Channels of one or several files; large ones were read in part.
///
/// A survey is no [`Log`]: samples are missing between the parts, so nothing can be fitted to it.
#[derive(Debug, Clone, Default)]
pub struct Survey {
    files: Vec<SurveyedFile>,
    channels: Vec<SurveyedChannel>,
    notes: Vec<Note>,
}

/// A file that was surveyed.
#[derive(Debug, Clone, PartialEq)]
pub struct SurveyedFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Size of the file.
    pub bytes: u64,
    /// Format, such as "comma-separated text".
    pub format: String,
    /// The SHA-256 of its bytes, in hexadecimal, if all of them were read.
    pub sha256: Option<String>,
    /// Parts that were read; `None` if the file was read completely.
    pub parts: Option<Parts>,
    /// Epoch of its times.
    pub epoch: Epoch,
}

/// Parts of a file that were read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parts {
    /// Number of parts.
    pub count: usize,
    /// Total size of all parts.
    pub bytes: u64,
    /// Longer intervals than this, s, may be stretches that were not read.
    pub pause_s: f64,
}

/// A channel whose samples may come from parts of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct SurveyedChannel {
    /// Samples that were read.
    pub read: Channel,
    /// Number of samples in the file. An index counts records, and does not reveal missing values
    /// in those that were not read.
    pub count: Figure<u64>,
    /// The time of the first of them, s.
    pub first_s: Figure<f64>,
    /// The time of the last of them, s.
    pub last_s: Figure<f64>,
    /// Samples per second, 1 / median interval within the parts; `None` for one sample.
    pub rate_hz: Option<Figure<f64>>,
}

impl Survey {
    /// Surveys files that were logged simultaneously.
    ///
    /// # Errors
    /// [`Error::NoFiles`]; those of [`survey`].
    pub fn open(files: &[(PathBuf, ReadOptions)]) -> Result<Self, Error> {
        if files.is_empty() {
            return Err(Error::NoFiles);
        }
        let mut all = Self::default();
        for (path, options) in files {
            let one = survey(path, options, Thoroughness::default())?;
            let before = all.files.len();
            all.files.extend(one.files);
            all.notes.extend(one.notes);
            all.channels.extend(one.channels.into_iter().map(|mut channel| {
                channel.read.source += before;
                channel
            }));
        }
        Ok(all)
    }

    /// Returns the files.
    pub fn files(&self) -> &[SurveyedFile] {
        &self.files
    }

    /// Returns their channels, in the order of the files and of their columns; [`Channel::source`]
    /// gives the file.
    pub fn channels(&self) -> &[SurveyedChannel] {
        &self.channels
    }

    /// Returns the notes on what the readers decided or dropped.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Returns the log, if every file was read completely; vehicle settings are not included.
    ///
    /// # Errors
    /// The survey itself, if it is of parts.
    pub fn into_log(self) -> Result<Log, Self> {
        if self.files.iter().any(|file| file.parts.is_some()) {
            return Err(self);
        }
        let sources = self.files.into_iter().map(|file| Source {
            path: file.path,
            bytes: file.bytes,
            sha256: file.sha256.unwrap_or_default(),
            format: file.format,
            epoch: file.epoch,
        });
        let channels = self.channels.into_iter().map(|channel| channel.read).collect();
        Ok(Log { channels, sources: sources.collect(), notes: self.notes, ..Log::default() })
    }

    fn of_parts(glance: Glance) -> Self {
        let Glance { log, parts: count, bytes, pause_s, has_ends } = glance;
        let parts = Some(Parts { count, bytes, pause_s });
        let files = log.sources.into_iter().map(|source| {
            let (path, format) = (source.path, source.format);
            let epoch = source.epoch;
            SurveyedFile { path, bytes: source.bytes, format, sha256: None, parts, epoch }
        });
        let files: Vec<SurveyedFile> = files.collect();
        let size = files.iter().map(|file| file.bytes).sum::<u64>();
        let all = log.channels.iter().flat_map(|c| [c.time_s.first(), c.time_s.last()]).flatten();
        let [from_s, to_s] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[from, to], &time| {
            [from.min(time), to.max(time)]
        });
        let portion = bytes as f64 / size.max(1) as f64;
        let channels = log.channels.into_iter().filter_map(|read| {
            let (first_s, last_s) = (*read.time_s.first()?, *read.time_s.last()?);
            let count = count_of(&read, portion);
            let near = |distance_s: f64| has_ends || distance_s < pause_s;
            Some(SurveyedChannel {
                count,
                first_s: Figure::new(first_s, near(first_s - from_s)),
                last_s: Figure::new(last_s, near(to_s - last_s)),
                rate_hz: rate(&read, count.value(), pause_s),
                read,
            })
        });
        Self { channels: channels.collect(), files, notes: log.notes }
    }
}

impl From<Log> for Survey {
    /// Converts a complete log to a survey.
    fn from(log: Log) -> Self {
        let files = log.sources.into_iter().map(|source| SurveyedFile {
            path: source.path,
            bytes: source.bytes,
            format: source.format,
            sha256: Some(source.sha256),
            parts: None,
            epoch: source.epoch,
        });
        let channels = log.channels.into_iter().filter_map(|read| {
            Some(SurveyedChannel {
                count: Figure::Exact(read.len() as u64),
                first_s: Figure::Exact(*read.time_s.first()?),
                last_s: Figure::Exact(*read.time_s.last()?),
                rate_hz: read.rate_hz().map(Figure::Exact),
                read,
            })
        });
        Self { channels: channels.collect(), files: files.collect(), notes: log.notes }
    }
}

/// Estimates the number of samples of a channel in a file from the `portion` of the bytes that was
/// read.
fn count_of(channel: &Channel, portion: f64) -> Figure<u64> {
    let read = channel.len();
    match channel.portion {
        Some(Portion { read: all, of: Figure::Exact(count) }) if all == read => {
            Figure::Exact(count)
        }
        Some(Portion { read: all, of }) => {
            let part = read as f64 / all.max(1) as f64;
            Figure::About((of.value() as f64 * part).round() as u64)
        }
        None => Figure::About((read as f64 / portion).round() as u64),
    }
}

/// Returns the rate within the parts; for a channel with one sample in each, the rate over all of
/// them.
fn rate(channel: &Channel, count: u64, pause_s: f64) -> Option<Figure<f64>> {
    /// Fewer intervals within parts are no representative sample.
    const LEAST: usize = 8;
    let steps = channel.time_s.windows(2).map(|w| w[1] - w[0]);
    let mut within: Vec<f64> = steps.filter(|step| *step < pause_s).collect();
    if within.len() >= LEAST {
        let middle = within.len() / 2;
        let median = *within.select_nth_unstable_by(middle, f64::total_cmp).1;
        return Some(Figure::About(1.0 / median));
    }
    let span_s = channel.span_s();
    (span_s > 0.0).then(|| Figure::About((count.max(2) - 1) as f64 / span_s))
}

/// Surveys a file: reads a small file completely, otherwise its index, where the format has one,
/// and parts from its first byte to its last, with the reader of the complete file.
///
/// Files are read completely, however large, if their format requires it (archives, workbooks,
/// MATLAB and HDF5 files, Arrow files, NMEA 0183 sentences, whose times depend on all before them),
/// and so are bags without an index, folders of several recordings, and irregular files: a clock
/// that steps, damage, quotes over several lines.
///
/// # Errors
/// Those of [`read()`].
pub fn survey(
    path: &Path,
    options: &ReadOptions,
    thoroughness: Thoroughness,
) -> Result<Survey, Error> {
    options.check(path)?;
    let before = progress();
    let only = match bag_folder::recordings(path).as_deref() {
        Some([only]) => Some(only.clone()),
        Some(_) => return read::read(path, options).map(Survey::from),
        None => None,
    };
    let path = only.as_deref().unwrap_or(path);
    let content = Content::open(path)?;
    let is_large = content.file_length().is_some_and(|length| length > thoroughness.whole_up_to);
    if is_large {
        // An error in parts is reported by reading the complete file.
        match glance(content, options, thoroughness) {
            Ok(Some(glance)) if !is_odd(&glance.log) => return Ok(Survey::of_parts(glance)),
            _ => {}
        }
    }
    take_back(before);
    read::read(path, options).map(Survey::from)
}

fn glance(
    content: Content,
    options: &ReadOptions,
    how: Thoroughness,
) -> Result<Option<Glance>, Error> {
    match Format::detect(content.head()) {
        Format::Mcap => mcap::glance(content, options, how),
        Format::Rosbag1 => rosbag1::glance(content, options, how),
        Format::Sqlite => sqlite::glance(content, options, how),
        Format::Parquet => parquet::glance(content, options, how),
        format => {
            let Some(frame) = format.framing() else { return Ok(None) };
            let Some(excerpt) = excerpt::choose(&content, frame, how)? else { return Ok(None) };
            let (parts, bytes) = (excerpt.pieces.len(), excerpt.length());
            let mut log = read_as(format, excerpt.content(content)?, options)?;
            log.notes = log.notes.into_iter().map(|note| excerpt.place(note)).collect();
            let pause_s = half_a_hole(&log, parts, bytes as f64 / excerpt.size.max(1) as f64);
            Ok(Some(Glance { log, parts, bytes, pause_s, has_ends: false }))
        }
    }
}

/// Returns whether parts do not represent the complete file.
fn is_odd(log: &Log) -> bool {
    log.notes.iter().any(|note| {
        matches!(
            note,
            Note::ClockStepped { .. }
                | Note::Restarted { .. }
                | Note::CorruptRecords { .. }
                | Note::UnreadableRows { .. }
        )
    })
}
