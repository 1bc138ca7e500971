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

/// The bag of a manoeuvre is a log whose topics have the table's commands.
#[test]
fn commands_are_also_a_ros_bag() {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    let made = planned(&workshop, &[]);
    let first = made["plan"]["manoeuvres"][0]["manoeuvre"]["name"].as_str().expect("a name");
    let path = format!("plan/commands/01-{first}");
    let words = ["inspect", &format!("{path}.mcap"), "--json"];
    let seen: Value = serde_json::from_str(&workshop.success(&words)).expect("JSON");
    let channels = seen["channels"].as_array().expect("channels");
    let rows = workshop.read(&format!("{path}.csv")).lines().count() - 1;
    for name in ["port", "starboard"] {
        let topic = format!("/thrusters/{name}/command");
        let own = channels.iter().find(|one| one["column"].to_string().contains(&topic));
        let own = own.unwrap_or_else(|| panic!("no {topic} in {seen}"));
        assert_eq!(own["count"].as_u64(), Some(rows as u64), "{own}");
    }
}

#[test]
fn a_mission_a_controller_and_a_battery_are_options() {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    workshop.write("mission.csv", "time [s],surge [N]\n0,20\n40,0\n60,0\n");
    let words = ["--mission", "mission.csv", "--bandwidth", "0.1", "--battery", "60,150,15"];
    let made = planned(&workshop, &words);
    let goals = made["plan"]["goals"].as_array().expect("goals");
    let names: Vec<&str> = goals.iter().filter_map(|goal| goal["name"].as_str()).collect();
    assert_eq!(names, ["mission.surge", "margin.surge", "margin.yaw"]);
    assert!(made["plan"]["energy_wh"].as_f64().expect("a battery") < 60.0);
    workshop.write("mission.csv", "time [s],surge [N]\n0,20\n40,fast\n");
    let fails = |words: &[&str]| {
        workshop.failure(&[&["plan", "vehicle.toml", "--out", "other"], words].concat())
    };
    let message = fails(&words);
    assert!(
        message.contains("mission.csv") && message.contains("line 3, `surge [N]`"),
        "{message}"
    );
    let message = fails(&["--weight", "20"]);
    assert!(message.contains("--weight takes N in water and kg"), "{message}");
    let message = fails(&["--weight", "20,2.5"]);
    assert!(message.contains("nothing lifts it"), "{message}");
    let message = fails(&["--battery", "60,150"]);
    assert!(message.contains("--battery takes three numbers"), "{message}");
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
    for (words, expected) in [
        (["--minutes", "-3"], "minutes is -3"),
        (["--speed", "-0.5"], "speed_m_s is -0.5"),
        (["--box", "-6,6"], "box_m"),
        (["--battery", "-60,150,15"], "battery.energy_wh is -60"),
    ] {
        let message = fails(&words);
        assert!(message.contains(expected), "{message}");
    }
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

/// A dive that was driven as planned but for one manoeuvre, which its campaign lacks.
#[test]
fn a_dive_is_compared_with_its_plan() {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    let goals = ["--goal", "mass.surge=4%", "--goal", "drag.yaw=0.5%", "--rehearse", "dive"];
    let made = planned(&workshop, &goals);
    let campaign = workshop.read("dive/campaign.toml");
    let trials: Vec<&str> = campaign.split("[[trial]]").collect();
    let (left_out, kept) = (trials[1], [&trials[..1], &trials[2..]].concat());
    workshop.write("dive/less.toml", kept.join("[[trial]]"));
    let words = ["identify", "dive/less.toml", "--plan", "plan/plan.json", "--out", "results"];
    let said = workshop.success(&words);
    assert!(said.contains("plan plan/plan.json: "), "{said}");
    // The printed command keeps the limits of the plan, and runs.
    let next = said.lines().find_map(|line| line.split_once("plan the next dive: seaplant "));
    let next: Vec<&str> = next.expect("a goal is missed").1.split_whitespace().collect();
    assert!(
        next.starts_with(&[
            "plan",
            "results/results.json",
            "--request",
            "plan/plan.json",
            "--goal"
        ]),
        "{said}"
    );
    let again: Value =
        serde_json::from_str(&workshop.success(&[&next[..], &["--json"]].concat())).expect("JSON");
    assert_eq!(again["plan"]["request"]["limits"], made["plan"]["request"]["limits"]);
    let results: Value =
        serde_json::from_str(&workshop.read("results/results.json")).expect("JSON");
    let plan = &results["plan"];
    let manoeuvres = plan["manoeuvres"].as_array().expect("manoeuvres");
    assert_eq!(manoeuvres.len(), made["plan"]["manoeuvres"].as_array().expect("planned").len());
    for one in manoeuvres {
        let [driven, planned] = ["minutes_driven", "minutes_planned"].map(|key| one[key].as_f64());
        let name = one["name"].as_str().expect("a name");
        match left_out.contains(&format!("\"{name}\"")) {
            true => assert_eq!(driven, Some(0.0), "{one}"),
            false => assert!(driven > planned.map(|minutes| 0.9 * minutes), "{one}"),
        }
    }
    let goal = |k: usize| &plan["goals"][k];
    assert_eq!(
        (goal(0)["is_met"].as_bool(), goal(1)["is_met"].as_bool()),
        (Some(true), Some(false))
    );
    // The interval of mass is that of the fit.
    let mass = &results["plants"]["surge-yaw"]["parameters"]["mass.surge"];
    let half = goal(0)["obtained"].as_f64().expect("found");
    assert!((half - 1.96 * mass["std"].as_f64().expect("fitted")).abs() < 1e-3 * half);
    let open = plan["open"].to_string();
    assert!(
        open.contains("was not driven in a fitted trial") && open.contains("drag.yaw"),
        "{open}"
    );
    let report = workshop.read("results/report.html");
    assert!(report.contains("<h2>The plan of the dive</h2>") && report.contains("Still open"));
    let inputs = results["provenance"]["inputs"].to_string();
    assert!(inputs.contains("plan/plan.json"), "{inputs}");
}

#[test]
fn a_plan_that_is_none_or_of_another_vehicle_is_reported() {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", VEHICLE);
    let made = planned(&workshop, &["--rehearse", "dive"]);
    let identify = ["identify", "dive/campaign.toml", "--out", "results", "--plan"];
    let with = |file: &'static str| [&identify[..], &[file]].concat();
    workshop.write("none.json", "{\"schema\": \"seaplant/results/2\"}");
    let message = workshop.failure(&with("none.json"));
    assert!(message.contains("none.json: is not a plan"), "{message}");
    assert!(message.contains("name the plan.json that `seaplant plan` wrote"), "{message}");
    // A plan in heave, and a campaign of surge and yaw.
    let mut heave = made["plan"].clone();
    heave["manoeuvres"].as_array_mut().expect("manoeuvres").truncate(1);
    heave["manoeuvres"][0]["manoeuvre"]["axes"] = serde_json::json!(["heave"]);
    workshop.write("heave.json", heave.to_string());
    let message = workshop.failure(&with("heave.json"));
    assert!(message.contains("no trial of the campaign has force on any"), "{message}");
    // Another vehicle, and a goal that the fit lacks: told, not refused.
    let mut other = made["plan"].clone();
    other["vehicle"] = "barge".into();
    for goal in other["goals"].as_array_mut().expect("goals") {
        goal["name"] = "mass.heave".into();
    }
    workshop.write("other.json", other.to_string());
    let said = workshop.success(&with("other.json"));
    assert!(said.contains("the plan is of `barge`, the campaign of `pond ROV`"), "{said}");
    assert!(said.contains("none of the goals is among the numbers of the fit"), "{said}");
}
