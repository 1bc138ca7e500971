//! Bootstrap of the output error method: refits to resampled measurements.

use nalgebra::Matrix4;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::OutputError;
use super::drift::WalkFilter;
use super::fit::{Solution, effective_samples, into_fit, search_all};
use super::intervals::{LEAST_FREEDOM, autocorrelation};
use super::minimise::{Point, Problem};
use super::sensitivity::{Residual, Weights, residuals};
use super::stretch::{Measured, Sample, Stretch};
use crate::estimate::{Fit, Records};
use crate::{Error, LumpedParameters, Terms};

/// Minimum number of draws for a covariance.
pub(super) const LEAST_DRAWS: usize = 50;

/// Minimum number of blocks in which a record is drawn.
const LEAST_BLOCKS: f64 = 8.0;

/// Refits a plant to measurements resampled from its own fit: simulated motion plus residuals from
/// other times, drawn in blocks.
///
/// The length of the blocks follows from the autocorrelation of the residuals. If the position
/// residuals contain a random walk, its innovations are drawn and the walk is rebuilt from them.
/// Residuals are enlarged by `√(n/(n − p))` for n effective samples and p terms, to make up for the
/// fit.
///
/// Equal seeds and numbers give equal draws, in any order or thread.
///
/// # Source
/// \[Kunsch1989\]: blocks; \[Politis1992\]: circular extension.
///
/// # Example
/// ```
/// use seaplant::estimate::{OutputError, OutputErrorBootstrap};
/// use seaplant::{AxisRecord, Dof, LumpedParameters, Motion, State, Timed, simulate};
/// let near = LumpedParameters { alpha: 0.01, beta: -0.5, ..Default::default() };
/// let times: Vec<f64> = (0..600).map(|k| 0.1 * f64::from(k)).collect();
/// let thrust: Vec<f64> = times.iter().map(|t| 150.0 * (0.8 * t).sin()).collect();
/// let force = Timed::new("thrust", times.clone(), thrust)?;
/// let moved = simulate(Dof::Surge, &near, &force, State::default(), &times)?.velocity;
/// let tone = moved.iter().zip(&times).map(|(v, t)| v + 0.01 * (7.0 * t * t).sin());
/// let motion = Motion::Velocity(force.with_values("velocity", tone.collect())?);
/// let axis = AxisRecord {
///     dof: Dof::Surge,
///     trial: "surge 1".to_owned(),
///     motion,
///     force,
///     thrusters: Vec::new(),
///     lever_rates: None,
///     turning: None,
///     position: None,
///     acceleration: None,
///     cuts: Vec::new(),
/// };
/// let (fit, bootstrap) = OutputErrorBootstrap::of(&[axis], &near, &OutputError::default())?;
/// let draws: Vec<_> = (0..100).filter_map(|number| bootstrap.draw(7, number)).collect();
/// let again = bootstrap.fit_with(&fit, &draws)?;
/// assert!(again.covariance[(0, 0)] > 0.0 && again.lumped == fit.lumped);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct OutputErrorBootstrap {
    terms: Terms,
    point: Point,
    weights: Weights,
    records: Vec<Simulated>,
    total_s: f64,
    blocks: f64,
}

/// A section with simulated in place of measured motion, and its residuals.
#[derive(Clone, Debug)]
struct Simulated {
    stretch: Stretch,
    /// Times of the samples since the start, s.
    at_s: Vec<f64>,
    /// Innovations of the residuals of velocity and of position, in standard deviations.
    new: [Vec<f64>; 2],
}

impl OutputErrorBootstrap {
    /// Fits the plant as [`OutputError::fit_from`] does, with
    /// [`OutputErrorIntervals::Sandwich`](super::OutputErrorIntervals), and returns the bootstrap
    /// with the fit.
    ///
    /// # Errors
    /// As [`OutputError::fit`].
    pub fn of<'a>(
        records: impl Into<Records<'a>>,
        start: &LumpedParameters,
        method: &OutputError,
    ) -> Result<(Fit, Self), Error> {
        let solution = search_all(records.into(), start, method)?;
        let fit = into_fit(&solution, method)?;
        let bootstrap = Self::around(&solution)?;
        Ok((fit, bootstrap))
    }

    pub(super) fn around(solution: &Solution) -> Result<Self, Error> {
        let Solution { stretches, terms, batch_s, optimum, weights, .. } = solution;
        let point = optimum.point.clone();
        let r = autocorrelation(solution)?;
        let total_s: f64 = stretches.iter().map(Stretch::duration_s).sum();
        let block_s = batch_s * (1.0 + r) / (1.0 - r);
        let blocks = (total_s / block_s).max(LEAST_BLOCKS);
        let (n, p) = (effective_samples(solution).max(LEAST_BLOCKS), terms.count() as f64);
        let enlarged = (n / (n - p)).sqrt();
        let each = stretches.iter().zip(&point.starts);
        let records = each
            .map(|(stretch, &start)| {
                let residuals = residuals(stretch, &point.plant, start);
                Simulated::of(stretch, &residuals, weights, enlarged)
            })
            .collect();
        Ok(Self { terms: *terms, point, weights: *weights, records, total_s, blocks })
    }

    /// Computes the optimum of one draw; `None` if the search does not converge.
    pub fn draw(&self, seed: u64, number: u64) -> Option<LumpedParameters> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(number);
        let per_s = self.blocks / self.total_s;
        let drawn = |record: &Simulated| record.draw(per_s, &self.weights, &mut random);
        let stretches: Vec<Stretch> = self.records.iter().map(drawn).collect();
        let problem = Problem { stretches: &stretches, terms: self.terms, batch_s: self.total_s };
        let optimum = problem.minimise(self.point.clone(), &self.weights);
        optimum.converged.then_some(optimum.point.plant)
    }

    /// Returns the fit with the covariance of some draws.
    ///
    /// # Errors
    /// [`Error::FewDraws`] for fewer than fifty.
    pub fn fit_with(&self, fit: &Fit, draws: &[LumpedParameters]) -> Result<Fit, Error> {
        if draws.len() < LEAST_DRAWS {
            return Err(Error::FewDraws { found: draws.len(), needed: LEAST_DRAWS });
        }
        let n = draws.len() as f64;
        let draws = || draws.iter().map(|draw| draw.to_vector());
        let mean = draws().sum::<nalgebra::Vector4<f64>>() / n;
        let square = |draw: nalgebra::Vector4<f64>| (draw - mean) * (draw - mean).transpose();
        let covariance = draws().map(square).sum::<Matrix4<f64>>() / (n - 1.0);
        let t_freedom = (self.blocks - self.terms.count() as f64).max(LEAST_FREEDOM);
        Ok(Fit { covariance, t_freedom, ..fit.clone() })
    }
}

impl Simulated {
    fn of(stretch: &Stretch, residuals: &[Residual], weights: &Weights, enlarged: f64) -> Self {
        let mut stretch = stretch.clone();
        let mut new = [Vec::new(), Vec::new()];
        let mut drift = WalkFilter::<0>::new(weights.drift);
        let mut before_s = 0.0;
        for (sample, residual) in stretch.samples.iter_mut().zip(residuals) {
            sample.value -= residual.value;
            let own = residual.value / weights.std_of(residual.measured);
            drift.wait(residual.at_s - before_s);
            before_s = residual.at_s;
            let own = match residual.measured {
                Measured::Velocity => own,
                Measured::Position => drift.take(own, &[]).0,
            };
            new[residual.measured as usize].push(enlarged * own);
        }
        Self { stretch, at_s: residuals.iter().map(|residual| residual.at_s).collect(), new }
    }

    fn draw(&self, blocks_per_s: f64, weights: &Weights, random: &mut ChaCha8Rng) -> Stretch {
        let blocks = ((blocks_per_s * self.stretch.duration_s()).round() as usize).max(1);
        // Residuals of velocity and position are drawn from the same times, which preserves their
        // correlation.
        let from: Vec<f64> = (0..blocks).map(|_| random.random()).collect();
        let mut pick = [0, 1].map(|kind: usize| Pick::new(&self.new[kind], &from));
        let mut drift = WalkFilter::<0>::new(weights.drift);
        let mut before_s = 0.0;
        let mut add = |(sample, &at_s): (&Sample, &f64)| {
            let new = pick[sample.measured as usize].next();
            drift.wait(at_s - before_s);
            before_s = at_s;
            let residual = match sample.measured {
                Measured::Velocity => new,
                Measured::Position => drift.restore(new),
            };
            Sample { value: sample.value + weights.std_of(sample.measured) * residual, ..*sample }
        };
        let samples = self.stretch.samples.iter().zip(&self.at_s).map(&mut add).collect();
        Stretch { samples, steps: self.stretch.steps.clone(), ..self.stretch }
    }
}

/// Iterator over a circular series in blocks that start at given fractions of its length.
struct Pick<'a> {
    series: &'a [f64],
    from: &'a [f64],
    done: usize,
    at: usize,
    next_block: usize,
}

impl<'a> Pick<'a> {
    fn new(series: &'a [f64], from: &'a [f64]) -> Self {
        Self { series, from, done: 0, at: 0, next_block: 0 }
    }

    fn next(&mut self) -> f64 {
        let n = self.series.len();
        if self.done * self.from.len() >= self.next_block * n && self.next_block < self.from.len() {
            self.at = (self.from[self.next_block] * n as f64) as usize % n;
            self.next_block += 1;
        }
        let value = self.series[self.at];
        self.at = if self.at + 1 == n { 0 } else { self.at + 1 };
        self.done += 1;
        value
    }
}
