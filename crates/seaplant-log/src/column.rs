//! A column of numbers without its missing values, from which a channel is made.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use crate::Unit;
use crate::cell::{Ambiguous, Cell, excerpt};
use crate::heading::Heading;
use crate::log::Reason;
use crate::note::Note;

/// One column: its header and its numbers.
pub(crate) struct Column {
    pub(crate) heading: Heading,
    pub(crate) samples: Samples,
    pub(crate) text: Option<Text>,
    /// Separators in its numbers.
    pub(crate) separators: Separators,
    /// Line and text of the number that makes all others ambiguous; the numbers are then discarded.
    pub(crate) doubtful: Option<(u64, String)>,
}

impl Column {
    /// Creates a column without rows.
    pub(crate) fn empty(heading: Heading) -> Self {
        Self::from_samples(heading, Samples::default())
    }

    /// Creates a column called `name` with a value for each row, `NaN` where one is missing.
    pub(crate) fn new(name: String, unit: Option<Unit>, values: Vec<f64>) -> Self {
        let (nameless, instant) = (false, false);
        let heading = Heading { column: name.clone(), name, unit, nameless, instant };
        Self::from_samples(heading, Samples::from_values(values))
    }

    fn from_samples(heading: Heading, samples: Samples) -> Self {
        Self { heading, samples, text: None, separators: Separators::default(), doubtful: None }
    }

    /// Returns why a column without numbers is no channel.
    pub(crate) fn reason(&self) -> Reason {
        match (&self.doubtful, &self.text) {
            (Some((line, text)), _) => Reason::Ambiguous { line: *line, text: text.clone() },
            (None, Some(Text { line, text, .. })) => {
                Reason::Text { line: *line, text: text.clone() }
            }
            (None, None) => Reason::Missing,
        }
    }

    /// Adds one cell, which was parsed as `found`.
    #[inline]
    pub(crate) fn push(&mut self, row: usize, line: u64, found: Cell, cell: &[u8]) {
        match found {
            Cell::Number(value) => self.samples.push(row, value),
            Cell::Ambiguous(number) => {
                self.separators.meet(line, number, cell);
                self.separators.open.push((self.samples.values.len(), number));
                self.samples.push(row, number.decimal);
            }
            Cell::Missing => self.samples.skip(row),
            Cell::Text => {
                self.samples.skip(row);
                self.add_text(Text { line, text: excerpt(cell), count: 1 });
            }
        }
    }

    /// Counts cells that hold no number; `more` gives the first.
    pub(crate) fn add_text(&mut self, more: Text) {
        let text = self.text.get_or_insert(Text { count: 0, ..more.clone() });
        text.count += more.count;
        if more.line < text.line {
            (text.line, text.text) = (more.line, more.text);
        }
    }

    /// Returns whether this column comes from a delimiter at the end of every line: no name and no
    /// value.
    pub(crate) fn is_margin(&self) -> bool {
        self.heading.nameless && self.samples.values.is_empty() && self.text.is_none()
    }

    /// Returns the note on the cells that hold no number.
    pub(crate) fn note(&self, path: &Path, rows: usize) -> Option<Note> {
        let (path, column) = (path.to_owned(), self.heading.column.clone());
        let empty = self.samples.values.is_empty();
        if let Some((line, text)) = self.doubtful.clone() {
            return Some(Note::AmbiguousColumn { path, column, line, text });
        }
        match &self.text {
            Some(Text { line, text, .. }) if empty => {
                Some(Note::TextColumn { path, column, line: *line, text: text.clone() })
            }
            Some(Text { line, text, count }) => {
                let (line, text, count) = (*line, text.clone(), *count);
                Some(Note::NotANumber { path, column, line, text, count, rows })
            }
            None if empty => Some(Note::AllMissing { path, column, rows }),
            None => None,
        }
    }
}

/// Text where numbers were expected.
#[derive(Clone)]
pub(crate) struct Text {
    pub(crate) line: u64,
    pub(crate) text: String,
    pub(crate) count: usize,
}

/// Separators in the numbers of one column.
#[derive(Default)]
pub(crate) struct Separators {
    /// Ambiguous numbers, such as `1.588` before the file had shown its decimal sign and those with
    /// the other sign, in order: index of the value and its readings.
    pub(crate) open: Vec<(usize, Ambiguous)>,
    /// Line and text of the first such number with a point, and of the first with a comma.
    pub(crate) first: [Option<(u64, String)>; 2],
    /// True if a number has unambiguous decimals.
    pub(crate) has_decimals: bool,
    /// True if a number other than zero has no separator.
    pub(crate) has_whole: bool,
}

impl Separators {
    /// Records the line of a number such as `1.588`, if it is the first.
    pub(crate) fn meet(&mut self, line: u64, number: Ambiguous, cell: &[u8]) {
        self.first[number.sign as usize].get_or_insert_with(|| (line, excerpt(cell)));
    }
}

/// Numbers of a column, and their rows.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Samples {
    pub(crate) values: Vec<f64>,
    /// Rows of the values; `None` while every row has a value.
    pub(crate) rows: Option<Vec<usize>>,
}

impl Samples {
    /// Creates samples from the values of successive rows; values that are not finite are missing.
    pub(crate) fn from_values(mut values: Vec<f64>) -> Self {
        if values.iter().all(|value| value.is_finite()) {
            return Self { values, rows: None };
        }
        let present = values.iter().enumerate().filter(|(_, value)| value.is_finite());
        let rows = present.map(|(row, _)| row).collect();
        values.retain(|value| value.is_finite());
        Self { values, rows: Some(rows) }
    }

    #[inline]
    pub(crate) fn push(&mut self, row: usize, value: f64) {
        if let Some(rows) = &mut self.rows {
            rows.push(row);
        }
        self.values.push(value);
    }

    #[inline]
    pub(crate) fn skip(&mut self, row: usize) {
        if self.rows.is_none() {
            self.rows = Some((0..row).collect());
        }
    }

    /// Drops all but the first `rows` rows.
    pub(crate) fn truncate(&mut self, rows: usize) {
        let kept = match &mut self.rows {
            Some(present) => {
                let kept = present.partition_point(|&row| row < rows);
                present.truncate(kept);
                kept
            }
            None => rows,
        };
        self.values.truncate(kept);
    }

    /// Removes the values at these increasing indices, which count as missing from then on.
    pub(crate) fn remove(&mut self, places: &[usize]) {
        let count = self.values.len();
        let rows = self.rows.get_or_insert_with(|| (0..count).collect());
        let mut removed = places.iter().peekable();
        let mut kept = 0;
        for place in 0..count {
            if removed.next_if(|next| **next == place).is_none() {
                (self.values[kept], rows[kept]) = (self.values[place], rows[place]);
                kept += 1;
            }
        }
        self.values.truncate(kept);
        rows.truncate(kept);
    }

    /// Iterates over the values with their rows.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let row = |k: usize| self.rows.as_ref().map_or(k, |rows| rows[k]);
        self.values.iter().enumerate().map(move |(k, &value)| (row(k), value))
    }

    /// Returns a value for each of `rows` rows, `NaN` where one is missing.
    pub(crate) fn dense(self, rows: usize) -> Vec<f64> {
        if self.rows.is_none() { self.values } else { self.to_dense(rows) }
    }

    /// Returns the same as [`Samples::dense`] without consuming the samples.
    pub(crate) fn to_dense(&self, rows: usize) -> Vec<f64> {
        let mut dense = vec![f64::NAN; rows];
        for (row, value) in self.iter() {
            dense[row] = value;
        }
        dense
    }
}

/// Makes the column text of every heading unique: a second `u` becomes `u.2`.
pub(crate) fn tell_apart<'a>(
    headings: impl Iterator<Item = (&'a mut String, &'a mut String)>,
    path: &Path,
    notes: &mut Vec<Note>,
) {
    let headings: Vec<(&mut String, &mut String)> = headings.collect();
    let mut taken: HashSet<String> =
        headings.iter().map(|(column, _)| column.to_string()).collect();
    let mut copies: HashMap<String, usize> = HashMap::new();
    for (column, name) in headings {
        let written = column.clone();
        let copy = copies.entry(written.clone()).or_insert(0);
        *copy += 1;
        if *copy == 1 {
            continue;
        }
        while !taken.insert(format!("{written}.{copy}")) {
            *copy += 1;
        }
        *column = format!("{written}.{copy}");
        *name = format!("{name}.{copy}");
        let (path, renamed) = (path.to_owned(), name.clone());
        notes.push(Note::DuplicateColumn { path, column: written, renamed });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_unique_without_using_an_existing_one() {
        let mut headings = ["u", "u.2", "u", "u"].map(Heading::parse);
        let mut notes = Vec::new();
        let names = headings.iter_mut().map(|h| (&mut h.column, &mut h.name));
        tell_apart(names, Path::new("log.csv"), &mut notes);
        let names: Vec<&str> = headings.iter().map(|h| h.column.as_str()).collect();
        assert_eq!(names, ["u", "u.2", "u.3", "u.4"]);
        assert_eq!(notes.len(), 2);
    }

    #[test]
    fn values_that_are_not_finite_are_missing() {
        let values = vec![1.0, f64::NAN, 3.0, f64::INFINITY];
        let samples = Samples::from_values(values);
        assert_eq!(samples.iter().collect::<Vec<_>>(), [(0, 1.0), (2, 3.0)]);
        let mut short = Samples::from_values(vec![1.0, f64::NAN, 3.0]);
        short.truncate(2);
        assert_eq!(short.iter().collect::<Vec<_>>(), [(0, 1.0)]);
        let dense = samples.dense(4);
        assert_eq!((dense[0], dense[2]), (1.0, 3.0));
        assert!(dense[1].is_nan() && dense[3].is_nan());
        assert_eq!(Samples::from_values(vec![1.0, 2.0]).rows, None);
    }
}
