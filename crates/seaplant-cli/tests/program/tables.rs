//! Bollard-pull tables, inspection of logs, and initial campaigns from them.

use serde_json::Value;

use crate::demo;
use crate::workshop::{VEHICLE, Workshop, assert_within, number};

fn bench() -> String {
    demo::folder().join("bollard-pull.csv").display().to_string()
}

#[test]
fn the_demos_bollard_pull_gives_the_thrusters_of_jason_2() {
    let fit = Workshop::empty().json(&["thruster", &bench(), "--json"]);
    // The coefficients of the paper's figure 2, N/(rad/s)².
    assert_within("forward", number(&fit, "forward.value"), 0.0402, 0.03);
    assert_within("reverse", number(&fit, "reverse.value"), 0.0328, 0.03);
    assert!(number(&fit, "r_squared") > 0.99);
}

#[test]
fn the_line_for_the_vehicle_is_read_by_the_vehicle() {
    let workshop = Workshop::quick();
    let words = workshop.success(&["thruster", &bench()]);
    let line = words.lines().find(|line| line.starts_with("curve = ")).expect("a line");
    let old = VEHICLE.lines().find(|line| line.starts_with("curve = ")).expect("a line");
    workshop.change("vehicle.toml", old, line);
    let found = workshop.json(&["identify", "campaign.toml", "--json"]);
    let curve = found["thrusters"][0]["curve"].as_str().expect("words");
    let fit = workshop.json(&["thruster", &bench(), "--json"]);
    let forward = format!("{:.3}", number(&fit, "forward.value"));
    assert!(curve.contains(&forward), "{curve} lacks {forward}");
}

#[test]
fn a_table_without_forces_is_refused() {
    let workshop = Workshop::empty();
    workshop.write("pull.csv", "speed [rpm],power [W]\n0,0\n10,1\n20,4\n30,9\n");
    let message = workshop.failure(&["thruster", "pull.csv"]);
    assert_eq!(
        message,
        "pull.csv: force: no column states a unit of force; name one and its unit (N, kgf, lbf)"
    );
}

#[test]
fn a_log_is_shown_channel_by_channel() {
    let workshop = Workshop::new();
    let found = workshop.json(&["inspect", "log.csv", "--json"]);
    let channels = found["channels"].as_array().expect("channels");
    let columns: Vec<&Value> = channels.iter().map(|channel| &channel["column"]).collect();
    assert_eq!(columns, ["prop [rpm]", "speed [m/s]"]);
    assert_within("rate", number(&channels[0], "rate_hz"), 10.0, 1e-6);
    assert_eq!(channels[0]["count"], 1200);
    assert_eq!(found["files"][0]["path"], "log.csv");
    let words = workshop.success(&["inspect", "log.csv"]);
    assert!(words.contains("prop [rpm]") && words.contains("1200"), "{words}");
}

#[test]
fn a_log_that_cannot_be_read_is_reported_once() {
    let message = Workshop::empty().failure(&["inspect", "no.csv"]);
    assert!(message.starts_with("cannot read no.csv: "), "{message}");
    assert_eq!(message.matches("No such file").count(), 1, "{message}");
}

#[test]
fn files_of_init_state_what_is_missing() {
    let workshop = Workshop::new();
    let words = workshop.success(&["init", "log.csv", "--out", "begun"]);
    assert!(words.starts_with("begun/vehicle.toml\nbegun/campaign.toml\n"), "{words}");
    assert!(words.contains("position_m, direction and curve"), "{words}");
    // Unfinished files are refused: no placeholder counts as a number.
    let message = workshop.failure(&["identify", "begun/campaign.toml"]);
    assert!(message.starts_with("begun/vehicle.toml: thruster `"), "{message}");
    let advice = "missing field `position_m`\nadd `position_m = ...` there; the file holds it as \
                  a comment to fill in";
    assert!(message.contains(advice), "{message}");
}

#[test]
fn files_of_init_are_identified_once_completed() {
    let workshop = Workshop::new();
    workshop.success(&["init", "log.csv", "--out", "begun", "-q"]);
    let mut vehicle = workshop.read("begun/vehicle.toml");
    for (key, value) in [
        ("position_m", "[0.0, 0.0, 0.0]"),
        ("direction", "[1.0, 0.0, 0.0]"),
        ("curve", "{ kind = \"quadratic\", forward = 0.04, reverse = 0.04 }"),
    ] {
        let line =
            vehicle.lines().find(|line| line.starts_with(&format!("# {key} ="))).map(str::to_owned);
        let line = line.unwrap_or_else(|| panic!("{key} is not in {vehicle}"));
        vehicle = vehicle.replacen(&line, &format!("{key} = {value}"), 1);
    }
    workshop.write("begun/vehicle.toml", vehicle);
    let found = workshop.json(&["identify", "begun/campaign.toml", "--json"]);
    let (mass, drag) = crate::workshop::SLED;
    // Clean data of two minutes.
    assert_within("mass", number(&found, "plants.surge.by_axis.surge.mass.value"), mass, 0.02);
    let found = number(&found, "plants.surge.by_axis.surge.quadratic_drag.value");
    assert_within("drag", found, drag, 0.02);
}
