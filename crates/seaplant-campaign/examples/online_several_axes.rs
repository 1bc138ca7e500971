//! Measures the errors in six axes of methods that work sample by sample, over seeds and seas:
//! `cargo run -p seaplant-campaign --example online_several_axes -- DIVE/campaign.toml …`.
//!
//! Each campaign is one of `seaplant twin`, with its truth.json; the folder is called SEA-SEED.
//! Prints the table of docs/src/methods/online.md, in Markdown.
#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "the program prints; that is what it is for"
)]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use seaplant::results::{OnlineHistory, PlantResult, Results};
use seaplant::{Caveat, Dof, Method, Severity};
use seaplant_campaign::Campaign;
use serde_json::Value;

/// Relative tolerance of agreement.
const PART: f64 = 0.05;

const METHODS: [Method; 4] =
    [Method::FilterError, Method::Adaptive, Method::Recursive, Method::Ekf];

/// Axes that the twin drives at will; roll and pitch follow from these, and hardly reveal their
/// damping.
const DRIVEN: [Dof; 4] = [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw];

/// Result of one method in one campaign.
struct Found {
    /// Largest relative error of mass and of drag over the driven axes.
    off: [f64; 2],
    /// Time after which all of them stayed within 5 % of filter error, s.
    within_s: Option<f64>,
    /// True if a caveat says that the numbers may be wrong.
    is_warned: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut table: BTreeMap<(String, Method), Vec<Found>> = BTreeMap::new();
    for path in std::env::args().skip(1) {
        let path = Path::new(&path);
        let folder = path.parent().ok_or("a campaign has a folder")?;
        let name = folder.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        let sea = name.rsplit_once('-').map_or(name, |(sea, _)| sea);
        let truth: Value = serde_json::from_slice(&std::fs::read(folder.join("truth.json"))?)?;
        let mut campaign = Campaign::open(path)?;
        campaign.options.methods = METHODS.to_vec();
        let results = campaign.identify("online_several_axes").results;
        for (method, found) in judged(&results, &truth["vehicle"]["coefficients"]) {
            eprintln!("{name} {method}: {:?}, {:?} s", found.off, found.within_s);
            table.entry((sea.to_owned(), method)).or_default().push(found);
        }
    }
    println!(
        "| sea | method | mass, median and worst | drag, median and worst | within 5 % | warned |"
    );
    println!("|---|---|--:|--:|--:|--:|");
    for ((sea, method), found) in &table {
        println!("| {sea} | {method} | {}", cells(found));
    }
    Ok(())
}

/// Returns the result of each method in one campaign.
fn judged(results: &Results, truth: &Value) -> Vec<(Method, Found)> {
    let mut all = Vec::new();
    for (name, batch) in results.together() {
        let last = |parameter: &str| batch.parameters.get(parameter).map(|x| x.value);
        let off = off(batch, truth, &last);
        all.push((
            Method::FilterError,
            Found { off, within_s: None, is_warned: warned(&batch.caveats) },
        ));
        for (method, online) in results.methods.get(name).into_iter().flatten() {
            let Some(history) = &online.history else { continue };
            let last = |parameter: &str| history.parameters.get(parameter)?.last().copied();
            all.push((
                *method,
                Found {
                    off: self::off(batch, truth, &last),
                    within_s: within_s(batch, history),
                    is_warned: warned(&online.caveats),
                },
            ));
        }
    }
    all
}

fn warned(caveats: &[Caveat]) -> bool {
    caveats.iter().any(|caveat| caveat.severity >= Severity::Warning)
}

/// Returns an axis' mass, and its drag at the mean speed of the trials.
fn of_axis(batch: &PlantResult, dof: Dof, value: &dyn Fn(&str) -> Option<f64>) -> Option<[f64; 2]> {
    let v = batch.fit.by_axis.get(&dof)?.null_error;
    let letter = ["u", "v", "w", "p", "q", "r"][dof.index()];
    let drag = |name: String, weight: f64| Some(weight * value(&name)?);
    let linear = drag(format!("{dof}: {letter}"), v).unwrap_or(0.0);
    let quadratic = drag(format!("{dof}: |{letter}|{letter}"), v * v).unwrap_or(0.0);
    Some([value(&format!("mass.{dof}"))?, linear + quadratic])
}

/// Returns the largest relative errors of mass and drag over the driven axes.
fn off(batch: &PlantResult, truth: &Value, found: &dyn Fn(&str) -> Option<f64>) -> [f64; 2] {
    let truly = |name: &str| truth[name].as_f64();
    let parts = DRIVEN.iter().filter_map(|dof| {
        let (found, truth) = (of_axis(batch, *dof, found)?, of_axis(batch, *dof, &truly)?);
        Some([0, 1].map(|k| (found[k] / truth[k] - 1.0).abs()))
    });
    parts.fold([0.0; 2], |[a, b], [c, d]| [f64::max(a, c), f64::max(b, d)])
}

/// Returns the time after which mass and drag of every driven axis stayed within 5 % of filter
/// error, s.
fn within_s(batch: &PlantResult, history: &OnlineHistory) -> Option<f64> {
    let is_off = |k: usize| {
        DRIVEN.iter().any(|dof| {
            let now = |name: &str| history.parameters.get(name)?.get(k).copied();
            let last = |name: &str| batch.parameters.get(name).map(|x| x.value);
            let pair = of_axis(batch, *dof, &now).zip(of_axis(batch, *dof, &last));
            pair.is_some_and(|(now, last)| (0..2).any(|i| (now[i] / last[i] - 1.0).abs() > PART))
        })
    };
    let from = (0..history.time_s.len()).rposition(is_off).map_or(0, |at| at + 1);
    history.time_s.get(from).copied()
}

/// Formats median and maximum over several seeds.
fn cells(found: &[Found]) -> String {
    let sorted = |mut all: Vec<f64>| {
        all.sort_by(f64::total_cmp);
        all
    };
    let percent = |k: usize| {
        let all = sorted(found.iter().map(|one| 100.0 * one.off[k]).collect());
        format!("{:.1}, {:.1} %", all[all.len() / 2], all[all.len() - 1])
    };
    let times = sorted(found.iter().filter_map(|one| one.within_s).collect());
    let within = match times.last() {
        None => "none".to_owned(),
        Some(last) => format!("{} of {}, by {last:.0} s", times.len(), found.len()),
    };
    let warned = found.iter().filter(|one| one.is_warned).count();
    format!("{} | {} | {within} | {warned} of {} |", percent(0), percent(1), found.len())
}
