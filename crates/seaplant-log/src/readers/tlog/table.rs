//! Messages of one kind from one sender.

use std::collections::HashMap;

use super::clock::{Clock, Stamp};
use super::frame::Sender;
use super::messages::{Field, Message};
use crate::assemble::{Assembly, Group};
use crate::column::Column;
use crate::readers::number::{Kind, text};

/// Messages of one kind from one sender.
pub(super) struct Table {
    pub(super) message: &'static Message,
    pub(super) sender: Sender,
    received_s: Vec<f64>,
    stamps: Vec<Stamp>,
    /// A column for each value of each field.
    values: Vec<Vec<f64>>,
    instances: Instances,
}

/// Instance of each message.
#[derive(Default)]
struct Instances {
    /// Instances in the order of their first messages, by the bytes of their field.
    known: HashMap<Vec<u8>, usize>,
    labels: Vec<String>,
    of_row: Vec<usize>,
}

impl Table {
    pub(super) fn new(message: &'static Message, sender: Sender) -> Self {
        let columns = numbers(message).map(|field| field.count.unwrap_or(1)).sum();
        let (received_s, stamps, values) = (Vec::new(), Vec::new(), vec![Vec::new(); columns]);
        Self { message, sender, received_s, stamps, values, instances: Instances::default() }
    }

    /// Adds a message; `payload` holds every field.
    pub(super) fn push(&mut self, received_s: f64, stamp: Stamp, payload: &[u8]) {
        self.received_s.push(received_s);
        self.stamps.push(stamp);
        let mut columns = self.values.iter_mut();
        for field in numbers(self.message) {
            let size = field.kind.size();
            for k in 0..field.count.unwrap_or(1) {
                if let Some(column) = columns.next() {
                    column.push(field.kind.value(&payload[field.at + k * size..]));
                }
            }
        }
        if let Some(field) = self.message.instance {
            self.instances.push(&self.message.fields[field], payload);
        }
    }

    /// Makes channels of the messages. `clock` is the sender's if its stamps are used; `apart`
    /// distinguishes it from other senders of this message. Returns the number of unusable stamps.
    pub(super) fn into_groups(
        mut self,
        clock: Option<&Clock>,
        apart: bool,
        assembly: &mut Assembly,
    ) -> usize {
        let [system, component] = self.sender;
        let name = self.message.name;
        for field in &self.message.fields {
            if let Some(why) = field.why_no_channel {
                assembly.leave_out(format!("{name}.{}", field.name), why);
            }
        }
        let name = if apart { format!("{name}[{system}.{component}]") } else { name.to_owned() };
        let (time_s, unusable) = self.times(clock);
        if self.instances.labels.len() < 2 {
            let group = self.group(name, time_s, None);
            assembly.group(group);
            return unusable;
        }
        let instances = std::mem::take(&mut self.instances);
        let mut rows = vec![Vec::new(); instances.labels.len()];
        for (row, instance) in instances.of_row.iter().enumerate() {
            rows[*instance].push(row);
        }
        for (label, rows) in instances.labels.iter().zip(rows) {
            let time_s = rows.iter().map(|row| time_s[*row]).collect();
            let group = self.group(format!("{name}[{label}]"), time_s, Some(&rows));
            assembly.group(group);
        }
        unusable
    }

    fn times(&mut self, clock: Option<&Clock>) -> (Vec<f64>, usize) {
        let received_s = std::mem::take(&mut self.received_s);
        let Some(clock) = clock else { return (received_s, 0) };
        let mut unusable = 0;
        let pairs = received_s.into_iter().zip(&self.stamps);
        let time = |(received_s, stamp): (f64, &Stamp)| {
            let sent_s = clock.received(*stamp, received_s);
            unusable += usize::from(sent_s.is_none() && stamp.time_s.is_finite());
            sent_s.unwrap_or(received_s)
        };
        (pairs.map(time).collect(), unusable)
    }

    /// Returns some of the messages, or all, taking their values.
    fn group(&mut self, name: String, time_s: Vec<f64>, rows: Option<&[usize]>) -> Group {
        let mut columns = Vec::new();
        let mut place = 0;
        for (index, field) in self.message.fields.iter().enumerate() {
            if field.why_no_channel.is_some() {
                continue;
            }
            for k in 0..field.count.unwrap_or(1) {
                let mut values: Vec<f64> = match rows {
                    Some(rows) => rows.iter().map(|row| self.values[place][*row]).collect(),
                    None => std::mem::take(&mut self.values[place]),
                };
                place += 1;
                if rows.is_some() && self.message.instance == Some(index) {
                    continue;
                }
                if field.divisor != 1.0 {
                    values.iter_mut().for_each(|value| *value /= field.divisor);
                }
                let element = field.count.map(|_| format!("[{k}]")).unwrap_or_default();
                let column = format!("{name}.{}{element}", field.name);
                columns.push(Column::new(column, field.unit.clone(), values));
            }
        }
        Group { name, time_s, columns, of: None }
    }
}

/// Iterates over the numeric fields.
fn numbers(message: &'static Message) -> impl Iterator<Item = &'static Field> {
    message.fields.iter().filter(|field| field.why_no_channel.is_none())
}

impl Instances {
    fn push(&mut self, field: &Field, payload: &[u8]) {
        let bytes = &payload[field.at..field.at + field.size()];
        let instance = match self.known.get(bytes) {
            Some(instance) => *instance,
            None => {
                let label = match field.kind {
                    Kind::Text(_) => text(bytes),
                    kind => kind.value(bytes).to_string(),
                };
                self.labels.push(label);
                self.known.insert(bytes.to_owned(), self.labels.len() - 1);
                self.labels.len() - 1
            }
        };
        self.of_row.push(instance);
    }
}
