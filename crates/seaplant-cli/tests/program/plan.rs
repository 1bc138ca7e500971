//! `seaplant plan`.

use serde_json::Value;

use crate::workshop::Workshop;

const VEHICLE: &str = r#"
name = "pond ROV"
dry_mass_kg = 18.0
size_m = [0.6, 0.4, 0.35]
thruster_curve = { kind = "quadratic", input = "command", forward = 35.0, reverse = 28.0 }
[[thruster]]
name = "port"
position_m = [0.0, -0.15, 0.0]
direction = [1, 0, 0]
[[thruster]]
name = "starboard"
position_m = [0.0, 0.15, 0.0]
direction = [1, 0, 0]
"#;

/// Few draws: a plan in a second.
const QUICK: [&str; 6] = ["--draws", "2", "--checks", "10", "--minutes", "6"];

fn planned(workshop: &Workshop, words: &[&str]) -> Value {
    let mut all = vec!["plan", "vehicle.toml", "--out", "plan", "--json"];
    all.extend(QUICK);
    all.extend(words);
    serde_json::from_str(&workshop.success(&all)).expect("JSON")
}

#[test]
fn a_vehicle_file_leads_to_a_plan_with_its_files() {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    let made = planned(&workshop, &["--goal", "mass.surge=4%", "--rehearse", "dive"]);
    let plan = &made["plan"];
    assert_eq!(plan["schema"], "seaplant/trial-plan/1");
    assert_eq!(plan["axes"], serde_json::json!(["surge", "yaw"]));
    let goal = &plan["goals"][0];
    assert!(goal["after"].as_f64() < goal["goal"].as_f64(), "{goal}");
    assert!(plan["certificate"]["gap"].as_f64().expect("a number") < 0.01);
    let written: Value = serde_json::from_str(&workshop.read("plan/plan.json")).expect("JSON");
    assert_eq!(written, *plan);
    assert!(workshop.read("plan/plan.html").contains("pond ROV"));
    assert!(workshop.read("plan/plan.lua").contains("SPLN_RUN"));
    assert!(workshop.read("plan/plan.svg").starts_with("<svg"));
    let first = plan["manoeuvres"][0]["manoeuvre"]["name"].as_str().expect("a name");
    let commands = workshop.read(&format!("plan/commands/01-{first}.csv"));
    assert!(commands.starts_with("time [s],port command [1],starboard command [1]\n"));
    assert!(workshop.read("dive/campaign.toml").contains("[[trial]]"));
}

#[test]
fn results_give_the_prior_of_the_next_plan() {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    planned(&workshop, &["--rehearse", "dive"]);
    workshop.success(&["identify", "dive/campaign.toml", "--out", "results", "--quiet"]);
    let mut words = vec!["plan", "results/results.json", "--out", "next", "--json"];
    words.extend(QUICK);
    let made: Value = serde_json::from_str(&workshop.success(&words)).expect("JSON");
    for goal in made["plan"]["goals"].as_array().expect("goals") {
        let (before, after) = (goal["before"].as_f64(), goal["after"].as_f64());
        assert!(before.is_some() && after < before, "{goal}");
    }
}

#[test]
fn impossible_plans_are_reported() {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    let fails = |words: &[&str]| {
        let mut all = vec!["plan", "vehicle.toml", "--out", "plan"];
        all.extend(words);
        workshop.failure(&all)
    };
    let message = fails(&["--goal", "mass.heave=5%"]);
    assert!(message.contains("the plant has no such coefficient; it has mass.surge"), "{message}");
    let message = fails(&["--box", "0.01,0.01"]);
    assert!(message.contains("box_m = [0.01, 0.01]"), "{message}");
    let message = fails(&["--goal", "mass.surge"]);
    assert!(message.contains("mass.surge=5%"), "{message}");
    let message = fails(&["--depth", "5"]);
    assert!(message.contains("--depth takes two numbers"), "{message}");
    workshop.write("vehicle.toml", VEHICLE.replace("size_m = [0.6, 0.4, 0.35]\n", ""));
    let message = fails(&[]);
    assert!(message.contains("states no size; give size_m"), "{message}");
}
