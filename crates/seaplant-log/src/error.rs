//! Errors of reading logs, with advice.

use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

use crate::dimension::Dimension;
use crate::spelling::list;
use crate::symbol::{self, symbols_of};

/// Reason why a log could not be read or a column was not found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system would not give the file.
    #[error("cannot read {}: {source}; {}", path.display(), io_advice(source))]
    Io {
        /// The file.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },

    /// The path is a folder.
    #[error("{} is a folder; name the log file inside it", path.display())]
    Directory {
        /// The folder.
        path: PathBuf,
    },

    /// The path is a pipe, a socket or a device.
    #[error(
        "{} is a pipe or a device, not a regular file; save its content to a file and name that",
        path.display()
    )]
    NotAFile {
        /// The path.
        path: PathBuf,
    },

    /// No file was named.
    #[error("no log file was given; name at least one")]
    NoFiles,

    /// A log with implausibly many columns.
    #[error(
        "{} names more than {most} columns, which is not plausible for a log; check its separators, \
         or export only the columns that you need",
        path.display()
    )]
    TooManyColumns {
        /// The file.
        path: PathBuf,
        /// The most columns that are read.
        most: usize,
    },

    /// A column name of implausible length.
    #[error(
        "{} names a column with {found} bytes (starting {start:?}), and {most} at most are read; \
         check that its first line is a header",
        path.display()
    )]
    LongName {
        /// The file.
        path: PathBuf,
        /// The first characters of the name.
        start: String,
        /// Bytes of the name.
        found: usize,
        /// Bytes of a name that are read, at most.
        most: usize,
    },

    /// A column in memory whose length differs from that of the times.
    #[error(
        "column {column:?} of {} has {found} {} for {expected} times; give one for each",
        path.display(),
        if *found == 1 { "value" } else { "values" }
    )]
    Rows {
        /// Name of the log.
        path: PathBuf,
        /// The column.
        column: String,
        /// Its values.
        found: usize,
        /// The times.
        expected: usize,
    },

    /// The file is neither text nor of a supported format.
    #[error(
        "{}: unsupported format (looks like {looks_like}); export it as CSV",
        path.display()
    )]
    Binary {
        /// The file.
        path: PathBuf,
        /// Format that its first bytes suggest.
        looks_like: String,
    },

    /// A file whose structure is too damaged to read.
    #[error(
        "{} cannot be read as {format}: at byte {byte}, {found}; copy the file again from where it \
         was recorded, or export it as CSV",
        path.display()
    )]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// Format, such as "an MCAP file".
        format: &'static str,
        /// Position of the damage, in bytes from the start.
        byte: u64,
        /// Content at that position.
        found: String,
    },

    /// A packed file that unpacks to far more than a log of its size can hold.
    #[error(
        "{}: {packed} bytes unpack to more than {unpacked}, which is not plausible for a log; if it \
         is one, unpack it first",
        path.display()
    )]
    TooMuch {
        /// The file.
        path: PathBuf,
        /// The packed bytes read.
        packed: u64,
        /// The bytes that they unpacked to.
        unpacked: u64,
    },

    /// An archive that cannot be unpacked at all.
    #[error(
        "{} is a {packing} archive that {reason} from its start; copy it again from where it was \
         made",
        path.display()
    )]
    Archive {
        /// The file.
        path: PathBuf,
        /// Kind of archive: "gzip".
        packing: &'static str,
        /// The fault, in words that follow "that": "is cut off".
        reason: String,
    },

    /// A file of a known format that its reader rejects.
    #[error(
        "{} cannot be read as {format}: {found}; copy the file again from where it was recorded, or \
         export it as CSV",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Format, such as "a Parquet file".
        format: &'static str,
        /// The fault.
        found: String,
    },

    /// A workbook without the requested sheet.
    #[error("{} has no sheet {wanted:?}; its sheets are {}", path.display(), list(sheets))]
    NoSheet {
        /// The file.
        path: PathBuf,
        /// The requested sheet.
        wanted: String,
        /// Every sheet that holds cells.
        sheets: Vec<String>,
    },

    /// A file of a known format with a feature that the reader does not support.
    #[error("{} is {format} {detail}, which is not supported; {advice}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// Format, such as "an MCAP file".
        format: &'static str,
        /// The unsupported feature, in words that follow the format: "with xz compression".
        detail: String,
        /// Advice.
        advice: &'static str,
    },

    /// A file of a known format without any numbers.
    #[error(
        "{} ({format}) holds no numbers with times; check that the recording was saved and copied \
         whole",
        path.display()
    )]
    NoSamples {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: String,
    },

    /// The file is empty or holds only blank lines.
    #[error("{} is empty; check that the recording was saved and copied whole", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },

    /// Text, but without rows of numbers.
    #[error(
        "{} holds no table: none of its first {rows} rows is mostly numbers; give a CSV file with \
         one header row above rows of numbers",
        path.display()
    )]
    NotATable {
        /// The file.
        path: PathBuf,
        /// Number of rows inspected.
        rows: usize,
    },

    /// Numbers start without a row of names above them.
    #[error(
        "{}:{line}: the numbers start here without a header row above; add a first line that names \
         each of the {cells} columns, units in brackets, such as \"time [s]\"",
        path.display()
    )]
    NoHeader {
        /// The file.
        path: PathBuf,
        /// The first row of numbers.
        line: u64,
        /// The cells in it.
        cells: usize,
    },

    /// The header names fewer or more columns than the rows hold.
    #[error(
        "{}:{line}: the header names {header} columns, but the rows from line {row_line} hold \
         {row} cells, so names and numbers cannot be matched; correct the header or put names that \
         hold the separator in quotes",
        path.display()
    )]
    HeaderCells {
        /// The file.
        path: PathBuf,
        /// The line of the header.
        line: u64,
        /// The cells of the header.
        header: usize,
        /// The first line of numbers.
        row_line: u64,
        /// The cells of that line.
        row: usize,
    },

    /// The header and the row of units below it contradict each other.
    #[error(
        "{}:{line}: the row of units gives {below:?} for column {column:?}, whose header states \
         {header:?}; correct one of the two",
        path.display()
    )]
    UnitsDiffer {
        /// The file.
        path: PathBuf,
        /// The line of the row of units.
        line: u64,
        /// The column.
        column: String,
        /// The unit in the header.
        header: String,
        /// The unit below it.
        below: String,
    },

    /// A second header, with other names or units than the first.
    #[error(
        "{}:{line}: a second header starts here, with {found:?} where the first has {expected:?}; \
         split the file there, so that each part has one header",
        path.display()
    )]
    SecondHeader {
        /// The file.
        path: PathBuf,
        /// The line of the second header.
        line: u64,
        /// Its content.
        found: String,
        /// Content of the first header at that place.
        expected: String,
    },

    /// Numbers such as `1.588`, which may have decimals or thousands, and no number that decides
    /// it.
    #[error(
        "{}:{line}: {text:?} in column {column:?} may have decimals or thousands, and no other \
         number shows which; write thousands without a sign between them, or decimals with \
         another number of digits",
        path.display()
    )]
    AmbiguousNumber {
        /// The file.
        path: PathBuf,
        /// The first line with one.
        line: u64,
        /// Its column.
        column: String,
        /// The cell.
        text: String,
    },

    /// A table without time whose last row has no line end.
    #[error(
        "{}:{line}: the last row has no line end, so its last cell, {text:?}, may be cut short; add \
         a line end if the row is complete",
        path.display()
    )]
    CutRow {
        /// The file.
        path: PathBuf,
        /// The line of the row.
        line: u64,
        /// Its last cell.
        text: String,
    },

    /// Too few rows of numbers to use.
    #[error(
        "{} holds {rows} usable row(s) of data and at least {needed} are needed; check that the \
         recording was saved and copied whole",
        path.display()
    )]
    TooFewRows {
        /// The file.
        path: PathBuf,
        /// Rows with data (in a log, with distinct times).
        rows: usize,
        /// Rows needed.
        needed: usize,
    },

    /// A quoted cell runs to the end of the file.
    #[error(
        "{}:{line}: a quotation mark opens here and is never closed, so the rest of the file is \
         one cell; close or remove it",
        path.display()
    )]
    OpenQuote {
        /// The file.
        path: PathBuf,
        /// The line of the mark.
        line: u64,
    },

    /// No column is recognised as time.
    #[error(
        "{}: no column is recognised as time; name it in campaign.toml under [time], or give an \
         equal sampling rate there if the rows are equally spaced; the columns are {}",
        path.display(),
        list(columns)
    )]
    NoTime {
        /// The file.
        path: PathBuf,
        /// Its columns.
        columns: Vec<String>,
    },

    /// The time column's unit does not measure time.
    #[error(
        "{}: the time column {column:?} has the unit {unit:?}, which is not one of time; write one \
         of {}",
        path.display(),
        accepted.join(", ")
    )]
    TimeUnit {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The unit found.
        unit: String,
        /// The accepted units.
        accepted: Vec<&'static str>,
    },

    /// No cell of the time column could be read.
    #[error(
        "{}:{line}: the time column {column:?} holds no readable time (here {text:?}); give \
         numbers or ISO 8601 such as 2020-07-31T13:50:28.5Z",
        path.display()
    )]
    TimeNotReadable {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The line of the first cell.
        line: u64,
        /// Content of that cell.
        text: String,
    },

    /// The clock was reset.
    #[error(
        "{}:{line}: time goes back from {from_s} s to {to_s} s and stays behind; split the file \
         there, correct the row before if its time is wrong, or name another time column in \
         campaign.toml under [time]",
        path.display()
    )]
    TimeGoesBackwards {
        /// The file.
        path: PathBuf,
        /// The first line after the jump.
        line: u64,
        /// The latest time before it, s.
        from_s: f64,
        /// The time after it, s.
        to_s: f64,
    },

    /// An invalid value of [`ReadOptions`](crate::ReadOptions).
    #[error("{}: {option} is {found}, and must be {expected}", path.display())]
    Option {
        /// The file to be read.
        path: PathBuf,
        /// The option.
        option: &'static str,
        /// Its value.
        found: String,
        /// The accepted values.
        expected: &'static str,
    },

    /// No column has that name.
    #[error(
        "no column {wanted:?} in {}; {}the columns are {}",
        files(paths),
        did_you_mean(nearest),
        list(available)
    )]
    NoChannel {
        /// The requested name.
        wanted: String,
        /// The files searched.
        paths: Vec<PathBuf>,
        /// The most similar columns, the nearest first.
        nearest: Vec<String>,
        /// Every column.
        available: Vec<String>,
    },

    /// Several columns have that name.
    #[error(
        "column {wanted:?} is ambiguous; write FILE:COLUMN with the header's full text: {}",
        choices.join(" or ")
    )]
    Ambiguous {
        /// The requested name.
        wanted: String,
        /// The names that distinguish them.
        choices: Vec<String>,
    },

    /// The column exists and holds no value.
    #[error(
        "column {column:?} of {} is empty: no value in any of its {rows} rows; choose another, or \
         check that the instrument was on",
        path.display()
    )]
    AllMissing {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// Number of rows searched.
        rows: usize,
    },

    /// The column exists and holds only text.
    #[error(
        "{}:{line}: column {column:?} holds text such as {text:?} and no number; choose another",
        path.display()
    )]
    AllText {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The first line with text.
        line: u64,
        /// That text.
        text: String,
    },

    /// The column exists, and its content cannot be a channel.
    #[error("column {column:?} of {} {why}; choose another", path.display())]
    LeftOut {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The reason, in words that follow its name: "is a list of varying length".
        why: &'static str,
    },

    /// An unknown unit.
    #[error("unknown unit {unit:?}; {}", unit_advice(nearest, expected))]
    UnknownUnit {
        /// The unit as written.
        unit: String,
        /// The most similar known unit.
        nearest: Option<&'static str>,
        /// The expected quantity, if known.
        expected: Option<Dimension>,
    },

    /// A unit of another quantity.
    #[error(
        "{unit:?} is a unit of {found} where one of {expected} is needed; write one of {}",
        accepted.join(", ")
    )]
    Dimension {
        /// The unit as written.
        unit: String,
        /// The quantity of that unit.
        found: Dimension,
        /// The expected quantity.
        expected: Dimension,
        /// The accepted units.
        accepted: Vec<&'static str>,
    },
}

/// An archive that holds more than a log of its size can; a source of [`io::Error`] that
/// [`Error::io`] recognises.
#[derive(Debug)]
pub(crate) struct TooMuch {
    /// Number of bytes unpacked.
    pub(crate) unpacked: u64,
    /// Number of packed bytes that they came from.
    pub(crate) packed: u64,
}

impl fmt::Display for TooMuch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes unpack to more than {}", self.packed, self.unpacked)
    }
}

impl std::error::Error for TooMuch {}

impl Error {
    pub(crate) fn io(path: &Path, source: io::Error) -> Self {
        let too_much = source.get_ref().and_then(|inner| inner.downcast_ref::<TooMuch>());
        if let Some(&TooMuch { unpacked, packed }) = too_much {
            return Self::TooMuch { path: path.to_owned(), packed, unpacked };
        }
        Self::Io { path: path.to_owned(), source }
    }
}

fn io_advice(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::NotFound => "check the spelling and the folder",
        io::ErrorKind::PermissionDenied => "allow this account to read it",
        _ => "check the disk or copy the file again",
    }
}

fn files(paths: &[PathBuf]) -> String {
    if paths.is_empty() {
        return "this log".to_owned();
    }
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

fn did_you_mean(nearest: &[String]) -> String {
    match nearest {
        [] => String::new(),
        names => {
            let quoted: Vec<String> = names.iter().map(|n| format!("{n:?}")).collect();
            format!("did you mean {}? ", quoted.join(" or "))
        }
    }
}

fn unit_advice(nearest: &Option<&'static str>, expected: &Option<Dimension>) -> String {
    let known: Vec<&str> = match (nearest, expected) {
        (Some(near), _) => return format!("did you mean {near:?}?"),
        (None, Some(expected)) => symbols_of(*expected).collect(),
        (None, None) => symbol::known().collect(),
    };
    format!("write one of {}", known.join(", "))
}
