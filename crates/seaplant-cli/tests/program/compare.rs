//! Comparisons of fits.

use predicates::prelude::*;

use crate::workshop::{Workshop, assert_within, log, number};

/// Makes the sled, and the sled on another day.
fn two_days() -> Workshop {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--out", "first", "--quiet"]);
    let gentle = |t: f64| 100.0 * (0.43 * t + 0.4).sin() + 70.0 * (0.21 * t).sin();
    workshop.write("log.csv", log(gentle));
    workshop.success(&["identify", "campaign.toml", "--out", "second", "--quiet"]);
    workshop
}

#[test]
fn each_test_is_the_difference_over_its_uncertainty() {
    let workshop = two_days();
    let found = workshop.json(&["compare", "first", "second/results.json", "--json"]);
    let results = ["first", "second"].map(|folder| {
        let text = workshop.read(&format!("{folder}/results.json"));
        serde_json::from_str::<serde_json::Value>(&text).expect("JSON")
    });
    for name in ["mass", "quadratic_drag", "bias_force"] {
        let parameter = |k: usize, of: &str| {
            number(&results[k], &format!("plants.surge.by_axis.surge.{name}.{of}"))
        };
        let difference = parameter(0, "value") - parameter(1, "value");
        let variance = parameter(0, "std").powi(2) + parameter(1, "std").powi(2);
        let q = number(&found, &format!("dofs.surge.parameters.{name}.test.q"));
        assert_within(name, q, difference * difference / variance, 1e-9);
    }
    assert_eq!(found["dofs"]["surge"]["test"]["degrees"], 3);
    assert_eq!(found["caveats"].as_array().map(Vec::len), Some(0));
}

#[test]
fn the_verdict_states_whether_the_plants_differ() {
    let workshop = two_days();
    let words = workshop.success(&["compare", "first", "second"]);
    assert!(words.starts_with("[1] first/results.json\n[2] second/results.json\n"), "{words}");
    assert!(words.contains("surge: the plants "), "{words}");
    let rows = ["  mass ", "  quadratic drag ", "  bias force "];
    let places: Vec<usize> = rows.iter().filter_map(|row| words.find(row)).collect();
    assert!(places.len() == 3 && places.is_sorted(), "{words}");
}

#[test]
fn fits_of_the_same_log_are_no_independent_ones() {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--quiet"]);
    let words = workshop.success(&["compare", "results", "results"]);
    assert!(words.contains("one log is used by more than one of the fits"), "{words}");
    assert!(words.contains("p = 1"), "{words}");
}

#[test]
fn a_method_that_no_two_fits_have_is_refused() {
    let workshop = two_days();
    let message =
        workshop.failure(&["compare", "first", "second", "--method", "weighted-least-squares"]);
    assert_eq!(
        message,
        "no degree of freedom has a plant by weighted-least-squares in two of the results"
    );
}

#[test]
fn one_fit_is_misuse() {
    let says = predicate::str::contains("2 values required");
    Workshop::empty().seaplant(&["compare", "one"]).assert().code(2).stderr(says);
}

#[test]
fn a_fit_is_compared_with_a_published_table() {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--quiet"]);
    let words = workshop.success(&["compare", "results", "published:wam-v-vrx"]);
    assert!(words.contains("[2] published:wam-v-vrx") && words.contains("surge: "), "{words}");
    let found = workshop.json(&["compare", "results", "published:wam-v-vrx", "--json"]);
    let drag = &found["dofs"]["surge"]["parameters"]["quadratic_drag"];
    assert!(drag["estimates"][0]["std"].is_number() && drag["estimates"][1]["std"].is_null());
    // A number without an uncertainty is listed, but not tested.
    assert!(drag["estimates"][1]["value"].is_number() && drag["test"].is_null(), "{drag}");
    let refused = workshop.failure(&["compare", "results", "published:wam"]);
    assert!(refused.contains("did you mean `wam-v-vrx`"), "{refused}");
}

#[test]
fn published_plants_of_several_axes_are_compared_with_their_couplings() {
    let workshop = Workshop::empty();
    let both = ["published:remus-100-prestero-2001", "published:otter-mss"];
    let found = workshop.json(&["compare", both[0], both[1], "--json"]);
    let coupling = &found["coefficients"]["mass.sway-yaw"]["estimates"];
    assert_eq!(coupling[0]["value"], -1.93, "{found}");
    let words = workshop.success(&["compare", both[0], both[1]]);
    assert!(words.contains("further coefficients") && words.contains("mass.sway-yaw"), "{words}");
    let refused = workshop.failure(&["compare", "otter-mss", both[0]]);
    assert!(refused.contains("did you mean `published:otter-mss`"), "{refused}");
}

/// Makes and identifies two dives of a vehicle; `aft port` gives less in the second.
fn two_dives_of_eight_thrusters() -> Workshop {
    let workshop = Workshop::empty();
    for (name, seed, gains) in [("may", 1, ""), ("june", 2, "\"aft port\" = 0.75")] {
        let spec = format!(
            "vehicle = \"published:bluerov2-heavy-von-benzon-2022\"\naxes = [\"surge\", \"sway\", \"yaw\"]\nseed = {seed}\nduration_s = 100.0\nhold_out_s = 60.0\nthruster_gains = {{ {gains} }}\n"
        );
        workshop.write(&format!("{name}.toml"), spec);
        let folder = format!("dive-{name}");
        workshop.success(&["twin", &format!("{name}.toml"), "--out", &folder, "-q"]);
        let campaign = format!("{folder}/campaign.toml");
        workshop.success(&["identify", &campaign, "--out", name, "-q"]);
    }
    workshop
}

#[test]
fn a_thruster_that_gives_less_is_named_by_dive_and_cause() {
    let workshop = two_dives_of_eight_thrusters();
    let found = workshop.json(&["compare", "may", "june", "--json"]);
    let thrusters = found["thrusters"].as_object().expect("histories");
    for (name, own) in thrusters {
        let changes = own["changes"].as_array().expect("a list");
        if name != "aft port" {
            assert!(changes.is_empty(), "{name}: {own}");
            continue;
        }
        assert_eq!((&changes[0]["cause"], &changes[0]["from"]), (&"loss".into(), &1.into()));
        assert_within("gain", number(&own["gains"][1], "value"), 0.75, 0.04);
        assert!(own["test"]["differs"].as_bool().expect("tested"));
    }
    let words = workshop.success(&["compare", "may", "june", "--out", "life.html"]);
    assert!(words.contains("thruster: thruster `aft port` gives 0.7"), "{words}");
    let page = workshop.read("life.html");
    assert!(page.contains("aft port") && page.contains("<svg"));
    // A page of one vehicle is not one of two, nor of thrusters that are called otherwise.
    let june = workshop.read("june/results.json");
    workshop.write("june/results.json", june.replace("\"aft port\"", "\"stern port\""));
    let refused = workshop.failure(&["compare", "may", "june", "--out", "other.html"]);
    assert!(refused.contains("only [1] has `aft port`, only [2] has `stern port`"), "{refused}");
    workshop.write("june/results.json", june.replace("BlueROV2 Heavy", "BlueROV3 Heavy"));
    let refused = workshop.failure(&["compare", "may", "june", "--out", "other.html"]);
    assert!(refused.contains("different vehicles: BlueROV2 Heavy"), "{refused}");
}
