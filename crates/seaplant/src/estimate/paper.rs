use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Filters, Fit, Method, all_columns, check_trials, least_rows, signed_square};
use crate::regression::{Columns, least_squares};
use crate::signal::{LowPass, differentiate};
use crate::{AxisRecord, Dof, Error, Terms, UniformStretch};

/// The choices of the paper's method; by default the paper's own.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PaperOptions {
    /// The filter on velocity: 1/8 Hz, second order.
    pub velocity_filter: LowPass,
}

impl Default for PaperOptions {
    fn default() -> Self {
        Self { velocity_filter: LowPass { cutoff_hz: 0.125, order: 2 } }
    }
}

/// A time stamp is in force at its own instant, whichever way its decimals were rounded.
const ROUNDING_S: f64 = 1e-6;

/// Fits the plant as the paper does.
///
/// Velocity is smoothed, differentiated, and regressed with its own square on thrust,
/// which is *not* smoothed but read at each sample: `v̇_f = α τ + β v_f|v_f| + μ v_f + bias`.
/// At the excited frequency f the mass comes out as about `m / |H(f)|`; the method is kept
/// exact as the baseline.
///
/// `axes` are the records of one degree of freedom, one for each trial.
///
/// # Errors
/// [`Error::NoTrial`] without records, [`Error::Cutoff`] if the filter cannot be made at
/// their rate, [`Error::TooShort`] for records shorter than it, [`Error::NotExciting`].
///
/// # Source
/// [Jason2, §3 and eq. (5)–(7)].
pub fn fit_paper(
    dof: Dof,
    axes: &[AxisRecord],
    terms: Terms,
    options: &PaperOptions,
) -> Result<Fit, Error> {
    check_trials(dof, axes)?;
    let filter = options.velocity_filter;
    let columns = |axis: &AxisRecord, stretch: UniformStretch, sample_hz: f64| {
        let v = filter.zero_phase(&stretch.v, sample_hz)?;
        Ok(Columns {
            v_dot: differentiate(&v, stretch.grid.period_s)?,
            tau: stretch.grid.times().map(|t| axis.force.held_at(t + ROUNDING_S)).collect(),
            quadratic: signed_square(&v),
            linear: v,
            period_s: stretch.grid.period_s,
        })
    };
    let mut caveats = Vec::new();
    let least = |rate| least_rows(filter, rate);
    let columns = all_columns(axes, least, columns, &mut caveats)?;
    let found = least_squares(dof, &columns, terms)?;
    let filters = Filters { velocity: Some(filter), every_term: None };
    Ok(Fit::of_regression(dof, Method::Paper, terms, found, filters, caveats))
}
