//! Tables without time: bollard pull, thrust curves.

use std::path::{Path, PathBuf};

use crate::column::Column;
use crate::content::Content;
use crate::grid::Lines;
use crate::log::{LeftOut, Reason, Source};
use crate::lookup::{self, Candidate};
use crate::note::Note;
use crate::{Error, Unit, format};

/// A table of numbers whose rows have no order.
#[derive(Debug, Clone)]
pub struct Table {
    /// The file.
    pub path: PathBuf,
    /// The file's size, hash and format.
    pub source: Source,
    /// Its columns, from left to right.
    pub columns: Vec<TableColumn>,
    /// The line of the header.
    pub header_line: u64,
    /// The line of the first row.
    pub first_line: u64,
    notes: Vec<Note>,
    rows: usize,
    lines: Lines,
}

/// A column of a [`Table`].
#[derive(Debug, Clone, PartialEq)]
pub struct TableColumn {
    /// The name, without the unit.
    pub name: String,
    /// Header text.
    pub column: String,
    /// The unit that the header states.
    pub unit: Option<Unit>,
    /// The value of each row; `None` where the cell holds no number.
    pub values: Vec<Option<f64>>,
    /// Reason why it holds no number, if it holds none.
    reason: Reason,
}

/// Reads a table that needs no time column: text, the first sheet of a workbook, Parquet, Arrow,
/// or one of these in an archive.
///
/// Delimiter, header, units, missing values: as [`read`](crate::read()).
///
/// # Errors
/// Those of [`read`](crate::read()) but for the ones about time; [`Error::CutRow`] if the last row
/// has no line end.
pub fn read_table(path: &Path) -> Result<Table, Error> {
    let grid = format::table(Content::open(path)?)?;
    if grid.rows == 0 {
        return Err(Error::TooFewRows { path: path.to_owned(), rows: 0, needed: 1 });
    }
    let mut notes = grid.notes;
    if let Some(error) = notes.iter().find_map(cut_row) {
        return Err(error);
    }
    let mut columns = Vec::with_capacity(grid.columns.len());
    for column in grid.columns {
        if column.is_margin() {
            continue;
        }
        notes.extend(column.note(path, grid.rows));
        columns.push(TableColumn::new(column, grid.rows));
    }
    let first_line = grid.lines.line(0);
    let (header_line, lines) = (grid.header_line, grid.lines);
    notes.extend(grid.origin.notes());
    let source = grid.origin.source(grid.format)?;
    let (path, rows) = (path.to_owned(), grid.rows);
    Ok(Table { path, source, columns, header_line, first_line, notes, rows, lines })
}

/// Returns the error for a table whose last row may be truncated: a curve has few points, so each
/// matters.
fn cut_row(note: &Note) -> Option<Error> {
    let Note::CutRow { path, line, text } = note else { return None };
    Some(Error::CutRow { path: path.clone(), line: *line, text: text.clone() })
}

impl TableColumn {
    fn new(column: Column, rows: usize) -> Self {
        let mut values = vec![None; rows];
        for (row, value) in column.samples.iter() {
            values[row] = Some(value);
        }
        let (reason, heading) = (column.reason(), column.heading);
        Self { name: heading.name, column: heading.column, unit: heading.unit, values, reason }
    }

    /// Returns the rows without a number.
    pub fn missing(&self) -> usize {
        self.values.iter().filter(|value| value.is_none()).count()
    }

    /// Returns whether no row holds a number.
    pub fn is_empty(&self) -> bool {
        self.values.iter().all(Option::is_none)
    }
}

impl Table {
    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the line of the file that holds `row`, counted from 0.
    pub fn line(&self, row: usize) -> u64 {
        self.lines.line(row)
    }

    /// Returns the notes on what the reader decided or dropped.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// Returns the column of that name, found as [`Log::channel`](crate::Log::channel) finds
    /// channels.
    ///
    /// # Errors
    /// [`Error::NoChannel`], [`Error::Ambiguous`], [`Error::AllMissing`], [`Error::AllText`].
    pub fn column(&self, name: &str) -> Result<&TableColumn, Error> {
        let path = self.path.as_path();
        let columns = self.columns.iter();
        let candidates: Vec<Candidate<'_>> = columns
            .map(|c| Candidate { column: &c.column, name: &c.name, path, empty: c.is_empty() })
            .collect();
        let column = &self.columns[lookup::find(name, &candidates)?];
        if !column.is_empty() {
            return Ok(column);
        }
        let left_out = LeftOut {
            column: column.column.clone(),
            name: column.name.clone(),
            source: 0,
            rows: self.rows,
            reason: column.reason.clone(),
        };
        Err(left_out.error(path))
    }
}
