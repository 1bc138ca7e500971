//! Leaves out of a model what is not worth its place.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{CLEAR_GAIN, NUMBERS, OneAxis, axis_of, decision, force_rms, usual_speed};
use crate::estimate::candidate::{Candidate, Decision};
use crate::estimate::plant_fit::Fitted;
use crate::estimate::plant_fit::actuator::Actuator;
use crate::estimate::plant_fit::descent::Tolerance;
use crate::estimate::plant_fit::problem::{Point, Problem};
use crate::estimate::plant_fit::search::{ADMITTED, widened};
use crate::estimate::plant_fit::uncertainty::inverse;
use crate::plant::{Basis, Parameterisation, Product, Structure};
use crate::{AxisRecord, Error};

impl OneAxis<'_> {
    /// The same without what is not worth its place, and what came of each.
    ///
    /// The covariance at the optimum says what each is worth, and where the others move to when one goes:
    /// `θ − C_g C_gg⁻¹ θ_g` and `C − C_g C_gg⁻¹ C_gᵀ` with g the numbers that go. The least worthy goes
    /// first; then what is left is fitted, until all of it is worth its place.
    pub(super) fn eliminated(&self, fitted: Fitted, decisions: &mut Vec<Decision>) -> Fitted {
        let mut now = fitted;
        loop {
            let Some((gone, kept)) = self.superfluous(&now) else { return now };
            if gone.is_empty() {
                replace(decisions, kept);
                return now;
            }
            let candidates: Vec<Candidate> = gone.iter().map(|own| own.candidate).collect();
            // A model that does not settle without them needs them.
            let Ok(fewer) = self.without(&now, &candidates) else {
                let stay = |own: Decision| Decision { admitted: true, ..own };
                let all = kept.into_iter().chain(gone.into_iter().map(stay));
                replace(decisions, all.collect());
                return now;
            };
            replace(decisions, gone);
            now = fewer;
        }
    }

    /// What is not worth its place, and what is.
    fn superfluous(&self, fitted: &Fitted) -> Option<(Vec<Decision>, Vec<Decision>)> {
        let (problem, optimum) = fitted.parts();
        let covariance = fitted.covariance_by_colour(&fitted.whiteness_by_axis().ok()?);
        let mut left = Parabola { theta: all_numbers(problem, &optimum.point), covariance };
        let mut open: Vec<(Candidate, Vec<usize>)> = self
            .candidates
            .iter()
            .filter_map(|candidate| Some((*candidate, places(*candidate, problem)?)))
            .collect();
        let mut gone = Vec::new();
        let drifts = optimum.point.noise.drift.is_some();
        loop {
            let judged = |(candidate, places): &(Candidate, Vec<usize>)| {
                self.judged(*candidate, &left, places, (problem, drifts))
            };
            let all: Vec<Decision> = open.iter().map(judged).collect();
            let has = |candidate| open.iter().any(|(own, _)| *own == candidate);
            let may_go = |own: &&Decision| {
                let ratios = [Candidate::LagRatio, Candidate::FallingLagRatio];
                !own.admitted && (own.candidate != Candidate::Lag || !ratios.into_iter().any(has))
            };
            let least = all.iter().filter(may_go).min_by(|a, b| {
                let part = |own: &Decision| own.likelihood_ratio / own.needed;
                part(a).total_cmp(&part(b))
            });
            let Some(least) = least else { return Some((gone, all)) };
            let at = open.iter().position(|(own, _)| *own == least.candidate)?;
            let (_, places) = open.remove(at);
            left.leave_out(&places);
            gone.push(least.clone());
        }
    }

    /// What a candidate is worth beside what is left; a current that drifts stays.
    pub(super) fn judged(
        &self,
        candidate: Candidate,
        left: &Parabola,
        places: &[usize],
        (problem, drifts): (&Problem, bool),
    ) -> Decision {
        let ratio = left.worth(places);
        let ln_samples = (problem.samples() as f64).ln();
        let tried = self.tried();
        let first = places.first().copied().unwrap_or_default();
        let (value, std) = (left.theta[first], left.covariance[(first, first)].max(0.0).sqrt());
        let (needed, size, admitted) = match candidate {
            Candidate::LinearDrag => {
                let knows_velocity = self.axes.iter().any(AxisRecord::knows_velocity);
                // Acceleration alone hardly shows the bend of drag: there linear drag stays, for mass and
                // quadratic drag would make up for it.
                let needed = if knows_velocity { ln_samples.max(CLEAR_GAIN) } else { 0.0 };
                let axis = axis_of(self.dof);
                let square = Basis::Product(axis, Product::quadratic(axis));
                let square = problem.structure.index_of(&square).map_or(0.0, |k| left.theta[k]);
                let size = value / (square * usual_speed(self.axes));
                let is_slight = (0.0..SLIGHT_LINEAR_DRAG).contains(&size);
                (needed, Some(size), ratio > needed && !is_slight)
            }
            Candidate::Bias => {
                let needed = ln_samples.max(CLEAR_GAIN);
                let size = (value.abs() + 1.96 * std) / force_rms(self.axes);
                (needed, Some(size), ratio > needed || size > SLIGHT_BIAS)
            }
            Candidate::Current => {
                let needed = places.len() as f64 * ln_samples + 2.0 * tried.ln();
                let currents: Vec<f64> = places.iter().map(|k| left.theta[*k]).collect();
                let admitted = ratio > needed && !self.follow_speed(&currents);
                (needed, None, admitted || drifts)
            }
            Candidate::Inflow | Candidate::InflowAhead | Candidate::Turning => {
                let needed = ln_samples + 2.0 * tried.ln();
                (needed, None, ratio > needed)
            }
            _ => {
                let number = NUMBERS.iter().find(|(own, _)| *own == candidate);
                let needed = number.map_or(0.0, |(_, k)| Actuator::shows(*k, value));
                // Thrust that acts hardly before its log says is refused whatever it is worth.
                let shown = if needed.is_finite() { needed } else { ADMITTED };
                (shown, None, ratio > needed)
            }
        };
        Decision { size, ..decision(candidate, ratio, needed, admitted) }
    }

    /// The optimum without some candidates.
    ///
    /// # Errors
    /// [`Error::Plant`] if the fit does not settle.
    pub(super) fn without(&self, fitted: &Fitted, gone: &[Candidate]) -> Result<Fitted, Error> {
        let (problem, optimum) = fitted.parts();
        let (problem, point) = narrowed(problem, &optimum.point, gone);
        let optimum = problem.descent_at_noise(point, Tolerance::COARSE)?;
        Ok(fitted.moved_to(problem, optimum))
    }

    /// True if the currents of trials are in proportion to the mean speeds of the vehicle: water does not
    /// know how fast a vehicle goes, so that this is something else, such as drag.
    pub(super) fn follow_speed(&self, currents: &[f64]) -> bool {
        let mean = |axis: &AxisRecord| {
            let velocity = axis.velocity().ok()?;
            Some(velocity.values().iter().sum::<f64>() / velocity.len() as f64)
        };
        let pairs = self.axes.iter().zip(currents);
        let pairs: Vec<(f64, f64)> =
            pairs.filter_map(|(axis, current)| Some((mean(axis)?, *current))).collect();
        are_in_proportion(&pairs)
    }
}

/// The problem without some candidates, and its point next to another.
pub(super) fn narrowed(old: &Problem, point: &Point, gone: &[Candidate]) -> (Problem, Point) {
    let terms: Vec<Basis> =
        gone.iter().filter_map(|candidate| term_of(*candidate, &old.structure)).collect();
    let structure = old.structure.without(|own| terms.contains(own));
    let mut problem = old.with_terms(structure);
    let mut point = widened(&problem, old, point);
    let mut numbers = point.actuator.numbers();
    for (candidate, k) in NUMBERS {
        if gone.contains(&candidate) {
            problem.fits[k] = false;
            numbers[k] = 0.0;
        }
    }
    point.actuator = point.actuator.with(numbers);
    if gone.contains(&Candidate::Current) {
        problem.has_current = false;
        point.currents.fill([0.0; 2]);
    }
    (problem, point)
}

/// Adds decisions, in the place of earlier ones on the same candidates.
pub(super) fn replace(decisions: &mut Vec<Decision>, new: Vec<Decision>) {
    decisions.retain(|old| !new.iter().any(|new| new.candidate == old.candidate));
    decisions.extend(new);
}

/// Linear drag below this part of the quadratic is none, however sharply it is seen: below what a thrust
/// curve or the clock of a log is good for.
const SLIGHT_LINEAR_DRAG: f64 = 0.01;

/// A bias force stays in the model unless the trials show that it is below this part of the thrust: a vehicle
/// is seldom neutral, and a simulation without its weight drifts away.
const SLIGHT_BIAS: f64 = 0.02;

/// The term that a candidate is.
fn term_of(candidate: Candidate, structure: &Structure) -> Option<Basis> {
    let axis = structure.axes()[0];
    match candidate {
        Candidate::LinearDrag => Some(Basis::Product(axis, Product::linear(axis))),
        Candidate::Bias => Some(Basis::One(axis)),
        Candidate::Inflow | Candidate::InflowAhead | Candidate::Turning => {
            structure.term_named(candidate.name())
        }
        _ => None,
    }
}

/// Where the numbers of a candidate stand among coefficients, numbers of the actuator and currents; `None` of
/// one that is not fitted.
pub(super) fn places(candidate: Candidate, problem: &Problem) -> Option<Vec<usize>> {
    let p = problem.structure.terms().len();
    if let Some((_, k)) = NUMBERS.iter().find(|(own, _)| *own == candidate) {
        return problem.fits[*k].then(|| vec![p + k]);
    }
    if candidate == Candidate::Current {
        let of_trial = |trial: usize| p + Actuator::COUNT + 2 * trial;
        return problem.has_current.then(|| (0..problem.trials.len()).map(of_trial).collect());
    }
    Some(vec![problem.structure.index_of(&term_of(candidate, &problem.structure)?)?])
}

/// Coefficients, numbers of the actuator and currents.
pub(super) fn all_numbers(problem: &Problem, point: &Point) -> DVector<f64> {
    let coefficients = problem.physical.coefficients(&point.free);
    let currents = point.currents.as_flattened().iter().copied();
    let numbers = coefficients.iter().copied().chain(point.actuator.numbers());
    DVector::from_iterator(
        coefficients.len() + Actuator::COUNT + currents.len(),
        numbers.chain(currents),
    )
}

/// The likelihood about an optimum, to second order.
pub(super) struct Parabola {
    pub(super) theta: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
}

impl Parabola {
    /// Twice what the log-likelihood is less by without some numbers.
    fn worth(&self, places: &[usize]) -> f64 {
        let own = self.covariance.select_rows(places).select_columns(places);
        let theta = self.theta.select_rows(places);
        theta.dot(&(inverse(&own) * &theta))
    }

    fn leave_out(&mut self, places: &[usize]) {
        let columns = self.covariance.select_columns(places);
        let by = &columns * inverse(&columns.select_rows(places));
        self.theta -= &by * self.theta.select_rows(places);
        self.covariance -= &by * columns.transpose();
    }
}

/// Mean speeds of trials that differ by less than this part of the greatest show nothing of what
/// follows them.
const SPEEDS_DIFFER: f64 = 0.3;

/// A ratio of current to speed is the same in all trials by chance once in a thousand.
const SAME_RATIO: f64 = 1e-3;

/// Whether the second numbers are in proportion to the first, which differ, by more than chance.
fn are_in_proportion(pairs: &[(f64, f64)]) -> bool {
    let speeds = || pairs.iter().map(|(speed, _)| *speed);
    let (least, most) = (speeds().fold(f64::MAX, f64::min), speeds().fold(f64::MIN, f64::max));
    if pairs.len() < 3 || most - least < SPEEDS_DIFFER * most.abs().max(least.abs()) {
        return false;
    }
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let ratio = sum(&|(v, u)| u * v) / sum(&|(v, _)| v * v);
    let left = sum(&|(v, u)| (u - ratio * v).powi(2));
    let freedom = (pairs.len() - 1) as f64;
    let explained = sum(&|(v, _)| (ratio * v).powi(2)) * freedom / left.max(f64::MIN_POSITIVE);
    FisherSnedecor::new(1.0, freedom).is_ok_and(|chance| chance.sf(explained) < SAME_RATIO)
}

#[cfg(test)]
mod tests {
    use super::are_in_proportion;

    #[test]
    fn currents_in_proportion_to_speed_are_told_from_a_current() {
        let with = |currents: [f64; 4]| {
            let pairs: Vec<(f64, f64)> = [0.3, 0.6, 0.9, 1.2].into_iter().zip(currents).collect();
            are_in_proportion(&pairs)
        };
        assert!(with([0.030, 0.061, 0.089, 0.120]));
        assert!(!with([0.1, 0.1, 0.1, 0.1]));
        assert!(!with([0.05, -0.02, 0.11, 0.08]));
        assert!(!are_in_proportion(&[(0.5, 0.1), (0.5, 0.1), (0.5, 0.1)]));
    }
}
