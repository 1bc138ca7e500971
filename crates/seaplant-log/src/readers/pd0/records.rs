//! Converts ensembles to columns.

use std::path::Path;

use jiff::civil::DateTime;
use jiff::tz::TimeZone;

use super::ensemble::{BOTTOM_TRACK, Ensemble, FIXED_LEADER, VARIABLE_LEADER, u16_at};
use crate::Unit;
use crate::assemble::{Assembly, Group};
use crate::column::Column;
use crate::note::Note;

/// A number at a fixed position of a data type, from Teledyne's tables of the PD0 format.
struct Field {
    name: &'static str,
    /// Unit; empty if it is not a unit of channels.
    unit: &'static str,
    data_type: u16,
    at: usize,
    kind: Kind,
    /// Stored units in one of the unit.
    per_unit: f64,
}

#[derive(Clone, Copy)]
enum Kind {
    U8,
    U16,
    /// 0 where no bottom was detected.
    Range,
    I16,
    I32,
    /// Two bytes, and a third elsewhere for ensembles after 65 535.
    Ensemble,
}

const fn leader(name: &'static str, unit: &'static str, at: usize, kind: Kind, per: f64) -> Field {
    Field { name, unit, data_type: VARIABLE_LEADER, at, kind, per_unit: per }
}

const fn bottom(name: &'static str, unit: &'static str, at: usize, kind: Kind, per: f64) -> Field {
    Field { name, unit, data_type: BOTTOM_TRACK, at, kind, per_unit: per }
}

#[rustfmt::skip]
const FIELDS: &[Field] = &[
    bottom("bottom_track.range_1", "m", 16, Kind::Range, 100.0),
    bottom("bottom_track.range_2", "m", 18, Kind::Range, 100.0),
    bottom("bottom_track.range_3", "m", 20, Kind::Range, 100.0),
    bottom("bottom_track.range_4", "m", 22, Kind::Range, 100.0),
    bottom("bottom_track.correlation_1", "", 32, Kind::U8, 1.0),
    bottom("bottom_track.correlation_2", "", 33, Kind::U8, 1.0),
    bottom("bottom_track.correlation_3", "", 34, Kind::U8, 1.0),
    bottom("bottom_track.correlation_4", "", 35, Kind::U8, 1.0),
    bottom("bottom_track.percent_good_1", "%", 40, Kind::U8, 1.0),
    bottom("bottom_track.percent_good_2", "%", 41, Kind::U8, 1.0),
    bottom("bottom_track.percent_good_3", "%", 42, Kind::U8, 1.0),
    bottom("bottom_track.percent_good_4", "%", 43, Kind::U8, 1.0),
    leader("heading", "deg", 18, Kind::U16, 100.0),
    leader("pitch", "deg", 20, Kind::I16, 100.0),
    leader("roll", "deg", 22, Kind::I16, 100.0),
    leader("transducer.depth", "m", 16, Kind::U16, 10.0),
    leader("pressure", "dbar", 48, Kind::I32, 1000.0),
    leader("temperature", "", 26, Kind::I16, 100.0),
    leader("salinity", "", 24, Kind::U16, 1.0),
    leader("speed_of_sound", "m/s", 14, Kind::U16, 1.0),
    leader("ensemble", "", 2, Kind::Ensemble, 1.0),
];

/// Velocities over ground, by the frame that the instrument was set to.
const VELOCITIES: [[&str; 4]; 4] = [
    [
        "bottom_track.beam.velocity_1",
        "bottom_track.beam.velocity_2",
        "bottom_track.beam.velocity_3",
        "bottom_track.beam.velocity_4",
    ],
    [
        "bottom_track.instrument.velocity_x",
        "bottom_track.instrument.velocity_y",
        "bottom_track.instrument.velocity_z",
        "bottom_track.instrument.velocity_error",
    ],
    [
        "bottom_track.ship.velocity_starboard",
        "bottom_track.ship.velocity_forward",
        "bottom_track.ship.velocity_up",
        "bottom_track.ship.velocity_error",
    ],
    [
        "bottom_track.earth.velocity_east",
        "bottom_track.earth.velocity_north",
        "bottom_track.earth.velocity_up",
        "bottom_track.earth.velocity_error",
    ],
];

/// Other data types that users may expect, and their names.
const LEFT_OUT: &[(u16, &str)] = &[
    (0x0100, "velocity profile"),
    (0x0200, "correlation profile"),
    (0x0300, "echo intensity profile"),
    (0x0400, "percent good profile"),
];

/// Columns under construction; ensembles without a field give `NaN`.
#[derive(Default)]
pub(super) struct Records {
    time_s: Vec<f64>,
    velocities: [[Vec<f64>; 4]; 4],
    fields: [Vec<f64>; FIELDS.len()],
    left_out: [bool; LEFT_OUT.len()],
}

impl Records {
    /// Adds an ensemble.
    pub(super) fn take(&mut self, ensemble: &Ensemble<'_>) {
        let row = self.time_s.len();
        let leader = ensemble.find(VARIABLE_LEADER).unwrap_or_default();
        self.time_s.push(time(leader).unwrap_or(f64::NAN));
        let bottom = ensemble.find(BOTTOM_TRACK).unwrap_or_default();
        for (field, column) in FIELDS.iter().zip(&mut self.fields) {
            let bytes = if field.data_type == BOTTOM_TRACK { bottom } else { leader };
            if let Some(value) = field.value(bytes) {
                put(column, row, value);
            }
        }
        let frame = ensemble.find(FIXED_LEADER).and_then(frame);
        if let Some(frame) = frame {
            for (k, column) in self.velocities[frame].iter_mut().enumerate() {
                if let Some(value) = velocity(bottom, k) {
                    put(column, row, value);
                }
            }
        }
        for (number, _) in ensemble.types() {
            if let Some(k) = LEFT_OUT.iter().position(|(known, _)| *known == number) {
                self.left_out[k] = true;
            }
        }
    }

    /// Returns the latest time so far, s.
    pub(super) fn last_s(&self) -> Option<f64> {
        self.time_s.iter().rev().copied().find(|time| time.is_finite())
    }

    /// Hands all columns to the assembly.
    pub(super) fn hand_over(self, path: &Path, assembly: &mut Assembly) {
        let rows = self.time_s.len();
        let names = VELOCITIES.iter().flatten().map(|name| (*name, "m/s"));
        let named = names.zip(self.velocities.into_iter().flatten());
        let fields = FIELDS.iter().map(|field| (field.name, field.unit)).zip(self.fields);
        let mut columns = Vec::new();
        for ((name, unit), mut values) in named.chain(fields) {
            if !values.is_empty() {
                values.resize(rows, f64::NAN);
                columns.push(Column::new(name.to_owned(), Unit::find(unit), values));
            }
        }
        for ((_, name), _) in LEFT_OUT.iter().zip(self.left_out).filter(|(_, found)| *found) {
            assembly.leave_out((*name).to_owned(), "is over cells of depth, not one number a time");
        }
        if rows > 0 {
            let clock =
                "those of the instrument's clock, taken as UTC: seconds since the Unix epoch";
            assembly.note(Note::Clock { path: path.to_owned(), clock: clock.to_owned() });
            assembly.group(Group {
                name: "ensembles".to_owned(),
                time_s: self.time_s,
                columns,
                of: None,
            });
        }
    }
}

/// Sets the value of one row, filling the rows before it.
fn put(column: &mut Vec<f64>, row: usize, value: f64) {
    column.resize(row, f64::NAN);
    column.push(value);
}

impl Field {
    fn value(&self, bytes: &[u8]) -> Option<f64> {
        let number = match self.kind {
            Kind::U8 => f64::from(*bytes.get(self.at)?),
            Kind::U16 => f64::from(u16_at(bytes, self.at)?),
            Kind::Range => range(bytes, self.at)?,
            Kind::I16 => f64::from(u16_at(bytes, self.at)?.cast_signed()),
            Kind::I32 => {
                f64::from(i32::from_le_bytes(bytes.get(self.at..self.at + 4)?.try_into().ok()?))
            }
            Kind::Ensemble => {
                let past = u32::from(*bytes.get(11)?) << 16;
                f64::from(past | u32::from(u16_at(bytes, self.at)?))
            }
        };
        Some(number / self.per_unit)
    }
}

/// Returns the range to the bottom, cm: two bytes, and a third for those beyond 655.35 m.
fn range(bytes: &[u8], at: usize) -> Option<f64> {
    /// Position of the third bytes.
    const HIGH: usize = 77;
    let beam = (at - 16) / 2;
    let low = u32::from(u16_at(bytes, at)?);
    let high = bytes.get(HIGH + beam).copied().map_or(0, u32::from);
    let centimetres = high << 16 | low;
    Some(if centimetres == 0 { f64::NAN } else { f64::from(centimetres) })
}

/// Returns the velocity of the bottom relative to the instrument, m/s, along axis `k`.
fn velocity(bottom: &[u8], k: usize) -> Option<f64> {
    let millimetres = u16_at(bottom, 24 + 2 * k)?.cast_signed();
    Some(if millimetres == i16::MIN { f64::NAN } else { f64::from(millimetres) / 1000.0 })
}

/// Returns the frame of velocities: bits 3 and 4 of the setting EX, an index into [`VELOCITIES`].
fn frame(fixed_leader: &[u8]) -> Option<usize> {
    Some(usize::from(fixed_leader.get(25)? >> 3 & 0b11))
}

/// Returns the time of an ensemble, in seconds since the Unix epoch.
fn time(leader: &[u8]) -> Option<f64> {
    let clock = |at: usize| <[u8; 7]>::try_from(leader.get(at..at + 7)?).ok();
    let century = leader.get(57).map(|century| i16::from(*century) * 100);
    let with_century = || instant(century.filter(|c| (1900..=2000).contains(c))?, clock(58)?);
    let without = || {
        let clock = clock(4)?;
        instant(if clock[0] < 80 { 2000 } else { 1900 }, clock)
    };
    with_century().or_else(without)
}

/// Converts year of the century, month, day, hour, minute, second and hundredth.
fn instant(century: i16, clock: [u8; 7]) -> Option<f64> {
    let [year, month, day, hour, minute, second, hundredth] = clock.map(u8::cast_signed);
    if !(0..100).contains(&year) || !(0..100).contains(&hundredth) {
        return None;
    }
    let year = century + i16::from(year);
    let date_time = DateTime::new(year, month, day, hour, minute, second, 0).ok()?;
    let whole = date_time.to_zoned(TimeZone::UTC).ok()?.timestamp().as_second();
    Some(whole as f64 + f64::from(hundredth) / 100.0)
}
