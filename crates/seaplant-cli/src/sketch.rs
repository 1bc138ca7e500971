//! Draws measured and simulated velocity as two lines of text.

use std::collections::BTreeMap;
use std::ops::Range;

use seaplant::results::{ComparisonFigure, PlantResult, Results, Series};
use seaplant::{Comparison, Dof, Role};
use seaplant_report::number::significant;

use crate::output::FAINT;

/// Length of a line in characters.
const COLUMNS: usize = 64;
/// Characters per period of the excitation: fewer hide its shape.
const COLUMNS_A_PERIOD: f64 = 8.0;

const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// A sketch of each axis of each recommended plant, from series that are processed one at a time.
#[derive(Default)]
pub struct Sketches(BTreeMap<(String, Dof), (Role, String)>);

impl Sketches {
    /// Adds a series, if it is of a recommended plant; a held-out trial is preferred.
    pub fn see(&mut self, series: &Series, results: &Results) {
        let Series::Comparison(figure) = series else { return };
        let dof = figure.comparison.dof;
        let name = figure.plant.clone().unwrap_or_else(|| dof.name().to_owned());
        let is_of = |plant: &&PlantResult| {
            plant.is_alone() == figure.plant.is_none() && plant.method == figure.method
        };
        let Some(plant) = results.plants.get(&name).filter(is_of) else { return };
        let key = (name, dof);
        let known = self.0.get(&key);
        if known.is_none_or(|(role, _)| *role == Role::Fit && figure.role == Role::HoldOut) {
            // Below the name of the axis, if there are several.
            let indent = if plant.axes.len() > 1 { 6 } else { 2 };
            self.0.insert(key, (figure.role, sketch(figure, results, indent)));
        }
    }

    /// Returns the lines of an axis of a plant; empty if there is nothing to show.
    pub fn of(&self, plant: &PlantResult, dof: Dof) -> &str {
        self.0.get(&(plant.name(), dof)).map_or("", |(_, lines)| lines)
    }
}

fn sketch(figure: &ComparisonFigure, results: &Results, indent: usize) -> String {
    let Comparison { quantity, dof, trial, time_s, measured, simulated, .. } = &figure.comparison;
    let axis = results.trials.iter().find(|t| t.name == *trial).and_then(|t| t.axes.get(dof));
    let window = window(time_s, measured, axis.and_then(|axis| axis.dominant_hz));
    if window.len() < 2 {
        return String::new();
    }
    let shown = |values: &[f64]| means(&values[window.clone()]);
    let lines = [shown(measured), shown(simulated)];
    let all = || lines.iter().flatten().copied();
    let (low, high) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let bar = |line: &[f64]| line.iter().map(|x| level(*x, low, high)).collect::<String>();
    let number = |x: f64| significant(x, 2);
    let indent = " ".repeat(indent);
    format!(
        "{indent}measured  {}  {FAINT}{} to {} {}{FAINT:#}\n\
         {indent}simulated {}  {FAINT}{trial}, {} to {} s{FAINT:#}\n",
        bar(&lines[0]),
        number(low),
        number(high),
        quantity.unit(*dof),
        bar(&lines[1]),
        significant(time_s[window.start], 3),
        significant(time_s[window.end - 1], 3),
    )
}

/// Draws a series in one line.
pub fn bar(values: &[f64]) -> String {
    let line = means(values);
    let low = line.iter().copied().fold(0.0, f64::min);
    let high = line.iter().copied().fold(0.0, f64::max);
    line.iter().map(|x| level(*x, low, high)).collect()
}

/// Draws a series in one line over a span of time; columns without a sample are blank.
pub fn over_time(time_s: &[f64], values: &[f64], from_s: f64, to_s: f64) -> String {
    let column = |k: usize| {
        let at = |k: usize| from_s + (to_s - from_s) * k as f64 / COLUMNS as f64;
        let until = if k + 1 == COLUMNS { f64::INFINITY } else { at(k + 1) };
        let first = time_s.partition_point(|t| *t < at(k));
        let after = time_s.partition_point(|t| *t < until);
        let part = &values[first..after];
        (!part.is_empty()).then(|| part.iter().sum::<f64>() / part.len() as f64)
    };
    let means: Vec<Option<f64>> = (0..COLUMNS).map(column).collect();
    let known = || means.iter().flatten().copied();
    let low = known().fold(f64::INFINITY, f64::min);
    let high = known().fold(f64::NEG_INFINITY, f64::max);
    means.iter().map(|mean| mean.map_or(' ', |mean| level(mean, low, high))).collect()
}

/// Returns the samples to show: some periods of the excitation around the greatest speed, or all.
fn window(time_s: &[f64], measured: &[f64], excited_hz: Option<f64>) -> Range<usize> {
    let (Some(first), Some(last)) = (time_s.first(), time_s.last()) else { return 0..0 };
    let span_s = match excited_hz {
        Some(hz) => (COLUMNS as f64 / COLUMNS_A_PERIOD / hz).min(last - first),
        None => last - first,
    };
    let fastest = (0..measured.len())
        .max_by(|a, b| measured[*a].abs().total_cmp(&measured[*b].abs()))
        .unwrap_or_default();
    // Rounding may move the latest start before the first sample, which `clamp` would refuse.
    let from_s = (time_s[fastest] - 0.5 * span_s).min(last - span_s).max(*first);
    let start = time_s.partition_point(|t| *t < from_s);
    start..time_s.partition_point(|t| *t <= from_s + span_s)
}

/// Returns the mean of each column.
fn means(values: &[f64]) -> Vec<f64> {
    let columns = COLUMNS.min(values.len());
    let part = |k: usize| k * values.len() / columns;
    (0..columns)
        .map(|k| &values[part(k)..part(k + 1)])
        .map(|part| part.iter().sum::<f64>() / part.len() as f64)
        .collect()
}

fn level(x: f64, low: f64, high: f64) -> char {
    let part = if high > low { (x - low) / (high - low) } else { 0.0 };
    LEVELS[((part * LEVELS.len() as f64) as usize).min(LEVELS.len() - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_span_the_shown_range() {
        let shown: String =
            [-1.0, -0.6, 0.0, 0.6, 1.0].map(|x| level(x, -1.0, 1.0)).iter().collect();
        assert_eq!(shown, "▁▂▅▇█");
        assert_eq!(level(3.0, 3.0, 3.0), '▁');
    }

    #[test]
    fn the_window_holds_eight_periods_around_the_greatest_speed() {
        let time_s: Vec<f64> = (0..4800).map(|k| 0.1 * f64::from(k)).collect();
        let mut measured = vec![0.0; 4800];
        measured[3000] = -1.0;
        let shown = window(&time_s, &measured, Some(0.125));
        assert!((shown.len() as f64 - 640.0).abs() <= 1.0 && shown.contains(&3000), "{shown:?}");
        assert_eq!(window(&time_s, &measured, None), 0..4800);
        measured[4799] = 2.0;
        assert_eq!(window(&time_s, &measured, Some(0.125)).end, 4800);
        assert_eq!(window(&[], &[], None), 0..0);
    }

    /// Spans that are the whole record, at starts that decimals cannot hold.
    #[test]
    fn the_window_of_a_record_that_starts_anywhere_is_within_it() {
        for k in 0..2000 {
            let start_s = 0.0137 * f64::from(k) + 1e-7 * f64::from(k * k);
            let jitter = |n: i32| 0.003 * f64::from((n * 7919 + k) % 31) / 31.0;
            let time_s: Vec<f64> =
                (0..40).map(|n| start_s + 0.1 * f64::from(n) + jitter(n)).collect();
            let measured: Vec<f64> = (0..40).map(|n| f64::from((n + k) % 17)).collect();
            for excited_hz in [None, Some(1e-3), Some(2.0), Some(1e9), Some(0.0)] {
                let shown = window(&time_s, &measured, excited_hz);
                assert!(shown.start < shown.end && shown.end <= 40, "{k} {excited_hz:?} {shown:?}");
            }
        }
    }

    #[test]
    fn a_span_without_samples_is_blank() {
        let (time_s, values) = ([0.0, 0.1, 9.9], [0.0, 0.0, 1.0]);
        let shown = over_time(&time_s, &values, 0.0, 20.0);
        assert_eq!(shown.chars().count(), COLUMNS);
        assert!(shown.starts_with('▁') && shown.trim_end().ends_with('█'), "{shown}");
        assert_eq!(shown.chars().filter(|c| *c != ' ').count(), 2, "{shown}");
        assert_eq!(over_time(&[], &[], 0.0, 1.0).trim(), "");
    }

    #[test]
    fn columns_are_means_of_equal_parts() {
        assert_eq!(means(&[1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
        let many: Vec<f64> = (0..640).map(f64::from).collect();
        assert_eq!(means(&many)[..2], [4.5, 14.5]);
    }
}
