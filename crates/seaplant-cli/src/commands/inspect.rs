use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use seaplant_campaign::{InspectedFile, InspectedOffset, Inspection, in_words, inspect};
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
    if several {
        inspection.files.iter().for_each(|file| text += &clock(file));
    }
    inspection.offsets.iter().for_each(|offset| text += &apart(offset));
    text
}

/// What the times of a file count from, and their span.
fn clock(file: &InspectedFile) -> String {
    let Some([first_s, last_s]) = file.span_s else { return String::new() };
    let (name, epoch) = (file_name(&file.path), file.epoch.name());
    format!(
        "{STRONG}clock of {name}:{STRONG:#} seconds since {epoch}, {first_s:.3} to {last_s:.3}\n"
    )
}

/// How far the clock of a file is from that of the first.
fn apart(offset: &InspectedOffset) -> String {
    let [name, against] = [&offset.file, &offset.against].map(|path| file_name(path));
    let mut text = format!("{STRONG}{name} and {against}:{STRONG:#} ");
    text += &match offset.overlap_s {
        overlap if overlap >= 0.0 => format!("share {overlap:.1} s as their clocks stand"),
        _ => "share no time as their clocks stand".to_owned(),
    };
    if !offset.same_epoch {
        text += ", and do not count from the same instant";
    }
    text += "\n";
    if let Some(clock) = &offset.clock {
        text += &format!("  by what they measured, {name} is to be moved by {}\n", in_words(clock));
    }
    if let Some(offset_s) = offset.by_satellite_s {
        text += &format!(
            "  by satellite time, {name} is to be moved by {offset_s:+.1} s, good to a second\n"
        );
    }
    if let Some(refused) = &offset.refused {
        text += &format!("  {WARNING}{refused}{WARNING:#}\n");
    }
    let doubtful = !offset.same_epoch || offset.overlap_s < 0.0;
    if doubtful && offset.clock.is_none() && offset.refused.is_none() {
        text += "  nothing that both measured tells how far they are apart; thrust may: write \
                 \"estimate\" for the seconds in campaign.toml\n";
    }
    if let Some(line) = &offset.campaign_line {
        text += &format!("  in campaign.toml, under [[trial]]: {STRONG}{line}{STRONG:#}\n");
    } else if offset.clock.is_some() {
        text += "  which is no more than the data can tell: the clocks agree\n";
    }
    text
}
