//! Identification sample by sample, against truth and against batch methods.

use nalgebra::Vector6;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use seaplant::estimate::online::{MOST_SIGNALS, Online, OnlineOptions, Sample, Scheme};
use seaplant::motion::{Inputs, down_body, simulate};
use seaplant::plant::{Basis, Effect, EffectForce, Foil, Plant, Structure, Symmetry};
use seaplant::{Dof, Surface, Timed};

const SCHEMES: [Scheme; 3] = [Scheme::Adaptive, Scheme::Recursive, Scheme::Ekf];

/// A small six-axis vehicle, near the published BlueROV2 Heavy.
fn six_axes() -> Plant {
    let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
    let own = [19.86, 20.62, 32.18, 0.45, 0.37, 0.59];
    let damping =
        [(13.7, 141.0), (8.0, 217.0), (33.0, 190.0), (0.3, 1.19), (0.8, 0.47), (0.5, 1.5)];
    let value = |term: &Basis| match term {
        Basis::Mass(i, j) if i == j => own[i.index()],
        Basis::Mass(Dof::Surge, Dof::Pitch) => 0.3,
        Basis::Mass(Dof::Sway, Dof::Roll) => -0.3,
        Basis::Mass(..) => 0.1,
        Basis::Product(on, product) if product.factors().count() == 1 => damping[on.index()].0,
        Basis::Product(on, _) => damping[on.index()].1,
        Basis::WeightExcess => -2.0,
        Basis::Lever(_) => 6.6,
        Basis::One(_) | Basis::Effect(_) => 0.0,
    };
    let coefficients = structure.terms().iter().map(value).collect();
    Plant::new(structure, coefficients).expect("possible")
}

/// Steps of force on each axis, held for random times.
fn joystick(size: f64, duration_s: f64, rng: &mut ChaCha8Rng) -> Timed {
    let (mut times, mut forces, mut t) = (Vec::new(), Vec::new(), 0.0);
    while t < duration_s {
        times.push(t);
        forces.push(size * rng.random_range(-1.0..1.0));
        t += rng.random_range(0.8..4.0);
    }
    Timed::new("force", times, forces).expect("valid")
}

struct Driven {
    h: f64,
    duration_s: f64,
    noise: f64,
    /// A slow force that nobody logs, as a part of the joystick's, with 30 s of memory.
    tether: f64,
    seed: u64,
}

/// How long the slow force remembers, s.
const TETHER_S: f64 = 30.0;

/// A force that wanders about zero, by an Ornstein–Uhlenbeck process.
fn wandering(size: f64, times: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
    let keep = times.get(1).map_or(0.0, |h| (-h / TETHER_S).exp());
    let mut force = 0.0;
    let mut next = || {
        let x: f64 = StandardNormal.sample(rng);
        force = keep * force + size * (1.0 - keep * keep).sqrt() * x;
        force
    };
    times.iter().map(|_| next()).collect()
}

/// Samples of a vehicle that is driven freely in its axes.
fn drive(plant: &Plant, sizes: [f64; 6], how: &Driven) -> Vec<Sample> {
    let mut rng = ChaCha8Rng::seed_from_u64(how.seed);
    let n = (how.duration_s / how.h) as usize;
    let times: Vec<f64> = (0..n).map(|k| how.h * k as f64).collect();
    let (mut inputs, mut logged) = (Inputs::default(), vec![Vector6::zeros(); n]);
    for (axis, size) in sizes.into_iter().enumerate().filter(|(_, size)| *size > 0.0) {
        let force = joystick(size, how.duration_s, &mut rng);
        // Held over each sample, as a controller's output is.
        let mut held: Vec<f64> = times.iter().map(|t| force.held_at(t + 1e-9)).collect();
        logged.iter_mut().zip(&held).for_each(|(all, force)| all[axis] = *force);
        if how.tether > 0.0 {
            let pull = wandering(how.tether * size, &times, &mut rng);
            held.iter_mut().zip(pull).for_each(|(force, pull)| *force += pull);
        }
        inputs.force[axis] = Some(Timed::new("force", times.clone(), held).expect("valid"));
    }
    let moved = simulate(plant, &inputs, &Vector6::zeros(), &times).expect("stable");
    let own =
        Vector6::from_fn(|i, _| f64::from(u8::from(plant.axes().iter().any(|a| a.index() == i))));
    let mut sample = |k: usize| {
        let noise = Vector6::from_fn(|_, _| {
            let x: f64 = StandardNormal.sample(&mut rng);
            how.noise * x
        });
        let [roll, pitch, _] = moved.attitude[k];
        Sample {
            time_s: times[k],
            velocity: moved.velocity[k] + noise.component_mul(&own),
            down_body: down_body(roll, pitch),
            force: logged[k],
            ..Sample::default()
        }
    };
    (0..n).map(&mut sample).collect()
}

fn fed(online: &mut Online, samples: &[Sample]) {
    for sample in samples {
        online.update(sample).expect("in order");
    }
}

/// Part of the truth that own masses and own damping are off by, the worst first.
fn errors(found: &Plant, truth: &Plant) -> Vec<(f64, String)> {
    let terms =
        truth.structure().terms().iter().zip(truth.coefficients()).zip(found.coefficients());
    let big = |term: &Basis| match term {
        Basis::Mass(i, j) => i == j,
        Basis::Product(_, product) => product.factors().count() == 2,
        _ => matches!(term, Basis::Lever(_)),
    };
    let mut all: Vec<(f64, String)> = terms
        .filter(|((term, _), _)| big(term))
        .map(|((term, truth), found)| {
            ((found / truth - 1.0).abs(), format!("{term}: {found:.4} of {truth}"))
        })
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all
}

const SIX: [f64; 6] = [60.0, 60.0, 60.0, 3.0, 3.0, 6.0];

#[test]
fn every_scheme_finds_a_vehicle_of_six_axes() {
    let truth = six_axes();
    let how = Driven { h: 0.05, duration_s: 600.0, noise: 0.002, tether: 0.0, seed: 3 };
    let samples = drive(&truth, SIX, &how);
    for scheme in SCHEMES {
        let mut online =
            Online::new(truth.structure().clone(), scheme, OnlineOptions::default(), None)
                .expect("sound");
        fed(&mut online, &samples);
        let found = online.estimate().expect("learnt");
        let errors = errors(&found.plant, &truth);
        assert!(errors[0].0 < 0.05, "{scheme:?}: {:?}", errors[0]);
    }
}

/// The longest that a start 30 % off may take to come within 5 %, s.
const CONVERGED_S: f64 = 300.0;

#[test]
fn the_adaptive_observer_comes_from_a_plant_a_third_off() {
    let truth = six_axes();
    let off: Vec<f64> = truth
        .coefficients()
        .iter()
        .enumerate()
        .map(|(k, x)| x * if k % 2 == 0 { 1.3 } else { 0.75 })
        .collect();
    let start = Plant::new(truth.structure().clone(), off).expect("possible");
    let samples = drive(
        &truth,
        SIX,
        &Driven { h: 0.05, duration_s: CONVERGED_S, noise: 0.002, tether: 0.0, seed: 5 },
    );
    let options = OnlineOptions { adaptation_s: 30.0, ..OnlineOptions::default() };
    let online = Online::new(truth.structure().clone(), Scheme::Adaptive, options, None);
    let mut online = online.expect("sound").starting_from(&start).expect("the same terms");
    fed(&mut online, &samples);
    let found = online.estimate().expect("learnt").plant;
    let errors = errors(&found, &truth);
    assert!(errors[0].0 < 0.05, "{:?}", errors[0]);
}

#[test]
fn what_a_sample_at_rest_says_forgets_nothing() {
    let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    let truth = Plant::new(structure.clone(), vec![100.0, 5.0, 20.0]).expect("possible");
    let mut samples = drive(
        &truth,
        [60.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        &Driven { h: 0.1, duration_s: 300.0, noise: 0.001, tether: 0.0, seed: 1 },
    );
    let options = OnlineOptions { memory_s: Some(60.0), ..OnlineOptions::default() };
    let mut online = Online::new(structure, Scheme::Recursive, options, None).expect("sound");
    fed(&mut online, &samples);
    let before = online.estimate().expect("learnt").std;
    let end = samples.pop().expect("some");
    for k in 1..3000 {
        // After a gap: it did not stop at once.
        let time_s = end.time_s + 10.0 + 0.1 * f64::from(k);
        let at_rest = Sample { time_s, velocity: Vector6::zeros(), force: Vector6::zeros(), ..end };
        online.update(&at_rest).expect("in order");
    }
    let after = online.estimate().expect("learnt");
    assert!((after.plant.mass_matrix()[(0, 0)] / 100.0 - 1.0).abs() < 0.02);
    // Five memories of rest: exponential forgetting would have multiplied it by e^2.5.
    assert!(after.std[0] < 1.5 * before[0], "{} against {}", after.std[0], before[0]);
}

/// A vehicle of three axes.
fn three_axes() -> Structure {
    Structure::of(&[Dof::Surge, Dof::Sway, Dof::Yaw], Symmetry::PortStarboard).expect("three")
}

/// What is driven before the payload and after it, s.
#[derive(Clone, Copy)]
struct Dive {
    before_s: f64,
    after_s: f64,
    tether: f64,
    seed: u64,
}

/// A payload: every mass 30 % more from some time on.
fn loaded(dive: Dive) -> Vec<Sample> {
    let empty = [20.0, 25.0, 0.6, 0.5, 5.0, 30.0, 8.0, 60.0, 0.1, 1.2];
    let full = [26.0, 32.5, 0.8, 0.65, 5.0, 30.0, 8.0, 60.0, 0.1, 1.2];
    let sizes = [40.0, 50.0, 0.0, 0.0, 0.0, 1.0];
    let part = |masses: [f64; 10], duration_s, seed| {
        let plant = Plant::new(three_axes(), masses.to_vec()).expect("possible");
        let how = Driven { h: 0.1, duration_s, noise: 0.003, tether: dive.tether, seed };
        drive(&plant, sizes, &how)
    };
    let mut samples = part(empty, dive.before_s, dive.seed);
    let after = part(full, dive.after_s, dive.seed + 1000);
    samples.extend(after.into_iter().map(|s| Sample { time_s: s.time_s + dive.before_s, ..s }));
    samples
}

/// How many false alarms there were before the payload, and how late it was noticed, s.
fn alarms(dive: Dive) -> (usize, Option<f64>) {
    let options = OnlineOptions::default();
    let mut online = Online::new(three_axes(), Scheme::Recursive, options, None).expect("sound");
    let (mut false_alarms, mut late_s) = (0, None);
    for sample in loaded(dive) {
        match online.update(&sample).expect("in order") {
            Some(change) if change.noticed_s < dive.before_s => false_alarms += 1,
            Some(change) => _ = late_s.get_or_insert(change.noticed_s - dive.before_s),
            None => {}
        }
    }
    (false_alarms, late_s)
}

/// Draws of which at most one may raise an alarm in 600 s or miss the payload for 120 s.
const DRAWS: u64 = 8;

#[test]
fn a_payload_is_noticed_and_nothing_else_is() {
    let dive = |seed| Dive { before_s: 600.0, after_s: 600.0, tether: 0.0, seed };
    let found: Vec<_> = (0..DRAWS).map(|seed| alarms(dive(seed))).collect();
    let false_alarms: usize = found.iter().map(|(count, _)| count).sum();
    let noticed = found.iter().filter(|(_, late_s)| late_s.is_some_and(|s| s < 120.0)).count();
    assert!(false_alarms <= 1 && noticed as u64 >= DRAWS - 1, "{found:?}");
}

/// Draws of the rates that the book states.
const MANY: u64 = 48;

#[test]
#[ignore = "prints the rates of docs/src/methods/online.md, from 48 dives of an hour"]
#[allow(clippy::print_stdout, reason = "the rates are what it is for")]
fn rates_of_false_alarms() {
    println!(
        "| tether, part of thrust | false alarms in {MANY} h | payloads noticed | median, s |"
    );
    println!("|---|--:|--:|--:|");
    for tether in [0.0, 0.02, 0.1, 0.3] {
        let dive = |seed| Dive { before_s: 3600.0, after_s: 600.0, tether, seed };
        let found: Vec<_> = (0..MANY).map(|seed| alarms(dive(seed))).collect();
        let false_alarms: usize = found.iter().map(|(count, _)| count).sum();
        let mut late_s: Vec<f64> = found.iter().filter_map(|(_, late_s)| *late_s).collect();
        late_s.sort_by(f64::total_cmp);
        let median = late_s.get(late_s.len() / 2).map_or("none".to_owned(), |s| format!("{s:.0}"));
        println!("| {tether} | {false_alarms} | {} of {MANY} | {median} |", late_s.len());
        assert!(false_alarms as u64 <= MANY, "{false_alarms}");
    }
}

#[test]
fn bad_samples_are_refused_and_change_nothing() {
    let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    let mut online =
        Online::new(structure, Scheme::Adaptive, OnlineOptions::default(), None).expect("sound");
    let sample = Sample { time_s: 1.0, ..Sample::default() };
    online.update(&sample).expect("the first");
    let error = online.estimate().expect_err("nothing yet").to_string();
    assert!(error.contains("not known yet"), "{error}");
    let error = online.update(&sample).expect_err("the same time").to_string();
    assert!(error.contains("after that of the one before"), "{error}");
    let broken = Sample { time_s: 2.0, velocity: Vector6::repeat(f64::NAN), ..sample };
    assert!(online.update(&broken).expect_err("not finite").to_string().contains("not finite"));
    let wild = Sample { time_s: 2.0, velocity: Vector6::repeat(1e300), ..sample };
    assert!(online.update(&wild).expect_err("too fast").to_string().contains("at most 1e12"));
    for duration_s in [-1.0, f64::NAN, 1e12] {
        let error = online.predict(duration_s).expect_err("no such time").to_string();
        assert!(error.contains("from 0 to 3600 s"), "{error}");
    }
    let options = OnlineOptions { adaptation_s: 0.0, ..OnlineOptions::default() };
    let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    let error = Online::new(structure, Scheme::Adaptive, options, None).err().expect("no time");
    assert!(error.to_string().contains("adaptation_s"), "{error}");
}

#[test]
fn a_structure_without_a_free_coefficient_or_with_too_many_signals_is_refused() {
    let surge = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    let terms = surge.terms().to_vec();
    let held = terms.iter().try_fold(surge, |held, term| held.holding(*term, 100.0));
    let foil = |k: usize| Foil {
        kind: Surface::Rudder,
        name: format!("rudder {k}"),
        position_m: [-1.5, 0.0, 0.0],
        axis: [0.0, 0.0, -1.0],
        stall_rad: None,
    };
    let sway = Structure::of(&[Dof::Sway], Symmetry::None).expect("sway");
    let many = (0..=MOST_SIGNALS).try_fold(sway, |structure, k| {
        let force = EffectForce::Lift { foil: foil(k), propeller_ahead: None };
        structure.with_effect(Effect { name: format!("rudder {k}.lift"), force }, true)
    });
    let refused = [(held, "holds every coefficient"), (many, "33 signals")];
    for (structure, words) in refused {
        let structure = structure.expect("a structure");
        let options = OnlineOptions::default();
        let error = Online::new(structure, Scheme::Recursive, options, None).err().expect("no");
        assert!(error.to_string().contains(words), "{error}");
    }
}

#[test]
fn a_coefficient_that_is_held_stays_and_the_others_are_found() {
    let truth =
        Plant::new(three_axes(), vec![20.0, 25.0, 0.6, 0.5, 5.0, 30.0, 8.0, 60.0, 0.1, 1.2]);
    let truth = truth.expect("possible");
    let how = Driven { h: 0.1, duration_s: 400.0, noise: 0.002, tether: 0.0, seed: 3 };
    let samples = drive(&truth, [40.0, 50.0, 0.0, 0.0, 0.0, 1.0], &how);
    let sway = Basis::Mass(Dof::Sway, Dof::Sway);
    let structure = three_axes().holding(sway, 25.0).expect("held");
    for scheme in SCHEMES {
        let options = OnlineOptions::default();
        let mut online = Online::new(structure.clone(), scheme, options, None).expect("sound");
        fed(&mut online, &samples);
        let found = online.estimate().expect("learnt");
        let k = structure.index_of(&sway).expect("there");
        assert_eq!((found.plant.coefficients()[k], found.std[k]), (25.0, 0.0), "{scheme:?}");
        let (off, name) = errors(&found.plant, &truth).remove(0);
        assert!(off < 0.05 && found.excitation > 0.0, "{scheme:?} {name}");
    }
}
