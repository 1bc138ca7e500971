//! Correlation of two series at every lag.

use seaplant_fourier::{Complex, RealTransform};

/// The correlation of two series at one lag, over the instants at which both exist.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AtLag {
    /// Instant k of the first series matches instant k + lag of the second.
    pub(super) lag: isize,
    /// −1 to 1.
    pub(super) correlation: f64,
    /// The number of instants at which both exist.
    pub(super) instants: f64,
}

impl AtLag {
    /// Returns the log-likelihood gain of the correlation for independent instants.
    pub(super) fn gain(&self) -> f64 {
        -0.5 * self.instants * (1.0 - self.correlation * self.correlation).max(1e-12).ln()
    }
}

/// Computes the normalised cross-correlation of two series at every lag with at least `least`
/// common instants; absent values are `NaN` and are skipped.
///
/// `ρ(m) = Σ (y_k − ȳ)(x_{k+m} − x̄) / √(Σ (y_k − ȳ)² Σ (x_{k+m} − x̄)²)`, sums and means over the
/// common instants at that lag. Six products of Fourier transforms give every sum.
pub(super) fn correlations(y: &[f64], x: &[f64], least: f64) -> Vec<AtLag> {
    let transform = RealTransform::new((y.len() + x.len()).next_power_of_two());
    let [of_y, of_x] = [y, x].map(|series| {
        let series = scaled(series);
        let of = |f: fn(f64) -> f64| series.iter().map(|v| v.map_or(0.0, f)).collect();
        [of(|_| 1.0), of(|v| v), of(|v| v * v)].map(|values| transform.forward(values))
    });
    let sums = [(0, 0), (1, 0), (2, 0), (0, 1), (0, 2), (1, 1)]
        .map(|(power_y, power_x)| product(&transform, &of_y[power_y], &of_x[power_x]));
    let lags = 1 - y.len() as isize..x.len() as isize;
    lags.filter_map(|lag| at(&sums, lag, least)).collect()
}

/// Returns the correlation at one lag from its sums; `None` for constants and too few instants.
fn at(sums: &[Vec<f64>; 6], lag: isize, least: f64) -> Option<AtLag> {
    let place = lag.rem_euclid(sums[0].len() as isize) as usize;
    let [n, y, yy, x, xx, xy] = [0, 1, 2, 3, 4, 5].map(|sum| sums[sum][place]);
    let instants = n.round();
    if instants < least.max(2.0) {
        return None;
    }
    /// Variances below this are rounding, for series of variance 1.
    const CONSTANT: f64 = 1e-9;
    let [of_y, of_x] = [(y, yy), (x, xx)].map(|(sum, squares)| (squares - sum * sum / n) / n);
    let covariance = (xy - x * y / n) / n;
    let varies = of_y > CONSTANT && of_x > CONSTANT;
    let correlation = (covariance / (of_y * of_x).sqrt()).clamp(-1.0, 1.0);
    varies.then_some(AtLag { lag, correlation, instants })
}

/// Scales a series to mean 0 and variance 1; absent values are `None`.
fn scaled(series: &[f64]) -> Vec<Option<f64>> {
    let known = || series.iter().filter(|x| !x.is_nan());
    let n = known().count().max(1) as f64;
    let mean = known().sum::<f64>() / n;
    let variance = known().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n;
    let scale = if variance > 0.0 { variance.sqrt().recip() } else { 1.0 };
    series.iter().map(|x| (!x.is_nan()).then(|| scale * (x - mean))).collect()
}

/// Returns `Σ a_k b_{k+m}` for every m, from both spectra.
fn product(transform: &RealTransform, a: &[Complex<f64>], b: &[Complex<f64>]) -> Vec<f64> {
    let length = transform.length() as f64;
    transform.inverse(a.iter().zip(b).map(|(a, b)| a.conj() * b / length).collect())
}

/// Returns at most `most` lags with a positive local maximum of correlation, those of the greatest
/// gain first.
pub(super) fn peaks(correlations: &[AtLag], most: usize) -> Vec<AtLag> {
    let value = |k: Option<usize>| {
        k.and_then(|k| correlations.get(k)).map_or(f64::NEG_INFINITY, |at| at.correlation)
    };
    let is_peak = |&(k, at): &(usize, &AtLag)| {
        let here = at.correlation;
        here > 0.0 && here >= value(k.checked_sub(1)) && here > value(Some(k + 1))
    };
    let mut found: Vec<AtLag> =
        correlations.iter().enumerate().filter(is_peak).map(|(_, at)| *at).collect();
    found.sort_by(|a, b| b.gain().total_cmp(&a.gain()));
    found.truncate(most);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Evaluates the formula sum by sum.
    fn by_hand(y: &[f64], x: &[f64], lag: isize) -> (f64, f64) {
        let pairs: Vec<(f64, f64)> = (0..y.len() as isize)
            .filter_map(|k| {
                let there = usize::try_from(k + lag).ok()?;
                Some((y[k as usize], *x.get(there)?))
            })
            .filter(|(y, x)| !y.is_nan() && !x.is_nan())
            .collect();
        let n = pairs.len() as f64;
        let mean = pairs.iter().fold((0.0, 0.0), |(a, b), (y, x)| (a + y / n, b + x / n));
        let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
            pairs.iter().map(|(y, x)| f(y - mean.0, x - mean.1)).sum()
        };
        (sum(&|y, x| y * x) / (sum(&|y, _| y * y) * sum(&|_, x| x * x)).sqrt(), n)
    }

    #[test]
    fn every_lag_agrees_with_the_formula_despite_gaps() {
        let wave = |k: usize, a: f64| 100.0 + (a * k as f64).sin() + 0.3 * (0.7 * k as f64).cos();
        let mut y: Vec<f64> = (0..37).map(|k| wave(k, 0.31)).collect();
        let mut x: Vec<f64> = (0..61).map(|k| 1e4 * wave(k, 0.29)).collect();
        y[5..9].fill(f64::NAN);
        x[20..23].fill(f64::NAN);
        let found = correlations(&y, &x, 4.0);
        assert!(found.len() > 80, "{}", found.len());
        for at in found {
            let (correlation, instants) = by_hand(&y, &x, at.lag);
            assert!((at.correlation - correlation).abs() < 1e-9, "{at:?} {correlation}");
            assert_eq!(at.instants, instants);
        }
    }

    /// The series of `tests/reference/make_clock_reference.py`, which SciPy correlates.
    #[test]
    fn every_lag_agrees_with_scipy() {
        let text = include_str!("../../tests/reference/clock.json");
        let reference: serde_json::Value = serde_json::from_str(text).expect("made by the script");
        let k = |k: usize| k as f64;
        let of_y = |n| 3.0 + (0.002 * (k(n) + 60.0).powi(2)).sin() + 0.2 * (1.3 * k(n)).cos();
        let of_x = |n| -700.0 + 50.0 * (0.002 * k(n).powi(2)).sin() + 9.0 * (0.4 * k(n)).cos();
        let (mut y, mut x): (Vec<f64>, Vec<f64>) =
            ((0..150).map(of_y).collect(), (0..260).map(of_x).collect());
        y[40..55].fill(f64::NAN);
        x[100..108].fill(f64::NAN);
        let found = correlations(&y, &x, 40.0);
        let expected = reference["lags"].as_array().expect("an array");
        assert_eq!(found.len(), expected.len());
        for (at, expected) in found.iter().zip(expected) {
            let number = |n: usize| expected[n].as_f64().expect("a number");
            assert_eq!([at.lag as f64, at.instants], [number(0), number(2)]);
            assert!((at.correlation - number(1)).abs() < 1e-9, "{at:?} {expected}");
        }
        assert_eq!(peaks(&found, 1)[0].lag, 60);
    }

    #[test]
    fn the_highest_peak_is_at_the_lag() {
        let x: Vec<f64> = (0..200).map(|k| (0.01 * (k * k) as f64).sin()).collect();
        let found = peaks(&correlations(&x[40..160], &x, 60.0), 3);
        assert_eq!(found[0].lag, 40);
        assert!(found[0].correlation > 0.999_999 && found[1].correlation < 0.9);
    }

    #[test]
    fn a_constant_has_no_correlation() {
        assert_eq!(correlations(&[3.0; 30], &[1.0; 50], 5.0), []);
    }
}
