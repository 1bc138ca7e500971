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

use nalgebra::{DVector, SMatrix};

use super::follower::{Change, StepCache};
use super::noise::Impulse;
use super::state::{Covariance, Observation, Observed, State, Transition};
use super::{Sweep, half_log};
use crate::estimate::plant_fit::schedule::FilterInstant;
use crate::motion::Flow;

/// Number of instants between two stored states, from which what is between them is computed again.
const SEGMENT: usize = 128;

impl<const N: usize, const M: usize, const K: usize> Sweep<'_, N, M, K> {
    /// Computes the negative log-likelihood and its gradient by the logarithms of the noise.
    pub(super) fn noise_gradient(&self) -> (f64, DVector<f64>) {
        let instants = &self.schedule.instants[1..];
        let (mut steps, mut of_steps) = (StepCache::default(), StepCache::default());
        let mut at = (self.initial_mean(), self.initial_covariance());
        let (mut cost, mut marks) = (0.0, Vec::new());
        for segment in instants.chunks(SEGMENT) {
            marks.push(at);
            cost += self.follow(segment, &mut at, &mut steps, None);
        }
        let mut back = Back::new(M + N + self.states(), self.noise.count());
        if !cost.is_finite() || !at.0.motion.iter().all(|v| v.is_finite()) {
            return (f64::INFINITY, DVector::from_vec(back.gradient));
        }
        let mut tape = Tape::default();
        for (segment, mark) in instants.chunks(SEGMENT).zip(marks).rev() {
            tape.clear();
            self.follow(segment, &mut { mark }, &mut steps, Some(&mut tape));
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
        }
        for (k, first) in self.noise_sensitivities().iter().enumerate() {
            back.gradient[k] += back.covariance.inner(&first.covariance);
        }
        (cost, DVector::from_vec(back.gradient))
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
    mean: Vec<f64>,
    covariance: Square,
    transition: Square,
    /// How the state after it moves with an impulse along each axis.
    impulses: Vec<Vec<f64>>,
    /// The measurements after it.
    measured: std::ops::Range<usize>,
}

/// A measurement.
struct Measured {
    /// c, covariance of the state with its prediction.
    column: Vec<f64>,
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
        let impulse = |axis: usize| {
            let mut impulse = numbers_of(&State::<N, M, K>::zeros(covariance.count));
            impulse[..N].copy_from_slice(inverse.column(axis).as_slice());
            if let Some([_, after]) = moved {
                for i in 0..covariance.count {
                    impulse[M + N + i] = (0..N).map(|k| after[(i, k)] * impulse[k]).sum();
                }
            }
            impulse
        };
        self.steps.push(Step {
            mean: numbers_of(mean),
            covariance: Square::of_covariance(covariance),
            transition: Square::of_transition(transition, covariance.count),
            impulses: (0..N).map(impulse).collect(),
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
    mean: Vec<f64>,
    covariance: Square,
    gradient: Vec<f64>,
    /// Room for a product.
    product: Square,
}

impl Back {
    fn new(states: usize, numbers: usize) -> Self {
        Self {
            mean: vec![0.0; states],
            covariance: Square::zeros(states),
            gradient: vec![0.0; numbers],
            product: Square::zeros(states),
        }
    }

    fn reset(&mut self, state: usize) {
        self.mean[state] = 0.0;
        self.covariance.clear(state);
    }

    fn correct(&mut self, measured: &Measured) {
        let Measured { column: c, row, error: e, variance: s, number, noise } = measured;
        let by_column = self.covariance.times(c);
        let (along, across) = (dot(&self.mean, c), dot(&by_column, c));
        let square = s * s;
        let by_variance = 0.5 / s + (across - (0.5 * e + along) * e) / square;
        self.gradient[*number] += 2.0 * noise * by_variance;
        let combined = self.mean.iter().zip(&by_column).map(|(x, y)| (e * x - 2.0 * y) / s);
        let mut by_c: Vec<f64> = combined.collect();
        for (k, h) in row {
            by_c[*k] += by_variance * h;
        }
        for (k, h) in row {
            self.mean[*k] -= h * (e + along) / s;
            self.covariance.add_to_cross(*k, 0.5 * h, &by_c);
        }
    }

    /// Goes back over a step; the state begins with m numbers of motion, and disturbances follow.
    fn predict(&mut self, m: usize, step: &Step, changes: &[Change]) {
        let Step { mean, covariance, transition, impulses, .. } = step;
        let first = m + impulses.len();
        self.covariance.times_matrix(transition, &mut self.product);
        let of_impulse = |(axis, impulse): (usize, &Vec<f64>)| {
            let by_force = self.covariance.column(m + axis);
            Impulse {
                variance: dot(&self.covariance.times(impulse), impulse),
                with_force: 2.0 * dot(by_force, impulse),
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
                by += self.covariance.column(first + state)[first + state] * variance;
            }
            if let Some(fade) = &change.fade {
                let force = m + fade.axis;
                // The transition changes in a part of how the force moves, and in its decay.
                let part = transition.column(force).iter().map(|x| x * fade.push);
                let mut changed: Vec<f64> = part.collect();
                changed[force] = fade.by;
                let with_force = self.product.times(covariance.column(force));
                by += 2.0 * dot(&with_force, &changed) + dot(&self.mean, &changed) * mean[force];
            }
            for map in &change.map {
                let (row, from) = (first + map.row, first + map.from);
                let with_from = self.product.times(covariance.column(from));
                by += map.by * (2.0 * with_from[row] + self.mean[row] * mean[from]);
            }
            self.gradient[k] += by;
        }
        self.mean = transition.transposed_times(&self.mean);
        self.product.transpose();
        self.product.times_matrix(transition, &mut self.covariance);
    }
}

/// A square matrix by columns.
struct Square {
    size: usize,
    numbers: Vec<f64>,
}

impl Square {
    fn zeros(size: usize) -> Self {
        Self { size, numbers: vec![0.0; size * size] }
    }

    fn of_covariance<const N: usize, const M: usize, const K: usize>(
        covariance: &Covariance<N, M, K>,
    ) -> Self {
        let (first, size) = (M + N, M + N + covariance.count);
        let mut all = Self::zeros(size);
        let mut set = |i: usize, j: usize, x: f64| {
            all.numbers[i + j * size] = x;
            all.numbers[j + i * size] = x;
        };
        for j in 0..M {
            (0..=j).for_each(|i| set(i, j, covariance.xx[(i, j)]));
        }
        for j in 0..N {
            (0..M).for_each(|i| set(i, M + j, covariance.xf[(i, j)]));
            (0..=j).for_each(|i| set(M + i, M + j, covariance.ff[(i, j)]));
        }
        for j in 0..covariance.count {
            (0..M).for_each(|i| set(i, first + j, covariance.xo[(i, j)]));
            (0..N).for_each(|i| set(M + i, first + j, covariance.fo[(i, j)]));
            (0..=j).for_each(|i| set(first + i, first + j, covariance.oo[(i, j)]));
        }
        all
    }

    fn of_transition<const N: usize, const M: usize, const K: usize>(
        step: &Transition<N, M, K>,
        count: usize,
    ) -> Self {
        let (first, size) = (M + N, M + N + count);
        let mut all = Self::zeros(size);
        for j in 0..M {
            all.column_mut(j)[..M].copy_from_slice(step.by_motion.column(j).as_slice());
        }
        for j in 0..N {
            let column = all.column_mut(M + j);
            column[..M].copy_from_slice(step.by_disturbance.column(j).as_slice());
            column[M + j] = step.fade[j];
        }
        let Some(rows) = &step.rows else {
            (first..size).for_each(|k| all.column_mut(k)[k] = 1.0);
            return all;
        };
        if let Some(pushing) = step.pushing() {
            for j in 0..count {
                all.column_mut(first + j)[..M].copy_from_slice(pushing.column(j).as_slice());
            }
        }
        for j in 0..size {
            let column = all.column_mut(j);
            let (moved, others) = column.split_at_mut(M);
            for (i, entry) in others[N..].iter_mut().enumerate() {
                *entry = j.checked_sub(first).map_or(0.0, |j| rows.entry(i, j));
                if let Some([before, after]) = rows.moved.as_deref() {
                    *entry += (0..M).map(|k| after[(i, k)] * moved[k]).sum::<f64>();
                    *entry += if j < M { before[(i, j)] } else { 0.0 };
                }
            }
        }
        all
    }

    fn column(&self, j: usize) -> &[f64] {
        &self.numbers[j * self.size..][..self.size]
    }

    fn column_mut(&mut self, j: usize) -> &mut [f64] {
        &mut self.numbers[j * self.size..][..self.size]
    }

    /// Sets a row and a column to zero.
    fn clear(&mut self, k: usize) {
        self.column_mut(k).fill(0.0);
        self.numbers.iter_mut().skip(k).step_by(self.size).for_each(|x| *x = 0.0);
    }

    /// Adds `h x` to a row and to the column of the same index.
    fn add_to_cross(&mut self, k: usize, h: f64, x: &[f64]) {
        add_scaled(self.column_mut(k), x, h);
        let row = self.numbers.iter_mut().skip(k).step_by(self.size);
        row.zip(x).for_each(|(entry, x)| *entry += h * x);
    }

    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.size];
        for (column, &x) in self.numbers.chunks_exact(self.size).zip(x) {
            add_scaled(&mut product, column, x);
        }
        product
    }

    fn transposed_times(&self, x: &[f64]) -> Vec<f64> {
        self.numbers.chunks_exact(self.size).map(|column| dot(column, x)).collect()
    }

    /// Writes A B, of a B that is mostly zero, to `product`.
    fn times_matrix(&self, b: &Self, product: &mut Self) {
        for (sum, of_b) in product.columns_mut().zip(b.columns()) {
            sum.fill(0.0);
            for (column, &x) in self.columns().zip(of_b).filter(|(_, x)| **x != 0.0) {
                add_scaled(sum, column, x);
            }
        }
    }

    fn transpose(&mut self) {
        for j in 0..self.size {
            (0..j).for_each(|i| self.numbers.swap(i + j * self.size, j + i * self.size));
        }
    }

    fn columns(&self) -> impl Iterator<Item = &[f64]> {
        self.numbers.chunks_exact(self.size)
    }

    fn columns_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        self.numbers.chunks_exact_mut(self.size)
    }

    /// Returns the sum of products of its entries with those of a covariance.
    fn inner<const N: usize, const M: usize, const K: usize>(
        &self,
        other: &Covariance<N, M, K>,
    ) -> f64 {
        let mut sum = 0.0;
        for j in 0..M {
            sum += dot(&self.column(j)[..M], other.xx.column(j).as_slice());
        }
        for j in 0..N {
            let (of_motion, rest) = self.column(M + j).split_at(M);
            sum += 2.0 * dot(of_motion, other.xf.column(j).as_slice());
            sum += dot(&rest[..N], other.ff.column(j).as_slice());
        }
        for j in 0..other.count {
            let (of_motion, rest) = self.column(M + N + j).split_at(M);
            sum += 2.0 * dot(of_motion, other.xo.column(j).as_slice());
            sum += 2.0 * dot(&rest[..N], other.fo.column(j).as_slice());
            sum += dot(&rest[N..], &other.oo.column(j).as_slice()[..other.count]);
        }
        sum
    }
}

/// Returns the numbers of a state in a row: motion, disturbance and navigation states.
fn numbers_of<const N: usize, const M: usize, const K: usize>(state: &State<N, M, K>) -> Vec<f64> {
    let (motion, disturbance) = (state.motion.as_slice(), state.disturbance.as_slice());
    [motion, disturbance, &state.navigation[..state.count]].concat()
}

/// Returns the entries of h that are not zero, with their indices.
fn row_of<const N: usize, const M: usize>(observation: &Observation) -> Vec<(usize, f64)> {
    match observation.of {
        Observed::Velocity(place) => {
            let levers = observation.lever_terms.into_iter().flatten();
            let water = (0..2).map(|k| (M + N + k, observation.water[k]));
            let all = std::iter::once((place, 1.0)).chain(levers).chain(water);
            all.filter(|(_, x)| *x != 0.0).collect()
        }
        Observed::Down(across) => (0..3).map(|i| (N + i, across[i])).collect(),
        Observed::Navigation { state, .. } => vec![(M + N + state, 1.0)],
    }
}

/// Returns Σ x y, in four sums so that the processor need not wait for each.
fn dot(x: &[f64], y: &[f64]) -> f64 {
    let ((of_x, last_x), (of_y, last_y)) = (x.as_chunks::<4>(), y.as_chunks::<4>());
    let mut sums = [0.0; 4];
    for (x, y) in of_x.iter().zip(of_y) {
        (0..4).for_each(|k| sums[k] += x[k] * y[k]);
    }
    let rest: f64 = last_x.iter().zip(last_y).map(|(x, y)| x * y).sum();
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

fn add_scaled(sum: &mut [f64], x: &[f64], factor: f64) {
    sum.iter_mut().zip(x).for_each(|(sum, x)| *sum += factor * x);
}
