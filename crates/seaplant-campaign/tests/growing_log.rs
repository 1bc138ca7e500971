//! Identification while a log is being written.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::thread;

use nalgebra::Vector6;
use seaplant::Dof;
use seaplant::estimate::online::{Online, OnlineEstimate, OnlineOptions, Sample, Scheme};
use seaplant::plant::{Structure, Symmetry};

/// Mass in kg, linear and quadratic drag.
const TRUTH: [f64; 3] = [100.0, 5.0, 20.0];

/// Returns rows of time in s, velocity in m/s, force in N from then on: two minutes at 10 Hz.
fn rows() -> Vec<String> {
    let (mut v, h) = (0.0_f64, 0.1);
    let row = |k: usize| {
        let t = h * k as f64;
        let force = 40.0 * (0.7 * t).sin() + 25.0 * (0.2 * t).sin();
        let row = format!("{t:.1},{v:.6},{force:.4}\n");
        for _ in 0..100 {
            let [mass, linear, quadratic] = TRUTH;
            v += 0.01 * h * (force - linear * v - quadratic * v * v.abs()) / mass;
        }
        row
    };
    (0..1200).map(row).collect()
}

fn surge(scheme: Scheme) -> Online {
    let structure = Structure::of(&[Dof::Surge], Symmetry::None).expect("surge");
    Online::new(structure, scheme, OnlineOptions::default(), None).expect("sound")
}

fn sample(row: &str) -> Sample {
    let mut cells = row.trim_end().split(',').map(|cell| cell.parse::<f64>().expect("a number"));
    let mut next = || cells.next().expect("three cells");
    let (time_s, v, force) = (next(), next(), next());
    Sample { time_s, velocity: Vector6::x() * v, force: Vector6::x() * force, ..Sample::default() }
}

/// Reads the rows added since the last call, complete ones only.
struct Tail {
    reader: BufReader<File>,
    row: String,
}

impl Tail {
    fn new(path: &Path) -> Self {
        Self { reader: BufReader::new(File::open(path).expect("there")), row: String::new() }
    }

    fn next_row(&mut self) -> Option<&str> {
        if self.row.ends_with('\n') {
            self.row.clear();
        }
        self.reader.read_line(&mut self.row).expect("text");
        self.row.ends_with('\n').then_some(&self.row)
    }
}

/// Estimates from a log while it is written, in pieces that end within rows.
fn followed(scheme: Scheme, folder: &Path) -> OnlineEstimate {
    let path = folder.join("growing.csv");
    File::create(&path).expect("a file");
    let writer = thread::spawn({
        let path = path.clone();
        move || {
            let mut file = OpenOptions::new().append(true).open(path).expect("a file");
            for piece in rows().concat().as_bytes().chunks(777) {
                file.write_all(piece).expect("written");
                file.flush().expect("written");
                thread::yield_now();
            }
        }
    });
    let (mut tail, mut online, mut taken) = (Tail::new(&path), surge(scheme), 0);
    let whole = rows().len();
    while taken < whole {
        let Some(row) = tail.next_row() else {
            thread::yield_now();
            continue;
        };
        online.update(&sample(row)).expect("in order");
        taken += 1;
    }
    writer.join().expect("written");
    online.estimate().expect("learnt")
}

#[test]
fn a_log_that_grows_gives_what_the_whole_log_gives() {
    let folder = tempfile::tempdir().expect("a folder");
    for scheme in [Scheme::Adaptive, Scheme::Recursive, Scheme::Ekf] {
        let mut at_once = surge(scheme);
        for row in rows() {
            at_once.update(&sample(&row)).expect("in order");
        }
        let at_once = at_once.estimate().expect("learnt");
        let grown = followed(scheme, folder.path());
        assert_eq!(grown, at_once, "{scheme:?}");
        for (found, truth) in grown.plant.coefficients().iter().zip(TRUTH) {
            assert!((found / truth - 1.0).abs() < 0.05, "{scheme:?}: {found} of {truth}");
        }
    }
}
