//! From a file to a log.

use std::path::Path;

use crate::content::Content;
use crate::{Error, Log, bag_folder, format};

/// How to read a log.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ReadOptions {
    /// The time column and its unit; `None` to recognise both by name and header.
    pub time: Option<TimeColumn>,
    /// Added to every time, s, to bring several files to one clock.
    pub offset_s: f64,
    /// The rate of a table without a time column: row k is at k / `equal_sampling_hz`.
    pub equal_sampling_hz: Option<f64>,
    /// The sheet of a workbook; `None` for the first.
    pub sheet: Option<String>,
    /// The clock of messages that carry a stamp of their own.
    pub stamp: Stamp,
}

/// Which of a message's two times counts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Stamp {
    /// That in the message's header, of the measurement; of messages without one, that of receipt.
    #[default]
    Header,
    /// That at which the recorder received it.
    Receive,
}

/// Where a log's time is.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeColumn {
    /// The column, found as [`Log::channel`] finds channels; `None` to recognise it by its name.
    pub column: Option<String>,
    /// Its unit, in place of the one that the header states.
    pub unit: Option<String>,
}

/// Reads a file as a log.
///
/// What it is, its first bytes tell, never its name: a text table; an Excel workbook, of which
/// the sheet that `options` name is read, else the first; a Parquet or Arrow file, of which
/// instants, numbers, flags and texts are read and structs flattened to `a.b`; or any of these in a
/// gzip or zstd archive. The folder of a ROS 2 bag stands for the recordings that its
/// `metadata.yaml` lists, one after the other.
///
/// Of a table of text, commas, semicolons, tabs or blanks part the cells; lines that start with `#`,
/// `%` or `//`, and whatever stands above the header, are passed over. The header is the row of
/// names above the numbers; `u_velo [m/s]` and `T1 (us)` state units, as does a row of units below
/// the names. Time is the column that `options` name, else one called `time`, `t`, `timestamp` and the like:
/// numbers, ISO 8601 date-times (seconds since the Unix epoch; UTC where no offset is stated), or
/// times of day (seconds since midnight). Empty cells, `NaN`, `NA` and the like are missing: the
/// channel has no sample there. [`Log::notes`] tells whatever else was decided or dropped.
///
/// # Errors
/// Of the file: [`Error::Io`], [`Error::Directory`], [`Error::NotAFile`], [`Error::Binary`], [`Error::Empty`],
/// [`Error::Archive`], [`Error::TooMuch`], [`Error::Damaged`], [`Error::Unsupported`],
/// [`Error::NoSheet`].
/// Of the table: [`Error::NotATable`], [`Error::NoHeader`], [`Error::HeaderCells`],
/// [`Error::UnitsDiffer`], [`Error::SecondHeader`], [`Error::AmbiguousNumber`],
/// [`Error::OpenQuote`], [`Error::TooFewRows`]. Of time: [`Error::NoTime`], [`Error::NoChannel`]
/// for a column that `options` name, [`Error::TimeUnit`], [`Error::TimeNotReadable`],
/// [`Error::TimeGoesBackwards`]. [`Error::Option`] for a rate or an offset that cannot be.
///
/// # Example
/// ```
/// # use seaplant_log::{ReadOptions, read};
/// # let path = std::env::temp_dir().join("seaplant-log-read-example.csv");
/// std::fs::write(&path, "time [s],u [m/s]\n0.0,0.10\n0.1,0.12\n0.2,0.15\n")?;
/// let log = read(&path, &ReadOptions::default())?;
/// let u = log.channel("u")?;
/// assert_eq!(u.values(), [0.10, 0.12, 0.15]);
/// assert_eq!(u.unit.as_ref().map(|unit| unit.symbol()), Some("m/s"));
/// # std::fs::remove_file(&path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read(path: &Path, options: &ReadOptions) -> Result<Log, Error> {
    check(options, path)?;
    match bag_folder::recordings(path).as_deref() {
        Some([only]) => format::read(Content::open(only)?, options),
        Some(several) => bag_folder::read_all(path, several, options),
        None => format::read(Content::open(path)?, options),
    }
}

/// Reads bytes as [`read`] reads a file; `path` is what messages call them.
///
/// # Errors
/// As [`read`].
#[doc(hidden)]
pub fn read_bytes(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Log, Error> {
    check(options, path)?;
    format::read(Content::of_bytes(path, bytes.to_owned())?, options)
}

pub(crate) fn check(options: &ReadOptions, path: &Path) -> Result<(), Error> {
    let refuse = |option, found: String, expected| {
        Err(Error::Option { path: path.to_owned(), option, found, expected })
    };
    if !options.offset_s.is_finite() {
        let found = options.offset_s.to_string();
        return refuse("the time offset", found, "a finite number of seconds");
    }
    match options.equal_sampling_hz {
        Some(rate) if !(rate.is_finite() && rate > 0.0) => {
            refuse("the sampling rate", rate.to_string(), "a positive number of hertz")
        }
        Some(rate) if options.time.is_some() => {
            let expected = "left out where a time column is named";
            refuse("the sampling rate", rate.to_string(), expected)
        }
        _ => Ok(()),
    }
}
