use std::collections::BTreeMap;
use std::sync::Arc;

use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use seaplant::estimate::steady::SteadyOptions;
use seaplant::results::{FittedModel, Identification, Parameter, PlantResult};
use seaplant::{Agreement, Comparison, Dof, Method, Model, compare_fitted_plant, evaluate};
use seaplant_campaign::{SourcedTrial, validate};
use seaplant_report::number::Rounded;
use seaplant_report::{parse_results, render};

use crate::convert::{Failure, apart, json};
use crate::trial::Trial;

/// Results of an identification.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Results(pub Arc<Identification>);

/// Axis, e, that of a model that never moves, R²; the series: time, force, measured, simulated.
type Simulated<'py> = (&'static str, f64, f64, Option<f64>, [Bound<'py, PyArray1<f64>>; 4]);

#[pymethods]
impl Results {
    /// Reads the text of a results.json.
    #[staticmethod]
    fn of_json(py: Python<'_>, text: String) -> PyResult<Self> {
        Ok(Self(Arc::new(apart(py, move || Ok(of_results(parse_results(&text)?)))?)))
    }

    /// Returns the text of results.json, without its line breaks.
    fn to_json(&self) -> PyResult<String> {
        Ok(json(&self.0.results)?)
    }

    /// Returns whether any plant was identified.
    ///
    /// # Errors
    /// `InputError`, with why each method found nothing.
    fn check(&self) -> PyResult<()> {
        Ok(self.0.results.check().map_err(Failure::from)?)
    }

    /// Simulates a plant with the thrust of a trial: each axis whose velocity was measured, of
    /// several without those that diverge.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        trial: PyRef<'_, Trial>,
        name: &str,
        method: Option<&str>,
    ) -> PyResult<Vec<Simulated<'py>>> {
        let results = &self.0.results;
        let plant = match parse_method(method)? {
            Some(method) => results.methods.get(name).and_then(|plants| plants.get(&method)),
            None => results.plants.get(name),
        };
        let plant = plant.cloned().ok_or_else(|| {
            let by = method.map_or(String::new(), |method| format!(" by {method}"));
            Failure::Input(format!("the fit has no plant of {name}{by}"))
        })?;
        let trial = Arc::clone(&trial.0);
        let found = apart(py, move || {
            let trial = &trial.trial;
            Ok(match Model::of_result(&plant) {
                Some(model) => vec![evaluate(plant.first_axis(), &model, trial)?],
                None => compare_fitted_plant(&plant, trial)?,
            })
        })?;
        let of = |one: &Comparison| {
            let series = [&one.time_s, &one.force, &one.measured, &one.simulated];
            let series = series.map(|series| PyArray1::from_slice(py, series));
            let Agreement { mean_abs_error, null_error, r_squared, .. } = one.velocity;
            (one.dof.name(), mean_abs_error, null_error, r_squared, series)
        };
        Ok(found.iter().map(of).collect())
    }

    /// Scores plants on trials, as JSON.
    fn validate(
        &self,
        py: Python<'_>,
        trials: Vec<PyRef<'_, Trial>>,
        method: Option<&str>,
    ) -> PyResult<String> {
        let method = parse_method(method)?;
        let found = Arc::clone(&self.0);
        let trials: Vec<_> = trials.iter().map(|own| SourcedTrial::clone(&own.0)).collect();
        apart(py, move || {
            let results = &found.results;
            let alone = results.alone().map(|(dof, ..)| results.plant_of(dof, method));
            let plants: Vec<&PlantResult> = alone.collect::<Result<_, _>>()?;
            json(&validate(results, plants, &trials)?)
        })
    }

    /// Returns every file of a report by its path; `trials` are those that were identified.
    fn render<'py>(
        &self,
        py: Python<'py>,
        trials: Vec<PyRef<'_, Trial>>,
    ) -> PyResult<BTreeMap<String, Bound<'py, PyBytes>>> {
        let found = Arc::clone(&self.0);
        let trials: Vec<_> = trials.iter().map(|own| own.0.trial.clone()).collect();
        let files = apart(py, move || files(&found, &trials))?;
        Ok(files.into_iter().map(|(path, bytes)| (path, PyBytes::new(py, &bytes))).collect())
    }
}

pub fn parse_method(method: Option<&str>) -> Result<Option<Method>, Failure> {
    Ok(method.map(str::parse).transpose()?)
}

/// Converts results of a file, with their models in the order of axes and methods.
fn of_results(results: seaplant::results::Results) -> Identification {
    let plants = Dof::ALL.into_iter().flat_map(|dof| results.methods_of(dof));
    let models = plants
        .filter_map(|(method, plant, _)| {
            Some(FittedModel { dof: plant.first_axis(), method, model: Model::of_result(plant)? })
        })
        .collect();
    Identification { results, models }
}

fn files(
    found: &Identification,
    trials: &[seaplant::Trial],
) -> Result<Vec<(String, Vec<u8>)>, Failure> {
    let mut files = Vec::new();
    render(&found.results, found.series(trials), |artifact| -> Result<(), Failure> {
        let mut bytes = Vec::new();
        artifact.write_to(&mut bytes).map_err(|error| Failure::Input(error.to_string()))?;
        files.push((artifact.path.clone(), bytes));
        Ok(())
    })?;
    Ok(files)
}

/// Estimates quadratic drag from the steady stretches of trials, as JSON.
#[pyfunction]
pub fn steady_drag(
    py: Python<'_>,
    trials: Vec<PyRef<'_, Trial>>,
    dof: &str,
    window_s: f64,
    slope: f64,
    thrust_part: f64,
) -> PyResult<String> {
    let dof: Dof = dof.parse().map_err(Failure::from)?;
    let trials: Vec<_> = trials.iter().map(|trial| Arc::clone(&trial.0)).collect();
    apart(py, move || {
        let trials: Vec<_> = trials.iter().map(|own| &own.trial).collect();
        let options = SteadyOptions { window_s, slope, thrust_part };
        json(&seaplant::steady_drag(dof, &trials, &options)?)
    })
}

/// Follows each thruster over dives: JSON of what each says of its thrusters, to JSON of histories.
///
/// # Errors
/// `ValueError` for text that is not such JSON.
#[pyfunction]
pub fn follow_thrusters(dives: &str) -> PyResult<String> {
    let dives: Vec<seaplant::DiveThrusters> =
        serde_json::from_str(dives).map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok(json(&seaplant::follow_thrusters(&dives))?)
}

/// Rounds a number with its uncertainty for readers: value, standard deviation and the ends of its
/// interval, to two digits of the standard deviation.
#[pyfunction]
pub fn rounded(value: f64, std: f64, low95: f64, high95: f64) -> [String; 4] {
    let unit = String::new();
    let rounded = Rounded::of(&Parameter { value, std, low95, high95, unit });
    [rounded.value, rounded.std, rounded.low95, rounded.high95]
}
