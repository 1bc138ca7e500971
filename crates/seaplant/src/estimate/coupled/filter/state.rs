//! The state, its covariance, and how a step and a measurement change them.

use nalgebra::{Matrix2, SMatrix, SVector, Vector2, Vector3};

use crate::motion::{apply, subtract_outer, subtract_outers, times, times_transposed};

/// The state, or a change of it.
#[derive(Clone, Copy)]
pub(super) struct State<const N: usize, const M: usize> {
    /// ν_r, and where M = N + 3 the world's down in body axes.
    pub(super) motion: SVector<f64, M>,
    pub(super) disturbance: SVector<f64, N>,
    /// What the current is beside its mean, north and east.
    pub(super) water: Vector2<f64>,
}

impl<const N: usize, const M: usize> State<N, M> {
    pub(super) fn zeros() -> Self {
        Self { motion: SVector::zeros(), disturbance: SVector::zeros(), water: Vector2::zeros() }
    }

    /// Adds x times another.
    pub(super) fn add(&mut self, other: &Self, x: f64) {
        self.motion += other.motion * x;
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
        match seen.of {
            Of::Velocity(place) => seen.along(place, &self.motion) + seen.water.dot(&self.water),
            Of::Down(across) => (0..3).map(|i| self.motion[N + i] * across[i]).sum(),
        }
    }

    /// A step; what else moves it is added to it.
    pub(super) fn step(&mut self, step: &Transition<N, M>) {
        self.motion =
            apply(&step.by_motion, &self.motion) + apply(&step.by_disturbance, &self.disturbance);
        self.disturbance.component_mul_assign(&step.fade);
        self.water *= step.fade_of_water;
    }
}

/// What a measurement sees of the state.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub(super) of: Of,
    /// How much of the current.
    pub(super) water: Vector2<f64>,
    /// Places of two rates of turn, and how far from their axes a translation is measured, m; none if it
    /// is measured at the origin.
    pub(super) turns: Option<[(usize, f64); 2]>,
    /// Its variance beside the usual one.
    pub(super) spread: f64,
}

impl Seen {
    /// What an instrument sees along a place of motion: that, and what turning makes of it.
    pub(super) fn along<const M: usize>(&self, place: usize, motion: &SVector<f64, M>) -> f64 {
        let turning = |turns: [(usize, f64); 2]| -> f64 {
            turns.iter().map(|(rate, arm)| motion[*rate] * arm).sum()
        };
        motion[place] + self.turns.map_or(0.0, turning)
    }
}

/// What a measurement is of.
#[derive(Clone, Copy)]
pub(super) enum Of {
    /// The velocity in a place.
    Velocity(usize),
    /// The world's down in a direction across it.
    Down(Vector3<f64>),
}

/// Covariance of the state; `xf` is that of motion (row) with disturbance (column), and w stands
/// for the water.
#[derive(Clone, Copy)]
pub(super) struct Covariance<const N: usize, const M: usize> {
    pub(super) xx: SMatrix<f64, M, M>,
    pub(super) xf: SMatrix<f64, M, N>,
    pub(super) ff: SMatrix<f64, N, N>,
    pub(super) xw: SMatrix<f64, M, 2>,
    pub(super) fw: SMatrix<f64, N, 2>,
    pub(super) ww: Matrix2<f64>,
}

impl<const N: usize, const M: usize> Covariance<N, M> {
    pub(super) fn zeros() -> Self {
        Self {
            xx: SMatrix::zeros(),
            xf: SMatrix::zeros(),
            ff: SMatrix::zeros(),
            xw: SMatrix::zeros(),
            fw: SMatrix::zeros(),
            ww: Matrix2::zeros(),
        }
    }

    /// Adds what a variance of the current makes of a velocity through water that was measured over
    /// ground: `ν_r = y − W c`.
    pub(super) fn of_first_water(&mut self, water: &SMatrix<f64, M, 2>, variance: f64) {
        self.xx += water * water.transpose() * variance;
        self.xw -= water * variance;
        self.ww += Matrix2::identity() * variance;
    }

    /// The covariance of the state with what a measurement sees of it.
    pub(super) fn seen(&self, seen: &Seen) -> State<N, M> {
        match seen.of {
            Of::Velocity(place) => {
                let mut state = State {
                    motion: self.xx.column(place) + self.xw * seen.water,
                    disturbance: self.xf.row(place).transpose() + self.fw * seen.water,
                    water: self.xw.row(place).transpose() + self.ww * seen.water,
                };
                let turns = seen.turns.iter().flatten();
                turns.for_each(|(rate, arm)| self.add_to(&mut state, *rate, *arm));
                state
            }
            Of::Down(across) => {
                let mut state = State::zeros();
                across.iter().enumerate().for_each(|(i, x)| self.add_to(&mut state, N + i, *x));
                state
            }
        }
    }

    /// Adds x times the covariance of the state with a place of motion.
    fn add_to(&self, state: &mut State<N, M>, place: usize, x: f64) {
        state.motion += self.xx.column(place) * x;
        state.disturbance += self.xf.row(place).transpose() * x;
        state.water += self.xw.row(place).transpose() * x;
    }

    /// Less `a bᵀ`.
    pub(super) fn subtract(&mut self, a: &State<N, M>, b: &State<N, M>) {
        subtract_outer(&mut self.xx, &a.motion, &b.motion);
        subtract_outer(&mut self.xf, &a.motion, &b.disturbance);
        subtract_outer(&mut self.ff, &a.disturbance, &b.disturbance);
        if b.water == Vector2::zeros() {
            return;
        }
        self.xw -= a.motion * b.water.transpose();
        self.fw -= a.disturbance * b.water.transpose();
        self.ww -= a.water * b.water.transpose();
    }

    /// Less `a bᵀ + b aᵀ`.
    pub(super) fn subtract_both(&mut self, a: &State<N, M>, b: &State<N, M>) {
        subtract_outers(&mut self.xx, (&a.motion, &b.motion), (&b.motion, &a.motion));
        subtract_outers(&mut self.xf, (&a.motion, &b.disturbance), (&b.motion, &a.disturbance));
        let (of_a, of_b) = (&a.disturbance, &b.disturbance);
        subtract_outers(&mut self.ff, (of_a, of_b), (of_b, of_a));
        if a.water == Vector2::zeros() && b.water == Vector2::zeros() {
            return;
        }
        self.xw -= a.motion * b.water.transpose() + b.motion * a.water.transpose();
        self.fw -= a.disturbance * b.water.transpose() + b.disturbance * a.water.transpose();
        self.ww -= a.water * b.water.transpose() + b.water * a.water.transpose();
    }

    pub(super) fn add(&mut self, other: &Self, weight: f64) {
        self.xx += other.xx * weight;
        self.xf += other.xf * weight;
        self.ff += other.ff * weight;
        self.ww += other.ww * weight;
    }

    /// Φ P Φᵀ + Q.
    pub(super) fn predict(&mut self, step: &Transition<N, M>, process: &Self) {
        let (a, b, fade) = (&step.by_motion, &step.by_disturbance, &step.fade);
        let u = times(a, &self.xx) + times_transposed(b, &self.xf);
        let v = times(a, &self.xf) + times(b, &self.ff);
        self.xx = times_transposed(&u, a) + times_transposed(&v, b) + process.xx;
        for j in 0..N {
            for i in 0..M {
                self.xf[(i, j)] = v[(i, j)] * fade[j] + process.xf[(i, j)];
            }
            for i in 0..N {
                self.ff[(i, j)] = fade[i] * self.ff[(i, j)] * fade[j] + process.ff[(i, j)];
            }
        }
        // Measurements take nothing of what rounding makes of it that is not symmetric, and where
        // motion is unstable, as by Munk's moment, that grows until variances are negative.
        symmetrise(&mut self.xx);
        symmetrise(&mut self.ff);
        if step.fade_of_water < 1.0 {
            self.predict_water(step, process);
        }
    }

    pub(super) fn predict_water(&mut self, step: &Transition<N, M>, process: &Self) {
        let rho = step.fade_of_water;
        self.xw = (step.by_motion * self.xw + step.by_disturbance * self.fw) * rho;
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
pub(super) struct Transition<const N: usize, const M: usize> {
    pub(super) by_motion: SMatrix<f64, M, M>,
    pub(super) by_disturbance: SMatrix<f64, M, N>,
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
        let step = Transition::<2, 2> {
            by_motion: turn * Matrix2::new(1.03, 0.0, 0.0, 0.999) * turn.transpose(),
            by_disturbance: Matrix2::new(0.02, 0.003, 0.003, 0.04),
            fade: Vector2::new(0.99, 0.995),
            fade_of_water: 1.0,
        };
        let mut process = Covariance::<2, 2>::zeros();
        process.xx = Matrix2::identity() * 1e-8;
        process.ff = Matrix2::identity() * 1e-4;
        let mut covariance = Covariance::<2, 2>::zeros();
        covariance.xx = Matrix2::identity() * 1e-4;
        covariance.ff = Matrix2::identity();
        for k in 0..5000 {
            covariance.predict(&step, &process);
            for axis in 0..2 {
                let (of, water) = (Of::Velocity(axis), Vector2::zeros());
                let seen = Seen { of, water, turns: None, spread: 1.0 };
                let column = covariance.seen(&seen);
                let variance = column.seen(&seen) + 1e-5;
                covariance.subtract(&column.scaled(1.0 / variance), &column);
            }
            let smallest = covariance.xx.symmetric_eigenvalues().min();
            let skewness = (covariance.xx - covariance.xx.transpose()).amax();
            assert!(smallest > 0.0, "{k}: {smallest}");
            assert!(skewness < 1e-12 * covariance.xx.amax(), "{k}: {skewness}");
        }
    }
}
