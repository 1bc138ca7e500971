use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, bail};
use seaplant::exchange::PlantModel;
use seaplant::results::Results;
use seaplant_campaign::{Campaign, Error, Validation, read_bounded, validate, validate_table};
use seaplant_report::number::{or_absent, significant};
use seaplant_report::parse_results;

use super::plant::{file_of, read_plant, read_table};
use crate::args::Validate;
use crate::output::{Output, WARNING};
use crate::progress::watched;
use crate::summary::{align, plain_table};
use crate::writing::is_complete;

pub fn run(arguments: &Validate, output: Output) -> Result<ExitCode> {
    let validations = match table(arguments)? {
        Some(model) => {
            let campaign = watched(output, || Campaign::open(&arguments.campaign))?;
            validate_table(&model, &campaign.vehicle, &campaign.sourced_trials())
        }
        None => {
            let results = read_results(&file_of(&arguments.results))?;
            let campaign = watched(output, || Campaign::open(&arguments.campaign))?;
            let alone = results.alone().map(|(dof, ..)| results.plant_of(dof, arguments.method));
            let plants = alone.collect::<Result<Vec<_>, _>>()?;
            validate(&results, plants, &campaign.sourced_trials())
        }
    };
    let validations = validations.with_context(|| arguments.campaign.display().to_string())?;
    if validations.is_empty() {
        bail!(
            "no trial of {} exercises a degree of freedom that {} holds",
            arguments.campaign.display(),
            arguments.results.display()
        );
    }
    output.give(&validations, || words(&validations))?;
    Ok(ExitCode::SUCCESS)
}

/// Reads the plant from a plant file or published table; `None` for results.
fn table(arguments: &Validate) -> Result<Option<PlantModel>> {
    let path = file_of(&arguments.results);
    match read_table(&path)? {
        Some(_) => read_plant(&path, arguments.method).map(Some),
        None => Ok(None),
    }
}

/// Reads a results.json.
pub fn read_results(path: &Path) -> Result<Results> {
    let folder = path.parent().unwrap_or(Path::new(""));
    if !is_complete(folder) {
        bail!(
            "{} may be of one run and the files beside it of another: the program was ended while \
             it wrote there; identify again",
            path.display()
        );
    }
    /// Size limit; ten thousand trials take a quarter of it.
    const MOST_BYTES: u64 = 1 << 30;
    let bytes = read_bounded(path, MOST_BYTES).map_err(|error| match error {
        Error::Io { source, .. } => {
            anyhow!("cannot read {}: {source}; give the results.json of a fit", path.display())
        }
        other => other.into(),
    })?;
    let text = String::from_utf8(bytes).map_err(|_| {
        anyhow!("cannot read {}: it is not text; give the results.json of a fit", path.display())
    })?;
    parse_results(&text).with_context(|| path.display().to_string())
}

fn words(validations: &[Validation]) -> String {
    let mut table = plain_table();
    table.set_header(["dof", "trial", "e", "never moves", "R²", "R² of position", ""]);
    for validation in validations {
        let axes = validation.axes.iter();
        let all = axes.flat_map(|&dof| validation.score.trials(dof).map(move |own| (dof, own)));
        for (dof, (name, trial)) in all {
            let own = validation.fitted_to.contains(name);
            let with = if validation.axes.len() > 1 { ", together" } else { "" };
            table.add_row([
                format!("{dof}{with}"),
                name.clone(),
                trial.mean_abs_error.map_or("diverges".to_owned(), |e| significant(e, 3)),
                significant(trial.null_error, 3),
                or_absent(trial.r_squared, 3),
                or_absent(trial.position_r_squared, 3),
                if own { "fitted to it".to_owned() } else { String::new() },
            ]);
        }
    }
    align(&mut table, 2..6);
    let mut text = format!("{table}\n");
    if validations.iter().any(|validation| !validation.fitted_to.is_empty()) {
        text += &format!(
            "{WARNING}caveat:{WARNING:#} a plant scored on files that it was fitted to looks better than it is\n"
        );
    }
    text
}
