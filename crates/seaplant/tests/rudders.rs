//! Plants with rudders, propellers of unknown strength and wind come back from their motion.

use std::collections::BTreeMap;

use nalgebra::Vector6;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::{Plant, Signal, Symmetry};
use seaplant::quantity::{Attitude, Axis, WindFrame, WindPart};
use seaplant::results::{CoupledPlant, Results, ToldBy};
use seaplant::{
    CoupledPlan, Dof, Fin, IdentifyOptions, Quantity, QuadraticThrust, Recording, Role, Surface,
    ThrustCurve, Thruster, ThrusterInput, Timed, Trial, TrialSetup, Vehicle, identify,
};

const AXES: [Dof; 3] = [Dof::Surge, Dof::Sway, Dof::Yaw];

/// A ship model of three metres.
fn ship(known_thrust: bool) -> Vehicle {
    let strength = if known_thrust { THRUST } else { 1.0 };
    let law = QuadraticThrust { forward: strength, reverse: strength, ..Default::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let propeller = Thruster::new("propeller", [-1.5, 0.0, 0.0], [1.0, 0.0, 0.0], curve);
    let propeller = propeller.expect("a thruster");
    let rudder = Fin::new(Surface::Rudder, "rudder", [-1.5, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let rudder = Fin { slipstream: Some("propeller".into()), ..rudder.expect("a rudder") };
    let (thrusters, propellers) =
        if known_thrust { (vec![propeller], vec![]) } else { (vec![], vec![propeller]) };
    Vehicle { thrusters, propellers, fins: vec![rudder], ..Vehicle::default() }
}

const THRUST: f64 = 0.004;

const TRUTH: [(&str, f64); 17] = [
    ("mass.surge", 260.0),
    ("mass.sway", 420.0),
    ("mass.sway-yaw", 12.0),
    ("mass.yaw", 180.0),
    ("surge: u", 2.0),
    ("surge: |u|u", 15.0),
    ("sway: v", 60.0),
    ("sway: |v|v", 150.0),
    ("yaw: r", 90.0),
    ("yaw: |r|r", 60.0),
    ("sway: r", 25.0),
    ("propeller.thrust", THRUST),
    ("rudder.lift", 60.0),
    ("rudder.slipstream", 0.01),
    ("wind.surge", 0.05),
    ("wind.sway", 0.4),
    ("wind.yaw", 0.2),
];

fn plan(hold: &[(&str, f64)], effects: &[&str]) -> CoupledPlan {
    CoupledPlan {
        axes: AXES.to_vec(),
        symmetry: Symmetry::PortStarboard,
        terms: vec!["sway: r".parse().expect("a term")],
        effects: effects.iter().map(ToString::to_string).collect(),
        hold: hold.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        search: true,
    }
}

fn truth() -> Plant {
    let effects = ["wind.surge", "wind.sway", "wind.yaw"];
    let structure = plan(&[], &effects).structure(&ship(false), |_| true).expect("a structure");
    let terms = structure.terms().iter();
    let dropped: Vec<String> = terms
        .map(|term| structure.name_of(term))
        .filter(|name| !TRUTH.iter().any(|(known, _)| known == name))
        .collect();
    assert_eq!(dropped, Vec::<String>::new());
    let value = |name: String| TRUTH.iter().find(|(known, _)| *known == name).expect("known").1;
    let coefficients = structure.names().into_iter().map(value).collect();
    Plant::new(structure, coefficients).expect("possible")
}

/// A drive of ten minutes, its rudder turned every few seconds, its speed now and then.
fn inputs(seed: u64, times: &[f64]) -> BTreeMap<Signal, Timed> {
    let phase = seed as f64;
    let of = |f: &dyn Fn(f64) -> f64| {
        Timed::new("input", times.to_vec(), times.iter().map(|t| f(*t)).collect()).expect("valid")
    };
    let rudder = |t: f64| {
        let turn = (0.21 * t + phase).sin() + (0.09 * t + 2.0 * phase).sin();
        (1.5 * turn).clamp(-1.0, 1.0) * 0.5
    };
    let speed = |t: f64| 55.0 + 20.0 * (0.05 * t + phase).sin().signum();
    BTreeMap::from([
        (Signal::Angle { kind: Surface::Rudder, name: "rudder".into() }, of(&rudder)),
        (Signal::Drive("propeller".into()), of(&speed)),
        (Signal::AirForward, of(&|t| 4.0 * (0.03 * t + phase).cos())),
        (Signal::AirStarboard, of(&|t| 4.0 * (0.045 * t + phase).sin())),
    ])
}

fn trial(name: &str, role: Role, seed: u64, vehicle: &Vehicle, with_wind: bool) -> Trial {
    let times: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
    let signals = inputs(seed, &times);
    let driven = Inputs { signals: signals.clone(), ..Inputs::default() };
    let start = Vector6::new(0.8, 0.0, 0.0, 0.0, 0.0, 0.0);
    let motion = simulate(&truth(), &driven, &start, &times).expect("bounded");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut measured = |f: &dyn Fn(usize) -> f64, std: f64| {
        let noise = Normal::new(0.0, std).expect("positive");
        let values = (0..times.len()).map(|k| f(k) + noise.sample(&mut random)).collect();
        Timed::new("log", times.clone(), values).expect("valid")
    };
    let mut recording = Recording::from([
        (Quantity::Velocity(Dof::Surge), measured(&|k| motion.velocity[k][0], 0.003)),
        (Quantity::Velocity(Dof::Sway), measured(&|k| motion.velocity[k][1], 0.003)),
        (Quantity::Rate(Axis::Z), measured(&|k| motion.velocity[k][5], 0.001)),
        (Quantity::Attitude(Attitude::Heading), measured(&|k| motion.attitude[k][2], 1e-4)),
    ]);
    for (signal, series) in signals {
        let quantity = match signal {
            Signal::Angle { kind, name } => Quantity::SurfaceAngle { kind, name },
            Signal::Drive(name) => Quantity::Thruster { name, input: ThrusterInput::Speed },
            Signal::AirForward | Signal::AirStarboard => continue,
        };
        recording.insert(quantity, series);
    }
    if with_wind {
        let air = inputs(seed, &times);
        let over_ground = |k: usize| {
            let (x, y) = (air[&Signal::AirForward].values()[k], air[&Signal::AirStarboard].values()[k]);
            let (sin, cos) = motion.attitude[k][2].sin_cos();
            (x * cos - y * sin, x * sin + y * cos)
        };
        let wind = |part| Quantity::Wind(WindFrame::True, part);
        let speed = measured(&|k| over_ground(k).0.hypot(over_ground(k).1), 1e-9);
        let from = measured(&|k| (-over_ground(k).1).atan2(-over_ground(k).0), 1e-9);
        recording.insert(wind(WindPart::Speed), speed);
        recording.insert(wind(WindPart::Direction), from);
    }
    let setup = TrialSetup {
        name: name.to_owned(),
        role,
        coupled: vec![AXES.to_vec()],
        ..TrialSetup::default()
    };
    Trial::new(setup, &recording, vehicle).expect("complete")
}

fn identified(vehicle: &Vehicle, plan: CoupledPlan, with_wind: bool) -> Results {
    let trials = [("a", Role::Fit, 1), ("b", Role::Fit, 2), ("c", Role::HoldOut, 3)];
    let trials = trials.map(|(name, role, seed)| trial(name, role, seed, vehicle, with_wind));
    let options = IdentifyOptions { coupled: vec![plan], ..IdentifyOptions::default() };
    identify(vehicle, &trials, &options).results
}

/// Every coefficient is within this part of the truth or so many standard deviations.
const PART: f64 = 0.05;
const DEVIATIONS: f64 = 3.0;

fn check(plant: &CoupledPlant, except: &[&str]) {
    for (name, value) in TRUTH.iter().filter(|(name, _)| !except.contains(name)) {
        let found = plant.parameters.get(*name).unwrap_or_else(|| panic!("{name} is missing"));
        let off = (found.value - value).abs();
        assert!(
            off <= PART * value.abs() || off <= DEVIATIONS * found.std,
            "{name}: {} ± {} against {value}",
            found.value,
            found.std
        );
    }
}

#[test]
fn a_ship_comes_back_from_its_rudder_its_propeller_speed_and_the_wind() {
    let results = identified(&ship(false), plan(&[("mass.surge", 260.0)], &[]), true);
    assert!(results.failures.is_empty(), "{:?}", results.failures);
    let plant = &results.coupled["surge-sway-yaw"];
    check(plant, &[]);
    assert_eq!(plant.parameters["mass.surge"].told_by, ToldBy::Stated);
    assert_eq!(plant.parameters["mass.surge"].std, 0.0);
    let held = plant.hold_out.as_ref().expect("held out");
    for (dof, score) in &held.by_axis {
        assert!(score.r2.is_some_and(|r2| r2 > 0.99), "{dof}: {:?}", score.r2);
    }
    // What results hold makes the same plant.
    let again = seaplant::plant_of_result(plant).expect("a plant");
    assert_eq!(again.structure().effects().len(), plant.effects.len());
}

#[test]
fn a_rudder_alone_leaves_the_scale_of_force_free() {
    let results = identified(&ship(false), plan(&[], &[]), false);
    assert!(results.coupled.is_empty());
    let message = &results.failures[0].message;
    assert!(message.contains("scale of force") && message.contains("hold"), "{message}");
}

#[test]
fn wind_that_is_asked_for_and_not_logged_is_missed() {
    let results = identified(&ship(true), plan(&[], &["wind.sway"]), false);
    let message = &results.failures[0].message;
    assert!(message.contains("the wind") && message.contains("wind.true.speed"), "{message}");
}
