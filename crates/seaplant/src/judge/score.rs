//! Prediction errors of a plant on trials, compared with simpler models.

use std::collections::BTreeMap;

use super::change::{LikelyChange, PlantChange, change};
use super::linear::{Window, windows};
use super::null::{NullScore, Nulls};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::caveat::spoken;
use crate::evaluate::compare_record;
use crate::regression::batch_s;
use crate::{
    Agreement, AxisRecord, Comparison, Dof, Error, Model, ScoredMotion, Trial, VelocitySource,
};

/// The error of a plant on one axis, of some trials or of one; values are absent if the simulation diverges, and
/// where a method or an instrument does not give them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
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
    /// Mean change of the model's velocity by a draw of the estimated disturbance, m/s or rad/s,
    /// which is the expected error of the true plant; includes the noise of velocities from
    /// differentiated positions.
    #[serde(default)]
    pub disturbance_error: Option<f64>,
    /// Mean |model − measured| of roll and pitch with the model restarted from the measured state
    /// every 10 s, rad/s: over a whole trial, an error of phase of these oscillations would
    /// dominate.
    #[serde(default)]
    pub restarted_error: Option<f64>,
    /// The same error of a constant rate from each restart.
    #[serde(default)]
    pub kept_error: Option<f64>,
    /// The change of the plant that would minimise the errors of its simulation; absent where they
    /// do not determine it.
    #[serde(default)]
    pub change: Option<PlantChange>,
    /// The change of the plant that the likelihood of unseen trials supports.
    #[serde(default)]
    pub likely_change: Option<LikelyChange>,
    /// 1 − Σ(v_model − v)² / Σ(v − mean v)².
    pub r_squared: Option<f64>,
    /// R² of position, where position was measured; of one trial.
    #[serde(default)]
    pub position_r_squared: Option<f64>,
    /// Mean |model − measured| of position, m or rad; of one trial.
    #[serde(default)]
    pub position_mean_abs_error: Option<f64>,
    /// Number of compared samples.
    pub samples: usize,
}

/// Ratio of errors below which a restarted model is better than a constant rate.
const FOLLOWED: f64 = 0.5;

/// Ratio of the error to that of a disturbance, above which the disturbance does not explain it.
const DISTURBED: f64 = 1.5;

/// Maximum prediction error of a confirmed plant, relative to that of a model that never moves.
pub(crate) const PREDICTS: f64 = 0.5;

/// R² of a plant whose error is 0.85 of that of a model that keeps its mean speed.
pub(super) const LEAST_R2: f64 = 0.28;

/// Fraction of the variance of acceleration that a valid plant explains; the rest may be vibration.
const EXPLAINED: f64 = 0.5;

/// Returns true if a plant explains most of the acceleration of trials where nothing else was
/// measured.
pub(super) fn explains(quantity: ScoredMotion, r_squared: Option<f64>) -> bool {
    quantity == ScoredMotion::Acceleration && r_squared.is_some_and(|r2| r2 > EXPLAINED)
}

/// Maximum error of a plant that predicts, relative to that of the best model without a plant …
const BEATS_NULL: f64 = 0.85;

/// … and relative to the same where trials confirm the plant otherwise: noise brings the errors closer together,
/// but does not make that of the better model larger by more than chance.
const HIDDEN_BY_NOISE: f64 = 1.1;

impl Score {
    /// Returns the error after removal of the offsets by current or tether, which affect every model.
    pub(crate) fn free_error(&self) -> f64 {
        let errors = [self.mean_abs_error, self.offset_free_error];
        errors.into_iter().flatten().fold(f64::INFINITY, f64::min)
    }

    /// Returns true if the error is too near to that of a model that never moves.
    pub(crate) fn fails(&self) -> bool {
        self.mean_abs_error.is_some()
            && self.free_error() > PREDICTS * self.null_error
            && !explains(self.quantity, self.r_squared)
    }

    /// Returns the best model without a plant if it does nearly as well.
    fn rival_null(&self) -> Option<NullScore> {
        self.best_null.filter(|null| self.free_error() > BEATS_NULL * null.mean_abs_error)
    }

    /// Returns true if the plant predicts no better than a model without one.
    pub(crate) fn falls_short(&self) -> bool {
        self.fails() || self.rival_null().is_some()
    }

    /// Returns true if the best model without a plant does better by more than noise.
    pub(crate) fn is_worse_than_null(&self) -> bool {
        self.best_null.is_some_and(|null| self.free_error() > HIDDEN_BY_NOISE * null.mean_abs_error)
    }

    /// Returns how the plant falls short in an axis on some trials, if it does.
    pub(crate) fn shortfall(&self, dof: Dof, trials: &str) -> Option<String> {
        let unit = self.quantity.unit(dof);
        let error = spoken(self.free_error());
        if self.fails() {
            return Some(format!(
                "on {trials} the error of {dof} is {error} {unit}, too near to that of {}, {} {unit}",
                self.quantity.null_model(),
                spoken(self.null_error)
            ));
        }
        self.rival_null().map(|null| {
            format!(
                "on {trials} the error of {dof} is {error} {unit}, hardly less than that of {}, {} {unit}",
                null.model.description(),
                spoken(null.mean_abs_error)
            )
        })
    }

    /// Returns whether the disturbance explains the error, which is then not evidence against the
    /// plant.
    pub(crate) fn is_of_disturbance(&self) -> bool {
        let both = self.mean_abs_error.zip(self.disturbance_error);
        both.is_some_and(|(error, disturbance)| error < DISTURBED * disturbance)
    }

    /// Returns whether held-out trials confirm the plant, regardless of the effect of unlogged
    /// forces on an open-loop simulation.
    pub(crate) fn is_vouched(&self) -> bool {
        self.likely_change.is_some_and(|change| change.vouches())
    }

    /// Returns whether the plant predicts roll or pitch over some seconds, if not over a whole
    /// trial.
    pub(crate) fn is_followed(&self) -> bool {
        let both = self.restarted_error.zip(self.kept_error);
        both.is_some_and(|(error, kept)| error < FOLLOWED * kept)
    }
}

/// The error of a plant on some trials, simulated in open loop.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantScore {
    /// Over all trials.
    pub by_axis: BTreeMap<Dof, Score>,
    /// By trial.
    pub by_trial: BTreeMap<String, BTreeMap<Dof, Score>>,
}

impl PlantScore {
    /// Creates the score of one axis, over all trials and of each.
    pub fn of_axis(
        dof: Dof,
        score: Score,
        trials: impl IntoIterator<Item = (String, Score)>,
    ) -> Self {
        let mut by_trial = BTreeMap::new();
        for (trial, own) in trials {
            // Parts of one trial, each of which was left out in turn, have its name.
            let part = |k: usize| if k == 1 { trial.clone() } else { format!("{trial}, part {k}") };
            let name = (1..).map(part).find(|name| !by_trial.contains_key(name));
            by_trial.insert(name.unwrap_or(trial), BTreeMap::from([(dof, own)]));
        }
        Self { by_axis: BTreeMap::from([(dof, score)]), by_trial }
    }

    /// Returns the score of an axis on each trial.
    pub fn trials(&self, dof: Dof) -> impl Iterator<Item = (&String, &Score)> + Clone {
        self.by_trial.iter().filter_map(move |(name, axes)| Some((name, axes.get(&dof)?)))
    }
}

/// A score with the errors used for comparison of plants.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scored {
    pub(crate) score: Score,
    /// The score of each trial.
    pub(crate) trials: Vec<(String, Score)>,
    /// Mean |error| of each of many parts of the trials after removal of offsets; the same parts
    /// for every plant. Empty if a simulation diverges.
    pub(crate) parts: Vec<f64>,
}

/// Scores a plant on trials: e on raw velocity, compared with models without a plant.
///
/// # Errors
/// Those of [`Trial::axis`]; for a simulation that diverges, the scores are absent.
pub fn score_plant(dof: Dof, model: &Model, trials: &[&Trial]) -> Result<PlantScore, Error> {
    Ok(score(model, &records(dof, trials)?, &Nulls::default())?.of_axis(dof))
}

impl Scored {
    /// Returns the scores as those of a plant of one axis.
    pub(crate) fn of_axis(&self, dof: Dof) -> PlantScore {
        PlantScore::of_axis(dof, self.score, self.trials.iter().cloned())
    }

    /// Returns the score of each trial.
    pub(crate) fn of_trials(&self) -> impl Iterator<Item = &Score> {
        self.trials.iter().map(|(_, score)| score)
    }
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
    let windows: Vec<Window> = outcomes.iter().flat_map(|outcome| outcome.windows(model)).collect();
    let (score, trials) = scores(&outcomes, &windows, nulls);
    let mut score = Score { quantity: quantity_of(axes), ..score };
    if score.mean_abs_error.is_none() {
        return Ok(Scored { score, trials, parts: Vec::new() });
    }
    let accelerations = outcomes.iter().filter_map(Outcome::comparison);
    let accelerations: Vec<f64> = accelerations.flat_map(parts_of_acceleration).collect();
    // The simulation of a long record takes much memory, and more simulations follow.
    drop(outcomes);
    let parts = [parts(&windows), accelerations].concat();
    score.change = change(model, axes, windows)?;
    Ok(Scored { score, trials, parts })
}

/// Returns the mean |error| of a plant over all samples of some trials; `None` if a simulation diverges.
///
/// # Errors
/// As [`score_plant`].
pub(crate) fn mean_error(model: &Model, axes: &[AxisRecord]) -> Result<Option<f64>, Error> {
    let outcomes = axes.iter().map(|axis| outcome(model, axis)).collect::<Result<Vec<_>, _>>()?;
    Ok(total_score(&outcomes).0.mean_abs_error)
}

/// Returns the score of a plant on one axis of some trials, and that of each; `windows` are those of the trials'
/// comparisons, by which offsets are removed.
pub(crate) fn scores(
    outcomes: &[Outcome],
    windows: &[Window],
    nulls: &Nulls,
) -> (Score, Vec<(String, Score)>) {
    let (mut total, mut trials) = total_score(outcomes);
    let compared: Vec<&Comparison> = outcomes.iter().filter_map(Outcome::comparison).collect();
    if compared.len() < outcomes.len() {
        return (total, trials);
    }
    total.best_null = nulls.best(&compared);
    total.offset_free_error = offset_free_error(windows.iter());
    for (name, trial) in &mut trials {
        let own = windows.iter().filter(|window| window.trial == *name);
        trial.offset_free_error = offset_free_error(own);
    }
    (total, trials)
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

/// Result of the simulation of one axis of a trial.
pub(crate) enum Outcome {
    Compared(Box<Comparison>, Expected),
    Diverged { trial: String, null_error: f64, samples: usize },
}

/// Mean errors over the samples of a trial that [`Score`] reports beside that of the simulation, where they are known.
#[derive(Clone, Copy, Default)]
pub(crate) struct Expected {
    pub(crate) disturbance: Option<f64>,
    pub(crate) restarted: Option<f64>,
    pub(crate) kept: Option<f64>,
}

impl Outcome {
    /// Returns the outcome of a simulation that diverges, with the measured values.
    pub(crate) fn diverged(trial: &str, measured: &[f64]) -> Self {
        let samples = measured.len();
        let null_error = measured.iter().map(|v| v.abs()).sum::<f64>() / samples.max(1) as f64;
        Self::Diverged { trial: trial.to_owned(), null_error, samples }
    }

    fn comparison(&self) -> Option<&Comparison> {
        match self {
            Self::Compared(comparison, _) => Some(comparison),
            Self::Diverged { .. } => None,
        }
    }

    /// Returns the windows of the comparison; errors of velocity decay in them by the drag of `model`.
    pub(crate) fn windows(&self, model: &Model) -> Vec<Window> {
        // Windows explain errors of velocity only.
        let of_velocity = self.comparison().filter(|one| one.quantity == ScoredMotion::Velocity);
        of_velocity.map(|comparison| windows(comparison, model)).unwrap_or_default()
    }

    fn score(&self) -> (String, Score) {
        match self {
            Self::Compared(comparison, expected) => {
                let position = comparison.position.as_ref().map(|position| position.agreement);
                let score = Score {
                    quantity: comparison.quantity,
                    mean_abs_error: Some(comparison.velocity.mean_abs_error),
                    null_error: comparison.velocity.null_error,
                    disturbance_error: expected.disturbance,
                    restarted_error: expected.restarted,
                    kept_error: expected.kept,
                    r_squared: comparison.velocity.r_squared,
                    position_r_squared: position.and_then(|agreement| agreement.r_squared),
                    position_mean_abs_error: position.map(|agreement| agreement.mean_abs_error),
                    samples: comparison.velocity.samples,
                    ..Score::default()
                };
                (comparison.trial.clone(), score)
            }
            Self::Diverged { trial, null_error, samples } => {
                let (null_error, samples) = (*null_error, *samples);
                (trial.clone(), Score { null_error, samples, ..Score::default() })
            }
        }
    }
}

fn outcome(model: &Model, axis: &AxisRecord) -> Result<Outcome, Error> {
    match compare_record(model, axis) {
        Ok(comparison) => Ok(Outcome::Compared(Box::new(comparison), Expected::default())),
        Err(Error::Diverged { .. }) => {
            let velocity = axis.velocity().unwrap_or_else(|_| axis.motion.series().clone());
            Ok(Outcome::diverged(&axis.trial, velocity.values()))
        }
        Err(other) => Err(other),
    }
}

/// Returns the score over all trials, and that of each.
fn total_score(outcomes: &[Outcome]) -> (Score, Vec<(String, Score)>) {
    let compared = outcomes.iter().filter_map(Outcome::comparison);
    let pairs = compared.flat_map(|c| c.measured.iter().copied().zip(c.simulated.iter().copied()));
    let all = Agreement::over(pairs, 0.0);
    let trials: Vec<(String, Score)> = outcomes.iter().map(Outcome::score).collect();
    let diverged = outcomes.iter().any(|outcome| outcome.comparison().is_none());
    let samples = trials.iter().map(|(_, score)| score.samples).sum::<usize>();
    // A mean over all samples, if it is known of each trial.
    let mean = |of: fn(&Score) -> Option<f64>| {
        let own = trials.iter().map(|(_, score)| Some(of(score)? * score.samples as f64));
        own.sum::<Option<f64>>().filter(|_| samples > 0).map(|sum| sum / samples as f64)
    };
    let total = Score {
        mean_abs_error: (!diverged).then_some(all.mean_abs_error),
        null_error: mean(|score| Some(score.null_error)).unwrap_or(0.0),
        disturbance_error: mean(|score| score.disturbance_error),
        restarted_error: mean(|score| score.restarted_error),
        kept_error: mean(|score| score.kept_error),
        r_squared: all.r_squared.filter(|_| !diverged),
        samples,
        ..Score::default()
    };
    (total, trials)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillation_is_predicted_if_the_error_is_below_half_that_of_a_constant_rate() {
        let score =
            |restarted_error, kept_error| Score { restarted_error, kept_error, ..Score::default() };
        assert!(score(Some(0.04), Some(0.1)).is_followed());
        assert!(!score(Some(0.06), Some(0.1)).is_followed());
        // Only roll and pitch are restarted.
        assert!(!score(None, None).is_followed());
    }

    #[test]
    fn a_disturbance_explains_an_error_of_its_own_size() {
        let score = |disturbance_error| Score {
            mean_abs_error: Some(0.1),
            disturbance_error,
            ..Score::default()
        };
        assert!(score(Some(0.08)).is_of_disturbance());
        assert!(!score(Some(0.05)).is_of_disturbance());
        assert!(!score(None).is_of_disturbance());
    }
}
