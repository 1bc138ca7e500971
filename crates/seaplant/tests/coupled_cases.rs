//! A vehicle driven freely in four axes, whose six axes are coupled, and its truth.

#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use seaplant::plant::{Basis, Symmetry};
use seaplant::quantity::{Attitude, Axis};
use seaplant::{
    CoupledPlan, Dof, IdentifyOptions, Quantity, Recording, Role, Timed, Trial, TrialSetup,
    Vehicle, identify, plant_of_result,
};
use serde_json::Value;

fn cases() -> Option<PathBuf> {
    let usual = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/cases");
    let folder = std::env::var_os("SEAPLANT_CASES").map_or(usual, PathBuf::from);
    let case = folder.join("20-free-driving-six-axes");
    if case.is_dir() {
        return Some(case);
    }
    eprintln!("passed over: no {}; set SEAPLANT_CASES", case.display());
    None
}

fn recording(path: &Path) -> Recording {
    let text = std::fs::read_to_string(path).expect("a log");
    let mut lines = text.lines();
    let names: Vec<String> = lines
        .next()
        .expect("a head")
        .split(',')
        .map(|name| name.split(" (").next().unwrap_or_default().to_owned())
        .collect();
    let mut columns: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for line in lines {
        for (name, cell) in names.iter().zip(line.split(',')) {
            columns.entry(name).or_default().push(cell.parse().expect("a number"));
        }
    }
    let series = |name: &str| {
        Timed::new(name, columns["time"].clone(), columns[name].clone()).expect("valid")
    };
    let mut recording = Recording::new();
    for dof in [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw] {
        recording.insert(Quantity::Wrench(dof), series(&format!("w_{dof}")));
    }
    for dof in [Dof::Surge, Dof::Sway, Dof::Heave] {
        recording.insert(Quantity::Velocity(dof), series(&format!("v_{dof}")));
    }
    for (axis, name) in [(Axis::X, "v_roll"), (Axis::Y, "v_pitch"), (Axis::Z, "v_yaw")] {
        recording.insert(Quantity::Rate(axis), series(name));
    }
    for (angle, name) in
        [(Attitude::Roll, "roll"), (Attitude::Pitch, "pitch"), (Attitude::Heading, "heading")]
    {
        recording.insert(Quantity::Attitude(angle), series(name));
    }
    recording
}

fn trial(case: &Path, name: &str, role: Role) -> Trial {
    let coupled = vec![Dof::ALL.to_vec()];
    let setup = TrialSetup { name: name.to_owned(), role, coupled, ..TrialSetup::default() };
    let recording = recording(&case.join(format!("{name}.csv")));
    Trial::new(setup, &recording, &Vehicle::default()).expect("complete")
}

fn truth(case: &Path) -> Value {
    let text = std::fs::read_to_string(case.join("truth.json")).expect("the truth");
    serde_json::from_str(&text).expect("JSON")
}

/// The true value of a term; zero of one that the vehicle does not have.
fn true_value(truth: &Value, term: &Basis) -> f64 {
    let at =
        |name: &str, i: Dof, j: Dof| truth[name][i.index()][j.index()].as_f64().expect("a number");
    let number = |name: &str| truth[name].as_f64().expect("a number");
    match term {
        Basis::Mass(i, j) => at("mass_matrix", *i, *j),
        Basis::Product(on, product) => match product.factors().collect::<Vec<_>>()[..] {
            [of] => at("linear_damping", *on, of.of),
            [modulus, of] if modulus.of == of.of => at("quadratic_damping_on_abs_v_v", *on, of.of),
            _ => 0.0,
        },
        Basis::WeightExcess => number("weight_N") - number("buoyancy_N"),
        Basis::Lever(axis) => {
            let moment = |weight: &str, centre: &str| {
                number(weight) * truth[centre][*axis].as_f64().expect("a number")
            };
            moment("weight_N", "centre_of_gravity_m") - moment("buoyancy_N", "centre_of_buoyancy_m")
        }
        Basis::One(_) => 0.0,
    }
}

/// Every coefficient is within this part of the truth, which linear and quadratic damping share
/// out between them, or the truth in its interval widened …
const PART: f64 = 0.03;
/// … to so many standard deviations: of thirty intervals some do not hold it.
const DEVIATIONS: f64 = 3.5;

/// The true plant reaches 0.999 in surge.
const LEAST_R2: f64 = 0.9;

#[test]
fn translations_of_a_freely_driven_vehicle_are_near_the_truth() {
    let Some(case) = cases() else { return };
    let trials = [("a", Role::Fit), ("b", Role::Fit), ("c", Role::Fit), ("t", Role::HoldOut)]
        .map(|(name, role)| trial(&case, name, role));
    let plan = CoupledPlan {
        axes: Dof::ALL.to_vec(),
        symmetry: Symmetry::PortStarboard,
        terms: Vec::new(),
        search: true,
    };
    let options = IdentifyOptions { coupled: vec![plan], ..IdentifyOptions::default() };
    let results = identify(&Vehicle::default(), &trials, &options).results;
    let plant = &results.coupled["surge-sway-heave-roll-pitch-yaw"];
    let truth = truth(&case);
    // What turns is not held to this yet: see the changelog.
    let of_translation =
        |name: &str| ["surge", "sway", "heave"].iter().any(|of| name.starts_with(of));
    for (name, found) in plant.parameters.iter().filter(|(name, _)| of_translation(name)) {
        let term = plant_of_result(plant).expect("a plant");
        let mut terms = term.structure().terms().iter();
        let term = terms.find(|term| term.to_string() == *name).expect("there");
        let expected = true_value(&truth, term);
        let off = (found.value - expected).abs();
        let is_near = off < PART * expected.abs() || off < DEVIATIONS * found.std;
        assert!(is_near, "{name}: {} ± {}, {expected}", found.value, found.std);
    }
    let held = plant.hold_out.as_ref().expect("a held-out trial");
    let surge = held.by_axis[&Dof::Surge].r2.expect("bounded");
    assert!(surge > LEAST_R2, "{surge}");
}
