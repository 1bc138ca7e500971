//! A channel in the form that the detectors use.

use seaplant_log::{Channel, Dimension};

use super::runs::{Run, runs_within};
use crate::words::{HEADING, PITCH, ROLL, is_input};

/// A channel in the form that the detectors use.
pub(super) struct Facts<'a> {
    pub(super) channel: &'a Channel,
    pub(super) words: Vec<String>,
    pub(super) time_s: Vec<f64>,
    pub(super) values: Vec<f64>,
    /// Longer intervals than this, s, may be stretches of the log that were not read.
    pub(super) pause_s: f64,
}

impl Facts<'_> {
    pub(super) fn with_unit(&self, value: f64) -> String {
        match &self.channel.unit {
            Some(unit) => format!("{} {unit}", short(value)),
            None => short(value),
        }
    }

    fn dimension(&self) -> Option<Dimension> {
        self.channel.unit.as_ref().map(|unit| unit.dimension())
    }

    pub(super) fn is_input(&self) -> bool {
        is_input(self.channel, &self.words)
    }

    pub(super) fn has_word(&self, known: &[&str]) -> bool {
        self.words.iter().any(|word| known.contains(&word.as_str()))
    }

    pub(super) fn is_heading(&self) -> bool {
        self.has_word(HEADING)
    }

    pub(super) fn is_angle(&self) -> bool {
        match self.dimension() {
            Some(dimension) => dimension == Dimension::Angle,
            None => self.is_heading() || self.has_word(ROLL) || self.has_word(PITCH),
        }
    }

    pub(super) fn steps(&self) -> impl Iterator<Item = f64> + '_ {
        self.pairs().map(|[before, after]| (after - before).abs())
    }

    /// Iterates over pairs of successive values, unless a pause lies between.
    pub(super) fn pairs(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let pairs = self.values.windows(2).map(|w| [w[0], w[1]]).enumerate();
        pairs.filter(|(k, _)| self.follows(k + 1)).map(|(_, pair)| pair)
    }

    /// Iterates over the time steps, s, without pauses.
    pub(super) fn intervals(&self) -> impl Iterator<Item = f64> + '_ {
        let all = self.channel.time_s().windows(2).map(|w| w[1] - w[0]);
        all.filter(|interval_s| *interval_s < self.pause_s)
    }

    pub(super) fn runs(&self) -> Vec<Run> {
        runs_within(&self.values, |k| self.follows(k))
    }

    /// Returns whether no pause precedes a sample.
    fn follows(&self, k: usize) -> bool {
        self.time_s[k] - self.time_s[k - 1] < self.pause_s
    }

    pub(super) fn min_max(&self) -> (f64, f64) {
        let fold = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
        self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), fold)
    }

    pub(super) fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |largest, x| x.abs().max(largest))
    }
}

/// Formats five significant digits.
pub(crate) fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{}", x.abs());
    }
    let scale = 10f64.powi(4 - x.abs().log10().floor() as i32);
    let rounded = (x * scale).round() / scale;
    format!("{}", if rounded.is_finite() { rounded } else { x })
}
