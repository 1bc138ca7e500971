//! Scores fitted plants on other trials.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use seaplant::exchange::PlantModel;
use seaplant::results::{
    AxisScore, FittedPlant, PlantResult, PlantScore, Results, Score, TrialResult, TrialScore,
};
use seaplant::{
    Comparison, Dof, Error, LumpedParameters, Method, Model, Role, Trial, Vehicle,
    compare_fitted_plant, evaluate, score_fitted_plant, score_plant, score_table,
};
use serde::Serialize;

use crate::recording::SourcedTrial;

/// A plant's score on some trials.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Validation {
    /// The degree of freedom.
    pub dof: Dof,
    /// The axes that are simulated together; only `dof` for a plant of one axis.
    pub axes: Vec<Dof>,
    /// The method of the plant; absent for a published table.
    pub method: Option<Method>,
    /// Its errors.
    pub score: Score,
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
    /// Simulates a plant with the thrust of a trial.
    ///
    /// # Errors
    /// As [`evaluate`].
    pub fn new(dof: Dof, plant: &PlantResult, trial: &Trial) -> Result<Self, Error> {
        Ok(evaluate(dof, &Model::of_result(plant), trial)?.into())
    }

    /// Simulates a plant of several axes with the thrust of a trial that was read for it: one
    /// simulation for each of its axes, which move together.
    ///
    /// # Errors
    /// As [`compare_fitted_plant`]; [`Error::Plant`] if the simulation runs away.
    pub fn of_several_axes(plant: &FittedPlant, trial: &Trial) -> Result<Vec<Self>, Error> {
        let all = compare_fitted_plant(plant, trial)?;
        if all.len() < plant.axes.len() {
            let axes: Vec<&str> = plant.axes.iter().map(|dof| dof.name()).collect();
            let reason = format!("its simulation of `{}` diverges", trial.name());
            return Err(Error::Plant { axes: axes.join("-"), reason });
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

/// Scores plants, each on the trials of its degree of freedom that are not steady runs; plants
/// without such a trial are skipped.
///
/// `trials` include the files that each was read from, so that those from which the results were
/// made are marked.
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
        let fitted = fitted_files(results, |trial| trial.axes.contains_key(&dof));
        let is_known = |of: &&SourcedTrial| {
            of.inputs.iter().any(|input| fitted.contains(&input.sha256.as_str()))
        };
        let known = of_dof.filter(is_known).map(|of| of.trial.name().to_owned());
        let (method, fitted_to) = (Some(plant.method), known.collect());
        validations.push(Validation { dof, axes: vec![dof], method, score, fitted_to });
    }
    for plant in results.coupled.values() {
        validations.extend(together(results, plant, trials)?);
    }
    Ok(validations)
}

/// Scores the axes of a plant of several axes, simulated together; none if no trial was read for
/// them.
fn together(
    results: &Results,
    plant: &FittedPlant,
    trials: &[SourcedTrial],
) -> Result<Vec<Validation>, Error> {
    let read = read_for(&plant.axes, trials);
    if read.is_empty() {
        return Ok(Vec::new());
    }
    let scored: Vec<&Trial> = read.iter().map(|of| &of.trial).collect();
    let score = score_fitted_plant(plant, &scored)?;
    let fitted = fitted_files(results, |_| true);
    let is_known =
        |of: &&&SourcedTrial| of.inputs.iter().any(|input| fitted.contains(&input.sha256.as_str()));
    let known = read.iter().filter(is_known).map(|of| of.trial.name().to_owned());
    Ok(by_axis(&score, &plant.axes, Some(plant.method), &known.collect::<Vec<_>>()))
}

/// Returns the trials that were read for a plant of several axes and are not steady runs.
fn read_for<'a>(axes: &[Dof], trials: &'a [SourcedTrial]) -> Vec<&'a SourcedTrial> {
    let is_read =
        |of: &&SourcedTrial| of.trial.role() != Role::Steady && of.trial.record(axes).is_ok();
    trials.iter().filter(is_read).collect()
}

/// Returns the scores of axes that were simulated together, one by one.
fn by_axis(
    score: &PlantScore,
    axes: &[Dof],
    method: Option<Method>,
    fitted_to: &[String],
) -> Vec<Validation> {
    let of = |(&dof, whole): (&Dof, &AxisScore)| {
        let of_trial = |(name, axes): (&String, &BTreeMap<Dof, AxisScore>)| {
            let own = axes.get(&dof)?;
            Some(TrialScore {
                trial: name.clone(),
                mean_abs_error: own.mean_abs_error,
                null_error: own.null_error,
                r_squared: own.r2,
                samples: own.samples,
                ..TrialScore::default()
            })
        };
        let score = Score {
            mean_abs_error: whole.mean_abs_error,
            null_error: whole.null_error,
            r_squared: whole.r2,
            trials: score.trials.iter().filter_map(of_trial).collect(),
            ..Score::default()
        };
        Validation { dof, axes: axes.to_vec(), method, score, fitted_to: fitted_to.to_vec() }
    };
    score.by_axis.iter().map(of).collect()
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
    let axes = model.plant.axes();
    let read = read_for(axes, trials);
    if !read.is_empty() {
        let scored: Vec<&Trial> = read.iter().map(|of| &of.trial).collect();
        return Ok(by_axis(&score_table(model, vehicle, &scored)?, axes, None, &[]));
    }
    let mut validations = Vec::new();
    for &dof in axes {
        let scored = moving(dof, trials);
        let Some(axis) = model.one_axis(dof).filter(|_| !scored.is_empty()) else { continue };
        let thrust = model.thrust_along_over(vehicle, dof)?;
        let lumped = axis.to_lumped();
        let lumped = LumpedParameters { alpha: thrust * lumped.alpha, ..lumped };
        let score = score_plant(dof, &Model::from(lumped), &scored)?;
        let (axes, fitted_to) = (vec![dof], Vec::new());
        validations.push(Validation { dof, axes, method: None, score, fitted_to });
    }
    Ok(validations)
}

/// Returns the trials of a degree of freedom that are not steady runs.
fn moving(dof: Dof, trials: &[SourcedTrial]) -> Vec<&Trial> {
    let of_dof = trials.iter().map(|of| &of.trial).filter(|trial| trial.dofs().contains(&dof));
    of_dof.filter(|trial| trial.role() != Role::Steady).collect()
}

/// Returns the hashes of the files that some fitted trials were read from.
fn fitted_files(results: &Results, is_wanted: impl Fn(&TrialResult) -> bool) -> Vec<&str> {
    let fitted = |trial: &&TrialResult| trial.role == Role::Fit && is_wanted(trial);
    let files = results.trials.iter().filter(fitted).flat_map(|trial| &trial.files);
    let inputs = &results.provenance.inputs;
    let hash = |path: &String| inputs.iter().find(|input| input.path == *path);
    files.filter_map(hash).map(|input| input.sha256.as_str()).collect()
}
