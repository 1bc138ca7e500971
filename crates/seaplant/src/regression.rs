//! Least squares on the columns of the plant model, with rank, conditioning and
//! a covariance that correlated residuals do not fool.

use nalgebra::{DMatrix, DVector, Matrix4};

use crate::terms::Term;
use crate::{Dof, Error, LumpedParameters, Terms};

/// The columns of one gapless stretch: every one has shape (n,).
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
    /// Time that one row stands for, s.
    pub period_s: f64,
}

/// What least squares found.
#[derive(Clone, Debug, PartialEq)]
pub struct LeastSquares {
    /// The coefficients; those of terms that were not fitted are zero.
    pub lumped: LumpedParameters,
    /// Covariance of `[α, β, μ, bias]` from batch means; zero where not fitted.
    pub covariance: Matrix4<f64>,
    /// Degrees of freedom for its t quantiles: batches less terms.
    pub t_freedom: f64,
    /// Condition number of the columns, each scaled to unit length.
    pub condition: f64,
    /// Variance inflation of each fitted term but the bias, in order.
    pub inflation: Vec<(Term, f64)>,
    /// Rows.
    pub samples: usize,
    /// Rows that would say as much if they were independent.
    pub effective_samples: f64,
    /// Root mean square of `v̇ − F Φ`, m/s² or rad/s².
    pub residual_rms: f64,
}

/// Columns whose smallest singular value is below this part of the largest are taken as
/// dependent: instruments have at most five digits.
const EXCITATION_FLOOR: f64 = 1e-6;

/// Rows that are reduced at a time: 512 rows of five numbers stay in the nearest cache.
const BLOCK_ROWS: usize = 512;

/// Residuals a batch apart are taken as independent …
const BATCH_S: f64 = 20.0;
/// … but there are never fewer batches than this, nor more than that.
const BATCHES: (usize, usize) = (10, 60);

impl Columns {
    fn len(&self) -> usize {
        self.v_dot.len()
    }

    /// One term of one row.
    fn term(&self, term: Term, row: usize) -> f64 {
        match term {
            Term::Force => self.tau[row],
            Term::Quadratic => self.quadratic[row],
            Term::Linear => self.linear[row],
            Term::Bias => 1.0,
        }
    }

    /// Rows `from..to` of one term, times `scale`, into `out`.
    fn write(&self, term: Term, from: usize, to: usize, scale: f64, out: &mut [f64]) {
        let column = match term {
            Term::Force => &self.tau,
            Term::Quadratic => &self.quadratic,
            Term::Linear => &self.linear,
            Term::Bias => return out.fill(scale),
        };
        out.iter_mut().zip(&column[from..to]).for_each(|(out, x)| *out = scale * x);
    }
}

/// Fits the lumped parameters of one degree of freedom to the columns of its stretches.
///
/// Minimises `‖F Φ − v̇‖₂`; row k of `F` (n × p) holds the chosen terms of
/// `[τ, v|v|, v, 1]`, and `Φ` (p × 1) their coefficients. Others are held at 0.
/// The covariance is `(FᵀF)⁻¹ S (FᵀF)⁻¹` with S from sums over batches of 20 s:
/// filtered residuals are correlated, and the textbook formula takes them as independent.
///
/// # Errors
/// [`Error::NotExciting`] if the columns of `F` are linearly dependent.
/// [`Error::NoTrial`] without rows.
///
/// # Source
/// [Jason2, eq. (7)], by orthogonal reduction and singular values: normal equations
/// square the condition number. Batch means: [Schruben1983].
pub fn least_squares(dof: Dof, stretches: &[Columns], terms: Terms) -> Result<LeastSquares, Error> {
    let samples: usize = stretches.iter().map(Columns::len).sum();
    if samples == 0 {
        return Err(Error::NoTrial { dof });
    }
    let fitted = terms.fitted();
    let needed = fitted.len();

    // Newtons (~1e3) sit beside m/s (~1e-1): unscaled, the rank test would
    // judge our choice of units instead of the trial.
    let scale: Vec<f64> = fitted.iter().map(|&term| 1.0 / norm(stretches, term)).collect();
    let triangle = reduce(stretches, &fitted, &scale);
    let r = triangle.view((0, 0), (needed, needed)).into_owned();
    let rhs = triangle.view((0, needed), (needed, 1)).into_owned();

    let svd = r.clone().svd(true, true);
    let largest = svd.singular_values.max();
    let rank = svd.rank(EXCITATION_FLOOR * largest);
    if rank < needed || !largest.is_finite() {
        return Err(Error::NotExciting { dof, rank, needed });
    }
    let condition = largest / svd.singular_values.min();
    let scaled = svd.solve(&rhs, 0.0).expect("U and Vᵀ were requested above");
    let coefficients: Vec<f64> = scaled.iter().zip(&scale).map(|(x, scale)| x * scale).collect();

    // (FᵀF)⁻¹ of the scaled columns, from R alone.
    let inverse = (r.transpose() * &r).try_inverse();
    let inverse = inverse.ok_or(Error::NotExciting { dof, rank, needed })?;
    let residual = Residuals::of(stretches, &fitted, &coefficients, &scale);
    let scaled_covariance = &inverse * residual.meat() * &inverse;

    let mut covariance = Matrix4::zeros();
    for (i, row) in fitted.iter().enumerate() {
        for (j, column) in fitted.iter().enumerate() {
            covariance[(*row as usize, *column as usize)] =
                scaled_covariance[(i, j)] * scale[i] * scale[j];
        }
    }
    Ok(LeastSquares {
        lumped: terms.unpack(&coefficients),
        covariance,
        t_freedom: residual.scores.len().saturating_sub(needed).max(1) as f64,
        condition,
        inflation: inflation(stretches, &fitted, &scale, &inverse),
        samples,
        effective_samples: residual.effective_samples(samples),
        residual_rms: (residual.square_sum / samples as f64).sqrt(),
    })
}

fn norm(stretches: &[Columns], term: Term) -> f64 {
    let square = |columns: &Columns| match term {
        Term::Force => sum_of_squares(&columns.tau),
        Term::Quadratic => sum_of_squares(&columns.quadratic),
        Term::Linear => sum_of_squares(&columns.linear),
        Term::Bias => columns.len() as f64,
    };
    stretches.iter().map(square).sum::<f64>().sqrt().max(f64::MIN_POSITIVE)
}

fn sum_of_squares(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum()
}

/// The triangle R of `[F v̇] = Q R`, block by block: shape (p+1, p+1).
fn reduce(stretches: &[Columns], fitted: &[Term], scale: &[f64]) -> DMatrix<f64> {
    let width = fitted.len() + 1;
    let mut triangle = DMatrix::zeros(width, width);
    for columns in stretches {
        for from in (0..columns.len()).step_by(BLOCK_ROWS) {
            let to = (from + BLOCK_ROWS).min(columns.len());
            let mut block = DMatrix::zeros(width + to - from, width);
            block.view_mut((0, 0), (width, width)).copy_from(&triangle);
            for (j, (&term, &scale)) in fitted.iter().zip(scale).enumerate() {
                let mut column = block.column_mut(j);
                columns.write(term, from, to, scale, &mut column.as_mut_slice()[width..]);
            }
            block.column_mut(width - 1).as_mut_slice()[width..]
                .copy_from_slice(&columns.v_dot[from..to]);
            triangle = block.qr().unpack_r();
        }
    }
    triangle
}

/// VIF_j = (FᵀF)⁻¹_jj Σ(x − x̄)², with x̄ = 0 where no bias is fitted.
fn inflation(
    stretches: &[Columns],
    fitted: &[Term],
    scale: &[f64],
    inverse: &DMatrix<f64>,
) -> Vec<(Term, f64)> {
    let rows: usize = stretches.iter().map(Columns::len).sum();
    let centred = fitted.contains(&Term::Bias);
    let of = |j: usize, term: Term| {
        let sum: f64 =
            stretches.iter().flat_map(|x| (0..x.len()).map(move |k| x.term(term, k))).sum();
        let mean = if centred { sum * scale[j] / rows as f64 } else { 0.0 };
        // Each scaled column has unit length.
        (inverse[(j, j)] * (1.0 - rows as f64 * mean * mean)).max(1.0)
    };
    let but_bias = fitted.iter().enumerate().filter(|(_, term)| **term != Term::Bias);
    but_bias.map(|(j, &term)| (term, of(j, term))).collect()
}

/// Residuals, summed as they are needed.
struct Residuals {
    /// Σ xᵀe of each batch, scaled columns.
    scores: Vec<DVector<f64>>,
    /// Mean residual of each batch, with its rows.
    means: Vec<(f64, usize)>,
    square_sum: f64,
}

impl Residuals {
    fn of(stretches: &[Columns], fitted: &[Term], coefficients: &[f64], scale: &[f64]) -> Self {
        let total_s: f64 = stretches.iter().map(|x| x.len() as f64 * x.period_s).sum();
        let batches = ((total_s / BATCH_S) as usize).clamp(BATCHES.0, BATCHES.1);
        let batch_s = total_s / batches as f64;
        let mut all = Self { scores: Vec::new(), means: Vec::new(), square_sum: 0.0 };
        for columns in stretches {
            let rows = ((batch_s / columns.period_s).round() as usize).max(1);
            for from in (0..columns.len()).step_by(rows) {
                let to = (from + rows).min(columns.len());
                all.add(columns, from..to, fitted, coefficients, scale);
            }
        }
        all
    }

    fn add(
        &mut self,
        columns: &Columns,
        rows: std::ops::Range<usize>,
        fitted: &[Term],
        coefficients: &[f64],
        scale: &[f64],
    ) {
        let mut score = DVector::zeros(fitted.len());
        let (mut sum, count) = (0.0, rows.len());
        for row in rows {
            let model: f64 = fitted
                .iter()
                .zip(coefficients)
                .map(|(&term, coefficient)| coefficient * columns.term(term, row))
                .sum();
            let e = columns.v_dot[row] - model;
            sum += e;
            self.square_sum += e * e;
            for (j, &term) in fitted.iter().enumerate() {
                score[j] += scale[j] * columns.term(term, row) * e;
            }
        }
        self.scores.push(score);
        self.means.push((sum / count as f64, count));
    }

    /// S = B/(B − p) Σ sᵦ sᵦᵀ.
    fn meat(&self) -> DMatrix<f64> {
        let (batches, terms) = (self.scores.len(), self.scores[0].len());
        let mut meat = DMatrix::zeros(terms, terms);
        for score in &self.scores {
            meat += score * score.transpose();
        }
        meat * (batches as f64 / batches.saturating_sub(terms).max(1) as f64)
    }

    /// n σ² / (rows a batch · variance of batch means), never more than n.
    fn effective_samples(&self, samples: usize) -> f64 {
        let n = samples as f64;
        let long_run: f64 =
            self.means.iter().map(|(mean, rows)| mean * mean * (*rows * *rows) as f64).sum::<f64>()
                / n;
        let variance = self.square_sum / n;
        if long_run > 0.0 { (n * variance / long_run).min(n) } else { n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two incommensurate tones, so that no two columns are alike.
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
    fn finds_every_coefficient_of_exact_columns() {
        let terms: Terms = "force,quadratic,linear,bias".parse().expect("valid");
        let fit = least_squares(Dof::Surge, &[columns(3000, PLANT)], terms).expect("exciting");
        let error = (fit.lumped.to_vector() - PLANT.to_vector()).component_div(&PLANT.to_vector());
        assert!(error.amax() < 1e-10, "{error}");
        assert!(fit.residual_rms < 1e-12);
    }

    #[test]
    fn several_stretches_count_as_one_fit() {
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
    fn columns_of_any_unit_have_the_same_condition() {
        let metres = columns(2000, PLANT);
        let mut millimetres = metres.clone();
        millimetres.quadratic.iter_mut().for_each(|x| *x *= 1e6);
        let condition = |columns| {
            least_squares(Dof::Surge, &[columns], Terms::default()).expect("exciting").condition
        };
        assert!((condition(metres) / condition(millimetres) - 1.0).abs() < 1e-9);
    }
}
