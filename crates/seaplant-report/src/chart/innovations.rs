//! Chart of the innovations' autocorrelation, which reveals whether they are white.

use seaplant::estimate::Innovations;
use seaplant::results::PlantResult;

use super::memory::{INKS, white};
use super::{Chart, Horizontal, Line, Panel, Subject, Values};
use crate::number::significant;
use crate::paths::Paths;

/// Returns `None` for a method without one-step predictions.
pub(super) fn chart(name: &str, plant: &PlantResult, ids: &mut Paths) -> Option<Chart> {
    let panels: Vec<Panel> = plant.innovations.chunks(INKS.len()).map(panel).collect();
    (!panels.is_empty()).then(|| Chart {
        subject: Subject::Memory,
        id: ids.unique(&["innovations", name]),
        title: "Whiteness of one-step prediction errors".to_owned(),
        description: description(&plant.innovations),
        files: Vec::new(),
        plant: name.to_owned(),
        stills: Vec::new(),
        x: Horizontal { label: "lag".to_owned(), unit: "samples", ..Horizontal::default() },
        panels,
    })
}

fn panel(trials: &[Innovations]) -> Panel {
    let longest = trials.iter().map(|trial| trial.autocorrelation.len()).max().unwrap_or_default();
    let lines = trials.iter().zip(INKS).map(|(trial, ink)| {
        let mut correlation = trial.autocorrelation.clone();
        correlation.resize(longest, f64::NAN);
        Line::new(trial.trial.clone(), ink, Values::pack(&correlation))
    });
    Panel {
        label: "Autocorrelation".to_owned(),
        height: 180,
        x: Values::pack(&(0..longest).map(|k| k as f64).collect::<Vec<_>>()),
        lines: lines.collect(),
        levels: white(trials.iter().map(|trial| trial.samples).min().unwrap_or_default()),
        ..Panel::default()
    }
}

fn description(trials: &[Innovations]) -> String {
    let after = |trial: &Innovations| trial.autocorrelation.get(1).copied().unwrap_or_default();
    let each: Vec<String> = trials
        .iter()
        .map(|trial| format!("{} {}", trial.trial, significant(after(trial), 2)))
        .collect();
    format!(
        "Autocorrelation of what the filter could not predict from one sample to the next. If the model of the plant, its disturbance and the noise is right, 95 of 100 lags lie between the outer lines, and the intervals can be believed. At a lag of one sample: {}.",
        each.join("; ")
    )
}
