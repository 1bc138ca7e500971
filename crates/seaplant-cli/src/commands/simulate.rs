use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, anyhow, bail};
use seaplant::Dof;
use seaplant::results::Results;
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
    let dof = arguments.dof.map_or_else(|| only_dof(&results), Ok)?;
    let plant = results.plant_of(dof, arguments.method)?;
    let campaign = campaign_of(arguments, &results)?;
    let mut inputs = campaign_files(&campaign);
    inputs.push(path);
    inputs.extend(arguments.logs.iter().cloned());
    let permit = Permit::of(&inputs, arguments.force);
    let is_ours = |bytes: &[u8]| bytes.starts_with(HEADER.as_bytes());
    let trial = watched(output, || read_logs(&campaign, &arguments.logs, dof))?;
    let simulation = Simulation::of(dof, plant, &trial)?;
    if let Some(path) = &arguments.out {
        write_file(path, csv(&simulation).as_bytes(), permit, is_ours)?;
    }
    if arguments.out.is_none() && !output.json {
        print(&csv(&simulation))?;
    } else {
        output.give(&simulation, || words(trial.name(), &simulation))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The degree of freedom of results that hold one only.
fn only_dof(results: &Results) -> Result<Dof> {
    let all: Vec<Dof> = results.plants.keys().copied().collect();
    match all.as_slice() {
        [only] => Ok(*only),
        [] => bail!(
            "the results hold no plant of one axis, and a log is simulated axis by axis; give \
             inputs (--step, a profile or a table of inputs) for a plant of several axes"
        ),
        several => {
            let names: Vec<&str> = several.iter().map(|dof| dof.name()).collect();
            bail!("the results hold {}; choose one with --dof", names.join(", "))
        }
    }
}

/// The campaign that was asked for, or the one that the results came from.
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

/// What every file that this writes starts with.
const HEADER: &str = "time [s],force [";

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
