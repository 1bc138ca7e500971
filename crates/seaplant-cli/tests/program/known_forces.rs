//! Weights of known size: what they say of thrust reaches whatever is made of the results.

use serde_json::Value;

use crate::workshop::{Workshop, assert_within, number};

/// Thrust over what the vehicle file says.
const SCALE: f64 = 1.2;

/// Mass, kg, and drag, N/(m/s) and N/(m/s)².
const PLANT: [f64; 3] = [30.0, 8.0, 40.0];

/// Weight in water, N, and mass, kg, of what is hung on, and when, s.
const WEIGHT: [f64; 2] = [15.0, 1.7];
const HUNG: [[f64; 2]; 2] = [[60.0, 120.0], [180.0, 240.0]];

/// Where an exported plant is.
const EXPORTED: &str = "out/plant.json";

/// N/(rad/s)² as the vehicle file has it.
const CURVE: f64 = 0.0016;

const VEHICLE: &str = r#"name = "diver"
[[thruster]]
name = "up"
position_m = [0.0, 0.0, 0.0]
direction = [0.0, 0.0, 1.0]
curve = { kind = "quadratic", forward = 0.0016, reverse = 0.0016 }
"#;

/// Simulates 300 s at 10 Hz; `input` writes what is logged of thrust, N.
fn log(column: &str, phase: f64, input: impl Fn(f64) -> f64) -> String {
    const FINE: usize = 50;
    let mut text = format!("time [s],{column},w [m/s]\n");
    let [mass, linear, quadratic] = PLANT;
    let (mut w, mut seed) = (0.0_f64, 7_u64);
    for k in 0..3000_u32 {
        let t = 0.1 * f64::from(k);
        let thrust = 15.0 * (0.5 * t + phase).sin() + 12.0 * (0.17 * t + 2.0 * phase).sin();
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let jitter = 0.01 * ((seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5);
        text += &format!("{t:.1},{:.5},{:.6}\n", input(thrust), w + jitter);
        let hangs = HUNG.iter().any(|[from, to]| (*from..*to).contains(&(t + 1e-9)));
        let [weight, weight_kg] = if hangs { WEIGHT } else { [0.0; 2] };
        for _ in 0..FINE {
            let drag = linear * w + quadratic * w * w.abs();
            w += (SCALE * thrust + weight - 2.0 - drag) / (mass + weight_kg) * 0.1 / FINE as f64;
        }
    }
    text
}

/// A campaign with the same weight in a trial to fit and one held out.
fn campaign(column: &str) -> String {
    let known: String = HUNG
        .iter()
        .map(|[from, to]| {
            let [weight, mass] = WEIGHT;
            format!(
                "[[trial.known]]\nkind = \"weight\"\nweight_n = {weight}\nmass_kg = {mass}\nfrom_s = {from}\nto_s = {to}\n"
            )
        })
        .collect();
    format!(
        "vehicle = \"vehicle.toml\"\n[[plant]]\naxes = [\"heave\"]\n[[trial]]\nname = \"one\"\nlog = \"one.csv\"\n{known}[[trial]]\nname = \"two\"\nlog = \"two.csv\"\nrole = \"hold-out\"\n{known}[channels]\n{column}\n\"velocity.heave\" = {{ column = \"w\" }}\n"
    )
}

fn hovered(column: &str, channel: &str, vehicle: &str, input: fn(f64) -> f64) -> Workshop {
    let workshop = Workshop::empty();
    workshop.write("vehicle.toml", vehicle);
    workshop.write("campaign.toml", campaign(channel));
    workshop.write("one.csv", log(column, 0.0, input));
    workshop.write("two.csv", log(column, 1.0, input));
    workshop.success(&["identify", "campaign.toml", "--out", "results", "-q"]);
    workshop
}

fn rpm(thrust: f64) -> f64 {
    (thrust.abs() / CURVE).sqrt().copysign(thrust) * 30.0 / std::f64::consts::PI
}

/// With the speed of a thruster.
fn diver() -> Workshop {
    hovered("up [rpm]", "\"thruster.up.speed\" = { column = \"up\" }", VEHICLE, rpm)
}

/// With the force that somebody computed.
fn diver_of_wrench() -> Workshop {
    let channel = "\"wrench.heave\" = { column = \"force\" }";
    hovered("force [N]", channel, "name = \"diver\"\n", |thrust| thrust)
}

fn export(workshop: &Workshop) {
    workshop.success(&["export", "results", "--to", "json", "--out", "out", "-q"]);
}

/// The error of a plant on the trial that was held out.
fn error_of(workshop: &Workshop, plant: &str) -> f64 {
    let found = workshop.json(&["validate", plant, "campaign.toml", "--json"]);
    let of = found.as_array().expect("a list").iter();
    let mut two = of.filter_map(|own| own["score"]["by_trial"].get("two"));
    number(two.next().expect("it was held out"), "heave.mean_abs_error")
}

#[test]
fn an_exported_plant_has_the_thrust_that_a_weight_revealed() {
    let workshop = diver();
    let results: Value =
        serde_json::from_str(&workshop.read("results/results.json")).expect("JSON");
    let plant = &results["plants"]["heave"];
    assert_within("scale", number(plant, "nuisances.thrust_scale.value"), SCALE, 0.02);
    export(&workshop);
    let exported: Value = serde_json::from_str(&workshop.read(EXPORTED)).expect("JSON");
    let scale = number(plant, "nuisances.thrust_scale.value");
    let forward = number(&exported["thruster"][0], "curve.forward");
    assert!((forward / (scale * CURVE) - 1.0).abs() < 1e-9, "{forward}");
    assert_eq!(number(&exported, "actuation.heave.thrust_scale.value"), scale);
    let (fit, file) = (error_of(&workshop, "results"), error_of(&workshop, EXPORTED));
    assert!((file / fit - 1.0).abs() < 0.02, "{fit} {file}");
    // With the exported curve in the vehicle file, thrust is not scaled a second time.
    workshop.change("vehicle.toml", "0.0016", &forward.to_string());
    let adopted = error_of(&workshop, EXPORTED);
    assert!((adopted / file - 1.0).abs() < 1e-6, "{file} {adopted}");
}

#[test]
fn an_exported_plant_scales_a_logged_wrench_as_where_it_was_fitted() {
    let workshop = diver_of_wrench();
    export(&workshop);
    let (fit, file) = (error_of(&workshop, "results"), error_of(&workshop, EXPORTED));
    assert!((file / fit - 1.0).abs() < 0.02, "{fit} {file}");
}

#[test]
fn a_simulation_pushes_as_the_trial_did() {
    let workshop = diver();
    export(&workshop);
    // Thrust of 20 N by the vehicle file is 24 N, and the vehicle is 2 N too light.
    let turns = rpm(20.0) * std::f64::consts::PI / 30.0;
    workshop.write("up.toml", format!("duration_s = 60.0\n[[hold]]\nthruster.up = {turns}\n"));
    let [_, linear, quadratic] = PLANT;
    let force = SCALE * 20.0 - 2.0;
    let top = ((linear * linear + 4.0 * quadratic * force).sqrt() - linear) / (2.0 * quadratic);
    for plant in [EXPORTED, "results"] {
        let found = workshop.json(&["simulate", plant, "up.toml", "--json"]);
        let rows = found["velocity"].as_array().expect("rows");
        let last = rows.last().expect("rows")[2].as_f64().expect("a number");
        assert_within(plant, last, top, 0.02);
    }
}

#[test]
fn weights_that_contradict_each_other_are_named_with_the_scale_by_each() {
    let workshop = diver();
    let second =
        |weight_n, mass_kg| format!("weight_n = {weight_n}\nmass_kg = {mass_kg}\nfrom_s = 180");
    workshop.change("campaign.toml", &second("15", "1.7"), &second("19.5", "2.1"));
    let words = workshop.success(&["identify", "campaign.toml", "--out", "results"]);
    let named = "severe: known forces contradict each other: thrust is 1.20";
    assert!(words.contains(named), "{words}");
    assert!(words.contains("by a weight of 15.0 N, and 1.5"), "{words}");
    assert!(words.contains("by a weight of 19.5 N"), "{words}");
}
