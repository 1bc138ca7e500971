//! Total least squares on the columns of the plant model.

use nalgebra::{DMatrix, DVector};

use super::triangle::{V_DOT, WIDTH};
use super::{LeastSquares, Reduced, Regression, sandwich};
use crate::terms::Term;
use crate::{Dof, Error};

/// Average covariance of a row's noise for measurement noise of unit variance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct NoiseShape {
    /// Variance of v|v|.
    pub(crate) quadratic: f64,
    /// Variance of v.
    pub(crate) linear: f64,
    /// Covariance of v|v| and v.
    pub(crate) quadratic_linear: f64,
    /// Variance of v̇.
    pub(crate) v_dot: f64,
}

impl NoiseShape {
    /// Returns a covariance; zero for columns without noise.
    fn between(&self, a: Option<Term>, b: Option<Term>) -> f64 {
        match (a, b) {
            (None, None) => self.v_dot,
            (Some(Term::Quadratic), Some(Term::Quadratic)) => self.quadratic,
            (Some(Term::Linear), Some(Term::Linear)) => self.linear,
            (Some(Term::Quadratic), Some(Term::Linear))
            | (Some(Term::Linear), Some(Term::Quadratic)) => self.quadratic_linear,
            // v̇ and v have the same noise through an odd and an even kernel: they are
            // uncorrelated.
            _ => 0.0,
        }
    }
}

/// The result of total least squares.
pub(crate) struct TotalSolution {
    pub(crate) found: LeastSquares,
    /// Standard deviation of measurement noise that would explain all residuals.
    pub(crate) implied_noise: f64,
}

impl Regression {
    /// Solves total least squares with noise in v|v|, v and v̇; τ and the constant are exact.
    ///
    /// With X the noisy columns and C the covariance of their noise, minimises
    /// `Σ e² / zᵀCz` with `e = v̇ − F Φ` and `z = [Φ_X; −1]`. One QR decomposition eliminates
    /// the exact columns; `z = L⁻ᵀ y` with y the last right singular vector of the remainder
    /// of `[X v̇]`, times L⁻ᵀ, C = L Lᵀ; the exact columns' coefficients follow.
    ///
    /// The covariance is `B⁻¹ S B⁻¹`, with `B = FᵀF − λ C` (C with zeros for exact columns),
    /// λ = Σe²/zᵀCz, and S from sums over batches of `F e + e²/(zᵀCz) C z`, which are zero
    /// over all rows.
    ///
    /// # Errors
    /// As [`least_squares`](super::least_squares); [`Error::NotExciting`] too if
    /// noise would explain a noisy column as well as v̇.
    ///
    /// # Source
    /// \[VanHuffel1991\]: mixed least squares and total least squares, and its generalisation
    /// to correlated noise; covariance: \[Fuller1987\].
    pub(crate) fn solve_total(self, dof: Dof, noise: &NoiseShape) -> Result<TotalSolution, Error> {
        let rows = self.reduce(dof)?;
        let factored = rows.factored()?;
        let mixed = Mixed::new(&rows, noise);
        let coefficients = mixed.coefficients()?;
        let mut residuals = rows.residuals(&coefficients);
        let pull = &mixed.noise_of_terms() * &coefficients;
        let variance = coefficients.dot(&pull) + noise.v_dot;
        for (score, batch) in residuals.scores.iter_mut().zip(&rows.batches) {
            let square = rows.residual(&batch.triangle, &coefficients).norm_squared();
            *score += &pull * (square / variance);
        }
        let per_noise = residuals.square_sum / variance;
        let bread = mixed.bread(per_noise)?;
        let covariance = sandwich(&bread, &residuals);
        let found = rows.found(&factored, &coefficients, &residuals, &covariance);
        Ok(TotalSolution { found, implied_noise: (per_noise / rows.samples as f64).sqrt() })
    }
}

/// The scaled columns in order: exact ones, noisy ones, v̇.
struct Mixed<'a> {
    rows: &'a Reduced,
    noise: &'a NoiseShape,
    /// Indices among the fitted terms.
    exact: Vec<usize>,
    noisy: Vec<usize>,
}

impl<'a> Mixed<'a> {
    fn new(rows: &'a Reduced, noise: &'a NoiseShape) -> Self {
        let is_noisy = |j: &usize| matches!(rows.fitted[*j], Term::Quadratic | Term::Linear);
        let (noisy, exact) = (0..rows.fitted.len()).partition(is_noisy);
        Self { rows, noise, exact, noisy }
    }

    fn not_exciting(&self) -> Error {
        let needed = self.rows.fitted.len();
        Error::NotExciting { dof: self.rows.dof, rank: needed - 1, needed }
    }

    /// Returns the covariance of noise in two scaled columns; `None` is v̇.
    fn noise_between(&self, a: Option<usize>, b: Option<usize>) -> f64 {
        let term = |j: Option<usize>| j.map(|j| self.rows.fitted[j]);
        let scale = |j: Option<usize>| j.map_or(1.0, |j| self.rows.scale[j]);
        self.noise.between(term(a), term(b)) * scale(a) * scale(b)
    }

    /// Returns the covariance of noise in all fitted terms; zero for exact ones.
    fn noise_of_terms(&self) -> DMatrix<f64> {
        let terms = self.rows.fitted.len();
        DMatrix::from_fn(terms, terms, |i, j| self.noise_between(Some(i), Some(j)))
    }

    fn coefficients(&self) -> Result<DVector<f64>, Error> {
        let (first, rest) = (self.exact.len(), self.noisy.len());
        let order: Vec<Option<usize>> =
            self.exact.iter().chain(&self.noisy).map(|&j| Some(j)).chain([None]).collect();
        let whole = &self.rows.whole;
        let columns = DMatrix::from_fn(WIDTH, order.len(), |i, k| {
            order[k].map_or(whole.column(V_DOT)[i], |j| self.rows.column(whole, j)[i])
        });
        let r = columns.qr().r();

        let last = &order[first..];
        let noise =
            DMatrix::from_fn(rest + 1, rest + 1, |i, j| self.noise_between(last[i], last[j]));
        let root = noise.cholesky().ok_or_else(|| self.not_exciting())?.l();
        let cleared = r.view((first, first), (rest + 1, rest + 1)).transpose();
        let white = root.solve_lower_triangular(&cleared).ok_or_else(|| self.not_exciting())?;
        let y = weakest_direction(&white.transpose()).ok_or_else(|| self.not_exciting())?;
        let z = root.transpose().solve_upper_triangular(&y).ok_or_else(|| self.not_exciting())?;
        let noisy = z.rows(0, rest) / -z[rest];

        let rhs =
            r.view((0, first + rest), (first, 1)) - r.view((0, first), (first, rest)) * &noisy;
        let exact = r.view((0, 0), (first, first)).solve_upper_triangular(&rhs);
        let exact = exact.ok_or_else(|| self.not_exciting())?;
        let mut coefficients = DVector::zeros(first + rest);
        let values = exact.iter().chain(noisy.iter());
        order.iter().flatten().zip(values).for_each(|(&j, value)| coefficients[j] = *value);
        Ok(coefficients)
    }

    /// Returns `(FᵀF − λ C)⁻¹`.
    fn bread(&self, per_noise: f64) -> Result<DMatrix<f64>, Error> {
        let terms = self.rows.fitted.len();
        let column = |j: usize| self.rows.column(&self.rows.whole, j);
        let squares = DMatrix::from_fn(terms, terms, |i, j| column(i).dot(&column(j)));
        let information = squares - self.noise_of_terms() * per_noise;
        Ok(information.cholesky().ok_or_else(|| self.not_exciting())?.inverse())
    }
}

/// Returns the right singular vector of the least singular value, if the last column takes part in
/// it: otherwise the noise hides a collinearity of the other columns.
fn weakest_direction(columns: &DMatrix<f64>) -> Option<DVector<f64>> {
    if !columns.iter().all(|x| x.is_finite()) {
        return None;
    }
    let others = columns.columns(0, columns.ncols() - 1).into_owned();
    let least_of_others = others.singular_values().min();
    let svd = columns.clone().svd(false, true);
    let (least, value) = svd.singular_values.argmin();
    (value < least_of_others).then(|| svd.v_t.map(|v_t| v_t.row(least).transpose())).flatten()
}
