//! Identification sample by sample, against truth and against batch methods.

use nalgebra::Vector6;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use seaplant::estimate::online::{Online, OnlineOptions, Sample, Scheme};
use seaplant::motion::{Inputs, down_body, simulate};
use seaplant::plant::{Basis, Plant, Structure, Symmetry};
use seaplant::{CoupledPlan, Dof, Fin, Surface, Timed, Vehicle};

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
    seed: u64,
}

/// Samples of a vehicle that is driven freely in its axes.
fn drive(plant: &Plant, sizes: [f64; 6], how: &Driven) -> Vec<Sample> {
    let mut rng = ChaCha8Rng::seed_from_u64(how.seed);
    let n = (how.duration_s / how.h) as usize;
    let times: Vec<f64> = (0..n).map(|k| how.h * k as f64).collect();
    let mut inputs = Inputs::default();
    for (axis, size) in sizes.into_iter().enumerate().filter(|(_, size)| *size > 0.0) {
        let force = joystick(size, how.duration_s, &mut rng);
        // Held over each sample, as a controller's output is.
        let held: Vec<f64> = times.iter().map(|t| force.held_at(t + 1e-9)).collect();
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
            force: Vector6::from_fn(|i, _| {
                inputs.force[i].as_ref().map_or(0.0, |force| force.held_at(times[k] + 1e-9))
            }),
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
    let how = Driven { h: 0.05, duration_s: 600.0, noise: 0.002, seed: 3 };
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
    let samples =
        drive(&truth, SIX, &Driven { h: 0.05, duration_s: CONVERGED_S, noise: 0.002, seed: 5 });
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
        &Driven { h: 0.1, duration_s: 300.0, noise: 0.001, seed: 1 },
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

/// A payload: every mass a quarter more from the middle of the record on.
fn loaded(seed: u64) -> Vec<Sample> {
    let structure =
        Structure::of(&[Dof::Surge, Dof::Sway, Dof::Yaw], Symmetry::PortStarboard).expect("three");
    let empty = [20.0, 25.0, 0.6, 0.5, 5.0, 30.0, 8.0, 60.0, 0.1, 1.2];
    let full = [26.0, 32.5, 0.8, 0.65, 5.0, 30.0, 8.0, 60.0, 0.1, 1.2];
    let sizes = [40.0, 50.0, 0.0, 0.0, 0.0, 1.0];
    let part = |masses: [f64; 10], seed| {
        let plant = Plant::new(structure.clone(), masses.to_vec()).expect("possible");
        drive(&plant, sizes, &Driven { h: 0.1, duration_s: 600.0, noise: 0.003, seed })
    };
    let mut samples = part(empty, seed);
    let end = samples.last().expect("some").time_s + 0.1;
    samples.extend(
        part(full, seed + 1000).into_iter().map(|s| Sample { time_s: s.time_s + end, ..s }),
    );
    samples
}

/// Draws of which none may raise an alarm in 600 s, and all must within 120 s of the payload.
const DRAWS: u64 = 8;

#[test]
fn a_payload_is_noticed_and_nothing_else_is() {
    let (mut false_alarms, mut noticed) = (0, Vec::new());
    for seed in 0..DRAWS {
        let samples = loaded(seed);
        let structure = Structure::of(&[Dof::Surge, Dof::Sway, Dof::Yaw], Symmetry::PortStarboard)
            .expect("three");
        let mut online = Online::new(structure, Scheme::Recursive, OnlineOptions::default(), None)
            .expect("sound");
        let mut after = None;
        for sample in &samples {
            if let Some(change) = online.update(sample).expect("in order") {
                if change.noticed_s < 600.0 {
                    false_alarms += 1;
                } else {
                    after.get_or_insert(change.noticed_s - 600.0);
                }
            }
        }
        noticed.push(after);
    }
    assert!(false_alarms <= 1, "{false_alarms}");
    assert!(
        noticed.iter().flatten().filter(|s| **s < 120.0).count() as u64 >= DRAWS - 1,
        "{noticed:?}"
    );
}

#[test]
fn bad_samples_are_refused_and_change_nothing() {
    let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    let mut online =
        Online::new(structure, Scheme::Adaptive, OnlineOptions::default(), None).expect("sound");
    let down_body = nalgebra::Vector3::z();
    let sample =
        Sample { time_s: 1.0, velocity: Vector6::zeros(), down_body, force: Vector6::zeros() };
    online.update(&sample).expect("the first");
    let error = online.update(&sample).expect_err("the same time").to_string();
    assert!(error.contains("after that of the one before"), "{error}");
    let broken = Sample { time_s: 2.0, velocity: Vector6::repeat(f64::NAN), ..sample };
    assert!(online.update(&broken).expect_err("not finite").to_string().contains("not finite"));
    let options = OnlineOptions { adaptation_s: 0.0, ..OnlineOptions::default() };
    let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    let error = Online::new(structure, Scheme::Adaptive, options, None).err().expect("no time");
    assert!(error.to_string().contains("adaptation_s"), "{error}");
}

#[test]
fn what_samples_do_not_hold_is_refused_with_what_would_do() {
    let rudder = Fin::new(Surface::Rudder, "rudder", [-1.5, 0.0, 0.0], [0.0, 0.0, -1.0]);
    let vehicle = Vehicle { fins: vec![rudder.expect("a rudder")], ..Vehicle::default() };
    let plan = CoupledPlan {
        axes: vec![Dof::Surge, Dof::Sway, Dof::Yaw],
        symmetry: Symmetry::PortStarboard,
        terms: Vec::new(),
        effects: Vec::new(),
        hold: Default::default(),
        search: false,
    };
    let steered = plan.structure(&vehicle, |_| true).expect("a ship");
    let surge = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    let held = surge.holding(Basis::Mass(Dof::Surge, Dof::Surge), 100.0).expect("held");
    for (structure, names) in [(steered, "`rudder.lift`"), (held, "`mass.surge`")] {
        let options = OnlineOptions::default();
        let error = Online::new(structure, Scheme::Recursive, options, None).err().expect("no");
        let message = error.to_string();
        assert!(message.contains(names) && message.contains("filter-error"), "{message}");
    }
}
