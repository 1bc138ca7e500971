use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use seaplant_campaign::{
    ChannelSummary, InspectedFile, InspectedOffset, Inspection, in_words, inspect, inspect_survey,
};
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
        watched(output, || Survey::open(&files).map(inspect_survey))?
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

#[cfg(test)]
mod tests {
    use seaplant_campaign::InspectedEpoch;

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
            epoch: InspectedEpoch::default(),
            span_s: None,
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
            Inspection { files: vec![file], channels: vec![channel], ..Inspection::default() };
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
