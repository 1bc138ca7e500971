//! Recognises headers that are repeated within the rows of a table.

use csv::ByteRecord;

use crate::Unit;
use crate::cell::{Cell, Decimal, decode, stamp};
use crate::heading::{Heading, lone_unit};
use crate::layout::{Layout, contradicts, holds_units, is_comment, without_mark};

/// A header, or a row of units, below the first one.
pub(crate) enum SecondHeader {
    /// It equals the first.
    Same,
    /// It differs from the first.
    Other { found: String, expected: String },
}

/// Compares a row with the header, if it is a header itself: a row of text that shares half of its
/// names with the header, or more than half of whose cells state a unit; for a comment, more than
/// half of the names.
///
/// `time` is the index of the time column.
pub(crate) fn find(
    record: &ByteRecord,
    time: Option<usize>,
    layout: &Layout,
) -> Option<SecondHeader> {
    let comment = is_comment(record);
    let first = record.get(time.unwrap_or(0)).unwrap_or_default().trim_ascii();
    let is_value = first.first().is_none_or(|b| matches!(b, b'0'..=b'9' | b'-' | b'+' | b'.'));
    if is_value && !comment {
        return None;
    }
    let record = if comment { &without_mark(record) } else { record };
    let has_cells = record.len() > 1 || layout.header.len() == 1;
    if !has_cells || (comment && record.len() != layout.header.len()) || !is_text(record) {
        return None;
    }
    if holds_units(record) {
        return Some(compare_units(record, layout));
    }
    let [here, there] = [record, &layout.header].map(headings);
    let filled = here.iter().filter(|heading| !heading.nameless).count();
    let is_known = |heading: &&Heading| there.iter().any(|known| has_name(known, heading));
    let known = here.iter().filter(|heading| !heading.nameless).filter(is_known).count();
    let with_unit = here.iter().filter(|heading| heading.unit.is_some()).count();
    let is_header = match comment {
        true => 2 * known > filled,
        false => 2 * known >= filled || 2 * with_unit > filled,
    };
    (is_header && filled > 0).then(|| compare(&here, &there))
}

/// Returns whether a row holds text, and neither numbers nor dates.
fn is_text(record: &ByteRecord) -> bool {
    let read = |cell: &[u8]| match Decimal::for_delimiter(b';').read(cell) {
        Cell::Text if stamp(cell).is_some() => Cell::Number(0.0),
        found => found,
    };
    record.iter().any(|cell| read(cell) == Cell::Text)
        && record.iter().all(|cell| matches!(read(cell), Cell::Text | Cell::Missing))
}

fn headings(record: &ByteRecord) -> Vec<Heading> {
    record.iter().map(|cell| Heading::parse(&decode(cell))).collect()
}

fn has_name(one: &Heading, other: &Heading) -> bool {
    one.name.to_lowercase() == other.name.to_lowercase()
}

fn compare(here: &[Heading], there: &[Heading]) -> SecondHeader {
    let is_same = |(here, there): &(&Heading, &Heading)| {
        let same_unit = match (&here.unit, &there.unit) {
            (Some(here), Some(there)) => here.agrees_with(there),
            (None, None) => true,
            _ => false,
        };
        has_name(here, there) && same_unit
    };
    if let Some((here, there)) = here.iter().zip(there).find(|pair| !is_same(pair)) {
        return SecondHeader::Other { found: here.column.clone(), expected: there.column.clone() };
    }
    if here.len() == there.len() {
        return SecondHeader::Same;
    }
    let [found, expected] = [here, there].map(|header| format!("{} columns", header.len()));
    SecondHeader::Other { found, expected }
}

/// Compares a row of units with those of the header, or of the row of units below it.
fn compare_units(record: &ByteRecord, layout: &Layout) -> SecondHeader {
    let below = |k: usize| layout.units.as_ref().and_then(|units| unit_of(units, k));
    for (k, heading) in headings(&layout.header).into_iter().enumerate() {
        let Some((here, there)) = unit_of(record, k).zip(heading.unit.or_else(|| below(k))) else {
            continue;
        };
        if contradicts(&here, &there) {
            let [found, expected] = [here, there].map(|unit| unit.symbol().to_owned());
            return SecondHeader::Other { found, expected };
        }
    }
    SecondHeader::Same
}

fn unit_of(record: &ByteRecord, k: usize) -> Option<Unit> {
    lone_unit(&decode(record.get(k)?))
}
