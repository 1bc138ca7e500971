//! Each doubt is raised by what causes it, and none by the clean twin.

use std::collections::BTreeSet;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use seaplant::results::{PlantResult, Results, Trust};
use seaplant::twin::{Disturbance, TwinCampaign, TwinSpec, make};
use seaplant::{
    CaveatCode, Dof, IdentifyOptions, Method, PhysicalParameters, QuadraticThrust, Quantity,
    Recording, Role, Severity, State, ThrustCurve, Thruster, ThrusterInput, Timed, Trial,
    TrialSetup, Vehicle, identify, simulate,
};

fn twin(dof: Dof, disturbances: &str) -> TwinCampaign {
    let spec = TwinSpec {
        dofs: [dof].into(),
        disturbances: Disturbance::parse_list(disturbances).expect("known"),
        ..TwinSpec::jason2()
    };
    make(&spec).expect("a valid twin")
}

fn trials(campaign: &TwinCampaign) -> Vec<Trial> {
    let trials = campaign.trials.iter().map(|log| log.trial(campaign).expect("complete"));
    trials.collect()
}

fn results(campaign: &TwinCampaign) -> Results {
    identify(&campaign.vehicle, &trials(campaign), &IdentifyOptions::default()).results
}

fn codes(plant: &PlantResult) -> BTreeSet<CaveatCode> {
    plant.caveats.iter().map(|caveat| caveat.code).collect()
}

/// A vehicle of one thruster, 0.04 N/(rad/s)² both ways, pushing forward.
fn simple_vehicle(dry_mass_kg: Option<f64>) -> Vehicle {
    let law = QuadraticThrust { forward: 0.04, reverse: 0.04, ..QuadraticThrust::default() };
    let curve = ThrustCurve::Quadratic { input: ThrusterInput::Speed, law };
    let thruster = Thruster::new("main", [0.0; 3], [1.0, 0.0, 0.0], curve).expect("valid");
    Vehicle { name: "test".into(), dry_mass_kg, thrusters: vec![thruster], ..Vehicle::default() }
}

const PLANT: PhysicalParameters =
    PhysicalParameters { mass: 800.0, d_quadratic: 400.0, d_linear: 0.0, bias_force: 0.0 };

/// A surge trial at 10 Hz of [`PLANT`] under a propeller speed, rad/s, of time.
fn driven(seconds: f64, speed: impl Fn(f64) -> f64) -> Recording {
    let time: Vec<f64> = (0..(10.0 * seconds) as usize).map(|k| 0.1 * k as f64).collect();
    let n: Vec<f64> = time.iter().map(|&t| speed(t)).collect();
    let force: Vec<f64> = n.iter().map(|n| 0.04 * n * n.abs()).collect();
    let force = Timed::new("force", time.clone(), force).expect("valid");
    let moved = simulate(Dof::Surge, &PLANT.to_lumped(), &force, State::default(), &time);
    let thruster = Quantity::Thruster { name: "main".into(), input: ThrusterInput::Speed };
    Recording::from([
        (thruster, Timed::new("n", time.clone(), n).expect("valid")),
        (
            Quantity::Velocity(Dof::Surge),
            Timed::new("u", time, moved.expect("stable").velocity).expect("valid"),
        ),
    ])
}

fn plant_of(vehicle: &Vehicle, recording: &Recording, method: Method) -> PlantResult {
    let setup = TrialSetup { name: "t".into(), dofs: vec![Dof::Surge], ..TrialSetup::default() };
    let trial = Trial::new(setup, recording, vehicle).expect("complete");
    let options = IdentifyOptions { methods: vec![method], ..IdentifyOptions::default() };
    let mut found = identify(vehicle, &[trial], &options).results;
    let mut methods = found.methods.remove("surge").unwrap_or_default();
    methods.remove(&method).unwrap_or_else(|| panic!("{:?}", found.failures))
}

/// Two tones both ways: nothing to doubt but that there is no held-out trial.
fn lively(t: f64) -> f64 {
    60.0 * (0.2 * t).sin() + 45.0 * (0.63 * t + 1.0).sin()
}

/// A surge trial of [`PLANT`] whose drag follows motion 1 s late, as where the wake takes its time to form.
fn late_drag(seed: u64, speed: impl Fn(f64) -> f64) -> Recording {
    let step_s = 0.01;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut u, mut wake) = (0.0_f64, 0.0_f64);
    let (mut time, mut n, mut measured) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..30_000 {
        let t = step_s * f64::from(k / 10 * 10);
        if k % 10 == 0 {
            time.push(t);
            n.push(speed(t));
            measured.push(u + 0.003 * rng.sample::<f64, _>(StandardNormal));
        }
        wake += step_s * (u - wake);
        let force = 0.04 * speed(t) * speed(t).abs() - PLANT.d_quadratic * wake * wake.abs();
        u += step_s * force / PLANT.mass;
    }
    let timed = |values| Timed::new("own", time.clone(), values).expect("valid");
    let thruster = Quantity::Thruster { name: "main".into(), input: ThrusterInput::Speed };
    Recording::from([(thruster, timed(n)), (Quantity::Velocity(Dof::Surge), timed(measured))])
}

/// Filter error follows motion within seconds, output error over whole trials: such drag is two drags to them.
#[test]
fn drag_that_follows_motion_late_makes_a_plant_doubtful() {
    let vehicle = simple_vehicle(None);
    let steps = |t: f64| 90.0 * (0.17 * t).sin() * (0.05 * t + 1.0).cos().signum();
    let trial = |name: &str, role, recording: &Recording| {
        let setup = TrialSetup { name: name.into(), role, ..TrialSetup::default() };
        Trial::new(TrialSetup { dofs: vec![Dof::Surge], ..setup }, recording, &vehicle)
    };
    let all = [
        trial("lively", Role::Fit, &late_drag(1, lively)).expect("complete"),
        trial("steps", Role::Fit, &late_drag(2, steps)).expect("complete"),
        trial("held out", Role::HoldOut, &late_drag(3, |t| 70.0 * (0.4 * t).sin()))
            .expect("complete"),
    ];
    let options = IdentifyOptions { subsets: false, ..IdentifyOptions::default() };
    let found = identify(&vehicle, &all, &options).results;
    let plant = &found.plants["surge"];
    let mass = plant.by_axis[&Dof::Surge].mass.value;
    assert!(mass < 0.95 * PLANT.mass, "nothing to doubt: {mass} kg");
    let is_told = plant
        .caveats
        .iter()
        .any(|caveat| caveat.message.contains("something that lasts for seconds"));
    assert!(is_told, "{:?}, {:?}", plant.method, plant.caveats);
    assert_eq!(plant.verdict.trust, Trust::Doubtful, "{:?}", plant.verdict);
}

#[test]
fn the_clean_twin_raises_no_doubt_but_about_the_papers_method() {
    let found = results(&twin(Dof::Yaw, "none"));
    for method in [Method::EquationError, Method::OutputError, Method::FilterError] {
        let raised = codes(&found.methods["yaw"][&method]);
        assert!(raised.is_empty(), "{method}: {raised:?}");
    }
}

#[test]
fn the_papers_filter_is_named_with_the_factor_that_it_costs() {
    let found = results(&twin(Dof::Yaw, "none"));
    let paper = &found.methods["yaw"][&Method::Paper];
    let raised = codes(paper);
    assert!(raised.contains(&CaveatCode::FilterAttenuatesExcitation), "{raised:?}");
    assert!(raised.contains(&CaveatCode::UnequalFiltering));
    assert!(raised.contains(&CaveatCode::MethodsDisagree));
    let message = &paper.caveats.iter().find(|c| c.code == CaveatCode::FilterAttenuatesExcitation);
    // |H(1/6 Hz)| = 1/(1 + (4/3)⁴) = 0.240, and its inverse 4.16.
    assert!(message.expect("raised").message.contains("4.16 times"), "{message:?}");
}

#[test]
fn a_lag_is_doubted_by_equation_and_output_error_and_allowed_for_by_filter_error() {
    let found = results(&twin(Dof::Surge, "lag"));
    let methods = &found.methods["surge"];
    let late = |method| {
        let caveats = &methods[&method].caveats;
        caveats.iter().find(|caveat| caveat.code == CaveatCode::LagOrDelay).cloned()
    };
    for method in [Method::EquationError, Method::OutputError] {
        let warning = late(method).expect("raised");
        assert_eq!(warning.severity, seaplant::Severity::Warning);
        // "… the mass would be 13608 in place of 13993 kg, and quadratic drag 2225 in …"
        let figure = |after: &str| -> f64 {
            let (_, rest) = warning.message.split_once(after).expect("with figures");
            rest.split(' ').next().expect("first").parse().expect("a number")
        };
        let worst =
            |mass: f64, drag: f64| (mass / 12970.2 - 1.0).abs().max((drag / 2230.9 - 1.0).abs());
        let timely = worst(figure("mass would be "), figure("and quadratic drag "));
        let found = &methods[&method].by_axis[&Dof::Surge];
        let late = worst(found.mass.value, found.quadratic_drag.as_ref().expect("fitted").value);
        assert!(timely < 0.8 * late, "{method}, off by {late}: {}", warning.message);
        assert!(warning.message.contains(&format!("in place of {:.0}", found.mass.value)));
    }
    let note = late(Method::FilterError).expect("raised");
    assert_eq!(note.severity, seaplant::Severity::Note);
    let lag = &methods[&Method::FilterError].nuisances["lag"];
    assert!((lag.value - 0.3).abs() < 0.03, "{lag:?}");
}

#[test]
fn reverse_thrust_that_one_axis_shows_is_doubted_in_the_one_that_hides_it() {
    let spec = TwinSpec {
        dofs: [Dof::Surge, Dof::Yaw].into(),
        disturbances: [Disturbance::Thrcoef, Disturbance::Tether].into(),
        seed: 2,
        ..TwinSpec::jason2()
    };
    let found = results(&make(&spec).expect("a valid twin"));
    let yaw = &found.plants["yaw"];
    // The twin turns by one thruster ahead and one astern: the scale hides the ratio.
    assert!(!yaw.nuisances.contains_key("reverse_ratio"), "{:?}", yaw.nuisances);
    let caveat = yaw.caveats.iter().find(|caveat| caveat.code == CaveatCode::ReverseThrust);
    assert!(caveat.expect("raised").message.starts_with("in surge reverse thrust is 0.8"));
    assert!(!codes(&found.plants["surge"]).contains(&CaveatCode::ReverseThrust));
}

#[test]
fn a_quick_hidden_force_is_doubted_by_filter_error() {
    let mut recording = driven(300.0, lively);
    let time = recording[&Quantity::Velocity(Dof::Surge)].time_s().to_vec();
    // As strong as the thrust, unlogged, and another every 0.4 s: the golden ratio's
    // multiples stand in for chance.
    let hidden = |k: usize| 300.0 * (((k / 4) as f64 * 0.618_034).fract() - 0.5);
    let force = |(k, &t): (usize, &f64)| 0.04 * lively(t) * lively(t).abs() + hidden(k);
    let force: Vec<f64> = time.iter().enumerate().map(force).collect();
    let force = Timed::new("force", time.clone(), force).expect("valid");
    let moved = simulate(Dof::Surge, &PLANT.to_lumped(), &force, State::default(), &time);
    let velocity = Timed::new("u", time, moved.expect("stable").velocity).expect("valid");
    recording.insert(Quantity::Velocity(Dof::Surge), velocity);
    let plant = plant_of(&simple_vehicle(None), &recording, Method::FilterError);
    let quick = plant.caveats.iter().find(|caveat| caveat.message.contains("changes within"));
    assert_eq!(quick.expect("raised").code, CaveatCode::ResidualsNotWhite);
}

#[test]
fn half_a_minute_of_motion_is_little() {
    let plant = plant_of(&simple_vehicle(None), &driven(30.0, lively), Method::EquationError);
    assert!(codes(&plant).contains(&CaveatCode::ShortTrial));
}

#[test]
fn a_held_out_trial_that_is_missed_is_named_though_the_others_hide_it() {
    let vehicle = simple_vehicle(None);
    let trial = |name: &str, role, recording: &Recording| {
        let dofs = vec![Dof::Surge];
        let setup = TrialSetup { name: name.into(), role, dofs, ..TrialSetup::default() };
        Trial::new(setup, recording, &vehicle).expect("complete")
    };
    // A vehicle that is held: thrust without motion.
    let mut held = driven(60.0, |t| 20.0 * (0.2 * t).sin());
    let velocity = held.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    *velocity = velocity.map(|_| 0.001);
    let trials = [
        trial("free", Role::Fit, &driven(300.0, lively)),
        trial("as well", Role::HoldOut, &driven(300.0, |t| lively(1.3 * t + 5.0))),
        trial("held", Role::HoldOut, &held),
    ];
    let found = identify(&vehicle, &trials, &IdentifyOptions::default()).results;
    let plant = &found.methods["surge"][&Method::EquationError];
    let missed = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::NoBetterThanNull);
    assert!(missed.expect("raised").message.contains("trial `held`"), "{missed:?}");
}

#[test]
fn a_bias_on_one_heading_may_be_a_current() {
    let found = results(&twin(Dof::Surge, "none"));
    assert!(codes(&found.plants["surge"]).contains(&CaveatCode::BiasOneDirection));
}

#[test]
fn steady_and_unsteady_drag_that_differ_are_both_shown() {
    // The twin's steady runs have a third of its unsteady drag, as the paper's tables do.
    let found = results(&twin(Dof::Heave, "none"));
    assert!(codes(&found.plants["heave"]).contains(&CaveatCode::SteadyUnsteadyDisagree));
}

#[test]
fn a_lively_trial_without_a_held_out_one_is_scored_on_itself() {
    let plant = plant_of(&simple_vehicle(None), &driven(300.0, lively), Method::EquationError);
    assert_eq!(codes(&plant), [CaveatCode::ScoredOnFit].into());
}

#[test]
fn a_mass_below_the_mass_in_air_is_severe() {
    let vehicle = simple_vehicle(Some(1200.0));
    let plant = plant_of(&vehicle, &driven(300.0, lively), Method::EquationError);
    assert!(codes(&plant).contains(&CaveatCode::MassBelowDryMass));
}

#[test]
fn thrust_one_way_is_named() {
    let ahead = |t: f64| 80.0 + 30.0 * (0.3 * t).sin();
    let plant = plant_of(&simple_vehicle(None), &driven(300.0, ahead), Method::EquationError);
    assert!(codes(&plant).contains(&CaveatCode::OneSignedThrust));
}

#[test]
fn thrust_at_two_levels_is_named() {
    let bang = |t: f64| if ((t / 15.0) as u64).is_multiple_of(2) { 80.0 } else { -80.0 };
    let plant = plant_of(&simple_vehicle(None), &driven(300.0, bang), Method::EquationError);
    assert!(codes(&plant).contains(&CaveatCode::TwoLevelThrust));
}

#[test]
fn quick_small_motion_says_little_of_drag() {
    let quick = |t: f64| 40.0 * (2.0 * t).sin() + 30.0 * (3.1 * t).sin();
    let plant = plant_of(&simple_vehicle(None), &driven(300.0, quick), Method::EquationError);
    assert!(codes(&plant).contains(&CaveatCode::WeakDrag));
}

#[test]
fn velocity_of_the_wrong_sign_gives_a_mass_of_the_wrong_sign() {
    let mut recording = driven(300.0, lively);
    let velocity = recording.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    *velocity = velocity.map(|v| -v);
    let plant = plant_of(&simple_vehicle(None), &recording, Method::EquationError);
    assert!(plant.by_axis[&Dof::Surge].mass.value < 0.0);
    let wrong = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::WrongSign);
    assert_eq!(wrong.expect("raised").severity, seaplant::Severity::Severe);
}

#[test]
fn a_gap_is_left_out_and_told() {
    let mut recording = driven(300.0, lively);
    let velocity = recording.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    let kept: Vec<usize> = (0..velocity.len()).filter(|k| !(1000..1400).contains(k)).collect();
    let pick = |from: &[f64]| kept.iter().map(|&k| from[k]).collect::<Vec<_>>();
    *velocity = Timed::new("u", pick(velocity.time_s()), pick(velocity.values())).expect("valid");
    let plant = plant_of(&simple_vehicle(None), &recording, Method::EquationError);
    let gap = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::Gaps);
    assert!(gap.expect("raised").message.contains("40.1 s"), "{gap:?}");
    assert!((plant.by_axis[&Dof::Surge].mass.value / PLANT.mass - 1.0).abs() < 0.01);
}

#[test]
fn a_few_wild_samples_are_removed_and_counted() {
    let mut recording = driven(300.0, lively);
    let velocity = recording.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    let mut values = velocity.values().to_vec();
    for k in [500, 1500, 2500] {
        values[k] = -32.768;
    }
    *velocity = velocity.with_values("u", values).expect("finite");
    let plant = plant_of(&simple_vehicle(None), &recording, Method::EquationError);
    let outliers = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::Outliers);
    assert!(outliers.expect("raised").message.starts_with("3 samples"), "{outliers:?}");
    // They do not say that the unit is wrong.
    assert!(plant.caveats.iter().all(|c| c.severity != Severity::Severe), "{:?}", plant.caveats);
    assert!((plant.by_axis[&Dof::Surge].mass.value / PLANT.mass - 1.0).abs() < 0.01);
}

#[test]
fn millimetres_a_second_taken_for_metres_are_suspicious() {
    let mut recording = driven(300.0, lively);
    let velocity = recording.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    *velocity = velocity.map(|v| 1000.0 * v);
    let plant = plant_of(&simple_vehicle(None), &recording, Method::EquationError);
    let unit = plant.caveats.iter().find(|caveat| caveat.code == CaveatCode::SuspiciousUnit);
    assert!(unit.expect("raised").message.contains("is it mm/s"), "{unit:?}");
    assert_eq!(unit.expect("raised").severity, Severity::Severe);
}

#[test]
fn roles_are_as_the_setup_says() {
    let campaign = twin(Dof::Surge, "none");
    let roles: Vec<Role> = trials(&campaign).iter().map(Trial::role).collect();
    assert_eq!(roles, [Role::Fit, Role::HoldOut]);
}

fn caveat_of(plant: &PlantResult, code: CaveatCode) -> &str {
    let caveat = plant.caveats.iter().find(|caveat| caveat.code == code);
    &caveat.unwrap_or_else(|| panic!("{code:?} in {:?}", plant.caveats)).message
}

#[test]
fn drag_that_no_hull_of_that_size_has_is_named() {
    let recording = driven(300.0, lively);
    // 400 N/(m/s)² on half a square metre is a coefficient of 1.6, and on 4 cm² of 1950.
    let sized = |size_m| Vehicle { size_m: Some(size_m), ..simple_vehicle(None) };
    let fits = plant_of(&sized([2.0, 0.7, 0.7]), &recording, Method::FilterError);
    assert!(!codes(&fits).contains(&CaveatCode::Implausible));
    let tiny = plant_of(&sized([2.0, 0.02, 0.02]), &recording, Method::FilterError);
    let says = |caveat: &seaplant::Caveat| caveat.message.contains("drag coefficient of 19");
    assert!(tiny.caveats.iter().any(says), "{:?}", tiny.caveats);
}

#[test]
fn more_added_mass_along_the_slender_axis_is_out_of_order() {
    let campaign = make(&TwinSpec { dofs: [Dof::Surge, Dof::Heave].into(), ..TwinSpec::jason2() })
        .expect("a valid twin");
    let of = |size_m| {
        let vehicle = Vehicle { size_m: Some(size_m), ..campaign.vehicle.clone() };
        let options = IdentifyOptions { methods: vec![Method::FilterError], ..Default::default() };
        identify(&vehicle, &trials(&campaign), &options).results
    };
    // Heave carries more water than surge: right for a raft, wrong for a tower.
    let raft = of([3.4, 2.2, 1.0]);
    assert!(raft.plants.values().all(|plant| !codes(plant).contains(&CaveatCode::Implausible)));
    let tower = of([2.0, 2.0, 6.0]);
    let message = caveat_of(&tower.plants["heave"], CaveatCode::Implausible);
    assert!(message.contains("area of 4.00 m²") && message.contains("12.0 m²"), "{message}");
}

#[test]
fn a_thruster_log_that_is_too_slow_for_its_motion_is_doubted() {
    let mut recording = driven(300.0, lively);
    let speed = Quantity::Thruster { name: "main".into(), input: ThrusterInput::Speed };
    let slow: Vec<f64> = (0..600).map(|k| 0.5 * f64::from(k)).collect();
    let n: Vec<f64> = slow.iter().map(|&t| lively(t)).collect();
    recording.insert(speed.clone(), Timed::new("n", slow.clone(), n).expect("valid"));
    let plant = plant_of(&simple_vehicle(None), &recording, Method::FilterError);
    let message = caveat_of(&plant, CaveatCode::ThrustBetweenSamples);
    assert!(message.contains("every 0.50 s"), "{message}");

    // Commands that are held for ten seconds are no such signal, however slow their log.
    let n: Vec<f64> = slow.iter().map(|&t: &f64| lively(10.0 * (0.1 * t).floor())).collect();
    recording.insert(speed, Timed::new("n", slow, n).expect("valid"));
    let plant = plant_of(&simple_vehicle(None), &recording, Method::FilterError);
    assert!(!codes(&plant).contains(&CaveatCode::ThrustBetweenSamples));
}

/// Thrust by propellers that turn smoothly and are logged every half second.
fn slowly_logged(tempo: f64) -> PlantResult {
    let mut recording = driven(300.0, |t| lively(tempo * t) + 20.0 * (2.0 * tempo * t).sin());
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let exact = &recording[&Quantity::Velocity(Dof::Surge)];
    let noisy = exact.values().iter().map(|u| u + 0.003 * random.sample::<f64, _>(StandardNormal));
    let noisy = exact.with_values("u", noisy.collect()).expect("finite");
    recording.insert(Quantity::Velocity(Dof::Surge), noisy);
    let speed = Quantity::Thruster { name: "main".into(), input: ThrusterInput::Speed };
    let (time, n) = (recording[&speed].time_s(), recording[&speed].values());
    let fifth = |all: &[f64]| all.iter().step_by(5).copied().collect::<Vec<f64>>();
    let slow = Timed::new("n", fifth(time), fifth(n)).expect("valid");
    recording.insert(speed, slow);
    plant_of(&simple_vehicle(None), &recording, Method::FilterError)
}

#[test]
fn propellers_that_move_smoothly_between_slow_samples_leave_mass_right() {
    let plant = slowly_logged(1.0);
    let mass = &plant.by_axis[&Dof::Surge].mass;
    assert!((mass.value / PLANT.mass - 1.0).abs() < 0.03, "{mass:?}");
    assert!(mass.low95 < PLANT.mass && PLANT.mass < mass.high95, "{mass:?}");
    // Five times as quick, too little of them is known between samples.
    let plant = slowly_logged(5.0);
    assert!(caveat_of(&plant, CaveatCode::NotDetermined).contains("changes so much"));
    assert_eq!(plant.verdict.trust, Trust::Doubtful);
}

#[test]
fn depth_in_feet_beside_velocity_in_metres_is_told() {
    let campaign = twin(Dof::Heave, "none");
    let log = campaign.trials.iter().find(|log| log.role == Role::Fit).expect("there");
    let mut recording = log.recording.clone();
    let feet = recording[&Quantity::Depth].map(|depth| depth / 0.3048);
    recording.insert(Quantity::Depth, feet);
    let setup = TrialSetup { name: "t".into(), dofs: vec![Dof::Heave], ..TrialSetup::default() };
    let plant_of = |dry_kg: f64| {
        let vehicle = Vehicle { dry_mass_kg: Some(dry_kg), ..campaign.vehicle.clone() };
        let trial = Trial::new(setup.clone(), &recording, &vehicle).expect("complete");
        let options = IdentifyOptions { methods: vec![Method::FilterError], ..Default::default() };
        identify(&vehicle, &[trial], &options).results.plants["heave"].clone()
    };
    let plant = plant_of(3400.0);
    let message = caveat_of(&plant, CaveatCode::InstrumentsDisagree);
    assert!(message.contains("moves 3.2"), "{message}");
    // The velocity alone still gives the plant.
    let truth = TwinSpec::jason2().plants[&Dof::Heave];
    assert!((plant.by_axis[&Dof::Heave].mass.value / truth.mass - 1.0).abs() < 0.02);
    // A mass of 20 or 6.2 t is possible for 3.4 t in air, so that either may be wrong; for 10 t it is not.
    assert!(caveat_of(&plant, CaveatCode::LikelyMistake).contains("in ft"));
    assert!(!codes(&plant_of(10_000.0)).contains(&CaveatCode::LikelyMistake));
}

#[test]
fn a_thruster_beyond_its_curve_is_named_with_the_part_of_the_log() {
    let points = (-8..=8).map(|k| 10.0 * f64::from(k)).map(|n| (n, 0.04 * n * n.abs())).collect();
    let table = seaplant::ThrustTable::new(None, points).expect("rises");
    let curve = ThrustCurve::tables(ThrusterInput::Speed, vec![table]).expect("one table");
    let thruster = Thruster::new("main", [0.0; 3], [1.0, 0.0, 0.0], curve).expect("valid");
    let vehicle = Vehicle { thrusters: vec![thruster], ..simple_vehicle(None) };
    let plant = plant_of(&vehicle, &driven(300.0, lively), Method::EquationError);
    assert!(caveat_of(&plant, CaveatCode::ThrusterSaturated).contains("`main` is driven beyond"));
}

#[test]
fn one_tone_cannot_tell_linear_from_quadratic_drag() {
    let terms = "force,quadratic,linear,bias".parse().expect("known");
    let options = IdentifyOptions {
        methods: vec![Method::EquationError],
        terms: Some(terms),
        ..IdentifyOptions::default()
    };
    let vehicle = simple_vehicle(None);
    let setup = TrialSetup { name: "t".into(), dofs: vec![Dof::Surge], ..TrialSetup::default() };
    let recording = driven(300.0, |t| 60.0 * (0.4 * t).sin());
    let trial = Trial::new(setup, &recording, &vehicle).expect("complete");
    let found = identify(&vehicle, &[trial], &options).results;
    let message = caveat_of(&found.plants["surge"], CaveatCode::Collinear);
    assert!(message.contains("variance inflation"), "{message}");
}

#[test]
fn steady_pairs_with_different_ballast_contradict_each_other() {
    let mut campaign = twin(Dof::Heave, "none");
    // A diver hangs 600 N on the vehicle for the runs at full thrust.
    let heavier = make(&TwinSpec {
        dofs: [Dof::Heave].into(),
        steady: seaplant::twin::SteadyRuns { bias_force: -600.0, ..TwinSpec::jason2().steady },
        ..TwinSpec::jason2()
    })
    .expect("a valid twin");
    for (log, other) in campaign.trials.iter_mut().zip(&heavier.trials) {
        if log.role == Role::Steady && log.name.contains("100") {
            log.recording = other.recording.clone();
        }
    }
    let steady = &results(&campaign).steady[&Dof::Heave];
    let contradicts = |c: &seaplant::Caveat| c.code == CaveatCode::SteadyPairsContradict;
    assert!(steady.caveats.iter().any(contradicts), "{:?}", steady.caveats);
    let clean = &results(&twin(Dof::Heave, "none")).steady[&Dof::Heave];
    assert!(!clean.caveats.iter().any(contradicts), "{:?}", clean.caveats);
}

fn setup(name: &str, role: Role) -> TrialSetup {
    TrialSetup { name: name.into(), role, dofs: vec![Dof::Surge], ..TrialSetup::default() }
}

/// A surge trial of [`PLANT`] whose thrust is not what its propeller says.
fn pushed(seconds: f64, speed: impl Fn(f64) -> f64, force: impl Fn(f64, f64) -> f64) -> Recording {
    let mut recording = driven(seconds, &speed);
    let time = recording[&Quantity::Velocity(Dof::Surge)].time_s().to_vec();
    let of = |&t: &f64| force(t, 0.04 * speed(t) * speed(t).abs());
    let force = Timed::new("force", time.clone(), time.iter().map(of).collect::<Vec<_>>());
    let force = force.expect("valid");
    let moved = simulate(Dof::Surge, &PLANT.to_lumped(), &force, State::default(), &time);
    let velocity = Timed::new("u", time, moved.expect("stable").velocity).expect("valid");
    recording.insert(Quantity::Velocity(Dof::Surge), velocity);
    recording
}

/// White noise of a standard deviation on the velocity, m/s.
fn with_noise(mut recording: Recording, std: f64) -> Recording {
    let velocity = recording.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    let chance = ChaCha8Rng::seed_from_u64(1).sample_iter::<f64, _>(StandardNormal);
    let values: Vec<f64> =
        velocity.values().iter().zip(chance).map(|(v, noise)| v + std * noise).collect();
    *velocity = velocity.with_values("u", values).expect("finite");
    recording
}

#[test]
fn thrust_that_pushes_the_other_way_is_named_and_nothing_recommended() {
    let mut recording = driven(300.0, lively);
    let velocity = recording.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    *velocity = velocity.map(|v| -v);
    let vehicle = simple_vehicle(None);
    let trial = Trial::new(setup("t", Role::Fit), &recording, &vehicle).expect("complete");
    let found = identify(&vehicle, &[trial], &IdentifyOptions::default()).results;
    assert!(found.plants.is_empty());
    let failure = found.failures.iter().find(|failure| failure.method == "any method");
    assert!(failure.expect("told").message.starts_with("thrust in surge seems reversed"));
    let plant = &found.methods["surge"][&Method::EquationError];
    assert!(caveat_of(plant, CaveatCode::ThrustReversed).contains("would have 8"));
}

#[test]
fn thrust_that_sags_through_the_record_is_a_plant_that_drifts() {
    let sagging = pushed(600.0, lively, |t, tau| tau * (1.0 - 0.25 * t / 600.0));
    let sagging = with_noise(sagging, 0.005);
    let plant = plant_of(&simple_vehicle(None), &sagging, Method::OutputError);
    assert!(caveat_of(&plant, CaveatCode::PlantDrifts).contains("thrust over mass"));
    // Filter error fits the change.
    let plant = plant_of(&simple_vehicle(None), &sagging, Method::FilterError);
    let change = plant.nuisances["thrust_change_within"].value;
    assert!((change + 0.25).abs() < 0.02, "{change}");
    assert!(caveat_of(&plant, CaveatCode::PlantDrifts).starts_with("thrust changes by"));
    let steady = with_noise(driven(600.0, lively), 0.005);
    let plant = plant_of(&simple_vehicle(None), &steady, Method::FilterError);
    assert!(!codes(&plant).contains(&CaveatCode::PlantDrifts));
}

#[test]
fn a_held_out_trial_of_a_heavier_vehicle_asks_for_another_plant() {
    let vehicle = simple_vehicle(None);
    let loaded = pushed(300.0, lively, |_, tau| tau / 1.3);
    let own = with_noise(driven(300.0, lively), 0.005);
    let held = |recording: &Recording| {
        let trials = [
            Trial::new(setup("t", Role::Fit), &own, &vehicle).expect("complete"),
            Trial::new(setup("h", Role::HoldOut), recording, &vehicle).expect("complete"),
        ];
        identify(&vehicle, &trials, &IdentifyOptions::default()).results.plants["surge"].clone()
    };
    let other = held(&with_noise(loaded, 0.005));
    assert!(caveat_of(&other, CaveatCode::AnotherPlantFits).contains("held-out surge trials"));
    assert_ne!(other.verdict.trust, Trust::Usable);
    let same = held(&with_noise(driven(300.0, |t| lively(1.3 * t + 5.0)), 0.005));
    assert!(!codes(&same).contains(&CaveatCode::AnotherPlantFits), "{:?}", same.caveats);
    assert_eq!(same.verdict.trust, Trust::Usable, "{:?}", same.caveats);
}

#[test]
fn an_axis_that_others_move_is_not_to_be_used_alone() {
    // Their product has the frequencies of the thrust, as where a pilot drives all axes at once.
    let sway = |t: f64| 0.4 * (0.415 * t + 0.5).sin();
    let turn = |t: f64| 0.5 * (0.215 * t).sin();
    // The mass across is twice that along.
    let driven_beside = |gain: f64| {
        let force = |t: f64, tau: f64| tau + gain * PLANT.mass * sway(t) * turn(t);
        let mut recording = with_noise(pushed(600.0, lively, force), 0.005);
        let time = recording[&Quantity::Velocity(Dof::Surge)].time_s().to_vec();
        let of = |f: &dyn Fn(f64) -> f64| {
            Timed::new("x", time.clone(), time.iter().map(|&t| f(t)).collect::<Vec<_>>())
        };
        recording.insert(Quantity::Velocity(Dof::Sway), of(&sway).expect("valid"));
        recording.insert(Quantity::Rate(seaplant::quantity::Axis::Z), of(&turn).expect("valid"));
        plant_of(&simple_vehicle(None), &recording, Method::EquationError)
    };
    let plant = driven_beside(1.0);
    let message = caveat_of(&plant, CaveatCode::CoupledAxes);
    assert!(message.starts_with("do not use surge alone") && message.contains("v r"), "{message}");
    assert!(!codes(&driven_beside(0.0)).contains(&CaveatCode::CoupledAxes));
}

#[test]
fn intervals_too_wide_for_use_are_named() {
    let vehicle = simple_vehicle(None);
    let of = |noise: f64| {
        let recording = with_noise(driven(80.0, |t| 0.3 * lively(t)), noise);
        plant_of(&vehicle, &recording, Method::OutputError)
    };
    let (rough, lost) = (of(0.05), of(0.3));
    assert!(codes(&lost).contains(&CaveatCode::NotDetermined), "{:?}", lost.parameters);
    assert!(codes(&rough).contains(&CaveatCode::WideInterval), "{:?}", rough.parameters);
}

#[test]
fn thrust_of_a_speed_controller_follows_velocity() {
    let plant = PLANT.to_lumped();
    let (mut v, mut time, mut n, mut u) = (0.0_f64, Vec::new(), Vec::new(), Vec::new());
    for k in 0..6000 {
        let t = 0.1 * f64::from(k);
        let wanted = if ((t / 20.0) as u32).is_multiple_of(2) { 0.3 } else { 0.6 };
        let tau: f64 = (2000.0 * (wanted - v)).clamp(-300.0, 300.0);
        // Waves that the controller answers.
        let waves = 120.0 * (1.7 * t).sin() * (0.13 * t).sin();
        let force = Timed::new("force", vec![0.0], vec![tau + waves]).expect("valid");
        let start = State { velocity: v, ..State::default() };
        time.push(t);
        n.push((tau.abs() / 0.04).sqrt().copysign(tau));
        u.push(v);
        v = simulate(Dof::Surge, &plant, &force, start, &[0.0, 0.1]).expect("stable").velocity[1];
    }
    let thruster = Quantity::Thruster { name: "main".into(), input: ThrusterInput::Speed };
    let recording = Recording::from([
        (thruster, Timed::new("n", time.clone(), n).expect("valid")),
        (Quantity::Velocity(Dof::Surge), Timed::new("u", time, u).expect("valid")),
    ]);
    let vehicle = simple_vehicle(None);
    let closed = plant_of(&vehicle, &recording, Method::EquationError);
    assert!(codes(&closed).contains(&CaveatCode::ThrustFollowsVelocity), "{:?}", closed.caveats);
    let open = plant_of(&vehicle, &driven(600.0, lively), Method::EquationError);
    assert!(!codes(&open).contains(&CaveatCode::ThrustFollowsVelocity));
}

#[test]
fn a_cruise_at_one_speed_is_named() {
    let cruise = |t: f64| 60.0 + 4.0 * (0.3 * t).sin();
    let plant = plant_of(&simple_vehicle(None), &driven(600.0, cruise), Method::EquationError);
    assert!(codes(&plant).contains(&CaveatCode::OneSpeed));
}

#[test]
fn a_plant_in_place_of_the_first_methods_is_explained() {
    let vehicle = simple_vehicle(None);
    let trial = Trial::new(setup("t", Role::Fit), &driven(300.0, lively), &vehicle);
    let options = IdentifyOptions {
        methods: vec![Method::Paper, Method::EquationError],
        ..IdentifyOptions::default()
    };
    let found = identify(&vehicle, &[trial.expect("complete")], &options).results;
    let plant = &found.plants["surge"];
    assert_eq!(plant.method, Method::EquationError);
    let message = caveat_of(plant, CaveatCode::RecommendedByPrediction);
    assert!(message.contains("in place of paper"), "{message}");
}

#[test]
fn a_mass_beyond_what_the_hull_and_its_water_have_is_severe() {
    let plant = |dry_mass_kg| {
        let vehicle = simple_vehicle(Some(dry_mass_kg));
        plant_of(&vehicle, &driven(300.0, lively), Method::EquationError)
    };
    assert!(caveat_of(&plant(60.0), CaveatCode::Implausible).contains("check the unit of thrust"));
    assert!(!codes(&plant(300.0)).contains(&CaveatCode::Implausible));
}

#[test]
fn a_minute_with_a_hole_is_shorter_than_a_minute() {
    let mut recording = driven(100.0, lively);
    let velocity = recording.get_mut(&Quantity::Velocity(Dof::Surge)).expect("there");
    let kept: Vec<usize> = (0..velocity.len()).filter(|k| !(200..700).contains(k)).collect();
    let pick = |from: &[f64]| kept.iter().map(|&k| from[k]).collect::<Vec<_>>();
    *velocity = Timed::new("u", pick(velocity.time_s()), pick(velocity.values())).expect("valid");
    let plant = plant_of(&simple_vehicle(None), &recording, Method::EquationError);
    assert!(caveat_of(&plant, CaveatCode::ShortTrial).contains("49.8 s"), "{:?}", plant.caveats);
}

#[test]
fn without_a_held_out_trial_every_third_is_predicted_by_the_others() {
    let recording = with_noise(driven(300.0, lively), 0.005);
    let plant = plant_of(&simple_vehicle(None), &recording, Method::FilterError);
    let left_out = plant.left_out.as_ref().expect("thirds are long enough");
    assert_eq!(left_out.by_trial.len(), 3);
    let left_out = left_out.by_axis[&Dof::Surge];
    assert!(left_out.mean_abs_error.expect("stable") < 0.1 * left_out.null_error);
    assert_eq!(plant.verdict.trust, Trust::UsableWithCare, "{}", plant.verdict.reason);
}
