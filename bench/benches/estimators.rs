//! Benchmarks of the hot paths: `cargo bench -p seaplant-bench`.

use std::hint::black_box;
use std::path::Path;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Vector3, Vector6};
use seaplant::estimate::online::{Online, OnlineOptions, Sample, Scheme};
use seaplant::estimate::{Candidate, EquationError, FilterError, OutputError, Records, fit_plant};
use seaplant::plant::{Structure, Symmetry};
use seaplant::regression::{Columns, least_squares};
use seaplant::signal::LowPass;
use seaplant::twin::{TwinTrial, VehicleTwinSpec, make_vehicle};
use seaplant::{
    Dof, Recording, Role, State, Terms, Timed, Trial, TrialRecord, TrialSetup, simulate,
};
use seaplant_bench::{SAMPLE_HZ, SURGE, SurgeSignals};
use seaplant_campaign::read_plant_file;

const SEED: u64 = 1;

/// 480 s at 10 Hz, both ends included.
const TRIAL_ROWS: usize = 4801;

fn signals(n: usize) -> SurgeSignals {
    SurgeSignals::seeded(n, SEED).expect("a stable plant")
}

fn zero_phase_filter(c: &mut Criterion) {
    let filter = LowPass { cutoff_hz: 0.5, order: 2 };
    for (name, n) in [("6001 samples", 6001), ("a million samples", 1_000_000)] {
        let v = signals(n).v;
        c.bench_function(&format!("zero-phase filter of {name}"), |b| {
            b.iter(|| filter.zero_phase(black_box(&v), SAMPLE_HZ).expect("long enough"));
        });
    }
}

fn least_squares_of_many_rows(c: &mut Criterion) {
    let SurgeSignals { v, tau } = signals(100_000);
    let plant = SURGE.to_lumped();
    let columns = [Columns {
        v_dot: tau.iter().zip(&v).map(|(&tau, &v)| plant.acceleration(tau, v)).collect(),
        quadratic: v.iter().map(|v| v * v.abs()).collect(),
        tau,
        linear: v,
        period_s: 1.0 / SAMPLE_HZ,
    }];
    c.bench_function("least squares of 100 000 rows", |b| {
        b.iter(|| least_squares(Dof::Surge, black_box(&columns), Terms::default()));
    });
}

fn equation_error_of_a_trial(c: &mut Criterion) {
    let record = [signals(TRIAL_ROWS).record().expect("valid")];
    let method = EquationError::default();
    c.bench_function("equation error of a 480 s trial", |b| {
        b.iter(|| method.fit(black_box(&record)).expect("exciting"));
    });
}

/// 600 s at 10 Hz, both ends included.
const LONG_TRIAL_ROWS: usize = 6001;

fn output_error_of_a_trial(c: &mut Criterion) {
    let record = [signals(LONG_TRIAL_ROWS).record().expect("valid")];
    let terms: Terms = "force,quadratic,linear,bias".parse().expect("a plant");
    let records = Records::from(&record).with_terms(terms);
    let method = OutputError::default();
    let near = EquationError::default().fit(records).expect("exciting").lumped;
    c.bench_function("output error of a 600 s trial from its start", |b| {
        b.iter(|| method.fit_from(black_box(records), black_box(&near)).expect("an optimum"));
    });
    c.bench_function("output error of a 600 s trial, the start included", |b| {
        b.iter(|| method.fit(black_box(records)).expect("an optimum"));
    });
}

fn filter_error_of_a_trial(c: &mut Criterion) {
    let record = [signals(TRIAL_ROWS).record().expect("valid")];
    let search = FilterError::default();
    let none = FilterError { candidates: Vec::new(), required: vec![Candidate::Bias] };
    // In addition to mass, drag, bias and three noise parameters.
    let four = vec![
        Candidate::Bias,
        Candidate::Lag,
        Candidate::Delay,
        Candidate::ReverseRatio,
        Candidate::Current,
    ];
    let ten = FilterError { candidates: Vec::new(), required: four };
    let cases =
        [("6 parameters", none), ("10 parameters", ten), ("its whole structure search", search)];
    for (name, method) in cases {
        c.bench_function(&format!("filter error of a 480 s trial, {name}"), |b| {
            b.iter(|| method.fit(black_box(&record)).expect("an optimum"));
        });
    }
}

/// Times two trials of 450 s of a work-class vehicle, driven freely: a DVL at 10 Hz, a gyroscope at
/// 50 Hz or at 10 Hz.
fn filter_error_of_several_axes(c: &mut Criterion) {
    let vehicle = "published:rexrov";
    let table = read_plant_file(Path::new(vehicle)).expect("a table").expect("a plant");
    let model = table.model().expect("possible");
    let spec = VehicleTwinSpec { vehicle: vehicle.into(), duration_s: 450.0, ..Default::default() };
    let twin = make_vehicle(&spec, &model).expect("can be made");
    let planar = [Dof::Surge, Dof::Sway, Dof::Yaw];
    let mut group = c.benchmark_group("filter error of 2 × 450 s");
    group.sample_size(10);
    let all = [(&planar[..], 10), (&planar[..], 50), (&Dof::ALL, 10), (&Dof::ALL, 50)];
    for (axes, gyro_hz) in all {
        let trial = |log: &TwinTrial| {
            let recording = if gyro_hz == 10 { &at_10_hz(&log.recording) } else { &log.recording };
            let together = vec![axes.to_vec()];
            let setup = TrialSetup { name: log.name.clone(), together, ..TrialSetup::default() };
            Trial::new(setup, recording, &twin.vehicle).expect("complete")
        };
        let fitted = twin.trials.iter().filter(|log| log.role == Role::Fit);
        let trials: Vec<Trial> = fitted.map(trial).collect();
        let records: Vec<&TrialRecord> =
            trials.iter().map(|trial| trial.record(axes).expect("measured")).collect();
        let structure = Structure::of(axes, Symmetry::PortStarboard).expect("axes");
        let body = twin.vehicle.rigid_body.as_ref();
        let coefficients = structure.terms().len();
        let of = format!("{} axes, {coefficients} coefficients, {gyro_hz} Hz", axes.len());
        group.bench_function(of, |b| {
            b.iter(|| fit_plant(&structure, black_box(&records), body, true).expect("settles"));
        });
    }
    group.finish();
}

/// Keeps every fifth sample of channels logged at 50 Hz.
fn at_10_hz(recording: &Recording) -> Recording {
    let thinned = |series: &Timed| {
        let kept = |of: &[f64]| of.iter().copied().step_by(5).collect::<Vec<f64>>();
        Timed::new("every fifth", kept(series.time_s()), kept(series.values())).expect("valid")
    };
    let is_fast = |series: &Timed| series.period_s() < 0.05;
    let of = |series: &Timed| if is_fast(series) { thinned(series) } else { series.clone() };
    recording.iter().map(|(quantity, series)| (quantity.clone(), of(series))).collect()
}

fn simulation_of_a_trial(c: &mut Criterion) {
    let record = signals(TRIAL_ROWS).record().expect("valid");
    let plant = SURGE.to_lumped();
    c.bench_function("simulation of a 480 s trial", |b| {
        b.iter(|| {
            let times_s = record.force.time_s();
            simulate(Dof::Surge, black_box(&plant), &record.force, State::default(), times_s)
                .expect("stable")
        });
    });
}

/// Returns 100 s at 20 Hz, with every axis in motion.
fn six_axis_samples() -> Vec<Sample> {
    let sine = |size: f64, rate: f64, t: f64, i: usize| size * ((rate + 0.19 * i as f64) * t).sin();
    let at = |k: u32| {
        let time_s = 0.05 * f64::from(k);
        Sample {
            time_s,
            velocity: Vector6::from_fn(|i, _| sine(0.5, 0.3, time_s, i)),
            down_body: Vector3::new(0.1 * time_s.sin(), 0.0, 1.0).normalize(),
            force: Vector6::from_fn(|i, _| sine(10.0, 0.5, time_s, i)),
            ..Sample::default()
        }
    };
    (0..2000).map(at).collect()
}

fn samples_of_six_axes(c: &mut Criterion) {
    let samples = six_axis_samples();
    for scheme in [Scheme::Adaptive, Scheme::Recursive, Scheme::Ekf] {
        let structure = Structure::of(&Dof::ALL, Symmetry::PortStarboard).expect("six axes");
        let mut online =
            Online::new(structure, scheme, OnlineOptions::default(), None).expect("sound");
        c.bench_function(&format!("2000 samples of six axes online, {scheme:?}"), |b| {
            b.iter(|| {
                online.restart();
                for sample in black_box(&samples) {
                    online.update(sample).expect("in order");
                }
            });
        });
    }
}

criterion_group!(
    benches,
    zero_phase_filter,
    least_squares_of_many_rows,
    equation_error_of_a_trial,
    output_error_of_a_trial,
    filter_error_of_a_trial,
    filter_error_of_several_axes,
    simulation_of_a_trial,
    samples_of_six_axes
);
criterion_main!(benches);
