//! The main path: the twin's campaign made, identified, reported, and used.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use serde_json::Value;

use crate::workshop::{Workshop, assert_within, caveat, number, only_axis, seaplant};

const DOFS: [&str; 4] = ["surge", "sway", "heave", "yaw"];

/// The demo of seed 1, run once for all tests.
struct Demo {
    /// Working folder; its files are in `demo` there.
    place: PathBuf,
    printed: Value,
}

fn demo() -> &'static Demo {
    static DEMO: OnceLock<Demo> = OnceLock::new();
    DEMO.get_or_init(|| {
        let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join("demo");
        if place.exists() {
            std::fs::remove_dir_all(&place).expect("an old demo can be removed");
        }
        std::fs::create_dir_all(&place).expect("a folder can be made");
        let mut command = seaplant();
        command.current_dir(&place).args(["demo", "--out", "demo", "--json"]);
        let output = command.assert().success().stderr("").get_output().clone();
        let printed = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
        Demo { place, printed }
    })
}

fn read_json(path: &Path) -> Value {
    let text = std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_slice(&text).expect("JSON")
}

/// Returns the absolute path of the demo's results.json.
pub fn results_file() -> PathBuf {
    demo().place.join("demo/results.json")
}

/// Returns the demo's folder.
pub fn folder() -> PathBuf {
    demo().place.join("demo")
}

pub fn results() -> &'static Value {
    &demo().printed
}

fn truth() -> Value {
    read_json(&folder().join("truth.json"))
}

fn plant(dof: &str, method: &str) -> &'static Value {
    &results()["methods"][dof][method]
}

/// Runs the program in the demo's working folder.
fn there(words: &[&str]) -> Value {
    let mut command = seaplant();
    let output = command.current_dir(&demo().place).args(words).arg("--json").assert().success();
    serde_json::from_slice(&output.get_output().stdout).expect("JSON and nothing else")
}

/// Asserts that a method recovers every mass and quadratic drag to within a fraction of the truth.
fn assert_recovers(method: &str, mass_part: f64, drag_part: f64) {
    let truth = truth();
    for dof in DOFS {
        let found = plant(dof, method);
        for (key, part) in [("mass", mass_part), ("quadratic_drag", drag_part)] {
            let value = number(only_axis(found), &format!("{key}.value"));
            let right = number(&truth, &format!("plants.{dof}.{key}"));
            assert_within(&format!("{key} in {dof} by {method}"), value, right, part);
        }
    }
}

#[test]
fn printed_and_written_results_are_equal() {
    assert_eq!(*results(), read_json(&results_file()));
    assert_eq!(results()["schema"], "seaplant/results/2");
    assert_eq!(results()["failures"], serde_json::json!([]));
}

#[test]
fn equation_error_recovers_the_twin() {
    // Design, section 2: 0.3 % without disturbances, over many seeds.
    assert_recovers("equation-error", 0.02, 0.02);
}

#[test]
fn filter_error_recovers_the_twin() {
    assert_recovers("filter-error", 0.01, 0.02);
}

#[test]
fn filter_error_is_recommended_and_stable() {
    for dof in DOFS {
        let found = &results()["plants"][dof];
        assert_eq!(found["method"], "filter-error");
        assert_eq!(found["alone"]["stable"], true);
        let score = only_axis(&found["hold_out"]);
        let (e, null) = (number(score, "mean_abs_error"), number(score, "null_error"));
        assert!(e < 0.1 * null, "{dof}: {e} against {null}");
    }
}

#[test]
fn the_papers_mass_is_too_large_by_its_filters_attenuation() {
    // Zero-phase second-order Butterworth at 1/8 Hz: |H|² = 1 / (1 + (f / f_c)⁴) at each pass.
    // Design, section 2: 1/|H| is 2.0 in surge and 4.2 in yaw; the joystick, which has slower
    // components, and the drag move the mass a little from there.
    let truth = truth();
    for (dof, low, high) in [("surge", 0.90, 1.07), ("yaw", 2.90, 3.50)] {
        let found = plant(dof, "paper");
        let mass = number(only_axis(found), "mass.value");
        let excess = mass / number(&truth, &format!("plants.{dof}.mass")) - 1.0;
        assert!((low..high).contains(&excess), "{dof}: {excess:+.3}");
    }
}

#[test]
fn the_papers_attenuation_is_reported_with_its_factor() {
    for (dof, frequency_hz) in [("surge", 0.125), ("yaw", 1.0 / 6.0)] {
        let message = caveat(plant(dof, "paper"), "filter-attenuates-excitation");
        let factor = message
            .split_once("to be ")
            .and_then(|(_, rest)| rest.split_once(" times too large"))
            .and_then(|(factor, _)| factor.parse::<f64>().ok());
        let factor = factor.unwrap_or_else(|| panic!("no factor in: {message}"));
        // The filter is run both ways, so its gain is that of one pass squared. Warping by the
        // bilinear transform and the grid of the spectrum shift it by a few per cent.
        let inverse_gain = 1.0 + (frequency_hz / 0.125_f64).powi(4);
        assert_within(&format!("1/|H| in {dof}"), factor, inverse_gain, 0.05);
        assert!(message.contains("equation-error"), "{message}");
    }
}

#[test]
fn steady_runs_give_drag_and_ballast_together() {
    let steady = &results()["steady"]["heave"];
    assert_within("steady drag", number(steady, "quadratic_drag.value"), 5500.0, 0.05);
    let bias = number(steady, "bias_force.value");
    assert!((bias - 250.0).abs() < 60.0, "bias force {bias} N");
}

#[test]
fn single_steady_runs_differ_down_and_up() {
    let segments = results()["steady"]["heave"]["segments"].as_array().expect("segments");
    assert_eq!(segments.len(), 7);
    let mean = |down: bool| {
        let of_way = segments.iter().filter(|segment| (number(segment, "force") > 0.0) == down);
        let drags: Vec<f64> = of_way.map(|s| number(s, "quadratic_drag.value")).collect();
        drags.iter().sum::<f64>() / drags.len() as f64
    };
    let (down, up) = (mean(true), mean(false));
    assert!(down > 1.2 * up, "{down} down, {up} up");
}

#[test]
fn the_report_needs_no_network() {
    let report = std::fs::read_to_string(folder().join("report.html")).expect("a report");
    assert!(report.len() > 10_000);
    for quote in ["\"", "'", ""] {
        for start in ["src=", "href=", "url("] {
            for scheme in ["http://", "https://", "//"] {
                let link = format!("{start}{quote}{scheme}");
                assert!(!report.contains(&link), "the report loads {link}...");
            }
        }
    }
}

#[test]
fn every_figure_that_the_report_shows_is_written() {
    let figures = std::fs::read_dir(folder().join("figures")).expect("figures");
    // Filter error is recommended on every axis; the figures of other methods are SVG alone.
    let others = ["equation-error", "output-error", "paper"];
    let mut count = 0;
    for entry in figures {
        let path = entry.expect("an entry").path();
        assert!(std::fs::metadata(&path).expect("a file").len() > 500, "{}", path.display());
        let stem = path.file_stem().and_then(|stem| stem.to_str()).expect("a name");
        let is_of_other = others.iter().any(|method| stem.ends_with(method));
        assert!(path.with_extension("svg").exists(), "{}", path.display());
        assert_ne!(path.with_extension("png").exists(), is_of_other, "{}", path.display());
        count += 1;
    }
    assert!(count >= DOFS.len(), "{count} files");
}

#[test]
fn the_same_seed_gives_the_same_results_to_the_byte() {
    let again = Workshop::empty();
    again.success(&["demo", "--out", "demo", "--quiet"]);
    let first = std::fs::read(results_file()).expect("results");
    assert!(again.read("demo/results.json").as_bytes() == first, "results.json differs");
}

#[test]
fn identifying_the_demos_campaign_gives_the_demos_plants() {
    let found = there(&["identify", "demo/campaign.toml", "--out", "again"]);
    for key in ["plants", "methods", "steady", "subsets", "trials", "bollard_pull"] {
        assert_eq!(found[key], results()[key], "{key}");
    }
}

#[test]
fn validation_gives_the_scores_of_the_identification() {
    let validations = there(&["validate", "demo/results.json", "demo/campaign.toml"]);
    for validation in validations.as_array().expect("a list") {
        let axes = validation["axes"].as_array().expect("a list");
        assert_eq!(axes.len(), 1, "{validation}");
        let dof = axes[0].as_str().expect("text");
        let fitted_to = validation["fitted_to"].as_array().expect("a list");
        assert_eq!(fitted_to, &[Value::from(format!("{dof} 1"))]);
        let by_trial = |score: &Value| score["by_trial"].as_object().expect("trials").clone();
        let trials = by_trial(&validation["score"]);
        let plant = &results()["plants"][dof];
        let own = [by_trial(&plant["fit"]), by_trial(&plant["hold_out"])];
        assert_eq!(own.each_ref().map(|of| of.len()), [1, 1], "{dof}");
        assert_eq!(trials.len(), own.len());
        for (name, own) in own.iter().flatten() {
            let error = |of: &Value| number(&of[dof], "mean_abs_error");
            let (e, right) = (error(&trials[name]), error(own));
            assert!((e - right).abs() < 1e-9, "{dof}: {e} against {right}");
        }
    }
}

#[test]
fn validation_says_which_trials_were_fitted() {
    let mut command = seaplant();
    let words = ["validate", "demo/results.json", "demo/campaign.toml"];
    let output = command.current_dir(&demo().place).args(words).assert().success();
    let text = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
    let row = |trial: &str| text.lines().find(|line| line.contains(trial)).expect("a row").trim();
    assert!(row("surge 1").ends_with("fitted to it"), "{text}");
    assert!(!row("surge hold-out").ends_with("fitted to it"), "{text}");
}

fn hold_out_logs() -> Vec<String> {
    let folder = folder().join("logs/surge-hold-out");
    let entries = std::fs::read_dir(folder).expect("logs").map(|e| e.expect("an entry").path());
    let mut logs: Vec<String> = entries.map(|path| path.display().to_string()).collect();
    logs.sort();
    logs
}

#[test]
fn simulation_of_the_held_out_log_gives_the_held_out_error() {
    let logs = hold_out_logs();
    let mut words = vec!["simulate", "demo/results.json", "--dof", "surge"];
    words.extend(logs.iter().map(String::as_str));
    let simulation = there(&words);
    let e = number(&simulation, "mean_abs_error");
    let right = number(results(), "plants.surge.hold_out.by_axis.surge.mean_abs_error");
    assert!((e - right).abs() < 1e-9, "{e} against {right}");
    let length = |key: &str| simulation[key].as_array().expect("numbers").len();
    assert!(length("time_s") > 1000);
    for key in ["force", "measured", "simulated"] {
        assert_eq!(length(key), length("time_s"), "{key}");
    }
}

#[test]
fn simulation_prints_a_table_whose_differences_are_the_error() {
    let logs = hold_out_logs();
    let mut command = seaplant();
    command.current_dir(&demo().place).args(["simulate", "demo/results.json", "--dof", "surge"]);
    let output = command.args(&logs).assert().success().stderr("").get_output().clone();
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let mut lines = text.lines();
    let header = "time [s],force [N],measured [m/s],simulated [m/s],difference [m/s]";
    assert_eq!(lines.next(), Some(header));
    let differences: Vec<f64> = lines
        .map(|line| line.rsplit(',').next().expect("a cell").parse().expect("a number"))
        .collect();
    let e = differences.iter().map(|d: &f64| d.abs()).sum::<f64>() / differences.len() as f64;
    let right = number(results(), "plants.surge.hold_out.by_axis.surge.mean_abs_error");
    assert!((e - right).abs() < 1e-9, "{e} against {right}");
}

#[test]
fn without_the_fits_campaign_another_is_requested() {
    let logs = hold_out_logs();
    let elsewhere = Workshop::empty();
    let results = results_file();
    let mut words = vec!["simulate", results.to_str().expect("UTF-8"), "--dof", "surge"];
    words.extend(logs.iter().map(String::as_str));
    assert_eq!(
        elsewhere.failure(&words),
        "the campaign that the results came from is not here; name it with --campaign"
    );
    let campaign = folder().join("campaign.toml");
    words.extend(["--campaign", campaign.to_str().expect("UTF-8")]);
    assert!(elsewhere.success(&words).starts_with("time [s],"));
}

#[test]
fn a_custom_twin_is_identified_from_its_files() {
    let workshop = Workshop::empty();
    workshop.write("twin.toml", "dofs = [\"surge\"]\nduration_s = 120.0\n");
    let made = workshop.json(&["twin", "twin.toml", "--out", "logs", "--json"]);
    assert_eq!(made["campaign"], "logs/campaign.toml");
    assert_eq!(made["trials"], serde_json::json!(["surge 1", "surge hold-out"]));
    let found = workshop.json(&["identify", "logs/campaign.toml", "--json"]);
    let truth: Value = serde_json::from_str(&workshop.read("logs/truth.json")).expect("JSON");
    for key in ["mass", "quadratic_drag"] {
        let value = number(&found, &format!("plants.surge.by_axis.surge.{key}.value"));
        // A quarter of the demo's trial: twice its spread.
        assert_within(key, value, number(&truth, &format!("plants.surge.{key}")), 0.02);
    }
    assert!(workshop.join("logs/results/report.html").is_file());
}

#[test]
fn a_twin_that_cannot_be_is_refused() {
    let workshop = Workshop::empty();
    let refuse = |spec: &str| {
        workshop.write("twin.toml", spec);
        workshop.failure(&["twin", "twin.toml", "--out", "logs"])
    };
    let short = refuse("duration_s = -3.0\n");
    assert_eq!(short, "twin.toml: the twin's duration_s is -3; it must be from 20 s to a day");
    let misspelt = refuse("duraton_s = 120.0\n");
    assert!(misspelt.ends_with("did you mean `duration_s`?"), "{misspelt}");
    let roll = refuse("dofs = [\"roll\"]\n");
    assert!(roll.contains("it must be some of surge, sway, heave and yaw"), "{roll}");
}
