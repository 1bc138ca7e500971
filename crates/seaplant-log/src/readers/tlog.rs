//! MAVLink telemetry logs, as ground stations write them.
//!
//! # Source
//! [MAVLink]

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::io::{self, Read};
use std::path::Path;

use crate::assemble::Assembly;
use crate::content::Content;
use crate::framing::Framing;
use crate::note::Note;
use crate::readers::number::text;
use crate::readers::window::Window;
use crate::{Error, Log, ReadOptions, Stamp};

mod clock;
mod frame;
mod messages;
mod table;

use clock::Clock;
use frame::{Frame, LONGEST, Next, Sender, next};
use messages::Message;
use table::Table;

/// Returns whether bytes start like a MAVLink telemetry log.
pub(crate) fn recognises(head: &[u8]) -> bool {
    /// Stamps beyond this year are implausible.
    const YEAR_2262_US: u64 = i64::MAX as u64 / 1000;
    let stamp = head.first_chunk().map_or(u64::MAX, |bytes| u64::from_be_bytes(*bytes));
    head.len() > 8
        && stamp < YEAR_2262_US
        && matches!(next(head), Next::Frame(_) | Next::Unknown(..))
}

/// Separates frames by the length that each starts with.
pub(crate) fn framing(_head: &[u8]) -> Option<Framing> {
    Some(Framing::Records(Box::new(length)))
}

/// Returns the length of the frame that bytes start with.
fn length(bytes: &[u8]) -> Option<usize> {
    match next(&bytes[..bytes.len().min(LONGEST)]) {
        Next::Frame(frame) => Some(frame.length),
        Next::Unknown(_, length) => Some(length),
        _ => None,
    }
}

/// Reads a MAVLink telemetry log: a channel `MESSAGE.field` for each number of each known message.
///
/// If several systems or components send a message, its channels are
/// `MESSAGE[SYSTEM.COMPONENT].field`, and if it has several instances or names,
/// `MESSAGE[NAME].field`.
///
/// # Errors
/// [`Error::NoSamples`], [`Error::Io`].
pub(crate) fn read(content: Content, options: &ReadOptions) -> Result<Log, Error> {
    let path = content.path().to_owned();
    let (origin, stream) = content.stream();
    let mut window = Window::new(stream);
    let mut telemetry = Telemetry::default();
    let cut = scan(&mut window, &mut telemetry).map_err(|error| origin.failed(error))?;
    let latest_s = telemetry.latest_s;
    let mut assembly = Assembly::new(origin, options);
    window.note(&path).into_iter().for_each(|note| assembly.note(note));
    if let Some(byte) = cut {
        assembly.note(Note::Truncated { path: path.clone(), byte, last_s: latest_s });
    }
    telemetry.into_log(assembly, options.stamp, &path)
}

/// Reads every frame, and returns the position of a truncated last one.
fn scan<R: Read>(window: &mut Window<R>, telemetry: &mut Telemetry) -> io::Result<Option<u64>> {
    let mut in_step = true;
    loop {
        match next(window.ahead(LONGEST)?) {
            Next::Frame(frame) => {
                let length = frame.length;
                telemetry.enter(&frame);
                window.take(length);
                in_step = true;
            }
            Next::Unknown(number, length) => {
                *telemetry.unknown.entry(number).or_default() += 1;
                window.take(length);
                in_step = true;
            }
            Next::Damage(length) => {
                window.skip(length);
                in_step = false;
            }
            Next::Cut if in_step => return Ok(Some(window.byte())),
            // Bytes within damage may look like the start of a frame by chance.
            Next::Cut => window.skip(1),
            Next::End => return Ok(None),
        }
    }
}

/// State read from the frames so far.
#[derive(Default)]
struct Telemetry {
    tables: Vec<Table>,
    places: HashMap<(u32, Sender), usize>,
    clocks: HashMap<Sender, Clock>,
    settings: BTreeMap<String, f64>,
    /// Numbers of unknown messages, and how often each occurred.
    unknown: BTreeMap<u32, usize>,
    latest_s: Option<f64>,
}

impl Telemetry {
    fn enter(&mut self, frame: &Frame<'_>) {
        let mut payload = [0; 256 + 8];
        payload[..frame.payload.len()].copy_from_slice(frame.payload);
        if frame.message.name == "PARAM_VALUE" {
            self.set(frame.message, &payload);
            return;
        }
        let received_s = frame.stamp_us as f64 / 1e6;
        let stamp = self.stamp(frame, &payload, received_s);
        let tables = &mut self.tables;
        let place = *self.places.entry((frame.message.number, frame.sender)).or_insert_with(|| {
            tables.push(Table::new(frame.message, frame.sender));
            tables.len() - 1
        });
        tables[place].push(received_s, stamp, &payload);
        self.latest_s = Some(received_s);
    }

    fn set(&mut self, message: &Message, payload: &[u8]) {
        let (Some(name), Some(value)) = (message.field("param_id"), message.field("param_value"))
        else {
            return;
        };
        let value = value.kind.value(&payload[value.at..]);
        if value.is_finite() {
            let name = text(&payload[name.at..name.at + name.size()]);
            self.settings.insert(name, value);
        }
    }

    /// Returns the sender's own stamp.
    fn stamp(&mut self, frame: &Frame<'_>, payload: &[u8], received_s: f64) -> clock::Stamp {
        /// Later stamps, s, count from the Unix epoch, by another clock.
        const EPOCH_S: f64 = 1e9;
        const PERIOD_S: f64 = 4_294.967_296;
        let value = |name: &str| {
            let field = frame.message.field(name)?;
            Some((field.kind.value(&payload[field.at..]), field.kind.size()))
        };
        if let Some((time, _)) = value("time_boot_ms") {
            let clock = self.clocks.entry(frame.sender).or_default();
            return clock.hear(time / 1e3, received_s);
        }
        let clock = self.clocks.get(&frame.sender);
        let stamp = value("time_usec").or_else(|| value("usec"));
        match (clock, stamp.map(|(time, size)| (time / 1e6, size))) {
            (Some(clock), Some((time, 4))) => clock.place(clock.unwrap(time, PERIOD_S)),
            (Some(clock), Some((time, _))) if time < EPOCH_S => clock.place(time),
            _ => clock::Stamp::NONE,
        }
    }

    fn into_log(self, mut assembly: Assembly, stamp: Stamp, path: &Path) -> Result<Log, Error> {
        let mut senders: HashMap<u32, BTreeSet<Sender>> = HashMap::new();
        for (number, sender) in self.places.keys() {
            senders.entry(*number).or_default().insert(*sender);
        }
        for (name, value) in self.settings {
            assembly.setting(name, value);
        }
        let mut unusable = 0;
        for table in self.tables {
            let clock = self.clocks.get(&table.sender).filter(|_| stamp == Stamp::Header);
            let apart = senders[&table.message.number].len() > 1;
            unusable += table.into_groups(clock, apart, &mut assembly);
        }
        let path = path.to_owned();
        assembly.note(Note::Clock { path: path.clone(), clock: in_words(stamp, unusable) });
        if !self.unknown.is_empty() {
            let numbers = self.unknown.into_iter().collect();
            assembly.note(Note::UnknownMessages { path, numbers });
        }
        assembly.log("MAVLink telemetry")
    }
}

/// Describes the clock of the times.
fn in_words(stamp: Stamp, unusable: usize) -> String {
    let clock = "seconds since the Unix epoch by the receiver's clock";
    match (stamp, unusable) {
        (Stamp::Receive, _) => format!("{clock}, of receipt"),
        (Stamp::Header, 0) => format!(
            "{clock}: the senders' own stamps, laid on it by the quickest message of each; of \
             messages without, of receipt"
        ),
        (Stamp::Header, unusable) => format!(
            "{clock}: the senders' own stamps, laid on it by the quickest message of each; of \
             messages without, and of {unusable} whose stamps are far from their receipt, of receipt"
        ),
    }
}
