//! The extended Kalman filter of one trial, with the sensitivities of its innovations.
//!
//! States velocity v, a slow disturbance d and, where the model has them, position p, what the
//! velocity sensor makes of v, waves and a current that varies:
//! `v̇ = α τ* + (β|r| + μ − α k_in γ) r + bias + d + ẇ` with r = v − u − c, `ḋ = −d/T + noise`,
//! `ṗ = v`. Where an accelerometer measures, what velocity gains since its last mean, with what
//! gravity leaks into it, `ṡ = v̇ + b`, and that leak itself, `ḃ = −b/T_b + noise`, are states too.

#![expect(clippy::needless_range_loop, reason = "states are numbered as in the matrices")]

use nalgebra::{DMatrix, DVector};

use super::discrete::{Sensing, Slow, Waves};
use super::drive::{Drive, OF_SPEED, Push, SHAPING};
use super::parameters::{Active, Sensor, Unknown, Values};
use super::schedule::{Instrument, Measured, Measurements, Stop};

/// Where the filter starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Start {
    /// Mean velocity.
    pub(crate) velocity: f64,
    /// Its variance.
    pub(crate) velocity_variance: f64,
    /// Mean position.
    pub(crate) position: f64,
    /// Its variance.
    pub(crate) position_variance: f64,
}

/// The likelihood of one trial, and how it changes with the fitted unknowns.
#[derive(Clone, Debug)]
pub(crate) struct Likelihood {
    /// ½ Σ (ln S + e²/S).
    pub(crate) cost: f64,
    /// Its gradient; shape (n,).
    pub(crate) gradient: DVector<f64>,
    /// The Fisher information, Σ (e_i e_j / S + ½ S_i S_j / S²); shape (n, n).
    pub(crate) information: DMatrix<f64>,
    /// What each measurement surprises by, if that was asked for.
    pub(crate) innovations: Vec<Innovation>,
    /// The gradients of parts one after the other, if they were asked for; each of shape (n,).
    pub(crate) scores: Vec<DVector<f64>>,
}

/// What the filter failed to predict of one measurement.
///
/// Single precision is enough to judge by, and a day of log holds a million.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Innovation {
    pub(crate) instrument: Instrument,
    /// Measured less predicted.
    pub(crate) error: f32,
    /// The standard deviation that the filter expects of it.
    pub(crate) std: f32,
    /// The part of it that the filter takes over into what it predicts next.
    pub(crate) gain: f32,
}

impl Innovation {
    /// e/√S.
    pub(crate) fn normalised(&self) -> f64 {
        f64::from(self.error) / f64::from(self.std)
    }
}

impl Likelihood {
    /// Of no measurement.
    pub(crate) fn of_nothing(active: &Active, wanted: Wanted) -> Self {
        let n = wanted.columns(active);
        let (gradient, information) = (DVector::zeros(n), DMatrix::zeros(n, n));
        Self { cost: 0.0, gradient, information, innovations: Vec::new(), scores: Vec::new() }
    }

    /// Of two parts of a trial that are followed from states of their own.
    pub(crate) fn and(mut self, other: Self) -> Self {
        self.cost += other.cost;
        self.gradient += other.gradient;
        self.information += other.information;
        self.innovations.extend(other.innovations);
        self.scores.extend(other.scores);
        self
    }
}

/// How a state or covariance changes with each fitted unknown. N is at least their number;
/// the width is known to the compiler so that it works on several at once.
type Row<const N: usize> = [f64; N];

/// The place of velocity among the states, and of the slow disturbance.
const V: usize = 0;
const D: usize = 1;

/// Where the other states stand.
#[derive(Clone, Copy, Debug)]
struct Layout {
    position: Option<usize>,
    /// What the velocity sensor shows: velocity itself, or a state.
    seen: usize,
    sensor: Sensor,
    /// w and ẇ.
    waves: Option<usize>,
    current: Option<usize>,
    /// What velocity gains while an acceleration is averaged; the leak of gravity is next to it.
    gained: Option<usize>,
    states: usize,
}

impl Layout {
    fn of(values: &Values, has_position: bool, has_acceleration: bool) -> Self {
        let mut states = 2;
        let mut take = |wanted: bool, n: usize| {
            let at = states;
            states += if wanted { n } else { 0 };
            wanted.then_some(at)
        };
        let sensor = values.shape.sensor;
        let position = take(has_position, 1);
        let seen = take(sensor != Sensor::Prompt, Sensing::states(sensor)).unwrap_or(V);
        let waves = take(values.shape.swell, 2);
        let current = take(values.shape.drift, 1);
        let gained = take(has_acceleration, 2);
        Self { position, seen, sensor, waves, current, gained, states }
    }

    /// Which states each state depends on a step later.
    fn sources<const S: usize>(&self) -> [Sources<S>; S] {
        let mut all = [Sources { at: [0; S], len: 0 }; S];
        let moved_by_all =
            |k: usize| k == V || Some(k) == self.position || self.sensing().contains(&k);
        for (k, sources) in all.iter_mut().enumerate().take(self.states) {
            for from in 0..self.states {
                let own_wave = self
                    .waves
                    .is_some_and(|w| (w..w + 2).contains(&k) && (w..w + 2).contains(&from));
                // Neither position nor a sensor acts on anything else.
                let acts = Some(from) != self.position && !self.sensing().contains(&from);
                let own_sensor = self.sensing().contains(&k) && self.sensing().contains(&from);
                // The leak acts on nothing but what an accelerometer sees, and that on nothing.
                let of_gained = |at: usize| self.gained.is_some_and(|g| (g..g + 2).contains(&at));
                if of_gained(k) || of_gained(from) {
                    if k == from || Some(k) == self.gained && Some(from) != self.position {
                        sources.at[sources.len] = from;
                        sources.len += 1;
                    }
                    continue;
                }
                if k == from || own_wave || own_sensor || (moved_by_all(k) && acts) {
                    sources.at[sources.len] = from;
                    sources.len += 1;
                }
            }
        }
        all
    }

    fn sensing(&self) -> std::ops::Range<usize> {
        self.seen..self.seen + Sensing::states(self.sensor)
    }
}

/// The states that one depends on.
#[derive(Clone, Copy)]
struct Sources<const S: usize> {
    at: [usize; S],
    len: usize,
}

/// A matrix over the states.
type Square<const S: usize> = [[f64; S]; S];

/// Mean and covariance of the states, with their sensitivities; of the covariance the upper
/// half is kept.
struct State<const S: usize, const N: usize> {
    x: [f64; S],
    p: Square<S>,
    x_by: [Row<N>; S],
    p_by: [[Row<N>; S]; S],
}

/// What depends on the length of a step alone.
#[derive(Clone, Copy)]
struct Discrete {
    h: f64,
    slow: Slow,
    slow_by_t: Slow,
    sense: Sensing,
    sense_by: Sensing,
    waves: Waves,
    waves_by_frequency: Waves,
    waves_by_damping: Waves,
    drift: Slow,
    leak: Slow,
    leak_by_t: Slow,
}

/// The filter of one trial at one set of values, with `S` states and `N` columns of
/// sensitivities.
struct Kalman<'a, const S: usize, const N: usize> {
    active: &'a Active,
    values: &'a Values,
    layout: Layout,
    sources: [Sources<S>; S],
    alpha: f64,
    beta: f64,
    mu: f64,
    bias: f64,
    current: f64,
    /// k_in forward through the water, and backward, of propellers that push each way.
    inflow: Inflow,
    turning: f64,
    lever: [f64; 2],
    offset: f64,
    acceleration_offset: f64,
    scale: f64,
    sigma2: f64,
    inverse_t: f64,
    noise: [f64; 3],
    state: State<S, N>,
    cost: f64,
    gradient: Row<N>,
    information: [Row<N>; N],
    innovations: Option<Vec<Innovation>>,
    batches: Option<Batches<N>>,
}

/// Gradients of parts that are as long as one another.
struct Batches<const N: usize> {
    length_s: f64,
    /// The time since the last part ended.
    since_s: f64,
    /// The gradient at its end.
    before: Row<N>,
    ended: Vec<Row<N>>,
}

impl<const N: usize> Batches<N> {
    fn of(length_s: f64) -> Self {
        Self { length_s, since_s: 0.0, before: [0.0; N], ended: Vec::new() }
    }

    fn after(&mut self, step_s: f64, gradient: &Row<N>) {
        self.since_s += step_s;
        if self.since_s >= self.length_s {
            self.end(gradient);
        }
    }

    fn end(&mut self, gradient: &Row<N>) {
        self.ended.push(std::array::from_fn(|j| gradient[j] - self.before[j]));
        (self.since_s, self.before) = (0.0, *gradient);
    }

    /// All parts; one that is shorter than half of the others counts with the last.
    fn all(mut self, gradient: &Row<N>) -> Vec<Row<N>> {
        let is_short = self.since_s < 0.5 * self.length_s;
        match self.ended.last_mut().filter(|_| is_short) {
            Some(last) => (0..N).for_each(|j| last[j] += gradient[j] - self.before[j]),
            None => self.end(gradient),
        }
        self.ended
    }
}

/// What inflow takes: from all propellers, and beside that from those that push the way the
/// vehicle goes.
#[derive(Clone, Copy)]
struct Inflow {
    all: f64,
    ahead: f64,
}

/// What to find out beside the cost.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Wanted {
    /// Nothing.
    Cost,
    /// Gradient and information.
    Sensitivities,
    /// These, and the gradients of parts of that length, s.
    Scores(f64),
    /// The innovations.
    Innovations,
}

impl Wanted {
    /// How many derivatives it takes.
    fn columns(self, active: &Active) -> usize {
        match self {
            Self::Sensitivities | Self::Scores(_) => active.len(),
            Self::Cost | Self::Innovations => 0,
        }
    }
}

/// The likelihood of one trial.
pub(crate) fn likelihood(
    measurements: &Measurements,
    drive: Drive<'_>,
    active: &Active,
    values: &Values,
    start: Start,
    wanted: Wanted,
) -> Likelihood {
    let columns = wanted.columns(active);
    let has_acceleration = measurements.of_instrument(Instrument::Acceleration).is_some();
    let layout = Layout::of(values, measurements.position().is_some(), has_acceleration);
    macro_rules! run {
        ($s:literal, $n:literal) => {
            Kalman::<$s, $n>::new(active, values, layout, start)
                .noting(wanted, measurements.samples())
                .run(measurements.steps(), drive)
        };
    }
    // The usual sizes are met closely; each size is compiled by itself.
    match (layout.states, columns) {
        (2, 0) => run!(2, 0),
        (2, 1..=8) => run!(2, 8),
        (2, 9..=12) => run!(2, 12),
        (2, 13..=16) => run!(2, 16),
        (2, _) => run!(2, 32),
        (3, 0) => run!(3, 0),
        (3, 1..=12) => run!(3, 12),
        (3, 13..=16) => run!(3, 16),
        (3, _) => run!(3, 32),
        (4..=5, 0) => run!(5, 0),
        (4..=5, 1..=16) => run!(5, 16),
        (4..=5, _) => run!(5, 32),
        (6..=8, 0) => run!(8, 0),
        (6..=8, 1..=20) => run!(8, 20),
        (6..=8, _) => run!(8, 32),
        (_, 0) => run!(10, 0),
        (_, _) => run!(10, 32),
    }
}

impl<'a, const S: usize, const N: usize> Kalman<'a, S, N> {
    fn new(active: &'a Active, values: &'a Values, layout: Layout, start: Start) -> Self {
        let of = |unknown| values.get(unknown);
        let sigma2 = (2.0 * of(Unknown::LogDisturbance)).exp();
        let noise =
            [Unknown::LogVelocityNoise, Unknown::LogPositionNoise, Unknown::LogAccelerationNoise];
        Self {
            active,
            values,
            layout,
            sources: layout.sources(),
            alpha: of(Unknown::Alpha),
            beta: of(Unknown::Beta),
            mu: of(Unknown::Mu),
            bias: of(Unknown::Bias),
            current: of(Unknown::Current),
            inflow: Inflow { all: of(Unknown::Inflow), ahead: of(Unknown::InflowAhead) },
            turning: of(Unknown::Turning),
            lever: [of(Unknown::LeverFirst), of(Unknown::LeverSecond)],
            offset: of(Unknown::VelocityOffset),
            acceleration_offset: of(Unknown::AccelerationOffset),
            scale: 1.0 + of(Unknown::VelocityScale),
            sigma2,
            inverse_t: (-of(Unknown::LogCorrelation)).exp(),
            noise: noise.map(|unknown| (2.0 * of(unknown)).exp()),
            state: State::at(start, &layout, values, active),
            cost: 0.0,
            gradient: [0.0; N],
            information: [[0.0; N]; N],
            innovations: None,
            batches: None,
        }
    }

    fn noting(mut self, wanted: Wanted, samples: usize) -> Self {
        let is_wanted = wanted == Wanted::Innovations;
        self.innovations = is_wanted.then(|| Vec::with_capacity(samples));
        if let Wanted::Scores(length_s) = wanted {
            self.batches = Some(Batches::of(length_s));
        }
        self
    }

    /// Runs the filter over the trial.
    fn run(mut self, steps: impl Iterator<Item = Stop>, mut drive: Drive<'_>) -> Likelihood {
        let mut discrete = self.discrete(0.0);
        for stop in steps {
            if stop.length_s > 0.0 {
                // Decimal time stamps differ in their last digits; steps do not.
                if (stop.length_s - discrete.h).abs() > 1e-9 {
                    discrete = self.discrete(stop.length_s);
                }
                self.predict(&drive.until(&stop), &discrete);
            }
            self.measure(&stop.measured);
            if let Some(batches) = &mut self.batches {
                batches.after(stop.length_s, &self.gradient);
            }
        }
        let n = self.active.len().min(N);
        let is_finite = self.cost.is_finite() && self.state.x[V].is_finite();
        Likelihood {
            cost: if is_finite { self.cost } else { f64::INFINITY },
            gradient: DVector::from_fn(n, |j, _| self.gradient[j]),
            information: DMatrix::from_fn(n, n, |i, j| self.information[i.min(j)][i.max(j)]),
            innovations: self.innovations.unwrap_or_default(),
            scores: self.batches.map_or_else(Vec::new, |batches| {
                let rows = batches.all(&self.gradient).into_iter();
                rows.map(|row| DVector::from_fn(n, |j, _| row[j])).collect()
            }),
        }
    }

    fn column(&self, unknown: Unknown) -> Option<usize> {
        self.active.column(unknown).filter(|j| *j < N)
    }

    fn discrete(&self, h: f64) -> Discrete {
        let (slow, slow_by_t) = Slow::over(h, self.sigma2, self.inverse_t);
        let (sense, sense_by) = Sensing::over(self.layout.sensor, h, self.values);
        let has_waves = self.layout.waves.is_some();
        let waves = |of: &dyn Fn() -> Waves| if has_waves { of() } else { Waves::default() };
        let by = |unknown| {
            waves(&|| match self.column(unknown) {
                Some(_) => Waves::by(unknown, h, self.values),
                None => Waves::default(),
            })
        };
        let drift = (2.0 * self.values.get(Unknown::LogDrift)).exp();
        let (leak, leak_by_t) = match self.layout.gained {
            Some(_) => {
                let sigma2 = (2.0 * self.values.get(Unknown::LogLeak)).exp();
                Slow::over(h, sigma2, (-self.values.get(Unknown::LogLeakCorrelation)).exp())
            }
            None => Default::default(),
        };
        Discrete {
            leak,
            leak_by_t,
            h,
            slow,
            slow_by_t,
            sense,
            sense_by,
            waves: waves(&|| Waves::over(h, self.values)),
            waves_by_frequency: by(Unknown::LogSwellFrequency),
            waves_by_damping: by(Unknown::LogSwellDamping),
            drift: Slow::over(h, drift, 1.0 / DRIFT_CORRELATION_S).0,
        }
    }

    /// One step: the mean by its Taylor series to third order, with what is linear in closed
    /// form, and the covariance by the derivative of the same map.
    fn predict(&mut self, push: &Push, step: &Discrete) {
        let x = &self.state.x;
        let c = self.layout.current.map_or(0.0, |k| x[k]);
        let r = x[V] - self.current - c;
        let gamma = usize::from(r < 0.0);
        let (speed, sign) = (r.abs(), r.signum());
        let Inflow { all, ahead } = self.inflow;
        let lost = all * (push.gamma[0] + push.gamma[1]) + ahead * push.gamma[gamma];
        let linear = self.mu - self.alpha * lost;
        let a = 2.0 * self.beta * speed + linear;
        let f = self.alpha * push.tau
            + (self.beta * speed + linear) * r
            + self.bias
            + self.turning * push.turning;
        let bend = 2.0 * self.beta * sign;
        let reversal = Reversal::of(r, f, step.h);
        let mut map = self.map(f, a, bend, step);
        map.of_v += 2.0 * map.h3 * self.beta * f * f * (reversal.by_r + reversal.by_f * a);
        let now = Now { r, speed, gamma, lost, a, f, bend, reversal, map };
        // Covariances go by the slope of drag and leave its bend out.
        let straight = Now { bend: 0.0, map: self.map(f, a, 0.0, step), ..now };
        let phi = self.transition(&straight, step);
        let q = self.process_noise(step);
        if N > 0 {
            self.predict_sensitivities(push, &now, &phi, step);
        }
        self.state.x = self.moved(&now, step);
        self.state.p = self.spread(&phi, &q);
    }

    /// Coefficients of the map over a step.
    fn map(&self, f: f64, a: f64, bend: f64, step: &Discrete) -> Map {
        let h = step.h;
        let (h2, h3) = (0.5 * h * h, h * h * h / 6.0);
        let x = &self.state.x;
        let wave = self.layout.waves.map_or(0.0, |w| {
            let [e, _] = step.waves.e;
            (e[0] - 1.0) * x[w] + e[1] * x[w + 1]
        });
        let pushed = step.slow.once * x[D] + wave;
        Map {
            h2,
            h3,
            wave,
            // Forces that vary in a step act on a sensor by their mean.
            g1: f + pushed / h,
            // ∂v(h)/∂v(0), but for what bend does to d and waves.
            of_v: 1.0
                + h * a
                + h2 * (a * a + bend * f)
                + h3 * (a * a * a + 4.0 * a * bend * f)
                + bend * (step.slow.twice * x[D] + 0.5 * h * wave),
        }
    }

    /// The states after a step.
    fn moved(&self, now: &Now, step: &Discrete) -> [f64; S] {
        let Now { a, f, reversal, map: Map { h2, h3, wave, g1, .. }, .. } = *now;
        let bend = 2.0 * self.beta * reversal.sign;
        let (h, slow) = (step.h, &step.slow);
        let from = &self.state.x;
        let mut to = *from;
        to[V] += h * f
            + h2 * a * f
            + h3 * (a * a * f + bend * f * f)
            + (slow.once + a * slow.twice) * from[D]
            + (1.0 + 0.5 * a * h) * wave;
        to[D] *= slow.rho;
        if let Some(p) = self.layout.position {
            to[p] += h * from[V] + h2 * f + h3 * a * f + slow.twice * from[D] + 0.5 * h * wave;
        }
        let (states, first) = (Sensing::states(self.layout.sensor), self.layout.seen);
        for i in 0..states {
            let Sensing { e, j0, j1, j2 } = &step.sense;
            let own: f64 = (0..states).map(|j| e[i][j] * from[first + j]).sum();
            to[first + i] = own + j0[i] * from[V] + j1[i] * g1 + 0.5 * j2[i] * a * g1;
        }
        if let Some(w) = self.layout.waves {
            let e = &step.waves.e;
            for i in 0..2 {
                to[w + i] = e[i][0] * from[w] + e[i][1] * from[w + 1];
            }
        }
        if let Some(c) = self.layout.current {
            to[c] *= step.drift.rho;
        }
        if let Some(g) = self.layout.gained {
            to[g] += to[first] - from[first] + step.leak.once * from[g + 1];
            to[g + 1] *= step.leak.rho;
        }
        to
    }

    /// Gives what is gained the row of what the sensor sees: it changes by as much.
    fn mirror_row<T: Copy>(&self, rows: &mut [T; S]) {
        if let Some(g) = self.layout.gained {
            rows[g] = rows[self.layout.seen];
        }
    }

    /// Adds noise of the states to a covariance, and to what is gained what the sensor sees of it.
    fn add_noise(&self, to: &mut Square<S>, add: impl Fn(&mut Square<S>)) {
        let Some(g) = self.layout.gained else { return add(to) };
        let mut q = [[0.0; S]; S];
        add(&mut q);
        let seen = self.layout.seen;
        let row: [f64; S] = std::array::from_fn(|k| q[seen.min(k)][seen.max(k)]);
        for k in 0..S {
            q[k.min(g)][k.max(g)] = if k == g { row[seen] } else { row[k] };
        }
        for (to, q) in to.iter_mut().zip(&q) {
            to.iter_mut().zip(q).for_each(|(to, q)| *to += q);
        }
    }

    /// The derivative of the states after a step by those before.
    fn transition(&self, now: &Now, step: &Discrete) -> Square<S> {
        let Now { a, f, bend, map: Map { h2, h3, of_v, g1, .. }, .. } = *now;
        let (h, slow) = (step.h, &step.slow);
        let Layout { position, seen, waves, current, sensor, .. } = self.layout;
        let mut phi = [[0.0; S]; S];
        // A force that is one at the start of the step, by the states that it is from.
        let forces = |row: &mut [f64; S], by_d: f64, by_wave: f64| {
            row[D] += by_d;
            if let Some(w) = waves {
                let e = step.waves.e[0];
                row[w] += by_wave * (e[0] - 1.0);
                row[w + 1] += by_wave * e[1];
            }
        };
        let against = |row: &mut [f64; S], by_v: f64| {
            if let Some(c) = current {
                row[c] -= by_v;
            }
        };
        phi[V][V] = of_v;
        forces(&mut phi[V], slow.once + a * slow.twice, 1.0 + 0.5 * a * h);
        against(&mut phi[V], of_v - 1.0);
        phi[D][D] = slow.rho;
        if let Some(p) = position {
            let by_v = h2 * a + h3 * (a * a + bend * f);
            phi[p][p] = 1.0;
            phi[p][V] = h + by_v;
            forces(&mut phi[p], slow.twice, 0.5 * h);
            against(&mut phi[p], by_v);
        }
        let states = Sensing::states(sensor);
        for i in 0..states {
            let Sensing { e, j0, j1, j2 } = &step.sense;
            for j in 0..states {
                phi[seen + i][seen + j] = e[i][j];
            }
            let by_g1 = j1[i] + 0.5 * j2[i] * a;
            let by_r = by_g1 * a + 0.5 * j2[i] * bend * g1;
            phi[seen + i][V] = j0[i] + by_r;
            forces(&mut phi[seen + i], by_g1 * slow.once / h, by_g1 / h);
            against(&mut phi[seen + i], by_r);
        }
        if let Some(w) = waves {
            for i in 0..2 {
                phi[w + i][w] = step.waves.e[i][0];
                phi[w + i][w + 1] = step.waves.e[i][1];
            }
        }
        if let Some(c) = current {
            phi[c][c] = step.drift.rho;
        }
        self.mirror_row(&mut phi);
        if let Some(g) = self.layout.gained {
            phi[g][seen] -= 1.0;
            phi[g][g] = 1.0;
            phi[g][g + 1] = step.leak.once;
            phi[g + 1][g + 1] = step.leak.rho;
        }
        phi
    }

    /// How the transition of covariances changes with the slope of drag.
    fn transition_by_slope(&self, now: &Now, step: &Discrete) -> Square<S> {
        let Now { a, map: Map { h2, h3, .. }, .. } = *now;
        let h = step.h;
        let Layout { position, seen, waves, current, sensor, .. } = self.layout;
        let mut phi = [[0.0; S]; S];
        phi[V][V] = h + h * h * a + 3.0 * h3 * a * a;
        phi[V][D] = step.slow.twice;
        if let Some(w) = waves {
            phi[V][w] = 0.5 * h * (step.waves.e[0][0] - 1.0);
            phi[V][w + 1] = 0.5 * h * step.waves.e[0][1];
        }
        if let Some(p) = position {
            phi[p][V] = h2 + 2.0 * h3 * a;
        }
        for i in 0..Sensing::states(sensor) {
            let Sensing { j1, j2, .. } = &step.sense;
            phi[seen + i][V] = j1[i] + j2[i] * a;
            let by_force = 0.5 * j2[i] / h;
            phi[seen + i][D] = by_force * step.slow.once;
            if let Some(w) = waves {
                phi[seen + i][w] = by_force * (step.waves.e[0][0] - 1.0);
                phi[seen + i][w + 1] = by_force * step.waves.e[0][1];
            }
        }
        if let Some(c) = current {
            for row in &mut phi {
                row[c] -= row[V];
            }
        }
        self.mirror_row(&mut phi);
        phi
    }

    fn process_noise(&self, step: &Discrete) -> Square<S> {
        let mut q = [[0.0; S]; S];
        self.add_noise(&mut q, |q| {
            add_slow(q, &step.slow);
            if let Some(w) = self.layout.waves {
                add_waves(q, w, &step.waves);
            }
        });
        if let Some(c) = self.layout.current {
            q[c][c] = step.drift.q_dd;
        }
        if let Some(g) = self.layout.gained {
            add_leak(&mut q, g, &step.leak);
        }
        q
    }

    /// Φ P Φᵀ + Q, upper half.
    fn spread(&self, phi: &Square<S>, q: &Square<S>) -> Square<S> {
        let p = &self.state.p;
        let mut half = [[0.0; S]; S];
        for (i, row) in half.iter_mut().enumerate() {
            for (k, x) in row.iter_mut().enumerate() {
                *x = self.over(i, |l| phi[i][l] * p[l.min(k)][l.max(k)]);
            }
        }
        let mut to = *q;
        for i in 0..S {
            for j in i..S {
                to[i][j] += self.over(j, |l| half[i][l] * phi[j][l]);
            }
        }
        to
    }

    /// A sum over the states that state `i` depends on.
    #[inline]
    fn over(&self, i: usize, of: impl Fn(usize) -> f64) -> f64 {
        if S <= 3 {
            return (0..S).map(of).sum();
        }
        let Sources { at, len } = &self.sources[i];
        at[..*len].iter().map(|l| of(*l)).sum()
    }

    /// `Ψ P Φᵀ` and its transpose, upper half: what a change Ψ of the transition does.
    fn turned(&self, psi: &Square<S>, phi: &Square<S>) -> Square<S> {
        let p = &self.state.p;
        let mut half = [[0.0; S]; S];
        for (i, row) in half.iter_mut().enumerate() {
            for (k, x) in row.iter_mut().enumerate() {
                *x = (0..S).map(|l| psi[i][l] * p[l.min(k)][l.max(k)]).sum();
            }
        }
        let of = |i: usize, j: usize| self.over(j, |l| half[i][l] * phi[j][l]);
        let mut to = [[0.0; S]; S];
        for i in 0..S {
            for j in i..S {
                to[i][j] = of(i, j) + of(j, i);
            }
        }
        to
    }

    /// ∂f and ∂a by each fitted unknown, the states held.
    fn partials(&self, push: &Push, now: &Now) -> (Row<N>, Row<N>) {
        let (mut f_by, mut a_by) = ([0.0; N], [0.0; N]);
        let Now { r, speed, gamma, lost, a, .. } = *now;
        let sign = r.signum();
        let mut set = |unknown, f: f64, a: f64| {
            if let Some(j) = self.active.column(unknown).filter(|j| *j < N) {
                f_by[j] = f;
                a_by[j] = a;
            }
        };
        set(Unknown::Alpha, push.tau - lost * r, -lost);
        set(Unknown::Beta, speed * r, 2.0 * speed);
        set(Unknown::Mu, r, 1.0);
        set(Unknown::Bias, 1.0, 0.0);
        set(Unknown::Turning, push.turning, 0.0);
        set(Unknown::Current, -a, -2.0 * self.beta * sign);
        for (unknown, by) in [
            (Unknown::Inflow, push.gamma[0] + push.gamma[1]),
            (Unknown::InflowAhead, push.gamma[gamma]),
        ] {
            set(unknown, -self.alpha * by * r, -self.alpha * by);
        }
        for (i, unknown) in SHAPING.into_iter().enumerate() {
            let lost = if i < OF_SPEED {
                let [forward, backward] = push.gamma_by.map(|by| by[i]);
                self.inflow.all * (forward + backward) + self.inflow.ahead * push.gamma_by[gamma][i]
            } else {
                0.0
            };
            set(unknown, self.alpha * (push.tau_by[i] - lost * r), -self.alpha * lost);
        }
        (f_by, a_by)
    }

    fn predict_sensitivities(&mut self, push: &Push, now: &Now, phi: &Square<S>, step: &Discrete) {
        let (f_by, a_by) = self.partials(push, now);
        let own = self.own_sensitivities(&f_by, &a_by, now, step);
        let slope = self.turned(&self.transition_by_slope(now, step), phi);
        let special = self.special(now, phi, step);
        let mut a_all = a_by;
        for (j, a) in a_all.iter_mut().enumerate() {
            let c = self.layout.current.map_or(0.0, |c| self.state.x_by[c][j]);
            *a += now.bend * (self.state.x_by[V][j] - c);
        }
        let exact = self.transition(now, step);
        let mut x_by = own;
        for (i, row) in x_by.iter_mut().enumerate() {
            self.each_source(i, |l| {
                for (x, from) in row.iter_mut().zip(&self.state.x_by[l]) {
                    *x += exact[i][l] * from;
                }
            });
        }
        let mut half = [[[0.0; N]; S]; S];
        for (i, rows) in half.iter_mut().enumerate() {
            for (k, row) in rows.iter_mut().enumerate() {
                self.each_source(i, |l| {
                    let p_by = &self.state.p_by[l.min(k)][l.max(k)];
                    for (x, p) in row.iter_mut().zip(p_by) {
                        *x += phi[i][l] * p;
                    }
                });
            }
        }
        let mut p_by = [[[0.0; N]; S]; S];
        for i in 0..S {
            for j in i..S {
                let row = &mut p_by[i][j];
                for (x, a) in row.iter_mut().zip(&a_all) {
                    *x = slope[i][j] * a;
                }
                self.each_source(j, |l| {
                    for (x, half) in row.iter_mut().zip(&half[i][l]) {
                        *x += half * phi[j][l];
                    }
                });
            }
        }
        for (column, change) in special.iter().flatten() {
            for i in 0..S {
                for j in i..S {
                    p_by[i][j][*column] += change[i][j];
                }
            }
        }
        self.state.x_by = x_by;
        self.state.p_by = p_by;
    }

    #[inline]
    fn each_source(&self, i: usize, mut with: impl FnMut(usize)) {
        if S <= 3 {
            (0..S).for_each(with);
            return;
        }
        let Sources { at, len } = &self.sources[i];
        at[..*len].iter().for_each(|l| with(*l));
    }

    /// How the states after a step change with the unknowns, those before held.
    fn own_sensitivities(
        &self,
        f_by: &Row<N>,
        a_by: &Row<N>,
        now: &Now,
        step: &Discrete,
    ) -> [Row<N>; S] {
        let Now { a, f, reversal, map: Map { h2, h3, wave, g1, .. }, .. } = *now;
        let bend = 2.0 * self.beta * (reversal.sign + 0.5 * f * reversal.by_f);
        let (h, slow) = (step.h, &step.slow);
        let x = &self.state.x;
        let mut own = [[0.0; N]; S];
        for j in 0..N {
            let (f_j, a_j) = (f_by[j], a_by[j]);
            own[V][j] = h * f_j
                + h2 * (a_j * f + a * f_j)
                + h3 * (2.0 * a * a_j * f + a * a * f_j + 2.0 * bend * f * f_j)
                + a_j * (slow.twice * x[D] + 0.5 * h * wave);
            if let Some(p) = self.layout.position {
                own[p][j] = h2 * f_j + h3 * (a_j * f + a * f_j);
            }
            for i in 0..Sensing::states(self.layout.sensor) {
                let Sensing { j1, j2, .. } = &step.sense;
                own[self.layout.seen + i][j] = j1[i] * f_j + 0.5 * j2[i] * (a_j * g1 + a * f_j);
            }
        }
        if let Some(j) = self.column(Unknown::Beta) {
            own[V][j] += 2.0 * h3 * reversal.sign * f * f;
        }
        self.own_of_noise(&mut own, now, step);
        self.mirror_row(&mut own);
        if let Some((g, j)) = self.layout.gained.zip(self.column(Unknown::LogLeakCorrelation)) {
            own[g][j] += step.leak_by_t.once * x[g + 1];
            own[g + 1][j] += step.leak_by_t.rho * x[g + 1];
        }
        own
    }

    /// The part of [`Kalman::own_sensitivities`] by what shapes the other states.
    fn own_of_noise(&self, own: &mut [Row<N>; S], now: &Now, step: &Discrete) {
        let Now { a, map: Map { g1, .. }, .. } = *now;
        let (h, x) = (step.h, &self.state.x);
        let seen = self.layout.seen;
        let sensing = Sensing::states(self.layout.sensor);
        if let Some(j) = self.column(Unknown::LogCorrelation) {
            let (by, d) = (&step.slow_by_t, x[D]);
            let effect = [(by.once + a * by.twice) * d, by.twice * d, by.once * d];
            self.force_by(own, j, effect, a, step);
            own[D][j] += by.rho * d;
        }
        for (unknown, by) in [
            (Unknown::LogSwellFrequency, &step.waves_by_frequency),
            (Unknown::LogSwellDamping, &step.waves_by_damping),
        ] {
            let Some((j, w)) = self.column(unknown).zip(self.layout.waves) else { continue };
            let change = [0, 1].map(|i| by.e[i][0] * x[w] + by.e[i][1] * x[w + 1]);
            let effect = [(1.0 + 0.5 * a * h) * change[0], 0.5 * h * change[0], change[0]];
            self.force_by(own, j, effect, a, step);
            own[w][j] += change[0];
            own[w + 1][j] += change[1];
        }
        for unknown in [Unknown::LogSensorLag, Unknown::LogSensorWindow] {
            let Some(j) = self.column(unknown) else { continue };
            let Sensing { e, j0, j1, j2 } = &step.sense_by;
            for i in 0..sensing {
                let past: f64 = (0..sensing).map(|k| e[i][k] * x[seen + k]).sum();
                own[seen + i][j] += past + j0[i] * x[V] + j1[i] * g1 + 0.5 * j2[i] * a * g1;
            }
        }
    }

    /// What a force that changes with an unknown does to velocity and position; a sensor sees
    /// the last, the velocity that it adds.
    fn force_by(
        &self,
        own: &mut [Row<N>; S],
        j: usize,
        [velocity, position, added]: [f64; 3],
        a: f64,
        step: &Discrete,
    ) {
        own[V][j] += velocity;
        if let Some(p) = self.layout.position {
            own[p][j] += position;
        }
        for i in 0..Sensing::states(self.layout.sensor) {
            let Sensing { j1, j2, .. } = &step.sense;
            own[self.layout.seen + i][j] += (j1[i] + 0.5 * j2[i] * a) * added / step.h;
        }
    }

    /// How the covariance after a step changes with what shapes the states beside velocity:
    /// the column of the unknown, and the change.
    fn special(
        &self,
        now: &Now,
        phi: &Square<S>,
        step: &Discrete,
    ) -> [Option<(usize, Square<S>)>; 9] {
        let a = now.a;
        let h = step.h;
        let Layout { position, seen, sensor, waves, current, .. } = self.layout;
        let sensing = Sensing::states(sensor);
        let correlation = self.column(Unknown::LogCorrelation).map(|j| {
            let by = &step.slow_by_t;
            let mut psi = [[0.0; S]; S];
            psi[V][D] = by.once + a * by.twice;
            psi[D][D] = by.rho;
            if let Some(p) = position {
                psi[p][D] = by.twice;
            }
            for i in 0..sensing {
                let by_g1 = step.sense.j1[i] + 0.5 * step.sense.j2[i] * a;
                psi[seen + i][D] = by_g1 * by.once / h;
            }
            self.mirror_row(&mut psi);
            let mut change = self.turned(&psi, phi);
            self.add_noise(&mut change, |q| add_slow(q, by));
            (j, change)
        });
        let disturbance = self.column(Unknown::LogDisturbance).map(|j| {
            let mut change = [[0.0; S]; S];
            let Slow { q_vv, q_vd, q_dd, .. } = step.slow;
            let twice = Slow { q_vv: 2.0 * q_vv, q_vd: 2.0 * q_vd, q_dd: 2.0 * q_dd, ..step.slow };
            self.add_noise(&mut change, |q| add_slow(q, &twice));
            (j, change)
        });
        let sensor_time = |unknown| {
            self.column(unknown).map(|j| {
                let Sensing { e, j0, j1, j2 } = &step.sense_by;
                let mut psi = [[0.0; S]; S];
                for i in 0..sensing {
                    for k in 0..sensing {
                        psi[seen + i][seen + k] = e[i][k];
                    }
                    let by_force = j1[i] + 0.5 * j2[i] * a;
                    psi[seen + i][V] = j0[i] + by_force * a;
                    psi[seen + i][D] = by_force * step.slow.once / h;
                    if let Some(w) = waves {
                        psi[seen + i][w] = by_force * (step.waves.e[0][0] - 1.0) / h;
                        psi[seen + i][w + 1] = by_force * step.waves.e[0][1] / h;
                    }
                    if let Some(c) = current {
                        psi[seen + i][c] = -by_force * a;
                    }
                }
                self.mirror_row(&mut psi);
                (j, self.turned(&psi, phi))
            })
        };
        let of_waves = |unknown, by: &Waves| {
            let (j, w) = self.column(unknown).zip(waves)?;
            let mut psi = [[0.0; S]; S];
            for k in 0..2 {
                psi[V][w + k] = (1.0 + 0.5 * a * h) * by.e[0][k];
                if let Some(p) = position {
                    psi[p][w + k] = 0.5 * h * by.e[0][k];
                }
                for i in 0..2 {
                    psi[w + i][w + k] = by.e[i][k];
                }
                for i in 0..sensing {
                    let by_force = (step.sense.j1[i] + 0.5 * step.sense.j2[i] * a) / h;
                    psi[seen + i][w + k] = by_force * by.e[0][k];
                }
            }
            self.mirror_row(&mut psi);
            let mut change = self.turned(&psi, phi);
            self.add_noise(&mut change, |q| add_waves(q, w, by));
            Some((j, change))
        };
        let swell = self.column(Unknown::LogSwell).zip(waves).map(|(j, w)| {
            let mut change = [[0.0; S]; S];
            let twice = Waves { q: step.waves.q.map(|q| 2.0 * q), ..step.waves };
            self.add_noise(&mut change, |q| add_waves(q, w, &twice));
            (j, change)
        });
        let drift = self.column(Unknown::LogDrift).zip(current).map(|(j, c)| {
            let mut change = [[0.0; S]; S];
            change[c][c] = 2.0 * step.drift.q_dd;
            (j, change)
        });
        let sensor_unknown = match sensor {
            Sensor::Window => Unknown::LogSensorWindow,
            _ => Unknown::LogSensorLag,
        };
        [
            correlation,
            disturbance,
            sensor_time(sensor_unknown),
            of_waves(Unknown::LogSwellFrequency, &step.waves_by_frequency),
            of_waves(Unknown::LogSwellDamping, &step.waves_by_damping),
            swell,
            drift,
            self.column(Unknown::LogLeak).zip(self.layout.gained).map(|(j, g)| {
                let mut change = [[0.0; S]; S];
                let Slow { q_vv, q_vd, q_dd, .. } = step.leak;
                let twice =
                    Slow { q_vv: 2.0 * q_vv, q_vd: 2.0 * q_vd, q_dd: 2.0 * q_dd, ..step.leak };
                add_leak(&mut change, g, &twice);
                (j, change)
            }),
            self.column(Unknown::LogLeakCorrelation).zip(self.layout.gained).map(|(j, g)| {
                let by = &step.leak_by_t;
                let mut psi = [[0.0; S]; S];
                psi[g][g + 1] = by.once;
                psi[g + 1][g + 1] = by.rho;
                let mut change = self.turned(&psi, phi);
                add_leak(&mut change, g, by);
                (j, change)
            }),
        ]
    }

    /// Takes in what was measured at an instant.
    fn measure(&mut self, measured: &Measured) {
        if let Some(y) = measured.velocity {
            self.measure_velocity(y, measured.lever);
        }
        if let Some((y, p)) = measured.position.zip(self.layout.position) {
            let error = y - self.state.x[p];
            self.take_in(Instrument::Position, p, 1.0, error, [0.0; N]);
        }
        if let Some(g) = self.layout.gained.filter(|_| measured.opens) {
            if let Some((mean, over_s)) = measured.acceleration {
                let error = mean - self.acceleration_offset - self.state.x[g] / over_s;
                let mut own = [0.0; N];
                if let Some(j) = self.column(Unknown::AccelerationOffset) {
                    own[j] = -1.0;
                }
                self.take_in(Instrument::Acceleration, g, 1.0 / over_s, error, own);
            }
            self.state.forget(g);
        }
    }

    fn measure_velocity(&mut self, y: f64, rates: [f64; 2]) {
        let seen = self.layout.seen;
        let turning = self.lever[0] * rates[0] + self.lever[1] * rates[1];
        let shown = self.state.x[seen];
        let error = y - turning - self.offset - self.scale * shown;
        let mut own = [0.0; N];
        let by = [
            (Unknown::LeverFirst, -rates[0]),
            (Unknown::LeverSecond, -rates[1]),
            (Unknown::VelocityOffset, -1.0),
            (Unknown::VelocityScale, -shown),
        ];
        for (unknown, by) in by {
            if let Some(j) = self.column(unknown) {
                own[j] = by;
            }
        }
        self.take_in(Instrument::Velocity, seen, self.scale, error, own);
    }

    /// Takes in a measurement of `g x[i]`, with what its error changes by beside the state.
    fn take_in(&mut self, instrument: Instrument, i: usize, g: f64, e: f64, own: Row<N>) {
        let r = self.noise[instrument as usize];
        let noise_by = self.column(match instrument {
            Instrument::Velocity => Unknown::LogVelocityNoise,
            Instrument::Position => Unknown::LogPositionNoise,
            Instrument::Acceleration => Unknown::LogAccelerationNoise,
        });
        let scale_by = match instrument {
            Instrument::Velocity => self.column(Unknown::VelocityScale),
            Instrument::Position | Instrument::Acceleration => None,
        };
        let s = &mut self.state;
        let column: [f64; S] = std::array::from_fn(|k| g * s.p[i.min(k)][i.max(k)]);
        let total = g * column[i] + r;
        let weight = 1.0 / total;
        let (mut e_by, mut total_by) = (own, [0.0; N]);
        if N > 0 {
            let mut column_by: [Row<N>; S] = [[0.0; N]; S];
            for (k, row) in column_by.iter_mut().enumerate() {
                for (x, p) in row.iter_mut().zip(&s.p_by[i.min(k)][i.max(k)]) {
                    *x = g * p;
                }
            }
            if let Some(j) = scale_by {
                for (row, c) in column_by.iter_mut().zip(&column) {
                    row[j] += c / g;
                }
            }
            for j in 0..N {
                e_by[j] -= g * s.x_by[i][j];
                total_by[j] = g * column_by[i][j];
            }
            if let Some(j) = scale_by {
                total_by[j] += column[i];
            }
            if let Some(j) = noise_by {
                total_by[j] += 2.0 * r;
            }
            let (pull, pull_total) = (e * weight, e * weight * weight);
            for k in 0..S {
                for j in 0..N {
                    s.x_by[k][j] += column_by[k][j] * pull + column[k] * weight * e_by[j]
                        - column[k] * pull_total * total_by[j];
                }
                for l in k..S {
                    let both = column[k] * column[l] * weight * weight;
                    let (ck, cl) = (column[k] * weight, column[l] * weight);
                    for j in 0..N {
                        s.p_by[k][l][j] -=
                            column_by[k][j] * cl + ck * column_by[l][j] - both * total_by[j];
                    }
                }
            }
        }
        for k in 0..S {
            s.x[k] += column[k] * e * weight;
            for l in k..S {
                s.p[k][l] -= column[k] * column[l] * weight;
            }
        }
        if let Some(innovations) = &mut self.innovations {
            let gain = g * column[i] * weight;
            let (error, std, gain) = (e as f32, total.sqrt() as f32, gain as f32);
            innovations.push(Innovation { instrument, error, std, gain });
        }
        self.account(e, total, &e_by, &total_by);
    }

    /// Adds an innovation to the likelihood.
    fn account(&mut self, e: f64, total: f64, e_by: &Row<N>, total_by: &Row<N>) {
        let weight = 1.0 / total;
        self.cost += 0.5 * (total.ln() + e * e * weight);
        let half = 0.5 * weight * (1.0 - e * e * weight);
        for j in 0..N {
            self.gradient[j] += e_by[j] * e * weight + total_by[j] * half;
            let (by_e, by_total) = (e_by[j] * weight, 0.5 * total_by[j] * weight * weight);
            // It is symmetric: half of it will do.
            for i in j..N {
                self.information[j][i] += e_by[i] * by_e + total_by[i] * by_total;
            }
        }
    }
}

/// A current of the sea changes over minutes, s.
const DRIFT_CORRELATION_S: f64 = 120.0;

fn add_slow<const S: usize>(q: &mut Square<S>, slow: &Slow) {
    q[V][V] += slow.q_vv;
    q[V][D] += slow.q_vd;
    q[D][D] += slow.q_dd;
}

/// The leak moves what is gained by its integral.
fn add_leak<const S: usize>(q: &mut Square<S>, g: usize, leak: &Slow) {
    q[g][g] += leak.q_vv;
    q[g][g + 1] += leak.q_vd;
    q[g + 1][g + 1] += leak.q_dd;
}

/// The velocity that waves add in a step is the change of w, and so is its noise.
fn add_waves<const S: usize>(q: &mut Square<S>, w: usize, waves: &Waves) {
    let [of_w, both, of_rate] = waves.q;
    q[V][V] += of_w;
    q[V][w] += of_w;
    q[V][w + 1] += both;
    q[w][w] += of_w;
    q[w][w + 1] += both;
    q[w + 1][w + 1] += of_rate;
}

/// What the plant does at the start of a step.
struct Now {
    /// Velocity through the water.
    r: f64,
    speed: f64,
    /// Which propellers push the way the vehicle goes.
    gamma: usize,
    /// Thrust lost per speed.
    lost: f64,
    /// Slope of the acceleration, and the acceleration but for d and waves.
    a: f64,
    f: f64,
    /// How the slope changes with velocity.
    bend: f64,
    reversal: Reversal,
    map: Map,
}

/// The sign of the velocity through the water over a step, which may change in it: what makes
/// `∫ r|r| = |r|r h + |r| f h² + s f² h³/3` exact where `r` changes by `f` per second.
///
/// With the sign at the start the velocity after a step would jump as its start passes zero, and
/// with it the likelihood.
#[derive(Clone, Copy)]
struct Reversal {
    sign: f64,
    by_r: f64,
    by_f: f64,
}

impl Reversal {
    fn of(r: f64, f: f64, h: f64) -> Self {
        let reach = f * h;
        if r * f >= 0.0 || r.abs() >= reach.abs() {
            let sign = if r == 0.0 { f.signum() } else { r.signum() };
            return Self { sign, by_r: 0.0, by_f: 0.0 };
        }
        // From −1, where it turns at the end of the step, to 0, where it turns at the start.
        let x = r / reach;
        let sign = f.signum() * (1.0 + 2.0 * x * (3.0 + x * (3.0 + x)));
        let by_x = 6.0 * f.signum() * (1.0 + x) * (1.0 + x);
        Self { sign, by_r: by_x / reach, by_f: -by_x * x / f }
    }
}

/// The map over a step.
#[derive(Clone, Copy)]
struct Map {
    h2: f64,
    h3: f64,
    /// The velocity that waves add.
    wave: f64,
    /// Mean acceleration.
    g1: f64,
    /// ∂v(h)/∂v(0).
    of_v: f64,
}

impl<const S: usize, const N: usize> State<S, N> {
    /// Starts a state anew at zero.
    fn forget(&mut self, k: usize) {
        self.x[k] = 0.0;
        self.x_by[k] = [0.0; N];
        for l in 0..S {
            self.p[k.min(l)][k.max(l)] = 0.0;
            self.p_by[k.min(l)][k.max(l)] = [0.0; N];
        }
    }

    fn at(start: Start, layout: &Layout, values: &Values, active: &Active) -> Self {
        let sigma2 = (2.0 * values.get(Unknown::LogDisturbance)).exp();
        let mut state =
            Self { x: [0.0; S], p: [[0.0; S]; S], x_by: [[0.0; N]; S], p_by: [[[0.0; N]; S]; S] };
        let column = |unknown| active.column(unknown).filter(|j| *j < N);
        state.x[V] = start.velocity;
        state.p[V][V] = start.velocity_variance;
        state.p[D][D] = sigma2;
        if let Some(j) = column(Unknown::LogDisturbance) {
            state.p_by[D][D][j] = 2.0 * sigma2;
        }
        if let Some(p) = layout.position {
            state.x[p] = start.position;
            state.p[p][p] = start.position_variance;
        }
        if let Some(first) = layout.sensing().next() {
            // A sensor shows what the vehicle has done for a while.
            state.x[first] = start.velocity;
            state.p[V][first] = start.velocity_variance;
            for k in layout.sensing() {
                state.p[k][k] = start.velocity_variance;
            }
        }
        if let Some(w) = layout.waves {
            let [of_w, of_rate] = Waves::variances(values);
            state.p[w][w] = of_w;
            state.p[w + 1][w + 1] = of_rate;
            if let Some(j) = column(Unknown::LogSwell) {
                state.p_by[w][w][j] = 2.0 * of_w;
                state.p_by[w + 1][w + 1][j] = 2.0 * of_rate;
            }
            if let Some(j) = column(Unknown::LogSwellFrequency) {
                state.p_by[w][w][j] = -2.0 * of_w;
            }
        }
        if let Some(g) = layout.gained {
            let leak = (2.0 * values.get(Unknown::LogLeak)).exp();
            state.p[g + 1][g + 1] = leak;
            if let Some(j) = column(Unknown::LogLeak) {
                state.p_by[g + 1][g + 1][j] = 2.0 * leak;
            }
        }
        if let Some(c) = layout.current {
            let drift = (2.0 * values.get(Unknown::LogDrift)).exp();
            state.p[c][c] = drift;
            if let Some(j) = column(Unknown::LogDrift) {
                state.p_by[c][c][j] = 2.0 * drift;
            }
        }
        state
    }
}

#[cfg(test)]
mod tests {
    use super::Reversal;

    /// ∫ r|r| over a step, by the antiderivative |r|³/3f.
    fn exact(r: f64, f: f64, h: f64) -> f64 {
        ((r + f * h).abs().powi(3) - r.abs().powi(3)) / (3.0 * f)
    }

    fn series(r: f64, f: f64, h: f64) -> f64 {
        let speed = r.abs();
        speed * r * h + speed * f * h * h + Reversal::of(r, f, h).sign * f * f * h.powi(3) / 3.0
    }

    #[test]
    fn drag_over_a_step_is_exact_where_the_vehicle_turns() {
        let (h, delta) = (0.1, 1e-7);
        for f in [1.5, -1.5] {
            for tenth in -15..=15 {
                let r = 0.01 * f64::from(tenth) + 1e-3;
                assert!((series(r, f, h) - exact(r, f, h)).abs() < 1e-12, "{r} {f}");
                let Reversal { by_r, by_f, .. } = Reversal::of(r, f, h);
                let sign = |r: f64, f: f64| Reversal::of(r, f, h).sign;
                let of_r = (sign(r + delta, f) - sign(r - delta, f)) / (2.0 * delta);
                let of_f = (sign(r, f + delta) - sign(r, f - delta)) / (2.0 * delta);
                assert!((of_r - by_r).abs() < 1e-5 && (of_f - by_f).abs() < 1e-5, "{r} {f}");
            }
        }
        assert_eq!(Reversal::of(0.0, -1.0, h).sign, -1.0);
    }
}
