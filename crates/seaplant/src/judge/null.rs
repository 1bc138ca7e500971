//! Models without a plant, which a useful prediction must surpass.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{AxisRecord, Comparison, ScoredMotion, Timed};

/// A model without a plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum NullModel {
    /// Zero velocity.
    NeverMoves,
    /// Constant initial speed.
    KeepsInitialSpeed,
    /// Constant speed, equal to the mean of the trial, which is given to this model.
    KeepsMeanSpeed,
    /// Steady speed for the present thrust, v = ±c √|τ|, with c from the fitted trials.
    SteadySpeed,
    /// Zero acceleration; used where acceleration is compared.
    NeverAccelerates,
    /// Acceleration by thrust without drag, v̇ = c τ, with c from the fitted trials.
    ThrustAlone,
}

impl NullModel {
    /// Returns a description for use in sentences.
    pub const fn description(self) -> &'static str {
        match self {
            Self::NeverMoves => "a model that never moves",
            Self::KeepsInitialSpeed => "a model that keeps its initial speed",
            Self::KeepsMeanSpeed => "a model that keeps the mean speed",
            Self::SteadySpeed => "the steady speed for the thrust",
            Self::NeverAccelerates => "a model that never accelerates",
            Self::ThrustAlone => "thrust over a mass, without drag",
        }
    }
}

/// A model without a plant, and its error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NullScore {
    /// Model.
    pub model: NullModel,
    /// e = mean |v_model − v|, m/s or rad/s.
    pub mean_abs_error: f64,
}

/// The models without a plant, with coefficients from fitted trials.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Nulls {
    /// c of v = ±c √|τ|, ahead and astern.
    steady: Option<[f64; 2]>,
    /// c of v̇ = c τ.
    thrust_coefficient: f64,
}

impl Nulls {
    /// Fits the models to records of one axis.
    pub(crate) fn of(fitted: &[AxisRecord]) -> Self {
        let measured: Vec<(Timed, &Timed)> =
            fitted.iter().filter_map(|axis| Some((axis.velocity().ok()?, &axis.force))).collect();
        let steady = Self::steady(measured.iter().map(|(velocity, force)| (velocity, *force)));
        Self { thrust_coefficient: fit_thrust_alone(fitted), ..steady }
    }

    /// Fits steady speed to thrust, ahead and astern, by least squares on the velocity and force of trials.
    pub(crate) fn steady<'a>(trials: impl Iterator<Item = (&'a Timed, &'a Timed)>) -> Self {
        let (mut products, mut squares, mut is_fitted) = ([0.0; 2], [0.0; 2], false);
        for (velocity, force) in trials {
            is_fitted = true;
            let mut force = force.reader();
            for (&t, &v) in velocity.time_s().iter().zip(velocity.values()) {
                let tau = force.held_at(t);
                let (way, root) = signed_root(tau);
                products[way] += root * v;
                squares[way] += root * root;
            }
        }
        let of = |way: usize| if squares[way] > 0.0 { products[way] / squares[way] } else { 0.0 };
        Self { steady: is_fitted.then(|| [of(0), of(1)]), thrust_coefficient: 0.0 }
    }

    /// Returns the best model on some simulated trials; `None` without samples.
    pub(crate) fn best(&self, comparisons: &[&Comparison]) -> Option<NullScore> {
        let count: usize = comparisons.iter().map(|comparison| comparison.measured.len()).sum();
        if count == 0 {
            return None;
        }
        if comparisons.iter().any(|one| one.quantity == ScoredMotion::Acceleration) {
            return self.best_acceleration(comparisons, count);
        }
        let mut sums = [
            (NullModel::NeverMoves, 0.0),
            (NullModel::KeepsInitialSpeed, 0.0),
            (NullModel::KeepsMeanSpeed, 0.0),
            (NullModel::SteadySpeed, if self.steady.is_some() { 0.0 } else { f64::INFINITY }),
        ];
        for comparison in comparisons {
            let measured = &comparison.measured;
            let mean = measured.iter().sum::<f64>() / measured.len().max(1) as f64;
            let initial = comparison.simulated.first().copied().unwrap_or(0.0);
            for (&v, &tau) in measured.iter().zip(&comparison.force) {
                let (way, root) = signed_root(tau);
                let steady = self.steady.map_or(0.0, |c| c[way] * root);
                for (sum, prediction) in sums.iter_mut().zip([0.0, initial, mean, steady]) {
                    sum.1 += (v - prediction).abs();
                }
            }
        }
        let (model, sum) = sums.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
        Some(NullScore { model, mean_abs_error: sum / count as f64 })
    }
}

impl Nulls {
    /// Compares accelerations, after removal of each trial's offset, as for the plant.
    fn best_acceleration(&self, comparisons: &[&Comparison], count: usize) -> Option<NullScore> {
        let models =
            [(NullModel::NeverAccelerates, 0.0), (NullModel::ThrustAlone, self.thrust_coefficient)];
        let error = |c: f64| {
            let of = |one: &&Comparison| {
                let left: Vec<f64> =
                    one.measured.iter().zip(&one.force).map(|(a, tau)| a - c * tau).collect();
                let mean = left.iter().sum::<f64>() / left.len().max(1) as f64;
                left.iter().map(|x| (x - mean).abs()).sum::<f64>()
            };
            comparisons.iter().map(of).sum::<f64>() / count as f64
        };
        let all = models.map(|(model, c)| NullScore { model, mean_abs_error: error(c) });
        all.into_iter().min_by(|a, b| a.mean_abs_error.total_cmp(&b.mean_abs_error))
    }
}

/// Fits c of v̇ = c τ by least squares, after removal of each trial's mean thrust.
fn fit_thrust_alone(fitted: &[AxisRecord]) -> f64 {
    let (mut xx, mut xy) = (0.0, 0.0);
    for axis in fitted.iter().filter(|axis| !axis.knows_velocity()) {
        let mut force = axis.force.reader();
        let accelerations =
            axis.acceleration.iter().flat_map(|accelerations| accelerations.windows());
        let pairs: Vec<(f64, f64)> =
            accelerations.map(|m| (force.held_at(0.5 * (m.from_s + m.to_s)), m.mean)).collect();
        let n = pairs.len().max(1) as f64;
        let mean_x = pairs.iter().map(|(x, _)| x).sum::<f64>() / n;
        for (x, y) in pairs {
            xx += (x - mean_x).powi(2);
            xy += (x - mean_x) * y;
        }
    }
    if xx > 0.0 { xy / xx } else { 0.0 }
}

/// Returns the direction (0 ahead, 1 astern), and √|τ| with the sign of τ.
fn signed_root(tau: f64) -> (usize, f64) {
    (usize::from(tau < 0.0), tau.abs().sqrt().copysign(tau))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Agreement, Dof};

    fn comparison(measured: Vec<f64>, force: Vec<f64>, first: f64) -> Comparison {
        let simulated = vec![first; measured.len()];
        Comparison {
            quantity: ScoredMotion::Velocity,
            dof: Dof::Surge,
            trial: "t".to_owned(),
            time_s: (0..measured.len()).map(|k| k as f64).collect(),
            velocity: Agreement::of(&measured, &simulated, 0.0),
            force,
            measured,
            simulated,
            position: None,
        }
    }

    fn best(nulls: Nulls, measured: &[f64], force: &[f64], first: f64) -> NullScore {
        nulls.best(&[&comparison(measured.to_vec(), force.to_vec(), first)]).expect("samples")
    }

    #[test]
    fn each_null_model_is_best_for_its_own_motion() {
        let nulls = Nulls { steady: Some([0.5, 0.25]), thrust_coefficient: 0.0 };
        let still = best(nulls, &[0.01, -0.01, 0.0], &[9.0, 4.0, -4.0], 0.5);
        assert_eq!(still.model, NullModel::NeverMoves);
        let coasting = best(nulls, &[1.0, 1.0, 1.1], &[0.0; 3], 1.0);
        assert_eq!(coasting.model, NullModel::KeepsInitialSpeed);
        let cruising = best(nulls, &[0.0, 1.0, 1.0, 1.0], &[0.0; 4], 0.0);
        assert_eq!(cruising.model, NullModel::KeepsMeanSpeed);
        let quick = best(nulls, &[1.5, 1.0, -0.5], &[9.0, 4.0, -4.0], 0.0);
        assert_eq!(quick, NullScore { model: NullModel::SteadySpeed, mean_abs_error: 0.0 });
    }

    #[test]
    fn steady_speed_needs_fitted_trials() {
        let found = best(Nulls::default(), &[0.0, 1.0], &[0.0, 1.0], 0.0);
        assert_ne!(found.model, NullModel::SteadySpeed);
    }
}
