//! State accumulated from the messages of a ULog file.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use super::topic::{Definition, Layout, Topic};
use crate::assemble::Assembly;
use crate::limits::MOST_COLUMNS;
use crate::readers::number::Kind;

/// Content of a synchronisation message.
const SYNC: [u8; 8] = [0x2f, 0x73, 0x13, 0x20, 0x25, 0x0c, 0xbb, 0x12];

/// Information from the messages so far.
#[derive(Default)]
pub(super) struct Logbook {
    definitions: HashMap<String, Definition>,
    /// Layout of each definition that was subscribed to; `None` for one without layout. It is built
    /// once, because a few bytes subscribe and a layout may have thousands of fields.
    layouts: HashMap<String, Option<Rc<Layout>>>,
    topics: Vec<Topic>,
    /// Total number of fields of all topics.
    fields: usize,
    places: HashMap<(String, u8), usize>,
    /// Current topic of each number.
    numbers: HashMap<u16, usize>,
    settings: BTreeMap<String, f64>,
    /// Positions of later parts of the file.
    parts: Vec<u64>,
    /// Latest time, s.
    pub(super) latest_s: Option<f64>,
    /// Time of the autopilot's start by satellite, s since 1970.
    start_s: Option<f64>,
}

/// Smallest plausible satellite time, in microseconds since 1970: there are no such logs before
/// 2010.
const LEAST_UTC_US: f64 = 1.26e15;

impl Logbook {
    /// Returns whether a message is plausible for its letter.
    pub(super) fn may_be(&self, letter: u8, body: &[u8]) -> bool {
        let topic = || self.topics.get(*self.numbers.get(&u16_of(body)?)?);
        match letter {
            b'D' => match topic() {
                Some(topic) => topic.layout.fits(body.len() - 2),
                // The size of a topic that is not read is unknown.
                None => body.len() > 2,
            },
            b'S' => body.len() >= SYNC.len() && body.starts_with(&SYNC),
            b'O' => body.len() == 2,
            b'B' => body.len() >= 40,
            b'A' => body.len() > 3,
            b'F' | b'I' | b'M' | b'P' | b'Q' => body.len() > 2,
            _ => true,
        }
    }

    /// Adds a message.
    pub(super) fn enter(&mut self, letter: u8, body: &[u8]) {
        // An invalid message is ignored.
        let _ = match letter {
            b'B' => self.note_parts(body),
            b'F' => self.define(body),
            b'P' => self.set(body),
            b'A' => self.subscribe(body),
            b'R' => self.unsubscribe(body),
            b'D' => self.record(body),
            _ => None,
        };
    }

    /// Returns the position of the next part that a logger appended.
    pub(super) fn next_part(&self, at: u64) -> Option<u64> {
        self.parts.iter().copied().filter(|part| *part > at).min()
    }

    /// Returns the time of the autopilot's start, s since 1970.
    pub(super) fn start_s(&self) -> Option<f64> {
        self.start_s
    }

    fn note_parts(&mut self, body: &[u8]) -> Option<()> {
        let is_appended = body.get(8)? & 1 == 1;
        let offsets = body.get(16..40)?.chunks_exact(8).filter_map(|eight| eight.try_into().ok());
        let offsets = offsets.map(u64::from_le_bytes).filter(|offset| *offset > 0 && is_appended);
        self.parts = offsets.collect();
        Some(())
    }

    fn define(&mut self, body: &[u8]) -> Option<()> {
        let definition = Definition::read(body)?;
        self.definitions.entry(definition.name.clone()).or_insert(definition);
        Some(())
    }

    fn set(&mut self, body: &[u8]) -> Option<()> {
        let (&length, rest) = body.split_first()?;
        let (key, value) = rest.split_at_checked(usize::from(length))?;
        let (kind, name) = std::str::from_utf8(key).ok()?.split_once(' ')?;
        let value = match kind {
            "float" => Kind::F32.value(value),
            "int32_t" => Kind::I32.value(value),
            _ => return None,
        };
        if value.is_finite() {
            self.settings.insert(name.to_owned(), value);
        }
        Some(())
    }

    fn subscribe(&mut self, body: &[u8]) -> Option<()> {
        let (&instance, rest) = body.split_first()?;
        let number = u16_of(rest)?;
        let name = std::str::from_utf8(rest.get(2..)?).ok()?.to_owned();
        let key = (name, instance);
        let place = match self.places.get(&key) {
            Some(place) => *place,
            None if self.has_too_many_fields() => return None,
            None => {
                let layout = self.layout(&key.0)?;
                self.fields += layout.fields();
                if self.has_too_many_fields() {
                    return None;
                }
                self.topics.push(Topic::new(key.0.clone(), instance, layout));
                self.places.insert(key, self.topics.len() - 1);
                self.topics.len() - 1
            }
        };
        self.numbers.insert(number, place);
        Some(())
    }

    fn layout(&mut self, name: &str) -> Option<Rc<Layout>> {
        if let Some(known) = self.layouts.get(name) {
            return known.clone();
        }
        self.definitions.get(name)?;
        let layout = Layout::new(name, &self.definitions).map(Rc::new);
        self.layouts.insert(name.to_owned(), layout.clone());
        layout
    }

    /// Returns whether topics have more fields than a log may have channels; later topics are not
    /// read.
    pub(super) fn has_too_many_fields(&self) -> bool {
        self.fields > MOST_COLUMNS
    }

    fn unsubscribe(&mut self, body: &[u8]) -> Option<()> {
        self.numbers.remove(&u16_of(body)?).map(|_| ())
    }

    fn record(&mut self, body: &[u8]) -> Option<()> {
        let topic = self.topics.get_mut(*self.numbers.get(&u16_of(body)?)?)?;
        let time_s = topic.push(body.get(2..)?);
        if time_s.is_finite() && self.latest_s.is_none_or(|latest_s| time_s > latest_s) {
            self.latest_s = Some(time_s);
        }
        if self.start_s.is_none() {
            let utc_us = topic.last("time_utc_usec").filter(|utc| *utc > LEAST_UTC_US);
            self.start_s = utc_us.map(|utc| (utc / 1e6 - time_s).round()).filter(|s| s.is_finite());
        }
        Some(())
    }

    /// Makes channels of all records.
    pub(super) fn into_groups(self, assembly: &mut Assembly) {
        for (name, value) in self.settings {
            assembly.setting(name, value);
        }
        let mut instances: HashMap<String, usize> = HashMap::new();
        for topic in self.topics.iter().filter(|topic| topic.has_records()) {
            *instances.entry(topic.name.clone()).or_default() += 1;
        }
        for topic in self.topics {
            let apart = instances.get(&topic.name).is_some_and(|count| *count > 1);
            topic.into_group(apart, assembly);
        }
    }
}

fn u16_of(bytes: &[u8]) -> Option<u16> {
    bytes.first_chunk().map(|two| u16::from_le_bytes(*two))
}
