//! Methods for comparison: requested by name, or all together.

use seaplant::Method;
use serde_json::Value;

use crate::workshop::{SLED, Workshop, only_axis};

fn found(workshop: &Workshop, words: &[&str]) -> Value {
    workshop.success(words);
    serde_json::from_str(&workshop.read("out/results.json")).expect("JSON")
}

#[test]
fn all_selects_every_method_and_the_recommended_one_is_first() {
    let workshop = Workshop::new();
    let words = ["identify", "campaign.toml", "--method", "all", "--out", "out"];
    let found = found(&workshop, &words);
    assert_eq!(found["plants"]["surge"]["method"], Method::RECOMMENDED.name());
    let methods = found["methods"]["surge"].as_object().expect("an object");
    assert_eq!(methods.len(), Method::ALL.len());
    let (mass, drag) = SLED;
    let of = |name: &str| {
        let value = &only_axis(&methods["weighted-least-squares"])[name]["value"];
        value.as_f64().expect("a number")
    };
    assert!((of("mass") / mass - 1.0).abs() < 0.02, "{}", of("mass"));
    assert!((of("quadratic_drag") / drag - 1.0).abs() < 0.03, "{}", of("quadratic_drag"));
    let report = workshop.read("out/report.html");
    assert!(report.contains("Weighted least squares"), "it is not in the report");
}

#[test]
fn methods_to_compare_with_are_not_used_unasked() {
    let workshop = Workshop::new();
    let found = found(&workshop, &["identify", "campaign.toml", "--out", "out"]);
    let methods = found["methods"]["surge"].as_object().expect("an object");
    assert_eq!(methods.len(), Method::DEFAULT.len());
    assert!(!methods.contains_key("weighted-least-squares"));
}

#[test]
fn a_method_named_before_all_comes_first_and_once() {
    let workshop = Workshop::new();
    let first = "weighted-least-squares";
    let words = ["identify", "campaign.toml", "--method", first, "--method", "all", "--out", "out"];
    let found = found(&workshop, &words);
    assert_eq!(found["plants"]["surge"]["method"], first);
    let settings = found["provenance"]["settings"]["methods"].as_str().expect("text");
    assert_eq!(settings.split(", ").count(), Method::ALL.len());
    assert!(settings.starts_with("weighted-least-squares, "), "{settings}");
}

#[test]
fn an_unknown_method_is_refused_with_the_known_ones() {
    let workshop = Workshop::quick();
    workshop.change("campaign.toml", "\"equation-error\"", "\"sriv\"");
    let says = workshop.failure(&["identify", "campaign.toml"]);
    assert!(says.contains("sriv") && Method::ALL.iter().all(|m| says.contains(m.name())), "{says}");
}

#[test]
fn a_campaign_chooses_the_bootstrap_and_results_contain_its_seed() {
    let workshop = Workshop::quick();
    let words = ["identify", "campaign.toml", "--out", "out"];
    let batches = found(&workshop, &words);
    assert!(batches["provenance"]["seed"].is_null());
    let text = workshop.read("campaign.toml")
        + "\n[equation-error]\nintervals = \"block-bootstrap\"\nbootstrap = { resamples = 500, seed = 9 }\n";
    workshop.write("campaign.toml", text);
    let blocks = found(&workshop, &words);
    assert_eq!(blocks["provenance"]["seed"], 9);
    let settings = &blocks["provenance"]["settings"]["equation-error: intervals"];
    assert_eq!(settings, "500 resamples in blocks of 20 s, seed 9");
    let mass = |found: &Value| only_axis(&found["plants"]["surge"])["mass"].clone();
    let (batches, blocks) = (mass(&batches), mass(&blocks));
    let number = |mass: &Value, of: &str| mass[of].as_f64().expect("a number");
    let moved = number(&batches, "value") / number(&blocks, "value") - 1.0;
    assert!(moved.abs() < 1e-9, "the estimate itself moved by {moved}");
    assert_ne!(number(&batches, "std"), number(&blocks, "std"));
}

#[test]
fn too_few_resamples_are_refused_with_advice() {
    let workshop = Workshop::quick();
    let text = workshop.read("campaign.toml")
        + "\n[equation-error]\nintervals = \"block-bootstrap\"\nbootstrap = { resamples = 3 }\n";
    workshop.write("campaign.toml", text);
    let says = workshop.failure(&["identify", "campaign.toml"]);
    assert!(says.contains("resamples: is 3; it must be from 100 to 1000000"), "{says}");
}
