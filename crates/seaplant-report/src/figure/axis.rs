//! Axes with round ticks.

use std::ops::Range;

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};

use crate::number::{Decimals, significant};

/// Fraction of a panel that remains free above and below its data.
const MARGIN: f64 = 0.06;

/// An axis: its ends, its ticks and their labels.
#[derive(Clone, Debug)]
pub(crate) struct Axis {
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    scale: Scale,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scale {
    Linear { step: f64 },
    Decades,
}

impl Axis {
    /// Creates an axis that holds every finite value, with a margin; around zero if there is none.
    pub(crate) fn around(values: impl IntoIterator<Item = f64>, most_ticks: usize) -> Self {
        let (low, high) = extent(values);
        let margin = MARGIN * (high - low);
        Self::between(low - margin, high + margin, most_ticks)
    }

    /// Creates an axis with given ends, widened if they coincide.
    pub(crate) fn between(low: f64, high: f64, most_ticks: usize) -> Self {
        let (low, high) = widened(low, high);
        let step = round_step((high - low) / most_ticks.max(1) as f64);
        let first = (low / step).ceil();
        let count = ((high / step).floor() - first).clamp(0.0, most_ticks as f64) as usize;
        let ticks = (0..=count).map(|k| (first + k as f64) * step).collect();
        Self { low, high, ticks, scale: Scale::Linear { step } }
    }

    /// Creates a logarithmic axis with ticks at 1, 2 and 5; both ends above zero.
    pub(crate) fn decades(low: f64, high: f64) -> Self {
        let low = if low.is_finite() { low.max(1e-9) } else { 1e-3 };
        let high = if high.is_finite() && high > low { high } else { 10.0 * low };
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let ticks = decades
            .flat_map(|decade| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(decade)))
            .filter(|tick| (low..=high).contains(tick))
            .collect();
        Self { low, high, ticks, scale: Scale::Decades }
    }

    pub(crate) fn label(&self, tick: f64) -> String {
        match self.scale {
            Scale::Linear { step } if (1e-5..1e8).contains(&step) => {
                Decimals::significant(step, 1).write(tick)
            }
            _ => significant(tick, 1),
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.ticks.len()
    }

    pub(crate) fn ends(&self) -> Range<f64> {
        self.low..self.high
    }

    fn part(&self, value: f64) -> f64 {
        let part = match self.scale {
            Scale::Linear { .. } => (value - self.low) / (self.high - self.low),
            Scale::Decades => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        if part.is_nan() { 0.0 } else { part.clamp(0.0, 1.0) }
    }
}

impl Ranged for Axis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        from + (self.part(*value) * f64::from(to - from)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.ticks.clone()
    }

    fn range(&self) -> Range<f64> {
        self.ends()
    }
}

/// Returns the smallest and the greatest finite value.
fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let finite = values.into_iter().filter(|value| value.is_finite());
    let (low, high) =
        finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high { (-1.0, 1.0) } else { widened(low, high) }
}

/// Widens a span of zero around its constant.
fn widened(low: f64, high: f64) -> (f64, f64) {
    if !(low.is_finite() && high.is_finite()) {
        return (-1.0, 1.0);
    }
    let least = 1e-9 * low.abs().max(high.abs());
    if high - low > least {
        return (low, high);
    }
    let room = if low == 0.0 { 1.0 } else { 0.5 * low.abs() };
    (low - room, low + room)
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let multiple = [1.0, 2.0, 5.0].into_iter().find(|m| m * power >= step * (1.0 - 1e-9));
    multiple.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis) -> Vec<String> {
        axis.ticks.iter().map(|tick| axis.label(*tick)).collect()
    }

    #[test]
    fn ticks_are_round_and_written_alike() {
        assert_eq!(labels(&Axis::between(0.0, 480.0, 6)), ["0", "100", "200", "300", "400"]);
        assert_eq!(labels(&Axis::between(-0.31, 0.3, 5)), ["−0.2", "0.0", "0.2"]);
        assert_eq!(
            labels(&Axis::decades(0.004, 0.2)),
            ["0.005", "0.01", "0.02", "0.05", "0.1", "0.2"]
        );
    }

    #[test]
    fn any_data_make_an_axis() {
        for values in [
            vec![],
            vec![f64::NAN, f64::INFINITY],
            vec![0.0, 0.0],
            vec![7.0],
            vec![1e-300, 2e-300],
            vec![-1e300, 1e300],
            vec![1e15, 1e15 + 1.0],
        ] {
            let axis = Axis::around(values.clone(), 5);
            assert!(axis.ends().start < axis.ends().end, "{values:?}");
            assert!(axis.count() <= 6, "{values:?}: {axis:?}");
        }
        let decades = Axis::decades(0.0, f64::NAN);
        assert!(decades.ends().start < decades.ends().end);
    }
}
