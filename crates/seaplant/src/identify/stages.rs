//! The fits of an identification, in order, with their expected cost.

use super::{IdentifyOptions, TrialsOf, Work};
use crate::PlantPlan;
use crate::estimate::MOST_TRIALS;
use crate::{Dof, Method, Trial, Vehicle, VelocitySource};

/// A fit of an identification, including the scores of its plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// Degrees of freedom: one, or those of a plant of several axes.
    pub axes: Vec<Dof>,
    /// Method.
    pub method: Method,
    /// Number of fits before it.
    pub done: usize,
    /// Number of samples of motion, over all trials.
    pub samples: usize,
    /// Usual range of the processor time, s: minimum and maximum.
    ///
    /// A fit whose model turns out to need lags, delays and currents takes many times as long as a
    /// simple one, which is not known in advance.
    pub cost_s: (f64, f64),
}

impl Stage {
    /// Returns the typical cost, s: the geometric mean of minimum and maximum.
    pub fn usual_s(&self) -> f64 {
        (self.cost_s.0 * self.cost_s.1).sqrt()
    }
}

/// Returns every fit that [`identify`](crate::identify) makes of these trials, in its order.
pub fn stages(vehicle: &Vehicle, trials: &[Trial], options: &IdentifyOptions) -> Vec<Stage> {
    let mut stages = Vec::new();
    let mut push = |axes: Vec<Dof>, method, samples, cost_s| {
        stages.push(Stage { axes, method, done: stages.len(), samples, cost_s });
    };
    for dof in Dof::ALL {
        let trials = &TrialsOf::new(dof, trials);
        if trials.fit.is_empty() {
            continue;
        }
        let work = Work { dof, vehicle, options, trials, batch: None };
        let samples: usize = trials.fit.iter().map(|trial| samples(trial, dof)).sum();
        for method in work.in_order() {
            let fitted = match method {
                Method::FilterError => {
                    samples * trials.fit.len().min(MOST_TRIALS) / trials.fit.len()
                }
                _ => samples,
            };
            push(vec![dof], method, samples, cost_s(method, fitted));
        }
    }
    for plan in &options.together {
        let samples = trials.iter().map(|trial| samples_together(trial, plan)).sum();
        push(plan.axes.clone(), Method::FilterError, samples, cost_together_s(plan, samples));
    }
    stages
}

fn samples(trial: &Trial, dof: Dof) -> usize {
    trial.axis(dof, VelocitySource::Measured).map_or(0, |axis| axis.motion.series().len())
}

/// Returns the number of samples of the axis with the highest rate.
fn samples_together(trial: &Trial, plan: &PlantPlan) -> usize {
    let Ok(record) = trial.record(&plan.axes) else { return 0 };
    record.velocity.iter().flatten().map(|series| series.len()).max().unwrap_or(0)
}

/// Returns the range of cost per sample times the samples, from fits of simulated twins and real
/// logs: `bench/README.md` has the longest.
fn cost_s(method: Method, samples: usize) -> (f64, f64) {
    let micro_s = |least: f64, most: f64| {
        let samples = samples as f64 * 1e-6;
        (least * samples, most * samples)
    };
    match method {
        Method::FilterError => micro_s(30.0, 500.0),
        Method::OutputError => micro_s(5.0, 50.0),
        Method::EquationError | Method::Paper => micro_s(2.0, 10.0),
        Method::WeightedLeastSquares => micro_s(4.0, 20.0),
        Method::Adaptive | Method::Recursive => micro_s(15.0, 60.0),
        Method::Ekf => micro_s(50.0, 200.0),
    }
}

/// Returns the range of cost of a plant of several axes, which increases with the square of their
/// number.
fn cost_together_s(plan: &PlantPlan, samples: usize) -> (f64, f64) {
    let axes = plan.axes.len() as f64;
    let (least, most) = (30e-6, 500e-6);
    let samples = axes * axes * samples as f64;
    (least * samples, most * samples)
}
