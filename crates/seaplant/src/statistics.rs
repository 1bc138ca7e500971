//! Statistics of estimates.

use nalgebra::{DMatrix, DVector};

/// Fewer batches determine the covariance of scores too poorly.
const LEAST_BATCHES: usize = 8;

/// Estimates the covariance of a maximum-likelihood estimate with a possibly wrong model: `A⁻¹ J
/// A⁻¹`, with no variance below that of `A⁻¹`.
///
/// `information` is A, shape (p, p); `scores` are the gradients of the cost over batches of the
/// record at the optimum, each of shape (p,), long compared with the correlation of the innovations
/// (thirty batches suffice); `J = B/(B − 1) Σ (s_b − s̄)(s_b − s̄)ᵀ`. Returns `None` for fewer than
/// eight batches, or if A cannot be inverted.
///
/// # Source
/// H. White, "Maximum likelihood estimation of misspecified models", *Econometrica* 50, 1982;
/// sums over batches: \[Schruben1983\].
///
/// ```
/// use nalgebra::{DMatrix, DVector};
/// // A mean of 40 batches of 25 samples, whose sums vary four times as much as of white noise.
/// let scores: Vec<_> = (0..40).map(|k| DVector::from_element(1, if k % 2 == 0 { 10.0 } else { -10.0 })).collect();
/// let robust = seaplant::robust_covariance(&DMatrix::from_element(1, 1, 1000.0), &scores).unwrap();
/// assert!((robust[(0, 0)] / (4.0 / 1000.0) - 40.0 / 39.0).abs() < 1e-12);
/// ```
pub fn robust_covariance(
    information: &DMatrix<f64>,
    scores: &[DVector<f64>],
) -> Option<DMatrix<f64>> {
    let p = information.nrows();
    if scores.len() < LEAST_BATCHES {
        return None;
    }
    let freedom = (scores.len() - 1) as f64;
    let scale = DVector::from_fn(p, |j, _| 1.0 / information[(j, j)].sqrt());
    if !scale.iter().all(|x| x.is_finite()) {
        return None;
    }
    let scales = &scale * scale.transpose();
    let inverse = information.component_mul(&scales).cholesky()?.inverse().component_mul(&scales);
    let mean: DVector<f64> = scores.iter().sum::<DVector<f64>>() / scores.len() as f64;
    let mut meat = DMatrix::zeros(p, p);
    for score in scores {
        let off = score - &mean;
        meat += &off * off.transpose();
    }
    let robust = &inverse * meat * &inverse * (scores.len() as f64 / freedom);
    // Raises each standard deviation to that of the model and keeps the correlations.
    let grow = DVector::from_fn(p, |j, _| (inverse[(j, j)] / robust[(j, j)]).max(1.0).sqrt());
    Some(robust.component_mul(&(&grow * grow.transpose())))
}

/// Returns a root A of a covariance C, `A Aᵀ = C`, by which draws of a normal distribution are `A z`.
///
/// `A = D R^½` with D the standard deviations and R^½ the symmetric root of the correlations. It does not depend on
/// the signs and the order of eigenvectors, which rounding decides. A rounded R may have no Cholesky factor.
pub(crate) fn root(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let std = covariance.diagonal().map(|variance| variance.max(0.0).sqrt());
    let correlation = DMatrix::from_fn(n, n, |i, j| {
        let scale = std[i] * std[j];
        if scale > 0.0 { covariance[(i, j)] / scale } else { 0.0 }
    });
    let mut eigen = correlation.symmetric_eigen();
    eigen.eigenvalues.apply(|value| *value = value.max(0.0).sqrt());
    DMatrix::from_diagonal(&std) * eigen.recompose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_root_of_a_covariance_hardly_moves_with_its_rounding() {
        // The second and third numbers are alike, so that their eigenvectors are any two across.
        let [a, b] = [4.0, 9e-4];
        let covariance = DMatrix::from_row_slice(
            4,
            4,
            &[a, 0.0, 0.0, 0.6, 0.0, b, 0.0, 0.0, 0.0, 0.0, b, 0.0, 0.6, 0.0, 0.0, 1.0],
        );
        let found = root(&covariance);
        assert!((&found * found.transpose() - &covariance).amax() < 1e-12);
        for (i, j) in [(1, 2), (0, 1), (2, 3)] {
            let mut rounded = covariance.clone();
            let change = 1e-9 * (rounded[(i, i)] * rounded[(j, j)]).sqrt();
            rounded[(i, j)] += change;
            rounded[(j, i)] += change;
            assert!((root(&rounded) - &found).amax() < 1e-8, "{i} {j}");
        }
    }

    #[test]
    fn a_robust_variance_is_never_below_the_models() {
        let information = DMatrix::from_row_slice(2, 2, &[400.0, 100.0, 100.0, 900.0]);
        let own = information.clone().try_inverse().expect("definite");
        let quiet: Vec<DVector<f64>> =
            (0..30).map(|k| DVector::from_row_slice(&[0.1 * (k % 3) as f64, 0.05])).collect();
        let robust = robust_covariance(&information, &quiet).expect("batches");
        for j in 0..2 {
            assert!(robust[(j, j)] >= own[(j, j)] * (1.0 - 1e-12), "{robust} {own}");
        }
        assert_eq!(robust_covariance(&information, &quiet[..2]), None);
    }
}
