//! A twin of a vehicle of several axes, driven freely or one axis at a time.

mod motion;
mod pilot;
mod rig;
mod spec;

use std::collections::BTreeMap;

pub use spec::{Driving, TwinWeight, VehicleTwinSpec};

use super::instruments::{MeasurementErrors, Observer, record};
use super::random::Streams;
use super::vehicle::InstrumentNoise;
use super::{TICK_HZ, TrueVehicle, Truth, TwinCampaign, TwinTrial};
use crate::exchange::PlantModel;
use crate::plant::{Basis, Symmetry};
use crate::{Dof, Error, PlantPlan, Role};
use motion::{Currents, DisturbanceForces, SimulatedTrial};
use pilot::VehiclePilot;
use rig::Rig;

/// Simulates the logs of a vehicle with a known plant of several axes.
///
/// The true plant is `model.plant`, simulated as by [`crate::motion::simulate`], under the
/// thrusters of `model`. Logged inputs are commands, valid from their time stamp: lag, delay and
/// rate limit act after them. Fitted trials are driven as `spec.driving` specifies, the held-out
/// one freely, by steps.
///
/// # Errors
/// [`Error::TwinSpec`] for an invalid specification, for thrusters that cannot drive a requested
/// axis, or if the vehicle surfaces; [`Error::Diverged`] if the motion diverges.
///
/// # Example
/// ```
/// use seaplant::exchange::PlantFile;
/// use seaplant::twin::{VehicleTwinSpec, make_vehicle};
/// let file: PlantFile = serde_json::from_value(serde_json::json!({
///     "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
///     "axes": ["surge", "yaw"], "mass_matrix": [100.0, 20.0], "linear_damping": [30.0, 15.0],
///     "thruster": [
///         { "name": "port", "position_m": [0.0, -0.5, 0.0], "direction": [1.0, 0.0, 0.0],
///           "curve": { "kind": "quadratic", "input": "command", "forward": 40.0, "reverse": 30.0 } },
///         { "name": "starboard", "position_m": [0.0, 0.5, 0.0], "direction": [1.0, 0.0, 0.0],
///           "curve": { "kind": "quadratic", "input": "command", "forward": 40.0, "reverse": 30.0 } }
///     ]
/// })).expect("a table");
/// let spec = VehicleTwinSpec { duration_s: 60.0, hold_out_s: 60.0, ..VehicleTwinSpec::default() };
/// let twin = make_vehicle(&spec, &file.model()?)?;
/// let names: Vec<&str> = twin.trials.iter().map(|trial| trial.name.as_str()).collect();
/// assert_eq!(names, ["free 1", "free 2", "hold-out"]);
/// assert_eq!(twin.together[0].axes.len(), 2);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn make_vehicle(spec: &VehicleTwinSpec, model: &PlantModel) -> Result<TwinCampaign, Error> {
    let rig = Rig::new(spec, model)?;
    let total_s: f64 = plans(spec, &rig).iter().map(|plan| plan.duration_s).sum();
    let (mut trials, mut mean_current) = (Vec::new(), BTreeMap::new());
    let mut elapsed_s = 0.0;
    for plan in plans(spec, &rig) {
        let spent = (elapsed_s / total_s, (elapsed_s + plan.duration_s) / total_s);
        elapsed_s += plan.duration_s;
        let (trial, current) = plan.simulate(&rig, spent)?;
        mean_current.insert(trial.name.clone(), current);
        trials.push(trial);
    }
    let mut truth = Truth::new(&rig.shared, BTreeMap::new());
    // The plants of the twin of one axis do not apply to this vehicle.
    truth.plants.clear();
    truth.steady.clear();
    truth.nuisances.reverse_ratio = rig.reverse_ratio();
    truth.vehicle = Some(TrueVehicle {
        name: model.name.clone(),
        coefficients: coefficients(model),
        tether: rig.tether(),
        mean_current_m_s: mean_current,
    });
    Ok(TwinCampaign {
        vehicle: rig.believed_vehicle(model)?,
        trials,
        together: vec![plan_of(model)],
        truth,
        bollard_pull: Vec::new(),
    })
}

/// Returns the coefficients of a plant by name.
fn coefficients(model: &PlantModel) -> BTreeMap<String, f64> {
    let names = model.plant.structure().names().into_iter();
    names.zip(model.plant.coefficients().iter().copied()).collect()
}

/// Returns the plan of an analyst who knows the symmetry of the hull.
fn plan_of(model: &PlantModel) -> PlantPlan {
    let structure = model.plant.structure();
    let couples = |symmetry: Symmetry| {
        structure.terms().iter().all(|term| match term {
            Basis::Mass(i, j) => symmetry.couples(*i, *j),
            _ => true,
        })
    };
    let is_symmetric = couples(Symmetry::PortStarboard);
    PlantPlan {
        axes: model.plant.axes().to_vec(),
        symmetry: if is_symmetric { Symmetry::PortStarboard } else { Symmetry::None },
        model: None,
        terms: Vec::new(),
        effects: Vec::new(),
        hold: BTreeMap::new(),
        search: true,
    }
}

/// The excitation of a trial.
#[derive(Clone, Copy)]
enum Moves {
    /// Every driven axis, by joystick and sinusoids.
    Freely,
    /// One axis, by a sinusoid of rising frequency, and joystick.
    Alone(Dof),
    /// Every driven axis, by steps.
    Steps,
}

struct VehiclePlan {
    name: String,
    role: Role,
    moves: Moves,
    duration_s: f64,
}

/// Number of freely driven trials in a twin without others.
const FREE_TRIALS: usize = 2;

fn plans(spec: &VehicleTwinSpec, rig: &Rig<'_>) -> Vec<VehiclePlan> {
    let fit = |name: String, moves| VehiclePlan {
        name,
        role: Role::Fit,
        moves,
        duration_s: spec.duration_s,
    };
    let free = match spec.driving {
        Driving::Free => FREE_TRIALS,
        Driving::Sweeps => 0,
        Driving::Mixture => 1,
    };
    let mut plans: Vec<VehiclePlan> =
        (1..=free).map(|k| fit(format!("free {k}"), Moves::Freely)).collect();
    if spec.driving != Driving::Free {
        let sweeps = rig.driven().map(|dof| fit(format!("{dof} sweep"), Moves::Alone(dof)));
        plans.extend(sweeps);
    }
    let (name, duration_s) = ("hold-out".to_owned(), spec.hold_out_s);
    plans.push(VehiclePlan { name, role: Role::HoldOut, moves: Moves::Steps, duration_s });
    plans
}

impl VehiclePlan {
    /// Simulates the trial; returns it with its mean current, north and east, m/s.
    fn simulate(self, rig: &Rig<'_>, spent: (f64, f64)) -> Result<(TwinTrial, [f64; 2]), Error> {
        let streams = Streams { seed: rig.shared.seed, trial: &self.name };
        let ticks = (self.duration_s * TICK_HZ).round() as usize;
        let pilot = VehiclePilot::new(rig, self.moves, &streams, ticks);
        let currents = Currents::new(&rig.shared, &streams, ticks);
        let disturbed = DisturbanceForces::new(rig, &streams, ticks);
        let thrusters = rig.thrusters(&streams, ticks, (spent, self.duration_s));
        let vehicle = rig.true_vehicle()?;
        let noise = InstrumentNoise::from_level(rig.shared.noise).with_gyro(rig.shared.noise);
        let driver = (pilot, thrusters, MeasurementErrors::new(&streams, noise, &vehicle.sensors));
        let known = rig.spec.known_forces(self.role, self.duration_s);
        let simulated =
            SimulatedTrial::simulate(rig, driver, (&disturbed, &known), &currents, &streams)?;
        simulated.check_submerged(&rig.shared, &self.name)?;
        let observer = Observer { spec: &rig.shared, vehicle: &vehicle, streams: &streams, noise };
        let recording = record(&observer, &simulated)?;
        let Self { name, role, .. } = self;
        let dofs = Vec::new();
        Ok((TwinTrial { name, role, dofs, recording, known }, currents.mean()))
    }
}

impl InstrumentNoise {
    /// Adds a gyroscope of a noise level.
    fn with_gyro(self, level: super::NoiseLevel) -> Self {
        let std = match level {
            super::NoiseLevel::Low => 0.5e-3,
            super::NoiseLevel::Middle => 2e-3,
            super::NoiseLevel::High => 6e-3,
        };
        Self { gyro: Some(std), ..self }
    }
}
