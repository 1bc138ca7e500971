//! Instrumental variables: one step.

use nalgebra::{DMatrix, DVector, Matrix4};

use crate::regression::{EXCITATION_FLOOR, LeastSquares, Residuals};
use crate::terms::Term;
use crate::{Dof, Error, LumpedParameters, Terms};

/// What one stretch says; columns are those of [`Term::ALL`].
pub(super) struct Rows {
    period_s: f64,
    /// What has gone through the filter since the start of the stretch does not know its
    /// initial velocity; `exp(−at)` times that makes up for it.
    decay: Vec<f64>,
    v_dot: Vec<f64>,
    terms: [Vec<f64>; 4],
    instruments: [Vec<f64>; 4],
    /// What was taken off to be clear of `decay`, as multiples of it.
    v_dot_part: f64,
    term_parts: [f64; 4],
}

impl Rows {
    /// Clears all columns of the initial velocity, which is thereby fitted.
    pub(super) fn of(
        period_s: f64,
        mut v_dot: Vec<f64>,
        mut terms: [Vec<f64>; 4],
        mut instruments: [Vec<f64>; 4],
        decay: Vec<f64>,
    ) -> Self {
        let v_dot_part = clear(&mut v_dot, &decay);
        let term_parts = std::array::from_fn(|j| clear(&mut terms[j], &decay));
        instruments.iter_mut().for_each(|column| _ = clear(column, &decay));
        Self { period_s, decay, v_dot, terms, instruments, v_dot_part, term_parts }
    }

    /// The initial velocity that suits a plant.
    pub(super) fn start_velocity(&self, plant: &LumpedParameters) -> f64 {
        let coefficients = plant.to_vector();
        let foretold: f64 =
            coefficients.iter().zip(self.term_parts).map(|(c, part)| c * part).sum();
        self.v_dot_part - foretold
    }

    fn len(&self) -> usize {
        self.decay.len()
    }
}

/// Takes off a column what goes along with another, and tells how much of that.
fn clear(column: &mut [f64], other: &[f64]) -> f64 {
    let part = dot(column, other) / dot(other, other);
    column.iter_mut().zip(other).for_each(|(x, other)| *x -= part * other);
    part
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Solves `Ẑᵀ(v̇ − Z Φ) = 0`, all columns at unit length.
///
/// # Errors
/// [`Error::NotExciting`] if instruments and terms hardly go together.
pub(super) fn solve(
    dof: Dof,
    terms: Terms,
    stretches: &[Rows],
    batch_s: f64,
) -> Result<LeastSquares, Error> {
    let system = System::of(terms, stretches);
    let solved = system.solve(dof)?;
    let residuals = system.residuals(&solved.lumped, batch_s);
    let scaled = &solved.inverse * residuals.meat() * solved.inverse.transpose();
    let mut covariance = Matrix4::zeros();
    for (i, row) in system.fitted.iter().enumerate() {
        for (j, column) in system.fitted.iter().enumerate() {
            covariance[(*row as usize, *column as usize)] =
                scaled[(i, j)] * system.scale[i] * system.scale[j];
        }
    }
    let samples = stretches.iter().map(Rows::len).sum();
    Ok(LeastSquares {
        lumped: solved.lumped,
        covariance,
        t_freedom: residuals.freedom(system.fitted.len()),
        condition: solved.condition,
        inflation: system.inflation(&solved.inverse),
        samples,
        effective_samples: residuals.effective_samples(samples),
        residual_rms: (residuals.square_sum / samples as f64).sqrt(),
    })
}

struct System<'a> {
    terms: Terms,
    fitted: Vec<Term>,
    stretches: &'a [Rows],
    /// What brings terms and instruments to unit length.
    scale: Vec<f64>,
    instrument_scale: Vec<f64>,
}

struct Solved {
    lumped: LumpedParameters,
    /// (ẐᵀZ)⁻¹, scaled.
    inverse: DMatrix<f64>,
    condition: f64,
}

impl<'a> System<'a> {
    fn of(terms: Terms, stretches: &'a [Rows]) -> Self {
        let fitted = terms.fitted();
        let scale = |columns: fn(&Rows) -> &[Vec<f64>; 4]| {
            let unit = |&term: &Term| {
                let squares = |rows: &Rows| {
                    let column = &columns(rows)[term as usize];
                    dot(column, column)
                };
                let length = stretches.iter().map(squares).sum::<f64>().sqrt();
                1.0 / length.max(f64::MIN_POSITIVE)
            };
            fitted.iter().map(unit).collect()
        };
        let (scale, instrument_scale) =
            (scale(|rows| &rows.terms), scale(|rows| &rows.instruments));
        Self { terms, fitted, stretches, scale, instrument_scale }
    }

    /// Σ over all stretches of the scaled instrument of a fitted term, times something.
    fn along(&self, i: usize, column: impl Fn(&Rows) -> &[f64]) -> f64 {
        let instrument = self.fitted[i] as usize;
        let of = |rows: &Rows| dot(&rows.instruments[instrument], column(rows));
        self.instrument_scale[i] * self.stretches.iter().map(of).sum::<f64>()
    }

    fn solve(&self, dof: Dof) -> Result<Solved, Error> {
        let needed = self.fitted.len();
        let cross = DMatrix::from_fn(needed, needed, |i, j| {
            let term = self.fitted[j] as usize;
            self.scale[j] * self.along(i, |rows| &rows.terms[term])
        });
        let rhs = DVector::from_fn(needed, |i, _| self.along(i, |rows| &rows.v_dot));
        if !cross.iter().all(|x| x.is_finite()) {
            return Err(Error::TooLarge { dof });
        }
        let values = cross.singular_values();
        // Products of columns: the square of what is asked of the columns themselves.
        let floor = EXCITATION_FLOOR.powi(2) * values.max();
        let rank = values.iter().filter(|value| **value > floor).count();
        let not_exciting = Error::NotExciting { dof, rank, needed };
        if rank < needed {
            return Err(not_exciting);
        }
        let inverse = cross.try_inverse().ok_or(not_exciting)?;
        let scaled = &inverse * rhs;
        let coefficients: Vec<f64> = scaled.iter().zip(&self.scale).map(|(c, s)| c * s).collect();
        let condition = (values.max() / values.min()).sqrt();
        Ok(Solved { lumped: self.terms.unpack(&coefficients), inverse, condition })
    }

    fn residuals(&self, plant: &LumpedParameters, batch_s: f64) -> Residuals {
        let mut all = Residuals::default();
        for rows in self.stretches {
            let coefficients = plant.to_vector();
            let error = |k: usize| {
                let foretold: f64 =
                    rows.terms.iter().zip(&coefficients).map(|(column, c)| c * column[k]).sum();
                rows.v_dot[k] - foretold
            };
            let errors: Vec<f64> = (0..rows.len()).map(error).collect();
            let batch = ((batch_s / rows.period_s).round() as usize).max(1);
            for from in (0..rows.len()).step_by(batch) {
                let span = from..(from + batch).min(rows.len());
                let e = &errors[span.clone()];
                let score = |(term, scale): (&Term, &f64)| {
                    scale * dot(&rows.instruments[*term as usize][span.clone()], e)
                };
                let scores = self.fitted.iter().zip(&self.instrument_scale).map(score);
                all.scores.push(DVector::from_iterator(self.fitted.len(), scores));
                all.sums.push(e.iter().sum());
                all.square_sum += dot(e, e);
            }
        }
        all
    }

    /// VIF_j = (ẐᵀZ)⁻¹_jj Σ(x − x̄)², as if instruments were the terms themselves.
    fn inflation(&self, inverse: &DMatrix<f64>) -> Vec<(Term, f64)> {
        let bias = self.fitted.iter().position(|term| *term == Term::Bias);
        let of = |(j, &term): (usize, &Term)| {
            let mean_part = bias.map_or(0.0, |bias| {
                self.scale[j] * self.along(bias, |rows| &rows.terms[term as usize])
            });
            (term, (inverse[(j, j)] * (1.0 - mean_part * mean_part)).max(1.0))
        };
        let but_bias = self.fitted.iter().enumerate().filter(|(_, term)| **term != Term::Bias);
        but_bias.map(of).collect()
    }
}
