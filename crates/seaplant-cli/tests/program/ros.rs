//! The twin's campaign in the form that ROS 2 records.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::demo;
use crate::workshop::{Workshop, number};

/// Tolerance of estimates.
#[derive(Clone, Copy, Debug)]
struct Within {
    /// For the paper's method, relative to the value.
    paper: f64,
    /// For filter error, relative to the standard deviation.
    filter_error: f64,
    /// For other methods, relative to the value or to the standard deviation, whichever is more.
    others: f64,
}

#[test]
fn an_mcap_recording_gives_the_estimates_of_the_tables() {
    // A clock that started with the vehicle, some time before: sums in another order. Filter error takes slopes from
    // differences of costs, and its last step is below a hundredth of the standard deviation.
    compare("1000000000000", Within { paper: 1e-9, filter_error: 1e-3, others: 1e-9 });
}

#[test]
fn stamps_since_1970_move_estimates_by_no_more_than_their_rounding() {
    // Rounding to a quarter of a microsecond decides which sample of thrust the paper's method
    // pairs with a velocity.
    compare("1700000000000000000", Within { paper: 5e-3, filter_error: 1e-2, others: 1e-4 });
}

fn compare(start_ns: &str, within: Within) {
    let Some(python) = std::env::var_os("SEAPLANT_PYTHON") else {
        eprintln!("skipped: SEAPLANT_PYTHON is not set; scripts/check sets it");
        return;
    };
    let workshop = Workshop::empty();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/program/twin_as_mcap.py");
    let run = Command::new(python)
        .arg("-B")
        .arg(script)
        .args([&demo::folder(), workshop.path()])
        .arg(start_ns)
        .output()
        .expect("Python runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let found = workshop.json(&["identify", "campaign.toml", "--out", "out", "--json"]);
    assert_eq!(found["failures"], serde_json::json!([]));
    let expected = demo::results();
    let mut compared = 0;
    for (dof, methods) in expected["methods"].as_object().expect("by degree of freedom") {
        for (method, plant) in methods.as_object().expect("by method") {
            let parameters = plant["parameters"].as_object().expect("by name");
            for (name, parameter) in parameters {
                let same = &found["methods"][dof][method]["parameters"][name];
                let value = number(parameter, "value").abs();
                let std = parameter["std"].as_f64().unwrap_or(0.0);
                let most = match method.as_str() {
                    "paper" => within.paper * value,
                    "filter-error" => within.filter_error * std,
                    _ => within.others * value.max(std),
                };
                assert_same(&format!("{name} in {dof} by {method}"), same, parameter, most);
                compared += 1;
            }
        }
    }
    assert!(compared > 40, "{compared} parameters");
}

fn assert_same(name: &str, found: &Value, expected: &Value, most: f64) {
    let (found, right) = (number(found, "value"), number(expected, "value"));
    assert!((found - right).abs() <= most, "{name}: {found} for {right}");
}
