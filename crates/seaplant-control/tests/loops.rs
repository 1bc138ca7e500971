//! Closed loops of one and six axes.

use std::collections::BTreeMap;

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use seaplant::Dof;
use seaplant::plant::{Basis, Plant, Structure, Symmetry};
use seaplant_control::{
    Actuators, Controller, Design, Error, Gains, Law, Path, Reference, Sea, State, Tracked, Tuning,
    c_header, design, gains_of_toml, track,
};

/// Returns a small six-axis vehicle, similar to the published BlueROV2 Heavy.
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

fn scaled(plant: &Plant, by: f64) -> Plant {
    let coefficients = plant.coefficients().iter().map(|x| by * x).collect();
    Plant::new(plant.structure().clone(), coefficients).expect("possible")
}

/// Returns the vehicle with other masses and damping, and its own weight and righting moment.
fn heavier(plant: &Plant, by: f64) -> Plant {
    let terms = plant.structure().terms().iter().zip(plant.coefficients());
    let moved = terms.map(|(term, x)| match term {
        Basis::WeightExcess | Basis::Lever(_) => *x,
        _ => by * x,
    });
    Plant::new(plant.structure().clone(), moved.collect()).expect("possible")
}

fn asked(law: Law, adapts: bool, hz: f64) -> Design {
    let tuning = Dof::ALL.map(|dof| (dof, Tuning::new(hz, 1.0))).into();
    Design { law, adapts, tuning, sample_hz: 20.0, adaptation_s: 20.0, ..Design::default() }
}

fn paths() -> BTreeMap<Dof, Path> {
    let sine = |amplitude, rate| Path::Sine { amplitude, rate };
    [
        (Dof::Surge, sine(0.5, 0.6)),
        (Dof::Sway, sine(0.5, 0.45)),
        (Dof::Heave, sine(0.4, 0.5)),
        (Dof::Yaw, sine(0.8, 0.35)),
    ]
    .into()
}

fn followed(law: Law, adapts: bool, believed: &Plant, duration_s: f64) -> Tracked {
    let truth = six_axes();
    let asked = asked(law, adapts, 0.2);
    let gains = design(&truth, &[], &Actuators::default(), &asked).expect("sound");
    let mut controller = Controller::new(believed.clone(), gains, &asked.speed);
    let (actuators, sea) = (Actuators::default(), Sea::default());
    track(&truth, &mut controller, &actuators, &paths(), &sea, duration_s).expect("stable")
}

fn worst(tracked: &Tracked) -> f64 {
    tracked.rms.values().copied().fold(0.0, f64::max)
}

#[test]
fn a_right_model_follows_in_six_axes_where_feedback_alone_lags() {
    let truth = six_axes();
    let pd = worst(&followed(Law::Pd, false, &truth, 100.0));
    for law in [Law::Exact, Law::NonExact, Law::SlotineLi] {
        let model = worst(&followed(law, false, &truth, 100.0));
        assert!(model < 0.1 * pd, "{law:?}: {model} against {pd}");
    }
}

#[test]
fn an_adaptive_model_repairs_a_wrong_one() {
    let wrong = heavier(&six_axes(), 2.0);
    for law in [Law::NonExact, Law::SlotineLi] {
        let fixed = followed(law, false, &wrong, 300.0);
        let adaptive = followed(law, true, &wrong, 300.0);
        // Errors of the last third: adaptation needs minutes.
        let late = |tracked: &Tracked, dof: Dof| {
            let from = 2 * tracked.error.len() / 3;
            let errors = tracked.error[from..].iter().map(|e| e[dof.index()].powi(2));
            (errors.sum::<f64>() / (tracked.error.len() - from) as f64).sqrt()
        };
        for dof in [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw] {
            let (fixed, adaptive) = (late(&fixed, dof), late(&adaptive, dof));
            assert!(adaptive < 0.6 * fixed, "{law:?} {dof}: {adaptive} against {fixed}");
        }
    }
}

#[test]
fn a_bandwidth_beyond_the_lag_is_refused_with_one_that_would_do() {
    let truth = six_axes();
    let lagging = Actuators { lag_s: [0.5; 6], delay_s: [0.2; 6], ..Actuators::default() };
    let error = design(&truth, &[], &lagging, &asked(Law::Pd, false, 1.0)).expect_err("too fast");
    let Error::Bandwidth { reachable_hz: Some(reachable_hz), dof, .. } = error else {
        panic!("{error}")
    };
    assert!(reachable_hz < 1.0, "{reachable_hz}");
    let mut slower = asked(Law::Pd, false, 0.05);
    slower.tuning.insert(dof, Tuning::new(0.99 * reachable_hz, 1.0));
    design(&truth, &[], &lagging, &slower).expect("what would do does");
}

#[test]
fn the_loop_that_is_called_unstable_runs_away_and_the_other_does_not() {
    let truth = six_axes();
    let late = Actuators { lag_s: [0.4; 6], delay_s: [0.3; 6], ..Actuators::default() };
    let sea = Sea { position_noise: 1e-4, ..Sea::default() };
    for (hz, is_stable) in [(0.1, true), (0.9, false)] {
        let asked = Design { anyway: true, ..asked(Law::Pd, false, hz) };
        let gains = design(&truth, &[], &late, &asked).expect("anyway");
        let told = gains.notes.iter().any(|note| note.contains("unstable"));
        assert_eq!(told, !is_stable, "{:?}", gains.notes);
        let mut controller = Controller::new(truth.clone(), gains, &asked.speed);
        let still = BTreeMap::new();
        let end = track(&truth, &mut controller, &late, &still, &sea, 120.0);
        // Buoyancy of 2 N alone holds it 0.16 m off its depth.
        let holds = end.is_ok_and(|tracked| worst(&tracked) < 0.3);
        assert_eq!(holds, is_stable, "{hz} Hz");
    }
}

#[test]
fn an_integral_that_acts_too_fast_is_refused_with_the_time_that_would_do() {
    let truth = six_axes();
    let mut hasty = asked(Law::Pid, false, 0.1);
    hasty.tuning.insert(Dof::Surge, Tuning { integral_s: Some(0.5), ..Tuning::new(0.1, 1.0) });
    let error = design(&truth, &[], &Actuators::default(), &hasty).expect_err("too fast");
    let Error::Integral { least_s, .. } = error else { panic!("{error}") };
    let patient = Tuning { integral_s: Some(1.01 * least_s), ..Tuning::new(0.1, 1.0) };
    hasty.tuning.insert(Dof::Surge, patient);
    design(&truth, &[], &Actuators::default(), &hasty).expect("what would do does");
}

#[test]
fn draws_determine_the_worst_case() {
    let truth = six_axes();
    let draws: Vec<Plant> = [0.5, 1.0, 2.0].map(|by| scaled(&truth, by)).into();
    let late = Actuators { lag_s: [0.3; 6], ..Actuators::default() };
    let gains = design(&truth, &draws, &late, &asked(Law::Pd, false, 0.15)).expect("sound");
    let surge = &gains.axes[&Dof::Surge];
    assert!(surge.worst.phase_deg < surge.margins.phase_deg - 5.0, "{surge:?}");
    assert_eq!((gains.draws, gains.probability_unstable), (3, 0.0));
}

#[test]
fn gains_come_back_from_their_file() {
    let gains = design(&six_axes(), &[], &Actuators::default(), &asked(Law::Pid, false, 0.1));
    let gains: Gains = gains.expect("sound");
    let text = toml::to_string(&gains).expect("plain data");
    assert_eq!(gains_of_toml(&text).expect("its own file"), gains);
    let error = gains_of_toml(&text.replace("control/1", "control/9")).expect_err("another");
    assert!(error.to_string().contains("control/9"), "{error}");
}

#[test]
fn laws_that_the_header_does_not_support_are_reported() {
    let gains = design(&six_axes(), &[], &Actuators::default(), &asked(Law::SlotineLi, false, 0.1));
    let error = c_header("x", &gains.expect("sound")).expect_err("no place").to_string();
    assert!(error.contains("non-exact"), "{error}");
}

#[test]
fn a_state_without_a_number_gives_no_force_and_leaves_no_trace() {
    let plant = six_axes();
    let asked = asked(Law::Pid, false, 0.1);
    let gains = design(&plant, &[], &Actuators::default(), &asked).expect("gains");
    let mut controller = Controller::new(plant, gains, &asked.speed);
    let state = State {
        position_ned: Vector3::zeros(),
        attitude: UnitQuaternion::identity(),
        velocity: Vector6::zeros(),
    };
    let to = Reference::at(Vector3::x(), UnitQuaternion::identity());
    let lost = State { position_ned: Vector3::repeat(f64::NAN), ..state };
    assert_eq!(controller.command(&lost, &to)[0], 0.0);
    let force = controller.command(&state, &to)[0];
    assert!(force.is_finite() && force > 0.0, "{force}");
}
