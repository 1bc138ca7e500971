//! Fitted plants on other trials.

use schemars::JsonSchema;
use seaplant::exchange::PlantModel;
use seaplant::results::{PlantResult, Results, Score};
use seaplant::{Comparison, Dof, Error, Method, Model, Role, Trial, evaluate, score_plant};
use serde::Serialize;

use crate::recording::SourcedTrial;

/// A plant's score on some trials.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Validation {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Whose plant; absent of a published table.
    pub method: Option<Method>,
    /// Its errors.
    pub score: Score,
    /// Trials that the plant was fitted to: their scores flatter it.
    pub fitted_to: Vec<String>,
}

/// A simulation beside its measurement.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Simulation {
    /// Which degree of freedom.
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
    /// Drives a plant with the thrust of a trial.
    ///
    /// # Errors
    /// As [`evaluate`].
    pub fn of(dof: Dof, plant: &PlantResult, trial: &Trial) -> Result<Self, Error> {
        let Comparison { time_s, force, measured, simulated, velocity, .. } =
            evaluate(dof, &Model::of_result(plant), trial)?;
        Ok(Self {
            dof,
            mean_abs_error: velocity.mean_abs_error,
            null_error: velocity.null_error,
            r_squared: velocity.r_squared,
            time_s,
            force,
            measured,
            simulated,
        })
    }
}

/// Scores plants, each on the trials of its degree of freedom that are not steady runs;
/// plants without such a trial are passed over.
///
/// `trials` come with the files that each was read from: those that the results were made
/// from, too, are told.
///
/// # Errors
/// As [`score_plant`].
pub fn validate<'a>(
    results: &Results,
    plants: impl IntoIterator<Item = (Dof, &'a PlantResult)>,
    trials: &[SourcedTrial],
) -> Result<Vec<Validation>, Error> {
    let mut validations = Vec::new();
    for (dof, plant) in plants {
        let of_dof = trials.iter().filter(|of| of.trial.dofs().contains(&dof));
        let scored = moving(dof, trials);
        if scored.is_empty() {
            continue;
        }
        let score = score_plant(dof, &Model::of_result(plant), &scored)?;
        let fitted = fitted_files(results, dof);
        let is_known = |of: &&SourcedTrial| {
            of.inputs.iter().any(|input| fitted.contains(&input.sha256.as_str()))
        };
        let known = of_dof.filter(is_known).map(|of| of.trial.name().to_owned());
        let (method, fitted_to) = (Some(plant.method), known.collect());
        validations.push(Validation { dof, method, score, fitted_to });
    }
    Ok(validations)
}

/// Scores each axis of a published table by itself, as [`validate`] scores fitted plants.
///
/// # Errors
/// As [`score_plant`].
pub fn validate_table(
    model: &PlantModel,
    trials: &[SourcedTrial],
) -> Result<Vec<Validation>, Error> {
    let mut validations = Vec::new();
    for &dof in model.plant.axes() {
        let scored = moving(dof, trials);
        let Some(axis) = model.single_axis(dof).filter(|_| !scored.is_empty()) else { continue };
        let score = score_plant(dof, &Model::from(axis.to_lumped()), &scored)?;
        validations.push(Validation { dof, method: None, score, fitted_to: Vec::new() });
    }
    Ok(validations)
}

/// The trials of a degree of freedom that are not steady runs.
fn moving(dof: Dof, trials: &[SourcedTrial]) -> Vec<&Trial> {
    let of_dof = trials.iter().map(|of| &of.trial).filter(|trial| trial.dofs().contains(&dof));
    of_dof.filter(|trial| trial.role() != Role::Steady).collect()
}

/// The hashes of the files that a degree of freedom was fitted to.
fn fitted_files(results: &Results, dof: Dof) -> Vec<&str> {
    let fitted = |trial: &&seaplant::results::TrialResult| {
        trial.role == Role::Fit && trial.axes.contains_key(&dof)
    };
    let files = results.trials.iter().filter(fitted).flat_map(|trial| &trial.files);
    let inputs = &results.provenance.inputs;
    let hash = |path: &String| inputs.iter().find(|input| input.path == *path);
    files.filter_map(hash).map(|input| input.sha256.as_str()).collect()
}
