//! Files that are no results of this version, and requests that results cannot satisfy.

use crate::demo;
use crate::workshop::Workshop;

/// Returns the error that `validate` and `simulate` both print for a results file.
fn both(workshop: &Workshop, results: &str) -> String {
    let simulated = workshop.failure(&["simulate", results, "log.csv"]);
    assert_eq!(workshop.failure(&["validate", results, "campaign.toml"]), simulated);
    simulated
}

#[test]
fn garbage_is_refused_with_its_place() {
    let workshop = Workshop::new();
    workshop.write("garbage.json", "garbage");
    let message = both(&workshop, "garbage.json");
    assert!(message.starts_with("garbage.json: line 1, column 1: "), "{message}");
    assert!(message.ends_with("; identify again, or correct the file there"), "{message}");
}

#[test]
fn results_of_another_schema_are_refused() {
    let workshop = Workshop::new();
    workshop.write("r.json", r#"{"schema": "seaplant/results/99"}"#);
    let message = both(&workshop, "r.json");
    assert!(
        message.starts_with("r.json: the results say schema `seaplant/results/99`"),
        "{message}"
    );
    assert!(message.contains("identify again with this version"), "{message}");
}

#[test]
fn json_of_something_else_is_refused() {
    let workshop = Workshop::new();
    workshop.write("truth.json", r#"{"surge": {"mass": 1}}"#);
    let message = both(&workshop, "truth.json");
    assert!(message.starts_with("truth.json: this is no results.json of Seaplant"), "{message}");
    assert!(message.ends_with("give the file that `seaplant identify` wrote"), "{message}");
}

#[test]
fn results_that_were_cut_off_are_refused() {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--out", "out", "--quiet"]);
    let whole = workshop.read("out/results.json");
    workshop.write("cut.json", &whole[..whole.len() / 2]);
    let message = both(&workshop, "cut.json");
    assert!(message.starts_with("cut.json: line "), "{message}");
}

#[test]
fn results_that_are_not_there_are_reported_with_their_path() {
    let message = both(&Workshop::new(), "none.json");
    assert!(message.starts_with("cannot read none.json: "), "{message}");
    assert!(message.ends_with("; give the results.json of a fit"), "{message}");
}

#[test]
fn a_published_table_has_no_campaign_to_read_a_log_by() {
    let message = Workshop::new().failure(&["simulate", "published:wam-v-vrx", "log.csv"]);
    assert!(message.starts_with("published:wam-v-vrx is a plant without a campaign"), "{message}");
    assert!(message.contains("`seaplant validate published:wam-v-vrx campaign.toml`"), "{message}");
}

#[test]
fn of_several_plants_one_must_be_chosen() {
    let workshop = Workshop::new();
    let results = demo::results_file();
    let results = results.to_str().expect("UTF-8");
    let several = workshop.failure(&["simulate", results, "log.csv"]);
    assert_eq!(several, "the results hold surge, sway, heave, yaw; choose one with --dof");
    let none = workshop.failure(&["simulate", results, "log.csv", "--dof", "roll"]);
    assert_eq!(none, "the results hold no roll plant, but surge, sway, heave, yaw");
}

#[test]
fn a_method_that_the_results_lack_is_named() {
    let workshop = Workshop::new();
    workshop.success(&["identify", "campaign.toml", "--method", "paper", "--out", "out", "-q"]);
    let words = ["validate", "out/results.json", "campaign.toml", "--method", "equation-error"];
    assert_eq!(workshop.failure(&words), "the results hold no surge plant by equation-error");
}

#[test]
fn a_campaign_of_other_axes_has_nothing_to_validate() {
    let workshop = Workshop::quick();
    workshop.success(&["identify", "campaign.toml", "--out", "out", "-q"]);
    let steady =
        workshop.read("campaign.toml").replace("[\"surge\"]", "[\"surge\"]\nrole = \"steady\"");
    workshop.write("steady.toml", steady);
    assert_eq!(
        workshop.failure(&["validate", "out/results.json", "steady.toml"]),
        "no trial of steady.toml exercises a degree of freedom that out/results.json holds"
    );
}
