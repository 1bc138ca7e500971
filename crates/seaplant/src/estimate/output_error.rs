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
use fit::{found, into_fit};
use sensitivity::Weighing;

/// The output error method with its choices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputError {
    /// How a residual counts.
    pub loss: Loss,
    /// Where the covariance comes from.
    pub intervals: OutputErrorIntervals,
}

impl OutputError {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Setting`] for a limit of Huber's loss that is not above zero, and for draws of a
    /// bootstrap that are too few to tell a covariance or more than it needs.
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

/// Fewer draws do not tell a covariance, more tell it no better than to a hundredth, and each is
/// a fit.
const DRAWS: RangeInclusive<usize> = bootstrap::LEAST_DRAWS..=10_000;

/// Where a covariance comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum OutputErrorIntervals {
    /// From what each of thirty parts of the record contributes.
    #[default]
    Sandwich,
    /// From fits to drawn measurements: simulated motion with residuals of other times.
    Bootstrap {
        /// How many; at least 50.
        draws: usize,
        /// Equal seeds give equal draws.
        seed: u64,
    },
}

/// How a residual counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// By its square.
    #[default]
    Squares,
    /// By its square up to so many robust standard deviations, in proportion beyond: a few
    /// outliers do not matter. 1.345 costs 5 % of efficiency where there are none.
    Huber(f64),
}

impl Loss {
    /// How the search weighs residuals.
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
    /// Minimises `Σ ρ((y − ŷ)/σ)` over the chosen ones of `[α, β, μ, bias]`, which all trials
    /// share, and the initial state of every stretch without a gap in force. ŷ is velocity,
    /// position, or both where a record has both, each at its own times and in its own
    /// standard deviations, by RK4 under the held force, with exact
    /// sensitivities: of `v̇ = α τ + β v|v| + μ v + bias` they follow
    /// `ṡⱼ = (2β|v| + μ) sⱼ + fⱼ`. Steps are those of Gauss and Newton, damped where that
    /// does not go downhill, with the initial states eliminated.
    ///
    /// A disturbance changes position for good, so that residuals of position are taken as
    /// white noise plus a random walk, which maximum likelihood tells apart, and y − ŷ of
    /// position is what is new in each. Under a quick walk those are increments of position;
    /// without one, position itself.
    ///
    /// The covariance is that of what each of thirty batches contributes, judged by the
    /// information of the others, with an autoregression between neighbours: what disturbs a
    /// vehicle stays in its velocity for a while. Degrees of freedom are independent batches
    /// less terms. Where force reacts to what disturbs (a vehicle that holds its depth), the
    /// plant itself is off, and no residual tells by how much. [`OutputErrorIntervals`] has another way.
    /// The fit's residual is of velocity, or of position where that alone was measured.
    ///
    /// The search begins at a fit by equation error. From there, or from one of two others, it
    /// converges, or there is no answer.
    ///
    /// # Errors
    /// As [`Records::dof`] and [`EquationError::fit`]; [`Error::TooShort`] for hardly any samples,
    /// [`Error::HuberLimit`], [`Error::NotConverged`], [`Error::NotExciting`] if the optimum
    /// is no point but a line, [`Error::FewDraws`] of a bootstrap.
    ///
    /// # Source
    /// [Morelli2016, ch. 6]: output error, and why its residuals are coloured; leaving batches
    /// out: \[Mackinnon1985\]; autoregression first: \[Andrews1992\], and its bias:
    /// \[Kendall1954\]; Huber's loss: \[Huber1964\].
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

    /// As [`OutputError::fit`], from a plant that is given.
    ///
    /// # Errors
    /// As [`OutputError::fit`].
    pub fn fit_from<'a>(
        &self,
        records: impl Into<Records<'a>>,
        start: &LumpedParameters,
    ) -> Result<Fit, Error> {
        let found = found(records.into(), start, self)?;
        let fit = into_fit(&found, self)?;
        match self.intervals {
            OutputErrorIntervals::Sandwich => Ok(fit),
            OutputErrorIntervals::Bootstrap { draws, seed } => {
                let bootstrap = OutputErrorBootstrap::around(&found)?;
                let draws: Vec<LumpedParameters> =
                    (0..draws as u64).filter_map(|number| bootstrap.draw(seed, number)).collect();
                bootstrap.fit_with(&fit, &draws)
            }
        }
    }
}
