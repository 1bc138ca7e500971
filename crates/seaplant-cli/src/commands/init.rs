use std::path::PathBuf;
use std::process::ExitCode;

use anyhow::{Result, bail};
use seaplant_campaign::propose;
use seaplant_log::Log;
use serde_json::json;

use crate::args::Init;
use crate::commands::read_options;
use crate::output::Output;
use crate::progress::watched;
use crate::writing::{File, Permit, Target};

pub fn run(arguments: &Init, output: Output) -> Result<ExitCode> {
    let targets = ["vehicle.toml", "campaign.toml"].map(|name| arguments.out.join(name));
    let there: Vec<&PathBuf> = targets.iter().filter(|path| path.exists()).collect();
    if let (false, Some(path)) = (arguments.force, there.first()) {
        bail!("{} exists; choose another --out, or overwrite it with --force", path.display());
    }
    let options = read_options(&arguments.reading);
    let logs = arguments.logs.iter();
    let files: Vec<_> = logs.map(|path| (path.clone(), options.clone())).collect();
    let log = watched(output, || Log::open(&files))?;
    let proposal = propose(&log, &arguments.logs, &arguments.out, &options, arguments.preset);
    let file = |path: &str, text: &str| File { path: path.to_owned(), bytes: text.into() };
    let permit = Permit::new(&arguments.logs, arguments.force);
    Target { folder: &arguments.out, made: None, permit }.write(&[
        file("vehicle.toml", &proposal.vehicle_toml),
        file("campaign.toml", &proposal.campaign_toml),
    ])?;
    let [vehicle, campaign] = &targets;
    let questions = &proposal.open_questions;
    let result = json!({ "vehicle": vehicle, "campaign": campaign, "open_questions": questions });
    output.give(&result, || words(&targets, questions))?;
    Ok(ExitCode::SUCCESS)
}

fn words(files: &[PathBuf], open_questions: &[String]) -> String {
    let mut text: String = files.iter().map(|file| format!("{}\n", file.display())).collect();
    if !open_questions.is_empty() {
        text += "to decide before `seaplant identify` (each is marked in the files):\n";
        text.extend(open_questions.iter().map(|question| format!("  {question}\n")));
    }
    text
}
