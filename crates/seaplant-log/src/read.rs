//! Reads files as logs.

use std::path::{Path, PathBuf};

use crate::content::Content;
use crate::{Error, Log, ReadOptions, bag_folder, format};

/// Reads a file as a log.
///
/// The format is detected from the first bytes, never from the name: a text table; an Excel
/// workbook, from which the sheet named in `options` is read, else the first; a Parquet or Arrow
/// file, from which instants, numbers, flags and texts are read and structs flattened to `a.b`; or
/// any of these in a gzip or zstd archive. The folder of a ROS 2 bag stands for the recordings that
/// its `metadata.yaml` lists, one after the other.
///
/// In a text table, commas, semicolons, tabs or blanks separate the cells; lines that start with
/// `#`, `%` or `//`, and any lines above the header, are skipped. The header is the row of names
/// above the numbers; `u_velo [m/s]` and `T1 (us)` state units, as does a row of units below the
/// names. Time is the column named in `options`, else one called `time`, `t`, `timestamp` and the
/// like: numbers, ISO 8601 date-times (seconds since the Unix epoch; UTC where no offset is
/// stated), or times of day (seconds since midnight). Empty cells, `NaN`, `NA` and the like are
/// missing: the channel has no sample there. [`Log::notes`] reports all other decisions and dropped
/// values.
///
/// # Errors
/// For the file: [`Error::Io`], [`Error::Directory`], [`Error::NotAFile`], [`Error::Binary`], [`Error::Empty`],
/// [`Error::Archive`], [`Error::TooMuch`], [`Error::Damaged`], [`Error::Unsupported`],
/// [`Error::NoSheet`].
/// For the table: [`Error::NotATable`], [`Error::NoHeader`], [`Error::HeaderCells`],
/// [`Error::UnitsDiffer`], [`Error::SecondHeader`], [`Error::AmbiguousNumber`],
/// [`Error::OpenQuote`], [`Error::TooFewRows`]. For time: [`Error::NoTime`], [`Error::NoChannel`]
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
    options.check(path)?;
    match bag_folder::recordings(path).as_deref() {
        Some([only]) => format::read(Content::open(only)?, options),
        Some(several) => bag_folder::join(path, several.iter().map(|one| read(one, options))),
        None => format::read(Content::open(path)?, options),
    }
}

impl Log {
    /// Reads the files of one trial; each channel keeps the times of its file.
    ///
    /// # Errors
    /// [`Error::NoFiles`], and whatever [`read`] fails with.
    pub fn open(files: &[(PathBuf, ReadOptions)]) -> Result<Self, Error> {
        if files.is_empty() {
            return Err(Error::NoFiles);
        }
        let mut log = Self::default();
        for (path, options) in files {
            log = log.merge(read(path, options)?);
        }
        Ok(log)
    }
}

/// Reads bytes as [`read`] reads a file; messages call them `path`.
///
/// # Errors
/// As [`read`].
#[doc(hidden)]
pub fn read_bytes(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Log, Error> {
    options.check(path)?;
    format::read(Content::of_bytes(path, bytes.to_owned())?, options)
}
