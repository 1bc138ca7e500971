//! Conversion of thruster commands or propeller speeds to thrust.

mod model;

pub use model::{BetweenSamples, ThrustModel};

use std::ops::RangeInclusive;

use crate::{Error, ThrusterInput};

/// Exponents of thrust that propellers may have, over their input.
pub const EXPONENTS: RangeInclusive<f64> = 0.5..=4.0;

/// Thrust as a square law of an input, or another power of it, with a coefficient for each direction.
///
/// `F = forward · s^p` for s > 0 and `F = −reverse · |s|^p` for s < 0, with the exponent p, 2 by default,
/// where s is the input less `deadband` towards zero:
/// `s = sign(x − neutral) max(0, |x − neutral| − deadband)`.
///
/// # Source
/// [Jason2, fig. 2]: 0.0402 N/(rad/s)² forward, 0.0328 reverse, from bollard pull.
///
/// ```
/// use seaplant::QuadraticThrust;
/// let curve = QuadraticThrust { forward: 0.0402, reverse: 0.0328, ..Default::default() };
/// assert!((curve.force(100.0) - 402.0).abs() < 1e-9);
/// assert!((curve.force(-100.0) + 328.0).abs() < 1e-9);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticThrust {
    /// Coefficient for positive input, N per squared unit of input, or per its power p.
    pub forward: f64,
    /// Coefficient for negative input, in the same unit.
    pub reverse: f64,
    /// The exponent p.
    pub exponent: f64,
    /// Half-width of the band around neutral without thrust, in units of input.
    pub deadband: f64,
    /// The input of zero thrust: 0 rad/s, or 1500 µs.
    pub neutral: f64,
    /// Supply voltage of the measurement, V, if it is stated.
    pub voltage: Option<f64>,
}

impl Default for QuadraticThrust {
    fn default() -> Self {
        let (forward, reverse, exponent) = (0.0, 0.0, 2.0);
        Self { forward, reverse, exponent, deadband: 0.0, neutral: 0.0, voltage: None }
    }
}

impl QuadraticThrust {
    /// Returns the thrust at one input, N.
    pub fn force(&self, input: f64) -> f64 {
        let n = self.propeller_speed(input);
        let coefficient = if n < 0.0 { self.reverse } else { self.forward };
        coefficient * n * n.abs()
    }

    /// Returns n of thrust k n|n| at an input: s itself of a square law.
    pub fn propeller_speed(&self, input: f64) -> f64 {
        let effective = self.effective(input);
        if self.exponent == 2.0 {
            return effective;
        }
        effective.abs().powf(0.5 * self.exponent).copysign(effective)
    }

    /// Returns exponent, deadband and neutral input.
    const fn shape(&self) -> [f64; 3] {
        [self.exponent, self.deadband, self.neutral]
    }

    /// Returns the law that trials have shown thrust to follow.
    fn found(&self, found: &FoundThrust) -> Self {
        let FoundThrust { gains: [forward, reverse], beyond_square, dead_band, full_speed } =
            *found;
        let law =
            Self { forward: forward * self.forward, reverse: reverse * self.reverse, ..*self };
        if beyond_square == 0.0 && dead_band == 0.0 {
            return law;
        }
        // Inputs, beyond neutral and deadband, of a propeller that begins to turn and of one at full speed.
        let [still, full] =
            [dead_band * full_speed, full_speed].map(|n| n.powf(2.0 / self.exponent));
        let exponent = self.exponent * (1.0 + 0.5 * beyond_square);
        let scale = full_speed.powi(2) / (full - still).powf(exponent);
        let (forward, reverse) = (scale * law.forward, scale * law.reverse);
        Self { forward, reverse, exponent, deadband: self.deadband + still, ..law }
    }

    /// Returns the input relative to neutral, less the deadband.
    pub fn effective(&self, input: f64) -> f64 {
        let offset = input - self.neutral;
        (offset.abs() - self.deadband).max(0.0).copysign(offset)
    }
}

/// Thrust measured at inputs, linearly interpolated, at one supply voltage.
#[derive(Clone, Debug, PartialEq)]
pub struct ThrustTable {
    /// Supply voltage of the measurement, V; needed only in addition to other tables.
    pub voltage: Option<f64>,
    inputs: Vec<f64>,
    forces: Vec<f64>,
}

impl ThrustTable {
    /// Sorts and checks points `(input, force)`; N, and the curve's input unit.
    ///
    /// Repeated inputs are averaged. Bench tables are noisy: thrust that falls by less than 2 % of
    /// its range while the input rises is kept as measured.
    ///
    /// # Errors
    /// [`Error::ThrustTable`] with fewer than two distinct inputs, a number that
    /// is not finite, thrust that falls further than that, or a voltage that is not above zero.
    pub fn new(voltage: Option<f64>, mut points: Vec<(f64, f64)>) -> Result<Self, Error> {
        let refuse = |reason: String| Error::ThrustTable { reason };
        check_supply(voltage)?;
        if points.iter().any(|(x, f)| !(x.is_finite() && f.is_finite())) {
            return Err(refuse("holds a number that is not finite".into()));
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (mut inputs, mut forces) = (Vec::new(), Vec::new());
        for same in points.chunk_by(|a, b| a.0 == b.0) {
            inputs.push(same[0].0);
            forces.push(same.iter().map(|point| point.1).sum::<f64>() / same.len() as f64);
        }
        if inputs.len() < 2 {
            return Err(refuse(format!("has {} distinct inputs and needs 2", inputs.len())));
        }
        check_monotone(&inputs, &forces)?;
        Ok(Self { voltage, inputs, forces })
    }

    /// Returns the least and greatest input of the table.
    pub fn range(&self) -> (f64, f64) {
        (self.inputs[0], self.inputs[self.inputs.len() - 1])
    }

    /// Returns the thrust at one input, N; the end values beyond the table.
    pub fn force(&self, input: f64) -> f64 {
        let after = self.inputs.partition_point(|&x| x <= input);
        if after == 0 {
            return self.forces[0];
        }
        if after == self.inputs.len() {
            return self.forces[after - 1];
        }
        let (x0, x1) = (self.inputs[after - 1], self.inputs[after]);
        let (f0, f1) = (self.forces[after - 1], self.forces[after]);
        f0 + (input - x0) / (x1 - x0) * (f1 - f0)
    }

    /// Returns the table of thrust as trials have shown it to be, with `BETWEEN` points from one to the next if it is
    /// not in proportion.
    fn found(&self, found: &FoundThrust) -> Result<Self, Error> {
        let is_scaled = found.beyond_square == 0.0 && found.dead_band == 0.0;
        let between = if is_scaled { 1 } else { BETWEEN };
        let pairs = self.inputs.windows(2).flat_map(|pair| {
            (0..between).map(|k| pair[0] + (pair[1] - pair[0]) * f64::from(k) / f64::from(between))
        });
        let inputs = pairs.chain(self.inputs.last().copied());
        Self::new(self.voltage, inputs.map(|x| (x, found.thrust(self.force(x)))).collect())
    }

    fn neutral(&self) -> f64 {
        let least = self.forces.iter().fold(f64::INFINITY, |least, f| least.min(f.abs()));
        let still: Vec<f64> =
            self.points().filter(|(_, f)| f.abs() == least).map(|(x, _)| x).collect();
        0.5 * (still[0] + still[still.len() - 1])
    }

    /// Returns the measured points, `(input, force)`.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.inputs.iter().copied().zip(self.forces.iter().copied())
    }
}

/// Parts of an interval of a table where thrust as found is no straight line.
const BETWEEN: i32 = 8;

/// Checks the exponent of a law.
///
/// # Errors
/// [`Error::ThrustTable`] unless it is among [`EXPONENTS`].
pub(crate) fn check_exponent(exponent: f64) -> Result<(), Error> {
    let (least, most) = (EXPONENTS.start(), EXPONENTS.end());
    match EXPONENTS.contains(&exponent) {
        true => Ok(()),
        false => Err(Error::ThrustTable {
            reason: format!(
                "has the exponent {exponent}, which must be between {least} and {most}"
            ),
        }),
    }
}

/// What trials have shown of a thruster beside its curve F = k n|n|, at propeller speeds up to N:
///
/// ```text
/// F' = g k n'|n'| (|n'|/N)^x,   n' = sign(n) max(|n| − p N, 0)/(1 − p)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct FoundThrust {
    /// The gain g ahead, and in reverse.
    pub(crate) gains: [f64; 2],
    /// x.
    pub(crate) beyond_square: f64,
    /// p.
    pub(crate) dead_band: f64,
    /// N, in the unit of the curve's n.
    pub(crate) full_speed: f64,
}

impl FoundThrust {
    /// Returns exponent, dead band and full speed, which matters where one of the two is not zero.
    pub(crate) fn shape(&self) -> [f64; 3] {
        let is_plain = self.beyond_square == 0.0 && self.dead_band == 0.0;
        [self.beyond_square, self.dead_band, if is_plain { 1.0 } else { self.full_speed }]
    }

    /// Returns thrust where a curve says `thrust`, for n = √|F| sign(F).
    fn thrust(&self, thrust: f64) -> f64 {
        let gain = self.gains[usize::from(thrust < 0.0)];
        let turning = thrust.abs().sqrt() - self.dead_band * self.full_speed;
        let n = turning.max(0.0) / (1.0 - self.dead_band);
        let grown = n.powf(2.0 + self.beyond_square) / self.full_speed.powf(self.beyond_square);
        (gain * grown).copysign(gain * thrust)
    }
}

/// Checks the supply voltage that a curve states, V.
///
/// # Errors
/// [`Error::ThrustTable`] unless it is above zero.
pub(crate) fn check_supply(voltage: Option<f64>) -> Result<(), Error> {
    match voltage.filter(|volts| !(*volts > 0.0 && volts.is_finite())) {
        None => Ok(()),
        Some(volts) => Err(Error::ThrustTable {
            reason: format!("has a supply voltage of {volts} V, which must be above 0"),
        }),
    }
}

/// Fraction of its range by which a bench table may fall where it should rise.
const TABLE_WOBBLE: f64 = 0.02;

fn check_monotone(inputs: &[f64], forces: &[f64]) -> Result<(), Error> {
    let range = forces.iter().copied().fold(f64::MIN, f64::max)
        - forces.iter().copied().fold(f64::MAX, f64::min);
    let mut highest = f64::MIN;
    for (input, &force) in inputs.iter().zip(forces) {
        if highest - force > TABLE_WOBBLE * range {
            let reason = format!(
                "falls from {highest} N to {force} N at input {input}, while thrust must rise with the input"
            );
            return Err(Error::ThrustTable { reason });
        }
        highest = highest.max(force);
    }
    Ok(())
}

/// Thrust of one thruster as a function of its input.
#[derive(Clone, Debug, PartialEq)]
pub enum ThrustCurve {
    /// A square law in the named input.
    Quadratic {
        /// The input of the law.
        input: ThrusterInput,
        /// The law.
        law: QuadraticThrust,
    },
    /// Measured tables, one for each supply voltage, in rising order of voltage.
    Table {
        /// The input of the tables.
        input: ThrusterInput,
        /// At least one; with several, each has its voltage.
        tables: Vec<ThrustTable>,
    },
}

impl ThrustCurve {
    /// Returns the curve that trials have shown thrust to follow; a law that is a power already has the dead band
    /// that begins and ends at the same inputs.
    ///
    /// # Errors
    /// [`Error::ThrustTable`] if a table no longer rises with its input, as with a gain below zero, the exponent of
    /// a law is not among [`EXPONENTS`], or the dead band is no part of a full speed.
    pub(crate) fn found(&self, found: &FoundThrust) -> Result<Self, Error> {
        let FoundThrust { dead_band, full_speed, .. } = *found;
        if !((0.0..1.0).contains(&dead_band) && full_speed > 0.0 && full_speed.is_finite()) {
            let reason = format!(
                "is to have a dead band of {dead_band} of a full speed of {full_speed}, which must be a part below 1 of one above 0; identify again"
            );
            return Err(Error::ThrustTable { reason });
        }
        match self {
            Self::Quadratic { input, law } => {
                let law = law.found(found);
                check_exponent(law.exponent)?;
                Ok(Self::Quadratic { input: *input, law })
            }
            Self::Table { input, tables } => {
                let tables = tables.iter().map(|table| table.found(found));
                Self::tables(*input, tables.collect::<Result<_, _>>()?)
            }
        }
    }

    /// Returns whether it gives another thrust for the same input.
    pub(crate) fn replaces(&self, other: &Self) -> bool {
        self.input() == other.input() && self != other
    }

    /// The thrust of this curve over that of another, ahead and in reverse; none of curves that read
    /// other inputs, of laws that differ in more than that, or of a law beside a table.
    ///
    /// Of tables it is that at the ends of the other's, for the highest voltage.
    pub(crate) fn over(&self, other: &Self) -> Option<[f64; 2]> {
        let ratio = |own: f64, other: f64| if other == 0.0 { 1.0 } else { own / other };
        match (self, other) {
            (Self::Quadratic { input: a, law }, Self::Quadratic { input: b, law: other }) => {
                let ways = [ratio(law.forward, other.forward), ratio(law.reverse, other.reverse)];
                (a == b && law.shape() == other.shape()).then_some(ways)
            }
            (Self::Table { input: a, tables }, Self::Table { input: b, tables: others }) => {
                let (own, other) = tables.last().zip(others.last())?;
                let (least, most) = other.range();
                let at = |input: f64| ratio(own.force(input), other.force(input));
                (a == b).then(|| [at(most), at(least)])
            }
            _ => None,
        }
    }

    /// Returns n of thrust k n|n| at an input: the effective input of a square law, or the root of
    /// a table's thrust.
    pub(crate) fn propeller_speed(&self, input: f64) -> f64 {
        match self {
            Self::Quadratic { law, .. } => law.propeller_speed(input),
            Self::Table { .. } => {
                let force = self.force(input, None);
                force.abs().sqrt().copysign(force)
            }
        }
    }

    /// Creates a curve from measured tables, ordered by voltage.
    ///
    /// # Errors
    /// [`Error::ThrustTable`] without a table, or if one of several lacks its
    /// voltage or repeats another's.
    pub fn tables(input: ThrusterInput, mut tables: Vec<ThrustTable>) -> Result<Self, Error> {
        let refuse = |reason: &str| Error::ThrustTable { reason: reason.into() };
        if tables.is_empty() {
            return Err(refuse("is missing"));
        }
        if tables.len() > 1 && tables.iter().any(|table| table.voltage.is_none()) {
            return Err(refuse("is one of several and needs its supply voltage"));
        }
        tables.sort_by(|a, b| a.voltage.unwrap_or(0.0).total_cmp(&b.voltage.unwrap_or(0.0)));
        if tables.windows(2).any(|pair| pair[0].voltage == pair[1].voltage) {
            return Err(refuse("has the same supply voltage as another"));
        }
        Ok(Self::Table { input, tables })
    }

    /// Returns the input of the curve.
    pub const fn input(&self) -> ThrusterInput {
        match self {
            Self::Quadratic { input, .. } | Self::Table { input, .. } => *input,
        }
    }

    /// Returns the thrust at one input, N; linearly interpolated between the tables of two
    /// voltages.
    ///
    /// Only a curve with several tables uses `voltage`; beyond them, the nearest table applies.
    pub fn force(&self, input: f64, voltage: Option<f64>) -> f64 {
        match self {
            Self::Quadratic { law, .. } => law.force(input),
            Self::Table { tables, .. } => force_between(tables, input, voltage),
        }
    }

    /// Returns the input for a thrust \[N\], in the unit of the curve.
    ///
    /// `voltage` is as in [`Self::force`]. Thrust beyond the end of a table has the input of that
    /// end; `None` if the curve gives no thrust in that direction.
    ///
    /// # Example
    /// ```
    /// use seaplant::{QuadraticThrust, ThrustCurve, ThrusterInput};
    /// let law = QuadraticThrust { forward: 40.0, reverse: 10.0, deadband: 0.1, ..Default::default() };
    /// let curve = ThrustCurve::Quadratic { input: ThrusterInput::Command, law };
    /// assert_eq!(curve.input_for(10.0, None), Some(0.6));
    /// assert_eq!(curve.input_for(-10.0, None), Some(-1.1));
    /// ```
    pub fn input_for(&self, thrust: f64, voltage: Option<f64>) -> Option<f64> {
        let still = self.neutral();
        if thrust == 0.0 {
            return Some(still);
        }
        match self {
            Self::Quadratic { law, .. } => {
                let coefficient = if thrust < 0.0 { law.reverse } else { law.forward };
                let beyond = (thrust.abs() / coefficient).powf(1.0 / law.exponent) + law.deadband;
                (coefficient > 0.0).then(|| still + beyond.copysign(thrust))
            }
            Self::Table { .. } => {
                let (low, high) = self.range();
                let gives = |input: f64| self.force(input, voltage) * thrust.signum();
                let end = [low, high].into_iter().find(|end| gives(*end) > 0.0)?;
                // Each bisection gains a binary digit: 60 suffice.
                let (mut less, mut more) = (still, end);
                for _ in 0..60 {
                    let middle = 0.5 * (less + more);
                    if gives(middle) < thrust.abs() { less = middle } else { more = middle }
                }
                Some(more)
            }
        }
    }

    /// Returns the input of zero thrust, or the middle of those with the least.
    pub fn neutral(&self) -> f64 {
        match self {
            Self::Quadratic { law, .. } => law.neutral,
            Self::Table { tables, .. } => tables.first().map_or(0.0, ThrustTable::neutral),
        }
    }

    /// Returns whether the curve depends on supply voltage.
    pub fn needs_voltage(&self) -> bool {
        matches!(self, Self::Table { tables, .. } if tables.len() > 1)
    }

    /// Returns the supply voltage at which the curve was measured, V, if it is stated and one.
    pub fn voltage(&self) -> Option<f64> {
        match self {
            Self::Quadratic { law, .. } => law.voltage,
            Self::Table { tables, .. } if tables.len() == 1 => tables[0].voltage,
            Self::Table { .. } => None,
        }
    }

    /// Returns whether thrust at an input depends on the supply voltage, and the curve does not say how.
    pub(crate) fn follows_supply(&self) -> bool {
        let is_commanded = matches!(self.input(), ThrusterInput::Command | ThrusterInput::Pwm);
        is_commanded && !self.needs_voltage()
    }

    /// Returns the range of inputs over which the curve was measured; unbounded for a law.
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::Quadratic { .. } => (f64::NEG_INFINITY, f64::INFINITY),
            Self::Table { tables, .. } => tables
                .iter()
                .map(ThrustTable::range)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (from, to)| {
                    (low.min(from), high.max(to))
                }),
        }
    }
}

fn force_between(tables: &[ThrustTable], input: f64, voltage: Option<f64>) -> f64 {
    let Some(voltage) = voltage else { return tables[0].force(input) };
    let voltage_of = |table: &ThrustTable| table.voltage.unwrap_or(voltage);
    let after = tables.partition_point(|table| voltage_of(table) <= voltage);
    if after == 0 || after == tables.len() {
        return tables[after.min(tables.len() - 1)].force(input);
    }
    let (below, above) = (&tables[after - 1], &tables[after]);
    let weight = (voltage - voltage_of(below)) / (voltage_of(above) - voltage_of(below));
    (1.0 - weight) * below.force(input) + weight * above.force(input)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_no_thrust_inside_the_deadband() {
        let (deadband, neutral) = (25.0, 1500.0);
        let law =
            QuadraticThrust { forward: 1.0, reverse: 0.5, deadband, neutral, ..Default::default() };
        assert_eq!(law.force(1524.0), 0.0);
        assert_eq!(law.force(1535.0), 100.0);
        assert_eq!(law.force(1465.0), -50.0);
    }

    #[test]
    fn interpolates_between_points_and_between_voltages() {
        let at = |voltage, top| {
            ThrustTable::new(Some(voltage), vec![(1900.0, top), (1500.0, 0.0), (1100.0, -top)])
                .expect("rises")
        };
        let curve = ThrustCurve::tables(ThrusterInput::Pwm, vec![at(16.0, 40.0), at(12.0, 20.0)])
            .expect("two voltages");
        assert_eq!(curve.force(1700.0, Some(12.0)), 10.0);
        assert_eq!(curve.force(1700.0, Some(14.0)), 15.0);
        assert_eq!(curve.force(1900.0, Some(20.0)), 40.0);
    }

    #[test]
    fn a_law_and_a_table_of_it_follow_thrust_as_found() {
        let law = QuadraticThrust { forward: 0.04, reverse: 0.03, ..Default::default() };
        let table = |law: &QuadraticThrust| {
            let points = (-50..=50).map(|k| 2.0 * f64::from(k)).map(|n| (n, law.force(n)));
            let table = ThrustTable::new(None, points.collect()).expect("rises");
            ThrustCurve::tables(ThrusterInput::Speed, vec![table]).expect("one")
        };
        let speed = ThrusterInput::Speed;
        let (beyond_square, dead_band, full_speed) = (-0.25, 0.08, 90.0);
        let of =
            |full_speed| FoundThrust { gains: [0.9, 0.8], beyond_square, dead_band, full_speed };
        let by_law =
            ThrustCurve::Quadratic { input: speed, law }.found(&of(full_speed)).expect("law");
        // A table has n = √|F|, at another full speed ahead than in reverse.
        for (sign, k) in [(1.0, 0.04_f64), (-1.0, 0.03)] {
            let by_table = table(&law).found(&of(full_speed * k.sqrt())).expect("rises");
            for told in [3.0, 7.5, 20.0, 55.0, 90.0] {
                let n = (told - 0.08 * 90.0_f64).max(0.0) / 0.92;
                let gain = if sign > 0.0 { 0.9 } else { 0.8 };
                let expected = sign * gain * k * n.powf(1.75) * 90.0_f64.powf(0.25);
                let [own, other] = [&by_law, &by_table].map(|curve| curve.force(sign * told, None));
                assert!((own - expected).abs() < 1e-9, "{told}: {own}, {expected}");
                assert!((other - expected).abs() < 0.02 + 2e-3 * expected.abs(), "{told}: {other}");
            }
        }
        let input = by_law.input_for(100.0, None).expect("ahead");
        assert!((by_law.force(input, None) - 100.0).abs() < 1e-9);
    }

    #[test]
    fn neutral_is_the_middle_of_the_deadband() {
        let points = vec![(1100.0, -40.0), (1480.0, 0.0), (1520.0, 0.0), (1900.0, 50.0)];
        let table = ThrustTable::new(None, points).expect("rises");
        let curve = ThrustCurve::tables(ThrusterInput::Pwm, vec![table]).expect("one");
        assert_eq!(curve.neutral(), 1500.0);
    }

    #[test]
    fn refuses_a_table_that_falls() {
        let refused = ThrustTable::new(None, vec![(0.0, 0.0), (1.0, 10.0), (2.0, 5.0)]);
        let message = refused.expect_err("falls").to_string();
        assert!(message.contains("falls from 10 N to 5 N at input 2"), "{message}");
    }
}
