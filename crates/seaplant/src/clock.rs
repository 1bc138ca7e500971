//! The offset between the clocks of two recordings.
//!
//! Two files of one trial record one motion: a gyro and a compass turn together, a DVL measures the
//! response to the thrusters. The offset of their clocks is that at which one file explains the
//! other best.

mod correlate;
mod lattice;
mod profile;
mod search;
mod signals;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::navigation::Recording;
use crate::trial::without_outliers;
use crate::{Dof, Error, Vehicle};
use lattice::is_mostly_gap;
use profile::Problem;
use search::Named;
use signals::{What, forces, motions};

/// How far the clock of a recording is behind another, as the data say.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockOffset {
    /// Seconds to add to its clock.
    pub offset_s: f64,
    /// The standard error of that, s.
    pub std_s: f64,
    /// The pairs of signals that were compared: those that determine the offset, then the others.
    pub pairs: Vec<OffsetPair>,
}

/// Two signals that must agree in time, and what they say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OffsetPair {
    /// The one whose clock is kept.
    pub reference: String,
    /// The one whose clock is moved.
    pub other: String,
    /// Seconds to add to its clock; absent if it was refused.
    pub offset_s: Option<f64>,
    /// The standard error of that, s.
    pub std_s: Option<f64>,
    /// The correlation of the two at that offset, −1 to 1; of force and velocity that of force
    /// and acceleration, both rid of drag.
    pub correlation: Option<f64>,
    /// How much of the evidence for that offset the next best one has, 0 to 1.
    pub second_peak: Option<f64>,
    /// Whether one of them is force: whatever thrusters lag behind then counts as offset.
    pub of_thrust: bool,
    /// Why it was not believed.
    pub refused: Option<String>,
}

/// Thrust is logged when commanded and acts once the propellers have responded: uncertainty of an
/// offset from thrust, s.
const THRUST_LAG_S: f64 = 0.3;

/// Pairs whose offsets differ by more than this many standard errors, and seconds, measure
/// different motions.
const CONTRADICTION_STD: f64 = 5.0;
const CONTRADICTION_S: f64 = 1.0;

/// Estimates the offset of the clock of `other` relative to that of `reference`.
///
/// For each motion that both recorded (rates of rotation, body velocity, velocity north and east,
/// speed), every offset at which the records share half of the shorter one is searched. The
/// estimate maximises the likelihood of `y(t) = g x(t + δ) + e(t)`, with residuals e that are an
/// autoregression of order eight, and is refined to a small fraction of a sample. A pair is
/// rejected if its likelihood gain is within chance, or if another offset has more than 0.7 of it:
/// for a sinusoid every period is as good. Estimates are weighted by their variances. Only where no
/// pair of motions succeeds, force is compared with the acceleration that it causes, by `v̇ = α τ +
/// β v|v| + μ v + ν`; thruster lag cannot be distinguished from an offset then, and 0.3 s is added
/// to the standard error.
///
/// # Errors
/// [`Error::ClockOffset`] if no pair determines the offset, or pairs contradict each other.
///
/// # Source
/// \[Cochrane1949\] for autoregressive residuals; \[Padfield2012\] for correlation in the
/// presence of gaps; \[Newey1987\] for the standard error.
///
/// # Example
/// ```
/// use seaplant::{Quantity, Recording, Timed, Vehicle, estimate_offset};
/// // An irregular turn, measured by a gyro, and by a compass whose clock is 2.5 s behind.
/// let turn = |t: f64| (0.4 * t + 3.0 * (0.05 * t).sin()).sin() + 0.5 * (0.011 * t * t).cos();
/// let time: Vec<f64> = (0..2400).map(|k| 0.1 * f64::from(k)).collect();
/// let late: Vec<f64> = time.iter().map(|t| t - 2.5).collect();
/// let (mut heading, mut headings) = (0.0, Vec::new());
/// for t in &time {
///     headings.push(heading);
///     heading += 0.1 * turn(t + 0.05);
/// }
/// let rate: Vec<f64> = time.iter().map(|t| turn(*t)).collect();
/// let gyro = Timed::new("rate", time, rate)?;
/// let compass = Timed::new("heading", late, headings)?;
/// let reference: Recording = [("rate.yaw".parse::<Quantity>()?, gyro)].into();
/// let other: Recording = [("attitude.heading".parse::<Quantity>()?, compass)].into();
/// let found = estimate_offset(&reference, &other, &Vehicle::default())?;
/// assert!((found.offset_s - 2.5).abs() < 0.01);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn estimate_offset(
    reference: &Recording,
    other: &Recording,
    vehicle: &Vehicle,
) -> Result<ClockOffset, Error> {
    let [reference, other] = [reference, other].map(usable);
    let here = motions(&reference, &vehicle.sensors);
    let there = motions(&other, &vehicle.sensors);
    let mut pairs: Vec<OffsetPair> = Vec::new();
    for (what, one) in &here {
        if let Some(another) = there.get(what).filter(|_| !is_redundant(*what, &here, &there)) {
            pairs.push(compare(one, another, Problem::agreement(one, another)));
        }
    }
    if pairs.iter().all(|pair| pair.offset_s.is_none()) {
        for (dof, force) in forces(&reference, vehicle) {
            if let Some(velocity) = there.get(&What::Along(dof)) {
                let problem = Problem::propulsion(&force, velocity);
                pairs.push(with_lag(compare(&force, velocity, problem)));
            }
        }
        for (dof, force) in forces(&other, vehicle) {
            if let Some(velocity) = here.get(&What::Along(dof)) {
                let problem = Problem::propulsion(&force, velocity);
                pairs.push(with_lag(compare(&force, velocity, problem).swapped()));
            }
        }
    }
    combine(pairs)
}

/// Returns a recording without outliers and without series that are mostly gap.
fn usable(recording: &Recording) -> Recording {
    let whole = recording.iter().filter(|(_, series)| !is_mostly_gap(series));
    without_outliers(whole.map(|(what, series)| (what.clone(), series.clone())).collect())
}

impl OffsetPair {
    /// Exchanges the roles of the two clocks.
    fn swapped(self) -> Self {
        let offset_s = self.offset_s.map(|offset_s| -offset_s);
        Self { reference: self.other, other: self.reference, offset_s, ..self }
    }

    /// Marks the pair as rejected.
    fn refused(self, why: impl Into<String>) -> Self {
        Self { refused: Some(why.into()), ..self }
    }

    /// Returns its offset and variance, if present.
    fn estimate(&self) -> Option<(f64, f64)> {
        Some((self.offset_s?, self.std_s?.powi(2)))
    }
}

/// Returns whether velocities along two axes make this motion redundant.
fn is_redundant(what: What, here: &BTreeMap<What, Named>, there: &BTreeMap<What, Named>) -> bool {
    let both = |what: What| here.contains_key(&what) && there.contains_key(&what);
    let body = both(What::Along(Dof::Surge)) && both(What::Along(Dof::Sway));
    match what {
        What::Along(_) => false,
        What::North | What::East => body,
        What::Speed => body || (both(What::North) && both(What::East)),
    }
}

/// Estimates the offset of the response from the driver, or states why not.
fn compare(driver: &Named, response: &Named, problem: Result<Problem, Error>) -> OffsetPair {
    let (reference, other) = (driver.name.clone(), response.name.clone());
    let pair = OffsetPair { reference, other, ..OffsetPair::default() };
    match problem {
        Ok(problem) => problem.search(pair),
        Err(error) => pair.refused(error.to_string()),
    }
}

fn with_lag(pair: OffsetPair) -> OffsetPair {
    let std_s = pair.std_s.map(|std_s| std_s.hypot(THRUST_LAG_S));
    OffsetPair { std_s, of_thrust: true, ..pair }
}

/// Averages the pairs' offsets, weighted by inverse variances; where they scatter more than
/// expected, the standard error grows accordingly.
fn combine(mut pairs: Vec<OffsetPair>) -> Result<ClockOffset, Error> {
    // The pairs closest to an acceptable offset come first.
    pairs.sort_by(|a, b| evidence(b).total_cmp(&evidence(a)));
    let known: Vec<(f64, f64)> = pairs.iter().filter_map(OffsetPair::estimate).collect();
    let weight: f64 = known.iter().map(|(_, variance)| variance.recip()).sum();
    if known.is_empty() {
        return Err(Error::ClockOffset { found: formatted(&pairs), pairs: pairs.len() });
    }
    let differ = |(a, b): (&(f64, f64), &(f64, f64))| {
        let apart = (a.0 - b.0).abs();
        apart > CONTRADICTION_S && apart > CONTRADICTION_STD * (a.1 + b.1).sqrt()
    };
    if known.iter().any(|a| known.iter().any(|b| differ((a, b)))) {
        let found = format!("pairs contradict each other: {}", formatted(&pairs));
        return Err(Error::ClockOffset { found, pairs: pairs.len() });
    }
    let offset_s =
        known.iter().map(|(offset_s, variance)| offset_s / variance).sum::<f64>() / weight;
    let misfit = known.iter().map(|(x, variance)| (x - offset_s).powi(2) / variance).sum::<f64>();
    let scatter = misfit / (known.len() - 1).max(1) as f64;
    Ok(ClockOffset { offset_s, std_s: (scatter.max(1.0) / weight).sqrt(), pairs })
}

/// Returns a rank of a pair: its correlation, accepted offsets before others.
fn evidence(pair: &OffsetPair) -> f64 {
    let believed = if pair.offset_s.is_some() { 1.0 } else { 0.0 };
    believed + pair.correlation.unwrap_or(0.0).abs()
}

/// Formats the compared pairs and their outcome.
fn formatted(pairs: &[OffsetPair]) -> String {
    if pairs.is_empty() {
        return "the files have no quantity in common to compare: neither rates, velocities nor positions in both, nor thrust in one and velocity in the other".to_owned();
    }
    let one = |pair: &OffsetPair| {
        let said = match (&pair.refused, pair.estimate()) {
            (Some(refused), _) => refused.clone(),
            (None, Some((offset_s, variance))) => {
                format!("{offset_s:.2} s ± {:.2} s", variance.sqrt())
            }
            (None, None) => String::new(),
        };
        format!("{} and {}: {said}", pair.reference, pair.other)
    };
    /// More would fill a screen without more information.
    const MOST: usize = 3;
    let mut said: Vec<String> = pairs.iter().map(one).take(MOST).collect();
    match pairs.len().saturating_sub(MOST) {
        0 => {}
        1 => said.push("another pair does no better".to_owned()),
        more => said.push(format!("{more} other pairs do no better")),
    }
    said.join("; ")
}
