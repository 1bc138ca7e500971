use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use seaplant_campaign::{ChannelSummary, InspectedFile, Inspection, inspect, inspect_survey};
use seaplant_log::{Log, Survey};
use seaplant_report::number::{or_absent, significant};

use crate::args::Inspect;
use crate::commands::read_options;
use crate::output::{FAINT, Output, STRONG, WARNING};
use crate::progress::watched;
use crate::summary::{align, plain_table};

pub fn run(arguments: &Inspect, output: Output) -> Result<ExitCode> {
    let options = read_options(&arguments.reading);
    let files: Vec<_> = arguments.logs.iter().map(|path| (path.clone(), options.clone())).collect();
    let inspection = if arguments.whole {
        watched(output, || Log::open(&files).map(|log| inspect(&log)))?
    } else {
        watched(output, || Survey::open(&files).map(|survey| inspect_survey(&survey)))?
    };
    output.give(&inspection, || words(&inspection))?;
    Ok(ExitCode::SUCCESS)
}

/// The last part of a path: what tells files apart in a table.
fn file_name(path: &str) -> &str {
    Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or(path)
}

/// What was read of a file that was not read whole.
fn surveyed(file: &InspectedFile) -> String {
    if !file.surveyed {
        return String::new();
    }
    let megabytes = significant(file.bytes_read as f64 / 1e6, 2);
    format!(
        "surveyed: {megabytes} MB in {} parts were read. ≈ marks estimates; min, max, remarks and what \
         notes count are of these parts; gaps are not looked for. --whole reads all of it.\n",
        file.parts
    )
}

/// A number, marked if it is an estimate.
fn figure(channel: &ChannelSummary, field: &str, number: String) -> String {
    let is_estimate = channel.estimated.iter().any(|estimated| estimated == field);
    if is_estimate { format!("≈ {number}") } else { number }
}

fn words(inspection: &Inspection) -> String {
    let mut text = String::new();
    let several = inspection.files.len() > 1;
    for file in &inspection.files {
        text +=
            &format!("{STRONG}{}{STRONG:#}: {}, {} bytes\n", file.path, file.format, file.bytes);
        text += &surveyed(file);
    }
    let mut table = plain_table();
    let header = ["column", "unit", "samples", "Hz", "first s", "last s", "gaps", "min", "max"];
    table.set_header(header);
    for channel in &inspection.channels {
        let name = if several {
            format!("{}: {}", file_name(&channel.file), channel.column)
        } else {
            channel.column.clone()
        };
        table.add_row([
            name,
            channel.unit.clone().unwrap_or_else(|| "?".to_owned()),
            figure(channel, "count", channel.count.to_string()),
            figure(channel, "rate_hz", or_absent(channel.rate_hz, 3)),
            figure(channel, "first_s", significant(channel.first_s, 6)),
            figure(channel, "last_s", significant(channel.last_s, 6)),
            channel.gaps.map_or("–".to_owned(), |gaps| gaps.to_string()),
            significant(channel.min, 4),
            significant(channel.max, 4),
        ]);
    }
    align(&mut table, 2..9);
    text += &format!("{table}\n");
    for channel in &inspection.channels {
        for remark in &channel.remarks {
            text += &format!("{WARNING}{}:{WARNING:#} {remark}\n", channel.column);
        }
        if let Some(longest) = channel.longest_gap_s {
            let longest = significant(longest, 3);
            text += &format!("{FAINT}{}: longest gap {longest} s{FAINT:#}\n", channel.column);
        }
    }
    for note in &inspection.notes {
        text += &format!("{WARNING}note:{WARNING:#} {note}\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn estimates_are_marked() {
        let file = InspectedFile {
            path: "a.csv".to_owned(),
            bytes: 1_000_000_000,
            sha256: None,
            format: "comma-separated text".to_owned(),
            surveyed: true,
            parts: 16,
            bytes_read: 8_400_000,
        };
        let channel = ChannelSummary {
            file: file.path.clone(),
            column: "u [m/s]".to_owned(),
            unit: Some("m/s".to_owned()),
            count: 4_000_000,
            read: 33_000,
            missing: 0,
            rate_hz: Some(100.0),
            first_s: 0.0,
            last_s: 40_000.0,
            gaps: None,
            longest_gap_s: None,
            min: -1.0,
            max: 1.0,
            remarks: Vec::new(),
            estimated: vec!["count".to_owned()],
        };
        let inspection =
            Inspection { files: vec![file], channels: vec![channel], notes: Vec::new() };
        let words = anstream::adapter::strip_str(&words(&inspection)).to_string();
        assert!(words.contains("surveyed: 8.4 MB in 16 parts were read."), "{words}");
        let row: Vec<&str> = words.lines().last().unwrap_or_default().split_whitespace().collect();
        assert_eq!(
            row,
            [
                "u", "[m/s]", "m/s", "≈", "4000000", "100", "0", "40", "000.0", "–", "−1.000",
                "1.000"
            ]
        );
    }
}
