//! Steps of the noise at a fixed plant.

use nalgebra::{DMatrix, DVector};

use super::descent::{DAMPING_FACTOR, MOST_DAMPING, Tolerance};
use super::filter::{InstrumentNoise, Noise, NoiseNumber, Swell};
use super::problem::{Point, Problem, clamped};
use super::schedule::PIECES_PART;
use crate::estimate::descend::Parabola;

/// Descent of the noise: what its steps have shown carries over to the next.
pub(super) struct NoiseDescent {
    damping: f64,
    /// Logarithms of the noise at the last point, and the gradient there.
    last: Option<(DVector<f64>, DVector<f64>)>,
    /// Steps, and the change of the gradient over each; the latest is last.
    steps: Vec<(DVector<f64>, DVector<f64>)>,
}

impl NoiseDescent {
    pub(super) const fn new() -> Self {
        Self { damping: NOISE_DAMPING, last: None, steps: Vec::new() }
    }

    /// Forgets past steps, as the likelihood is another one with another plant.
    pub(super) fn forget(&mut self) {
        (self.last, self.steps) = Default::default();
    }

    /// Estimates the Hessian at a point: its Fisher information, which is the Hessian only where the
    /// model is true, with the update of Broyden, Fletcher, Goldfarb and Shanno for each step so far.
    ///
    /// # Source
    /// [NocedalWright2006, eq. 6.19].
    fn hessian(
        &mut self,
        at: &DVector<f64>,
        gradient: &DVector<f64>,
        information: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        if let Some((before, gradient_before)) = &self.last {
            let (step, change) = (at - before, gradient - gradient_before);
            if step.dot(&change) > 0.0 {
                self.steps.push((step, change));
            }
        }
        self.last = Some((at.clone(), gradient.clone()));
        let mut hessian = information.clone();
        for (step, change) in &self.steps {
            let expected = &hessian * step;
            let curvature = step.dot(&expected);
            if curvature > 0.0 {
                hessian -= &expected * expected.transpose() / curvature;
                hessian += change * change.transpose() / step.dot(change);
            }
        }
        hessian
    }
}

/// Maximum number of steps of the noise between two of the plant.
const MOST_NOISE_STEPS: usize = 8;

/// Maximum step of a logarithm of the noise.
const GREATEST_LOG_STEP: f64 = 1.0;

/// Information on the logarithm of a disturbance or a jitter below which it is absent: it changes no likelihood.
const ABSENT: f64 = 1e-4;

/// Maximum downward step of the logarithm of a disturbance, …
const GREATEST_FALL: f64 = 3.0;
/// … and maximum upward step.
const GREATEST_RISE: f64 = 6.0;

/// Limits of the disturbance's correlation time, s: a shorter one is indistinguishable from
/// measurement noise, a longer one from a constant.
const CORRELATION_S: [f64; 2] = [0.2, 300.0];

/// Limits of the standard deviation of the current's variation, m/s.
const DRIFT_STD_M_S: [f64; 2] = [1e-4, 1.0];

/// Limits of the correlation time of the current's variation, s: shorter is turbulence or sensor
/// noise, longer is constant during a trial.
const DRIFT_CORRELATION_S: [f64; 2] = [10.0, 1000.0];

/// Limits of the standard deviation of an accelerometer's offset, m/s².
const OFFSET_M_S2: [f64; 2] = [1e-4, 2.0];

/// Limits of its correlation time, s: shorter is measurement noise, longer is a constant.
const OFFSET_CORRELATION_S: [f64; 2] = [3.0, 3000.0];

/// Lower limit of measurement noise as a fraction of the estimate from differences of samples:
/// otherwise a disturbance that explains every sample could reduce it to zero.
const LEAST_NOISE_PART: f64 = 0.1;

/// Initial and least damping of steps of the noise, whose curvature is known less well.
const NOISE_DAMPING: f64 = 0.02;

impl Problem {
    /// Returns true if the noise is fitted to pieces of the trials, which determine it well enough for a
    /// coarse fit. With position or acceleration sensors its gradient takes so long that they have to do
    /// at the optimum as well. Waves are not determined by pieces: their fit would be that of other waves.
    pub(super) fn has_partial_noise(&self, tolerance: Tolerance) -> bool {
        let is_enough = tolerance.is_coarse || self.instruments.count() > 0;
        // A pass over all of one axis is short, and pieces of it tell slow disturbances from a bias force badly.
        is_enough && self.pieces.is_some() && self.structure.axes().len() > 1
    }

    /// Makes steps of the noise while each gains more than the last step of the plant promised;
    /// returns true if the noise has converged.
    pub(super) fn settle_noise(
        &self,
        point: &mut Point,
        tolerance: Tolerance,
        descent: &mut NoiseDescent,
        promised: f64,
    ) -> bool {
        if self.is_free {
            return self.step_misfit(point, tolerance);
        }
        for _ in 0..MOST_NOISE_STEPS {
            match self.step_noise(point, tolerance, descent) {
                None => return true,
                Some(gained) if gained <= promised => return false,
                Some(_) => {}
            }
        }
        false
    }

    /// Makes one step of the noise; returns its gain in log-likelihood, or `None` if the noise has
    /// converged.
    fn step_noise(
        &self,
        point: &mut Point,
        tolerance: Tolerance,
        descent: &mut NoiseDescent,
    ) -> Option<f64> {
        let is_partial = self.has_partial_noise(tolerance);
        let pieces = if is_partial { self.in_pieces() } else { None };
        let data = pieces.as_ref().unwrap_or(self);
        let needed = tolerance.noise * if pieces.is_some() { PIECES_PART } else { 1.0 };
        let logarithms = point.noise.logarithms();
        let (cost, gradient) = data.by_noise(point)?;
        let information = data.noise_information(point)?;
        let limits = self.noise_limits(&point.noise);
        let hessian = descent.hessian(&logarithms, &gradient, &information);
        let damping = &mut descent.damping;
        // A number that changes no likelihood and need not grow is held, with the correlation time of a disturbance.
        let is_absent = |k: usize| information[(k, k)] < ABSENT && gradient[k] >= 0.0;
        let numbers = point.noise.numbers();
        let is_held = |k: usize| match numbers[k] {
            NoiseNumber::Disturbance(axis) | NoiseNumber::Correlation(axis) => is_absent(axis),
            NoiseNumber::Jitter => is_absent(k),
            NoiseNumber::Velocity(axis) => self.is_unmeasured(axis),
            _ => false,
        };
        let parabola = Parabola::new((&gradient, &hessian), (&logarithms, &limits), is_held);
        while *damping < MOST_DAMPING {
            let Some(step) = parabola.step(*damping) else {
                *damping *= DAMPING_FACTOR;
                continue;
            };
            if 0.5 * parabola.promise(&step) < needed {
                return None;
            }
            // Each component is limited separately, so that one that diverges does not slow the
            // others.
            let is_first = *damping <= NOISE_DAMPING;
            let reached = step.iter().zip(&numbers).map(|(x, number)| {
                let x = if number.is_std() { as_step_of_variance(*x) } else { *x };
                // A disturbance that was or is absent has to change by orders of magnitude.
                let [down, up] = match number {
                    NoiseNumber::Disturbance(_) if is_first => [GREATEST_FALL, GREATEST_RISE],
                    NoiseNumber::Disturbance(_) => [GREATEST_FALL, GREATEST_LOG_STEP],
                    _ => [GREATEST_LOG_STEP; 2],
                };
                x.clamp(-down, up)
            });
            let step = DVector::from_iterator(step.len(), reached);
            let moved = clamped(&logarithms + step, &limits);
            let moved = Point { noise: point.noise.with_logarithms(&moved), ..point.clone() };
            let gained = cost + self.prior(point) - data.cost(&moved);
            if gained > 0.0 {
                *point = moved;
                *damping = (*damping / DAMPING_FACTOR).max(NOISE_DAMPING);
                // An absent disturbance decreases without limit and gains nothing.
                return (gained >= needed).then_some(gained);
            }
            *damping *= DAMPING_FACTOR;
        }
        *damping = NOISE_DAMPING;
        None
    }

    /// Returns the lower and upper limit of each logarithm of the noise.
    fn noise_limits(&self, noise: &Noise) -> Vec<(f64, f64)> {
        let least = |of_samples: f64| [LEAST_NOISE_PART * of_samples, f64::INFINITY];
        let of = |number: &NoiseNumber| match *number {
            NoiseNumber::Disturbance(_) | NoiseNumber::Swell(_) => [0.0, f64::INFINITY],
            NoiseNumber::Correlation(_) => CORRELATION_S,
            NoiseNumber::Velocity(axis) => least(self.sample_noise[axis]),
            NoiseNumber::Attitude => least(self.attitude_noise),
            NoiseNumber::Instrument(InstrumentNoise::OFFSET) => OFFSET_M_S2,
            NoiseNumber::Instrument(InstrumentNoise::OFFSET_CORRELATION) => OFFSET_CORRELATION_S,
            NoiseNumber::Instrument(number) => least(self.instruments.numbers[number]),
            NoiseNumber::Drift => DRIFT_STD_M_S,
            NoiseNumber::DriftCorrelation => DRIFT_CORRELATION_S,
            NoiseNumber::SwellFrequency => Swell::FREQUENCY,
            NoiseNumber::SwellDamping => Swell::DAMPING,
            NoiseNumber::Jitter => [0.0, self.thrust_period_s],
        };
        noise.numbers().iter().map(|number| of(number).map(f64::ln).into()).collect()
    }
}

/// Converts a step x of ln σ to the one that changes σ² by as much as x promises, `σ² (1 + 2x)`: the
/// likelihood is closer to a parabola in variances than in their logarithms.
fn as_step_of_variance(x: f64) -> f64 {
    // No variance falls below a tenth.
    let part = 1.0 + 2.0 * x;
    if part > 0.1 { 0.5 * part.ln() } else { x.min(0.5 * 0.1_f64.ln()) }
}

#[cfg(test)]
mod tests {
    use super::as_step_of_variance;

    /// White noise of r times the variance that is assumed has a slope of 1 − r by ln σ and a Fisher
    /// information of 2, by number of samples.
    #[test]
    fn a_wrong_variance_of_white_noise_takes_one_step() {
        for ratio in [0.11_f64, 0.5, 1.0, 4.0, 1e9] {
            let found = (2.0 * as_step_of_variance(0.5 * (ratio - 1.0))).exp();
            assert!((found / ratio - 1.0).abs() < 1e-9, "{found}, not {ratio}");
        }
        let steps = [-9.0, -1.2, -0.5, -0.46, -0.44, 0.0, 3.0];
        let reached = steps.map(as_step_of_variance);
        assert!(reached.is_sorted() && reached.iter().all(|x| x.is_finite()), "{reached:?}");
    }
}
