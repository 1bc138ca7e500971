//! Candidate terms that the propeller speeds of the trials can determine.

use crate::ThrusterTrack;

/// Number of bins of speed up to full speed.
const BINS: usize = 100;

/// Speeds within this many bins, a tenth of full speed, form one level.
const LEVEL: usize = 10;

/// Fraction of the time with thrust that the counted levels cover.
const MOST_OF_THE_TIME: f64 = 0.95;

/// Minimum number of speed levels that separate an exponent of thrust from mass and two drag
/// coefficients.
const LEAST_LEVELS: usize = 4;

/// Minimum share of each direction, or of acceleration and deceleration of the propeller.
const LEAST_SHARE: f64 = 0.05;

/// Propeller speeds of all trials, relative to the maximum of each propeller.
pub(super) struct Inputs {
    /// Samples in each bin of non-zero magnitude.
    counts: [f64; BINS],
    /// Samples with positive and with negative thrust.
    directions: [f64; 2],
    /// Total increase and total decrease of the magnitudes.
    changes: [f64; 2],
    /// Least and greatest logarithm of the supply voltage.
    supply: [f64; 2],
}

/// Least range of the logarithm of supply voltage that shows an exponent of it.
const LEAST_SUPPLY: f64 = 0.01;

impl Inputs {
    /// Counts the propeller speeds of all records.
    pub(super) fn new<'a>(tracks: impl IntoIterator<Item = &'a ThrusterTrack>) -> Self {
        let supply = [f64::INFINITY, f64::NEG_INFINITY];
        let mut all = Self { counts: [0.0; BINS], directions: [0.0; 2], changes: [0.0; 2], supply };
        for track in tracks {
            for ln_volts in track.supply.iter().flat_map(|supply| supply.ln_volts.values()) {
                all.supply = [all.supply[0].min(*ln_volts), all.supply[1].max(*ln_volts)];
            }
            let speeds = track.speed.values();
            let full = speeds.iter().fold(0.0_f64, |max, n| max.max(n.abs()));
            if full == 0.0 {
                continue;
            }
            for n in speeds.iter().filter(|n| **n != 0.0) {
                all.add(n.abs() / full);
                all.directions[usize::from(*n < 0.0)] += 1.0;
            }
            for pair in speeds.windows(2) {
                let change = (pair[1].abs() - pair[0].abs()) / full;
                all.changes[usize::from(change < 0.0)] += change.abs();
            }
        }
        all
    }

    fn add(&mut self, speed: f64) {
        let bin = (speed * BINS as f64) as usize;
        self.counts[bin.min(BINS - 1)] += 1.0;
    }

    fn samples(&self) -> f64 {
        self.counts.iter().sum()
    }

    /// Returns true if these inputs separate an exponent of thrust from mass and drag.
    pub(super) fn show_exponent(&self) -> bool {
        self.levels() >= LEAST_LEVELS
    }

    /// Returns true if there is thrust in both directions.
    pub(super) fn show_reverse_ratio(&self) -> bool {
        has_both(self.directions)
    }

    /// Returns true if propellers both speed up and slow down.
    pub(super) fn show_lag_ratio(&self) -> bool {
        has_both(self.changes)
    }

    /// Returns true if the supply voltage varies.
    pub(super) fn show_voltage(&self) -> bool {
        self.supply[1] - self.supply[0] > LEAST_SUPPLY
    }

    /// Counts the levels that together cover most of the time with thrust, in order of their share.
    fn levels(&self) -> usize {
        let mut left = self.counts;
        let least = (1.0 - MOST_OF_THE_TIME) * self.samples();
        let mut levels = 0;
        while left.iter().sum::<f64>() > least {
            let held = |from: usize| left[from..from + LEVEL].iter().sum::<f64>();
            let most = (0..=BINS - LEVEL).max_by(|a, b| held(*a).total_cmp(&held(*b)));
            let from = most.unwrap_or(0);
            left[from..from + LEVEL].fill(0.0);
            levels += 1;
        }
        levels
    }
}

fn has_both(of: [f64; 2]) -> bool {
    of[0].min(of[1]) > LEAST_SHARE * (of[0] + of[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(speeds: Vec<f64>) -> Inputs {
        let both = [1.0, 1.0];
        let mut inputs =
            Inputs { counts: [0.0; BINS], directions: both, changes: both, supply: [0.0; 2] };
        speeds.into_iter().for_each(|speed| inputs.add(speed));
        inputs
    }

    #[test]
    fn two_levels_of_thrust_do_not_determine_an_exponent() {
        let ripple = |k: usize| 0.01 * (k % 5) as f64;
        let two: Vec<f64> =
            (0..200).map(|k| if k % 3 == 0 { 0.6 } else { 0.95 } + ripple(k)).collect();
        assert_eq!(with(two.clone()).levels(), 2);
        assert!(!with(two).show_exponent());
        let many: Vec<f64> = (1..=200).map(|k| k as f64 / 200.0).collect();
        assert!(with(many).show_exponent());
    }

    #[test]
    fn one_direction_does_not_determine_a_reverse_ratio() {
        let mut inputs = with(vec![0.5; 10]);
        assert!(inputs.show_reverse_ratio() && inputs.show_lag_ratio());
        inputs.directions = [10.0, 0.0];
        inputs.changes = [1.0, 0.0];
        assert!(!inputs.show_reverse_ratio() && !inputs.show_lag_ratio());
    }
}
