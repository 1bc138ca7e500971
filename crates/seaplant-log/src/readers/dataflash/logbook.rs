//! State accumulated from the records of a log.

use std::collections::{BTreeMap, HashMap};

use super::definition::{Definition, FMT, FMT_LENGTH};
use super::table::{Letters, Role, Table};
use crate::assemble::Assembly;
use crate::readers::number::{Kind, text};
use crate::{Epoch, Error, Log};

/// Time placed between the last record before a restart of the autopilot and the first after it, s:
/// no method takes it for a gap in one run.
const APART_S: f64 = 100.0;

/// Tolerance on the order of records in one run, s.
const JITTER_S: f64 = 1.0;

/// Information from the records so far.
pub(super) struct Logbook {
    /// Current table of each type number.
    types: [Option<usize>; 256],
    tables: Vec<Table>,
    /// Table of each definition, keyed by its bytes without the type number.
    known: HashMap<Vec<u8>, usize>,
    letters: Letters,
    settings: BTreeMap<String, f64>,
    /// The latest time, s.
    pub(super) latest_s: Option<f64>,
    /// Times at which each later start of the autopilot was placed, s.
    pub(super) restarts_s: Vec<f64>,
    /// Added to the autopilot's clock, s.
    shift_s: f64,
    /// True once the definitions were repeated, as they are when the autopilot starts.
    may_restart: bool,
    epoch: Option<jiff::Timestamp>,
}

impl Default for Logbook {
    fn default() -> Self {
        let mut types = [None; 256];
        types[usize::from(FMT)] = Some(0);
        Self {
            types,
            tables: vec![Table::new(Definition::of_definitions())],
            known: HashMap::new(),
            letters: Letters::default(),
            settings: BTreeMap::new(),
            latest_s: None,
            restarts_s: Vec::new(),
            shift_s: 0.0,
            may_restart: false,
            epoch: None,
        }
    }
}

impl Logbook {
    /// Returns the length of a record of a type.
    #[inline]
    pub(super) fn length(&self, number: u8) -> Option<usize> {
        Some(self.tables[self.types[usize::from(number)]?].definition.length)
    }

    /// Adds a record; `body` is the part after its header.
    #[inline]
    pub(super) fn enter(&mut self, number: u8, body: &[u8]) {
        let Some(index) = self.types[usize::from(number)] else { return };
        if self.is_told(index, body) {
            return;
        }
        let table = &mut self.tables[index];
        let Some(time_s) = table.time_s(body) else {
            table.dropped += 1;
            return;
        };
        if self.may_restart {
            self.restart(time_s);
        }
        let time_s = time_s + self.shift_s;
        self.tables[index].push(time_s, body);
        if time_s.is_finite() && self.latest_s.is_none_or(|latest_s| time_s > latest_s) {
            self.latest_s = Some(time_s);
        }
    }

    /// Returns whether a record describes the log or the vehicle instead of a measurement, after
    /// reading it.
    fn is_told(&mut self, index: usize, body: &[u8]) -> bool {
        // An incomplete description is ignored.
        let _ = match self.tables[index].role {
            Role::Measurement => return false,
            Role::Fix => {
                self.look_at_gps(index, body);
                return false;
            }
            Role::Definition => self.define(body),
            Role::Letters => self.assign_letters(index, body),
            Role::Unit => self.define_unit(index, body),
            Role::Multiplier => self.define_multiplier(index, body),
            Role::Setting => self.set(index, body),
        };
        true
    }

    fn define(&mut self, body: &[u8]) -> Option<()> {
        let (number, definition) = Definition::read(body)?;
        if number == FMT {
            // A different length of the definitions themselves would be damage.
            self.may_restart = self.latest_s.is_some();
            return (definition.length == FMT_LENGTH).then_some(());
        }
        let tables = &mut self.tables;
        let index = *self.known.entry(body[1..].to_owned()).or_insert_with(|| {
            tables.push(Table::new(definition));
            tables.len() - 1
        });
        self.types[usize::from(number)] = Some(index);
        Some(())
    }

    fn assign_letters(&mut self, index: usize, body: &[u8]) -> Option<()> {
        let number = self.number(index, "FmtType", body)?;
        let units = self.text(index, "UnitIds", body)?.into_bytes();
        let multipliers = self.text(index, "MultIds", body)?.into_bytes();
        let table = &mut self.tables[self.types[number as usize & 0xff]?];
        table.unit_letters = units;
        table.multiplier_letters = multipliers;
        Some(())
    }

    fn define_unit(&mut self, index: usize, body: &[u8]) -> Option<()> {
        let letter = self.number(index, "Id", body)? as u8;
        let label = self.text(index, "Label", body)?;
        self.letters.units.insert(letter, label);
        Some(())
    }

    fn define_multiplier(&mut self, index: usize, body: &[u8]) -> Option<()> {
        let letter = self.number(index, "Id", body)? as u8;
        // The multiplier is stored in 64 bits but was once rounded to 32, so seven digits are
        // meaningful.
        let meant = format!("{:.6e}", self.number(index, "Mult", body)?).parse().ok()?;
        self.letters.multipliers.insert(letter, meant);
        Some(())
    }

    fn set(&mut self, index: usize, body: &[u8]) -> Option<()> {
        let name = self.text(index, "Name", body)?;
        let value = self.number(index, "Value", body)?;
        self.settings.insert(name, value);
        Some(())
    }

    /// Reads the date from the first satellite fix.
    fn look_at_gps(&mut self, index: usize, body: &[u8]) {
        if self.epoch.is_none() && self.restarts_s.is_empty() {
            self.epoch = self.start_by_gps(index, body);
        }
    }

    fn start_by_gps(&self, index: usize, body: &[u8]) -> Option<jiff::Timestamp> {
        let week = self.number(index, "GWk", body).filter(|week| *week > 0.0)?;
        let of_week_s = self.number(index, "GMS", body)? / 1e3;
        let start_s = satellite_utc_s(week, of_week_s) - self.tables[index].time_s(body)?;
        jiff::Timestamp::from_second(start_s.round() as i64).ok()
    }

    /// Handles a clock that went back after the definitions were repeated: the autopilot restarted.
    fn restart(&mut self, time_s: f64) {
        self.may_restart = false;
        if let Some(latest_s) = self.latest_s
            && time_s + self.shift_s < latest_s - JITTER_S
        {
            let at_s = latest_s + APART_S;
            self.shift_s = at_s - time_s;
            self.restarts_s.push(at_s);
        }
    }

    fn number(&self, index: usize, field: &str, body: &[u8]) -> Option<f64> {
        let definition = &self.tables[index].definition;
        let field = definition.field(field).filter(|_| definition.opaque.is_none())?;
        let value = field.kind.value(body.get(field.at..)?);
        value.is_finite().then_some(value)
    }

    fn text(&self, index: usize, field: &str, body: &[u8]) -> Option<String> {
        let definition = &self.tables[index].definition;
        let field = definition.field(field).filter(|_| definition.opaque.is_none())?;
        let Kind::Text(size) = field.kind else { return None };
        Some(text(body.get(field.at..field.at + size)?))
    }

    /// Describes the clock of the times.
    pub(super) fn clock(&self) -> String {
        let clock = "seconds since the autopilot started".to_owned();
        match self.epoch {
            Some(epoch) => format!("{clock}, which was {epoch} by satellite"),
            None => clock,
        }
    }

    pub(super) fn into_log(self, mut assembly: Assembly) -> Result<Log, Error> {
        for (name, value) in self.settings {
            assembly.setting(name, value);
        }
        let since_1970_s = self.epoch.map(|start| start.as_duration().as_secs_f64());
        assembly.epoch(Epoch::Start { since_1970_s });
        for table in self.tables {
            table.into_groups(&self.letters, &mut assembly);
        }
        assembly.log("ArduPilot DataFlash")
    }
}

/// Converts a GPS week and the time in it to UTC, s since 1970.
///
/// A week before the first ArduPilot comes from a receiver whose week number overflowed after 1024.
fn satellite_utc_s(week: f64, of_week_s: f64) -> f64 {
    /// 1980-01-06.
    const EPOCH_S: f64 = 315_964_800.0;
    const WEEK_S: f64 = 604_800.0;
    /// Start of 2009.
    const FIRST_WEEK: f64 = 1512.0;
    const ROLLOVER: f64 = 1024.0;
    /// GPS times from which a number of leap seconds applies: since 2009-01-01, 2012-07-01,
    /// 2015-07-01 and 2017-01-01.
    const LEAP_S: [(f64, f64); 4] = [
        (f64::NEG_INFINITY, 15.0),
        (1_341_100_816.0, 16.0),
        (1_435_708_817.0, 17.0),
        (1_483_228_818.0, 18.0),
    ];
    let turns = ((FIRST_WEEK - week) / ROLLOVER).ceil().max(0.0);
    let satellite_s = EPOCH_S + (week + turns * ROLLOVER) * WEEK_S + of_week_s;
    let leap_s = LEAP_S.iter().rfind(|(from_s, _)| satellite_s >= *from_s);
    satellite_s - leap_s.map_or(0.0, |(_, leap_s)| *leap_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn satellite_time_is_utc_less_leap_seconds_and_rollovers() {
        let utc = |week, of_week_s: f64| {
            jiff::Timestamp::from_second(satellite_utc_s(week, of_week_s) as i64)
                .map(|instant| instant.to_string())
                .unwrap()
        };
        // GPS weeks that began on these Sundays.
        assert_eq!(utc(2200.0, 18.0), "2022-03-06T00:00:00Z");
        assert_eq!(utc(1852.0, 17.0), "2015-07-05T00:00:00Z");
        assert_eq!(utc(1851.0, 16.0), "2015-06-28T00:00:00Z");
        assert_eq!(utc(1513.0, 15.0), "2009-01-04T00:00:00Z");
        // A receiver whose week number restarts from 0 after 1023.
        assert_eq!(utc(2200.0 - 2048.0, 18.0), "2022-03-06T00:00:00Z");
    }
}
