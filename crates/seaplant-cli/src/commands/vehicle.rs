use std::process::ExitCode;

use anyhow::Result;
use seaplant_campaign::{SourcedVehicle, ThrusterEntry, VehicleFile, read_toml};
use seaplant_report::number::significant;
use serde_json::{Value, json};

use crate::args::Vehicle;
use crate::output::{FAINT, Output, STRONG, WARNING};

pub fn run(arguments: &Vehicle, output: Output) -> Result<ExitCode> {
    let file: VehicleFile = read_toml(&arguments.vehicle)?;
    let thrusters = file.thrusters();
    // An incomplete file is shown, with its error.
    let missing = SourcedVehicle::from_file(file.clone(), &arguments.vehicle).err();
    let missing = missing.map(|error| error.to_string());
    let mut result = json!(file);
    result["thruster"] = thrusters.iter().map(shown).collect();
    result["missing"] = json!(missing);
    output.give(&result, || words(&file, &thrusters, missing.as_deref()))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns a thruster as in its file, and the wrench of one newton of thrust at positive input,
/// also in words.
fn shown(thruster: &ThrusterEntry) -> Value {
    let (mut shown, wrench) = (json!(thruster), wrench(thruster));
    shown["wrench"] = json!(wrench);
    shown["moves"] = json!(wrench.map(moves));
    shown
}

/// Returns the wrench of one newton of thrust at positive input, `[d; r × d]` in N and N m, if
/// position and direction are given.
fn wrench(thruster: &ThrusterEntry) -> Option<[f64; 6]> {
    let ([x, y, z], d) = (thruster.position_m?, thruster.direction?);
    let length = d.iter().map(|d| d * d).sum::<f64>().sqrt();
    let sign = if thruster.reversed { -1.0 } else { 1.0 };
    let [a, b, c] = d.map(|d| sign * d / length);
    let wrench = [a, b, c, y * c - z * b, z * a - x * c, x * b - y * a];
    wrench.iter().all(|part| part.is_finite()).then_some(wrench)
}

fn words(file: &VehicleFile, thrusters: &[ThrusterEntry], missing: Option<&str>) -> String {
    let name = file.name.as_deref().or(file.preset.map(|preset| preset.title()));
    let mut text = format!("{STRONG}{}{STRONG:#}\n", name.unwrap_or("vehicle without a name"));
    for thruster in thrusters {
        let moves = wrench(thruster).map_or("position or direction is missing".to_owned(), moves);
        text += &format!("{}: {moves}\n", thruster.name);
    }
    if !thrusters.is_empty() {
        text += &format!("{FAINT}of positive input{FAINT:#}\n");
    }
    if let Some(missing) = missing {
        text += &format!("{WARNING}incomplete:{WARNING:#} {missing}\n");
    }
    text
}

/// Smallest contribution in newtons, or newton metres, that is named.
const NAMED: f64 = 0.01;

/// Formats `0.707 N forward, 0.707 N to port, 0.19 N m to port`.
fn moves(wrench: [f64; 6]) -> String {
    const WAYS: [[&str; 2]; 6] = [
        ["N forward", "N aft"],
        ["N to starboard", "N to port"],
        ["N down", "N up"],
        ["N m rolling to starboard", "N m rolling to port"],
        ["N m bow up", "N m bow down"],
        ["N m turning to starboard", "N m turning to port"],
    ];
    let parts = wrench.iter().zip(WAYS).filter(|(part, _)| part.abs() >= NAMED);
    let parts = parts.map(|(part, [positive, negative])| {
        let way = if *part > 0.0 { positive } else { negative };
        format!("{} {way}", significant(part.abs(), 3))
    });
    parts.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reversed_thruster_off_the_centre_line_turns_the_other_way() {
        let toml = "preset = \"bluerov2\"\n[[thruster]]\nname = \"motor 1\"\nreversed = true";
        let file: VehicleFile = toml::from_str(toml).expect("a vehicle");
        let [first, second, ..] = &file.thrusters()[..] else { panic!("six thrusters") };
        // At starboard bow; reversed, it acts forward and to port.
        let turns = 0.5_f64.sqrt() * -(0.156 + 0.111);
        let wrench = wrench(first).expect("a preset has positions");
        assert!((wrench[5] - turns).abs() < 1e-12, "{wrench:?}");
        assert!(moves(wrench).starts_with("0.707 N forward, 0.707 N to port"), "{}", moves(wrench));
        assert_eq!(second.name, "motor 2");
    }
}
