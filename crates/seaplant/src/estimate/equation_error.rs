use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    Filters, Fit, Method, Stretch, all_stretches, check_trials, least_rows, slowest_source_hz,
};
use crate::regression::{Regression, Row};
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
/// [Morelli2016, ch. 5]: equation error; equal filtering as in \[Young2011\].
pub fn fit_equation_error(
    dof: Dof,
    axes: &[AxisRecord],
    terms: Terms,
    options: &EquationErrorOptions,
) -> Result<Fit, Error> {
    check_trials(dof, axes)?;
    let mut caveats = Vec::new();
    let filters = filters_for(slowest_source_hz(axes), options, &mut caveats);
    let least = |rate| filters.every_term.map_or(0, |filter| least_rows(filter, rate));
    let stretches = all_stretches(axes, least, &mut caveats)?;
    let mut regression = Regression::of(stretches.iter().map(Stretch::duration_s).sum(), terms);
    for stretch in &stretches {
        add_stretch(stretch, &filters, &mut regression)?;
    }
    let found = regression.solve(dof)?;
    Ok(Fit::of_regression(dof, Method::EquationError, terms, found, filters, caveats))
}

/// Rows that are filtered at a time: with all their columns they stay in the cache.
const TILE_ROWS: usize = 4096;

/// Filters a stretch tile by tile, each with so much of its neighbours that the filters
/// have forgotten its edges, to rounding.
fn add_stretch(
    stretch: &Stretch<'_>,
    filters: &Filters,
    regression: &mut Regression,
) -> Result<(), Error> {
    let grid = stretch.ready.grid;
    let margin = margin_rows(filters, stretch.sample_hz)?.min(grid.len);
    let tile_rows = TILE_ROWS.max(4 * margin);
    let mut rows = Vec::new();
    regression.start_stretch(grid.period_s);
    for from in (0..grid.len).step_by(tile_rows) {
        let to = (from + tile_rows).min(grid.len);
        let seen = from.saturating_sub(margin)..(to + margin).min(grid.len);
        let tile = stretch.ready.on(grid.part(seen.clone()))?;
        filter_rows(tile, stretch.sample_hz, filters, &mut rows)?;
        regression.add(&rows[from - seen.start..to - seen.start]);
    }
    Ok(())
}

fn margin_rows(filters: &Filters, sample_hz: f64) -> Result<usize, Error> {
    let used = [filters.velocity, filters.every_term].into_iter().flatten();
    used.map(|filter| filter.settling_rows(sample_hz)).sum()
}

/// The rows of a tile, in room that is used again and again.
fn filter_rows(
    UniformStretch { grid, tau, mut v }: UniformStretch,
    sample_hz: f64,
    filters: &Filters,
    rows: &mut Vec<Row>,
) -> Result<(), Error> {
    if let Some(filter) = filters.velocity {
        filter.zero_phase_in_place(&mut v, sample_hz)?;
    }
    let v_dot = differentiate(&v, grid.period_s)?;
    let terms = tau.iter().zip(&v).zip(v_dot);
    rows.clear();
    rows.extend(terms.map(|((&tau, &v), v_dot)| [tau, v * v.abs(), v, v_dot]));
    match filters.every_term {
        Some(filter) => filter.zero_phase_rows(rows, sample_hz),
        None => Ok(()),
    }
}

/// A fit with thrust moved in time.
#[derive(Clone, Debug, PartialEq)]
pub struct DelayedFit {
    /// By how much thrust was moved to later, s.
    pub delay_s: f64,
    /// The fit.
    pub fit: Fit,
}

/// Fits the plant with thrust moved by each of some delays, and keeps the one with the
/// least residual: a first look at lag, delay and clocks that differ.
///
/// # Errors
/// As [`fit_equation_error`], if no delay can be fitted.
pub fn fit_best_delay(
    dof: Dof,
    axes: &[AxisRecord],
    terms: Terms,
    options: &EquationErrorOptions,
    delays_s: impl Iterator<Item = f64>,
) -> Result<DelayedFit, Error> {
    let mut best: Option<DelayedFit> = None;
    let mut refused = Error::NoTrial { dof };
    for delay_s in delays_s {
        let late: Vec<AxisRecord> = axes.iter().map(|axis| axis.delayed(delay_s)).collect();
        match fit_equation_error(dof, &late, terms, options) {
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
