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
pub(in crate::estimate::plant_fit) struct ThrustChanges(Vec<f64>);

impl ThrustChanges {
    /// Computes the changes of the forces over some slices; `period_s` is the time between samples of their
    /// log, above zero.
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
        let change = |slice: &Slice| {
            let middle_s = slice.from_s + 0.5 * slice.length_s;
            let [before, after] =
                [middle_s - 0.5 * period_s, middle_s + 0.5 * period_s].map(around);
            let root = 0.5 * (slice.length_s / period_s).sqrt();
            let axes = 0..before[0].len();
            axes.map(move |k| root * ((after[0][k] + after[1][k]) - (before[0][k] + before[1][k])))
        };
        Self(slices.iter().flat_map(change).collect())
    }
}

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    /// Computes the covariance Q that jitter adds to motion over a step; `None` without jitter, and where
    /// thrust does not change.
    pub(super) fn jitter(&self, instant: &FilterInstant) -> Option<Box<SMatrix<f64, M, M>>> {
        let (std_s, ThrustChanges(changes)) = (self.noise.jitter_s?, self.thrust_changes?);
        let axes = self.noise.axes();
        let own = &changes[axes * instant.slices.start..axes * instant.slices.end];
        let mut sum: Option<Box<SMatrix<f64, M, M>>> = None;
        for change in own.chunks_exact(axes).filter(|change| change.iter().any(|x| *x != 0.0)) {
            let of_axis = |k: usize, _| change.get(k).copied().unwrap_or_default();
            let of_velocity = self.plant.inverse() * SVector::from_fn(of_axis) * std_s;
            let column: SVector<f64, M> = with_down(&of_velocity, Vector3::zeros);
            **sum.get_or_insert_with(|| Box::new(SMatrix::zeros())) += column * column.transpose();
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::plant_fit::tests::{over, planar, record};
    use crate::{Dof, Timed};

    #[test]
    fn a_change_of_thrust_keeps_its_size_where_it_is_spread_over_a_period() {
        let plant = planar();
        let mut record = record(&plant, "a", 1, 20, 0.005);
        let step = Timed::new("force", vec![0.0, 5.0], vec![1.0, 8.0]).expect("valid");
        record.force = std::array::from_fn(|axis| match axis {
            axis if axis == Dof::Sway.index() => Some(step.clone()),
            _ => None,
        });
        over(&record, &plant, |input| {
            let ThrustChanges(changes) = input.thrust_changes.expect("there");
            let squares = |place: usize| -> f64 {
                changes.iter().skip(place).step_by(3).map(|x| x * x).sum()
            };
            assert_eq!((squares(0), squares(2)), (0.0, 0.0));
            assert!((squares(1) - 49.0).abs() < 1e-9, "{}", squares(1));
        });
    }
}
