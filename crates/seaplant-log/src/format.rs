//! Detects the format of a file from its first bytes, never from its name, and selects its reader.
//!
//! # To add a reader
//! 1. `readers/NAME.rs` with `recognises(head: &[u8]) -> bool` and `read(content: Content, options:
//!    &ReadOptions) -> Result<Log, Error>`. It takes the bytes through [`Content::stream`],
//!    [`Content::seekable`] or [`Content::bytes`] and hands groups of samples to an
//!    [`Assembly`](crate::assemble::Assembly), which sorts them, drops values that are not numbers
//!    or repeat a time, and makes the [`Log`]. A table goes through [`tabular`](crate::tabular).
//! 2. A [`Format`] with its name, a line in [`Format::RECOGNISED`] and one in [`read`]; one in
//!    [`Format::framing`] if its records can be separated anywhere in a file.
//! 3. Tests in `tests/NAME.rs`: every channel against files that an independent writer makes by
//!    `tests/reference/make_NAME.py` (see `tests/common/python.rs`), and errors and notes by their
//!    complete text. Small files of the same script for `tests/robust/`, which damages them by the
//!    thousand, and smaller ones by `fuzz/make_corpus.py` for `scripts/fuzz NAME`, which searches
//!    further, and for `tests/robust/corpus.rs`, which names the readers that have such files.

use crate::content::{Content, is_binary};
use crate::framing::Frame;
use crate::grid::{self, Grid};
use crate::readers::{
    arrow_ipc, dataflash, gzip, hdf5, mat5, mcap, nmea, parquet, pd0, rosbag1, sqlite, text, tlog,
    ulog, xlsx, zstd,
};
use crate::{Error, Log, ReadOptions};

/// File format.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Format {
    Text,
    Nmea,
    Gzip,
    Zstd,
    Xlsx,
    Parquet,
    ArrowIpc,
    Mcap,
    Sqlite,
    Rosbag1,
    DataFlash,
    Tlog,
    Ulog,
    Mat5,
    Hdf5,
    Pd0,
    /// Recognised by its first bytes but not supported; holds the name.
    Unsupported(&'static str),
}

/// Recognises a format from the first bytes of a file.
type Recognises = fn(&[u8]) -> bool;

impl Format {
    /// Formats that a reader recognises, in the order of detection.
    const RECOGNISED: &'static [(Recognises, Self)] = &[
        (gzip::recognises, Self::Gzip),
        (zstd::recognises, Self::Zstd),
        (xlsx::recognises, Self::Xlsx),
        (parquet::recognises, Self::Parquet),
        (arrow_ipc::recognises, Self::ArrowIpc),
        (mcap::recognises, Self::Mcap),
        (sqlite::recognises, Self::Sqlite),
        (rosbag1::recognises, Self::Rosbag1),
        (dataflash::recognises, Self::DataFlash),
        (ulog::recognises, Self::Ulog),
        (mat5::recognises, Self::Mat5),
        (hdf5::recognises, Self::Hdf5),
        (pd0::recognises, Self::Pd0),
        (tlog::recognises, Self::Tlog),
    ];

    /// Detects the format of a file that starts with `head`.
    pub(crate) fn detect(head: &[u8]) -> Self {
        if let Some((_, format)) = Self::RECOGNISED.iter().find(|(is, _)| is(head)) {
            return *format;
        }
        let stands = |at: usize, magic| head.get(at..).is_some_and(|rest| rest.starts_with(magic));
        if let Some((_, _, name)) = MAGIC.iter().find(|(at, magic, _)| stands(*at, magic)) {
            return Self::Unsupported(name);
        }
        let marked = encoding_rs::Encoding::for_bom(head).is_some();
        match head {
            _ if nmea::recognises(head) => Self::Nmea,
            _ if !marked && is_binary(head) => Self::Unsupported("binary data"),
            _ => Self::Text,
        }
    }

    /// Returns the common name of the format.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Text => "a text table",
            Self::Nmea => "NMEA 0183 sentences",
            Self::Gzip => "a gzip archive",
            Self::Zstd => "a zstd archive",
            Self::Xlsx => "an Excel workbook (.xlsx)",
            Self::Parquet => "a Parquet file",
            Self::ArrowIpc => "an Arrow file",
            Self::Mcap => "an MCAP file",
            Self::Sqlite => "an SQLite database, perhaps a ROS 2 bag",
            Self::Rosbag1 => "a ROS 1 bag",
            Self::DataFlash => "an ArduPilot DataFlash log (.BIN)",
            Self::Tlog => "a MAVLink telemetry log (.tlog)",
            Self::Ulog => "a PX4 ULog file (.ulg)",
            Self::Mat5 => "a MATLAB file",
            Self::Hdf5 => "an HDF5 file or a MATLAB 7.3 file",
            Self::Pd0 => "a Teledyne RDI PD0 file",
            Self::Unsupported(name) => name,
        }
    }

    /// Returns how records are framed; `None` for a format whose parts the reader of the complete
    /// file cannot read.
    pub(crate) fn framing(self) -> Option<Frame> {
        match self {
            Self::Text => Some(text::framing),
            Self::DataFlash => Some(dataflash::framing),
            Self::Tlog => Some(tlog::framing),
            Self::Pd0 => Some(pd0::framing),
            _ => None,
        }
    }
}

/// Reads a log of any format.
///
/// # Errors
/// [`Error::Binary`] of a format without a reader; those of the reader.
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    read_as(Format::detect(content.head()), content, options)
}

/// Reads a log of a known format.
///
/// # Errors
/// As [`read`].
pub(crate) fn read_as(
    format: Format,
    content: Content,
    options: &ReadOptions,
) -> Result<Log, Error> {
    match format {
        Format::Text => text::read(content, options),
        Format::Nmea => nmea::read(content, options),
        Format::Gzip => read(gzip::unpack(content)?, options),
        Format::Zstd => read(zstd::unpack(content)?, options),
        Format::Xlsx => xlsx::read(content, options),
        Format::Parquet => parquet::read(content, options),
        Format::ArrowIpc => arrow_ipc::read(content, options),
        Format::Mcap => mcap::read(content, options),
        Format::Sqlite => sqlite::read(content, options),
        Format::Rosbag1 => rosbag1::read(content, options),
        Format::DataFlash => dataflash::read(content, options),
        Format::Tlog => tlog::read(content, options),
        Format::Ulog => ulog::read(content, options),
        Format::Mat5 => mat5::read(content, options),
        Format::Hdf5 => hdf5::read(content, options),
        Format::Pd0 => pd0::read(content, options),
        Format::Unsupported(_) => Err(unsupported(&content)),
    }
}

/// Reads a table of any tabular format.
///
/// # Errors
/// [`Error::Binary`] of a format without tables; those of the reader.
pub(crate) fn table(content: Content) -> Result<Grid, Error> {
    match Format::detect(content.head()) {
        Format::Text => grid::read(content, &mut |_| Ok(None)),
        Format::Gzip => table(gzip::unpack(content)?),
        Format::Zstd => table(zstd::unpack(content)?),
        Format::Xlsx => xlsx::grid(content, None, &mut |_| Ok(None)),
        Format::Parquet => parquet::grid(content, &mut |_| Ok(None)),
        Format::ArrowIpc => arrow_ipc::grid(content, &mut |_| Ok(None)),
        _ => Err(unsupported(&content)),
    }
}

/// Returns the error for an unsupported file.
pub(crate) fn unsupported(content: &Content) -> Error {
    let looks_like = Format::detect(content.head()).name().to_owned();
    Error::Binary { path: content.path().to_owned(), looks_like }
}

/// Magic bytes of other formats that people take for logs, with their positions and names.
const MAGIC: &[(usize, &[u8], &str)] = &[
    (30, b"mimetypeapplication/vnd.oasis", "an OpenDocument file"),
    (0, b"PK\x03\x04", "a zip archive (unpack it first)"),
    (0, b"\xd0\xcf\x11\xe0", "an Excel workbook of the old kind (.xls) or with a password"),
    (0, b"CDF\x01", "a NetCDF file"),
    (0, b"CDF\x02", "a NetCDF file"),
    (0, b"CDF\x05", "a NetCDF file"),
    (0, b"\x93NUMPY", "a NumPy array"),
    (0, b"BZh", "a bzip2 archive (unpack it first)"),
    (0, b"\xfd7zXZ", "an xz archive (unpack it first)"),
    (0, b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive (unpack it first)"),
    (257, b"ustar", "a tar archive (unpack it first)"),
    (0, b"FEA1", "a Feather file of version 1"),
    (0, b"%PDF", "a PDF document"),
];
