use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use seaplant_campaign::{Inspection, inspect};
use seaplant_log::Log;
use seaplant_report::number::{or_absent, significant};

use crate::args::Inspect;
use crate::commands::read_options;
use crate::output::{FAINT, Output, STRONG, WARNING};
use crate::summary::{align, plain_table};

pub fn run(arguments: &Inspect, output: Output) -> Result<ExitCode> {
    let options = read_options(&arguments.reading);
    let files: Vec<_> = arguments.logs.iter().map(|path| (path.clone(), options.clone())).collect();
    let log = Log::open(&files)?;
    let inspection = inspect(&log);
    output.give(&inspection, || words(&inspection))?;
    Ok(ExitCode::SUCCESS)
}

/// The last part of a path: what tells files apart in a table.
fn file_name(path: &str) -> &str {
    Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or(path)
}

fn words(inspection: &Inspection) -> String {
    let mut text = String::new();
    let several = inspection.files.len() > 1;
    for file in &inspection.files {
        text +=
            &format!("{STRONG}{}{STRONG:#}: {}, {} bytes\n", file.path, file.format, file.bytes);
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
            channel.count.to_string(),
            or_absent(channel.rate_hz, 3),
            significant(channel.first_s, 6),
            significant(channel.last_s, 6),
            channel.gaps.to_string(),
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
