//! Errors of an open-loop simulation, and their linear dependence on small changes of the model.
//!
//! Where a model `v̇ = f(v, τ)` lacks a small acceleration a(t), its velocity has the error s:
//! `ṡ = (2β|v| + μ) s + a`. The errors of a simulation are therefore linear in what the model
//! lacks, which least squares estimates.

use nalgebra::{DMatrix, DVector};

use crate::evaluate::compare_record;
use crate::regression::batch_s;
use crate::{AxisRecord, Comparison, Error, Model, ScoredMotion, VelocitySensor};

/// Maximum length of a window with its own initial velocity and constant force, s: forces of
/// tethers and currents change within minutes, while drag acts within one.
pub(crate) const WINDOW_S: f64 = 150.0;

/// A step longer than this many median steps, and than one second, ends a window.
const GAP_STEPS: f64 = 5.0;

/// Maximum number of windows; longer records are represented by windows at equal intervals.
const MOST_WINDOWS: usize = 96;

/// Minimum number of samples of a window.
const LEAST_SAMPLES: usize = 10;

/// Relative norm below which a nuisance, after projection on the others, is linearly dependent.
const DEPENDENT: f64 = 1e-6;

/// A window of a simulated trial after removal of its initial velocity, a constant force and, for
/// translations, a current, which affect every model alike.
#[derive(Clone, Debug)]
pub(crate) struct Window {
    pub(crate) trial: String,
    pub(crate) time_s: Vec<f64>,
    /// Measured minus simulated velocity, after removal of the nuisances.
    pub(crate) error: Vec<f64>,
    /// Simulated velocity through the water.
    pub(crate) velocity: Vec<f64>,
    /// Acceleration by thrust over the step that starts at each sample.
    pub(crate) thrust: Vec<f64>,
    /// Acceleration by drag over the same step.
    pub(crate) drag: Vec<f64>,
    /// Of the step that starts at each sample, the factor by which a velocity error decays, and the gain of a
    /// constant acceleration, s.
    steps: Vec<[f64; 2]>,
    /// Model of the velocity sensor.
    sensor: VelocitySensor,
    nuisances: Vec<Vec<f64>>,
}

/// Returns the windows of simulated records; none for a record whose simulation diverges.
///
/// # Errors
/// Those of [`AxisRecord::velocity`].
pub(crate) fn windows_of(model: &Model, axes: &[AxisRecord]) -> Result<Vec<Window>, Error> {
    let mut all = Vec::new();
    for axis in axes {
        match compare_record(model, axis) {
            Ok(comparison) if comparison.quantity == ScoredMotion::Velocity => {
                all.extend(windows(&comparison, model));
            }
            Ok(_) => {}
            Err(Error::Diverged { .. }) => {}
            Err(other) => return Err(other),
        }
    }
    Ok(all)
}

/// Returns the windows of a comparison.
pub(crate) fn windows(comparison: &Comparison, model: &Model) -> Vec<Window> {
    let current = model.thrust.current_of(&comparison.trial);
    let parts: Vec<_> =
        parts(&comparison.time_s).into_iter().filter(|part| part.len() >= LEAST_SAMPLES).collect();
    let every = parts.len().div_ceil(MOST_WINDOWS).max(1);
    parts
        .into_iter()
        .step_by(every)
        .map(|part| Window::of(comparison, part, model, current))
        .collect()
}

/// Returns ranges of samples without gaps, divided equally to at most [`WINDOW_S`].
fn parts(time_s: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let usual = crate::series::median(&mut steps).unwrap_or(0.0);
    let is_gap = |k: &usize| time_s[*k] - time_s[k - 1] > (GAP_STEPS * usual).max(1.0);
    let mut edges: Vec<usize> = vec![0];
    edges.extend((1..time_s.len()).filter(is_gap));
    edges.push(time_s.len());
    let mut parts = Vec::new();
    for pair in edges.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        if to <= from + 1 {
            continue;
        }
        let span_s = time_s[to - 1] - time_s[from];
        let count = (span_s / WINDOW_S).ceil().max(1.0);
        let at = |part: f64| {
            let edge_s = time_s[from] + span_s * part / count;
            from + time_s[from..to].partition_point(|&t| t < edge_s)
        };
        let cuts: Vec<usize> = (0..count as usize).map(|k| at(k as f64)).chain([to]).collect();
        parts.extend(cuts.windows(2).map(|cut| cut[0]..cut[1]));
    }
    parts
}

impl Window {
    fn of(
        comparison: &Comparison,
        part: std::ops::Range<usize>,
        model: &Model,
        current: f64,
    ) -> Self {
        let time_s = comparison.time_s[part.clone()].to_vec();
        let simulated = &comparison.simulated[part.clone()];
        let velocity: Vec<f64> = simulated.iter().map(|v| v - current).collect();
        let plant = model.lumped;
        // Negative decay rate of a small velocity error, 1/s.
        let decay = velocity.iter().map(|v| (2.0 * plant.beta * v.abs() + plant.mu).min(0.0));
        let decay: Vec<f64> = decay.collect();
        let step = |(rates, times): (&[f64], &[f64])| {
            step_response(0.5 * (rates[0] + rates[1]), times[1] - times[0])
        };
        let (mut thrust, mut drag) = (Vec::new(), Vec::new());
        for k in 0..velocity.len() {
            // No step starts at the last sample; its value is not used.
            let next = (k + 1).min(velocity.len() - 1);
            let step_s = (time_s[next] - time_s[k]).max(f64::MIN_POSITIVE);
            let v = 0.5 * (velocity[k] + velocity[next]);
            let by_drag = plant.acceleration(0.0, v) - plant.bias;
            drag.push(by_drag);
            thrust.push((velocity[next] - velocity[k]) / step_s - by_drag - plant.bias);
        }
        let error: Vec<f64> =
            comparison.measured[part].iter().zip(simulated).map(|(y, s)| y - s).collect();
        let mut window = Self {
            trial: comparison.trial.clone(),
            steps: decay.windows(2).zip(time_s.windows(2)).map(step).collect(),
            sensor: model.sensor,
            time_s,
            error: Vec::new(),
            velocity,
            thrust,
            drag,
            nuisances: Vec::new(),
        };
        let force = window.sensor_output(&vec![1.0; error.len()]);
        // Drag acts on velocity through the water: a current u adds −(2β|v| + μ) u.
        let current = window.sensor_output(&decay.iter().map(|x| -x).collect::<Vec<_>>());
        let has_current = !comparison.dof.is_rotation();
        let nuisances =
            [Some(window.start_response()), Some(force), has_current.then_some(current)];
        for nuisance in nuisances.into_iter().flatten() {
            let mut left = window.without_nuisances(nuisance.clone());
            let (before, after) = (norm(&nuisance), norm(&left));
            if after > DEPENDENT * before && after > 0.0 {
                left.iter_mut().for_each(|x| *x /= after);
                window.nuisances.push(left);
            }
        }
        window.error = window.without_nuisances(error);
        window
    }

    /// Computes the response of velocity to an acceleration that the model lacks, after removal of
    /// the nuisances; shape (n,). The acceleration is constant over the step that starts at each
    /// sample.
    pub(crate) fn response(&self, acceleration: &[f64]) -> Vec<f64> {
        self.without_nuisances(self.sensor_output(acceleration))
    }

    /// Computes the sensor output for the velocity due to an acceleration.
    fn sensor_output(&self, acceleration: &[f64]) -> Vec<f64> {
        self.sensor.shows(&self.time_s, &self.integrate(acceleration))
    }

    fn start_response(&self) -> Vec<f64> {
        let kept = self.steps.iter().scan(1.0, |left, [kept, _]| {
            *left *= kept;
            Some(*left)
        });
        std::iter::once(1.0).chain(kept).collect()
    }

    fn integrate(&self, acceleration: &[f64]) -> Vec<f64> {
        let steps = self.steps.iter().zip(acceleration);
        let response = steps.scan(0.0, |velocity, ([kept, gain_s], acceleration)| {
            *velocity = kept * *velocity + gain_s * acceleration;
            Some(*velocity)
        });
        std::iter::once(0.0).chain(response).collect()
    }

    fn without_nuisances(&self, mut x: Vec<f64>) -> Vec<f64> {
        for nuisance in &self.nuisances {
            let part: f64 = nuisance.iter().zip(&x).map(|(n, x)| n * x).sum();
            x.iter_mut().zip(nuisance).for_each(|(x, n)| *x -= part * n);
        }
        x
    }

    /// Divides the samples into batches of about the given length, s.
    pub(crate) fn batches(&self, batch_s: f64) -> Vec<std::ops::Range<usize>> {
        let span_s = self.duration_s();
        let count = (span_s / batch_s).round().max(1.0);
        let at = |k: usize| {
            let edge_s = self.time_s[0] + span_s * k as f64 / count;
            self.time_s.partition_point(|&t| t < edge_s)
        };
        let count = count as usize;
        let edges: Vec<usize> = (0..count).map(at).chain([self.time_s.len()]).collect();
        let parts = edges.windows(2).map(|pair| pair[0]..pair[1]);
        parts.filter(|part| !part.is_empty()).collect()
    }

    pub(crate) fn duration_s(&self) -> f64 {
        self.time_s[self.time_s.len() - 1] - self.time_s[0]
    }
}

/// Returns the factor by which a velocity error decays over a step, and the gain of a constant acceleration
/// over it, s; `decay` is the negative rate, 1/s.
fn step_response(decay: f64, step_s: f64) -> [f64; 2] {
    let kept = (decay * step_s).exp();
    let gain_s = if decay * step_s > -1e-9 { step_s } else { (kept - 1.0) / decay };
    [kept, gain_s]
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Least squares of simulation errors on accelerations that a model may lack.
#[derive(Clone, Debug, Default)]
pub(crate) struct ErrorRegression {
    batches: Vec<Batch>,
}

#[derive(Clone, Debug)]
struct Batch {
    information: DMatrix<f64>,
    score: DVector<f64>,
    square: f64,
}

/// Coefficients of the columns that minimise the errors.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    pub(crate) value: DVector<f64>,
    /// Covariance from the scores of batches, valid for errors that are correlated within one.
    pub(crate) covariance: DMatrix<f64>,
    /// Number of batches minus number of columns.
    pub(crate) freedom: f64,
}

impl ErrorRegression {
    /// Sums over windows; `columns` returns the accelerations of each, shape (n,).
    pub(crate) fn of(
        windows: &[Window],
        columns: impl Fn(&Window) -> Option<Vec<Vec<f64>>>,
    ) -> Self {
        let total_s: f64 = windows.iter().map(Window::duration_s).sum();
        let batch_s = batch_s(total_s);
        let mut batches = Vec::new();
        for window in windows {
            let Some(columns) = columns(window) else { continue };
            let columns: Vec<Vec<f64>> = columns.iter().map(|x| window.response(x)).collect();
            for rows in window.batches(batch_s) {
                batches.push(Batch::of(&columns, &window.error, rows));
            }
        }
        Self { batches }
    }

    /// Solves for the coefficients; `None` if columns are linearly dependent or batches are too
    /// few.
    pub(crate) fn solve(&self) -> Option<Solution> {
        let p = self.batches.first()?.score.len();
        let freedom = self.batches.len().checked_sub(p).filter(|freedom| *freedom > 1)? as f64;
        let mut information = DMatrix::zeros(p, p);
        let mut score = DVector::zeros(p);
        for batch in &self.batches {
            information += &batch.information;
            score += &batch.score;
        }
        let scale = DVector::from_fn(p, |j, _| 1.0 / information[(j, j)].sqrt());
        if !scale.iter().all(|x| x.is_finite()) {
            return None;
        }
        let scaled = information.component_mul(&(&scale * scale.transpose()));
        let smallest = scaled.clone().symmetric_eigenvalues().min();
        if smallest < DEPENDENT {
            return None;
        }
        let inverse = scaled.cholesky()?.inverse().component_mul(&(&scale * scale.transpose()));
        let value = &inverse * &score;
        let mut meat = DMatrix::zeros(p, p);
        for batch in &self.batches {
            let own = &batch.score - &batch.information * &value;
            meat += &own * own.transpose();
        }
        let count = self.batches.len() as f64;
        let covariance = &inverse * meat * &inverse * (count / freedom);
        Some(Solution { value, covariance, freedom })
    }
}

impl ErrorRegression {
    /// Computes Σ error² in cross-validation: of each half of the batches with the coefficients of
    /// the other half.
    pub(crate) fn cross_validated(&self) -> Option<f64> {
        let half = |odd: bool| {
            let of = |(k, batch): (usize, &Batch)| ((k % 2 == 1) == odd).then(|| batch.clone());
            Self { batches: self.batches.iter().enumerate().filter_map(of).collect() }
        };
        let (even, odd) = (half(false), half(true));
        let left = |told: &Self, by: &Self| {
            let value = by.solve()?.value;
            let of = |batch: &Batch| {
                batch.square - 2.0 * batch.score.dot(&value)
                    + value.dot(&(&batch.information * &value))
            };
            Some(told.batches.iter().map(of).sum::<f64>())
        };
        Some(left(&even, &odd)? + left(&odd, &even)?)
    }
}

impl Batch {
    fn of(columns: &[Vec<f64>], error: &[f64], rows: std::ops::Range<usize>) -> Self {
        let p = columns.len();
        let dot = |a: &[f64], b: &[f64]| -> f64 {
            a[rows.clone()].iter().zip(&b[rows.clone()]).map(|(a, b)| a * b).sum()
        };
        Self {
            information: DMatrix::from_fn(p, p, |i, j| dot(&columns[i], &columns[j])),
            score: DVector::from_fn(p, |j, _| dot(&columns[j], error)),
            square: dot(error, error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Agreement, Dof, PhysicalParameters, State, Timed, simulate};

    /// Returns a trial of a vehicle of 100 kg and 60 N/(m/s)², simulated by another plant.
    fn comparison(model: &Model, extra_n: f64) -> Comparison {
        let truth = PhysicalParameters { mass: 100.0, d_quadratic: 60.0, ..Default::default() };
        let time_s: Vec<f64> = (0..1200).map(|k| 0.1 * f64::from(k)).collect();
        let tau: Vec<f64> =
            time_s.iter().map(|t| 40.0 * (0.3 * t).sin() + 30.0 * (0.11 * t).cos()).collect();
        let run = |plant, extra: f64| {
            let force = tau.iter().map(|tau| tau + extra).collect::<Vec<_>>();
            let force = Timed::new("force", time_s.clone(), force).expect("valid");
            simulate(Dof::Surge, &plant, &force, State::default(), &time_s)
                .expect("stable")
                .velocity
        };
        let (measured, simulated) = (run(truth.to_lumped(), extra_n), run(model.lumped, 0.0));
        Comparison {
            quantity: ScoredMotion::Velocity,
            dof: Dof::Surge,
            trial: "t".to_owned(),
            velocity: Agreement::of(&measured, &simulated, 0.0),
            force: tau,
            time_s,
            measured,
            simulated,
            position: None,
        }
    }

    fn model(mass: f64, d_quadratic: f64) -> Model {
        let plant = PhysicalParameters { mass, d_quadratic, ..Default::default() };
        Model::from(plant.to_lumped())
    }

    #[test]
    fn recovers_the_plant_from_simulation_errors() {
        let model = model(104.0, 57.0);
        let windows = windows(&comparison(&model, 0.0), &model);
        assert_eq!(windows.len(), 1);
        let of = |window: &Window| Some(vec![window.thrust.clone(), window.drag.clone()]);
        let asked = ErrorRegression::of(&windows, of).solve().expect("exciting");
        // α is 4 % too small; β is 57/104 in place of 60/100. Beyond first order: the square of a
        // change of 9 %, and correlated columns.
        let first_order = 0.02;
        assert!((asked.value[0] - 0.04).abs() < first_order, "{}", asked.value);
        assert!((asked.value[1] - (0.6 / (57.0 / 104.0) - 1.0)).abs() < first_order);
        let errors: f64 = windows[0].error.iter().map(|e| e * e).sum();
        let own = ErrorRegression::of(&windows, of).cross_validated().expect("two halves");
        assert!(own < 0.01 * errors, "{own} of {errors}");
    }

    #[test]
    fn a_constant_force_leaves_no_error() {
        let model = model(100.0, 60.0);
        let free = windows(&comparison(&model, 0.0), &model);
        let pushed = windows(&comparison(&model, 2.0), &model);
        let error = |windows: &[Window]| norm(&windows[0].error);
        assert!(error(&free) < 1e-9);
        let raw = comparison(&model, 2.0);
        let raw: Vec<f64> = raw.measured.iter().zip(&raw.simulated).map(|(y, s)| y - s).collect();
        assert!(error(&pushed) < 0.1 * norm(&raw), "{} {}", error(&pushed), norm(&raw));
    }

    #[test]
    fn windows_end_at_gaps_and_at_the_maximum_length() {
        let mut time_s: Vec<f64> = (0..4000).map(|k| 0.1 * f64::from(k)).collect();
        time_s[500..].iter_mut().for_each(|t| *t += 20.0);
        let found = parts(&time_s);
        assert_eq!(found[0], 0..500);
        assert_eq!(found.len(), 4);
        assert!(found.iter().all(|part| time_s[part.end - 1] - time_s[part.start] <= WINDOW_S));
        assert_eq!(found.iter().map(ExactSizeIterator::len).sum::<usize>(), 4000);
    }
}
