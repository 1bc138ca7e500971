//! A complete identification from DataFlash logs.
//!
//! `tests/reference/twin_to_dataflash.py` writes the twin's trials as such logs, with the
//! interpreter in `SEAPLANT_PYTHON`; without it the test reports that it is skipped.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use crate::demo;
use crate::workshop::Workshop;

/// Makes a campaign of the demo's trials as DataFlash logs.
fn campaign() -> Option<Workshop> {
    let Some(python) = std::env::var_os("SEAPLANT_PYTHON") else {
        eprintln!("skipped: SEAPLANT_PYTHON is not set; scripts/check sets it");
        return None;
    };
    let workshop = Workshop::empty();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference/twin_to_dataflash.py");
    let mut command = Command::new(python);
    command.arg("-B").arg(script).arg(demo::folder()).arg(workshop.path());
    let run = command.output().expect("the interpreter runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    Some(workshop)
}

#[test]
fn logs_of_an_autopilot_give_the_estimates_that_tables_give() {
    let Some(workshop) = campaign() else { return };
    let found = workshop.json(&["identify", "campaign.toml", "--out", "out", "--json"]);
    let tables = std::fs::read(demo::results_file()).expect("the demo wrote its results");
    let tables: Value = serde_json::from_slice(&tables).expect("JSON");
    for part in ["plants", "methods", "steady"] {
        for (dof, plants) in tables[part].as_object().expect("one for each degree of freedom") {
            assert_same(&format!("{part}.{dof}"), &found[part][dof], plants);
        }
    }
}

/// Asserts equality to the last bit, except for caveats, which contain the readers' notes.
fn assert_same(name: &str, found: &Value, wanted: &Value) {
    match (found, wanted) {
        (Value::Object(found), Value::Object(wanted)) => {
            for (key, wanted) in wanted.iter().filter(|(key, _)| *key != "caveats") {
                assert_same(&format!("{name}.{key}"), &found[key], wanted);
            }
        }
        (Value::Array(found), Value::Array(wanted)) => {
            assert_eq!(found.len(), wanted.len(), "{name}");
            for (k, (found, wanted)) in found.iter().zip(wanted).enumerate() {
                assert_same(&format!("{name}[{k}]"), found, wanted);
            }
        }
        _ => assert_eq!(found, wanted, "{name}"),
    }
}
