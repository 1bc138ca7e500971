use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    Filters, Fit, Method, all_columns, check_trials, least_rows, signed_square, slowest_source_hz,
};
use crate::regression::{Columns, least_squares};
use crate::signal::{LowPass, differentiate};
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Error, Terms, UniformStretch};

/// The choices of the equation-error method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EquationErrorOptions {
    /// A light filter on velocity, before it is squared: it keeps noise out of v|v|.
    pub velocity_filter: LowPass,
    /// The filter on every term alike, v̇ and force included.
    pub term_filter: LowPass,
}

impl Default for EquationErrorOptions {
    fn default() -> Self {
        Self {
            velocity_filter: LowPass { cutoff_hz: 1.5, order: 2 },
            term_filter: LowPass { cutoff_hz: 0.5, order: 2 },
        }
    }
}

/// A cut-off above this part of the sampling rate is no filter any more.
const HIGHEST_CUTOFF_PART: f64 = 0.4;

/// Fits the plant by least squares on the equation of motion, every term filtered alike.
///
/// v is smoothed lightly, squared and differentiated; then v̇, τ, v|v| and v pass the
/// same filter H, which leaves the equation true: `H v̇ = α H τ + β H v|v| + μ H v + bias`.
/// Force is the mean over each sample interval.
///
/// Where motion was sampled too slowly for the filters, their cut-offs are lowered, or
/// the light one is left out, and a caveat says so.
///
/// # Errors
/// [`Error::NoTrial`] without records, [`Error::TooShort`] for records shorter than the
/// filter, [`Error::NotExciting`].
///
/// # Source
/// [Morelli2016, ch. 5]: equation error; equal filtering as in [Young2011].
pub fn fit_equation_error(
    dof: Dof,
    axes: &[AxisRecord],
    terms: Terms,
    options: &EquationErrorOptions,
) -> Result<Fit, Error> {
    check_trials(dof, axes)?;
    let mut caveats = Vec::new();
    let filters = filters_for(slowest_source_hz(axes), options, &mut caveats);
    let smooth = |filter: Option<LowPass>, x: Vec<f64>, sample_hz: f64| match filter {
        Some(filter) => filter.zero_phase(&x, sample_hz),
        None => Ok(x),
    };
    let columns = |_: &AxisRecord, stretch: UniformStretch, sample_hz: f64| {
        let v = smooth(filters.velocity, stretch.v, sample_hz)?;
        let alike = |x: Vec<f64>| smooth(filters.every_term, x, sample_hz);
        Ok(Columns {
            v_dot: alike(differentiate(&v, stretch.grid.period_s)?)?,
            tau: alike(stretch.tau)?,
            quadratic: alike(signed_square(&v))?,
            linear: alike(v)?,
            period_s: stretch.grid.period_s,
        })
    };
    let least = |rate| filters.every_term.map_or(0, |filter| least_rows(filter, rate));
    let columns = all_columns(axes, least, columns, &mut caveats)?;
    let found = least_squares(dof, &columns, terms)?;
    Ok(Fit::of_regression(dof, Method::EquationError, terms, found, filters, caveats))
}

fn filters_for(
    source_hz: f64,
    options: &EquationErrorOptions,
    caveats: &mut Vec<Caveat>,
) -> Filters {
    let highest = HIGHEST_CUTOFF_PART * source_hz;
    let wanted = options.term_filter;
    let every_term = LowPass { cutoff_hz: wanted.cutoff_hz.min(highest), ..wanted };
    if every_term.cutoff_hz < wanted.cutoff_hz {
        let message = format!(
            "motion was logged at {source_hz:.2} Hz only, so the terms are filtered at {:.2} Hz in place of {:.2} Hz; log faster to see quicker motion",
            every_term.cutoff_hz, wanted.cutoff_hz
        );
        caveats.push(Caveat::note(CaveatCode::SampledSlowly, message));
    }
    let velocity = Some(options.velocity_filter).filter(|filter| filter.cutoff_hz <= highest);
    Filters { velocity, every_term: Some(every_term) }
}
