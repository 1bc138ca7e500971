use std::fmt::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail};
use schemars::JsonSchema;
use seaplant::results::{PlantResult, Results};
use seaplant::{Comparison, Dof, Model, evaluate};
use seaplant_campaign::read_logs;
use seaplant_report::number::{or_absent, significant};
use serde::Serialize;

use super::validate::{plant_of, read_results};
use crate::args::Simulate;
use crate::output::{Output, print, write_file};
use crate::progress::watched;

/// A simulation beside its measurement.
#[derive(Debug, Serialize, JsonSchema)]
struct Simulation<'a> {
    dof: Dof,
    mean_abs_error: f64,
    null_error: f64,
    r_squared: Option<f64>,
    time_s: &'a [f64],
    force: &'a [f64],
    measured: &'a [f64],
    simulated: &'a [f64],
}

pub fn run(arguments: &Simulate, output: Output) -> Result<ExitCode> {
    let results = read_results(&arguments.results)?;
    let (dof, recommended) = choose(&results, arguments.dof)?;
    let plant = plant_of(&results, dof, recommended, arguments.method)?;
    let campaign = campaign_of(arguments, &results)?;
    let trial = watched(output, || read_logs(&campaign, &arguments.logs, dof))?;
    let comparison = evaluate(dof, &Model::of_result(plant), &trial)?;
    if let Some(path) = &arguments.out {
        write_file(path, csv(&comparison).as_bytes())?;
    }
    if arguments.out.is_none() && !output.json {
        print(&csv(&comparison))?;
    } else {
        output.give(&simulation(&comparison), || words(&comparison))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn choose(results: &Results, dof: Option<Dof>) -> Result<(Dof, &PlantResult)> {
    let all: Vec<&str> = results.plants.keys().map(|dof| dof.name()).collect();
    match (dof, results.plants.iter().next()) {
        (Some(dof), _) => {
            let plant = results.plants.get(&dof);
            let plant = plant.with_context(|| {
                format!("the results hold no {dof} plant, but {}", all.join(", "))
            })?;
            Ok((dof, plant))
        }
        (None, Some((dof, plant))) if all.len() == 1 => Ok((*dof, plant)),
        (None, Some(_)) => bail!("the results hold {}; choose one with --dof", all.join(", ")),
        (None, None) => bail!("the results hold no plant"),
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

fn simulation(comparison: &Comparison) -> Simulation<'_> {
    Simulation {
        dof: comparison.dof,
        mean_abs_error: comparison.velocity.mean_abs_error,
        null_error: comparison.velocity.null_error,
        r_squared: comparison.velocity.r_squared,
        time_s: &comparison.time_s,
        force: &comparison.force,
        measured: &comparison.measured,
        simulated: &comparison.simulated,
    }
}

fn words(comparison: &Comparison) -> String {
    let unit = comparison.dof.units().velocity;
    format!(
        "{} {}: e = {} {unit}, {} for a model that never moves, R² {}",
        comparison.trial,
        comparison.dof,
        significant(comparison.velocity.mean_abs_error, 3),
        significant(comparison.velocity.null_error, 3),
        or_absent(comparison.velocity.r_squared, 3)
    )
}

fn csv(comparison: &Comparison) -> String {
    let units = comparison.dof.units();
    let mut text = format!(
        "time [s],force [{}],measured [{v}],simulated [{v}],difference [{v}]\n",
        units.force,
        v = units.velocity
    );
    for (k, t) in comparison.time_s.iter().enumerate() {
        let (y, s) = (comparison.measured[k], comparison.simulated[k]);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{t},{},{y},{s},{}", comparison.force[k], s - y);
    }
    text
}
