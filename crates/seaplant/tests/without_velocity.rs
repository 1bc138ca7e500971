//! Vehicles that nothing measures the velocity of: thrust, attitude and an accelerometer.

use seaplant::quantity::{Attitude, Axis};
use seaplant::results::{Results, Trust};
use seaplant::twin::{
    Disturbance, Excitation, TwinAccelerometer, TwinCampaign, TwinPlant, TwinSpec, TwinThrusters,
    make,
};
use seaplant::{
    CaveatCode, Dof, Error, IdentifyOptions, Method, PhysicalParameters, Quantity, Recording, Role,
    ScoredMotion, Trial, TrialSetup, evaluate, identify,
};

/// A small ROV: 20 kg, 60 N/(m/s)², 8 N/(m/s), a tether of 1 N, 0.7 m/s at work.
fn rov(dof: Dof, seed: u64) -> TwinSpec {
    let plant = TwinPlant { mass: 20.0, d_quadratic: 60.0, d_linear: 8.0, bias_force: 0.0 };
    let drive = match dof {
        Dof::Heave => Excitation { amplitude: 0.5, frequency_rad_s: 0.8, joystick: 0.2 },
        _ => Excitation { amplitude: 30.0, frequency_rad_s: 0.6, joystick: 20.0 },
    };
    let mut spec = TwinSpec {
        seed,
        dofs: [dof].into(),
        duration_s: 300.0,
        hold_out_s: 150.0,
        dry_mass_kg: 11.5,
        disturbances: [Disturbance::Tether].into(),
        thrusters: TwinThrusters { forward: 2e-3, reverse: 2e-3, max_rpm: 1500.0 },
        accelerometer: Some(TwinAccelerometer::default()),
        ..TwinSpec::jason2()
    };
    spec.plants.insert(dof, plant);
    spec.excitation.insert(dof, drive);
    spec.steady.down.clear();
    spec.steady.up.clear();
    spec.strength.tether_n = 1.0;
    spec
}

/// The trials of a twin after a change of each log.
fn trials(twin: &TwinCampaign, change: impl Fn(&mut Recording)) -> Result<Vec<Trial>, Error> {
    let trial = |log: &seaplant::twin::TwinTrial| {
        let mut recording = log.recording.clone();
        change(&mut recording);
        let (name, role, dofs) = (log.name.clone(), log.role, log.dofs.clone());
        let setup = TrialSetup { name, role, dofs, ..TrialSetup::default() };
        Trial::new(setup, &recording, &twin.vehicle)
    };
    twin.trials.iter().map(trial).collect()
}

/// Identifies the logs of a twin after a change of each.
fn identified(spec: &TwinSpec, change: impl Fn(&mut Recording)) -> Result<Results, Error> {
    let twin = make(spec)?;
    let trials = trials(&twin, change)?;
    let methods = vec![Method::FilterError, Method::EquationError];
    let options = IdentifyOptions { methods, subsets: false, ..IdentifyOptions::default() };
    Ok(identify(&twin.vehicle, &trials, &options).results)
}

/// R² of the plant that made the logs, over the held-out trial.
fn of_the_truth(spec: &TwinSpec, dof: Dof) -> f64 {
    let twin = make(spec).expect("a twin");
    let trials = trials(&twin, |_| ()).expect("complete");
    let hold_out = trials.iter().find(|trial| trial.role() == Role::HoldOut).expect("held out");
    let TwinPlant { mass, d_quadratic, d_linear, bias_force } = spec.plants[&dof];
    let truth = PhysicalParameters { mass, d_quadratic, d_linear, bias_force };
    let comparison = evaluate(dof, &truth.to_lumped().into(), hold_out).expect("simulated");
    comparison.velocity.r_squared.expect("moved")
}

/// Drag at 0.7 m/s, of 20 kg: 35 N.
fn drag(results: &Results, dof: Dof) -> f64 {
    results.plants[dof.name()].drag_at(dof, 0.7).value
}

/// What an accelerometer is good for: parts of mass, and of drag.
const MASS: f64 = 0.03;
const DRAG: f64 = 0.05;

#[test]
fn mass_and_drag_are_found_from_acceleration_alone() {
    for dof in [Dof::Surge, Dof::Sway] {
        let results = identified(&rov(dof, 1), |_| ()).expect("complete");
        let plant = &results.plants[dof.name()];
        let mass = &plant.by_axis[&dof].mass;
        assert!((mass.value / 20.0 - 1.0).abs() < MASS, "{dof}: {mass:?}");
        assert!((drag(&results, dof) / 35.0 - 1.0).abs() < DRAG, "{dof}: {:?}", plant.parameters);
        assert!((mass.low95..=mass.high95).contains(&20.0), "{dof}: {mass:?}");
        let score = plant.held_out(dof).expect("held out");
        assert_eq!(score.quantity, ScoredMotion::Acceleration);
        // A held-out trial of few steps is as much vibration as motion.
        let (truth, r2) = (of_the_truth(&rov(dof, 1), dof), score.r_squared.expect("moved"));
        assert!((r2 - truth).abs() < 0.02, "{truth}, {score:?}");
        assert!(dof != Dof::Surge || r2 > 0.9, "{score:?}");
        assert!(plant.verdict.trust >= Trust::UsableWithCare, "{:?}", plant.verdict);
        let refused = results.failures.iter().find(|failure| failure.method == "equation-error");
        assert!(refused.expect("no velocity").message.contains("only acceleration"));
    }
}

#[test]
fn acceleration_joins_a_slow_depth() {
    let results = identified(&rov(Dof::Heave, 2), |_| ()).expect("complete");
    let plant = &results.plants["heave"];
    assert!(
        (plant.by_axis[&Dof::Heave].mass.value / 20.0 - 1.0).abs() < MASS,
        "{:?}",
        plant.parameters
    );
    assert!(plant.nuisances.contains_key("acceleration_noise"));
    assert_eq!(plant.fit.by_axis[&Dof::Heave].quantity, ScoredMotion::Velocity);
}

#[test]
fn accelerometers_that_are_none_in_metres_per_second_squared_are_refused() {
    let scaled = |axes: [f64; 3]| {
        identified(&rov(Dof::Surge, 3), |recording| {
            for (axis, factor) in [Axis::X, Axis::Y, Axis::Z].into_iter().zip(axes) {
                let felt = &recording[&Quantity::Acceleration(axis)];
                let changed = felt.map(|f| factor * f);
                recording.insert(Quantity::Acceleration(axis), changed);
            }
        })
    };
    for (axes, says) in [
        ([1.0 / 9.81; 3], "[g]"),
        ([1.0, -1.0, -1.0], "[180, 0, 0]"),
        ([-1.0; 3], "the scale -1"),
        ([0.3; 3], "check the unit"),
    ] {
        let message = scaled(axes).expect_err("wrong").to_string();
        assert!(message.contains(says), "{message}");
    }
}

#[test]
fn gravity_needs_tilt_unless_it_was_taken_out() {
    let level = |recording: &mut Recording| {
        for angle in [Attitude::Roll, Attitude::Pitch, Attitude::Heading] {
            recording.remove(&Quantity::Attitude(angle));
        }
    };
    let message = identified(&rov(Dof::Surge, 4), level).expect_err("no tilt").to_string();
    assert!(message.contains("attitude.pitch"), "{message}");
    let results = identified(&rov(Dof::Surge, 4), |recording| {
        let down = recording[&Quantity::Acceleration(Axis::Z)].map(|f| f + 9.806_65);
        recording.insert(Quantity::Acceleration(Axis::Z), down);
        level(recording);
    })
    .expect("gravity is out");
    let plant = &results.plants["surge"];
    assert!((plant.by_axis[&Dof::Surge].mass.value / 20.0 - 1.0).abs() < 2.0 * MASS);
    let told = plant.caveats.iter().any(|caveat| caveat.message.contains("gravity was taken out"));
    assert!(told, "{:?}", plant.caveats);
}

#[test]
fn a_tilted_and_a_clipped_accelerometer_are_told() {
    let results = identified(&rov(Dof::Surge, 5), |recording| {
        let x = recording[&Quantity::Acceleration(Axis::X)].map(|f| (f + 0.6).clamp(-1.5, 1.5));
        recording.insert(Quantity::Acceleration(Axis::X), x);
    })
    .expect("complete");
    let caveats = &results.plants["surge"].caveats;
    for code in [CaveatCode::TiltedAccelerometer, CaveatCode::ClippedAccelerometer] {
        assert!(caveats.iter().any(|caveat| caveat.code == code), "{code:?}: {caveats:?}");
    }
}

#[test]
fn thrust_that_hardly_moves_the_vehicle_gives_no_usable_plant() {
    let mut spec = rov(Dof::Surge, 6);
    spec.excitation
        .insert(Dof::Surge, Excitation { amplitude: 0.5, frequency_rad_s: 0.6, joystick: 0.3 });
    let results = identified(&spec, |_| ()).expect("complete");
    let trust = results.plants.get("surge").map(|plant| plant.verdict.trust);
    assert!(trust.is_none_or(|trust| trust <= Trust::Doubtful), "{trust:?}");
}
