//! From a start to the optimum: Gauss–Newton steps of plant, thrust and currents, and steps of the noise between
//! them.
//!
//! Steps follow the innovations at fixed filter gains; of one axis, whose passes are short, the likelihood itself.

use nalgebra::{DMatrix, DVector};

use super::actuator::Actuator;
use super::filter::{Gains, Slope};
use super::noise_descent::NoiseDescent;
use super::problem::{CURRENT_STD, Point, Problem};
use crate::Error;
use crate::estimate::descend::Parabola;
use crate::plant::Parameterisation;

/// Result of the optimisation.
#[derive(Clone, Debug)]
pub(super) struct Optimum {
    pub(super) point: Point,
    /// Negative log-likelihood.
    pub(super) cost: f64,
    /// Fisher information of coefficients, actuator and currents, including priors.
    pub(super) information: DMatrix<f64>,
    /// Fisher information of the logarithms of the noise; zero for output error.
    pub(super) noise_information: DMatrix<f64>,
    /// Number of iterations.
    pub(super) iterations: usize,
}

/// Treatment of the noise during a descent.
#[derive(Clone, Copy, Debug, PartialEq)]
enum WithNoise {
    Fitted,
    Kept,
}

/// Maximum number of iterations of a fit.
const MOST_STEPS: usize = 60;

/// Gain in log-likelihood that the last of them may still promise: most coefficients are then within half a
/// standard deviation.
const LATE: f64 = 0.5;

/// Convergence tolerance of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerance {
    /// The iteration stops when the expected gain in log-likelihood of a step is below this.
    plant: f64,
    /// The same for a step of the noise, whose parameters matter less. At the true value of some twenty of
    /// them the log-likelihood is some ten below its maximum.
    pub(super) noise: f64,
    /// True where the noise may be fitted to pieces of the trials.
    pub(super) is_coarse: bool,
}

impl Tolerance {
    /// Steps of every coefficient are below 1 % of its standard deviation.
    pub(super) const FINE: Self = Self { plant: 5e-5, noise: 0.05, is_coarse: false };
    /// Steps of every coefficient are below half of its standard deviation: sufficient for a search
    /// of missing terms and as a start for a finer fit.
    pub(super) const COARSE: Self = Self { plant: 0.1, noise: 0.5, is_coarse: true };

    /// Sufficient to compare plants of other terms beside the same noise: steps end at about a standard deviation,
    /// and follow the innovations at fixed filter gains.
    pub(super) const ROUGH: Self = Self { plant: KEPT_BELOW, ..Self::COARSE };

    /// Coarse for the plant and fine for the noise, of which each number matters: for waves.
    pub(super) const OF_NOISE: Self = Self { noise: Self::FINE.noise, ..Self::COARSE };

    /// Returns the tolerance for output error, where the correlated misfit makes about a hundred
    /// samples worth one independent sample.
    fn for_output_error(self) -> Self {
        Self { plant: 100.0 * self.plant, noise: 100.0 * self.noise, ..self }
    }

    /// Returns the actual gain below which a step is the last, whatever gain was expected.
    fn least_gain(self) -> f64 {
        0.1 * self.plant
    }
}

/// Damping of Gauss–Newton steps: initial value, factor, limits.
const DAMPING: f64 = 1e-4;
pub(super) const DAMPING_FACTOR: f64 = 8.0;
pub(super) const MOST_DAMPING: f64 = 1e8;
const LEAST_DAMPING: f64 = 1e-9;

/// Differences by which slopes are computed, in standard deviations.
const DIFFERENCE: f64 = 0.02;

/// Part of the promised gain of a step that it has to give where its slope is that at kept gains.
const PART_KEPT: f64 = 0.5;

/// Gain of a step of the plant above which earlier steps of the noise say nothing of its curvature, and the
/// slope at kept gains suffices.
const KEPT_BELOW: f64 = 1.0;

impl Problem {
    /// Returns true if output error is the fallback when this fit does not converge, so that
    /// further attempts are not worth their time.
    pub(super) fn has_rival(&self) -> bool {
        !self.is_free && self.structure.reads_beside_thrusters()
    }

    /// Finds the optimum from a start, with the first steps on pieces of the trials.
    ///
    /// # Errors
    /// [`Error::Plant`] if the fit does not converge.
    pub(super) fn optimum(&self, start: Point, tolerance: Tolerance) -> Result<Optimum, Error> {
        let pieces = self.in_pieces();
        if let Some(pieces) = pieces.as_ref().filter(|_| self.has_rival()) {
            let nearer = pieces.descent(start, Tolerance::COARSE)?;
            return self.descent(nearer.point, tolerance);
        }
        let on_pieces = |pieces: Self| pieces.descent(start.clone(), Tolerance::COARSE).ok();
        let nearer = pieces.and_then(on_pieces);
        let found = nearer.and_then(|nearer| self.descent(nearer.point, tolerance).ok());
        found.map_or_else(|| self.descent(start, tolerance), Ok)
    }

    /// Finds the optimum from a start: alternates steps of plant and currents at fixed filter gains
    /// with steps of the noise.
    ///
    /// # Errors
    /// [`Error::Plant`] if the fit does not converge.
    pub(super) fn descent(&self, start: Point, tolerance: Tolerance) -> Result<Optimum, Error> {
        self.descend(start, tolerance, WithNoise::Fitted)
    }

    /// Finds the optimum at fixed noise: for a plant with few more terms than the one with which
    /// the noise was fitted.
    ///
    /// # Errors
    /// As [`Self::descent`].
    pub(super) fn descent_at_noise(
        &self,
        start: Point,
        tolerance: Tolerance,
    ) -> Result<Optimum, Error> {
        self.descend(start, tolerance, WithNoise::Kept)
    }

    fn descend(
        &self,
        start: Point,
        tolerance: Tolerance,
        noise: WithNoise,
    ) -> Result<Optimum, Error> {
        let refuse =
            |reason: &str| Error::Plant { axes: self.structure.name(), reason: reason.to_owned() };
        let tolerance = if self.is_free { tolerance.for_output_error() } else { tolerance };
        let mut point = start;
        if noise == WithNoise::Fitted {
            point.jitter_of = point.actuator;
        }
        let mut damping = DAMPING;
        let mut of_noise = NoiseDescent::new();
        let mut is_kept = noise == WithNoise::Kept;
        let mut noise_is_settled = is_kept;
        let (mut gain, mut before) = (f64::INFINITY, [f64::INFINITY; 2]);
        for iterations in 0..MOST_STEPS {
            if !noise_is_settled {
                noise_is_settled = self.settle_noise(&mut point, tolerance, &mut of_noise, gain);
            }
            let (slope, gains) = self
                .by_plant(&point)
                .ok_or_else(|| refuse("its simulation diverges from the start; leave out terms, or use trials with more motion"))?;
            is_kept |= self.has_partial_noise(tolerance) && alternate(before, slope.cost);
            before = [before[1], slope.cost];
            gain = self.step_plant(&mut point, &slope, &gains, &mut damping, tolerance);
            if gain > KEPT_BELOW {
                of_noise.forget();
            }
            // At the limit of what masses are possible, some numbers lose their meaning, and steps promise a little
            // for ever. A coarse fit that does not settle tells its caller something.
            let is_late = iterations + 1 == MOST_STEPS && gain < LATE && !tolerance.is_coarse;
            let is_last = gain < tolerance.plant || is_late;
            if is_last && noise_is_settled {
                let Slope { cost, information, .. } = slope;
                let iterations = iterations + 1;
                let count = point.noise.count();
                let of_noise = (!self.is_free).then(|| self.noise_information(&point)).flatten();
                let noise_information = of_noise.unwrap_or_else(|| DMatrix::zeros(count, count));
                return Ok(Optimum { point, cost, information, noise_information, iterations });
            }
            noise_is_settled =
                is_kept || is_last && self.settle_noise(&mut point, tolerance, &mut of_noise, gain);
        }
        Err(refuse(
            "the fit did not converge; leave out terms, or use trials with more variation of speed and turning",
        ))
    }

    /// Makes a damped Gauss–Newton step of plant and currents; returns the expected gain of an
    /// undamped step.
    fn step_plant(
        &self,
        point: &mut Point,
        slope: &Slope,
        gains: &[Gains],
        damping: &mut f64,
        tolerance: Tolerance,
    ) -> f64 {
        let (mut gradient, hessian) = self.in_free_numbers(&point.free, slope);
        let is_whole = self.is_small() && tolerance.plant < KEPT_BELOW;
        if is_whole {
            if let Some(promised) = self.step_far(point, slope.cost, (&gradient, &hessian)) {
                return promised;
            }
            self.complete_slope(point, gains, (&mut gradient, &hessian));
        }
        let (numbers, limits) = (point.numbers(), self.limits(point));
        let parabola =
            Parabola::new((&gradient, &hessian), (&numbers, &limits), |k| self.is_held(point, k));
        let at = if is_whole { slope.cost } else { slope.misfit + self.prior(point) };
        let whole = parabola.step(LEAST_DAMPING);
        let expected = whole.map_or(f64::INFINITY, |step| 0.5 * parabola.promise(&step));
        while *damping < MOST_DAMPING {
            let Some(step) = parabola.step(*damping) else {
                *damping *= DAMPING_FACTOR;
                continue;
            };
            let moved = self.as_disturbed(point, point.moved(&step, &limits));
            let there = if is_whole { self.cost(&moved) } else { self.at_gains(&moved, gains) };
            if there <= at {
                *point = moved;
                *damping = (*damping / DAMPING_FACTOR).max(LEAST_DAMPING);
                // Where a limit shortens the step, the gain is less than expected.
                let gained = at - there;
                return if gained < tolerance.least_gain() { gained } else { expected };
            }
            if expected < tolerance.plant {
                return expected;
            }
            *damping *= DAMPING_FACTOR;
        }
        // No shorter step reduces the cost: this is the minimum, within rounding.
        *damping = DAMPING;
        0.0
    }

    /// Makes a step of one axis by the slope at kept gains, if it promises much and keeps that; returns the
    /// promised gain. The rest of the slope takes some passes, and matters near the optimum only.
    fn step_far(
        &self,
        point: &mut Point,
        cost: f64,
        (gradient, hessian): (&DVector<f64>, &DMatrix<f64>),
    ) -> Option<f64> {
        let (numbers, limits) = (point.numbers(), self.limits(point));
        let parabola =
            Parabola::new((gradient, hessian), (&numbers, &limits), |k| self.is_held(point, k));
        let step = parabola.step(LEAST_DAMPING)?;
        let promised = 0.5 * parabola.promise(&step);
        if promised < KEPT_BELOW {
            return None;
        }
        let moved = self.as_disturbed(point, point.moved(&step, &limits));
        let is_kept = cost - self.cost(&moved) > PART_KEPT * promised;
        is_kept.then(|| {
            *point = moved;
            promised
        })
    }

    /// Returns true of a plant of one axis, whose passes are short.
    fn is_small(&self) -> bool {
        self.structure.axes().len() == 1 && !self.is_free
    }

    /// Replaces the slope at fixed gains by that of the likelihood, by differences: plant and currents change the
    /// gains, thrust does not. The current of a trial changes those of this trial alone, so that the currents of all
    /// trials are moved at once.
    ///
    /// `(L(x + δ) − L(x)) / δ − ½ H δ`, with the information H for the curvature.
    fn complete_slope(
        &self,
        point: &Point,
        gains: &[Gains],
        (gradient, hessian): (&mut DVector<f64>, &DMatrix<f64>),
    ) {
        let (limits, numbers) = (self.limits(point), point.numbers());
        let here = self.by_trial_of(gains.iter().map(|own| own.cost));
        let (p, first_current) = (point.free.len(), point.free.len() + Actuator::COUNT);
        let currents = |along: usize| (first_current + along..numbers.len()).step_by(2).collect();
        let moves = (0..p).map(|k| vec![k]).chain((0..2).map(currents));
        for moving in moves {
            let mut step = DVector::zeros(numbers.len());
            for &k in &moving {
                // What is known of currents before does not change the gains.
                let least = if k < p { 0.0 } else { CURRENT_STD.powi(-2) };
                if !self.is_held(point, k) && hessian[(k, k)] > least {
                    step[k] = DIFFERENCE / hessian[(k, k)].sqrt();
                }
            }
            if step.iter().all(|x| *x == 0.0) {
                continue;
            }
            let moved = self.as_disturbed(point, point.moved(&step, &limits));
            let Ok(there) = self.each(&moved, |_, pass| pass.cost()) else { continue };
            let changes = self.by_trial_of(there) - &here;
            let reached = moved.numbers();
            for (trial, &k) in moving.iter().enumerate().filter(|(_, k)| step[**k] != 0.0) {
                let change = match k < p {
                    true => changes.sum() + self.prior(&moved) - self.prior(point),
                    false => {
                        let half_square = |x: f64| 0.5 * (x / CURRENT_STD).powi(2);
                        changes[trial] + half_square(reached[k]) - half_square(numbers[k])
                    }
                };
                let by = reached[k] - numbers[k];
                let slope = change / by - 0.5 * hessian[(k, k)] * by;
                // A simulation that diverges so near has no slope of its own.
                if slope.is_finite() {
                    gradient[k] = slope;
                }
            }
        }
    }

    /// Adds up numbers of schedules by trial.
    fn by_trial_of(&self, of_schedules: impl IntoIterator<Item = f64>) -> DVector<f64> {
        let mut sums = DVector::zeros(self.trials.len());
        for (schedule, x) in self.schedules.iter().zip(of_schedules) {
            sums[schedule.trial] += x;
        }
        sums
    }

    /// Returns a point with disturbances that accelerate the vehicle as at another, whatever its mass.
    ///
    /// That keeps the gains of the filter, which stay fixed in a step of the plant: with forces kept
    /// instead, steps of plant and noise can drive each other away from the optimum.
    fn as_disturbed(&self, from: &Point, mut point: Point) -> Point {
        let masses =
            |point: &Point| self.plant(&point.free).map(|plant| plant.mass_matrix().diagonal());
        let (Ok(before), Ok(now)) = (masses(from), masses(&point)) else { return point };
        let ratio = now.component_div(&before);
        point.noise.disturbance.component_mul_assign(&ratio);
        if let Some(swell) = &mut point.noise.swell {
            swell.std.component_mul_assign(&ratio);
        }
        point
    }

    /// Returns the lower and upper limit of each number of a point.
    fn limits(&self, point: &Point) -> Vec<(f64, f64)> {
        let lowest = self.physical.lowest().into_iter();
        let of_plant = lowest.map(|low| (low.unwrap_or(f64::NEG_INFINITY), f64::INFINITY));
        let of_currents = point.currents.iter().flatten();
        let of_currents = of_currents.map(|_| (f64::NEG_INFINITY, f64::INFINITY));
        of_plant.chain(Actuator::LIMITS).chain(of_currents).collect()
    }

    /// Returns true if a number of a point is not fitted.
    fn is_held(&self, point: &Point, k: usize) -> bool {
        let p = point.free.len();
        match k.checked_sub(p) {
            None => false,
            Some(k) => self.fits.get(k).map_or(!self.has_current, |fits| !fits),
        }
    }

    /// Converts gradient and information from coefficients to the plant's free parameters.
    fn in_free_numbers(&self, free: &DVector<f64>, slope: &Slope) -> (DVector<f64>, DMatrix<f64>) {
        let (p, all) = (free.len(), slope.gradient.len());
        let mut jacobian = DMatrix::identity(all, all);
        jacobian.view_mut((0, 0), (p, p)).copy_from(&self.physical.jacobian(free));
        let hessian = jacobian.transpose() * &slope.information * &jacobian;
        (jacobian.transpose() * &slope.gradient, hessian)
    }
}

/// Returns true if costs alternate between two values: the last is nearly that before the one before it.
/// Noise that is fitted to pieces of the trials and a plant that is fitted to all of them do so where pieces
/// differ from the rest.
fn alternate([before, last]: [f64; 2], cost: f64) -> bool {
    let swing = (cost - last).abs();
    swing > LEAST_SWING && (cost - before).abs() < CLOSED_PART * swing
}

/// Least swing of a cost: a coarse fit that converges changes it by less than one.
const LEAST_SWING: f64 = 10.0;
/// Part of a swing by which costs may differ that count as the same.
const CLOSED_PART: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::alternate;

    #[test]
    fn costs_that_alternate_are_told_from_those_that_fall() {
        // As noise of pieces and a plant of all trials did with kicks in some pieces.
        assert!(alternate([-389_469.9, -376_993.7], -389_470.0));
        assert!(!alternate([f64::INFINITY; 2], -100.0));
        assert!(!alternate([f64::INFINITY, -100.0], -200.0));
        assert!(!alternate([-100.0, -200.0], -250.0), "falling");
        assert!(!alternate([-200.0, -100.0], -150.0), "half of the way back");
        assert!(!alternate([-200.0, -199.0], -200.0), "converged");
    }
}
