use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow};
use seaplant::twin::TwinCampaign;
use seaplant_campaign::{TwinFile, twin_files};
use serde_json::json;

use super::identify::quoted;
use crate::args::Twin;
use crate::output::Output;
use crate::writing::{File, Made, Permit, Target};

pub fn run(arguments: &Twin, output: Output) -> Result<ExitCode> {
    let spec = TwinFile::read(&arguments.spec)?;
    let twin = spec.make().with_context(|| arguments.spec.display().to_string())?;
    let inputs = [arguments.spec.clone()];
    let permit = Permit::new(&inputs, arguments.force);
    write(&twin, &arguments.out, permit)?;
    let campaign = arguments.out.join("campaign.toml");
    let trials: Vec<&str> = twin.trials.iter().map(|trial| trial.name.as_str()).collect();
    output.give(&json!({ "campaign": campaign, "trials": trials }), || {
        format!(
            "{} trials of `{}` are in {}; identify them with\n  seaplant identify {}",
            trials.len(),
            twin.vehicle.name,
            arguments.out.display(),
            quoted(&campaign)
        )
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Writes a twin's logs, vehicle and campaign files, and truth.
pub fn write(twin: &TwinCampaign, folder: &Path, permit: Permit<'_>) -> Result<()> {
    let files = twin_files(twin).map_err(|error| anyhow!("the twin cannot be written: {error}"))?;
    let files: Vec<File> = files
        .into_iter()
        .map(|file| File { path: file.path, bytes: file.text.into_bytes() })
        .collect();
    Target { folder, made: Some(Made::Campaign), permit }.write(&files)
}
