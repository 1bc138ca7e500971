//! Fisher information against `pyomo.contrib.doe`, which `reference/make_information_reference.py`
//! runs on a model of its own.
//!
//! Without disturbances, the filter error method is output error from a beginning that is known as well
//! as one sample: the innovations are those of a free simulation, and their information is what
//! Pyomo computes.

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use seaplant::estimate::{Actuator, ExpectedNoise, ExpectedNoises, information};
use seaplant::plant::{Plant, Structure, Symmetry};
use seaplant::quantity::Attitude;
use seaplant::{Dof, Quantity, Timed, TrialRecord, TrialSetup, Vehicle};
use serde_json::Value;

const AXES: [Dof; 3] = [Dof::Surge, Dof::Sway, Dof::Yaw];

/// Disturbances, N and N m, that move the boat by a thousandth of the noise.
const HARDLY: f64 = 1e-3;

/// Pyomo's slopes are central differences of 0.1 %, and the filter's solution is of second order in
/// steps of a fifth of a second.
const SAME: f64 = 0.01;

/// Samples at rest before the reference begins: what thrust did before a log is not known, so that a
/// record leaves out its first 5 %, which these are.
const RESTS: usize = 7;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

#[test]
fn information_agrees_with_pyomo() {
    let text = include_str!("reference/information.json");
    let reference: Value = serde_json::from_str(text).expect("JSON");
    let structure = Structure::of(&AXES, Symmetry::Diagonal).expect("axes");
    let names = structure.names();
    let coefficient = |name: &String| reference["coefficients"][name].as_f64().expect(name);
    let plant = Plant::new(structure, names.iter().map(coefficient).collect()).expect("a plant");
    let step_s = reference["step_s"].as_f64().expect("a step");
    let rows = |key: &str| -> Vec<Vec<f64>> {
        reference[key].as_array().expect("rows").iter().map(numbers).collect()
    };
    let at_rest = |mut rows: Vec<Vec<f64>>| {
        rows.splice(0..0, vec![vec![0.0; AXES.len()]; RESTS]);
        rows
    };
    let (force, velocity) = (at_rest(rows("force")), at_rest(rows("velocity")));
    let first = RESTS as f64;
    let times: Vec<f64> = (0..force.len()).map(|k| step_s * (k as f64 - first)).collect();
    let series = |values: Vec<f64>| Timed::new("reference", times.clone(), values).expect("sorted");
    let column = |of: &[Vec<f64>], k: usize| series(of.iter().map(|row| row[k]).collect());
    let heading = [vec![0.0; RESTS], numbers(&reference["heading"])].concat();
    let heading = series(heading);
    let mut recording = BTreeMap::from([(Quantity::Attitude(Attitude::Heading), heading)]);
    let mut axes = BTreeMap::new();
    for (k, (dof, name)) in AXES.into_iter().zip(["u", "v", "r"]).enumerate() {
        recording.insert(Quantity::Wrench(dof), column(&force, k));
        recording.insert(Quantity::Velocity(dof), column(&velocity, k));
        let std = reference["std"][name].as_f64().expect("a standard deviation");
        let own = ExpectedNoise { disturbance: HARDLY, correlation_s: 10.0, velocity: std };
        axes.insert(dof, own);
    }
    let setup = TrialSetup { name: "reference".to_owned(), ..TrialSetup::default() };
    let record = TrialRecord::new(&setup, &recording, &Vehicle::default(), &AXES);
    let noise = ExpectedNoises { axes, ..ExpectedNoises::default() };
    let found = information(&plant, &Actuator::default(), &noise, &record.expect("a record"));
    let found = found.expect("moves");
    assert_eq!(found.names, names);
    // Pyomo's order is that of its coefficients.
    let own: Vec<String> = ORDER.iter().map(|name| (*name).to_owned()).collect();
    let place = |name: &String| own.iter().position(|own| own == name).expect("a coefficient");
    let theirs = rows("information");
    let theirs = DMatrix::from_fn(names.len(), names.len(), |i, j| {
        theirs[place(&names[i])][place(&names[j])]
    });
    let scale = |i: usize, j: usize| (theirs[(i, i)] * theirs[(j, j)]).sqrt();
    for i in 0..names.len() {
        for j in 0..names.len() {
            let off = (found.matrix[(i, j)] - theirs[(i, j)]) / scale(i, j);
            assert!(off.abs() < SAME, "{} and {}: {off}", names[i], names[j]);
        }
        let inverse = theirs.clone().try_inverse().expect("regular");
        let ratio = (found.covariance()[(i, i)] / inverse[(i, i)]).sqrt();
        assert!((ratio - 1.0).abs() < SAME, "{}: {ratio}", names[i]);
    }
}

/// The coefficients as the script has them.
const ORDER: [&str; 9] = [
    "mass.surge",
    "mass.sway",
    "mass.yaw",
    "surge: u",
    "surge: |u|u",
    "sway: v",
    "sway: |v|v",
    "yaw: r",
    "yaw: |r|r",
];
