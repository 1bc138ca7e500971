//! How soon methods that work sample by sample agree with filter error over whole logs:
//! `cargo run -p seaplant-campaign --example online -- campaign.toml …`.
//!
//! The tables of docs/src/methods/online.md, in Markdown.
#![allow(clippy::print_stdout, reason = "the program prints; that is what it is for")]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use seaplant::Method;
use seaplant::results::{OnlineHistory, Results};
use seaplant_campaign::Campaign;

/// Parameters agree within this part.
const PART: f64 = 0.05;

const METHODS: [Method; 4] =
    [Method::FilterError, Method::Adaptive, Method::Recursive, Method::Ekf];

fn main() -> Result<(), Box<dyn Error>> {
    for path in std::env::args().skip(1) {
        let mut campaign = Campaign::open(Path::new(&path))?;
        campaign.options.methods = METHODS.to_vec();
        let found = campaign.identify("online").results;
        println!("\n{}:\n", found.vehicle);
        println!(
            "| plant | parameter | filter error | method | last | within 5 % after, s | of, s |"
        );
        println!("|---|---|--:|---|--:|--:|--:|");
        for (dof, methods) in &found.methods {
            let Some(batch) = methods.get(&Method::FilterError) else { continue };
            let p = &batch.parameters;
            let batch: BTreeMap<String, f64> = [
                ("mass", Some(&p.mass)),
                ("quadratic_drag", p.quadratic_drag.as_ref()),
                ("linear_drag", p.linear_drag.as_ref()),
            ]
            .into_iter()
            .filter_map(|(name, x)| Some((name.to_owned(), x?.value)))
            .collect();
            for (method, plant) in methods {
                if let Some(history) = &plant.history {
                    rows(dof.name(), *method, &batch, history);
                }
            }
        }
        coupled(&found);
    }
    Ok(())
}

fn coupled(found: &Results) {
    for (name, methods) in &found.coupled_online {
        let batch = &found.coupled[name].parameters;
        let batch = batch.iter().map(|(name, x)| (name.clone(), x.value)).collect();
        for (method, plant) in methods {
            rows(name, *method, &batch, &plant.history);
        }
    }
}

fn rows(plant: &str, method: Method, batch: &BTreeMap<String, f64>, history: &OnlineHistory) {
    let end_s = history.time_s.last().copied().unwrap_or(0.0);
    for (name, truth) in batch {
        let Some(values) = history.parameters.get(name) else { continue };
        let is_off = |x: &f64| (x / truth - 1.0).abs() > PART;
        let from = values.iter().rposition(is_off).map_or(0, |at| at + 1);
        let after = history.time_s.get(from).map_or("not".to_owned(), |s| format!("{s:.0}"));
        let last = values.last().copied().unwrap_or(f64::NAN);
        println!("| {plant} | {name} | {truth:.4} | {method} | {last:.4} | {after} | {end_s:.0} |");
    }
}
