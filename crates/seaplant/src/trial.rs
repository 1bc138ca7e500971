//! One stretch of one log of one vehicle, checked once.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::navigation::{Motion, Navigated, Recording, navigate};
use crate::quantity::Kind;
use crate::signal::{Hampel, differentiate, differentiate_timed, resample, uniform_stretches};
use crate::{
    Caveat, CaveatCode, Dof, Error, Gap, Grid, Quantity, Stretches, Thruster, ThrusterInput, Timed,
    Vehicle,
};

/// What a trial is for.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Role {
    /// Parameters are fitted to it.
    #[default]
    Fit,
    /// Fitted plants are judged on it.
    HoldOut,
    /// It holds stretches at constant speed.
    Steady,
}

impl Role {
    /// As campaign files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fit => "fit",
            Self::HoldOut => "hold-out",
            Self::Steady => "steady",
        }
    }
}

/// Where an estimator takes velocity from, if the trial leaves a choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VelocitySource {
    /// The instrument that measures velocity, else the derivative of position.
    Measured,
    /// The derivative of navigated position, else the instrument.
    Position,
}

/// What a trial is called, what it is for and which part of the log it takes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrialSetup {
    /// How tables and messages call it.
    pub name: String,
    /// What it is for.
    pub role: Role,
    /// The degrees of freedom that it exercises.
    pub dofs: Vec<Dof>,
    /// Its start, in the recording's time, s.
    pub from_s: Option<f64>,
    /// Its end, in the recording's time, s.
    pub to_s: Option<f64>,
    /// Steady stretches `[from, to]`, in the recording's time, s; empty to find them.
    pub segments_s: Vec<[f64; 2]>,
}

/// One stretch of one log for one vehicle.
///
/// It offers the raw timed measurements, and uniform views of them, by degree of freedom.
#[derive(Clone, Debug)]
pub struct Trial {
    setup: TrialSetup,
    force: BTreeMap<Dof, Timed>,
    navigated: Navigated,
    rates_hz: BTreeMap<Quantity, f64>,
    saturated: Vec<Saturation>,
    caveats: Vec<Caveat>,
}

/// How often a thruster was driven beyond its measured curve.
#[derive(Clone, Debug, PartialEq)]
struct Saturation {
    thruster: String,
    part: f64,
}

/// What one trial says of one degree of freedom.
#[derive(Clone, Debug, PartialEq)]
pub struct AxisRecord {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which trial.
    pub trial: String,
    /// Force or moment, held from each sample to the next; N or N m.
    pub force: Timed,
    /// Velocity, or the position that it is derived from.
    pub motion: Motion,
    /// Position measured along this degree of freedom, where there is one.
    pub position: Option<Timed>,
}

/// A stretch of one degree of freedom on a uniform grid.
#[derive(Clone, Debug, PartialEq)]
pub struct UniformStretch {
    /// Its instants.
    pub grid: Grid,
    /// Force averaged over the interval around each instant; N or N m, shape (n,).
    pub tau: Vec<f64>,
    /// Velocity, unfiltered; m/s or rad/s, shape (n,).
    pub v: Vec<f64>,
}

/// A degree of freedom of a trial on uniform grids, cut at its gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct UniformAxis {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Rate of the grids, Hz.
    pub sample_hz: f64,
    /// Rate at which motion was measured, Hz.
    pub source_hz: f64,
    /// The stretches, each without a gap.
    pub stretches: Vec<UniformStretch>,
    /// What was left out between them.
    pub gaps: Vec<Gap>,
}

/// Regressions gain nothing above this rate: vehicles of a tonne move below 1 Hz.
const HIGHEST_RATE_HZ: f64 = 20.0;

/// Outliers of a measured velocity: a second of neighbours, eight standard deviations.
const VELOCITY_OUTLIERS: Hampel = Hampel { half_width: 5, threshold: 8.0, floor: 0.0 };
/// The least standard deviation of a velocity to believe, m/s or rad/s.
const VELOCITY_NOISE_FLOOR: f64 = 0.02;

impl Trial {
    /// Navigates a recording, turns thruster readings into forces and checks both.
    ///
    /// # Errors
    /// [`Error::MissingChannel`] if a degree of freedom of the trial lacks force or
    /// motion, [`Error::NoOverlap`] if they share no time, [`Error::TooShort`] if
    /// fewer than ten samples of motion are left in the trial's window.
    pub fn new(setup: TrialSetup, recording: &Recording, vehicle: &Vehicle) -> Result<Self, Error> {
        let mut caveats = suspicious_units(recording);
        let recording = masked(recording, &mut caveats);
        let mut navigated = navigate(&setup.name, &recording, &vehicle.sensors)?;
        caveats.append(&mut navigated.caveats);
        let mut saturated = Vec::new();
        let mut force = BTreeMap::new();
        for &dof in &setup.dofs {
            let of_dof = force_along(&setup.name, dof, &recording, vehicle, &mut saturated)?;
            force.insert(dof, of_dof);
        }
        let rates_hz = recording.iter().map(|(what, x)| (what.clone(), rate_hz(x))).collect();
        let trial = Self { setup, force, navigated, rates_hz, saturated, caveats };
        for &dof in &trial.setup.dofs {
            trial.axis(dof, VelocitySource::Measured)?;
        }
        Ok(trial)
    }

    /// Adds doubts that the log's reader had.
    pub fn with_caveats(mut self, caveats: impl IntoIterator<Item = Caveat>) -> Self {
        self.caveats.extend(caveats);
        self
    }

    /// What the trial is called.
    pub fn name(&self) -> &str {
        &self.setup.name
    }

    /// What the trial is for.
    pub fn role(&self) -> Role {
        self.setup.role
    }

    /// The degrees of freedom that it exercises.
    pub fn dofs(&self) -> &[Dof] {
        &self.setup.dofs
    }

    /// Its name, role and window.
    pub fn setup(&self) -> &TrialSetup {
        &self.setup
    }

    /// How the vehicle moved.
    pub fn navigated(&self) -> &Navigated {
        &self.navigated
    }

    /// The median rate at which a quantity was logged, Hz; `None` if it was not.
    pub fn rate_hz(&self, quantity: &Quantity) -> Option<f64> {
        self.rates_hz.get(quantity).copied()
    }

    /// The raw record of one degree of freedom, cut to the trial's window.
    ///
    /// # Errors
    /// As [`Trial::new`].
    pub fn axis(&self, dof: Dof, source: VelocitySource) -> Result<AxisRecord, Error> {
        let missing = |what: &str, advice: &str| Error::MissingChannel {
            trial: self.setup.name.clone(),
            what: format!("{what} for {dof}"),
            advice: advice.to_owned(),
        };
        let force = self.force.get(&dof).ok_or_else(|| {
            missing("force", "name the degree of freedom in the trial's dof = [...]")
        })?;
        let measured = self.navigated.measured.get(&dof).cloned().map(Motion::Velocity);
        let by_position = self.navigated.by_position.get(&dof).cloned();
        let motion = match source {
            VelocitySource::Measured => measured.or(by_position),
            VelocitySource::Position => by_position.or(measured),
        }
        .ok_or_else(|| missing("velocity or position", motion_advice(dof)))?;
        let (from_s, to_s) = self.overlap(dof, force, &motion)?;
        let cut = |series: &Timed| series.window(from_s, to_s);
        let motion = match &motion {
            Motion::Velocity(velocity) => cut(velocity).map(Motion::Velocity),
            Motion::Position(position) => cut(position).map(Motion::Position),
        };
        let force = force.window_held(from_s, to_s);
        let record = motion.zip(force).map(|(motion, force)| AxisRecord {
            dof,
            trial: self.setup.name.clone(),
            force,
            motion,
            position: self.navigated.position.get(&dof).and_then(cut),
        });
        let samples = record.as_ref().map_or(0, |record| record.motion.series().len());
        record.filter(|_| samples >= LEAST_SAMPLES).ok_or_else(|| Error::TooShort {
            name: format!("the {dof} motion of trial `{}`", self.setup.name),
            found: samples,
            needed: LEAST_SAMPLES,
        })
    }

    /// The caveats that every fit of a degree of freedom of this trial inherits.
    pub fn caveats(&self, dof: Dof) -> Vec<Caveat> {
        let mut caveats = self.caveats.clone();
        for Saturation { thruster, part } in &self.saturated {
            let message = format!(
                "trial `{}`: thruster `{thruster}` is driven beyond its measured curve for {:.0} % of the log, where its thrust is taken as the curve's last; measure the curve further out or leave those stretches out",
                self.setup.name,
                100.0 * part
            );
            caveats.push(Caveat::warning(CaveatCode::ThrusterSaturated, message));
        }
        if let Ok(uniform) =
            self.axis(dof, VelocitySource::Measured).and_then(|axis| axis.uniform(LEAST_SAMPLES))
            && let Some(first) = uniform.gaps.first()
        {
            let lost: f64 = uniform.gaps.iter().map(|gap| gap.to_s - gap.from_s).sum();
            let message = format!(
                "trial `{}`: {} without samples, {lost:.1} s in all, the first from {:.1} to {:.1} s; they are left out, and simulation starts anew after each gap in thrust",
                self.setup.name,
                count(uniform.gaps.len(), "stretch", "stretches"),
                first.from_s,
                first.to_s
            );
            caveats.push(Caveat::note(CaveatCode::Gaps, message));
        }
        caveats
    }

    fn overlap(&self, dof: Dof, force: &Timed, motion: &Motion) -> Result<(f64, f64), Error> {
        let motion = motion.series();
        let wanted_from = self.setup.from_s.unwrap_or(f64::NEG_INFINITY);
        let wanted_to = self.setup.to_s.unwrap_or(f64::INFINITY);
        let refuse = |second: String, from_s: f64, to_s: f64| Error::NoOverlap {
            trial: self.setup.name.clone(),
            first: format!("the {dof} motion"),
            first_from_s: motion.first_s(),
            first_to_s: motion.last_s(),
            second,
            second_from_s: from_s,
            second_to_s: to_s,
        };
        // A thrust logged once holds until it is logged again, but for no more than
        // the rest of the trial.
        let held_to = if force.len() == 1 { f64::INFINITY } else { force.last_s() };
        let held_to = held_to + force.period_s();
        if motion.first_s() > held_to || motion.last_s() < force.first_s() {
            return Err(refuse(format!("the {dof} thrust"), force.first_s(), force.last_s()));
        }
        if motion.first_s() > wanted_to || motion.last_s() < wanted_from {
            return Err(refuse("the trial's from_s to to_s".to_owned(), wanted_from, wanted_to));
        }
        Ok((
            wanted_from.max(motion.first_s()).max(force.first_s()),
            wanted_to.min(motion.last_s()).min(held_to),
        ))
    }
}

/// Below this a trial says nothing: an order-2 filter alone needs ten samples.
const LEAST_SAMPLES: usize = 10;

fn motion_advice(dof: Dof) -> &'static str {
    match dof {
        Dof::Surge => {
            "map velocity.surge, dvl.velocity.x, or position.north and .east with attitude.heading"
        }
        Dof::Sway => {
            "map velocity.sway, dvl.velocity.y, or position.north and .east with attitude.heading"
        }
        Dof::Heave => "map depth, velocity.heave or dvl.velocity.z",
        Dof::Roll => "map attitude.roll or rate.roll",
        Dof::Pitch => "map attitude.pitch or rate.pitch",
        Dof::Yaw => "map attitude.heading or rate.yaw",
    }
}

pub(crate) fn count(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

impl Motion {
    /// The samples as measured: velocity or position.
    pub fn series(&self) -> &Timed {
        match self {
            Self::Velocity(series) | Self::Position(series) => series,
        }
    }
}

impl AxisRecord {
    /// Velocity at the times of its own samples, unfiltered.
    ///
    /// # Errors
    /// [`Error::TooShort`] if it must be derived from fewer than two positions.
    pub fn velocity(&self) -> Result<Timed, Error> {
        match &self.motion {
            Motion::Velocity(velocity) => Ok(velocity.clone()),
            Motion::Position(position) => differentiate_timed(position),
        }
    }

    /// Force and velocity on uniform grids, cut at gaps of either, each stretch with
    /// at least `least` instants.
    ///
    /// The rate is that of the faster of the two, at most 20 Hz.
    ///
    /// # Errors
    /// [`Error::TooShort`] if no stretch is long enough.
    pub fn uniform(&self, least: usize) -> Result<UniformAxis, Error> {
        let motion = self.motion.series();
        let source_hz = rate_hz(motion);
        let sample_hz = source_hz.max(rate_hz(&self.force)).min(HIGHEST_RATE_HZ);
        let period_s = 1.0 / sample_hz;
        let least = least.max(LEAST_SAMPLES);
        let Stretches { stretches: found, mut gaps } = uniform_stretches(motion, period_s, least)?;
        let force_gaps = self.force_gaps();
        let mut stretches = Vec::new();
        for whole in found {
            for grid in without(whole.grid, &force_gaps, least) {
                let values =
                    if grid == whole.grid { whole.values.clone() } else { resample(motion, grid)? };
                let v = match self.motion {
                    Motion::Velocity(_) => values,
                    Motion::Position(_) => differentiate(&values, period_s)?,
                };
                stretches.push(UniformStretch { grid, tau: self.force.held_means(grid), v });
            }
        }
        if stretches.is_empty() {
            let span = ((motion.last_s() - motion.first_s()) * sample_hz) as usize + 1;
            return Err(Error::TooShort {
                name: format!(
                    "trial `{}`, at {sample_hz:.1} Hz and without its gaps, in {}",
                    self.trial, self.dof
                ),
                found: span,
                needed: least,
            });
        }
        gaps.extend(force_gaps);
        gaps.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
        Ok(UniformAxis { dof: self.dof, sample_hz, source_hz, stretches, gaps })
    }

    /// Intervals in which thrust was not logged, though it usually is.
    ///
    /// Thrust that is logged when it changes has long intervals by nature, so a gap
    /// is measured against the longest tenth of them.
    pub fn force_gaps(&self) -> Vec<Gap> {
        let mut steps: Vec<f64> =
            self.force.time_s().windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let Some(long) = steps.get(steps.len() * 9 / 10) else { return Vec::new() };
        self.force.gaps((5.0 * long).max(1.0))
    }
}

fn rate_hz(series: &Timed) -> f64 {
    let period = series.period_s();
    if period > 0.0 { 1.0 / period } else { 0.0 }
}

/// The parts of a grid outside of gaps that have at least `least` instants.
fn without(grid: Grid, gaps: &[Gap], least: usize) -> Vec<Grid> {
    let mut parts = Vec::new();
    let mut from = 0;
    for gap in gaps {
        let until = ((gap.from_s - grid.start_s) / grid.period_s).floor();
        let next = ((gap.to_s - grid.start_s) / grid.period_s).ceil();
        if next <= from as f64 || until >= grid.len as f64 {
            continue;
        }
        parts.push((from, (until.max(0.0) as usize).min(grid.len)));
        from = (next.max(0.0) as usize).min(grid.len);
    }
    parts.push((from, grid.len));
    parts
        .into_iter()
        .filter(|(from, to)| *to >= from + least)
        .map(|(from, to)| Grid {
            start_s: grid.time(from),
            period_s: grid.period_s,
            len: to - from,
        })
        .collect()
}

/// Removes implausible samples of measured velocity, and says so.
fn masked(recording: &Recording, caveats: &mut Vec<Caveat>) -> Recording {
    let mut clean = recording.clone();
    for (quantity, series) in &mut clean {
        if !matches!(quantity, Quantity::DvlVelocity(_) | Quantity::Velocity(_)) {
            continue;
        }
        let masked = Hampel { floor: VELOCITY_NOISE_FLOOR, ..VELOCITY_OUTLIERS }.mask(series);
        if let Some(first) = masked.removed_s.first() {
            let message = format!(
                "{} of {quantity} stand far off their neighbours and are left out, the first at {first:.1} s",
                count(masked.removed_s.len(), "sample", "samples")
            );
            caveats.push(Caveat::note(CaveatCode::Outliers, message));
            *series = masked.series;
        }
    }
    clean
}

/// Values that no vehicle has in the unit that was stated.
fn suspicious_units(recording: &Recording) -> Vec<Caveat> {
    recording.iter().filter_map(|(quantity, series)| suspicious(quantity, series)).collect()
}

/// Beyond these a unit is more likely wrong than the vehicle fast, deep or odd.
const HIGHEST_SPEED_M_S: f64 = 20.0;
const HIGHEST_RATE_RAD_S: f64 = 6.0;
const DEEPEST_M: f64 = 12_000.0;
const HIGHEST_ANGLE_RAD: f64 = 8.0;

fn suspicious(quantity: &Quantity, series: &Timed) -> Option<Caveat> {
    let peak = series.values().iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
    let low = series.values().iter().copied().fold(f64::INFINITY, f64::min);
    let (limit, hint) = match quantity.kind() {
        Kind::Velocity => (HIGHEST_SPEED_M_S, "is it mm/s or cm/s?"),
        Kind::AngularVelocity if matches!(quantity, Quantity::Thruster { .. }) => {
            return None;
        }
        Kind::AngularVelocity => (HIGHEST_RATE_RAD_S, "is it deg/s?"),
        Kind::Length => (DEEPEST_M, "is it mm or cm?"),
        // Headings run to 2π; a log that is already unwrapped may go on, but slowly.
        Kind::Angle if has_jump(series, HIGHEST_ANGLE_RAD) || peak > 100.0 => {
            (HIGHEST_ANGLE_RAD, "is it deg?")
        }
        Kind::Ratio => (1.0 + 1e-6, "is it %, or another quantity?"),
        Kind::PulseWidth if low < 500.0 || peak > 2500.0 => (0.0, "is it a pulse width at all?"),
        _ => return None,
    };
    (peak > limit).then(|| {
        let message = format!(
            "{quantity} reaches {peak:.4} {}, which no vehicle does: check its unit ({hint})",
            si_unit(quantity)
        );
        Caveat::warning(CaveatCode::SuspiciousUnit, message)
    })
}

fn has_jump(series: &Timed, size: f64) -> bool {
    series.values().windows(2).any(|pair| (pair[1] - pair[0]).abs() > size)
}

fn si_unit(quantity: &Quantity) -> &'static str {
    match quantity.kind() {
        Kind::AngularVelocity => "rad/s",
        Kind::PulseWidth => "us",
        Kind::Ratio => "(as a ratio)",
        Kind::Force => "N",
        Kind::Moment => "N m",
        Kind::Velocity => "m/s",
        Kind::Length => "m",
        Kind::Angle => "rad",
        Kind::Voltage => "V",
    }
}

/// `τ = Σ [d; r × d] F`, held, at the times of all thrusters that act along `dof`;
/// or the wrench where the log has it.
fn force_along(
    trial: &str,
    dof: Dof,
    recording: &Recording,
    vehicle: &Vehicle,
    saturated: &mut Vec<Saturation>,
) -> Result<Timed, Error> {
    if let Some(wrench) = recording.get(&Quantity::Wrench(dof)) {
        return Ok(wrench.clone());
    }
    let mut parts = Vec::new();
    for thruster in vehicle.thrusters.iter().filter(|thruster| Vehicle::acts_on(thruster, dof)) {
        let force = thruster_force(trial, thruster, recording, saturated)?;
        parts.push((thruster.unit_wrench()[dof.index()], force));
    }
    let missing = || Error::MissingChannel {
        trial: trial.to_owned(),
        what: format!("thruster that acts in {dof}"),
        advice: format!("give one in vehicle.toml, or map wrench.{dof}"),
    };
    held_sum(&parts)?.ok_or_else(missing)
}

fn thruster_force(
    trial: &str,
    thruster: &Thruster,
    recording: &Recording,
    saturated: &mut Vec<Saturation>,
) -> Result<Timed, Error> {
    let of = |input| Quantity::Thruster { name: thruster.name.clone(), input };
    if let Some(force) = recording.get(&of(ThrusterInput::Force)) {
        return Ok(force.clone());
    }
    let missing = |what: String, advice: String| Error::MissingChannel {
        trial: trial.to_owned(),
        what,
        advice,
    };
    let wanted = of(thruster.curve.input());
    let input = recording.get(&wanted).ok_or_else(|| {
        missing(wanted.to_string(), "map it under [channels]: its curve reads it".to_owned())
    })?;
    let voltage = recording.get(&Quantity::SupplyVoltage);
    if thruster.curve.needs_voltage() && voltage.is_none() {
        let advice = format!(
            "the curve of `{}` depends on it; map it, or keep the table of one voltage",
            thruster.name
        );
        return Err(missing(Quantity::SupplyVoltage.to_string(), advice));
    }
    let (low, high) = thruster.curve.range();
    let beyond = input.values().iter().filter(|x| !(low..=high).contains(*x)).count();
    let part = beyond as f64 / input.len() as f64;
    let known = saturated.iter().any(|known| known.thruster == thruster.name);
    if beyond > 0 && !known {
        saturated.push(Saturation { thruster: thruster.name.clone(), part });
    }
    let forces = input
        .time_s()
        .iter()
        .zip(input.values())
        .map(|(&t, &x)| thruster.curve.force(x, voltage.map(|voltage| voltage.at(t))))
        .collect();
    input.with_values(&thruster.name, forces)
}

/// Σ weight · series of held series, at every time at which one changes.
fn held_sum(parts: &[(f64, Timed)]) -> Result<Option<Timed>, Error> {
    let Some((_, first)) = parts.first() else { return Ok(None) };
    let together = parts.iter().all(|(_, part)| part.time_s() == first.time_s());
    let times: Vec<f64> = if together {
        first.time_s().to_vec()
    } else {
        // Before the last of them starts, the sum is not known.
        let start = parts.iter().map(|(_, part)| part.first_s()).fold(f64::MIN, f64::max);
        let mut times: Vec<f64> = parts
            .iter()
            .flat_map(|(_, part)| part.time_s())
            .copied()
            .filter(|t| *t >= start)
            .collect();
        times.sort_by(f64::total_cmp);
        times.dedup();
        times
    };
    let values: Vec<f64> = if together {
        (0..times.len()).map(|k| parts.iter().map(|(w, part)| w * part.values()[k]).sum()).collect()
    } else {
        times.iter().map(|&t| parts.iter().map(|(w, part)| w * part.held_at(t)).sum()).collect()
    };
    Timed::new("force", times, values).map(Some)
}
