//! The filter error method on the twin, one disturbance at a time.

use std::collections::BTreeSet;

use seaplant::monte_carlo::{ParameterName, Row, sample, summarise};
use seaplant::results::PlantResult;
use seaplant::twin::{Disturbance, DisturbanceStrength, TwinSpec, make};
use seaplant::{
    CaveatCode, Dof, IdentifyOptions, Method, Role, Trial, TrialSetup, Vehicle, identify,
};

const SEEDS: std::ops::RangeInclusive<u64> = 1..=3;

/// Median errors of surge over a few seeds, %.
fn surge(disturbances: &str) -> Vec<Row> {
    errors(Dof::Surge, disturbances)
}

/// Median errors of an axis over a few seeds, %.
fn errors(dof: Dof, disturbances: &str) -> Vec<Row> {
    let options = IdentifyOptions { methods: vec![Method::FilterError], ..Default::default() };
    let of_seed = |seed| {
        let spec = TwinSpec {
            seed,
            dofs: [dof].into(),
            disturbances: Disturbance::parse_list(disturbances).expect("known"),
            ..TwinSpec::jason2()
        };
        sample(&spec, &options).expect("a valid twin")
    };
    summarise(&SEEDS.flat_map(of_seed).collect::<Vec<_>>())
}

fn error(rows: &[Row], parameter: ParameterName) -> f64 {
    let row = rows.iter().find(|row| row.parameter == parameter).expect("fitted");
    assert_eq!(row.failures, 0, "{row:?}");
    row.median_abs_error_percent
}

/// What one disturbance alone may cost, %: the design's targets.
const MASS_PERCENT: f64 = 2.0;
const DRAG_PERCENT: f64 = 5.0;

/// The disturbances that the method's model has a part for, or that do it no harm.
const MODELLED: [Disturbance; 8] = [
    Disturbance::Tether,
    Disturbance::Current,
    Disturbance::Lag,
    Disturbance::Delay,
    Disturbance::Thrcoef,
    Disturbance::Lever,
    Disturbance::Swell,
    Disturbance::Inflow,
];

#[test]
fn each_disturbance_alone_leaves_mass_and_drag_right() {
    for disturbance in MODELLED {
        let rows = surge(disturbance.name());
        let (mass, drag) =
            (error(&rows, ParameterName::Mass), error(&rows, ParameterName::QuadraticDrag));
        assert!(mass < MASS_PERCENT, "{disturbance}: mass {mass:.2} %");
        assert!(drag < DRAG_PERCENT, "{disturbance}: drag {drag:.2} %");
    }
}

#[test]
fn all_disturbances_together_leave_mass_and_drag_right() {
    let rows = surge("all");
    let (mass, drag) =
        (error(&rows, ParameterName::Mass), error(&rows, ParameterName::QuadraticDrag));
    assert!(mass < MASS_PERCENT, "mass {mass:.2} %");
    assert!(drag < DRAG_PERCENT, "drag {drag:.2} %");
}

#[test]
fn a_weaker_reverse_thrust_of_a_pair_that_turns_the_vehicle_leaves_mass_and_drag_right() {
    let rows = errors(Dof::Yaw, "thrcoef");
    let (mass, drag) =
        (error(&rows, ParameterName::Mass), error(&rows, ParameterName::QuadraticDrag));
    assert!(mass < MASS_PERCENT, "inertia {mass:.2} %");
    assert!(drag < DRAG_PERCENT, "drag {drag:.2} %");
}

#[test]
fn a_lag_that_differs_up_and_down_is_told_from_a_delay() {
    let rows = errors(Dof::Heave, "lag-two-way");
    let (mass, drag) =
        (error(&rows, ParameterName::Mass), error(&rows, ParameterName::QuadraticDrag));
    assert!(mass < 0.5 && drag < 1.0, "mass {mass:.2} %, drag {drag:.2} %");
}

#[test]
fn a_current_that_varies_is_told_from_forces() {
    let drag = error(&errors(Dof::Sway, "current-drift"), ParameterName::QuadraticDrag);
    assert!(drag < 2.0, "drag {drag:.2} %");
}

#[test]
fn loss_of_thrust_ahead_that_waves_hide_leaves_drag_right() {
    for dof in [Dof::Sway, Dof::Yaw] {
        let rows = errors(dof, "inflow-one-sided, swell-narrow-band");
        let (mass, drag) =
            (error(&rows, ParameterName::Mass), error(&rows, ParameterName::QuadraticDrag));
        assert!(mass < 1.0 && drag < 3.0, "{dof}: mass {mass:.2} %, drag {drag:.2} %");
    }
}

/// Makes a twin; returns its trials, with something added to their names, and its vehicle.
fn made(spec: &TwinSpec, added: &str) -> (Vec<Trial>, Vehicle) {
    let dive = make(spec).expect("a valid twin");
    let trial = |log: &seaplant::twin::TwinTrial| {
        let name = format!("{}{added}", log.name);
        let setup =
            TrialSetup { name, role: log.role, dofs: log.dofs.clone(), ..Default::default() };
        Trial::new(setup, &log.recording, &dive.vehicle).expect("a valid trial")
    };
    (dive.trials.iter().map(trial).collect(), dive.vehicle)
}

/// The recommended plant of an axis of the twin with a disturbance.
fn recommended(dof: Dof, disturbance: Disturbance) -> PlantResult {
    let (dofs, disturbances) = ([dof].into(), [disturbance].into());
    let (trials, vehicle) = made(&TwinSpec { dofs, disturbances, ..TwinSpec::jason2() }, "");
    let options = IdentifyOptions { methods: vec![Method::FilterError], ..Default::default() };
    let mut results = identify(&vehicle, &trials, &options).results;
    results.plants.remove(dof.name()).expect("a plant")
}

#[test]
fn each_choice_of_terms_is_told_once() {
    let plant = recommended(Dof::Heave, Disturbance::LagTwoWay);
    let told: Vec<&String> = plant.structure.iter().map(|own| &own.candidate).collect();
    let different: BTreeSet<&String> = told.iter().copied().collect();
    assert_eq!(different.len(), told.len(), "{told:?}");
}

#[test]
fn what_turning_does_to_a_lever_arm_that_was_found_is_no_coupling() {
    let plant = recommended(Dof::Surge, Disturbance::Lever);
    assert!(plant.nuisances.keys().any(|name| name.starts_with("lever")), "{:?}", plant.nuisances);
    assert!(plant.caveats.iter().all(|caveat| caveat.code != CaveatCode::CoupledAxes));
}

/// Surge in a current that comes from ahead or, on the other heading, from astern.
fn dive(seed: u64, current_m_s: f64) -> Vec<Trial> {
    let spec = TwinSpec {
        seed,
        dofs: [Dof::Surge].into(),
        duration_s: 240.0,
        hold_out_s: 120.0,
        disturbances: Disturbance::parse_list("tether,current").expect("known"),
        strength: DisturbanceStrength { current_m_s, ..TwinSpec::jason2().strength },
        ..TwinSpec::jason2()
    };
    made(&spec, &format!(" in {current_m_s}")).0
}

#[test]
fn a_held_out_trial_in_a_current_does_not_speak_against_both_headings() {
    let spec = TwinSpec::jason2();
    let vehicle = make(&TwinSpec { dofs: [Dof::Surge].into(), ..spec }).expect("a twin").vehicle;
    let options = IdentifyOptions { methods: vec![Method::FilterError], ..Default::default() };
    for seed in SEEDS {
        let mut trials = dive(seed, 0.1);
        let back = dive(seed + 100, -0.1);
        trials.extend(back.into_iter().filter(|trial| trial.role() == Role::Fit));
        let found = identify(&vehicle, &trials, &options).results;
        let plant = &found.plants["surge"];
        let drag = plant.by_axis[&Dof::Surge].quadratic_drag.as_ref().expect("fitted").value;
        let truth = 2230.9;
        assert!((drag / truth - 1.0).abs() < 0.1, "seed {seed}: drag {drag:.0}");
        assert!(plant.nuisances.keys().any(|name| name.starts_with("current")), "seed {seed}");
    }
}

/// Mass may be off by this part in four minutes of calm.
const CALM: f64 = 0.03;

#[test]
fn of_more_than_300_trials_300_are_fitted_and_all_are_scored() {
    let spec = TwinSpec { dofs: [Dof::Surge].into(), ..TwinSpec::jason2() };
    let dive = make(&spec).expect("a valid twin");
    let log = dive.trials.iter().find(|trial| trial.role == Role::Fit).expect("one to fit");
    let part = |k: usize| {
        let from_s = 5.0 + k as f64;
        let setup = TrialSetup {
            name: format!("part {k}"),
            dofs: log.dofs.clone(),
            from_s: Some(from_s),
            to_s: Some(from_s + 15.0),
            ..TrialSetup::default()
        };
        Trial::new(setup, &log.recording, &dive.vehicle).expect("complete")
    };
    let trials: Vec<Trial> = (0..320).map(part).collect();
    let mut options = IdentifyOptions { methods: vec![Method::FilterError], ..Default::default() };
    options.filter_error.candidates.clear();
    let results = identify(&dive.vehicle, &trials, &options).results;
    let plant = &results.plants["surge"];
    let notes: Vec<&str> = plant.caveats.iter().map(|caveat| caveat.message.as_str()).collect();
    assert!(notes.iter().any(|note| note.contains("300 of 320 trials")), "{notes:?}");
    assert_eq!(plant.fit.by_trial.len(), 320);
    let truth = dive.truth.plants[&Dof::Surge].mass;
    let off = (plant.by_axis[&Dof::Surge].mass.value / truth - 1.0).abs();
    assert!(off < CALM, "{off}");
}
