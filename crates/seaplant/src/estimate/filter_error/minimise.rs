//! Levenberg–Marquardt on the Fisher information.

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

/// Minimises the cost from a start.
pub(crate) fn minimise(problem: &Problem<'_>, start: DVector<f64>) -> Optimum {
    let unknowns = problem.unknowns();
    let mut theta = start;
    let (mut cost, mut gradient, mut information) = problem.evaluate(&theta);
    let mut damping = FIRST_DAMPING;
    for iterations in 0..MOST_ITERATIONS {
        let mut improved = false;
        while damping < MOST_DAMPING {
            let Some(step) = damped_step(&information, &gradient, damping) else {
                damping *= 10.0;
                continue;
            };
            let next = bounded(&unknowns, &theta, &step);
            let promised = -gradient.dot(&(&next - &theta));
            if promised.abs() < CONVERGED && damping < 1.0 {
                return Optimum { theta, cost, information, converged: true, iterations };
            }
            let next_cost = problem.cost(&next);
            if next_cost < cost {
                theta = next;
                damping = (damping * 0.1).max(LEAST_DAMPING);
                improved = true;
                break;
            }
            damping *= 5.0;
        }
        if !improved {
            // No step helps at any size: as converged as rounding allows, if the last
            // promise was small; stuck if it was not.
            let promise = damped_step(&information, &gradient, LEAST_DAMPING)
                .map_or(f64::INFINITY, |step| -gradient.dot(&step));
            let converged = promise.abs() < 100.0 * CONVERGED;
            return Optimum { theta, cost, information, converged, iterations };
        }
        (cost, gradient, information) = problem.evaluate(&theta);
    }
    Optimum { theta, cost, information, converged: false, iterations: MOST_ITERATIONS }
}

fn damped_step(
    information: &DMatrix<f64>,
    gradient: &DVector<f64>,
    damping: f64,
) -> Option<DVector<f64>> {
    let scale = information.diagonal().map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
    let mut scaled = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
        information[(i, j)] * scale[i] * scale[j]
    });
    for j in 0..scale.len() {
        scaled[(j, j)] += damping;
    }
    let cholesky = Cholesky::new(scaled)?;
    let step = cholesky.solve(&gradient.component_mul(&scale)).component_mul(&scale);
    step.iter().all(|x| x.is_finite()).then(|| -step)
}

/// Keeps every number where it means something.
fn bounded(unknowns: &[Unknown], theta: &DVector<f64>, step: &DVector<f64>) -> DVector<f64> {
    DVector::from_fn(theta.len(), |j, _| {
        let (from, to) = (theta[j], theta[j] + step[j]);
        match unknowns[j] {
            // Mass stays positive, and changes by no more than a factor of four a step.
            Unknown::Alpha => to.clamp(from / 4.0, from * 4.0),
            Unknown::Lag => to.clamp(0.0, 3.0),
            Unknown::Delay => to.clamp(-1.0, 3.0),
            Unknown::LogReverseRatio => to.clamp(-1.5, 1.5),
            Unknown::Current => to.clamp(from - 0.2, from + 0.2),
            Unknown::LogDisturbance | Unknown::LogVelocityNoise | Unknown::LogPositionNoise => {
                to.clamp(from - 1.5, from + 1.5).clamp(-30.0, 5.0)
            }
            Unknown::LogCorrelation => to.clamp(from - 1.0, from + 1.0).clamp(-1.5, 8.0),
            Unknown::Beta | Unknown::Mu | Unknown::Bias | Unknown::Inflow => to,
        }
    })
}
