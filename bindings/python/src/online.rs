use std::collections::BTreeMap;

use nalgebra::Vector6;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use seaplant::Dof;
use seaplant::estimate::online::{
    MOST_SIGNALS, Online as Estimator, OnlineOptions, Sample, Scheme,
};
use seaplant::exchange::{Origin, PlantModel};
use seaplant::motion::down_body;
use seaplant::plant::{Basis, Signal, Structure, Symmetry};
use serde::Deserialize;

use crate::convert::{Failure, numbers, parse};
use crate::plant::Plant;
use crate::vehicle::Vehicle;

/// Specification of an estimator.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    scheme: Scheme,
    /// Axes of a new plant; empty if it starts from a plant.
    axes: Vec<Dof>,
    symmetry: Symmetry,
    terms: Vec<String>,
    settings: OnlineOptions,
}

impl Asked {
    fn structure(&self) -> Result<Structure, Failure> {
        let mut structure = Structure::of(&self.axes, self.symmetry)?;
        for term in &self.terms {
            structure = structure.with(term.parse::<Basis>()?)?;
        }
        Ok(structure)
    }
}

/// An estimator that processes one sample at a time.
#[pyclass(module = "seaplant._native")]
pub struct Online(Estimator);

/// Times at which a change began and was detected, s, and its significance.
type Changed = (f64, f64, f64);

/// The plant; standard deviations and variance inflation factors of its coefficients; excitation,
/// residual of each axis, detectable change, motion so far.
type Estimated<'py> = (
    Plant,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    f64,
    Bound<'py, PyArray1<f64>>,
    Option<f64>,
    f64,
);

#[pymethods]
impl Online {
    #[new]
    fn new(asked: &str, start: Option<&Plant>, vehicle: Option<&Vehicle>) -> PyResult<Self> {
        let asked: Asked = parse("online", asked)?;
        let body = vehicle.and_then(|vehicle| vehicle.0.vehicle.rigid_body);
        let structure = match start {
            Some(plant) => plant.model().plant.structure().clone(),
            None => asked.structure()?,
        };
        let made = Estimator::new(structure, asked.scheme, asked.settings, body.as_ref())
            .and_then(|made| match start {
                Some(plant) => made.starting_from(&plant.model().plant),
                None => Ok(made),
            })
            .map_err(Failure::from)?;
        Ok(Self(made))
    }

    /// Processes a sample; velocity and force of shape (6,), signals by name.
    fn update(
        &mut self,
        time_s: f64,
        velocity: PyReadonlyArray1<'_, f64>,
        force: PyReadonlyArray1<'_, f64>,
        attitude: (f64, f64),
        signals: BTreeMap<String, f64>,
    ) -> PyResult<Option<Changed>> {
        let sample = Sample {
            time_s,
            velocity: six("velocity", &velocity)?,
            down_body: down_body(attitude.0, attitude.1),
            force: six("force", &force)?,
            signals: self.signals(&signals)?,
        };
        let change = self.0.update(&sample).map_err(Failure::from)?;
        Ok(change.map(|change| (change.since_s, change.noticed_s, change.statistic)))
    }

    /// Starts a new motion with the next sample.
    fn restart(&mut self) {
        self.0.restart();
    }

    /// Predicts the velocity after a time under the last force, shape (6,).
    fn predict<'py>(
        &self,
        py: Python<'py>,
        duration_s: f64,
    ) -> PyResult<Option<Bound<'py, PyArray1<f64>>>> {
        let velocity = self.0.predict(duration_s).map_err(Failure::from)?;
        Ok(velocity.map(|velocity| PyArray1::from_slice(py, velocity.as_slice())))
    }

    fn estimate<'py>(&self, py: Python<'py>) -> PyResult<Estimated<'py>> {
        let found = self.0.estimate().map_err(Failure::from)?;
        let is_told = found.covariance.iter().all(|x| x.is_finite());
        let model = PlantModel {
            name: "identified sample by sample".to_owned(),
            plant: found.plant,
            covariance: is_told.then_some(found.covariance),
            intervals: Default::default(),
            rigid_body: None,
            dry_mass_kg: None,
            size_m: None,
            buoyancy: None,
            thrusters: Vec::new(),
            max_rpm: None,
            actuation: Default::default(),
            driven: Default::default(),
            disturbances: Default::default(),
            origin: Origin::default(),
            judgements: Vec::new(),
            notes: Vec::new(),
        };
        Ok((
            Plant::new(model)?,
            PyArray1::from_slice(py, &found.std),
            PyArray1::from_slice(py, &found.inflation),
            found.excitation,
            PyArray1::from_slice(py, found.residual.as_slice()),
            found.noticeable_change,
            found.elapsed_s,
        ))
    }

    /// Returns whether the scheme itself has started.
    fn has_started(&self) -> bool {
        self.0.has_started()
    }

    /// Returns the signals of the plant's effects, by the names that `update` takes.
    fn signal_names(&self) -> Vec<String> {
        self.0.structure().signals().iter().map(signal_name).collect()
    }

    /// Returns the names of the coefficients, in order.
    fn names(&self) -> Vec<String> {
        self.0.structure().names()
    }

    /// Returns the current coefficients, in that order.
    fn coefficients<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.coefficients())
    }
}

impl Online {
    /// Returns signals in the order of the structure.
    fn signals(&self, named: &BTreeMap<String, f64>) -> Result<[f64; MOST_SIGNALS], Failure> {
        let names = self.signal_names();
        let known = || names.join(", ");
        if let Some(strange) = named.keys().find(|name| !names.contains(name)) {
            let known = if names.is_empty() { "none".to_owned() } else { known() };
            return Err(Failure::Input(format!(
                "unknown signal `{strange}`; the plant reads {known}"
            )));
        }
        let mut signals = [0.0; MOST_SIGNALS];
        for (place, name) in signals.iter_mut().zip(&names) {
            *place = *named.get(name).ok_or_else(|| {
                Failure::Input(format!("the signal `{name}` is missing; give {}", known()))
            })?;
        }
        Ok(signals)
    }
}

/// Returns `rudder.NAME.angle`, `thruster.NAME.drive`, `thruster.NAME.speed`,
/// `thruster.NAME.thrust`, `thruster.NAME.thrust-by-lag`, `wind.forward`.
fn signal_name(signal: &Signal) -> String {
    match signal {
        Signal::Angle { kind, name } => format!("{}.{name}.angle", kind.name()),
        Signal::Drive(name) => format!("thruster.{name}.drive"),
        Signal::PropellerSpeed(name) => format!("thruster.{name}.speed"),
        Signal::Thrust(name) => format!("thruster.{name}.thrust"),
        Signal::ThrustBy { number, thruster } => {
            format!("thruster.{thruster}.thrust-by-{}", number.key())
        }
        Signal::AirForward => "wind.forward".to_owned(),
        Signal::AirStarboard => "wind.starboard".to_owned(),
    }
}

/// Returns six numbers of an array.
pub fn six(name: &str, array: &PyReadonlyArray1<'_, f64>) -> Result<Vector6<f64>, Failure> {
    let all = numbers(array);
    if all.len() == 6 {
        return Ok(Vector6::from_column_slice(&all));
    }
    Err(Failure::Input(format!("{name} has {} numbers and needs 6", all.len())))
}
