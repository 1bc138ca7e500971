//! Rows of the equation of motion with equally filtered terms.

use std::ops::Range;

use super::{Filters, Records, Stretch, all_stretches, least_rows, slowest_source_hz};
use crate::estimate::EquationError;
use crate::regression::{Regression, Row};
use crate::signal::{LowPass, differentiate};
use crate::trial::ReadyStretch;
use crate::{Caveat, CaveatCode, Dof, Error, Grid, Terms, UniformStretch};

/// Continuous sections of some trials, and filters suitable for all of them.
pub(super) struct Filtered<'a> {
    pub(super) dof: Dof,
    pub(super) terms: Terms,
    pub(super) filters: Filters,
    pub(super) stretches: Vec<Stretch<'a>>,
    pub(super) caveats: Vec<Caveat>,
}

/// Maximum cut-off frequency as a fraction of the sampling rate.
const HIGHEST_CUTOFF_PART: f64 = 0.4;

/// Number of rows filtered at a time: with all columns they fit into the cache.
const TILE_ROWS: usize = 4096;

impl<'a> Filtered<'a> {
    /// # Errors
    /// As [`Records::dof`]; [`Error::TooShort`] for records shorter than the filter.
    pub(super) fn of(records: Records<'a>, options: &EquationError) -> Result<Self, Error> {
        let (dof, terms, axes) = (records.dof()?, records.terms(), records.fit);
        let mut caveats = Vec::new();
        let filters = filters_for(slowest_source_hz(axes), options, &mut caveats);
        let least = |rate| filters.every_term.map_or(0, |filter| least_rows(filter, rate));
        let stretches = all_stretches(axes, least, &mut caveats)?;
        Ok(Self { dof, terms, filters, stretches, caveats })
    }

    pub(super) fn duration_s(&self) -> f64 {
        self.stretches.iter().map(Stretch::duration_s).sum()
    }

    /// Adds all rows to a regression, tile by tile.
    ///
    /// # Errors
    /// [`Error::Cutoff`].
    pub(super) fn add_to(&self, mut regression: Regression) -> Result<Regression, Error> {
        self.stretches.iter().try_for_each(|stretch| {
            regression.start_stretch(stretch.ready.grid.period_s);
            self.for_each_tile(stretch, |rows| regression.add(rows))
        })?;
        Ok(regression)
    }

    /// Returns the rows of each section.
    ///
    /// # Errors
    /// [`Error::Cutoff`].
    pub(super) fn rows(&self) -> Result<Vec<Vec<Row>>, Error> {
        let of = |stretch| {
            let mut rows = Vec::new();
            self.for_each_tile(stretch, |tile| rows.extend_from_slice(tile))?;
            Ok(rows)
        };
        self.stretches.iter().map(of).collect()
    }

    fn for_each_tile(
        &self,
        stretch: &Stretch<'_>,
        mut take: impl FnMut(&[Row]),
    ) -> Result<(), Error> {
        let Stretch { ready, sample_hz, .. } = stretch;
        let whole = 0..ready.grid.len;
        for_each_tile(ready, ready.grid, whole, *sample_hz, &self.filters, |_, rows| take(rows))
    }
}

/// Filters rows of a section on a uniform grid, tile by tile, each with a margin after which the
/// filters have forgotten its edges, within rounding; `take` gets the index of the first row of
/// each tile.
pub(super) fn for_each_tile(
    stretch: &ReadyStretch,
    grid: Grid,
    wanted: Range<usize>,
    sample_hz: f64,
    filters: &Filters,
    mut take: impl FnMut(usize, &[Row]),
) -> Result<(), Error> {
    let margin = margin_rows(filters, sample_hz)?.min(grid.len);
    let tile_rows = TILE_ROWS.max(4 * margin);
    let mut rows = Vec::new();
    for from in wanted.clone().step_by(tile_rows) {
        let to = (from + tile_rows).min(wanted.end);
        let seen = from.saturating_sub(margin)..(to + margin).min(grid.len);
        let tile = stretch.on(grid.part(seen.clone()))?;
        filter_rows(tile, sample_hz, filters, &mut rows)?;
        take(from, &rows[from - seen.start..to - seen.start]);
    }
    Ok(())
}

pub(super) fn margin_rows(filters: &Filters, sample_hz: f64) -> Result<usize, Error> {
    let used = [filters.velocity, filters.every_term].into_iter().flatten();
    used.map(|filter| filter.settling_rows(sample_hz)).sum()
}

/// Filters the rows of one tile into a reused buffer.
pub(super) fn filter_rows(
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

pub(super) fn filters_for(
    source_hz: f64,
    options: &EquationError,
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
