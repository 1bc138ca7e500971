//! The records of one type.

use std::collections::{BTreeMap, HashMap};

use super::definition::Definition;
use crate::assemble::{Assembly, Group};
use crate::column::Column;
use crate::readers::number::Kind;
use crate::{Dimension, Unit};

/// Meanings of letters from UNIT and MULT records.
#[derive(Default)]
pub(super) struct Letters {
    pub(super) units: HashMap<u8, String>,
    pub(super) multipliers: HashMap<u8, f64>,
}

/// Purpose of the records of a type.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Role {
    Measurement,
    /// A measurement with the date.
    Fix,
    Definition,
    /// Letters of a type's units and multipliers.
    Letters,
    Unit,
    Multiplier,
    Setting,
}

/// A type and its records, as stored.
pub(super) struct Table {
    pub(super) definition: Definition,
    pub(super) role: Role,
    /// Letters of each field's unit and multiplier, from FMTU.
    pub(super) unit_letters: Vec<u8>,
    pub(super) multiplier_letters: Vec<u8>,
    clock: Option<Clock>,
    time_s: Vec<f64>,
    /// Values of each field; empty for fields that are not numbers.
    values: Vec<Vec<f64>>,
    /// Number of records that were not kept.
    pub(super) dropped: usize,
}

/// The time field.
#[derive(Clone, Copy)]
struct Clock {
    field: usize,
    per_s: f64,
}

impl Table {
    pub(super) fn new(definition: Definition) -> Self {
        let clock = |name, per_s| {
            let field = definition.fields.iter().position(|field| field.name == name)?;
            let is_number = definition.fields[field].why_no_channel.is_none();
            is_number.then_some(Clock { field, per_s })
        };
        let clock = clock("TimeUS", 1e6).or_else(|| clock("TimeMS", 1e3));
        let clock = clock.filter(|_| definition.opaque.is_none());
        let values = vec![Vec::new(); definition.fields.len()];
        let role = match definition.name.as_str() {
            "FMT" => Role::Definition,
            "FMTU" => Role::Letters,
            "UNIT" => Role::Unit,
            "MULT" => Role::Multiplier,
            "PARM" => Role::Setting,
            "GPS" => Role::Fix,
            _ => Role::Measurement,
        };
        Self {
            definition,
            role,
            unit_letters: Vec::new(),
            multiplier_letters: Vec::new(),
            clock,
            time_s: Vec::new(),
            values,
            dropped: 0,
        }
    }

    /// Returns the time of a record, s on the autopilot's clock.
    pub(super) fn time_s(&self, body: &[u8]) -> Option<f64> {
        let Clock { field, per_s } = self.clock?;
        let field = &self.definition.fields[field];
        Some(field.kind.value(body.get(field.at..)?) / per_s)
    }

    /// Stores a record.
    pub(super) fn push(&mut self, time_s: f64, body: &[u8]) {
        self.time_s.push(time_s);
        for (field, values) in self.definition.fields.iter().zip(&mut self.values) {
            if field.why_no_channel.is_none() {
                values.push(field.kind.value(&body[field.at..]));
            }
        }
    }

    /// Makes channels of the records.
    pub(super) fn into_groups(mut self, letters: &Letters, assembly: &mut Assembly) {
        let name = std::mem::take(&mut self.definition.name);
        if let Some(why) = self.why_dropped() {
            assembly.leave_out(name.clone(), why);
        }
        if self.time_s.is_empty() {
            return;
        }
        for field in self.definition.fields.iter().filter(|field| !field.name.is_empty()) {
            if let Some(why) = field.why_no_channel {
                assembly.leave_out(format!("{name}.{}", field.name), why);
            }
        }
        let Some(instance) = self.instance_field() else {
            let (time_s, rows) = (std::mem::take(&mut self.time_s), None);
            return assembly.group(self.group(name, time_s, rows, letters));
        };
        let mut instances: BTreeMap<u8, Vec<usize>> = BTreeMap::new();
        for (row, value) in self.values[instance].iter().enumerate() {
            instances.entry(*value as u8).or_default().push(row);
        }
        self.values[instance] = Vec::new();
        let time_s = std::mem::take(&mut self.time_s);
        for (instance, rows) in instances {
            let time_s = rows.iter().map(|row| time_s[*row]).collect();
            let group = self.group(format!("{name}[{instance}]"), time_s, Some(&rows), letters);
            assembly.group(group);
        }
    }

    fn why_dropped(&self) -> Option<&'static str> {
        let timeless = self.clock.is_none().then_some("has no time of its own");
        self.definition.opaque.or(timeless).filter(|_| self.dropped > 0)
    }

    /// Returns the field with the instance number of a record.
    fn instance_field(&self) -> Option<usize> {
        let field = self.unit_letters.iter().position(|letter| *letter == b'#')?;
        (self.definition.fields.get(field)?.kind == Kind::U8).then_some(field)
    }

    /// Returns the records of one instance, or all, taking their values.
    fn group(
        &mut self,
        name: String,
        time_s: Vec<f64>,
        rows: Option<&[usize]>,
        letters: &Letters,
    ) -> Group {
        let clock = self.clock.map(|clock| clock.field);
        let mut columns = Vec::new();
        for k in 0..self.values.len() {
            if Some(k) == clock || self.values[k].is_empty() || self.named(k).is_none() {
                continue;
            }
            let mut values = match rows {
                Some(rows) => rows.iter().map(|row| self.values[k][*row]).collect(),
                None => std::mem::take(&mut self.values[k]),
            };
            self.scale(k, letters).apply(&mut values);
            let column = format!("{name}.{}", self.definition.fields[k].name);
            columns.push(Column::new(column, self.unit(k, letters), values));
        }
        Group { name, time_s, columns, of: None }
    }

    fn named(&self, field: usize) -> Option<&str> {
        let name = self.definition.fields[field].name.as_str();
        (!name.is_empty()).then_some(name)
    }

    fn unit(&self, field: usize, letters: &Letters) -> Option<Unit> {
        let symbol = letters.units.get(self.unit_letters.get(field)?)?;
        match symbol.as_str() {
            "degheading" | "deglatitude" | "deglongitude" => Unit::find("deg"),
            // The only letter for microseconds is that of servos; times are in s.
            "us" => Unit::find_as("us", Dimension::PulseWidth),
            symbol => Unit::find(symbol),
        }
    }

    /// Returns the conversion of a stored number to its unit. The letter of its type and its
    /// multiplier agree where both define one.
    fn scale(&self, field: usize, letters: &Letters) -> Scale {
        let divisor = self.definition.fields[field].divisor;
        if divisor != 1.0 {
            return Scale::Over(divisor);
        }
        let letter = self.multiplier_letters.get(field);
        let multiplier = letter.and_then(|letter| letters.multipliers.get(letter)).copied();
        match multiplier {
            Some(small) if small > 0.0 && small < 1.0 => Scale::Over((1.0 / small).round()),
            Some(large) if large > 1.0 && large.is_finite() => Scale::Times(large),
            _ => Scale::Over(1.0),
        }
    }
}

/// Division is exact to the last bit where multiplication by an inverse is not.
enum Scale {
    Over(f64),
    Times(f64),
}

impl Scale {
    fn apply(&self, values: &mut [f64]) {
        match self {
            Self::Over(divisor) if *divisor == 1.0 => {}
            Self::Over(divisor) => values.iter_mut().for_each(|value| *value /= divisor),
            Self::Times(factor) => values.iter_mut().for_each(|value| *value *= factor),
        }
    }
}
