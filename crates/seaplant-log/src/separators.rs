//! Resolves whether separators in numbers mark decimals or thousands.

use std::path::Path;

use crate::Error;
use crate::cell::{Decimal, Sign};
use crate::column::{Column, Separators, Text};
use crate::layout::Delimiter;
use crate::note::Note;

/// Resolves `1.588` and `1,588`, once all rows were read: the decimal sign is that of the other
/// numbers, and the other sign separates thousands. Returns the decimal sign.
///
/// In a column with decimals, a thousands separator must occur unambiguously in the file
/// (`12.345.678`); otherwise the cells count as text. A column with integers in addition to
/// `1.588`, and no other decimals, may have thousands: it is left out.
///
/// # Errors
/// [`Error::AmbiguousNumber`] where no number of the file shows the decimal sign, and the delimiter
/// does not make one likely; where times are doubtful, in the column `time`.
pub(crate) fn settle(
    columns: &mut [Column],
    time: Option<usize>,
    decimal: Decimal,
    delimiter: Delimiter,
    path: &Path,
    notes: &mut Vec<Note>,
) -> Result<Option<Sign>, Error> {
    let refuse = |(column, (line, text)): (&Column, &(u64, String))| {
        let (column, line, text) = (column.heading.column.clone(), *line, text.clone());
        Error::AmbiguousNumber { path: path.to_owned(), line, column, text }
    };
    let Some(first) = first(columns) else { return Ok(decimal.sign) };
    let sign = match decimal.sign {
        Some(sign) => sign,
        None => likely(columns, delimiter).ok_or_else(|| refuse(first))?,
    };
    if sign == Sign::Comma && decimal.sign.is_none() {
        let (_, (line, text)) = first;
        let (path, line, text) = (path.to_owned(), *line, text.clone());
        notes.push(Note::DecimalComma { path, line, text });
    }
    for (k, column) in columns.iter_mut().enumerate() {
        notes.extend(settle_column(column, sign, decimal.groups, path));
        if let Some(doubt) = column.doubtful.as_ref().filter(|_| time == Some(k)) {
            return Err(refuse((&*column, doubt)));
        }
    }
    Ok(Some(sign))
}

/// Returns the decimal sign that the delimiter makes likely, where all numbers have the same sign:
/// commas between semicolons, points between tabs and blanks.
fn likely(columns: &[Column], delimiter: Delimiter) -> Option<Sign> {
    let sign = match delimiter {
        Delimiter::Semicolon => Sign::Comma,
        Delimiter::Comma | Delimiter::Tab | Delimiter::Blanks | Delimiter::Cells => Sign::Point,
    };
    let mut open = columns.iter().flat_map(|column| &column.separators.open);
    open.all(|(_, number)| number.sign == sign).then_some(sign)
}

/// Returns the column of the first ambiguous number, with its line and its text.
fn first(columns: &[Column]) -> Option<(&Column, &(u64, String))> {
    let places = columns.iter().flat_map(|column| {
        column.separators.first.iter().flatten().map(move |place| (column, place))
    });
    places.min_by_key(|(_, (line, _))| *line)
}

fn settle_column(column: &mut Column, sign: Sign, groups: bool, path: &Path) -> Option<Note> {
    let separators = std::mem::take(&mut column.separators);
    let Separators { open, mut first, has_decimals, has_whole } = separators;
    let with_decimals = first[sign as usize].take();
    if with_decimals.is_some() && has_whole && !has_decimals {
        column.samples.values.clear();
        column.samples.rows = Some(Vec::new());
        column.doubtful = with_decimals;
        return None;
    }
    let others: Vec<_> = open.into_iter().filter(|(_, number)| number.sign != sign).collect();
    let (line, text) = first[sign.other() as usize].take()?;
    let count = others.len();
    if (has_decimals || with_decimals.is_some()) && !groups {
        let places: Vec<usize> = others.iter().map(|(value, _)| *value).collect();
        column.samples.remove(&places);
        column.add_text(Text { line, text, count });
        return None;
    }
    for (value, number) in &others {
        column.samples.values[*value] = number.thousands;
    }
    let (path, value) = (path.to_owned(), others.first()?.1.thousands);
    let column = column.heading.column.clone();
    Some(Note::Thousands { path, column, line, text, value, count })
}
