//! The Kalman filter of a trial: states ν_r and a Gauss–Markov force on each axis.
//!
//! ```text
//! ν̇_r = M⁻¹ (τ + f − n(ν_r, η)),   ḟ = −f/T + w,   y = ν_r + R(η)ᵀ u_c + noise
//! ```
//!
//! A constant current is no part of the dynamics of ν_r: it shows in the measurement only.
//! Two things are found of a trial: how the innovations change with the plant's coefficients
//! and the current at the gains of the filter as they are, which at the truth are what the
//! likelihood's slope consists of; and how the likelihood changes with the disturbance and
//! the noise.

use nalgebra::{DMatrix, DVector, SMatrix, SVector};

use super::schedule::{Schedule, Stop};
use crate::motion::{
    Decay, Flow, HeldForce, PUSHED_BY, Prepared, advance, apply, subtract_outer, times,
    times_transposed,
};
use crate::series::ROUNDING_S;

/// What stands beside the plant, by axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Noise<const N: usize> {
    /// Standard deviation of the disturbance, N or N m.
    pub(super) disturbance: SVector<f64, N>,
    /// Its correlation time, s.
    pub(super) correlation_s: SVector<f64, N>,
    /// Standard deviation of a sample of velocity, m/s or rad/s.
    pub(super) velocity: SVector<f64, N>,
}

impl<const N: usize> Noise<N> {
    /// How many numbers that is.
    pub(super) const COUNT: usize = 3 * N;

    /// Their logarithms, shape (3 N,).
    pub(super) fn logarithms(&self) -> DVector<f64> {
        let parts = [self.disturbance, self.correlation_s, self.velocity];
        DVector::from_fn(Self::COUNT, |k, _| parts[k / N][k % N].ln())
    }

    /// The numbers of such logarithms.
    pub(super) fn of(logarithms: &DVector<f64>) -> Self {
        let part = |k: usize| SVector::from_fn(|i, _| logarithms[k * N + i].exp());
        Self { disturbance: part(0), correlation_s: part(1), velocity: part(2) }
    }

    fn decay(&self) -> Decay<N> {
        Decay { rate: self.correlation_s.map(|t| 1.0 / t) }
    }
}

/// A cost with its slope and the Fisher information.
#[derive(Clone, Debug)]
pub(super) struct Slope {
    pub(super) cost: f64,
    /// What of the cost changes with the plant while the gains are kept: ½ Σ e²/S.
    pub(super) misfit: f64,
    pub(super) gradient: DVector<f64>,
    pub(super) information: DMatrix<f64>,
}

impl Slope {
    pub(super) fn zeros(count: usize) -> Self {
        Self {
            cost: 0.0,
            misfit: 0.0,
            gradient: DVector::zeros(count),
            information: DMatrix::zeros(count, count),
        }
    }

    /// Adds an innovation e of variance s whose derivatives are `by`.
    fn add(&mut self, e: f64, s: f64, by: &[f64]) {
        let columns = self.information.as_mut_slice().chunks_exact_mut(by.len());
        for ((i, &x), column) in by.iter().enumerate().zip(columns) {
            self.gradient[i] += e * x / s;
            let weighted = x / s;
            for (entry, &y) in column.iter_mut().zip(&by[..=i]) {
                *entry += weighted * y;
            }
        }
    }

    /// What [`Self::add`] leaves out: the lower half.
    fn mirror(&mut self) {
        for i in 0..self.gradient.len() {
            for j in 0..i {
                self.information[(i, j)] = self.information[(j, i)];
            }
        }
    }

    pub(super) fn plus(mut self, other: &Self) -> Self {
        self.cost += other.cost;
        self.misfit += other.misfit;
        self.gradient += &other.gradient;
        self.information += &other.information;
        self
    }
}

/// How a measurement moves the state: the gain of a filter, kept.
#[derive(Clone, Copy)]
pub(super) struct Gain<const N: usize> {
    velocity: SVector<f64, N>,
    disturbance: SVector<f64, N>,
    variance: f64,
}

/// An innovation, for whiteness and outliers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Innovation {
    /// Which of the plant's axes.
    pub(super) axis: usize,
    /// e/√S.
    pub(super) normalised: f64,
}

/// How far a trial depends on what is wanted of it.
pub(super) struct Pass<'a, const N: usize> {
    pub(super) plant: &'a Prepared<N>,
    pub(super) schedule: &'a Schedule,
    /// The force over each of its slices.
    pub(super) pushes: &'a [HeldForce],
    /// North and east, m/s.
    pub(super) current: [f64; 2],
    pub(super) noise: &'a Noise<N>,
}

/// Mean of the state.
#[derive(Clone, Copy)]
struct Mean<const N: usize> {
    velocity: SVector<f64, N>,
    disturbance: SVector<f64, N>,
}

/// Covariance of the state; `vf` is that of velocity (row) with disturbance (column).
#[derive(Clone, Copy)]
struct Covariance<const N: usize> {
    vv: SMatrix<f64, N, N>,
    vf: SMatrix<f64, N, N>,
    ff: SMatrix<f64, N, N>,
}

/// A step of the covariance: transition and process noise.
struct Transition<const N: usize> {
    by_velocity: SMatrix<f64, N, N>,
    by_disturbance: SMatrix<f64, N, N>,
    fade: SVector<f64, N>,
}

impl<const N: usize> Pass<'_, N> {
    /// ln-likelihood with its slope by coefficients, actuators and current, and the gains.
    pub(super) fn by_plant(&self) -> (Slope, Vec<Gain<N>>) {
        self.by_plant_at(f64::INFINITY, |_| ())
    }

    /// The same; `at_mark` is told the gradient so far after each `spacing_s`, and at the end.
    pub(super) fn by_plant_at(
        &self,
        spacing_s: f64,
        mut at_mark: impl FnMut(&DVector<f64>),
    ) -> (Slope, Vec<Gain<N>>) {
        let (coefficients, mut gains) =
            (self.plant.count(), Vec::with_capacity(self.schedule.samples()));
        let p = coefficients + PUSHED_BY;
        let mut slope = Slope::zeros(p + 2);
        let mut flow = Flow::of_plant(coefficients);
        let (mut mean, mut covariance) = (self.first_mean(), self.first_covariance());
        let mut by = vec![(SVector::<f64, N>::zeros(), SVector::<f64, N>::zeros()); p + 2];
        let mut row = vec![0.0; p + 2];
        let mut since_mark_s = 0.0;
        for direction in 0..2 {
            by[p + direction].0 = -self.water_column(&self.schedule.stops[0], direction);
        }
        for stop in &self.schedule.stops[1..] {
            let transition = self.predict(stop, &mut mean, &mut flow);
            for (k, (velocity, disturbance)) in by.iter_mut().enumerate() {
                *velocity = apply(&transition.by_velocity, velocity)
                    + apply(&transition.by_disturbance, disturbance);
                if k < p {
                    *velocity += flow.by_plant()[k];
                }
                disturbance.component_mul_assign(&transition.fade);
            }
            covariance.predict(&transition, &self.process(stop.length_s));
            for (axis, y) in self.measurements(stop) {
                let (e, gain) = self.correct(axis, y, stop, &mut mean, &mut covariance);
                for (k, (x, (velocity, _))) in row.iter_mut().zip(&by).enumerate() {
                    *x = -velocity[axis];
                    if k >= p {
                        *x -= self.water_column(stop, k - p)[axis];
                    }
                }
                for (x, (velocity, disturbance)) in row.iter().zip(&mut by) {
                    *velocity += gain.velocity * *x;
                    *disturbance += gain.disturbance * *x;
                }
                slope.cost += half_log(e, gain.variance);
                slope.misfit += 0.5 * e * e / gain.variance;
                slope.add(e, gain.variance, &row);
                gains.push(gain);
            }
            since_mark_s += stop.length_s;
            if since_mark_s >= spacing_s {
                at_mark(&slope.gradient);
                since_mark_s = 0.0;
            }
        }
        at_mark(&slope.gradient);
        slope.mirror();
        (finite(slope, &mean), gains)
    }

    /// ½ Σ e²/S with the gains of another pass: what the plant's slope is the slope of.
    pub(super) fn at_gains(&self, gains: &[Gain<N>]) -> f64 {
        let (mut mean, mut flow) = (self.first_mean(), Flow::bare());
        let (mut cost, mut gains) = (0.0, gains.iter());
        for stop in &self.schedule.stops[1..] {
            self.move_mean(stop, &mut mean, &mut flow);
            for (axis, y) in self.measurements(stop) {
                let Some(gain) = gains.next() else { return f64::INFINITY };
                let e = y - self.expected(axis, stop, &mean);
                mean.velocity += gain.velocity * e;
                mean.disturbance += gain.disturbance * e;
                cost += 0.5 * e * e / gain.variance;
            }
        }
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// The negative log-likelihood, and each innovation.
    pub(super) fn innovations(&self) -> (f64, Vec<Innovation>) {
        let (mut mean, mut covariance) = (self.first_mean(), self.first_covariance());
        let (mut flow, mut cost) = (Flow::of_state(), 0.0);
        let mut innovations = Vec::with_capacity(self.schedule.samples());
        for stop in &self.schedule.stops[1..] {
            let transition = self.predict(stop, &mut mean, &mut flow);
            covariance.predict(&transition, &self.process(stop.length_s));
            for (axis, y) in self.measurements(stop) {
                let (e, gain) = self.correct(axis, y, stop, &mut mean, &mut covariance);
                cost += half_log(e, gain.variance);
                let normalised = e / gain.variance.sqrt();
                innovations.push(Innovation { axis, normalised });
            }
        }
        (if cost.is_finite() { cost } else { f64::INFINITY }, innovations)
    }

    /// ln-likelihood with its slope by the logarithms of the noise.
    pub(super) fn by_noise(&self) -> Slope {
        let mut slope = Slope::zeros(Noise::<N>::COUNT);
        let (mut mean, mut covariance) = (self.first_mean(), self.first_covariance());
        let mut flow = Flow::of_state();
        let mut followers = self.noise_followers();
        let mut row = vec![0.0; Noise::<N>::COUNT];
        let mut variances = row.clone();
        let mut processes: Vec<Process<N>> = Vec::new();
        for stop in &self.schedule.stops[1..] {
            let before = mean;
            let transition = self.predict(stop, &mut mean, &mut flow);
            let process = self.process_over(stop.length_s, &mut processes);
            for (follower, change) in followers.iter_mut().zip(&process.changes) {
                follower.predict(&transition, &covariance, &before, change);
            }
            covariance.predict(&transition, &process.whole);
            for (axis, y) in self.measurements(stop) {
                let r = self.noise.velocity[axis].powi(2);
                let s = covariance.vv[(axis, axis)] + r;
                let e = y - self.expected(axis, stop, &mean);
                let column =
                    (covariance.vv.column(axis).into_owned(), covariance.vf.row(axis).transpose());
                for (k, follower) in followers.iter_mut().enumerate() {
                    let r_by = if k == 2 * N + axis { 2.0 * r } else { 0.0 };
                    let (e_by, s_by) = follower.correct(axis, e, s, r_by, &column);
                    row[k] = e_by;
                    variances[k] = s_by / s;
                    slope.gradient[k] += 0.5 * s_by / s * (1.0 - e * e / s);
                }
                // The information of a variance is ½ S_i S_j / S².
                slope.add(0.0, 2.0, &variances);
                slope.add(e, s, &row);
                slope.cost += half_log(e, s);
                self.correct(axis, y, stop, &mut mean, &mut covariance);
            }
        }
        slope.mirror();
        finite(slope, &mean)
    }

    fn first_mean(&self) -> Mean<N> {
        let stop = &self.schedule.stops[0];
        let water = self.water(stop);
        let velocity = self.plant.on_axes(&self.schedule.start) - water;
        Mean { velocity, disturbance: SVector::zeros() }
    }

    fn first_covariance(&self) -> Covariance<N> {
        let square = |x: &SVector<f64, N>| SMatrix::from_diagonal(&x.map(|x| x * x));
        Covariance {
            vv: square(&self.noise.velocity),
            vf: SMatrix::zeros(),
            ff: square(&self.noise.disturbance),
        }
    }

    /// The current's part of a measurement of each axis.
    fn water(&self, stop: &Stop) -> SVector<f64, N> {
        let [north, east] = self.current;
        self.water_column(stop, 0) * north + self.water_column(stop, 1) * east
    }

    fn water_column(&self, stop: &Stop, direction: usize) -> SVector<f64, N> {
        let axes = self.plant.axes();
        SVector::from_fn(|i, _| match axes[i] {
            Some(axis @ 0..3) => stop.water[(axis, direction)],
            _ => 0.0,
        })
    }

    /// What was measured at a stop, by place among the plant's axes.
    fn measurements(&self, stop: &Stop) -> impl Iterator<Item = (usize, f64)> {
        let axes = *self.plant.axes();
        let measured = stop.measured;
        (0..N).filter_map(move |place| Some((place, measured[axes[place]?]?)))
    }

    fn expected(&self, axis: usize, stop: &Stop, mean: &Mean<N>) -> f64 {
        mean.velocity[axis] + self.water(stop)[axis]
    }

    fn move_mean(&self, stop: &Stop, mean: &mut Mean<N>, flow: &mut Flow<N>) {
        let slices = &self.schedule.slices[stop.slices.clone()];
        let pushes = &self.pushes[stop.slices.clone()];
        let decay = self.noise.decay();
        advance(self.plant, (slices, pushes), &mean.velocity, &mean.disturbance, &decay, flow);
        mean.velocity = flow.velocity;
        mean.disturbance.component_mul_assign(&self.fade(stop.length_s));
    }

    fn predict(&self, stop: &Stop, mean: &mut Mean<N>, flow: &mut Flow<N>) -> Transition<N> {
        self.move_mean(stop, mean, flow);
        Transition {
            by_velocity: flow.by_velocity(),
            by_disturbance: flow.by_disturbance(),
            fade: self.fade(stop.length_s),
        }
    }

    fn fade(&self, h: f64) -> SVector<f64, N> {
        self.noise.correlation_s.map(|t| (-h / t).exp())
    }

    /// What one axis's disturbance adds to the covariance over a step.
    fn process_of(&self, axis: usize, h: f64) -> Covariance<N> {
        let (sigma, t) = (self.noise.disturbance[axis], self.noise.correlation_s[axis]);
        let q = 2.0 * sigma * sigma / t;
        let column = self.plant.inverse().column(axis).into_owned();
        let mut added = Covariance::zeros();
        added.vv = column * column.transpose() * (q * h * h * h / 3.0);
        added.vf.set_column(axis, &(column * (0.5 * q * h * h)));
        added.ff[(axis, axis)] = sigma * sigma * (1.0 - (-2.0 * h / t).exp());
        added
    }

    /// What all disturbances add to the covariance over a step.
    fn process(&self, h: f64) -> Covariance<N> {
        let mut sum = Covariance::zeros();
        (0..N).for_each(|axis| sum.add(&self.process_of(axis, h), 1.0));
        sum
    }

    /// A step of a length, from those that were met last.
    fn process_over<'a>(&self, length_s: f64, met: &'a mut Vec<Process<N>>) -> &'a Process<N> {
        let is_it = |process: &Process<N>| (process.length_s - length_s).abs() < ROUNDING_S;
        let at = met.iter().position(is_it).unwrap_or_else(|| {
            if met.len() == MOST_LENGTHS {
                met.clear();
            }
            met.push(Process::new(self, length_s));
            met.len() - 1
        });
        &met[at]
    }

    /// How the k-th logarithm of the noise changes a step.
    fn process_change(&self, k: usize, h: f64) -> Change<N> {
        let axis = k % N;
        let mut change = Change { process: Covariance::zeros(), fade: None };
        match k / N {
            0 => change.process.add(&self.process_of(axis, h), 2.0),
            1 => {
                let (sigma, t) = (self.noise.disturbance[axis], self.noise.correlation_s[axis]);
                let rho = self.fade(h)[axis];
                change.process.add(&self.process_of(axis, h), -1.0);
                let fade_by = rho * h / t;
                change.process.ff[(axis, axis)] = -2.0 * sigma * sigma * rho * fade_by;
                change.fade = Some(Fade { axis, by: fade_by, push: push_by(h / t) });
            }
            _ => {}
        }
        change
    }

    fn noise_followers(&self) -> Vec<Follower<N>> {
        let mut followers = vec![Follower::zeros(); Noise::<N>::COUNT];
        for axis in 0..N {
            followers[axis].covariance.ff[(axis, axis)] =
                2.0 * self.noise.disturbance[axis].powi(2);
            followers[2 * N + axis].covariance.vv[(axis, axis)] =
                2.0 * self.noise.velocity[axis].powi(2);
        }
        followers
    }

    fn correct(
        &self,
        axis: usize,
        y: f64,
        stop: &Stop,
        mean: &mut Mean<N>,
        covariance: &mut Covariance<N>,
    ) -> (f64, Gain<N>) {
        let e = y - self.expected(axis, stop, mean);
        let (vv, vf) =
            (covariance.vv.column(axis).into_owned(), covariance.vf.row(axis).transpose());
        let variance = vv[axis] + self.noise.velocity[axis].powi(2);
        let gain = Gain { velocity: vv / variance, disturbance: vf / variance, variance };
        mean.velocity += gain.velocity * e;
        mean.disturbance += gain.disturbance * e;
        subtract_outer(&mut covariance.vv, &gain.velocity, &vv);
        subtract_outer(&mut covariance.vf, &gain.velocity, &vf);
        subtract_outer(&mut covariance.ff, &gain.disturbance, &vf);
        (e, gain)
    }
}

fn half_log(e: f64, variance: f64) -> f64 {
    0.5 * (variance.ln() + e * e / variance)
}

fn finite<const N: usize>(mut slope: Slope, mean: &Mean<N>) -> Slope {
    if !(slope.cost.is_finite() && mean.velocity.iter().all(|v| v.is_finite())) {
        slope.cost = f64::INFINITY;
    }
    slope
}

impl<const N: usize> Covariance<N> {
    fn zeros() -> Self {
        Self { vv: SMatrix::zeros(), vf: SMatrix::zeros(), ff: SMatrix::zeros() }
    }

    fn add(&mut self, other: &Self, weight: f64) {
        self.vv += other.vv * weight;
        self.vf += other.vf * weight;
        self.ff += other.ff * weight;
    }

    /// Φ P Φᵀ + Q.
    fn predict(&mut self, step: &Transition<N>, process: &Self) {
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
    }
}

/// Steps of so many lengths are kept: instruments of different rates make few.
const MOST_LENGTHS: usize = 8;

/// What a step of a length adds to the covariance, and how the noise changes that.
struct Process<const N: usize> {
    length_s: f64,
    whole: Covariance<N>,
    changes: Vec<Change<N>>,
}

impl<const N: usize> Process<N> {
    fn new(pass: &Pass<'_, N>, length_s: f64) -> Self {
        let change = |k| pass.process_change(k, length_s);
        let changes = (0..Noise::<N>::COUNT).map(change).collect();
        Self { length_s, whole: pass.process(length_s), changes }
    }
}

/// How a step of the filter changes with one number of the noise.
struct Change<const N: usize> {
    process: Covariance<N>,
    fade: Option<Fade>,
}

/// An axis whose disturbance fades otherwise.
struct Fade {
    axis: usize,
    /// The change of what is left of it after a step.
    by: f64,
    /// The change of what it does to velocity, as a part of that.
    push: f64,
}

/// `d ln g/d ln T` of `g = ∫₀ʰ e^(−s/T) ds`, with x = h/T: how the push of a disturbance over a
/// step changes with its correlation time.
fn push_by(x: f64) -> f64 {
    if x < 1e-6 { 0.5 * x } else { 1.0 - x / x.exp_m1() }
}

/// How mean and covariance change with one number of the noise.
#[derive(Clone)]
struct Follower<const N: usize> {
    velocity: SVector<f64, N>,
    disturbance: SVector<f64, N>,
    covariance: Covariance<N>,
}

impl<const N: usize> Follower<N> {
    fn zeros() -> Self {
        Self {
            velocity: SVector::zeros(),
            disturbance: SVector::zeros(),
            covariance: Covariance::zeros(),
        }
    }

    fn predict(
        &mut self,
        step: &Transition<N>,
        covariance: &Covariance<N>,
        mean: &Mean<N>,
        change: &Change<N>,
    ) {
        self.covariance.predict(step, &change.process);
        self.velocity = apply(&step.by_velocity, &self.velocity)
            + apply(&step.by_disturbance, &self.disturbance);
        self.disturbance.component_mul_assign(&step.fade);
        if let Some(fade) = &change.fade {
            self.fade(fade, step, covariance, mean);
        }
    }

    fn fade(
        &mut self,
        fade: &Fade,
        step: &Transition<N>,
        covariance: &Covariance<N>,
        mean: &Mean<N>,
    ) {
        let axis = fade.axis;
        let push = step.by_disturbance.column(axis) * fade.push;
        self.velocity += push * mean.disturbance[axis];
        self.disturbance[axis] += fade.by * mean.disturbance[axis];
        let v =
            times(&step.by_velocity, &covariance.vf) + times(&step.by_disturbance, &covariance.ff);
        let own = v.column(axis).into_owned();
        self.covariance.vv += push * own.transpose() + own * push.transpose();
        self.covariance.vf +=
            push * covariance.ff.row(axis).transpose().component_mul(&step.fade).transpose();
        for i in 0..N {
            self.covariance.vf[(i, axis)] += own[i] * fade.by;
            let cross = covariance.ff[(i, axis)] * step.fade[i] * fade.by;
            self.covariance.ff[(i, axis)] += cross;
            self.covariance.ff[(axis, i)] += cross;
        }
    }

    /// The changes of innovation and its variance; then of the state.
    fn correct(
        &mut self,
        axis: usize,
        e: f64,
        s: f64,
        r_by: f64,
        (vv, vf): &(SVector<f64, N>, SVector<f64, N>),
    ) -> (f64, f64) {
        let vv_by = self.covariance.vv.column(axis).into_owned();
        let vf_by = self.covariance.vf.row(axis).transpose();
        let s_by = vv_by[axis] + r_by;
        let e_by = -self.velocity[axis];
        // K = c/S, so that ∂K = (∂c − K ∂S)/S and ∂(c cᵀ/S) = ∂K cᵀ + K ∂cᵀ.
        let (k_v, k_f) = (vv / s, vf / s);
        let (k_v_by, k_f_by) = ((vv_by - k_v * s_by) / s, (vf_by - k_f * s_by) / s);
        self.velocity += k_v_by * e + k_v * e_by;
        self.disturbance += k_f_by * e + k_f * e_by;
        subtract_outer(&mut self.covariance.vv, &k_v_by, vv);
        subtract_outer(&mut self.covariance.vv, &k_v, &vv_by);
        subtract_outer(&mut self.covariance.vf, &k_v_by, vf);
        subtract_outer(&mut self.covariance.vf, &k_v, &vf_by);
        subtract_outer(&mut self.covariance.ff, &k_f_by, vf);
        subtract_outer(&mut self.covariance.ff, &k_f, &vf_by);
        (e_by, s_by)
    }
}
