//! Simulation of a section with the derivatives of its motion, in one pass.

use nalgebra::{SMatrix, SVector};

use super::drift::WalkFilter;
use super::stretch::{Measured, Sample, Step, Stretch};
use crate::{LumpedParameters, State};

/// Number of unknowns: `[α, β, μ, bias]`, then velocity and position at the start of a section.
pub(super) const UNKNOWNS: usize = 6;
/// Number of unknowns on which velocity depends.
const OF_VELOCITY: usize = 5;

/// Loss ρ of a residual r, in standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Weighing {
    /// ρ = ½ r².
    Squares,
    /// ρ = ½ r² up to a limit, linear beyond. The information has weights ψ(r)/r, with which every
    /// step is a descent direction.
    Huber(f64),
    /// The same loss with weights ψ'(r), which give the second derivative of the cost.
    HuberCurvature(f64),
}

/// Sums over some samples.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// Σ w JᵀJ, both triangles.
    pub(super) information: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Σ Jᵀψ, the negative gradient.
    pub(super) score: SVector<f64, UNKNOWNS>,
    /// Σ ρ.
    pub(super) cost: f64,
    /// Σ ψ.
    pub(super) influence: f64,
    /// Σ ψ².
    pub(super) influence_squares: f64,
    /// Σ r², of velocity and of position.
    pub(super) squares: [f64; 2],
    /// Number of samples.
    pub(super) samples: usize,
}

impl Sums {
    pub(super) fn add(&mut self, other: &Self) {
        self.information += other.information;
        self.score += other.score;
        self.cost += other.cost;
        self.influence += other.influence;
        self.influence_squares += other.influence_squares;
        self.squares[0] += other.squares[0];
        self.squares[1] += other.squares[1];
        self.samples += other.samples;
    }
}

/// Noise and loss of the residuals.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    pub(super) weighing: Weighing,
    /// Standard deviations of a sample of velocity and of position.
    pub(super) std: [f64; 2],
    /// Variance per second of the random walk in position: [`WalkFilter`].
    pub(super) drift: f64,
}

/// The noise has converged when it changes by less than this fraction: the effect on the plant is
/// that fraction of a fraction of a standard deviation.
const SETTLED: f64 = 1e-4;

/// The same for the random walk, whose error affects the cost in second order.
const DRIFT_SETTLED: f64 = 1e-2;

impl Weights {
    pub(super) fn std_of(&self, measured: Measured) -> f64 {
        self.std[measured as usize]
    }

    /// Returns true if the difference from another has a negligible effect on the optimum.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        let near = |a: f64, b: f64, part: f64| (a - b).abs() <= part * a.abs();
        let stds = self.std.iter().zip(other.std).all(|(&a, b)| near(a, b, SETTLED));
        stds && near(self.drift, other.drift, DRIFT_SETTLED) && self.weighing == other.weighing
    }
}

/// Simulates a section and sums over its samples, batch by batch.
pub(super) fn batches(
    stretch: &Stretch,
    plant: &LumpedParameters,
    start: State,
    batch: usize,
    weights: &Weights,
) -> Vec<Sums> {
    let all = Pass { stretch, plant, start, batch, weights };
    match (stretch.has_position, weights.weighing) {
        (false, Weighing::Squares) => all.run::<5, false>(squares),
        (true, Weighing::Squares) => all.run::<6, true>(squares),
        (false, Weighing::Huber(limit)) => all.run::<5, false>(huber(limit)),
        (true, Weighing::Huber(limit)) => all.run::<6, true>(huber(limit)),
        (false, Weighing::HuberCurvature(limit)) => all.run::<5, false>(curvature(limit)),
        (true, Weighing::HuberCurvature(limit)) => all.run::<6, true>(curvature(limit)),
    }
}

/// Measurement minus simulation of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Residual {
    pub(super) measured: Measured,
    /// Time since the start of the section, s.
    pub(super) at_s: f64,
    pub(super) value: f64,
}

/// Returns the residual of each sample.
pub(super) fn residuals(
    stretch: &Stretch,
    plant: &LumpedParameters,
    start: State,
) -> Vec<Residual> {
    let mut moving = SimulatedMotion::from(start);
    let mut at_s = 0.0;
    let mut steps = stretch.steps.iter();
    let residual = |sample: &Sample| {
        for step in steps.by_ref().take(sample.steps as usize) {
            moving.advance::<true>(plant, step);
            at_s += step.span_s;
        }
        let predicted = match sample.measured {
            Measured::Velocity => moving.velocity,
            Measured::Position => moving.position,
        };
        Residual { measured: sample.measured, at_s, value: sample.value - predicted }
    };
    stretch.samples.iter().map(residual).collect()
}

/// ρ, ψ and the weight of JᵀJ.
type Weighed = (f64, f64, f64);

fn squares(r: f64) -> Weighed {
    (0.5 * r * r, r, 1.0)
}

fn huber(limit: f64) -> impl Fn(f64) -> Weighed {
    move |r| {
        let size = r.abs();
        if size <= limit {
            squares(r)
        } else {
            (limit * (size - 0.5 * limit), limit.copysign(r), limit / size)
        }
    }
}

fn curvature(limit: f64) -> impl Fn(f64) -> Weighed {
    move |r| {
        let (cost, influence, _) = huber(limit)(r);
        (cost, influence, f64::from(r.abs() <= limit))
    }
}

struct Pass<'a> {
    stretch: &'a Stretch,
    plant: &'a LumpedParameters,
    start: State,
    batch: usize,
    weights: &'a Weights,
}

impl Pass<'_> {
    fn run<const N: usize, const POSITION: bool>(
        &self,
        weigh: impl Fn(f64) -> Weighed,
    ) -> Vec<Sums> {
        let Stretch { samples, steps, .. } = self.stretch;
        let [per_velocity, per_position] = self.weights.std.map(|std| 1.0 / std);
        // Rows of a single kind are divided by the standard deviation once, after summation.
        let (now_per, then_per) = if POSITION { (per_velocity, 1.0) } else { (1.0, per_velocity) };
        let mut moving = SimulatedMotion::from(self.start);
        let mut drift = WalkFilter::<N>::new(self.weights.drift);
        let mut steps = steps.as_slice();
        let of_batch = |samples: &[Sample]| {
            let mut sums = CompactSums::<N>::default();
            for sample in samples {
                let (now, later) = steps.split_at(sample.steps as usize);
                now.iter().for_each(|step| moving.advance::<POSITION>(self.plant, step));
                if POSITION {
                    now.iter().for_each(|step| drift.wait(step.span_s));
                }
                steps = later;
                if POSITION && sample.measured == Measured::Position {
                    let residual = per_position * (sample.value - moving.position);
                    let (r, row) = drift.take(residual, &moving.position_row(per_position));
                    sums.add(Measured::Position, r, &row, &weigh);
                } else {
                    let r = per_velocity * (sample.value - moving.velocity);
                    let row = moving.velocity_row(now_per);
                    sums.add(Measured::Velocity, r, &row, &weigh);
                }
            }
            sums.into_sums(then_per, samples.len())
        };
        samples.chunks(self.batch).map(of_batch).collect()
    }
}

/// [`Sums`] over only as many unknowns as a sample depends on, for the inner loop.
struct CompactSums<const N: usize> {
    information: [[f64; N]; N],
    score: [f64; N],
    cost: f64,
    influence: f64,
    influence_squares: f64,
    velocity_squares: f64,
    position_squares: f64,
}

impl<const N: usize> Default for CompactSums<N> {
    fn default() -> Self {
        let (information, score) = ([[0.0; N]; N], [0.0; N]);
        let (cost, influence, influence_squares) = (0.0, 0.0, 0.0);
        let (velocity_squares, position_squares) = (0.0, 0.0);
        Self {
            information,
            score,
            cost,
            influence,
            influence_squares,
            velocity_squares,
            position_squares,
        }
    }
}

impl<const N: usize> CompactSums<N> {
    #[expect(clippy::needless_range_loop, reason = "a tenth quicker than iterators")]
    #[inline(always)]
    fn add(&mut self, measured: Measured, r: f64, row: &[f64; N], weigh: impl Fn(f64) -> Weighed) {
        let (cost, influence, weight) = weigh(r);
        for i in 0..N {
            let weighed = weight * row[i];
            for j in i..N {
                self.information[i][j] += weighed * row[j];
            }
            self.score[i] += influence * row[i];
        }
        self.cost += cost;
        self.influence += influence;
        self.influence_squares += influence * influence;
        match measured {
            Measured::Velocity => self.velocity_squares += r * r,
            Measured::Position => self.position_squares += r * r,
        }
    }

    /// Converts to [`Sums`]; rows are multiplied by `factor`.
    fn into_sums(self, factor: f64, samples: usize) -> Sums {
        let at = |i: usize, j: usize| self.information[i.min(j)][i.max(j)];
        Sums {
            information: SMatrix::from_fn(|i, j| match i.max(j) < N {
                true => factor * factor * at(i, j),
                false => 0.0,
            }),
            score: SVector::from_fn(|i, _| factor * self.score.get(i).unwrap_or(&0.0)),
            cost: self.cost,
            influence: self.influence,
            influence_squares: self.influence_squares,
            squares: [self.velocity_squares, self.position_squares],
            samples,
        }
    }
}

/// Simulated motion and its derivatives by `[α, β, μ, bias, v₀]`; the derivative of position by the
/// initial position is one.
struct SimulatedMotion {
    velocity: f64,
    position: f64,
    velocity_by: [f64; OF_VELOCITY],
    position_by: [f64; OF_VELOCITY],
}

impl From<State> for SimulatedMotion {
    fn from(start: State) -> Self {
        Self {
            velocity: start.velocity,
            position: start.position,
            velocity_by: [0.0, 0.0, 0.0, 0.0, 1.0],
            position_by: [0.0; OF_VELOCITY],
        }
    }
}

impl SimulatedMotion {
    /// Advances motion and derivatives by one classical Runge–Kutta step.
    ///
    /// Stage i, at velocity `vᵢ`, adds `κᵢ = h v̇(vᵢ)`. One step takes velocity v to
    /// `v + (κ₁ + 2κ₂ + 2κ₃ + κ₄)/6`, so that a change of `κᵢ`, whatever its cause, changes the
    /// result by the weight `wᵢ` below. The derivative of a step by a parameter is therefore
    /// `Σ wᵢ ∂κᵢ`, equal to RK4 of `ṡ = (2β|v| + μ) s + f`.
    #[expect(clippy::needless_range_loop, reason = "a tenth quicker than iterators")]
    #[inline(always)]
    fn advance<const POSITION: bool>(&mut self, plant: &LumpedParameters, step: &Step) {
        let &Step { span_s: h, tau } = step;
        let constant = h * (plant.alpha * tau + plant.bias);
        let (beta, mu) = (h * plant.beta, h * plant.mu);
        let (half_constant, half_beta, half_mu) = (0.5 * constant, 0.5 * beta, 0.5 * mu);

        // Each stage depends on the previous one: the number of operations in between is minimal.
        let v1 = self.velocity;
        let s1 = v1.abs() * v1;
        let half = v1 + half_constant;
        let v2 = half_beta * s1 + (half_mu * v1 + half);
        let s2 = v2.abs() * v2;
        let v3 = half_beta * s2 + (half_mu * v2 + half);
        let s3 = v3.abs() * v3;
        let v4 = beta * s3 + (mu * v3 + (v1 + constant));
        let s4 = v4.abs() * v4;
        // κ₁ + 2κ₂ + 2κ₃ + κ₄ from the stages: κ₁ = 2 (v₂ − v₁), and so on.
        let k4 = beta * s4 + (mu * v4 + constant);
        let before = v2 + 2.0 * v3 + v4 - 4.0 * v1;
        self.velocity = v1 + (1.0 / 3.0) * (before + 0.5 * k4);

        let slope = |v: f64| 2.0 * beta * v.abs() + mu;
        let (a1, a2, a3, a4) = (slope(v1), slope(v2), slope(v3), slope(v4));
        if POSITION {
            let u3 = h / 6.0;
            let u2 = h / 6.0 + 0.5 * a3 * u3;
            let u1 = h / 6.0 + 0.5 * a2 * u2;
            self.position += h / 6.0 * (v1 + 2.0 * (v2 + v3) + v4);
            let by_bias = h * (u1 + u2 + u3);
            let own = [
                tau * by_bias,
                h * (u1 * s1 + u2 * s2 + u3 * s3),
                h * (u1 * v1 + u2 * v2 + u3 * v3),
                by_bias,
                0.0,
            ];
            let keep = h + u1 * a1 + u2 * a2 + u3 * a3;
            for j in 0..OF_VELOCITY {
                self.position_by[j] += keep * self.velocity_by[j] + own[j];
            }
        }
        let w4 = 1.0 / 6.0;
        let w3 = 1.0 / 3.0 + a4 * w4;
        let w2 = 1.0 / 3.0 + 0.5 * a3 * w3;
        let w1 = 1.0 / 6.0 + 0.5 * a2 * w2;
        let by_bias = h * ((w1 + w2) + (w3 + w4));
        let own = [
            tau * by_bias,
            h * ((w1 * s1 + w2 * s2) + (w3 * s3 + w4 * s4)),
            h * ((w1 * v1 + w2 * v2) + (w3 * v3 + w4 * v4)),
            by_bias,
            0.0,
        ];
        let keep = 1.0 + ((w1 * a1 + w2 * a2) + (w3 * a3 + w4 * a4));
        for j in 0..OF_VELOCITY {
            self.velocity_by[j] = keep * self.velocity_by[j] + own[j];
        }
    }

    /// Returns the derivatives of velocity, times a factor.
    #[inline(always)]
    fn velocity_row<const N: usize>(&self, factor: f64) -> [f64; N] {
        let of = |j| if j < OF_VELOCITY { factor * self.velocity_by[j] } else { 0.0 };
        std::array::from_fn(of)
    }

    /// Returns the derivatives of position, times a factor.
    #[inline(always)]
    fn position_row<const N: usize>(&self, factor: f64) -> [f64; N] {
        let of = |j| if j < OF_VELOCITY { factor * self.position_by[j] } else { factor };
        std::array::from_fn(of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANT: LumpedParameters =
        LumpedParameters { alpha: 8e-5, beta: -0.2, mu: -0.03, bias: 0.015 };
    const START: State = State { position: 2.0, velocity: -0.4 };

    /// Returns uneven samples, some without a step of their own and some with three.
    fn stretch(measured: &[Measured]) -> Stretch {
        let sample = |k: usize| Sample {
            measured: measured[k % measured.len()],
            steps: ((k * k) % 4) as u32,
            value: 0.1 * (k as f64).cos(),
        };
        let samples: Vec<Sample> = (0..200).map(sample).collect();
        let count: u32 = samples.iter().map(|sample| sample.steps).sum();
        let step = |k: u32| Step {
            span_s: 0.04 + 0.06 * f64::from(k).sin().powi(2),
            tau: 1500.0 * (0.07 * f64::from(k)).sin(),
        };
        let steps = (0..count).map(step).collect();
        let has_position = measured.contains(&Measured::Position);
        Stretch { has_position, start: START, steps, samples, period_s: 0.1 }
    }

    const KINDS: [&[Measured]; 3] = [
        &[Measured::Velocity],
        &[Measured::Position],
        &[Measured::Velocity, Measured::Velocity, Measured::Position],
    ];

    fn counted(weighing: Weighing, drift: f64) -> Weights {
        Weights { weighing, std: [0.5, 0.4], drift }
    }

    fn moved(j: usize, by: f64) -> (LumpedParameters, State) {
        let mut plant = PLANT.to_vector();
        let mut start = START;
        match j {
            0..4 => plant[j] += by,
            4 => start.velocity += by,
            _ => start.position += by,
        }
        (LumpedParameters::from_vector(&plant), start)
    }

    /// Steps of central differences, small relative to each unknown.
    const STEPS: [f64; UNKNOWNS] = [1e-9, 1e-5, 1e-6, 1e-6, 1e-5, 1e-5];

    /// Relative error of central differences with those steps.
    const DIFFERENCES: f64 = 1e-7;

    #[test]
    fn sensitivities_match_central_differences() {
        for kinds in KINDS {
            let stretch = stretch(kinds);
            let residuals = |j, by| {
                let (plant, start) = moved(j, by);
                let all = residuals(&stretch, &plant, start);
                let per_std =
                    |r: &Residual| r.value / counted(Weighing::Squares, 0.0).std_of(r.measured);
                all.iter().map(per_std).collect::<Vec<f64>>()
            };
            let slope: Vec<Vec<f64>> = (0..UNKNOWNS)
                .map(|j| {
                    let (up, down) = (residuals(j, STEPS[j]), residuals(j, -STEPS[j]));
                    up.iter().zip(down).map(|(up, down)| (down - up) / (2.0 * STEPS[j])).collect()
                })
                .collect();
            let at = residuals(0, 0.0);
            for (weighing, weighs) in
                [(Weighing::Squares, f64::INFINITY), (Weighing::HuberCurvature(0.3), 0.3)]
            {
                let parts = batches(&stretch, &PLANT, START, 37, &counted(weighing, 0.0));
                assert_eq!(parts.len(), 6);
                let mut sums = Sums::default();
                parts.iter().for_each(|part| sums.add(part));
                for i in 0..UNKNOWNS {
                    for j in 0..UNKNOWNS {
                        let of = |k: usize| match at[k].abs() <= weighs {
                            true => slope[i][k] * slope[j][k],
                            false => 0.0,
                        };
                        let expected: f64 = (0..at.len()).map(of).sum();
                        let size: f64 =
                            (0..at.len()).map(|k| (slope[i][k] * slope[j][k]).abs()).sum();
                        let off = (sums.information[(i, j)] - expected).abs();
                        assert!(off <= DIFFERENCES * size, "{kinds:?} {i} {j}: {off} of {size}");
                    }
                }
            }
        }
    }

    #[test]
    fn score_is_the_negative_gradient_of_the_cost() {
        for kinds in KINDS {
            for (weighing, drift) in
                [(Weighing::Squares, 0.0), (Weighing::Huber(0.3), 0.0), (Weighing::Squares, 0.7)]
            {
                let (stretch, weights) = (stretch(kinds), counted(weighing, drift));
                let at = |j, by| {
                    let (plant, start) = moved(j, by);
                    batches(&stretch, &plant, start, 1000, &weights)[0]
                };
                let score = at(0, 0.0).score;
                for (j, step) in STEPS.into_iter().enumerate() {
                    let slope = (at(j, -step).cost - at(j, step).cost) / (2.0 * step);
                    let off = (score[j] - slope).abs() / slope.abs().max(1.0);
                    assert!(off < 1e-5, "{kinds:?} {weighing:?} {j}: {} {slope}", score[j]);
                }
            }
        }
    }
}
