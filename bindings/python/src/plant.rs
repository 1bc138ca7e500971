use std::path::PathBuf;

use nalgebra::{Vector3, Vector6};
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use seaplant::Timed;
use seaplant::exchange::{Draws, Drive, PlantModel, Scenario};
use seaplant::motion::{STATE_NAMES, State, StateSpace};
use seaplant_campaign::read_plant_file;
use seaplant_export::{Permission, doubts, export, exporter};

use crate::convert::{Failure, apart, json, numbers};
use crate::results::{Results, parse_method};

/// A plant of any axes, in its exchange form.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Plant {
    model: PlantModel,
    space: StateSpace,
}

/// ∂f/∂x, ∂f/∂u, the holding input, and the indices of the states that the plant moves.
type Linear<'py> =
    (Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>, Vec<usize>);

/// Pose, velocity, the band of velocity, derived numbers as JSON, and notes.
type Moved<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Option<Bound<'py, PyArray3<f64>>>,
    String,
    Vec<String>,
);

/// A coefficient: name, value, standard deviation, ends of its 95 % interval, unit.
type Coefficient = (String, f64, Option<f64>, Option<[f64; 2]>, String);

/// Initial state and water of a simulation, and settings of its band.
#[derive(FromPyObject)]
pub struct Setting {
    #[pyo3(item)]
    start: Vec<f64>,
    #[pyo3(item)]
    current: [f64; 2],
    #[pyo3(item)]
    draws: usize,
    #[pyo3(item)]
    seed: u64,
    #[pyo3(item)]
    disturbed: bool,
}

impl Plant {
    pub fn new(model: PlantModel) -> Result<Self, Failure> {
        Ok(Self { space: StateSpace::new(&model.plant)?, model })
    }

    pub fn model(&self) -> &PlantModel {
        &self.model
    }
}

/// A file: its name and content.
type NamedBytes<'py> = (String, Bound<'py, PyBytes>);

#[pymethods]
impl Plant {
    #[staticmethod]
    fn of_results(results: &Results, source: &str, method: Option<&str>) -> PyResult<Self> {
        let method = parse_method(method)?;
        let model = PlantModel::of_results(&results.0.results, source, method);
        Ok(Self::new(model.map_err(Failure::from)?)?)
    }

    /// Reads a plant file or a published table; `None` for a file that may hold results.
    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Option<Self>> {
        let file = apart(py, move || Ok(read_plant_file(&path)?))?;
        let Some(file) = file else { return Ok(None) };
        Ok(Some(Self::new(file.model().map_err(Failure::from)?)?))
    }

    #[getter]
    fn name(&self) -> String {
        self.model.name.clone()
    }

    #[getter]
    fn axes(&self) -> Vec<&'static str> {
        self.model.plant.axes().iter().map(|dof| dof.name()).collect()
    }

    #[getter]
    fn thrusters(&self) -> Vec<String> {
        self.model.thrusters.iter().map(|thruster| thruster.name.clone()).collect()
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        let notes = self.model.notes.iter().cloned();
        notes.chain(doubts(&self.model)).collect()
    }

    fn coefficients(&self) -> Vec<Coefficient> {
        let model = &self.model;
        let terms = model.plant.structure().terms().iter().zip(model.plant.coefficients());
        let of = |(k, (term, &value)): (usize, (&seaplant::plant::Basis, &f64))| {
            (term.to_string(), value, model.std(k), model.interval(k), term.unit())
        };
        terms.enumerate().map(of).collect()
    }

    /// Computes ẋ = f(x, u); x of shape (12,), u and current of (6,) and (3,).
    fn rate<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        u: PyReadonlyArray1<'py, f64>,
        current: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (x, u, current) = point(&x, &u, &current)?;
        let rate = self.space.rate(&x, &u, &current).map_err(Failure::from)?;
        Ok(PyArray1::from_slice(py, rate.as_slice()))
    }

    /// Returns the Jacobians at a state, and the input that holds its velocity.
    fn linear<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        current: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Linear<'py>> {
        let (x, _, current) = point_of(&numbers(&x), &[0.0; 6], &numbers(&current))?;
        let input = self.space.holding_input(&x, &current).map_err(Failure::from)?;
        let (a, b) = self.space.jacobians(&x, &input, &current).map_err(Failure::from)?;
        let rows = |rows: usize, columns: usize, at: &dyn Fn(usize, usize) -> f64| {
            let row = |i: usize| (0..columns).map(|j| at(i, j)).collect::<Vec<f64>>();
            PyArray2::from_vec2(py, &(0..rows).map(row).collect::<Vec<_>>())
        };
        let moved = self.space.moved(&a);
        let (a, b) = (rows(12, 12, &|i, j| a[(i, j)])?, rows(12, 6, &|i, j| b[(i, j)])?);
        Ok((a, b, PyArray1::from_slice(py, input.as_slice()), moved))
    }

    /// Returns the wrench of constant inputs, N and N m, shape (6,).
    fn wrench<'py>(
        &self,
        py: Python<'py>,
        inputs: Vec<(String, f64)>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let constant = |(name, x): (String, f64)| (name, vec![0.0], vec![x]);
        let drive = drive(inputs.into_iter().map(constant).collect())?;
        let drive = Drive { already_turning: true, ..drive };
        let forces = self.model.forces(&drive, 0.0).map_err(Failure::from)?;
        let wrench = forces.map(|force| force.map_or(0.0, |force| force.held_at(0.0)));
        Ok(PyArray1::from_slice(py, &wrench))
    }

    /// Simulates the motion under inputs that are held from each of their times on.
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        time_s: Vec<f64>,
        inputs: Vec<(String, Vec<f64>, Vec<f64>)>,
        setting: Setting,
    ) -> PyResult<Moved<'py>> {
        let Setting { start, current, draws, seed, disturbed } = setting;
        let (x, _, _) = point_of(&start, &[0.0; 6], &[0.0; 3])?;
        let velocity = seaplant::Dof::ALL.into_iter().map(|dof| (dof, x[6 + dof.index()]));
        let scenario = Scenario {
            drive: drive(inputs)?,
            time_s,
            velocity: velocity.filter(|(_, v)| *v != 0.0).collect(),
            attitude: [x[3], x[4], x[5]],
            current,
            disturbed,
        };
        let (model, draws) = (self.model.clone(), Draws { count: draws, seed });
        let at = [x[0], x[1], x[2]];
        let outcome = apart(py, move || Ok(model.run(&scenario, draws)?))?;
        let moved = |row: &[f64; 6]| {
            let place = |k: usize| row[k] + if k < 3 { at[k] } else { 0.0 };
            (0..6).map(place).collect::<Vec<f64>>()
        };
        let pose: Vec<Vec<f64>> = outcome.prediction.pose.iter().map(moved).collect();
        let velocity: Vec<Vec<f64>> =
            outcome.prediction.velocity.iter().map(|row| row.to_vec()).collect();
        let pairs = |row: &[[f64; 2]; 6]| row.iter().map(|pair| pair.to_vec()).collect::<Vec<_>>();
        let band: Vec<Vec<Vec<f64>>> = outcome.prediction.band.iter().map(pairs).collect();
        let band = if band.is_empty() { None } else { Some(PyArray3::from_vec3(py, &band)?) };
        let mut notes = outcome.notes;
        notes.extend(doubts(&self.model));
        Ok((
            PyArray2::from_vec2(py, &pose)?,
            PyArray2::from_vec2(py, &velocity)?,
            band,
            json(&outcome.consequences)?,
            notes,
        ))
    }

    /// Returns the files of an export by name, and its notes.
    fn export<'py>(
        &self,
        py: Python<'py>,
        to: &str,
        anyway: bool,
    ) -> PyResult<(Vec<NamedBytes<'py>>, Vec<String>)> {
        let permission = if anyway { Permission::Anyway } else { Permission::Checked };
        let made = exporter(to)
            .and_then(|exporter| export(exporter, &self.model, permission))
            .map_err(Failure::from)?;
        let bytes =
            |file: seaplant_export::ExportedFile| (file.path, PyBytes::new(py, &file.bytes));
        Ok((made.files.into_iter().map(bytes).collect(), made.notes))
    }
}

/// Returns the names of the states, in order.
#[pyfunction]
pub fn state_names() -> Vec<&'static str> {
    STATE_NAMES.to_vec()
}

type Point = (State, Vector6<f64>, Vector3<f64>);

fn point(
    x: &PyReadonlyArray1<'_, f64>,
    u: &PyReadonlyArray1<'_, f64>,
    current: &PyReadonlyArray1<'_, f64>,
) -> Result<Point, Failure> {
    point_of(&numbers(x), &numbers(u), &numbers(current))
}

fn point_of(x: &[f64], u: &[f64], current: &[f64]) -> Result<Point, Failure> {
    let all = [("x", x.len(), 12), ("u", u.len(), 6), ("current", current.len(), 3)];
    if let Some((name, found, needed)) = all.into_iter().find(|(_, found, needed)| found != needed)
    {
        let message = format!("{name} has {found} numbers and needs {needed}");
        return Err(Failure::Input(message));
    }
    let state = State::from_column_slice(x);
    Ok((state, Vector6::from_column_slice(u), Vector3::from_column_slice(current)))
}

/// Parses inputs by the names of a profile: `force.AXIS`, `thruster.NAME`, `supply_v`.
fn drive(inputs: Vec<(String, Vec<f64>, Vec<f64>)>) -> Result<Drive, Failure> {
    let mut drive = Drive::default();
    for (name, times, values) in inputs {
        let series = Timed::new(&name, times, values)?;
        match name.split_once('.') {
            Some(("force", axis)) => drop(drive.wrench.insert(axis.parse()?, series)),
            Some(("thruster", own)) => drop(drive.thrusters.insert(own.to_owned(), series)),
            _ if name == "supply_v" => drive.supply_v = Some(series),
            _ => {
                let message = format!(
                    "unknown input `{name}`; expected force.surge (or another axis), thruster.NAME or supply_v"
                );
                return Err(Failure::Input(message));
            }
        }
    }
    Ok(drive)
}
