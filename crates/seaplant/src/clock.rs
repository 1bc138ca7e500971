//! By how much the clock of one recording is off that of another.
//!
//! Two files of one trial tell of one motion: a gyro and a compass turn together, a DVL goes
//! where thrusters push. The offset of their clocks is the one at which the one file explains the
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

/// Force is logged when it is commanded and acts when propellers have followed: by so much the
/// offset from thrust may be off, s.
const THRUST_LAG_S: f64 = 0.3;

/// Pairs that differ by more than this many standard errors, and seconds, tell of different
/// motions.
const CONTRADICTION_STD: f64 = 5.0;
const CONTRADICTION_S: f64 = 1.0;

/// By how much the clock of `other` is behind that of `reference`.
///
/// Of all that both tell of (turning, body velocity, velocity north and east, speed), each pair
/// is searched over every offset at which half of the shorter record is shared. The offset is
/// that of the greatest likelihood of `y(t) = g x(t + δ) + e(t)`, with residuals that remember
/// eight instants, refined to a small part of a sample. A pair is refused if chance would do as
/// well, or if another offset has more than 0.7 of the evidence: of a sinusoid every period is as
/// good. Estimates are weighted by their variances. Only where no pair of motions will do, force
/// is held against the acceleration that it makes, by `v̇ = α τ + β v|v| + μ v + ν`; the lag of
/// thrusters cannot be told from an offset then, and 0.3 s is added to the standard error.
///
/// # Errors
/// [`Error::ClockOffset`] if no pair tells the offset, or pairs contradict each other.
///
/// # Source
/// \[Cochrane1949\] for residuals that remember; \[Padfield2012\] for correlation in the
/// presence of gaps; \[Newey1987\] for the standard error.
///
/// # Example
/// ```
/// use seaplant::{Quantity, Recording, Timed, Vehicle, estimate_offset};
/// // A wandering turn, told by a gyro, and by a compass whose clock is 2.5 s behind.
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
        if let Some(another) = there.get(what).filter(|_| !is_told_by_others(*what, &here, &there))
        {
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
                pairs.push(with_lag(compare(&force, velocity, problem).turned()));
            }
        }
    }
    combine(pairs)
}

/// A recording without outliers and without series that are nearly all gap.
fn usable(recording: &Recording) -> Recording {
    let whole = recording.iter().filter(|(_, series)| !is_mostly_gap(series));
    without_outliers(whole.map(|(what, series)| (what.clone(), series.clone())).collect())
}

impl OffsetPair {
    /// The same with the clock of the other kept.
    fn turned(self) -> Self {
        let offset_s = self.offset_s.map(|offset_s| -offset_s);
        Self { reference: self.other, other: self.reference, offset_s, ..self }
    }

    /// The same, not to be believed.
    fn refused(self, why: impl Into<String>) -> Self {
        Self { refused: Some(why.into()), ..self }
    }

    /// Its offset and variance, if it has them.
    fn estimate(&self) -> Option<(f64, f64)> {
        Some((self.offset_s?, self.std_s?.powi(2)))
    }
}

/// Speed says nothing that velocity along two axes does not.
fn is_told_by_others(
    what: What,
    here: &BTreeMap<What, Named>,
    there: &BTreeMap<What, Named>,
) -> bool {
    let both = |what: What| here.contains_key(&what) && there.contains_key(&what);
    let body = both(What::Along(Dof::Surge)) && both(What::Along(Dof::Sway));
    match what {
        What::Along(_) => false,
        What::North | What::East => body,
        What::Speed => body || (both(What::North) && both(What::East)),
    }
}

/// The offset of the response from the driver, or why there is none.
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

/// The mean of what pairs say, each by its variance; where they differ by more than that
/// allows, its standard error grows with their scatter.
fn combine(mut pairs: Vec<OffsetPair>) -> Result<ClockOffset, Error> {
    // What came nearest to telling the offset first.
    pairs.sort_by(|a, b| evidence(b).total_cmp(&evidence(a)));
    let known: Vec<(f64, f64)> = pairs.iter().filter_map(OffsetPair::estimate).collect();
    let weight: f64 = known.iter().map(|(_, variance)| variance.recip()).sum();
    if known.is_empty() {
        return Err(Error::ClockOffset { found: in_words(&pairs), pairs: pairs.len() });
    }
    let differ = |(a, b): (&(f64, f64), &(f64, f64))| {
        let apart = (a.0 - b.0).abs();
        apart > CONTRADICTION_S && apart > CONTRADICTION_STD * (a.1 + b.1).sqrt()
    };
    if known.iter().any(|a| known.iter().any(|b| differ((a, b)))) {
        let found = format!("pairs contradict each other: {}", in_words(&pairs));
        return Err(Error::ClockOffset { found, pairs: pairs.len() });
    }
    let offset_s =
        known.iter().map(|(offset_s, variance)| offset_s / variance).sum::<f64>() / weight;
    let misfit = known.iter().map(|(x, variance)| (x - offset_s).powi(2) / variance).sum::<f64>();
    let scatter = misfit / (known.len() - 1).max(1) as f64;
    Ok(ClockOffset { offset_s, std_s: (scatter.max(1.0) / weight).sqrt(), pairs })
}

/// How much a pair tells: its correlation, believed offsets before others.
fn evidence(pair: &OffsetPair) -> f64 {
    let believed = if pair.offset_s.is_some() { 1.0 } else { 0.0 };
    believed + pair.correlation.unwrap_or(0.0).abs()
}

/// What pairs were compared, and what came of it.
fn in_words(pairs: &[OffsetPair]) -> String {
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
    /// More fill a screen and say no more.
    const MOST: usize = 3;
    let mut said: Vec<String> = pairs.iter().map(one).take(MOST).collect();
    match pairs.len().saturating_sub(MOST) {
        0 => {}
        1 => said.push("another pair does no better".to_owned()),
        more => said.push(format!("{more} other pairs do no better")),
    }
    said.join("; ")
}
