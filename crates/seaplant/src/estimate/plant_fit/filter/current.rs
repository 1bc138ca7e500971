//! A step of a current that varies. The vehicle keeps its velocity over ground:
//!
//! ```text
//! c⁺ = ρ c + w,   ν_r⁺ = ν_r − R(η)ᵀ (c⁺ − c),   ρ = exp(−h/T_c)
//! ```
//!
//! A vehicle that crosses eddies is not carried by them. Water that accelerates everywhere would carry it; that is
//! as slow as tides.

use nalgebra::{DVector, SMatrix};

use super::Sweep;
use super::navigation::{Crossed, Rows};
use super::state::{Covariance, State};
use crate::estimate::plant_fit::schedule::FilterInstant;

/// A step of the current.
#[derive(Clone, Copy)]
pub(super) struct CurrentStep<const M: usize> {
    /// Change of motion with each component of the current.
    pub(super) by_current: SMatrix<f64, M, 2>,
    /// Decay ρ over the step.
    pub(super) fade: f64,
    /// Variance of each component of w, (m/s)².
    added: f64,
}

/// Derivative of a step of the current by one noise parameter.
#[derive(Clone, Copy)]
pub(super) struct CurrentChange {
    /// Derivative of the decay.
    pub(super) fade: f64,
    /// Derivative of the variance that is added.
    pub(super) added: f64,
}

impl<const M: usize> CurrentStep<M> {
    /// Returns the change of the state with one component of the current.
    fn direction<const N: usize, const K: usize>(
        &self,
        component: usize,
        count: usize,
    ) -> State<N, M, K> {
        let mut direction = State::zeros(count);
        direction.motion = self.by_current.column(component).into_owned();
        direction.navigation[component] = 1.0;
        direction
    }

    /// Returns the same for both components, with all states in a row.
    pub(super) fn directions<const N: usize>(&self, count: usize) -> [DVector<f64>; 2] {
        [0, 1].map(|k| {
            let mut direction = DVector::zeros(M + N + count);
            direction.rows_mut(0, M).copy_from(&self.by_current.column(k));
            direction[M + N + k] = 1.0;
            direction
        })
    }
}

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    /// Returns the step of the current that ends at an instant; `None` if it does not vary.
    pub(super) fn current_step(&self, instant: &FilterInstant) -> Option<CurrentStep<M>> {
        let (drift, h) = (self.noise.drift?, instant.length_s);
        let by_current = self.by_current(instant);
        Some(CurrentStep { by_current, fade: drift.fade(h), added: drift.process(h) })
    }

    /// Returns the change of motion with each component of the current at a constant velocity over ground.
    pub(super) fn by_current(&self, instant: &FilterInstant) -> SMatrix<f64, M, 2> {
        SMatrix::from_columns(&[0, 1].map(|k| -self.water_column(instant, k)))
    }
}

impl<const N: usize, const M: usize, const K: usize> State<N, M, K> {
    /// Propagates the mean, or a deviation, over a step of the current.
    pub(super) fn step_current(&mut self, step: &CurrentStep<M>) {
        for k in 0..2 {
            let change = (step.fade - 1.0) * self.navigation[k];
            self.motion += step.by_current.column(k) * change;
            self.navigation[k] += change;
        }
    }

    /// Adds the effect of a changed decay of the current, given the mean before the step.
    pub(super) fn add_current_change(
        &mut self,
        (step, change): (&CurrentStep<M>, &CurrentChange),
        mean: &Self,
    ) {
        for k in 0..2 {
            self.add(&step.direction(k, self.count), change.fade * mean.navigation[k]);
        }
    }
}

impl<const N: usize, const M: usize, const K: usize> Covariance<N, M, K> {
    /// Propagates the covariance over a step of the current.
    pub(super) fn step_current(&mut self, step: &CurrentStep<M>) {
        self.fade_current(step);
        self.add_current(&step.by_current, step.added);
    }

    /// Propagates the covariance over the decay of the current.
    pub(super) fn fade_current(&mut self, step: &CurrentStep<M>) {
        let by = step.by_current * (step.fade - 1.0);
        let (with, with_force) = (self.xo.fixed_columns::<2>(0), self.fo.fixed_columns::<2>(0));
        let crossed = by * with.transpose();
        let own = self.oo.fixed_view::<2, 2>(0, 0);
        self.xx += crossed + crossed.transpose() + by * own * by.transpose();
        self.xf += by * with_force.transpose();
        self.xo += by * self.oo.fixed_rows::<2>(0);
        for k in 0..2 {
            self.xo.column_mut(k).scale_mut(step.fade);
            self.fo.column_mut(k).scale_mut(step.fade);
            self.oo.column_mut(k).scale_mut(step.fade);
            self.oo.row_mut(k).scale_mut(step.fade);
        }
    }

    /// Adds a variance of each component of the current, at a constant velocity over ground.
    pub(super) fn add_current(&mut self, by_current: &SMatrix<f64, M, 2>, variance: f64) {
        self.xx += by_current * by_current.transpose() * variance;
        for k in 0..2 {
            let mut own = self.xo.column_mut(k);
            own += by_current.column(k) * variance;
            self.oo[(k, k)] += variance;
        }
    }

    /// Adds the effect of a changed step of the current; `before` is the nominal covariance before the step.
    pub(super) fn add_current_change(
        &mut self,
        (step, change): (&CurrentStep<M>, &CurrentChange),
        before: &Self,
        (crossed, rows): (&Crossed<N, M, K>, &Rows<M, K>),
    ) {
        self.add_current(&step.by_current, change.added);
        if change.fade == 0.0 {
            return;
        }
        let with_after = before.with_after(crossed, rows);
        for k in 0..2 {
            let mut column = State::<N, M, K>::zeros(self.count);
            column.motion = crossed.xo.column(k).into_owned();
            column.disturbance = crossed.fo.column(k).into_owned();
            column.navigation = with_after.row(k).transpose().data.0[0];
            column.step_current(step);
            let direction = step.direction(k, self.count).scaled(-change.fade);
            self.subtract_both(&direction, &column);
        }
    }
}
