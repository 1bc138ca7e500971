//! Prediction errors of a plant on trials, compared with simpler models.

use super::change::{PlantChange, change};
use super::linear::{Window, windows};
use super::null::{NullScore, Nulls};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::evaluate::compare_record;
use crate::regression::batch_s;
use crate::{
    Agreement, AxisRecord, Comparison, Dof, Error, Model, ScoredMotion, Trial, VelocitySource,
};

/// Prediction error of a plant on some trials; values that do not exist for a diverging simulation
/// are absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Score {
    /// Compared quantity: where velocity was not measured, e and R² are of acceleration, in means
    /// over half a second after removal of the accelerometer's offset.
    #[serde(default)]
    pub quantity: ScoredMotion,
    /// e = mean |v_model − v| on raw velocity.
    pub mean_abs_error: Option<f64>,
    /// e of a model that never moves, or that never accelerates.
    pub null_error: f64,
    /// The best model without a plant; absent if a simulation diverged.
    #[serde(default)]
    pub best_null: Option<NullScore>,
    /// e with an initial velocity, a constant force and, for translations, a current fitted to each
    /// trial (for long ones, to each 150 s): the criterion for comparison of methods.
    #[serde(default)]
    pub offset_free_error: Option<f64>,
    /// The change of the plant that would minimise the errors; absent where they do not determine
    /// it.
    #[serde(default)]
    pub change: Option<PlantChange>,
    /// 1 − Σ(v_model − v)² / Σ(v − mean v)², over all trials.
    pub r_squared: Option<f64>,
    /// Scores of each trial.
    pub trials: Vec<TrialScore>,
}

/// Prediction error of a plant on one trial.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialScore {
    /// Trial.
    pub trial: String,
    /// e = mean |v_model − v| on raw velocity; absent if the simulation diverged.
    pub mean_abs_error: Option<f64>,
    /// e of a model that never moves.
    pub null_error: f64,
    /// e with an initial velocity, a constant force and, for translations, a current fitted to the
    /// trial; absent where the compared quantity is not velocity.
    #[serde(default)]
    pub offset_free_error: Option<f64>,
    /// R² of velocity.
    pub r_squared: Option<f64>,
    /// R² of position, where position was measured.
    pub position_r_squared: Option<f64>,
    /// Mean |model − measured| of position, m or rad.
    pub position_mean_abs_error: Option<f64>,
    /// Number of compared samples.
    pub samples: usize,
}

/// A score with the errors used for comparison of plants.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scored {
    pub(crate) score: Score,
    /// Mean |error| of each of many parts of the trials after removal of offsets; the same parts
    /// for every plant. Empty if a simulation diverges.
    pub(crate) parts: Vec<f64>,
}

/// Scores a plant on trials: e on raw velocity, compared with models without a plant.
///
/// # Errors
/// Those of [`Trial::axis`]; for a simulation that diverges, the scores are absent.
pub fn score_plant(dof: Dof, model: &Model, trials: &[&Trial]) -> Result<Score, Error> {
    Ok(score(model, &records(dof, trials)?, &Nulls::default())?.score)
}

/// Returns the records of one degree of freedom for comparison with plants.
pub(crate) fn records(dof: Dof, trials: &[&Trial]) -> Result<Vec<AxisRecord>, Error> {
    trials.iter().map(|trial| trial.axis(dof, VelocitySource::Measured)).collect()
}

/// Scores as [`score_plant`], with null models from the fitted trials.
///
/// # Errors
/// As [`score_plant`].
pub(crate) fn score(model: &Model, axes: &[AxisRecord], nulls: &Nulls) -> Result<Scored, Error> {
    let outcomes = axes.iter().map(|axis| outcome(model, axis)).collect::<Result<Vec<_>, _>>()?;
    let quantity = quantity_of(axes);
    let windows: Vec<Window> = outcomes.iter().flat_map(|outcome| outcome.windows(model)).collect();
    let has_run_away = outcomes.iter().any(|outcome| matches!(outcome, Outcome::Diverged { .. }));
    let mut score = Score { quantity, ..total_score(&outcomes) };
    if has_run_away {
        return Ok(Scored { score, ..Scored::default() });
    }
    score.best_null =
        nulls.best(&outcomes.iter().filter_map(Outcome::comparison).collect::<Vec<_>>());
    score.offset_free_error = offset_free_error(windows.iter());
    for trial in &mut score.trials {
        let own = windows.iter().filter(|window| window.trial == trial.trial);
        trial.offset_free_error = offset_free_error(own);
    }
    let accelerations = outcomes.iter().filter_map(Outcome::comparison);
    let accelerations: Vec<f64> = accelerations.flat_map(parts_of_acceleration).collect();
    // The simulation of a long record takes much memory, and more simulations follow.
    drop(outcomes);
    let parts = [parts(&windows), accelerations].concat();
    score.change = change(model, axes, windows)?;
    Ok(Scored { score, parts })
}

/// Returns the compared quantity: acceleration only where velocity was not measured.
fn quantity_of(axes: &[AxisRecord]) -> ScoredMotion {
    match axes.iter().any(AxisRecord::knows_velocity) || axes.is_empty() {
        true => ScoredMotion::Velocity,
        false => ScoredMotion::Acceleration,
    }
}

/// Number of acceleration means in a part for comparison of plants.
const MEANS_IN_PART: usize = 20;

fn parts_of_acceleration(comparison: &Comparison) -> Vec<f64> {
    if comparison.quantity == ScoredMotion::Velocity {
        return Vec::new();
    }
    let errors = comparison.measured.iter().zip(&comparison.simulated).map(|(y, s)| (y - s).abs());
    let errors: Vec<f64> = errors.collect();
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    errors.chunks(MEANS_IN_PART).map(mean).collect()
}

fn offset_free_error<'a>(windows: impl Iterator<Item = &'a Window>) -> Option<f64> {
    let errors = windows.flat_map(|window| &window.error);
    let (sum, count) = errors.fold((0.0, 0_usize), |(sum, n), e| (sum + e.abs(), n + 1));
    (count > 0).then(|| sum / count as f64)
}

fn parts(windows: &[Window]) -> Vec<f64> {
    let batch_s = batch_s(windows.iter().map(Window::duration_s).sum());
    let of = |window: &Window| -> Vec<f64> {
        let mean = |rows: std::ops::Range<usize>| {
            let count = rows.len() as f64;
            window.error[rows].iter().map(|e| e.abs()).sum::<f64>() / count
        };
        window.batches(batch_s).into_iter().map(mean).collect()
    };
    windows.iter().flat_map(of).collect()
}

/// Result of the simulation of one trial.
enum Outcome {
    Compared(Box<Comparison>),
    Diverged { trial: String, null_error: f64, samples: usize },
}

impl Outcome {
    fn comparison(&self) -> Option<&Comparison> {
        match self {
            Self::Compared(comparison) => Some(comparison),
            Self::Diverged { .. } => None,
        }
    }

    fn windows(&self, model: &Model) -> Vec<Window> {
        // Windows explain errors of velocity only.
        let of_velocity = self.comparison().filter(|one| one.quantity == ScoredMotion::Velocity);
        of_velocity.map(|comparison| windows(comparison, model)).unwrap_or_default()
    }
}

fn outcome(model: &Model, axis: &AxisRecord) -> Result<Outcome, Error> {
    match compare_record(model, axis) {
        Ok(comparison) => Ok(Outcome::Compared(Box::new(comparison))),
        Err(Error::Diverged { .. }) => {
            let velocity = axis.velocity().unwrap_or_else(|_| axis.motion.series().clone());
            let samples = velocity.len();
            let null_error =
                velocity.values().iter().map(|v| v.abs()).sum::<f64>() / samples as f64;
            Ok(Outcome::Diverged { trial: axis.trial.clone(), null_error, samples })
        }
        Err(other) => Err(other),
    }
}

fn total_score(outcomes: &[Outcome]) -> Score {
    let compared = outcomes.iter().filter_map(Outcome::comparison);
    let pairs = compared.flat_map(|c| c.measured.iter().copied().zip(c.simulated.iter().copied()));
    let all = Agreement::over(pairs, 0.0);
    let mut diverged = false;
    let mut null = (0.0, 0);
    let mut trials = Vec::new();
    for outcome in outcomes {
        let score = match outcome {
            Outcome::Compared(comparison) => trial_score(comparison),
            Outcome::Diverged { trial, null_error, samples } => {
                diverged = true;
                TrialScore {
                    trial: trial.clone(),
                    mean_abs_error: None,
                    null_error: *null_error,
                    offset_free_error: None,
                    r_squared: None,
                    position_r_squared: None,
                    position_mean_abs_error: None,
                    samples: *samples,
                }
            }
        };
        null.0 += score.null_error * score.samples as f64;
        null.1 += score.samples;
        trials.push(score);
    }
    Score {
        quantity: ScoredMotion::Velocity,
        mean_abs_error: (!diverged).then_some(all.mean_abs_error),
        null_error: if null.1 == 0 { 0.0 } else { null.0 / null.1 as f64 },
        best_null: None,
        offset_free_error: None,
        change: None,
        r_squared: all.r_squared.filter(|_| !diverged),
        trials,
    }
}

fn trial_score(comparison: &Comparison) -> TrialScore {
    let position = comparison.position.as_ref().map(|position| position.agreement);
    TrialScore {
        trial: comparison.trial.clone(),
        mean_abs_error: Some(comparison.velocity.mean_abs_error),
        null_error: comparison.velocity.null_error,
        offset_free_error: None,
        r_squared: comparison.velocity.r_squared,
        position_r_squared: position.and_then(|agreement| agreement.r_squared),
        position_mean_abs_error: position.map(|agreement| agreement.mean_abs_error),
        samples: comparison.velocity.samples,
    }
}
