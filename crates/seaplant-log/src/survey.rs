//! What a large file holds, from its index and from parts of it.

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

/// The channels of one or several files, of which the large ones were read in part.
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
    /// Where it is.
    pub path: PathBuf,
    /// Its size.
    pub bytes: u64,
    /// What it is, such as "comma-separated text".
    pub format: String,
    /// The SHA-256 of its bytes, in hexadecimal, if all of them were read.
    pub sha256: Option<String>,
    /// What was read of it; `None` if all was.
    pub parts: Option<Parts>,
    /// What its times count from.
    pub epoch: Epoch,
}

/// What was read of a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parts {
    /// How many parts.
    pub count: usize,
    /// The bytes of all parts.
    pub bytes: u64,
    /// Longer intervals than this, s, may be stretches that were not read.
    pub pause_s: f64,
}

/// A channel, of which the samples may be those of parts of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct SurveyedChannel {
    /// The samples that were read.
    pub read: Channel,
    /// How many samples the file holds. An index counts records: that values are missing in some of
    /// those that were not read, it does not tell.
    pub count: Figure<u64>,
    /// The time of the first of them, s.
    pub first_s: Figure<f64>,
    /// The time of the last of them, s.
    pub last_s: Figure<f64>,
    /// The samples in a second, 1 over the median interval within the parts; `None` of one sample.
    pub rate_hz: Option<Figure<f64>>,
}

impl Survey {
    /// Surveys files that were logged side by side.
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

    /// The files.
    pub fn files(&self) -> &[SurveyedFile] {
        &self.files
    }

    /// Their channels, in the order of the files and of their columns;
    /// [`Channel::source`] tells the file.
    pub fn channels(&self) -> &[SurveyedChannel] {
        &self.channels
    }

    /// What the readers decided or dropped.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// The log, if every file was read whole; what the vehicle was set to is not in it.
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
    /// The survey of files that were read whole.
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

/// How many samples a file holds of a channel, of which a `portion` of the bytes was read.
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

/// The rate within the parts; of a channel with one sample in each, that over all of them.
fn rate(channel: &Channel, count: u64, pause_s: f64) -> Option<Figure<f64>> {
    /// Fewer intervals within parts are no sample of all.
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

/// Surveys a file: reads it whole if it is small, else its index, where the format has one, and
/// parts from its first byte to its last, by the reader of the whole.
///
/// Read whole, however large, are formats that have to be (archives, workbooks, MATLAB and HDF5
/// files, Arrow files, NMEA 0183 sentences, whose times take all before them), bags
/// without an index, folders of several recordings, and whatever is odd: a clock that steps, damage, quotes over several lines.
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
        // What goes wrong in part is told by reading the whole.
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
    match Format::of(content.head()) {
        Format::Mcap => mcap::glance(content, options, how),
        Format::Rosbag1 => rosbag1::glance(content, options, how),
        Format::Sqlite => sqlite::glance(content, options, how),
        Format::Parquet => parquet::glance(content, options, how),
        format => {
            let Some(frame) = format.framing() else { return Ok(None) };
            let Some(excerpt) = excerpt::of(&content, frame, how)? else { return Ok(None) };
            let (parts, bytes) = (excerpt.pieces.len(), excerpt.length());
            let mut log = read_as(format, excerpt.content(content)?, options)?;
            log.notes = log.notes.into_iter().map(|note| excerpt.place(note)).collect();
            let pause_s = half_a_hole(&log, parts, bytes as f64 / excerpt.size.max(1) as f64);
            Ok(Some(Glance { log, parts, bytes, pause_s, has_ends: false }))
        }
    }
}

/// Whether parts do not tell what the whole would.
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
