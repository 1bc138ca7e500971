//! Random numbers: one independent stream for each trial and purpose.

use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::TICK_HZ;
use crate::random::gauss_markov;

/// The streams of one trial.
///
/// A stream depends on the seed, the trial's name and its purpose, so that another disturbance or
/// trial leaves all other numbers unchanged.
pub(super) struct Streams<'a> {
    pub(super) seed: u64,
    pub(super) trial: &'a str,
}

impl Streams<'_> {
    pub(super) fn stream(&self, purpose: &str) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(fnv_1a(&[self.trial, purpose]));
        rng
    }
}

/// Computes FNV-1a, 64 bits: unlike the standard library's hash it never changes.
fn fnv_1a(parts: &[&str]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for byte in parts.join("/").bytes() {
        hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
    }
    hash
}

/// Draws an Ornstein–Uhlenbeck process, one value a tick, stationary from the start.
pub(super) fn ornstein_uhlenbeck(
    rng: ChaCha8Rng,
    std: f64,
    correlation_s: f64,
    ticks: usize,
) -> Vec<f64> {
    gauss_markov(rng, std, TICK_HZ * correlation_s, ticks)
}

/// Draws levels, each held for a time drawn from `dwell_s`, one value a tick.
pub(super) fn held_levels(
    mut rng: ChaCha8Rng,
    dwell_s: Range<f64>,
    ticks: usize,
    mut level: impl FnMut(&mut ChaCha8Rng) -> f64,
) -> Vec<f64> {
    let mut path = Vec::with_capacity(ticks);
    while path.len() < ticks {
        let held = (TICK_HZ * rng.random_range(dwell_s.clone())).round() as usize;
        let until = (path.len() + held.max(1)).min(ticks);
        path.resize(until, level(&mut rng));
    }
    path
}

/// Applies a first-order lag to a held signal, one value a tick.
pub(super) fn lagged(x: &[f64], time_constant_s: f64) -> Vec<f64> {
    let keep = (-1.0 / (TICK_HZ * time_constant_s)).exp();
    let follow = |y: &mut f64, x: &f64| {
        *y = x + keep * (*y - x);
        Some(*y)
    };
    x.iter().scan(0.0, follow).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn streams_differ_by_trial_and_by_purpose() {
        let first =
            |trial, purpose: &str| Streams { seed: 7, trial }.stream(purpose).random::<u64>();
        assert_eq!(first("surge 1", "dvl"), first("surge 1", "dvl"));
        assert_ne!(first("surge 1", "dvl"), first("surge 1", "heading"));
        assert_ne!(first("surge 1", "dvl"), first("sway 1", "dvl"));
    }

    #[test]
    fn an_ornstein_uhlenbeck_process_has_its_standard_deviation_and_correlation() {
        let rng = Streams { seed: 1, trial: "t" }.stream("tether");
        let x = ornstein_uhlenbeck(rng, 75.0, 30.0, 400_000);
        let product = |lag: usize| {
            let pairs = x.iter().zip(&x[lag..]);
            pairs.map(|(a, b)| a * b).sum::<f64>() / (x.len() - lag) as f64
        };
        // 1333 correlation times: the variance is known to about 4 %.
        assert!((product(0).sqrt() / 75.0 - 1.0).abs() < 0.06, "{}", product(0).sqrt());
        let after_30_s = product(300) / product(0);
        assert!((after_30_s - (-1.0_f64).exp()).abs() < 0.08, "{after_30_s}");
    }
}
