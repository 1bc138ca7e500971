//! Converts sentences to columns.

use std::collections::{BTreeSet, HashMap};

use super::line::Sentence;
use super::prefix::Prefix;
use super::tables::{self, Field, Kind};
use super::utc::{Course, Utc};
use crate::Unit;
use crate::assemble::{Assembly, Group};
use crate::column::Column;

/// Sentences of one kind.
struct Rows {
    kind: Kind,
    /// Time of receipt of each, s, or its number among all sentences.
    times: Vec<f64>,
    /// Values, field after field.
    columns: Vec<Vec<f64>>,
    /// Number of fields of the longest: some end before fields that later standards added.
    longest: usize,
}

impl Rows {
    fn new(kind: Kind) -> Self {
        let columns = vec![Vec::new(); kind.fields().len()];
        Self { kind, times: Vec::new(), columns, longest: 0 }
    }
}

impl Kind {
    fn fields(&self) -> &'static [Field] {
        self.fields.unwrap_or_default()
    }
}

/// Sentences by kind.
pub(super) struct Records {
    prefix: Option<Prefix>,
    places: HashMap<String, usize>,
    rows: Vec<Rows>,
    /// Number of sentences.
    count: usize,
    /// UTC of the sentences that contain it, by sentence number.
    said: Vec<(usize, Utc)>,
    /// Time of receipt minus UTC, s, for the first sentences with both.
    behind_s: Vec<f64>,
    last_s: Option<f64>,
}

/// Origin of times.
pub(super) enum Times {
    Received { clock: &'static str, of_day: bool, behind_s: Option<f64>, last_s: Option<f64> },
    Said(Course),
}

impl Records {
    pub(super) fn new(prefix: Option<Prefix>) -> Self {
        let (places, rows, said, behind_s) = Default::default();
        Self { prefix, places, rows, count: 0, said, behind_s, last_s: None }
    }

    /// Adds a sentence, with the text before it in its line.
    pub(super) fn take(&mut self, before: &[u8], sentence: &Sentence<'_>) {
        let (key, fields) = tables::split(sentence.body);
        let place = self.places.get(key).copied().unwrap_or_else(|| {
            self.rows.push(Rows::new(tables::kind(key)));
            self.places.insert(key.to_owned(), self.rows.len() - 1);
            self.rows.len() - 1
        });
        let kind = &self.rows[place].kind;
        let utc = Utc::read(&kind.formatter, &fields);
        let number = self.count;
        self.count += 1;
        let time = match &mut self.prefix {
            Some(prefix) => prefix.time(before).unwrap_or(f64::NAN),
            None => number as f64,
        };
        if let Some(utc) = utc {
            self.say(number, time, utc);
        }
        if time.is_finite() && self.prefix.is_some() {
            self.last_s = Some(time);
        }
        let rows = &mut self.rows[place];
        if rows.columns.is_empty() {
            return;
        }
        rows.times.push(time);
        rows.longest = rows.longest.max(fields.len());
        for (field, column) in rows.kind.fields().iter().zip(&mut rows.columns) {
            column.push(field.value(&fields));
        }
    }

    /// Records the UTC in a sentence.
    fn say(&mut self, number: usize, received_s: f64, utc: Utc) {
        /// Number of pairs from which the clock difference is estimated.
        const PAIRS: usize = 1000;
        match &self.prefix {
            None => self.said.push((number, utc)),
            Some(prefix) if prefix.is_since_1970() && self.behind_s.len() < PAIRS => {
                let behind_s = utc.since_1970_s().map(|utc_s| utc_s - received_s);
                self.behind_s.extend(behind_s.filter(|behind_s| behind_s.is_finite()));
            }
            Some(_) => {}
        }
    }

    /// Determines the origin of times; `None` if there are no times.
    pub(super) fn times(&mut self) -> Option<Times> {
        let Some(prefix) = &self.prefix else { return Course::new(&self.said).map(Times::Said) };
        let middle = self.behind_s.len() / 2;
        self.behind_s.sort_unstable_by(f64::total_cmp);
        let behind_s = self.behind_s.get(middle).copied();
        let (clock, of_day) = (prefix.clock(), prefix.is_of_day());
        Some(Times::Received { clock, of_day, behind_s, last_s: self.last_s })
    }

    /// Hands all columns to the assembly.
    pub(super) fn hand_over(self, times: &Times, assembly: &mut Assembly) {
        let unknown = self.rows.iter().filter(|rows| rows.kind.fields.is_none());
        let unknown: BTreeSet<&str> = unknown.map(|rows| rows.kind.name.as_str()).collect();
        for name in unknown {
            assembly.leave_out(name.to_owned(), "is a sentence whose fields are not known");
        }
        for Rows { kind, times: mut time_s, columns, longest } in self.rows {
            if let Times::Said(course) = times {
                time_s.iter_mut().for_each(|time| *time = course.time(*time as usize));
            }
            let sent = kind.fields().iter().zip(columns).filter(|(field, _)| field.at < longest);
            let named = sent.map(|(field, values)| {
                let name = format!("{}.{}", kind.name, field.name);
                Column::new(name, Unit::find(field.unit), values)
            });
            let columns: Vec<Column> = named.collect();
            if !columns.is_empty() {
                assembly.group(Group { name: kind.name.clone(), time_s, columns, of: None });
            }
        }
    }
}

impl Times {
    /// Returns the latest time, s.
    pub(super) fn last_s(&self) -> Option<f64> {
        match self {
            Self::Received { last_s, .. } => *last_s,
            Self::Said(course) => course.last_s(),
        }
    }

    /// Returns whether times count from an unknown midnight.
    pub(super) fn are_of_day(&self) -> bool {
        match self {
            Self::Received { of_day, .. } => *of_day,
            Self::Said(course) => !course.dated,
        }
    }

    /// Describes the clock of the times.
    pub(super) fn clock(&self) -> String {
        /// Upper bound on transmission delays, s.
        const CLOSE_S: f64 = 2.0;
        match self {
            Self::Received { clock, behind_s: Some(behind_s), .. } if behind_s.abs() > CLOSE_S => {
                let (by_s, side) =
                    (behind_s.abs(), if *behind_s > 0.0 { "behind" } else { "ahead of" });
                format!("{clock}; they are {by_s:.1} s {side} the UTC in the sentences")
            }
            Self::Received { clock, .. } => (*clock).to_owned(),
            Self::Said(course) => {
                let origin = if course.dated { "the Unix epoch" } else { "midnight" };
                format!(
                    "the UTC in the sentences: seconds since {origin}; sentences without it are \
                     spread evenly between those with it, and up to {:.1} s off",
                    course.span_s()
                )
            }
        }
    }
}
