//! The circular block bootstrap of a regression.

use std::ops::RangeInclusive;

use nalgebra::{DMatrix, DVector, Matrix4, Vector4};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::triangle::{Triangle, V_DOT};
use super::{BATCHES, EXCITATION_FLOOR, LeastSquares, Reduced, Regression, Residuals};
use crate::{Dof, Error, Terms};

/// Where a regression's intervals come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Intervals {
    /// From how the residuals' sums differ from batch to batch of 20 s.
    #[default]
    BatchMeans,
    /// From fits to blocks of the record, drawn at random.
    BlockBootstrap,
}

/// How blocks are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct BlockBootstrap {
    /// How many records to draw; 100 to a million.
    pub resamples: usize,
    /// Where its random numbers start.
    pub seed: u64,
    /// How long a block is, s; at least 1, a tenth of the record if that is less.
    pub block_s: f64,
}

impl Default for BlockBootstrap {
    fn default() -> Self {
        Self { resamples: 2000, seed: 1, block_s: super::BATCH_S }
    }
}

/// Possible starts of a block, per length of a block.
const PARTS: usize = 4;

/// Fewer resamples do not determine a standard deviation to a tenth; the record limits the
/// precision of more.
const RESAMPLES: RangeInclusive<usize> = 100..=1_000_000;

/// The filters alone correlate residuals over this time, s.
const LEAST_BLOCK_S: f64 = 1.0;

/// A day: no record holds several longer blocks, s.
const LONGEST_BLOCK_S: f64 = 86_400.0;

/// The result of the fits to drawn blocks.
pub(crate) struct Resampled {
    pub(crate) found: LeastSquares,
    /// Discarded draws in which the terms were collinear.
    pub(crate) discarded: usize,
    /// Correlation of neighbouring quarters of blocks, if significant.
    pub(crate) block_correlation: Option<f64>,
}

/// Threshold of significance of that correlation, in standard deviations.
const BEYOND_CHANCE: f64 = 3.0;

impl BlockBootstrap {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Setting`] for too few or many resamples, or too short blocks.
    pub fn check(&self) -> Result<(), Error> {
        let Self { resamples, block_s, .. } = *self;
        if !RESAMPLES.contains(&resamples) {
            let expected = format!("from {} to {}", RESAMPLES.start(), RESAMPLES.end());
            return Err(Error::setting("resamples", resamples, expected));
        }
        if !(LEAST_BLOCK_S..=LONGEST_BLOCK_S).contains(&block_s) {
            let expected = format!("from {LEAST_BLOCK_S} to {LONGEST_BLOCK_S} s");
            return Err(Error::setting("block_s", block_s, expected));
        }
        Ok(())
    }

    /// Creates an empty regression whose batches are the quarters of blocks.
    ///
    /// # Errors
    /// [`Error::Bootstrap`] for too few or many resamples, or too short blocks.
    pub(crate) fn regression(&self, total_s: f64, terms: Terms) -> Result<Regression, Error> {
        let Self { resamples, block_s, .. } = *self;
        let is_long = block_s >= LEAST_BLOCK_S && block_s.is_finite();
        if !RESAMPLES.contains(&resamples) || !is_long {
            return Err(Error::Bootstrap { resamples, block_s });
        }
        let block_s = block_s.min(total_s / BATCHES.0 as f64);
        Ok(Regression::in_batches(block_s / PARTS as f64, terms))
    }
}

impl Regression {
    /// Solves with the covariance of the estimate over records assembled from blocks of this one,
    /// drawn with replacement.
    ///
    /// The rows of a block stay together, and so does the correlation of their residuals. A draw
    /// needs only `G = Σ FᵀF` and `s = Σ Fᵀe` of its blocks, and changes the estimate by `G⁻¹ s`.
    /// The covariance is that of the draws, times B/(B − p) for B blocks in the record and p terms.
    ///
    /// # Errors
    /// As [`least_squares`](super::least_squares); [`Error::NotExciting`] too if the terms are
    /// collinear in most draws.
    ///
    /// # Source
    /// Circular blocks: \[Politis1992\]; regression by pairs in blocks: \[Lahiri2003\].
    pub(crate) fn solve_by_blocks(
        self,
        dof: Dof,
        bootstrap: &BlockBootstrap,
    ) -> Result<Resampled, Error> {
        let rows = self.reduce(dof)?;
        let factored = rows.factored()?;
        let coefficients = factored.solve(&rows.whole.column(V_DOT));
        let parts = rows.residuals(&coefficients);
        let draws = Circle::new(&rows, &parts).draws(bootstrap);
        let terms = rows.fitted.len();
        if 2 * draws.len() < bootstrap.resamples {
            return Err(Error::NotExciting { dof, rank: terms - 1, needed: terms });
        }
        let residuals = parts.joined(PARTS);
        let inflate = residuals.scores.len() as f64 / residuals.freedom(terms);
        let covariance = covariance(&draws, terms) * inflate;
        let found = rows.found(&factored, &coefficients, &residuals, &covariance);
        let chance = BEYOND_CHANCE / (parts.sums.len() as f64).sqrt();
        let block_correlation =
            Some(parts.correlation_of_neighbours()).filter(|found| *found > chance);
        Ok(Resampled { found, discarded: bootstrap.resamples - draws.len(), block_correlation })
    }
}

/// FᵀF and Fᵀe of a set of rows, scaled columns.
#[derive(Clone, Copy)]
struct Sums {
    gram: Matrix4<f64>,
    score: Vector4<f64>,
}

impl Sums {
    fn new(rows: &Reduced, triangle: &Triangle, score: &DVector<f64>) -> Self {
        let terms = score.len();
        let gram = |i: usize, j: usize| match i.max(j) < terms {
            true => rows.column(triangle, i).dot(&rows.column(triangle, j)),
            false => 0.0,
        };
        let score = |i: usize, _| score.get(i).copied().unwrap_or(0.0);
        Self { gram: Matrix4::from_fn(gram), score: Vector4::from_fn(score) }
    }

    fn zero() -> Self {
        Self { gram: Matrix4::zeros(), score: Vector4::zeros() }
    }

    /// Adds the difference of two running sums.
    fn add_between(&mut self, from: &Self, to: &Self) {
        self.gram += to.gram - from.gram;
        self.score += to.score - from.score;
    }
}

/// A record closed to a circle, so that a block may begin at any of its parts.
struct Circle {
    /// Running sums over the parts, twice around the circle.
    up_to: Vec<Sums>,
    parts: usize,
    terms: usize,
}

impl Circle {
    fn new(rows: &Reduced, residuals: &Residuals) -> Self {
        let each = rows.batches.iter().zip(&residuals.scores);
        let each: Vec<Sums> =
            each.map(|(batch, score)| Sums::new(rows, &batch.triangle, score)).collect();
        let mut up_to = vec![Sums::zero()];
        for part in each.iter().chain(&each) {
            let mut sums = up_to[up_to.len() - 1];
            sums.add_between(&Sums::zero(), part);
            up_to.push(sums);
        }
        Self { up_to, parts: each.len(), terms: rows.fitted.len() }
    }

    /// Returns the change of the scaled estimate in each drawn record.
    fn draws(&self, bootstrap: &BlockBootstrap) -> Vec<Vector4<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(bootstrap.seed);
        (0..bootstrap.resamples).filter_map(|_| self.draw(&mut rng)).collect()
    }

    /// Draws blocks with as many parts as the record; the last may be shorter.
    fn draw(&self, rng: &mut ChaCha8Rng) -> Option<Vector4<f64>> {
        let mut drawn = Sums::zero();
        for from in (0..self.parts).step_by(PARTS) {
            let length = PARTS.min(self.parts - from);
            let start = rng.random_range(0..self.parts);
            drawn.add_between(&self.up_to[start], &self.up_to[start + length]);
        }
        (self.terms..4).for_each(|j| drawn.gram[(j, j)] = 1.0);
        if !drawn.gram.iter().all(|x| x.is_finite()) {
            return None;
        }
        // Columns have unit length: an eigenvalue below this is rounding.
        let weakest = drawn.gram.symmetric_eigenvalues().min();
        let is_exciting = weakest > EXCITATION_FLOOR.powi(2);
        is_exciting.then(|| drawn.gram.cholesky().map(|root| root.solve(&drawn.score))).flatten()
    }
}

/// Returns the covariance of the first `terms` components of the draws.
fn covariance(draws: &[Vector4<f64>], terms: usize) -> DMatrix<f64> {
    let n = draws.len() as f64;
    let mean = draws.iter().sum::<Vector4<f64>>() / n;
    let mut squares = Matrix4::zeros();
    for draw in draws {
        squares += (draw - mean) * (draw - mean).transpose();
    }
    DMatrix::from_fn(terms, terms, |i, j| squares[(i, j)] / (n - 1.0))
}
