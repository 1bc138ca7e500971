//! Excel workbooks.

use std::io::{self, BufReader, Read};
use std::path::Path;

use calamine::{DataRef, Reader, Sheet, SheetType, SheetVisible, Xlsx, XlsxCellReader, XlsxError};
use csv::ByteRecord;
use zip::ZipArchive;

use crate::cell::{Cell, Decimal, stamp};
use crate::content::{Content, Seekable};
use crate::error::TooMuch;
use crate::grid::{ChooseTime, Grid, Rows};
use crate::layout::{self, Delimiter};
use crate::note::Note;
use crate::unpack::limit;
use crate::{Error, Log, ReadOptions, guard, tabular};

/// Name of the format in messages.
const FORMAT: &str = "an Excel workbook";

/// Maximum number of columns of a sheet.
const COLUMNS: usize = 16_384;

/// Returns whether bytes start like a workbook.
pub(crate) fn recognises(head: &[u8]) -> bool {
    let holds = |name: &[u8]| head.windows(name.len()).any(|window| window == name);
    head.starts_with(b"PK\x03\x04") && (holds(b"[Content_Types].xml") || holds(b"xl/"))
}

/// Reads a sheet of a workbook: the one named in `options`, else the first.
///
/// # Errors
/// Those of [`grid`]; for time: see [`tabular::read`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let sheet = options.sheet.as_deref();
    tabular::read(&path, options, |choose_time| grid(content, sheet, choose_time))
}

/// Reads the table on a sheet.
///
/// # Errors
/// [`Error::Damaged`], [`Error::TooMuch`], [`Error::NoSheet`]; of the table, those of
/// [`layout::find_in_sheet`].
pub(crate) fn grid(
    content: Content,
    sheet: Option<&str>,
    choose_time: ChooseTime<'_>,
) -> Result<Grid, Error> {
    let path = content.path().to_owned();
    let (origin, file) = content.seekable()?;
    let mut file = BufReader::new(file);
    let most = unpacked_size(&mut file, &path)?;
    let mut workbook = guarded(&path, || Xlsx::new(file))?;
    let mut notes = Vec::new();
    let sheet = choose_sheet(&workbook, sheet, &path, &mut notes)?;
    let from_1904 = workbook.has_1904_epoch();
    let cells = guarded(&path, || workbook.worksheet_cells_reader(&sheet))?;
    let mut records = Records::new(cells, &path, most, from_1904);
    let mut sample = Vec::new();
    while sample.len() < layout::ROWS
        && let Some(record) = records.next()?
    {
        sample.push(record);
    }
    let mut layout = layout::find_in_sheet(&sample, &path)?;
    let mut rows = Rows::new(&path, &mut layout, notes, choose_time)?;
    for (line, record) in sample.drain(..).skip(layout.skip) {
        records.count(rows.width().saturating_sub(record.len()))?;
        rows.take(&fitted(record, rows.width()), line, &layout)?;
    }
    while let Some((line, record)) = records.next()? {
        records.count(rows.width().saturating_sub(record.len()))?;
        rows.take(&fitted(record, rows.width()), line, &layout)?;
    }
    let format = format!("{}, sheet {sheet:?}", Delimiter::Cells.name());
    Ok(rows.into_grid(origin, format, &layout))
}

/// Pads a row whose empty last cells the sheet omits; a single cell is still a remark, unless it is
/// a number.
fn fitted(mut record: ByteRecord, width: usize) -> ByteRecord {
    let mut filled = record.iter().filter(|cell| !cell.is_empty());
    if let (Some(only), None) = (filled.next(), filled.next())
        && width > 1
        && Decimal::point().read(only) == Cell::Text
        && stamp(only).is_none()
    {
        return ByteRecord::from(vec![only]);
    }
    while record.len() < width {
        record.push_field(b"");
    }
    record
}

/// Returns the maximum total size of the unpacked parts of a workbook, bytes. Parts that are held
/// in memory are unpacked, because their stated sizes may be false.
fn unpacked_size(file: &mut BufReader<Seekable>, path: &Path) -> Result<u64, Error> {
    let size = io::Seek::seek(file, io::SeekFrom::End(0)).map_err(|e| Error::io(path, e))?;
    let most = limit(size);
    let mut archive = ZipArchive::new(file).map_err(|error| damaged(error.into(), path))?;
    let mut unpacked: u64 = 0;
    for part in 0..archive.len() {
        let part = archive.by_index(part).map_err(|error| damaged(error.into(), path))?;
        let is_sheet = part.name().is_ok_and(|name| name.contains("worksheets/"));
        let bytes = if is_sheet { part.size() } else { length(part.take(most + 1)) };
        unpacked = unpacked.saturating_add(bytes);
        if unpacked > most {
            return Err(Error::io(path, io::Error::other(TooMuch { unpacked, packed: size })));
        }
    }
    Ok(most)
}

/// Returns the number of bytes up to the end, or to damage, which is reported where it matters.
fn length(mut part: impl Read) -> u64 {
    let mut buffer = vec![0; 64 * 1024];
    let mut length = 0;
    while let Ok(read @ 1..) = part.read(&mut buffer) {
        length += read as u64;
    }
    length
}

fn choose_sheet(
    workbook: &Xlsx<BufReader<Seekable>>,
    wanted: Option<&str>,
    path: &Path,
    notes: &mut Vec<Note>,
) -> Result<String, Error> {
    let sheets = workbook.sheets_metadata().iter();
    let with_cells = sheets.filter(|sheet| sheet.typ == SheetType::WorkSheet);
    let is_seen = |sheet: &&Sheet| wanted.is_some() || sheet.visible == SheetVisible::Visible;
    let mut sheets: Vec<String> = with_cells.filter(is_seen).map(|s| s.name.clone()).collect();
    if let Some(wanted) = wanted {
        let exact = sheets.iter().find(|sheet| *sheet == wanted);
        let near = || sheets.iter().find(|sheet| sheet.to_lowercase() == wanted.to_lowercase());
        return exact.or_else(near).cloned().ok_or_else(|| {
            let (path, wanted) = (path.to_owned(), wanted.to_owned());
            Error::NoSheet { path, wanted, sheets: sheets.clone() }
        });
    }
    if sheets.is_empty() {
        let found = "it shows no sheet with cells".to_owned();
        return Err(Error::Damaged { path: path.to_owned(), format: FORMAT, found });
    }
    let sheet = sheets.remove(0);
    if !sheets.is_empty() {
        let (path, sheet, others) = (path.to_owned(), sheet.clone(), sheets);
        notes.push(Note::SheetChosen { path, sheet, others });
    }
    Ok(sheet)
}

/// Non-empty rows of a sheet.
struct Records<'a> {
    cells: XlsxCellReader<'a, BufReader<Seekable>>,
    /// True once its last cell was read: what follows is not part of the sheet.
    done: bool,
    path: &'a Path,
    /// First cell of the next row: its row and column from 0, and its text.
    ahead: Option<(u32, usize, String)>,
    /// Number of bytes that the workbook may still unpack to.
    left: u64,
    /// True if days are counted from 1904.
    from_1904: bool,
}

impl<'a> Records<'a> {
    fn new(
        cells: XlsxCellReader<'a, BufReader<Seekable>>,
        path: &'a Path,
        most: u64,
        from_1904: bool,
    ) -> Self {
        Self { cells, done: false, path, ahead: None, left: most, from_1904 }
    }

    /// Returns the next row, with its number from 1.
    fn next(&mut self) -> Result<Option<(u64, ByteRecord)>, Error> {
        let Some((row, column, text)) =
            self.ahead.take().map_or_else(|| self.cell(), |c| Ok(Some(c)))?
        else {
            return Ok(None);
        };
        let mut record = ByteRecord::new();
        place(&mut record, column, &text);
        let mut filled = 1;
        while let Some(cell) = self.cell()? {
            if cell.0 != row {
                self.ahead = Some(cell);
                break;
            }
            place(&mut record, cell.1, &cell.2);
            filled += 1;
        }
        self.count(record.len().saturating_sub(filled))?;
        Ok(Some((u64::from(row) + 1, record)))
    }

    /// Counts cells, including those that a sheet omits: one cell in the last column implies
    /// sixteen thousand.
    ///
    /// # Errors
    /// [`Error::Damaged`] of more than the size of the workbook allows.
    fn count(&mut self, cells: usize) -> Result<(), Error> {
        /// Minimum length of a cell in a sheet: `<c/>`.
        const CELL_BYTES: u64 = 4;
        let Some(left) = self.left.checked_sub(CELL_BYTES.saturating_mul(cells as u64)) else {
            let found = "it holds more cells, empty ones included, than its size allows".to_owned();
            return Err(Error::Damaged { path: self.path.to_owned(), format: FORMAT, found });
        };
        self.left = left;
        Ok(())
    }

    /// Returns the next non-empty cell.
    fn cell(&mut self) -> Result<Option<(u32, usize, String)>, Error> {
        while !self.done {
            let cell = guarded(self.path, || self.cells.next_cell())?;
            let Some(cell) = cell else {
                self.done = true;
                break;
            };
            let (row, column) = cell.get_position();
            let text = text(cell.get_value(), self.from_1904);
            self.count(1)?;
            if column as usize >= COLUMNS {
                let found = format!("row {} has a cell past the last column", u64::from(row) + 1);
                return Err(Error::Damaged { path: self.path.to_owned(), format: FORMAT, found });
            }
            if !text.is_empty() {
                return Ok(Some((row, column as usize, text)));
            }
        }
        Ok(None)
    }
}

/// Writes a cell to its column; a second cell for a column is ignored.
fn place(record: &mut ByteRecord, column: usize, text: &str) {
    if column < record.len() {
        return;
    }
    while record.len() < column {
        record.push_field(b"");
    }
    record.push_field(text.as_bytes());
}

const DAY_S: f64 = 86_400.0;

/// Formats a cell as a text table would hold it.
fn text(value: &DataRef<'_>, from_1904: bool) -> String {
    match value {
        DataRef::Int(number) => number.to_string(),
        DataRef::Float(number) => plain(*number),
        DataRef::String(text) | DataRef::DateTimeIso(text) | DataRef::DurationIso(text) => {
            text.clone()
        }
        DataRef::SharedString(text) => (*text).to_owned(),
        DataRef::Bool(yes) => u8::from(*yes).to_string(),
        DataRef::DateTime(time) if time.is_duration() => plain(time.as_f64() * DAY_S),
        DataRef::DateTime(time) => date_time(time.as_f64(), from_1904),
        DataRef::Error(_) => "#N/A".to_owned(),
        DataRef::Empty => String::new(),
    }
}

/// Formats a number with the digits that distinguish it from all others.
fn plain(number: f64) -> String {
    /// Above this, and below its inverse, exponents are used.
    const LONG: f64 = 1e15;
    match number.abs() {
        size if !size.is_finite() => String::new(),
        size if size == 0.0 || (1.0 / LONG..LONG).contains(&size) => number.to_string(),
        _ => format!("{number:e}"),
    }
}

/// Formats a count of days as ISO 8601, a fraction of a day as a time of day; to the microsecond,
/// the resolution of days in a double.
fn date_time(days: f64, from_1904: bool) -> String {
    /// The year 10 000.
    const LAST_DAY: f64 = 2_958_466.0;
    if !(0.0..LAST_DAY).contains(&days) {
        return plain(days);
    }
    // Excel treats 1900 as a leap year, with 29 February as day 60.
    let epoch_day = match from_1904 {
        _ if days < 1.0 => 0,
        true => 24_107,
        false if days < 60.0 => 25_568,
        false => 25_569,
    };
    let microseconds = (days * DAY_S * 1e6).round() as i64 - epoch_day * 86_400_000_000;
    let text = jiff::Timestamp::from_microsecond(microseconds).map(|instant| instant.to_string());
    let text = text.unwrap_or_else(|_| plain(days));
    if days < 1.0 {
        text.trim_start_matches("1970-01-01T").trim_end_matches('Z').to_owned()
    } else {
        text
    }
}

fn guarded<T>(path: &Path, find: impl FnOnce() -> Result<T, XlsxError>) -> Result<T, Error> {
    guard::guarded(path, FORMAT, find)
}

fn damaged(error: XlsxError, path: &Path) -> Error {
    Error::Damaged { path: path.to_owned(), format: FORMAT, found: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_dates() {
        assert_eq!(date_time(44_043.576_724_537_04, false), "2020-07-31T13:50:29Z");
        assert_eq!(date_time(44_043.576_724_537_04 - 1462.0, true), "2020-07-31T13:50:29Z");
        assert_eq!(date_time(1.0, false), "1900-01-01T00:00:00Z");
        assert_eq!(date_time(0.5 + 1e-9, false), "12:00:00.000086");
        assert_eq!(date_time(-1.0, false), "-1");
    }

    #[test]
    fn numbers_keep_every_digit() {
        for number in [0.1 + 0.2, 1e300, -5e-324, 1500.0, 1e15 + 0.5, 0.0] {
            assert_eq!(plain(number).parse(), Ok(number));
        }
        assert_eq!((plain(1500.0).as_str(), plain(f64::NAN).as_str()), ("1500", ""));
    }
}
