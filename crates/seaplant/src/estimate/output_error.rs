//! The output error method: least squares between simulated and measured motion.

mod bootstrap;
mod drift;
mod fit;
mod intervals;
mod minimise;
mod sensitivity;
mod stretch;

use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{EquationError, Fit, Records};
use crate::{Error, LumpedParameters};
pub use bootstrap::OutputErrorBootstrap;
use fit::{into_fit, search_all};
use sensitivity::Weighing;

/// Options of the output error method.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputError {
    /// Loss of a residual.
    pub loss: Loss,
    /// Source of the covariance.
    pub intervals: OutputErrorIntervals,
}

impl OutputError {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Setting`] for a limit of Huber's loss that is not positive, and for a number of
    /// bootstrap draws that is too small for a covariance or larger than useful.
    pub fn check(&self) -> Result<(), Error> {
        if let (Loss::Huber(limit), Err(_)) = (self.loss, self.loss.check()) {
            let expected = "above 0 and finite, such as 1.345";
            return Err(Error::setting("loss.huber", limit, expected));
        }
        if let OutputErrorIntervals::Bootstrap { draws, .. } = self.intervals
            && !DRAWS.contains(&draws)
        {
            let expected = format!("from {} to {}", DRAWS.start(), DRAWS.end());
            return Err(Error::setting("intervals.bootstrap.draws", draws, expected));
        }
        Ok(())
    }
}

/// Range of the number of draws: fewer do not determine a covariance; more improve it by less than
/// a hundredth, and each is a fit.
const DRAWS: RangeInclusive<usize> = bootstrap::LEAST_DRAWS..=10_000;

/// Source of the covariance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum OutputErrorIntervals {
    /// Contributions of thirty parts of the record.
    #[default]
    Sandwich,
    /// Fits to resampled measurements: simulated motion with residuals from other times.
    Bootstrap {
        /// Number of draws, at least 50.
        draws: usize,
        /// Seed of the random numbers; equal seeds give equal draws.
        seed: u64,
    },
}

/// Loss of a residual.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// Its square.
    #[default]
    Squares,
    /// Its square up to this many robust standard deviations, linear beyond, so that a few outliers
    /// have little effect. 1.345 costs 5 % of efficiency where there are none.
    Huber(f64),
}

impl Loss {
    /// Returns the weighing of residuals during the search.
    fn weighing(self) -> Weighing {
        match self {
            Self::Squares => Weighing::Squares,
            Self::Huber(limit) => Weighing::Huber(limit),
        }
    }

    fn check(self) -> Result<(), Error> {
        match self {
            Self::Huber(limit) if !(limit > 0.0 && limit.is_finite()) => {
                Err(Error::HuberLimit { found: limit })
            }
            _ => Ok(()),
        }
    }
}

impl OutputError {
    /// Fits the plant by least squares between simulated and measured motion.
    ///
    /// Minimises `Σ ρ((y − ŷ)/σ)` over the selected terms of `[α, β, μ, bias]`, common to all
    /// trials, and the initial state of each section without a gap in force. ŷ is velocity,
    /// position, or both where a record has both, each at its own times and divided by its own
    /// standard deviation. It is simulated by RK4 under the held force, with exact sensitivities:
    /// for `v̇ = α τ + β v|v| + μ v + bias` they follow `ṡⱼ = (2β|v| + μ) sⱼ + fⱼ`. Gauss–Newton
    /// steps are damped where they do not reduce the cost, and initial states are eliminated.
    ///
    /// A disturbance changes position permanently. Position residuals are therefore modelled as
    /// white noise plus a random walk, separated by maximum likelihood, and replaced by their
    /// innovations. For a fast walk these are increments of position; without one, position itself.
    ///
    /// The covariance follows from the contributions of thirty batches, each evaluated with the
    /// information of the others, with an autoregression between neighbours, since a disturbance
    /// persists in velocity for some time. Degrees of freedom are the independent batches minus the
    /// terms. Where force reacts to the disturbance (a vehicle that holds its depth), the plant
    /// itself is biased by an amount that no residual shows. [`OutputErrorIntervals`] offers an
    /// alternative. The residual of the fit is of velocity, or of position where only that was
    /// measured.
    ///
    /// The search starts from a fit by equation error, then from two other points. If none
    /// converges, an error is returned.
    ///
    /// # Errors
    /// As [`Records::dof`] and [`EquationError::fit`]; [`Error::TooShort`] for too few samples,
    /// [`Error::HuberLimit`], [`Error::NotConverged`], [`Error::NotExciting`] if the optimum is not
    /// unique, [`Error::FewDraws`] of a bootstrap.
    ///
    /// # Source
    /// [Morelli2016, ch. 6]: output error, and why its residuals are coloured; leaving batches out:
    /// \[Mackinnon1985\]; autoregression first: \[Andrews1992\], and its bias: \[Kendall1954\];
    /// Huber's loss: \[Huber1964\].
    ///
    /// ```
    /// use seaplant::estimate::OutputError;
    /// use seaplant::{AxisRecord, Dof, Motion, PhysicalParameters, State, Timed, simulate};
    /// let plant = PhysicalParameters { mass: 100.0, d_quadratic: 50.0, ..Default::default() };
    /// let times: Vec<f64> = (0..200).map(|k| 0.1 * f64::from(k)).collect();
    /// let thrust = times.iter().map(|t| 150.0 * (0.8 * t).sin()).collect::<Vec<_>>();
    /// let force = Timed::new("thrust", times.clone(), thrust)?;
    /// let moved = simulate(Dof::Surge, &plant.to_lumped(), &force, State::default(), &times)?;
    /// let axis = AxisRecord {
    ///     dof: Dof::Surge,
    ///     trial: "surge 1".to_owned(),
    ///     motion: Motion::Velocity(Timed::new("velocity", times, moved.velocity)?),
    ///     force,
    ///     thrusters: Vec::new(),
    ///     lever_rates: None,
    ///     turning: None,
    ///     position: None,
    ///     acceleration: None,
    ///     cuts: Vec::new(),
    /// };
    /// let fit = OutputError::default().fit(&[axis])?;
    /// assert!((fit.physical().mass - 100.0).abs() < 1e-3);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let records = records.into();
        let start = EquationError::default().fit(records)?.lumped;
        self.fit_from(records, &start)
    }

    /// Fits as [`OutputError::fit`], starting from a given plant.
    ///
    /// # Errors
    /// As [`OutputError::fit`].
    pub fn fit_from<'a>(
        &self,
        records: impl Into<Records<'a>>,
        start: &LumpedParameters,
    ) -> Result<Fit, Error> {
        let solution = search_all(records.into(), start, self)?;
        let fit = into_fit(&solution, self)?;
        match self.intervals {
            OutputErrorIntervals::Sandwich => Ok(fit),
            OutputErrorIntervals::Bootstrap { draws, seed } => {
                let bootstrap = OutputErrorBootstrap::around(&solution)?;
                let draws: Vec<LumpedParameters> =
                    (0..draws as u64).filter_map(|number| bootstrap.draw(seed, number)).collect();
                bootstrap.fit_with(&fit, &draws)
            }
        }
    }
}
