//! Simplified refined instrumental variables in continuous time.

mod instrumental;
mod prefilter;

use super::filtered::Filtered;
use super::{EquationErrorOptions, Filters, Fit, Method, fit_equation_error};
use crate::estimate::Intervals;
use crate::regression::{LeastSquares, batch_s};
use crate::{AxisRecord, Dof, Error, LumpedParameters, Terms};
use instrumental::{Rows, solve};
use prefilter::{Prefilter, Record};

/// Fits the plant by simplified refined instrumental variables (SRIV).
///
/// Every term of `v̇ = α τ + β v|v| + μ v + bias` passes `F = 1/(s + a)`, a the mean of
/// `2|β||v̂| + |μ|`: F is the plant's own response, by which noise in v becomes white in the
/// equation again, and `F v̇ = v − a F v − v₀ exp(−at)` needs no derivative. The
/// coefficients solve `Ẑᵀ(F v̇ − F Φ) = 0`, where the instruments Ẑ are the terms of the
/// *simulated* motion v̂, which force alone drives: noise of v is in the regressors, but not
/// in Ẑ, so that it does not pull the estimate as it pulls least squares. a, v̂ and the
/// initial velocity v₀ of every stretch follow from the coefficients; all are repeated
/// until they agree. v is smoothed lightly for v|v| alone, whose mean noise would lift.
///
/// Intervals are `(ẐᵀZ)⁻¹ S (ZᵀẐ)⁻¹` with S from batch means of Ẑᵀe. The residual is in
/// m/s or rad/s, since F integrates.
///
/// It is consistent if what the equation leaves has nothing to do with force: noise of
/// velocity, and a tether or swell too, as long as the pilot does not answer it. In closed
/// loop the controller does: through force the disturbance is in Ẑ as well, and the estimate
/// is biased, though not by sensor noise that the controller does not see. A lag, a delay
/// or a wrong thrust curve make Ẑ itself wrong, and a current is in the regressors: neither
/// goes away.
///
/// # Errors
/// As [`fit_equation_error`], from which it starts; [`Error::NotConverged`] if the
/// repetitions do not settle, [`Error::Diverged`] if a simulation runs away.
///
/// # Source
/// [Young2011, ch. 8]: SRIV in continuous time; \[Young1980\].
pub fn fit_sriv(
    dof: Dof,
    axes: &[AxisRecord],
    terms: Terms,
    options: &EquationErrorOptions,
) -> Result<Fit, Error> {
    let first = EquationErrorOptions { intervals: Intervals::BatchMeans, ..*options };
    let start = fit_equation_error(dof, axes, terms, &first)?.lumped;
    let Filtered { filters, stretches, caveats } = Filtered::of(dof, axes, options)?;
    let records: Vec<Record> = stretches
        .iter()
        .map(|stretch| Record::of(stretch, filters.velocity))
        .collect::<Result<_, _>>()?;
    let found = Refinement { dof, terms, records: &records }.refine(start)?;
    let filters = Filters { every_term: None, ..filters };
    Ok(Fit::of_regression(dof, Method::Sriv, terms, found, filters, caveats))
}

/// It settles in a dozen rounds, or not at all.
const MOST_ROUNDS: usize = 60;

/// Settled: no coefficient moves by more than this part of its standard deviation …
const SETTLED: f64 = 1e-4;
/// … or of itself, where there is no noise.
const ROUNDING: f64 = 1e-9;

struct Refinement<'a> {
    dof: Dof,
    terms: Terms,
    records: &'a [Record],
}

impl Refinement<'_> {
    fn refine(&self, start: LumpedParameters) -> Result<LeastSquares, Error> {
        let batch_s = batch_s(self.records.iter().map(Record::duration_s).sum());
        let mut plant = start;
        let mut starts: Vec<f64> = self.records.iter().map(Record::first_velocity).collect();
        for _ in 0..MOST_ROUNDS {
            let rows = self.rows(&plant, &starts)?;
            let found = solve(self.dof, self.terms, &rows, batch_s)?;
            let moved = found.lumped.to_vector() - plant.to_vector();
            plant = found.lumped;
            starts = rows.iter().map(|rows| rows.start_velocity(&plant)).collect();
            let std = found.covariance.diagonal().map(f64::sqrt);
            let near = SETTLED * std + ROUNDING * plant.to_vector().abs();
            if moved.abs().iter().zip(&near).all(|(moved, near)| moved <= near) {
                return Ok(found);
            }
        }
        Err(Error::NotConverged { dof: self.dof, iterations: MOST_ROUNDS })
    }

    /// The filtered terms of the measured motion and of the one that a plant makes.
    fn rows(&self, plant: &LumpedParameters, starts: &[f64]) -> Result<Vec<Rows>, Error> {
        let simulate = |(record, start): (&Record, &f64)| record.simulate(self.dof, plant, *start);
        let motions = self.records.iter().zip(starts).map(simulate);
        let motions: Vec<Vec<f64>> = motions.collect::<Result<_, _>>()?;
        let longest_s = self.records.iter().map(Record::duration_s).fold(0.0, f64::max);
        let prefilter = Prefilter::of(plant, motions.iter().flatten(), longest_s);
        let of = |(record, motion): (&Record, &Vec<f64>)| record.rows(&prefilter, motion);
        Ok(self.records.iter().zip(&motions).map(of).collect())
    }
}
