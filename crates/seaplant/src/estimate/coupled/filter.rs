//! The Kalman filter of a trial: states ν_r, a Gauss–Markov force on each axis, and what motion
//! drives ([`navigation`]).
//!
//! ```text
//! ν̇_r = M⁻¹ (τ + f − n(ν_r, η)),   ḟ = −f/T + w,   ċ = −c/T_c + w_c,
//! y = ν_r + R(η)ᵀ (u_c + c) + ω × r + noise
//! ```
//!
//! with r where the instrument of a translation sits. It sees ω as it is, not as a gyroscope reads it:
//! taken from readings of both, the gyroscope's noise would be in two of them, and in what an autopilot
//! makes of it.
//! A current is no part of the dynamics of ν_r: it shows in the measurement only. So it is of one
//! that changes, if the vehicle weighs what it displaces: water that accelerates takes it along.
//! Two things are found of a trial: how the innovations change with the plant's coefficients
//! and the current at the gains of the filter as they are, which at the truth are what the
//! likelihood's slope consists of; and how the likelihood changes with the disturbance and
//! the noise.

mod follower;
mod navigation;
mod noise;
mod state;

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector, Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::schedule::{Schedule, Stop};
use crate::motion::{Flow, HeldForce, PUSHED_BY, Prepared, advance, with_down};
use follower::{Process, Steps};
use navigation::Ends;
pub(super) use navigation::{InstrumentNoise, Layout, MOST as MOST_NAVIGATION, Reading};
pub(super) use noise::{Drift, Noise};
use state::{Covariance, Of, Seen, State, Transition};

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
pub(super) struct Gain<const N: usize, const M: usize> {
    state: State<N, M>,
    variance: f64,
}

/// An innovation, for whiteness and outliers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Innovation {
    /// Which of the plant's axes; none where an axis has innovations of a better instrument.
    pub(super) axis: Option<usize>,
    /// Which number of the noise its instrument has.
    pub(super) number: usize,
    /// e, m/s or rad/s.
    pub(super) error: f64,
    /// S.
    pub(super) variance: f64,
}

impl Innovation {
    /// e/√S.
    pub(super) fn normalised(&self) -> f64 {
        self.error / self.variance.sqrt()
    }
}

/// How far a trial depends on what is wanted of it.
pub(super) struct Pass<'a, const N: usize, const M: usize> {
    pub(super) plant: &'a Prepared<N>,
    pub(super) schedule: &'a Schedule,
    /// The force over each of its slices.
    pub(super) pushes: &'a [HeldForce],
    /// North and east, m/s.
    pub(super) current: [f64; 2],
    pub(super) noise: &'a Noise<N, M>,
}

impl<const N: usize, const M: usize> Pass<'_, N, M> {
    /// ln-likelihood with its slope by coefficients, actuators and current, and the gains.
    pub(super) fn by_plant(&self) -> (Slope, Vec<Gain<N, M>>) {
        self.sweep(f64::INFINITY, |_| (), None)
    }

    /// The same; `at_mark` is told the gradient so far after each `spacing_s`, and at the end.
    pub(super) fn by_plant_at(&self, spacing_s: f64, at_mark: impl FnMut(&DVector<f64>)) {
        self.sweep(spacing_s, at_mark, None);
    }

    /// The same slope, and last that by how translations are reported, of what is already taken away:
    /// by their delay, `∂e/∂d = ν̇`, by their lag if there is one, for which that is behind the lag, and
    /// by where they are measured, `∂e/∂r = −∂(ω × r)/∂r`.
    pub(super) fn by_plant_and_report(&self, lag_s: f64) -> Slope {
        self.sweep(f64::INFINITY, |_| (), Some(lag_s)).0
    }

    fn sweep(
        &self,
        spacing_s: f64,
        mut at_mark: impl FnMut(&DVector<f64>),
        lag_s: Option<f64>,
    ) -> (Slope, Vec<Gain<N, M>>) {
        let (coefficients, mut gains) =
            (self.plant.count(), Vec::with_capacity(self.schedule.samples()));
        let p = coefficients + PUSHED_BY;
        let first = p + 2;
        // Where the levers stand: behind delay and lag.
        let levers = lag_s.map_or(first..first, |lag_s| {
            let after = first + if lag_s > 0.0 { 2 } else { 1 };
            after..after + 3
        });
        let count = levers.end;
        let mut slope = Slope::zeros(count);
        let mut flow = Flow::of_plant(coefficients);
        let (mut mean, mut covariance) = (self.first_mean(), self.first_covariance());
        let states = self.schedule.layout.count;
        let mut by = vec![State::<N, M>::zeros(states); count];
        let mut row = vec![0.0; count];
        let (mut since_mark_s, mut steps) = (0.0, Steps::default());
        let still = SVector::zeros();
        let (lag_s, mut behind) = (lag_s.unwrap_or_default(), SVector::<f64, M>::zeros());
        for direction in 0..2 {
            by[p + direction].motion = -self.water_column(&self.schedule.stops[0], direction);
        }
        for (along, k) in levers.clone().enumerate() {
            by[k].motion = SVector::from_fn(|place, _| -self.turning(&mean.motion, place, along));
        }
        for stop in &self.schedule.stops[1..] {
            let before = mean.motion;
            let transition = self.predict(stop, &mut mean, &mut flow);
            let acceleration = (mean.motion - before) / stop.length_s;
            behind = acceleration + (behind - acceleration) * (-stop.length_s / lag_s).exp();
            let own = flow.by_plant().iter().chain(std::iter::repeat(&still));
            by.iter_mut().zip(own).for_each(|(state, own)| state.step(&transition, own));
            if let Some(north) = self.schedule.layout.position {
                (0..2).for_each(|k| by[p + k].navigation[north + k] += stop.length_s);
            }
            let crossed = covariance.crossed_over(&transition);
            let process = steps.of(stop.length_s, |h| self.process(h));
            covariance.predict(&transition, process, crossed.as_ref());
            for (seen, y) in self.measurements(stop) {
                let turning = self.may_be_late(&seen).filter(|_| !levers.is_empty());
                let turning = turning.map_or([0.0; 3], |place| {
                    [0, 1, 2].map(|along| self.turning(&mean.motion, place, along))
                });
                let (e, gain) = self.correct(&seen, y, &mut mean, &mut covariance);
                for (x, state) in row.iter_mut().zip(&by) {
                    *x = -state.seen(&seen);
                }
                row[p] -= seen.water[0];
                row[p + 1] -= seen.water[1];
                if let Some(place) = self.may_be_late(&seen) {
                    let late = [&acceleration, &behind].map(|of| seen.along(place, of));
                    row[first..levers.start].iter_mut().zip(late).for_each(|(x, by)| *x += by);
                    row[levers.clone()].iter_mut().zip(turning).for_each(|(x, by)| *x -= by);
                }
                row.iter().zip(&mut by).for_each(|(x, state)| state.add(&gain.state, *x));
                slope.cost += half_log(e, gain.variance);
                slope.misfit += 0.5 * e * e / gain.variance;
                slope.add(e, gain.variance, &row);
                gains.push(gain);
            }
            for state in self.begun(stop) {
                by.iter_mut().chain([&mut mean]).for_each(|own| own.forget(state));
                covariance.forget(state);
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
    pub(super) fn at_gains(&self, gains: &[Gain<N, M>]) -> f64 {
        let (mut mean, mut flow) = (self.first_mean(), Flow::bare());
        let (mut cost, mut gains) = (0.0, gains.iter());
        for stop in &self.schedule.stops[1..] {
            self.move_mean(stop, &mut mean, &mut flow);
            for (seen, y) in self.measurements(stop) {
                let Some(gain) = gains.next() else { return f64::INFINITY };
                let e = self.innovation(&seen, y, &mean);
                mean.add(&gain.state, e);
                cost += 0.5 * e * e / gain.variance;
            }
            self.begun(stop).for_each(|state| mean.forget(state));
        }
        if cost.is_finite() { cost } else { f64::INFINITY }
    }

    /// The negative log-likelihood, and each innovation.
    pub(super) fn innovations(&self) -> (f64, Vec<Innovation>) {
        let (mut mean, mut covariance) = (self.first_mean(), self.first_covariance());
        let (mut flow, mut cost, mut steps) = (Flow::of_state(), 0.0, Steps::default());
        let mut innovations = Vec::with_capacity(self.schedule.samples());
        for stop in &self.schedule.stops[1..] {
            let transition = self.predict(stop, &mut mean, &mut flow);
            let crossed = covariance.crossed_over(&transition);
            let process = steps.of(stop.length_s, |h| self.process(h));
            covariance.predict(&transition, process, crossed.as_ref());
            for (seen, y) in self.measurements(stop) {
                let (e, gain) = self.correct(&seen, y, &mut mean, &mut covariance);
                cost += half_log(e, gain.variance);
                let axis = match seen.of {
                    Of::Velocity(place) => Some(place),
                    Of::Down(_) => continue,
                    Of::Navigation { axis, .. } => axis.and_then(|axis| self.place_of(axis)),
                };
                let number = self.noise.place_of(&seen.of);
                innovations.push(Innovation { axis, number, error: e, variance: gain.variance });
            }
            for state in self.begun(stop) {
                mean.forget(state);
                covariance.forget(state);
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
        let mut steps = Steps::default();
        for stop in &self.schedule.stops[1..] {
            let before = mean;
            let transition = self.predict(stop, &mut mean, &mut flow);
            let process = steps.of(stop.length_s, |h| Process::new(self, h));
            let crossed = covariance.crossed_over(&transition);
            for (follower, change) in followers.iter_mut().zip(&process.changes) {
                follower.predict(&transition, (&covariance, crossed.as_ref()), &before, change);
            }
            covariance.predict(&transition, &process.whole, crossed.as_ref());
            for (seen, y) in self.measurements(stop) {
                let r = self.variance(&seen);
                let own = self.noise.place_of(&seen.of);
                let column = covariance.seen(&seen);
                let s = column.seen(&seen) + r;
                let e = self.innovation(&seen, y, &mean);
                for (k, follower) in followers.iter_mut().enumerate() {
                    let r_by = if k == own { 2.0 * r } else { 0.0 };
                    let (e_by, s_by) = follower.correct(&seen, (e, s), r_by, &column);
                    row[k] = e_by;
                    variances[k] = s_by / s;
                    slope.gradient[k] += 0.5 * s_by / s * (1.0 - e * e / s);
                }
                // The information of a variance is ½ S_i S_j / S².
                slope.add(0.0, 2.0, &variances);
                slope.add(e, s, &row);
                slope.cost += half_log(e, s);
                self.correct(&seen, y, &mut mean, &mut covariance);
            }
            for state in self.begun(stop) {
                mean.forget(state);
                covariance.forget(state);
                for follower in &mut followers {
                    follower.mean.forget(state);
                    follower.covariance.forget(state);
                }
            }
        }
        slope.mirror();
        finite(slope, &mean)
    }

    fn first_mean(&self) -> State<N, M> {
        let stop = &self.schedule.stops[0];
        let [north, east] = self.current;
        let velocity = self.plant.on_axes(&self.schedule.start);
        let still = with_down(&velocity, || self.schedule.start_down);
        let water = self.water_column(stop, 0) * north + self.water_column(stop, 1) * east;
        let mut first = State { motion: still - water, ..State::zeros(self.schedule.layout.count) };
        self.first_navigation(&mut first);
        first
    }

    /// A covariance of nothing.
    fn no_covariance(&self) -> Covariance<N, M> {
        Covariance::zeros(self.schedule.layout.count)
    }

    /// The states that begin anew from zero after a stop.
    fn begun<'a>(&self, stop: &'a Stop) -> impl Iterator<Item = usize> + use<'a, N, M> {
        stop.begun.iter().copied()
    }

    fn first_covariance(&self) -> Covariance<N, M> {
        let mut first = Covariance {
            xx: (0..N).map(|place| self.first_of_velocity(place)).sum(),
            ff: SMatrix::from_diagonal(&self.noise.disturbance.map(|x| x * x)),
            ..self.no_covariance()
        };
        self.first_covariance_of_navigation(&mut first);
        if M > N {
            let of_down = self.first_of_down() * self.noise.attitude.powi(2);
            add_of_down(&mut first.xx, &of_down);
        }
        first.of_first_water(&self.first_water(), self.noise.of_water().std_m_s.powi(2));
        first
    }

    /// What noise of the first sample in a place makes of the motion's covariance: of a rate it is in
    /// translations of the origin as well, as they are readings less `ω × r`.
    fn first_of_velocity(&self, place: usize) -> SMatrix<f64, M, M> {
        let mut by = SVector::<f64, M>::zeros();
        if !self.is_measured(place) {
            let axis = self.plant.axes()[place];
            by[place] = axis.map_or(0.0, |axis| self.schedule.start_std[axis]);
            return by * by.transpose();
        }
        by[place] = self.noise.velocity[place];
        for other in 0..N {
            let turns = self.turns(other).into_iter().flatten();
            let own = turns.filter(|(rate, _)| *rate == place);
            own.for_each(|(_, arm)| by[other] -= arm * self.noise.velocity[place]);
        }
        by * by.transpose()
    }

    /// What noise of attitude makes of the world's down at first, beside its variance: `1 − k kᵀ`.
    fn first_of_down(&self) -> Matrix3<f64> {
        let down = &self.schedule.start_down;
        Matrix3::identity() - down * down.transpose()
    }

    /// The current's part of the first measurement, shape (M, 2).
    fn first_water(&self) -> SMatrix<f64, M, 2> {
        let stop = &self.schedule.stops[0];
        SMatrix::from_columns(&[self.water_column(stop, 0), self.water_column(stop, 1)])
    }

    fn water_column(&self, stop: &Stop, direction: usize) -> SVector<f64, M> {
        let axes = self.plant.axes();
        SVector::from_fn(|i, _| match axes.get(i) {
            Some(Some(axis @ 0..3)) => stop.water[(*axis, direction)],
            _ => 0.0,
        })
    }

    /// What a metre along an axis between the origin and an instrument adds to the translation in a
    /// place, `∂(ω × r)/∂r`, 1/s, of the rates that are axes: of others what is measured may be noise
    /// alone. Zero of one that is the slope of positions, or no translation.
    fn turning(&self, motion: &SVector<f64, M>, place: usize, along: usize) -> f64 {
        let Some(axis) = self.translation_measured(place) else { return 0.0 };
        let metre = Vector3::from_fn(|k, _| if k == along { 1.0 } else { 0.0 });
        let omega = Vector3::from_fn(|k, _| self.place_of(3 + k).map_or(0.0, |at| motion[at]));
        omega.cross(&metre)[axis]
    }

    /// The rates that the instrument of a place sees, and how far from their axes it sits.
    fn turns(&self, place: usize) -> Option<[(usize, f64); 2]> {
        let axis: usize = self.plant.axes()[place]?;
        let r = self.schedule.levers_m.get(axis).filter(|r| **r != Vector3::zeros())?;
        // (ω × r)ᵢ = ωⱼ rₖ − ωₖ rⱼ
        let [j, k] = [(axis + 1) % 3, (axis + 2) % 3];
        let arm = |rate: usize, arm: f64| {
            self.place_of(3 + rate).map_or((place, 0.0), |rate| (rate, arm))
        };
        Some([arm(j, r[k]), arm(k, -r[j])])
    }

    /// Returns true if an instrument measures the velocity in a place.
    fn is_measured(&self, place: usize) -> bool {
        self.plant.axes()[place].is_none_or(|axis| self.schedule.is_measured[axis])
    }

    /// Where an axis stands, in SNAME order.
    fn place_of(&self, axis: usize) -> Option<usize> {
        self.plant.axes().iter().position(|own| *own == Some(axis))
    }

    /// The place of a velocity that may be measured late.
    fn may_be_late(&self, seen: &Seen) -> Option<usize> {
        let Of::Velocity(place) = seen.of else { return None };
        self.translation_measured(place).map(|_| place)
    }

    /// The axis of a place that is a translation whose velocity an instrument measures.
    fn translation_measured(&self, place: usize) -> Option<usize> {
        let axis = self.plant.axes().get(place).copied().flatten()?;
        (axis < 3 && self.schedule.is_measured[axis]).then_some(axis)
    }

    /// What was measured at a stop: velocities by their places among the plant's axes, and where it
    /// is a state the world's down, whose component across the one that is measured is zero.
    fn measurements<'a>(
        &self,
        stop: &'a Stop,
    ) -> impl Iterator<Item = (Seen, f64)> + use<'a, N, M> {
        let axes = *self.plant.axes();
        let (measured, spread, water) = (stop.measured, stop.spread, stop.water);
        let turns: [_; N] = std::array::from_fn(|place| self.turns(place));
        let velocity = move |place: usize| {
            let axis: usize = axes[place]?;
            let water = match axis {
                0..3 => water.row(axis).transpose(),
                _ => Vector2::zeros(),
            };
            let (of, turns) = (Of::Velocity(place), turns[place]);
            let seen = Seen { of, water, turns, spread: spread[axis] };
            Some((seen, measured[axis]?))
        };
        let (across, spread) = (stop.across, stop.spread_across);
        let down = move |turn: usize| {
            let of = Of::Down(across[turn]?);
            let water = Vector2::zeros();
            Some((Seen { of, water, turns: None, spread: spread[turn] }, 0.0))
        };
        let turns = if M > N { 2 } else { 0 };
        let navigation = |reading: &'a Reading| {
            let Reading { state, number, axis, value, spread } = *reading;
            let of = Of::Navigation { state, number, axis };
            (Seen { of, water: Vector2::zeros(), turns: None, spread }, value)
        };
        let navigation = stop.readings.iter().map(navigation);
        (0..N).filter_map(velocity).chain((0..turns).filter_map(down)).chain(navigation)
    }

    /// What noise makes of a sample, (m/s)², (rad/s)² or rad².
    fn variance(&self, seen: &Seen) -> f64 {
        let std = match seen.of {
            Of::Velocity(place) => self.noise.velocity[place],
            Of::Down(_) => self.noise.attitude,
            Of::Navigation { number, .. } => self.noise.instruments.numbers[number],
        };
        std * std * seen.spread
    }

    /// A sample less what the state makes of it. A heading is another by at most half a turn: over a
    /// gap it may have turned further than a log without jumps can say.
    fn innovation(&self, seen: &Seen, y: f64, mean: &State<N, M>) -> f64 {
        let [north, east] = self.current;
        let e = y - (mean.seen(seen) + (seen.water[0] * north + seen.water[1] * east));
        match seen.of {
            Of::Navigation { number: InstrumentNoise::HEADING, .. } => wrapped(e),
            _ => e,
        }
    }

    fn move_mean(&self, stop: &Stop, mean: &mut State<N, M>, flow: &mut Flow<N, M>) {
        let slices = &self.schedule.slices[stop.slices.clone()];
        let pushes = &self.pushes[stop.slices.clone()];
        let decay = self.noise.decay();
        advance(self.plant, (slices, pushes), &mean.motion, &mean.disturbance, &decay, flow);
        let ends = Ends { before: &mean.motion, after: &flow.motion };
        self.move_navigation(stop, &ends, &mut mean.navigation);
        mean.motion = flow.motion;
        mean.disturbance.component_mul_assign(&self.fade(stop.length_s));
    }

    fn predict(
        &self,
        stop: &Stop,
        mean: &mut State<N, M>,
        flow: &mut Flow<N, M>,
    ) -> Transition<N, M> {
        let before = mean.motion;
        self.move_mean(stop, mean, flow);
        let ends = Ends { before: &before, after: &mean.motion };
        Transition {
            by_motion: flow.by_motion(),
            by_disturbance: flow.by_disturbance(),
            fade: self.fade(stop.length_s),
            rows: self.rows(stop, &ends),
        }
    }

    fn fade(&self, h: f64) -> SVector<f64, N> {
        self.noise.correlation_s.map(|t| (-h / t).exp())
    }

    fn correct(
        &self,
        seen: &Seen,
        y: f64,
        mean: &mut State<N, M>,
        covariance: &mut Covariance<N, M>,
    ) -> (f64, Gain<N, M>) {
        let e = self.innovation(seen, y, mean);
        let column = covariance.seen(seen);
        let variance = column.seen(seen) + self.variance(seen);
        let gain = Gain { state: column.scaled(1.0 / variance), variance };
        mean.add(&gain.state, e);
        covariance.subtract(&gain.state, &column);
        (e, gain)
    }
}

/// Adds a covariance of the world's down to that of the motion that it is a part of.
fn add_of_down<const M: usize>(motion: &mut SMatrix<f64, M, M>, of_down: &Matrix3<f64>) {
    let mut own = motion.view_mut((M - 3, M - 3), (3, 3));
    own += of_down;
}

/// An angle less the whole turns in it, rad.
fn wrapped(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

fn half_log(e: f64, variance: f64) -> f64 {
    0.5 * (variance.ln() + e * e / variance)
}

fn finite<const N: usize, const M: usize>(mut slope: Slope, mean: &State<N, M>) -> Slope {
    if !(slope.cost.is_finite() && mean.motion.iter().all(|v| v.is_finite())) {
        slope.cost = f64::INFINITY;
    }
    slope
}
