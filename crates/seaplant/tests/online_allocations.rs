//! Between its first samples and its last, `Online` allocates nothing.

use nalgebra::Vector6;
use seaplant::Dof;
use seaplant::estimate::online::{Change, Online, OnlineOptions, Sample, Scheme};
use seaplant::motion::down_body;
use seaplant::plant::{Structure, Symmetry};

/// So many samples, at 10 Hz: ten minutes.
const SAMPLES: usize = 6000;

/// What is taken in first, s: least squares make the start.
const START_S: f64 = 210.0;

/// Six axes that move as no vehicle does: bounded work is what counts, whatever it finds.
fn samples() -> Vec<Sample> {
    let of = |k: usize| {
        let t = 0.1 * k as f64;
        let wave = |i: usize, rate: f64| (rate * (1.0 + 0.17 * i as f64) * t + i as f64).sin();
        Sample {
            time_s: t,
            velocity: Vector6::from_fn(|i, _| 0.4 * wave(i, 0.7)),
            // Half as strong later: the plant seems to change.
            force: Vector6::from_fn(|i, _| 30.0 * wave(i, 0.45))
                * if k > SAMPLES / 2 { 0.5 } else { 1.0 },
            down_body: down_body(0.1 * wave(3, 0.7), 0.1 * wave(4, 0.7)),
            ..Sample::default()
        }
    };
    (0..SAMPLES).map(of).collect()
}

#[test]
fn nothing_is_allocated_for_a_sample() {
    let samples = samples();
    let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
    for scheme in [Scheme::Adaptive, Scheme::Recursive, Scheme::Ekf] {
        let options = OnlineOptions { memory_s: Some(120.0), ..OnlineOptions::default() };
        let online = Online::new(structure.clone(), scheme, options, None);
        let mut online = online.expect("sound");
        let (first, later) = samples.split_at((10.0 * START_S) as usize);
        for sample in first {
            online.update(sample).expect("in order");
        }
        let mut changes = 0;
        let counted = allocation_counter::measure(|| {
            for sample in later {
                let change: Option<Change> = online.update(sample).expect("in order");
                changes += usize::from(change.is_some());
            }
        });
        assert_eq!((counted.count_total, counted.bytes_total), (0, 0), "{scheme:?}");
        online.estimate().expect("learnt");
    }
}
