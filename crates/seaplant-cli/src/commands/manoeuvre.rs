//! `simulate` with a manoeuvre: the response of a ship's plant in a turning circle, a zigzag or a
//! stop.

use std::fmt::Write;
use std::process::ExitCode;

use anyhow::{Result, bail};
use seaplant::exchange::{Approach, Draws, ManoeuvreNumber, PlantModel};
use seaplant_campaign::{ManoeuvreEntry, ManoeuvreKind, Profile};
use seaplant_export::doubts;
use seaplant_report::number::significant;
use serde_json::json;

use crate::args::Simulate;
use crate::output::{Output, STRONG, WARNING};
use crate::summary::{align, plain_table};

/// Prints the characteristic numbers of a manoeuvre.
pub fn run(
    arguments: &Simulate,
    profile: &Profile,
    entry: &ManoeuvreEntry,
    model: &PlantModel,
    output: Output,
) -> Result<ExitCode> {
    if arguments.out.is_some() {
        bail!("the result of a manoeuvre is printed, or given as JSON by --json; leave out --out");
    }
    let approach = Approach {
        rudder: entry.rudder.clone(),
        rudder_rate: entry.rudder_rate(model),
        drive: profile.drive(model)?,
        speed: profile.start.velocity.get(&seaplant::Dof::Surge).copied().unwrap_or(0.0),
        longest_s: profile.duration_s,
    };
    let draws = Draws { count: usize::from(arguments.draws), seed: arguments.seed };
    let numbers = model.manoeuvre(entry.manoeuvre(), &approach, draws)?;
    let mut notes: Vec<String> = rudder(entry, model).into_iter().collect();
    notes.extend(model.notes.iter().cloned());
    notes.extend(doubts(model));
    if model.covariance.is_none() {
        notes.push(
            "the plant states no standard deviations, so that there are no intervals".to_owned(),
        );
    }
    let result = json!({
        "vehicle": model.name,
        "manoeuvre": entry.manoeuvre(),
        "numbers": numbers,
        "seed": draws.seed,
        "draws": draws.count,
        "notes": notes,
    });
    output.give(&result, || words(model, &numbers, &notes))?;
    Ok(ExitCode::SUCCESS)
}

/// Notes the assumed rate of the rudder, if none was stated.
fn rudder(entry: &ManoeuvreEntry, model: &PlantModel) -> Option<String> {
    let is_assumed = entry.rudder_deg_per_s.is_none() && entry.kind != ManoeuvreKind::Stop;
    is_assumed.then(|| {
        let rate = significant(entry.rudder_rate(model).to_degrees(), 2);
        match model.steering_gear().rate_rad_s() {
            Some(_) => format!("the rudder turns at {rate}°/s, as the logs of the plant show"),
            None => format!(
                "the rudder turns at {rate}°/s, as SOLAS asks of ships; state rudder_deg_per_s"
            ),
        }
    })
}

fn words(model: &PlantModel, numbers: &[ManoeuvreNumber], notes: &[String]) -> String {
    let length = model.size_m.map(|[length, ..]| length);
    let mut table = plain_table();
    for number in numbers {
        table.add_row(told(number, length));
    }
    align(&mut table, 1..2);
    let mut text =
        format!("{STRONG}{}{STRONG:#}\n{}\n\n", model.name, table.to_string().trim_end());
    for note in notes {
        let _ = writeln!(text, "{WARNING}note:{WARNING:#} {note}");
    }
    text
}

/// Formats a number with its interval, angles in degrees, lengths also in ship lengths.
fn told(number: &ManoeuvreNumber, length: Option<f64>) -> [String; 5] {
    let (factor, unit) = match number.unit.as_str() {
        "rad" => (180.0 / std::f64::consts::PI, "deg"),
        unit => (1.0, unit),
    };
    let shown = |x: f64| significant(factor * x, 3);
    let interval = number
        .interval95
        .map_or(String::new(), |[low, high]| format!("[{}, {}]", shown(low), shown(high)));
    let in_lengths = match (number.unit.as_str(), length) {
        ("m", Some(length)) => format!("{} L", significant(number.value / length, 3)),
        _ => String::new(),
    };
    [number.name.clone(), shown(number.value), interval, unit.to_owned(), in_lengths]
}
