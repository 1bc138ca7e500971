use std::path::Path;
use std::sync::Arc;

use numpy::PyArray1;
use pyo3::prelude::*;
use seaplant::{Dof, Role, Timed, VelocitySource, axes_by_name};
use seaplant_campaign::{SourcedTrial, TrialEntry, trial_of_log};
use serde_json::Value;

use crate::convert::{Failure, apart, parse};
use crate::log::Log;
use crate::vehicle::Vehicle;

/// One stretch of one log of one vehicle.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Trial(pub Arc<SourcedTrial>);

/// Times and values.
type Series<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

fn series<'py>(py: Python<'py>, series: &Timed) -> Series<'py> {
    (PyArray1::from_slice(py, series.time_s()), PyArray1::from_slice(py, series.values()))
}

/// Parses the axes of each plant: of one, by a name or a list, unless the list is of such sets.
fn plants_axes(axes: Value) -> Result<Vec<Vec<Dof>>, Failure> {
    let is_axis = |of: &Value| of.as_str().is_some_and(|name| name.parse::<Dof>().is_ok());
    let sets = match axes {
        Value::Array(sets) if !sets.iter().any(is_axis) => sets,
        one => vec![one],
    };
    Ok(sets.into_iter().map(axes_by_name).collect::<Result<_, _>>()?)
}

#[pymethods]
impl Trial {
    /// Makes a trial of a log, by the keys of a [[trial]], for plants of some axes as well.
    #[staticmethod]
    fn of_log(
        py: Python<'_>,
        log: PyRef<'_, Log>,
        entry: &str,
        axes: &str,
        vehicle: PyRef<'_, Vehicle>,
    ) -> PyResult<Self> {
        let entry: TrialEntry = parse("trial", entry)?;
        let plant_axes = plants_axes(parse("axes", axes)?)?;
        let (log, vehicle) = (Arc::clone(&log.0), Arc::clone(&vehicle.0));
        let trial = apart(py, move || {
            let log = Arc::unwrap_or_clone(log);
            Ok(trial_of_log(Path::new("trial"), log, &entry, &vehicle.vehicle, &plant_axes)?)
        })?;
        Ok(Self(Arc::new(trial)))
    }

    /// Returns the same trial with another role.
    fn as_role(&self, role: &str) -> PyResult<Self> {
        let role: Role = serde_json::from_value(role.into()).map_err(Failure::from)?;
        let SourcedTrial { trial, inputs, offsets, start_s } = SourcedTrial::clone(&self.0);
        Ok(Self(Arc::new(SourcedTrial { trial: trial.with_role(role), inputs, offsets, start_s })))
    }

    /// Returns its name.
    #[getter]
    fn name(&self) -> &str {
        self.0.trial.name()
    }

    /// Returns its role.
    #[getter]
    fn role(&self) -> &'static str {
        self.0.trial.role().name()
    }

    /// Returns the degrees of freedom that it exercises.
    #[getter]
    fn dofs(&self) -> Vec<&'static str> {
        self.0.trial.dofs().iter().map(|dof| dof.name()).collect()
    }

    /// Returns the axes of each plant of several axes that it may serve.
    #[getter]
    fn axes(&self) -> Vec<Vec<&'static str>> {
        let names = |axes: &Vec<Dof>| axes.iter().map(|dof| dof.name()).collect();
        self.0.trial.setup().together.iter().map(names).collect()
    }

    /// Returns the time in its logs' clock at which its own starts, s.
    #[getter]
    fn start_s(&self) -> f64 {
        self.0.start_s
    }

    /// Returns the files that it was read from.
    #[getter]
    fn files(&self) -> Vec<String> {
        self.0.inputs.iter().map(|input| input.path.clone()).collect()
    }

    /// Returns the doubts of one degree of freedom.
    fn caveats(&self, dof: &str) -> PyResult<Vec<String>> {
        let dof: Dof = dof.parse().map_err(Failure::from)?;
        Ok(self.0.trial.caveats(dof).into_iter().map(|caveat| caveat.message).collect())
    }

    /// Returns velocity, force, and measured position, each with its times.
    fn axis<'py>(
        &self,
        py: Python<'py>,
        dof: &str,
    ) -> PyResult<(Series<'py>, Series<'py>, Option<Series<'py>>)> {
        let dof: Dof = dof.parse().map_err(Failure::from)?;
        let axis = self.0.trial.axis(dof, VelocitySource::Measured).map_err(Failure::from)?;
        let velocity = axis.velocity().map_err(Failure::from)?;
        let position = axis.position.as_ref().map(|position| series(py, position));
        Ok((series(py, &velocity), series(py, &axis.force), position))
    }
}
