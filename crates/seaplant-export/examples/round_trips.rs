//! Writes plants in every format, and their motion by Seaplant itself, with which the round trips
//! of `scripts/round-trips` compare other engines. The only argument is the folder.

use std::error::Error;
use std::path::Path;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use seaplant::exchange::{Drive, PlantFile, PlantModel};
use seaplant::motion::{Inputs, simulate};
use seaplant::{Dof, Thruster, ThrusterInput, Timed};
use seaplant_export::{EXPORTERS, Permission, export};
use serde_json::{Value, json};

type Failed = Box<dyn Error>;

/// Published tables, and plants with terms of every kind.
const CASES: [(&str, &str); 7] = [
    ("heavy", include_str!("../../seaplant-campaign/plants/bluerov2-heavy-von-benzon-2022.toml")),
    ("rexrov", include_str!("../../seaplant-campaign/plants/rexrov.toml")),
    ("boat", include_str!("../../seaplant-campaign/plants/wam-v-vrx.toml")),
    ("every-term", include_str!("round_trips/every-term.toml")),
    ("vertical", include_str!("round_trips/vertical.toml")),
    ("hull", include_str!("round_trips/hull.toml")),
    ("surge", include_str!("round_trips/surge.toml")),
];

const STATES: usize = 200;
const SEED: u64 = 7;
const CURRENT: [f64; 2] = [0.2, -0.1];

fn main() -> Result<(), Failed> {
    let folder = std::env::args_os().nth(1).ok_or("give the folder to write to")?;
    for (name, text) in CASES {
        let model = toml::from_str::<PlantFile>(text)?.model()?;
        let case = Path::new(&folder).join(name);
        write_formats(&model, &case)?;
        let reference = reference(&model)?;
        std::fs::write(case.join("reference.json"), serde_json::to_string(&reference)?)?;
    }
    Ok(())
}

fn write_formats(model: &PlantModel, case: &Path) -> Result<(), Failed> {
    for exporter in EXPORTERS {
        for file in export(exporter, model, Permission::Checked)?.files {
            let path = case.join(exporter.name()).join(file.path);
            std::fs::create_dir_all(path.parent().ok_or("no folder")?)?;
            std::fs::write(path, file.bytes)?;
        }
    }
    Ok(())
}

fn reference(model: &PlantModel) -> Result<Value, Failed> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED);
    let states: Vec<Value> =
        (0..STATES).map(|_| state(model, &mut random)).collect::<Result<_, _>>()?;
    let mass = model.plant.mass_matrix_of_six();
    let rows: Vec<Vec<f64>> = mass.row_iter().map(|row| row.iter().copied().collect()).collect();
    Ok(json!({
        "own": Dof::ALL.map(|dof| model.plant.axes().contains(&dof)),
        "coefficients": model.plant.structure().terms().iter().map(ToString::to_string)
            .zip(model.plant.coefficients()).collect::<std::collections::BTreeMap<_, _>>(),
        "mass": rows,
        "states": states,
        "trajectory": trajectory(model)?,
        "thrust": thrust(model),
        "actuated": actuated(model)?,
    }))
}

/// Returns a state with the plant's rate there.
fn state(model: &PlantModel, random: &mut ChaCha8Rng) -> Result<Value, Failed> {
    let mut draw = |scale: f64| scale * random.random_range(-1.0..1.0);
    let angles = [draw(1.5), draw(1.2), draw(3.0)];
    let velocity = Vector6::from_fn(|k, _| draw(if k < 3 { 2.0 } else { 1.0 }));
    let force = Vector6::from_fn(|_, _| draw(100.0));
    let current = Vector3::new(draw(0.5), draw(0.5), draw(0.2));
    let q = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
    let (water, down) = (q.inverse() * current, q.inverse() * Vector3::z());
    let velocity = model.plant.with_held_angles(&velocity, &down);
    let own = |k: usize| model.plant.axes().contains(&Dof::ALL[k]);
    let moved = |k: usize, x: &Vector3<f64>| if k < 3 && own(k) { x[k] } else { 0.0 };
    let relative = Vector6::from_fn(|k, _| velocity[k] - moved(k, &water));
    let turning = Vector3::new(velocity[3], velocity[4], velocity[5]).cross(&water);
    let rate = model.plant.acceleration(&force, &relative, &down)?;
    let rate = Vector6::from_fn(|k, _| rate[k] - moved(k, &turning));
    Ok(json!({
        "angles": angles,
        "quaternion": [q.w, q.i, q.j, q.k],
        "velocity": velocity.as_slice(),
        "force": force.as_slice(),
        "current": current.as_slice(),
        "rate": rate.as_slice(),
    }))
}

/// Simulates a minute under forces that change every five seconds, in a current.
fn trajectory(model: &PlantModel) -> Result<Value, Failed> {
    let mut random = ChaCha8Rng::seed_from_u64(SEED + 1);
    let changes: Vec<f64> = (0..12).map(|k| 5.0 * f64::from(k)).collect();
    let mut inputs = Inputs { current: CURRENT, ..Inputs::default() };
    let mut forces = Vec::new();
    for dof in Dof::ALL {
        let mass = model.plant.mass_matrix_of_six()[(dof.index(), dof.index())];
        let scale = if dof.is_rotation() { 0.1 } else { 0.5 };
        let force: Vec<f64> =
            changes.iter().map(|_| scale * mass * random.random_range(-1.0..1.0)).collect();
        inputs.force[dof.index()] = Some(Timed::new("force", changes.clone(), force.clone())?);
        forces.push(force);
    }
    let heading = Timed::new("heading", vec![0.0], vec![0.3])?;
    inputs.attitude[2] = Some(heading);
    let time_s: Vec<f64> = (0..=120).map(|k| 0.5 * f64::from(k)).collect();
    let has = |dof: Dof| model.plant.axes().contains(&dof);
    let turns = [Dof::Roll, Dof::Pitch, Dof::Yaw].iter().filter(|dof| has(**dof)).count();
    let moved = simulate(&model.plant, &inputs, &Vector6::zeros(), &time_s)?;
    Ok(json!({
        "time_s": time_s,
        "change_s": changes,
        "forces": forces,
        "current": [CURRENT[0], CURRENT[1], 0.0],
        "heading": 0.3,
        "turns": turns,
        "velocity": moved.velocity.iter().map(|v| v.as_slice().to_vec()).collect::<Vec<_>>(),
        "attitude": moved.attitude,
    }))
}

/// Returns inputs that change every half second, and the resulting wrench with lag, delay and
/// reverse ratio, in steps of 0.02 s.
fn actuated(model: &PlantModel) -> Result<Value, Failed> {
    const STEP_S: f64 = 0.02;
    const STEPS: usize = 500;
    if model.thrusters.is_empty() {
        return Ok(Value::Null);
    }
    let mut random = ChaCha8Rng::seed_from_u64(SEED + 3);
    let times: Vec<f64> = (0..20).map(|k| 0.5 * f64::from(k)).collect();
    // As in the exports, propellers start with the first inputs.
    let mut drive = Drive { already_turning: true, ..Drive::default() };
    let mut inputs = Vec::new();
    for thruster in &model.thrusters {
        let series: Vec<f64> =
            times.iter().map(|_| input(thruster.curve.input(), &mut random)).collect();
        drive
            .thrusters
            .insert(thruster.name.clone(), Timed::new("input", times.clone(), series.clone())?);
        inputs.push(series);
    }
    drive.supply_v = Some(Timed::new("supply", vec![0.0], vec![15.0])?);
    let forces = model.forces(&drive, STEP_S * STEPS as f64)?;
    let wrench = |k: usize| {
        let middle = STEP_S * (k as f64 + 0.5);
        forces.each_ref().map(|force| force.as_ref().map_or(0.0, |force| force.held_at(middle)))
    };
    Ok(json!({
        "supply_v": 15.0,
        "inputs": inputs,
        "wrench": (0..STEPS).map(wrench).collect::<Vec<_>>(),
    }))
}

/// Draws an input of a thruster.
fn input(kind: ThrusterInput, random: &mut ChaCha8Rng) -> f64 {
    random.random_range(match kind {
        ThrusterInput::Speed => -150.0..150.0,
        ThrusterInput::Pwm => 1050.0..1950.0,
        ThrusterInput::Command => -1.0..1.0,
        ThrusterInput::Force => -100.0..100.0,
    })
}

/// Returns inputs of all thrusters and the resulting wrench.
fn thrust(model: &PlantModel) -> Value {
    let mut random = ChaCha8Rng::seed_from_u64(SEED + 2);
    let inputs: Vec<Vec<f64>> = (0..50)
        .map(|_| {
            let drawn = |thruster: &Thruster| input(thruster.curve.input(), &mut random);
            model.thrusters.iter().map(drawn).collect()
        })
        .collect();
    let wrench = |inputs: &Vec<f64>| {
        let mut tau = [0.0; 6];
        for (thruster, input) in model.thrusters.iter().zip(inputs) {
            let force = thruster.curve.force(*input, Some(15.0));
            let unit = thruster.unit_wrench();
            (0..6).for_each(|k| tau[k] += unit[k] * force);
        }
        tau
    };
    json!({ "supply_v": 15.0, "wrench": inputs.iter().map(wrench).collect::<Vec<_>>(), "inputs": inputs })
}
