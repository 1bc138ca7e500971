use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, anyhow, bail};
use seaplant::results::{PlantResult, Results};
use seaplant_campaign::{Simulation, campaign_files, read_logs};
use seaplant_report::number::{or_absent, significant};

use super::plant::{file_of, read_table};
use super::predict;
use super::validate::read_results;
use crate::args::Simulate;
use crate::output::{Output, print};
use crate::progress::watched;
use crate::writing::{Permit, write_file};

pub fn run(arguments: &Simulate, output: Output) -> Result<ExitCode> {
    if let Some(inputs) = predict::inputs_alone(arguments)? {
        return predict::run(arguments, inputs, output);
    }
    let path = file_of(&arguments.results);
    if read_table(&path)?.is_some() {
        let table = path.display();
        bail!(
            "{table} is a plant without a campaign, which says what the channels of a log are: give              it inputs (--step, a profile or a table of inputs), or compare it with a log by              `seaplant validate {table} campaign.toml`"
        );
    }
    let results = read_results(&path)?;
    let plant = select(&results, arguments)?;
    let campaign = campaign_of(arguments, &results)?;
    let mut inputs = campaign_files(&campaign);
    inputs.push(path);
    inputs.extend(arguments.logs.iter().cloned());
    let permit = Permit::new(&inputs, arguments.force);
    let is_ours = |bytes: &[u8]| {
        [HEADER, HEADER_OF_SEVERAL].iter().any(|header| bytes.starts_with(header.as_bytes()))
    };
    let trial = watched(output, || read_logs(&campaign, &arguments.logs, &plant.axes))?;
    let all = Simulation::of_plant(plant, &trial)?;
    let lines: Vec<String> = all.iter().map(|one| words(trial.name(), one)).collect();
    let lines = lines.join("\n");
    let (rows, said) = match all.as_slice() {
        [one] if plant.is_alone() => (csv(one), serde_json::to_value(one)?),
        several => (csv_of_several(several), serde_json::to_value(several)?),
    };
    if let Some(path) = &arguments.out {
        write_file(path, rows.as_bytes(), permit, is_ours)?;
    }
    if arguments.out.is_none() && !output.json {
        print(&rows)?;
    } else {
        output.give(&said, || lines)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Selects the only plant of the results, or that of `--dof`: the one-axis plant where there is one.
fn select<'a>(results: &'a Results, arguments: &Simulate) -> Result<&'a PlantResult> {
    let plant = match arguments.dof {
        Some(dof) if results.plants.contains_key(dof.name()) => {
            return Ok(results.plant_of(dof, arguments.method)?);
        }
        Some(dof) => match results.plants.values().find(|plant| plant.axes.contains(&dof)) {
            Some(plant) => plant,
            None => return Ok(results.plant_of(dof, arguments.method)?),
        },
        None => {
            let mut plants = results.plants.values();
            let first = plants.next().ok_or_else(|| anyhow!("the results hold no plant"))?;
            if plants.next().is_some() {
                let names: Vec<&str> = results.names().collect();
                bail!("the results hold {}; choose one with --dof", names.join(", "));
            }
            first
        }
    };
    let Some(method) = arguments.method else { return Ok(plant) };
    let of_method = results.methods.get(&plant.name()).and_then(|methods| methods.get(&method));
    of_method.ok_or_else(|| {
        anyhow!("the results hold no {} plant by {method}, but by {}", plant.name(), plant.method)
    })
}

/// Returns the requested campaign, or the one that the results came from.
fn campaign_of(arguments: &Simulate, results: &Results) -> Result<PathBuf> {
    if let Some(campaign) = &arguments.campaign {
        return Ok(campaign.clone());
    }
    let first = results.provenance.inputs.first().map(|input| PathBuf::from(&input.path));
    first.filter(|path| path.exists()).ok_or_else(|| {
        anyhow!("the campaign that the results came from is not here; name it with --campaign")
    })
}

fn words(trial: &str, simulation: &Simulation) -> String {
    let unit = simulation.dof.units().velocity;
    format!(
        "{} {}: e = {} {unit}, {} for a model that never moves, R² {}",
        trial,
        simulation.dof,
        significant(simulation.mean_abs_error, 3),
        significant(simulation.null_error, 3),
        or_absent(simulation.r_squared, 3)
    )
}

/// Start of every file that this command writes.
const HEADER: &str = "time [s],force [";

/// The same for a plant of several axes, each measured at its own times.
const HEADER_OF_SEVERAL: &str = "time [s],axis,force [";

fn csv_of_several(all: &[Simulation]) -> String {
    let mut text = format!(
        "{HEADER_OF_SEVERAL}N or N m],measured [m/s or rad/s],simulated [m/s or rad/s],difference [m/s or rad/s]\n"
    );
    for one in all {
        for (k, t) in one.time_s.iter().enumerate() {
            let (y, s, force) = (one.measured[k], one.simulated[k], one.force[k]);
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{t},{},{force},{y},{s},{}", one.dof, s - y);
        }
    }
    text
}

fn csv(simulation: &Simulation) -> String {
    let units = simulation.dof.units();
    let mut text = format!(
        "{HEADER}{}],measured [{v}],simulated [{v}],difference [{v}]\n",
        units.force,
        v = units.velocity
    );
    for (k, t) in simulation.time_s.iter().enumerate() {
        let (y, s) = (simulation.measured[k], simulation.simulated[k]);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{t},{},{y},{s},{}", simulation.force[k], s - y);
    }
    text
}
