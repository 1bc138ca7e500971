//! Notes on what a reader decided or dropped.

use std::fmt;
use std::path::{Path, PathBuf};

use crate::spelling::list;

/// One thing that a reader decided or dropped, to be judged with the result.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Note {
    /// Rows whose time is earlier than that of a row before them; they were sorted into place.
    OutOfOrder {
        /// The file.
        path: PathBuf,
        /// Number of rows.
        count: usize,
        /// The first of them.
        first_line: u64,
        /// Largest lag behind the latest time before, s.
        backwards_by_s: f64,
    },
    /// Rows that repeat a time; of each channel the first sample at that time was kept.
    RepeatedTime {
        /// The file.
        path: PathBuf,
        /// Number of rows.
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
        /// Number of rows.
        count: usize,
        /// All rows of the file.
        rows: usize,
        /// The first of them.
        first_line: u64,
    },
    /// Rows with fewer or more cells than the header; absent cells count as missing, cells without
    /// a name were dropped.
    RaggedRows {
        /// The file.
        path: PathBuf,
        /// Number of rows.
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
        /// Number of rows.
        count: usize,
        /// The first of them.
        first_line: u64,
        /// Its content.
        text: String,
    },
    /// Further copies of the header row; they were skipped.
    RepeatedHeader {
        /// The file.
        path: PathBuf,
        /// Number of rows.
        count: usize,
        /// The first of them.
        first_line: u64,
    },
    /// Rows with a quoted cell that spans several lines; each was read as one row, although a stray
    /// quotation mark may have joined several.
    RunOnCell {
        /// The file.
        path: PathBuf,
        /// Number of rows.
        count: usize,
        /// The first of them.
        first_line: u64,
    },
    /// A last row without a line end, whose last cell may be truncated; it was left out.
    CutRow {
        /// The file.
        path: PathBuf,
        /// The line of the row.
        line: u64,
        /// Its last cell.
        text: String,
    },
    /// Numbers with thousands separators, which were ignored.
    Thousands {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The first line with one.
        line: u64,
        /// That cell.
        text: String,
        /// The number in it.
        value: f64,
        /// Number of cells.
        count: usize,
    },
    /// A column of ambiguous numbers, which may have decimals or thousands; it was left out.
    AmbiguousColumn {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The first line with one.
        line: u64,
        /// That cell.
        text: String,
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
        /// Number of cells.
        count: usize,
        /// The rows of the table.
        rows: usize,
    },
    /// Rows that cannot be read; those before them were read.
    UnreadableRows {
        /// The file.
        path: PathBuf,
        /// The first of them, counted from 1.
        first_row: u64,
        /// The reason.
        reason: String,
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
        /// Number of rows searched.
        rows: usize,
    },
    /// A name that another column already has; the later one was renamed.
    DuplicateColumn {
        /// The file.
        path: PathBuf,
        /// The header text of both.
        column: String,
        /// New name of the later one.
        renamed: String,
    },
    /// Several columns could be time, and one was chosen.
    TimeChosen {
        /// The file.
        path: PathBuf,
        /// The chosen one.
        column: String,
        /// The others.
        others: Vec<String>,
    },
    /// A workbook has several sheets, and the first was read.
    SheetChosen {
        /// The file.
        path: PathBuf,
        /// The sheet read.
        sheet: String,
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
    /// The header of the time column states another unit than the requested one.
    TimeUnitReplaced {
        /// The file.
        path: PathBuf,
        /// The time column.
        column: String,
        /// The unit in its header.
        header: String,
        /// The unit used.
        stated: String,
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
    /// The file ends within a record; all records before it were read.
    Truncated {
        /// The file.
        path: PathBuf,
        /// Position of the truncated record, in bytes from the start of the file (unpacked, if it
        /// is an archive).
        byte: u64,
        /// The latest time before the end, s, if known.
        last_s: Option<f64>,
    },
    /// A truncated or damaged archive; everything that could be unpacked was read.
    ArchiveCut {
        /// The file.
        path: PathBuf,
        /// Kind of archive: "gzip".
        packing: &'static str,
        /// Number of bytes that could be unpacked.
        byte: u64,
        /// The fault, in words that follow the archive: "is cut off".
        reason: String,
    },
    /// Damaged records; they were skipped.
    CorruptRecords {
        /// The file.
        path: PathBuf,
        /// Number of damaged stretches.
        count: usize,
        /// Position of the first, in bytes from the start of the file.
        first_byte: u64,
        /// Total number of bytes skipped.
        bytes: u64,
    },
    /// The clock or epoch of the times, where there are several.
    Clock {
        /// The file.
        path: PathBuf,
        /// In words that follow "times are": "header stamps, seconds since the Unix epoch".
        clock: String,
    },
    /// The clock was set while the log was written.
    ClockStepped {
        /// The file.
        path: PathBuf,
        /// Groups of records that show it.
        groups: Vec<String>,
        /// The time before, in the first of them, s.
        from_s: f64,
        /// The time after, s.
        to_s: f64,
        /// Number of records after steps back, which were left out; 0 for steps ahead.
        left_out: usize,
    },
    /// The clock overflowed and restarted from its lowest value; its times were continued.
    ClockWrapped {
        /// The file.
        path: PathBuf,
        /// The first row after the first overflow.
        line: u64,
        /// The period that overflowed: "the day".
        cycle: &'static str,
        /// Number of overflows.
        count: usize,
        /// Time before and after, as in the column.
        step: [f64; 2],
    },
    /// The vehicle's computer, and with it the clock, restarted while the log was written.
    Restarted {
        /// The file.
        path: PathBuf,
        /// Times to which each later start was shifted, s.
        at_s: Vec<f64>,
    },
    /// Messages of unknown kinds; they were skipped.
    UnknownMessages {
        /// The file.
        path: PathBuf,
        /// Each unknown kind and its number of messages.
        numbers: Vec<(u32, usize)>,
    },
    /// Records without a readable time; they were dropped.
    RecordsWithoutTime {
        /// The file.
        path: PathBuf,
        /// Their groups.
        groups: Vec<String>,
        /// Number of such records.
        count: usize,
        /// Number of all records of these groups.
        of: usize,
    },
    /// Records earlier than one before them in their group; they were sorted into place.
    LateRecords {
        /// The file.
        path: PathBuf,
        /// Their groups.
        groups: Vec<String>,
        /// Number of such records.
        count: usize,
        /// Number of all records of these groups.
        of: usize,
        /// Largest lag behind the latest time before, s.
        backwards_by_s: f64,
    },
    /// Records that repeat a time of their group; of each channel the first sample at that time
    /// was kept.
    RepeatedTimes {
        /// The file.
        path: PathBuf,
        /// Their groups.
        groups: Vec<String>,
        /// Number of such records.
        count: usize,
        /// Number of all records of these groups.
        of: usize,
    },
    /// A note on a table that was read in part, for a line whose number is unknown.
    InPart(Box<Note>),
    /// Fields that make no channel.
    LeftOut {
        /// The file.
        path: PathBuf,
        /// The fields.
        columns: Vec<String>,
        /// The reason, in words that follow the name of one: "holds text".
        why: &'static str,
    },
}

impl Note {
    /// Returns the file that the note is about.
    pub fn path(&self) -> &Path {
        match self {
            Self::OutOfOrder { path, .. }
            | Self::RepeatedTime { path, .. }
            | Self::MissingTime { path, .. }
            | Self::RaggedRows { path, .. }
            | Self::SkippedRows { path, .. }
            | Self::RepeatedHeader { path, .. }
            | Self::RunOnCell { path, .. }
            | Self::CutRow { path, .. }
            | Self::Thousands { path, .. }
            | Self::AmbiguousColumn { path, .. }
            | Self::NotANumber { path, .. }
            | Self::UnreadableRows { path, .. }
            | Self::TextColumn { path, .. }
            | Self::AllMissing { path, .. }
            | Self::DuplicateColumn { path, .. }
            | Self::TimeChosen { path, .. }
            | Self::SheetChosen { path, .. }
            | Self::TimeUnitAssumed { path, .. }
            | Self::TimeUnitReplaced { path, .. }
            | Self::DecimalComma { path, .. }
            | Self::Encoding { path, .. }
            | Self::Truncated { path, .. }
            | Self::CorruptRecords { path, .. }
            | Self::ArchiveCut { path, .. }
            | Self::Clock { path, .. }
            | Self::ClockStepped { path, .. }
            | Self::ClockWrapped { path, .. }
            | Self::Restarted { path, .. }
            | Self::UnknownMessages { path, .. }
            | Self::RecordsWithoutTime { path, .. }
            | Self::LateRecords { path, .. }
            | Self::RepeatedTimes { path, .. }
            | Self::LeftOut { path, .. } => path,
            Self::InPart(note) => note.path(),
        }
    }

    /// Returns the likely unit of times without one: `"ms"`, `"us"` or `"ns"` where seconds were
    /// assumed and rows would be more than 10 s apart; `None` for other notes.
    pub fn likely_time_unit(&self) -> Option<&'static str> {
        /// Period that the rows of motion logs do not exceed, s.
        const RARE_S: f64 = 10.0;
        match self {
            Self::TimeUnitAssumed { period_s, .. } => match *period_s {
                period_s if period_s <= RARE_S => None,
                period_s if period_s <= 1e3 * RARE_S => Some("ms"),
                period_s if period_s <= 1e6 * RARE_S => Some("us"),
                _ => Some("ns"),
            },
            _ => None,
        }
    }

    /// Returns the line that the note refers to, if there is one.
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
            | Self::CutRow { line, .. }
            | Self::Thousands { line, .. }
            | Self::AmbiguousColumn { line, .. }
            | Self::ClockWrapped { line, .. }
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
        self.words(f)
    }
}

impl Note {
    /// Writes the note without its file and line.
    fn words(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InPart(note) => {
                f.write_str("in the parts that were read, ")?;
                note.words(f)
            }
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
            Self::CutRow { text, .. } => write!(
                f,
                "the last row has no line end, so its last cell, {text:?}, may be cut short; the \
                 row is left out: add a line end if it is complete"
            ),
            Self::Thousands { column, text, value, count, .. } => write!(
                f,
                "column {column:?} has {} separated thousands; {text:?} is read as {value}",
                first_of(*count, "cell with", "cells with")
            ),
            Self::AmbiguousColumn { column, text, .. } => write!(
                f,
                "column {column:?} has whole numbers and numbers such as {text:?}, which may have \
                 decimals or thousands; left out"
            ),
            Self::NotANumber { column, text, count, .. } => write!(
                f,
                "column {column:?} has {} not a number (here {text:?}); counted as missing",
                first_of(*count, "cell that is", "cells that are")
            ),
            Self::UnreadableRows { first_row, reason, .. } => write!(
                f,
                "the rows from {first_row} on cannot be read ({reason}); those before were"
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
                list(others)
            ),
            Self::SheetChosen { sheet, others, .. } => {
                write!(f, "the first sheet, {sheet:?}, is read, and not {}", list(others))
            }
            Self::TimeUnitAssumed { column, period_s, .. } => {
                write!(
                    f,
                    "the time column {column:?} states no unit; seconds assumed, so a row every \
                     {period_s:.6} s"
                )?;
                match self.likely_time_unit() {
                    Some(unit) => write!(f, "; is it {unit}?"),
                    None => Ok(()),
                }
            }
            Self::TimeUnitReplaced { column, header, stated, .. } => write!(
                f,
                "the header of the time column {column:?} states {header}, but {stated} was asked \
                 for and is used"
            ),
            Self::DecimalComma { text, .. } => {
                write!(f, "numbers have a decimal comma (here {text:?}); read as a decimal point")
            }
            Self::Encoding { encoding, .. } => {
                write!(f, "the text is not UTF-8; read as {encoding}")
            }
            Self::Truncated { byte, last_s, .. } => {
                write!(f, "the file is cut off in the record at byte {byte}")?;
                if let Some(last_s) = last_s {
                    write!(f, ", after {last_s:.3} s")?;
                }
                f.write_str("; all before was read")
            }
            Self::ArchiveCut { packing, byte, reason, .. } => write!(
                f,
                "the {packing} archive {reason}; the {byte} bytes that could be unpacked were read"
            ),
            Self::CorruptRecords { count, first_byte, bytes, .. } => write!(
                f,
                "{}, the first at byte {first_byte}; {bytes} bytes skipped",
                first_of(*count, "stretch is damaged", "stretches are damaged")
            ),
            Self::Clock { clock, .. } => write!(f, "times are {clock}"),
            Self::ClockStepped { groups, from_s, to_s, left_out, .. } => {
                let groups = list(groups);
                write!(f, "the clock of {groups} leaps from {from_s:.6} s to {to_s:.6} s")?;
                match left_out {
                    0 => f.write_str("; check what set it"),
                    1.. => write!(
                        f,
                        " and stays behind; {} left out: split the log there",
                        first_of(*left_out, "record from there on is", "records from there on are")
                    ),
                }
            }
            Self::ClockWrapped { cycle, count, step: [from, to], .. } => write!(
                f,
                "the time goes from {from} to {to}, where {cycle} runs out; times carry on from \
                 there ({})",
                first_of(*count, "time", "times")
            ),
            Self::Restarted { at_s, .. } => {
                let at: Vec<String> = at_s.iter().take(12).map(|at| format!("{at:.3} s")).collect();
                write!(
                    f,
                    "the autopilot was started anew {}, and its clock with it; what follows is \
                     moved to {}: the time between is not known",
                    first_of(at_s.len(), "time", "times"),
                    at.join(", ")
                )
            }
            Self::UnknownMessages { numbers, .. } => {
                let count: usize = numbers.iter().map(|(_, count)| count).sum();
                let kinds: Vec<String> = numbers.iter().map(|(kind, _)| kind.to_string()).collect();
                write!(
                    f,
                    "{} of no known kind; passed over: number {}",
                    first_of(count, "message is", "messages are"),
                    list(&kinds)
                )
            }
            Self::RecordsWithoutTime { groups, count, of, .. } => write!(
                f,
                "of {of} records of {} {} no readable time; dropped",
                list(groups),
                first_of(*count, "has", "have")
            ),
            Self::LateRecords { groups, count, of, backwards_by_s, .. } => write!(
                f,
                "of {of} records of {} {} earlier than one before, by up to {backwards_by_s:.6} s; \
                 sorted by time",
                list(groups),
                first_of(*count, "is", "are")
            ),
            Self::RepeatedTimes { groups, count, of, .. } => write!(
                f,
                "of {of} records of {} {} the time of another; each channel keeps its first sample \
                 at a time",
                list(groups),
                first_of(*count, "repeats", "repeat")
            ),
            Self::LeftOut { columns, why, .. } => match columns.len() {
                1 => write!(f, "{} {why}; left out", list(columns)),
                many => write!(f, "each of {many} fields {why}; left out: {}", list(columns)),
            },
        }
    }
}

/// Formats "1 row is", "3 rows are".
fn first_of(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
