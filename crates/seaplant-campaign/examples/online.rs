//! Measures how soon methods that work sample by sample agree with filter error over complete logs:
//! `cargo run -p seaplant-campaign --example online -- campaign.toml …`.
//!
//! Prints the tables of docs/src/methods/online.md, in Markdown.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "the program prints; that is what it is for"
)]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use seaplant::Method;
use seaplant::results::{OnlineHistory, PlantResult, Results};
use seaplant_campaign::Campaign;

/// Relative tolerance of agreement.
const PART: f64 = 0.05;

const METHODS: [Method; 4] =
    [Method::FilterError, Method::Adaptive, Method::Recursive, Method::Ekf];

const ONLINE: [Method; 3] = [Method::Adaptive, Method::Recursive, Method::Ekf];

fn main() -> Result<(), Box<dyn Error>> {
    println!("| log | plant | parameter | filter error | adaptive | recursive | ekf |");
    println!("|---|---|---|--:|--:|--:|--:|");
    for path in std::env::args().skip(1) {
        let mut campaign = Campaign::open(Path::new(&path))?;
        campaign.options.methods = METHODS.to_vec();
        let found = campaign.identify("online").results;
        plants(&found);
        for failure in &found.failures {
            eprintln!("{path}: {} by {}: {}", failure.dof, failure.method, failure.message);
        }
    }
    Ok(())
}

/// Compares each plant with that of filter error, if it has histories.
fn plants(found: &Results) {
    for (name, methods) in &found.methods {
        let Some(batch) = methods.get(&Method::FilterError) else { continue };
        let batch = batch.parameters.iter().map(|(name, x)| (name.clone(), x.value)).collect();
        let histories = histories(methods);
        if !histories.is_empty() {
            rows(&found.vehicle, name, &batch, &histories);
        }
    }
}

fn histories(methods: &BTreeMap<Method, PlantResult>) -> BTreeMap<Method, &OnlineHistory> {
    methods.iter().filter_map(|(of, plant)| Some((*of, plant.history.as_ref()?))).collect()
}

/// Returns the last value of each method, and the time after which it stayed within 5 % of filter
/// error's.
fn rows(
    log: &str,
    plant: &str,
    batch: &BTreeMap<String, f64>,
    histories: &BTreeMap<Method, &OnlineHistory>,
) {
    for (name, truth) in batch {
        let cell = |method: &Method| {
            let told = histories.get(method).and_then(|history| {
                let (values, end_s) = (history.parameters.get(name)?, history.time_s.last()?);
                let is_off = |x: &f64| (x / truth - 1.0).abs() > PART;
                let from = values.iter().rposition(is_off).map_or(0, |at| at + 1);
                let last = number(*values.last()?);
                Some(match history.time_s.get(from) {
                    Some(s) => format!("{last} after {s:.0} s"),
                    None => format!("{last}, not in {end_s:.0} s"),
                })
            });
            format!(" {} |", told.unwrap_or_else(|| "none".to_owned()))
        };
        let cells: String = ONLINE.iter().map(cell).collect();
        println!("| {log} | {plant} | {name} | {} |{cells}", number(*truth));
    }
}

/// Formats a number with about four digits.
fn number(x: f64) -> String {
    let decimals = (3.0 - x.abs().max(1e-3).log10().floor()).clamp(0.0, 4.0) as usize;
    format!("{x:.decimals$}")
}
