//! Converts the messages of one topic to columns.

use std::ops::Range;

use super::decode::{Encoding, Known, Row, texts};
use super::layout::Layout;
use crate::assemble::{Assembly, Group};
use crate::column::{Column, Samples};
use crate::{Figure, Stamp, Unit};

/// Messages of one topic and type, so far.
pub(crate) struct Topic {
    name: String,
    encoding: Encoding,
    layout: Layout,
    row: Row,
    time_s: Vec<f64>,
    /// Columns of lists have values for some rows only.
    columns: Vec<Vec<f64>>,
    /// Rows in which each list has values.
    filled: Vec<Vec<usize>>,
    /// Names of the elements of its lists: the last bytes read, and their texts.
    names: Option<(Vec<u8>, Vec<String>)>,
    names_change: bool,
    /// Messages whose stamp is zero, with their times of receipt, s.
    unstamped: Vec<(usize, f64)>,
    /// Difference between the first stamp and its time of receipt, s.
    lag_s: Option<f64>,
    /// Number of messages that contradict the definition.
    misfits: usize,
    /// Number of messages in the bag, if only some of them are read.
    pub(super) of: Option<Figure<u64>>,
}

/// Reason why a topic that was only announced has no channels.
pub(crate) const NO_MESSAGE: &str = "has no message";

/// Origin of a topic's times.
pub(crate) enum Timed {
    /// Its messages carry stamps; holds the difference between the first and its time of receipt,
    /// s.
    Stamped {
        lag_s: f64,
    },
    Received,
    /// There are no times, for this reason, in words that follow the topic.
    Never(&'static str),
}

impl Topic {
    pub(crate) fn new(name: String, encoding: Encoding, mut layout: Layout, stamp: Stamp) -> Self {
        if stamp == Stamp::Receive {
            layout.show_stamp();
        }
        let (row, columns) = (Row::new(&layout), vec![Vec::new(); layout.leaves.len()]);
        let filled = vec![Vec::new(); layout.lists.len()];
        Self {
            name,
            encoding,
            layout,
            row,
            time_s: Vec::new(),
            columns,
            filled,
            names: None,
            names_change: false,
            unstamped: Vec::new(),
            lag_s: None,
            misfits: 0,
            of: None,
        }
    }

    /// Adds a message received at `receipt` ns; returns whether it agrees with the definition.
    pub(crate) fn message(&mut self, receipt: i64, bytes: &[u8]) -> bool {
        let read = |row: &mut Row, layout| row.read(layout, self.encoding, bytes).is_some();
        let mut fits = read(&mut self.row, &self.layout);
        if fits && !self.row.news.is_empty() && self.row.learn(&self.layout) {
            self.columns.resize(self.row.values.len(), Vec::new());
            fits = read(&mut self.row, &self.layout);
        }
        if !fits {
            self.misfits += 1;
            return false;
        }
        if let Some((from, to)) = self.row.names {
            self.learn_names(bytes, from, to);
        }
        self.push(0..self.layout.leaves.len());
        for k in 0..self.row.filled.len() {
            let list = self.row.filled[k];
            self.filled[list].push(self.time_s.len());
            self.push(self.row.columns(&self.layout, list));
        }
        self.push_time(receipt);
        true
    }

    fn push(&mut self, columns: Range<usize>) {
        let values = &self.row.values[columns.clone()];
        for (column, value) in self.columns[columns].iter_mut().zip(values) {
            column.push(*value);
        }
    }

    fn push_time(&mut self, receipt: i64) {
        let receipt_s = seconds([0, receipt]);
        let Some(stamp) = self.row.stamp else {
            self.time_s.push(receipt_s);
            return;
        };
        if stamp == [0, 0] {
            self.unstamped.push((self.time_s.len(), receipt_s));
            self.time_s.push(f64::NAN);
            return;
        }
        let time_s = seconds(stamp);
        self.lag_s.get_or_insert(time_s - receipt_s);
        self.time_s.push(time_s);
    }

    fn learn_names(&mut self, bytes: &[u8], from: usize, to: usize) {
        let header = if self.encoding == Encoding::Cdr { 4 } else { 0 };
        let Some(these) = bytes.get(header + from..header + to) else { return };
        if self.names.as_ref().is_some_and(|(known, _)| known == these) {
            return;
        }
        let Some(names) = texts(self.encoding, bytes, from).filter(|names| !names.is_empty())
        else {
            return;
        };
        // The bytes between texts are arbitrary.
        self.names_change |= self.names.as_ref().is_some_and(|(_, known)| *known != names);
        self.names = Some((these.to_owned(), names));
    }

    /// Returns the latest time of a message, s.
    pub(crate) fn last_s(&self) -> Option<f64> {
        self.time_s.iter().copied().filter(|time| time.is_finite()).reduce(f64::max)
    }

    /// Returns the number of messages added.
    pub(crate) fn len(&self) -> usize {
        self.time_s.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    pub(crate) fn is_cdr(&self) -> bool {
        self.encoding == Encoding::Cdr
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Hands the columns to the assembly; returns the origin of the times.
    pub(crate) fn finish(mut self, assembly: &mut Assembly) -> Timed {
        if self.time_s.is_empty() {
            return Timed::Never(match self.misfits {
                0 => NO_MESSAGE,
                _ => "has messages that are not as their definition says",
            });
        }
        for (path, why) in std::mem::take(&mut self.layout.left_out) {
            assembly.leave_out(format!("{}/{path}", self.name), why);
        }
        let timed = self.timed();
        let columns = self.named(assembly);
        assembly.group(Group { name: self.name, time_s: self.time_s, columns, of: self.of });
        timed
    }

    /// Replaces stamps by times of receipt, if no message has a stamp.
    fn timed(&mut self) -> Timed {
        if self.unstamped.len() == self.time_s.len() {
            for (row, receipt_s) in self.unstamped.drain(..) {
                self.time_s[row] = receipt_s;
            }
        }
        self.lag_s.map_or(Timed::Received, |lag_s| Timed::Stamped { lag_s })
    }

    fn named(&mut self, assembly: &mut Assembly) -> Vec<Column> {
        let Self { name: topic, layout, .. } = self;
        let mut values = std::mem::take(&mut self.columns);
        let messages = self.time_s.len();
        let mut column =
            |path: &str, unit: Option<&str>, index: usize, rows: Option<&Vec<usize>>| {
                let rows = rows.filter(|rows| rows.len() < messages).cloned();
                let samples = Samples { values: std::mem::take(&mut values[index]), rows };
                let unit = unit.and_then(Unit::find);
                Column::new(format!("{topic}/{path}"), unit, samples.dense(messages))
            };
        let leaves = layout.leaves.iter().enumerate();
        let mut columns: Vec<Column> =
            leaves.map(|(k, leaf)| column(&leaf.path, leaf.unit, k, None)).collect();
        let names = self.names.as_ref().map_or(&[][..], |(_, names)| names);
        let lists = layout.lists.iter().zip(&self.row.lists).zip(&self.filled);
        for ((list, known), rows) in lists {
            let (start, count) = match *known {
                Known::Columns { start, count } => (start, count),
                Known::Nothing => continue,
                Known::LeftOut(why) => {
                    assembly.leave_out(format!("{topic}/{}", list.path), why);
                    continue;
                }
            };
            if self.names_change {
                assembly
                    .leave_out(format!("{topic}/{}", list.path), "changes what its elements are");
                continue;
            }
            for k in 0..count {
                let element = match names.get(k).filter(|_| names.len() == count) {
                    Some(name) => name.clone(),
                    None => k.to_string(),
                };
                for (nth, leaf) in list.leaves.iter().enumerate() {
                    let path = format!("{}[{element}]{}", list.path, leaf.path);
                    let index = start + k * list.leaves.len() + nth;
                    columns.push(column(&path, leaf.unit, index, Some(rows)));
                }
            }
        }
        columns
    }
}

/// Converts seconds and nanoseconds to seconds, rounded to what a double distinguishes from its
/// neighbours.
fn seconds([s, ns]: [i64; 2]) -> f64 {
    const NS: i64 = 1_000_000_000;
    let (more, ns) = (ns.div_euclid(NS), ns.rem_euclid(NS));
    s.saturating_add(more) as f64 + 1e-9 * ns as f64
}
