//! Levenberg–Marquardt on the Fisher information, within limits.

use nalgebra::{DMatrix, DVector};

use super::parameters::{Sensor, Shape, Unknown};
use super::problem::Problem;
use crate::estimate::descend::Parabola;

/// Where a fit ended.
#[derive(Clone, Debug)]
pub(crate) struct Optimum {
    pub(crate) theta: DVector<f64>,
    pub(crate) cost: f64,
    pub(crate) information: DMatrix<f64>,
    pub(crate) converged: bool,
    pub(crate) iterations: usize,
}

/// How long a descent goes on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// A fit that takes more iterations has lost its way, or is compared before it has ended.
    pub(crate) iterations: usize,
    /// It has converged when a step promises to lower the cost by less.
    promise: f64,
}

impl Effort {
    /// To the optimum: the cost is a log-likelihood, and this far from its minimum every number is
    /// within 6 % of its own standard deviation.
    pub(crate) const FINE: Self = Self { iterations: MOST_ITERATIONS, promise: 2e-3 };
    /// Near enough to compare models: every number is within a third of its standard deviation.
    pub(crate) const COARSE: Self = Self { iterations: MOST_ITERATIONS, promise: ROUNDING };

    /// A coarse descent of so many iterations.
    pub(crate) const fn begun(iterations: usize) -> Self {
        Self { iterations, ..Self::COARSE }
    }
}

const MOST_ITERATIONS: usize = 60;
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;
const MOST_DAMPING: f64 = 1e9;

/// Where no step helps at any size, what was promised may be this much: within a third of a
/// standard deviation.
pub(crate) const ROUNDING: f64 = 0.05;

/// Less noise than this is none.
const LEAST_NOISE: f64 = 1e-11;

/// A step that gains less than this part of what it promised is a poor one.
const POOR_GAIN: f64 = 0.02;

/// The damping after one: it halves the step of a number that no other is correlated with.
const AFTER_POOR_DAMPING: f64 = 1.0;

/// After this many poor steps in a row the cost has a kink here.
const POOR_STEPS: usize = 3;

/// Minimises the cost from a start.
///
/// Logged thrust jumps, so the cost has a kink in the delay wherever a jump meets the end
/// of a step. Where descent ends at one, the delay stays there and the rest goes on.
pub(crate) fn minimise(problem: &Problem<'_>, start: DVector<f64>, effort: Effort) -> Optimum {
    let unknowns = problem.numbers();
    let limits = limits_of(problem);
    let (damping, at_kink, poor) = (FIRST_DAMPING, false, 0);
    let mut descent = Descent { theta: start, limits, damping, at_kink, poor };
    let mut here = problem.evaluate(&descent.theta);
    for iterations in 0..effort.iterations {
        let parabola = descent.parabola(unknowns, &here.1, &here.2);
        let step = parabola.step(LEAST_DAMPING);
        let promise = step.map_or(f64::INFINITY, |step| parabola.promise(&step));
        let next = (promise >= effort.promise)
            .then(|| descent.next(problem, unknowns, here.0, &parabola))
            .flatten();
        let Some(Next { theta, damping, there }) = next else {
            let converged = promise < ROUNDING;
            let has_kink = !descent.at_kink && unknowns.contains(&Unknown::Delay);
            if !converged && has_kink {
                descent.leave_at_kink();
                continue;
            }
            let (cost, _, information) = here;
            return Optimum { theta: descent.theta, cost, information, converged, iterations };
        };
        (descent.theta, descent.damping) = (theta, damping);
        let before = here.0;
        here = there;
        let is_poor = before - here.0 < POOR_GAIN * promise;
        descent.poor = if is_poor { descent.poor + 1 } else { 0 };
        if is_poor {
            // The cost is more curved than the information says: whole steps go to and fro over
            // its minimum.
            descent.damping = descent.damping.max(AFTER_POOR_DAMPING);
        }
        if descent.poor >= POOR_STEPS && !descent.at_kink {
            descent.leave_at_kink();
        }
    }
    let (cost, _, information) = here;
    let (theta, iterations) = (descent.theta, effort.iterations);
    Optimum { theta, cost, information, converged: false, iterations }
}

/// Where a minimisation has got to.
struct Descent {
    theta: DVector<f64>,
    /// Of each number.
    limits: Vec<(f64, f64)>,
    damping: f64,
    at_kink: bool,
    poor: usize,
}

impl Descent {
    /// Holds the delay where it is.
    fn leave_at_kink(&mut self) {
        self.at_kink = true;
        self.damping = FIRST_DAMPING;
        self.poor = 0;
    }

    /// The cost near here; at a kink the delay is held.
    fn parabola<'a>(
        &'a self,
        unknowns: &[Unknown],
        gradient: &'a DVector<f64>,
        information: &'a DMatrix<f64>,
    ) -> Parabola<'a> {
        let is_held = |j: usize| self.at_kink && unknowns[j] == Unknown::Delay;
        Parabola::new((gradient, information), (&self.theta, &self.limits), is_held)
    }

    /// The longest step that lowers the cost, if there is one.
    fn next(
        &self,
        problem: &Problem<'_>,
        unknowns: &[Unknown],
        cost: f64,
        parabola: &Parabola<'_>,
    ) -> Option<Next> {
        let moved = |damping: f64| {
            let step = parabola.step(damping)?;
            Some(within(unknowns, &self.limits, &self.theta, &step))
        };
        // Most steps lower the cost: the first is evaluated at once, with its slope.
        let mut damping = self.damping;
        if let Some(theta) = moved(damping) {
            let there = problem.evaluate(&theta);
            if there.0 < cost {
                return Some(Next { theta, damping: relaxed(damping), there });
            }
        }
        loop {
            damping *= 5.0;
            if damping >= MOST_DAMPING {
                return None;
            }
            if let Some(theta) = moved(damping).filter(|theta| problem.cost(theta) < cost) {
                let there = problem.evaluate(&theta);
                return Some(Next { theta, damping: relaxed(damping), there });
            }
        }
    }
}

/// Where a step leads.
struct Next {
    theta: DVector<f64>,
    /// The damping of the step after it.
    damping: f64,
    /// Cost, gradient and information there.
    there: (f64, DVector<f64>, DMatrix<f64>),
}

/// The damping after a step that lowered the cost.
fn relaxed(damping: f64) -> f64 {
    (0.1 * damping).max(LEAST_DAMPING)
}

/// Where each number of a problem means something.
fn limits_of(problem: &Problem<'_>) -> Vec<(f64, f64)> {
    let shape = &problem.fixed.shape;
    problem.numbers().iter().map(|unknown| limits(*unknown, shape)).collect()
}

/// A first plant whose mass is off by more than this factor is none to start from.
const OTHER_MASS: f64 = 100.0;

/// No sensor shows a velocity more precisely than to this part of the usual speed, and no model
/// predicts it: what is smoother was smoothed by whoever logged it, and says nothing of the plant …
pub(crate) const VELOCITY_PRECISION: f64 = 1e-3;
/// … nor a position more precisely than to what is passed in this time, s.
pub(crate) const POSITION_PRECISION_S: f64 = 3e-4;

/// No accelerometer is better than this, m/s².
const LEAST_ACCELERATION_NOISE: f64 = 1e-5;

/// Where a number means something in a model of that shape.
pub(crate) fn limits(unknown: Unknown, shape: &Shape) -> (f64, f64) {
    let Shape { sensor, usual, .. } = *shape;
    let log = |x: f64| x.max(LEAST_NOISE).ln();
    match unknown {
        Unknown::Alpha if usual.alpha > 0.0 => (usual.alpha / OTHER_MASS, usual.alpha * OTHER_MASS),
        Unknown::Alpha => (f64::MIN_POSITIVE, f64::INFINITY),
        Unknown::LogVelocityNoise => (log(VELOCITY_PRECISION * usual.speed), 5.0),
        Unknown::LogPositionNoise => (log(POSITION_PRECISION_S * usual.speed), 5.0),
        Unknown::LogAccelerationNoise => (LEAST_ACCELERATION_NOISE.ln(), 5.0),
        // Drag brakes, and inflow takes thrust away.
        Unknown::Beta | Unknown::Mu => (f64::NEG_INFINITY, 0.0),
        Unknown::Inflow | Unknown::InflowAhead => (0.0, f64::INFINITY),
        Unknown::Lag => (0.0, 3.0),
        Unknown::LogLagRatio => (-2.5, 2.5),
        Unknown::Slew => (0.0, 10.0),
        // A log of thrust that is late looks like thrust that comes too soon. Beside a sensor that
        // lags it would only undo that lag.
        Unknown::Delay if sensor != Sensor::Prompt => (0.0, 3.0),
        Unknown::Delay => (-1.0, 3.0),
        Unknown::LogReverseRatio | Unknown::LogForwardRatio => (-1.5, 1.5),
        // Between thrust that is linear in speed and thrust that is cubic.
        Unknown::Exponent => (-1.0, 1.0),
        Unknown::VelocityScale => (-0.5, 1.0),
        // No instrument smooths for longer than two seconds.
        Unknown::LogSensorLag | Unknown::LogSensorWindow => (-4.0, 0.7),
        // Waves of 1 s to 1 min, from a swell of one period to a sea of many.
        Unknown::LogSwellFrequency => (-2.3, 1.84),
        Unknown::LogSwellDamping => (-5.0, -0.4),
        // A disturbance of an hour is a bias, and one that forgets in 0.05 s is noise.
        Unknown::LogCorrelation => (-3.0, 8.0),
        // Attitude errors take seconds to hours; what is quicker is noise.
        Unknown::LogLeakCorrelation => (1.0, 8.0),
        Unknown::LogLeak => (LEAST_ACCELERATION_NOISE.ln(), 2.0),
        Unknown::LogDisturbance | Unknown::LogSwell | Unknown::LogDrift => (LEAST_NOISE.ln(), 5.0),
        Unknown::Bias
        | Unknown::Current
        | Unknown::LeverFirst
        | Unknown::LeverSecond
        | Unknown::VelocityOffset
        | Unknown::AccelerationOffset
        | Unknown::Turning => (f64::NEG_INFINITY, f64::INFINITY),
    }
}

/// A step cut to limits, and to what a parabola can be trusted for.
fn within(
    unknowns: &[Unknown],
    limits: &[(f64, f64)],
    theta: &DVector<f64>,
    step: &DVector<f64>,
) -> DVector<f64> {
    DVector::from_fn(theta.len(), |j, _| {
        let from = theta[j];
        let (low, high) = limits[j];
        let (near, far) = match unknowns[j] {
            Unknown::Alpha => (from / 4.0, from * 4.0),
            Unknown::Current => (from - 0.2, from + 0.2),
            Unknown::LogCorrelation
            | Unknown::LogLeakCorrelation
            | Unknown::LogSensorLag
            | Unknown::LogSensorWindow => (from - 1.0, from + 1.0),
            Unknown::LogSwellFrequency => (from - 0.2, from + 0.2),
            Unknown::LogDisturbance
            | Unknown::LogSwell
            | Unknown::LogSwellDamping
            | Unknown::LogDrift
            | Unknown::LogVelocityNoise
            | Unknown::LogPositionNoise
            | Unknown::LogAccelerationNoise
            | Unknown::LogLeak => (from - 1.5, from + 1.5),
            _ => (f64::NEG_INFINITY, f64::INFINITY),
        };
        (from + step[j]).clamp(near, far).clamp(low, high)
    })
}
