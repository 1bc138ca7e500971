//! Tracking errors of controllers on the Jason 2 twin, as a page in Markdown: `cargo run -p
//! seaplant-control --example tracking > docs/src/control-on-the-twin.md`.
#![allow(clippy::print_stdout, reason = "the program prints; that is what it is for")]

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::path::Path as FilePath;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use seaplant::plant::{Basis, Plant, Product, Structure, Symmetry};
use seaplant::twin::{Disturbance, Measured, TwinSpec, close_loop, make};
use seaplant::{Dof, IdentifyOptions, Method, PhysicalParameters, identify};
use seaplant_campaign::read_plant_file;
use seaplant_control::{
    Actuators, Controller, Design, Law, Path, Reference, Sea, State, Tuning, design, track,
};

const DOFS: [Dof; 4] = [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw];

/// Disturbances of the twin during identification and during control.
const SEAS: [(&str, &str); 2] =
    [("Calm", "none"), ("Tether, current, lag, delay", "tether,current,lag,delay")];

/// Natural frequency of every loop, Hz, its damping, and its sample rate, Hz.
const BANDWIDTH_HZ: f64 = 0.06;
const DAMPING: f64 = 1.0;
const SAMPLE_HZ: f64 = 10.0;

/// Duration of each run, s; errors are those of its second half, 180 s.
const RUN_S: f64 = 360.0;

/// Seeds over which errors are averaged.
const SEEDS: [u64; 5] = [11, 12, 13, 14, 15];

/// Interval between steps in either direction, s.
const STEP_EVERY_S: f64 = 45.0;

/// The sine of [Jason2, table 4] in heave.
const SINE_RAD_S: f64 = 0.3925;

/// Reference motion.
#[derive(Clone, Copy)]
enum Task {
    Sine,
    Steps,
    Hold,
}

impl Task {
    const ALL: [Self; 3] = [Self::Sine, Self::Steps, Self::Hold];

    fn name(self) -> &'static str {
        match self {
            Self::Sine => "sine",
            Self::Steps => "steps",
            Self::Hold => "hold",
        }
    }

    /// Returns displacement and its first and second derivative.
    fn at(self, dof: Dof, t: f64) -> [f64; 3] {
        let size = if dof.is_rotation() { 0.3 } else { 0.5 };
        match self {
            Self::Sine => Path::Sine { amplitude: size, rate: SINE_RAD_S }.at(t),
            Self::Hold => Path::Hold.at(t),
            Self::Steps => {
                let mut sum = [0.0; 3];
                for k in 0..=(t / STEP_EVERY_S) as usize {
                    let there = if k % 2 == 0 { 2.0 * size } else { -2.0 * size };
                    let step = Path::Step { size: there, rate: SINE_RAD_S };
                    let at = step.at(t - STEP_EVERY_S * k as f64);
                    sum.iter_mut().zip(at).for_each(|(sum, x)| *sum += x);
                }
                sum
            }
        }
    }
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

/// Models of the vehicle: their names and the plant of each axis.
type Beliefs = Vec<(&'static str, BTreeMap<Dof, Plant>)>;

fn beliefs(spec: &TwinSpec) -> Result<Beliefs, Box<dyn Error>> {
    let dive = make(spec)?;
    let trials = dive.trials.iter().map(|log| log.trial(&dive));
    let trials = trials.collect::<Result<Vec<_>, _>>()?;
    let methods = vec![Method::FilterError, Method::Paper];
    let options = IdentifyOptions { methods, subsets: false, ..IdentifyOptions::default() };
    let found = identify(&dive.vehicle, &trials, &options).results;
    let by = |method: Method| -> Result<BTreeMap<Dof, Plant>, Box<dyn Error>> {
        let of = |dof: Dof| {
            let own = found.plant_of(dof, Some(method))?.alone.as_ref().ok_or("of several axes")?;
            Ok((dof, plant(dof, &own.lumped.to_physical())?))
        };
        DOFS.into_iter().map(of).collect()
    };
    let table = read_plant_file(FilePath::new("published:rexrov"))?.ok_or("no such table")?;
    let table = table.model()?;
    let other = |dof: Dof| {
        let single = table.one_axis(dof).ok_or("not in the table")?;
        Ok((dof, plant(dof, &PhysicalParameters { bias_force: 0.0, ..single })?))
    };
    let other: Result<BTreeMap<Dof, Plant>, Box<dyn Error>> = DOFS.into_iter().map(other).collect();
    Ok(vec![
        ("identified", by(Method::FilterError)?),
        ("the paper's", by(Method::Paper)?),
        ("RexROV's", other?),
    ])
}

/// Converts one axis to a pose of the vehicle.
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

/// A closed loop on the twin.
struct Loop<'a> {
    spec: &'a TwinSpec,
    dof: Dof,
    /// Plant for which gains are designed.
    gains_for: &'a Plant,
}

impl Loop<'_> {
    /// Creates a controller with a model plant and the feedback gains for the identified mass: ω
    /// and ζ are those that give the same K_p and K_d with its own mass.
    fn controller(
        &self,
        law: Law,
        adapts: bool,
        plant: &Plant,
    ) -> Result<Controller, Box<dyn Error>> {
        let part = (self.gains_for.mass_matrix()[(0, 0)] / plant.mass_matrix()[(0, 0)]).sqrt();
        let mut actuators = Actuators::default();
        actuators.limit[self.dof.index()] = Some(self.spec.force_limit(self.dof));
        let asked = Design {
            law,
            adapts,
            tuning: [(self.dof, Tuning::new(BANDWIDTH_HZ * part, DAMPING * part))].into(),
            sample_hz: SAMPLE_HZ,
            adaptation_s: 30.0,
            anyway: true,
            ..Design::default()
        };
        let gains = design(plant, &[], &actuators, &asked)?;
        Ok(Controller::new(plant.clone(), gains, &asked.speed))
    }

    /// Returns the error of the second half, RMS over seeds, mm or mrad.
    fn error(&self, task: Task, controller: &Controller) -> Result<f64, Box<dyn Error>> {
        let (mut square, mut count) = (0.0, 0_usize);
        let dof = self.dof;
        for seed in SEEDS {
            let spec = TwinSpec { seed, ..self.spec.clone() };
            let mut controller = controller.clone();
            let mut act = |at: &Measured| {
                let to = reference(dof, task.at(dof, at.time_s));
                controller.command(&state(dof, at), &to)[dof.index()]
            };
            let run = close_loop(&spec, dof, RUN_S, &mut act)?;
            let half = run.time_s.len() / 2;
            // Position is dead reckoned: the controller tracks its own estimate, so that drift of
            // integrated velocity does not count as an error of the law.
            for k in half..run.time_s.len() {
                square += (run.measured[k].position - task.at(dof, run.time_s[k])[0]).powi(2);
                count += 1;
            }
        }
        Ok(1e3 * (square / count as f64).sqrt())
    }
}

/// Errors of one axis and task: PD, PID, then fixed and adaptive control with each model.
struct Row {
    dof: Dof,
    task: Task,
    feedback: [f64; 2],
    model: Vec<[f64; 2]>,
}

fn rows(spec: &TwinSpec, law: Law, beliefs: &Beliefs) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for dof in DOFS {
        let gains_for = &beliefs[0].1[&dof];
        let of = Loop { spec, dof, gains_for };
        for task in Task::ALL {
            let run =
                |law, adapts, plant: &Plant| of.error(task, &of.controller(law, adapts, plant)?);
            let feedback = [run(Law::Pd, false, gains_for)?, run(Law::Pid, false, gains_for)?];
            let both = |(_, plants): &(&str, BTreeMap<Dof, Plant>)| -> Result<_, Box<dyn Error>> {
                Ok([run(law, false, &plants[&dof])?, run(law, true, &plants[&dof])?])
            };
            let model = beliefs.iter().map(both).collect::<Result<_, _>>()?;
            rows.push(Row { dof, task, feedback, model });
        }
    }
    Ok(rows)
}

fn print_table(beliefs: &Beliefs, rows: &[Row]) {
    let names: String =
        beliefs.iter().map(|(name, _)| format!(" {name}, fixed | {name}, adaptive |")).collect();
    println!("| | | PD | PID |{names}");
    println!("|---|---|--:|--:|{}", "--:|--:|".repeat(beliefs.len()));
    for row in rows {
        let unit = if row.dof.is_rotation() { "mrad" } else { "mm" };
        let all = row.feedback.iter().chain(row.model.iter().flatten());
        let cells: String = all.map(|x| format!(" {x:.1} |")).collect();
        println!("| {}, {unit} | {} |{cells}", row.dof, row.task.name());
    }
}

/// Returns the geometric mean over axes of the ratio of two errors.
fn ratio(rows: &[Row], task: Task, of: impl Fn(&Row) -> [f64; 2]) -> f64 {
    let own = rows.iter().filter(|row| row.task.name() == task.name());
    let logs: Vec<f64> = own.map(|row| (of(row)[0] / of(row)[1]).ln()).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

fn print_claims(beliefs: &Beliefs, (sea, law): (&str, Law), rows: &[Row]) {
    for task in Task::ALL {
        for (k, (name, _)) in beliefs.iter().enumerate() {
            let by_pd = ratio(rows, task, |row| [row.model[k][0], row.feedback[0]]);
            let by_pid = ratio(rows, task, |row| [row.model[k][0], row.feedback[1]]);
            let adapts = ratio(rows, task, |row| [row.model[k][1], row.model[k][0]]);
            let cells = format!("{by_pd:.2} | {by_pid:.2} | {adapts:.2}");
            println!("| {sea} | {} | {} | {name} | {cells} |", law.name(), task.name());
        }
    }
}

const INTRODUCTION: &str = "\
# Controllers on the twin

<!-- Made by: cargo run -p seaplant-control --example tracking > docs/src/control-on-the-twin.md -->

These tables show the tracking error of the Jason 2 [twin](twin.md), RMS over the second half of six minutes and
over five seeds, in mm and mrad. The simulation includes thrusters with limits and jitter, and the instruments.
Position is dead reckoned, and the error is that of the position that the controller receives. Each axis has a
control loop of 0.06 Hz with ζ = 1 at 10 Hz, designed for the identified mass; all laws have the same feedback.
The paths are a sine of 0.5 m (0.3 rad) at 0.3925 rad/s, as in the paper's heave trial; steps of 1 m (0.6 rad)
back and forth every 45 s; and station keeping (hold).

The model-based controllers use one of three plants: the identified plant (filter error on the twin's own trials
with the same disturbances); the plant that the paper's method finds from the same trials, whose mass is the
true mass times";

const REMAKE: &str = "\
This command regenerates the page, in about a minute:

```text
cargo run -p seaplant-control --example tracking > docs/src/control-on-the-twin.md
```";

/// Formats `2.0 in surge, 1.1 in sway …`.
fn biases(spec: &TwinSpec, beliefs: &Beliefs) -> String {
    let of = |dof: &Dof| {
        let bias = beliefs[1].1[dof].mass_matrix()[(0, 0)] / spec.plants[dof].mass;
        format!("{bias:.2} in {dof}")
    };
    DOFS.iter().map(of).collect::<Vec<_>>().join(", ")
}

const SIX_AXES: &str = "
## Six axes at once

The published BlueROV2 Heavy, with a control loop of 0.2 Hz at 20 Hz in all axes, follows sines of 0.4 to 0.5 m and
0.8 rad in four axes at once. The thrusters have a lag of 0.1 s; the noise is 2 mm and 3 mm/s. The table shows the RMS
error over the last third of 300 s. \"Wrong\" is a plant with twice the masses and twice the damping; the time
constant of adaptation is 20 s.
";

/// Returns the vehicle with other masses and damping, and its own weight and righting moment.
fn heavier(plant: &Plant, by: f64) -> Result<Plant, seaplant::Error> {
    let terms = plant.structure().terms().iter().zip(plant.coefficients());
    let moved = terms.map(|(term, x)| match term {
        Basis::WeightExcess | Basis::Lever(_) => *x,
        _ => by * x,
    });
    Plant::new(plant.structure().clone(), moved.collect())
}

/// Returns the error of each driven axis in the last third, mm and mrad; `None` if the loop
/// diverges.
fn six_axes_error(
    truth: &Plant,
    believed: &Plant,
    law: Law,
    adapts: bool,
) -> Result<Option<[f64; 4]>, Box<dyn Error>> {
    let tuning = Dof::ALL.map(|dof| (dof, Tuning::new(0.2, 1.0))).into();
    let (sample_hz, adaptation_s) = (20.0, 20.0);
    let asked = Design { law, adapts, tuning, sample_hz, adaptation_s, ..Design::default() };
    let actuators = Actuators { lag_s: [0.1; 6], ..Actuators::default() };
    let gains = design(truth, &[], &actuators, &asked)?;
    let mut controller = Controller::new(believed.clone(), gains, &asked.speed);
    let sine = |amplitude, rate| Path::Sine { amplitude, rate };
    let paths = [
        (Dof::Surge, sine(0.5, 0.6)),
        (Dof::Sway, sine(0.5, 0.45)),
        (Dof::Heave, sine(0.4, 0.5)),
        (Dof::Yaw, sine(0.8, 0.35)),
    ];
    let sea = Sea { velocity_noise: 0.003, position_noise: 0.002, seed: 1, ..Sea::default() };
    let run = match track(truth, &mut controller, &actuators, &paths.into(), &sea, 300.0) {
        Ok(run) => run,
        Err(seaplant_control::Error::Setting { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    };
    let late = &run.error[2 * run.error.len() / 3..];
    let rms = |dof: Dof| {
        let square: f64 = late.iter().map(|e| e[dof.index()].powi(2)).sum();
        1e3 * (square / late.len() as f64).sqrt()
    };
    Ok(Some(DOFS.map(rms)))
}

fn print_six_axes() -> Result<(), Box<dyn Error>> {
    let name = FilePath::new("published:bluerov2-heavy-von-benzon-2022");
    let truth = read_plant_file(name)?.ok_or("no such table")?.model()?.plant;
    let wrong = heavier(&truth, 2.0)?;
    println!("{SIX_AXES}");
    println!("| law | plant | surge, mm | sway, mm | heave, mm | yaw, mrad |");
    println!("|---|---|--:|--:|--:|--:|");
    for law in [Law::Pd, Law::Pid, Law::Exact, Law::NonExact, Law::SlotineLi] {
        for (plant, believed) in [("right", &truth), ("wrong", &wrong)] {
            for (how, adapts) in [("fixed", false), ("adaptive", true)] {
                if law.is_model_based() || (plant == "right" && !adapts) {
                    let plant = match law.is_model_based() {
                        true => format!("{plant}, {how}"),
                        false => "none".to_owned(),
                    };
                    let errors = six_axes_error(&truth, believed, law, adapts)?;
                    let cells = match errors {
                        Some(errors) => errors.map(|x| format!(" {x:.1} |")).concat(),
                        None => " diverges |".repeat(DOFS.len()),
                    };
                    println!("| {} | {plant} |{cells}", law.name());
                }
            }
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut claims = Vec::new();
    for (k, (sea, disturbances)) in SEAS.into_iter().enumerate() {
        let disturbances: BTreeSet<_> = Disturbance::parse_list(disturbances)?;
        let spec = TwinSpec { disturbances, ..TwinSpec::jason2() };
        let beliefs = beliefs(&spec)?;
        if k == 0 {
            println!(
                "{INTRODUCTION}\n{}; and the published table of another",
                biases(&spec, &beliefs)
            );
            println!("vehicle, RexROV.\n\n{REMAKE}");
        }
        for law in [Law::NonExact, Law::Exact] {
            let rows = rows(&spec, law, &beliefs)?;
            println!("\n## {sea}, {}\n", law.name());
            print_table(&beliefs, &rows);
            claims.push((sea, law, rows));
        }
        if k + 1 == SEAS.len() {
            println!("\n## Benefit of a model\n");
            println!("Ratios of the errors above, as geometric means over the four axes.\n");
            println!("| sea | law | path | plant | fixed / PD | fixed / PID | adaptive / fixed |");
            println!("|---|---|---|---|--:|--:|--:|");
            for (sea, law, rows) in &claims {
                print_claims(&beliefs, (sea, *law), rows);
            }
        }
    }
    print_six_axes()
}
