//! Solution of symmetric systems in place, without allocation between samples.

/// Factors of a symmetric matrix A with a ridge, scaled to a unit diagonal; lower triangle, row by
/// row.
#[derive(Clone)]
pub(super) struct Factor {
    n: usize,
    lower: Vec<f64>,
    scale: Vec<f64>,
}

impl Factor {
    pub(super) fn new(n: usize) -> Self {
        Self { n, lower: vec![0.0; n * n], scale: vec![1.0; n] }
    }

    /// Factors `A + ridge · diag(A)` from the lower triangle of A. Empty rows and columns are
    /// replaced by those of the unit matrix.
    pub(super) fn set(&mut self, matrix: &[f64], ridge: f64) {
        let n = self.n;
        for i in 0..n {
            let own = matrix[i * n + i];
            self.scale[i] = if own > 0.0 { 1.0 / own.sqrt() } else { 0.0 };
        }
        for i in 0..n {
            let (above, own) = self.lower.split_at_mut(i * n);
            for j in 0..i {
                let other = &above[j * n..=j * n + j];
                let scaled = matrix[i * n + j] * self.scale[i] * self.scale[j];
                own[j] = (scaled - dot(&own[..j], &other[..j])) / other[j];
            }
            own[i] = (1.0 + ridge - dot(&own[..i], &own[..i])).max(ridge).sqrt();
        }
    }

    /// Computes xᵀ A x for the factored matrix, including the ridge; entries of empty rows are left
    /// out.
    #[cfg(test)]
    pub(super) fn norm(&self, x: &[f64]) -> f64 {
        let n = self.n;
        let scaled = |k: usize| if self.scale[k] > 0.0 { x[k] / self.scale[k] } else { 0.0 };
        let along = |j: usize| (j..n).map(|i| self.lower[i * n + j] * scaled(i)).sum::<f64>();
        (0..n).map(|j| along(j).powi(2)).sum()
    }

    /// Solves for a right-hand side in place.
    pub(super) fn solve(&self, x: &mut [f64]) {
        let n = self.n;
        for (i, row) in self.lower.chunks_exact(n).enumerate() {
            x[i] = (x[i] * self.scale[i] - dot(&row[..i], &x[..i])) / row[i];
        }
        for (i, row) in self.lower.chunks_exact(n).enumerate().rev() {
            let (before, own) = x.split_at_mut(i);
            own[0] /= row[i];
            before.iter_mut().zip(row).for_each(|(x, lower)| *x -= lower * own[0]);
        }
        for (x, scale) in x.iter_mut().zip(&self.scale) {
            *x *= scale;
        }
    }
}

/// Computes Σ a b in four independent sums, for speed.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (fours, rest) = a.as_chunks::<4>();
    let (of_fours, of_rest) = b.as_chunks::<4>();
    let mut sums = [0.0; 4];
    for (a, b) in fours.iter().zip(of_fours) {
        sums.iter_mut().zip(a).zip(b).for_each(|((sum, a), b)| *sum += a * b);
    }
    let rest: f64 = rest.iter().zip(of_rest).map(|(a, b)| a * b).sum();
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_badly_scaled_system() {
        // [4, 2; 2, 1e6] x = [6, 2e6 + 4] has x = [0.5…, 2].
        let matrix = [4.0, 2.0, 2.0, 1e6];
        let mut factor = Factor::new(2);
        factor.set(&matrix, 0.0);
        let mut x = [4.0 * 0.5 + 2.0 * 2.0, 2.0 * 0.5 + 1e6 * 2.0];
        factor.solve(&mut x);
        assert!((x[0] - 0.5).abs() < 1e-12 && (x[1] - 2.0).abs() < 1e-12, "{x:?}");
    }

    #[test]
    fn undetermined_entries_stay_at_zero() {
        let mut factor = Factor::new(2);
        factor.set(&[4.0, 0.0, 0.0, 0.0], 1e-9);
        let mut x = [8.0, 0.0];
        factor.solve(&mut x);
        assert!((x[0] - 2.0).abs() < 1e-8 && x[1] == 0.0, "{x:?}");
    }
}
