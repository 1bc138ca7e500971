mod blocks;
mod jitter;
mod known;
mod sensor_place;
mod slow_logs;
mod steering;
mod thrusters;

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Vector3, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::filter::{Filter, InstrumentNoise, Noise, Pass, PassInput, ThrustChanges};
use super::schedule::Schedule;
use super::sensor_lag::SensorLag;
use super::*;
use crate::motion::{HeldForces, Inputs, Moving, body_from_world, simulate};
use crate::plant::{Basis, Effect, EffectForce, Pusher, Signal, Symmetry};
use crate::random::gauss_markov;
use crate::{
    Grid, MeanAcceleration, PlacedThruster, ThrustUncertainty, ThrusterTrack, Timed, VelocityReport,
};

/// Differences over parts of 1e-6 of sums of thousands of squares.
const DIFFERENCE: f64 = 2e-3;

/// All actuator parameters.
const ALL: [bool; Actuator::COUNT] = [true; Actuator::COUNT];

const PLANAR: [Dof; 3] = [Dof::Surge, Dof::Sway, Dof::Yaw];

pub(super) fn planar() -> Plant {
    let structure = Structure::of(&PLANAR, Symmetry::PortStarboard).expect("three axes");
    let structure = structure.with("sway: r".parse().expect("a term")).expect("fits");
    let mass = [20.0, 21.0, 0.8, 0.6];
    let damping = [5.0, 40.0, 8.0, 90.0, 0.3, 1.5, 0.9];
    Plant::new(structure, mass.into_iter().chain(damping).collect()).expect("possible")
}

fn random(seed: u64) -> impl FnMut() -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    move || StandardNormal.sample(&mut random)
}

/// A force that takes a new level by chance after every so many instants.
fn stepped(
    time_s: &[f64],
    random: &mut impl FnMut() -> f64,
    (amplitude, dwell): (f64, usize),
) -> Timed {
    let mut level = 0.0;
    let at = |k: usize| {
        level = if k.is_multiple_of(dwell) { amplitude * random() } else { level };
        level
    };
    let values: Vec<f64> = (0..time_s.len()).map(at).collect();
    Timed::new("force", time_s.to_vec(), values).expect("valid")
}

/// What acts of a logged force, by steps of 1 ms: of a wrench `T τ̇ + τ = u(t − D)`; of a propeller
/// its speed √|τ| lags so, and its thrust in reverse is κ times what was logged.
fn behind(logged: &Timed, actuator: Actuator, is_of_propeller: bool) -> Timed {
    const STEP_S: f64 = 1e-3;
    let Actuator { lag_s, delay_s, log_reverse_ratio, log_change_within, .. } = actuator;
    if actuator == Actuator::default() {
        return logged.clone();
    }
    let lagging = |force: f64| match is_of_propeller {
        true => force.abs().sqrt().copysign(force),
        false => force,
    };
    let acting = |x: f64| match is_of_propeller {
        true if x < 0.0 => -x * x * log_reverse_ratio.exp(),
        true => x * x,
        false => x,
    };
    let (mut time_s, mut values, mut x) = (Vec::new(), Vec::new(), lagging(logged.values()[0]));
    for k in 0..(logged.last_s() / STEP_S) as usize {
        let goal = lagging(logged.held_at((k as f64 * STEP_S - delay_s).max(0.0)));
        x += if lag_s > 0.0 { STEP_S / lag_s * (goal - x) } else { goal - x };
        if k % 10 == 0 {
            let t = k as f64 * STEP_S;
            time_s.push(t);
            values.push(acting(x) * (log_change_within * (t / logged.last_s() - 0.5)).exp());
        }
    }
    Timed::new("force", time_s, values).expect("valid")
}

/// One thruster on each axis that a force is logged of.
fn of_thrusters(mut record: TrialRecord) -> TrialRecord {
    let of = |(axis, force): (usize, &Option<Timed>)| {
        let track = ThrusterTrack::of_force(1.0, force.as_ref()?);
        let mut wrench = Vector6::zeros();
        wrench[axis] = 1.0;
        Some(PlacedThruster { name: format!("{axis}"), track, wrench })
    };
    record.thrusters = record.force.iter().enumerate().filter_map(of).collect();
    record
}

/// A vehicle driven freely in a current, as its sensors see it.
pub(super) fn record(
    plant: &Plant,
    trial: &str,
    seed: u64,
    seconds: usize,
    noise: f64,
) -> TrialRecord {
    record_behind(plant, trial, seed, (seconds, noise), (Actuator::default(), false))
}

/// The same with thrust that is behind its log.
fn record_behind(
    plant: &Plant,
    trial: &str,
    seed: u64,
    (seconds, noise): (usize, f64),
    (actuator, is_of_propeller): (Actuator, bool),
) -> TrialRecord {
    let mut random = random(seed);
    let time_s: Vec<f64> = (0..10 * seconds).map(|k| 0.1 * k as f64).collect();
    let mut series = |amplitude, dwell| Some(stepped(&time_s, &mut random, (amplitude, dwell)));
    let force = [series(20.0, 37), series(20.0, 53), None, None, None, series(1.0, 23)];
    let speed = |(axis, force): (usize, &Option<Timed>)| {
        let speed = force.as_ref()?.map(|force| force.abs().sqrt().copysign(force));
        Some((Signal::PropellerSpeed(axis.to_string()), speed))
    };
    let signals: BTreeMap<Signal, Timed> = force.iter().enumerate().filter_map(speed).collect();
    let acting = force.clone().map(|logged| Some(behind(&logged?, actuator, is_of_propeller)));
    let empty = TrialRecord::until(trial, time_s[time_s.len() - 1]);
    let logged = TrialRecord { force, signals, ..empty };
    driven(plant, logged, acting, (&time_s, noise, &mut random))
}

/// A logged trial with the motion that acting forces make of it, in a current.
fn driven(
    plant: &Plant,
    logged: TrialRecord,
    acting: [Option<Timed>; 6],
    (time_s, noise, random): (&[f64], f64, &mut impl FnMut() -> f64),
) -> TrialRecord {
    let heading = Timed::new("heading", vec![0.0], vec![0.3]).expect("valid");
    let inputs = Inputs {
        signals: logged.signals.clone(),
        force: acting,
        attitude: [None, None, Some(heading)],
        current: [0.1, -0.05],
        ..Inputs::default()
    };
    let motion = simulate(plant, &inputs, &Vector6::zeros(), time_s).expect("bounded");
    let mut measured = |of: &dyn Fn(usize) -> f64, std: f64| {
        let values: Vec<f64> = (0..time_s.len()).map(|k| of(k) + std * random()).collect();
        Some(Timed::new("motion", time_s.to_vec(), values).expect("valid"))
    };
    let velocity = [0, 1, 5].map(|axis| measured(&|k| motion.velocity[k][axis], noise));
    let [surge, sway, yaw] = velocity;
    let heading = measured(&|k| motion.attitude[k][2], 0.1 * noise);
    TrialRecord {
        velocity: [surge, sway, None, None, None, yaw],
        attitude: [None, None, crate::navigation::unwrap(&heading.expect("there")).into()],
        ..logged
    }
}

fn noise() -> Noise {
    Noise {
        disturbance: vec![0.5, 0.4, 0.02].into(),
        correlation_s: vec![4.0, 6.0, 3.0].into(),
        velocity: vec![0.006, 0.005, 0.004].into(),
        attitude: None,
        instruments: InstrumentNoise::NONE,
        drift: Some(filter::Drift { std_m_s: 0.03, correlation_s: 25.0 }),
        swell: Some(filter::Swell {
            std: vec![0.2, 0.1, 0.02].into(),
            frequency: 1.1,
            damping: 0.08,
        }),
        jitter_s: Some(0.03),
    }
}

/// The force over each slice, and its changes.
type Forces = (HeldForces, ThrustChanges);

fn forces(actuator: Actuator, schedule: &Schedule, axes: &[Dof]) -> Forces {
    let pushes = actuator.pushes(&schedule.thrust, &schedule.slices, axes);
    let thrust_changes = ThrustChanges::of(&pushes, &schedule.slices, 0.1);
    (pushes, thrust_changes)
}

fn input<'a>(
    (schedule, (pushes, thrust_changes)): (&'a Schedule, &'a Forces),
    current: [f64; 2],
    noise: &'a Noise,
) -> PassInput<'a> {
    PassInput { schedule, pushes, thrust_changes: Some(thrust_changes), current, noise, fits: ALL }
}

fn pass<'a>(
    filter: &'a dyn Filter,
    forces: (&'a Schedule, &'a Forces),
    current: [f64; 2],
    noise: &'a Noise,
) -> Box<dyn Pass + 'a> {
    filter.pass(input(forces, current, noise))
}

/// The same force, logged so often that each slice of the filter is short: what lies in its middle
/// then stands for all of it as exactly as differences tell.
fn logged_often(mut record: TrialRecord) -> TrialRecord {
    const PERIOD_S: f64 = 0.1 / 32.0;
    let finely = |force: Timed| {
        let grid = Grid::spanning(force.first_s(), force.last_s(), PERIOD_S);
        // Rounding must not put an instant before the step that begins at it.
        let values = grid.times().map(|t| force.held_at(t + 0.5 * PERIOD_S)).collect();
        Timed::on_grid("force", grid, values).expect("valid")
    };
    record.force = record.force.map(|force| force.map(finely));
    record
}

/// Velocity sensors that show velocity as it is, behind a lag, and as a mean.
const SENSORS: [SensorLag; 3] = [
    SensorLag { time_s: 0.0, is_window: false },
    SensorLag { time_s: 0.3, is_window: false },
    SensorLag { time_s: 0.8, is_window: true },
];

#[test]
fn the_plants_slope_is_that_of_the_cost_at_the_filters_gains() {
    SENSORS.into_iter().for_each(check_slope_by_plant);
}

fn check_slope_by_plant(sensor: SensorLag) {
    let plant = planar();
    let record = of_thrusters(logged_often(record(&plant, "a", 1, 20, 0.005)));
    let schedules = Schedule::complete(&[&record], plant.structure(), Attitude::Known, sensor);
    let schedule = &schedules[0];
    let noise = noise();
    // Away from the optimum, where slopes are steep.
    let off: Vec<f64> = plant.coefficients().iter().map(|x| 1.1 * x).collect();
    let current = [0.07, 0.02];
    let prepared = |coefficients: &[f64]| {
        let plant = Plant::new(plant.structure().clone(), coefficients.to_vec()).expect("possible");
        filter_of(&plant, Attitude::Known)
    };
    let base = prepared(&off);
    // A dead band has a slope where there is one.
    let (lag_s, delay_s, dead_band) = (0.15, 0.07, 0.02);
    let actuator = Actuator { lag_s, delay_s, dead_band, full_speed: 8.0, ..Actuator::default() };
    let pushed = |actuator: Actuator| forces(actuator, schedule, plant.axes());
    let pushes = pushed(actuator);
    let (slope, gains) = pass(&*base, (schedule, &pushes), current, &noise).by_plant();
    // Slopes that are small beside others are the difference of large parts.
    let least = 0.01 * slope.gradient.amax();
    let check = |found: f64, expected: f64, name: &str| {
        let off = (found - expected).abs() / expected.abs().max(least);
        assert!(off < DIFFERENCE, "{sensor:?}, {name}: {found} and {expected}");
    };
    for (k, term) in plant.structure().terms().iter().enumerate() {
        let step = 1e-6 * off[k].abs();
        let at = |sign: f64| {
            let mut moved = off.clone();
            moved[k] += sign * step;
            pass(&*prepared(&moved), (schedule, &pushes), current, &noise).at_gains(&gains)
        };
        check(slope.gradient[k], (at(1.0) - at(-1.0)) / (2.0 * step), &term.to_string());
    }
    for direction in 0..2 {
        let at = |step: f64| {
            let mut moved = current;
            moved[direction] += step;
            pass(&*base, (schedule, &pushes), moved, &noise).at_gains(&gains)
        };
        let expected = (at(1e-6) - at(-1e-6)) / 2e-6;
        check(slope.gradient[off.len() + Actuator::COUNT + direction], expected, "current");
    }
    for k in 0..Actuator::COUNT {
        let at = |sign: f64| {
            let mut numbers = actuator.numbers();
            numbers[k] += 1e-6 * sign;
            let pushes = pushed(actuator.with(numbers));
            pass(&*base, (schedule, &pushes), current, &noise).at_gains(&gains)
        };
        check(slope.gradient[off.len() + k], (at(1.0) - at(-1.0)) / 2e-6, "actuator");
    }
}

/// What a DVL reports for sitting elsewhere, or for being turned, is taken from its readings, so that a metre
/// more of lever or another angle is another record.
#[test]
fn the_slope_by_lever_and_misalignment_is_that_of_the_cost() {
    let plant = planar();
    let mut record = record(&plant, "a", 1, 20, 0.005);
    let yaw = record.velocity[5].clone().expect("measured");
    let tilting = yaw.time_s().iter().map(|t| 0.1 * t.sin()).collect();
    let tilting = yaw.with_values("rate", tilting).expect("finite");
    record.rates = Some([tilting.clone(), tilting, yaw]);
    // Away from the optimum, where slopes are steep.
    let off = VelocityReport {
        lever_m: [0.3, -0.2, 0.0],
        misalignment_rad: [0.0, 0.0, 0.1],
        ..VelocityReport::default()
    };
    let record = record.with_translations_before(&off);
    let filter = filter_of(&plant, Attitude::Known);
    let (slope, gains) = over(&record, &plant, |own| {
        let pass = filter.pass(own);
        (pass.by_plant_and_report(0.0), pass.by_plant().1)
    });
    let first = slope.gradient.len() - 6;
    for k in 0..6 {
        let at = |step: f64| {
            let mut how = VelocityReport::default();
            let mut numbers = how.lever_m.iter_mut().chain(&mut how.misalignment_rad);
            *numbers.nth(k).expect("six") = step;
            over(&record.with_translations_before(&how), &plant, |own| {
                filter.pass(own).at_gains(&gains)
            })
        };
        let (found, expected) = (slope.gradient[first + k], (at(1e-5) - at(-1e-5)) / 2e-5);
        if (2..5).contains(&k) {
            // Roll and pitch are no axes: what is logged of their rates may be noise alone. Nor is heave.
            assert_eq!(found, 0.0);
            continue;
        }
        let off = (found - expected).abs() / expected.abs().max(1.0);
        assert!(off < DIFFERENCE, "{k}: {found} and {expected}");
    }
}

pub(super) fn filter_of(plant: &Plant, attitude: Attitude) -> Box<dyn Filter> {
    <dyn Filter>::of(plant, &[], attitude).expect("a mass matrix")
}

/// What is asked of a pass over a record.
pub(super) fn over<T>(
    record: &TrialRecord,
    plant: &Plant,
    work: impl FnOnce(PassInput<'_>) -> T,
) -> T {
    let noise = noise();
    let schedules =
        Schedule::complete(&[record], plant.structure(), Attitude::Known, SensorLag::default());
    let schedule = &schedules[0];
    let pushes = forces(Actuator::default(), schedule, plant.axes());
    work(input((schedule, &pushes), [0.07, 0.02], &noise))
}

/// A vehicle that rolls and pitches, driven freely, as its sensors see it.
fn rolling(seed: u64, seconds: usize, noise: f64) -> (Plant, TrialRecord) {
    let axes = [Dof::Surge, Dof::Roll, Dof::Pitch];
    let structure = Structure::of(&axes, Symmetry::PortStarboard).expect("three axes");
    let coefficient = |term: &Basis| match term {
        Basis::Mass(Dof::Surge, Dof::Surge) => 20.0,
        Basis::Mass(a, b) if a == b => 0.5,
        Basis::Mass(..) => 0.2,
        Basis::Product(Dof::Surge, _) => 20.0,
        Basis::Product(..) => 0.4,
        Basis::Lever(2) => 4.0,
        _ => 0.0,
    };
    let coefficients = structure.terms().iter().map(coefficient).collect();
    let plant = Plant::new(structure, coefficients).expect("possible");
    let mut random = random(seed);
    let time_s: Vec<f64> = (0..10 * seconds).map(|k| 0.1 * k as f64).collect();
    let mut series = |amplitude, dwell| Some(stepped(&time_s, &mut random, (amplitude, dwell)));
    let force = [series(20.0, 37), None, None, series(1.0, 13), series(1.0, 17), None];
    // It turns about no vertical axis, as the filter takes a rate that nobody measured.
    let mut inputs = Inputs { force: force.clone(), ..Inputs::default() };
    inputs.velocity[5] = Some(Timed::new("yaw rate", vec![0.0], vec![0.0]).expect("valid"));
    let motion = simulate(&plant, &inputs, &Vector6::zeros(), &time_s).expect("bounded");
    let mut measured = |of: &dyn Fn(usize) -> f64, std: f64| {
        let values: Vec<f64> = (0..time_s.len()).map(|k| of(k) + std * random()).collect();
        Some(Timed::new("motion", time_s.clone(), values).expect("valid"))
    };
    let mut velocity = [const { None }; 6];
    for axis in [0, 3, 4] {
        velocity[axis] = measured(&|k| motion.velocity[k][axis], noise);
    }
    let inclination = [0, 1].map(|which| measured(&|k| motion.attitude[k][which], noise));
    let record = TrialRecord {
        force,
        velocity,
        attitude: [inclination[0].clone(), inclination[1].clone(), None],
        inclination,
        ..TrialRecord::until("a", time_s[time_s.len() - 1])
    };
    (plant, record)
}

#[test]
fn slopes_are_those_of_the_likelihood_where_attitude_is_a_state() {
    let (plant, record) = rolling(3, 60, 0.01);
    let record = logged_often(record);
    let schedules =
        Schedule::complete(&[&record], plant.structure(), Attitude::State, SensorLag::default());
    let schedule = &schedules[0];
    let noise = Noise {
        disturbance: vec![0.5, 0.02, 0.03].into(),
        correlation_s: vec![4.0, 6.0, 3.0].into(),
        velocity: vec![0.009, 0.011, 0.01].into(),
        attitude: Some(0.012),
        instruments: InstrumentNoise::NONE,
        drift: None,
        swell: None,
        jitter_s: Some(0.03),
    };
    let pushes = forces(Actuator::default(), schedule, plant.axes());
    let prepared = |coefficients: &[f64]| {
        let plant = Plant::new(plant.structure().clone(), coefficients.to_vec()).expect("possible");
        filter_of(&plant, Attitude::State)
    };
    let off: Vec<f64> = plant.coefficients().iter().map(|x| 1.1 * x).collect();
    let base = prepared(&off);
    let here = pass(&*base, (schedule, &pushes), [0.0; 2], &noise);
    let (slope, gains) = here.by_plant();
    for (k, term) in plant.structure().terms().iter().enumerate() {
        let step = 1e-6 * off[k].abs().max(0.1);
        let at = |sign: f64| {
            let mut moved = off.clone();
            moved[k] += sign * step;
            pass(&*prepared(&moved), (schedule, &pushes), [0.0; 2], &noise).at_gains(&gains)
        };
        let expected = (at(1.0) - at(-1.0)) / (2.0 * step);
        let part = (slope.gradient[k] - expected).abs() / expected.abs().max(1.0);
        assert!(part < DIFFERENCE, "{term}: {} and {expected}", slope.gradient[k]);
    }
    let truth = prepared(plant.coefficients());
    let of_noise = |noise: &Noise| {
        let pass = pass(&*truth, (schedule, &pushes), [0.0; 2], noise);
        (pass.noise_gradient(), pass.cost())
    };
    let ((found, gradient), cost) = of_noise(&noise);
    assert!((found - cost).abs() < 1e-9 * cost.abs());
    let logarithms = noise.logarithms();
    for k in 0..logarithms.len() {
        let at = |step: f64| {
            let mut moved = logarithms.clone();
            moved[k] += step;
            of_noise(&noise.with_logarithms(&moved)).1
        };
        let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
        let part = (gradient[k] - expected).abs() / expected.abs().max(1.0);
        assert!(part < LINEARISATION, "{k}: {} and {expected}", gradient[k]);
    }
}

#[test]
fn noise_of_attitude_does_not_pass_for_drag_in_roll() {
    let (truth, record) = rolling(4, 300, 0.02);
    let fit = fit_plant(truth.structure(), &[&record], None, false).expect("an optimum");
    for (k, term) in truth.structure().terms().iter().enumerate() {
        let (found, expected) = (fit.plant.coefficients()[k], truth.coefficients()[k]);
        let std = fit.covariance[(k, k)].sqrt();
        assert!((found - expected).abs() < 3.5 * std, "{term}: {found} ± {std}, {expected}");
    }
    let (noise, std) = fit.attitude_noise.expect("a state");
    assert!((noise - 0.02).abs() < 4.0 * std, "{noise} ± {std}");
}

/// The noise's slope leaves out that the filter's linearisation changes with its state.
const LINEARISATION: f64 = 0.02;

#[test]
fn the_noises_slope_is_that_of_the_likelihood() {
    let plant = planar();
    let record = record(&plant, "a", 1, 60, 0.005);
    let schedules =
        Schedule::complete(&[&record], plant.structure(), Attitude::Known, SensorLag::default());
    let schedule = &schedules[0];
    let filter = filter_of(&plant, Attitude::Known);
    let logarithms = noise().logarithms();
    let pushes = forces(Actuator::default(), schedule, plant.axes());
    let pass = |noise: &Noise| {
        let pass = pass(&*filter, (schedule, &pushes), [0.1, -0.05], noise);
        (pass.noise_gradient(), pass.cost())
    };
    let ((found, gradient), cost) = pass(&noise());
    assert!((found - cost).abs() < 1e-9 * cost.abs());
    for k in 0..noise().count() {
        let at = |step: f64| {
            let mut moved = logarithms.clone();
            moved[k] += step;
            pass(&noise().with_logarithms(&moved)).1
        };
        let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
        let off = (gradient[k] - expected).abs() / expected.abs().max(1.0);
        assert!(off < LINEARISATION, "{k}: {} and {expected}", gradient[k]);
    }
}

/// Of linear motion only that is left out which a step of second order misses.
#[test]
fn of_linear_motion_the_noises_slope_is_within_a_thousandth() {
    SENSORS.into_iter().for_each(check_slope_by_noise);
}

fn check_slope_by_noise(sensor: SensorLag) {
    let structure = Structure::of(&PLANAR[..1], Symmetry::Diagonal).expect("one axis");
    let plant = Plant::new(structure, vec![20.0, 5.0, 0.0]).expect("possible");
    let record = record(&plant, "a", 1, 60, 0.005);
    let schedules = Schedule::complete(&[&record], plant.structure(), Attitude::Known, sensor);
    let schedule = &schedules[0];
    let filter = filter_of(&plant, Attitude::Known);
    let pushes = forces(Actuator::default(), schedule, plant.axes());
    let noise = Noise {
        disturbance: vec![0.5].into(),
        correlation_s: vec![4.0].into(),
        velocity: vec![0.006].into(),
        attitude: None,
        instruments: InstrumentNoise::NONE,
        drift: Some(filter::Drift { std_m_s: 0.03, correlation_s: 25.0 }),
        swell: Some(filter::Swell { std: vec![0.2].into(), frequency: 1.1, damping: 0.08 }),
        jitter_s: Some(0.03),
    };
    let pass = |noise: &Noise| {
        let pass = pass(&*filter, (schedule, &pushes), [0.1, 0.0], noise);
        (pass.noise_gradient().1, pass.cost())
    };
    let (gradient, _) = pass(&noise);
    let logarithms = noise.logarithms();
    for k in 0..noise.count() {
        let at = |step: f64| {
            let mut moved = logarithms.clone();
            moved[k] += step;
            pass(&noise.with_logarithms(&moved)).1
        };
        let expected = (at(1e-5) - at(-1e-5)) / 2e-5;
        let off = (gradient[k] - expected).abs() / expected.abs().max(1.0);
        assert!(off < 1e-3, "{k}: {} and {expected}", gradient[k]);
    }
}

#[test]
fn a_simulated_vehicle_comes_back_within_its_intervals() {
    let truth = planar();
    let records = [("a", 3), ("b", 4)].map(|(name, seed)| record(&truth, name, seed, 150, 0.005));
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
    for (k, term) in truth.structure().terms().iter().enumerate() {
        let (found, expected) = (fit.plant.coefficients()[k], truth.coefficients()[k]);
        let std = fit.covariance[(k, k)].sqrt();
        assert!((found - expected).abs() < 4.0 * std, "{term}: {found} ± {std}, {expected}");
        assert!(std < 0.1 * expected.abs(), "{term}: {found} ± {std}");
    }
    assert_eq!((fit.actuator, fit.actuator_std), (Actuator::default(), [None; Actuator::COUNT]));
    let [north, east] = fit.current_of("a");
    assert!((north - 0.1).abs() < 0.01 && (east + 0.05).abs() < 0.01, "{north} {east}");
}

/// Standard deviation, m/s, and correlation time, s, of how a current changes.
const CHANGES: (f64, f64) = (0.03, 30.0);

/// A step of likelihood on a trial that the fit has not seen goes to the vehicle that the trial is of.
#[test]
fn an_unseen_trial_asks_for_its_own_vehicle() {
    let plant = planar();
    let trials = [record(&plant, "a", 1, 200, 0.005), record(&plant, "b", 2, 200, 0.005)];
    let fit = fit_plant(plant.structure(), &trials.each_ref(), None, false).expect("fits");
    let step = |vehicle: &Plant, seed| {
        let unseen = record(vehicle, "c", seed, 200, 0.005);
        fit.likelihood_step(&[&unseen]).expect("simulates").expect("of filter error")
    };
    let same = step(&plant, 3);
    for (k, truth) in plant.coefficients().iter().enumerate() {
        let variance = same.covariance[(k, k)] + fit.covariance[(k, k)];
        let off = fit.plant.coefficients()[k] + same.change[k] - truth;
        assert!(off.abs() < 4.0 * variance.sqrt(), "{k}: {off} of {truth}, {variance}");
    }
    assert!(same.whiteness.values().all(|x| *x < 1.8), "{:?}", same.whiteness);
    assert!(same.surprise.values().all(|x| *x < 1.3), "{:?}", same.surprise);
    let mut coefficients = plant.coefficients().to_vec();
    coefficients[0] *= 1.1;
    let heavier = Plant::new(plant.structure().clone(), coefficients).expect("possible");
    let found = step(&heavier, 4);
    // One step of ten percent, where motion is not linear in mass.
    let added = found.change[0] / plant.coefficients()[0];
    assert!((added - 0.1).abs() < 0.02, "{added}");
    assert!(found.covariance[(0, 0)].sqrt() < 0.01 * plant.coefficients()[0]);
    assert!(found.surprise[&Dof::Surge] > 1.5, "{:?}", found.surprise);
}

/// The same trial in a current that changes, which does not carry the vehicle along.
fn in_changing_current(plant: &Plant, mut record: TrialRecord, seed: u64) -> TrialRecord {
    let draw = |stream: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(stream);
        gauss_markov(random, CHANGES.0, 10.0 * CHANGES.1, 10_000)
    };
    let ([north, east], mut random) = ([draw(1), draw(2)], random(seed));
    let heading = Timed::new("heading", vec![0.0], vec![0.3]).expect("valid");
    let inputs = Inputs { attitude: [None, None, Some(heading)], ..Inputs::default() };
    let mut moving = Moving::at_rest(plant, &inputs).expect("possible");
    let time_s = record.force[0].as_ref().expect("is logged").time_s().to_vec();
    let mut measured = [0, 1, 5].map(|axis| (axis, Vec::new()));
    let mut headings = Vec::new();
    for k in 0..time_s.len() {
        moving.set_current([0.1 + north[k], -0.05 + east[k]]);
        for (axis, values) in &mut measured {
            values.push(moving.velocity()[*axis] + 0.005 * random());
        }
        headings.push(moving.attitude()[2] + 5e-4 * random());
        let force = |axis: usize| record.force[axis].as_ref().map_or(0.0, |own| own.values()[k]);
        moving.advance(&Vector6::from_fn(|axis, _| force(axis)), 0.1).expect("bounded");
    }
    let series = |values| Timed::new("motion", time_s.clone(), values).expect("valid");
    for (axis, values) in measured {
        record.velocity[axis] = Some(series(values));
    }
    record.attitude[2] = crate::navigation::unwrap(&series(headings)).into();
    record
}

#[test]
fn a_current_that_changes_is_told_from_forces_that_do() {
    let truth = planar();
    let record = |name, seed| record(&truth, name, seed, 300, 0.005);
    let steady = [record("a", 3), record("b", 4)];
    let changing = [("a", 3), ("b", 4)]
        .map(|(name, seed)| in_changing_current(&truth, record(name, seed), seed));
    let fit = |records: &[TrialRecord; 2]| {
        let records: Vec<&TrialRecord> = records.iter().collect();
        fit_plant(truth.structure(), &records, None, false).expect("an optimum")
    };
    assert_eq!(fit(&steady).current_drift, None);
    let fit = fit(&changing);
    let drift = fit.current_drift.expect("is found");
    let (std, correlation) = (drift.std_m_s.0 / CHANGES.0, drift.correlation_s.0 / CHANGES.1);
    assert!((0.6..1.6).contains(&std) && (0.3..3.0).contains(&correlation), "{drift:?}");
    assert!(fit.whiteness.values().all(|x| *x < 1.8), "{:?}", fit.whiteness);
    for (k, term) in truth.structure().terms().iter().enumerate() {
        let off = (fit.plant.coefficients()[k] - truth.coefficients()[k]).abs();
        let std = fit.covariance[(k, k)].sqrt();
        assert!(off < 4.0 * std, "{term}: off by {off}, ± {std}");
    }
}

fn check_behind([lag_s, delay_s, log_reverse_ratio]: [f64; 3], is_of_propeller: bool) {
    let actuator = Actuator { lag_s, delay_s, log_reverse_ratio, ..Actuator::default() };
    check_actuator(actuator, is_of_propeller);
}

fn check_actuator(actuator: Actuator, is_of_propeller: bool) {
    let truth = planar();
    let records = [("a", 8), ("b", 9)].map(|(name, seed)| {
        let record = record_behind(&truth, name, seed, (150, 0.005), (actuator, is_of_propeller));
        if is_of_propeller { of_thrusters(record) } else { record }
    });
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
    let found = fit.actuator.numbers().into_iter().zip(actuator.numbers()).zip(fit.actuator_std);
    for ((found, expected), std) in found {
        // Forces of the simulation are held for 0.01 s.
        let off = (found - expected).abs() - 0.005;
        assert!(off < 4.0 * std.unwrap_or(0.0), "{actuator:?}: {found} ± {std:?}");
    }
    for dof in PLANAR {
        let mass = Basis::Mass(dof, dof);
        let (found, expected) = (fit.plant.coefficient(&mass), truth.coefficient(&mass));
        let off = found.zip(expected).map_or(f64::INFINITY, |(a, b)| (a / b - 1.0).abs());
        assert!(off < 0.02, "{actuator:?}, {dof}: {found:?}, {expected:?}");
    }
}

#[test]
fn a_wrench_that_lags_or_is_late_does_not_pass_for_mass() {
    [[0.3, 0.0, 0.0], [0.0, 0.15, 0.0], [0.2, 0.1, 0.0]]
        .into_iter()
        .for_each(|numbers| check_behind(numbers, false));
}

#[test]
fn propellers_that_lag_or_push_less_in_reverse_do_not_pass_for_mass() {
    [[0.3, 0.0, 0.0], [0.2, 0.1, 0.0], [0.0, 0.0, -0.3], [0.3, 0.1, -0.2]]
        .into_iter()
        .for_each(|numbers| check_behind(numbers, true));
}

#[test]
fn thrust_that_falls_during_each_trial_does_not_pass_for_mass() {
    let actuator = Actuator { log_change_within: -0.2, ..Actuator::default() };
    check_actuator(actuator, true);
    check_actuator(actuator, false);
}

/// Thrusters whose strength is known so well, each way.
fn known_to(mut record: TrialRecord, [forward, reverse]: [f64; 2]) -> TrialRecord {
    for thruster in &mut record.thrusters {
        thruster.track.uncertainty = ThrustUncertainty { forward, reverse };
    }
    record
}

/// What unsure thrust makes of each coefficient's standard deviation, as a part of the coefficient.
fn parts_of_thrust(fit: &PlantFit) -> Vec<f64> {
    let coefficients = fit.plant.coefficients().iter().enumerate();
    coefficients.map(|(k, x)| fit.thrust_covariance[(k, k)].sqrt() / x.abs()).collect()
}

#[test]
fn unsure_curves_are_in_the_intervals() {
    let truth = planar();
    let fit = |log_reverse_ratio: f64, uncertainty: [f64; 2]| {
        let actuator = Actuator { log_reverse_ratio, ..Actuator::default() };
        let records = [("a", 3), ("b", 4)].map(|(trial, seed)| {
            let behind = record_behind(&truth, trial, seed, (150, 0.005), (actuator, true));
            known_to(of_thrusters(behind), uncertainty)
        });
        let records: Vec<&TrialRecord> = records.iter().collect();
        let fit = fit_plant(truth.structure(), &records, None, false).expect("an optimum");
        assert!((fit.actuator.log_reverse_ratio - log_reverse_ratio).abs() < 0.02);
        fit
    };
    // Motion tells the ratio of both ways: they are off together, by 1/√(1/σ² + 1/σ²), and beside that
    // by the little that it leaves of the ratio.
    for (ratio, uncertainty, expected) in [
        (0.0, [0.0, 0.0], 0.0),
        (0.0, [0.05, 0.05], 0.05 / 2_f64.sqrt()),
        (0.0, [0.05, 0.2], 0.05 / (1.0_f64 + 1.0 / 16.0).sqrt()),
        // Curves that motion contradicts do not tell each other's scale.
        (-0.25, [0.05, 0.05], 0.05),
    ] {
        for part in parts_of_thrust(&fit(ratio, uncertainty)) {
            assert!((part - expected).abs() <= 0.03 * expected, "{uncertainty:?}: {part}");
        }
    }
}

/// A mass that is held tells the scale of surge; the rest of the plant asks for another one.
#[test]
fn what_unsure_curves_do_is_what_curves_that_are_off_do() {
    // So little that nothing of the actuator stands for it.
    const OFF: f64 = 0.001;
    let truth = planar();
    let mass = Basis::Mass(Dof::Surge, Dof::Surge);
    let held = truth.coefficient(&mass).expect("a mass");
    let structure = truth.structure().clone().holding(mass, held).expect("a mass");
    let of = |times: f64, uncertainty: f64| {
        let records = [("a", 3), ("b", 4)].map(|(trial, seed)| {
            let mut record = of_thrusters(record(&truth, trial, seed, 150, 0.005));
            record.force = record.force.map(|force| force.map(|force| force.map(|x| times * x)));
            let record = of_thrusters(record);
            known_to(record, [uncertainty; 2])
        });
        let records: Vec<&TrialRecord> = records.iter().collect();
        fit_plant(&structure, &records, None, false).expect("an optimum")
    };
    let (unsure, off) = (of(1.0, 2_f64.sqrt() * OFF), of(1.0 + OFF, 0.0));
    assert_eq!(off.actuator_std, [None; Actuator::COUNT]);
    for (k, x) in unsure.plant.coefficients().iter().enumerate() {
        let moved = (off.plant.coefficients()[k] - x).abs();
        let of_thrust = unsure.thrust_covariance[(k, k)].sqrt();
        // Either optimum is found to a part of its standard deviation.
        let own = unsure.of_sure_thrust().covariance[(k, k)].sqrt();
        let tolerance = 0.2 * own + 0.05 * of_thrust;
        assert!((moved - of_thrust).abs() <= tolerance, "{k}: {moved}, {of_thrust}, {own}");
    }
}

#[test]
fn thrust_that_falls_is_in_the_intervals() {
    let truth = planar();
    let actuator = Actuator { log_change_within: -0.2, ..Actuator::default() };
    let record = record_behind(&truth, "a", 8, (150, 0.005), (actuator, true));
    let fit = fit_plant(truth.structure(), &[&of_thrusters(record)], None, false);
    // A curve that holds at the beginning, or at the end, is within 1.13 of 1.96 deviations.
    let expected = 0.1 / 3_f64.sqrt();
    for part in parts_of_thrust(&fit.expect("an optimum")) {
        assert!((part - expected).abs() < 0.1 * expected, "{part}");
    }
}

/// Loses thrust to inflow, everywhere or where thrusters push the way they move, and asks for both.
fn check_inflow(ahead: bool) {
    let pusher = |(name, direction): (&str, [f64; 3])| Pusher {
        name: name.to_owned(),
        position_m: [0.0; 3],
        direction,
    };
    let thrusters = || [("0", [1.0, 0.0, 0.0]), ("1", [0.0, 1.0, 0.0])].map(pusher).to_vec();
    let effect = |ahead: bool| Effect {
        name: if ahead { "ahead" } else { "all" }.to_owned(),
        force: EffectForce::Inflow { thrusters: thrusters(), ahead },
    };
    let usual = planar();
    let with = |structure: Structure, ahead, as_term| {
        structure.with_effect(effect(ahead), as_term).expect("new")
    };
    let coefficients = usual.coefficients().iter().copied().chain([1.5]).collect();
    let truth = Plant::new(with(usual.structure().clone(), ahead, true), coefficients);
    let truth = truth.expect("possible");
    let records = [("a", 5), ("b", 6)]
        .map(|(name, seed)| of_thrusters(record(&truth, name, seed, 150, 0.005)));
    let records: Vec<&TrialRecord> = records.iter().collect();
    let asked = with(with(usual.structure().clone(), ahead, false), !ahead, false);
    let fit = fit_plant(&asked, &records, None, true).expect("an optimum");
    let names: Vec<String> =
        fit.tried.iter().filter(|tried| tried.admitted).map(|tried| tried.name.clone()).collect();
    assert_eq!(names, [effect(ahead).name]);
    for term in truth.structure().terms() {
        let (found, expected) = (fit.plant.coefficient(term), truth.coefficient(term));
        let off = found.zip(expected).map_or(f64::INFINITY, |(a, b)| (a - b).abs());
        let std = fit.std(term).expect("fitted");
        assert!(off < 4.0 * std, "{}: {found:?} ± {std}", truth.structure().name_of(term));
    }
}

#[test]
fn thrust_lost_to_inflow_does_not_pass_for_mass_or_drag() {
    check_inflow(false);
}

#[test]
fn thrust_lost_only_by_thrusters_that_push_the_way_they_move_is_told_from_that() {
    check_inflow(true);
}

#[test]
fn a_coupling_that_is_there_is_found_and_none_is_invented() {
    let truth = planar();
    let usual = truth.structure().without(|term| term.to_string() == "sway: r");
    let records = [("a", 5), ("b", 6)].map(|(name, seed)| record(&truth, name, seed, 150, 0.005));
    let records: Vec<&TrialRecord> = records.iter().collect();
    let fit = fit_plant(&usual, &records, None, true).expect("an optimum");
    let admitted = fit.tried.iter().filter(|tried| tried.admitted);
    let admitted: Vec<String> = admitted.map(|tried| tried.name.clone()).collect();
    assert_eq!(admitted, ["sway: r"]);
    assert_eq!(fit.tried.len(), 4);
}

#[test]
fn added_mass_stays_above_zero_where_the_rigid_body_is_known() {
    let truth = planar();
    let records = [record(&truth, "a", 7, 100, 0.005)];
    let records: Vec<&TrialRecord> = records.iter().collect();
    // Heavier than the vehicle is: the least that the fit may give.
    let inertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
    let body = RigidBody::new(20.5, [0.0; 3], inertia).expect("a body");
    let fit = fit_plant(truth.structure(), &records, Some(&body), false).expect("an optimum");
    let rigid = body.mass_matrix();
    let rigid = DMatrix::from_fn(3, 3, |i, j| rigid[(PLANAR[i].index(), PLANAR[j].index())]);
    let added = fit.plant.mass_matrix() - rigid;
    assert!(added.symmetric_eigenvalues().min() > -1e-9, "{added}");
}

/// A vehicle of six axes without a velocity sensor: fixes of its position, depth, heading, roll and
/// pitch, a gyroscope about two axes, and an accelerometer.
fn without_velocity(seed: u64, seconds: usize) -> (Plant, TrialRecord) {
    let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
    let coefficient = |term: &Basis| match term {
        Basis::Mass(a, b) if a == b => {
            if a.is_rotation() {
                0.8
            } else {
                20.0
            }
        }
        Basis::Mass(..) => 0.2,
        Basis::Product(dof, _) => {
            if dof.is_rotation() {
                0.9
            } else {
                25.0
            }
        }
        Basis::Lever(2) => 6.0,
        _ => 0.0,
    };
    let coefficients = structure.terms().iter().map(coefficient).collect();
    let plant = Plant::new(structure, coefficients).expect("possible");
    let mut random = random(seed);
    let time_s: Vec<f64> = (0..10 * seconds).map(|k| 0.1 * k as f64).collect();
    let mut series = |amplitude, dwell| Some(stepped(&time_s, &mut random, (amplitude, dwell)));
    let force = [(20.0, 37), (20.0, 29), (15.0, 41), (1.0, 13), (1.0, 17), (0.8, 23)]
        .map(|(amplitude, dwell)| series(amplitude, dwell));
    let inputs = Inputs { force: force.clone(), ..Inputs::default() };
    let motion = simulate(&plant, &inputs, &Vector6::zeros(), &time_s).expect("bounded");
    let mut way = vec![Vector3::<f64>::zeros()];
    let over_ground = |k: usize| {
        let body = motion.velocity[k].fixed_rows::<3>(0).into_owned();
        body_from_world(motion.attitude[k]).transpose() * body
    };
    for k in 1..time_s.len() {
        way.push(way[k - 1] + 0.05 * (over_ground(k) + over_ground(k - 1)));
    }
    let mut measured = |of: &dyn Fn(usize) -> f64, every: usize, std: f64| {
        let samples = (1..time_s.len()).step_by(every);
        let (time_s, values): (Vec<f64>, Vec<f64>) =
            samples.map(|k| (time_s[k], of(k) + std * random())).unzip();
        Timed::new("motion", time_s, values).expect("valid")
    };
    let [roll_rate, pitch_rate, yaw_rate] =
        [3, 4, 5].map(|axis| measured(&|k| motion.velocity[k][axis], 1, 0.01));
    let [roll, pitch, heading] =
        [0, 1, 2].map(|which| measured(&|k| motion.attitude[k][which], 1, 0.01));
    let heading = crate::navigation::unwrap(&heading);
    let fixes = [0, 1].map(|which| measured(&|k| way[k][which], 10, 0.2));
    let depth = measured(&|k| way[k][2], 2, 0.01);
    let acceleration = [0, 1, 2].map(|axis| {
        let felt = |k: usize| {
            let [(v, w), (before, turned)] = [k, k - 1].map(|k| {
                let six = &motion.velocity[k];
                (six.fixed_rows::<3>(0).into_owned(), six.fixed_rows::<3>(3).into_owned())
            });
            let crossed = 0.5 * (w.cross(&v) + turned.cross(&before));
            ((v - before) / 0.1 + crossed)[axis] + 0.05
        };
        let mean = measured(&felt, 1, 0.05);
        let from_s = mean.time_s().iter().map(|t| t - 0.1).collect();
        Some(MeanAcceleration { mean, from_s })
    });
    let mut velocity = [const { None }; 6];
    for (axis, velocity) in velocity.iter_mut().enumerate().take(3) {
        *velocity = Some(measured(&|k| motion.velocity[k][axis], 1, 0.05));
    }
    velocity[5] = Some(measured(&|k| motion.velocity[k][5], 1, 0.05));
    let rates = Some([roll_rate.clone(), pitch_rate.clone(), yaw_rate]);
    [velocity[3], velocity[4]] = [Some(roll_rate), Some(pitch_rate)];
    let record = TrialRecord {
        force,
        velocity,
        by_slope: [true, true, true, false, false, true],
        fixes: Some(fixes.map(Some)),
        depth: Some(depth),
        heading: Some(heading.clone()),
        acceleration,
        rates,
        attitude: [Some(roll.clone()), Some(pitch.clone()), Some(heading)],
        inclination: [Some(roll), Some(pitch)],
        ..TrialRecord::until("a", time_s[time_s.len() - 1])
    };
    (plant, record)
}

/// Masses and drag come back from fixes each second, depth, a gyroscope and acceleration.
#[test]
fn a_vehicle_without_a_velocity_sensor_comes_back_within_its_intervals() {
    let (truth, record) = without_velocity(7, 150);
    let by_slope = [true, true, true, false, false, false];
    let record = TrialRecord { by_slope, ..record };
    let fit = fit_plant(truth.structure(), &[&record], None, false).expect("an optimum");
    for (term, &expected) in truth.structure().terms().iter().zip(truth.coefficients()) {
        let Some(found) = fit.plant.coefficient(term) else { continue };
        let std = fit.std(term).expect("fitted");
        assert!((found - expected).abs() < 4.0 * std, "{term}: {found} ± {std}, not {expected}");
        if let Basis::Mass(a, b) = term {
            assert!(a != b || std < 0.05 * expected, "{term}: {found} ± {std}");
        }
    }
    let (noise, _) = fit.instruments["depth_noise"];
    assert!((noise / 0.01 - 1.0).abs() < 0.15, "{noise} m");
    let (noise, _) = fit.instruments["position_noise"];
    assert!((noise / 0.2 - 1.0).abs() < 0.15, "{noise} m");
}

#[test]
fn slopes_are_those_of_the_likelihood_where_only_positions_and_acceleration_are_measured() {
    let (plant, record) = without_velocity(5, 40);
    let record = logged_often(record);
    let schedules =
        Schedule::complete(&[&record], plant.structure(), Attitude::State, SensorLag::default());
    let schedule = &schedules[0];
    let noise = Noise {
        disturbance: vec![0.5, 0.4, 0.6, 0.02, 0.03, 0.02].into(),
        correlation_s: vec![4.0, 5.0, 3.0, 6.0, 3.0, 4.0].into(),
        velocity: vec![0.5, 0.5, 0.5, 0.011, 0.01, 0.5].into(),
        attitude: Some(0.012),
        instruments: InstrumentNoise {
            numbers: [0.25, 0.012, 0.013, 0.06, 0.05, 0.07, 0.06, 40.0],
            active: [true; InstrumentNoise::COUNT],
        },
        drift: Some(filter::Drift { std_m_s: 0.03, correlation_s: 25.0 }),
        swell: Some(filter::Swell {
            std: vec![0.6, 0.5, 0.8, 0.02, 0.02, 0.03].into(),
            frequency: 1.1,
            damping: 0.08,
        }),
        jitter_s: Some(0.03),
    };
    let pushes = forces(Actuator::default(), schedule, plant.axes());
    let prepared = |coefficients: &[f64]| {
        let plant = Plant::new(plant.structure().clone(), coefficients.to_vec()).expect("possible");
        filter_of(&plant, Attitude::State)
    };
    let off: Vec<f64> = plant.coefficients().iter().map(|x| 1.1 * x).collect();
    let (base, current) = (prepared(&off), [0.04, -0.03]);
    let (slope, gains) = pass(&*base, (schedule, &pushes), current, &noise).by_plant();
    let check = |found: f64, at: &dyn Fn(f64) -> f64, step: f64, limit: f64, name: &str| {
        let expected = (at(step) - at(-step)) / (2.0 * step);
        let part = (found - expected).abs() / expected.abs().max(1.0);
        assert!(part < limit, "{name}: {found} and {expected}");
    };
    for (k, term) in plant.structure().terms().iter().enumerate() {
        let at = |step: f64| {
            let mut moved = off.clone();
            moved[k] += step;
            pass(&*prepared(&moved), (schedule, &pushes), current, &noise).at_gains(&gains)
        };
        let step = 1e-6 * off[k].abs().max(0.1);
        check(slope.gradient[k], &at, step, LINEARISATION, &term.to_string());
    }
    for direction in 0..2 {
        let at = |step: f64| {
            let mut moved = current;
            moved[direction] += step;
            pass(&*base, (schedule, &pushes), moved, &noise).at_gains(&gains)
        };
        let found = slope.gradient[off.len() + Actuator::COUNT + direction];
        check(found, &at, 1e-6, LINEARISATION, "current");
    }
    let truth = prepared(plant.coefficients());
    let of_noise = |noise: &Noise| {
        let pass = pass(&*truth, (schedule, &pushes), current, noise);
        (pass.noise_gradient(), pass.cost())
    };
    let ((found, gradient), cost) = of_noise(&noise);
    assert!((found - cost).abs() < 1e-9 * cost.abs());
    let logarithms = noise.logarithms();
    for k in 0..logarithms.len() {
        let at = |step: f64| {
            let mut moved = logarithms.clone();
            moved[k] += step;
            of_noise(&noise.with_logarithms(&moved)).1
        };
        // Products of rates and of velocities that are hardly known add to what is left out.
        check(gradient[k], &at, 1e-5, 5.0 * LINEARISATION, &format!("noise {k}"));
    }
}
