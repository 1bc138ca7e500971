//! Plans the next trial.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use seaplant::Vehicle;
use seaplant::exchange::PlantModel;
use seaplant_campaign::{SourcedVehicle, read_bounded, read_toml};
use seaplant_plan::{
    Battery, ControllerGoal, Goal, HungWeight, Mission, Plan, Prior, Rehearsal, Request, chart_svg,
    commands_bag, commands_csv, deck_page, lua_script, plan, rehearse, words,
};
use serde_json::json;

use super::identify::quoted;
use super::named_plan::read_plan;
use super::plant::{file_of, read_plant};
use super::twin;
use crate::args;
use crate::output::Output;
use crate::writing::{File, Made, Permit, Target};

pub fn run(arguments: &args::Plan, output: Output) -> Result<ExitCode> {
    let request = request(arguments)?;
    let (prior, vehicle) = prior(arguments)?;
    let made = plan(&prior, &vehicle, &request)?;
    let (files, notes) = files(&prior, &made)?;
    let mut inputs = vec![file_of(&arguments.plant)];
    inputs.extend(arguments.request.iter().chain(&arguments.mission).cloned());
    let permit = Permit::new(&inputs, arguments.force);
    Target { folder: &arguments.out, made: Some(Made::Export), permit }.write(&files)?;
    let mut campaign = None;
    if let Some(folder) = &arguments.rehearse {
        let rehearsal = Rehearsal { seed: request.seed, ..Rehearsal::default() };
        let driven = rehearse(&prior, &vehicle, &made, rehearsal)?;
        twin::write(&driven, folder, permit)?;
        campaign = Some(folder.join("campaign.toml"));
    }
    let paths: Vec<String> =
        files.iter().map(|file| arguments.out.join(&file.path).display().to_string()).collect();
    let result = json!({ "plan": made, "files": paths, "campaign": campaign, "notes": notes });
    output.give(&result, || {
        let mut text = words(&made);
        for note in &notes {
            text += &format!("\nnote: {note}");
        }
        text += &format!("\n\nwritten to {}: {}", arguments.out.display(), names(&files));
        if let Some(campaign) = &campaign {
            text += &format!(
                "\nthe rehearsal's logs: identify them with\n  seaplant identify {}",
                quoted(campaign)
            );
        }
        text
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Lists the files; those of single manoeuvres are only counted.
fn names(files: &[File]) -> String {
    let (of_manoeuvres, others): (Vec<&File>, Vec<&File>) =
        files.iter().partition(|file| file.path.starts_with(COMMANDS));
    let others: Vec<&str> = others.iter().map(|file| file.path.as_str()).collect();
    let count = of_manoeuvres.iter().filter(|file| file.path.ends_with(".csv")).count();
    format!("{} and {count} tables and ROS 2 bags of commands in {COMMANDS}", others.join(", "))
}

/// Size of the largest file of text that is read.
const MOST_BYTES: u64 = 1 << 24;

/// Folder of the tables and bags of commands.
const COMMANDS: &str = "commands";

fn request(arguments: &args::Plan) -> Result<Request> {
    let mut request: Request = match &arguments.request {
        Some(path) if path.extension().is_some_and(|ending| ending == "json") => {
            read_plan(path)?.0.request
        }
        Some(path) => read_toml(path)?,
        None => Request::default(),
    };
    if !arguments.goals.is_empty() {
        let goals = arguments.goals.iter().map(|text| text.parse::<Goal>());
        request.goals = goals.collect::<Result<_, _>>()?;
    }
    let pair = |values: &[f64], flag: &str| match *values {
        [a, b] => Ok([a, b]),
        _ => bail!("{flag} takes two numbers with a comma between them, as {flag} 5,8"),
    };
    if let Some(path) = &arguments.mission {
        let bytes = read_bounded(path, MOST_BYTES)?;
        let text = String::from_utf8(bytes).with_context(|| path.display().to_string())?;
        let mission = Mission::of_csv(&text).with_context(|| path.display().to_string())?;
        request.mission = Some(mission);
    }
    if let Some(bandwidth_hz) = arguments.bandwidth {
        let controller = request.controller.unwrap_or_default();
        request.controller = Some(ControllerGoal { bandwidth_hz, ..controller });
    }
    match *arguments.weight {
        [] => {}
        [weight_n, mass_kg] => {
            request.weight = Some(HungWeight { weight_n, mass_kg, position_m: [0.0; 3] });
        }
        [weight_n, mass_kg, x, y, z] => {
            request.weight = Some(HungWeight { weight_n, mass_kg, position_m: [x, y, z] });
        }
        _ => bail!(
            "--weight takes N in water and kg, and x,y,z in m if it does not hang at the origin, with commas between them, as --weight 20,2.5,0,0,0.2"
        ),
    }
    match *arguments.battery {
        [] => {}
        [energy_wh, thruster_w, other_w] => {
            request.battery = Some(Battery { energy_wh, thruster_w, other_w });
        }
        _ => bail!(
            "--battery takes three numbers with commas between them, Wh, W of a thruster at its greatest thrust, W of the rest, as --battery 266,350,20"
        ),
    }
    let limits = &mut request.limits;
    if !arguments.room.is_empty() {
        limits.box_m = pair(&arguments.room, "--box")?;
    }
    if !arguments.depth.is_empty() {
        limits.depth_m = pair(&arguments.depth, "--depth")?;
        if arguments.start_depth.is_none() {
            limits.start_depth_m = 0.5 * (limits.depth_m[0] + limits.depth_m[1]);
        }
    }
    limits.start_depth_m = arguments.start_depth.unwrap_or(limits.start_depth_m);
    limits.speed_m_s = arguments.speed.unwrap_or(limits.speed_m_s);
    limits.rate_rad_s = arguments.rate.unwrap_or(limits.rate_rad_s);
    limits.tilt_rad = arguments.tilt.map_or(limits.tilt_rad, f64::to_radians);
    limits.thrust_part = arguments.thrust.map_or(limits.thrust_part, |part| 0.01 * part);
    limits.tether_m = arguments.tether.or(limits.tether_m);
    if !arguments.current.is_empty() {
        request.current_m_s = pair(&arguments.current, "--current")?;
    }
    if let Some(part) = arguments.disturbance {
        request.disturbance_part = 0.01 * part;
    }
    if let Some(text) = &arguments.full_input {
        request.full_input = Some(full_input(text)?);
    }
    request.criterion = arguments.criterion.unwrap_or(request.criterion);
    request.minutes = arguments.minutes.or(request.minutes);
    request.draws = arguments.draws.unwrap_or(request.draws);
    request.checks = arguments.checks.unwrap_or(request.checks);
    request.compare |= arguments.compare;
    request.seed = arguments.seed.unwrap_or(request.seed);
    Ok(request)
}

/// Parses `1650 rpm`, or a number in the unit of the curve.
fn full_input(text: &str) -> Result<f64> {
    let (number, factor) = match text.trim().strip_suffix("rpm") {
        Some(number) => (number, std::f64::consts::PI / 30.0),
        None => (text, 1.0),
    };
    let number: f64 = number.trim().parse().map_err(|_| {
        anyhow::anyhow!("--full-input `{text}` is not an input; write \"1650 rpm\", or a number in the unit of the curve, as 400")
    })?;
    Ok(factor * number)
}

/// Returns the prior of the vehicle's plant, and the vehicle with which its logs will be read.
fn prior(arguments: &args::Plan) -> Result<(Prior, Vehicle)> {
    if is_vehicle_file(&arguments.plant)? {
        let vehicle = SourcedVehicle::open(&arguments.plant)?.vehicle;
        let prior = Prior::of_vehicle(&vehicle, &arguments.axes)
            .with_context(|| arguments.plant.display().to_string())?;
        return Ok((prior, vehicle));
    }
    let model = read_plant(&arguments.plant, None)?;
    let prior = Prior::of_model(&model, &arguments.axes)?;
    Ok((prior, vehicle_of(&model)))
}

/// Returns whether a path is a vehicle.toml, not a plant file, results or a published table.
fn is_vehicle_file(path: &Path) -> Result<bool> {
    if path.extension().is_none_or(|ending| ending != "toml") || !path.is_file() {
        return Ok(false);
    }
    let bytes = read_bounded(path, MOST_BYTES)?;
    let table = std::str::from_utf8(&bytes).ok().and_then(|text| text.parse::<toml::Table>().ok());
    // The reader of vehicle files reports what cannot be read.
    Ok(table.is_none_or(|table| !table.contains_key("schema")))
}

fn vehicle_of(model: &PlantModel) -> Vehicle {
    Vehicle {
        name: model.name.clone(),
        dry_mass_kg: model.rigid_body.as_ref().map(|body| body.mass_kg()).or(model.dry_mass_kg),
        size_m: model.size_m,
        rigid_body: model.rigid_body,
        buoyancy: model.buoyancy,
        thrusters: model.thrusters.clone(),
        ..Vehicle::default()
    }
}

fn files(prior: &Prior, made: &Plan) -> Result<(Vec<File>, Vec<String>)> {
    let text = |path: &str, text: String| File { path: path.to_owned(), bytes: text.into_bytes() };
    let mut files = vec![
        text("plan.json", serde_json::to_string_pretty(made)? + "\n"),
        text("plan.html", deck_page(made)?),
        text("plan.svg", chart_svg(made) + "\n"),
    ];
    let mut notes = Vec::new();
    match lua_script(prior, made) {
        Ok(script) => files.push(text("plan.lua", script)),
        Err(error) => notes.push(format!("no plan.lua: {error}")),
    }
    for (k, planned) in made.manoeuvres.iter().enumerate() {
        // A hover under a weight is driven by the vehicle itself.
        if planned.manoeuvre.weight.is_some() {
            continue;
        }
        let path = format!("{COMMANDS}/{:02}-{}", k + 1, planned.manoeuvre.name);
        files.push(text(&format!("{path}.csv"), commands_csv(prior, made, planned)?));
        let bytes = commands_bag(prior, made, planned)?;
        files.push(File { path: format!("{path}.mcap"), bytes });
    }
    Ok((files, notes))
}
