//! Jitter of thrust: changes that act at another time than log and actuator say.
//!
//! A change Δτ that acts δ too early has an impulse of Δτ δ. It may act at any time within a period h of
//! the log of thrust, so that what it adds to the covariance of ν is spread over that,
//!
//! ```text
//! Q = Σ ℓ/h M⁻¹ Δτ Δτᵀ M⁻ᵀ σ²,   Δτ = τ(t + h/2) − τ(t − h/2),
//! ```
//!
//! with the sum over the slices of a step, their lengths ℓ and their middles t. τ is the force by an
//! actuator that stays the same during a descent: otherwise the covariance would follow delay and lag,
//! which steps at fixed gains of the filter do not see.

use nalgebra::{SMatrix, SVector, Vector3};

use super::Sweep;
use crate::estimate::plant_fit::schedule::FilterInstant;
use crate::motion::{HeldForces, Slice, with_down};
use crate::series::ROUNDING_S;

/// Δτ √(ℓ/h) of each slice, by axis of the plant, one slice after the other.
#[derive(Default)]
pub(in crate::estimate::plant_fit) struct Jolts {
    axes: usize,
    numbers: Vec<f64>,
}

impl Jolts {
    /// Returns those of forces whose log has this time between samples, s.
    pub(in crate::estimate::plant_fit) fn of(
        pushes: &HeldForces,
        slices: &[Slice],
        period_s: f64,
    ) -> Self {
        let forces: Vec<&[f64]> = pushes.each().map(|push| push.force).collect();
        let at = |time_s: f64| {
            let after = slices.partition_point(|slice| slice.from_s <= time_s);
            forces[after.saturating_sub(1)]
        };
        // At the boundary of two slices, the mean of both.
        let around = |time_s: f64| [time_s - ROUNDING_S, time_s + ROUNDING_S].map(at);
        let jolt = |slice: &Slice| {
            let middle_s = slice.from_s + 0.5 * slice.length_s;
            let [before, after] =
                [middle_s - 0.5 * period_s, middle_s + 0.5 * period_s].map(around);
            let root = 0.5 * (slice.length_s / period_s).sqrt();
            let axes = 0..before[0].len();
            axes.map(move |k| root * ((after[0][k] + after[1][k]) - (before[0][k] + before[1][k])))
        };
        Self {
            axes: forces.first().map_or(0, |force| force.len()),
            numbers: slices.iter().flat_map(jolt).collect(),
        }
    }
}

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    /// Returns what jitter adds to the covariance of motion over a step; `None` without jitter, and where
    /// thrust does not change.
    pub(super) fn jitter(&self, instant: &FilterInstant) -> Option<SMatrix<f64, M, M>> {
        let (std_s, Jolts { axes, numbers }) = (self.noise.jitter_s?, self.jolts?);
        let own = &numbers[axes * instant.slices.start..axes * instant.slices.end];
        let mut sum: Option<SMatrix<f64, M, M>> = None;
        for jolt in own.chunks_exact((*axes).max(1)).filter(|jolt| jolt.iter().any(|x| *x != 0.0)) {
            let jolt = SVector::<f64, N>::from_fn(|k, _| jolt.get(k).copied().unwrap_or_default());
            let change = self.plant.inverse() * jolt * std_s;
            let change: SVector<f64, M> = with_down(&change, Vector3::zeros);
            let added = change * change.transpose();
            sum = Some(sum.map_or(added, |sum| sum + added));
        }
        sum
    }
}
