//! The gradient of the likelihood by the noise, by a sweep back over a pass of the filter.
//!
//! Over a step `x ← f(x)`, `P ← Φ P Φᵀ + Q`; a measurement with `c = P h`, `S = hᵀ c + r` and
//! `e = y − hᵀ x` costs `½ (ln S + e²/S)` and makes `x ← x + c e/S`, `P ← P − c cᵀ/S`. The
//! derivatives of the cost by x and P, here x̄ and P̄, follow from the last measurement to the first:
//!
//! ```text
//! S̄ = ½/S − ½ e²/S² − (x̄ᵀ c) e/S² + cᵀ P̄ c/S²,   c̄ = x̄ e/S − 2 P̄ c/S + S̄ h,
//! x̄ ← x̄ − h (e + x̄ᵀ c)/S,   P̄ ← P̄ + ½ (c̄ hᵀ + h c̄ᵀ),   and over a step x̄ ← Φᵀ x̄,   P̄ ← Φᵀ P̄ Φ.
//! ```
//!
//! The sweep takes as long as a few passes, however many parameters the noise has. As in the forward
//! derivatives, Φ counts as independent of the state.
//!
//! # Source
//! [GriewankWalther2008, ch. 3]: reverse mode; ch. 12: checkpoints.

use nalgebra::{DMatrix, DVector, SMatrix};

use super::follower::{Change, StepCache};
use super::noise::Impulse;
use super::state::{Covariance, Observation, Observed, State, Transition};
use super::{Sweep, half_log};
use crate::estimate::plant_fit::schedule::FilterInstant;
use crate::motion::Flow;

/// Least number of instants between two stored states, from which what is between them is computed again …
const SEGMENT: usize = 128;

/// … and entries of covariances that are stored at once: several megabytes, which hold a trial of one axis.
const MOST_STORED: usize = 200_000;

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    /// Computes the negative log-likelihood and its gradient by the logarithms of the noise.
    pub(super) fn noise_gradient(&self) -> (f64, DVector<f64>) {
        let instants = &self.schedule.instants[1..];
        let mut back = Back::new(M + N + self.states(), self.noise.count());
        let length =
            (MOST_STORED / back.covariance.len()).clamp(SEGMENT, instants.len().max(SEGMENT));
        let (mut steps, mut of_steps) = (StepCache::default(), StepCache::default());
        let mut at = (self.initial_mean(), self.initial_covariance());
        let (mut cost, mut marks, mut tape) = (0.0, Vec::new(), Tape::default());
        for segment in instants.chunks(length) {
            marks.push(at);
            // The sweep back begins with the last segment.
            let is_last = marks.len() == instants.len().div_ceil(length);
            cost += self.follow(segment, &mut at, &mut steps, is_last.then_some(&mut tape));
        }
        if !cost.is_finite() || !at.0.motion.iter().all(|v| v.is_finite()) {
            return (f64::INFINITY, back.gradient);
        }
        for (segment, mark) in instants.chunks(length).zip(marks).rev() {
            if tape.steps.is_empty() {
                self.follow(segment, &mut { mark }, &mut steps, Some(&mut tape));
            }
            for (instant, step) in segment.iter().zip(&tape.steps).rev() {
                for state in self.reset_states(instant) {
                    back.reset(M + N + state);
                }
                for measured in tape.measured[step.measured.clone()].iter().rev() {
                    back.correct(measured);
                }
                let changes = of_steps.get(instant.length_s, |h| self.changes(h));
                back.predict(M, step, changes);
            }
            tape.clear();
        }
        for (k, first) in self.noise_sensitivities().iter().enumerate() {
            back.gradient[k] += back.covariance.dot(&matrix_of(&first.covariance));
        }
        (cost, back.gradient)
    }

    /// Follows a part of the trial from a mean and a covariance to those at its end; returns its cost.
    fn follow(
        &self,
        segment: &[FilterInstant],
        (mean, covariance): &mut (State<N, M, K>, Covariance<N, M, K>),
        steps: &mut StepCache<Covariance<N, M, K>>,
        mut tape: Option<&mut Tape>,
    ) -> f64 {
        let (mut cost, mut flow) = (0.0, Flow::of_state());
        for instant in segment {
            let before = *mean;
            let transition = self.predict(instant, mean, &mut flow);
            if let Some(tape) = tape.as_mut() {
                tape.begin(&before, covariance, &transition, self.plant.inverse());
            }
            let crossed = covariance.crossed_if_needed(&transition);
            let process = steps.get(instant.length_s, |h| self.process(h));
            covariance.predict(&transition, process, crossed.as_ref());
            for (observation, y) in self.measurements(instant) {
                let (e, gain) = self.correct(&observation, y, mean, covariance);
                cost += half_log(e, gain.variance);
                if let Some(tape) = tape.as_mut() {
                    let (s, r) = (gain.variance, self.variance(&observation));
                    let number = self.noise.place_of(&observation.of);
                    let column = numbers_of(&gain.state.scaled(s));
                    let row = row_of::<N, M>(&observation);
                    tape.add(Measured { column, row, error: e, variance: s, number, noise: r });
                }
            }
            for state in self.reset_states(instant) {
                mean.reset(state);
                covariance.reset(state);
            }
        }
        cost
    }
}

/// What a sweep back needs of some steps and measurements, in order of time.
#[derive(Default)]
struct Tape {
    steps: Vec<Step>,
    measured: Vec<Measured>,
}

/// A step: state and covariance before it, and its transition matrix.
struct Step {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    transition: DMatrix<f64>,
    /// Change of the state with each component of the current, if it varies.
    by_current: Option<[DVector<f64>; 2]>,
    /// How the state after it moves with an impulse along each axis.
    impulses: Vec<DVector<f64>>,
    /// Covariance that the jitter of thrust adds to the state.
    jitter: Option<DMatrix<f64>>,
    /// The measurements after it.
    measured: std::ops::Range<usize>,
}

/// A measurement.
struct Measured {
    /// c, covariance of the state with its prediction.
    column: DVector<f64>,
    /// Entries of h that are not zero, with their indices.
    row: Vec<(usize, f64)>,
    error: f64,
    variance: f64,
    /// Index of its noise among the logarithms.
    number: usize,
    /// r.
    noise: f64,
}

impl Tape {
    fn clear(&mut self) {
        self.steps.clear();
        self.measured.clear();
    }

    fn begin<const N: usize, const M: usize, const K: usize>(
        &mut self,
        mean: &State<N, M, K>,
        covariance: &Covariance<N, M, K>,
        transition: &Transition<N, M, K>,
        inverse: &SMatrix<f64, N, N>,
    ) {
        let end = self.measured.len();
        let moved = transition.rows.as_ref().and_then(|rows| rows.moved.as_deref());
        let count = covariance.count;
        // How the state after the step moves with the motion after it.
        let mut by_motion = DMatrix::zeros(M + N + count, M);
        by_motion.view_mut((0, 0), (M, M)).fill_with_identity();
        if let Some([_, after]) = moved {
            by_motion.view_mut((M + N, 0), (count, M)).copy_from(&after.rows(0, count));
        }
        let impulse = |axis: usize| by_motion.columns(0, N) * inverse.column(axis);
        let jitter = transition.jitter.as_deref();
        let jitter = jitter.map(|jitter| &by_motion * jitter * by_motion.transpose());
        self.steps.push(Step {
            mean: numbers_of(mean),
            covariance: matrix_of(covariance),
            transition: transition_of(transition, covariance.count),
            by_current: transition.current.map(|step| step.directions::<N>(covariance.count)),
            impulses: (0..N).map(impulse).collect(),
            jitter,
            measured: end..end,
        });
    }

    fn add(&mut self, measured: Measured) {
        self.measured.push(measured);
        if let Some(step) = self.steps.last_mut() {
            step.measured.end = self.measured.len();
        }
    }
}

/// Derivatives of the cost by state, covariance and noise.
struct Back {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    gradient: DVector<f64>,
}

impl Back {
    fn new(states: usize, numbers: usize) -> Self {
        Self {
            mean: DVector::zeros(states),
            covariance: DMatrix::zeros(states, states),
            gradient: DVector::zeros(numbers),
        }
    }

    fn reset(&mut self, state: usize) {
        self.mean[state] = 0.0;
        self.covariance.row_mut(state).fill(0.0);
        self.covariance.column_mut(state).fill(0.0);
    }

    fn correct(&mut self, measured: &Measured) {
        let Measured { column: c, row, error: e, variance: s, number, noise } = measured;
        let by_column = &self.covariance * c;
        let (along, across) = (self.mean.dot(c), by_column.dot(c));
        let by_variance = 0.5 / s + (across - (0.5 * e + along) * e) / (s * s);
        self.gradient[*number] += 2.0 * noise * by_variance;
        let mut by_c = (&self.mean * *e - by_column * 2.0) / *s;
        for (k, h) in row {
            by_c[*k] += by_variance * h;
        }
        for (k, h) in row {
            self.mean[*k] -= h * (e + along) / s;
            let half = &by_c * (0.5 * h);
            let mut across = self.covariance.row_mut(*k);
            across += half.transpose();
            let mut down = self.covariance.column_mut(*k);
            down += half;
        }
    }

    /// Goes back over a step; the state begins with m numbers of motion, and disturbances follow.
    fn predict(&mut self, m: usize, step: &Step, changes: &[Change]) {
        let Step { mean, covariance, transition, by_current, impulses, jitter, .. } = step;
        let first = m + impulses.len();
        let product = &self.covariance * transition;
        let of_impulse = |(axis, impulse): (usize, &DVector<f64>)| {
            let by_force = self.covariance.column(m + axis);
            Impulse {
                variance: (&self.covariance * impulse).dot(impulse),
                with_force: 2.0 * by_force.dot(impulse),
                of_force: by_force[m + axis],
            }
        };
        let of_impulses: Vec<Impulse> = impulses.iter().enumerate().map(of_impulse).collect();
        for (k, change) in changes.iter().enumerate() {
            let mut by = 0.0;
            if let Some((axis, impulse)) = &change.impulse {
                let of = &of_impulses[*axis];
                by += of.variance * impulse.variance + of.with_force * impulse.with_force;
                by += of.of_force * impulse.of_force;
            }
            for (state, variance) in &change.process {
                by += self.covariance[(first + state, first + state)] * variance;
            }
            if let Some(fade) = &change.fade {
                let force = m + fade.axis;
                // The transition changes in a part of how the force moves, and in its decay.
                let mut changed = transition.column(force) * fade.push;
                changed[force] = fade.by;
                let with_force = &product * covariance.column(force);
                by += 2.0 * with_force.dot(&changed) + self.mean.dot(&changed) * mean[force];
            }
            for map in &change.map {
                let (row, from) = (first + map.row, first + map.from);
                let with_from = product.row(row).tr_dot(&covariance.column(from));
                by += map.by * (2.0 * with_from + self.mean[row] * mean[from]);
            }
            if let Some((current, by_current)) = change.current.zip(by_current.as_ref()) {
                for (component, direction) in by_current.iter().enumerate() {
                    let from = first + component;
                    let with_from = direction.dot(&(&product * covariance.column(from)));
                    let of_mean = self.mean.dot(direction) * mean[from];
                    by += current.fade * (2.0 * with_from + of_mean);
                    by += current.added * (&self.covariance * direction).dot(direction);
                }
            }
            if let Some(jitter) = jitter.as_ref().filter(|_| change.jitter != 0.0) {
                by += change.jitter * self.covariance.dot(jitter);
            }
            self.gradient[k] += by;
        }
        self.mean = transition.tr_mul(&self.mean);
        self.covariance = transition.transpose() * product;
    }
}

/// Returns a covariance as one matrix.
fn matrix_of<const N: usize, const M: usize, const K: usize>(
    covariance: &Covariance<N, M, K>,
) -> DMatrix<f64> {
    let (first, count) = (M + N, covariance.count);
    let mut all = DMatrix::zeros(first + count, first + count);
    all.view_mut((0, 0), (M, M)).copy_from(&covariance.xx);
    all.view_mut((0, M), (M, N)).copy_from(&covariance.xf);
    all.view_mut((M, M), (N, N)).copy_from(&covariance.ff);
    all.view_mut((0, first), (M, count)).copy_from(&covariance.xo.columns(0, count));
    all.view_mut((M, first), (N, count)).copy_from(&covariance.fo.columns(0, count));
    all.view_mut((first, first), (count, count))
        .copy_from(&covariance.oo.view((0, 0), (count, count)));
    all.fill_lower_triangle_with_upper_triangle();
    all
}

/// Returns the transition of a step with some navigation states as one matrix.
fn transition_of<const N: usize, const M: usize, const K: usize>(
    step: &Transition<N, M, K>,
    count: usize,
) -> DMatrix<f64> {
    let first = M + N;
    let mut all = DMatrix::identity(first + count, first + count);
    all.view_mut((0, 0), (M, M)).copy_from(&step.by_motion);
    all.view_mut((0, M), (M, N)).copy_from(&step.by_disturbance);
    (0..N).for_each(|k| all[(M + k, M + k)] = step.fade[k]);
    let Some(rows) = &step.rows else { return all };
    if let Some(pushing) = step.pushing() {
        all.view_mut((0, first), (M, count)).copy_from(&pushing.columns(0, count));
    }
    for i in 0..count {
        (0..count).for_each(|j| all[(first + i, first + j)] = rows.entry(i, j));
    }
    if let Some([before, after]) = rows.moved.as_deref() {
        let by_after = after.rows(0, count) * all.rows(0, M);
        let mut of_navigation = all.rows_mut(first, count);
        of_navigation += by_after;
        let mut by_motion = of_navigation.columns_mut(0, M);
        by_motion += before.rows(0, count);
    }
    if let Some(current) = &step.current {
        for (component, direction) in current.directions::<N>(count).iter().enumerate() {
            let mut column = all.column_mut(first + component);
            column += direction * (current.fade - 1.0);
        }
    }
    all
}

/// Returns the numbers of a state in a row: motion, disturbance and navigation states.
fn numbers_of<const N: usize, const M: usize, const K: usize>(
    state: &State<N, M, K>,
) -> DVector<f64> {
    let (motion, disturbance) = (state.motion.as_slice(), state.disturbance.as_slice());
    DVector::from_vec([motion, disturbance, &state.navigation[..state.count]].concat())
}

/// Returns the entries of h that are not zero, with their indices.
fn row_of<const N: usize, const M: usize>(observation: &Observation) -> Vec<(usize, f64)> {
    match observation.of {
        Observed::Velocity(place) => {
            let levers = observation.lever_terms.into_iter().flatten();
            let water = (0..2).map(|k| (M + N + k, observation.water[k]));
            let own = observation.lagged.map_or(place, |state| M + N + state);
            let all = std::iter::once((own, 1.0)).chain(levers).chain(water);
            all.filter(|(_, x)| *x != 0.0).collect()
        }
        Observed::Down(across) => (0..3).map(|i| (N + i, across[i])).collect(),
        Observed::Navigation { state, .. } => vec![(M + N + state, 1.0)],
    }
}
