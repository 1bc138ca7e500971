//! The digital twin: logs of a vehicle whose truth is known.
//!
//! One degree of freedom moves at a time, driven by a pair of thrusters, and is seen
//! through instruments that round, jitter and sit off the origin. What disturbs it, and
//! what its analyst gets wrong, is switched on by name.

mod command;
mod instruments;
mod motion;
mod random;
mod spec;
mod truth;
mod validate;
mod vehicle;
mod water;

use std::collections::BTreeMap;
use std::f64::consts::PI;

pub use spec::{
    Disturbance, DisturbanceStrength, Excitation, NoiseLevel, SteadyRuns, TwinPlant, TwinSpec,
    TwinThrusters,
};
pub use truth::{Truth, TrueNuisances, TrueParameters, TrueSteady};

use crate::navigation::Recording;
use crate::{Dof, Error, PhysicalParameters, Role, Vehicle};
use command::Pilot;
use instruments::record;
use motion::move_vehicle;
use random::{Streams, normal};
use validate::refused;
use water::Water;

/// One rpm, rad/s.
const RPM: f64 = PI / 30.0;
/// Thrust is commanded, and most instruments read, at this rate, Hz.
const TICK_HZ: f64 = 10.0;
/// Integration steps of 0.02 s in each of those.
const STEPS_PER_TICK: usize = 5;

fn tick_time(tick: usize) -> f64 {
    tick as f64 / TICK_HZ
}

/// The logs of the twin, and what is true of it.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinCampaign {
    /// The vehicle as its analyst has it.
    pub vehicle: Vehicle,
    /// For each degree of freedom one trial to fit and one to hold out; then steady runs.
    pub trials: Vec<TwinTrial>,
    /// What an analyst would like to know.
    pub truth: Truth,
    /// Propeller speed, rad/s, and thrust, N, of one thruster on a test bench.
    pub bollard_pull: Vec<(f64, f64)>,
}

/// The log of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TwinTrial {
    /// What it is called: `surge 1`, `surge hold-out`, `heave down 30 %`.
    pub name: String,
    /// What it is for.
    pub role: Role,
    /// The degree of freedom that moves.
    pub dof: Dof,
    /// What thrusters and instruments logged, in SI units and radians.
    pub recording: Recording,
}

/// Makes the logs of a twin.
///
/// `τ = m v̇ + d_Q v_r|v_r| + d_L v_r + b` with v_r the velocity through the water, by
/// RK4 at 0.02 s under thrust that is held for 0.1 s. Logged propeller speeds are in
/// force from their time stamp, and are those asked for: lag and delay come after.
///
/// # Errors
/// [`Error::TwinSpec`] for a twin that cannot be, or that surfaces.
///
/// # Source
/// [Jason2, tables 3–6] for vehicle, instruments and trials.
///
/// ```
/// use seaplant::twin::{TwinSpec, make};
/// let spec = TwinSpec { duration_s: 60.0, ..TwinSpec::jason2() };
/// let campaign = make(&spec)?;
/// assert_eq!(campaign.trials[0].name, "surge 1");
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn make(spec: &TwinSpec) -> Result<TwinCampaign, Error> {
    spec.validate()?;
    let mut trials = Vec::new();
    let mut mean_current = BTreeMap::new();
    for plan in plans(spec) {
        let (trial, current) = plan.carry_out(spec)?;
        mean_current.insert(trial.name.clone(), current);
        trials.push(trial);
    }
    Ok(TwinCampaign {
        vehicle: spec.believed_vehicle()?,
        trials,
        truth: Truth::of(spec, mean_current),
        bollard_pull: bollard_pull(spec),
    })
}

/// A trial that is to be made.
struct Plan {
    name: String,
    role: Role,
    dof: Dof,
    plant: PhysicalParameters,
    duration_s: f64,
    /// Constant thrust of a steady run, as a part of the greatest, positive downwards.
    thrust: f64,
}

fn plans(spec: &TwinSpec) -> Vec<Plan> {
    let mut plans = Vec::new();
    for &dof in &spec.dofs {
        let plan = |name, role, duration_s| {
            let plant = spec.plants[&dof].physical();
            Plan { name, role, dof, plant, duration_s, thrust: 0.0 }
        };
        plans.push(plan(format!("{dof} 1"), Role::Fit, spec.duration_s));
        plans.push(plan(format!("{dof} hold-out"), Role::HoldOut, spec.hold_out_s));
    }
    if spec.dofs.contains(&Dof::Heave) {
        let runs = &spec.steady;
        plans.extend(runs.down.iter().map(|&part| steady_plan(spec, "down", part, part)));
        plans.extend(runs.up.iter().map(|&part| steady_plan(spec, "up", part, -part)));
    }
    plans
}

fn steady_plan(spec: &TwinSpec, way: &str, part: f64, thrust: f64) -> Plan {
    let SteadyRuns { d_quadratic, bias_force, duration_s, .. } = spec.steady;
    let mass = spec.plants[&Dof::Heave].mass;
    Plan {
        name: format!("heave {way} {:.0} %", 100.0 * part),
        role: Role::Steady,
        dof: Dof::Heave,
        plant: PhysicalParameters { mass, d_quadratic, d_linear: 0.0, bias_force },
        duration_s,
        thrust,
    }
}

impl Plan {
    /// Makes the trial; with it comes the mean current in it, m/s.
    fn carry_out(self, spec: &TwinSpec) -> Result<(TwinTrial, f64), Error> {
        let Self { name, role, dof, plant, duration_s, thrust } = self;
        let streams = Streams { seed: spec.seed, trial: &name };
        let ticks = (duration_s * TICK_HZ).round() as usize;
        let pilot = match role {
            Role::Fit => Pilot::of_fit(spec, dof, &streams, ticks),
            Role::HoldOut => Pilot::of_hold_out(spec, dof, &streams, ticks),
            Role::Steady => Pilot::of_steady(thrust * spec.reverse_limit(dof), ticks),
        };
        let water = Water::of(spec, dof, &streams, ticks);
        let moved = move_vehicle(spec, dof, &plant, pilot, &water, &streams, ticks)?;
        let highest = moved.sunk.iter().copied().fold(0.0, f64::min);
        if spec.start_depth_m + highest <= 0.0 {
            let expected = format!("{:.0} or more: trial `{name}` rises that far", 1.0 - highest);
            return Err(refused("start_depth_m", &spec.start_depth_m.to_string(), &expected));
        }
        let recording = record(spec, dof, &moved, &water, &streams)?;
        let current = water.current.iter().sum::<f64>() / ticks as f64;
        Ok((TwinTrial { name, role, dof, recording }, current))
    }
}

/// Points of the test bench each way, and what its force gauge errs by, N.
const BENCH_POINTS: usize = 10;
const BENCH_STD_N: f64 = 10.0;

fn bollard_pull(spec: &TwinSpec) -> Vec<(f64, f64)> {
    let mut rng = Streams { seed: spec.seed, trial: "bench" }.of("bollard pull");
    let points = BENCH_POINTS as i32;
    let read = |point: i32| {
        let speed = spec.thrusters.max_speed() * f64::from(point) / f64::from(points);
        (speed, spec.thrusters.law().force(speed) + BENCH_STD_N * normal(&mut rng))
    };
    (-points..=points).map(read).collect()
}
