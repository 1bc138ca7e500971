//! Yaw from a compass that loses its reading, jitters or has a dead gyro beside it.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use seaplant::quantity::{Attitude, Axis};
use seaplant::results::PlantResult;
use seaplant::{
    CaveatCode, Dof, IdentifyOptions, Method, PhysicalParameters, Quantity, Recording, Role, State,
    Timed, Trial, TrialSetup, Vehicle, identify, simulate,
};

/// A small vehicle that turns at up to 1.5 rad/s.
const TRUTH: PhysicalParameters =
    PhysicalParameters { mass: 2.6, d_quadratic: 1.3, d_linear: 0.0, bias_force: 0.0 };

/// A compass' noise, rad.
const NOISE_RAD: f64 = 0.003;

/// Half of the gaps that were seen to do harm were longer than this, s.
const GAPS_S: [(f64, f64); 6] =
    [(20.0, 26.0), (60.0, 69.0), (95.0, 98.0), (140.0, 150.0), (190.0, 203.0), (230.0, 231.0)];

/// How a log differs from a sound one.
#[derive(Clone, Copy, Default)]
struct Faults {
    gaps: bool,
    /// Stamps that are off by up to so much, s.
    jitter_s: f64,
    dead_gyro: bool,
    continuous: bool,
}

fn trial(name: &str, role: Role, seed: u64, faults: Faults) -> Trial {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let time_s: Vec<f64> = (0..2500).map(|k| 0.1 * f64::from(k)).collect();
    let phase = seed as f64;
    let moment = |t: f64| {
        1.6 * (0.21 * t + phase).sin() + 0.9 * (0.67 * t).sin() + 0.8 * (1.3 * t + phase).cos()
    };
    let moments: Vec<f64> = time_s.iter().map(|t| moment(*t)).collect();
    let wrench = Timed::new("moment", time_s.clone(), moments).expect("valid");
    let moved =
        simulate(Dof::Yaw, &TRUTH.to_lumped(), &wrench, State::default(), &time_s).expect("stable");
    let (mut stamps, mut headings) = (Vec::new(), Vec::new());
    for (t, psi) in time_s.iter().zip(&moved.position) {
        let heading = 1.0 + psi + NOISE_RAD * random.sample::<f64, _>(StandardNormal);
        let stamp = t + faults.jitter_s * random.random_range(0.0..1.0);
        let is_lost = GAPS_S.iter().any(|(from, to)| faults.gaps && t > from && t < to);
        if !is_lost && stamps.last().is_none_or(|last| stamp > *last) {
            stamps.push(stamp);
            headings.push(if faults.continuous { heading } else { heading.rem_euclid(TAU) });
        }
    }
    let heading = Timed::new("heading", stamps, headings).expect("valid");
    let mut recording = Recording::from([
        (Quantity::Wrench(Dof::Yaw), wrench.clone()),
        (Quantity::Attitude(Attitude::Heading), heading),
    ]);
    if faults.dead_gyro {
        recording.insert(Quantity::Rate(Axis::Z), wrench.map(|_| 0.0));
    }
    let setup =
        TrialSetup { name: name.to_owned(), role, dofs: vec![Dof::Yaw], ..Default::default() };
    Trial::new(setup, &recording, &Vehicle::default()).expect("complete")
}

/// The plants of filter error and output error.
fn plants(faults: Faults) -> [PlantResult; 2] {
    let trials = [
        trial("a", Role::Fit, 1, faults),
        trial("b", Role::Fit, 2, faults),
        trial("c", Role::HoldOut, 3, faults),
    ];
    let methods = vec![Method::FilterError, Method::OutputError];
    let options = IdentifyOptions { methods: methods.clone(), ..Default::default() };
    let mut found = identify(&Vehicle::default(), &trials, &options).results;
    let mut of_yaw = found.methods.remove("yaw").expect("fitted");
    [0, 1].map(|k| of_yaw.remove(&methods[k]).expect("fitted"))
}

/// Inertia and drag within one per cent, which noise and gaps leave; and a score that is that
/// of the motion and not of the compass.
fn assert_right(plants: &[PlantResult; 2]) {
    for plant in plants {
        let own = &plant.by_axis[&Dof::Yaw];
        let drag = own.quadratic_drag.as_ref().expect("fitted").value / TRUTH.d_quadratic;
        let mass = own.mass.value / TRUTH.mass;
        assert!((mass - 1.0).abs() < 0.01, "{:?}: inertia {mass}", plant.method);
        assert!((drag - 1.0).abs() < 0.01, "{:?}: drag {drag}", plant.method);
        let score = plant.held_out(Dof::Yaw).expect("one trial is held out");
        let e = score.mean_abs_error.expect("it is stable");
        assert!(e < 0.03 * score.null_error, "{e} of {}", score.null_error);
    }
}

#[test]
fn gaps_of_heading_cost_no_turn() {
    let found = plants(Faults { gaps: true, ..Faults::default() });
    assert_right(&found);
    let cut = |message: &str| message.contains("turned half around");
    assert!(found[0].caveats.iter().any(|c| c.code == CaveatCode::Gaps && cut(&c.message)));
}

#[test]
fn a_heading_that_is_written_continuous_keeps_its_turns_across_gaps() {
    let found = plants(Faults { gaps: true, continuous: true, ..Faults::default() });
    assert_right(&found);
    assert!(!found[0].caveats.iter().any(|c| c.message.contains("turned half around")));
}

#[test]
fn stamps_that_jitter_by_a_tenth_of_a_second_do_not_spoil_the_score() {
    // Stamps are late by 0.05 s on average, which the filter finds and output error does not.
    let found = plants(Faults { jitter_s: 0.1, ..Faults::default() });
    for plant in &found {
        let score = plant.held_out(Dof::Yaw).expect("one trial is held out");
        let e = score.mean_abs_error.expect("it is stable");
        assert!(e < 0.1 * score.null_error, "{e} of {}", score.null_error);
    }
}

#[test]
fn a_dead_gyro_gives_way_to_the_compass() {
    let found = plants(Faults { dead_gyro: true, ..Faults::default() });
    assert_right(&found);
    let said = |c: &&seaplant::Caveat| c.code == CaveatCode::InstrumentsDisagree;
    let caveat = found[0].caveats.iter().find(said).expect("it is said");
    assert!(caveat.message.contains("rate.yaw never changes"), "{}", caveat.message);
}
