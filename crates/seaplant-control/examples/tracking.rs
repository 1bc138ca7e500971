//! How controllers track on the Jason 2 twin: `cargo run -p seaplant-control --example tracking`.
//!
//! The table of docs/src/control.md, in Markdown.
#![allow(clippy::print_stdout, reason = "the program prints; that is what it is for")]

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::path::Path as FilePath;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use seaplant::plant::{Basis, Plant, Product, Structure, Symmetry};
use seaplant::twin::{Disturbance, Measured, TwinSpec, close_loop, make};
use seaplant::{Dof, IdentifyOptions, Method, PhysicalParameters, Trial, TrialSetup, identify};
use seaplant_campaign::read_plant_file;
use seaplant_control::{
    Actuators, Controller, Design, Law, Path, Reference, State, Tuning, design,
};

const DOFS: [Dof; 4] = [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw];

/// What disturbs the twin while it is identified and while it is controlled.
const SEAS: [(&str, &str); 2] =
    [("calm", "none"), ("tether, current, lag, delay", "tether,current,lag,delay")];

/// Natural frequency of every loop, Hz, its damping, and how often it acts, Hz.
const BANDWIDTH_HZ: f64 = 0.06;
const DAMPING: f64 = 1.0;
const SAMPLE_HZ: f64 = 10.0;

/// Each run, s; errors are those of its second half.
const RUN_S: f64 = 360.0;

/// Seeds over which errors are averaged.
const SEEDS: [u64; 3] = [11, 12, 13];

/// The paths: the sine of [Jason2, table 4] in heave, a step, and a place to keep.
fn paths(dof: Dof) -> [(&'static str, Path); 3] {
    let size = if dof.is_rotation() { 0.3 } else { 0.5 };
    [
        ("sine", Path::Sine { amplitude: size, rate: 0.3925 }),
        ("step", Path::Step { size: 2.0 * size, rate: 0.3 }),
        ("hold", Path::Hold),
    ]
}

fn plant(dof: Dof, of: &PhysicalParameters) -> Result<Plant, seaplant::Error> {
    let structure = Structure::of(&[dof], Symmetry::Diagonal)?
        .without(|term| matches!(term, Basis::WeightExcess | Basis::Lever(_)))
        .with(Basis::One(dof))?;
    let value = |term: &Basis| match term {
        Basis::Mass(..) => of.mass,
        Basis::Product(_, product) if *product == Product::linear(dof) => of.d_linear,
        Basis::Product(..) => of.d_quadratic,
        _ => of.bias_force,
    };
    let coefficients = structure.terms().iter().map(value).collect();
    Plant::new(structure, coefficients)
}

/// What is believed of the vehicle: its name and the plant of each axis.
type Beliefs = Vec<(&'static str, BTreeMap<Dof, Plant>)>;

fn beliefs(spec: &TwinSpec) -> Result<Beliefs, Box<dyn Error>> {
    let dive = make(spec)?;
    let trials = dive
        .trials
        .iter()
        .map(|log| {
            let setup = TrialSetup {
                name: log.name.clone(),
                role: log.role,
                dofs: log.dofs.clone(),
                ..TrialSetup::default()
            };
            Trial::new(setup, &log.recording, &dive.vehicle)
        })
        .collect::<Result<Vec<_>, _>>()?;
    let methods = vec![Method::FilterError, Method::Paper];
    let options = IdentifyOptions { methods, subsets: false, ..IdentifyOptions::default() };
    let found = identify(&dive.vehicle, &trials, &options).results;
    let by = |method: Method| -> Result<BTreeMap<Dof, Plant>, Box<dyn Error>> {
        let of = |dof: Dof| {
            Ok((dof, plant(dof, &found.plant_of(dof, Some(method))?.lumped.to_physical())?))
        };
        DOFS.into_iter().map(of).collect()
    };
    let table = read_plant_file(FilePath::new("published:rexrov"))?.ok_or("no such table")?;
    let table = table.model()?;
    let other = |dof: Dof| {
        let single = table.single_axis(dof).ok_or("not in the table")?;
        Ok((dof, plant(dof, &PhysicalParameters { bias_force: 0.0, ..single })?))
    };
    let other: Result<BTreeMap<Dof, Plant>, Box<dyn Error>> = DOFS.into_iter().map(other).collect();
    Ok(vec![
        ("identified", by(Method::FilterError)?),
        ("the paper's", by(Method::Paper)?),
        ("RexROV's table", other?),
    ])
}

/// One axis as a pose of the vehicle.
fn state(dof: Dof, at: &Measured) -> State {
    let mut position_ned = Vector3::zeros();
    let mut attitude = UnitQuaternion::identity();
    match dof {
        Dof::Surge | Dof::Sway | Dof::Heave => position_ned[dof.index()] = at.position,
        _ => attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, at.position),
    }
    let velocity = Vector6::from_fn(|i, _| if i == dof.index() { at.velocity } else { 0.0 });
    State { position_ned, attitude, velocity }
}

fn reference(dof: Dof, [x, v, a]: [f64; 3]) -> Reference {
    let mut to = Reference::at(Vector3::zeros(), UnitQuaternion::identity());
    if dof.is_rotation() {
        to.attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, x);
        (to.turning.z, to.turning_rate.z) = (v, a);
    } else {
        let i = dof.index();
        (to.position_ned[i], to.velocity_ned[i], to.acceleration_ned[i]) = (x, v, a);
    }
    to
}

/// The error of the second half, RMS over seeds.
fn error(
    spec: &TwinSpec,
    dof: Dof,
    path: &Path,
    controller: &Controller,
) -> Result<f64, Box<dyn Error>> {
    let (mut square, mut count) = (0.0, 0_usize);
    for seed in SEEDS {
        let spec = TwinSpec { seed, ..spec.clone() };
        let mut controller = controller.clone();
        let mut act = |at: &Measured| {
            controller.command(&state(dof, at), &reference(dof, path.at(at.time_s)))[dof.index()]
        };
        let run = close_loop(&spec, dof, RUN_S, &mut act)?;
        let half = run.time_s.len() / 2;
        // Position is dead reckoned: the controller keeps what it is told, so that drift of the
        // sum of velocities is no error of the law.
        for k in half..run.time_s.len() {
            square += (run.measured[k].position - path.at(run.time_s[k])[0]).powi(2);
            count += 1;
        }
    }
    Ok((square / count as f64).sqrt())
}

fn main() -> Result<(), Box<dyn Error>> {
    for (sea, disturbances) in SEAS {
        let disturbances: BTreeSet<_> = Disturbance::parse_list(disturbances)?;
        let spec = TwinSpec { disturbances, ..TwinSpec::jason2() };
        let beliefs = beliefs(&spec)?;
        println!("\n{sea}:\n");
        println!(
            "| axis | path | PD | PID | plant | fixed, exact | fixed, non-exact | adaptive, exact | adaptive, non-exact |"
        );
        println!("|---|---|---|---|---|---|---|---|---|");
        for dof in DOFS {
            table(&spec, dof, &beliefs)?;
        }
    }
    Ok(())
}

fn table(spec: &TwinSpec, dof: Dof, beliefs: &Beliefs) -> Result<(), Box<dyn Error>> {
    let mut actuators = Actuators::default();
    actuators.limit[dof.index()] = Some(spec.force_limit(dof));
    // Equal feedback for all: that of the identified mass.
    let of = |law: Law, adapts: bool| -> Result<_, Box<dyn Error>> {
        let asked = Design {
            law,
            adapts,
            tuning: [(dof, Tuning::new(BANDWIDTH_HZ, DAMPING))].into(),
            sample_hz: SAMPLE_HZ,
            adaptation_s: 30.0,
            ..Design::default()
        };
        Ok((design(&beliefs[0].1[&dof], &[], &actuators, &asked)?, asked.speed))
    };
    for (name, path) in paths(dof) {
        let run = |law: Law, adapts: bool, plant: &Plant| -> Result<String, Box<dyn Error>> {
            let (mut gains, speed) = of(law, adapts)?;
            if law == Law::Exact {
                // Its feedback is M̂ times an acceleration: the same force for every plant.
                let own = plant.mass_matrix()[(0, 0)];
                if let Some(axis) = gains.axes.get_mut(&dof) {
                    axis.mass = own;
                }
            }
            let controller = Controller::new(plant.clone(), gains, &speed);
            let found = error(spec, dof, &path, &controller)?;
            let (scale, unit) = if dof.is_rotation() { (1e3, "mrad") } else { (1e3, "mm") };
            Ok(format!("{:.1} {unit}", scale * found))
        };
        let (pd, pid) =
            (run(Law::Pd, false, &beliefs[0].1[&dof])?, run(Law::Pid, false, &beliefs[0].1[&dof])?);
        for (belief, plants) in beliefs {
            let plant = &plants[&dof];
            println!(
                "| {dof} | {name} | {pd} | {pid} | {belief} | {} | {} | {} | {} |",
                run(Law::Exact, false, plant)?,
                run(Law::NonExact, false, plant)?,
                run(Law::Exact, true, plant)?,
                run(Law::NonExact, true, plant)?,
            );
        }
    }
    Ok(())
}
