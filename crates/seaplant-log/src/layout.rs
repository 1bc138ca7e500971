//! Finds the table in a text: the delimiter, the header, the first row of numbers.

use std::path::Path;

use csv::ByteRecord;

use crate::cell::{Cell, Decimal, decode, stamp};
use crate::heading::{Heading, lone_unit};
use crate::input::{Input, Newline, Squeeze};
use crate::limits::{MOST_COLUMNS, check_names, too_many_columns};
use crate::{Error, Unit};

/// Number of rows inspected.
pub(crate) const ROWS: usize = 300;

/// Layout of a table in a text.
#[derive(Debug)]
pub(crate) struct Layout {
    pub(crate) delimiter: Delimiter,
    pub(crate) headings: Vec<Heading>,
    /// Header cells as written, from which a repeated header is recognised.
    pub(crate) header: ByteRecord,
    pub(crate) header_line: u64,
    /// Row of units as written, if there is one.
    pub(crate) units: Option<ByteRecord>,
    /// Number of records before the first that may hold data.
    pub(crate) skip: usize,
}

impl Layout {
    /// Returns the layout if its names are plausible for a log.
    fn checked(self, path: &Path) -> Result<Self, Error> {
        check_names(self.headings.iter().map(|heading| heading.column.as_str()), path)?;
        Ok(self)
    }
}

/// Separator of cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Delimiter {
    Comma,
    Semicolon,
    Tab,
    Blanks,
    /// None: the cells of a spreadsheet.
    Cells,
}

impl Delimiter {
    pub(crate) fn byte(self) -> u8 {
        match self {
            // Numbers in spreadsheet cells have a decimal point, as those between commas do.
            Self::Comma | Self::Cells => b',',
            Self::Semicolon => b';',
            // Blanks arrive as tabs: see `Squeeze`.
            Self::Tab | Self::Blanks => b'\t',
        }
    }

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Comma => "comma-separated text",
            Self::Semicolon => "semicolon-separated text",
            Self::Tab => "tab-separated text",
            Self::Blanks => "blank-separated text",
            Self::Cells => "Excel workbook",
        }
    }
}

/// Creates a CSV reader that leaves every decision about rows to us.
pub(crate) fn csv_reader<R: std::io::Read>(input: R, delimiter: Delimiter) -> csv::Reader<R> {
    csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter.byte())
        .buffer_capacity(256 * 1024)
        .from_reader(input)
}

/// Returns the line on which the last record starts; `before` is the reader's line before it.
///
/// The reader counts line feeds; the newline determines whether that of this record is among them.
pub(crate) fn line_of<R: std::io::Read>(
    reader: &csv::Reader<R>,
    newline: Newline,
    before: u64,
    record: &ByteRecord,
) -> u64 {
    let position = reader.position();
    let last = match newline {
        Newline::Lf => position.line().saturating_sub(1),
        Newline::CrLf => position.line(),
        Newline::Cr => return position.record(),
    };
    if last <= before {
        return last;
    }
    let within = record.as_slice().iter().filter(|&&b| b == b'\n').count() as u64;
    let last = if has_open_quote(record) { position.line() } else { last };
    last.saturating_sub(within).max(1)
}

/// Returns whether the last cell swallowed the end of its line, which only an unclosed quote does.
pub(crate) fn has_open_quote(record: &ByteRecord) -> bool {
    record.as_slice().last() == Some(&b'\n')
}

/// Returns whether a row is a comment, with `#`, `%` or `//` in front, unless that is a
/// spreadsheet's `#N/A`.
pub(crate) fn is_comment(record: &ByteRecord) -> bool {
    let Some(cell) = record.get(0).map(<[u8]>::trim_ascii) else { return false };
    match cell.first() {
        Some(b'#') => Decimal::point().read(cell) != Cell::Missing,
        Some(b'%') => true,
        Some(b'/') => cell.starts_with(b"//"),
        _ => false,
    }
}

/// One inspected row.
struct Row {
    record: ByteRecord,
    line: u64,
    comment: bool,
    numbers: usize,
    texts: usize,
    /// Number of cells up to the last that is not empty.
    filled: usize,
}

impl Row {
    fn new(mut record: ByteRecord, line: u64, mut decimal: Decimal) -> Self {
        let comment = is_comment(&record);
        if comment {
            record = without_mark(&record);
        }
        let (mut numbers, mut texts, mut filled) = (0, 0, 0);
        for (k, cell) in record.iter().enumerate() {
            if !cell.trim_ascii().is_empty() {
                filled = k + 1;
            }
            match decimal.read(cell) {
                Cell::Number(_) | Cell::Ambiguous(_) => numbers += 1,
                Cell::Missing => {}
                Cell::Text if stamp(cell).is_some() => numbers += 1,
                Cell::Text => texts += 1,
            }
        }
        Self { record, line, comment, numbers, texts, filled }
    }

    fn is_data(&self) -> bool {
        !self.comment && 2 * self.numbers > self.texts
    }

    fn may_be_header(&self) -> bool {
        self.texts > 0 && 2 * self.numbers <= self.texts
    }

    /// Returns whether every value of `row` has a name in this row, and every name a cell there.
    fn heads(&self, row: &Self) -> bool {
        row.filled <= self.record.len() && self.filled <= row.record.len()
    }
}

/// Removes the mark of a commented header such as `# time, u`.
pub(crate) fn without_mark(record: &ByteRecord) -> ByteRecord {
    let mut cells = record.iter();
    let first = cells.next().unwrap_or_default().trim_ascii();
    let first = first
        .iter()
        .position(|b| !matches!(b, b'#' | b'%' | b'/'))
        .map_or(&[][..], |at| first[at..].trim_ascii());
    // A mark that is separated from the first name by blanks is a cell of its own.
    let first = (!first.is_empty()).then_some(first);
    first.into_iter().chain(cells).collect()
}

/// Finds the table at the start of a text.
///
/// # Errors
/// [`Error::NotATable`], [`Error::NoHeader`], [`Error::HeaderCells`], [`Error::UnitsDiffer`],
/// [`Error::TooFewRows`], [`Error::OpenQuote`]; those of [`check_names`].
pub(crate) fn find(input: &Input) -> Result<Layout, Error> {
    let mut squeezed = vec![0; input.head().len() + 1];
    let written = Squeeze::default().pass(input.head(), &mut squeezed);
    squeezed.truncate(written);
    let mut best: Option<(usize, Result<Layout, Error>)> = None;
    let (mut open_quote, mut too_wide) = (None, false);
    let mut failed: Option<(usize, Vec<Row>)> = None;
    for delimiter in [Delimiter::Comma, Delimiter::Semicolon, Delimiter::Tab, Delimiter::Blanks] {
        let text = if delimiter == Delimiter::Blanks { &squeezed } else { input.head() };
        if is_too_wide(text, delimiter) {
            too_wide = true;
            continue;
        }
        let rows = sample(text, delimiter, input.newline());
        open_quote =
            open_quote.or(rows.last().filter(|r| has_open_quote(&r.record)).map(|r| r.line));
        match header(&rows, delimiter) {
            Some((score, at)) if best.as_ref().is_none_or(|(other, _)| score > *other) => {
                best = Some((score, layout(&rows, at, delimiter, input.path())));
            }
            Some(_) => {}
            None => {
                let score = rows.iter().filter(|r| r.is_data()).map(|r| r.numbers).sum();
                if failed.as_ref().is_none_or(|(other, _)| score > *other) {
                    failed = Some((score, rows));
                }
            }
        }
    }
    match (best, open_quote) {
        (Some((_, layout)), _) => layout?.checked(input.path()),
        (None, _) if too_wide => Err(too_many_columns(input.path())),
        (None, Some(line)) => Err(Error::OpenQuote { path: input.path().to_owned(), line }),
        (None, None) => {
            let rows = failed.map(|(_, rows)| rows).unwrap_or_default();
            Err(why_not(&rows, input.is_whole(), input.path()))
        }
    }
}

/// Finds the table at the start of a sheet, given its first rows, [`ROWS`] or all, with their
/// numbers.
///
/// # Errors
/// As [`find`].
pub(crate) fn find_in_sheet(sample: &[(u64, ByteRecord)], path: &Path) -> Result<Layout, Error> {
    let decimal = Decimal::for_delimiter(Delimiter::Cells.byte());
    let mut width = 0;
    let row = |(line, record): &(u64, ByteRecord)| {
        // A sheet omits the empty cells at the end of a row.
        width = width.max(record.len());
        let empty = std::iter::repeat_n(&b""[..], width - record.len());
        Row::new(record.iter().chain(empty).collect(), *line, decimal)
    };
    let rows: Vec<Row> = sample.iter().map(row).collect();
    match header(&rows, Delimiter::Cells) {
        Some((_, at)) => layout(&rows, at, Delimiter::Cells, path)?.checked(path),
        None => Err(why_not(&rows, sample.len() < ROWS, path)),
    }
}

/// Returns whether a line has more separators than a log may have columns. Each cell costs more
/// memory than its separator, so this is checked before a line is split.
fn is_too_wide(text: &[u8], delimiter: Delimiter) -> bool {
    let is_separator = |byte: &&u8| **byte == delimiter.byte();
    text.split(|byte| matches!(byte, b'\n' | b'\r'))
        .any(|line| line.iter().filter(is_separator).count() > MOST_COLUMNS)
}

fn sample(text: &[u8], delimiter: Delimiter, newline: Newline) -> Vec<Row> {
    let closed: &[u8] = if text.ends_with(b"\n") { b"" } else { b"\n" };
    let mut reader = csv_reader(std::io::Read::chain(text, closed), delimiter);
    let mut rows = Vec::new();
    let mut record = ByteRecord::new();
    while rows.len() < ROWS {
        let before = reader.position().line();
        if !reader.read_byte_record(&mut record).unwrap_or(false) {
            break;
        }
        let line = line_of(&reader, newline, before, &record);
        // A clone would copy the reader's buffer, which is as long as its longest record so far.
        let own: ByteRecord = record.iter().collect();
        // A version number above the table says nothing about the decimal sign in it.
        rows.push(Row::new(own, line, Decimal::for_delimiter(delimiter.byte())));
    }
    rows
}

/// Returns the header with the most numbers below it, and its score.
///
/// Prefers, of two equal ones, one that is no comment, then the later, which is closer to the
/// numbers.
fn header(rows: &[Row], delimiter: Delimiter) -> Option<(usize, usize)> {
    // With the wrong delimiter any text is one column, and "0,1" has a decimal comma.
    let alone = matches!(delimiter, Delimiter::Comma | Delimiter::Cells);
    let least = if alone { 1 } else { 2 };
    let score = |at: usize| -> usize {
        let below = rows[at + 1..].iter().filter(|row| row.is_data() && rows[at].heads(row));
        below.map(|row| 2 * row.numbers - row.texts).sum()
    };
    let candidates =
        (0..rows.len()).filter(|&at| rows[at].may_be_header() && rows[at].record.len() >= least);
    let scored = candidates.map(|at| (score(at), !rows[at].comment, at)).filter(|s| s.0 > 0);
    scored.max().map(|(score, _, at)| (score, at))
}

/// Returns the table whose header, or row of units below it, is at `at`.
///
/// # Errors
/// [`Error::UnitsDiffer`].
fn layout(rows: &[Row], at: usize, delimiter: Delimiter, path: &Path) -> Result<Layout, Error> {
    let (names, units) = match row_of_names(rows, at) {
        Some(names) => (names, Some(at)),
        None => (at, Some(at + 1).filter(|&below| is_comment_of_units(rows, below))),
    };
    let header = &rows[names];
    let mut headings: Vec<Heading> = Vec::with_capacity(header.record.len());
    for (k, cell) in header.record.iter().enumerate() {
        let mut heading = Heading::parse(&decode(cell));
        let below = units.and_then(|row| lone_unit(&decode(rows[row].record.get(k)?)));
        if let (Some(header), Some(below)) = (&heading.unit, &below)
            && contradicts(below, header)
        {
            let line = rows[units.unwrap_or(at)].line;
            let [header, below] = [header, below].map(|unit| unit.symbol().to_owned());
            let (path, column) = (path.to_owned(), heading.column);
            return Err(Error::UnitsDiffer { path, line, column, header, below });
        }
        heading.unit = heading.unit.or(below);
        headings.push(heading);
    }
    let (header, header_line) = (header.record.clone(), header.line);
    let units = units.map(|row| rows[row].record.clone());
    Ok(Layout { delimiter, headings, header, header_line, units, skip: at + 1 })
}

/// Returns whether a row of units states another unit than a header; a dash states none.
pub(crate) fn contradicts(below: &Unit, header: &Unit) -> bool {
    !["-", "none"].contains(&below.symbol()) && !below.agrees_with(header)
}

/// Returns the row of names above the row at `at`, if that row holds only units.
fn row_of_names(rows: &[Row], at: usize) -> Option<usize> {
    let units = &rows[at];
    let names = at.checked_sub(1)?;
    let fits = rows[names].may_be_header() && rows[names].heads(units) && units.heads(&rows[names]);
    (fits && holds_units(&units.record)).then_some(names)
}

/// Returns whether a row is a comment that holds only units, one for each name above it.
fn is_comment_of_units(rows: &[Row], at: usize) -> bool {
    rows.get(at).is_some_and(|row| {
        row.comment
            && row.filled > 0
            && holds_units(&row.record)
            && row.heads(&rows[at - 1])
            && rows[at - 1].heads(row)
    })
}

/// Returns whether all non-empty cells of a row hold units.
pub(crate) fn holds_units(record: &ByteRecord) -> bool {
    record.iter().all(|cell| cell.trim_ascii().is_empty() || lone_unit(&decode(cell)).is_some())
}

/// Returns the error that explains why these rows hold no table.
fn why_not(rows: &[Row], whole: bool, path: &Path) -> Error {
    let path = path.to_owned();
    let Some(first) = rows.iter().position(Row::is_data) else {
        let texts: Vec<&Row> = rows.iter().filter(|row| !row.comment).collect();
        return match texts[..] {
            [only] if only.record.len() > 1 && whole => {
                Error::TooFewRows { path, rows: 0, needed: 1 }
            }
            _ => Error::NotATable { path, rows: rows.len() },
        };
    };
    let row = &rows[first];
    let above = rows[..first].iter().rev().find(|r| !r.comment);
    match above {
        Some(above) if above.may_be_header() && above.filled > 1 && row.filled > 1 => {
            Error::HeaderCells {
                path,
                line: above.line,
                header: above.filled,
                row_line: row.line,
                row: row.filled,
            }
        }
        _ => Error::NoHeader { path, line: row.line, cells: row.record.len() },
    }
}
