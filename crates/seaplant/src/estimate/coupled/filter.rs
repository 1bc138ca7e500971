//! The Kalman filter of a trial: states ν_r, a Gauss–Markov force on each axis, and what the current
//! is beside its mean.
//!
//! ```text
//! ν̇_r = M⁻¹ (τ + f − n(ν_r, η)),   ḟ = −f/T + w,   ċ = −c/T_c + w_c,
//! y = ν_r + R(η)ᵀ (u_c + c) + noise
//! ```
//!
//! A current is no part of the dynamics of ν_r: it shows in the measurement only. So it is of one
//! that changes, if the vehicle weighs what it displaces: water that accelerates takes it along.
//! Two things are found of a trial: how the innovations change with the plant's coefficients
//! and the current at the gains of the filter as they are, which at the truth are what the
//! likelihood's slope consists of; and how the likelihood changes with the disturbance and
//! the noise.

use nalgebra::{DMatrix, DVector, Matrix2, SMatrix, SVector, Vector2};

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
    /// How the current changes; none if it is constant.
    pub(super) drift: Option<Drift>,
}

/// How the current changes in the course of a trial: a Gauss–Markov velocity north, and one east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Drift {
    /// Standard deviation of each, m/s.
    pub(super) std_m_s: f64,
    /// Their correlation time, s.
    pub(super) correlation_s: f64,
}

impl Drift {
    /// One that never shows itself.
    const NONE: Self = Self { std_m_s: 0.0, correlation_s: f64::INFINITY };

    /// Too small to change what else is found: where it is asked whether more is likelier.
    pub(super) const TRIED: Self = Self { std_m_s: 1e-3, correlation_s: 60.0 };

    /// Where a fit begins with it.
    pub(super) const FIRST: Self = Self { std_m_s: 0.02, correlation_s: 60.0 };

    fn fade(&self, h: f64) -> f64 {
        (-h / self.correlation_s).exp()
    }

    /// What a step adds to the variance of each.
    fn process(&self, h: f64) -> f64 {
        self.std_m_s.powi(2) * (1.0 - self.fade(h).powi(2))
    }
}

impl<const N: usize> Noise<N> {
    /// Where the logarithms of the current's changes stand: standard deviation, correlation time.
    pub(super) const DRIFT: usize = 3 * N;

    /// How many numbers there are where the current changes.
    pub(super) const COUNT: usize = Self::DRIFT + 2;

    /// How many numbers there are.
    pub(super) const fn count(&self) -> usize {
        if self.drift.is_some() { Self::COUNT } else { Self::DRIFT }
    }

    /// Their logarithms, shape (3 N,) or (3 N + 2,).
    pub(super) fn logarithms(&self) -> DVector<f64> {
        let parts = [self.disturbance, self.correlation_s, self.velocity];
        let of_axes = parts.into_iter().flat_map(|part| part.map(f64::ln).data.0[0]);
        let of_water =
            self.drift.iter().flat_map(|drift| [drift.std_m_s.ln(), drift.correlation_s.ln()]);
        DVector::from_vec(of_axes.chain(of_water).collect())
    }

    /// The numbers of such logarithms.
    pub(super) fn of(logarithms: &DVector<f64>) -> Self {
        let part = |k: usize| SVector::from_fn(|i, _| logarithms[k * N + i].exp());
        let drift = (logarithms.len() > Self::DRIFT).then(|| Drift {
            std_m_s: logarithms[Self::DRIFT].exp(),
            correlation_s: logarithms[Self::DRIFT + 1].exp(),
        });
        Self { disturbance: part(0), correlation_s: part(1), velocity: part(2), drift }
    }

    fn of_water(&self) -> Drift {
        self.drift.unwrap_or(Drift::NONE)
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
    state: State<N>,
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

/// The state, or a change of it.
#[derive(Clone, Copy)]
struct State<const N: usize> {
    velocity: SVector<f64, N>,
    disturbance: SVector<f64, N>,
    /// What the current is beside its mean, north and east.
    water: Vector2<f64>,
}

impl<const N: usize> State<N> {
    fn zeros() -> Self {
        let zeros = SVector::zeros();
        Self { velocity: zeros, disturbance: zeros, water: Vector2::zeros() }
    }

    /// Adds x times another.
    fn add(&mut self, other: &Self, x: f64) {
        self.velocity += other.velocity * x;
        self.disturbance += other.disturbance * x;
        self.water += other.water * x;
    }

    fn scaled(&self, x: f64) -> Self {
        let mut scaled = Self::zeros();
        scaled.add(self, x);
        scaled
    }

    /// What a measurement sees of it.
    fn seen(&self, seen: &Seen) -> f64 {
        self.velocity[seen.axis] + seen.water.dot(&self.water)
    }

    /// A step; what else moves velocity is added to it.
    fn step(&mut self, step: &Transition<N>) {
        self.velocity = apply(&step.by_velocity, &self.velocity)
            + apply(&step.by_disturbance, &self.disturbance);
        self.disturbance.component_mul_assign(&step.fade);
        self.water *= step.fade_of_water;
    }
}

/// What a measurement of an axis is of: its own velocity, and this much of the current.
#[derive(Clone, Copy)]
struct Seen {
    axis: usize,
    water: Vector2<f64>,
}

/// Covariance of the state; `vf` is that of velocity (row) with disturbance (column), and w stands
/// for the water.
#[derive(Clone, Copy)]
struct Covariance<const N: usize> {
    vv: SMatrix<f64, N, N>,
    vf: SMatrix<f64, N, N>,
    ff: SMatrix<f64, N, N>,
    vw: SMatrix<f64, N, 2>,
    fw: SMatrix<f64, N, 2>,
    ww: Matrix2<f64>,
}

/// A step of the covariance: transition and process noise.
struct Transition<const N: usize> {
    by_velocity: SMatrix<f64, N, N>,
    by_disturbance: SMatrix<f64, N, N>,
    fade: SVector<f64, N>,
    fade_of_water: f64,
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
        let mut by = vec![State::<N>::zeros(); p + 2];
        let mut row = vec![0.0; p + 2];
        let mut since_mark_s = 0.0;
        for direction in 0..2 {
            by[p + direction].velocity = -self.water_column(&self.schedule.stops[0], direction);
        }
        for stop in &self.schedule.stops[1..] {
            let transition = self.predict(stop, &mut mean, &mut flow);
            by.iter_mut().for_each(|state| state.step(&transition));
            by.iter_mut().zip(flow.by_plant()).for_each(|(state, own)| state.velocity += own);
            covariance.predict(&transition, &self.process(stop.length_s));
            for (axis, y) in self.measurements(stop) {
                let (e, gain) = self.correct(axis, y, stop, &mut mean, &mut covariance);
                let seen = self.seen(axis, stop);
                for (x, state) in row.iter_mut().zip(&by) {
                    *x = -state.seen(&seen);
                }
                row[p] -= seen.water[0];
                row[p + 1] -= seen.water[1];
                row.iter().zip(&mut by).for_each(|(x, state)| state.add(&gain.state, *x));
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
                let e = y - self.expected(&self.seen(axis, stop), &mean);
                mean.add(&gain.state, e);
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
        let mut slope = Slope::zeros(self.noise.count());
        let (mut mean, mut covariance) = (self.first_mean(), self.first_covariance());
        let mut flow = Flow::of_state();
        let mut followers = self.noise_followers();
        let mut row = vec![0.0; self.noise.count()];
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
                let seen = self.seen(axis, stop);
                let column = covariance.seen(&seen);
                let s = column.seen(&seen) + r;
                let e = y - self.expected(&seen, &mean);
                for (k, follower) in followers.iter_mut().enumerate() {
                    let r_by = if k == 2 * N + axis { 2.0 * r } else { 0.0 };
                    let (e_by, s_by) = follower.correct(&seen, (e, s), r_by, &column);
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

    fn first_mean(&self) -> State<N> {
        let stop = &self.schedule.stops[0];
        let [north, east] = self.current;
        let water = self.water_column(stop, 0) * north + self.water_column(stop, 1) * east;
        let velocity = self.plant.on_axes(&self.schedule.start) - water;
        State { velocity, ..State::zeros() }
    }

    fn first_covariance(&self) -> Covariance<N> {
        let square = |x: &SVector<f64, N>| SMatrix::from_diagonal(&x.map(|x| x * x));
        let mut first = Covariance {
            vv: square(&self.noise.velocity),
            ff: square(&self.noise.disturbance),
            ..Covariance::zeros()
        };
        first.of_first_water(&self.first_water(), self.noise.of_water().std_m_s.powi(2));
        first
    }

    /// The current's part of the first measurement, shape (N, 2).
    fn first_water(&self) -> SMatrix<f64, N, 2> {
        let stop = &self.schedule.stops[0];
        SMatrix::from_columns(&[self.water_column(stop, 0), self.water_column(stop, 1)])
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

    fn seen(&self, axis: usize, stop: &Stop) -> Seen {
        let water = match self.plant.axes()[axis] {
            Some(of @ 0..3) => stop.water.row(of).transpose(),
            _ => Vector2::zeros(),
        };
        Seen { axis, water }
    }

    fn expected(&self, seen: &Seen, mean: &State<N>) -> f64 {
        let [north, east] = self.current;
        mean.seen(seen) + (seen.water[0] * north + seen.water[1] * east)
    }

    fn move_mean(&self, stop: &Stop, mean: &mut State<N>, flow: &mut Flow<N>) {
        let slices = &self.schedule.slices[stop.slices.clone()];
        let pushes = &self.pushes[stop.slices.clone()];
        let decay = self.noise.decay();
        advance(self.plant, (slices, pushes), &mean.velocity, &mean.disturbance, &decay, flow);
        mean.velocity = flow.velocity;
        mean.disturbance.component_mul_assign(&self.fade(stop.length_s));
        mean.water *= self.noise.of_water().fade(stop.length_s);
    }

    fn predict(&self, stop: &Stop, mean: &mut State<N>, flow: &mut Flow<N>) -> Transition<N> {
        self.move_mean(stop, mean, flow);
        Transition {
            by_velocity: flow.by_velocity(),
            by_disturbance: flow.by_disturbance(),
            fade: self.fade(stop.length_s),
            fade_of_water: self.noise.of_water().fade(stop.length_s),
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
        sum.ww = Matrix2::identity() * self.noise.of_water().process(h);
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
        let mut change = Change { process: Covariance::zeros(), fade: None, fade_of_water: 0.0 };
        if let Some(of_drift) = k.checked_sub(Noise::<N>::DRIFT) {
            let drift = self.noise.of_water();
            let by = match of_drift {
                0 => 2.0 * drift.process(h),
                _ => {
                    let rho = drift.fade(h);
                    change.fade_of_water = rho * h / drift.correlation_s;
                    -2.0 * drift.std_m_s.powi(2) * rho * change.fade_of_water
                }
            };
            change.process.ww = Matrix2::identity() * by;
            return change;
        }
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
        let mut followers = vec![Follower::zeros(); self.noise.count()];
        if let Some(drift) = self.noise.drift {
            let by = 2.0 * drift.std_m_s.powi(2);
            followers[Noise::<N>::DRIFT].covariance.of_first_water(&self.first_water(), by);
        }
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
        mean: &mut State<N>,
        covariance: &mut Covariance<N>,
    ) -> (f64, Gain<N>) {
        let seen = self.seen(axis, stop);
        let e = y - self.expected(&seen, mean);
        let column = covariance.seen(&seen);
        let variance = column.seen(&seen) + self.noise.velocity[axis].powi(2);
        let gain = Gain { state: column.scaled(1.0 / variance), variance };
        mean.add(&gain.state, e);
        covariance.subtract(&gain.state, &column);
        (e, gain)
    }
}

fn half_log(e: f64, variance: f64) -> f64 {
    0.5 * (variance.ln() + e * e / variance)
}

fn finite<const N: usize>(mut slope: Slope, mean: &State<N>) -> Slope {
    if !(slope.cost.is_finite() && mean.velocity.iter().all(|v| v.is_finite())) {
        slope.cost = f64::INFINITY;
    }
    slope
}

impl<const N: usize> Covariance<N> {
    fn zeros() -> Self {
        let (zeros, of_water) = (SMatrix::zeros(), SMatrix::zeros());
        let ww = Matrix2::zeros();
        Self { vv: zeros, vf: zeros, ff: zeros, vw: of_water, fw: of_water, ww }
    }

    /// Adds what a variance of the current makes of a velocity through water that was measured over
    /// ground: `ν_r = y − W c`.
    fn of_first_water(&mut self, water: &SMatrix<f64, N, 2>, variance: f64) {
        self.vv += water * water.transpose() * variance;
        self.vw -= water * variance;
        self.ww += Matrix2::identity() * variance;
    }

    /// The covariance of the state with what a measurement sees of it.
    fn seen(&self, seen: &Seen) -> State<N> {
        let axis = seen.axis;
        State {
            velocity: self.vv.column(axis) + self.vw * seen.water,
            disturbance: self.vf.row(axis).transpose() + self.fw * seen.water,
            water: self.vw.row(axis).transpose() + self.ww * seen.water,
        }
    }

    /// Less `a bᵀ`.
    fn subtract(&mut self, a: &State<N>, b: &State<N>) {
        subtract_outer(&mut self.vv, &a.velocity, &b.velocity);
        subtract_outer(&mut self.vf, &a.velocity, &b.disturbance);
        subtract_outer(&mut self.ff, &a.disturbance, &b.disturbance);
        self.vw -= a.velocity * b.water.transpose();
        self.fw -= a.disturbance * b.water.transpose();
        self.ww -= a.water * b.water.transpose();
    }

    fn add(&mut self, other: &Self, weight: f64) {
        self.vv += other.vv * weight;
        self.vf += other.vf * weight;
        self.ff += other.ff * weight;
        self.ww += other.ww * weight;
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
        self.predict_water(step, process);
    }

    fn predict_water(&mut self, step: &Transition<N>, process: &Self) {
        let rho = step.fade_of_water;
        self.vw = (step.by_velocity * self.vw + step.by_disturbance * self.fw) * rho;
        for j in 0..2 {
            let faded = self.fw.column(j).component_mul(&step.fade) * rho;
            self.fw.set_column(j, &faded);
        }
        self.ww = self.ww * (rho * rho) + process.ww;
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
        let changes = (0..pass.noise.count()).map(change).collect();
        Self { length_s, whole: pass.process(length_s), changes }
    }
}

/// How a step of the filter changes with one number of the noise.
struct Change<const N: usize> {
    process: Covariance<N>,
    fade: Option<Fade>,
    /// The change of what is left of the current's changes after a step.
    fade_of_water: f64,
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
    mean: State<N>,
    covariance: Covariance<N>,
}

impl<const N: usize> Follower<N> {
    fn zeros() -> Self {
        Self { mean: State::zeros(), covariance: Covariance::zeros() }
    }

    fn predict(
        &mut self,
        step: &Transition<N>,
        covariance: &Covariance<N>,
        mean: &State<N>,
        change: &Change<N>,
    ) {
        self.covariance.predict(step, &change.process);
        self.mean.step(step);
        if let Some(fade) = &change.fade {
            self.fade(fade, step, covariance, mean);
        }
        if change.fade_of_water > 0.0 {
            self.fade_water(change.fade_of_water, step, covariance, mean);
        }
    }

    fn fade_water(
        &mut self,
        by: f64,
        step: &Transition<N>,
        covariance: &Covariance<N>,
        mean: &State<N>,
    ) {
        self.mean.water += mean.water * by;
        let own = step.by_velocity * covariance.vw + step.by_disturbance * covariance.fw;
        self.covariance.vw += own * by;
        for j in 0..2 {
            let faded = covariance.fw.column(j).component_mul(&step.fade) * by;
            self.covariance.fw.set_column(j, &(self.covariance.fw.column(j) + faded));
        }
        self.covariance.ww += covariance.ww * (2.0 * step.fade_of_water * by);
    }

    fn fade(
        &mut self,
        fade: &Fade,
        step: &Transition<N>,
        covariance: &Covariance<N>,
        mean: &State<N>,
    ) {
        let axis = fade.axis;
        let push = step.by_disturbance.column(axis) * fade.push;
        self.mean.velocity += push * mean.disturbance[axis];
        self.mean.disturbance[axis] += fade.by * mean.disturbance[axis];
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
        self.covariance.vw += push * covariance.fw.row(axis) * step.fade_of_water;
        let own = covariance.fw.row(axis) * (fade.by * step.fade_of_water);
        self.covariance.fw.set_row(axis, &(self.covariance.fw.row(axis) + own));
    }

    /// The changes of innovation and its variance; then of the state.
    fn correct(
        &mut self,
        seen: &Seen,
        (e, s): (f64, f64),
        r_by: f64,
        column: &State<N>,
    ) -> (f64, f64) {
        let column_by = self.covariance.seen(seen);
        let s_by = column_by.seen(seen) + r_by;
        let e_by = -self.mean.seen(seen);
        // K = c/S, so that ∂K = (∂c − K ∂S)/S and ∂(c cᵀ/S) = ∂K cᵀ + K ∂cᵀ.
        let gain = column.scaled(1.0 / s);
        let mut gain_by = column_by.scaled(1.0 / s);
        gain_by.add(&gain, -s_by / s);
        self.mean.add(&gain_by, e);
        self.mean.add(&gain, e_by);
        self.covariance.subtract(&gain_by, column);
        self.covariance.subtract(&gain, &column_by);
        (e_by, s_by)
    }
}
