//! A text table in memory: columns of numbers without missing values.

use std::path::Path;

use csv::ByteRecord;

use crate::cell::{Cell, Decimal, Sign, excerpt};
use crate::column::{Column, Samples, tell_apart};
use crate::content::{Content, Origin};
use crate::heading::Heading;
use crate::input::Input;
use crate::layout::{self, Delimiter, Layout};
use crate::note::Note;
use crate::second_header::{self, SecondHeader};
use crate::separators;
use crate::time::time_cell;
use crate::{Epoch, Error};

/// A table as read, before its time column is interpreted.
pub(crate) struct Grid {
    pub(crate) origin: Origin,
    /// File format, such as "comma-separated text".
    pub(crate) format: String,
    pub(crate) columns: Vec<Column>,
    pub(crate) rows: usize,
    pub(crate) lines: Lines,
    pub(crate) header_line: u64,
    /// True if the time column holds date-times.
    pub(crate) stamped: bool,
    /// Epoch of the times, if it was determined.
    pub(crate) epoch: Option<Epoch>,
    pub(crate) notes: Vec<Note>,
    /// Columns whose type is not a series of numbers, and why: see [`Assembly::leave_out`].
    ///
    /// [`Assembly::leave_out`]: crate::assemble::Assembly::leave_out
    pub(crate) left_out: Vec<(String, &'static str)>,
}

/// Line of each row, stored as the few rows where the offset between lines and rows changes.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Lines(Vec<(usize, u64)>);

impl Lines {
    #[inline]
    fn push(&mut self, row: usize, line: u64) {
        if self.0.is_empty() || self.line(row) != line {
            self.0.push((row, line));
        }
    }

    /// Creates the lines of a table that has none: rows counted from 1.
    pub(crate) fn of_rows() -> Self {
        Self(vec![(0, 1)])
    }

    /// Returns the line of a row.
    pub(crate) fn line(&self, row: usize) -> u64 {
        let known = match self.0.last() {
            Some(&last) if last.0 <= row => last,
            _ => match self.0.partition_point(|&(start, _)| start <= row) {
                0 => return 0,
                after => self.0[after - 1],
            },
        };
        known.1 + (row - known.0) as u64
    }
}

/// Chooses the time column of a table, if it has one, which may hold date-times.
pub(crate) type ChooseTime<'a> = &'a mut dyn FnMut(&[Heading]) -> Result<Option<usize>, Error>;

/// Reads a text table.
///
/// # Errors
/// For the file: [`Error::Io`], [`Error::Binary`], [`Error::Empty`]. For the table:
/// [`Error::NotATable`], [`Error::NoHeader`], [`Error::HeaderCells`], [`Error::UnitsDiffer`],
/// [`Error::SecondHeader`], [`Error::AmbiguousNumber`], [`Error::OpenQuote`],
/// [`Error::TooFewRows`]; those of `choose_time`.
pub(crate) fn read(content: Content, choose_time: ChooseTime<'_>) -> Result<Grid, Error> {
    let mut input = Input::new(content)?;
    let path = &input.path().to_owned();
    let mut layout = layout::find(&input)?;
    let mut notes = Vec::new();
    if let Some(encoding) = input.encoding() {
        notes.push(Note::Encoding { path: path.to_owned(), encoding });
    } else if layout.header.iter().any(|cell| std::str::from_utf8(cell).is_err()) {
        notes.push(Note::Encoding { path: path.to_owned(), encoding: "windows-1252" });
    }
    if layout.delimiter == Delimiter::Blanks {
        input.squeeze_blanks();
    }
    let mut rows = Rows::new(path, &mut layout, notes, choose_time)?;
    let (origin, format) = rows.read_all(input, &layout)?;
    Ok(rows.into_grid(origin, format, &layout))
}

/// Gives every column a unique name and header text.
pub(crate) fn tell_headings_apart(headings: &mut [Heading], path: &Path, notes: &mut Vec<Note>) {
    for (k, heading) in headings.iter_mut().enumerate().filter(|(_, h)| h.nameless) {
        heading.column = format!("column {}", k + 1);
        heading.name = heading.column.clone();
    }
    tell_apart(headings.iter_mut().map(|h| (&mut h.column, &mut h.name)), path, notes);
}

/// Number of rows from which the length of rows is estimated.
const SAMPLED_ROWS: usize = 1024;

/// State of reading row after row.
pub(crate) struct Rows<'a> {
    path: &'a Path,
    notes: Vec<Note>,
    columns: Vec<Column>,
    time: Option<usize>,
    /// True if the time column holds date-times, decided by its first readable cell.
    stamped: Option<bool>,
    decimal: Decimal,
    row: usize,
    lines: Lines,
    decimal_comma: Option<Note>,
    irregular: Irregular,
}

/// Rows that differ from the header, by kind: their number and the first of them.
#[derive(Default)]
struct Irregular {
    ragged: Option<(usize, u64, usize)>,
    skipped: Option<(usize, u64, String)>,
    repeated: Option<(usize, u64)>,
    run_on: Option<(usize, u64)>,
}

impl Irregular {
    fn into_notes(self, path: &Path, expected: usize) -> impl Iterator<Item = Note> {
        let path = || path.to_owned();
        let ragged = self.ragged.map(|(count, first_line, found)| Note::RaggedRows {
            path: path(),
            count,
            first_line,
            found,
            expected,
        });
        let skipped = self.skipped.map(|(count, first_line, text)| Note::SkippedRows {
            path: path(),
            count,
            first_line,
            text,
        });
        let repeated = self.repeated.map(|(count, first_line)| Note::RepeatedHeader {
            path: path(),
            count,
            first_line,
        });
        let run_on = self.run_on.map(|(count, first_line)| Note::RunOnCell {
            path: path(),
            count,
            first_line,
        });
        [ragged, skipped, repeated, run_on].into_iter().flatten()
    }
}

impl<'a> Rows<'a> {
    /// Prepares for the first row below the header.
    ///
    /// # Errors
    /// Those of `choose_time`.
    pub(crate) fn new(
        path: &'a Path,
        layout: &mut Layout,
        mut notes: Vec<Note>,
        choose_time: ChooseTime<'_>,
    ) -> Result<Self, Error> {
        let mut headings = std::mem::take(&mut layout.headings);
        tell_headings_apart(&mut headings, path, &mut notes);
        let time = choose_time(&headings)?;
        Ok(Self {
            path,
            notes,
            columns: headings.into_iter().map(Column::empty).collect(),
            time,
            stamped: None,
            decimal: Decimal::for_delimiter(layout.delimiter.byte()),
            row: 0,
            lines: Lines::default(),
            decimal_comma: None,
            irregular: Irregular::default(),
        })
    }

    /// Returns the table, once all rows are read.
    pub(crate) fn into_grid(self, origin: Origin, format: String, layout: &Layout) -> Grid {
        let Self { columns, row, lines, decimal_comma, irregular, stamped, mut notes, .. } = self;
        notes.extend(decimal_comma);
        notes.extend(irregular.into_notes(self.path, columns.len()));
        let (rows, stamped, header_line) = (row, stamped.unwrap_or(false), layout.header_line);
        let (left_out, epoch) = (Vec::new(), None);
        Grid { origin, format, columns, rows, lines, header_line, stamped, epoch, notes, left_out }
    }

    /// Returns the number of columns.
    pub(crate) fn width(&self) -> usize {
        self.columns.len()
    }

    fn read_all(&mut self, input: Input, layout: &Layout) -> Result<(Origin, String), Error> {
        let newline = input.newline();
        let mut reader = layout::csv_reader(input, layout.delimiter);
        let mut record = ByteRecord::new();
        let mut read = 0;
        let mut open_quote = None;
        loop {
            let before = reader.position().line();
            if !reader.read_byte_record(&mut record).map_err(|e| self.failed(e))? {
                break;
            }
            let line = layout::line_of(&reader, newline, before, &record);
            let is_cut = reader.get_ref().is_cut_before(reader.position().byte());
            let in_archive = reader.get_ref().is_archive_cut();
            open_quote =
                (layout::has_open_quote(&record) && !(is_cut && in_archive)).then_some(line);
            read += 1;
            // A truncated number is another number.
            if is_cut && open_quote.is_none() {
                self.leave_out_last(&record, line, in_archive || read <= layout.skip);
                break;
            }
            if read > layout.skip {
                if reader.position().line() > before + 1 && record.as_slice().contains(&b'\n') {
                    self.irregular.run_on.get_or_insert((0, line)).0 += 1;
                }
                self.take(&record, line, layout)?;
                if self.row == SAMPLED_ROWS && !reader.get_ref().is_in_part() {
                    self.make_room(reader.position().byte());
                }
            }
        }
        if let Some(line) = open_quote {
            return Err(Error::OpenQuote { path: self.path.to_owned(), line });
        }
        let (columns, notes) = (&mut self.columns, &mut self.notes);
        let (time, delimiter) = (self.time, layout.delimiter);
        let sign = separators::settle(columns, time, self.decimal, delimiter, self.path, notes)?;
        let mut format = layout.delimiter.name().to_owned();
        if sign == Some(Sign::Comma) {
            format.push_str(", decimal comma");
        }
        Ok((reader.into_inner().into_origin(), format))
    }

    /// Notes that the last row has no line end; a truncated archive has its own note.
    fn leave_out_last(&mut self, record: &ByteRecord, line: u64, is_known: bool) {
        let last = record.iter().next_back().unwrap_or_default();
        let is_blank = record.len() <= 1 && last.trim_ascii().is_empty();
        if !(is_known || is_blank || layout::is_comment(record)) {
            let (path, text) = (self.path.to_owned(), excerpt(last));
            self.notes.push(Note::CutRow { path, line, text });
        }
    }

    /// Reserves memory for all rows, estimated from the file: columns that grow in turn fragment
    /// the memory.
    fn make_room(&mut self, bytes_read: u64) {
        let Ok(file) = std::fs::metadata(self.path) else { return };
        let rows = self.row as f64 * file.len() as f64 / bytes_read.max(1) as f64;
        for Samples { values, .. } in self.columns.iter_mut().map(|column| &mut column.samples) {
            let more = (rows as usize).saturating_sub(values.len());
            // If the reservation fails, the columns grow as they are filled.
            let _ = if values.is_empty() { Ok(()) } else { values.try_reserve_exact(more) };
        }
    }

    fn failed(&self, error: csv::Error) -> Error {
        let reason = error.to_string();
        match error.into_kind() {
            csv::ErrorKind::Io(source) => Error::io(self.path, source),
            _ => Error::io(self.path, std::io::Error::other(reason)),
        }
    }

    /// Reads one record of the table.
    ///
    /// # Errors
    /// [`Error::SecondHeader`].
    pub(crate) fn take(
        &mut self,
        record: &ByteRecord,
        line: u64,
        layout: &Layout,
    ) -> Result<(), Error> {
        match second_header::find(record, self.time, layout) {
            Some(SecondHeader::Same) => {
                self.irregular.repeated.get_or_insert((0, line)).0 += 1;
                return Ok(());
            }
            Some(SecondHeader::Other { found, expected }) => {
                let path = self.path.to_owned();
                return Err(Error::SecondHeader { path, line, found, expected });
            }
            None => {}
        }
        let expected = self.columns.len();
        if layout::is_comment(record) || (record.len() != expected && !self.fits(record, line)) {
            return Ok(());
        }
        let row = self.row;
        for k in 0..expected {
            let cell = record.get(k).unwrap_or_default();
            self.cell(k, cell, row, line);
        }
        self.lines.push(row, line);
        self.row += 1;
        Ok(())
    }

    /// Counts a row of another length and returns whether it is used.
    fn fits(&mut self, record: &ByteRecord, line: u64) -> bool {
        if record.len() <= 1 {
            let cell = record.get(0).unwrap_or_default();
            if !cell.trim_ascii().is_empty() {
                let first = self.irregular.skipped.get_or_insert((0, line, excerpt(cell)));
                first.0 += 1;
            }
            return false;
        }
        let nameless = record.iter().skip(self.columns.len());
        let only_delimiters = record.len() > self.columns.len()
            && nameless.into_iter().all(|cell| cell.trim_ascii().is_empty());
        if !only_delimiters {
            self.irregular.ragged.get_or_insert((0, line, record.len())).0 += 1;
        }
        true
    }

    /// Records the separators of a cell, and reads `1.588` as a decimal once the file has shown
    /// decimals.
    fn without_doubt(&mut self, k: usize, found: Cell, line: u64, cell: &[u8]) -> Cell {
        let (sign, separators) = (self.decimal.sign, &mut self.columns[k].separators);
        let is_sign = |b: &u8| matches!(b, b'.' | b',');
        match found {
            Cell::Ambiguous(number) if sign == Some(number.sign) => {
                separators.meet(line, number, cell);
                return Cell::Number(number.decimal);
            }
            Cell::Number(value) => {
                let has_sign = sign.is_some_and(|sign| cell.contains(&(sign.character() as u8)));
                separators.has_decimals |= has_sign;
                separators.has_whole |= value != 0.0 && !cell.iter().any(is_sign);
            }
            Cell::Text => {
                let has_digit = cell.iter().any(u8::is_ascii_digit);
                separators.has_decimals |= has_digit && cell.iter().any(is_sign);
            }
            Cell::Ambiguous(_) | Cell::Missing => {}
        }
        found
    }

    #[inline]
    fn cell(&mut self, k: usize, cell: &[u8], row: usize, line: u64) {
        let before = self.decimal.sign;
        let mut found = self.decimal.read(cell);
        if !self.decimal.is_fixed() {
            found = self.without_doubt(k, found, line, cell);
        }
        if self.time == Some(k) {
            found = time_cell(&mut self.stamped, found, cell);
        }
        if before.is_none() && self.decimal.sign == Some(Sign::Comma) && cell.contains(&b',') {
            let (path, text) = (self.path.to_owned(), excerpt(cell));
            self.decimal_comma = Some(Note::DecimalComma { path, line, text });
        }
        self.columns[k].push(row, line, found, cell);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_again_across_jumps() {
        let mut lines = Lines::default();
        let written = [2, 3, 4, 9, 10, 20];
        for (row, line) in written.into_iter().enumerate() {
            lines.push(row, line);
        }
        assert_eq!(lines.0.len(), 3);
        for (row, line) in written.into_iter().enumerate() {
            assert_eq!(lines.line(row), line);
        }
    }

    #[test]
    fn a_column_without_a_name_is_called_by_its_place() {
        let mut headings = ["u", "", "u"].map(Heading::parse);
        let mut notes = Vec::new();
        tell_headings_apart(&mut headings, Path::new("log.csv"), &mut notes);
        let names: Vec<&str> = headings.iter().map(|h| h.column.as_str()).collect();
        assert_eq!(names, ["u", "column 2", "u.2"]);
        assert_eq!(notes.len(), 1);
    }
}
