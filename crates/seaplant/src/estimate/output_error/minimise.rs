//! Gauss–Newton steps, damped where they do not go downhill.

use nalgebra::{Cholesky, Matrix2, Matrix4, Matrix4x2, Vector2, Vector4};

use super::sensitivity::{Count, Residual, Sums, batches, residuals};
use super::stretch::{Measured, Stretch};
use crate::{LumpedParameters, State, Term, Terms};

/// The measurements, and what is asked of them.
pub(super) struct Problem<'a> {
    pub(super) stretches: &'a [Stretch],
    pub(super) terms: Terms,
    /// Time whose samples are summed into one batch, s.
    pub(super) batch_s: f64,
}

/// A plant, and the state that each stretch starts from.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) plant: LumpedParameters,
    pub(super) starts: Vec<State>,
}

/// What the measurements say at a point.
pub(super) struct Evaluated {
    /// The sums of each batch, stretch by stretch.
    pub(super) batches: Vec<Vec<Sums>>,
    /// Their total, stretch by stretch.
    pub(super) totals: Vec<Sums>,
    pub(super) cost: f64,
}

/// Where a search ended.
pub(super) struct Optimum {
    pub(super) point: Point,
    pub(super) at: Evaluated,
    pub(super) converged: bool,
    pub(super) iterations: usize,
}

const MOST_ITERATIONS: usize = 60;

/// Undamped, but for what keeps dependent columns from making infinite steps.
const LEAST_DAMPING: f64 = 1e-12;
const FIRST_DAMPING: f64 = 1e-4;
const MOST_DAMPING: f64 = 1e9;

/// A search has converged when its step is this part of a standard deviation: the step
/// is then made, and the next would be too small to matter, as Gauss–Newton's error
/// shrinks many times over with each.
const CONVERGED_STD: f64 = 1e-4;

/// … or when the step changes the simulation by this part of what was measured, where
/// there is no noise.
const CONVERGED_PART: f64 = 1e-12;

/// A step that fails at every size still counts as converged if it promised less than
/// this part of the cost: what is left is the rounding of thousands of terms.
const ROUNDING_PART: f64 = 1e-10;

impl Problem<'_> {
    pub(super) fn samples(&self) -> usize {
        self.stretches.iter().map(|stretch| stretch.samples.len()).sum()
    }

    pub(super) fn evaluate(&self, point: &Point, count: &Count) -> Evaluated {
        let of = |(stretch, &start): (&Stretch, &State)| {
            let batch = ((self.batch_s / stretch.period_s).round() as usize).max(1);
            batches(stretch, &point.plant, start, batch, count)
        };
        let batches: Vec<Vec<Sums>> = self.stretches.iter().zip(&point.starts).map(of).collect();
        let total = |batches: &Vec<Sums>| {
            batches.iter().fold(Sums::default(), |mut all, sums| {
                all.add(sums);
                all
            })
        };
        let totals: Vec<Sums> = batches.iter().map(total).collect();
        let cost = totals.iter().map(|sums| sums.cost).sum();
        Evaluated { batches, totals, cost }
    }

    /// Residuals of what measures one thing, stretch by stretch.
    pub(super) fn residuals(&self, point: &Point, measured: Measured) -> Vec<Vec<Residual>> {
        let of = |(stretch, &start): (&Stretch, &State)| {
            let mut all = residuals(stretch, &point.plant, start);
            all.retain(|residual| residual.measured == measured);
            all
        };
        self.stretches.iter().zip(&point.starts).map(of).collect()
    }

    pub(super) fn measures(&self, measured: Measured) -> bool {
        self.stretches.iter().any(|stretch| stretch.measures(measured))
    }

    /// Root mean square of what was measured; of position, of how far it went.
    pub(super) fn measured_rms(&self, measured: Measured) -> f64 {
        let of_kind = self.stretches.iter().map(|stretch| stretch.squares(measured));
        let (sum, count) = of_kind.fold((0.0, 0), |all, own| (all.0 + own.0, all.1 + own.1));
        (sum / count.max(1) as f64).sqrt()
    }

    /// Σ of squares of what was measured, in standard deviations.
    fn measured_squares(&self, count: &Count) -> f64 {
        let of = |measured| {
            let squares = self.stretches.iter().map(|stretch| stretch.squares(measured).0);
            squares.sum::<f64>() / count.std_of(measured).powi(2)
        };
        of(Measured::Velocity) + of(Measured::Position)
    }

    /// Minimises the cost from a point.
    pub(super) fn minimise(&self, start: Point, count: &Count) -> Optimum {
        let (mut point, mut at) = (start.clone(), self.evaluate(&start, count));
        let floor = CONVERGED_PART.powi(2) * self.measured_squares(count);
        let samples = self.samples() as f64;
        let mut damping = LEAST_DAMPING;
        let mut iterations = 0;
        while iterations < MOST_ITERATIONS && at.cost.is_finite() {
            iterations += 1;
            let step = self.step(&at, LEAST_DAMPING);
            let promise = step.as_ref().map_or(f64::INFINITY, |step| step.promise);
            let variance = 2.0 * at.cost / samples;
            if let Some(step) = &step
                && promise <= (CONVERGED_STD.powi(2) * variance).max(floor)
            {
                let point = point.moved(step);
                return Optimum { point, at, converged: true, iterations };
            }
            let mut accepted = None;
            while accepted.is_none() && damping < MOST_DAMPING {
                let next = self.step(&at, damping).map(|step| point.moved(&step));
                let next = next.map(|next| (self.evaluate(&next, count), next));
                accepted = next.filter(|(there, _)| there.cost < at.cost);
                damping = match accepted {
                    Some(_) => (0.1 * damping).max(LEAST_DAMPING),
                    None => (10.0 * damping).max(FIRST_DAMPING),
                };
            }
            let Some(next) = accepted else {
                let converged = promise <= ROUNDING_PART * at.cost;
                return Optimum { point, at, converged, iterations };
            };
            (at, point) = next;
        }
        Optimum { point, at, converged: false, iterations }
    }

    /// The step to where the cost would be least if it were a parabola.
    fn step(&self, at: &Evaluated, damping: f64) -> Option<Step> {
        let mut plant = Reduced::of(&at.totals, damping);
        plant.keep(self.terms);
        let scale = plant.scale;
        let scaled = plant.information.component_mul(&(scale * scale.transpose()));
        let score = plant.score.component_mul(&scale);
        let change = Cholesky::new(scaled)?.solve(&score).component_mul(&scale);
        let starts = plant.own.iter().map(|own| own.change(&change)).collect();
        let mut step = Step { plant: change, starts, promise: 0.0 };
        step.promise = step.along(&at.totals);
        step.promise.is_finite().then_some(step)
    }
}

/// A change of plant and initial states.
struct Step {
    plant: Vector4<f64>,
    /// Of velocity and position at the start of each stretch.
    starts: Vec<Vector2<f64>>,
    /// By how much it would lower the cost, twice.
    promise: f64,
}

impl Step {
    fn along(&self, totals: &[Sums]) -> f64 {
        let of = |(start, sums): (&Vector2<f64>, &Sums)| {
            self.plant.dot(&sums.score.fixed_rows::<4>(0))
                + start.dot(&sums.score.fixed_rows::<2>(4))
        };
        self.starts.iter().zip(totals).map(of).sum()
    }
}

/// A mass changes at most by this factor in one step, so that it stays one.
const MASS_FACTOR: f64 = 4.0;

impl Point {
    fn moved(&self, step: &Step) -> Self {
        let LumpedParameters { alpha, .. } = self.plant;
        let mut plant = LumpedParameters::from_vector(&(self.plant.to_vector() + step.plant));
        plant.alpha = plant.alpha.clamp(alpha / MASS_FACTOR, alpha * MASS_FACTOR);
        let start = |(start, change): (&State, &Vector2<f64>)| State {
            velocity: start.velocity + change[0],
            position: start.position + change[1],
        };
        Self { plant, starts: self.starts.iter().zip(&step.starts).map(start).collect() }
    }
}

/// The information on the plant that is left once every stretch has the initial state
/// that suits it.
pub(super) struct Reduced {
    pub(super) information: Matrix4<f64>,
    pub(super) score: Vector4<f64>,
    /// Brings the information, initial states aside, to a unit diagonal.
    pub(super) scale: Vector4<f64>,
    pub(super) own: Vec<Own>,
}

/// One stretch's initial state beside the plant.
pub(super) struct Own {
    /// The initial state that its score asks for.
    alone: Vector2<f64>,
    /// What a change of the plant takes from it: C⁻¹ Bᵀ, transposed.
    by_plant: Matrix4x2<f64>,
}

impl Own {
    fn change(&self, plant: &Vector4<f64>) -> Vector2<f64> {
        self.alone - self.by_plant.transpose() * plant
    }

    /// A score on the plant without what the initial state can answer.
    pub(super) fn reduce(&self, sums: &Sums) -> Vector4<f64> {
        sums.score.fixed_rows::<4>(0) - self.by_plant * sums.score.fixed_rows::<2>(4)
    }

    /// The information on the plant likewise.
    pub(super) fn reduced_information(&self, sums: &Sums) -> Matrix4<f64> {
        let shared = sums.information.fixed_view::<4, 4>(0, 0);
        let cross = sums.information.fixed_view::<4, 2>(0, 4);
        let start = sums.information.fixed_view::<2, 2>(4, 4);
        let both = cross * self.by_plant.transpose();
        shared - both - both.transpose() + self.by_plant * start * self.by_plant.transpose()
    }
}

impl Reduced {
    pub(super) fn of(totals: &[Sums], damping: f64) -> Self {
        let (mut information, mut score) = (Matrix4::zeros(), Vector4::zeros());
        let mut diagonal = Vector4::zeros();
        let mut own = Vec::with_capacity(totals.len());
        for sums in totals {
            let shared = sums.information.fixed_view::<4, 4>(0, 0);
            let cross: Matrix4x2<f64> = sums.information.fixed_view::<4, 2>(0, 4).into();
            let mut start: Matrix2<f64> = sums.information.fixed_view::<2, 2>(4, 4).into();
            for j in 0..2 {
                start[(j, j)] *= 1.0 + damping;
                // Velocity says nothing of the position that it started from.
                if start[(j, j)] <= 0.0 {
                    start[(j, j)] = 1.0;
                }
            }
            let inverse = start.try_inverse().unwrap_or_else(Matrix2::zeros);
            let of_stretch =
                Own { alone: inverse * sums.score.fixed_rows::<2>(4), by_plant: cross * inverse };
            information += shared - of_stretch.by_plant * cross.transpose();
            score += of_stretch.reduce(sums);
            diagonal += shared.diagonal();
            own.push(of_stretch);
        }
        information += Matrix4::from_diagonal(&(damping * diagonal));
        let scale = diagonal.map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
        Self { information, score, scale, own }
    }

    /// Holds the terms that are not fitted where they are.
    fn keep(&mut self, terms: Terms) {
        for term in Term::ALL.into_iter().filter(|term| !terms.has(*term)) {
            let j = term as usize;
            self.information.fill_row(j, 0.0);
            self.information.fill_column(j, 0.0);
            self.information[(j, j)] = 1.0;
            self.score[j] = 0.0;
            self.scale[j] = 1.0;
        }
    }
}
