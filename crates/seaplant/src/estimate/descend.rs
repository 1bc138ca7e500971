//! Damped Gauss–Newton steps within limits, for fits by maximum likelihood.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Quadratic model of a cost near a point, by its gradient and information.
pub(super) struct Parabola<'a> {
    gradient: &'a DVector<f64>,
    information: &'a DMatrix<f64>,
    /// Distances of each number from its lower and upper limit.
    room: Vec<(f64, f64)>,
    /// True for numbers that may move.
    free: Vec<bool>,
}

impl<'a> Parabola<'a> {
    /// Creates the model. Held numbers do not move, nor do those at a limit towards which the
    /// gradient points.
    pub(super) fn new(
        (gradient, information): (&'a DVector<f64>, &'a DMatrix<f64>),
        (at, limits): (&DVector<f64>, &[(f64, f64)]),
        is_held: impl Fn(usize) -> bool,
    ) -> Self {
        let is_free = |(j, (low, high)): (usize, &(f64, f64))| {
            let is_pushed =
                at[j] <= *low && gradient[j] > 0.0 || at[j] >= *high && gradient[j] < 0.0;
            !is_pushed && !is_held(j)
        };
        let room = limits.iter().zip(at.iter()).map(|((low, high), at)| (low - at, high - at));
        let free = limits.iter().enumerate().map(is_free).collect();
        Self { gradient, information, room: room.collect(), free }
    }

    /// Computes the step `−(H + λ diag H)⁻¹ g`. A number that would leave its limits stops at the
    /// limit, and the others are recomputed.
    pub(super) fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let n = self.gradient.len();
        let mut free = self.free.clone();
        let mut fixed = DVector::zeros(n);
        for _ in 0..=n {
            let step = self.partial_step(&free, &fixed, damping)?;
            let leaves =
                |j: &usize| free[*j] && (step[*j] < self.room[*j].0 || step[*j] > self.room[*j].1);
            let Some(j) = (0..n).find(leaves) else { return Some(step) };
            free[j] = false;
            fixed[j] = step[j].clamp(self.room[j].0, self.room[j].1);
        }
        None
    }

    /// Computes the step of the free numbers for given steps of the others.
    fn partial_step(
        &self,
        free: &[bool],
        fixed: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let Self { gradient, information, .. } = self;
        let n = gradient.len();
        let scale = information.diagonal().map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
        let scaled = DMatrix::from_fn(n, n, |i, j| match (i == j, free[i] && free[j]) {
            (true, true) => 1.0 + damping,
            (true, false) => 1.0,
            (false, true) => information[(i, j)] * scale[i] * scale[j],
            (false, false) => 0.0,
        });
        let pull = *gradient + *information * fixed;
        let downhill = DVector::from_fn(n, |j, _| if free[j] { -pull[j] * scale[j] } else { 0.0 });
        let step = Cholesky::new(scaled)?.solve(&downhill).component_mul(&scale) + fixed;
        step.iter().all(|x| x.is_finite()).then_some(step)
    }

    /// Returns twice the reduction of the quadratic model's cost by a step.
    pub(super) fn promise(&self, step: &DVector<f64>) -> f64 {
        -2.0 * self.gradient.dot(step) - step.dot(&(self.information * step))
    }
}

/// Scales a matrix to a unit diagonal: α and ln T differ by many orders of magnitude.
pub(super) fn unit_diagonal(information: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_diagonal(&information.diagonal().map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt()))
}
