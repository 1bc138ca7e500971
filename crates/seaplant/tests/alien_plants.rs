//! Vehicles that other equations move than those that are fitted.
//!
//! A body with the full tensor of a work-class ROV is integrated by Kirchhoff's equations of
//! momentum, ṗ = p × ω + F and π̇ = π × ω + p × v + Q, in which no Coriolis matrix appears; a
//! catamaran by those of three axes with cross-flow drag in strips along its hull, which is none
//! of the products that a plant has.

use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use seaplant::plant::Symmetry;
use seaplant::quantity::{Attitude, Axis};
use seaplant::results::PlantResult;
use seaplant::{
    Dof, IdentifyOptions, PlantPlan, Quantity, Recording, Role, Timed, Trial, TrialSetup, Vehicle,
    identify,
};

/// Steps of the integration, and of the log, s.
const STEP_S: f64 = 0.01;
const STEPS_PER_SAMPLE: usize = 10;
/// Noise of velocity, m/s, of rates, rad/s, and of angles, rad.
const NOISE: (f64, f64, f64) = (3e-3, 2e-3, 1.7e-3);

type Rate<'a> = &'a dyn Fn(&Vector6<f64>, &Rotation3<f64>, &Vector6<f64>) -> Vector6<f64>;

/// A trial of a body under a joystick on each axis, by Heun's method.
fn logged(seed: u64, duration_s: f64, most: [f64; 6], rate: Rate<'_>) -> Recording {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut velocity, mut attitude) = (Vector6::zeros(), Rotation3::identity());
    let (mut force, mut level, mut until) = (Vector6::zeros(), [0.0; 6], [0.0; 6]);
    let mut rows: Vec<[f64; 16]> = Vec::new();
    for step in 0..(duration_s / STEP_S) as usize {
        let t = step as f64 * STEP_S;
        if step % STEPS_PER_SAMPLE == 0 {
            for k in 0..6 {
                if t >= until[k] {
                    level[k] = most[k] * rng.random_range(-1.0..=1.0);
                    until[k] = t + rng.random_range(2.0..10.0);
                }
                force[k] += 0.2 * (level[k] - force[k]);
            }
            rows.push(row(t, &force, &velocity, &attitude, &mut rng));
        }
        let turned = |velocity: &Vector6<f64>, h: f64| {
            Rotation3::from_scaled_axis(Vector3::new(velocity[3], velocity[4], velocity[5]) * h)
        };
        let first = rate(&velocity, &attitude, &force);
        let guess = velocity + first * STEP_S;
        let second = rate(&guess, &(attitude * turned(&velocity, STEP_S)), &force);
        let next = velocity + (first + second) * (0.5 * STEP_S);
        attitude *= turned(&(0.5 * (velocity + next)), STEP_S);
        velocity = next;
    }
    recording(&rows)
}

fn row(
    t: f64,
    force: &Vector6<f64>,
    velocity: &Vector6<f64>,
    attitude: &Rotation3<f64>,
    rng: &mut ChaCha8Rng,
) -> [f64; 16] {
    let (roll, pitch, heading) = attitude.euler_angles();
    let mut noisy = |x: f64, std: f64| x + std * rng.sample::<f64, _>(StandardNormal);
    let mut row = [0.0; 16];
    row[0] = t;
    for k in 0..6 {
        row[1 + k] = force[k];
        row[7 + k] = noisy(velocity[k], if k < 3 { NOISE.0 } else { NOISE.1 });
    }
    for (k, angle) in [roll, pitch, heading].into_iter().enumerate() {
        row[13 + k] = noisy(angle, NOISE.2);
    }
    row
}

fn recording(rows: &[[f64; 16]]) -> Recording {
    let column = |k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let series = |k: usize| Timed::new("log", column(0), column(k)).expect("finite");
    let mut recording = Recording::new();
    for (k, dof) in Dof::ALL.into_iter().enumerate() {
        recording.insert(Quantity::Wrench(dof), series(1 + k));
    }
    for (k, dof) in [Dof::Surge, Dof::Sway, Dof::Heave].into_iter().enumerate() {
        recording.insert(Quantity::Velocity(dof), series(7 + k));
    }
    for (k, axis) in [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate() {
        recording.insert(Quantity::Rate(axis), series(10 + k));
    }
    let mut heading = column(15);
    for k in 1..heading.len() {
        let turn = std::f64::consts::TAU;
        heading[k] -= turn * ((heading[k] - heading[k - 1]) / turn).round();
    }
    let heading = Timed::new("log", column(0), heading).expect("finite");
    recording.insert(Quantity::Attitude(Attitude::Heading), heading);
    recording.insert(Quantity::Attitude(Attitude::Roll), series(13));
    recording.insert(Quantity::Attitude(Attitude::Pitch), series(14));
    recording
}

fn identified(
    axes: &[Dof],
    symmetry: Symmetry,
    duration_s: f64,
    most: [f64; 6],
    rate: Rate<'_>,
) -> PlantResult {
    let trial = |name: &str, role, seed| {
        let (name, together) = (name.to_owned(), vec![axes.to_vec()]);
        let setup = TrialSetup { name, role, together, ..TrialSetup::default() };
        let recording = logged(seed, duration_s, most, rate);
        Trial::new(setup, &recording, &Vehicle::default()).expect("complete")
    };
    let trials = [trial("a", Role::Fit, 1), trial("b", Role::HoldOut, 2)];
    let plan = PlantPlan {
        axes: axes.to_vec(),
        symmetry,
        model: None,
        terms: Vec::new(),
        effects: Vec::new(),
        hold: Default::default(),
        search: false,
    };
    let options = IdentifyOptions { together: vec![plan], ..IdentifyOptions::default() };
    let results = identify(&Vehicle::default(), &trials, &options).results;
    results.plants.into_values().next().expect("a plant")
}

/// M_RB + M_A of RexROV, uuv_simulator, uuv_descriptions/urdf/rexrov.gazebo.xacro.
fn rexrov() -> Matrix6<f64> {
    let added = [
        [779.79, -6.8773, -103.32, 8.5426, -165.54, -7.8033],
        [-6.8773, 1222.0, 51.29, 409.44, -5.8488, 62.726],
        [-103.32, 51.29, 3659.9, 6.1112, -386.42, 10.7745],
        [8.5426, 409.44, 6.1112, 534.9, -10.027, 21.019],
        [-165.54, -5.8488, -386.42, -10.027, 842.69, -1.1162],
        [-7.8033, 62.726, 10.7745, 21.019, -1.1162, 224.32],
    ];
    let dry = [1862.87, 1862.87, 1862.87, 525.39, 794.2, 691.23];
    Matrix6::from_fn(|i, j| added[i][j] + if i == j { dry[i] } else { 0.0 })
}

const LINEAR: [f64; 6] = [74.82, 69.48, 728.4, 268.8, 309.77, 105.0];
const QUADRATIC: [f64; 6] = [748.22, 992.53, 1821.01, 672.0, 774.44, 523.27];
/// Righting moment per angle, N m.
const RIGHTING: f64 = 5560.0;

/// Every mass is within this part of the root of the product of its axes' own …
const MASS_PART: f64 = 0.01;
/// … or within so many standard deviations: of forty 99.7 % intervals all hold the truth.
const DEVIATIONS: f64 = 3.5;

#[test]
fn a_body_moved_by_its_momentum_gives_its_full_tensor_back() {
    let mass = rexrov();
    let inverse = mass.try_inverse().expect("positive");
    let rate = |velocity: &Vector6<f64>, attitude: &Rotation3<f64>, force: &Vector6<f64>| {
        let part = |x: &Vector6<f64>, from| Vector3::from(x.fixed_rows::<3>(from));
        let momentum = mass * velocity;
        let (v, omega) = (part(velocity, 0), part(velocity, 3));
        let (p, pi) = (part(&momentum, 0), part(&momentum, 3));
        let down = attitude.inverse() * Vector3::z();
        let linear = p.cross(&omega);
        let angular = pi.cross(&omega) + p.cross(&v) + RIGHTING * Vector3::z().cross(&down);
        let mut sum = *force;
        for k in 0..3 {
            sum[k] += linear[k];
            sum[3 + k] += angular[k];
        }
        for k in 0..6 {
            sum[k] -= LINEAR[k] * velocity[k] + QUADRATIC[k] * velocity[k].abs() * velocity[k];
        }
        inverse * sum
    };
    let most = [900.0, 1100.0, 2500.0, 1500.0, 1800.0, 500.0];
    let found = identified(&Dof::ALL, Symmetry::None, 200.0, most, &rate);
    for (i, on) in Dof::ALL.into_iter().enumerate() {
        for (j, of) in Dof::ALL.into_iter().enumerate().skip(i) {
            let name = if i == j { format!("mass.{on}") } else { found_name(&found, on, of) };
            let x = &found.parameters[&name];
            let off = (x.value - mass[(i, j)]).abs();
            let scale = (mass[(i, i)] * mass[(j, j)]).sqrt();
            let near = off < MASS_PART * scale || off < DEVIATIONS * x.std;
            assert!(near, "{name}: {} ± {}, {}", x.value, x.std, mass[(i, j)]);
        }
    }
    let lever = &found.parameters["lever.z"];
    assert!((lever.value / RIGHTING - 1.0).abs() < MASS_PART, "{}", lever.value);
}

/// Mass that couples two axes goes by the one name or the other.
fn found_name(found: &PlantResult, on: Dof, of: Dof) -> String {
    let name = format!("mass.{on}-{of}");
    if found.parameters.contains_key(&name) { name } else { format!("mass.{of}-{on}") }
}

/// Hull of the Otter: length, m, draught of a pontoon, m, and the drag coefficient of its strips.
const OTTER: (f64, f64, f64) = (2.0, 0.195, 0.8);
/// Strips of half a decimetre.
const STRIPS: usize = 40;

/// −∫ ½ ρ C T |v + x r| (v + x r) (1, x) dx: cross-flow drag on sway and yaw.
fn cross_flow(v: f64, r: f64) -> (f64, f64) {
    let (length, draught, coefficient) = OTTER;
    let dx = length / STRIPS as f64;
    let strip = |k: usize| {
        let x = -0.5 * length + (k as f64 + 0.5) * dx;
        let across = v + x * r;
        let force = -0.5 * 1025.0 * coefficient * draught * across * across.abs() * dx;
        (force, x * force)
    };
    (0..STRIPS).map(strip).fold((0.0, 0.0), |sum, strip| (sum.0 + strip.0, sum.1 + strip.1))
}

/// A catamaran is predicted in each axis but for this part of its variation, though its drag is
/// no product of a plant's.
const PREDICTED: f64 = 0.97;
/// And its masses are right to this part.
const CATAMARAN_MASS: f64 = 0.05;

/// Masses, linear damping and yaw drag of the Otter with 25 kg of payload (T. I. Fossen, MSS,
/// otter.m), driven by a force ahead and a moment.
#[test]
fn a_catamaran_with_cross_flow_drag_is_predicted_and_its_masses_found() {
    let (surge, sway, yaw, offset) = (85.28, 162.5, 40.49, 11.0);
    let rate = |velocity: &Vector6<f64>, _: &Rotation3<f64>, force: &Vector6<f64>| {
        let (u, v, r) = (velocity[0], velocity[1], velocity[5]);
        let (side, turn) = cross_flow(v, r);
        // Momentum of the three axes, p = M ν, and ṗ = p × ω + F.
        let (px, py) = (surge * u, sway * v + offset * r);
        let x = force[0] - 77.6 * u + py * r;
        let y = side - 162.5 * v - px * r;
        let n = force[5] + turn - 40.49 * (1.0 + 10.0 * r.abs()) * r + px * v - py * u;
        let det = sway * yaw - offset * offset;
        Vector6::new(
            x / surge,
            (yaw * y - offset * n) / det,
            0.0,
            0.0,
            0.0,
            (sway * n - offset * y) / det,
        )
    };
    let axes = [Dof::Surge, Dof::Sway, Dof::Yaw];
    let most = [150.0, 0.0, 0.0, 0.0, 0.0, 60.0];
    let found = identified(&axes, Symmetry::PortStarboard, 300.0, most, &rate);
    for (name, expected) in [("mass.surge", surge), ("mass.sway", sway), ("mass.yaw", yaw)] {
        let x = &found.parameters[name];
        let near = (x.value / expected - 1.0).abs() < CATAMARAN_MASS;
        assert!(near, "{name}: {} ± {}, {expected}", x.value, x.std);
    }
    for (dof, score) in &found.hold_out.as_ref().expect("held out").by_axis {
        assert!(score.r_squared.expect("bounded") > PREDICTED, "{dof}: {:?}", score.r_squared);
    }
}
