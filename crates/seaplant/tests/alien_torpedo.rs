//! A torpedo that others published, written here a second time after their equations, comes back
//! from the logs of a free run in six axes.
//!
//! REMUS 100 [Prestero2001], where the table is that of a symmetric body: what it has of heave and
//! pitch is what it has of sway and yaw. Its derivatives hold the Coriolis forces of added mass,
//! and those of drift and turn what its fins do there. Fins push at right angles to themselves,
//! which for small angles is the table's Y_uuδ; the propeller has no torque.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use nalgebra::{Matrix6, SVector, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::{Signal, Symmetry};
use seaplant::quantity::{Attitude, Axis};
use seaplant::results::{PlantResult, ToldBy};
use seaplant::{
    Dof, Fin, IdentifyOptions, PlantPlan, QuadraticThrust, Quantity, Recording, Role, Surface,
    ThrustCurve, Thruster, ThrusterInput, Timed, Trial, TrialSetup, Vehicle, identify,
    plant_of_result,
};

const GRAVITY: f64 = 9.81;
const WEIGHT: f64 = 299.0;
const BUOYANCY: f64 = 306.0;
const MASS: f64 = WEIGHT / GRAVITY;
const INERTIA: [f64; 3] = [0.177, 3.45, 3.45];
const GRAVITY_BELOW: f64 = 0.0196;
const FIN_AT: f64 = -0.638;
/// Thrust, N/(rad/s)²: 3.86 N at 1500 rpm.
const THRUST: f64 = 1.564e-4;

// Derivatives as published; Z and M are those of Y and N, turned by a quarter.
const X_UDOT: f64 = -0.93;
const Y_VDOT: f64 = -35.5;
const Y_RDOT: f64 = 1.93;
const K_PDOT: f64 = -0.0704;
const N_RDOT: f64 = -4.88;
const X_UU: f64 = -1.62;
const Y_VV: f64 = -1310.0;
const Y_RR: f64 = 0.632;
const Y_UV: f64 = -28.6;
const Y_UR: f64 = 5.22;
const K_PP: f64 = -0.130;
const N_VV: f64 = -3.18;
const N_RR: f64 = -94.0;
const N_UV: f64 = -24.0;
const N_UR: f64 = -2.0;
const Y_UUD: f64 = 9.64;

/// Left-hand mass with what the water adds, all six axes.
fn mass() -> Matrix6<f64> {
    let g = MASS * GRAVITY_BELOW;
    let mut m = Matrix6::from_diagonal(&Vector6::new(
        MASS - X_UDOT,
        MASS - Y_VDOT,
        MASS - Y_VDOT,
        INERTIA[0] - K_PDOT,
        INERTIA[1] - N_RDOT,
        INERTIA[2] - N_RDOT,
    ));
    for (i, j, value) in [(0, 4, g), (1, 3, -g), (1, 5, -Y_RDOT), (2, 4, Y_RDOT)] {
        m[(i, j)] = value;
        m[(j, i)] = value;
    }
    m
}

/// ν̇ at a velocity, roll and pitch, rad, angles of rudder and stern planes, rad, and thrust, N.
fn rate(x: &Vector6<f64>, [roll, pitch]: [f64; 2], fins: [f64; 2], thrust: f64) -> Vector6<f64> {
    let (u, v, w, p, q, r) = (x[0], x[1], x[2], x[3], x[4], x[5]);
    let [rudder, plane] = fins;
    let (excess, righting) = (WEIGHT - BUOYANCY, GRAVITY_BELOW * WEIGHT);
    let side = [v + FIN_AT * r, w - FIN_AT * q];
    let normal = |side: f64, attack: f64| Y_UUD * (u * u + side * side) * attack.sin();
    let yaw = normal(side[0], rudder - side[0].atan2(u));
    let dive = normal(side[1], plane + side[1].atan2(u));
    let drag = yaw * rudder.sin() + dive * plane.sin();
    let (yaw_force, pitch_force) = (yaw * rudder.cos(), -dive * plane.cos());
    // What the table has of the fins in drift and turn is the body's without them.
    let (y_uv, y_ur) = (Y_UV + Y_UUD, Y_UR + FIN_AT * Y_UUD);
    let (n_uv, n_ur) = (N_UV + FIN_AT * Y_UUD, N_UR + FIN_AT * FIN_AT * Y_UUD);
    let g = GRAVITY_BELOW;
    let rigid = Vector6::new(
        MASS * (w * q - v * r + g * p * r),
        MASS * (u * r - w * p + g * q * r),
        MASS * (v * p - u * q - g * (p * p + q * q)),
        (INERTIA[2] - INERTIA[1]) * q * r - MASS * g * (u * r - w * p),
        (INERTIA[0] - INERTIA[2]) * r * p + MASS * g * (w * q - v * r),
        (INERTIA[1] - INERTIA[0]) * p * q,
    );
    let force = Vector6::new(
        -excess * pitch.sin() + X_UU * u * u.abs() + Y_VDOT * w * q
            - Y_RDOT * q * q
            - Y_VDOT * v * r
            - Y_RDOT * r * r
            + thrust
            - drag,
        excess * pitch.cos() * roll.sin() + Y_VV * v * v.abs() + Y_RR * r * r.abs() + y_ur * u * r
            - Y_VDOT * w * p
            + Y_RDOT * p * q
            + y_uv * u * v
            + yaw_force,
        excess * pitch.cos() * roll.cos() + Y_VV * w * w.abs() - Y_RR * q * q.abs() - y_ur * u * q
            + Y_VDOT * v * p
            + Y_RDOT * r * p
            + y_uv * u * w
            + pitch_force,
        -righting * pitch.cos() * roll.sin() + K_PP * p * p.abs(),
        -righting * pitch.sin() - N_VV * w * w.abs() + N_RR * q * q.abs() + n_ur * u * q
            - Y_RDOT * v * p
            + (K_PDOT - N_RDOT) * r * p
            - n_uv * u * w
            - FIN_AT * pitch_force,
        N_VV * v * v.abs() + N_RR * r * r.abs() + n_ur * u * r - Y_RDOT * w * p
            + (N_RDOT - K_PDOT) * p * q
            + n_uv * u * v
            + FIN_AT * yaw_force,
    );
    mass().try_inverse().expect("a body") * (force - rigid)
}

/// What the identified plant should have: the fin's part taken out of uv and uw, Munk's moment out
/// of N_uv and M_uw.
fn truth() -> BTreeMap<&'static str, f64> {
    let m = mass();
    let munk = X_UDOT - Y_VDOT;
    let lift = Y_UUD;
    BTreeMap::from([
        ("mass.surge", m[(0, 0)]),
        ("mass.sway", m[(1, 1)]),
        ("mass.heave", m[(2, 2)]),
        ("mass.roll", m[(3, 3)]),
        ("mass.pitch", m[(4, 4)]),
        ("mass.yaw", m[(5, 5)]),
        ("mass.surge-heave", 0.0),
        ("mass.surge-pitch", m[(0, 4)]),
        ("mass.sway-roll", m[(1, 3)]),
        ("mass.sway-yaw", m[(1, 5)]),
        ("mass.heave-pitch", m[(2, 4)]),
        ("mass.roll-yaw", 0.0),
        ("surge: |u|u", -X_UU),
        ("sway: |v|v", -Y_VV),
        ("heave: |w|w", -Y_VV),
        ("roll: |p|p", -K_PP),
        ("pitch: |q|q", -N_RR),
        ("yaw: |r|r", -N_RR),
        ("sway: uv", -Y_UV - lift),
        ("heave: uw", -Y_UV - lift),
        ("yaw: uv", -N_UV - munk - FIN_AT * lift),
        ("pitch: uw", N_UV + munk + FIN_AT * lift),
        ("sway: |r|r", -Y_RR),
        ("heave: |q|q", Y_RR),
        ("yaw: |v|v", -N_VV),
        ("pitch: |w|w", N_VV),
        ("weight-minus-buoyancy", WEIGHT - BUOYANCY),
        ("lever.z", GRAVITY_BELOW * WEIGHT),
        ("rudder.lift", lift),
        ("planes.lift", lift),
    ])
}

/// Roll, pitch, heading and ν.
type State = SVector<f64, 9>;

/// What a run was, each step of 0.05 s.
#[derive(Default)]
struct Track {
    time_s: Vec<f64>,
    velocity: Vec<Vector6<f64>>,
    angles: Vec<[f64; 3]>,
    fins: Vec<[f64; 2]>,
    shaft: Vec<f64>,
}

const STEP_S: f64 = 0.05;
const SUBSTEPS: usize = 3;
const CRUISE: f64 = 1.5;

/// A run under orders of rudder and planes, which see time, pitch and its rate, and of the shaft.
fn track(
    length_s: f64,
    fins: impl Fn(f64, f64, f64) -> [f64; 2],
    shaft: impl Fn(f64) -> f64,
) -> Track {
    let (mut x, mut angles) = (Vector6::x() * CRUISE, [0.0_f64; 3]);
    let (mut turned, mut track) = ([0.0_f64; 2], Track::default());
    let h = STEP_S / SUBSTEPS as f64;
    for k in 0..(length_s / STEP_S) as usize {
        let t = STEP_S * k as f64;
        let n = shaft(t);
        track.time_s.push(t);
        track.velocity.push(x);
        track.angles.push(angles);
        track.fins.push(turned);
        track.shaft.push(n);
        let orders = fins(t, angles[1], x[4]);
        // Fins turn at half a radian a second, straight from sample to sample.
        let turn: [f64; 2] = std::array::from_fn(|i| (orders[i] - turned[i]).clamp(-0.025, 0.025));
        for part in 0..SUBSTEPS {
            let at = |w: f64| {
                std::array::from_fn(|i| turned[i] + turn[i] * (part as f64 + w) / SUBSTEPS as f64)
            };
            // Roll, pitch, heading, then ν.
            let slope = |state: &State, w: f64| {
                let angles = [state[0], state[1], state[2]];
                let x: Vector6<f64> = state.fixed_rows::<6>(3).into();
                let x_dot = rate(&x, [angles[0], angles[1]], at(w), THRUST * n * n.abs());
                let angles_dot = euler_rate(&x, angles);
                State::from_iterator(angles_dot.into_iter().chain(x_dot.iter().copied()))
            };
            let begin = State::from_iterator(angles.into_iter().chain(x.iter().copied()));
            let k1 = slope(&begin, 0.0);
            let k2 = slope(&(begin + k1 * (0.5 * h)), 0.5);
            let k3 = slope(&(begin + k2 * (0.5 * h)), 0.5);
            let k4 = slope(&(begin + k3 * h), 1.0);
            let end = begin + (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
            angles = [end[0], end[1], end[2]];
            x = end.fixed_rows::<6>(3).into();
        }
        turned = std::array::from_fn(|i| turned[i] + turn[i]);
    }
    track
}

fn euler_rate(x: &Vector6<f64>, [roll, pitch, _]: [f64; 3]) -> [f64; 3] {
    let (p, q, r) = (x[3], x[4], x[5]);
    let turning = q * roll.sin() + r * roll.cos();
    [p + turning * pitch.tan(), q * roll.cos() - r * roll.sin(), turning / pitch.cos()]
}

/// A free run: fins and shaft change at odd times, and the planes keep pitch within bounds.
fn free_run(seed: f64, length_s: f64) -> Track {
    let step = move |t: f64, every: f64, k: f64| {
        (12.9898 * ((t / every + (0.13 * t + k).sin()).floor() + 7.0 * k)).sin()
    };
    let fins = move |t: f64, pitch: f64, q: f64| {
        let goal = 0.25 * step(t, 8.0, seed + 0.3);
        let plane = 0.6 * (pitch - goal) + 0.4 * q + 0.08 * step(t, 3.0, seed + 0.7);
        [0.22 * step(t, 5.0, seed), plane.clamp(-0.25, 0.25)]
    };
    track(length_s, fins, move |t| 150.0 + 60.0 * step(t, 14.0, seed + 0.1))
}

/// Standard deviations: 3 mm/s, 0.05 degrees a second, 0.1 degrees.
const NOISE: [f64; 3] = [0.003, 0.000_9, 0.0017];

fn trial(name: &str, role: Role, track: &Track, seed: u64, vehicle: &Vehicle) -> Trial {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut log = |values: Vec<f64>, std: f64| {
        let noise = Normal::new(0.0, std).expect("positive");
        let noisy: Vec<f64> = values.into_iter().map(|x| x + noise.sample(&mut random)).collect();
        Timed::new("log", track.time_s.clone(), noisy).expect("valid")
    };
    let of = |k: usize| track.velocity.iter().map(|x| x[k]).collect::<Vec<_>>();
    let angle = |k: usize| track.angles.iter().map(|x| x[k]).collect::<Vec<_>>();
    let fin = |k: usize| track.fins.iter().map(|x| x[k]).collect::<Vec<_>>();
    let surface = |kind, name: &str| Quantity::SurfaceAngle { kind, name: name.to_owned() };
    let shaft = Quantity::Thruster { name: "propeller".to_owned(), input: ThrusterInput::Speed };
    let recording = Recording::from([
        (Quantity::Velocity(Dof::Surge), log(of(0), NOISE[0])),
        (Quantity::Velocity(Dof::Sway), log(of(1), NOISE[0])),
        (Quantity::Velocity(Dof::Heave), log(of(2), NOISE[0])),
        (Quantity::Rate(Axis::X), log(of(3), NOISE[1])),
        (Quantity::Rate(Axis::Y), log(of(4), NOISE[1])),
        (Quantity::Rate(Axis::Z), log(of(5), NOISE[1])),
        (Quantity::Attitude(Attitude::Roll), log(angle(0), NOISE[2])),
        (Quantity::Attitude(Attitude::Pitch), log(angle(1), NOISE[2])),
        (Quantity::Attitude(Attitude::Heading), log(angle(2), NOISE[2])),
        (surface(Surface::Rudder, "rudder"), log(fin(0), 0.0)),
        (surface(Surface::Fin, "planes"), log(fin(1), 0.0)),
        (shaft, log(track.shaft.clone(), 0.0)),
    ]);
    let together = vec![Dof::ALL.to_vec()];
    let setup = TrialSetup { name: name.to_owned(), role, together, ..TrialSetup::default() };
    Trial::new(setup, &recording, vehicle).expect("complete")
}

fn vehicle() -> Vehicle {
    let law = QuadraticThrust { forward: THRUST, reverse: THRUST, ..Default::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let propeller = Thruster::new("propeller", [-0.8, 0.0, 0.0], [1.0, 0.0, 0.0], curve);
    let at = [FIN_AT, 0.0, 0.0];
    let rudder = Fin::new(Surface::Rudder, "rudder", at, [0.0, 0.0, 1.0]);
    let planes = Fin::new(Surface::Fin, "planes", at, [0.0, 1.0, 0.0]);
    Vehicle {
        thrusters: vec![propeller.expect("a propeller")],
        fins: vec![rudder.expect("a rudder"), planes.expect("planes")],
        ..Vehicle::default()
    }
}

fn identified(vehicle: &Vehicle) -> PlantResult {
    let runs = [
        ("a", Role::Fit, 1.0, 150.0),
        ("b", Role::Fit, 2.0, 150.0),
        ("c", Role::HoldOut, 3.0, 60.0),
    ];
    let of = |(name, role, seed, length_s): (&str, Role, f64, f64)| {
        trial(name, role, &free_run(seed, length_s), 10 + seed as u64, vehicle)
    };
    let trials = runs.map(of);
    let lift = ["sway: uv", "yaw: uv", "heave: uw", "pitch: uw"];
    let cross = ["sway: |r|r", "yaw: |v|v", "heave: |q|q", "pitch: |w|w"];
    let plan = PlantPlan {
        axes: Dof::ALL.to_vec(),
        symmetry: Symmetry::PortStarboard,
        model: None,
        terms: lift.iter().chain(&cross).map(|term| term.parse().expect("a term")).collect(),
        effects: Vec::new(),
        hold: BTreeMap::new(),
        search: false,
    };
    let options = IdentifyOptions { together: vec![plan], ..IdentifyOptions::default() };
    let results = identify(vehicle, &trials, &options).results;
    assert!(results.failures.is_empty(), "{:?}", results.failures);
    results.plants.into_values().next().expect("a plant")
}

/// Advance, transfer and tactical diameter, m.
fn circle(velocity: &[Vector6<f64>], angles: &[[f64; 3]]) -> [f64; 3] {
    let (mut place, mut heading) = ([0.0; 2], 0.0);
    let (mut quarter, mut half) = (None, None);
    for (pair, at) in velocity.windows(2).zip(angles.windows(2)) {
        let x = 0.5 * (pair[0] + pair[1]);
        let [roll, pitch, yaw]: [f64; 3] = std::array::from_fn(|i| 0.5 * (at[0][i] + at[1][i]));
        let turned = nalgebra::Rotation3::from_euler_angles(roll, pitch, yaw);
        let moved = turned * nalgebra::Vector3::new(x[0], x[1], x[2]) * STEP_S;
        place = [place[0] + moved.x, place[1] + moved.y];
        heading += euler_rate(&x, [roll, pitch, yaw])[2] * STEP_S;
        if heading.abs() >= 0.5 * PI && quarter.is_none() {
            quarter = Some(place);
        }
        if heading.abs() >= PI && half.is_none() {
            half = Some(place);
        }
    }
    let (quarter, half) = (quarter.expect("it turns"), half.expect("it turns"));
    [quarter[0], quarter[1].abs(), half[1].abs()]
}

/// Targets: numbers of a turning circle within 3 %, coefficients within 5 % or three standard
/// deviations.
const CIRCLE_PART: f64 = 0.03;
const PART: f64 = 0.05;
const DEVIATIONS: f64 = 3.0;

#[test]
fn a_published_torpedo_comes_back_in_six_axes_and_turns_as_it_did() {
    let vehicle = vehicle();
    let found = identified(&vehicle);
    let truth = truth();
    let turn = track(80.0, |_, pitch, q| [0.2, 0.6 * pitch + 0.4 * q], |_| 157.0);
    let plant = plant_of_result(&found).expect("a plant");
    let series = |values: Vec<f64>| Timed::new("in", turn.time_s.clone(), values).expect("valid");
    let fin = |k: usize| series(turn.fins.iter().map(|x| x[k]).collect());
    let angle = |kind, name: &str| Signal::Angle { kind, name: name.to_owned() };
    let signals = BTreeMap::from([
        (angle(Surface::Rudder, "rudder"), fin(0)),
        (angle(Surface::Fin, "planes"), fin(1)),
    ]);
    let mut inputs = Inputs { signals, ..Inputs::default() };
    inputs.force[0] = Some(series(turn.shaft.iter().map(|n| THRUST * n * n).collect()));
    let moved = simulate(&plant, &inputs, &turn.velocity[0], &turn.time_s).expect("bounded");
    let pairs = circle(&moved.velocity, &moved.attitude)
        .into_iter()
        .zip(circle(&turn.velocity, &turn.angles));
    for (own, true_) in pairs {
        assert!((own / true_ - 1.0).abs() < CIRCLE_PART, "{own} m against {true_} m");
    }
    for (name, x) in found.parameters.iter().filter(|(_, x)| x.told_by != ToldBy::Nothing) {
        let value = truth.get(name.as_str()).copied().unwrap_or(0.0);
        let off = (x.value - value).abs();
        assert!(
            off <= PART * scale_of(name, value) || off <= DEVIATIONS * x.std,
            "{name}: {} ± {} against {value}",
            x.value,
            x.std
        );
    }
}

/// What an error is compared with: the coefficient, or of a mass that couples axes the mean of
/// theirs.
fn scale_of(name: &str, value: f64) -> f64 {
    let axes = name.strip_prefix("mass.").and_then(|axes| axes.split_once('-'));
    let index = |axis: &str| Dof::ALL.iter().position(|dof| dof.name() == axis);
    match axes.map(|(i, j)| (index(i), index(j))) {
        Some((Some(i), Some(j))) => (mass()[(i, i)] * mass()[(j, j)]).sqrt(),
        _ => value.abs(),
    }
}
