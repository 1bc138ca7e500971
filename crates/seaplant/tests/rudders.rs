//! Plants with rudders, propellers of unknown strength and wind come back from their motion.

use std::collections::BTreeMap;

use nalgebra::Vector6;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use seaplant::estimate::online::{OnlineFit, OnlineOptions, Scheme, fit_online_plant};
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::{Plant, Signal, Symmetry};
use seaplant::quantity::{Attitude, Axis, WindFrame, WindPart, World};
use seaplant::results::{PlantResult, Results, ToldBy};
use seaplant::{
    CaveatCode, Dof, Fin, IdentifyOptions, PlantPlan, QuadraticThrust, Quantity, Recording, Role,
    Surface, ThrustCurve, Thruster, ThrusterInput, Timed, Trial, TrialRecord, TrialSetup, Vehicle,
    identify, likely_mistakes,
};

const AXES: [Dof; 3] = [Dof::Surge, Dof::Sway, Dof::Yaw];
const SIDEWAYS: [Dof; 2] = [Dof::Sway, Dof::Yaw];

/// A vehicle, what is asked of it, and its true coefficients.
struct Case {
    vehicle: Vehicle,
    plan: PlantPlan,
    truth: &'static [(&'static str, f64)],
    /// Force ahead that is logged, N, about which it varies.
    force: Option<f64>,
    speed: f64,
}

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

fn plan(hold: &[(&str, f64)], effects: &[&str]) -> PlantPlan {
    PlantPlan {
        axes: AXES.to_vec(),
        symmetry: Symmetry::PortStarboard,
        model: None,
        terms: vec!["sway: r".parse().expect("a term")],
        effects: effects.iter().map(ToString::to_string).collect(),
        hold: hold.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
        search: true,
    }
}

/// The ship, its plant asked for with some coefficients held and some effects.
fn case(known_thrust: bool, hold: &[(&str, f64)], effects: &[&str]) -> Case {
    let (vehicle, plan) = (ship(known_thrust), plan(hold, effects));
    Case { vehicle, plan, truth: &TRUTH, force: None, speed: 0.8 }
}

/// REMUS 100 in the plane, its coefficients apart from those that its rudder and its added mass
/// bring with them: Y_uv = −28.6 is −9.64 of the rudder and −18.96 of the body, N_uv = −24 is
/// −34.57 of Munk, 6.15 of the rudder and 4.42 of the body. [Prestero2001]
const REMUS: [(&str, f64); 14] = [
    ("mass.surge", 31.41),
    ("mass.sway", 65.98),
    ("mass.sway-yaw", -1.93),
    ("mass.yaw", 8.33),
    ("surge: u", 0.0),
    ("surge: |u|u", 1.62),
    ("sway: v", 0.0),
    ("sway: |v|v", 1310.0),
    ("yaw: r", 0.0),
    ("yaw: |r|r", 94.0),
    ("sway: uv", 18.96),
    ("yaw: uv", -4.42),
    ("yaw: |v|v", 3.18),
    ("rudder.lift", 9.64),
];

fn remus() -> Case {
    let rudder = Fin::new(Surface::Rudder, "rudder", [-0.638, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let vehicle = Vehicle { fins: vec![rudder.expect("a rudder")], ..Vehicle::default() };
    let terms = ["sway: uv", "yaw: uv", "yaw: |v|v"];
    let terms = terms.map(|term| term.parse().expect("a term")).to_vec();
    let plan = PlantPlan { terms, search: false, ..plan(&[], &[]) };
    Case { vehicle, plan, truth: &REMUS, force: Some(4.0), speed: 1.5 }
}

/// The true plant; of the ship, with wind.
fn truth(case: &Case) -> Plant {
    let (mut plan, mut vehicle) = (case.plan.clone(), case.vehicle.clone());
    if case.truth.len() == TRUTH.len() {
        plan.effects = ["wind.surge", "wind.sway", "wind.yaw"].map(str::to_owned).to_vec();
        vehicle = ship(false);
    }
    plan.hold.clear();
    let is_ship = case.truth.len() == TRUTH.len();
    let is_logged = |signal: &Signal| is_ship || !signal.is_of_wind();
    let structure = plan.structure(&vehicle, is_logged).expect("a structure");
    let value = |name: String| {
        let known = case.truth.iter().find(|(known, _)| *known == name);
        known.unwrap_or_else(|| panic!("{name} has no truth")).1
    };
    let coefficients = structure.names().into_iter().map(value).collect();
    Plant::new(structure, coefficients).expect("possible")
}

/// A drive of ten minutes, its rudder turned every few seconds, its speed now and then.
fn inputs(seed: u64, times: &[f64]) -> BTreeMap<Signal, Timed> {
    let phase = seed as f64;
    let of = |f: &dyn Fn(f64) -> f64| {
        Timed::new("input", times.to_vec(), times.iter().map(|t| f(*t)).collect::<Vec<_>>())
            .expect("valid")
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

fn trial(name: &str, role: Role, seed: u64, case: &Case, with_wind: bool) -> Trial {
    trial_of(name, role, case, &recording(seed, case, with_wind))
}

fn trial_of(name: &str, role: Role, case: &Case, recording: &Recording) -> Trial {
    let setup = TrialSetup {
        name: name.to_owned(),
        role,
        together: vec![AXES.to_vec(), SIDEWAYS.to_vec()],
        ..TrialSetup::default()
    };
    Trial::new(setup, recording, &case.vehicle).expect("complete")
}

fn recording(seed: u64, case: &Case, with_wind: bool) -> Recording {
    let times: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
    let truth = truth(case);
    let mut signals = inputs(seed, &times);
    signals.retain(|signal, _| truth.structure().signals().contains(signal));
    let phase = seed as f64;
    let force = case.force.map(|force| {
        let at = |t: &f64| force * (1.0 + 0.6 * (0.07 * t + phase).sin().signum());
        Timed::new("force", times.clone(), times.iter().map(at).collect::<Vec<_>>()).expect("valid")
    });
    let mut driven = Inputs { signals: signals.clone(), ..Inputs::default() };
    driven.force[0] = force.clone();
    let start = Vector6::new(case.speed, 0.0, 0.0, 0.0, 0.0, 0.0);
    let motion = simulate(&truth, &driven, &start, &times).expect("bounded");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut measured = |f: &dyn Fn(usize) -> f64, std: f64| {
        let noise = Normal::new(0.0, std).expect("positive");
        let values: Vec<f64> = (0..times.len()).map(|k| f(k) + noise.sample(&mut random)).collect();
        Timed::new("log", times.clone(), values).expect("valid")
    };
    let mut recording = Recording::from([
        (Quantity::Velocity(Dof::Surge), measured(&|k| motion.velocity[k][0], 0.003)),
        (Quantity::Velocity(Dof::Sway), measured(&|k| motion.velocity[k][1], 0.003)),
        (Quantity::Rate(Axis::Z), measured(&|k| motion.velocity[k][5], 0.001)),
        (Quantity::Attitude(Attitude::Heading), measured(&|k| motion.attitude[k][2], 1e-4)),
    ]);
    recording.extend(force.map(|force| (Quantity::Wrench(Dof::Surge), force)));
    for (signal, series) in signals {
        let quantity = match signal {
            Signal::Angle { kind, name } => Quantity::SurfaceAngle { kind, name },
            Signal::Drive(name) => Quantity::Thruster { name, input: ThrusterInput::Speed },
            Signal::AirForward | Signal::AirStarboard => continue,
            Signal::PropellerSpeed(_) | Signal::Thrust(_) | Signal::ThrustBy { .. } => continue,
        };
        recording.insert(quantity, series);
    }
    if with_wind {
        let air = inputs(seed, &times);
        let over_ground = |k: usize| {
            let (x, y) =
                (air[&Signal::AirForward].values()[k], air[&Signal::AirStarboard].values()[k]);
            let (sin, cos) = motion.attitude[k][2].sin_cos();
            (x * cos - y * sin, x * sin + y * cos)
        };
        let wind = |part| Quantity::Wind(WindFrame::True, part);
        let speed = measured(&|k| over_ground(k).0.hypot(over_ground(k).1), 1e-9);
        let from = measured(&|k| (-over_ground(k).1).atan2(-over_ground(k).0), 1e-9);
        recording.insert(wind(WindPart::Speed), speed);
        recording.insert(wind(WindPart::Direction), from);
    }
    for (way, k) in [(World::North, 0), (World::East, 1)] {
        let fixes = measured(&|at| motion.position[at][k], 0.01);
        recording.insert(Quantity::Position(way), fixes);
    }
    recording
}

const TRIALS: [(&str, Role, u64); 3] =
    [("a", Role::Fit, 1), ("b", Role::Fit, 2), ("c", Role::HoldOut, 3)];

fn identified(case: &Case, with_wind: bool) -> Results {
    let trials = TRIALS.map(|(name, role, seed)| trial(name, role, seed, case, with_wind));
    identified_from(case, &trials)
}

fn identified_from(case: &Case, trials: &[Trial]) -> Results {
    let together = vec![case.plan.clone()];
    let options = IdentifyOptions { together, ..IdentifyOptions::default() };
    identify(&case.vehicle, trials, &options).results
}

/// Every coefficient is within this part of the truth or so many standard deviations.
const PART: f64 = 0.05;
const DEVIATIONS: f64 = 3.0;

fn check(plant: &PlantResult, case: &Case) {
    for (name, value) in case.truth {
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
    let case = case(false, &[("mass.surge", 260.0)], &[]);
    let results = identified(&case, true);
    assert!(results.failures.is_empty(), "{:?}", results.failures);
    let plant = &results.plants["surge-sway-yaw"];
    check(plant, &case);
    assert_eq!(plant.parameters["mass.surge"].told_by, ToldBy::Stated);
    assert_eq!(plant.parameters["mass.surge"].std, 0.0);
    let held = plant.hold_out.as_ref().expect("held out");
    for (dof, score) in &held.by_axis {
        assert!(score.r_squared.is_some_and(|r2| r2 > 0.99), "{dof}: {:?}", score.r_squared);
    }
    // What results hold makes the same plant.
    let again = seaplant::plant_of_result(plant).expect("a plant");
    assert_eq!(again.structure().effects().len(), plant.effects.len());
}

/// Where velocities are not measured, no number of their noise is without a standard deviation.
#[test]
fn results_from_fixes_and_a_rudder_are_read_again() {
    let case = case(true, &[], &[]);
    let trials = TRIALS.map(|(name, role, seed)| {
        let mut recording = recording(seed, &case, true);
        recording.retain(|quantity, _| !matches!(quantity, Quantity::Velocity(_)));
        trial_of(name, role, &case, &recording)
    });
    let results = identified_from(&case, &trials);
    let plant = &results.plants["surge-sway-yaw"];
    let mass = &plant.parameters["mass.sway"];
    assert!((mass.low95..=mass.high95).contains(&420.0), "{mass:?}");
    let text = serde_json::to_string(&results).expect("text");
    let again: Results = serde_json::from_str(&text).expect("every number is finite");
    assert_eq!(again.plants["surge-sway-yaw"].nuisances, plant.nuisances);
}

#[test]
fn a_rudder_whose_angle_is_logged_with_the_wrong_sign_is_named() {
    let case = case(true, &[], &[]);
    let named = |sign: f64| {
        let trials = TRIALS.map(|(name, role, seed)| {
            let mut recording = recording(seed, &case, true);
            for (quantity, series) in &mut recording {
                if matches!(quantity, Quantity::SurfaceAngle { .. }) {
                    *series = series.map(|x| sign * x);
                }
            }
            trial_of(name, role, &case, &recording)
        });
        likely_mistakes(&case.vehicle, &trials)
    };
    assert_eq!(named(1.0), []);
    let found = named(-1.0);
    let [only] = found.as_slice() else { panic!("one mistake was made: {found:#?}") };
    assert!(only.message.starts_with("rudder.rudder.angle looks reversed"), "{}", only.message);
    assert!(only.message.contains("`negate = true` for \"rudder.rudder.angle\""));
}

#[test]
fn a_torpedo_comes_back_from_its_thrust_and_its_rudder() {
    let case = remus();
    let results = identified(&case, false);
    assert!(results.failures.is_empty(), "{:?}", results.failures);
    check(&results.plants["surge-sway-yaw"], &case);
}

const SCHEMES: [Scheme; 3] = [Scheme::Adaptive, Scheme::Recursive, Scheme::Ekf];

/// Fed sample by sample, ten minutes give masses, thrust and lift to this part; the joint filter,
/// whose coefficients move with its linearisation, to the other.
const NEAR: f64 = 0.12;
const NEAR_FILTER: f64 = 0.25;

/// Where only Coriolis forces tell the scale of sway and yaw.
const NEAR_TORPEDO: f64 = 0.2;

/// A plant with some coefficients held, taken in sample by sample.
fn online(case: &Case, scheme: Scheme) -> Result<OnlineFit, seaplant::Error> {
    let trials = [("a", Role::Fit, 1), ("b", Role::Fit, 2)];
    let trials = trials.map(|(name, role, seed)| trial(name, role, seed, case, true));
    let structure = case.plan.structure(&case.vehicle, |_| true)?;
    let records: Vec<&TrialRecord> =
        trials.iter().map(|trial| trial.record(&AXES)).collect::<Result<_, _>>()?;
    fit_online_plant(&structure, scheme, &records, None, &OnlineOptions::default())
}

fn assert_near(case: &Case, scheme: Scheme, names: &[&str]) {
    let found = online(case, scheme).expect("determined").estimate.plant;
    let near = if scheme == Scheme::Ekf { NEAR_FILTER } else { NEAR };
    for name in names {
        let k = found.structure().names().iter().position(|known| known == name).expect("there");
        let (_, truth) = case.truth.iter().find(|(known, _)| known == name).expect("true");
        let value = found.coefficients()[k];
        assert!((value / truth - 1.0).abs() < near, "{name}: {value} of {truth}, {scheme:?}");
    }
}

#[test]
fn a_ship_whose_lift_is_known_comes_back_sample_by_sample() {
    let case = case(false, &[("mass.surge", 260.0), ("rudder.lift", 60.0)], &[]);
    for scheme in SCHEMES {
        assert_near(&case, scheme, &["mass.surge", "mass.sway", "mass.yaw", "propeller.thrust"]);
    }
}

#[test]
fn lift_is_found_sample_by_sample_where_only_surge_has_a_known_force() {
    let ship = case(false, &[("mass.surge", 260.0)], &[]);
    let names = ["mass.sway", "mass.yaw", "rudder.lift"];
    for scheme in [Scheme::Recursive, Scheme::Ekf] {
        assert_near(&ship, scheme, &names);
    }
    let message = online(&ship, Scheme::Adaptive).expect_err("no force").to_string();
    assert!(message.contains("sway and yaw") && message.contains("lift_slope"), "{message}");
}

#[test]
fn a_torpedo_keeps_its_sway_mass_sample_by_sample() {
    // Known force acts on surge alone; all else is told through its Coriolis forces.
    let case = remus();
    let found = online(&case, Scheme::Recursive).expect("determined").estimate.plant;
    for (name, mass) in [("mass.surge", 31.41), ("mass.sway", 65.98), ("mass.yaw", 8.33)] {
        let k = found.structure().names().iter().position(|known| known == name).expect("there");
        let value = found.coefficients()[k];
        assert!((value / mass - 1.0).abs() < NEAR_TORPEDO, "{name}: {value} of {mass}");
    }
}

#[test]
fn a_rudder_alone_leaves_the_scale_of_force_free() {
    let results = identified(&case(false, &[], &[]), false);
    assert!(results.plants.is_empty());
    let message = &results.failures[0].message;
    assert!(message.contains("scale of force") && message.contains("hold"), "{message}");
}

#[test]
fn sway_and_yaw_without_surge_hold_part_of_munks_moment() {
    let case = case(true, &[], &[]);
    let trials = [("a", Role::Fit, 1), ("b", Role::HoldOut, 3)];
    let trials = trials.map(|(name, role, seed)| trial(name, role, seed, &case, false));
    let hold = [("mass.sway".to_owned(), 420.0)].into();
    let alone = PlantPlan { axes: SIDEWAYS.to_vec(), hold, search: false, ..case.plan.clone() };
    let options = IdentifyOptions { together: vec![alone], ..IdentifyOptions::default() };
    let results = identify(&case.vehicle, &trials, &options).results;
    assert!(results.failures.is_empty(), "{:?}", results.failures);
    let plant = &results.plants["sway-yaw"];
    let found = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::MunkMoment);
    let message = &found.expect("it drifts under way").message;
    assert!(message.contains("surge is not among the plant's axes"), "{message}");
    // 180 kg m² with all three axes.
    let inertia = plant.parameters["mass.yaw"].value;
    assert!((inertia / 180.0 - 1.0).abs() > 0.05, "{inertia}");
}

#[test]
fn wind_that_is_asked_for_and_not_logged_is_missed() {
    let results = identified(&case(true, &[], &["wind.sway"]), false);
    let message = &results.failures[0].message;
    assert!(message.contains("the wind") && message.contains("wind.true.speed"), "{message}");
}
