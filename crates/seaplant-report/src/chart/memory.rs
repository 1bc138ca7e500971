//! Chart of the autocorrelation of a simulation's error.

use seaplant::signal::autocorrelation;
use seaplant::{Dof, Role};

use super::{Chart, Horizontal, Line, Panel, Subject, Values};
use crate::decimate::runs;
use crate::figure::Ink;
use crate::number::significant;
use crate::paths::Paths;
use crate::words;

/// Longest lag, s.
const LONGEST_S: f64 = 60.0;
/// Longest lag, as a fraction of the record.
const LONGEST_PART: f64 = 0.25;
/// Maximum number of lags.
const MOST_LAGS: usize = 300;
/// Minimum number of samples.
const FEWEST: usize = 32;

/// Autocorrelation of one trial's error.
pub(super) struct Memory {
    trial: String,
    role: Role,
    /// Step between lags.
    step_s: f64,
    correlation: Vec<f64>,
    samples: usize,
}

impl Memory {
    /// Computes it from the longest stretch without a gap; `None` if that is too short.
    pub(super) fn new(trial: &str, role: Role, time_s: &[f64], difference: &[f64]) -> Option<Self> {
        let longest = runs(time_s).into_iter().max_by_key(std::ops::Range::len)?;
        let (time_s, difference) = (&time_s[longest.clone()], &difference[longest]);
        let samples = time_s.len();
        if samples < FEWEST {
            return None;
        }
        let span_s = time_s[samples - 1] - time_s[0];
        let step_s = span_s / (samples - 1) as f64;
        let furthest = (LONGEST_S.min(LONGEST_PART * span_s) / step_s) as usize;
        let stride = furthest.div_ceil(MOST_LAGS).max(1);
        let correlation = autocorrelation(difference, (0..=furthest).step_by(stride));
        let step_s = stride as f64 * step_s;
        Some(Self { trial: trial.to_owned(), role, step_s, correlation, samples })
    }

    /// Returns the lag at which the correlation first falls below 1/e, s.
    fn memory_s(&self) -> Option<f64> {
        let below = |r: &f64| *r < (-1.0_f64).exp();
        Some(self.step_s * self.correlation.iter().position(below)? as f64)
    }
}

pub(super) fn chart(dof: Dof, memories: Vec<&Memory>, ids: &mut Paths) -> Option<Chart> {
    // Lines of one panel have common lags: trials with other rates have panels of their own.
    let mut panels: Vec<(f64, Panel)> = Vec::new();
    for memory in &memories {
        let name = format!("{} ({})", memory.trial, words::role(memory.role));
        let place = panels
            .iter()
            .position(|(step_s, panel)| *step_s == memory.step_s && panel.lines.len() < INKS.len());
        let place = place.unwrap_or_else(|| {
            panels.push((memory.step_s, Panel::default()));
            panels.len() - 1
        });
        let (_, panel) = &mut panels[place];
        let lags = memory.correlation.len();
        let longest = (0..lags).map(|k| k as f64 * memory.step_s);
        if panel.lines.is_empty() {
            panel.levels = white(memory.samples);
            panel.label = "Autocorrelation".to_owned();
            panel.height = 180;
            panel.x = Values::of_times(&longest.collect::<Vec<_>>());
        }
        let ink = INKS[panel.lines.len()];
        panel.lines.push(Line::new(name, ink, Values::pack(&memory.correlation)));
    }
    if panels.is_empty() {
        return None;
    }
    Some(Chart {
        subject: Subject::Memory,
        id: ids.unique(&["memory", dof.name()]),
        title: "Autocorrelation of simulated − measured".to_owned(),
        description: description(&memories),
        files: Vec::new(),
        plant: dof.name().to_owned(),
        stills: Vec::new(),
        x: Horizontal::seconds("lag"),
        panels: panels.into_iter().map(|(_, panel)| panel).collect(),
    })
}

/// Returns levels; white noise lies within the outer two at 95 of 100 lags.
pub(super) fn white(samples: usize) -> Vec<f64> {
    let bound = 1.96 / (samples.max(1) as f64).sqrt();
    vec![-bound, 0.0, bound]
}

/// Inks of the trials in one panel.
pub(super) const INKS: [Ink; 4] = [Ink::Simulated, Ink::Other1, Ink::Other2, Ink::Other3];

fn description(memories: &[&Memory]) -> String {
    let each: Vec<String> = memories
        .iter()
        .map(|memory| match memory.memory_s() {
            Some(s) => format!("{} {} s", memory.trial, significant(s, 2)),
            None => format!("{} longer than shown", memory.trial),
        })
        .collect();
    format!(
        "Autocorrelation of the recommended plant's simulation error, trial by trial; pure measurement noise would stay between the outer lines at every lag but zero. It falls below 1/e after: {}. A slow decay means that something is missing from the plant: a current, a tether, or a term.",
        each.join("; ")
    )
}
