//! The extended Kalman filter of one trial, with the sensitivities of its innovations.
//!
//! States velocity v, a slow disturbance d and, where the model has them, position p, what the
//! velocity sensor makes of v, waves and a current that varies:
//! `v̇ = α τ* + (β|r| + μ − α k_in γ) r + bias + d + ẇ` with r = v − u − c, `ḋ = −d/T + noise`,
//! `ṗ = v`. Where an accelerometer measures, what velocity gains since its last mean, with what
//! gravity leaks into it, `ṡ = v̇ + b`, and that leak itself, `ḃ = −b/T_b + noise`, are states too.

mod measure;
mod sensitivity;
mod step;

use nalgebra::{DMatrix, DVector};

use super::discrete::{Sensing, Slow, Waves};
use super::driven::DrivenStep;
use super::parameters::{Active, Sensor, Unknown, Values};
use super::schedule::{Instrument, Measurements};

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
    steps: &mut dyn Iterator<Item = DrivenStep>,
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
                .run(steps)
        };
    }
    // The usual sizes are met closely; each size is compiled by itself.
    match (layout.states, columns) {
        (2, 0) => run!(2, 0),
        (2, 1..=8) => run!(2, 8),
        (2, 9..=12) => run!(2, 12),
        (2, 13..=16) => run!(2, 16),
        (2, 17..=24) => run!(2, 24),
        (2, _) => run!(2, 32),
        (3, 0) => run!(3, 0),
        (3, 1..=12) => run!(3, 12),
        (3, 13..=16) => run!(3, 16),
        (3, 17..=24) => run!(3, 24),
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
    fn run(mut self, steps: &mut dyn Iterator<Item = DrivenStep>) -> Likelihood {
        let mut discrete = self.discrete(0.0);
        for (stop, push) in steps {
            if stop.length_s > 0.0 {
                // Decimal time stamps differ in their last digits; steps do not.
                if (stop.length_s - discrete.h).abs() > 1e-9 {
                    discrete = self.discrete(stop.length_s);
                }
                self.predict(&push, &discrete);
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
