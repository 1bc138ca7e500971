//! Between its first samples and its last, `Online` allocates nothing.

use nalgebra::Vector6;
use seaplant::estimate::online::{Change, Online, OnlineOptions, Sample, Scheme};
use seaplant::motion::{Inputs, down_body, simulate};
use seaplant::plant::{Basis, Plant, Structure, Symmetry};
use seaplant::{Dof, Timed};

/// So many samples, at 10 Hz: ten minutes.
const SAMPLES: usize = 6000;

/// What is taken in first, s: least squares make the start.
const START_S: f64 = 210.0;

/// A vehicle of six axes, its coefficients by term.
fn vehicle() -> Plant {
    let structure = Structure::of(&Dof::ALL, Symmetry::Diagonal).expect("six axes");
    let own = [19.86, 20.62, 32.18, 0.45, 0.37, 0.59];
    let damping = [141.0, 217.0, 190.0, 1.19, 0.47, 1.5];
    let value = |term: &Basis| match term {
        Basis::Mass(i, _) => own[i.index()],
        Basis::Product(on, product) if product.speed() == 0 => damping[on.index()],
        Basis::WeightExcess => -2.0,
        Basis::Lever(_) => 6.6,
        _ => 0.0,
    };
    let coefficients = structure.terms().iter().map(value).collect();
    Plant::new(structure, coefficients).expect("possible")
}

fn samples() -> Vec<Sample> {
    let times: Vec<f64> = (0..SAMPLES).map(|k| 0.1 * k as f64).collect();
    let mut inputs = Inputs::default();
    for (axis, size) in [40.0, 40.0, 40.0, 2.0, 2.0, 4.0].into_iter().enumerate() {
        let of = |t: &f64| {
            let wave = |rate: f64| (rate * (1.0 + 0.17 * axis as f64) * t + axis as f64).sin();
            size * (wave(0.31) + 0.5 * wave(1.3))
        };
        let force: Vec<f64> = times.iter().map(of).collect();
        inputs.force[axis] = Some(Timed::new("force", times.clone(), force).expect("valid"));
    }
    let moved = simulate(&vehicle(), &inputs, &Vector6::zeros(), &times).expect("stable");
    let of = |k: usize| {
        let [roll, pitch, _] = moved.attitude[k];
        // Twice as strong as logged later: the plant seems to change.
        let part = if k > SAMPLES / 2 { 0.5 } else { 1.0 };
        let force = |axis: usize| inputs.force[axis].as_ref().map_or(0.0, |x| x.values()[k]);
        Sample {
            time_s: times[k],
            velocity: moved.velocity[k],
            force: Vector6::from_fn(|i, _| part * force(i)),
            down_body: down_body(roll, pitch),
            ..Sample::default()
        }
    };
    (0..SAMPLES).map(of).collect()
}

#[test]
fn nothing_is_allocated_for_a_sample() {
    let samples = samples();
    let structure = vehicle().structure().clone();
    for scheme in [Scheme::Adaptive, Scheme::Recursive, Scheme::Ekf] {
        let options = OnlineOptions { memory_s: Some(120.0), ..OnlineOptions::default() };
        let online = Online::new(structure.clone(), scheme, options, None);
        let mut online = online.expect("sound");
        let (first, later) = samples.split_at((10.0 * START_S) as usize);
        // A joint filter that the changed plant throws off begins anew, with a state of its own.
        let measured = if scheme == Scheme::Ekf { SAMPLES / 2 - first.len() } else { later.len() };
        let (measured, rest) = later.split_at(measured);
        for sample in first {
            online.update(sample).expect("in order");
        }
        assert!(online.has_started(), "{scheme:?}");
        let mut changes = 0;
        let counted = allocation_counter::measure(|| {
            for sample in measured {
                let change: Option<Change> = online.update(sample).expect("in order");
                changes += usize::from(change.is_some());
            }
        });
        assert_eq!((counted.count_total, counted.bytes_total), (0, 0), "{scheme:?}");
        for sample in rest {
            changes += usize::from(online.update(sample).expect("in order").is_some());
        }
        assert!(changes > 0, "{scheme:?} notices no change");
        online.estimate().expect("learnt");
    }
}
