use std::num::NonZero;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;

use anyhow::{Context, Result, bail};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use seaplant::IdentifyOptions;
use seaplant::monte_carlo::{Admission, Assurance, ParameterName, Row};
use seaplant::twin::{Disturbance, TwinSpec};
use seaplant_campaign::{
    MonteCarloTable, TwinFile, VehicleMonteCarloTable, monte_carlo, monte_carlo_of_several_axes,
};
use seaplant_report::number::significant;
use serde::Serialize;

use crate::args::{MethodChoice, MonteCarlo};
use crate::output::Output;
use crate::summary::{align, plain_table};
use crate::writing::{Permit, check_writable, write_file};

pub fn run(arguments: &MonteCarlo, output: Output) -> Result<ExitCode> {
    let spec = spec_of(arguments)?;
    if arguments.runs == 0 {
        bail!("--runs is 0 and must be at least 1");
    }
    let inputs: Vec<PathBuf> = arguments.spec.iter().cloned().collect();
    let permit = Permit::new(&inputs, arguments.force);
    if let Some(path) = &arguments.out {
        check_writable(path, permit, is_ours).with_context(|| path.display().to_string())?;
    }
    let processors = thread::available_parallelism().map_or(1, NonZero::get);
    let threads = arguments.threads.map_or(processors, usize::from);
    let progress = progress(arguments.runs, output);
    let go_on = |run| {
        progress.set_position(run);
        true
    };
    match &spec {
        TwinFile::OneAxis(spec) => {
            let mut options = IdentifyOptions::default();
            if !arguments.methods.is_empty() {
                options.methods = MethodChoice::methods(&arguments.methods);
            }
            let table = monte_carlo(spec, &options, arguments.runs, threads, go_on)?;
            progress.finish_and_clear();
            give(arguments, &table.context(STOPPED)?, permit, output, words)
        }
        TwinFile::SeveralAxes(spec) => {
            let table = monte_carlo_of_several_axes(spec, arguments.runs, threads, go_on)?;
            progress.finish_and_clear();
            give(arguments, &table.context(STOPPED)?, permit, output, words_of_several_axes)
        }
    }
}

const STOPPED: &str = "the study was stopped";

/// Writes a table if requested, and prints it.
fn give<T: Serialize>(
    arguments: &MonteCarlo,
    table: &T,
    permit: Permit<'_>,
    output: Output,
    words: impl Fn(&T) -> String,
) -> Result<ExitCode> {
    if let Some(path) = &arguments.out {
        write_file(path, serde_json::to_string_pretty(table)?.as_bytes(), permit, is_ours)?;
    }
    output.give(table, || words(table))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns whether a file starts like the tables that this command writes.
fn is_ours(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let has = |key: &str| text.contains(&format!("\n  \"{key}\": "));
    text.starts_with("{\n  \"version\": ") && has("runs") && has("spec")
}

fn spec_of(arguments: &MonteCarlo) -> Result<TwinFile> {
    let mut file = match &arguments.spec {
        Some(path) => TwinFile::read(path)?,
        None => TwinFile::OneAxis(Box::new(TwinSpec::jason2())),
    };
    let disturbances =
        arguments.disturbances.as_deref().map(Disturbance::parse_list).transpose()?;
    match &mut file {
        TwinFile::OneAxis(spec) => {
            spec.disturbances = disturbances.unwrap_or_else(|| spec.disturbances.clone());
            if !arguments.dofs.is_empty() {
                spec.dofs = arguments.dofs.iter().copied().collect();
            }
            spec.validate().context("the twin's settings")?;
        }
        TwinFile::SeveralAxes(spec) => {
            if !arguments.dofs.is_empty() {
                bail!(
                    "--dof is for twins of single axes; this twin has `vehicle` and all its axes: state `axes` in its file"
                );
            }
            if !arguments.methods.is_empty() {
                bail!(
                    "--method is for twins of single axes; this twin has `vehicle`, whose plant of several axes is fitted by filter error: leave it out"
                );
            }
            spec.disturbances = disturbances.unwrap_or_else(|| spec.disturbances.clone());
        }
    }
    Ok(file)
}

fn progress(runs: u64, output: Output) -> ProgressBar {
    if output.quiet || output.json {
        return ProgressBar::with_draw_target(Some(runs), ProgressDrawTarget::hidden());
    }
    // Indicatif draws nothing if standard error is no terminal.
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} twins, {eta} left");
    ProgressBar::new(runs).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn words(table: &MonteCarloTable) -> String {
    let mut text = plain_table();
    text.set_header(["dof", "method", "", "mass", "d_Q", "bias", "answers"]);
    let percent = |x: f64| format!("{} %", significant(x, 2));
    for rows in table.rows.chunk_by(|a, b| (a.dof, a.method) == (b.dof, b.method)) {
        let first = &rows[0];
        let answers = format!("{} of {}", first.answers, first.answers + first.failures);
        let [mass, drag, bias] = cells(rows, |row| percent(row.median_abs_error_percent));
        let (dof, method) = (first.dof.to_string(), first.method.to_string());
        text.add_row([dof, method, "median |error|".to_owned(), mass, drag, bias, answers]);
        let [mass, drag, bias] = cells(rows, |row| format!("{:.0} %", row.coverage_percent));
        let empty = String::new;
        text.add_row([empty(), empty(), "covered".to_owned(), mass, drag, bias, empty()]);
    }
    align(&mut text, 3..6);
    let mut all = format!("{} twins, 95 % intervals\n{text}", table.runs);
    for part in table.admissions.iter().filter(|part| part.admitted_percent > 0.0) {
        let Admission { dof, method, candidate, admitted_percent, fits } = part;
        let name = candidate.name();
        all += &format!("\n{dof}, {method}: {name} in {admitted_percent:.0} % of {fits} fits");
    }
    table.assurance.iter().for_each(|of| all += &format!("\n{}", told(of)));
    all
}

fn words_of_several_axes(table: &VehicleMonteCarloTable) -> String {
    let mut text = plain_table();
    text.set_header(["coefficient", "truth", "median |error|", "", "covered", "plants"]);
    for row in &table.coefficients {
        let part = 100.0 * row.median_abs_error / row.truth.abs();
        text.add_row([
            row.name.clone(),
            format!("{} {}", significant(row.truth, 4), row.unit),
            significant(row.median_abs_error, 2),
            if part.is_finite() { format!("{} %", significant(part, 2)) } else { String::new() },
            format!("{:.0} %", row.coverage_percent),
            row.answers.to_string(),
        ]);
    }
    align(&mut text, 1..6);
    let mut all = format!("{} twins, 95 % intervals\n{text}", table.runs);
    table.assurance.iter().for_each(|of| all += &format!("\n{}", told(of)));
    table.failures.iter().for_each(|(seed, why)| all += &format!("\nseed {seed}: {why}"));
    all
}

/// Formats the assurance given to users of the recommended plants, with the truth.
fn told(of: &Assurance) -> String {
    let Assurance { dof, plants, wrong, good, .. } = of;
    let Assurance { wrong_but_usable: usable, wrong_but_usable_with_care: care, .. } = of;
    let doubted = of.good_but_doubted;
    format!(
        "{dof}: {wrong} of {plants} plants wrong (mass off by > 10 % or drag by > 20 %): {usable} called usable, {care} usable with care; {good} good: {doubted} doubted"
    )
}

/// Returns one cell for each parameter, a dash where it was not fitted.
fn cells(rows: &[Row], of: impl Fn(&Row) -> String) -> [String; 3] {
    [ParameterName::Mass, ParameterName::QuadraticDrag, ParameterName::BiasForce]
        .map(|name| rows.iter().find(|row| row.parameter == name).map_or("–".to_owned(), &of))
}
