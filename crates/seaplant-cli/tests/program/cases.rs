//! Simulated vehicles with faults that the project's digital twin lacks, and their truth, through
//! the complete program.
//!
//! They are looked for in the folder in `SEAPLANT_CASES`, else in `../shared/cases`; a test whose
//! files are absent reports it.

use std::path::PathBuf;

use serde_json::Value;

use crate::real_data::workspace;
use crate::workshop::{Workshop, number, only_axis};

/// Relative error up to which a mass counts as right …
const MASS: f64 = 0.05;
/// … and a drag at the vehicle's working speed.
const DRAG: f64 = 0.10;

/// Relative error beyond which a mass is wrong: it counts as right up to there in a log that is weak and disturbed.
const WEAK_MASS: f64 = 0.10;

/// A likelihood ratio of nested models is not negative, except for rounding of the two optima, each
/// within 0.05.
const ROUNDING: f64 = 0.1;

fn case(name: &str) -> Option<PathBuf> {
    let named = std::env::var_os("SEAPLANT_CASES").map(PathBuf::from);
    let folder = workspace().join(named.unwrap_or_else(|| "../shared/cases".into())).join(name);
    if !folder.exists() {
        eprintln!("skipped: {} is not there", folder.display());
        return None;
    }
    Some(folder.canonicalize().expect("it is there"))
}

/// Returns the recommended plant of a case, and the truth.
fn plant(name: &str) -> Option<(Value, Value)> {
    let folder = case(name)?;
    let truth = std::fs::read_to_string(folder.join("truth.json")).expect("a truth");
    let truth: Value = serde_json::from_str(&truth).expect("JSON");
    let campaign = folder.join("campaign.toml");
    let workshop = Workshop::empty();
    let output = workshop
        .seaplant(&["identify", campaign.to_str().expect("UTF-8"), "--out", "out", "--json"])
        .output()
        .expect("it runs");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let dof = truth["dof"].as_str().expect("named");
    Some((found["plants"][dof].clone(), truth))
}

/// Computes quadratic and linear drag at a speed.
fn drag(of: &dyn Fn(&str) -> f64, speed: f64) -> f64 {
    of("quadratic_drag") * speed * speed + of("linear_drag") * speed
}

/// Returns the relative errors of mass and of drag at working speed: the error of a model that never moves is that
/// speed.
fn errors(plant: &Value, truth: &Value) -> [f64; 2] {
    let found = |key: &str| only_axis(plant)[key]["value"].as_f64().unwrap_or(0.0);
    let known = |key: &str| truth[key].as_f64().unwrap_or(0.0);
    let speed = number(only_axis(&plant["hold_out"]), "null_error");
    [found("mass") / known("mass") - 1.0, drag(&found, speed) / drag(&known, speed) - 1.0]
}

fn is_found(name: &str) {
    let Some((plant, truth)) = plant(name) else { return };
    let [mass, drag] = errors(&plant, &truth);
    assert!(mass.abs() < MASS, "{name}: mass {:+.1} %", 100.0 * mass);
    assert!(drag.abs() < DRAG, "{name}: drag {:+.1} %", 100.0 * drag);
    for decision in plant["structure"].as_array().expect("decisions") {
        let ratio = number(decision, "likelihood_ratio");
        assert!(ratio > -ROUNDING, "{name}: {decision}");
    }
}

#[test]
fn spikes_do_not_veto_linear_drag() {
    is_found("02-holdout-veto/case136-surge-spikes");
}

#[test]
fn a_sensor_that_froze_is_left_out() {
    is_found("02-holdout-veto/case142-heave-spikes");
}

#[test]
fn propellers_that_lag_differently_up_and_down_are_found() {
    for name in ["case16-surge-lag2", "case21-sway-lag2"] {
        let name = format!("03-lag-per-direction/{name}");
        is_found(&name);
        let Some((plant, _)) = plant(&name) else { return };
        // 0.15 s while speed rises, and 0.45 s while it falls.
        for (nuisance, expected) in [("lag", 0.15), ("falling_lag_ratio", 3.0)] {
            let found = number(&plant["nuisances"][nuisance], "value");
            assert!((found / expected - 1.0).abs() < 0.15, "{name}: {nuisance} {found}");
        }
    }
}

#[test]
fn thrust_that_falls_in_the_course_of_each_trial_is_found() {
    let Some((plant, truth)) = plant("10-thrust-drifts/case176-surge-sag") else { return };
    let change = number(&plant["nuisances"]["thrust_change_within"], "value");
    assert!((change + 0.15).abs() < 0.005, "{change}");
    // Of the curve, which holds at the beginning; the plant is that of the mean thrust.
    for key in ["mass", "quadratic_drag", "linear_drag"] {
        let [found, known] = [&only_axis(&plant)[key], &truth[key]];
        let known = known.as_f64().expect("a number");
        assert!((number(found, "value") / known - 1.0 / 0.925).abs() < 0.02, "{key}: {found}");
        assert!((number(found, "low95")..number(found, "high95")).contains(&known), "{key}");
    }
    let message = |caveat: &Value| caveat["message"].as_str().map(str::to_owned);
    let caveats = plant["caveats"].as_array().expect("caveats").iter().filter_map(message);
    assert!(caveats.filter(|own| own.contains("thrust changes by -15")).count() == 1);
}

#[test]
fn rate_limited_propellers_are_found() {
    is_found("04-slew/case26-heave-slew");
}

#[test]
fn swell_is_found() {
    is_found("05-swell/case12-surge");
}

#[test]
fn yaw_is_followed_across_gaps_of_heading() {
    is_found("07-yaw-gap/case99-yaw-dropout");
}

#[test]
fn one_sided_inflow_is_found() {
    is_found("09-inflow-one-sided/case56-surge-inflow1");
}

#[test]
fn another_thrust_exponent_is_found() {
    is_found("11-curve-exponent/case174-heave-curve");
}

#[test]
fn a_current_that_varies_is_found() {
    is_found("12-current-varies/case85-sway-slowcurrent");
}

#[test]
fn a_sensor_that_averages_is_found() {
    is_found("13-dvl-averages/case161-sway-dvlsmooth");
}

#[test]
fn a_sensor_that_reads_too_much_is_found() {
    is_found("14-dvl-scale/case122-heave-dvlscale");
}

#[test]
fn plants_that_the_logs_do_not_determine_are_doubtful() {
    for name in ["case12-surge-field3", "case15-yaw-field3"] {
        let Some((plant, _)) = plant(&format!("06-usable-with-wide-interval/{name}")) else {
            return;
        };
        let trust = plant["verdict"]["trust"].as_str().expect("judged");
        assert!(["doubtful", "do-not-use"].contains(&trust), "{name}: {trust}");
    }
}

#[test]
fn linear_drag_in_a_weak_log_is_found() {
    let Some((plant, truth)) = plant("06-usable-with-wide-interval/case14-heave-field3") else {
        return;
    };
    let [mass, drag] = errors(&plant, &truth);
    assert!(mass.abs() < WEAK_MASS, "mass {:+.1} %", 100.0 * mass);
    assert!(drag.abs() < DRAG, "drag {:+.1} %", 100.0 * drag);
}
