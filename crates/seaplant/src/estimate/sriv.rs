//! Simplified refined instrumental variables in continuous time.

mod instrumental;
mod prefilter;

use super::filtered::Filtered;
use super::{EquationError, Filters, Fit, Method, Records, first_delays};
use crate::regression::{LeastSquares, batch_s};
use crate::{Dof, Error, LumpedParameters, Terms};
use instrumental::{Rows, solve};
use prefilter::{Prefilter, Record};

/// Instrumental variables, with the velocity filter of equation error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sriv(pub EquationError);

impl Sriv {
    /// Fits the plant by simplified refined instrumental variables (SRIV).
    ///
    /// Every term of `v̇ = α τ + β v|v| + μ v + bias` passes `F = 1/(s + a)`, where a is the mean
    /// of `2|β||v̂| + |μ|`. F is the plant's own linearised response: it makes noise of v white in
    /// the equation, and `F v̇ = v − a F v − v₀ exp(−at)` needs no derivative. The coefficients
    /// solve `Ẑᵀ(F v̇ − F Φ) = 0`, where the instruments Ẑ are the terms of the *simulated* motion
    /// v̂ under force alone: noise of v enters the regressors but not Ẑ, and so does not bias the
    /// estimate as it does in least squares. a, v̂ and the initial velocity v₀ of every section
    /// follow from the coefficients; all are iterated until they converge. v is smoothed lightly
    /// only for v|v|, whose mean noise would increase.
    ///
    /// Intervals are `(ẐᵀZ)⁻¹ S (ZᵀẐ)⁻¹` with S from batch means of Ẑᵀe. The residual is in m/s or
    /// rad/s, since F integrates.
    ///
    /// The estimate is consistent if the equation's residual is uncorrelated with force: velocity
    /// noise, and also tether or swell, as long as the pilot does not react to it. In closed loop
    /// the controller does: the disturbance enters Ẑ through force, and the estimate is biased,
    /// although not by sensor noise that the controller does not see. A lag, a delay or a wrong
    /// thrust curve make Ẑ itself wrong, and a current enters the regressors: these errors remain.
    ///
    /// # Errors
    /// As [`EquationError::fit_best_delay`], from which it starts; [`Error::NotConverged`] if the
    /// iteration does not converge, [`Error::Diverged`] if a simulation diverges.
    ///
    /// # Source
    /// \[Young1980\], \[Young2011\]: SRIV in continuous time, for linear plants; here v|v| is one
    /// more input.
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let records = records.into();
        // A lag can make the drag of least squares negative, with which no motion can be simulated.
        let start = self.0.fit_best_delay(records, first_delays())?.fit.lumped;
        let Filtered { dof, terms, filters, stretches, caveats } = Filtered::of(records, &self.0)?;
        let records: Vec<Record> = stretches
            .iter()
            .map(|stretch| Record::of(stretch, filters.velocity))
            .collect::<Result<_, _>>()?;
        let found = Refinement { dof, terms, records: &records }.refine(start)?;
        let filters = Filters { every_term: None, ..filters };
        Ok(Fit::of_regression(dof, Method::Sriv, terms, found, filters, caveats))
    }
}

/// Maximum number of rounds; it converges in about a dozen, or not at all.
const MOST_ROUNDS: usize = 100;

/// Converged: no coefficient changes by more than this fraction of its standard deviation …
const SETTLED: f64 = 1e-4;
/// … or of itself, for noise-free data.
const ROUNDING: f64 = 1e-9;

/// Minimum fraction of a step, below which the iteration fails.
const LEAST_PART: f64 = 1e-3;

/// A plant, and the initial velocity of every section.
struct Guess {
    plant: LumpedParameters,
    velocities: Vec<f64>,
}

/// Filtered terms at a guess.
struct Simulated {
    guess: Guess,
    rows: Vec<Rows>,
}

struct Refinement<'a> {
    dof: Dof,
    terms: Terms,
    records: &'a [Record],
}

impl Refinement<'_> {
    fn refine(&self, start: LumpedParameters) -> Result<LeastSquares, Error> {
        let batch_s = batch_s(self.records.iter().map(Record::duration_s).sum());
        let first_velocities = self.records.iter().map(Record::first_velocity).collect();
        let mut now = self.simulated(Guess { plant: start, velocities: first_velocities })?;
        for _ in 0..MOST_ROUNDS {
            let found = solve(self.dof, self.terms, &now.rows, batch_s)?;
            let moved = found.lumped.to_vector() - now.guess.plant.to_vector();
            let std = found.covariance.diagonal().map(f64::sqrt);
            let near = SETTLED * std + ROUNDING * found.lumped.to_vector().abs();
            if moved.abs().iter().zip(&near).all(|(moved, near)| moved <= near) {
                return Ok(found);
            }
            now = self.towards(&now, found.lumped)?;
        }
        Err(Error::NotConverged { dof: self.dof, iterations: MOST_ROUNDS })
    }

    /// Returns the next guess: the complete step, or the largest part of it whose simulation does
    /// not diverge.
    fn towards(&self, from: &Simulated, plant: LumpedParameters) -> Result<Simulated, Error> {
        let velocities: Vec<f64> =
            from.rows.iter().map(|rows| rows.start_velocity(&plant)).collect();
        let (old, new) = (from.guess.plant.to_vector(), plant.to_vector());
        let mut part = 1.0;
        loop {
            let plant = LumpedParameters::from_vector(&(old + part * (new - old)));
            match self.simulated(Guess { plant, velocities: velocities.clone() }) {
                Err(Error::Diverged { .. }) if part > LEAST_PART => part *= 0.5,
                simulated => return simulated,
            }
        }
    }

    /// Computes the filtered terms of the measured motion and of the simulated one.
    fn simulated(&self, guess: Guess) -> Result<Simulated, Error> {
        let simulate =
            |(record, start): (&Record, &f64)| record.simulate(self.dof, &guess.plant, *start);
        let motions = self.records.iter().zip(&guess.velocities).map(simulate);
        let motions: Vec<Vec<f64>> = motions.collect::<Result<_, _>>()?;
        let longest_s = self.records.iter().map(Record::duration_s).fold(0.0, f64::max);
        let prefilter = Prefilter::of(&guess.plant, motions.iter().flatten(), longest_s);
        let of = |(record, motion): (&Record, &Vec<f64>)| record.rows(&prefilter, motion);
        let rows = self.records.iter().zip(&motions).map(of).collect();
        Ok(Simulated { guess, rows })
    }
}
