//! Section on the evolution of parameters, for methods that work sample by sample.

use std::fmt::Write as _;

use seaplant::Method;
use seaplant::results::{OnlineHistory, Results};
use serde::Serialize;

use super::table::{Row, Table};
use crate::number::{ABSENT, or_absent, significant};
use crate::words::{self, escaped};

/// One plant by one method.
#[derive(Serialize)]
pub(crate) struct OnlinePlant {
    title: String,
    svg: String,
    caption: String,
    table: Table,
}

/// Returns every plant that has a history.
pub(crate) fn views(results: &Results) -> Vec<OnlinePlant> {
    let all = results.methods.iter().flat_map(|(name, methods)| {
        methods.iter().map(move |(method, plant)| (name, *method, plant))
    });
    all.filter_map(|(name, method, plant)| Some(view(name, method, plant.history.as_ref()?)))
        .collect()
}

fn view(name: &str, method: Method, history: &OnlineHistory) -> OnlinePlant {
    let last_s = history.time_s.last().copied().unwrap_or(0.0);
    let changes = match history.changes.len() {
        0 => unnoticed(history.noticeable_change),
        _ => {
            let of = |change: &seaplant::results::PlantChanged| {
                format!("{:.0} s of {}", change.since_s, change.trial)
            };
            let all: Vec<String> = history.changes.iter().map(of).collect();
            format!("The plant seemed to change at {}.", all.join(", "))
        }
    };
    let caption = format!(
        "Each parameter over its last value, from half to one and a half, in {last_s:.0} s of motion. {changes}"
    );
    let rows = history.parameters.iter().map(|(name, values)| {
        let settled = history.settled_s.get(name).copied().flatten();
        let settled = settled.map_or(ABSENT.to_owned(), |s| format!("{s:.0}"));
        Row::new([name.clone(), or_absent(values.last().copied(), 4), settled])
    });
    let note = format!(
        "Settled: the motion after which it stayed within 5 % of its last value. The combination of parameters that the motion determines least has {} of the information that these have one by one.",
        or_absent(Some(history.excitation), 2)
    );
    OnlinePlant {
        title: format!("{}, {}", words::capitalised(name), words::method(method)),
        svg: svg(history),
        caption,
        table: Table::new(
            "Where they settled",
            ["parameter", "last value", "settled, s"],
            rows.collect(),
        )
        .noted(&note),
    }
}

/// Notes that no change was detected, and the smallest detectable one.
fn unnoticed(noticeable: Option<f64>) -> String {
    let which = match noticeable {
        None => "the motion is too short to tell of one".to_owned(),
        Some(part) if part > 1.0 => {
            "even twice the mass would have gone unnoticed, for forces that are not logged hide it"
                .to_owned()
        }
        Some(part) => format!(
            "one of {} % of every mass would have been, within two minutes",
            significant(100.0 * part, 2)
        ),
    };
    format!("No change of the plant was noticed: {which}.")
}

/// Width and height of the drawing, and its margin.
const SIZE: (f64, f64) = (720.0, 220.0);
const MARGIN: f64 = 8.0;

/// Draws one line for each parameter, named by its title.
fn svg(history: &OnlineHistory) -> String {
    let (width, height) = SIZE;
    let mut text = format!(
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"History of the parameters\">"
    );
    let (first, last) = match history.time_s[..] {
        [first, .., last] if last > first => (first, last),
        _ => return text + "</svg>",
    };
    let x = |t: f64| MARGIN + (t - first) / (last - first) * (width - 2.0 * MARGIN);
    // From one and a half at the top to a half at the bottom.
    let y = |part: f64| MARGIN + (1.5 - part.clamp(0.5, 1.5)) * (height - 2.0 * MARGIN);
    for part in [0.95, 1.05] {
        // Writing to a text cannot fail.
        let _ = write!(
            text,
            "<line x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"currentColor\" stroke-dasharray=\"3 4\" opacity=\"0.5\"/>",
            MARGIN,
            width - MARGIN,
            y = y(part)
        );
    }
    for (k, (name, values)) in history.parameters.iter().enumerate() {
        let Some(end) = values.last().copied().filter(|end| *end != 0.0) else { continue };
        let points: Vec<String> = history
            .time_s
            .iter()
            .zip(values)
            .map(|(t, value)| format!("{:.1},{:.1}", x(*t), y(value / end)))
            .collect();
        let hue = (k * 67) % 360;
        let _ = write!(
            text,
            "<polyline fill=\"none\" stroke=\"hsl({hue} 55% 45%)\" stroke-width=\"1.4\" points=\"{}\"><title>{}</title></polyline>",
            points.join(" "),
            escaped(name)
        );
    }
    text + "</svg>"
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn a_history_is_drawn_and_described() {
        let history = OnlineHistory {
            time_s: vec![20.0, 30.0, 40.0],
            parameters: BTreeMap::from([("sway: |v|v".to_owned(), vec![80.0, 98.0, 100.0])]),
            settled_s: BTreeMap::from([("sway: |v|v".to_owned(), Some(30.0))]),
            excitation: 0.25,
            changes: Vec::new(),
            noticeable_change: Some(0.123),
        };
        let view = view("sway-yaw", Method::Adaptive, &history);
        assert!(view.svg.matches("<polyline").count() == 1, "{}", view.svg);
        assert!(view.svg.contains("712.0,110.0"), "the last value is in the middle: {}", view.svg);
        assert_eq!(view.table.rows[0].cells[2], "30");
        assert!(view.caption.contains("one of 12 % of every mass"), "{}", view.caption);
    }
}
