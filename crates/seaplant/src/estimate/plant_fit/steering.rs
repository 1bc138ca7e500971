//! Rudders and fins that follow their orders late, where orders are logged in place of angles.
//!
//! Neither the delay nor the greatest rate has a slope where there is none, and a plant that was fitted without them
//! makes up for them by mass and damping. The descent begins at the likeliest of several; after each, both take a step
//! of Newton's method along the profile of the likelihood,
//!
//! ```text
//! −(H_xx − H_xθ I⁻¹ H_θx)⁻¹ (g_x − H_xθ I⁻¹ g_θ)
//! ```
//!
//! with the numbers x of the gear, those θ of the plant and their information I; H by central differences of cost and
//! gradient.

use std::collections::BTreeMap;
use std::convert::identity;

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::descent::{Optimum, Tolerance};
use super::problem::{Point, Problem};
use super::uncertainty::{Asked, inverse};
use super::wiring::acting;
use super::{FirstFit, Fitted, search};
use crate::plant::{Basis, Signal, Structure};
use crate::trial::{HIGHEST_SURFACE_ANGLE_RAD, SteeringGear};
use crate::{Error, Timed, TrialRecord};

/// Delays at which a descent begins, s.
const DELAYS_S: [f64; 4] = [0.1, 0.2, 0.4, 0.8];

/// Times from the least to the greatest order of the trials, s, likewise.
const SWEEPS_S: [f64; 6] = [0.25, 0.5, 1.0, 2.0, 4.0, 8.0];

/// Those that are tried where nothing settles without, s.
const USUAL_SWEEPS_S: [f64; 4] = [1.0, 2.0, 4.0, 0.5];

/// Maximum number of steps.
const MOST_STEPS: usize = 10;

/// A step where the likelihood is convex, as a factor.
const STRIDE: f64 = 1.5;

/// What either number has to show beside the other: together they show as much as a coupling.
const SHOWS: f64 = 4.0;

/// A step below this many standard deviations is negligible.
const SETTLED: f64 = 0.3;

/// Minimum delay, s, and time from the least to the greatest order, s: less is within the sampling error.
const LEAST_S: f64 = 0.01;

/// Where a descent begins of the number that is likeliest zero, s.
const FIRST_S: f64 = 0.05;

/// Differences by which the likelihood is differentiated: of the delay, s, and as a part of the slew.
const DELAY_DIFFERENCE_S: f64 = 0.02;
const SLEW_DIFFERENCE: f64 = 0.1;

/// A gear with standard deviations of delay and slew; `None` for those that are not significant.
#[derive(Clone, Debug, Default)]
pub(super) struct Steering {
    pub(super) gear: SteeringGear,
    pub(super) std: [Option<f64>; 2],
    /// Their share of the covariance of coefficients, actuator and currents.
    of_plant: DMatrix<f64>,
}

impl Steering {
    /// Returns true if a number of it is as clear as a coupling.
    fn is_clear(&self) -> bool {
        let numbers = [self.gear.delay_s, self.gear.slew_s_rad];
        let mut clear = numbers.iter().zip(self.std);
        clear.any(|(x, std)| std.is_some_and(|std| (x / std).powi(2) > search::ADMITTED))
    }

    /// Adds what an unsure gear adds to the covariance of coefficients, actuator and currents.
    pub(super) fn widened(&self, covariance: DMatrix<f64>) -> DMatrix<f64> {
        if self.of_plant.is_empty() { covariance } else { covariance + &self.of_plant }
    }
}

impl SteeringGear {
    /// Returns records in which rudders and fins follow the angles that others have of them.
    fn of_all(
        &self,
        now: &[&TrialRecord],
        logged: &[&TrialRecord],
    ) -> Result<Vec<TrialRecord>, Error> {
        let both = now.iter().zip(logged);
        both.map(|(now, logged)| now.with_surfaces_behind(logged, self)).collect()
    }
}

/// A fit with a gear.
struct Geared {
    steering: Steering,
    problem: Problem,
    optimum: Optimum,
}

/// A first fit with its gear, and records with rudders and fins that follow it; none where they are as logged.
type Steered = (FirstFit, Steering, Vec<TrialRecord>);

impl FirstFit {
    /// Begins with rudders and fins that follow what is logged of them late where that shows, or where nothing settles
    /// without.
    ///
    /// # Errors
    /// Those of `first_fit` on records as they are logged.
    pub(super) fn steered(
        structure: &Structure,
        records: &[&TrialRecord],
        first_fit: impl Fn(&[&TrialRecord]) -> Result<Self, Error>,
    ) -> Result<Steered, Error> {
        let error = match first_fit(records) {
            Ok(begun) => return begun.with_steering_that_shows(records, first_fit),
            Err(error) => error,
        };
        let range = range_of_orders(structure, records);
        if range == 0.0 {
            return Err(error);
        }
        for sweep_s in USUAL_SWEEPS_S {
            let gear = SteeringGear { delay_s: FIRST_S, slew_s_rad: sweep_s / range };
            let Some((_, first, _)) = Self::with_gear(gear, records, &first_fit)? else { continue };
            let found = Self::with_gear(first.gear, records, &first_fit)?;
            if let Some(found) = found.filter(|(_, found, _)| found.is_clear()) {
                return Ok(found);
            }
        }
        Err(error)
    }

    /// The same with rudders and fins that follow what is logged of them late, begun anew by `first_fit`, if that is
    /// likelier by more than chance.
    fn with_steering_that_shows(
        self,
        records: &[&TrialRecord],
        first_fit: impl Fn(&[&TrialRecord]) -> Result<Self, Error>,
    ) -> Result<Steered, Error> {
        let now = acting(&self.prompt, &[], records);
        let likeliest = self.fitted.likeliest_gear(&now, records)?;
        let found = match likeliest {
            Some(gear) => Self::with_gear(gear, records, first_fit)?,
            None => None,
        };
        let Some(found) = found else { return Ok((self, Steering::default(), Vec::new())) };
        let fitted = &found.0.fitted;
        let bar = search::ADMITTED * fitted.colour_of(&fitted.lifts())?;
        let by_sample = |fit: &Fitted| fit.optimum.cost / fit.problem.samples() as f64;
        let samples = self.fitted.problem.samples() as f64;
        let gain = 2.0 * samples * (by_sample(&self.fitted) - by_sample(fitted));
        Ok(if gain > bar { found } else { (self, Steering::default(), Vec::new()) })
    }

    /// Begins anew with a gear, and follows it to where it settles beside lever arms and delays of sensors that no longer
    /// make up for it; none where it does not settle.
    fn with_gear(
        gear: SteeringGear,
        records: &[&TrialRecord],
        first_fit: impl Fn(&[&TrialRecord]) -> Result<Self, Error>,
    ) -> Result<Option<Steered>, Error> {
        let moved = gear.of_all(records, records)?;
        let Ok(next) = first_fit(&moved.iter().collect::<Vec<_>>()) else { return Ok(None) };
        let now = acting(&next.prompt, &moved, records);
        let found = next.fitted.settled(&now, records, (gear, identity))?;
        let Some(found) = found else { return Ok(None) };
        let Geared { steering, problem, optimum } = found;
        // What follows may add to the plant whose covariance it widens.
        let steering = Steering { of_plant: DMatrix::zeros(0, 0), ..steering };
        let moved = steering.gear.of_all(records, records)?;
        let prompt: Vec<&TrialRecord> = next.prompt.iter().collect();
        let prompt = steering.gear.of_all(&prompt, records)?;
        let fitted = Fitted { problem, optimum, ..next.fitted };
        Ok(Some((Self { fitted, prompt, ..next }, steering, moved)))
    }
}

/// Returns the orders of rudders and fins of a plant.
fn orders<'a>(
    structure: &'a Structure,
    logged: &'a [&'a TrialRecord],
) -> impl Iterator<Item = (&'a Signal, &'a Timed)> {
    let surfaces =
        structure.signals().iter().filter(|signal| matches!(signal, Signal::Angle { .. }));
    surfaces.flat_map(|signal| {
        let of_trial = |record: &&'a TrialRecord| record.signals.get(signal);
        logged.iter().filter_map(of_trial).map(move |order| (signal, order))
    })
}

/// Returns the difference of the greatest and the least order of any rudder or fin of a plant, rad; zero if one is none
/// that a surface can follow, as in degrees under the name of radians.
fn range_of_orders(structure: &Structure, logged: &[&TrialRecord]) -> f64 {
    let mut ranges = BTreeMap::new();
    for (signal, order) in orders(structure, logged) {
        let (least, most) = ranges.entry(signal).or_insert((f64::INFINITY, f64::NEG_INFINITY));
        for angle in order.values() {
            (*least, *most) = (least.min(*angle), most.max(*angle));
        }
    }
    let can_follow =
        |(least, most): &(f64, f64)| least.abs().max(most.abs()) <= HIGHEST_SURFACE_ANGLE_RAD;
    match ranges.values().all(can_follow) {
        true => ranges.values().map(|(least, most)| most - least).fold(0.0, f64::max),
        false => 0.0,
    }
}

impl Fitted {
    /// The same with the gear, if there is one, beside all that was found after it, and what it is unsure by in
    /// the covariance of all. The records are those of the fit, `logged` those with angles as logged.
    pub(super) fn with_steering_as_it_is(
        self,
        records: &[&TrialRecord],
        logged: &[&TrialRecord],
    ) -> Result<Self, Error> {
        if self.steering.gear.is_prompt() {
            return Ok(self);
        }
        let acting = match self.reads_speeds() {
            true => self.speeds_as_they_are(records)?,
            false => Vec::new(),
        };
        let acting: Vec<&TrialRecord> = acting.iter().collect();
        let records = if acting.is_empty() { records } else { &acting };
        // Where it does not settle again it stays as it was.
        let start = (self.steering.gear, identity as fn(Problem) -> Problem);
        let Some(found) = self.settled(records, logged, start)? else {
            return Ok(self);
        };
        let Geared { steering, problem, optimum } = found;
        let iterations = self.optimum.iterations + optimum.iterations;
        Ok(Self { steering, problem, optimum: Optimum { iterations, ..optimum }, ..self })
    }

    /// Returns the lift of rudders and fins.
    fn lifts(&self) -> Vec<Basis> {
        let structure = &self.problem.structure;
        let turns = |term: &&Basis| {
            let Basis::Effect(k) = term else { return false };
            let signals = structure.effects()[*k].signals();
            signals.iter().any(|signal| matches!(signal, Signal::Angle { .. }))
        };
        structure.terms().iter().filter(turns).cloned().collect()
    }

    /// Returns the gear that makes trials likeliest, at where it settles; none where none is likelier by more than chance.
    fn likeliest_gear(
        &self,
        now: &[&TrialRecord],
        logged: &[&TrialRecord],
    ) -> Result<Option<SteeringGear>, Error> {
        let range = range_of_orders(&self.problem.structure, logged);
        if range == 0.0 {
            return Ok(None);
        }
        let cost = |gear: SteeringGear| -> Result<f64, Error> {
            let records = gear.of_all(now, logged)?;
            let problem = self.problem.without_pieces(&records.iter().collect::<Vec<_>>());
            Ok(problem.cost(&self.optimum.point))
        };
        let mut best = (self.optimum.cost, SteeringGear::default());
        for round in 0..2 {
            let before = best.1;
            let delayed = DELAYS_S.map(|delay_s| SteeringGear { delay_s, ..before });
            let slowed = SWEEPS_S.map(|all| SteeringGear { slew_s_rad: all / range, ..before });
            let all = delayed.into_iter().chain(slowed);
            for gear in all.filter(|gear| round == 0 || *gear != before) {
                let cost = cost(gear)?;
                if cost < best.0 {
                    best = (cost, gear);
                }
            }
            if best.1 == before {
                break;
            }
        }
        let (cost, gear) = best;
        let least = search::ADMITTED.max(SHOWS * self.colour_of(&self.lifts())?);
        if 2.0 * (self.optimum.cost - cost) <= least {
            return Ok(None);
        }
        let SteeringGear { delay_s, slew_s_rad } = gear;
        let gear = SteeringGear {
            delay_s: delay_s.max(FIRST_S),
            slew_s_rad: slew_s_rad.max(FIRST_S / range),
        };
        // Pieces of the trials show what it is about.
        let found =
            self.settled(now, logged, (gear, |whole| whole.in_pieces().unwrap_or(whole)))?;
        Ok(found.map(|found| found.steering.gear))
    }

    /// Returns the fit with a gear to where it settles, without numbers that are not significant; none where it does not
    /// settle or none is left. It is of the `part` of the trials.
    fn settled(
        &self,
        now: &[&TrialRecord],
        logged: &[&TrialRecord],
        (start, part): (SteeringGear, fn(Problem) -> Problem),
    ) -> Result<Option<Geared>, Error> {
        let least = [LEAST_S, LEAST_S / range_of_orders(&self.problem.structure, logged)];
        let mut now_at = [start.delay_s, start.slew_s_rad];
        let mut from = self.optimum.point.clone();
        for _ in 0..MOST_STEPS {
            let gear = SteeringGear { delay_s: now_at[0], slew_s_rad: now_at[1] };
            let by = |gear: SteeringGear| {
                let records = gear.of_all(now, logged)?;
                Ok(part(self.problem.of(&records.iter().collect::<Vec<_>>())))
            };
            let here = by(gear)?;
            // A descent that does not settle finds no gear.
            let Ok(optimum) = here.descent(from, Tolerance::COARSE) else { return Ok(None) };
            from = optimum.point.clone();
            let Some(slope) = BySteering::at(&here, &from, gear, by)? else { return Ok(None) };
            let fitted = self.moved_to(here, optimum);
            let colour = fitted.colour_of(&self.lifts())?;
            let Some(mut step) = slope.step(colour) else {
                let stride = |k: usize| if slope.slope[k] < 0.0 { STRIDE } else { STRIDE.recip() };
                now_at = [0, 1].map(|k| now_at[k] * stride(k));
                continue;
            };
            let std = [0, 1].map(|k| step.covariance[(k, k)].sqrt());
            let next = [0, 1].map(|k| {
                let next = step.numbers[k].clamp(0.5 * now_at[k], 2.0 * now_at[k]);
                if next < least[k] { 0.0 } else { next }
            });
            let is_settled = (0..2).all(|k| (next[k] - now_at[k]).abs() <= SETTLED * std[k]);
            if next == [0.0; 2] {
                return Ok(None);
            }
            if !is_settled {
                now_at = next;
                continue;
            }
            let unseen = step.without_unseen(|_, _| SHOWS);
            if unseen.iter().all(|k| now_at[*k] == 0.0) {
                // Orders that are held until the next sample are read as lines to it: half a period early.
                let periods = orders(&self.problem.structure, logged).map(|(_, x)| x.period_s());
                let early_s = 0.5 * periods.fold(0.0, f64::max);
                let std = [std[0].hypot(early_s), std[1]];
                let std = [0, 1].map(|k| (now_at[k] > 0.0).then_some(std[k]));
                let steering = Steering { gear, std, of_plant: slope.of_plant(&step.covariance) };
                let Fitted { problem, optimum, .. } = fitted;
                return Ok(Some(Geared { steering, problem, optimum }));
            }
            unseen.into_iter().for_each(|k| now_at[k] = 0.0);
            if now_at == [0.0; 2] {
                return Ok(None);
            }
        }
        Ok(None)
    }
}

/// Slope and curvature of the negative log-likelihood by delay and slew, with the plant to follow.
struct BySteering {
    numbers: Vector2<f64>,
    slope: Vector2<f64>,
    curvature: Matrix2<f64>,
    /// How coefficients, actuator and currents follow them.
    follows: DMatrix<f64>,
}

impl BySteering {
    /// Computes them at a point, with the problem of another gear by `at`; numbers that are zero stay so. `None` where the
    /// filter diverges.
    fn at(
        here: &Problem,
        point: &Point,
        gear: SteeringGear,
        at: impl Fn(SteeringGear) -> Result<Problem, Error>,
    ) -> Result<Option<Self>, Error> {
        let numbers = Vector2::new(gear.delay_s, gear.slew_s_rad);
        let by = Vector2::new(
            DELAY_DIFFERENCE_S.min(0.5 * gear.delay_s),
            SLEW_DIFFERENCE * gear.slew_s_rad,
        );
        let moved = |by: Vector2<f64>| {
            let to = numbers + by;
            at(SteeringGear { delay_s: to[0], slew_s_rad: to[1] })
        };
        let Some((own, _)) = here.by_plant(point) else { return Ok(None) };
        let (mut slope, mut curvature) = (Vector2::zeros(), Matrix2::zeros());
        let mut cross = DMatrix::zeros(own.gradient.len(), 2);
        for k in (0..2).filter(|k| numbers[*k] > 0.0) {
            let step = Vector2::from_fn(|i, _| if i == k { by[k] } else { 0.0 });
            let both = [moved(step)?.by_plant(point), moved(-step)?.by_plant(point)];
            let [Some((after, _)), Some((before, _))] = both else { return Ok(None) };
            slope[k] = (after.cost - before.cost) / (2.0 * by[k]);
            curvature[(k, k)] = (after.cost - 2.0 * own.cost + before.cost) / by[k].powi(2);
            cross.set_column(k, &((after.gradient - before.gradient) / (2.0 * by[k])));
        }
        if numbers.min() > 0.0 {
            let along = moved(by)?.cost(point) - 2.0 * own.cost + moved(-by)?.cost(point);
            let squares = curvature[(0, 0)] * by[0].powi(2) + curvature[(1, 1)] * by[1].powi(2);
            let both = 0.5 * (along - squares) / (by[0] * by[1]);
            (curvature[(0, 1)], curvature[(1, 0)]) = (both, both);
        }
        let follows = -(inverse(&own.information) * &cross);
        let of_plant = follows.transpose() * &own.gradient;
        slope += Vector2::new(of_plant[0], of_plant[1]);
        let of_plant = cross.transpose() * &follows;
        curvature += Matrix2::from_fn(|i, j| of_plant[(i, j)]);
        Ok(Some(Self { numbers, slope, curvature, follows }))
    }

    /// Returns the numbers after a step of Newton's method, with their covariance for noise of a colour; `None` where the
    /// likelihood has no maximum that way.
    fn step(&self, colour: f64) -> Option<Asked> {
        let mut curvature = self.curvature;
        for k in (0..2).filter(|k| self.numbers[*k] == 0.0) {
            curvature[(k, k)] = 1.0;
        }
        let inverse = curvature.cholesky()?.inverse();
        let numbers = self.numbers - inverse * self.slope;
        let covariance = inverse * colour;
        Some(Asked {
            numbers: DVector::from_row_slice(numbers.as_slice()),
            covariance: DMatrix::from_column_slice(2, 2, covariance.as_slice()),
        })
    }

    /// Returns what an unsure gear adds to the covariance of coefficients, actuator and currents.
    fn of_plant(&self, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        &self.follows * covariance * self.follows.transpose()
    }
}
