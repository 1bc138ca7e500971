use std::sync::Arc;

use pyo3::prelude::*;
use seaplant::estimate::{EquationError, EquationErrorStatistics, Shard, ShardClock};
use seaplant::{AxisRecord, Dof, Terms, VelocitySource, accumulated_plant};

use crate::convert::{Failure, apart, json, parse};
use crate::trial::Trial;

/// Sufficient statistics of equation error from shards of a record.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Shards(Arc<EquationErrorStatistics>);

#[pymethods]
impl Shards {
    /// Computes the statistics of a shard's rows; times are those of its log.
    #[staticmethod]
    #[expect(clippy::too_many_arguments, reason = "each has its name in Python")]
    fn of(
        py: Python<'_>,
        trial: PyRef<'_, Trial>,
        dof: &str,
        clock: &str,
        terms: Option<String>,
        options: &str,
        from_s: Option<f64>,
        to_s: Option<f64>,
    ) -> PyResult<Self> {
        let clock: ShardClock = parse("clock", clock)?;
        let options = equation_error(options)?;
        let terms =
            terms.map_or_else(|| Ok(Terms::default()), |t| t.parse()).map_err(Failure::from)?;
        let (axis, offset_s) = axis(&trial, dof)?;
        let sums = apart(py, move || {
            let shard = Shard { part: &axis, offset_s, from_s, to_s };
            Ok(EquationErrorStatistics::of(shard, &clock, terms, &options)?)
        })?;
        Ok(Self(Arc::new(sums)))
    }

    /// Returns the sum of both.
    fn merged(&self, other: PyRef<'_, Self>) -> PyResult<Self> {
        let mut sums = EquationErrorStatistics::clone(&self.0);
        sums.merge(&other.0).map_err(Failure::from)?;
        Ok(Self(Arc::new(sums)))
    }

    /// Returns the number of rows.
    #[getter]
    fn rows(&self) -> usize {
        self.0.rows()
    }

    /// Returns the plant of all rows, as JSON.
    fn plant(&self, py: Python<'_>) -> PyResult<String> {
        let sums = Arc::clone(&self.0);
        apart(py, move || json(&accumulated_plant(&sums)?))
    }

    /// Returns JSON from which another process restores this.
    fn to_json(&self) -> PyResult<String> {
        Ok(json(&*self.0)?)
    }

    /// Restores the output of [`Shards::to_json`].
    #[staticmethod]
    fn of_json(text: &str) -> PyResult<Self> {
        Ok(Self(Arc::new(parse("shards", text)?)))
    }
}

/// Returns the record of a degree of freedom, and the offset of its times to those of its log.
fn axis(trial: &Trial, dof: &str) -> Result<(AxisRecord, f64), Failure> {
    let dof: Dof = dof.parse()?;
    Ok((trial.0.trial.axis(dof, VelocitySource::Measured)?, trial.0.start_s))
}

/// Returns the clock of a record that is complete, or begins with this trial, as JSON.
#[pyfunction]
pub fn shard_clock(trial: PyRef<'_, Trial>, dof: &str) -> PyResult<String> {
    let (axis, offset_s) = axis(&trial, dof)?;
    let clock = ShardClock::of(&axis).map_err(Failure::from)?;
    Ok(json(&ShardClock { start_s: clock.start_s + offset_s, ..clock })?)
}

/// Returns how much of its neighbours a shard needs on either side, s.
#[pyfunction]
pub fn shard_margin_s(clock: &str, options: &str) -> PyResult<f64> {
    let clock: ShardClock = parse("clock", clock)?;
    let options = equation_error(options)?;
    Ok(clock.margin_s(&options).map_err(Failure::from)?)
}

fn equation_error(options: &str) -> Result<EquationError, Failure> {
    let options: EquationError = parse("equation_error", options)?;
    options.check()?;
    Ok(options)
}
