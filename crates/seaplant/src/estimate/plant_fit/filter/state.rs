//! The state, its covariance, their propagation and measurement update.

use nalgebra::{SMatrix, SVector, Vector2, Vector3};

use super::current::CurrentStep;
use super::navigation::{Crossed, Rows};
use crate::motion::{apply, subtract_outer, subtract_outers, times, times_transposed};

/// The state, or a deviation of it.
#[derive(Clone, Copy)]
pub(super) struct State<const N: usize, const M: usize, const K: usize> {
    /// ν_r, followed by the down vector in body axes where M = N + 3.
    pub(super) motion: SVector<f64, M>,
    pub(super) disturbance: SVector<f64, N>,
    /// Deviation of the current from its mean, north and east, and the other navigation states.
    pub(super) navigation: [f64; K],
    /// Number of navigation states in use.
    pub(super) count: usize,
}

impl<const N: usize, const M: usize, const K: usize> State<N, M, K> {
    pub(super) fn zeros(count: usize) -> Self {
        let navigation = [0.0; K];
        Self { motion: SVector::zeros(), disturbance: SVector::zeros(), navigation, count }
    }

    /// Adds `x` times another state.
    pub(super) fn add(&mut self, other: &Self, x: f64) {
        self.motion += other.motion * x;
        self.disturbance += other.disturbance * x;
        for k in 0..self.count {
            self.navigation[k] += other.navigation[k] * x;
        }
    }

    /// Adds `x` times a gain, the numbers of a state in a row.
    pub(super) fn add_gain(&mut self, gain: &[f64], x: f64) {
        let (motion, rest) = gain.split_at(M);
        let (disturbance, navigation) = rest.split_at(N);
        let add = |own: &mut [f64], by: &[f64]| {
            own.iter_mut().zip(by).for_each(|(own, by)| *own += by * x)
        };
        add(self.motion.as_mut_slice(), motion);
        add(self.disturbance.as_mut_slice(), disturbance);
        add(&mut self.navigation, navigation);
    }

    pub(super) fn scaled(&self, x: f64) -> Self {
        let mut scaled = Self::zeros(self.count);
        scaled.add(self, x);
        scaled
    }

    /// Returns the predicted value of a measurement, without the mean current.
    pub(super) fn observed_by(&self, observation: &Observation) -> f64 {
        match observation.of {
            Observed::Velocity(place) => {
                let (north, east) = (self.navigation[0], self.navigation[1]);
                let own = match observation.lagged {
                    Some(state) => self.navigation[state],
                    None => observation.along(place, &self.motion),
                };
                own + observation.water.dot(&Vector2::new(north, east))
            }
            Observed::Down(across) => (0..3).map(|i| self.motion[N + i] * across[i]).sum(),
            Observed::Navigation { state, .. } => self.navigation[state],
        }
    }

    /// Propagates a deviation of the state; `own` is added to the motion after the step.
    pub(super) fn step(&mut self, step: &Transition<N, M, K>, own: &SVector<f64, M>) {
        let before = self.motion;
        self.motion =
            apply(&step.by_motion, &before) + apply(&step.by_disturbance, &self.disturbance) + own;
        if let Some(pushing) = step.pushing() {
            self.motion += apply(pushing, &SVector::from(self.navigation));
        }
        self.disturbance.component_mul_assign(&step.fade);
        if let Some(rows) = &step.rows {
            self.step_navigation(&before, rows);
        }
        step.current.iter().for_each(|current| self.step_current(current));
    }
}

/// The linear measurement function of one sample.
#[derive(Clone, Copy)]
pub(super) struct Observation {
    pub(super) of: Observed,
    /// Factors of the current, north and east.
    pub(super) water: Vector2<f64>,
    /// Indices of two rates with the lever arms, m, at which a translation is measured; `None` if
    /// it is measured at the origin.
    pub(super) lever_terms: Option<[(usize, f64); 2]>,
    /// Navigation state that is measured in place of a velocity, behind which it lags.
    pub(super) lagged: Option<usize>,
    /// Variance relative to the nominal one.
    pub(super) spread: f64,
}

impl Observation {
    /// Returns the velocity at an index as the sensor measures it, including `ω × r`.
    pub(super) fn along<const M: usize>(&self, place: usize, motion: &SVector<f64, M>) -> f64 {
        let turning = |lever_terms: [(usize, f64); 2]| -> f64 {
            lever_terms.iter().map(|(rate, arm)| motion[*rate] * arm).sum()
        };
        motion[place] + self.lever_terms.map_or(0.0, turning)
    }
}

/// The measured quantity.
#[derive(Clone, Copy)]
pub(super) enum Observed {
    /// Velocity at an index of motion.
    Velocity(usize),
    /// Component of the down vector along a direction perpendicular to it.
    Down(Vector3<f64>),
    /// A navigation state, with the index of its sensor noise and the axis to which its innovations
    /// are assigned.
    Navigation { state: usize, number: usize, axis: Option<usize> },
}

/// Covariance of the state: blocks of motion (x), disturbance (f) and navigation states (o); `xf`
/// has motion in its rows.
#[derive(Clone, Copy)]
pub(super) struct Covariance<const N: usize, const M: usize, const K: usize> {
    pub(super) xx: SMatrix<f64, M, M>,
    pub(super) xf: SMatrix<f64, M, N>,
    pub(super) ff: SMatrix<f64, N, N>,
    pub(super) xo: SMatrix<f64, M, K>,
    pub(super) fo: SMatrix<f64, N, K>,
    pub(super) oo: SMatrix<f64, K, K>,
    pub(super) count: usize,
}

impl<const N: usize, const M: usize, const K: usize> Covariance<N, M, K> {
    pub(super) fn zeros(count: usize) -> Self {
        Self {
            xx: SMatrix::zeros(),
            xf: SMatrix::zeros(),
            ff: SMatrix::zeros(),
            xo: SMatrix::zeros(),
            fo: SMatrix::zeros(),
            oo: SMatrix::zeros(),
            count,
        }
    }

    /// Returns the covariance of the state with a measurement's prediction.
    pub(super) fn observed_by(&self, observation: &Observation) -> State<N, M, K> {
        let mut state = State::zeros(self.count);
        match observation.of {
            Observed::Velocity(place) => {
                match observation.lagged {
                    Some(lagged) => self.add_navigation_to(&mut state, lagged, 1.0),
                    None => self.add_to(&mut state, place, 1.0),
                }
                if observation.water != Vector2::zeros() {
                    (0..2)
                        .for_each(|k| self.add_navigation_to(&mut state, k, observation.water[k]));
                }
                let lever_terms = observation.lever_terms.iter().flatten();
                lever_terms.for_each(|(rate, arm)| self.add_to(&mut state, *rate, *arm));
            }
            Observed::Down(across) => {
                across.iter().enumerate().for_each(|(i, x)| self.add_to(&mut state, N + i, *x));
            }
            Observed::Navigation { state: k, .. } => self.add_navigation_to(&mut state, k, 1.0),
        }
        state
    }

    /// Adds `x` times the covariance of the state with an entry of motion.
    fn add_to(&self, state: &mut State<N, M, K>, place: usize, x: f64) {
        state.motion += self.xx.column(place) * x;
        state.disturbance += self.xf.row(place).transpose() * x;
        for k in 0..self.count {
            state.navigation[k] += self.xo[(place, k)] * x;
        }
    }

    /// Adds `x` times the covariance of the state with a navigation state.
    fn add_navigation_to(&self, state: &mut State<N, M, K>, place: usize, x: f64) {
        state.motion += self.xo.column(place) * x;
        state.disturbance += self.fo.column(place) * x;
        for k in 0..self.count {
            state.navigation[k] += self.oo[(k, place)] * x;
        }
    }

    /// Subtracts `a bᵀ`.
    pub(super) fn subtract(&mut self, a: &State<N, M, K>, b: &State<N, M, K>) {
        subtract_outer(&mut self.xx, &a.motion, &b.motion);
        subtract_outer(&mut self.xf, &a.motion, &b.disturbance);
        subtract_outer(&mut self.ff, &a.disturbance, &b.disturbance);
        for k in 0..self.count {
            if b.navigation[k] != 0.0 {
                self.less(k, (a, b.navigation[k]));
            }
        }
    }

    /// Subtracts `a bᵀ + b aᵀ`.
    pub(super) fn subtract_both(&mut self, a: &State<N, M, K>, b: &State<N, M, K>) {
        subtract_outers(&mut self.xx, (&a.motion, &b.motion), (&b.motion, &a.motion));
        subtract_outers(&mut self.xf, (&a.motion, &b.disturbance), (&b.motion, &a.disturbance));
        let (of_a, of_b) = (&a.disturbance, &b.disturbance);
        subtract_outers(&mut self.ff, (of_a, of_b), (of_b, of_a));
        for k in 0..self.count {
            let (by_a, by_b) = (a.navigation[k], b.navigation[k]);
            if by_a == 0.0 && by_b == 0.0 {
                continue;
            }
            self.less(k, (a, by_b));
            self.less(k, (b, by_a));
        }
    }

    /// Subtracts `x` times a state from its covariance with a navigation state.
    fn less(&mut self, k: usize, (state, x): (&State<N, M, K>, f64)) {
        let of = |own: &mut [f64], taken: &[f64]| {
            own.iter_mut().zip(taken).for_each(|(own, taken)| *own -= taken * x);
        };
        of(&mut self.xo.data.0[k], &state.motion.data.0[0]);
        of(&mut self.fo.data.0[k], &state.disturbance.data.0[0]);
        of(&mut self.oo.data.0[k], &state.navigation);
    }

    pub(super) fn add(&mut self, other: &Self, weight: f64) {
        self.xx += other.xx * weight;
        self.xf += other.xf * weight;
        self.ff += other.ff * weight;
    }

    /// Propagates the covariance: Φ P Φᵀ + Q. `crossed` is the covariance between states before and
    /// after the step, needed where navigation states change.
    pub(super) fn predict(
        &mut self,
        step: &Transition<N, M, K>,
        process: &Self,
        crossed: Option<&Crossed<N, M, K>>,
    ) {
        let before = crossed.map(|_| *self);
        self.predict_motion(step, process);
        step.jitter.iter().for_each(|jitter| self.xx += **jitter);
        if let (Some(before), Some(crossed), Some(rows)) = (before, crossed, &step.rows) {
            self.predict_navigation(&before, crossed, (rows, process));
        }
        step.current.iter().for_each(|current| self.step_current(current));
    }

    pub(super) fn predict_motion(&mut self, step: &Transition<N, M, K>, process: &Self) {
        let (a, b, fade) = (&step.by_motion, &step.by_disturbance, &step.fade);
        let mut u = times(a, &self.xx) + times_transposed(b, &self.xf);
        let mut v = times(a, &self.xf) + times(b, &self.ff);
        let mut of_swell = SMatrix::zeros();
        if let Some(pushing) = step.pushing() {
            u += times_transposed(pushing, &self.xo);
            v += times_transposed(pushing, &self.fo);
            let with_navigation =
                times(a, &self.xo) + times(b, &self.fo) + times(pushing, &self.oo);
            of_swell = times_transposed(&with_navigation, pushing);
        }
        self.xx = times_transposed(&u, a) + times_transposed(&v, b) + of_swell + process.xx;
        for j in 0..N {
            for i in 0..M {
                self.xf[(i, j)] = v[(i, j)] * fade[j] + process.xf[(i, j)];
            }
            for i in 0..N {
                self.ff[(i, j)] = fade[i] * self.ff[(i, j)] * fade[j] + process.ff[(i, j)];
            }
        }
        // Rounding makes the matrix asymmetric. Measurements do not reduce the antisymmetric part,
        // and where motion is unstable, as with Munk's moment, it grows until variances are
        // negative.
        symmetrise(&mut self.xx);
        symmetrise(&mut self.ff);
    }
}

/// Replaces a matrix by the mean of itself and its transpose.
pub(super) fn symmetrise<const N: usize>(matrix: &mut SMatrix<f64, N, N>) {
    for j in 0..N {
        for i in 0..j {
            let mean = 0.5 * (matrix[(i, j)] + matrix[(j, i)]);
            matrix[(i, j)] = mean;
            matrix[(j, i)] = mean;
        }
    }
}

/// Transition matrices of a step.
pub(super) struct Transition<const N: usize, const M: usize, const K: usize> {
    pub(super) by_motion: SMatrix<f64, M, M>,
    pub(super) by_disturbance: SMatrix<f64, M, N>,
    pub(super) fade: SVector<f64, N>,
    /// Map of the navigation states; `None` where it is the identity.
    pub(super) rows: Option<Rows<M, K>>,
    /// Step of the current, after the other states; `None` if it does not vary.
    pub(super) current: Option<CurrentStep<M>>,
    /// Covariance that the jitter of thrust adds to motion; `None` where thrust does not change.
    pub(super) jitter: Option<Box<SMatrix<f64, M, M>>>,
}

impl<const N: usize, const M: usize, const K: usize> Transition<N, M, K> {
    /// Returns the change of motion by navigation states that push, if any.
    pub(super) fn pushing(&self) -> Option<&SMatrix<f64, M, K>> {
        self.rows.as_ref()?.pushing.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;

    use super::*;

    /// Sway and yaw under Munk's moment: one mode grows, another hardly decays. No measurement
    /// reduces the antisymmetric part of the covariance, which would grow as the product of both.
    #[test]
    fn covariance_stays_positive_definite_for_unstable_motion() {
        let (sin, cos) = 0.4_f64.sin_cos();
        let turn = Matrix2::new(cos, -sin, sin, cos);
        let step = Transition::<2, 2, 4> {
            by_motion: turn * Matrix2::new(1.03, 0.0, 0.0, 0.999) * turn.transpose(),
            by_disturbance: Matrix2::new(0.02, 0.003, 0.003, 0.04),
            fade: Vector2::new(0.99, 0.995),
            rows: None,
            current: None,
            jitter: None,
        };
        let mut process = Covariance::<2, 2, 4>::zeros(2);
        process.xx = Matrix2::identity() * 1e-8;
        process.ff = Matrix2::identity() * 1e-4;
        let mut covariance = Covariance::<2, 2, 4>::zeros(2);
        covariance.xx = Matrix2::identity() * 1e-4;
        covariance.ff = Matrix2::identity();
        for k in 0..5000 {
            covariance.predict(&step, &process, None);
            for axis in 0..2 {
                let (of, water) = (Observed::Velocity(axis), Vector2::zeros());
                let observation =
                    Observation { of, water, lever_terms: None, lagged: None, spread: 1.0 };
                let column = covariance.observed_by(&observation);
                let variance = column.observed_by(&observation) + 1e-5;
                covariance.subtract(&column.scaled(1.0 / variance), &column);
            }
            let smallest = covariance.xx.symmetric_eigenvalues().min();
            let skewness = (covariance.xx - covariance.xx.transpose()).amax();
            assert!(smallest > 0.0, "{k}: {smallest}");
            assert!(skewness < 1e-12 * covariance.xx.amax(), "{k}: {skewness}");
        }
    }
}
