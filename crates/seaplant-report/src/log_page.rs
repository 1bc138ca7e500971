//! The channels of a log as one page: look, and mark trials.

use std::fmt::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use sha2::{Digest, Sha256};

use crate::decimate::{decimate, runs};
use crate::number::significant;
use crate::words::escaped;

/// A channel as it is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// Its column.
    pub name: String,
    /// Its unit, where that is known.
    pub unit: Option<String>,
    /// Instants, s after the first sample of the log.
    pub time_s: Vec<f64>,
    /// Values, as many.
    pub values: Vec<f64>,
}

/// Points of a line.
const POINTS: usize = 2000;

/// The drawing's width and height.
const SIZE: (f64, f64) = (1000.0, 80.0);

const STYLE: &str = include_str!("../templates/log.css");
const SCRIPT: &str = include_str!("../templates/log.js");

/// The page of a log: a chart for each channel over one time axis. Stretches that are dragged over
/// become `[[trial]]` entries of a campaign; `logs` are the files as it names them.
pub fn log_page(title: &str, logs: &[String], tracks: &[Track]) -> Vec<u8> {
    let ends =
        tracks.iter().flat_map(|track| track.time_s.first().into_iter().chain(track.time_s.last()));
    let last = ends.copied().fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let drawn: String = tracks.iter().map(|track| drawn(track, last)).collect();
    let logs: Vec<String> = logs
        .iter()
        .map(|log| format!("\"{}\"", log.replace('\\', "/").replace('"', "\\\"")))
        .collect();
    let hash = STANDARD.encode(Sha256::digest(SCRIPT));
    let title = escaped(title);
    let page = format!(
        "{MARK}\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"><meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'sha256-{hash}'\"><title>{title}</title>\n<style>{STYLE}</style></head>\n<body data-last=\"{last}\" data-logs=\"{}\"><h1>{title}</h1>\n<p>{} channels over {} s. Drag over a stretch to mark a trial; its entry for campaign.toml appears below.</p>\n<pre id=\"marks\" hidden></pre>\n<main>\n{drawn}</main>\n<script>{SCRIPT}</script></body></html>\n",
        escaped(&format!("[{}]", logs.join(", "))),
        tracks.len(),
        significant(last, 4),
    );
    page.into_bytes()
}

fn drawn(track: &Track, last: f64) -> String {
    let (width, height) = SIZE;
    let low = track.values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = track.values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let span = (high - low).max(f64::MIN_POSITIVE);
    let mut path = String::new();
    for run in runs(&track.time_s) {
        let (t, y) = (&track.time_s[run.clone()], &track.values[run]);
        for (k, (t, y)) in decimate(t, y, POINTS).into_iter().enumerate() {
            let letter = if k == 0 { 'M' } else { 'L' };
            let up = height - 2.0 - (height - 4.0) * (y - low) / span;
            // Writing to a string cannot fail.
            let _ = write!(path, "{letter}{:.1} {up:.1}", width * t / last);
        }
    }
    let unit = track.unit.as_deref().unwrap_or("unit not stated");
    let label =
        format!("{} [{unit}], {} to {}", track.name, significant(low, 4), significant(high, 4));
    let label = escaped(&label);
    format!(
        "<figure><figcaption>{label}</figcaption><svg viewBox=\"0 0 {width} {height}\" preserveAspectRatio=\"none\" role=\"img\" aria-label=\"{label}\"><path d=\"{path}\"/></svg></figure>\n"
    )
}

/// What every such page begins with.
const MARK: &str = "<!DOCTYPE html><!-- seaplant plot -->";

/// Whether a file begins as such a page.
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
        let page = log_page("a & b", &["x\"y.csv".to_owned()], &[track]);
        assert!(is_log_page(&page));
        let text = String::from_utf8(page).expect("text");
        assert!(text.contains("&lt;u&gt; [m/s], 0 to 1") && !text.contains("<u>"), "{text}");
        assert!(text.contains("M0.0 78.0L500.0 2.0L1000.0 40.0"), "{text}");
        assert!(text.contains("a &amp; b") && text.contains("x\\&quot;y.csv"), "{text}");
    }

    #[test]
    fn a_log_without_channels_has_a_page() {
        assert!(is_log_page(&log_page("empty", &[], &[])));
    }
}
