//! Kalman filter of one trial. States: velocity through the water ν_r, a Gauss–Markov disturbance
//! force f on each axis, and the navigation states ([`navigation`]).
//!
//! ```text
//! ν̇_r = M⁻¹ (τ + f − n(ν_r, η)) − R(η)ᵀ ċ,   ḟ = −f/T + w,   ċ = −c/T_c + w_c,
//! y = ν_r + R(η)ᵀ (u_c + c) + ω × r + noise
//! ```
//!
//! Where waves push, f has a second part in a narrow band of frequencies ([`noise::Swell`]).
//! r is the lever arm of the sensor of a translation. The measurement model uses the state ω
//! instead of the gyroscope's sample: otherwise one noise would enter two measurements, and an
//! autopilot's command as well. A current that varies does not carry the vehicle along ([`current`]).
//!
//! The filter computes two kinds of derivatives: of the innovations by the plant's coefficients and
//! the current at fixed gains, which give the score of the likelihood at the true parameters; and
//! of the likelihood by disturbance and noise.

mod current;
mod follower;
mod jitter;
mod navigation;
mod noise;
mod reverse;
mod state;

use std::f64::consts::TAU;
use std::ops::Deref;

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::problem::PLACE;
use super::schedule::{Attitude, FilterInstant, Schedule};
use crate::Error;
use crate::motion::{
    Decay, Flow, HeldForces, Load, PUSHED_BY, Prepared, advance, with_down, with_places,
};
use crate::plant::Plant;
use follower::{Process, StepCache};
pub(super) use jitter::ThrustChanges;
use navigation::Ends;
pub(super) use navigation::{InstrumentNoise, Layout, MOST as MOST_NAVIGATION, Reading};
pub(super) use noise::{Drift, Noise, NoiseNumber, Swell};
use state::{Covariance, Observation, Observed, State, Transition};

/// A cost with its gradient and Fisher information.
#[derive(Clone, Debug)]
pub(super) struct Slope {
    pub(super) cost: f64,
    /// The part of the cost that depends on the plant at fixed gains: ½ Σ e²/S.
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
}

/// A sum of Fisher information, to which derivatives of innovations are added four at a time.
struct InformationSum {
    /// Its upper triangle.
    sum: DMatrix<f64>,
    /// Derivatives, divided by standard deviations, that are not in the sum yet.
    rows: Vec<f64>,
}

impl InformationSum {
    const AT_ONCE: usize = 4;

    fn zeros(count: usize) -> Self {
        let rows = Vec::with_capacity(Self::AT_ONCE * count);
        Self { sum: DMatrix::zeros(count, count), rows }
    }

    /// Adds an innovation of variance s with derivatives `by`.
    fn add(&mut self, s: f64, by: impl ExactSizeIterator<Item = f64>) {
        let (count, root) = (by.len(), s.sqrt());
        self.rows.extend(by.map(|x| x / root));
        if self.rows.len() == Self::AT_ONCE * count {
            self.add_rows();
        }
    }

    fn add_rows(&mut self) {
        let count = self.sum.nrows();
        self.rows.resize(Self::AT_ONCE * count, 0.0);
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| &self.rows[k * count..][..count]);
        for (i, column) in self.sum.as_mut_slice().chunks_exact_mut(count).enumerate() {
            let [of_a, of_b, of_c, of_d] = [a[i], b[i], c[i], d[i]];
            let rows = a.iter().zip(b).zip(c.iter().zip(d));
            for (entry, ((a, b), (c, d))) in column[..=i].iter_mut().zip(rows) {
                *entry += (of_a * a + of_b * b) + (of_c * c + of_d * d);
            }
        }
        self.rows.clear();
    }

    fn finished(mut self) -> DMatrix<f64> {
        if !self.rows.is_empty() {
            self.add_rows();
        }
        self.sum.fill_lower_triangle_with_upper_triangle();
        self.sum
    }
}

/// A Kalman gain and the variance of its innovation.
#[derive(Clone, Copy)]
struct Gain<const N: usize, const M: usize, const K: usize> {
    state: State<N, M, K>,
    variance: f64,
}

/// Kalman gains of all measurements of a pass, stored for passes at fixed gains.
pub(super) struct Gains {
    /// Negative log-likelihood of the pass.
    pub(super) cost: f64,
    /// Numbers by measurement: the gain of each state, and the variance of the innovation.
    stride: usize,
    numbers: Vec<f64>,
}

impl Gains {
    fn with_capacity<const N: usize, const M: usize>(states: usize, measurements: usize) -> Self {
        let stride = M + N + states + 1;
        Self { cost: 0.0, stride, numbers: Vec::with_capacity(stride * measurements) }
    }

    fn push<const N: usize, const M: usize, const K: usize>(&mut self, gain: &Gain<N, M, K>) {
        let state = &gain.state;
        self.numbers.extend_from_slice(state.motion.as_slice());
        self.numbers.extend_from_slice(state.disturbance.as_slice());
        self.numbers.extend_from_slice(&state.navigation[..state.count]);
        self.numbers.push(gain.variance);
    }

    /// Returns the gain of each state and the variance of the innovation, by measurement.
    fn each(&self) -> impl Iterator<Item = (&[f64], f64)> {
        let each = self.numbers.chunks_exact(self.stride);
        each.filter_map(|numbers| numbers.split_last()).map(|(variance, gain)| (gain, *variance))
    }
}

/// An innovation, for whiteness and outliers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Innovation {
    /// Index among the plant's axes; `None` where a better sensor supplies the innovations of the
    /// axis.
    pub(super) axis: Option<usize>,
    /// Index of the sensor's noise among the logarithms of the noise.
    pub(super) number: usize,
    /// Index of its instant in the schedule.
    pub(super) instant: usize,
    /// Innovation e, m/s or rad/s.
    pub(super) error: f64,
    /// Its variance S.
    pub(super) variance: f64,
}

impl Innovation {
    /// Returns e/√S.
    pub(super) fn normalised(&self) -> f64 {
        self.error / self.variance.sqrt()
    }
}

/// Velocity and force in a simulation without disturbances.
pub(super) struct DrivenState {
    /// By axis of the plant, m/s and rad/s.
    pub(super) velocity: Vec<f64>,
    /// Mean force since the instant before, N and N m, by axis of the plant.
    pub(super) force: Vec<f64>,
}

/// What a pass of the filter goes over.
#[derive(Clone, Copy)]
pub(super) struct PassInput<'a> {
    pub(super) schedule: &'a Schedule,
    /// Force over each slice of the schedule.
    pub(super) pushes: &'a HeldForces,
    /// Changes of thrust that may act at another time; `None` without jitter.
    pub(super) thrust_changes: Option<&'a ThrustChanges>,
    /// Mean current, north and east, m/s.
    pub(super) current: [f64; 2],
    pub(super) noise: &'a Noise,
    /// True for the actuator parameters by which derivatives are computed; by the others they are zero.
    pub(super) fits: [bool; PUSHED_BY],
}

/// The filter of a plant, whatever its number of axes.
pub(super) trait Filter: Sync {
    /// Returns a pass over a trial.
    fn pass<'a>(&'a self, input: PassInput<'a>) -> Box<dyn Pass + 'a>;
}

impl dyn Filter {
    /// Returns the filter of a plant under some sums of known forces.
    ///
    /// # Errors
    /// [`Error::Plant`] if the mass matrix is not positive definite.
    pub(super) fn of(
        plant: &Plant,
        loads: &[Load],
        attitude: Attitude,
    ) -> Result<Box<Self>, Error> {
        match attitude {
            Attitude::State => Ok(Box::new(SizedFilter::<6, 9>::new(plant, loads)?)),
            Attitude::Known => with_places!(plant.axes().len(), N => {
                Ok(Box::new(SizedFilter::<N, N>::new(plant, loads)?))
            }),
        }
    }
}

/// A filter of M states of motion and N disturbances.
struct SizedFilter<const N: usize, const M: usize> {
    plant: Prepared<N>,
}

impl<const N: usize, const M: usize> SizedFilter<N, M> {
    fn new(plant: &Plant, loads: &[Load]) -> Result<Self, Error> {
        Ok(Self { plant: Prepared::with_loads(plant, loads)? })
    }
}

impl<const N: usize, const M: usize> Filter for SizedFilter<N, M> {
    fn pass<'a>(&'a self, input: PassInput<'a>) -> Box<dyn Pass + 'a> {
        Box::new(SizedPass::<N, M> { plant: &self.plant, input })
    }
}

/// One pass of the filter over a trial at given parameters.
pub(super) trait Pass {
    /// Computes the negative log-likelihood, its gradient by coefficients, actuator and current,
    /// and the gains.
    fn by_plant(&self) -> (Slope, Gains);

    /// Computes the same gradient; returns its value so far after each `spacing_s` seconds and at the
    /// end.
    fn by_plant_at(&self, spacing_s: f64) -> Vec<DVector<f64>>;

    /// Computes the same gradient, followed by that by changes of the velocity sensor's delay,
    /// `∂e/∂d = ν̇`, of its lag if `lag_s` > 0, where ν̇ is filtered by the lag, of its lever arm,
    /// `∂e/∂r = −∂(ω × r)/∂r`, and of its misalignment, `∂e/∂θ = ∂(θ × y)/∂θ`.
    fn by_plant_and_report(&self, lag_s: f64) -> Slope;

    /// Computes ½ Σ e²/S at the gains of another pass: the cost whose gradient [`Self::by_plant`]
    /// returns.
    fn at_gains(&self, gains: &Gains) -> f64;

    /// Computes the negative log-likelihood.
    fn cost(&self) -> f64;

    /// Computes the innovations of all measurements.
    fn innovations(&self) -> Vec<Innovation>;

    /// Simulates the plant from its start without disturbances and measurements; returns a state for
    /// each instant of the schedule.
    fn driven_states(&self) -> Vec<DrivenState>;

    /// Computes the negative log-likelihood and its gradient by the logarithms of the noise.
    fn noise_gradient(&self) -> (f64, DVector<f64>);

    /// Computes the Fisher information of the logarithms of the noise.
    fn noise_information(&self) -> DMatrix<f64>;
}

/// A pass of a filter of M states of motion and N disturbances.
struct SizedPass<'a, const N: usize, const M: usize> {
    plant: &'a Prepared<N>,
    input: PassInput<'a>,
}

impl<'a, const N: usize, const M: usize> Deref for SizedPass<'a, N, M> {
    type Target = PassInput<'a>;

    fn deref(&self) -> &Self::Target {
        &self.input
    }
}

/// Calls a method of a pass with room for its navigation states, as matrices of the largest size would be
/// copied where hardly any state is in use: 4 for the current with a position, or with depth and heading; 14
/// for all instruments without waves, or for waves on six axes without these. Each size costs time to compile;
/// methods that have no such matrices do without.
macro_rules! with_room {
    ($pass:expr, $method:ident($($argument:expr),*)) => {
        match $pass.states() {
            ..=4 => Sweep::<'_, N, M, 4> { pass: $pass }.$method($($argument),*),
            5..=14 => Sweep::<'_, N, M, 14> { pass: $pass }.$method($($argument),*),
            _ => Sweep::<'_, N, M, MOST_NAVIGATION> { pass: $pass }.$method($($argument),*),
        }
    };
}

impl<const N: usize, const M: usize> SizedPass<'_, N, M> {
    /// Returns the number of navigation states in use.
    fn states(&self) -> usize {
        self.schedule.layout.count + self.noise.swell.as_ref().map_or(0, |_| 2 * self.noise.axes())
    }
}

impl<const N: usize, const M: usize> Pass for SizedPass<'_, N, M> {
    fn by_plant(&self) -> (Slope, Gains) {
        with_room!(self, sweep(f64::INFINITY, &mut |_| (), None))
    }

    fn by_plant_at(&self, spacing_s: f64) -> Vec<DVector<f64>> {
        let mut marks = Vec::new();
        with_room!(self, sweep(spacing_s, &mut |gradient| marks.push(gradient), None));
        marks
    }

    fn by_plant_and_report(&self, lag_s: f64) -> Slope {
        with_room!(self, sweep(f64::INFINITY, &mut |_| (), Some(lag_s))).0
    }

    fn at_gains(&self, gains: &Gains) -> f64 {
        Sweep::<'_, N, M, MOST_NAVIGATION> { pass: self }.at_gains(gains)
    }

    fn cost(&self) -> f64 {
        with_room!(self, cost(None))
    }

    fn innovations(&self) -> Vec<Innovation> {
        let mut innovations = Vec::with_capacity(self.schedule.samples());
        with_room!(self, cost(Some(&mut innovations)));
        innovations
    }

    fn driven_states(&self) -> Vec<DrivenState> {
        Sweep::<'_, N, M, MOST_NAVIGATION> { pass: self }.driven_states()
    }

    fn noise_gradient(&self) -> (f64, DVector<f64>) {
        with_room!(self, noise_gradient())
    }

    fn noise_information(&self) -> DMatrix<f64> {
        with_room!(self, noise_information())
    }
}

/// A pass with room for K navigation states.
struct Sweep<'a, const N: usize, const M: usize, const K: usize> {
    pass: &'a SizedPass<'a, N, M>,
}

impl<'a, const N: usize, const M: usize, const K: usize> Deref for Sweep<'a, N, M, K> {
    type Target = SizedPass<'a, N, M>;

    fn deref(&self) -> &Self::Target {
        self.pass
    }
}

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    fn sweep(
        &self,
        spacing_s: f64,
        at_mark: &mut dyn FnMut(DVector<f64>),
        lag_s: Option<f64>,
    ) -> (Slope, Gains) {
        let coefficients = self.plant.count();
        let mut gains = Gains::with_capacity::<N, M>(self.states(), self.schedule.samples());
        let parameters: Vec<usize> = (0..PUSHED_BY).filter(|k| self.fits[*k]).collect();
        let p = coefficients + parameters.len();
        let first = p + 2;
        // Indices of lever arm and misalignment: after delay and lag.
        let place = lag_s.map_or(first..first, |lag_s| {
            let after = first + if lag_s > 0.0 { 2 } else { 1 };
            after..after + PLACE
        });
        // That about the vertical axis is the last.
        let (count, turned) = (place.end, place.end - 1);
        // Among derivatives by all actuator parameters, those by the others are zero.
        let all = count + PUSHED_BY - parameters.len();
        let fitted = parameters.iter().map(|k| coefficients + k);
        let places: Vec<usize> =
            (0..coefficients).chain(fitted).chain(coefficients + PUSHED_BY..all).collect();
        let among_all = |own: &DVector<f64>| {
            let mut by = DVector::zeros(all);
            places.iter().zip(own.iter()).for_each(|(place, x)| by[*place] = *x);
            by
        };
        let (mut slope, mut information) = (Slope::zeros(count), InformationSum::zeros(count));
        let mut flow = Flow::of_plant(coefficients, &parameters);
        let (mut mean, mut covariance) = (self.initial_mean(), self.initial_covariance());
        let states = self.states();
        let mut by = vec![State::<N, M, K>::zeros(states); count];
        let mut row = vec![0.0; count];
        let (mut since_mark_s, mut steps) = (0.0, StepCache::default());
        let still = SVector::zeros();
        let mut behind = SVector::<f64, M>::zeros();
        for direction in 0..2 {
            let own = &mut by[p + direction];
            own.motion = -self.water_column(&self.schedule.instants[0], direction);
            self.start_lagged(&own.motion, &mut own.navigation);
        }
        for (k, own) in by[place.clone()].iter_mut().enumerate() {
            let first = &self.schedule.instants[0];
            own.motion = SVector::from_fn(|at, _| self.by_place(first, &mean.motion, at)[k]);
        }
        if let Some(north) = self.schedule.layout.position.filter(|_| !place.is_empty()) {
            let [x, y] = self.place_of_fixes(&mean);
            (by[turned].navigation[north], by[turned].navigation[north + 1]) = (-y, x);
        }
        for instant in &self.schedule.instants[1..] {
            let (before, fixed_before) = (mean.motion, self.place_of_fixes(&mean));
            let transition = self.predict(instant, &mut mean, &mut flow);
            let mut acceleration = (mean.motion - before) / instant.length_s;
            if let Some(lag_s) = lag_s {
                acceleration += self.of_turned_axes(instant, &mean.motion);
                behind = acceleration + (behind - acceleration) * (-instant.length_s / lag_s).exp();
            }
            let own = flow.by_plant().iter().chain(std::iter::repeat(&still));
            by.iter_mut().zip(own).for_each(|(state, own)| state.step(&transition, own));
            if let Some(north) = self.schedule.layout.position {
                (0..2).for_each(|k| by[p + k].navigation[north + k] += instant.length_s);
            }
            let crossed = covariance.crossed_if_needed(&transition);
            let process = steps.get(instant.length_s, |h| self.process(h));
            covariance.predict(&transition, process, crossed.as_ref());
            let fixed = self.place_of_fixes(&mean);
            for (observation, y) in self.measurements(instant) {
                let late = self.may_be_late(&observation).filter(|_| !place.is_empty());
                let by_place =
                    late.map_or([0.0; PLACE], |at| self.by_place(instant, &mean.motion, at));
                let (e, gain) = self.correct(&observation, y, &mut mean, &mut covariance);
                for (x, state) in row.iter_mut().zip(&by) {
                    *x = -state.observed_by(&observation);
                }
                row[p] -= observation.water[0];
                row[p + 1] -= observation.water[1];
                if let Some(k) = self.component_of_fix(&observation).filter(|_| lag_s.is_some()) {
                    row[first] += (fixed[k] - fixed_before[k]) / instant.length_s;
                    row[turned] += if k == 0 { -fixed[1] } else { fixed[0] };
                }
                if let Some(at) = late {
                    let late = [&acceleration, &behind].map(|of| observation.along(at, of));
                    row[first..place.start].iter_mut().zip(late).for_each(|(x, by)| *x += by);
                    row[place.clone()].iter_mut().zip(by_place).for_each(|(x, by)| *x += by);
                }
                row.iter().zip(&mut by).for_each(|(x, state)| state.add(&gain.state, *x));
                slope.cost += half_log(e, gain.variance);
                slope.misfit += 0.5 * e * e / gain.variance;
                let weighted = e / gain.variance;
                slope.gradient.iter_mut().zip(&row).for_each(|(sum, x)| *sum += weighted * x);
                information.add(gain.variance, row.iter().copied());
                gains.push(&gain);
            }
            for state in self.reset_states(instant) {
                by.iter_mut().chain([&mut mean]).for_each(|own| own.reset(state));
                covariance.reset(state);
            }
            since_mark_s += instant.length_s;
            if since_mark_s >= spacing_s {
                at_mark(among_all(&slope.gradient));
                since_mark_s = 0.0;
            }
        }
        slope.gradient = among_all(&slope.gradient);
        at_mark(slope.gradient.clone());
        let own = information.finished();
        slope.information = DMatrix::zeros(all, all);
        for (i, &row) in places.iter().enumerate() {
            for (j, &column) in places.iter().enumerate() {
                slope.information[(row, column)] = own[(i, j)];
            }
        }
        gains.cost = slope.cost;
        (finite(slope, &mean), gains)
    }

    fn at_gains(&self, gains: &Gains) -> f64 {
        let (mut mean, mut flow) = (self.initial_mean(), Flow::bare());
        let (mut cost, mut gains) = (0.0, gains.each());
        for instant in &self.schedule.instants[1..] {
            self.move_mean(instant, &mut mean, &mut flow);
            for (observation, y) in self.measurements(instant) {
                let Some((gain, variance)) = gains.next() else { return f64::INFINITY };
                let e = self.innovation(&observation, y, &mean);
                mean.add_gain(gain, e);
                cost += 0.5 * e * e / variance;
            }
            self.reset_states(instant).for_each(|state| mean.reset(state));
        }
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// Computes the negative log-likelihood, and appends the innovations where they are asked for.
    fn cost(&self, mut innovations: Option<&mut Vec<Innovation>>) -> f64 {
        let (mut mean, mut covariance) = (self.initial_mean(), self.initial_covariance());
        let (mut flow, mut cost, mut steps) = (Flow::of_state(), 0.0, StepCache::default());
        for (index, instant) in self.schedule.instants.iter().enumerate().skip(1) {
            let transition = self.predict(instant, &mut mean, &mut flow);
            let crossed = covariance.crossed_if_needed(&transition);
            let process = steps.get(instant.length_s, |h| self.process(h));
            covariance.predict(&transition, process, crossed.as_ref());
            for (observation, y) in self.measurements(instant) {
                let (e, gain) = self.correct(&observation, y, &mut mean, &mut covariance);
                cost += half_log(e, gain.variance);
                let Some(innovations) = &mut innovations else { continue };
                let axis = match observation.of {
                    Observed::Velocity(place) => Some(place),
                    Observed::Down(_) => continue,
                    Observed::Navigation { axis, .. } => axis.and_then(|axis| self.place_of(axis)),
                };
                let number = self.noise.place_of(&observation.of);
                let variance = gain.variance;
                innovations.push(Innovation { axis, number, instant: index, error: e, variance });
            }
            for state in self.reset_states(instant) {
                mean.reset(state);
                covariance.reset(state);
            }
        }
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    fn driven_states(&self) -> Vec<DrivenState> {
        let (mut mean, mut flow) = (self.initial_mean(), Flow::bare());
        let state = |motion: &SVector<f64, M>, force| DrivenState {
            velocity: motion.as_slice()[..self.noise.axes()].to_vec(),
            force,
        };
        let mut states = vec![state(&mean.motion, vec![0.0; self.noise.axes()])];
        for instant in &self.schedule.instants[1..] {
            self.move_mean(instant, &mut mean, &mut flow);
            let slices = &self.schedule.slices[instant.slices.clone()];
            let mut force = vec![0.0; self.noise.axes()];
            for (slice, push) in slices.iter().zip(self.pushes.over(instant.slices.clone())) {
                let part = slice.length_s / instant.length_s;
                force.iter_mut().zip(push.force).for_each(|(sum, own)| *sum += own * part);
            }
            states.push(state(&mean.motion, force));
        }
        states
    }

    fn noise_information(&self) -> DMatrix<f64> {
        let count = self.noise.count();
        let mut information = InformationSum::zeros(count);
        let (mut mean, mut covariance) = (self.initial_mean(), self.initial_covariance());
        let mut flow = Flow::of_state();
        let mut sensitivities = self.noise_sensitivities();
        let mut steps = StepCache::default();
        let mut measured = Vec::new();
        for instant in &self.schedule.instants[1..] {
            let (before, covariance_before) = (mean, covariance);
            let transition = self.predict(instant, &mut mean, &mut flow);
            let process = steps.get(instant.length_s, |h| Process::new(self, h));
            let crossed = covariance.crossed_if_needed(&transition);
            covariance.predict(&transition, &process.whole, crossed.as_ref());
            measured.clear();
            for (observation, y) in self.measurements(instant) {
                let (e, gain) = self.correct(&observation, y, &mut mean, &mut covariance);
                let own = self.noise.place_of(&observation.of);
                let column = gain.state.scaled(gain.variance);
                measured.push((observation, (e, gain.variance), own, column));
            }
            let mut rows = vec![[0.0; 2]; measured.len() * count];
            let of_numbers = sensitivities.iter_mut().zip(&process.changes).enumerate();
            for (k, (sensitivity, change)) in of_numbers {
                let nominal = (&covariance_before, crossed.as_ref());
                sensitivity.predict(&transition, nominal, &before, change);
                for (row, (observation, (e, s), own, column)) in measured.iter().enumerate() {
                    let noise = if k == *own { 2.0 * self.variance(observation) } else { 0.0 };
                    let (e_by, s_by) = sensitivity.correct(observation, (*e, *s), noise, column);
                    rows[row * count + k] = [e_by, s_by / s];
                }
            }
            for (row, (_, (_, s), ..)) in rows.chunks_exact(count).zip(&measured) {
                // The Fisher information of a variance is ½ S_i S_j / S².
                information.add(2.0, row.iter().map(|[_, by]| *by));
                information.add(*s, row.iter().map(|[by, _]| *by));
            }
            for state in self.reset_states(instant) {
                mean.reset(state);
                covariance.reset(state);
                for sensitivity in &mut sensitivities {
                    sensitivity.mean.reset(state);
                    sensitivity.covariance.reset(state);
                }
            }
        }
        information.finished()
    }

    fn initial_mean(&self) -> State<N, M, K> {
        let instant = &self.schedule.instants[0];
        let [north, east] = self.current;
        let velocity = self.plant.on_axes(&self.schedule.start);
        let still = with_down(&velocity, || self.schedule.start_down);
        let water = self.water_column(instant, 0) * north + self.water_column(instant, 1) * east;
        let mut first = State { motion: still - water, ..State::zeros(self.states()) };
        self.set_initial_navigation(&mut first);
        self.start_lagged(&first.motion, &mut first.navigation);
        first
    }

    /// Returns a zero covariance.
    fn zero_covariance(&self) -> Covariance<N, M, K> {
        Covariance::zeros(self.states())
    }

    /// Returns the navigation states that restart from zero after an instant.
    fn reset_states<'a>(
        &self,
        instant: &'a FilterInstant,
    ) -> impl Iterator<Item = usize> + use<'a, N, M, K> {
        instant.reset_states.iter().copied()
    }

    fn initial_covariance(&self) -> Covariance<N, M, K> {
        let initial_force = on_places(&self.noise.disturbance, |x| x * x, 0.0);
        let mut first = Covariance {
            xx: (0..self.noise.axes()).map(|place| self.initial_velocity_covariance(place)).sum(),
            ff: SMatrix::from_diagonal(&initial_force),
            ..self.zero_covariance()
        };
        self.set_initial_navigation_covariance(&mut first);
        if let Some(std) = self.noise.attitude {
            let of_down = self.initial_down_covariance() * std.powi(2);
            add_down_covariance(&mut first.xx, &of_down);
        }
        first.add_current(
            &self.by_current(&self.schedule.instants[0]),
            self.noise.of_water().std_m_s.powi(2),
        );
        first
    }

    /// Returns the initial covariance of motion from the noise of the first sample at an index.
    /// Noise of a rate also enters the translations of the origin, which are samples minus `ω × r`.
    fn initial_velocity_covariance(&self, place: usize) -> SMatrix<f64, M, M> {
        let mut by = SVector::<f64, M>::zeros();
        if !self.is_measured(place) {
            let axis = self.plant.axes()[place];
            by[place] = axis.map_or(0.0, |axis| self.schedule.start_std[axis]);
            return by * by.transpose();
        }
        by[place] = self.noise.velocity[place];
        for other in 0..self.noise.axes() {
            let lever_terms = self.lever_terms(other).into_iter().flatten();
            let own = lever_terms.filter(|(rate, _)| *rate == place);
            own.for_each(|(_, arm)| by[other] -= arm * self.noise.velocity[place]);
        }
        by * by.transpose()
    }

    /// Returns the initial covariance of the down vector k for unit attitude variance: `1 − k kᵀ`.
    fn initial_down_covariance(&self) -> Matrix3<f64> {
        let down = &self.schedule.start_down;
        Matrix3::identity() - down * down.transpose()
    }

    fn water_column(&self, instant: &FilterInstant, direction: usize) -> SVector<f64, M> {
        let axes = self.plant.axes();
        SVector::from_fn(|i, _| match axes.get(i) {
            Some(Some(axis @ 0..3)) => instant.water[(*axis, direction)],
            _ => 0.0,
        })
    }

    /// Computes `−∂(ω × r)/∂r`, 1/s, and `∂(θ × y)/∂θ`, m/s: the changes of the velocity of the origin at an
    /// index, as measured, by lever arm and misalignment. Uses only rates that are axes of the plant, as other
    /// measured rates may be noise alone. Returns 0 for a rotation, or for a translation differentiated from
    /// positions.
    fn by_place(
        &self,
        instant: &FilterInstant,
        motion: &SVector<f64, M>,
        at: usize,
    ) -> [f64; PLACE] {
        let Some(axis) = self.translation_measured(at) else { return [0.0; PLACE] };
        let moving = |axis: usize| self.place_of(axis).map_or(0.0, |at| motion[at]);
        let omega = Vector3::from_fn(|k, _| moving(3 + k));
        let read = Vector3::from_fn(|k, _| instant.measured[k].unwrap_or_else(|| moving(k)));
        let one = Vector3::from_fn(|k, _| if k == axis { 1.0 } else { 0.0 });
        // (ω × r)·a = r·(a × ω), and (θ × y)·a = θ·(y × a).
        let (by_lever, by_turn) = (-one.cross(&omega), read.cross(&one));
        std::array::from_fn(|k| if k < 3 { by_lever[k] } else { by_turn[k - 3] })
    }

    /// Returns the indices of the rates that the sensor of a translation also measures, with their
    /// lever arms, m.
    fn lever_terms(&self, place: usize) -> Option<[(usize, f64); 2]> {
        let axis: usize = self.plant.axes()[place]?;
        let r = self.schedule.levers_m.get(axis).filter(|r| **r != Vector3::zeros())?;
        // (ω × r)ᵢ = ωⱼ rₖ − ωₖ rⱼ
        let [j, k] = [(axis + 1) % 3, (axis + 2) % 3];
        let arm = |rate: usize, arm: f64| {
            self.place_of(3 + rate).map_or((place, 0.0), |rate| (rate, arm))
        };
        Some([arm(j, r[k]), arm(k, -r[j])])
    }

    /// Returns true if a sensor measures the velocity at an index.
    fn is_measured(&self, place: usize) -> bool {
        self.plant.axes()[place].is_none_or(|axis| self.schedule.is_measured[axis])
    }

    /// Returns ω × v along the translations, by which velocities along the world's axes change beside ν̇; zero where
    /// these are measured along the body's.
    fn of_turned_axes(&self, instant: &FilterInstant, motion: &SVector<f64, M>) -> SVector<f64, M> {
        let mut change = SVector::zeros();
        if !self.schedule.is_turned {
            return change;
        }
        let of = |axis: usize| self.place_of(axis).map_or(0.0, |place| motion[place]);
        let rate = Vector3::from_fn(|k, _| of(3 + k));
        let velocity = Vector3::from_fn(|k, _| instant.measured[k].unwrap_or_else(|| of(k)));
        let turning = rate.cross(&velocity);
        for axis in 0..3 {
            if let Some(place) = self.place_of(axis) {
                change[place] = turning[axis];
            }
        }
        change
    }

    /// Returns the index of an axis, given in SNAME order, among the plant's axes.
    fn place_of(&self, axis: usize) -> Option<usize> {
        self.plant.axes().iter().position(|own| *own == Some(axis))
    }

    /// Returns 0 of a measurement of the position north, and 1 of that east.
    fn component_of_fix(&self, observation: &Observation) -> Option<usize> {
        match observation.of {
            Observed::Navigation { state, number: InstrumentNoise::POSITION, .. } => {
                self.schedule.layout.position.map(|north| state - north)
            }
            _ => None,
        }
    }

    /// Returns the position north and east, m; zero where it is no state.
    fn place_of_fixes(&self, mean: &State<N, M, K>) -> [f64; 2] {
        let north = self.schedule.layout.position;
        north.map_or([0.0; 2], |north| [mean.navigation[north], mean.navigation[north + 1]])
    }

    /// Returns the index of a measured velocity that may be delayed.
    fn may_be_late(&self, observation: &Observation) -> Option<usize> {
        let Observed::Velocity(place) = observation.of else { return None };
        self.translation_measured(place).filter(|_| observation.lagged.is_none()).map(|_| place)
    }

    /// Returns the axis at an index if it is a translation with a velocity sensor.
    fn translation_measured(&self, place: usize) -> Option<usize> {
        let axis = self.plant.axes().get(place).copied().flatten()?;
        (axis < 3 && self.schedule.is_measured[axis]).then_some(axis)
    }

    /// Returns the measurements at an instant: velocities; where attitude is a state, the
    /// components of the down vector perpendicular to the measured one, which are zero; and
    /// navigation states.
    fn measurements<'a>(
        &self,
        instant: &'a FilterInstant,
    ) -> impl Iterator<Item = (Observation, f64)> + use<'a, N, M, K> {
        let axes = *self.plant.axes();
        let (measured, spread, water) = (instant.measured, instant.spread, instant.water);
        let lever_terms: [_; N] = std::array::from_fn(|place| self.lever_terms(place));
        let lagged = self.schedule.layout.lagged;
        let velocity = move |place: usize| {
            let axis: usize = axes[place]?;
            let water = match axis {
                0..3 => water.row(axis).transpose(),
                _ => Vector2::zeros(),
            };
            let (of, lagged) = (Observed::Velocity(place), lagged.get(axis).copied().flatten());
            let lever_terms = lever_terms[place].filter(|_| lagged.is_none());
            let observation = Observation { of, water, lever_terms, lagged, spread: spread[axis] };
            Some((observation, measured[axis]?))
        };
        let (across, spread) = (instant.across, instant.spread_across);
        let down = move |turn: usize| {
            let of = Observed::Down(across[turn]?);
            let water = Vector2::zeros();
            let spread = spread[turn];
            Some((Observation { of, water, lever_terms: None, lagged: None, spread }, 0.0))
        };
        let directions = if M > N { 2 } else { 0 };
        let navigation = |reading: &'a Reading| {
            let Reading { state, number, axis, value, spread } = *reading;
            let of = Observed::Navigation { state, number, axis };
            let water = Vector2::zeros();
            (Observation { of, water, lever_terms: None, lagged: None, spread }, value)
        };
        let navigation = instant.readings.iter().map(navigation);
        (0..N).filter_map(velocity).chain((0..directions).filter_map(down)).chain(navigation)
    }

    /// Returns the measurement noise variance, (m/s)², (rad/s)² or rad².
    fn variance(&self, observation: &Observation) -> f64 {
        let std = match observation.of {
            Observed::Velocity(place) => self.noise.velocity[place],
            Observed::Down(_) => self.noise.attitude.unwrap_or_default(),
            Observed::Navigation { number, .. } => self.noise.instruments.numbers[number],
        };
        std * std * observation.spread
    }

    /// Returns measurement minus prediction. Heading errors are wrapped to ±π: over a gap the
    /// vehicle may have turned further than an unwrapped log can show.
    fn innovation(&self, observation: &Observation, y: f64, mean: &State<N, M, K>) -> f64 {
        let [north, east] = self.current;
        let e = y
            - (mean.observed_by(observation)
                + (observation.water[0] * north + observation.water[1] * east));
        match observation.of {
            Observed::Navigation { number: InstrumentNoise::HEADING, .. } => wrapped(e),
            _ => e,
        }
    }

    fn move_mean(&self, instant: &FilterInstant, mean: &mut State<N, M, K>, flow: &mut Flow<N, M>) {
        let slices = &self.schedule.slices[instant.slices.clone()];
        let pushes = self.pushes.over(instant.slices.clone());
        let decay = Decay { rate: on_places(&self.noise.correlation_s, |t| 1.0 / t, 0.0) };
        let acting = self.acting(mean, instant.length_s);
        advance(self.plant, (slices, pushes), &mean.motion, &acting, &decay, flow);
        let ends = Ends { before: &mean.motion, after: &flow.motion };
        self.move_navigation(instant, &ends, &mut mean.navigation);
        mean.motion = flow.motion;
        mean.disturbance.component_mul_assign(&flow.left);
        self.current_step(instant).iter().for_each(|step| mean.step_current(step));
    }

    fn predict(
        &self,
        instant: &FilterInstant,
        mean: &mut State<N, M, K>,
        flow: &mut Flow<N, M>,
    ) -> Transition<N, M, K> {
        let before = mean.motion;
        self.move_mean(instant, mean, flow);
        let ends = Ends { before: &before, after: &flow.motion };
        let by_disturbance = flow.by_disturbance();
        Transition {
            by_motion: flow.by_motion(),
            by_disturbance,
            fade: flow.left,
            rows: self.rows(instant, &ends, &by_disturbance),
            current: self.current_step(instant),
            jitter: self.jitter(instant),
        }
    }

    fn fade(&self, h: f64) -> SVector<f64, N> {
        on_places(&self.noise.correlation_s, |t| (-h / t).exp(), 1.0)
    }

    fn correct(
        &self,
        observation: &Observation,
        y: f64,
        mean: &mut State<N, M, K>,
        covariance: &mut Covariance<N, M, K>,
    ) -> (f64, Gain<N, M, K>) {
        let e = self.innovation(observation, y, mean);
        let column = covariance.observed_by(observation);
        let variance = column.observed_by(observation) + self.variance(observation);
        let gain = Gain { state: column.scaled(1.0 / variance), variance };
        mean.add(&gain.state, e);
        covariance.subtract(&gain.state, &column);
        (e, gain)
    }
}

/// Returns a function of a number of each axis, with another value at places without an axis.
fn on_places<const N: usize>(
    of_axes: &DVector<f64>,
    function: impl Fn(f64) -> f64,
    other: f64,
) -> SVector<f64, N> {
    SVector::from_fn(|place, _| of_axes.get(place).map_or(other, |x| function(*x)))
}

/// Adds a covariance of the down vector to its block of the motion covariance.
fn add_down_covariance<const M: usize>(motion: &mut SMatrix<f64, M, M>, of_down: &Matrix3<f64>) {
    let mut own = motion.view_mut((M - 3, M - 3), (3, 3));
    own += of_down;
}

/// Wraps an angle to ±π, rad.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

fn half_log(e: f64, variance: f64) -> f64 {
    0.5 * (variance.ln() + e * e / variance)
}

fn finite<const N: usize, const M: usize, const K: usize>(
    mut slope: Slope,
    mean: &State<N, M, K>,
) -> Slope {
    if !(slope.cost.is_finite() && mean.motion.iter().all(|v| v.is_finite())) {
        slope.cost = f64::INFINITY;
    }
    slope
}

#[cfg(test)]
mod tests {
    use super::super::tests::{over, planar, record};
    use super::*;

    /// All that passes compute of a record, with room for K navigation states.
    fn with_room_for<const K: usize>(pass: &SizedPass<'_, 3, 3>) -> Vec<f64> {
        let sweep = Sweep::<3, 3, K> { pass };
        let (by_plant, gains) = sweep.sweep(f64::INFINITY, &mut |_| (), Some(0.2));
        let (_, by_noise) = sweep.noise_gradient();
        let mut innovations = Vec::new();
        let cost = sweep.cost(Some(&mut innovations));
        let mut all = vec![cost, sweep.at_gains(&gains)];
        all.extend(innovations.iter().flat_map(|own| [own.error, own.variance]));
        all.extend(by_plant.gradient.iter().chain(by_plant.information.iter()));
        all.extend(by_noise.iter().chain(sweep.noise_information().iter()));
        all
    }

    #[test]
    fn derivatives_by_some_actuator_parameters_are_those_among_all() {
        let plant = planar();
        let record = record(&plant, "a", 1, 20, 0.005);
        let filter = SizedFilter::<3, 3>::new(&plant, &[]).expect("three axes");
        over(&record, &plant, |input| {
            let some = std::array::from_fn(|k| k % 3 == 0);
            let pass = |fits| SizedPass::<3, 3> {
                plant: &filter.plant,
                input: PassInput { fits, ..input },
            };
            let (of_all, of_some) = (pass(input.fits).by_plant().0, pass(some).by_plant().0);
            let p = plant.coefficients().len();
            let is_some = |k: usize| k.checked_sub(p).and_then(|k| some.get(k)).is_none_or(|x| *x);
            for i in 0..of_all.gradient.len() {
                let expected = if is_some(i) { of_all.gradient[i] } else { 0.0 };
                assert_eq!(of_some.gradient[i], expected, "{i}");
                for j in 0..of_all.gradient.len() {
                    let is_some = is_some(i) && is_some(j);
                    let expected = if is_some { of_all.information[(i, j)] } else { 0.0 };
                    assert_eq!(of_some.information[(i, j)], expected, "{i}, {j}");
                }
            }
        });
    }

    #[test]
    fn room_for_more_navigation_states_changes_no_digit() {
        let plant = planar();
        let record = record(&plant, "a", 1, 20, 0.005);
        let filter = SizedFilter::<3, 3>::new(&plant, &[]).expect("three axes");
        over(&record, &plant, |input| {
            let pass = SizedPass { plant: &filter.plant, input };
            // The current, and waves on three axes.
            assert_eq!(pass.states(), 8);
            assert_eq!(with_room_for::<14>(&pass), with_room_for::<MOST_NAVIGATION>(&pass));
            let calm = Noise { swell: None, ..input.noise.clone() };
            let input = PassInput { noise: &calm, ..input };
            let pass = SizedPass { input, ..pass };
            assert_eq!(pass.states(), 2);
            assert_eq!(with_room_for::<4>(&pass), with_room_for::<MOST_NAVIGATION>(&pass));
        });
    }
}
