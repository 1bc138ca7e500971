//! Least squares on the columns of the plant model, with rank, conditioning and
//! a covariance that correlated residuals do not fool.

use nalgebra::{DMatrix, DVector, Matrix4, SVector};

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
pub(crate) const EXCITATION_FLOOR: f64 = 1e-6;

/// Residuals a batch apart are taken as independent …
const BATCH_S: f64 = 20.0;
/// … but there are never fewer batches than this, nor more than that.
const BATCHES: (usize, usize) = (10, 60);

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
/// square the condition number. Batch means: \[Schruben1983\].
pub fn least_squares(dof: Dof, stretches: &[Columns], terms: Terms) -> Result<LeastSquares, Error> {
    let mut regression = Regression::of(stretches.iter().map(Columns::duration_s).sum(), terms);
    for columns in stretches {
        regression.start_stretch(columns.period_s);
        regression.add(&columns.rows().collect::<Vec<_>>());
    }
    regression.solve(dof)
}

/// τ, v|v|, v and v̇ of one instant.
pub(crate) type Row = [f64; 4];

/// Least squares on rows that are seen once and not kept.
///
/// Each batch of rows `[F v̇]` becomes the triangle R of its QR decomposition, from which
/// rank, solution and the residuals' sums all follow: `v̇ − F Φ = Q R [−Φ; 1]`.
pub(crate) struct Regression {
    terms: Terms,
    batch_s: f64,
    batch_rows: usize,
    batches: Vec<Batch>,
    block: Block,
}

impl Regression {
    /// For rows of stretches that last `total_s` together.
    pub(crate) fn of(total_s: f64, terms: Terms) -> Self {
        let batches = ((total_s / BATCH_S) as usize).clamp(BATCHES.0, BATCHES.1);
        let batch_s = total_s / batches as f64;
        Self { terms, batch_s, batch_rows: 1, batches: Vec::new(), block: Block::default() }
    }

    /// No batch goes on across a gap.
    pub(crate) fn start_stretch(&mut self, period_s: f64) {
        self.finish_block();
        self.batch_rows = ((self.batch_s / period_s).round() as usize).max(1);
        self.batches.push(Batch::default());
    }

    pub(crate) fn add(&mut self, mut rows: &[Row]) {
        while !rows.is_empty() {
            let in_batch = self.batches.last().map_or(0, |batch| batch.rows) + self.block.rows;
            let room = (BLOCK_ROWS - self.block.rows).min(self.batch_rows - in_batch);
            let (now, later) = rows.split_at(room.min(rows.len()));
            self.block.push(now);
            if now.len() == room {
                self.finish_block();
            }
            rows = later;
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

    /// What the rows say.
    ///
    /// # Errors
    /// As [`least_squares`].
    pub(crate) fn solve(mut self, dof: Dof) -> Result<LeastSquares, Error> {
        self.finish_block();
        self.batches.retain(|batch| batch.rows > 0);
        let samples: usize = self.batches.iter().map(|batch| batch.rows).sum();
        if samples == 0 {
            return Err(Error::NoTrial { dof });
        }
        let fitted = self.terms.fitted();
        let needed = fitted.len();
        let whole = Triangle::of(&self.batches);

        // Newtons (~1e3) sit beside m/s (~1e-1): unscaled, the rank test would
        // judge our choice of units instead of the trial.
        let scale = DVector::from_iterator(
            needed,
            fitted
                .iter()
                .map(|&term| 1.0 / whole.column(place(term)).norm().max(f64::MIN_POSITIVE)),
        );
        let columns =
            DMatrix::from_fn(WIDTH, needed, |i, j| whole.column(place(fitted[j]))[i] * scale[j]);
        let svd = columns.svd(true, true);
        let largest = svd.singular_values.max();
        let rank = svd.rank(EXCITATION_FLOOR * largest);
        if rank < needed || !largest.is_finite() {
            return Err(Error::NotExciting { dof, rank, needed });
        }
        let rhs = whole.column(V_DOT);
        let scaled = svd.solve(&rhs, 0.0).expect("U and Vᵀ were requested above");
        let coefficients: Vec<f64> = scaled.component_mul(&scale).iter().copied().collect();

        // (FᵀF)⁻¹ = V Σ⁻² Vᵀ of the scaled columns.
        let v_t = svd.v_t.as_ref().expect("requested above");
        let inverse = v_t.transpose()
            * DMatrix::from_diagonal(&svd.singular_values.map(|s| 1.0 / (s * s)))
            * v_t;
        let residual = Residuals::of(&self.batches, &fitted, &coefficients, &scale);
        let scaled_covariance = &inverse * residual.meat() * &inverse;

        let mut covariance = Matrix4::zeros();
        for (i, row) in fitted.iter().enumerate() {
            for (j, column) in fitted.iter().enumerate() {
                covariance[(*row as usize, *column as usize)] =
                    scaled_covariance[(i, j)] * scale[i] * scale[j];
            }
        }
        Ok(LeastSquares {
            lumped: self.terms.unpack(&coefficients),
            covariance,
            t_freedom: residual.scores.len().saturating_sub(needed).max(1) as f64,
            condition: largest / svd.singular_values.min(),
            inflation: inflation(&whole, &fitted, &scale, &inverse),
            samples,
            effective_samples: residual.effective_samples(samples),
            residual_rms: (residual.square_sum / samples as f64).sqrt(),
        })
    }
}

/// The columns of a triangle: `[τ, v|v|, 1, v̇, v]`; the last is seldom fitted, and then
/// costs nothing.
const WIDTH: usize = 5;
const ONE: usize = 2;
const V_DOT: usize = 3;

fn width(terms: Terms) -> usize {
    if terms.has(Term::Linear) { WIDTH } else { WIDTH - 1 }
}

const fn place(term: Term) -> usize {
    match term {
        Term::Force => 0,
        Term::Quadratic => 1,
        Term::Bias => ONE,
        Term::Linear => 4,
    }
}

/// Rows that are reduced at a time: 512 rows of five numbers stay in the nearest cache.
const BLOCK_ROWS: usize = 512;

/// Rows on their way into a triangle, column by column.
struct Block {
    columns: [[f64; BLOCK_ROWS]; WIDTH],
    rows: usize,
}

impl Default for Block {
    fn default() -> Self {
        Self { columns: [[0.0; BLOCK_ROWS]; WIDTH], rows: 0 }
    }
}

impl Block {
    fn push(&mut self, rows: &[Row]) {
        let space = self.rows..self.rows + rows.len();
        for (term, place) in [
            (0, place(Term::Force)),
            (1, place(Term::Quadratic)),
            (2, place(Term::Linear)),
            (3, V_DOT),
        ] {
            let column = self.columns[place][space.clone()].iter_mut();
            column.zip(rows).for_each(|(x, row)| *x = row[term]);
        }
        self.columns[ONE][space].fill(1.0);
        self.rows += rows.len();
    }
}

/// Rows that follow each other, reduced.
#[derive(Default)]
struct Batch {
    triangle: Triangle,
    rows: usize,
}

/// R of a QR decomposition, row by row.
#[derive(Clone, Copy, Default)]
struct Triangle([[f64; WIDTH]; WIDTH]);

impl Triangle {
    fn of(batches: &[Batch]) -> Self {
        let mut whole = Self::default();
        for batch in batches {
            let mut columns: [[f64; WIDTH]; WIDTH] =
                std::array::from_fn(|j| batch.triangle.column(j).into());
            whole.absorb(&mut columns, WIDTH, WIDTH);
        }
        whole
    }

    /// R of this triangle with rows of a block below it, by Householder reflections, in
    /// the first `width` columns; the block is used up.
    fn absorb<const N: usize>(&mut self, block: &mut [[f64; N]; WIDTH], rows: usize, width: usize) {
        for j in 0..width {
            let (done, rest) = block[..width].split_at_mut(j + 1);
            let mirror = &done[j][..rows];
            let square = dot(mirror, mirror);
            if square == 0.0 {
                continue;
            }
            let top = self.0[j][j];
            let reflected = -(top * top + square).sqrt().copysign(top);
            let mirror_top = top - reflected;
            let weight = 2.0 / (mirror_top * mirror_top + square);
            self.0[j][j] = reflected;
            for (k, column) in rest.iter_mut().enumerate() {
                let top = &mut self.0[j][j + 1 + k];
                let column = &mut column[..rows];
                let part = weight * (mirror_top * *top + dot(mirror, column));
                *top -= part * mirror_top;
                column.iter_mut().zip(mirror).for_each(|(x, mirror)| *x -= part * mirror);
            }
        }
    }

    fn column(&self, j: usize) -> SVector<f64, WIDTH> {
        SVector::from_fn(|i, _| self.0[i][j])
    }
}

/// A scalar product in eight sums side by side: one alone waits for itself.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..8 {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

/// VIF_j = (FᵀF)⁻¹_jj Σ(x − x̄)², with x̄ = 0 where no bias is fitted.
fn inflation(
    whole: &Triangle,
    fitted: &[Term],
    scale: &DVector<f64>,
    inverse: &DMatrix<f64>,
) -> Vec<(Term, f64)> {
    let one = whole.column(ONE);
    let of = |j: usize, term: Term| {
        let column = whole.column(place(term)) * scale[j];
        let mean_part =
            if fitted.contains(&Term::Bias) { one.dot(&column) / one.norm() } else { 0.0 };
        // Each scaled column has unit length.
        (inverse[(j, j)] * (1.0 - mean_part * mean_part)).max(1.0)
    };
    let but_bias = fitted.iter().enumerate().filter(|(_, term)| **term != Term::Bias);
    but_bias.map(|(j, &term)| (term, of(j, term))).collect()
}

/// Sums of the residuals.
#[derive(Default)]
struct Residuals {
    /// Σ xᵀe of each batch, scaled columns.
    scores: Vec<DVector<f64>>,
    /// Sum of the residuals of each batch.
    sums: Vec<f64>,
    /// Σ e².
    square_sum: f64,
}

impl Residuals {
    fn of(batches: &[Batch], fitted: &[Term], coefficients: &[f64], scale: &DVector<f64>) -> Self {
        let mut all = Self::default();
        for Batch { triangle, .. } in batches {
            let mut e = triangle.column(V_DOT);
            for (&term, coefficient) in fitted.iter().zip(coefficients) {
                e -= triangle.column(place(term)) * *coefficient;
            }
            let score =
                |(&term, scale): (&Term, &f64)| triangle.column(place(term)).dot(&e) * scale;
            all.scores
                .push(DVector::from_iterator(fitted.len(), fitted.iter().zip(scale).map(score)));
            all.sums.push(triangle.column(ONE).dot(&e));
            all.square_sum += e.norm_squared();
        }
        all
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
        let long_run = self.sums.iter().map(|sum| sum * sum).sum::<f64>() / n;
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
