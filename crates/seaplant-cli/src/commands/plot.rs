//! `plot`: shows a log before the fit, in the terminal and as a page.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use seaplant_log::{Channel, Log};
use seaplant_report::number::significant;
use seaplant_report::{Track, is_log_page, log_page};
use serde_json::json;

use crate::args::Plot;
use crate::commands::{is_wanted, read_options};
use crate::output::{FAINT, Output, STRONG};
use crate::progress::watched;
use crate::sketch::over_time;
use crate::writing::{Permit, check_writable, write_file};

/// Maximum number of charts on a page.
const MOST_CHARTS: usize = 200;

pub fn run(arguments: &Plot, output: Output) -> Result<ExitCode> {
    let permit = Permit::new(&arguments.logs, arguments.force);
    if let Some(path) = &arguments.out {
        check_writable(path, permit, is_log_page).with_context(|| path.display().to_string())?;
    }
    let options = read_options(&arguments.reading);
    let logs = arguments.logs.iter();
    let files: Vec<_> = logs.map(|path| (path.clone(), options.clone())).collect();
    let log = watched(output, || Log::open(&files))?;
    let all = || log.channels().iter().filter(|channel| is_wanted(channel, &arguments.only));
    let (shown, constant): (Vec<&Channel>, Vec<&Channel>) =
        all().partition(|of| of.min() != of.max());
    if shown.is_empty() && constant.is_empty() {
        bail!(
            "no channel's name contains {}; `seaplant inspect` lists all",
            arguments.only.join(" or ")
        );
    }
    let start = start_s(&log);
    if let Some(path) = &arguments.out {
        if shown.len() > MOST_CHARTS {
            bail!(
                "{} channels vary, and a page holds {MOST_CHARTS}; choose some with --only NAME",
                shown.len()
            );
        }
        write_file(path, &page(arguments, &shown, start, path)?, permit, is_log_page)?;
    }
    let names = |of: &[&Channel]| of.iter().map(|c| c.column.clone()).collect::<Vec<_>>();
    let result =
        json!({ "channels": names(&shown), "constant": names(&constant), "page": arguments.out });
    output.give(&result, || words(&shown, &constant, start, arguments.out.as_deref()))?;
    Ok(ExitCode::SUCCESS)
}

/// Returns the first time of any channel, from which a campaign's `from_s` counts.
fn start_s(log: &Log) -> f64 {
    let first = log.channels().iter().filter_map(|channel| channel.time_s().first().copied());
    first.fold(f64::INFINITY, f64::min)
}

fn page(arguments: &Plot, shown: &[&Channel], start: f64, path: &Path) -> Result<Vec<u8>> {
    let base = path.parent().unwrap_or(Path::new(""));
    let named =
        |log: &std::path::PathBuf| log.strip_prefix(base).unwrap_or(log).display().to_string();
    let logs: Vec<String> = arguments.logs.iter().map(named).collect();
    let track = |channel: &&Channel| Track {
        name: channel.column.clone(),
        unit: channel.unit.as_ref().map(|unit| unit.symbol().to_owned()),
        time_s: channel.time_s().iter().map(|t| t - start).collect(),
        values: channel.values().to_vec(),
    };
    let tracks: Vec<Track> = shown.iter().map(track).collect();
    Ok(log_page(&logs.join(", "), &logs, &tracks)?)
}

fn words(shown: &[&Channel], constant: &[&Channel], start: f64, page: Option<&Path>) -> String {
    let ends = shown.iter().filter_map(|channel| channel.time_s().last().copied());
    let end = ends.fold(start, f64::max);
    let widest = shown.iter().map(|channel| channel.column.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for channel in shown {
        let [low, high] = [channel.min(), channel.max()].map(|x| significant(x.unwrap_or(0.0), 4));
        let unit = channel.unit.as_ref().map_or("?", |unit| unit.symbol());
        text += &format!(
            "{STRONG}{:<widest$}{STRONG:#}  {}  {FAINT}{low} to {high} {unit}{FAINT:#}\n",
            channel.column,
            over_time(channel.time_s(), channel.values(), start, end),
        );
    }
    text += &format!("{FAINT}over {} s{FAINT:#}\n", significant(end - start, 4));
    if !constant.is_empty() {
        let names: Vec<&str> = constant.iter().map(|channel| channel.column.as_str()).collect();
        text += &format!("{FAINT}constant: {}{FAINT:#}\n", names.join(", "));
    }
    if let Some(page) = page {
        text += &format!("{}\n", page.display());
    }
    text
}
