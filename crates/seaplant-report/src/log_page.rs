//! Writes the channels of a log as one page, for inspection and for marking trials.

use crate::Error;
use crate::chart::{Cut, Horizontal, Line, Panel};
use crate::chart_page::{ChartPage, LiveChart};
use crate::control::CurveChart;
use crate::figure::{Ink, curves_scene, inline_svg};
use crate::number::significant;
use crate::visible::is_obeyed;

/// A channel to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Its column.
    pub name: String,
    /// Its unit, if known.
    pub unit: Option<String>,
    /// Instants, s after the first sample of the log.
    pub time_s: Vec<f64>,
    /// Values, one for each instant.
    pub values: Vec<f64>,
}

/// Approximate number of points of all lines of a page: what a browser loads and draws without
/// delay.
const POINTS: usize = 4_000_000;

/// Height of a channel's panel, px.
const PANEL_PX: u16 = 110;

/// Writes the page of a log: a panel for each channel over one time axis. Marked ranges become
/// `[[trial]]` entries of a campaign; `logs` are the files as it names them.
///
/// # Errors
/// [`Error::Figure`], [`Error::Template`], [`Error::Json`].
pub fn log_page(title: &str, logs: &[String], tracks: &[Track]) -> Result<Vec<u8>, Error> {
    let ends = tracks.iter().filter_map(|track| track.time_s.last());
    let last = ends.copied().fold(0.0, f64::max);
    let most = POINTS / tracks.len().max(1);
    let stills: Result<Vec<String>, Error> = tracks.iter().map(still).collect();
    let logs: Vec<String> = logs.iter().map(|log| format!("\"{}\"", toml_text(log))).collect();
    let chart = LiveChart {
        id: "log".to_owned(),
        title: "Channels over time".to_owned(),
        x: Horizontal::seconds("time"),
        panels: tracks.iter().map(|track| panel(track, most)).collect(),
        description: String::new(),
        stills: stills?,
    };
    let page = ChartPage {
        mark: MARK,
        kind: "Log",
        title: title.to_owned(),
        lead: vec![format!(
            "{} channels over {} s. Drag over a stretch to see it closer; “Mark trial” then writes its \
             entry for campaign.toml above the charts.",
            tracks.len(),
            significant(last, 4),
        )],
        charts: (!tracks.is_empty()).then_some(chart).into_iter().collect(),
        logs: Some(format!("[{}]", logs.join(", "))),
        ..ChartPage::default()
    };
    page.bytes()
}

/// Formats `speed, m/s`, unless the column's name states its unit.
fn label(track: &Track) -> String {
    match &track.unit {
        Some(unit) if track.name.contains(&format!("[{unit}]")) => track.name.clone(),
        Some(unit) => format!("{}, {unit}", track.name),
        None => format!("{}, unit not stated", track.name),
    }
}

fn panel(track: &Track, most: usize) -> Panel {
    let cut = Cut::to_points(&track.time_s, most);
    Panel {
        label: label(track),
        height: PANEL_PX,
        x: cut.times(),
        lines: vec![Line::new(&track.name, Ink::Force, cut.pack(&track.values))],
        ..Panel::default()
    }
}

/// Draws a channel for print and without script.
fn still(track: &Track) -> Result<String, Error> {
    let scene = curves_scene(&CurveChart {
        title: track.name.clone(),
        caption: label(track),
        x_label: "time",
        x_unit: "s",
        is_logarithmic: false,
        y_label: track.unit.clone().unwrap_or_default(),
        x: track.time_s.clone(),
        line: (track.name.clone(), track.values.clone()),
        beside: None,
        band: None,
    })?;
    Ok(inline_svg(&scene))
}

/// Formats a path as TOML string content, with control characters shown by their number.
fn toml_text(path: &str) -> String {
    let path = path.replace('\\', "/").replace('"', "\\\"");
    let shown = |c| if is_obeyed(c) { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() };
    path.chars().map(shown).collect()
}

/// First bytes of every such page.
const MARK: &str = "<!DOCTYPE html><!-- seaplant plot -->";

/// Returns whether a file begins like such a page.
pub fn is_log_page(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_shows_every_channel_and_escapes_its_name() {
        let track = Track {
            name: "<u>".to_owned(),
            unit: Some("m/s".to_owned()),
            time_s: vec![0.0, 1.0, 2.0],
            values: vec![0.0, 1.0, 0.5],
        };
        let page = log_page("a & b", &["x\"y.csv".to_owned()], &[track]).expect("a page");
        assert!(is_log_page(&page));
        let text = String::from_utf8(page).expect("text");
        assert!(text.contains("&lt;u&gt;") && !text.contains("<u>"), "{text}");
        assert!(text.contains("a &amp; b"), "{text}");
        assert!(text.contains("data-logs=\"[&quot;x\\&quot;y.csv&quot;]\""), "{text}");
        assert!(text.contains("\"label\":\"\\u003cu>, m/s\""), "{text}");
    }

    #[test]
    fn control_characters_are_shown_by_their_number() {
        let name = "u\u{1b}[2J\u{202e}".to_owned();
        let track = Track { name, unit: None, time_s: vec![0.0, 1.0], values: vec![0.0, 1.0] };
        let page = log_page("a\u{202e}", &["x\u{1b}.csv".to_owned()], &[track]).expect("a page");
        let text = String::from_utf8(page).expect("text");
        assert!(!text.contains(is_obeyed), "{text}");
        assert!(text.contains("u\\\\u{1b}[2J\\\\u{202e}, unit not stated"), "{text}");
        // The campaign's entry contains the name of the file.
        assert!(text.contains("data-logs=\"[&quot;x\\u001b.csv&quot;]\""), "{text}");
    }

    #[test]
    fn a_log_without_channels_has_a_page() {
        assert!(is_log_page(&log_page("empty", &[], &[]).expect("a page")));
    }
}
