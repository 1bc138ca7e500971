//! A vehicle driven freely in four axes, whose six axes are coupled, and its truth.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use nalgebra::Vector6;
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::{Basis, Plant, Product, Structure, Symmetry};
use seaplant::quantity::{Attitude, Axis};
use seaplant::{
    Dof, IdentifyOptions, PlantPlan, Quantity, Recording, Role, Timed, Trial, TrialRecord,
    TrialSetup, Vehicle, identify, plant_of_result,
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
    let together = vec![Dof::ALL.to_vec()];
    let setup = TrialSetup { name: name.to_owned(), role, together, ..TrialSetup::default() };
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
        Basis::One(_) | Basis::Effect(_) => 0.0,
    }
}

/// The true plant, with the terms of a fitted one and those that it lacks.
fn true_plant(truth: &Value, fitted: &Structure) -> Plant {
    let of_damping = |on: Dof, of: Dof| {
        [Product::linear(of), Product::quadratic(of)].map(|product| Basis::Product(on, product))
    };
    let pairs = Dof::ALL.into_iter().flat_map(|on| Dof::ALL.map(|of| (on, of)));
    let mut structure = fitted.clone();
    for term in pairs.flat_map(|(on, of)| of_damping(on, of)) {
        if structure.index_of(&term).is_none() && true_value(truth, &term) != 0.0 {
            structure = structure.with(term).expect("six axes");
        }
    }
    let coefficients = structure.terms().iter().map(|term| true_value(truth, term)).collect();
    Plant::new(structure, coefficients).expect("possible")
}

/// R² by axis of a plant that is simulated freely over a trial.
fn r2(plant: &Plant, record: &TrialRecord, current: [f64; 2]) -> [f64; 6] {
    let velocity = |dof: Dof| record.velocity[dof.index()].as_ref().expect("measured");
    let inputs = Inputs {
        force: record.force.clone(),
        velocity: record.velocity.clone(),
        attitude: record.attitude.clone(),
        current,
        signals: record.signals.clone(),
        wind: None,
        known: Vec::new(),
    };
    let start = Vector6::from_fn(|k, _| velocity(Dof::ALL[k]).values()[0]);
    let times = velocity(Dof::Surge).time_s();
    let model = simulate(plant, &inputs, &start, times).expect("bounded").velocity;
    Dof::ALL.map(|dof| {
        let y = velocity(dof).values();
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let missed = y.iter().zip(&model).map(|(y, v)| (y - v[dof.index()]).powi(2)).sum::<f64>();
        1.0 - missed / y.iter().map(|y| (y - mean).powi(2)).sum::<f64>()
    })
}

/// Every coefficient is within this part of the truth …
const PART: f64 = 0.03;
/// … or the truth within so many standard deviations: of thirty 95 % intervals some do not
/// hold it, of thirty of 99.7 % all do.
const DEVIATIONS: f64 = 3.0;

/// The plant predicts a held-out trial as well as the truth does, but for this much of R².
const BEHIND: f64 = 0.01;

/// The couplings in damping that the vehicle has and the trials tell.
const COUPLINGS: [&str; 3] = ["pitch: u", "sway: |r|r", "yaw: |v|v"];

#[test]
fn a_freely_driven_vehicle_comes_out_whole() {
    let Some(case) = cases() else { return };
    let trials = [("a", Role::Fit), ("b", Role::Fit), ("c", Role::Fit), ("t", Role::HoldOut)]
        .map(|(name, role)| trial(&case, name, role));
    let plan = PlantPlan {
        axes: Dof::ALL.to_vec(),
        symmetry: Symmetry::PortStarboard,
        model: None,
        terms: Vec::new(),
        effects: Vec::new(),
        hold: Default::default(),
        search: true,
    };
    let options = IdentifyOptions { together: vec![plan], ..IdentifyOptions::default() };
    let results = identify(&Vehicle::default(), &trials, &options).results;
    let plant = &results.plants["surge-sway-heave-roll-pitch-yaw"];
    let truth = truth(&case);
    let fitted = plant_of_result(plant).expect("a plant");
    for (term, value) in fitted.structure().terms().iter().zip(fitted.coefficients()) {
        let (expected, std) = (true_value(&truth, term), plant.parameters[&term.to_string()].std);
        let off = (value - expected).abs();
        let is_near = off < PART * expected.abs() || off < DEVIATIONS * std;
        assert!(is_near, "{term}: {value} ± {std}, {expected}");
    }
    for coupling in COUPLINGS {
        assert!(plant.parameters.contains_key(coupling), "{coupling} is not found");
    }
    let current: Vec<f64> =
        ["north", "east"].map(|way| plant.nuisances[&format!("current {way}: a")].value).to_vec();
    for (found, expected) in current.iter().zip([0.08, -0.05]) {
        assert!((found - expected).abs() < 0.002, "{current:?}");
    }
    let held = plant.hold_out.as_ref().expect("a held-out trial");
    let record = trials[3].record(&Dof::ALL).expect("complete");
    let best = r2(&true_plant(&truth, fitted.structure()), record, [0.08, -0.05]);
    for (dof, best) in Dof::ALL.into_iter().zip(best) {
        let found = held.by_axis[&dof].r_squared.expect("bounded");
        assert!(found > best - BEHIND, "{dof}: R² {found}, the truth's {best}");
    }
}
