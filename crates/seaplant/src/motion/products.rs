//! Products of small matrices, written out by columns: general matrix products are slow for small
//! sizes.

use nalgebra::{ArrayStorage, SMatrix, SVector};

/// Returns A B.
pub(crate) fn times<const M: usize, const K: usize, const N: usize>(
    a: &SMatrix<f64, M, K>,
    b: &SMatrix<f64, K, N>,
) -> SMatrix<f64, M, N> {
    let mut product = [[0.0; M]; N];
    for (column, by) in product.iter_mut().zip(&b.data.0) {
        *column = combined(&a.data.0, by);
    }
    SMatrix::from_data(ArrayStorage(product))
}

/// Returns A Bᵀ.
pub(crate) fn times_transposed<const M: usize, const K: usize, const N: usize>(
    a: &SMatrix<f64, M, K>,
    b: &SMatrix<f64, N, K>,
) -> SMatrix<f64, M, N> {
    let mut product = [[0.0; M]; N];
    for (of_a, of_b) in a.data.0.iter().zip(&b.data.0) {
        for (column, &factor) in product.iter_mut().zip(of_b) {
            add_scaled(column, of_a, factor);
        }
    }
    SMatrix::from_data(ArrayStorage(product))
}

/// Returns A Bᵀ for a B that is mostly zero.
pub(crate) fn times_sparse_transposed<const M: usize, const K: usize, const N: usize>(
    a: &SMatrix<f64, M, K>,
    b: &SMatrix<f64, N, K>,
) -> SMatrix<f64, M, N> {
    let mut product = [[0.0; M]; N];
    for (of_a, of_b) in a.data.0.iter().zip(&b.data.0) {
        for (column, &factor) in product.iter_mut().zip(of_b).filter(|(_, by)| **by != 0.0) {
            add_scaled(column, of_a, factor);
        }
    }
    SMatrix::from_data(ArrayStorage(product))
}

/// Returns A x.
pub(crate) fn apply<const M: usize, const N: usize>(
    a: &SMatrix<f64, M, N>,
    x: &SVector<f64, N>,
) -> SVector<f64, M> {
    SVector::from_data(ArrayStorage([combined(&a.data.0, &x.data.0[0])]))
}

/// Subtracts x yᵀ from A.
pub(crate) fn subtract_outer<const M: usize, const N: usize>(
    a: &mut SMatrix<f64, M, N>,
    x: &SVector<f64, M>,
    y: &SVector<f64, N>,
) {
    for (column, &factor) in a.data.0.iter_mut().zip(&y.data.0[0]) {
        add_scaled(column, &x.data.0[0], -factor);
    }
}

/// Subtracts x yᵀ + u vᵀ from A.
pub(crate) fn subtract_outers<const M: usize, const N: usize>(
    a: &mut SMatrix<f64, M, N>,
    (x, y): (&SVector<f64, M>, &SVector<f64, N>),
    (u, v): (&SVector<f64, M>, &SVector<f64, N>),
) {
    let ([x], [y], [u], [v]) = (&x.data.0, &y.data.0, &u.data.0, &v.data.0);
    for ((column, y), v) in a.data.0.iter_mut().zip(y).zip(v) {
        for ((entry, x), u) in column.iter_mut().zip(x).zip(u) {
            *entry -= x * y + u * v;
        }
    }
}

/// Returns Σ_k a_k x_k over the columns of a matrix.
fn combined<const M: usize, const N: usize>(a: &[[f64; M]; N], x: &[f64; N]) -> [f64; M] {
    let mut sum = [0.0; M];
    for (column, &factor) in a.iter().zip(x) {
        add_scaled(&mut sum, column, factor);
    }
    sum
}

fn add_scaled<const N: usize>(sum: &mut [f64; N], x: &[f64; N], factor: f64) {
    for (sum, &x) in sum.iter_mut().zip(x) {
        *sum += factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounding of sums of three products of numbers of order one.
    const ROUNDING: f64 = 1e-14;

    #[test]
    fn products_agree_with_the_library() {
        let a = SMatrix::<f64, 4, 3>::from_fn(|i, j| (1.0 + i as f64) / (2.0 + j as f64));
        let b = SMatrix::<f64, 3, 2>::from_fn(|i, j| i as f64 - 0.7 * j as f64);
        let (x, y) = (SVector::from([0.3, -1.0, 2.0, 0.7]), SVector::from([1.0, 0.5, -0.2]));
        assert!((times(&a, &b) - a * b).amax() < ROUNDING);
        assert!((times_transposed(&a, &b.transpose()) - a * b).amax() < ROUNDING);
        let thin = SMatrix::<f64, 2, 3>::new(0.0, 0.5, 0.0, -0.7, 0.0, 0.0);
        assert!((times_sparse_transposed(&a, &thin) - a * thin.transpose()).amax() < ROUNDING);
        assert!((apply(&a, &y) - a * y).amax() < ROUNDING);
        let mut less = a;
        subtract_outer(&mut less, &x, &y);
        assert!((less - (a - x * y.transpose())).amax() < ROUNDING);
        let mut less = a;
        subtract_outers(&mut less, (&x, &y), (&(x * 0.3), &(y * 2.0)));
        assert!((less - (a - x * y.transpose() * 1.6)).amax() < ROUNDING);
    }
}
