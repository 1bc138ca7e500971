use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, anyhow};
use seaplant::results::{Failure, Identification, Results};
use seaplant::{Method, Trial};
use seaplant_campaign::{Campaign, campaign_files};
use seaplant_report::render;

#[cfg(not(target_family = "wasm"))]
use super::named_plan::NamedPlan;
use crate::args::{Identify, MethodChoice};
use crate::output::Output;
use crate::progress::{fitted, watched, written};
use crate::sketch::Sketches;
use crate::summary;
use crate::writing::{Made, Permit, Target};

pub fn run(arguments: &Identify, output: Output) -> Result<ExitCode> {
    Ok(identified(arguments, output)?.1)
}

/// Identifies a campaign, writes its report and prints the result.
pub fn identified(arguments: &Identify, output: Output) -> Result<(Identification, ExitCode)> {
    let mut campaign = watched(output, || Campaign::open(&arguments.campaign))?;
    if !arguments.methods.is_empty() {
        campaign.options.methods = MethodChoice::methods(&arguments.methods);
    }
    if let Some(terms) = arguments.terms {
        campaign.options.terms = Some(terms);
        campaign.options.terms_of.clear();
    }
    let folder = arguments.out.clone().unwrap_or_else(|| beside(&arguments.campaign));
    let inputs = campaign_files(&arguments.campaign);
    #[cfg(not(target_family = "wasm"))]
    let inputs: Vec<PathBuf> = inputs.into_iter().chain(arguments.plan.clone()).collect();
    #[cfg(not(target_family = "wasm"))]
    let plan = NamedPlan::open(arguments.plan.as_deref(), &campaign.trials)?;
    let permit = Permit::new(&inputs, arguments.force);
    let target = Target { folder: &folder, made: Some(Made::Report), permit };
    target.check(&["results.json", "report.html"])?;
    let found = fitted(output, &campaign, &command_line(arguments));
    #[cfg(not(target_family = "wasm"))]
    let found = match &plan {
        Some(plan) => plan.compared(&campaign.trials, found, &folder)?,
        None => found,
    };
    finish(&found, &campaign.trials, &target, output)?;
    let code = exit_code(&found.results, &campaign.options.methods);
    Ok((found, code))
}

/// Returns failure if a fit failed, unless no methods were chosen and another one identified the axis.
pub fn exit_code(results: &Results, methods: &[Method]) -> ExitCode {
    let is_replaced = |failure: &Failure| {
        methods == Method::DEFAULT
            && failure.method.parse::<Method>().is_ok()
            && results.plants.contains_key(failure.dof.name())
    };
    if results.failures.iter().all(is_replaced) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Writes the report and prints the result; fails if no fit succeeded.
pub fn finish(
    found: &Identification,
    trials: &[Trial],
    target: &Target<'_>,
    output: Output,
) -> Result<()> {
    let results = &found.results;
    results.check()?;
    let mut sketches = Sketches::default();
    written(output, || {
        target.fill(|staging| {
            let series = found.series(trials).inspect(|series| sketches.see(series, results));
            render(results, series, |artifact| {
                staging.write(&artifact.path, |out| artifact.write_to(out))
            })
        })
    })?;
    output.give(results, || summary::of(results, &sketches, target.folder))?;
    if output.quiet && !output.json {
        for (dof, methods, why) in results.reasons() {
            output.error(&anyhow!("{dof} by {methods}: {why}"));
        }
    }
    Ok(())
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
    #[cfg(not(target_family = "wasm"))]
    if let Some(plan) = &arguments.plan {
        words.push(format!("--plan {}", quoted(plan)));
    }
    if let Some(out) = &arguments.out {
        words.push(format!("--out {}", quoted(out)));
    }
    words.join(" ")
}

/// Quotes a path for a shell.
pub fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+".contains(c);
    if text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}
