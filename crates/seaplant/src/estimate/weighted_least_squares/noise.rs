//! What is known of the errors of the equation of motion.

use crate::regression::Row;

/// How the variance of an equation depends on speed: `a + c v²`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Variance {
    /// At rest.
    at_rest: f64,
    /// For each (m/s)² or (rad/s)².
    by_square: f64,
}

/// No equation is surer than one of this part of the mean variance: a few rows that happen
/// to fit would else count for all.
const SUREST_PART: f64 = 0.05;

impl Variance {
    /// Least squares of e² on v²; constant where that would make it fall with speed.
    pub(super) fn of(rows: &[Vec<Row>], errors: &[Vec<f64>]) -> Self {
        let pairs = || {
            let rows = rows.iter().flatten().map(|[_, _, v, _]| v * v);
            rows.zip(errors.iter().flatten().map(|e| e * e))
        };
        let count = pairs().count().max(1) as f64;
        let (x_sum, y_sum) = pairs().fold((0.0, 0.0), |(x, y), pair| (x + pair.0, y + pair.1));
        let (x_mean, y_mean) = (x_sum / count, y_sum / count);
        let (mut xx, mut xy) = (0.0, 0.0);
        for (x, y) in pairs() {
            xx += (x - x_mean) * (x - x_mean);
            xy += (x - x_mean) * (y - y_mean);
        }
        let slope = if xx > 0.0 { (xy / xx).max(0.0) } else { 0.0 };
        let floor = SUREST_PART * y_mean;
        Self { at_rest: (y_mean - slope * x_mean).max(floor), by_square: slope }
    }

    /// 1/σ of a row; of an equation without any error, 1.
    pub(super) fn weight(&self, [_, _, v, _]: &Row) -> f64 {
        let variance = self.at_rest + self.by_square * v * v;
        if variance > 0.0 { variance.sqrt().recip() } else { 1.0 }
    }
}

/// An autoregression over rows that lie some distance apart.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Memory {
    /// φ₁, φ₂, …
    parts: Vec<f64>,
    spacing: usize,
}

/// The highest order that is tried.
const HIGHEST_ORDER: usize = 8;

impl Memory {
    /// By the recursion of Levinson and Durbin, of a given order or of that with the least
    /// BIC; a stretch must hold ten times as much as is remembered.
    pub(super) fn of(errors: &[Vec<f64>], spacing: usize, order: Option<usize>) -> Self {
        let longest = errors.iter().map(Vec::len).max().unwrap_or(0);
        let highest = order.unwrap_or(HIGHEST_ORDER.min(longest / (10 * spacing)));
        let covariance: Vec<f64> =
            (0..=highest).map(|lag| covariance(errors, lag * spacing)).collect();
        // Rows nearer than the spacing say the same again.
        let independent = errors.iter().map(Vec::len).sum::<usize>() as f64 / spacing as f64;
        let criterion = |order: usize, variance: f64| {
            independent * variance.ln() + order as f64 * independent.ln()
        };
        let (mut parts, mut variance) = (Vec::new(), covariance[0]);
        let mut best = (criterion(0, variance), Vec::new());
        for k in 1..=highest {
            if variance <= 0.0 {
                break;
            }
            let foretold: f64 =
                parts.iter().zip((1..k).rev()).map(|(p, j)| p * covariance[j]).sum();
            let reflected = (covariance[k] - foretold) / variance;
            let before: Vec<f64> = parts.clone();
            let turned = parts.iter_mut().zip(before.iter().rev());
            turned.for_each(|(part, other): (&mut f64, &f64)| *part -= reflected * other);
            parts.push(reflected);
            variance *= 1.0 - reflected * reflected;
            let value = criterion(k, variance);
            if order.is_some() || value < best.0 {
                best = (value, parts.clone());
            }
        }
        Self { parts: best.1, spacing }
    }

    pub(super) fn order(&self) -> usize {
        self.parts.len()
    }

    /// Rows at the start of a stretch of which not all is foretold.
    pub(super) fn reach(&self) -> usize {
        self.order() * self.spacing
    }

    /// Takes off each row what the rows before it foretell; the first ones keep all.
    pub(super) fn forget<T: Copy>(&self, rows: &mut [T], take_off: impl Fn(&mut T, &T, f64)) {
        for k in (self.reach()..rows.len()).rev() {
            for (i, part) in self.parts.iter().enumerate() {
                let before = rows[k - (i + 1) * self.spacing];
                take_off(&mut rows[k], &before, *part);
            }
        }
    }
}

/// Σ u_k u_{k−lag}, all stretches together.
fn covariance(errors: &[Vec<f64>], lag: usize) -> f64 {
    let of = |u: &Vec<f64>| -> f64 {
        u.get(lag..).map_or(0.0, |late| late.iter().zip(u).map(|(a, b)| a * b).sum())
    };
    errors.iter().map(of).sum()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// Independent numbers, evenly between −1 and 1.
    fn white(n: usize) -> Vec<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        (0..n).map(|_| rng.random_range(-1.0..1.0)).collect()
    }

    #[test]
    fn an_autoregression_is_found_with_its_order() {
        // u_k = 0.6 u_{k−3} − 0.3 u_{k−6} + noise.
        let mut u = white(30_000);
        for k in 6..u.len() {
            u[k] += 0.6 * u[k - 3] - 0.3 * u[k - 6];
        }
        let memory = Memory::of(&[u.clone()], 3, None);
        assert_eq!(memory.order(), 2, "{memory:?}");
        assert!((memory.parts[0] - 0.6).abs() < 0.02, "{memory:?}");
        assert!((memory.parts[1] + 0.3).abs() < 0.02, "{memory:?}");
        let known = Memory { parts: vec![0.6, -0.3], spacing: 3 };
        known.forget(&mut u, |x, before, part| *x -= part * before);
        let expected = white(30_000);
        assert!(u.iter().zip(&expected).skip(6).all(|(u, e)| (u - e).abs() < 1e-12));
    }

    #[test]
    fn a_variance_that_grows_with_speed_is_found() {
        let rows: Vec<Row> =
            (0..40_000).map(|k| [0.0, 0.0, (0.01 * f64::from(k)).sin(), 0.0]).collect();
        let e = white(40_000);
        let errors: Vec<f64> =
            rows.iter().zip(e).map(|(row, e)| (0.2 + 0.7 * row[2] * row[2]).sqrt() * e).collect();
        let found = Variance::of(&[rows], &[errors]);
        // The variance of the numbers is a third.
        assert!((found.at_rest - 0.2 / 3.0).abs() < 0.005, "{found:?}");
        assert!((found.by_square - 0.7 / 3.0).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn a_variance_that_falls_with_speed_is_taken_as_constant() {
        let rows: Vec<Row> = [0.0, 1.0, 2.0].map(|v| [0.0, 0.0, v, 0.0]).into();
        let found = Variance::of(std::slice::from_ref(&rows), &[vec![3.0, 2.0, 1.0]]);
        assert_eq!(found.by_square, 0.0);
        assert!((found.weight(&rows[2]) - (3.0_f64 / 14.0).sqrt()).abs() < 1e-15);
    }
}
