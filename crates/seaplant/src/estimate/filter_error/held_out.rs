//! What held-out trials say of a candidate.

use nalgebra::DVector;

use super::kalman::Innovation;
use super::minimise::{Effort, minimise};
use super::problem::Record;
use super::search::Fitted;

/// What a candidate gains on held-out trials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct HeldOut {
    /// In bounded log-likelihood.
    pub(crate) gain: f64,
    /// Its scatter: the standard deviation that the differences of blocks give it.
    pub(crate) scatter: f64,
}

/// A loss smaller than this speaks against nothing: what is fitted to one trial misses another
/// by its own uncertainty.
const SLACK: f64 = 2.0;

/// A loss within this many standard deviations is chance.
const CHANCE: f64 = 2.0;

/// Each held-out trial is cut into so many blocks, long beside what errors remember.
const BLOCKS: usize = 10;

/// Degrees of freedom of Student's t, which bounds what a spike or a gap can say.
const FREEDOM: f64 = 4.0;

impl HeldOut {
    /// Of the larger model over the smaller, with everything held but what each trial has by
    /// itself, its currents and offsets, and its noise: the noise of another day is no fault
    /// of a plant.
    ///
    /// One step ahead, and not by the error of a simulation: under a current the true
    /// parameters simulate worse than wrong ones.
    pub(crate) fn of(with: &Fitted<'_>, without: &Fitted<'_>, others: &[Record]) -> Self {
        let blocks: Vec<f64> = others
            .iter()
            .flat_map(|record| {
                let (with, without) = (losses(with, record), losses(without, record));
                let gains: Vec<f64> = without.iter().zip(&with).map(|(b, a)| b - a).collect();
                let length = gains.len().div_ceil(BLOCKS).max(1);
                gains.chunks(length).map(|block| block.iter().sum()).collect::<Vec<f64>>()
            })
            .collect();
        let (n, gain) = (blocks.len() as f64, blocks.iter().sum::<f64>());
        let spread: f64 = blocks.iter().map(|block| (block - gain / n).powi(2)).sum();
        Self { gain, scatter: (spread * n / (n - 1.0).max(1.0)).sqrt() }
    }

    /// Whether it loses by more than chance.
    pub(crate) fn speaks_against(&self) -> bool {
        self.gain.is_nan() || self.gain <= -SLACK - CHANCE * self.scatter
    }
}

/// What each measurement of another trial costs a model.
fn losses(fit: &Fitted<'_>, other: &Record) -> Vec<f64> {
    let (problem, start) = fit.problem.of_another(&fit.optimum.theta, other);
    let theta: DVector<f64> = minimise(&problem, start, Effort::COARSE).theta;
    problem.innovations(&theta, 0).iter().map(bounded).collect()
}

/// The negative log-likelihood of Student's t.
fn bounded(innovation: &Innovation) -> f64 {
    let square = innovation.normalised().powi(2);
    f64::from(innovation.std).ln() + 0.5 * (FREEDOM + 1.0) * (square / FREEDOM).ln_1p()
}
