//! Takes the colour off residuals.

/// Residuals are averaged over no more than this, s.
const MEMORY_S: f64 = 120.0;

/// Correlations are taken this part smaller: a filter that leaves nothing tells nothing.
const LESS: f64 = 1e-6;

/// The least variance that is left, as a part of that of the residual.
const LEAST_LEFT: f64 = 1e-9;

/// The filter `x_k − a₁ x_{k−1} − a₂ x_{k−2}` that leaves least of a residual, by its mean products
/// so far, and what it makes of residual and regressors.
///
/// # Source
/// [Jategaonkar2015, ch. 6]: generalised least squares with residuals of their own colour.
pub(super) struct White {
    /// Mean products of residuals that are none, one and two samples apart.
    products: [f64; 3],
    /// Mean square of what the filter leaves.
    left: f64,
    elapsed_s: f64,
    /// The last two residuals and regressors, the latest first.
    residuals: [f64; 2],
    regressors: [Vec<f64>; 2],
    seen: usize,
    filtered: Vec<f64>,
}

/// A sample without colour.
pub(super) struct WhiteRow<'a> {
    pub(super) residual: f64,
    /// Its mean square so far.
    pub(super) variance: f64,
    pub(super) regressors: &'a [f64],
}

impl White {
    /// A filter for at most so many regressors.
    pub(super) fn of(count: usize) -> Self {
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

    /// Begins anew after a gap; what colour there is, is known still.
    pub(super) fn restart(&mut self) {
        self.seen = 0;
    }

    /// Takes a sample of h seconds in; `None` of the first two.
    pub(super) fn take(
        &mut self,
        residual: f64,
        regressors: &[f64],
        h: f64,
    ) -> Option<WhiteRow<'_>> {
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
        is_known.then(|| WhiteRow { residual: left, variance, regressors: &self.filtered[..n] })
    }

    /// a₁ and a₂ by the equations of Yule and Walker; none while nothing is known.
    fn weights(&self) -> [f64; 2] {
        if self.products[0] <= 0.0 {
            return [0.0; 2];
        }
        let part = |k: usize| (self.products[k] / self.products[0]).clamp(-1.0, 1.0) * (1.0 - LESS);
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

    /// Of means over 2000 samples with two minutes of memory.
    const CHANCE: f64 = 0.15;

    #[test]
    fn a_residual_of_two_poles_is_left_white() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut white = White::of(1);
        let (mut x, mut past, mut product, mut square) = ([0.0; 2], 0.0, 0.0, 0.0);
        for k in 0..4000 {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let now = 1.6 * x[0] - 0.64 * x[1] + noise;
            x = [now, x[0]];
            let Some(row) = white.take(now, &[1.0], 0.1) else { continue };
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
