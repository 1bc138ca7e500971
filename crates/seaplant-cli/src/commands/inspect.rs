use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, bail};
use seaplant_campaign::{
    ChannelSummary, InspectedEpoch, InspectedFile, InspectedOffset, Inspection, in_words, inspect,
    inspect_survey,
};
use seaplant_log::{Log, Survey};
use seaplant_report::number::{or_absent, significant, with_minus};

use crate::args::Inspect;
use crate::commands::{contains_any, read_options};
use crate::output::{FAINT, Output, STRONG, WARNING};
use crate::progress::watched;
use crate::summary::{align, plain_table};

pub fn run(arguments: &Inspect, output: Output) -> Result<ExitCode> {
    let options = read_options(&arguments.reading);
    let logs = arguments.logs.iter();
    let files: Vec<_> = logs.map(|path| (path.clone(), options.clone())).collect();
    let inspection = if arguments.whole {
        watched(output, || Log::open(&files).map(|log| inspect(&log)))?
    } else {
        watched(output, || Survey::open(&files).map(inspect_survey))?
    };
    let inspection = narrowed(inspection, &arguments.only)?;
    output.give(&inspection, || words(&inspection))?;
    Ok(ExitCode::SUCCESS)
}

/// Keeps only the requested channels.
fn narrowed(inspection: Inspection, only: &[String]) -> Result<Inspection> {
    let Inspection { channels, .. } = &inspection;
    let wanted = channels.iter().filter(|channel| contains_any(&channel.column, only));
    let channels: Vec<ChannelSummary> = wanted.cloned().collect();
    if channels.is_empty() && !inspection.channels.is_empty() {
        bail!("no column's name contains {}; leave --only out to see all", only.join(" or "));
    }
    Ok(Inspection { channels, ..inspection })
}

/// Returns the last component of a path, which distinguishes files in a table.
fn file_name(path: &str) -> &str {
    Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or(path)
}

/// Describes the parts of a file that were read.
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

/// Formats a number, marked if it is an estimate.
fn figure(channel: &ChannelSummary, field: &str, number: String) -> String {
    let is_estimate = channel.estimated.iter().any(|estimated| estimated == field);
    if is_estimate { format!("≈ {number}") } else { number }
}

/// Number of columns from which logs are shown topic by topic.
const PLAIN: usize = 24;

/// Splits a column into its topic and the rest: `ATT` for `ATT.Roll`, `/dvl` for `/dvl.velocity.x`.
fn topic(channel: &ChannelSummary) -> (&str, &str) {
    channel.column.split_once('.').unwrap_or(("", &channel.column))
}

/// Returns whether the topic of a column differs from that of the one before.
fn is_new_topic(before: Option<&ChannelSummary>, channel: &ChannelSummary) -> bool {
    before.is_none_or(|before| (topic(before).0, &before.file) != (topic(channel).0, &channel.file))
}

fn is_constant(channel: &ChannelSummary) -> bool {
    channel.count > 1 && channel.min == channel.max
}

fn words(inspection: &Inspection) -> String {
    let mut text = String::new();
    let several = inspection.files.len() > 1;
    for file in &inspection.files {
        text +=
            &format!("{STRONG}{}{STRONG:#}: {}, {} bytes\n", file.path, file.format, file.bytes);
        text += &surveyed(file);
        text += &span(file);
    }
    let (constant, varying): (Vec<&ChannelSummary>, Vec<&ChannelSummary>) =
        inspection.channels.iter().partition(|channel| is_constant(channel));
    text += &table(&varying, several, inspection);
    text += &folded(&constant);
    for channel in varying {
        for remark in &channel.remarks {
            text += &format!("{WARNING}{}:{WARNING:#} {}\n", channel.column, with_minus(remark));
        }
        if let Some(longest) = channel.longest_gap_s {
            let longest = significant(longest, 3);
            text += &format!("{FAINT}{}: longest gap {longest} s{FAINT:#}\n", channel.column);
        }
    }
    for note in &inspection.notes {
        text += &format!("{WARNING}note:{WARNING:#} {}\n", with_minus(note));
    }
    if several {
        inspection.files.iter().for_each(|file| text += &clock(file));
    }
    inspection.offsets.iter().for_each(|offset| text += &apart(offset));
    text
}

/// Lists every channel that varies; if there are many, under the name of their topic.
fn table(channels: &[&ChannelSummary], several: bool, inspection: &Inspection) -> String {
    let by_topic = channels.len() > PLAIN;
    let mut table = plain_table();
    let header = ["column", "unit", "samples", "Hz", "from s", "to s", "gaps", "min", "max"];
    table.set_header(header);
    let mut before = None;
    for &channel in channels {
        let file = if several { format!("{}: ", file_name(&channel.file)) } else { String::new() };
        let (of, column) = topic(channel);
        let is_within = by_topic && !of.is_empty();
        if is_within && is_new_topic(before, channel) {
            table.add_row([format!("{file}{of}")]);
        }
        before = Some(channel);
        let name =
            if is_within { format!("  {column}") } else { format!("{file}{}", channel.column) };
        let since = start_s(inspection, &channel.file);
        table.add_row([
            name,
            channel.unit.clone().unwrap_or_else(|| "?".to_owned()),
            figure(channel, "count", channel.count.to_string()),
            figure(channel, "rate_hz", or_absent(channel.rate_hz, 3)),
            figure(channel, "first_s", significant(channel.first_s - since, 6)),
            figure(channel, "last_s", significant(channel.last_s - since, 6)),
            channel.gaps.map_or("–".to_owned(), |gaps| gaps.to_string()),
            significant(channel.min, 4),
            significant(channel.max, 4),
        ]);
    }
    align(&mut table, 2..9);
    format!("{table}\n")
}

/// Maximum number of constant channels that are named; the others are counted.
const NAMED: usize = 12;

/// Lists the constant channels in one line.
fn folded(channels: &[&ChannelSummary]) -> String {
    if channels.is_empty() {
        return String::new();
    }
    let of = |channel: &&ChannelSummary| {
        let unit = channel.unit.as_ref().map_or_else(String::new, |unit| format!(" {unit}"));
        format!("{} = {}{unit}", channel.column, significant(channel.min, 4))
    };
    let named: Vec<String> = channels.iter().take(NAMED).map(of).collect();
    let more = match channels.len() - named.len() {
        0 => String::new(),
        more => format!(" and {more} more; choose columns with --only"),
    };
    format!("{FAINT}constant:{FAINT:#} {}{more}\n", named.join(", "))
}

/// First time from which a clock is taken to count from long before the log, whatever its file
/// states, s.
const LATE_S: f64 = 1e6;

/// Returns whether times are shown from the first sample of a file, as `from_s` of a trial counts
/// them: its clock counts from another instant.
fn is_shifted(file: &InspectedFile, first: f64) -> bool {
    first > LATE_S || (first > 0.0 && file.epoch != InspectedEpoch::Unstated)
}

/// Returns the time from which those of a file are shown.
fn start_s(inspection: &Inspection, path: &str) -> f64 {
    let file = inspection.files.iter().find(|file| file.path == path);
    let first = file.and_then(|file| Some((file, file.span_s?[0])));
    first.filter(|(file, first)| is_shifted(file, *first)).map_or(0.0, |(_, first)| first)
}

/// Describes the start and the duration of a file whose times are shown from its start.
fn span(file: &InspectedFile) -> String {
    let Some([first, last]) = file.span_s.filter(|[first, _]| is_shifted(file, *first)) else {
        return String::new();
    };
    let start = match (file.epoch, instant(first)) {
        (InspectedEpoch::Unix, Some(instant)) => format!("starts {instant} UTC"),
        (InspectedEpoch::Unstated, _) => format!("starts at {first:.3} s"),
        (epoch, _) => format!("starts {first:.3} s after {}", epoch.name()),
    };
    format!("{start}, lasts {}; times below count from there\n", lasting(last - first))
}

/// Formats year, month, day, hour, minute and second of a time since 1970.
fn instant(unix_s: f64) -> Option<String> {
    let instant = jiff::Timestamp::from_second(unix_s.floor() as i64).ok()?;
    Some(instant.strftime("%Y-%m-%d %H:%M:%S").to_string())
}

fn lasting(seconds: f64) -> String {
    if seconds < 120.0 {
        return format!("{} s", significant(seconds, 3));
    }
    let minutes = (seconds / 60.0).floor();
    match minutes < 120.0 {
        true => format!("{minutes:.0} min {:.0} s", (seconds - 60.0 * minutes).floor()),
        false => {
            let hours = (minutes / 60.0).floor();
            format!("{hours:.0} h {:.0} min", minutes - 60.0 * hours)
        }
    }
}

/// Describes the epoch of a file's times, and their span.
fn clock(file: &InspectedFile) -> String {
    let Some([first_s, last_s]) = file.span_s else { return String::new() };
    let (name, epoch) = (file_name(&file.path), file.epoch.name());
    format!(
        "{STRONG}clock of {name}:{STRONG:#} seconds since {epoch}, {first_s:.3} to {last_s:.3}\n"
    )
}

/// Describes the offset of a file's clock to that of the first.
fn apart(offset: &InspectedOffset) -> String {
    let [name, against] = [&offset.file, &offset.against].map(|path| file_name(path));
    let mut text = format!("{STRONG}{name} and {against}:{STRONG:#} ");
    text += &match offset.overlap_s {
        overlap if overlap >= 0.0 => format!("overlap by {overlap:.1} s with the recorded clocks"),
        _ => "do not overlap with the recorded clocks".to_owned(),
    };
    if !offset.same_epoch {
        text += ", which do not count from the same instant";
    }
    text += "\n";
    if let Some(clock) = &offset.clock {
        text +=
            &format!("  by their measurements, move {name} by {}\n", with_minus(&in_words(clock)));
    }
    if let Some(offset_s) = offset.by_satellite_s {
        text += &format!(
            "  by satellite time, move {name} by {} s, to within a second\n",
            with_minus(&format!("{offset_s:+.1}"))
        );
    }
    if let Some(refused) = &offset.refused {
        text += &format!("  {WARNING}{refused}{WARNING:#}\n");
    }
    let doubtful = !offset.same_epoch || offset.overlap_s < 0.0;
    if doubtful && offset.clock.is_none() && offset.refused.is_none() {
        text += "  both files measured nothing from which the offset follows; thrust may give it: write \
                 \"estimate\" for the seconds in campaign.toml\n";
    }
    if let Some(line) = &offset.campaign_line {
        text += &format!("  in campaign.toml, under [[trial]]: {STRONG}{line}{STRONG:#}\n");
    } else if offset.clock.is_some() {
        text += "  which is within its uncertainty: the clocks agree\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(instant(0.0).as_deref(), Some("1970-01-01 00:00:00"));
        // From `date -u -d @1700000000` and `date -u -d @1709251199`, the last second of a leap
        // day.
        assert_eq!(instant(1_700_000_000.9).as_deref(), Some("2023-11-14 22:13:20"));
        assert_eq!(instant(1_709_251_199.0).as_deref(), Some("2024-02-29 23:59:59"));
        assert_eq!(lasting(90.04), "90.0 s");
        assert_eq!(lasting(754.9), "12 min 34 s");
        assert_eq!(lasting(7_260.0), "2 h 1 min");
    }

    /// Returns a file of one channel, 40 000 s long, whose clock starts at `first_s`.
    fn inspection(epoch: InspectedEpoch, first_s: f64) -> Inspection {
        let file = InspectedFile {
            path: "a.csv".to_owned(),
            bytes: 1_000_000_000,
            sha256: None,
            format: "comma-separated text".to_owned(),
            surveyed: true,
            parts: 16,
            bytes_read: 8_400_000,
            epoch,
            span_s: Some([first_s, first_s + 40_000.0]),
        };
        let channel = ChannelSummary {
            file: file.path.clone(),
            column: "u [m/s]".to_owned(),
            unit: Some("m/s".to_owned()),
            count: 4_000_000,
            read: 33_000,
            missing: 0,
            rate_hz: Some(100.0),
            first_s,
            last_s: first_s + 40_000.0,
            gaps: None,
            longest_gap_s: None,
            min: -1.0,
            max: 1.0,
            remarks: Vec::new(),
            estimated: vec!["count".to_owned()],
        };
        Inspection { files: vec![file], channels: vec![channel], ..Inspection::default() }
    }

    fn shown(inspection: &Inspection) -> String {
        anstream::adapter::strip_str(&words(inspection)).to_string().replace('\u{202f}', "")
    }

    #[test]
    fn times_of_an_autopilot_count_from_its_first_sample() {
        let words = shown(&inspection(InspectedEpoch::Start, 112.3));
        assert!(
            words.contains("starts 112.300 s after the autopilot started, lasts 11 h"),
            "{words}"
        );
        let row: Vec<&str> = words.lines().last().unwrap_or_default().split_whitespace().collect();
        assert_eq!(row[6..8], ["0", "40000.0"], "{words}");
        // A clock of unknown epoch keeps its own times, which are those of the table.
        let words = shown(&inspection(InspectedEpoch::Unstated, 112.3));
        assert!(words.contains("112.300"), "{words}");
    }

    #[test]
    fn estimates_are_marked() {
        let words = shown(&inspection(InspectedEpoch::default(), 0.0));
        assert!(words.contains("surveyed: 8.4 MB in 16 parts were read."), "{words}");
        let row: Vec<&str> = words.lines().last().unwrap_or_default().split_whitespace().collect();
        assert_eq!(
            row,
            ["u", "[m/s]", "m/s", "≈", "4000000", "100", "0", "40000.0", "–", "−1.000", "1.000"]
        );
    }
}
