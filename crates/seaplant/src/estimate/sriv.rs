//! Simplified refined instrumental variables in continuous time.

mod instrumental;
mod prefilter;

use super::filtered::Filtered;
use super::{EquationError, Filters, Fit, Method, Records, first_delays};
use crate::regression::{LeastSquares, batch_s};
use crate::{Dof, Error, LumpedParameters, Terms};
use instrumental::{Rows, solve};
use prefilter::{Prefilter, Record};

/// Instrumental variables, with the filter on velocity of equation error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sriv(pub EquationError);

impl Sriv {
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
    /// As [`EquationError::fit_best_delay`], from which it starts; [`Error::NotConverged`] if the
    /// repetitions do not settle, [`Error::Diverged`] if a simulation runs away.
    ///
    /// # Source
    /// \[Young1980\], \[Young2011\]: SRIV in continuous time, of linear plants; here v|v| is one
    /// more input.
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let records = records.into();
        // A lag can make the drag of least squares negative; no motion could be simulated then.
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

/// It settles in a dozen rounds, or not at all.
const MOST_ROUNDS: usize = 100;

/// Settled: no coefficient moves by more than this part of its standard deviation …
const SETTLED: f64 = 1e-4;
/// … or of itself, where there is no noise.
const ROUNDING: f64 = 1e-9;

/// A step that is cut down to less than this goes nowhere.
const LEAST_PART: f64 = 1e-3;

/// A plant, and the initial velocity of every stretch.
struct Guess {
    plant: LumpedParameters,
    velocities: Vec<f64>,
}

/// What a guess makes of the records.
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

    /// The next guess: all the way, or as much of it as does not run away.
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

    /// The filtered terms of the measured motion and of the one that a plant makes.
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
