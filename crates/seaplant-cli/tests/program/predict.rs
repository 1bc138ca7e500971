//! Predictions of a plant under inputs alone.

use serde_json::Value;

use crate::workshop::{SLED, Workshop, assert_within, number, only_axis};

/// Tolerance of estimates from a log of two minutes.
const PART: f64 = 0.02;

fn identified() -> Workshop {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--quiet"]);
    workshop
}

fn follows<'a>(said: &'a Value, name: &str) -> &'a Value {
    let all = said["consequences"].as_array().expect("consequences");
    let is_it = |x: &&Value| x["name"].as_str().is_some_and(|found| found.starts_with(name));
    all.iter().find(is_it).unwrap_or_else(|| panic!("no {name} in {said}"))
}

#[test]
fn a_step_ends_at_top_speed_within_its_band() {
    let workshop = identified();
    let step =
        ["simulate", "results", "--step", "surge 300 N", "--for", "60", "--draws", "40", "--json"];
    let said = workshop.json(&step);
    let (mass, drag) = SLED;
    let top = (300.0 / drag).sqrt();
    let last = said["velocity"].as_array().expect("rows").last().expect("rows")[0].as_f64();
    assert_within("speed", last.expect("a number"), top, PART);
    let band = &said["band95"].as_array().expect("rows").last().expect("rows")[0];
    assert!(band[0].as_f64() < last && band[1].as_f64() > last, "{band}");
    let value = |name: &str| follows(&said, name)["value"].as_f64().expect("a number");
    assert_within("top speed", value("top speed"), top, PART);
    assert_within("time constant", value("time constant"), mass / (2.0 * drag * top), PART);
    assert_within("way", value("stopping distance"), mass / drag * 10.0_f64.ln(), PART);
    // The same seed gives the same draws, another seed others.
    assert_eq!(workshop.json(&step)["band95"], said["band95"]);
    let other = [&step[..], &["--seed", "2"]].concat();
    assert_ne!(workshop.json(&other)["band95"], said["band95"]);
}

#[test]
fn thrusters_drive_by_their_curves_from_profiles_and_tables() {
    let workshop = identified();
    workshop.write("p.toml", "duration_s = 60.0\n[[hold]]\nthruster.prop = 86.6\n");
    let rpm = 86.6 * 30.0 / std::f64::consts::PI;
    workshop.write("t.csv", format!("time [s],thruster.prop.speed [rpm]\n0,{rpm}\n60,{rpm}\n"));
    let (_, drag) = SLED;
    for inputs in ["p.toml", "t.csv"] {
        let said = workshop.json(&["simulate", "results", inputs, "--draws", "40", "--json"]);
        let last = said["velocity"].as_array().expect("rows").last().expect("rows")[0].as_f64();
        let top = (0.04 * 86.6_f64.powi(2) / drag).sqrt();
        assert_within(inputs, last.expect("a number"), top, PART);
    }
}

#[test]
fn csv_and_page_are_written_and_known_again() {
    let workshop = identified();
    let run = |out: &str| {
        let step = ["simulate", "results", "--step", "surge 300 N", "--for", "5", "--out", out];
        workshop.success(&step)
    };
    for out in ["motion.csv", "motion.html"] {
        assert!(run(out).contains("top speed at 300 N"));
        run(out);
    }
    let csv = workshop.read("motion.csv");
    let head = csv.lines().next().expect("a heading");
    assert!(
        head.starts_with("time [s],north [m]") && head.ends_with("yaw high95 [rad/s]"),
        "{head}"
    );
    assert_eq!(csv.lines().count(), 52);
    let page = workshop.read("motion.html");
    assert!(
        page.contains("<svg") && page.contains("Axes without a plant, which do not move: sway")
    );
    // The licence of the chart library contains its address, which is not loaded.
    let page = page.replace("https://github.com/leeoniya/uPlot", "");
    assert!(!page.contains("http://") && !page.contains("https://"), "it needs no network");
    workshop.write("other.csv", "mine");
    let step = ["simulate", "results", "--step", "surge 1 N", "--for", "5", "--out", "other.csv"];
    assert!(workshop.failure(&step).contains("not written by this command"));
}

#[test]
fn impossible_requests_to_drive_are_refused_with_advice() {
    let workshop = identified();
    let refused = |words: &[&str]| workshop.failure(&[&["simulate", "results"], words].concat());
    assert!(refused(&[]).contains("--step \"surge 200 N\" --for 60"));
    assert!(refused(&["--step", "surge 3 m", "--for", "5"]).contains("write \"surge 3 N\""));
    assert!(refused(&["--step", "surge 3 N", "--for", "0"]).contains("above zero"));
    workshop.write("bow.toml", "duration_s = 5.0\n[[hold]]\nthruster.bow = 1.0\n");
    assert!(refused(&["bow.toml"]).contains("it has prop"), "{}", refused(&["bow.toml"]));
    workshop.write("odd.toml", "duration = 5.0\n");
    assert!(refused(&["odd.toml"]).contains("did you mean `duration_s`"));
}

#[test]
fn a_force_on_an_unknown_axis_is_reported() {
    let workshop = identified();
    let words = workshop.success(&["simulate", "results", "--step", "yaw 5 N m", "--for", "5"]);
    assert!(words.contains("the inputs also act on yaw, where the plant is not known"), "{words}");
}

#[test]
fn a_published_table_is_held_against_a_log() {
    let workshop = identified();
    let table = "schema = \"seaplant/plant/1\"\nname = \"sled\"\nsource = \"the truth\"\n\
        axes = [\"surge\"]\nmass_matrix = [500.0]\nquadratic_damping = [150.0]\n";
    workshop.write("truth.toml", table);
    workshop.write("wrong.toml", table.replace("150.0", "18.0"));
    let error = |plant: &str| {
        let said = workshop.json(&["validate", plant, "campaign.toml", "--json"]);
        number(only_axis(&said[0]["score"]), "mean_abs_error")
    };
    assert!(error("truth.toml") < 0.01, "{}", error("truth.toml"));
    assert!(error("wrong.toml") > 10.0 * error("truth.toml"));
    assert!(error("results") < 0.01);
}

#[test]
fn speeds_and_forces_beyond_the_trials_are_said() {
    let workshop = identified();
    let notes = |force: &str| {
        let said = workshop.json(&[
            "simulate", "results", "--step", force, "--for", "60", "--draws", "10", "--json",
        ]);
        said["notes"].to_string()
    };
    let far = notes("surge 20000 N");
    assert_eq!(far.matches("the plant is extrapolated").count(), 2, "{far}");
    assert!(!notes("surge 300 N").contains("extrapolated"));
}

#[test]
fn disturbances_are_drawn_where_the_plant_states_them() {
    let workshop = Workshop::empty();
    let plant = "schema = \"seaplant/plant/1\"\nname = \"sled\"\nsource = \"worked by hand\"\naxes = [\"surge\"]\n[coefficients.\"mass.surge\"]\nvalue = 100.0\nstd = 1.0\n[coefficients.\"surge: |u|u\"]\nvalue = 20.0\nstd = 0.1\n";
    workshop.write("calm.toml", plant);
    workshop.write(
        "rough.toml",
        format!("{plant}[disturbance.surge]\nstd = 30.0\ncorrelation_s = 5.0\n"),
    );
    let width = |plant: &str, more: &[&str]| {
        let step = ["simulate", plant, "--step", "surge 50 N", "--for", "60", "--json"];
        let said = workshop.json(&[&step[..], more].concat());
        let band = said["band95"].as_array().expect("rows").last().expect("rows")[0].clone();
        (
            band[1].as_f64().expect("high") - band[0].as_f64().expect("low"),
            said["notes"].to_string(),
        )
    };
    let (calm, _) = width("rough.toml", &[]);
    let (rough, notes) = width("rough.toml", &["--disturbed"]);
    assert!(
        rough > 5.0 * calm && notes.contains("each with a disturbance"),
        "{calm} {rough} {notes}"
    );
    let (_, notes) = width("calm.toml", &["--disturbed"]);
    assert!(notes.contains("states no disturbance"), "{notes}");
    workshop.write(
        "bad.toml",
        format!("{plant}[disturbance.surge]\nstd = -1.0\ncorrelation_s = 5.0\n"),
    );
    let refused =
        workshop.failure(&["simulate", "bad.toml", "--step", "surge 50 N", "--for", "60"]);
    assert!(refused.contains("disturbance of surge"), "{refused}");
}

#[test]
fn the_zigzag_of_a_published_torpedo_states_how_fast_its_rudder_turns() {
    let workshop = Workshop::empty();
    let profile = |rate: &str| {
        let start = "duration_s = 120\nstart.velocity.surge = 1.5\n[[hold]]\nforce.surge = 3.86\n";
        format!(
            "{start}[manoeuvre]\nkind = \"zigzag\"\nrudder = \"rudder\"\nangle_deg = 10\nheading_deg = 10\n{rate}"
        )
    };
    let overshoot = |rate: &str| {
        workshop.write("zigzag.toml", profile(rate));
        let remus = "published:remus-100-prestero-2001";
        let said = workshop.json(&["simulate", remus, "zigzag.toml", "--json"]);
        let assumed = said["notes"].to_string().contains("state rudder_deg_per_s");
        assert_eq!(assumed, rate.is_empty(), "{said}");
        number(&said["numbers"][1], "value")
    };
    let (slow, fast) = (overshoot(""), overshoot("rudder_deg_per_s = 30"));
    assert!(fast > 0.0 && slow > fast, "{slow} {fast}");
}

#[test]
fn a_part_of_the_greatest_thrust_is_a_force() {
    let workshop = Workshop::empty();
    let end = |step: &str| {
        let heavy = "published:bluerov2-heavy-von-benzon-2022";
        let said = workshop.json(&["simulate", heavy, "--step", step, "--for", "5", "--json"]);
        let rows = said["velocity"].as_array().expect("rows");
        rows[rows.len() - 1][0].as_f64().expect("surge")
    };
    // Four thrusters of 30.4 N at 45°.
    let force = 0.6 * 4.0 * 30.4 * 0.5_f64.sqrt();
    assert_within("60 %", end("surge 60 %"), end(&format!("surge {force} N")), 1e-9);
}
