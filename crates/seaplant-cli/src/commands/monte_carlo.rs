use std::num::NonZero;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use anyhow::{Context, Result, bail};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use schemars::JsonSchema;
use seaplant::monte_carlo::{Admission, ParameterName, Row, Sample, admissions, sample, summarise};
use seaplant::twin::{Disturbance, TwinSpec};
use seaplant::{Error, IdentifyOptions};
use seaplant_campaign::read_toml;
use seaplant_report::number::significant;
use serde::Serialize;

use crate::args::{MethodChoice, MonteCarlo};
use crate::output::{Output, write_file};
use crate::summary::{align, plain_table};

/// The number of a run, and what came of it.
type RunOf = (u64, Result<Vec<Sample>, Error>);

/// The table, and what it was made from.
#[derive(Debug, Serialize, JsonSchema)]
struct Table {
    version: &'static str,
    runs: u64,
    spec: TwinSpec,
    rows: Vec<Row>,
    admissions: Vec<Admission>,
}

pub fn run(arguments: &MonteCarlo, output: Output) -> Result<ExitCode> {
    let spec = spec_of(arguments)?;
    if arguments.runs == 0 {
        bail!("--runs is 0 and must be at least 1");
    }
    let mut options = IdentifyOptions::default();
    if !arguments.methods.is_empty() {
        options.methods = MethodChoice::methods(&arguments.methods);
    }
    let samples = all_samples(&spec, &options, arguments, output)?;
    let table = Table {
        version: env!("CARGO_PKG_VERSION"),
        runs: arguments.runs,
        rows: summarise(&samples),
        admissions: admissions(&samples),
        spec,
    };
    if let Some(path) = &arguments.out {
        write_file(path, serde_json::to_string_pretty(&table)?.as_bytes())?;
    }
    output.give(&table, || words(&table))?;
    Ok(ExitCode::SUCCESS)
}

fn spec_of(arguments: &MonteCarlo) -> Result<TwinSpec> {
    let mut spec = match &arguments.spec {
        Some(path) => read_toml(path)?,
        None => TwinSpec::jason2(),
    };
    if let Some(list) = &arguments.disturbances {
        spec.disturbances = Disturbance::parse_list(list)?;
    }
    if !arguments.dofs.is_empty() {
        spec.dofs = arguments.dofs.iter().copied().collect();
    }
    spec.validate().context("the twin's settings")?;
    Ok(spec)
}

/// The samples of all seeds, in order of seed whatever the threads did.
fn all_samples(
    spec: &TwinSpec,
    options: &IdentifyOptions,
    arguments: &MonteCarlo,
    output: Output,
) -> Result<Vec<Sample>> {
    let processors = thread::available_parallelism().map_or(1, NonZero::get);
    let threads = arguments.threads.unwrap_or(processors).max(1);
    let progress = progress(arguments.runs, output);
    let next = AtomicU64::new(0);
    let done: Mutex<Vec<RunOf>> = Mutex::default();
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let run = next.fetch_add(1, Ordering::Relaxed);
                    if run >= arguments.runs {
                        break;
                    }
                    let spec = TwinSpec { seed: spec.seed + run, ..spec.clone() };
                    let samples = sample(&spec, options);
                    progress.inc(1);
                    // A poisoned lock means that another thread panicked; the scope tells.
                    if let Ok(mut done) = done.lock() {
                        done.push((run, samples));
                    }
                }
            });
        }
    });
    progress.finish_and_clear();
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    done.sort_by_key(|(run, _)| *run);
    let mut samples = Vec::new();
    for (_, of_seed) in done {
        samples.extend(of_seed?);
    }
    Ok(samples)
}

fn progress(runs: u64, output: Output) -> ProgressBar {
    if output.quiet || output.json {
        return ProgressBar::with_draw_target(Some(runs), ProgressDrawTarget::hidden());
    }
    // Indicatif itself draws nothing where standard error is no terminal.
    let style = ProgressStyle::with_template("{bar:30} {pos}/{len} twins, {eta} left");
    ProgressBar::new(runs).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

fn words(table: &Table) -> String {
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
    all
}

/// One cell for each parameter, a dash where it was not fitted.
fn cells(rows: &[Row], of: impl Fn(&Row) -> String) -> [String; 3] {
    [ParameterName::Mass, ParameterName::QuadraticDrag, ParameterName::BiasForce]
        .map(|name| rows.iter().find(|row| row.parameter == name).map_or("–".to_owned(), &of))
}
