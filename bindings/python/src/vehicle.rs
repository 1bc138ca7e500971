use std::path::{Path, PathBuf};
use std::sync::Arc;

use pyo3::prelude::*;
use seaplant_campaign::SourcedVehicle;

use crate::convert::{Failure, apart, parse};

/// A vehicle with known thrusters.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Vehicle(pub Arc<SourcedVehicle>);

#[pymethods]
impl Vehicle {
    /// Reads a vehicle.toml, and the curve tables that it refers to.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let vehicle = apart(py, move || Ok(SourcedVehicle::open(&path)?))?;
        Ok(Self(Arc::new(vehicle)))
    }

    /// Creates a vehicle from its file's content; paths in it are relative to the working folder.
    #[staticmethod]
    fn of_json(json: &str) -> PyResult<Self> {
        let vehicle = parse("vehicle", json)
            .and_then(|file| Ok(SourcedVehicle::from_file(file, Path::new("vehicle"))?));
        Ok(Self(Arc::new(vehicle?)))
    }

    /// Returns its name.
    #[getter]
    fn name(&self) -> &str {
        &self.0.vehicle.name
    }

    /// Returns the mass in air, kg.
    #[getter]
    fn dry_mass_kg(&self) -> Option<f64> {
        self.0.vehicle.dry_mass_kg
    }

    /// Returns length, width and height of the hull, m.
    #[getter]
    fn size_m(&self) -> Option<[f64; 3]> {
        self.0.vehicle.size_m
    }

    /// Returns the names of its thrusters.
    #[getter]
    fn thrusters(&self) -> Vec<&str> {
        self.0.vehicle.thrusters.iter().map(|thruster| thruster.name.as_str()).collect()
    }

    /// Returns the wrench of one newton of each thruster, N and N m.
    fn unit_wrenches(&self) -> Vec<[f64; 6]> {
        self.0.vehicle.thrusters.iter().map(seaplant::Thruster::unit_wrench).collect()
    }

    /// Returns the force of a thruster, N, at inputs in rad/s, us or as a ratio.
    fn thrust(&self, name: &str, inputs: Vec<f64>, voltage_v: Option<f64>) -> PyResult<Vec<f64>> {
        let known = &self.0.vehicle.thrusters;
        let thruster = known.iter().find(|thruster| thruster.name == name).ok_or_else(|| {
            let known = self.thrusters().join(", ");
            Failure::Input(format!("the vehicle has no thruster `{name}` but {known}"))
        })?;
        Ok(inputs.into_iter().map(|input| thruster.curve.force(input, voltage_v)).collect())
    }
}
