//! Definitions of messages, from the MAVLink project.
//!
//! `messages.txt` is made by `scripts/mavlink-messages` from those in pymavlink 2.4.50 and holds
//! numbers, names, types and units, none of their texts. The definitions are under the LGPL 3, with
//! the exception that what is generated from them for a program comes under the MIT licence that
//! stands in `messages.txt.license`.

use std::collections::HashMap;
use std::sync::LazyLock;

use crate::readers::number::Kind;
use crate::{Dimension, Unit};

/// One line for each message of ardupilotmega and its includes.
const TABLE: &str = include_str!("messages.txt");

/// All known messages, by number.
static MESSAGES: LazyLock<HashMap<u32, Message>> = LazyLock::new(|| {
    let known = TABLE.lines().filter_map(Message::parse);
    known.map(|message| (message.number, message)).collect()
});

/// Returns the message of that number, if it is known.
pub(super) fn find(number: u32) -> Option<&'static Message> {
    MESSAGES.get(&number)
}

/// A known message.
#[derive(Debug)]
pub(super) struct Message {
    pub(super) number: u32,
    pub(super) name: &'static str,
    /// Seed byte of its checksum, with which frames of other definitions fail.
    pub(super) seed: u8,
    pub(super) fields: Vec<Field>,
    /// Field that identifies instances or names.
    pub(super) instance: Option<usize>,
}

/// A field as transmitted.
#[derive(Debug)]
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) kind: Kind,
    /// Number of values; `None` for a single one.
    pub(super) count: Option<usize>,
    /// Position in the payload.
    pub(super) at: usize,
    pub(super) unit: Option<Unit>,
    /// Divisor that converts its values to that unit.
    pub(super) divisor: f64,
    /// Reason why the field is no channel, in words that follow its name.
    pub(super) why_no_channel: Option<&'static str>,
}

impl Message {
    fn parse(line: &'static str) -> Option<Self> {
        let mut parts = line.split(' ');
        let number = parts.next()?.parse().ok()?;
        let name = parts.next()?;
        let seed = parts.next()?.parse().ok()?;
        let (mut fields, mut instance, mut at) = (Vec::new(), None, 0);
        for part in parts {
            let bare = part.trim_start_matches(['+', '*']);
            if part[..part.len() - bare.len()].contains('*') {
                instance = Some(fields.len());
            }
            let field = Field::parse(bare, at)?;
            at += field.size();
            fields.push(field);
        }
        Some(Self { number, name, seed, fields, instance })
    }

    /// Returns the field of that name.
    pub(super) fn field(&self, name: &str) -> Option<&Field> {
        self.fields.iter().find(|field| field.name == name)
    }
}

impl Field {
    /// Parses `rollspeed:f32:rad/s` and `voltages:u16[10]:mV`.
    fn parse(text: &'static str, at: usize) -> Option<Self> {
        /// Longer byte arrays are not measurements.
        const BYTES: usize = 16;
        let mut parts = text.split(':');
        let (name, kind, symbol) = (parts.next()?, parts.next()?, parts.next()?);
        let (kind, count) = match kind.strip_suffix(']').and_then(|kind| kind.split_once('[')) {
            Some((kind, count)) => (kind, Some(count.parse().ok()?)),
            None => (kind, None),
        };
        let (kind, count, why_no_channel) = match kind {
            "char" => (Kind::Text(count.unwrap_or(1)), None, Some("holds text")),
            "u8" if count > Some(BYTES) => {
                (Kind::Text(count?), None, Some("holds bytes, not measurements"))
            }
            kind => (number_of(kind)?, count, None),
        };
        let (unit, divisor) = unit_of(symbol, name);
        Some(Self { name, kind, count, at, unit, divisor, why_no_channel })
    }

    /// Returns the size in bytes.
    pub(super) fn size(&self) -> usize {
        self.kind.size() * self.count.unwrap_or(1)
    }
}

fn number_of(kind: &str) -> Option<Kind> {
    Some(match kind {
        "i8" => Kind::I8,
        "u8" => Kind::U8,
        "i16" => Kind::I16,
        "u16" => Kind::U16,
        "i32" => Kind::I32,
        "u32" => Kind::U32,
        "i64" => Kind::I64,
        "u64" => Kind::U64,
        "f32" => Kind::F32,
        "f64" => Kind::F64,
        _ => return None,
    })
}

/// Returns the unit of a definition's symbol, and the divisor that converts values to it.
fn unit_of(symbol: &str, field: &str) -> (Option<Unit>, f64) {
    let (symbol, divisor) = match symbol {
        "degE7" => ("deg", 1e7),
        "degE5" => ("deg", 1e5),
        "cdeg" => ("deg", 100.0),
        "deg/2" => ("deg", 0.5),
        "cdeg/s" => ("deg/s", 100.0),
        "ddeg/s" => ("deg/s", 10.0),
        "dm" => ("m", 10.0),
        "dam" => ("m", 0.1),
        "dm/s" => ("m/s", 10.0),
        "m/s*5" => ("m/s", 5.0),
        "cA" => ("A", 100.0),
        "cV" => ("V", 100.0),
        "c%" => ("%", 100.0),
        "d%" => ("%", 10.0),
        "cs" => ("s", 100.0),
        "ds" => ("s", 10.0),
        symbol => (symbol, 1.0),
    };
    // Microseconds are pulse widths in fields of servos, and times elsewhere.
    let is_pulse = ["servo", "chan"].iter().any(|word| field.starts_with(word));
    let unit = match symbol {
        "us" if !is_pulse => Unit::find_as(symbol, Dimension::Time),
        "ms" => Unit::find_as(symbol, Dimension::Time),
        // An acceleration in the definitions, but a mass in this crate.
        "g" => None,
        symbol => Unit::find(symbol),
    };
    (unit, divisor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_a_message() {
        assert_eq!((TABLE.lines().count(), MESSAGES.len()), (301, 301));
        for message in MESSAGES.values() {
            let size: usize = message.fields.iter().map(Field::size).sum();
            assert!(size <= 255, "{}", message.name);
        }
    }

    #[test]
    fn fields_have_places_and_units() {
        let attitude = find(30).unwrap();
        assert_eq!((attitude.name, attitude.fields.len()), ("ATTITUDE", 7));
        let yaw = attitude.field("yaw").unwrap();
        assert_eq!((yaw.at, yaw.kind, yaw.divisor), (12, Kind::F32, 1.0));
        let servo = find(36).unwrap().field("servo1_raw").unwrap();
        assert_eq!(servo.unit.as_ref().unwrap().dimension(), Dimension::PulseWidth);
        let time = find(36).unwrap().field("time_usec").unwrap();
        assert_eq!(time.unit.as_ref().unwrap().dimension(), Dimension::Time);
        let voltages = find(147).unwrap().field("voltages").unwrap();
        assert_eq!((voltages.count, voltages.size()), (Some(10), 20));
        let latitude = find(33).unwrap().field("lat").unwrap();
        assert_eq!((latitude.unit.as_ref().unwrap().symbol(), latitude.divisor), ("deg", 1e7));
    }
}
