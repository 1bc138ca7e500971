//! A catamaran with two propellers, moved by other equations than those that are fitted.
//!
//! The Otter of MSS (`otter.m`, release of 2026-07, 25 kg of payload amidships) in its plane: M,
//! linear damping, yaw damping that grows with the rate, cross-flow drag in strips along the hull,
//! and two propellers beside each other, at y = ±0.395 m. Motion follows from Kirchhoff's
//! equations of momentum, ṗ = p × ω + F and π̇ = p × v + N, in which no Coriolis matrix appears.

use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use seaplant::plant::Symmetry;
use seaplant::quantity::{Attitude, Axis};
use seaplant::results::PlantResult;
use seaplant::{
    Dof, IdentifyOptions, PlantPlan, QuadraticThrust, Quantity, Recording, Role, ThrustCurve,
    Thruster, ThrusterInput, Timed, Trial, TrialSetup, Vehicle, identify,
};

const STEP_S: f64 = 0.01;
const STEPS_PER_SAMPLE: usize = 10;
const DURATION_S: f64 = 300.0;

/// Thrust over the square of propeller speed, ahead and astern, N/(rad/s)².
const THRUST: (f64, f64) = (0.01108, 0.006_445);
/// Propellers sit so far out, m.
const OUT_M: f64 = 0.395;
/// Propeller speeds reach so far, rad/s.
const MOST: (f64, f64) = (-100.0, 100.0);
/// Noise of velocity, m/s, of yaw rate, rad/s, and of heading, rad.
const NOISE: (f64, f64, f64) = (0.01, 0.002, 0.003);

/// Mass of surge and sway, sway with yaw, and yaw.
const MASS: (f64, f64, f64, f64) = (85.2815, 162.5, 11.0, 40.4937);

/// What its water does: 24.4 kgf at 6 knots, time constants of a second, and strips of 0.195 m
/// draught with a drag coefficient of 1.0 over 2 m of length.
fn drag(nu: &Vector3<f64>) -> Vector3<f64> {
    let (u, v, r) = (nu.x, nu.y, nu.z);
    let mut force = Vector3::new(77.5 * u, MASS.1 * v, MASS.3 * (1.0 + 10.0 * r.abs()) * r);
    const STRIPS: i32 = 40;
    for k in 0..STRIPS {
        let x = (f64::from(k) + 0.5) / f64::from(STRIPS) * 2.0 - 1.0;
        let across = v + x * r;
        let strip = 0.5 * 1025.0 * 0.195 * 1.0 * 2.0 / f64::from(STRIPS) * across.abs() * across;
        force += Vector3::new(0.0, strip, x * strip);
    }
    force
}

fn rate(nu: &Vector3<f64>, propellers: [f64; 2]) -> Vector3<f64> {
    let mass = Matrix3::new(MASS.0, 0.0, 0.0, 0.0, MASS.1, MASS.2, 0.0, MASS.2, MASS.3);
    let momentum = mass * nu;
    let thrust = propellers.map(|n| if n > 0.0 { THRUST.0 * n * n } else { -THRUST.1 * n * n });
    // The port propeller turns the bow to starboard.
    let pushed = Vector3::new(thrust[0] + thrust[1], 0.0, OUT_M * (thrust[0] - thrust[1]));
    let carried =
        Vector3::new(momentum.y * nu.z, -momentum.x * nu.z, momentum.x * nu.y - momentum.y * nu.x);
    mass.try_inverse().expect("positive") * (pushed + carried - drag(nu))
}

/// A drive with both propellers at speeds of their own, changed every few seconds.
fn logged(seed: u64) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut nu, mut heading) = (Vector3::zeros(), 0.0);
    let (mut speed, mut level, mut until) = ([0.0; 2], [0.0; 2], [0.0; 2]);
    let mut rows: Vec<[f64; 7]> = Vec::new();
    for step in 0..(DURATION_S / STEP_S) as usize {
        let t = step as f64 * STEP_S;
        if step % STEPS_PER_SAMPLE == 0 {
            for k in 0..2 {
                if t >= until[k] {
                    level[k] = rng.random_range(MOST.0..=MOST.1);
                    until[k] = t + rng.random_range(2.0..10.0);
                }
                speed[k] += 0.3 * (level[k] - speed[k]);
            }
            let mut noisy = |x: f64, std: f64| x + std * rng.sample::<f64, _>(StandardNormal);
            let velocity = [noisy(nu.x, NOISE.0), noisy(nu.y, NOISE.0), noisy(nu.z, NOISE.1)];
            let [u, v, r] = velocity;
            rows.push([t, speed[0], speed[1], u, v, r, noisy(heading, NOISE.2)]);
        }
        let first = rate(&nu, speed);
        let second = rate(&(nu + first * STEP_S), speed);
        let next = nu + (first + second) * (0.5 * STEP_S);
        heading += 0.5 * STEP_S * (nu.z + next.z);
        nu = next;
    }
    let series = |k: usize| {
        let (time_s, values) =
            rows.iter().map(|row| (row[0], row[k])).unzip::<_, _, Vec<_>, Vec<_>>();
        Timed::new("log", time_s, values).expect("finite")
    };
    let propeller =
        |name: &str| Quantity::Thruster { name: name.to_owned(), input: ThrusterInput::Speed };
    Recording::from([
        (propeller("port"), series(1)),
        (propeller("starboard"), series(2)),
        (Quantity::Velocity(Dof::Surge), series(3)),
        (Quantity::Velocity(Dof::Sway), series(4)),
        (Quantity::Rate(Axis::Z), series(5)),
        (Quantity::Attitude(Attitude::Heading), series(6)),
    ])
}

fn vehicle() -> Vehicle {
    let law = QuadraticThrust { forward: THRUST.0, reverse: THRUST.1, ..Default::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let at = |name: &str, y: f64| {
        Thruster::new(name, [-0.9, y, 0.1], [1.0, 0.0, 0.0], curve.clone()).expect("a thruster")
    };
    let thrusters = vec![at("port", -OUT_M), at("starboard", OUT_M)];
    Vehicle { thrusters, ..Vehicle::default() }
}

fn identified() -> PlantResult {
    let axes = [Dof::Surge, Dof::Sway, Dof::Yaw];
    let vehicle = vehicle();
    let trial = |name: &str, role, seed| {
        let (name, together) = (name.to_owned(), vec![axes.to_vec()]);
        let setup = TrialSetup { name, role, together, ..TrialSetup::default() };
        Trial::new(setup, &logged(seed), &vehicle).expect("complete")
    };
    let trials = [trial("a", Role::Fit, 1), trial("b", Role::Fit, 2), trial("c", Role::HoldOut, 3)];
    let plan = PlantPlan {
        axes: axes.to_vec(),
        symmetry: Symmetry::PortStarboard,
        model: None,
        terms: Vec::new(),
        effects: Vec::new(),
        hold: Default::default(),
        search: true,
    };
    let options = IdentifyOptions { together: vec![plan], ..IdentifyOptions::default() };
    let results = identify(&vehicle, &trials, &options).results;
    results.plants.into_values().next().expect("a plant")
}

/// What a mass may be off by.
const PART: f64 = 0.05;

/// Masses whose interval holds the truth. That of sway does not: strips of cross-flow drag are no
/// product that the plant has, and some of theirs is taken for mass.
const HELD: [&str; 2] = ["mass.surge", "mass.yaw"];

#[test]
fn two_propellers_tell_the_masses_of_a_catamaran() {
    let plant = identified();
    for (name, truth) in [("mass.surge", MASS.0), ("mass.sway", MASS.1), ("mass.yaw", MASS.3)] {
        let found = &plant.parameters[name];
        let told = format!("{name}: {} ± {} against {truth}", found.value, found.std);
        assert!((found.value / truth - 1.0).abs() < PART, "{told}");
        let is_held = found.low95 < truth && truth < found.high95;
        assert!(is_held || !HELD.contains(&name), "{told}");
    }
    let score = plant.hold_out.expect("a held-out trial");
    for (dof, score) in score.by_axis {
        assert!(score.r_squared.is_some_and(|r2| r2 > 0.9), "{dof}: {:?}", score.r_squared);
    }
}
