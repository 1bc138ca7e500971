//! Levenberg–Marquardt on the Fisher information, within limits.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::parameters::Unknown;
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

const MOST_ITERATIONS: usize = 60;
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;
const MOST_DAMPING: f64 = 1e9;

/// A fit has converged when a step promises to lower the cost by less than this. The cost
/// is a log-likelihood, of which 2 separates a 95 % interval's end from its middle.
const CONVERGED: f64 = 1e-4;

/// A step that fails at every size still counts as converged if it promised less: what is
/// left is the rounding of thousands of terms.
const ROUNDING: f64 = 1e-2;

/// Minimises the cost from a start.
pub(crate) fn minimise(problem: &Problem<'_>, start: DVector<f64>) -> Optimum {
    let unknowns = problem.unknowns();
    let mut theta = start;
    let (mut cost, mut gradient, mut information) = problem.evaluate(&theta);
    let mut damping = FIRST_DAMPING;
    for iterations in 0..MOST_ITERATIONS {
        let free = free(&unknowns, &theta, &gradient);
        let promise = damped_step(&information, &gradient, &free, LEAST_DAMPING)
            .map_or(f64::INFINITY, |step| -gradient.dot(&step));
        let done = |converged| Optimum {
            theta: theta.clone(),
            cost,
            information: information.clone(),
            converged,
            iterations,
        };
        if promise < CONVERGED {
            return done(true);
        }
        let mut accepted = None;
        while accepted.is_none() && damping < MOST_DAMPING {
            let next = damped_step(&information, &gradient, &free, damping)
                .map(|step| within(&unknowns, &theta, &step));
            accepted = next.filter(|next| problem.cost(next) < cost);
            damping *= if accepted.is_some() { 0.1 } else { 5.0 };
        }
        let Some(next) = accepted else { return done(promise < ROUNDING) };
        damping = damping.max(LEAST_DAMPING);
        theta = next;
        (cost, gradient, information) = problem.evaluate(&theta);
    }
    Optimum { theta, cost, information, converged: false, iterations: MOST_ITERATIONS }
}

/// Which numbers may move: not those at a limit that the cost pushes them against.
fn free(unknowns: &[Unknown], theta: &DVector<f64>, gradient: &DVector<f64>) -> Vec<bool> {
    let is_free = |(j, unknown): (usize, &Unknown)| {
        let (low, high) = limits(*unknown);
        !(theta[j] <= low && gradient[j] > 0.0 || theta[j] >= high && gradient[j] < 0.0)
    };
    unknowns.iter().enumerate().map(is_free).collect()
}

fn damped_step(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    free: &[bool],
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
    let downhill = DVector::from_fn(n, |j, _| if free[j] { -gradient[j] * scale[j] } else { 0.0 });
    let step = Cholesky::new(scaled)?.solve(&downhill).component_mul(&scale);
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// Where a number means something.
fn limits(unknown: Unknown) -> (f64, f64) {
    match unknown {
        Unknown::Alpha => (f64::MIN_POSITIVE, f64::INFINITY),
        Unknown::Lag => (0.0, 3.0),
        Unknown::Delay => (-1.0, 3.0),
        Unknown::LogReverseRatio => (-1.5, 1.5),
        // A disturbance that forgets within a second is noise, one of an hour a bias.
        Unknown::LogCorrelation => (0.0, 8.0),
        Unknown::LogDisturbance | Unknown::LogVelocityNoise | Unknown::LogPositionNoise => {
            (-25.0, 5.0)
        }
        Unknown::Beta
        | Unknown::Mu
        | Unknown::Bias
        | Unknown::Current
        | Unknown::Inflow
        | Unknown::LeverFirst
        | Unknown::LeverSecond => (f64::NEG_INFINITY, f64::INFINITY),
    }
}

/// A step cut to limits, and to what a parabola can be trusted for.
fn within(unknowns: &[Unknown], theta: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(theta.len(), |j, _| {
        let from = theta[j];
        let (low, high) = limits(unknowns[j]);
        let (near, far) = match unknowns[j] {
            Unknown::Alpha => (from / 4.0, from * 4.0),
            Unknown::Current => (from - 0.2, from + 0.2),
            Unknown::LogCorrelation => (from - 1.0, from + 1.0),
            Unknown::LogDisturbance | Unknown::LogVelocityNoise | Unknown::LogPositionNoise => {
                (from - 1.5, from + 1.5)
            }
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
