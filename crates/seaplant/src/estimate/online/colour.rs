//! Whitening of residuals.

/// Maximum averaging time of the residuals' products, s.
const MEMORY_S: f64 = 120.0;

/// Fraction by which autocorrelations are reduced, to keep the filter's output from vanishing.
const SHRINKAGE: f64 = 1e-6;

/// Lower limit of the output variance, as a fraction of that of the residual.
const LEAST_LEFT: f64 = 1e-9;

/// The whitening filter `x_k − a₁ x_{k−1} − a₂ x_{k−2}` with the least output variance by the mean
/// products so far, applied to residual and regressors.
///
/// # Source
/// [Jategaonkar2015, ch. 6]: generalised least squares with coloured residuals.
pub(super) struct Whitening {
    /// Mean products of residuals at lags of 0, 1 and 2 samples.
    products: [f64; 3],
    /// Mean square of the output.
    left: f64,
    elapsed_s: f64,
    /// The last two residuals and regressors, the latest first.
    residuals: [f64; 2],
    regressors: [Vec<f64>; 2],
    seen: usize,
    filtered: Vec<f64>,
}

/// A whitened sample.
pub(super) struct WhitenedRow<'a> {
    pub(super) residual: f64,
    /// Its mean square so far.
    pub(super) variance: f64,
    pub(super) regressors: &'a [f64],
}

impl Whitening {
    /// Creates a filter for at most `count` regressors.
    pub(super) fn new(count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self {
            products: [0.0; 3],
            left: 0.0,
            elapsed_s: 0.0,
            residuals: [0.0; 2],
            regressors: [zeros(), zeros()],
            seen: 0,
            filtered: zeros(),
        }
    }

    /// Restarts after a gap; the mean products are kept.
    pub(super) fn restart(&mut self) {
        self.seen = 0;
    }

    /// Processes a sample of `h` seconds; `None` for the first two.
    pub(super) fn take(
        &mut self,
        residual: f64,
        regressors: &[f64],
        h: f64,
    ) -> Option<WhitenedRow<'_>> {
        let [a, b] = self.weights();
        let n = regressors.len();
        let past = self.regressors[0].iter().zip(&self.regressors[1]);
        for ((filtered, x), (one, two)) in self.filtered.iter_mut().zip(regressors).zip(past) {
            *filtered = x - a * one - b * two;
        }
        let left = residual - a * self.residuals[0] - b * self.residuals[1];
        let is_known = self.seen >= 2;
        if is_known {
            self.elapsed_s += h;
            let part = (h / self.elapsed_s.min(MEMORY_S)).min(1.0);
            let products = [residual, self.residuals[0], self.residuals[1]].map(|x| x * residual);
            for (mean, product) in self.products.iter_mut().zip(products) {
                *mean += part * (product - *mean);
            }
            self.left += part * (left * left - self.left);
        }
        self.residuals = [residual, self.residuals[0]];
        self.regressors.swap(0, 1);
        self.regressors[0][..n].copy_from_slice(regressors);
        self.seen += 1;
        let variance = self.left.max(LEAST_LEFT * self.products[0]);
        is_known.then(|| WhitenedRow { residual: left, variance, regressors: &self.filtered[..n] })
    }

    /// Returns a₁ and a₂ by the Yule–Walker equations; zeros while nothing is known.
    fn weights(&self) -> [f64; 2] {
        if self.products[0] <= 0.0 {
            return [0.0; 2];
        }
        let part =
            |k: usize| (self.products[k] / self.products[0]).clamp(-1.0, 1.0) * (1.0 - SHRINKAGE);
        let (one, two) = (part(1), part(2));
        let rest = 1.0 - one * one;
        let second = ((two - one * one) / rest).clamp(-1.0, 1.0);
        [one * (1.0 - second), second]
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    /// Tolerance for means over 2000 samples with two minutes of memory.
    const CHANCE: f64 = 0.15;

    #[test]
    fn whitens_a_second_order_autoregression() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut whitening = Whitening::new(1);
        let (mut x, mut past, mut product, mut square) = ([0.0; 2], 0.0, 0.0, 0.0);
        for k in 0..4000 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let now = 1.6 * x[0] - 0.64 * x[1] + noise;
            x = [now, x[0]];
            let Some(row) = whitening.take(now, &[1.0], 0.1) else { continue };
            if k >= 2000 {
                product += row.residual * past;
                square += row.residual * row.residual;
            }
            past = row.residual;
        }
        assert!((product / square).abs() < CHANCE, "{}", product / square);
        assert!((square / 2000.0 - 1.0).abs() < CHANCE, "{}", square / 2000.0);
    }
}
