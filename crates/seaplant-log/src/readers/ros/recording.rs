//! Topics of a bag, whatever its format.

use std::collections::HashMap;
use std::path::Path;

use super::bundled;
use super::chunks::Choice;
use super::decode::Encoding;
use super::definition::{Definitions, plain};
use super::layout::Layout;
use super::packing::{Packing, ZSTD};
use super::topic::{NO_MESSAGE, Timed, Topic};
use crate::assemble::Assembly;
use crate::content::Origin;
use crate::glance::Glance;
use crate::note::Note;
use crate::spelling::list;
use crate::unpack;
use crate::{Error, Figure, Log, ReadOptions, Stamp};

/// A bag's description of a topic's messages.
#[derive(Clone, PartialEq, Eq, Hash)]
pub(crate) struct Connection {
    pub(crate) topic: String,
    /// `package/msg/Type` or `package/Type`.
    pub(crate) kind: String,
    pub(crate) encoding: Encoding,
    /// `None` if the bag has none.
    pub(crate) definition: Option<String>,
}

/// Damaged stretches.
#[derive(Default)]
pub(crate) struct Damage {
    count: usize,
    first: Option<u64>,
    bytes: u64,
}

/// Topics of a bag while it is read.
pub(crate) struct Recording {
    stamp: Stamp,
    topics: Vec<Topic>,
    known: HashMap<Connection, Option<usize>>,
    left_out: Vec<(String, &'static str)>,
    damage: Damage,
    truncated: Option<u64>,
    /// An unsupported compression, with advice.
    unknown_packing: Option<(String, &'static str)>,
    /// An unpacked message.
    message: Vec<u8>,
    /// Size of the file, and number of bytes unpacked from it.
    length: u64,
    unpacked: u64,
}

impl Recording {
    /// Creates the recording of a file of `length` bytes.
    pub(crate) fn new(length: u64, options: &ReadOptions) -> Self {
        Self {
            stamp: options.stamp,
            topics: Vec::new(),
            known: HashMap::new(),
            left_out: Vec::new(),
            damage: Damage::default(),
            truncated: None,
            unknown_packing: None,
            message: Vec::new(),
            length,
            unpacked: 0,
        }
    }

    /// Returns the topic of a connection; `None` if its messages cannot be read.
    pub(crate) fn topic(&mut self, connection: &Connection) -> Option<usize> {
        if let Some(known) = self.known.get(connection) {
            return *known;
        }
        let topic = match layout(connection) {
            Ok(layout) => {
                let (name, encoding) = (connection.topic.clone(), connection.encoding);
                self.topics.push(Topic::new(name, encoding, layout, self.stamp));
                Some(self.topics.len() - 1)
            }
            Err(why) => {
                self.leave_out(connection.topic.clone(), why);
                None
            }
        };
        self.known.insert(connection.clone(), topic);
        topic
    }

    /// Records a topic without channels, with the reason.
    pub(crate) fn leave_out(&mut self, topic: String, why: &'static str) {
        self.left_out.push((topic, why));
    }

    /// Adds a message that was received at `receipt` ns and is at `byte` of the file.
    pub(crate) fn message(&mut self, topic: usize, receipt: i64, bytes: &[u8], byte: u64) {
        let mut unpacked = std::mem::take(&mut self.message);
        // ROS 2 may compress each message; no CDR starts with these bytes.
        let packed = bytes.starts_with(ZSTD)
            && self.topics[topic].is_cdr()
            && Packing::Zstd.unpack(bytes, &mut unpacked);
        if packed {
            self.unpacked(unpacked.len());
        }
        let message = if packed { &unpacked } else { bytes };
        if !self.topics[topic].message(receipt, message) {
            self.damaged(byte, bytes.len() as u64);
        }
        self.message = unpacked;
    }

    /// Counts unpacked bytes.
    pub(crate) fn unpacked(&mut self, bytes: usize) {
        self.unpacked = self.unpacked.saturating_add(bytes as u64);
    }

    /// Returns whether more was unpacked than a plausible log of this size holds.
    pub(crate) fn swells(&self) -> bool {
        self.unpacked > unpack::limit(self.length)
    }

    /// Counts a damaged stretch.
    pub(crate) fn damaged(&mut self, byte: u64, bytes: u64) {
        self.damage.count += 1;
        self.damage.bytes = self.damage.bytes.saturating_add(bytes);
        self.damage.first.get_or_insert(byte);
    }

    /// Sets the number of messages of a topic in the bag, if only some of them are read.
    pub(crate) fn holds(&mut self, topic: usize, messages: u64) {
        let before = self.topics[topic].of.map_or(0, Figure::value);
        self.topics[topic].of = Some(Figure::Exact(before.saturating_add(messages)));
    }

    /// Estimates the number of messages of each topic, assuming that the same share of each topic
    /// was read.
    pub(crate) fn holds_about(&mut self, messages: u64, read: u64) {
        let times = messages as f64 / read.max(1) as f64;
        for topic in &mut self.topics {
            topic.of = Some(Figure::About((topic.len() as f64 * times).round() as u64));
        }
    }

    /// Returns whether no topic has more messages than the bag states.
    pub(crate) fn is_held(&self) -> bool {
        let held = |topic: &Topic| topic.of.is_some_and(|of| topic.len() as u64 <= of.value());
        self.topics.iter().all(|topic| topic.is_empty() || held(topic))
    }

    /// Returns whether damage was found.
    pub(crate) fn is_damaged(&self) -> bool {
        self.damage.count > 0 || self.truncated.is_some()
    }

    /// Records that the file ends in the record at `byte`.
    pub(crate) fn truncated(&mut self, byte: u64) {
        self.truncated.get_or_insert(byte);
    }

    /// Records an unsupported compression, with advice.
    pub(crate) fn unknown_packing(&mut self, name: String, advice: &'static str) {
        self.unknown_packing.get_or_insert((name, advice));
    }

    /// Makes the log of everything that was read, of the format `name`. Messages call the file
    /// `format`: "an MCAP file".
    ///
    /// # Errors
    /// [`Error::Unsupported`] where nothing could be unpacked or no topic be read, with the reason of
    /// the first; [`Error::TooMuch`] where more was unpacked than any log of this size holds;
    /// [`Error::NoSamples`].
    pub(crate) fn log(
        mut self,
        origin: Origin,
        options: &ReadOptions,
        format: &'static str,
        name: &str,
    ) -> Result<Log, Error> {
        let path = origin.path().to_owned();
        let empty = self.topics.iter().all(Topic::is_empty);
        if let Some((packing, advice)) = self.unknown_packing.take().filter(|_| empty) {
            let detail = format!("whose chunks are packed by {packing:?}");
            return Err(Error::Unsupported { path, format, detail, advice });
        }
        let mut assembly = Assembly::new(origin, options);
        self.finish(&path, format, &mut assembly)?;
        assembly.log(name)
    }

    /// Returns the log of some chunks, which an index selected; `None` if they do not represent the
    /// complete file.
    ///
    /// # Errors
    /// As [`Self::log`].
    pub(crate) fn glance(
        self,
        mut origin: Origin,
        options: &ReadOptions,
        format: &'static str,
        name: &str,
        choice: &Choice,
    ) -> Result<Option<Glance>, Error> {
        if self.is_damaged() || !self.is_held() {
            return Ok(None);
        }
        origin.reads_in_part(self.length);
        let log = self.log(origin, options, format, name)?;
        let Choice { places, bytes, pause_s } = choice;
        let (parts, bytes, pause_s) = (places.len(), *bytes, *pause_s);
        Ok(Some(Glance { log, parts, bytes, pause_s, has_ends: true }))
    }

    fn finish(
        self,
        path: &Path,
        format: &'static str,
        assembly: &mut Assembly,
    ) -> Result<(), Error> {
        let path = || path.to_owned();
        if self.swells() {
            let (packed, unpacked) = (self.length, self.unpacked);
            return Err(Error::TooMuch { path: path(), packed, unpacked });
        }
        if let Some(byte) = self.truncated {
            let last_s = self.topics.iter().filter_map(Topic::last_s).reduce(f64::max);
            assembly.note(Note::Truncated { path: path(), byte, last_s });
        }
        if let Damage { count: count @ 1.., first: Some(first_byte), bytes } = self.damage {
            assembly.note(Note::CorruptRecords { path: path(), count, first_byte, bytes });
        }
        let mut clock = Clock::default();
        let mut left_out = self.left_out;
        for topic in self.topics {
            let name = topic.name().to_owned();
            match topic.finish(assembly) {
                Timed::Stamped { lag_s } => clock.stamped(name, lag_s),
                Timed::Received => clock.received.push(name),
                Timed::Never(why) => left_out.push((name, why)),
            }
        }
        let clock = clock.words(self.stamp);
        let unread = left_out.iter().find(|(_, why)| *why != NO_MESSAGE);
        if let (None, Some((topic, why))) = (&clock, unread) {
            let detail = format!("in which {topic:?} {why}");
            let advice = "record topics of numbers as ROS messages, with their definitions";
            return Err(Error::Unsupported { path: path(), format, detail, advice });
        }
        for (topic, why) in left_out {
            assembly.leave_out(topic, why);
        }
        if let Some(clock) = clock {
            assembly.note(Note::Clock { path: path(), clock });
        }
        Ok(())
    }
}

fn layout(connection: &Connection) -> Result<Layout, &'static str> {
    const UNREADABLE: &str = "has a message definition that cannot be read";
    const UNKNOWN: &str = "is of a type without definition in the file, which is not one of the \
                           common types; record it as MCAP";
    const FRAMES: &str = "mixes the frames of several publishers";
    let Connection { kind, encoding, definition, .. } = connection;
    let kind = plain(kind);
    if kind == "tf2_msgs/TFMessage" || kind == "tf/tfMessage" {
        return Err(FRAMES);
    }
    let embedded;
    let definitions = match definition {
        Some(text) => {
            embedded = Definitions::parse(&kind, text, encoding.dialect()).ok_or(UNREADABLE)?;
            &embedded
        }
        None if *encoding == Encoding::Ros1 => return Err(UNKNOWN),
        None => bundled::definitions(),
    };
    if definitions.fields(&kind).is_none() {
        return Err(UNKNOWN);
    }
    Layout::compile(definitions, &kind, encoding.dialect())
}

/// Clock of the times, over all topics.
#[derive(Default)]
struct Clock {
    stamped: usize,
    received: Vec<String>,
    /// Topic whose first stamp differs most from its time of receipt, s.
    furthest: Option<(String, f64)>,
}

impl Clock {
    fn stamped(&mut self, topic: String, lag_s: f64) {
        self.stamped += 1;
        if self.furthest.as_ref().is_none_or(|(_, furthest)| lag_s.abs() > furthest.abs()) {
            self.furthest = Some((topic, lag_s));
        }
    }

    /// Describes the clock in words that follow "times are".
    fn words(&self, stamp: Stamp) -> Option<String> {
        /// Largest difference between readings of one clock, s.
        const APART_S: f64 = 1.0;
        const EPOCH: &str = "seconds since the Unix epoch";
        if stamp == Stamp::Receive || self.stamped == 0 {
            let none = if stamp == Stamp::Receive { "" } else { "; no message has a stamp" };
            let any = self.stamped > 0 || !self.received.is_empty();
            return any.then(|| format!("those of receipt, {EPOCH}{none}"));
        }
        let mut words = format!("header stamps, {EPOCH}");
        if !self.received.is_empty() {
            let without = list(&self.received);
            words = format!("{words}; of {without}, without stamps, those of receipt");
        }
        if let Some((topic, lag_s)) = self.furthest.as_ref().filter(|(_, lag)| lag.abs() > APART_S)
        {
            words = format!(
                "{words}; the first stamp of {topic:?} is {:.3} s {} its receipt: the clocks differ, \
                 so take `stamp = \"receive\"` if topics must agree",
                lag_s.abs(),
                if *lag_s < 0.0 { "before" } else { "after" }
            );
        }
        Some(words)
    }
}
