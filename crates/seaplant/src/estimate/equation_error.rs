mod statistics;

pub use statistics::{EquationErrorStatistics, Shard, ShardClock};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::filtered::Filtered;
use super::{Fit, Method, Records};
use crate::regression::{BlockBootstrap, Intervals, Regression, Resampled};
use crate::signal::LowPass;
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Error};

/// Options of the equation error method; other regressions with equally filtered terms use its
/// filters as well.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EquationError {
    /// Light filter on velocity before it is squared, which keeps noise out of v|v|.
    pub velocity_filter: LowPass,
    /// Filter on all terms, including v̇ and force.
    pub term_filter: LowPass,
    /// Source of the intervals.
    pub intervals: Intervals,
    /// Settings of the block bootstrap, if intervals come from it.
    pub bootstrap: BlockBootstrap,
}

impl Default for EquationError {
    fn default() -> Self {
        Self {
            velocity_filter: LowPass { cutoff_hz: 1.5, order: 2 },
            term_filter: LowPass { cutoff_hz: 0.5, order: 2 },
            intervals: Intervals::default(),
            bootstrap: BlockBootstrap::default(),
        }
    }
}

impl EquationError {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Setting`] for an invalid filter or bootstrap.
    pub fn check(&self) -> Result<(), Error> {
        self.velocity_filter.check().map_err(|error| error.within("velocity_filter"))?;
        self.term_filter.check().map_err(|error| error.within("term_filter"))?;
        self.bootstrap.check().map_err(|error| error.within("bootstrap"))
    }

    /// Fits the plant by least squares on the equation of motion, with equally filtered terms.
    ///
    /// v is smoothed lightly, squared and differentiated; then v̇, τ, v|v| and v pass the same
    /// filter H, which leaves the equation valid: `H v̇ = α H τ + β H v|v| + μ H v + bias`. Force
    /// is the mean over each sample interval.
    ///
    /// Where motion was sampled too slowly for the filters, their cut-off frequencies are lowered,
    /// or the light one is omitted, with a caveat.
    ///
    /// Intervals, from batch means or a block bootstrap, include random error with correlated
    /// residuals. They do not include bias: a persistent force that is missing in the equation
    /// (tether, current) moves the vehicle and is correlated with v|v|, and no resampling of the
    /// same record shows its effect.
    ///
    /// # Errors
    /// As [`Records::dof`]; [`Error::TooShort`] for records shorter than the filter,
    /// [`Error::NotExciting`], [`Error::Bootstrap`].
    ///
    /// # Source
    /// [Morelli2016, ch. 5]: equation error; equal filtering as in \[Young2011\].
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let filtered = Filtered::of(records.into(), self)?;
        let (dof, terms) = (filtered.dof, filtered.terms);
        let (found, doubts) = match self.intervals {
            Intervals::BatchMeans => {
                let rows = filtered.add_to(Regression::new(filtered.duration_s(), terms))?;
                (rows.solve(dof)?, Vec::new())
            }
            Intervals::BlockBootstrap => {
                let empty = self.bootstrap.regression(filtered.duration_s(), terms)?;
                let resampled = filtered.add_to(empty)?.solve_by_blocks(dof, &self.bootstrap)?;
                let doubts = doubts(dof, &resampled, &self.bootstrap);
                (resampled.found, doubts)
            }
        };
        let Filtered { filters, mut caveats, .. } = filtered;
        caveats.extend(doubts);
        Ok(Fit::of_regression(dof, Method::EquationError, terms, found, filters, caveats))
    }

    /// Fits the plant with thrust shifted by each of several delays, and keeps the fit with the
    /// smallest residual: a first test for lag, delay and clock offsets.
    ///
    /// Where only acceleration was measured, the plant is selected from a grid, by the agreement of
    /// the acceleration simulated from rest.
    ///
    /// # Errors
    /// As [`EquationError::fit`], if no delay can be fitted; [`Error::Setting`] without delays.
    pub fn fit_best_delay<'a>(
        &self,
        records: impl Into<Records<'a>>,
        delays_s: impl Iterator<Item = f64>,
    ) -> Result<DelayedFit, Error> {
        let records = records.into();
        records.dof()?;
        if records.fit.iter().any(|axis| !axis.knows_velocity()) {
            return super::first_look(records, delays_s);
        }
        // Only estimates and residuals are used.
        let plain = Self { intervals: Intervals::BatchMeans, ..*self };
        let mut best: Option<DelayedFit> = None;
        let mut refused = Error::setting("delays_s", "empty", "one delay or more");
        for delay_s in delays_s {
            let late: Vec<AxisRecord> =
                records.fit.iter().map(|axis| axis.delayed(delay_s)).collect();
            match plain.fit(Records { fit: &late, ..records }) {
                Ok(fit) => {
                    if best.as_ref().is_none_or(|best| fit.residual_rms < best.fit.residual_rms) {
                        best = Some(DelayedFit { delay_s, fit });
                    }
                }
                Err(error) => refused = error,
            }
        }
        best.ok_or(refused)
    }
}

/// Returns caveats for errors that the intervals of the bootstrap do not include.
fn doubts(dof: Dof, resampled: &Resampled, bootstrap: &BlockBootstrap) -> Vec<Caveat> {
    let Resampled { discarded, block_correlation, .. } = *resampled;
    let of = bootstrap.resamples;
    let narrow = (discarded > 0).then(|| {
        let message = format!(
            "in {discarded} of {of} resampled records the {dof} terms cannot be separated; these records are left out, so that the intervals are too narrow: the fit depends on a few moments of the trial; use a longer one"
        );
        Caveat::warning(CaveatCode::FewEffectiveSamples, message)
    });
    let biased = block_correlation.map(|correlation| {
        let message = format!(
            "the residual of the {dof} equation is correlated over seconds (correlation {correlation:.2} from one quarter of a block to the next), as under a slowly varying force such as that of a tether or a current: such a force biases mass and drag, which resampling the same record cannot show; compare with filter-error"
        );
        Caveat::warning(CaveatCode::ResidualsNotWhite, message)
    });
    narrow.into_iter().chain(biased).collect()
}

/// A fit with thrust shifted in time.
#[derive(Clone, Debug, PartialEq)]
pub struct DelayedFit {
    /// Delay of the thrust, s.
    pub delay_s: f64,
    /// The fit.
    pub fit: Fit,
}
