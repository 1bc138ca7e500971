//! Intervals of output error on a boat with a rudder, under gusts that last: they hold the truth
//! about as often as they say.

use std::collections::BTreeMap;

use nalgebra::Vector6;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use seaplant::estimate::fit_plant_freely;
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::{Plant, Signal, Structure, Symmetry};
use seaplant::quantity::{Attitude, Axis};
use seaplant::{
    Dof, Estimate, Fin, PlantPlan, QuadraticThrust, Quantity, Recording, Role, Surface,
    ThrustCurve, Thruster, ThrusterInput, Timed, Trial, TrialRecord, TrialSetup, Vehicle,
};

const AXES: [Dof; 3] = [Dof::Surge, Dof::Sway, Dof::Yaw];
const THRUST: f64 = 0.02;
const PERIOD_S: f64 = 0.2;
const LENGTH_S: f64 = 120.0;

/// Standard deviations of the gusts, N and N m, a tenth of what drives the boat, and how long one
/// lasts.
const GUSTS: [f64; 3] = [4.0, 4.0, 2.0];
const GUST_S: f64 = 8.0;

/// Noise of velocities, m/s, and of yaw rate, rad/s.
const NOISE: [f64; 2] = [0.01, 0.003];

const TRUTH: [(&str, f64); 12] = [
    ("mass.surge", 85.0),
    ("mass.sway", 150.0),
    ("mass.sway-yaw", 10.0),
    ("mass.yaw", 40.0),
    ("surge: u", 40.0),
    ("surge: |u|u", 15.0),
    ("sway: v", 120.0),
    ("sway: |v|v", 200.0),
    ("yaw: r", 45.0),
    ("yaw: |r|r", 150.0),
    ("rudder.lift", 45.0),
    ("rudder.slipstream", 0.5),
];

fn boat() -> (Vehicle, Structure) {
    let law = QuadraticThrust { forward: THRUST, reverse: THRUST, ..Default::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let propeller = Thruster::new("propeller", [-0.9, 0.0, 0.0], [1.0, 0.0, 0.0], curve);
    let rudder = Fin::new(Surface::Rudder, "rudder", [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let rudder = Fin { slipstream: Some("propeller".into()), ..rudder.expect("a rudder") };
    let vehicle = Vehicle {
        thrusters: vec![propeller.expect("a thruster")],
        fins: vec![rudder],
        ..Vehicle::default()
    };
    let plan = PlantPlan {
        axes: AXES.to_vec(),
        symmetry: Symmetry::PortStarboard,
        model: None,
        terms: Vec::new(),
        effects: Vec::new(),
        hold: BTreeMap::new(),
        search: false,
    };
    let structure = plan.structure(&vehicle, |signal| !signal.is_of_wind()).expect("a structure");
    (vehicle, structure)
}

fn truth(structure: &Structure) -> Plant {
    let of = |name: String| TRUTH.iter().find(|(known, _)| *known == name).expect("known").1;
    let coefficients = structure.names().into_iter().map(of).collect();
    Plant::new(structure.clone(), coefficients).expect("a body")
}

/// A drive with orders and gusts of its own.
fn record(name: &str, seed: u64) -> TrialRecord {
    let (vehicle, structure) = boat();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let times: Vec<f64> =
        (0..(LENGTH_S / PERIOD_S) as usize).map(|k| PERIOD_S * k as f64).collect();
    let series = |values: Vec<f64>| Timed::new("log", times.clone(), values).expect("valid");
    let mut orders = |low: f64, high: f64, quickly: f64| {
        let (mut order, mut now, mut until) = (0.0, 0.0, 0.0);
        let of = |t: &f64| {
            if *t >= until {
                order = random.random_range(low..high);
                until = t + random.random_range(3.0..12.0);
            }
            now += (order - now).clamp(-quickly, quickly);
            now
        };
        times.iter().map(of).collect::<Vec<f64>>()
    };
    let (shaft, angle) = (orders(30.0, 90.0, 20.0), orders(-0.6, 0.6, 0.12));
    let mut draw = |std: f64| std * random.sample::<f64, _>(StandardNormal);
    let fade = (-PERIOD_S / GUST_S).exp();
    let gusts = GUSTS.map(|std| {
        let mut gust = draw(std);
        let mut next = || {
            gust = fade * gust + draw(std) * (1.0 - fade * fade).sqrt();
            gust
        };
        times.iter().map(|_| next()).collect::<Vec<f64>>()
    });
    let pushed = shaft.iter().zip(&gusts[0]).map(|(n, gust)| THRUST * n * n + gust).collect();
    let drive = series(shaft.iter().map(|n| THRUST * n * n).collect());
    let mut inputs = Inputs {
        signals: BTreeMap::from([
            (Signal::Angle { kind: Surface::Rudder, name: "rudder".into() }, series(angle.clone())),
            (Signal::Drive("propeller".into()), drive),
            (Signal::PropellerSpeed("propeller".into()), series(shaft.clone())),
        ]),
        ..Inputs::default()
    };
    for (dof, force) in AXES.into_iter().zip([pushed, gusts[1].clone(), gusts[2].clone()]) {
        inputs.force[dof.index()] = Some(series(force));
    }
    let start = Vector6::new(0.8, 0.0, 0.0, 0.0, 0.0, 0.0);
    let moved = simulate(&truth(&structure), &inputs, &start, &times).expect("bounded");
    let mut log = |axis: usize, std: f64| {
        series(moved.velocity.iter().map(|x| x[axis] + draw(std)).collect())
    };
    let recording = Recording::from([
        (Quantity::Velocity(Dof::Surge), log(0, NOISE[0])),
        (Quantity::Velocity(Dof::Sway), log(1, NOISE[0])),
        (Quantity::Rate(Axis::Z), log(5, NOISE[1])),
        (
            Quantity::Attitude(Attitude::Heading),
            series(moved.attitude.iter().map(|x| x[2]).collect()),
        ),
        (Quantity::SurfaceAngle { kind: Surface::Rudder, name: "rudder".into() }, series(angle)),
        (
            Quantity::Thruster { name: "propeller".into(), input: ThrusterInput::Speed },
            series(shaft),
        ),
    ]);
    let together = vec![AXES.to_vec()];
    let setup =
        TrialSetup { name: name.to_owned(), role: Role::Fit, together, ..TrialSetup::default() };
    let trial = Trial::new(setup, &recording, &vehicle).expect("complete");
    trial.record(&AXES).expect("complete").clone()
}

const DRAWS: u64 = 20;

#[test]
fn intervals_hold_under_gusts_that_last() {
    let structure = boat().1;
    let mut held: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
    for draw in 0..DRAWS {
        let records = [record("a", 10 * draw), record("b", 10 * draw + 1)];
        let records: Vec<&TrialRecord> = records.iter().collect();
        let fit = fit_plant_freely(&structure, &records, None, false).expect("a plant");
        for (name, truth) in TRUTH {
            let term = structure.term_named(name).expect("known");
            let (value, std) =
                (fit.plant.coefficient(&term).expect("fitted"), fit.std(&term).expect("fitted"));
            let x = Estimate::new(value, std, fit.samples as f64);
            let sum = held.entry(name).or_default();
            sum.0 += usize::from((x.low95..=x.high95).contains(&truth));
            sum.1 += (value - truth) / std / DRAWS as f64;
        }
    }
    let all: usize = held.values().map(|(count, _)| count).sum();
    let part = all as f64 / (DRAWS as usize * TRUTH.len()) as f64;
    assert!((LEAST..=MOST).contains(&part), "{part:.3}: {held:?}");
}

/// Of 240 intervals, by draws that are twenty.
const LEAST: f64 = 0.86;
const MOST: f64 = 0.995;
