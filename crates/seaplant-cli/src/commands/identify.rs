use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, anyhow};
use seaplant::Trial;
use seaplant::results::Identification;
use seaplant_campaign::Campaign;
use seaplant_report::render;

use crate::args::{Identify, MethodChoice};
use crate::output::{Output, fill_folder};
use crate::summary;

pub fn run(arguments: &Identify, output: Output) -> Result<ExitCode> {
    let mut campaign = Campaign::open(&arguments.campaign)?;
    if !arguments.methods.is_empty() {
        campaign.options.methods = MethodChoice::methods(&arguments.methods);
    }
    if let Some(terms) = arguments.terms {
        campaign.options.terms = Some(terms);
        campaign.options.terms_of.clear();
    }
    let folder = arguments.out.clone().unwrap_or_else(|| beside(&arguments.campaign));
    let found = campaign.identify(&command_line(arguments));
    finish(&found, &campaign.trials, &folder, output)
}

/// Writes the report and says what was found; fails if nothing was.
pub fn finish(
    found: &Identification,
    trials: &[Trial],
    folder: &Path,
    output: Output,
) -> Result<ExitCode> {
    let results = &found.results;
    results.check()?;
    fill_folder(folder, |aside| {
        render(results, found.series(trials), |artifact| {
            aside.write(&artifact.path, |out| artifact.write_to(out))
        })
    })?;
    output.give(results, || summary::of(results, folder))?;
    if output.quiet && !output.json {
        for f in &results.failures {
            output.error(&anyhow!("{} by {}: {}", f.dof, f.method, f.message));
        }
    }
    let complete = results.failures.is_empty();
    Ok(if complete { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

fn beside(campaign: &Path) -> PathBuf {
    campaign.with_file_name("results")
}

fn command_line(arguments: &Identify) -> String {
    let mut words = vec!["seaplant identify".to_owned(), quoted(&arguments.campaign)];
    words.extend(arguments.methods.iter().map(|method| format!("--method {method}")));
    if let Some(terms) = arguments.terms {
        words.push(format!("--terms {}", terms.to_string().replace(' ', "")));
    }
    if let Some(out) = &arguments.out {
        words.push(format!("--out {}", quoted(out)));
    }
    words.join(" ")
}

/// A path as a shell reads it.
pub fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+".contains(c);
    if text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}
