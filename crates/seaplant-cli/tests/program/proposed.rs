//! Campaigns that `init` proposes for the logs of vehicles, completed as a user would who knows the
//! trials, and identified: their results equal those of the tables.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::demo;
use crate::workshop::{Workshop, number};

/// Writes the demo's trials in another format, by a script of these tests; `None` without Python.
fn written_by(script: &str, more: &[&str]) -> Option<Workshop> {
    let Some(python) = std::env::var_os("SEAPLANT_PYTHON") else {
        eprintln!("skipped: SEAPLANT_PYTHON is not set; scripts/check sets it");
        return None;
    };
    let workshop = Workshop::empty();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(script);
    let mut command = Command::new(python);
    command.arg("-B").arg(script).arg(demo::folder()).arg(workshop.path()).args(more);
    let run = command.output().expect("the interpreter runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    Some(workshop)
}

/// Fit and hold-out trials of two degrees of freedom, for one fast method.
const TRIALS: [&str; 4] = ["heave-1", "heave-hold-out", "yaw-1", "yaw-hold-out"];
const METHOD: &str = "methods = [\"equation-error\"]\n";

/// Proposes a campaign for logs and sets the roles of its trials by their names.
fn init(workshop: &Workshop, extension: &str) {
    let logs = TRIALS.map(|trial| format!("{trial}.{extension}"));
    let mut words = vec!["init", "--force", "--quiet"];
    words.extend(logs.iter().map(String::as_str));
    workshop.seaplant(&words).assert().success();
    let proposed = workshop.read("campaign.toml");
    let open =
        |line: &&str| !["dof =", "role =", "# role ="].iter().any(|key| line.starts_with(key));
    let mut text = METHOD.to_owned();
    for line in proposed.lines().filter(open) {
        text += &format!("{line}\n");
        if let Some(name) = line.strip_prefix("name = \"") {
            let dof = name.split('-').next().expect("a name");
            let role = if name.contains("hold-out") { "hold-out" } else { "fit" };
            text += &format!("dof = [\"{dof}\"]\nrole = \"{role}\"\n");
        }
    }
    workshop.write("campaign.toml", text);
}

fn identify(workshop: &Workshop) -> Value {
    let found = workshop.json(&["identify", "campaign.toml", "--out", "out", "--json"]);
    assert_eq!(found["failures"], serde_json::json!([]));
    found
}

/// Returns the results of the same trials as tables, without the quantities that start with
/// `without`.
fn of_tables(without: &str) -> Value {
    let workshop = Workshop::empty();
    let demo = std::fs::read_to_string(demo::folder().join("campaign.toml")).expect("the demo's");
    let mut campaign: toml::Table = demo.parse().expect("TOML");
    let folder = demo::folder().display().to_string();
    campaign["vehicle"] = format!("{folder}/vehicle.toml").into();
    campaign.remove("bollard-pull");
    let trials = campaign["trial"].as_array_mut().expect("trials");
    trials.retain(|trial| {
        TRIALS.contains(&trial["name"].as_str().expect("named").replace(' ', "-").as_str())
    });
    for trial in trials {
        for log in trial["log"].as_array_mut().expect("several files") {
            *log = format!("{folder}/{}", log.as_str().expect("a path")).into();
        }
    }
    let channels = campaign["channels"].as_table_mut().expect("channels");
    channels.retain(|quantity, _| without.is_empty() || !quantity.starts_with(without));
    workshop.write("campaign.toml", format!("{METHOD}{campaign}"));
    identify(&workshop)
}

/// Asserts that every parameter of both fits is equal, to the rounding of sums in another order.
fn assert_same(found: &Value, expected: &Value) {
    const WITHIN: f64 = 1e-6;
    let mut compared = 0;
    for dof in ["heave", "yaw"] {
        let parameters = |of: &Value| of["methods"][dof]["equation-error"]["parameters"].clone();
        let (found, expected) = (parameters(found), parameters(expected));
        for (name, right) in expected.as_object().expect("by name") {
            let (value, right) = (number(&found[name], "value"), number(right, "value"));
            let apart = (value - right).abs();
            assert!(apart <= WITHIN * right.abs(), "{name} in {dof}: {value} for {right}");
            compared += 1;
        }
    }
    assert!(compared >= 6, "{compared} parameters");
}

#[test]
fn a_proposed_campaign_of_ros_bags_gives_the_estimates_of_the_tables() {
    let Some(workshop) = written_by("program/twin_as_mcap.py", &["1000000000000"]) else { return };
    let vehicle = workshop.read("vehicle.toml");
    init(&workshop, "mcap");
    workshop.write("vehicle.toml", vehicle);
    assert_same(&identify(&workshop), &of_tables(""));
}

#[test]
fn a_proposed_campaign_of_ardusub_gives_the_estimates_of_the_tables() {
    let Some(workshop) = written_by("reference/twin_to_ardusub.py", &[]) else { return };
    init(&workshop, "BIN");
    workshop.write("vehicle.toml", workshop.read("finished.toml"));
    assert_same(&identify(&workshop), &of_tables("dvl."));
}
