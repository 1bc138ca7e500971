//! What a reader decided or dropped.

use std::fmt;
use std::path::{Path, PathBuf};

/// One thing that a reader decided or dropped, for whoever judges the result.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Note {
    /// Rows whose time is earlier than that of a row before them; they were sorted into place.
    OutOfOrder {
        /// The file.
        path: PathBuf,
        /// How many rows.
        count: usize,
        /// The first of them.
        first_line: u64,
        /// The furthest that one lies behind, s.
        backwards_by_s: f64,
    },
    /// Rows that repeat a time; of each channel the first sample at that time was kept.
    RepeatedTime {
        /// The file.
        path: PathBuf,
        /// How many rows.
        count: usize,
        /// All rows of the file.
        rows: usize,
        /// The first of them.
        first_line: u64,
    },
    /// Rows without a readable time; they were dropped.
    MissingTime {
        /// The file.
        path: PathBuf,
        /// How many rows.
        count: usize,
        /// The first of them.
        first_line: u64,
    },
    /// Rows with fewer or more cells than the header; cells that lack count as missing, cells
    /// without a name were dropped.
    RaggedRows {
        /// The file.
        path: PathBuf,
        /// How many rows.
        count: usize,
        /// The first of them.
        first_line: u64,
        /// The cells in that row.
        found: usize,
        /// The cells of the header.
        expected: usize,
    },
    /// Rows of a single cell in a table of several columns; they were skipped.
    SkippedRows {
        /// The file.
        path: PathBuf,
        /// How many rows.
        count: usize,
        /// The first of them.
        first_line: u64,
        /// What it holds.
        text: String,
    },
    /// Further copies of the header row; they were skipped.
    RepeatedHeader {
        /// The file.
        path: PathBuf,
        /// How many rows.
        count: usize,
        /// The first of them.
        first_line: u64,
    },
    /// Rows with a quoted cell that runs over several lines; each was read as one row, which a
    /// stray quotation mark makes of many.
    RunOnCell {
        /// The file.
        path: PathBuf,
        /// How many rows.
        count: usize,
        /// The first of them.
        first_line: u64,
    },
    /// Text in a column of numbers; it counts as missing.
    NotANumber {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The first line with text.
        line: u64,
        /// That text.
        text: String,
        /// How many cells.
        count: usize,
    },
    /// A column of text; it was left out.
    TextColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The first line with text.
        line: u64,
        /// That text.
        text: String,
    },
    /// A column without a value; it was left out.
    AllMissing {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The rows in which it was looked for.
        rows: usize,
    },
    /// A name that another column has already; the later one was renamed.
    DuplicateColumn {
        /// The file.
        path: PathBuf,
        /// The header text of both.
        column: String,
        /// The later one's name now.
        renamed: String,
    },
    /// Several columns could be time, and one was taken.
    TimeChosen {
        /// The file.
        path: PathBuf,
        /// The one taken.
        column: String,
        /// The others.
        others: Vec<String>,
    },
    /// No unit of time is stated; seconds were assumed.
    TimeUnitAssumed {
        /// The file.
        path: PathBuf,
        /// The time column.
        column: String,
        /// The median time between rows that follows, s.
        period_s: f64,
    },
    /// Numbers are written with a decimal comma.
    DecimalComma {
        /// The file.
        path: PathBuf,
        /// The first line with one.
        line: u64,
        /// The cell.
        text: String,
    },
    /// The text is not UTF-8 and was read in another encoding.
    Encoding {
        /// The file.
        path: PathBuf,
        /// The encoding.
        encoding: &'static str,
    },
}

impl Note {
    /// The file that the note is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::OutOfOrder { path, .. }
            | Self::RepeatedTime { path, .. }
            | Self::MissingTime { path, .. }
            | Self::RaggedRows { path, .. }
            | Self::SkippedRows { path, .. }
            | Self::RepeatedHeader { path, .. }
            | Self::RunOnCell { path, .. }
            | Self::NotANumber { path, .. }
            | Self::TextColumn { path, .. }
            | Self::AllMissing { path, .. }
            | Self::DuplicateColumn { path, .. }
            | Self::TimeChosen { path, .. }
            | Self::TimeUnitAssumed { path, .. }
            | Self::DecimalComma { path, .. }
            | Self::Encoding { path, .. } => path,
        }
    }

    /// The line that the note points at, where it points at one.
    pub fn line(&self) -> Option<u64> {
        match self {
            Self::OutOfOrder { first_line, .. }
            | Self::RepeatedTime { first_line, .. }
            | Self::MissingTime { first_line, .. }
            | Self::RaggedRows { first_line, .. }
            | Self::SkippedRows { first_line, .. }
            | Self::RepeatedHeader { first_line, .. }
            | Self::RunOnCell { first_line, .. } => Some(*first_line),
            Self::NotANumber { line, .. }
            | Self::TextColumn { line, .. }
            | Self::DecimalComma { line, .. } => Some(*line),
            _ => None,
        }
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path().display())?;
        if let Some(line) = self.line() {
            write!(f, ":{line}")?;
        }
        f.write_str(": ")?;
        match self {
            Self::OutOfOrder { count, backwards_by_s, .. } => write!(
                f,
                "{} earlier than a row before, by up to {backwards_by_s:.6} s; sorted by time",
                first_of(*count, "row is", "rows are")
            ),
            Self::RepeatedTime { count, rows, .. } => {
                write!(
                    f,
                    "of {rows} rows {} the time of another; each channel keeps its first sample at a \
                     time",
                    first_of(*count, "repeats", "repeat")
                )?;
                if 2 * count > *rows {
                    f.write_str(" (the clock is coarser than the sampling)")?;
                }
                Ok(())
            }
            Self::MissingTime { count, .. } => {
                write!(f, "{} no readable time; dropped", first_of(*count, "row has", "rows have"))
            }
            Self::RaggedRows { count, found, expected, .. } => write!(
                f,
                "{} have {expected} cells (here {found}); absent cells count as missing, further \
                 ones are dropped",
                first_of(*count, "row does not", "rows do not")
            ),
            Self::SkippedRows { count, text, .. } => write!(
                f,
                "{} a single cell (here {text:?}); skipped",
                first_of(*count, "row holds", "rows hold")
            ),
            Self::RepeatedHeader { count, .. } => {
                write!(f, "{} the header; skipped", first_of(*count, "row repeats", "rows repeat"))
            }
            Self::RunOnCell { count, .. } => write!(
                f,
                "{} a quoted cell that runs over several lines; read as one row: check the \
                 quotation marks",
                first_of(*count, "row holds", "rows hold")
            ),
            Self::NotANumber { column, text, count, .. } => write!(
                f,
                "column {column:?} has {} not a number (here {text:?}); counted as missing",
                first_of(*count, "cell that is", "cells that are")
            ),
            Self::TextColumn { column, text, .. } => {
                write!(f, "column {column:?} holds text (here {text:?}); left out")
            }
            Self::AllMissing { column, rows, .. } => {
                write!(f, "column {column:?} has no value in any of {rows} rows; left out")
            }
            Self::DuplicateColumn { column, renamed, .. } => {
                write!(f, "a second column is headed {column:?}; it is named {renamed:?} here")
            }
            Self::TimeChosen { column, others, .. } => write!(
                f,
                "column {column:?} is taken as time, though {} could be too",
                crate::lookup::list(others)
            ),
            Self::TimeUnitAssumed { column, period_s, .. } => write!(
                f,
                "the time column {column:?} states no unit; seconds assumed, so a row every \
                 {period_s:.6} s"
            ),
            Self::DecimalComma { text, .. } => {
                write!(f, "numbers have a decimal comma (here {text:?}); read as a decimal point")
            }
            Self::Encoding { encoding, .. } => {
                write!(f, "the text is not UTF-8; read as {encoding}")
            }
        }
    }
}

/// "1 row is", "3 rows are".
fn first_of(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
