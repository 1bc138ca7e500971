//! Scores fitted plants on other trials.

use schemars::JsonSchema;
use seaplant::exchange::PlantModel;
use seaplant::results::{PlantResult, PlantScore, Results, TrialResult};
use seaplant::{
    Comparison, Dof, Error, LumpedParameters, Method, Model, Role, Trial, Vehicle,
    compare_fitted_plant, evaluate, score_fitted_plant, score_plant, score_table,
};
use serde::Serialize;

use crate::recording::SourcedTrial;

/// A plant's score on some trials.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Validation {
    /// Its axes, which are simulated together.
    pub axes: Vec<Dof>,
    /// The method of the plant; absent for a published table.
    pub method: Option<Method>,
    /// Its errors.
    pub score: PlantScore,
    /// Trials that the plant was fitted to: their scores are optimistic.
    pub fitted_to: Vec<String>,
}

/// A simulation and its measurement.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Simulation {
    /// The degree of freedom.
    pub dof: Dof,
    /// e = mean |v_model − v| on raw velocity.
    pub mean_abs_error: f64,
    /// e of a model that never moves.
    pub null_error: f64,
    /// R² of velocity; absent if nothing moved.
    pub r_squared: Option<f64>,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Force in effect at each, N or N m.
    pub force: Vec<f64>,
    /// Velocity as measured, unfiltered, m/s or rad/s.
    pub measured: Vec<f64>,
    /// Velocity as simulated, m/s or rad/s.
    pub simulated: Vec<f64>,
}

impl Simulation {
    /// Simulates a plant with the thrust of a trial, which was read for its axes: one simulation for
    /// each of them, which move together.
    ///
    /// # Errors
    /// As [`evaluate`] and [`compare_fitted_plant`]; [`Error::Plant`] if a simulation of several axes
    /// runs away.
    pub fn of_plant(plant: &PlantResult, trial: &Trial) -> Result<Vec<Self>, Error> {
        let all = match Model::of_result(plant) {
            Some(model) => vec![evaluate(plant.first_axis(), &model, trial)?],
            None => compare_fitted_plant(plant, trial)?,
        };
        if all.len() < plant.axes.len() {
            let reason = format!("its simulation of `{}` diverges", trial.name());
            return Err(Error::Plant { axes: plant.name(), reason });
        }
        Ok(all.into_iter().map(Self::from).collect())
    }
}

impl From<Comparison> for Simulation {
    fn from(comparison: Comparison) -> Self {
        let Comparison { dof, time_s, force, measured, simulated, velocity, .. } = comparison;
        Self {
            dof,
            mean_abs_error: velocity.mean_abs_error,
            null_error: velocity.null_error,
            r_squared: velocity.r_squared,
            time_s,
            force,
            measured,
            simulated,
        }
    }
}

/// Scores plants of axes that were identified alone, and those of several axes in the results, each
/// on the trials of its axes that are not steady runs; plants without such a trial are skipped.
///
/// `trials` include the files that each was read from, so that those from which the results were
/// made are marked.
///
/// # Errors
/// As [`score_plant`] and [`score_fitted_plant`].
pub fn validate<'a>(
    results: &'a Results,
    plants: impl IntoIterator<Item = &'a PlantResult>,
    trials: &[SourcedTrial],
) -> Result<Vec<Validation>, Error> {
    let mut validations = Vec::new();
    let several = results.together().map(|(_, plant)| plant);
    for plant in plants.into_iter().chain(several) {
        let (dof, model) = (plant.first_axis(), Model::of_result(plant));
        let scored = moving(trials, |trial| match model {
            Some(_) => trial.dofs().contains(&dof),
            None => trial.record(&plant.axes).is_ok(),
        });
        if scored.is_empty() {
            continue;
        }
        let score = match &model {
            Some(model) => score_plant(dof, model, &scored)?,
            None => score_fitted_plant(plant, &scored)?,
        };
        let is_of_plant = |trial: &TrialResult| model.is_none() || trial.axes.contains_key(&dof);
        let fitted = fitted_files(results, is_of_plant);
        let is_known = |of: &&SourcedTrial| {
            score.by_trial.contains_key(of.trial.name())
                && of.inputs.iter().any(|input| fitted.contains(&input.sha256.as_str()))
        };
        let known = trials.iter().filter(is_known).map(|of| of.trial.name().to_owned());
        let (axes, method, fitted_to) = (plant.axes.clone(), Some(plant.method), known.collect());
        validations.push(Validation { axes, method, score, fitted_to });
    }
    Ok(validations)
}

/// Scores a published table, as [`validate`] scores fitted plants: its axes together on trials that
/// were read for them, and otherwise each by itself.
///
/// # Errors
/// As [`score_table`] and [`score_plant`].
pub fn validate_table(
    model: &PlantModel,
    vehicle: &Vehicle,
    trials: &[SourcedTrial],
) -> Result<Vec<Validation>, Error> {
    let of = |axes: &[Dof], score| Validation {
        axes: axes.to_vec(),
        method: None,
        score,
        fitted_to: Vec::new(),
    };
    let axes = model.plant.axes();
    let scored = moving(trials, |trial| trial.record(axes).is_ok());
    if !scored.is_empty() {
        return Ok(vec![of(axes, score_table(model, vehicle, &scored)?)]);
    }
    let mut validations = Vec::new();
    for &dof in axes {
        let scored = moving(trials, |trial| trial.dofs().contains(&dof));
        let Some(axis) = model.one_axis(dof).filter(|_| !scored.is_empty()) else { continue };
        let thrust = model.thrust_along_over(vehicle, dof)?;
        let lumped = axis.to_lumped();
        let lumped = LumpedParameters { alpha: thrust * lumped.alpha, ..lumped };
        validations.push(of(&[dof], score_plant(dof, &Model::from(lumped), &scored)?));
    }
    Ok(validations)
}

/// Returns the trials that were read for some axes and are not steady runs.
fn moving(trials: &[SourcedTrial], is_read: impl Fn(&Trial) -> bool) -> Vec<&Trial> {
    let is_moving = |trial: &&Trial| trial.role() != Role::Steady && is_read(trial);
    trials.iter().map(|of| &of.trial).filter(is_moving).collect()
}

/// Returns the hashes of the files that some fitted trials were read from.
fn fitted_files(results: &Results, is_wanted: impl Fn(&TrialResult) -> bool) -> Vec<&str> {
    let fitted = |trial: &&TrialResult| trial.role == Role::Fit && is_wanted(trial);
    let files = results.trials.iter().filter(fitted).flat_map(|trial| &trial.files);
    let inputs = &results.provenance.inputs;
    let hash = |path: &String| inputs.iter().find(|input| input.path == *path);
    files.filter_map(hash).map(|input| input.sha256.as_str()).collect()
}
