//! From records to a fitted plant.

use nalgebra::Matrix4;

use super::drift::DriftingNoise;
use super::intervals::{Bread, batch_s};
use super::minimise::{Optimum, Point, Problem, Reduced};
use super::sensitivity::{Count, Residual, Weighing};
use super::stretch::{Measured, Stretch};
use super::{Loss, OutputError};
use crate::estimate::{Filters, Fit, Method, Nuisances, Records};
use crate::signal::rms;
use crate::terms::Term;
use crate::{AxisRecord, Dof, Error, LumpedParameters, Terms};

/// The stretches of all records.
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

/// Where a search begins: at the given plant, then at two that know only how strong
/// thrust and motion are.
fn starts(given: &LumpedParameters, terms: Terms, stretches: &[Stretch]) -> [LumpedParameters; 3] {
    // A wrong-signed mass is no place to start from; the scale of thrust is.
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
        // Drag that holds thrust at a speed of which typical motion is a part.
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

/// Mean |v|, from differences where position alone was measured.
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

/// The noise and the weights settle together in fewer rounds than this.
const MOST_ROUNDS: usize = 50;

/// Minimises from one start; with the count under which the optimum is one.
fn search(problem: &Problem<'_>, start: LumpedParameters, loss: Loss) -> (Optimum, Count) {
    let starts = problem.stretches.iter().map(|stretch| stretch.start).collect();
    let start = Point { plant: start, starts };
    let has_position = problem.measures(Measured::Position);
    // How far squares of one kind are counted is all the same.
    let mut count = match has_position {
        true => noise(problem, &start, Loss::Squares),
        false => Count { weighing: Weighing::Squares, std: [1.0; 2], drift: 0.0 },
    };
    let mut optimum = problem.minimise(start, &count);
    if !has_position && loss == Loss::Squares {
        return (optimum, count);
    }
    let mut iterations = optimum.iterations;
    for _ in 0..MOST_ROUNDS {
        let next = noise(problem, &optimum.point, loss);
        if next.is_like(&count) {
            return (Optimum { iterations, ..optimum }, count);
        }
        count = next;
        optimum = problem.minimise(optimum.point, &count);
        iterations += optimum.iterations;
    }
    (Optimum { iterations, converged: false, ..optimum }, count)
}

/// How residuals count, judged by themselves.
fn noise(problem: &Problem<'_>, point: &Point, loss: Loss) -> Count {
    let robust = |residuals: &[f64]| match loss {
        Loss::Squares => rms(residuals),
        Loss::Huber(_) => robust_std(residuals.to_vec()),
    };
    let surest = |kind| SUREST_PART * problem.measured_rms(kind);
    let velocity = problem.residuals(point, Measured::Velocity);
    let values: Vec<f64> = velocity.iter().flatten().map(|residual| residual.value).collect();
    let velocity_std = match values.is_empty() {
        true => 1.0,
        false => robust(&values).max(surest(Measured::Velocity)),
    };
    let surest_position = surest(Measured::Position);
    let position = problem.residuals(point, Measured::Position);
    let wander = wander(&velocity, problem.batch_s);
    let position = DriftingNoise::of(&position, wander, |new| robust(new).max(surest_position));
    Count { weighing: loss.weighing(), std: [velocity_std, position.std], drift: position.walk }
}

/// By how much the vehicle, as residuals of velocity have it, wanders off its simulated
/// position: variance a second.
///
/// Hundreds of velocities tell it better than a few rough depths.
fn wander(velocity: &[Vec<Residual>], batch_s: f64) -> f64 {
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

/// 1.4826 times the median size of the residuals: their standard deviation if they are
/// Gaussian, whatever a few are.
fn robust_std(mut residuals: Vec<f64>) -> f64 {
    residuals.iter_mut().for_each(|residual| *residual = residual.abs());
    let middle = residuals.len() / 2;
    let (_, median, _) = residuals.select_nth_unstable_by(middle, f64::total_cmp);
    1.4826 * *median
}

/// No simulation is surer than this part of the motion; it would matter without noise.
const SUREST_PART: f64 = 1e-6;

/// An optimum, and what it is one of.
pub(super) struct Found {
    pub(super) dof: Dof,
    pub(super) stretches: Vec<Stretch>,
    pub(super) terms: Terms,
    pub(super) batch_s: f64,
    pub(super) optimum: Optimum,
    pub(super) count: Count,
}

impl Found {
    pub(super) fn problem(&self) -> Problem<'_> {
        Problem { stretches: &self.stretches, terms: self.terms, batch_s: self.batch_s }
    }
}

/// Searches from one start after another.
pub(super) fn found(
    records: Records<'_>,
    start: &LumpedParameters,
    method: &OutputError,
) -> Result<Found, Error> {
    method.loss.check()?;
    let (dof, terms, axes) = (records.dof()?, records.terms(), records.fit);
    let stretches = stretches(axes, terms)?;
    let batch_s = batch_s(&stretches);
    let problem = Problem { stretches: &stretches, terms, batch_s };
    let mut iterations = 0;
    for start in starts(start, terms, &stretches) {
        let (optimum, count) = search(&problem, start, method.loss);
        if optimum.converged {
            return Ok(Found { dof, stretches, terms, batch_s, optimum, count });
        }
        iterations += optimum.iterations;
    }
    Err(Error::NotConverged { dof, iterations })
}

pub(super) fn into_fit(found: &Found, method: &OutputError) -> Result<Fit, Error> {
    let (dof, problem, count) = (found.dof, found.problem(), &found.count);
    let Optimum { point, at, .. } = &found.optimum;
    // Intervals want the curvature of the cost, which for squares the search had already.
    let curved = match method.loss {
        Loss::Squares => None,
        Loss::Huber(limit) => {
            let weighing = Weighing::HuberCurvature(limit);
            Some(problem.evaluate(point, &Count { weighing, ..*count }))
        }
    };
    let at = curved.as_ref().unwrap_or(at);
    let reduced = Reduced::of(&at.totals, 0.0);
    let bread = Bread::of(dof, &reduced, problem.terms)?;
    let (covariance, t_freedom) = bread.influences(&reduced, at).covariance();
    // Velocity is what both kinds are about; without it, position.
    let of_kind = |measured| {
        let squares: f64 = at.totals.iter().map(|sums| sums.squares[measured as usize]).sum();
        let count_of = problem.stretches.iter().map(|stretch| stretch.squares(measured).1);
        (squares * count.std_of(measured).powi(2), count_of.sum::<usize>())
    };
    let measured =
        if problem.measures(Measured::Velocity) { Measured::Velocity } else { Measured::Position };
    let (squares, of_samples) = of_kind(measured);
    Ok(Fit {
        dof,
        method: Method::OutputError,
        terms: problem.terms,
        lumped: point.plant,
        covariance: bread.unscaled(&covariance),
        thrust_covariance: Matrix4::zeros(),
        t_freedom,
        condition: bread.condition,
        inflation: bread.inflation(),
        samples: problem.samples(),
        effective_samples: effective_samples(found),
        residual_rms: (squares / of_samples as f64).sqrt(),
        filters: Filters::default(),
        nuisances: Nuisances::default(),
        structure: Vec::new(),
        steady_test: None,
        innovations: Vec::new(),
        history: None,
        caveats: Vec::new(),
        optimum: None,
    })
}

/// n σ² / (samples a batch · variance of batch means), never more than n.
pub(super) fn effective_samples(found: &Found) -> f64 {
    let sums = || found.optimum.at.batches.iter().flatten();
    let long_run: f64 = sums().map(|sums| sums.influence.powi(2)).sum();
    let squares: f64 = sums().map(|sums| sums.influence_squares).sum();
    let n = found.problem().samples() as f64;
    if long_run > 0.0 { (n * squares / long_run).min(n) } else { n }
}
