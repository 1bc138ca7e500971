//! The fit from records to plant.

use nalgebra::Matrix4;

use super::drift::DriftingNoise;
use super::intervals::{ScaledInformation, batch_s};
use super::minimise::{Optimum, Point, Problem, Reduced};
use super::sensitivity::{Residual, Weighing, Weights};
use super::stretch::{Measured, Stretch};
use super::{Loss, OutputError};
use crate::estimate::{Filters, Fit, Method, Nuisances, Records};
use crate::signal::rms;
use crate::terms::Term;
use crate::{AxisRecord, Dof, Error, LumpedParameters, Terms};

/// Returns the continuous sections of all records.
fn stretches(axes: &[AxisRecord], terms: Terms) -> Result<Vec<Stretch>, Error> {
    let mut all = Vec::new();
    for axis in axes {
        all.extend(Stretch::all_of(axis)?);
    }
    let found: usize = all.iter().map(|stretch| stretch.samples.len()).sum();
    let needed = terms.count() + 2 * all.len().max(1) + 1;
    if found < needed {
        let name = format!("the {} motion between its gaps", axes[0].dof);
        return Err(Error::TooShort { name, found, needed });
    }
    Ok(all)
}

/// Returns initial points of the search: the given plant, and two that depend only on the
/// magnitudes of thrust and motion.
fn starts(given: &LumpedParameters, terms: Terms, stretches: &[Stretch]) -> [LumpedParameters; 3] {
    // A mass of the wrong sign is useless as a start, but the scale of thrust is known.
    let alpha = given.alpha.abs().max(f64::MIN_POSITIVE);
    let of = |term, value| if terms.has(term) { value } else { 0.0 };
    let near = LumpedParameters {
        alpha,
        beta: of(Term::Quadratic, given.beta.min(0.0)),
        mu: of(Term::Linear, given.mu.min(0.0)),
        bias: of(Term::Bias, given.bias),
    };
    let steps = || stretches.iter().flat_map(|stretch| &stretch.steps);
    let force = steps().map(|step| step.tau.abs()).sum::<f64>() / steps().count().max(1) as f64;
    let balanced = |alpha: f64| {
        // Drag that balances mean thrust at the typical speed.
        let speed = typical_speed(stretches).max(f64::MIN_POSITIVE);
        let drag = -alpha * force / speed;
        let is_quadratic = terms.has(Term::Quadratic);
        LumpedParameters {
            alpha,
            beta: if is_quadratic { drag / speed } else { 0.0 },
            mu: if is_quadratic { 0.0 } else { drag },
            bias: 0.0,
        }
    };
    [near, balanced(alpha), balanced(alpha / 3.0)]
}

/// Returns the mean |v|, from differences where only position was measured.
fn typical_speed(stretches: &[Stretch]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for stretch in stretches {
        let of_kind = |measured| {
            let samples = stretch.samples.iter().filter(move |s| s.measured == measured);
            samples.map(|sample| sample.value).collect::<Vec<f64>>()
        };
        let velocity = of_kind(Measured::Velocity);
        if velocity.is_empty() {
            let position = of_kind(Measured::Position);
            let way: f64 = position.windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum();
            sum += way / stretch.period_s;
            count += position.len();
        } else {
            sum += velocity.iter().map(|v| v.abs()).sum::<f64>();
            count += velocity.len();
        }
    }
    sum / count.max(1) as f64
}

/// Maximum number of rounds of fitting plant and noise in turn.
const MOST_ROUNDS: usize = 50;

/// Minimises the cost from one start; returns the optimum and the noise with which it was found.
fn search(problem: &Problem<'_>, start: LumpedParameters, loss: Loss) -> (Optimum, Weights) {
    let starts = problem.stretches.iter().map(|stretch| stretch.start).collect();
    let start = Point { plant: start, starts };
    let has_position = problem.measures(Measured::Position);
    // The scale of a single kind of residual has no effect on the optimum.
    let mut weights = match has_position {
        true => noise(problem, &start, Loss::Squares),
        false => Weights { weighing: Weighing::Squares, std: [1.0; 2], drift: 0.0 },
    };
    let mut optimum = problem.minimise(start, &weights);
    if !has_position && loss == Loss::Squares {
        return (optimum, weights);
    }
    let mut iterations = optimum.iterations;
    for _ in 0..MOST_ROUNDS {
        let next = noise(problem, &optimum.point, loss);
        if next.is_near(&weights) {
            return (Optimum { iterations, ..optimum }, weights);
        }
        weights = next;
        optimum = problem.minimise(optimum.point, &weights);
        iterations += optimum.iterations;
    }
    (Optimum { iterations, converged: false, ..optimum }, weights)
}

/// Estimates the noise from the residuals at a point.
fn noise(problem: &Problem<'_>, point: &Point, loss: Loss) -> Weights {
    let robust = |residuals: &[f64]| match loss {
        Loss::Squares => rms(residuals),
        Loss::Huber(_) => robust_std(residuals.to_vec()),
    };
    let floor = |kind| LEAST_NOISE_PART * problem.measured_rms(kind);
    let velocity = problem.residuals(point, Measured::Velocity);
    let values: Vec<f64> = velocity.iter().flatten().map(|residual| residual.value).collect();
    let velocity_std = match values.is_empty() {
        true => 1.0,
        false => robust(&values).max(floor(Measured::Velocity)),
    };
    let position_floor = floor(Measured::Position);
    let position = problem.residuals(point, Measured::Position);
    let position_walk = position_walk(&velocity, problem.batch_s);
    let position =
        DriftingNoise::estimate(&position, position_walk, |new| robust(new).max(position_floor));
    Weights { weighing: loss.weighing(), std: [velocity_std, position.std], drift: position.walk }
}

/// Computes the variance per second that the position gains through velocity residuals.
///
/// Hundreds of velocities determine it better than a few rough depths.
fn position_walk(velocity: &[Vec<Residual>], batch_s: f64) -> f64 {
    let (mut ways, mut noise, mut total_s) = (0.0, 0.0, 0.0);
    for residuals in velocity {
        let pairs = || residuals.windows(2).map(|pair| (pair[0], pair[1]));
        let Some(last) = residuals.last() else { continue };
        total_s += last.at_s;
        // White noise has half the variance of differences between neighbours.
        noise += pairs()
            .map(|(a, b)| 0.5 * ((b.value - a.value) * (b.at_s - a.at_s)).powi(2))
            .sum::<f64>();
        let (mut way, mut until_s) = (0.0, batch_s);
        for (a, b) in pairs() {
            way += 0.5 * (a.value + b.value) * (b.at_s - a.at_s);
            if b.at_s >= until_s {
                (ways, way, until_s) = (ways + way * way, 0.0, b.at_s + batch_s);
            }
        }
        ways += way * way;
    }
    if total_s > 0.0 { (ways - noise).max(0.0) / total_s } else { 0.0 }
}

/// Computes 1.4826 times the median of the residuals' magnitudes: a robust standard deviation,
/// exact for a Gaussian distribution.
fn robust_std(mut residuals: Vec<f64>) -> f64 {
    residuals.iter_mut().for_each(|residual| *residual = residual.abs());
    let middle = residuals.len() / 2;
    let (_, median, _) = residuals.select_nth_unstable_by(middle, f64::total_cmp);
    1.4826 * *median
}

/// Lower limit of the noise as a fraction of the motion; matters for noise-free data.
const LEAST_NOISE_PART: f64 = 1e-6;

/// An optimum, with its data and noise.
pub(super) struct Solution {
    pub(super) dof: Dof,
    pub(super) stretches: Vec<Stretch>,
    pub(super) terms: Terms,
    pub(super) batch_s: f64,
    pub(super) optimum: Optimum,
    pub(super) weights: Weights,
}

impl Solution {
    pub(super) fn problem(&self) -> Problem<'_> {
        Problem { stretches: &self.stretches, terms: self.terms, batch_s: self.batch_s }
    }
}

/// Searches the optimum from several starts, in sequence.
pub(super) fn search_all(
    records: Records<'_>,
    start: &LumpedParameters,
    method: &OutputError,
) -> Result<Solution, Error> {
    method.loss.check()?;
    let (dof, terms, axes) = (records.dof()?, records.terms(), records.fit);
    let stretches = stretches(axes, terms)?;
    let batch_s = batch_s(&stretches);
    let problem = Problem { stretches: &stretches, terms, batch_s };
    let mut iterations = 0;
    for start in starts(start, terms, &stretches) {
        let (optimum, weights) = search(&problem, start, method.loss);
        if optimum.converged {
            return Ok(Solution { dof, stretches, terms, batch_s, optimum, weights });
        }
        iterations += optimum.iterations;
    }
    Err(Error::NotConverged { dof, iterations })
}

pub(super) fn into_fit(solution: &Solution, method: &OutputError) -> Result<Fit, Error> {
    let (dof, problem, weights) = (solution.dof, solution.problem(), &solution.weights);
    let Optimum { point, at, .. } = &solution.optimum;
    // Intervals need the second derivative of the cost, which the search has already computed for
    // squares.
    let curved = match method.loss {
        Loss::Squares => None,
        Loss::Huber(limit) => {
            let weighing = Weighing::HuberCurvature(limit);
            Some(problem.evaluate(point, &Weights { weighing, ..*weights }))
        }
    };
    let at = curved.as_ref().unwrap_or(at);
    let reduced = Reduced::of(&at.totals, 0.0);
    let information = ScaledInformation::of(dof, &reduced, problem.terms)?;
    let (covariance, t_freedom) = information.influences(&reduced, at).covariance();
    // The statistic is of velocity residuals, or of position residuals if only position was
    // measured.
    let of_kind = |measured| {
        let squares: f64 = at.totals.iter().map(|sums| sums.squares[measured as usize]).sum();
        let count_of = problem.stretches.iter().map(|stretch| stretch.squares(measured).1);
        (squares * weights.std_of(measured).powi(2), count_of.sum::<usize>())
    };
    let measured =
        if problem.measures(Measured::Velocity) { Measured::Velocity } else { Measured::Position };
    let (squares, of_samples) = of_kind(measured);
    Ok(Fit {
        dof,
        method: Method::OutputError,
        terms: problem.terms,
        lumped: point.plant,
        covariance: information.unscaled(&covariance),
        thrust_covariance: Matrix4::zeros(),
        t_freedom,
        condition: information.condition,
        inflation: information.inflation(),
        samples: problem.samples(),
        effective_samples: effective_samples(solution),
        residual_rms: (squares / of_samples as f64).sqrt(),
        filters: Filters::default(),
        nuisances: Nuisances::default(),
        structure: Vec::new(),
        steady_test: None,
        innovations: Vec::new(),
        history: None,
        caveats: Vec::new(),
        start: None,
    })
}

/// Computes n σ² / (samples per batch · variance of batch means), at most n.
pub(super) fn effective_samples(solution: &Solution) -> f64 {
    let sums = || solution.optimum.at.batches.iter().flatten();
    let long_run: f64 = sums().map(|sums| sums.influence.powi(2)).sum();
    let squares: f64 = sums().map(|sums| sums.influence_squares).sum();
    let n = solution.problem().samples() as f64;
    if long_run > 0.0 { (n * squares / long_run).min(n) } else { n }
}
