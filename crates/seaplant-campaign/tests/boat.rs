//! A boat that logs position and heading, by a simulator of its own (`examples/boat/simulate.py`).

use std::path::{Path, PathBuf};

use seaplant::results::{PlantResult, Results};
use seaplant::{Dof, likely_mistakes};
use seaplant_campaign::Campaign;

use crate::common::Folder;

/// Targets: within this fraction of the truth, or within the 95 % interval.
const PART: f64 = 0.05;

/// True values in `simulate.py`.
const TRUTH: [(&str, f64); 6] = [
    ("mass.surge", 85.3),
    ("mass.sway", 162.5),
    ("mass.sway-yaw", 11.0),
    ("mass.yaw", 40.5),
    ("surge: u", 60.0),
    ("surge: |u|u", 12.0),
];

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/boat")
}

fn identified() -> Results {
    let path = example().join("campaign.toml");
    let campaign = Campaign::open(&path).expect("the example");
    campaign.identify("seaplant identify").results
}

fn plant_of(results: &Results) -> &PlantResult {
    assert!(results.failures.is_empty(), "{:?}", results.failures);
    &results.plants["surge-sway-yaw"]
}

#[test]
fn masses_come_out_of_fixes_and_heading_with_an_antenna_off_the_centre() {
    let results = identified();
    let plant = plant_of(&results);
    for (name, truth) in TRUTH {
        let x = &plant.parameters[name];
        let is_in = (x.low95..=x.high95).contains(&truth);
        let off = (x.value / truth - 1.0).abs();
        assert!(is_in || off < PART, "{name}: {x:?}, not {truth}");
    }
    // The moment of inertia is determined, not merely within a wide interval.
    let yaw = &plant.parameters["mass.yaw"];
    assert!((yaw.value / 40.5 - 1.0).abs() < PART && yaw.std < 0.08 * yaw.value, "{yaw:?}");
    let held = plant.hold_out.as_ref().expect("a trial aside");
    for (dof, least) in [(Dof::Surge, 0.95), (Dof::Sway, 0.6), (Dof::Yaw, 0.95)] {
        let score = &held.by_axis[&dof];
        assert!(score.r_squared.is_some_and(|r2| r2 > least), "{dof}: {score:?}");
    }
    let told: Vec<&str> = plant.caveats.iter().map(|caveat| caveat.message.as_str()).collect();
    assert!(told.iter().any(|text| text.contains("estimates it from position")), "{told:?}");
}

/// Returns the mistakes that are named if the example's campaign file is changed.
fn mistakes_with(change: impl Fn(&str) -> String) -> Vec<String> {
    let folder = Folder::new();
    let Campaign { vehicle, trials, .. } = changed(&folder, change);
    likely_mistakes(&vehicle, &trials).into_iter().map(|mistake| mistake.message).collect()
}

/// Opens the example with a change of its campaign file.
fn changed(folder: &Folder, change: impl Fn(&str) -> String) -> Campaign {
    let read = |name: &str| std::fs::read_to_string(example().join(name)).expect("the example");
    for name in ["vehicle.toml", "fit-1.csv", "fit-2.csv", "aside.csv"] {
        folder.write(name, &read(name));
    }
    let path = folder.write("campaign.toml", &change(&read("campaign.toml")));
    Campaign::open(&path).expect("a campaign")
}

/// Has the heading, in deg, read as rad.
fn heading_as_rad(campaign: &str) -> String {
    campaign.replace("\"heading [deg]\"", "\"heading [deg]\", unit = \"rad\"")
}

#[test]
fn a_correct_campaign_has_no_likely_mistake() {
    assert_eq!(mistakes_with(str::to_owned), [""; 0]);
}

#[test]
fn a_heading_in_deg_that_is_read_as_rad_is_named() {
    let named = mistakes_with(heading_as_rad);
    let is_named = |text: &String| text.contains("attitude.heading looks in deg and read as rad");
    assert!(named.len() == 1 && named.iter().all(is_named), "{named:?}");
}

#[test]
fn a_fit_that_fails_is_told_what_no_vehicle_does() {
    let folder = Folder::new();
    let too_short =
        |campaign: &str| heading_as_rad(campaign).replace(".csv\"\n\n", ".csv\"\nto_s = 6\n\n");
    let results = changed(&folder, too_short).identify("seaplant identify").results;
    let told: Vec<&str> = results.failures.iter().map(|one| one.message.as_str()).collect();
    let is_told = |text: &&str| {
        text.contains("needs at least 30") && text.contains("359.8400 rad, which no vehicle does")
    };
    assert!(!told.is_empty() && told.iter().all(is_told), "{told:?}");
}

#[test]
fn exchanged_propellers_are_named_although_yaw_follows_its_moment_at_once() {
    let exchanged = ["port", "starboard", "?"].map(|side| format!("\"{side} propeller [rpm]\""));
    let [port, starboard, other] = exchanged.each_ref().map(String::as_str);
    let named = mistakes_with(|campaign| {
        campaign.replace(port, other).replace(starboard, port).replace(other, starboard)
    });
    let is_named =
        |text: &String| text.contains("`port propeller` and `starboard propeller` look exchanged");
    assert!(named.len() == 1 && named.iter().all(is_named), "{named:?}");
}
