//! Output error estimation of a plant: open-loop simulation, with all misfit attributed to
//! the measurement.
//!
//! In terms of the filter: no disturbance, so that its gain decays to zero, and measurement noise
//! as large as the misfit. The misfit is correlated in time, which the information of independent
//! samples ignores; therefore the covariance comes from the scores of blocks.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::actuator::Actuator;
use super::descent::Tolerance;
use super::filter::{Noise, NoiseNumber};
use super::problem::{Point, Problem};
use crate::motion::PUSHED_BY;
use crate::statistics::robust_covariance;
use crate::{Dof, Error, TrialRecord};

/// Number of blocks per fitted number, for the covariance of the scores.
const BLOCKS_PER_NUMBER: f64 = 2.0;

/// The autocorrelation of the misfit is summed up to this lag: the length of the trial divided by
/// this number.
const MOST_LAGS_PART: usize = 10;

/// Returns the initial noise: all motion counts as misfit.
pub(super) fn first_noise(problem: &Problem, records: &[&TrialRecord]) -> Noise {
    let axes = problem.structure.axes();
    let spread = |i: usize| {
        let dof = axes[i];
        let series = records.iter().filter_map(|record| record.velocity[dof.index()].as_ref());
        let values: Vec<f64> = series.flat_map(|series| series.values()).copied().collect();
        let sum: f64 = values.iter().map(|x| x * x).sum();
        (sum / values.len().max(1) as f64).sqrt().max(problem.sample_noise[i])
    };
    Noise {
        disturbance: DVector::zeros(axes.len()),
        correlation_s: DVector::repeat(axes.len(), 1.0),
        velocity: DVector::from_fn(axes.len(), |i, _| spread(i)),
        attitude: None,
        instruments: problem.instruments,
        drift: None,
        swell: None,
        jitter_s: None,
    }
}

impl Problem {
    /// Optimises each start on pieces of the trials and sorts by cost. In open loop, a start far
    /// from the truth may lead to a local minimum.
    pub(super) fn nearer<T>(&self, starts: Vec<(Point, T)>) -> Vec<(Point, T)> {
        let Some(pieces) = self.in_pieces() else { return starts };
        let mut found: Vec<(f64, Point, T)> = starts
            .into_iter()
            .map(|(point, of)| match pieces.descent(point.clone(), Tolerance::COARSE) {
                Ok(nearer) => (nearer.cost, nearer.point, of),
                Err(_) => (f64::INFINITY, point, of),
            })
            .collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|(_, point, of)| (point, of)).collect()
    }

    /// Sets the noise of each axis to its misfit; returns true if it has converged.
    pub(super) fn step_misfit(&self, point: &mut Point, tolerance: Tolerance) -> bool {
        let Ok(trials) = self.innovations(point) else { return true };
        let mut sums = vec![(0.0, 0.0); point.noise.count()];
        for innovation in trials.iter().flatten() {
            let (sum, n) = &mut sums[innovation.number];
            *sum += innovation.normalised().powi(2);
            *n += 1.0;
        }
        let (numbers, mut logarithms) = (point.noise.numbers(), point.noise.logarithms());
        let mut gain = 0.0_f64;
        for (k, (sum, n)) in sums.iter().enumerate().filter(|(_, (_, n))| *n > 0.0) {
            let ratio = sum / n;
            if !(ratio.is_finite() && ratio > 0.0) {
                return true;
            }
            let before = logarithms[k];
            logarithms[k] += 0.5 * ratio.ln();
            if let NoiseNumber::Velocity(axis) = numbers[k] {
                logarithms[k] = logarithms[k].max(self.sample_noise[axis].ln());
            }
            gain = gain.max(0.25 * n * (2.0 * (logarithms[k] - before)).powi(2));
        }
        point.noise = point.noise.with_logarithms(&logarithms);
        gain < tolerance.noise
    }

    /// Computes the covariance of coefficients, actuator and currents for a misfit of any
    /// autocorrelation: `H⁻¹ Σ g gᵀ H⁻¹`, where g are the scores of blocks of the trials.
    ///
    /// # Source
    /// [White1982].
    pub(super) fn covariance_of_blocks(
        &self,
        point: &Point,
        information: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        let terms = self.structure.terms().len();
        let (p, all) = (terms + PUSHED_BY, information.nrows());
        let duration_s: f64 =
            self.schedules.iter().flat_map(|x| &x.instants).map(|instant| instant.length_s).sum();
        // An exponent and a dead band replace each other.
        let numbers = (all - 1) as f64;
        let spacing_s = duration_s / (BLOCKS_PER_NUMBER * numbers);
        let marks = self.each(point, |_, pass| pass.by_plant_at(spacing_s)).ok()?;
        let mut scores: Vec<DVector<f64>> = Vec::new();
        for (schedule, marks) in self.schedules.iter().zip(marks) {
            let mut before = DVector::zeros(p + 2);
            for mark in marks {
                let own = &mark - &before;
                let mut score = DVector::zeros(all);
                for (k, x) in own.iter().enumerate() {
                    score[if k < p { k } else { 2 * schedule.trial + k }] = *x;
                }
                (0..Actuator::COUNT).filter(|k| !self.fits[*k]).for_each(|k| {
                    score[terms + k] = 0.0;
                });
                scores.push(score);
                before = mark;
            }
        }
        for (k, term) in self.structure.terms().iter().enumerate() {
            if self.structure.held(term).is_some() {
                scores.iter_mut().for_each(|score| score[k] = 0.0);
            }
        }
        // Each number takes the freedom of one block, whether it is fitted or not.
        let n = scores.len() as f64;
        let few = (n - 1.0) / (n - numbers).max(1.0);
        Some(robust_covariance(information, &scores)? * few)
    }

    /// Computes, for each axis, how many samples are worth one independent sample: `1 + 2 Σ r_k`,
    /// summed while the autocorrelations r_k of the misfit are positive.
    pub(super) fn samples_per_independent(
        &self,
        point: &Point,
    ) -> Result<BTreeMap<Dof, f64>, Error> {
        let trials = self.innovations(point)?;
        let of = |(axis, &dof): (usize, &Dof)| {
            let mut weighted = (0.0, 0.0);
            for trial in &trials {
                let own = trial.iter().filter(|innovation| innovation.axis == Some(axis));
                let e: Vec<f64> = own.map(|innovation| innovation.normalised()).collect();
                let power: f64 = e.iter().map(|x| x * x).sum();
                let mut sum = 1.0;
                for lag in 1..=e.len() / MOST_LAGS_PART {
                    let r = e.iter().zip(&e[lag..]).map(|(a, b)| a * b).sum::<f64>() / power;
                    if r <= 0.0 || !r.is_finite() {
                        break;
                    }
                    sum += 2.0 * r;
                }
                weighted = (weighted.0 + sum * e.len() as f64, weighted.1 + e.len() as f64);
            }
            (dof, weighted.0 / weighted.1.max(1.0))
        };
        Ok(self.structure.axes().iter().enumerate().map(of).collect())
    }
}
