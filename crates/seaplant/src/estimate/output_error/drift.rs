//! Position residuals as white noise plus a random walk, which disturbances cause.

use super::sensitivity::Residual;

/// Kalman filter of a random walk observed in white noise, which whitens position residuals.
///
/// A disturbance changes velocity for some time and position permanently, so that position
/// residuals grow with time and are correlated. In an unweighted sum of squares the late ones would
/// dominate. Each residual is therefore replaced by its innovation, given the earlier ones: for a
/// fast walk relative to the white noise these are increments of position, that is mean velocities;
/// for a slow one, position itself.
///
/// All quantities are in standard deviations of the white noise; `walk` is the variance that the
/// walk gains per second.
pub(super) struct WalkFilter<const N: usize> {
    walk: f64,
    /// Predicted walk, and its derivatives by each unknown.
    level: f64,
    level_by: [f64; N],
    /// Variance of the prediction.
    spread: f64,
}

impl<const N: usize> WalkFilter<N> {
    /// Creates the filter with a walk that starts at zero, as the initial position of a section is
    /// a separate unknown.
    pub(super) fn new(walk: f64) -> Self {
        Self { walk, level: 0.0, level_by: [0.0; N], spread: 0.0 }
    }

    /// Predicts over a time span, s.
    #[inline(always)]
    pub(super) fn wait(&mut self, span_s: f64) {
        self.spread += self.walk * span_s;
    }

    /// Returns the innovations of a residual and of its derivatives, divided by their standard
    /// deviation, and updates the filter.
    #[inline(always)]
    pub(super) fn take(&mut self, residual: f64, row: &[f64; N]) -> (f64, [f64; N]) {
        let variance = self.spread + 1.0;
        let per_std = 1.0 / variance.sqrt();
        let gain = self.spread / variance;
        let innovation = residual - self.level;
        self.level += gain * innovation;
        let mut new = [0.0; N];
        for j in 0..N {
            let own = row[j] - self.level_by[j];
            self.level_by[j] += gain * own;
            new[j] = per_std * own;
        }
        self.spread = gain;
        (per_std * innovation, new)
    }

    /// Returns the residual with a given innovation: the inverse of [`WalkFilter::take`].
    pub(super) fn restore(&mut self, new: f64) -> f64 {
        let variance = self.spread + 1.0;
        let innovation = variance.sqrt() * new;
        let residual = self.level + innovation;
        self.spread /= variance;
        self.level += self.spread * innovation;
        residual
    }
}

/// Maximum likelihood estimate of the noise in position residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DriftingNoise {
    /// Standard deviation of the white noise.
    pub(super) std: f64,
    /// Variance of the walk per second, as in [`WalkFilter`].
    pub(super) walk: f64,
}

/// Minimum gain in log-likelihood for a walk. Without a walk, twice the log-likelihood ratio of a
/// non-negative variance exceeds twice this in one of twenty records.
const LEAST_GAIN: f64 = 1.35;

/// Range of the variance gained from sample to sample, powers of ten.
const ORDERS: (i32, i32) = (-8, 4);

/// Tolerance of the search, in powers of ten.
const ORDER_TOLERANCE: f64 = 1e-3;

impl DriftingNoise {
    /// Estimates the noise from the residuals of each section by maximum likelihood, with a walk of
    /// at least `least` per second, in squared units of the measurement; `scale` computes the
    /// standard deviation of innovations.
    pub(super) fn estimate(
        stretches: &[Vec<Residual>],
        least: f64,
        scale: impl Fn(&[f64]) -> f64,
    ) -> Self {
        let span_s: f64 = stretches.iter().filter_map(|all| all.last()).map(|last| last.at_s).sum();
        let count: usize = stretches.iter().map(Vec::len).sum();
        if count == 0 {
            return Self { std: 1.0, walk: 0.0 };
        }
        let period_s = span_s / count as f64;
        let at = |walk: f64| {
            let (innovations, logarithms) = innovations(stretches, walk);
            let std = scale(&innovations);
            (count as f64 * std.ln() + 0.5 * logarithms, Self { std, walk })
        };
        let of_order = |order: f64| 10.0_f64.powf(order) / period_s;
        let cost = |order: f64| at(of_order(order)).0;
        let orders = (ORDERS.0..=ORDERS.1).map(f64::from);
        let coarse = orders.map(|order| (cost(order), order)).min_by(|a, b| a.0.total_cmp(&b.0));
        let order = coarse.map_or(0.0, |(_, order)| golden_section(cost, order - 1.0, order + 1.0));
        let (still, moving) = (at(0.0), at(of_order(order)));
        let found = if still.0 - moving.0 > LEAST_GAIN { moving.1 } else { still.1 };
        let least = least / found.std.powi(2);
        if found.walk < least { at(least).1 } else { found }
    }
}

/// Returns the innovations of all residuals and Σ of the logarithms of their variances.
fn innovations(stretches: &[Vec<Residual>], walk: f64) -> (Vec<f64>, f64) {
    let mut all = Vec::with_capacity(stretches.iter().map(Vec::len).sum());
    let mut logarithms = 0.0;
    for residuals in stretches {
        let mut drift = WalkFilter::<0>::new(walk);
        let mut before_s = 0.0;
        for residual in residuals {
            drift.wait(residual.at_s - before_s);
            before_s = residual.at_s;
            logarithms += (drift.spread + 1.0).ln();
            all.push(drift.take(residual.value, &[]).0);
        }
    }
    (all, logarithms)
}

/// Finds the minimum of a unimodal function by golden section search.
fn golden_section(of: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    const PART: f64 = 0.618_033_988_749_894_8;
    let inner = |low: f64, high: f64| (high - PART * (high - low), low + PART * (high - low));
    let (mut left, mut right) = inner(low, high);
    let (mut at_left, mut at_right) = (of(left), of(right));
    while high - low > ORDER_TOLERANCE {
        if at_left < at_right {
            (high, right, at_right) = (right, left, at_left);
            left = inner(low, high).0;
            at_left = of(left);
        } else {
            (low, left, at_left) = (left, right, at_right);
            right = inner(low, high).1;
            at_right = of(right);
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::super::stretch::Measured;
    use super::*;
    use crate::signal::rms;

    fn uneven_times(n: usize) -> Vec<f64> {
        (0..n).map(|k| 0.3 * k as f64 + 0.2 * (k as f64).sin()).collect()
    }

    /// Rounding error of a hundred sums.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn whitens_like_the_cholesky_factor_of_the_covariance() {
        let (walk, times) = (0.7, uneven_times(60));
        let residual: Vec<f64> = times.iter().map(|t| (3.1 * t).sin() + 0.2 * t).collect();
        let row: Vec<f64> = times.iter().map(|t| t * t).collect();
        let covariance = DMatrix::from_fn(60, 60, |i, j| {
            f64::from(i == j) + walk * (times[i].min(times[j]) - times[0])
        });
        let factor = covariance.cholesky().expect("positive").l();
        let dense = |x: &[f64]| {
            factor.solve_lower_triangular(&DVector::from_row_slice(x)).expect("regular")
        };
        let (of_residual, of_row) = (dense(&residual), dense(&row));
        let mut drift = WalkFilter::<1>::new(walk);
        let mut inverse = WalkFilter::<0>::new(walk);
        for k in 0..60 {
            let span_s = if k == 0 { 0.0 } else { times[k] - times[k - 1] };
            drift.wait(span_s);
            inverse.wait(span_s);
            let (new, [new_row]) = drift.take(residual[k], &[row[k]]);
            assert!((new - of_residual[k]).abs() < ROUNDING * of_residual.amax());
            assert!((new_row - of_row[k]).abs() < ROUNDING * of_row.amax());
            assert!(
                (inverse.restore(new) - residual[k]).abs() < ROUNDING * residual[k].abs().max(1.0)
            );
        }
    }

    fn normal(random: &mut ChaCha8Rng) -> f64 {
        StandardNormal.sample(random)
    }

    fn walked(std: f64, walk: f64, random: &mut ChaCha8Rng) -> Vec<Residual> {
        let mut level = 0.0;
        let mut before_s = 0.0;
        let of = |at_s: f64| {
            level += (walk * (at_s - before_s)).sqrt() * normal(random);
            before_s = at_s;
            let value = std * (level + normal(random));
            Residual { measured: Measured::Position, at_s, value }
        };
        (0..4000).map(|k| 0.1 * f64::from(k)).map(of).collect()
    }

    #[test]
    fn separates_a_walk_from_white_noise() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for walk in [0.1, 1.0, 100.0] {
            let stretches = [walked(0.02, walk, &mut random), walked(0.02, walk, &mut random)];
            let found = DriftingNoise::estimate(&stretches, 0.0, |x| rms(x));
            // Eight thousand samples tell a strong walk to a few per cent; a weak one shows
            // in a few hundred spans alone.
            assert!((found.walk / walk - 1.0).abs() < 0.3, "{walk}: {found:?}");
            assert!((found.std / 0.02 - 1.0).abs() < 0.1, "{walk}: {found:?}");
        }
    }

    #[test]
    fn finds_no_walk_in_white_noise_unless_a_minimum_is_given() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let stretches = [walked(0.02, 0.0, &mut random)];
        let found = DriftingNoise::estimate(&stretches, 0.0, |x| rms(x));
        assert_eq!(found.walk, 0.0);
        let known = DriftingNoise::estimate(&stretches, 1e-5, |x| rms(x));
        assert!((known.walk * found.std.powi(2) / 1e-5 - 1.0).abs() < 1e-9, "{known:?}");
    }
}
