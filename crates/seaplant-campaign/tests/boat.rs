//! A boat that logs position and heading, by a simulator of its own (`examples/boat/simulate.py`).

use std::path::Path;

use seaplant::Dof;
use seaplant::results::{PlantResult, Results};
use seaplant_campaign::Campaign;

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

fn identified() -> Results {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/boat/campaign.toml");
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
