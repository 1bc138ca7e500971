//! Damped Gauss–Newton minimisation.

use nalgebra::{Cholesky, Matrix2, Matrix4, Matrix4x2, Vector2, Vector4};

use super::sensitivity::{Residual, Sums, Weights, batches, residuals};
use super::stretch::{Measured, Stretch};
use crate::{LumpedParameters, State, Term, Terms};

/// The data and the fitted terms.
pub(super) struct Problem<'a> {
    pub(super) stretches: &'a [Stretch],
    pub(super) terms: Terms,
    /// Duration of a batch, s; its samples are summed.
    pub(super) batch_s: f64,
}

/// A plant, and the initial state of each section.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Point {
    pub(super) plant: LumpedParameters,
    pub(super) starts: Vec<State>,
}

/// Cost and derivatives at a point.
pub(super) struct Evaluated {
    /// Sums of each batch, by section.
    pub(super) batches: Vec<Vec<Sums>>,
    /// Totals, by section.
    pub(super) totals: Vec<Sums>,
    pub(super) cost: f64,
}

/// Result of a search.
pub(super) struct Optimum {
    pub(super) point: Point,
    pub(super) at: Evaluated,
    pub(super) converged: bool,
    pub(super) iterations: usize,
}

const MOST_ITERATIONS: usize = 60;

/// Minimum damping, which limits the step where columns are linearly dependent.
const LEAST_DAMPING: f64 = 1e-12;
const FIRST_DAMPING: f64 = 1e-4;
const MOST_DAMPING: f64 = 1e9;

/// The search has converged when its step is below this fraction of a standard deviation. That step
/// is still made; the next would be negligible, as the error of Gauss–Newton decreases by a large
/// factor per step.
const CONVERGED_STD: f64 = 1e-4;

/// The search has also converged when the step changes the simulation by less than this fraction of
/// the measurements, which applies to noise-free data.
const CONVERGED_PART: f64 = 1e-12;

/// A search that finds no better point has converged if the expected reduction of the cost is below
/// this fraction: the rest is rounding of thousands of terms.
const ROUNDING_PART: f64 = 1e-10;

impl Problem<'_> {
    pub(super) fn samples(&self) -> usize {
        self.stretches.iter().map(|stretch| stretch.samples.len()).sum()
    }

    pub(super) fn evaluate(&self, point: &Point, weights: &Weights) -> Evaluated {
        let of = |(stretch, &start): (&Stretch, &State)| {
            let batch = ((self.batch_s / stretch.period_s).round() as usize).max(1);
            batches(stretch, &point.plant, start, batch, weights)
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

    /// Returns the residuals of one kind of measurement, by section.
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

    /// Returns the root mean square of the measurements; for position, of the displacement.
    pub(super) fn measured_rms(&self, measured: Measured) -> f64 {
        let of_kind = self.stretches.iter().map(|stretch| stretch.squares(measured));
        let (sum, count) = of_kind.fold((0.0, 0), |all, own| (all.0 + own.0, all.1 + own.1));
        (sum / count.max(1) as f64).sqrt()
    }

    /// Returns the sum of squared measurements, in standard deviations.
    fn measured_squares(&self, weights: &Weights) -> f64 {
        let of = |measured| {
            let squares = self.stretches.iter().map(|stretch| stretch.squares(measured).0);
            squares.sum::<f64>() / weights.std_of(measured).powi(2)
        };
        of(Measured::Velocity) + of(Measured::Position)
    }

    /// Minimises the cost from a point.
    pub(super) fn minimise(&self, start: Point, weights: &Weights) -> Optimum {
        let (mut point, mut at) = (start.clone(), self.evaluate(&start, weights));
        let floor = CONVERGED_PART.powi(2) * self.measured_squares(weights);
        let samples = self.samples() as f64;
        let mut damping = LEAST_DAMPING;
        let mut iterations = 0;
        while iterations < MOST_ITERATIONS && at.cost.is_finite() {
            iterations += 1;
            let step = self.step(&at, LEAST_DAMPING);
            let reduction = step.as_ref().map_or(f64::INFINITY, |step| step.reduction);
            let variance = 2.0 * at.cost / samples;
            if let Some(step) = &step
                && reduction <= (CONVERGED_STD.powi(2) * variance).max(floor)
            {
                let point = point.moved(step);
                return Optimum { point, at, converged: true, iterations };
            }
            let mut accepted = None;
            while accepted.is_none() && damping < MOST_DAMPING {
                let next = self.step(&at, damping).map(|step| point.moved(&step));
                let next = next.map(|next| (self.evaluate(&next, weights), next));
                accepted = next.filter(|(there, _)| there.cost < at.cost);
                damping = match accepted {
                    Some(_) => (0.1 * damping).max(LEAST_DAMPING),
                    None => (10.0 * damping).max(FIRST_DAMPING),
                };
            }
            let Some(next) = accepted else {
                let converged = reduction <= ROUNDING_PART * at.cost;
                return Optimum { point, at, converged, iterations };
            };
            (at, point) = next;
        }
        Optimum { point, at, converged: false, iterations }
    }

    /// Computes the damped Gauss–Newton step.
    fn step(&self, at: &Evaluated, damping: f64) -> Option<Step> {
        let mut plant = Reduced::of(&at.totals, damping);
        plant.keep(self.terms);
        let scale = plant.scale;
        let scaled = plant.information.component_mul(&(scale * scale.transpose()));
        let score = plant.score.component_mul(&scale);
        let change = Cholesky::new(scaled)?.solve(&score).component_mul(&scale);
        let starts = plant.own.iter().map(|own| own.change(&change)).collect();
        let mut step = Step { plant: change, starts, reduction: 0.0 };
        step.reduction = step.along(&at.totals);
        step.reduction.is_finite().then_some(step)
    }
}

/// A change of plant and initial states.
struct Step {
    plant: Vector4<f64>,
    /// Changes of velocity and position at the start of each section.
    starts: Vec<Vector2<f64>>,
    /// Twice the expected reduction of the cost.
    reduction: f64,
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

/// Maximum factor by which α changes in one step, which keeps its sign.
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

/// Information and score of the plant after elimination of the initial states.
pub(super) struct Reduced {
    pub(super) information: Matrix4<f64>,
    pub(super) score: Vector4<f64>,
    /// Factors that scale the information, before elimination of the initial states, to a unit
    /// diagonal.
    pub(super) scale: Vector4<f64>,
    pub(super) own: Vec<StartElimination>,
}

/// Elimination of one section's initial state.
pub(super) struct StartElimination {
    /// Change of the initial state at a constant plant.
    alone: Vector2<f64>,
    /// C⁻¹ Bᵀ, transposed: minus the change of the initial state per change of the plant.
    by_plant: Matrix4x2<f64>,
}

impl StartElimination {
    fn change(&self, plant: &Vector4<f64>) -> Vector2<f64> {
        self.alone - self.by_plant.transpose() * plant
    }

    /// Returns the score of the plant after elimination of the initial state.
    pub(super) fn reduce(&self, sums: &Sums) -> Vector4<f64> {
        sums.score.fixed_rows::<4>(0) - self.by_plant * sums.score.fixed_rows::<2>(4)
    }

    /// Returns the information on the plant after elimination of the initial state.
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
                // Velocity carries no information on the initial position.
                if start[(j, j)] <= 0.0 {
                    start[(j, j)] = 1.0;
                }
            }
            let inverse = start.try_inverse().unwrap_or_else(Matrix2::zeros);
            let of_stretch = StartElimination {
                alone: inverse * sums.score.fixed_rows::<2>(4),
                by_plant: cross * inverse,
            };
            information += shared - of_stretch.by_plant * cross.transpose();
            score += of_stretch.reduce(sums);
            diagonal += shared.diagonal();
            own.push(of_stretch);
        }
        information += Matrix4::from_diagonal(&(damping * diagonal));
        let scale = diagonal.map(|x| 1.0 / x.max(f64::MIN_POSITIVE).sqrt());
        Self { information, score, scale, own }
    }

    /// Excludes the terms that are not fitted.
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
