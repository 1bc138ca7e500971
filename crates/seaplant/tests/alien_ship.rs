//! A ship that others published, written here a second time after their equations, comes back from
//! the logs of free runs.
//!
//! KVLCC2, the model of 7 m, by the MMG standard method [Yasukawa2015, tables 1 to 4]: hull forces
//! are polynomials in v' and r', thrust follows an open-water curve, the rudder stands in the race
//! and behind a hull that straightens its flow.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix2, Vector2, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use seaplant::motion::{Inputs, simulate};
use seaplant::plant::{HullModel, Plant, RudderFlow, Signal, Symmetry, WakeByDrift};
use seaplant::quantity::{Attitude, Axis};
use seaplant::results::{PlantResult, Results, ToldBy};
use seaplant::{
    Caveat, CaveatCode, Dof, Fin, IdentifyOptions, PlantPlan, PropellerCurve, QuadraticThrust,
    Quantity, Recording, Role, Severity, Surface, ThrustCurve, Thruster, ThrusterInput, Timed,
    Trial, TrialSetup, Vehicle, identify, plant_of_result,
};

const DENSITY: f64 = 1000.0;
const LENGTH: f64 = 7.0;
const DRAUGHT: f64 = 0.46;
const MASS: f64 = 3270.0;
const GRAVITY_AT: f64 = 0.25;
/// Radius of inertia, as a part of length.
const RADIUS: f64 = 0.25;
/// m_x', m_y', J_z'.
const ADDED: [f64; 3] = [0.022, 0.223, 0.011];
const RESISTANCE: f64 = 0.022;
/// X_vv, X_vr, X_rr, X_vvvv.
const ALONG: [f64; 4] = [-0.040, 0.002, 0.011, 0.771];
/// Y and N: v, r, vvv, vvr, vrr, rrr.
const SIDE: [f64; 6] = [-0.315, 0.083, -1.607, 0.379, -0.391, 0.008];
const TURN: [f64; 6] = [-0.137, -0.049, -0.030, -0.294, 0.055, -0.013];
const PROPELLER_M: f64 = 0.216;
const OPEN_WATER: [f64; 3] = [0.2931, -0.2753, -0.1385];
const WAKE: f64 = 0.40;
const THRUST_DEDUCTION: f64 = 0.220;
const RUDDER_M2: f64 = 0.0539;
const LIFT_SLOPE: f64 = 2.747;
const FLOW: RudderFlow = RudderFlow {
    wake_ratio: 1.09,
    race_factor: 0.50,
    diameter_to_span: 0.626,
    straightening: [0.395, 0.640],
    flow_at_m: -0.710 * LENGTH,
    steering_deduction: 0.387,
    hull_increase: 0.312,
    hull_at_m: -0.464 * LENGTH,
};
/// How the wake changes with drift at the propeller, −0.48 L: C₁, and C₂ for flow from port and
/// from starboard.
const WAKE_BY_DRIFT: (f64, [f64; 2]) = (2.0, [1.1, 1.6]);
/// Turn rate of the rudder: 2.34 degrees a second at full scale, by Froude.
const RUDDER_RATE: f64 = 0.276;

/// The ship, and whether its wake changes with drift.
#[derive(Clone, Copy)]
struct Ship {
    wake_drifts: bool,
}

impl Ship {
    fn masses() -> [f64; 4] {
        let scale = 0.5 * DENSITY * LENGTH * LENGTH * DRAUGHT;
        let inertia = MASS * ((RADIUS * LENGTH).powi(2) + GRAVITY_AT * GRAVITY_AT);
        [
            MASS + ADDED[0] * scale,
            MASS + ADDED[1] * scale,
            MASS * GRAVITY_AT,
            inertia + ADDED[2] * scale * LENGTH * LENGTH,
        ]
    }

    /// u̇, v̇, ṙ at u, v, r, an angle of the rudder, rad, and revolutions a second.
    fn rate(self, [u, v, r]: [f64; 3], delta: f64, n: f64) -> [f64; 3] {
        let speed = u.hypot(v);
        let drift = (-v).atan2(u);
        let (v1, r1) = (v / speed, r * LENGTH / speed);
        let sum = |c: &[f64; 6]| {
            c[0] * v1
                + c[1] * r1
                + c[2] * v1.powi(3)
                + c[3] * v1 * v1 * r1
                + c[4] * v1 * r1 * r1
                + c[5] * r1.powi(3)
        };
        let scale = 0.5 * DENSITY * LENGTH * DRAUGHT * speed * speed;
        let along = ALONG[0] * v1 * v1 + ALONG[1] * v1 * r1 + ALONG[2] * r1 * r1;
        let hull_x = scale * (along + ALONG[3] * v1.powi(4) - RESISTANCE);
        let (hull_y, hull_n) = (scale * sum(&SIDE), scale * LENGTH * sum(&TURN));
        let at_propeller = drift + 0.48 * r1;
        let drifts = if self.wake_drifts {
            let (c1, c2) = (WAKE_BY_DRIFT.0, WAKE_BY_DRIFT.1[usize::from(at_propeller > 0.0)]);
            1.0 + (1.0 - (-c1 * at_propeller.abs()).exp()) * (c2 - 1.0)
        } else {
            1.0
        };
        let u_p = u * (1.0 - WAKE) * drifts;
        let j = u_p / (n * PROPELLER_M);
        let k_t = OPEN_WATER[0] + OPEN_WATER[1] * j + OPEN_WATER[2] * j * j;
        let thrust = (1.0 - THRUST_DEDUCTION) * DENSITY * n * n * PROPELLER_M.powi(4) * k_t;
        let at_rudder = drift - FLOW.flow_at_m / LENGTH * r1;
        let gamma = FLOW.straightening[usize::from(at_rudder > 0.0)];
        let v_r = speed * gamma * at_rudder;
        let race = 1.0 + FLOW.race_factor * ((1.0 + 8.0 * k_t / (PI * j * j)).sqrt() - 1.0);
        let eta = FLOW.diameter_to_span;
        let u_r = FLOW.wake_ratio * u_p * (eta * race * race + 1.0 - eta).sqrt();
        let attack = delta - v_r.atan2(u_r);
        let square = u_r * u_r + v_r * v_r;
        let normal = 0.5 * DENSITY * RUDDER_M2 * square * LIFT_SLOPE * attack.sin();
        let x = hull_x + thrust - (1.0 - FLOW.steering_deduction) * normal * delta.sin();
        let y = hull_y - (1.0 + FLOW.hull_increase) * normal * delta.cos();
        let lever = -0.5 * LENGTH + FLOW.hull_increase * FLOW.hull_at_m;
        let n = hull_n - lever * normal * delta.cos();
        let [m11, m22, m23, m33] = Self::masses();
        let across = Matrix2::new(m22, m23, m23, m33);
        let force = Vector2::new(y - m11 * u * r, n - m23 * u * r);
        let [v_dot, r_dot]: [f64; 2] = (across.try_inverse().expect("a body") * force).into();
        [(x + m22 * v * r + m23 * r * r) / m11, v_dot, r_dot]
    }

    /// What the identified plant should have.
    fn truth() -> BTreeMap<String, f64> {
        let [m11, m22, m23, m33] = Self::masses();
        let scale = 0.5 * DENSITY * LENGTH * DRAUGHT;
        let munk = m22 - m11;
        let mut all: BTreeMap<String, f64> = BTreeMap::new();
        let mut put = |name: &str, value: f64| {
            all.insert(name.to_owned(), value);
        };
        put("mass.surge", m11);
        put("mass.sway", m22);
        put("mass.sway-yaw", m23);
        put("mass.yaw", m33);
        put("surge: |u|u", scale * RESISTANCE);
        // R₀ U² is R₀ u² + R₀ v².
        put("surge: vv", scale * (RESISTANCE - ALONG[0]));
        put("surge: vr", -scale * LENGTH * ALONG[1]);
        put("surge: rr", -scale * LENGTH * LENGTH * ALONG[2]);
        put("surge: vvvv/UU", -scale * ALONG[3]);
        let names = ["Uv", "Ur", "vvv/U", "vvr/U", "vrr/U", "rrr/U"];
        for (k, name) in names.into_iter().enumerate() {
            let rotations = LENGTH.powi(name.matches('r').count() as i32);
            put(&format!("sway: {name}"), -scale * rotations * SIDE[k]);
            // Munk's moment is in N_v: (m22 − m11) u v with u = U − v²/(2U) − ….
            let munk = [-munk, 0.0, 0.5 * munk, 0.0, 0.0, 0.0][k];
            put(&format!("yaw: {name}"), munk - scale * LENGTH * rotations * TURN[k]);
        }
        all
    }
}

/// What rudder and propeller are told, at a time, with the heading, rad.
type Orders = Box<dyn Fn(f64, f64) -> f64>;

/// A free run: orders of the rudder, rad, and revolutions a second.
struct Run {
    rudder: Orders,
    shaft: Box<dyn Fn(f64) -> f64>,
    length_s: f64,
}

/// What a run was, each step of 0.2 s.
#[derive(Default)]
struct Track {
    time_s: Vec<f64>,
    velocity: Vec<[f64; 3]>,
    heading: Vec<f64>,
    place: Vec<[f64; 2]>,
    angle: Vec<f64>,
    shaft: Vec<f64>,
}

const STEP_S: f64 = 0.2;
const SUBSTEPS: usize = 4;
const APPROACH: f64 = 1.17;
const REVOLUTIONS: f64 = 12.0;

impl Run {
    fn track(&self, ship: Ship) -> Track {
        let (mut x, mut heading, mut place) = ([APPROACH, 0.0, 0.0], 0.0, [0.0; 2]);
        let (mut delta, mut track) = (0.0_f64, Track::default());
        let h = STEP_S / SUBSTEPS as f64;
        for k in 0..(self.length_s / STEP_S) as usize {
            let t = STEP_S * k as f64;
            let shaft = (self.shaft)(t);
            track.time_s.push(t);
            track.velocity.push(x);
            track.heading.push(heading);
            track.place.push(place);
            track.angle.push(delta);
            track.shaft.push(shaft);
            // The angle goes straight from sample to sample, as the log has it.
            let order = (self.rudder)(t, heading);
            let turn = (order - delta).clamp(-RUDDER_RATE * STEP_S, RUDDER_RATE * STEP_S);
            for part in 0..SUBSTEPS {
                let at = |w: f64| delta + turn * (part as f64 + w) / SUBSTEPS as f64;
                let next = |x: [f64; 3], by: [f64; 3], h: f64| {
                    [x[0] + h * by[0], x[1] + h * by[1], x[2] + h * by[2]]
                };
                let a = ship.rate(x, at(0.0), shaft);
                let b = ship.rate(next(x, a, 0.5 * h), at(0.5), shaft);
                let c = ship.rate(next(x, b, 0.5 * h), at(0.5), shaft);
                let d = ship.rate(next(x, c, h), at(1.0), shaft);
                let mean = std::array::from_fn(|i| (a[i] + 2.0 * (b[i] + c[i]) + d[i]) / 6.0);
                let end = next(x, mean, h);
                let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (x[i] + end[i]));
                let (sin, cos) = (heading + 0.5 * h * middle[2]).sin_cos();
                place[0] += h * (middle[0] * cos - middle[1] * sin);
                place[1] += h * (middle[0] * sin + middle[1] * cos);
                heading += h * middle[2];
                x = end;
            }
            delta += turn;
        }
        track
    }
}

fn zigzag(degrees: f64) -> Orders {
    let side = std::cell::Cell::new(1.0);
    let limit = degrees.to_radians();
    Box::new(move |_, heading| {
        if side.get() * heading > limit {
            side.set(-side.get());
        }
        side.get() * limit
    })
}

fn circle(degrees: f64) -> Orders {
    Box::new(move |_, _| degrees.to_radians())
}

/// Orders that change at odd times, up to 35 degrees.
fn helm(seed: f64) -> Orders {
    Box::new(move |t, _| {
        let step = (t / 9.0 + (0.11 * t + seed).sin()).floor();
        35_f64.to_radians() * (12.9898 * (step + 7.0 * seed)).sin()
    })
}

fn steady(n: f64) -> Box<dyn Fn(f64) -> f64> {
    Box::new(move |_| n)
}

/// Revolutions that change every half a minute, 6 to 14 a second.
fn changing(seed: f64) -> Box<dyn Fn(f64) -> f64> {
    Box::new(move |t| 10.0 + 4.0 * (4.1 * (t / 30.0 + seed).floor() + seed).sin())
}

fn runs() -> Vec<(&'static str, Role, Run)> {
    let run = |rudder, shaft, length_s| Run { rudder, shaft, length_s };
    vec![
        ("starboard", Role::Fit, run(circle(35.0), steady(REVOLUTIONS), 80.0)),
        ("port", Role::Fit, run(circle(-25.0), steady(10.0), 80.0)),
        ("zigzag 20", Role::Fit, run(zigzag(20.0), steady(REVOLUTIONS), 80.0)),
        ("zigzag 10", Role::Fit, run(zigzag(10.0), changing(3.0), 120.0)),
        ("free 1", Role::Fit, run(helm(1.0), changing(1.0), 200.0)),
        ("free 2", Role::Fit, run(helm(2.0), changing(2.0), 200.0)),
        ("aside", Role::HoldOut, run(helm(5.0), changing(4.0), 120.0)),
    ]
}

/// Standard deviations: 4 mm/s, 0.05 degrees a second, 0.1 degrees.
const NOISE: [f64; 3] = [0.004, 0.000_9, 0.0017];

fn trial(name: &str, role: Role, track: &Track, seed: u64, vehicle: &Vehicle) -> Trial {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut log = |values: Vec<f64>, std: f64| {
        let noise = Normal::new(0.0, std).expect("positive");
        let noisy: Vec<f64> = values.into_iter().map(|x| x + noise.sample(&mut random)).collect();
        Timed::new("log", track.time_s.clone(), noisy).expect("valid")
    };
    let of = |k: usize| track.velocity.iter().map(|x| x[k]).collect::<Vec<_>>();
    let (kind, rudder) = (Surface::Rudder, "rudder".to_owned());
    let propeller =
        Quantity::Thruster { name: "propeller".to_owned(), input: ThrusterInput::Speed };
    let recording = Recording::from([
        (Quantity::Velocity(Dof::Surge), log(of(0), NOISE[0])),
        (Quantity::Velocity(Dof::Sway), log(of(1), NOISE[0])),
        (Quantity::Rate(Axis::Z), log(of(2), NOISE[1])),
        (Quantity::Attitude(Attitude::Heading), log(track.heading.clone(), NOISE[2])),
        (Quantity::SurfaceAngle { kind, name: rudder }, log(track.angle.clone(), 0.0)),
        (propeller, log(track.shaft.iter().map(|n| TAU * n).collect(), 0.0)),
    ]);
    let together = vec![vec![Dof::Surge, Dof::Sway, Dof::Yaw]];
    let setup = TrialSetup { name: name.to_owned(), role, together, ..TrialSetup::default() };
    Trial::new(setup, &recording, vehicle).expect("complete")
}

/// What is known of the ship beside its logs: propeller in open water and behind the hull, and
/// the rudder.
fn vehicle(drifts: bool) -> Vehicle {
    let law = QuadraticThrust { forward: 1.0, reverse: 1.0, ..Default::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let propeller = Thruster::new("propeller", [-3.36, 0.0, 0.0], [1.0, 0.0, 0.0], curve);
    let open_water = PropellerCurve {
        diameter_m: PROPELLER_M,
        k_t: OPEN_WATER,
        wake: WAKE,
        wake_by_drift: drifts
            .then_some(WakeByDrift { rate: WAKE_BY_DRIFT.0, greatest: WAKE_BY_DRIFT.1 }),
        thrust_deduction: Some(THRUST_DEDUCTION),
    };
    let propeller = Thruster { open_water: Some(open_water), ..propeller.expect("a propeller") };
    let rudder = Fin::new(Surface::Rudder, "rudder", [-3.5, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let rudder = Fin {
        area_m2: Some(RUDDER_M2),
        lift_slope: Some(LIFT_SLOPE),
        slipstream: Some("propeller".to_owned()),
        flow: Some(FLOW),
        ..rudder.expect("a rudder")
    };
    Vehicle {
        size_m: Some([LENGTH, 1.27, DRAUGHT]),
        draught_m: Some(DRAUGHT),
        water_density_kg_m3: DENSITY,
        propellers: vec![propeller],
        fins: vec![rudder.checked().expect("possible")],
        ..Vehicle::default()
    }
}

fn plan(search: bool) -> PlantPlan {
    PlantPlan {
        axes: vec![Dof::Surge, Dof::Sway, Dof::Yaw],
        symmetry: Symmetry::PortStarboard,
        model: Some(HullModel::Mmg),
        terms: Vec::new(),
        effects: Vec::new(),
        hold: BTreeMap::new(),
        search,
    }
}

fn identified(ship: Ship, vehicle: &Vehicle, plan: PlantPlan) -> Results {
    identified_from(ship, vehicle, plan, |_| true)
}

/// From the runs of some names.
fn identified_from(
    ship: Ship,
    vehicle: &Vehicle,
    plan: PlantPlan,
    is_taken: impl Fn(&str) -> bool,
) -> Results {
    let of = |(k, (name, role, run)): (usize, (&str, Role, Run))| {
        trial(name, role, &run.track(ship), 100 + k as u64, vehicle)
    };
    let runs = runs().into_iter().enumerate().filter(|(_, (name, ..))| is_taken(name));
    let trials: Vec<Trial> = runs.map(of).collect();
    let options = IdentifyOptions { together: vec![plan], ..IdentifyOptions::default() };
    identify(vehicle, &trials, &options).results
}

/// Advance, transfer and tactical diameter, m.
fn numbers(heading: &[f64], place: &[[f64; 2]]) -> [f64; 3] {
    let at = |angle: f64| heading.iter().position(|x| x.abs() >= angle).expect("it turns");
    let (quarter, half) = (at(0.5 * PI), at(PI));
    [place[quarter][0], place[quarter][1].abs(), place[half][1].abs()]
}

/// The circle of an identified plant under the orders of a true one.
fn circle_of(plant: &Plant, track: &Track) -> [f64; 3] {
    let series = |values: Vec<f64>| Timed::new("in", track.time_s.clone(), values).expect("valid");
    let angle = Signal::Angle { kind: Surface::Rudder, name: "rudder".to_owned() };
    let shaft = track.shaft.iter().map(|n| TAU * n).collect();
    let all = BTreeMap::from([
        (angle, series(track.angle.clone())),
        (Signal::Drive("propeller".to_owned()), series(shaft)),
    ]);
    let read = plant.structure().signals();
    let signals = all.into_iter().filter(|(signal, _)| read.contains(signal)).collect();
    let inputs = Inputs { signals, ..Inputs::default() };
    let start = Vector6::new(APPROACH, 0.0, 0.0, 0.0, 0.0, 0.0);
    let moved = simulate(plant, &inputs, &start, &track.time_s).expect("bounded");
    let (mut heading, mut place) = (vec![0.0], vec![[0.0; 2]]);
    for pair in moved.velocity.windows(2) {
        let mean = 0.5 * (pair[0] + pair[1]);
        let last = heading[heading.len() - 1];
        let (sin, cos) = (last + 0.5 * STEP_S * mean[5]).sin_cos();
        let [north, east] = place[place.len() - 1];
        let (u, v) = (mean[0], mean[1]);
        place.push([north + STEP_S * (u * cos - v * sin), east + STEP_S * (u * sin + v * cos)]);
        heading.push(last + STEP_S * mean[5]);
    }
    numbers(&heading, &place)
}

/// Targets: numbers of a turning circle within 3 %, coefficients within 5 % or three standard
/// deviations.
const CIRCLE_PART: f64 = 0.03;
const PART: f64 = 0.05;
const DEVIATIONS: f64 = 3.0;

fn check_circles(ship: Ship, found: &PlantResult) {
    let plant = plant_of_result(found).expect("a plant");
    for degrees in [35.0, -35.0] {
        let run = Run { rudder: circle(degrees), shaft: steady(REVOLUTIONS), length_s: 120.0 };
        let track = run.track(ship);
        let truth = numbers(&track.heading, &track.place);
        let own = circle_of(&plant, &track);
        for (own, truth) in own.into_iter().zip(truth) {
            let off = own / truth - 1.0;
            assert!(off.abs() < CIRCLE_PART, "{degrees} degrees: {own} m against {truth} m");
        }
    }
}

fn plant_of(results: &Results) -> &PlantResult {
    assert!(results.failures.is_empty(), "{:?}", results.failures);
    &results.plants["surge-sway-yaw"]
}

#[test]
fn the_hull_of_a_published_ship_comes_back_from_free_runs() {
    let ship = Ship { wake_drifts: true };
    let vehicle = vehicle(true);
    // Its added mass is what only forced motion or charts tell: in a turn it looks like Y_r.
    let hold = BTreeMap::from([("mass.sway".to_owned(), Ship::masses()[1])]);
    let results = identified(ship, &vehicle, PlantPlan { hold, ..plan(false) });
    let found = plant_of(&results);
    let truth = Ship::truth();
    let fitted = found.parameters.iter().filter(|(_, x)| x.told_by != ToldBy::Stated);
    assert_eq!(fitted.clone().count(), 20);
    for (name, x) in fitted {
        let off = (x.value - truth[name]).abs();
        assert!(
            off <= PART * truth[name].abs() || off <= DEVIATIONS * x.std,
            "{name}: {} ± {} against {}",
            x.value,
            x.std,
            truth[name]
        );
    }
    // Those that ships are steered by.
    for name in
        ["mass.surge", "mass.yaw", "surge: |u|u", "sway: Uv", "sway: Ur", "yaw: Uv", "yaw: Ur"]
    {
        let off = found.parameters[name].value / truth[name] - 1.0;
        assert!(off.abs() < PART, "{name} is {:.1} % off", 100.0 * off);
    }
    check_circles(ship, found);
    check_prime(found);
}

/// Published numbers without dimension are in their intervals.
fn check_prime(found: &PlantResult) {
    let system = found.nondimensional.as_ref().expect("a length");
    assert_eq!((system.length_m, system.depth_m), (LENGTH, DRAUGHT));
    let published = [
        ("surge: |u|u", "X'_|u|u", -RESISTANCE),
        ("sway: Uv", "Y'_v", SIDE[0]),
        ("sway: vvr/U", "Y'_vvr", SIDE[3]),
        ("yaw: rrr/U", "N'_rrr", TURN[5]),
        ("yaw: Uv, with Munk's moment", "N'_v, with Munk's moment", TURN[0]),
    ];
    for (name, symbol, value) in published {
        let x = &system.coefficients[name];
        assert_eq!(x.symbol, symbol);
        let off = (x.value - value).abs();
        assert!(off < DEVIATIONS * x.std || off < PART * value.abs(), "{symbol}: {x:?}");
    }
}

#[test]
fn turning_circles_come_out_where_nothing_of_rudder_and_propeller_is_known() {
    let ship = Ship { wake_drifts: true };
    let law = QuadraticThrust { forward: 1.0, reverse: 1.0, ..Default::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let known = vehicle(false);
    let propellers = vec![Thruster { open_water: None, curve, ..known.propellers[0].clone() }];
    let rudder = Fin { area_m2: None, lift_slope: None, flow: None, ..known.fins[0].clone() };
    let vehicle = Vehicle { propellers, fins: vec![rudder], ..known };
    let [surge, sway, ..] = Ship::masses();
    let hold = BTreeMap::from([("mass.surge".to_owned(), surge), ("mass.sway".to_owned(), sway)]);
    let results = identified(ship, &vehicle, PlantPlan { hold, ..plan(true) });
    let found = plant_of(&results);
    // Its yaw inertia is not that of the ship, and the plant says that it need not be.
    let codes: Vec<CaveatCode> = found.caveats.iter().map(|caveat| caveat.code).collect();
    assert!(codes.contains(&CaveatCode::ThrustScale), "{codes:?}");
    check_circles(ship, found);
}

#[test]
fn added_mass_in_sway_and_what_looks_like_it_in_zigzags_are_named() {
    let (ship, vehicle) = (Ship { wake_drifts: true }, vehicle(true));
    let is_zigzag = |name: &str| name.starts_with("zigzag") || name == "aside";
    let results = identified_from(ship, &vehicle, plan(true), is_zigzag);
    let found = plant_of(&results);
    let is_named = |caveat: &&Caveat| {
        caveat.code == CaveatCode::Collinear
            && caveat.severity == Severity::Warning
            && caveat.message.contains("`mass.sway`")
    };
    let named = found.caveats.iter().find(is_named);
    let x = &found.parameters["mass.sway"];
    assert!(named.is_some(), "{x:?} {:?} {:?}", found.caveats, found.correlation);
}
