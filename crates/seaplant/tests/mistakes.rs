//! What users get wrong is named, and nothing is named of logs without a mistake.

use std::f64::consts::FRAC_PI_2;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use seaplant::quantity::{Attitude, Axis, World};
use seaplant::results::{Results, Trust};
use seaplant::{
    Caveat, CaveatCode, Dof, IdentifyOptions, Method, QuadraticThrust, Quantity, Recording, Role,
    ThrustCurve, Thruster, ThrusterInput, Timed, Trial, TrialSetup, Vehicle, identify,
    likely_mistakes,
};

const STEP_S: f64 = 0.02;
const EVERY: usize = 5;
const SECONDS: f64 = 240.0;

/// m₁₁, m₂₂, I₃₃ and their drag per square of speed: a vehicle of 60 kg in air.
const MASS: [f64; 3] = [80.0, 120.0, 12.0];
const DRAG: [f64; 3] = [90.0, 160.0, 14.0];
const DRY_KG: f64 = 60.0;

/// Place and direction of four thrusters at the corners, at 45° to the bow.
const CORNERS: [(f64, f64, f64); 4] =
    [(0.4, 0.3, -45.0), (0.4, -0.3, 45.0), (-0.4, 0.3, 45.0), (-0.4, -0.3, -45.0)];

fn vehicle() -> Vehicle {
    let thruster = |(k, (x, y, degrees)): (usize, &(f64, f64, f64))| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let law = QuadraticThrust { forward: 0.01, reverse: 0.01, ..QuadraticThrust::default() };
        let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
        let name = format!("T{}", k + 1);
        Thruster::new(&name, [*x, *y, 0.0], [cos, sin, 0.0], curve).expect("valid")
    };
    let thrusters = CORNERS.iter().enumerate().map(thruster).collect();
    let dry_mass_kg = Some(DRY_KG);
    Vehicle { name: "corners".into(), dry_mass_kg, thrusters, ..Vehicle::default() }
}

/// A trial in which every thruster keeps levels by chance for some seconds, in gusts of 1 s whose forces have a standard
/// deviation.
fn driven(seed: u64, gust_n: f64) -> Recording {
    let vehicle = vehicle();
    let mut chance = ChaCha8Rng::seed_from_u64(seed);
    let mut weather = ChaCha8Rng::seed_from_u64(100 + seed);
    let (mut nu, mut heading, mut gusts) = ([0.0_f64; 3], 0.0_f64, [0.0_f64; 3]);
    let (mut force, mut left_s) = ([0.0_f64; 4], [0.0_f64; 4]);
    let mut time = Vec::new();
    let mut columns = vec![Vec::new(); 8];
    for k in 0..(SECONDS / STEP_S) as usize {
        for (force, left_s) in force.iter_mut().zip(&mut left_s) {
            *left_s -= STEP_S;
            if *left_s < 0.0 {
                *force = chance.random_range(-40.0..40.0);
                *left_s = chance.random_range(2.0..8.0);
            }
        }
        let mut wrench = [0.0; 3];
        for (thruster, force) in vehicle.thrusters.iter().zip(force) {
            let unit = thruster.unit_wrench();
            [0, 1, 5].iter().zip(&mut wrench).for_each(|(axis, sum)| *sum += unit[*axis] * force);
        }
        if k % EVERY == 0 {
            time.push(k as f64 * STEP_S);
            let mut noise = || 0.01 * (chance.random::<f64>() - 0.5);
            let seen = [nu[0] + noise(), nu[1] + noise(), nu[2] + noise(), heading];
            columns[..4].iter_mut().zip(seen).for_each(|(column, x)| column.push(x));
            let told = force.map(|force| (force.abs() / 0.01).sqrt().copysign(force));
            columns[4..].iter_mut().zip(told).for_each(|(column, x)| column.push(x));
        }
        let fade = (-STEP_S).exp();
        for (gust, arm) in gusts.iter_mut().zip([1.0, 1.0, 0.2]) {
            // Uniform between −√3 and √3, with a variance of 1.
            let by_chance = weather.random_range(-3.0_f64.sqrt()..3.0_f64.sqrt());
            *gust = fade * *gust + arm * gust_n * (1.0 - fade * fade).sqrt() * by_chance;
        }
        wrench.iter_mut().zip(gusts).for_each(|(sum, gust)| *sum += gust);
        let [u, v, r] = nu;
        let [m, n, _] = MASS;
        // Rigid body and added mass turn with the vehicle; their moment is Munk's.
        let turning = [n * v * r, -m * u * r, (m - n) * u * v];
        for axis in 0..3 {
            let drag = DRAG[axis] * nu[axis] * nu[axis].abs();
            nu[axis] += STEP_S * (wrench[axis] + turning[axis] - drag) / MASS[axis];
        }
        heading += STEP_S * nu[2];
    }
    let thruster =
        |k: usize| Quantity::Thruster { name: format!("T{k}"), input: ThrusterInput::Speed };
    let names = [
        Quantity::DvlVelocity(Axis::X),
        Quantity::DvlVelocity(Axis::Y),
        Quantity::Rate(Axis::Z),
        Quantity::Attitude(Attitude::Heading),
        thruster(1),
        thruster(2),
        thruster(3),
        thruster(4),
    ];
    let series = |column| Timed::new("test", time.clone(), column).expect("valid");
    names.into_iter().zip(columns.into_iter().map(series)).collect()
}

/// What is named of two trials of a recording and a vehicle that were changed.
fn named(change: impl Fn(&mut Recording, &mut Vehicle)) -> Vec<Caveat> {
    let axes = [Dof::Surge, Dof::Sway, Dof::Yaw];
    named_of(&axes, change)
}

fn named_of(axes: &[Dof], change: impl Fn(&mut Recording, &mut Vehicle)) -> Vec<Caveat> {
    named_in_gusts(axes, 0.0, change)
}

fn named_in_gusts(
    axes: &[Dof],
    gust_n: f64,
    change: impl Fn(&mut Recording, &mut Vehicle),
) -> Vec<Caveat> {
    let setup = TrialSetup { dofs: axes.to_vec(), ..TrialSetup::default() };
    let (vehicle, trials) = trials(&setup, gust_n, change);
    likely_mistakes(&vehicle, &trials)
}

/// Two trials to fit of recordings and a vehicle that were changed, and one held out.
fn trials(
    setup: &TrialSetup,
    gust_n: f64,
    change: impl Fn(&mut Recording, &mut Vehicle),
) -> (Vehicle, Vec<Trial>) {
    let mut vehicle = vehicle();
    let recordings = [1, 2, 3].map(|seed| {
        let mut recording = driven(seed, gust_n);
        vehicle = self::vehicle();
        change(&mut recording, &mut vehicle);
        recording
    });
    let trial = |(k, recording): (usize, &Recording)| {
        let role = if k == 2 { Role::HoldOut } else { Role::Fit };
        let setup = TrialSetup { name: format!("{k}"), role, ..setup.clone() };
        Trial::new(setup, recording, &vehicle).expect("complete")
    };
    let trials = recordings.iter().enumerate().map(trial).collect();
    (vehicle, trials)
}

/// Asserts that one mistake is named, with all of some words.
fn assert_says(found: &[Caveat], words: &[&str]) {
    let [only] = found else { panic!("one mistake was made: {found:#?}") };
    assert_eq!(only.code, CaveatCode::LikelyMistake);
    let message = &only.message;
    words.iter().for_each(|word| assert!(message.contains(word), "no `{word}`: {message}"));
}

fn scale(recording: &mut Recording, quantity: &Quantity, factor: f64) {
    let series = recording.get_mut(quantity).expect("logged");
    *series = series.map(|x| factor * x);
}

fn exchange(recording: &mut Recording, a: &Quantity, b: &Quantity) {
    let (x, y) = (recording[a].clone(), recording[b].clone());
    recording.insert(a.clone(), y);
    recording.insert(b.clone(), x);
}

const X: Quantity = Quantity::DvlVelocity(Axis::X);
const Y: Quantity = Quantity::DvlVelocity(Axis::Y);
const R: Quantity = Quantity::Rate(Axis::Z);
const HEADING: Quantity = Quantity::Attitude(Attitude::Heading);

#[test]
fn nothing_is_named_of_logs_without_a_mistake() {
    assert_eq!(named(|_, _| {}), []);
    for dof in [Dof::Surge, Dof::Sway, Dof::Yaw] {
        assert_eq!(named_of(&[dof], |_, _| {}), []);
    }
}

#[test]
fn a_reversed_velocity_is_named_with_its_channel() {
    let found = named(|recording, _| scale(recording, &Y, -1.0));
    assert_says(&found, &["velocity of sway looks reversed", "`negate = true`", "dvl.velocity.y"]);
    let found = named_of(&[Dof::Surge], |recording, _| scale(recording, &X, -1.0));
    assert_says(&found, &["velocity of surge looks reversed", "dvl.velocity.x"]);
}

/// Either makes ω × r at the sensor wrong, too.
#[test]
fn a_reversed_velocity_or_rate_is_named_where_the_dvl_is_off_the_origin() {
    let ahead_m = 1.0;
    let placed = |recording: &mut Recording, vehicle: &mut Vehicle| {
        vehicle.sensors.dvl.position_body.x = ahead_m;
        let (y, r) = (recording[&Y].clone(), recording[&R].clone());
        let both = y.values().iter().zip(r.values()).map(|(y, r)| y + ahead_m * r);
        recording.insert(Y, y.with_values("at the DVL", both.collect()).expect("finite"));
    };
    assert_eq!(named(placed), []);
    let found = named(|recording, vehicle| {
        placed(recording, vehicle);
        scale(recording, &Y, -1.0);
    });
    assert_says(&found, &["velocity of sway looks reversed", "dvl.velocity.y"]);
    let found = named(|recording, vehicle| {
        placed(recording, vehicle);
        scale(recording, &R, -1.0);
        scale(recording, &HEADING, -1.0);
    });
    assert_says(&found, &["velocity of yaw looks reversed", "rate.yaw"]);
}

/// Gusts as strong as the thrusters leave most motion unexplained.
#[test]
fn a_reversed_velocity_is_named_where_gusts_hide_thrust() {
    for axes in [&[Dof::Surge, Dof::Sway, Dof::Yaw][..], &[Dof::Sway]] {
        assert_eq!(named_in_gusts(axes, 80.0, |_, _| {}), []);
        let found = named_in_gusts(axes, 40.0, |recording, _| scale(recording, &Y, -1.0));
        assert_says(&found, &["velocity of sway looks reversed", "dvl.velocity.y"]);
    }
}

#[test]
fn a_reversed_thruster_is_named() {
    let turn = |_: &mut Recording, vehicle: &mut Vehicle| {
        vehicle.thrusters[2].direction_body = -vehicle.thrusters[2].direction_body;
    };
    assert_says(&named(turn), &["thruster `T3` looks reversed", "reversed = true", "vehicle.toml"]);
}

#[test]
fn exchanged_thrusters_are_named() {
    let of = |name: &str| Quantity::Thruster { name: name.into(), input: ThrusterInput::Speed };
    let found = named(|recording, _| exchange(recording, &of("T1"), &of("T2")));
    assert_says(&found, &["`T1` and `T2` look exchanged", "thruster.T1"]);
}

#[test]
fn exchanged_columns_of_velocity_are_named() {
    let found = named(|recording, _| exchange(recording, &X, &Y));
    assert_says(&found, &["velocities of surge and sway look exchanged", "dvl.velocity.x"]);
}

#[test]
fn a_dvl_at_an_angle_is_named_with_the_angle_to_state() {
    for degrees in [45.0_f64, 90.0] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let found = named(|recording, _| {
            let (x, y) = (recording[&X].clone(), recording[&Y].clone());
            let turned = |a: f64, b: f64| {
                let both = x.values().iter().zip(y.values()).map(|(x, y)| a * x + b * y);
                x.with_values("turned", both.collect()).expect("finite")
            };
            // What a sensor reads whose axes are turned to starboard from the vehicle's.
            recording.insert(X, turned(cos, sin));
            recording.insert(Y, turned(-sin, cos));
        });
        assert_says(&found, &[&format!("rotation_deg = [0, 0, {degrees}]"), "[sensor.dvl]"]);
    }
}

#[test]
fn axes_forward_port_and_up_are_named_as_such() {
    let found = named(|recording, _| {
        scale(recording, &R, -1.0);
        scale(recording, &HEADING, -1.0);
        scale(recording, &Y, -1.0);
    });
    let said: String = found.iter().map(|caveat| caveat.message.clone()).collect();
    assert!(said.contains("sway") && said.contains("yaw") && said.contains("reversed"), "{said}");
}

/// Velocity north and east and heading in place of a DVL and a gyroscope.
fn over_ground(recording: &mut Recording) {
    let (x, y) = (recording.remove(&X).expect("logged"), recording.remove(&Y).expect("logged"));
    recording.remove(&R);
    let of = |part: &dyn Fn(f64, f64, f64) -> f64| {
        let heading = recording[&HEADING].values().iter();
        let both = x.values().iter().zip(y.values()).zip(heading);
        let values = both.map(|((u, v), heading)| part(*u, *v, *heading)).collect();
        x.with_values("over ground", values).expect("finite")
    };
    let north = of(&|u, v, heading| u * heading.cos() - v * heading.sin());
    let east = of(&|u, v, heading| u * heading.sin() + v * heading.cos());
    recording.insert(NORTH, north);
    recording.insert(EAST, east);
}

const NORTH: Quantity = Quantity::WorldVelocity(World::North);
const EAST: Quantity = Quantity::WorldVelocity(World::East);

#[test]
fn headings_that_turn_velocity_over_ground_wrongly_are_named() {
    let named_with = |heading: &dyn Fn(f64) -> f64| {
        named(|recording, _| {
            over_ground(recording);
            let wrong = recording[&HEADING].map(heading);
            recording.insert(HEADING, wrong);
        })
    };
    assert_eq!(named_with(&|x| x), []);
    let degrees = named_with(&f64::to_degrees);
    assert_says(&degrees, &["attitude.heading looks in deg and read as rad", "correct `unit`"]);
    let radians = named_with(&f64::to_radians);
    assert_says(&radians, &["attitude.heading looks in rad and read as deg", "correct `unit`"]);
    let reversed = named_with(&|x| -x);
    assert_says(&reversed, &["attitude.heading looks reversed", "`negate = true`"]);
    let from_east = named_with(&|x| FRAC_PI_2 - x);
    assert_says(&from_east, &["counterclockwise from east", "`negate = true, offset = -90`"]);
    let turned = named_with(&|x| x + FRAC_PI_2);
    assert_says(&turned, &["compass looks turned by 90°", "[0, 0, 90]", "[sensor.attitude]"]);
}

#[test]
fn directions_of_the_world_that_are_exchanged_or_reversed_are_named() {
    let found = named(|recording, _| {
        over_ground(recording);
        exchange(recording, &NORTH, &EAST);
    });
    assert_says(&found, &["velocity.north and velocity.east look exchanged", "columns"]);
    let found = named(|recording, _| {
        over_ground(recording);
        scale(recording, &EAST, -1.0);
    });
    assert_says(&found, &["velocity.east looks reversed", "`negate = true`"]);
}

#[test]
fn a_rate_and_an_angle_that_turn_opposite_ways_are_named() {
    let found = named(|recording, _| scale(recording, &HEADING, -1.0));
    assert_says(&found, &["attitude.heading looks reversed", "`negate = true`"]);
    let found = named(|recording, _| scale(recording, &R, 57.29578));
    assert_says(&found, &["rate.yaw", "deg/s"]);
}

#[test]
fn units_of_force_and_speed_that_make_impossible_masses_are_named() {
    let found = named(|_, vehicle| {
        for thruster in &mut vehicle.thrusters {
            let ThrustCurve::Quadratic { law, .. } = &mut thruster.curve else { return };
            (law.forward, law.reverse) = (law.forward / 9.80665, law.reverse / 9.80665);
        }
    });
    assert_says(&found, &["kgf", "thrust curves in vehicle.toml"]);
    let found = named(|recording, _| [X, Y].iter().for_each(|what| scale(recording, what, 3.6)));
    assert_says(&found, &["km/h"]);
}

#[test]
fn thrusters_placed_in_millimetres_are_named() {
    let found = named(|_, vehicle| {
        vehicle.thrusters.iter_mut().for_each(|thruster| thruster.position_body *= 1000.0);
    });
    assert_says(&found, &["`T1`", "mm", "position_m"]);
}

/// A vehicle that only its propeller ahead pushes, with its DVL at 45° and nothing in the file of it.
#[test]
fn a_dvl_at_45_degrees_shows_without_lateral_thrust() {
    let law = QuadraticThrust { forward: 0.01, reverse: 0.01, ..QuadraticThrust::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let main = Thruster::new("main", [0.0; 3], [1.0, 0.0, 0.0], curve).expect("valid");
    let vehicle = Vehicle { name: "one".into(), thrusters: vec![main], ..Vehicle::default() };
    let time: Vec<f64> = (0..3000).map(|k| 0.1 * f64::from(k)).collect();
    let told: Vec<f64> = time.iter().map(|t| 60.0 * (0.4 * t).sin()).collect();
    let mut u = 0.0_f64;
    let mut ahead = Vec::new();
    for n in &told {
        ahead.push(u);
        u += 0.1 * (0.01 * n * n.abs() - DRAG[0] * u * u.abs()) / MASS[0];
    }
    let series = |values: Vec<f64>| Timed::new("test", time.clone(), values).expect("valid");
    let part = |factor: f64| series(ahead.iter().map(|u| factor * u).collect());
    let half = 0.5_f64.sqrt();
    let speed = Quantity::Thruster { name: "main".into(), input: ThrusterInput::Speed };
    for (x, y, is_turned) in [(1.0, 0.02, false), (half, -half, true)] {
        let recording =
            Recording::from([(X, part(x)), (Y, part(y)), (speed.clone(), series(told.clone()))]);
        let setup = TrialSetup { name: "t".into(), dofs: vec![Dof::Surge], ..Default::default() };
        let trial = Trial::new(setup, &recording, &vehicle).expect("complete");
        let found = likely_mistakes(&vehicle, &[trial]);
        match is_turned {
            true => assert_says(&found, &["turned by 45°", "rotation_deg = [0, 0, 45]"]),
            false => assert_eq!(found, []),
        }
    }
}

/// What is identified of surge by itself, by equation error.
fn surge(change: impl Fn(&mut Recording, &mut Vehicle)) -> Results {
    alone(Dof::Surge, change)
}

fn alone(dof: Dof, change: impl Fn(&mut Recording, &mut Vehicle)) -> Results {
    let setup = TrialSetup { dofs: vec![dof], ..TrialSetup::default() };
    let (vehicle, trials) = trials(&setup, 0.0, change);
    let options =
        IdentifyOptions { methods: vec![Method::EquationError], ..IdentifyOptions::default() };
    identify(&vehicle, &trials, &options).results
}

#[test]
fn a_fit_that_fails_says_which_mistake_explains_the_logs() {
    let results = surge(|recording, _| scale(recording, &X, -1.0));
    assert!(results.plants.is_empty());
    let told = results.failures.iter().any(|failure| {
        failure.message.contains("velocity of surge looks reversed")
            && failure.message.contains("`negate = true` for \"dvl.velocity.x\"")
    });
    assert!(told, "{:?}", results.failures);
}

/// With levers a thousand times as long a plant of yaw predicts as well, with an inertia a thousand times as
/// large.
#[test]
fn thrusters_placed_in_millimetres_are_named_whatever_the_plant_predicts() {
    let results = alone(Dof::Yaw, |_, vehicle| {
        vehicle.thrusters.iter_mut().for_each(|thruster| thruster.position_body *= 1000.0);
    });
    let plant = &results.plants["yaw"];
    assert_eq!(plant.verdict.trust, Trust::DoNotUse, "{:?}", plant.verdict);
    assert!(plant.caveats[0].message.contains("position_m"), "{:?}", plant.caveats);
}

#[test]
fn plants_of_logs_without_a_mistake_have_none() {
    let results = surge(|_, _| {});
    let plant = &results.plants["surge"];
    assert!(plant.caveats.iter().all(|caveat| caveat.code != CaveatCode::LikelyMistake));
}
