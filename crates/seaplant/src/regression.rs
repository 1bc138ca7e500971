//! Least squares on the columns of the plant model, with rank, conditioning and a covariance that
//! is valid for correlated residuals.

mod bootstrap;
mod residuals;
mod sums;
mod triangle;

use nalgebra::linalg::SVD;
use nalgebra::{DMatrix, DVector, Dyn, Matrix4, SVector};

pub(crate) use bootstrap::Resampled;
pub use bootstrap::{BlockBootstrap, Intervals};
pub(crate) use residuals::Residuals;
pub(crate) use sums::Sums;
use triangle::{BLOCK_ROWS, Batch, Block, ONE, Triangle, V_DOT, WIDTH, place, width};

use crate::terms::Term;
use crate::{Dof, Error, LumpedParameters, Terms};

/// The columns of one stretch without gaps, each of shape (n,).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    /// v̇, the left-hand side.
    pub v_dot: Vec<f64>,
    /// τ.
    pub tau: Vec<f64>,
    /// v|v|.
    pub quadratic: Vec<f64>,
    /// v.
    pub linear: Vec<f64>,
    /// Duration of one row, s.
    pub period_s: f64,
}

/// The result of least squares.
#[derive(Clone, Debug, PartialEq)]
pub struct LeastSquares {
    /// The coefficients; those of terms that were not fitted are zero.
    pub lumped: LumpedParameters,
    /// Covariance of `[α, β, μ, bias]` from batch means; zero where not fitted.
    pub covariance: Matrix4<f64>,
    /// Degrees of freedom of its t quantiles: batches less terms.
    pub t_freedom: f64,
    /// Condition number of the columns, each scaled to unit length.
    pub condition: f64,
    /// Variance inflation factors of the fitted terms but the bias, in order.
    pub inflation: Vec<(Term, f64)>,
    /// The number of rows.
    pub samples: usize,
    /// The number of independent rows with the same information.
    pub effective_samples: f64,
    /// Root mean square of `v̇ − F Φ`, m/s² or rad/s².
    pub residual_rms: f64,
}

/// Columns whose smallest singular value is below this fraction of the largest count as dependent:
/// instruments have at most five digits.
pub(crate) const EXCITATION_FLOOR: f64 = 1e-6;

/// Length of a batch, beyond which residuals count as independent, s …
const BATCH_S: f64 = 20.0;
/// … with at least and at most this many batches.
pub(crate) const BATCHES: (usize, usize) = (10, 60);

impl Columns {
    fn rows(&self) -> impl Iterator<Item = Row> + '_ {
        let terms = self.tau.iter().zip(&self.quadratic).zip(&self.linear);
        let rows = terms.zip(&self.v_dot);
        rows.map(|(((&tau, &quadratic), &linear), &v_dot)| [tau, quadratic, linear, v_dot])
    }

    fn duration_s(&self) -> f64 {
        self.v_dot.len() as f64 * self.period_s
    }
}

/// Fits the lumped parameters of one degree of freedom to the columns of its stretches.
///
/// Minimises `‖F Φ − v̇‖₂`; row k of `F` (n × p) holds the chosen terms of
/// `[τ, v|v|, v, 1]`, and `Φ` (p × 1) their coefficients. Others are fixed at 0.
/// The covariance is `(FᵀF)⁻¹ S (FᵀF)⁻¹` with S from sums over batches of 20 s:
/// filtered residuals are correlated, and the textbook formula assumes them independent.
///
/// # Errors
/// [`Error::NotExciting`] if the columns of `F` are linearly dependent.
/// [`Error::NoTrial`] without rows.
///
/// # Source
/// [Jason2, eq. (7)], by orthogonal reduction and singular values: normal equations
/// square the condition number. Batch means: \[Schruben1983\].
pub fn least_squares(dof: Dof, stretches: &[Columns], terms: Terms) -> Result<LeastSquares, Error> {
    let mut regression = Regression::new(stretches.iter().map(Columns::duration_s).sum(), terms);
    for columns in stretches {
        regression.start_stretch(columns.period_s);
        regression.add(&columns.rows().collect::<Vec<_>>());
    }
    regression.solve(dof)
}
/// τ, v|v|, v and v̇ at one instant.
pub(crate) type Row = [f64; 4];

/// Sequential least squares, which does not store rows.
///
/// Each batch of rows `[F v̇]` becomes the triangle R of its QR decomposition, which determines
/// rank, solution and the sums of residuals: `v̇ − F Φ = Q R [−Φ; 1]`.
pub(crate) struct Regression {
    terms: Terms,
    batch_s: f64,
    batch_rows: usize,
    batches: Vec<Batch>,
    block: Block,
}

/// Returns the number of batches in stretches of total duration `total_s`.
pub(crate) fn batches_of(total_s: f64) -> usize {
    ((total_s / BATCH_S) as usize).clamp(BATCHES.0, BATCHES.1)
}

/// Returns the duration of one of these batches, s.
pub(crate) fn batch_s(total_s: f64) -> f64 {
    total_s / batches_of(total_s) as f64
}

impl Regression {
    /// Starts a regression on stretches of total duration `total_s`.
    pub(crate) fn new(total_s: f64, terms: Terms) -> Self {
        Self::in_batches(batch_s(total_s), terms)
    }

    /// Starts a regression with batches of duration `batch_s`.
    fn in_batches(batch_s: f64, terms: Terms) -> Self {
        Self { terms, batch_s, batch_rows: 1, batches: Vec::new(), block: Block::default() }
    }

    /// Creates a regression from rows that are already reduced.
    pub(crate) fn of_batches(batches: Vec<Batch>, terms: Terms) -> Self {
        Self { batches, ..Self::in_batches(BATCH_S, terms) }
    }

    /// Starts a stretch: no batch extends across a gap.
    pub(crate) fn start_stretch(&mut self, period_s: f64) {
        self.finish_block();
        self.batch_rows = ((self.batch_s / period_s).round() as usize).max(1);
        self.batches.push(Batch::default());
    }

    pub(crate) fn add(&mut self, rows: &[Row]) {
        self.add_with(rows, None);
    }

    /// Adds equations that were multiplied or differenced, so that the constant's column is `ones`
    /// instead of 1.
    pub(crate) fn add_transformed(&mut self, rows: &[Row], ones: &[f64]) {
        self.add_with(rows, Some(ones));
    }

    fn add_with(&mut self, mut rows: &[Row], mut ones: Option<&[f64]>) {
        while !rows.is_empty() {
            let in_batch = self.batches.last().map_or(0, |batch| batch.rows) + self.block.rows;
            let room = (BLOCK_ROWS - self.block.rows).min(self.batch_rows - in_batch);
            let (now, later) = rows.split_at(room.min(rows.len()));
            let (ones_now, ones_later) = ones.map(|ones| ones.split_at(now.len())).unzip();
            self.block.push(now, ones_now);
            if now.len() == room {
                self.finish_block();
            }
            (rows, ones) = (later, ones_later);
        }
    }

    fn finish_block(&mut self) {
        let Some(batch) = self.batches.last_mut() else { return };
        batch.rows += self.block.rows;
        batch.triangle.absorb(&mut self.block.columns, self.block.rows, width(self.terms));
        self.block.rows = 0;
        if batch.rows >= self.batch_rows {
            self.batches.push(Batch::default());
        }
    }

    /// Solves for the coefficients.
    ///
    /// # Errors
    /// As [`least_squares`].
    pub(crate) fn solve(self, dof: Dof) -> Result<LeastSquares, Error> {
        let rows = self.reduce(dof)?;
        let factored = rows.factored()?;
        let coefficients = factored.solve(&rows.whole.column(V_DOT));
        let residuals = rows.residuals(&coefficients);
        let covariance = sandwich(&factored.inverse, &residuals);
        Ok(rows.found(&factored, &coefficients, &residuals, &covariance))
    }

    fn reduce(mut self, dof: Dof) -> Result<Reduced, Error> {
        self.finish_block();
        self.batches.retain(|batch| batch.rows > 0);
        let samples: usize = self.batches.iter().map(|batch| batch.rows).sum();
        if samples == 0 {
            return Err(Error::NoTrial { dof });
        }
        let fitted = self.terms.fitted();
        let whole = Triangle::merged(&self.batches);
        // Newtons (~1e3) stand next to m/s (~1e-1): unscaled, the rank test would depend on the
        // choice of units instead of the trial.
        let unit = |&term: &Term| 1.0 / whole.column(place(term)).norm().max(f64::MIN_POSITIVE);
        let scale = DVector::from_iterator(fitted.len(), fitted.iter().map(unit));
        Ok(Reduced { dof, terms: self.terms, fitted, whole, batches: self.batches, scale, samples })
    }
}

/// The reduced rows of all batches.
struct Reduced {
    dof: Dof,
    terms: Terms,
    fitted: Vec<Term>,
    batches: Vec<Batch>,
    whole: Triangle,
    /// Scale factors that bring each fitted column to unit length.
    scale: DVector<f64>,
    samples: usize,
}

/// A factorisation of the scaled columns.
struct Factored {
    svd: SVD<f64, Dyn, Dyn>,
    /// (FᵀF)⁻¹.
    inverse: DMatrix<f64>,
    condition: f64,
}

impl Factored {
    /// Returns the scaled coefficients.
    fn solve(&self, rhs: &SVector<f64, WIDTH>) -> DVector<f64> {
        let rhs = DVector::from_column_slice(rhs.as_slice());
        self.svd.solve(&rhs, 0.0).expect("U and Vᵀ were asked for")
    }
}

/// Returns `(FᵀF)⁻¹ S (FᵀF)⁻¹` of the scaled columns.
fn sandwich(inverse: &DMatrix<f64>, residuals: &Residuals) -> DMatrix<f64> {
    inverse * residuals.meat() * inverse
}

impl Reduced {
    /// Returns a fitted column of reduced rows, scaled.
    fn column(&self, rows: &Triangle, j: usize) -> SVector<f64, WIDTH> {
        rows.column(place(self.fitted[j])) * self.scale[j]
    }

    fn factored(&self) -> Result<Factored, Error> {
        let needed = self.fitted.len();
        let columns = DMatrix::from_fn(WIDTH, needed, |i, j| self.column(&self.whole, j)[i]);
        // The iteration for singular values does not terminate unless all are finite.
        if !columns.iter().all(|x| x.is_finite()) {
            return Err(Error::TooLarge { dof: self.dof });
        }
        let svd = columns.svd(true, true);
        let largest = svd.singular_values.max();
        let rank = svd.rank(EXCITATION_FLOOR * largest);
        if rank < needed || !largest.is_finite() {
            return Err(Error::NotExciting { dof: self.dof, rank, needed });
        }
        // (FᵀF)⁻¹ = V Σ⁻² Vᵀ of the scaled columns.
        let v_t = svd.v_t.as_ref().expect("asked for above");
        let inverse = v_t.transpose()
            * DMatrix::from_diagonal(&svd.singular_values.map(|s| 1.0 / (s * s)))
            * v_t;
        let condition = largest / svd.singular_values.min();
        Ok(Factored { svd, inverse, condition })
    }

    /// Returns the residual of reduced rows for scaled coefficients, in reduced form.
    fn residual(&self, rows: &Triangle, coefficients: &DVector<f64>) -> SVector<f64, WIDTH> {
        let mut e = rows.column(V_DOT);
        for (j, coefficient) in coefficients.iter().enumerate() {
            e -= self.column(rows, j) * *coefficient;
        }
        e
    }

    fn residuals(&self, coefficients: &DVector<f64>) -> Residuals {
        let mut all = Residuals::default();
        let per_one = (self.samples as f64).sqrt() / self.whole.column(ONE).norm();
        for Batch { triangle, .. } in &self.batches {
            let e = self.residual(triangle, coefficients);
            let score = |j: usize| self.column(triangle, j).dot(&e);
            all.scores
                .push(DVector::from_iterator(self.fitted.len(), (0..self.fitted.len()).map(score)));
            all.sums.push(per_one * triangle.column(ONE).dot(&e));
            all.square_sum += e.norm_squared();
        }
        all
    }

    fn found(
        &self,
        factored: &Factored,
        coefficients: &DVector<f64>,
        residuals: &Residuals,
        scaled_covariance: &DMatrix<f64>,
    ) -> LeastSquares {
        let mut covariance = Matrix4::zeros();
        for (i, row) in self.fitted.iter().enumerate() {
            for (j, column) in self.fitted.iter().enumerate() {
                covariance[(*row as usize, *column as usize)] =
                    scaled_covariance[(i, j)] * self.scale[i] * self.scale[j];
            }
        }
        LeastSquares {
            lumped: self.terms.unpack(coefficients.component_mul(&self.scale).as_slice()),
            covariance,
            t_freedom: residuals.freedom(self.fitted.len()),
            condition: factored.condition,
            inflation: self.inflation(&factored.inverse),
            samples: self.samples,
            effective_samples: residuals.effective_samples(self.samples),
            residual_rms: (residuals.square_sum / self.samples as f64).sqrt(),
        }
    }

    /// Returns VIF_j = (FᵀF)⁻¹_jj Σ(x − x̄)², with x̄ = 0 where no bias is fitted.
    fn inflation(&self, inverse: &DMatrix<f64>) -> Vec<(Term, f64)> {
        let one = self.whole.column(ONE);
        let of = |j: usize| {
            let mean_part = if self.terms.has(Term::Bias) {
                one.dot(&self.column(&self.whole, j)) / one.norm()
            } else {
                0.0
            };
            // Each scaled column has unit length.
            (inverse[(j, j)] * (1.0 - mean_part * mean_part)).max(1.0)
        };
        let but_bias = self.fitted.iter().enumerate().filter(|(_, term)| **term != Term::Bias);
        but_bias.map(|(j, &term)| (term, of(j))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Builds columns of two incommensurate tones, so that no two columns are collinear.
    fn columns(n: usize, plant: LumpedParameters) -> Columns {
        let time = |k: usize| 0.1 * k as f64;
        let tau: Vec<f64> = (0..n).map(|k| 900.0 * (0.7 * time(k)).sin()).collect();
        let v: Vec<f64> =
            (0..n).map(|k| 0.5 * (0.31 * time(k)).cos() + 0.2 * (1.3 * time(k)).sin()).collect();
        Columns {
            v_dot: tau.iter().zip(&v).map(|(&tau, &v)| plant.acceleration(tau, v)).collect(),
            quadratic: v.iter().map(|v| v * v.abs()).collect(),
            tau,
            linear: v,
            period_s: 0.1,
        }
    }

    const PLANT: LumpedParameters =
        LumpedParameters { alpha: 7.71e-5, beta: -0.172, mu: -0.01, bias: 0.0197 };

    #[test]
    fn recovers_every_coefficient_from_exact_columns() {
        let terms: Terms = "force,quadratic,linear,bias".parse().expect("valid");
        let fit = least_squares(Dof::Surge, &[columns(3000, PLANT)], terms).expect("exciting");
        let error = (fit.lumped.to_vector() - PLANT.to_vector()).component_div(&PLANT.to_vector());
        assert!(error.amax() < 1e-10, "{error}");
        assert!(fit.residual_rms < 1e-12);
    }

    #[test]
    fn several_stretches_equal_one_fit() {
        let whole = columns(3000, PLANT);
        let part = |from: usize, to: usize| Columns {
            v_dot: whole.v_dot[from..to].to_vec(),
            tau: whole.tau[from..to].to_vec(),
            quadratic: whole.quadratic[from..to].to_vec(),
            linear: whole.linear[from..to].to_vec(),
            period_s: whole.period_s,
        };
        let terms = Terms::default();
        let one = least_squares(Dof::Surge, std::slice::from_ref(&whole), terms).expect("ok");
        let two = least_squares(Dof::Surge, &[part(0, 1234), part(1234, 3000)], terms).expect("ok");
        let error = (one.lumped.to_vector() - two.lumped.to_vector()).amax();
        assert!(error < 1e-12, "{error}");
    }

    #[test]
    fn refuses_constant_thrust_and_speed() {
        let still = Columns {
            v_dot: vec![0.0; 100],
            tau: vec![500.0; 100],
            quadratic: vec![0.25; 100],
            linear: vec![0.5; 100],
            period_s: 0.1,
        };
        let refused = least_squares(Dof::Heave, &[still], Terms::default());
        assert_eq!(refused, Err(Error::NotExciting { dof: Dof::Heave, rank: 1, needed: 3 }));
    }

    #[test]
    fn the_condition_number_does_not_depend_on_units() {
        let metres = columns(2000, PLANT);
        let mut millimetres = metres.clone();
        millimetres.quadratic.iter_mut().for_each(|x| *x *= 1e6);
        let condition = |columns| {
            least_squares(Dof::Surge, &[columns], Terms::default()).expect("exciting").condition
        };
        assert!((condition(metres) / condition(millimetres) - 1.0).abs() < 1e-9);
    }
}
