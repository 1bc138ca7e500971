//! Levenberg–Marquardt on the Fisher information, within limits.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::parameters::{Sensor, Shape, Unknown};
use super::problem::Problem;

/// Where a fit ended.
#[derive(Clone, Debug)]
pub(crate) struct Optimum {
    pub(crate) theta: DVector<f64>,
    pub(crate) cost: f64,
    pub(crate) information: DMatrix<f64>,
    pub(crate) converged: bool,
    pub(crate) iterations: usize,
}

/// A fit that takes more has lost its way.
pub(crate) const MOST_ITERATIONS: usize = 60;
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;
const MOST_DAMPING: f64 = 1e9;

/// A fit has converged when a step promises to lower the cost by less than this. The cost
/// is a log-likelihood: this far from its minimum every number is within 6 % of its own
/// standard deviation.
const CONVERGED: f64 = 2e-3;

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

/// Minimises the cost from a start, in so many iterations at most.
///
/// Logged thrust jumps, so the cost has a kink in the delay wherever a jump meets the end
/// of a step. Where descent ends at one, the delay stays there and the rest goes on.
pub(crate) fn minimise(
    problem: &Problem<'_>,
    start: DVector<f64>,
    most_iterations: usize,
) -> Optimum {
    let unknowns = problem.numbers();
    let limits = limits_of(problem);
    let (damping, at_kink, poor) = (FIRST_DAMPING, false, 0);
    let mut descent = Descent { theta: start, limits, damping, at_kink, poor };
    let mut here = problem.evaluate(&descent.theta);
    for iterations in 0..most_iterations {
        let free = descent.free(unknowns, &here.1);
        let step = damped_step(&here.2, &here.1, &descent.room(), &free, LEAST_DAMPING);
        let promise = step.map_or(f64::INFINITY, |step| promise(&here.2, &here.1, &step));
        let moved = promise >= CONVERGED && descent.step(problem, unknowns, &here, &free);
        if !moved {
            let converged = promise < ROUNDING;
            let has_kink = !descent.at_kink && unknowns.contains(&Unknown::Delay);
            if !converged && has_kink {
                descent.leave_at_kink();
                continue;
            }
            let (cost, _, information) = here;
            return Optimum { theta: descent.theta, cost, information, converged, iterations };
        }
        let before = here.0;
        here = problem.evaluate(&descent.theta);
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
    let (theta, iterations) = (descent.theta, most_iterations);
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

    fn free(&self, unknowns: &[Unknown], gradient: &DVector<f64>) -> Vec<bool> {
        let mut free = free(&self.limits, &self.theta, gradient);
        for (free, unknown) in free.iter_mut().zip(unknowns) {
            *free &= !(self.at_kink && *unknown == Unknown::Delay);
        }
        free
    }

    /// How far down and up each number may go.
    fn room(&self) -> Vec<(f64, f64)> {
        let of = |((low, high), at): (&(f64, f64), &f64)| (low - at, high - at);
        self.limits.iter().zip(self.theta.iter()).map(of).collect()
    }

    /// Takes the longest step that lowers the cost; whether there was one.
    fn step(
        &mut self,
        problem: &Problem<'_>,
        unknowns: &[Unknown],
        (cost, gradient, information): &(f64, DVector<f64>, DMatrix<f64>),
        free: &[bool],
    ) -> bool {
        while self.damping < MOST_DAMPING {
            let room = self.room();
            let next = damped_step(information, gradient, &room, free, self.damping)
                .map(|step| within(unknowns, &self.limits, &self.theta, &step))
                .filter(|next| problem.cost(next) < *cost);
            if let Some(next) = next {
                self.theta = next;
                self.damping = (0.1 * self.damping).max(LEAST_DAMPING);
                return true;
            }
            self.damping *= 5.0;
        }
        false
    }
}

/// Which numbers may move: not those at a limit that the cost pushes them against.
fn free(limits: &[(f64, f64)], theta: &DVector<f64>, gradient: &DVector<f64>) -> Vec<bool> {
    let is_free = |(j, (low, high)): (usize, &(f64, f64))| {
        !(theta[j] <= *low && gradient[j] > 0.0 || theta[j] >= *high && gradient[j] < 0.0)
    };
    limits.iter().enumerate().map(is_free).collect()
}

/// The damped step of Gauss and Newton. A number that would leave its limits goes to the
/// limit, and the others to where they suit it best.
fn damped_step(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    room: &[(f64, f64)],
    free: &[bool],
    damping: f64,
) -> Option<DVector<f64>> {
    let n = gradient.len();
    let mut free = free.to_vec();
    let mut fixed = DVector::zeros(n);
    for _ in 0..=n {
        let step = partial_step(information, gradient, &free, &fixed, damping)?;
        let leaves = |j: &usize| free[*j] && (step[*j] < room[*j].0 || step[*j] > room[*j].1);
        let Some(j) = (0..n).find(leaves) else { return Some(step) };
        free[j] = false;
        fixed[j] = step[j].clamp(room[j].0, room[j].1);
    }
    None
}

/// The step of the free numbers beside given steps of the others.
fn partial_step(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    free: &[bool],
    fixed: &DVector<f64>,
    damping: f64,
) -> Option<DVector<f64>> {
    let n = gradient.len();
    let scale = information.diagonal().map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
    let scaled = DMatrix::from_fn(n, n, |i, j| match (i == j, free[i] && free[j]) {
        (true, true) => 1.0 + damping,
        (true, false) => 1.0,
        (false, true) => information[(i, j)] * scale[i] * scale[j],
        (false, false) => 0.0,
    });
    let pull = gradient + information * fixed;
    let downhill = DVector::from_fn(n, |j, _| if free[j] { -pull[j] * scale[j] } else { 0.0 });
    let step = Cholesky::new(scaled)?.solve(&downhill).component_mul(&scale) + fixed;
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// Twice what a step would lower the cost by, if it were a parabola.
fn promise(information: &DMatrix<f64>, gradient: &DVector<f64>, step: &DVector<f64>) -> f64 {
    -2.0 * gradient.dot(step) - step.dot(&(information * step))
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

/// Brings a matrix to a unit diagonal: α and ln T differ by many magnitudes.
pub(crate) fn unit_diagonal(information: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_diagonal(&information.diagonal().map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt()))
}

/// The covariance that an information matrix leaves; `None` if some number is not seen.
pub(crate) fn scaled_inverse(information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let scale = unit_diagonal(information);
    let inverse = (&scale * information * &scale).cholesky()?.inverse();
    Some(&scale * inverse * &scale)
}
