use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Filters, Fit, Method, Records, Stretch, all_stretches, least_rows};
use crate::Error;
use crate::regression::{Regression, Row};
use crate::series::ROUNDING_S;
use crate::signal::{LowPass, differentiate};

/// Options of the paper's method, with the paper's values as default.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Paper {
    /// Filter on velocity: 1/8 Hz, second order.
    pub velocity_filter: LowPass,
}

impl Default for Paper {
    fn default() -> Self {
        Self { velocity_filter: LowPass { cutoff_hz: 0.125, order: 2 } }
    }
}

impl Paper {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Setting`] for an invalid filter.
    pub fn check(&self) -> Result<(), Error> {
        self.velocity_filter.check().map_err(|error| error.within("velocity_filter"))
    }

    /// Fits the plant by the paper's method.
    ///
    /// Velocity is smoothed, differentiated, and regressed with its own square on thrust, which is
    /// *not* smoothed but taken at each sample: `v̇_f = α τ + β v_f|v_f| + μ v_f + bias`. At the
    /// excited frequency f the estimated mass is about `m / |H(f)|`; the method is kept exact as
    /// the baseline.
    ///
    /// # Errors
    /// As [`Records::dof`]; [`Error::Cutoff`] if the filter is not possible at the rate of the
    /// records, [`Error::TooShort`] for records shorter than it, [`Error::NotExciting`].
    ///
    /// # Source
    /// [Jason2, §3 and eq. (5)–(7)].
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let records = records.into();
        let (dof, terms) = (records.dof()?, records.terms());
        let filter = self.velocity_filter;
        let mut caveats = Vec::new();
        let least = |rate| least_rows(filter, rate);
        let stretches = all_stretches(records.fit, least, &mut caveats)?;
        let mut regression =
            Regression::new(stretches.iter().map(Stretch::duration_s).sum(), terms);
        for stretch in &stretches {
            add_stretch(stretch, filter, &mut regression)?;
        }
        let found = regression.solve(dof)?;
        let filters = Filters { velocity: Some(filter), every_term: None };
        Ok(Fit::of_regression(dof, Method::Paper, terms, found, filters, caveats))
    }
}

/// Number of rows that are collected before they are reduced.
const TILE_ROWS: usize = 4096;

fn add_stretch(
    stretch: &Stretch<'_>,
    filter: LowPass,
    regression: &mut Regression,
) -> Result<(), Error> {
    let grid = stretch.ready.grid;
    let mut v = stretch.ready.velocity(grid)?;
    filter.zero_phase_in_place(&mut v, stretch.sample_hz)?;
    let v_dot = differentiate(&v, grid.period_s)?;
    let mut force = stretch.axis.force.reader();
    let mut rows: Vec<Row> = Vec::with_capacity(TILE_ROWS);
    regression.start_stretch(grid.period_s);
    for ((t, v), v_dot) in grid.times().zip(v).zip(v_dot) {
        rows.push([force.held_at(t + ROUNDING_S), v * v.abs(), v, v_dot]);
        if rows.len() == TILE_ROWS {
            regression.add(&rows);
            rows.clear();
        }
    }
    regression.add(&rows);
    Ok(())
}
