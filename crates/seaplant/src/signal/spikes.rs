use std::f64::consts::{PI, TAU};

use crate::Timed;
use crate::series::median;

/// Least jump of a spike, in standard deviations of one sample's noise: one sample in a million
/// exceeds it by chance.
const SIGMAS: f64 = 5.0;

/// Jump that does not occur by chance.
const SURE_SIGMAS: f64 = 6.0;

/// Fewer spikes below [`SURE_SIGMAS`] are attributed to chance, as there are many channels.
const LEAST_UNSURE: usize = 3;

/// Least jump of a spike, relative to the median change around it: motion that alternates from
/// sample to sample remains.
const LEAST_RELATIVE_JUMP: f64 = 4.0;

/// Number of changes on either side that determine the median change.
const AROUND: usize = 6;

/// Largest difference between the samples before and after a spike, relative to its jump.
const BACK_PART: f64 = 0.5;

/// Samples further apart than this many periods are not neighbours.
const APART_PERIODS: f64 = 2.5;

/// Fewer samples do not determine the noise.
const LEAST_SAMPLES: usize = 20;

/// Converts a median absolute deviation to a standard deviation of normal noise.
const MAD_TO_STD: f64 = 1.4826;

/// Returns the indices of single samples that jump away from their neighbours and back, as motion
/// does not: the signal changes by far more than its noise and its median change, and returns in
/// the next sample.
///
/// Differences of an `angle` are wrapped.
pub(crate) fn spikes(series: &Timed, angle: bool) -> Vec<usize> {
    let (t, x) = (series.time_s(), series.values());
    if x.len() < LEAST_SAMPLES {
        return Vec::new();
    }
    let signal = Signal { values: x, angle };
    let noise = signal.noise();
    let least = SIGMAS * noise;
    let apart_s = APART_PERIODS * series.period_s();
    let is_spike = |k: &usize| {
        let (off, back) = (signal.change(k - 1), signal.change(*k));
        let size = off.abs().min(back.abs());
        off * back < 0.0
            && size > least
            && (off + back).abs() < BACK_PART * size
            && t[k + 1] - t[k - 1] < 2.0 * apart_s
            && size > LEAST_RELATIVE_JUMP * signal.median_change(*k)
    };
    let mut found: Vec<usize> = (1..x.len() - 1).filter(is_spike).collect();
    let size = |k: usize| signal.change(k - 1).abs().min(signal.change(k).abs());
    if found.len() < LEAST_UNSURE {
        found.retain(|k| size(*k) > SURE_SIGMAS * noise);
    }
    found
}

/// Number of samples from which the noise of a long record is estimated: more would only cost
/// memory.
const NOISE_SAMPLES: usize = 20_000;

struct Signal<'a> {
    values: &'a [f64],
    angle: bool,
}

impl Signal<'_> {
    /// Returns the change from sample `k` to the next.
    fn change(&self, k: usize) -> f64 {
        let d = self.values[k + 1] - self.values[k];
        if self.angle && d.abs() > PI { d - (d / TAU).round() * TAU } else { d }
    }

    /// Estimates the standard deviation of one sample's noise from third differences, whose
    /// variance is 20 σ²; at least the step of a quantised signal.
    fn noise(&self) -> f64 {
        let last = self.values.len() - 3;
        let third = |k: usize| self.change(k + 2) - 2.0 * self.change(k + 1) + self.change(k);
        let every = last.div_ceil(NOISE_SAMPLES);
        let mut thirds: Vec<f64> = (0..last).step_by(every).map(|k| third(k).abs()).collect();
        let sigma = MAD_TO_STD * median(&mut thirds).unwrap_or(0.0) / 20_f64.sqrt();
        let steps = (0..self.values.len() - 1).map(|k| self.change(k).abs());
        sigma.max(steps.filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min))
    }

    /// Returns the median change around sample `k`, without the two changes next to it.
    fn median_change(&self, k: usize) -> f64 {
        let before = k.saturating_sub(1 + AROUND)..k - 1;
        let after = k + 1..(k + 1 + AROUND).min(self.values.len() - 1);
        let mut around: Vec<f64> = before.chain(after).map(|k| self.change(k).abs()).collect();
        median(&mut around).unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;

    use super::*;

    const NOISE: f64 = 0.005;

    fn noisy(period_s: f64, seed: u64, of: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut at =
            |k: i32| of(period_s * f64::from(k)) + NOISE * random.sample::<f64, _>(StandardNormal);
        (0..3000).map(&mut at).collect()
    }

    fn found(period_s: f64, values: Vec<f64>, angle: bool) -> Vec<usize> {
        let time_s: Vec<f64> = (0..values.len()).map(|k| period_s * k as f64).collect();
        spikes(&Timed::new("test", time_s, values).expect("valid"), angle)
    }

    /// Returns the speed of a vehicle under steps of thrust, with a time constant of a second and a
    /// half.
    fn steps(t: f64) -> f64 {
        let (step, since) = ((t / 15.0).floor(), t % 15.0);
        let level = |k: f64| 0.6 * (12.9898 * k).sin();
        level(step) + (level(step - 1.0) - level(step)) * (-since / 1.5).exp()
    }

    #[test]
    fn every_hundredth_sample_is_found_where_it_exceeds_the_noise() {
        for (seed, sigmas) in [(1, 8.0), (2, 20.0), (3, -100.0)] {
            let mut values = noisy(0.1, seed, steps);
            let off: Vec<usize> = (50..2950).step_by(97).collect();
            off.iter().for_each(|k| values[*k] += sigmas * NOISE);
            let found = found(0.1, values, false);
            let hits = found.iter().filter(|k| off.contains(k)).count();
            assert!(hits * 10 >= off.len() * 8, "{sigmas}: {hits} of {}", off.len());
            // The largest spikes may mask a neighbour, never more.
            assert!(found.len() <= hits + 1, "{sigmas}: {found:?}");
        }
    }

    #[test]
    fn motion_remains_at_any_sampling_rate() {
        for period_s in [0.05, 0.1, 0.5, 1.0, 2.0] {
            for seed in 0..10 {
                let found = found(period_s, noisy(period_s, seed, steps), false);
                assert!(found.len() <= 1, "{period_s}: {found:?}");
            }
            let wave = |t: f64| 0.3 * (2.0 * PI * t / 1.3).sin();
            assert_eq!(found(period_s, noisy(period_s, 3, wave), false), [0; 0]);
        }
    }

    #[test]
    fn a_quantised_signal_may_flicker() {
        let quantised = noisy(0.1, 5, steps).iter().map(|x| (x / 0.01).round() * 0.01).collect();
        assert_eq!(found(0.1, quantised, false), [0; 0]);
    }

    #[test]
    fn a_heading_that_passes_north_is_no_spike_but_a_spike_there_is() {
        let heading = |t: f64| 0.02 * (0.5 * t).sin();
        let mut values: Vec<f64> =
            noisy(0.1, 7, heading).iter().map(|x| x.rem_euclid(TAU)).collect();
        assert_eq!(found(0.1, values.clone(), true), [0; 0]);
        values[700] = (values[700] + 3.0).rem_euclid(TAU);
        assert_eq!(found(0.1, values, true), [700]);
    }
}
