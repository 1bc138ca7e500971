//! Third-party vehicle data through the complete program.
//!
//! The logs are looked for in the folder in `SEAPLANT_DATA`, relative to the workspace, else in
//! `../shared/data`; a test whose files are absent reports it.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;

use crate::workshop::{Workshop, caveats, number, only_axis};

/// Returns the folder of all crates.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns a folder of the data, if it exists.
pub fn data(folder: &str) -> Option<PathBuf> {
    let named = std::env::var_os("SEAPLANT_DATA").map(PathBuf::from);
    let all = workspace().join(named.unwrap_or_else(|| "../shared/data".into()));
    let path = all.join(folder);
    if !path.exists() {
        eprintln!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path.canonicalize().expect("it is there"))
}

/// Returns the result of `identify` for an example, run once for all tests, without failures.
fn identify(found: &'static OnceLock<Option<Value>>, example: &str) -> Option<&'static Value> {
    found.get_or_init(|| run(example)).as_ref()
}

fn run(example: &str) -> Option<Value> {
    let all = data("")?;
    let campaign = workspace().join("examples").join(example).canonicalize().expect("an example");
    let workshop = Workshop::empty();
    let campaign = campaign.to_str().expect("UTF-8");
    let mut command = workshop.seaplant(&["identify", campaign, "--out", "out", "--json"]);
    let output = command.env("SEAPLANT_DATA", all).assert().success().stderr("");
    let found: Value = serde_json::from_slice(&output.get_output().stdout).expect("JSON");
    assert_eq!(found["failures"], serde_json::json!([]));
    assert!(workshop.join("out/report.html").is_file());
    Some(found)
}

fn bolt_in_heave() -> Option<&'static Value> {
    static FOUND: OnceLock<Option<Value>> = OnceLock::new();
    identify(&FOUND, "bolt/heave.toml")
}

fn bolt_in_yaw() -> Option<&'static Value> {
    static FOUND: OnceLock<Option<Value>> = OnceLock::new();
    identify(&FOUND, "bolt/yaw.toml")
}

/// Asserts that mass is significantly positive, and that drag is positive or a caveat reports that
/// it is not.
fn assert_physical(plant: &Value) {
    let own = only_axis(plant);
    assert!(number(own, "mass.low95") > 0.0, "{}", own["mass"]);
    for drag in ["quadratic_drag", "linear_drag"] {
        let drag = &own[drag];
        if drag.is_null() {
            continue;
        }
        let is_told = caveats(plant).iter().any(|(code, _, _)| *code == "wrong-sign");
        assert!(number(drag, "value") > 0.0 || is_told, "{drag}");
    }
}

/// Asserts that on held-out trials a plant is better than one that never moves.
fn assert_better_than_null(plant: &Value) {
    let score = only_axis(&plant["hold_out"]);
    let (e, null) = (number(score, "mean_abs_error"), number(score, "null_error"));
    assert!(e < null, "{} is off by {e}, standing still by {null}", plant["method"]);
}

fn held_out<'a>(plant: &'a Value, trial: &str) -> &'a Value {
    let axis = plant["axes"][0].as_str().expect("an axis");
    let found = plant["hold_out"]["by_trial"].get(trial).and_then(|axes| axes.get(axis));
    found.unwrap_or_else(|| panic!("{trial} is not held out"))
}

/// Checks the position that a plant simulates over a complete held-out dive, from thrust alone.
#[track_caller]
fn assert_predicts_position(plant: &Value, trial: &str, r_squared: f64) {
    let found = number(held_out(plant, trial), "position_r_squared");
    assert!(found > r_squared, "{} on {trial}: R² {found}", plant["method"]);
}

/// A careful manual fit reached 0.918 on these dives.
const HEAVE_R_SQUARED: f64 = 0.9;

#[test]
fn bolt_in_heave_is_physical_and_predicts_held_out_dives() {
    let Some(found) = bolt_in_heave() else { return };
    for method in ["filter-error", "equation-error"] {
        let plant = &found["methods"]["heave"][method];
        assert_eq!(plant["alone"]["stable"], true, "{method}");
        // The intervals of equation error include its unexplained residuals of 25 s.
        match method {
            "filter-error" => assert_physical(plant),
            _ => assert!(number(only_axis(plant), "mass.value") > 0.0, "{plant}"),
        }
        assert_better_than_null(plant);
        for trial in ["depth 1", "depth 2"] {
            assert_predicts_position(plant, trial, HEAVE_R_SQUARED);
        }
    }
    // Vertical thrusters hold down a vehicle that floats.
    assert!(number(found, "plants.heave.by_axis.heave.bias_force.value") > 0.0);
}

#[test]
fn bolt_in_heave_reports_why_it_is_doubtful() {
    let Some(found) = bolt_in_heave() else { return };
    // All dives have downward thrust, for fifteen seconds, at 2 Hz.
    for (method, code) in [
        ("filter-error", "one-signed-thrust"),
        ("equation-error", "lag-or-delay"),
        ("paper", "few-effective-samples"),
        ("paper", "filter-attenuates-excitation"),
    ] {
        let all = caveats(&found["methods"]["heave"][method]);
        assert!(all.iter().any(|(found, _, _)| *found == code), "{method} lacks {code}: {all:?}");
    }
}

/// Velocity, simulated for half a minute, against the derivative of a heading at 2 Hz.
const YAW_R_SQUARED: f64 = 0.6;

#[test]
fn bolt_in_yaw_is_physical_and_predicts_held_out_turns() {
    let Some(found) = bolt_in_yaw() else { return };
    let plant = &found["plants"]["yaw"];
    assert_eq!(plant["alone"]["stable"], true);
    assert_physical(plant);
    assert_better_than_null(plant);
    assert!(number(only_axis(&plant["hold_out"]), "r_squared") > YAW_R_SQUARED);
    // A careful manual fit reached 0.967 on a held-out turn.
    for trial in ["yaw 4", "yaw 6"] {
        assert_predicts_position(plant, trial, 0.9);
    }
}

#[test]
fn a_plant_that_creeps_or_has_a_negative_drag_says_so() {
    let Some(found) = bolt_in_yaw() else { return };
    for plant in found["methods"]["yaw"].as_object().expect("methods").values() {
        let has = |code: &str| caveats(plant).iter().any(|(found, _, _)| *found == code);
        assert_eq!(plant["alone"]["stable"] == false, has("unstable"), "{}", plant["method"]);
        let drags = ["quadratic_drag", "linear_drag"].map(|drag| &only_axis(plant)[drag]["value"]);
        let negative = drags.iter().any(|drag| drag.as_f64().is_some_and(|value| value <= 0.0));
        assert_eq!(negative, has("wrong-sign"), "{}", plant["method"]);
    }
}

#[test]
fn the_esso_osaka_is_physical_and_predicts_held_out_runs() {
    let Some(found) = run("esso-osaka/surge.toml") else { return };
    let plant = &found["plants"]["surge"];
    assert_eq!(plant["alone"]["stable"], true);
    assert_physical(plant);
    assert_better_than_null(plant);
    assert!(number(only_axis(&plant["hold_out"]), "r_squared") > 0.75);
    // By textbooks a tanker's added mass is half of its mass in sway and a tenth in surge: 1.5 to
    // 1.8 times the turning.
    assert!((1.3..2.0).contains(&number(plant, "nuisances.turning.value")));
    for method in ["filter-error", "equation-error"] {
        // The added mass of a slender hull in surge is a few per cent of its mass; the assumed
        // thrust of the propeller may be wrong by far more, either way.
        let mass = &only_axis(&found["methods"]["surge"][method])["mass"];
        let (low, high) = (number(mass, "low95"), number(mass, "high95"));
        assert!(low < 1.5 * 244.6 && high > 244.6, "{method}: {low} to {high} kg");
    }
}

#[test]
fn the_thruster_tables_of_its_maker_fit_a_curve_each_way() {
    let Some(folder) = data("t200-static") else { return };
    let workshop = Workshop::empty();
    let mut forward = Vec::new();
    for volts in [10, 12, 14, 16, 18, 20] {
        let table = folder.join(format!("T200-Thrusters-{volts}V.csv"));
        let fit = workshop.json(&["thruster", table.to_str().expect("UTF-8"), "--json"]);
        assert!(number(&fit, "r_squared") > 0.95, "{volts} V: {fit}");
        assert_eq!(fit["input_unit"], "us");
        let (ahead, astern) = (number(&fit, "forward.value"), number(&fit, "reverse.value"));
        // Its propeller is designed for forward thrust; the maker states 5.25 against 4.1 kgf at 16
        // V.
        assert!((0.7..0.9).contains(&(astern / ahead)), "{volts} V: {astern} against {ahead}");
        forward.push(ahead);
    }
    assert!(forward[5] > forward[0], "20 V must push harder than 10 V: {forward:?}");
}
