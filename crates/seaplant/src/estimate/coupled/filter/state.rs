//! The state, its covariance, and how a step and a measurement change them.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

use crate::motion::{apply, subtract_outer, subtract_outers, times, times_transposed};

/// The state, or a change of it.
#[derive(Clone, Copy)]
pub(super) struct State<const N: usize> {
    pub(super) velocity: SVector<f64, N>,
    pub(super) disturbance: SVector<f64, N>,
    /// What the current is beside its mean, north and east.
    pub(super) water: Vector2<f64>,
}

impl<const N: usize> State<N> {
    pub(super) fn zeros() -> Self {
        let zeros = SVector::zeros();
        Self { velocity: zeros, disturbance: zeros, water: Vector2::zeros() }
    }

    /// Adds x times another.
    pub(super) fn add(&mut self, other: &Self, x: f64) {
        self.velocity += other.velocity * x;
        self.disturbance += other.disturbance * x;
        self.water += other.water * x;
    }

    pub(super) fn scaled(&self, x: f64) -> Self {
        let mut scaled = Self::zeros();
        scaled.add(self, x);
        scaled
    }

    /// What a measurement sees of it.
    pub(super) fn seen(&self, seen: &Seen) -> f64 {
        self.velocity[seen.axis] + seen.water.dot(&self.water)
    }

    /// A step; what else moves velocity is added to it.
    pub(super) fn step(&mut self, step: &Transition<N>) {
        self.velocity = apply(&step.by_velocity, &self.velocity)
            + apply(&step.by_disturbance, &self.disturbance);
        self.disturbance.component_mul_assign(&step.fade);
        self.water *= step.fade_of_water;
    }
}

/// What a measurement of an axis is of: its own velocity, and this much of the current.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub(super) axis: usize,
    pub(super) water: Vector2<f64>,
    /// Its variance beside that of the axis.
    pub(super) spread: f64,
}

/// Covariance of the state; `vf` is that of velocity (row) with disturbance (column), and w stands
/// for the water.
#[derive(Clone, Copy)]
pub(super) struct Covariance<const N: usize> {
    pub(super) vv: SMatrix<f64, N, N>,
    pub(super) vf: SMatrix<f64, N, N>,
    pub(super) ff: SMatrix<f64, N, N>,
    pub(super) vw: SMatrix<f64, N, 2>,
    pub(super) fw: SMatrix<f64, N, 2>,
    pub(super) ww: Matrix2<f64>,
}

impl<const N: usize> Covariance<N> {
    pub(super) fn zeros() -> Self {
        let (zeros, of_water) = (SMatrix::zeros(), SMatrix::zeros());
        let ww = Matrix2::zeros();
        Self { vv: zeros, vf: zeros, ff: zeros, vw: of_water, fw: of_water, ww }
    }

    /// Adds what a variance of the current makes of a velocity through water that was measured over
    /// ground: `ν_r = y − W c`.
    pub(super) fn of_first_water(&mut self, water: &SMatrix<f64, N, 2>, variance: f64) {
        self.vv += water * water.transpose() * variance;
        self.vw -= water * variance;
        self.ww += Matrix2::identity() * variance;
    }

    /// The covariance of the state with what a measurement sees of it.
    pub(super) fn seen(&self, seen: &Seen) -> State<N> {
        let axis = seen.axis;
        State {
            velocity: self.vv.column(axis) + self.vw * seen.water,
            disturbance: self.vf.row(axis).transpose() + self.fw * seen.water,
            water: self.vw.row(axis).transpose() + self.ww * seen.water,
        }
    }

    /// Less `a bᵀ`.
    pub(super) fn subtract(&mut self, a: &State<N>, b: &State<N>) {
        subtract_outer(&mut self.vv, &a.velocity, &b.velocity);
        subtract_outer(&mut self.vf, &a.velocity, &b.disturbance);
        subtract_outer(&mut self.ff, &a.disturbance, &b.disturbance);
        if b.water == Vector2::zeros() {
            return;
        }
        self.vw -= a.velocity * b.water.transpose();
        self.fw -= a.disturbance * b.water.transpose();
        self.ww -= a.water * b.water.transpose();
    }

    /// Less `a bᵀ + b aᵀ`.
    pub(super) fn subtract_both(&mut self, a: &State<N>, b: &State<N>) {
        subtract_outers(&mut self.vv, (&a.velocity, &b.velocity), (&b.velocity, &a.velocity));
        subtract_outers(&mut self.vf, (&a.velocity, &b.disturbance), (&b.velocity, &a.disturbance));
        let (of_a, of_b) = (&a.disturbance, &b.disturbance);
        subtract_outers(&mut self.ff, (of_a, of_b), (of_b, of_a));
        if a.water == Vector2::zeros() && b.water == Vector2::zeros() {
            return;
        }
        self.vw -= a.velocity * b.water.transpose() + b.velocity * a.water.transpose();
        self.fw -= a.disturbance * b.water.transpose() + b.disturbance * a.water.transpose();
        self.ww -= a.water * b.water.transpose() + b.water * a.water.transpose();
    }

    pub(super) fn add(&mut self, other: &Self, weight: f64) {
        self.vv += other.vv * weight;
        self.vf += other.vf * weight;
        self.ff += other.ff * weight;
        self.ww += other.ww * weight;
    }

    /// Φ P Φᵀ + Q.
    pub(super) fn predict(&mut self, step: &Transition<N>, process: &Self) {
        let (a, b, fade) = (&step.by_velocity, &step.by_disturbance, &step.fade);
        let u = times(a, &self.vv) + times_transposed(b, &self.vf);
        let v = times(a, &self.vf) + times(b, &self.ff);
        self.vv = times_transposed(&u, a) + times_transposed(&v, b) + process.vv;
        for j in 0..N {
            for i in 0..N {
                self.vf[(i, j)] = v[(i, j)] * fade[j] + process.vf[(i, j)];
                self.ff[(i, j)] = fade[i] * self.ff[(i, j)] * fade[j] + process.ff[(i, j)];
            }
        }
        // Measurements take nothing of what rounding makes of it that is not symmetric, and where
        // motion is unstable, as by Munk's moment, that grows until variances are negative.
        symmetrise(&mut self.vv);
        symmetrise(&mut self.ff);
        if step.fade_of_water < 1.0 {
            self.predict_water(step, process);
        }
    }

    pub(super) fn predict_water(&mut self, step: &Transition<N>, process: &Self) {
        let rho = step.fade_of_water;
        self.vw = (step.by_velocity * self.vw + step.by_disturbance * self.fw) * rho;
        for j in 0..2 {
            let faded = self.fw.column(j).component_mul(&step.fade) * rho;
            self.fw.set_column(j, &faded);
        }
        self.ww = self.ww * (rho * rho) + process.ww;
    }
}

/// The mean of a matrix and its transpose.
pub(super) fn symmetrise<const N: usize>(matrix: &mut SMatrix<f64, N, N>) {
    for j in 0..N {
        for i in 0..j {
            let mean = 0.5 * (matrix[(i, j)] + matrix[(j, i)]);
            matrix[(i, j)] = mean;
            matrix[(j, i)] = mean;
        }
    }
}

/// A step of the covariance: transition and process noise.
pub(super) struct Transition<const N: usize> {
    pub(super) by_velocity: SMatrix<f64, N, N>,
    pub(super) by_disturbance: SMatrix<f64, N, N>,
    pub(super) fade: SVector<f64, N>,
    /// 1 of a constant current.
    pub(super) fade_of_water: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As Munk's moment makes sway and yaw: one direction grows, another hardly fades. What of the
    /// covariance is not symmetric is seen by no measurement, and would grow as their product.
    #[test]
    fn a_covariance_stays_one_where_motion_is_unstable() {
        let (sin, cos) = 0.4_f64.sin_cos();
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let step = Transition::<2> {
            by_velocity: turn * Matrix2::new(1.03, 0.0, 0.0, 0.999) * turn.transpose(),
            by_disturbance: Matrix2::new(0.02, 0.003, 0.003, 0.04),
            fade: Vector2::new(0.99, 0.995),
            fade_of_water: 1.0,
        };
        let mut process = Covariance::<2>::zeros();
        process.vv = Matrix2::identity() * 1e-8;
        process.ff = Matrix2::identity() * 1e-4;
        let mut covariance = Covariance::<2>::zeros();
        covariance.vv = Matrix2::identity() * 1e-4;
        covariance.ff = Matrix2::identity();
        for k in 0..5000 {
            covariance.predict(&step, &process);
            for axis in 0..2 {
                let seen = Seen { axis, water: Vector2::zeros(), spread: 1.0 };
                let column = covariance.seen(&seen);
                let variance = column.seen(&seen) + 1e-5;
                covariance.subtract(&column.scaled(1.0 / variance), &column);
            }
            let smallest = covariance.vv.symmetric_eigenvalues().min();
            let skewness = (covariance.vv - covariance.vv.transpose()).amax();
            assert!(smallest > 0.0, "{k}: {smallest}");
            assert!(skewness < 1e-12 * covariance.vv.amax(), "{k}: {skewness}");
        }
    }
}
