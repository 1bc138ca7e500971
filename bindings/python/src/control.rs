use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use seaplant::Dof;
use seaplant::exchange::Draws;
use seaplant_control::{
    Actuators, Controller as Law, Design, Law as Kind, Reference, State, Tuning, ardusub, c_header,
    check_usable, design, doubts_of_model,
};
use serde::Deserialize;

use crate::convert::{Failure, json, numbers, parse};
use crate::online::six;
use crate::plant::Plant;

/// Specification of a controller.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Asked {
    law: Kind,
    adapts: bool,
    bandwidth_hz: BTreeMap<Dof, f64>,
    damping: f64,
    integral_s: Option<f64>,
    lag_s: BTreeMap<Dof, f64>,
    delay_s: BTreeMap<Dof, f64>,
    limit: BTreeMap<Dof, f64>,
    sample_hz: f64,
    adaptation_s: f64,
    draws: usize,
    seed: u64,
    anyway: bool,
}

impl Asked {
    fn design(&self) -> Design {
        let tuned = |(&dof, &hz): (&Dof, &f64)| {
            (dof, Tuning { integral_s: self.integral_s, ..Tuning::new(hz, self.damping) })
        };
        Design {
            law: self.law,
            adapts: self.adapts,
            tuning: self.bandwidth_hz.iter().map(tuned).collect(),
            sample_hz: self.sample_hz,
            adaptation_s: self.adaptation_s,
            anyway: self.anyway,
            ..Design::default()
        }
    }

    /// Returns lag, delay and limits of the plant, overridden by given ones.
    fn actuators(&self, plant: &Plant) -> Actuators {
        let mut actuators = Actuators::of_model(plant.model());
        self.lag_s.iter().for_each(|(dof, s)| actuators.lag_s[dof.index()] = *s);
        self.delay_s.iter().for_each(|(dof, s)| actuators.delay_s[dof.index()] = *s);
        self.limit.iter().for_each(|(dof, most)| actuators.limit[dof.index()] = Some(*most));
        actuators
    }
}

/// A running controller.
#[pyclass(module = "seaplant._native")]
pub struct Controller {
    name: String,
    law: Law,
}

#[pymethods]
impl Controller {
    #[new]
    fn new(plant: &Plant, asked: &str) -> PyResult<Self> {
        let asked: Asked = parse("controller", asked)?;
        let model = plant.model();
        if !asked.anyway {
            check_usable(model).map_err(Failure::from)?;
        }
        let count = Draws { count: asked.draws, seed: asked.seed };
        let draws = model.draws(count).map_err(Failure::from)?;
        let wanted = asked.design();
        let mut gains = design(&model.plant, &draws, &asked.actuators(plant), &wanted)
            .map_err(Failure::from)?;
        let doubts = doubts_of_model(model, &gains);
        gains.notes.extend(doubts);
        let law = Law::new(model.plant.clone(), gains, &wanted.speed);
        Ok(Self { name: model.name.clone(), law })
    }

    /// Returns gains and margins, as JSON.
    fn gains(&self) -> PyResult<String> {
        Ok(json(self.law.gains())?)
    }

    /// Returns the current coefficients, in the order of the plant's.
    fn coefficients<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.law.coefficients())
    }

    /// Returns the force for the next period; the state has shape (12,), the reference is pose,
    /// velocity and acceleration, each of shape (6,).
    fn command<'py>(
        &mut self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        pose: PyReadonlyArray1<'py, f64>,
        rate: PyReadonlyArray1<'py, f64>,
        acceleration: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let state = state(&numbers(&x))?;
        let [pose, rate, acceleration] =
            [("pose", pose), ("rate", rate), ("acceleration", acceleration)]
                .map(|(name, array)| six(name, &array));
        let (pose, rate, acceleration) = (pose?, rate?, acceleration?);
        let all =
            state.velocity.iter().chain(&state.position_ned).chain(state.attitude.coords.iter());
        let mut all = all.chain(&pose).chain(&rate).chain(&acceleration);
        if !all.all(|x| x.is_finite()) {
            let message = "the state or the reference is not finite".to_owned();
            return Err(Failure::Input(message).into());
        }
        let to = Reference {
            position_ned: pose.fixed_rows::<3>(0).into(),
            velocity_ned: rate.fixed_rows::<3>(0).into(),
            acceleration_ned: acceleration.fixed_rows::<3>(0).into(),
            attitude: UnitQuaternion::from_euler_angles(pose[3], pose[4], pose[5]),
            turning: rate.fixed_rows::<3>(3).into(),
            turning_rate: acceleration.fixed_rows::<3>(3).into(),
        };
        let force = self.law.command(&state, &to);
        Ok(PyArray1::from_slice(py, force.as_slice()))
    }

    /// Returns the C header for the exported plant.
    fn c_header(&self) -> PyResult<String> {
        Ok(c_header(&self.name, self.law.gains()).map_err(Failure::from)?)
    }

    /// Returns ArduSub's equivalent parameters, and the gains without one.
    fn ardusub(&self) -> (String, Vec<String>) {
        ardusub(self.law.gains())
    }
}

fn state(x: &[f64]) -> Result<State, Failure> {
    if x.len() != 12 {
        return Err(Failure::Input(format!("x has {} numbers and needs 12", x.len())));
    }
    Ok(State {
        position_ned: Vector3::from_column_slice(&x[..3]),
        attitude: UnitQuaternion::from_euler_angles(x[3], x[4], x[5]),
        velocity: nalgebra::Vector6::from_column_slice(&x[6..]),
    })
}
