use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use seaplant_log::{MemoryColumn, MemoryTable, ReadOptions, Stamp, TimeColumn};

use crate::convert::{Failure, apart, json, numbers};

/// A log.
#[pyclass(frozen, module = "seaplant._native")]
pub struct Log(pub Arc<seaplant_log::Log>);

/// Header, unit and values of a column in memory.
type ColumnOf<'py> = (String, Option<String>, PyReadonlyArray1<'py, f64>);
/// Name, times and columns of a table in memory.
type TableOf<'py> = (String, PyReadonlyArray1<'py, f64>, Vec<ColumnOf<'py>>);
/// Name, header, unit, file and missing rows of a channel, its times and values.
type ChannelOf<'py> = (
    String,
    String,
    Option<String>,
    String,
    usize,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
);

#[pymethods]
impl Log {
    /// Reads files that were logged simultaneously.
    #[staticmethod]
    #[pyo3(signature = (paths, *, offsets_s, time, time_unit, equal_sampling_hz, sheet, receive))]
    #[expect(clippy::too_many_arguments, reason = "each has its name in Python")]
    fn open(
        py: Python<'_>,
        paths: Vec<PathBuf>,
        offsets_s: Vec<f64>,
        time: Option<String>,
        time_unit: Option<String>,
        equal_sampling_hz: Option<f64>,
        sheet: Option<String>,
        receive: bool,
    ) -> PyResult<Self> {
        let options = ReadOptions {
            time: (time.is_some() || time_unit.is_some())
                .then_some(TimeColumn { column: time, unit: time_unit }),
            equal_sampling_hz,
            sheet,
            stamp: if receive { Stamp::Receive } else { Stamp::Header },
            ..Default::default()
        };
        let of = |(path, offset_s)| (path, ReadOptions { offset_s, ..options.clone() });
        let files: Vec<_> = paths.into_iter().zip(offsets_s).map(of).collect();
        let log = apart(py, move || Ok(seaplant_log::Log::open(&files)?))?;
        Ok(Self(Arc::new(log)))
    }

    /// Makes a log of arrays.
    #[staticmethod]
    fn of_tables(py: Python<'_>, name: String, tables: Vec<TableOf<'_>>) -> PyResult<Self> {
        let column = |(header, unit, values): ColumnOf<'_>| MemoryColumn {
            header,
            unit,
            values: numbers(&values),
        };
        let table = |(name, time_s, columns): TableOf<'_>| MemoryTable {
            name,
            time_s: numbers(&time_s),
            columns: columns.into_iter().map(column).collect(),
        };
        let tables = tables.into_iter().map(table).collect();
        let log = apart(py, move || Ok(seaplant_log::Log::of_tables(&name, tables)?))?;
        Ok(Self(Arc::new(log)))
    }

    /// Returns every channel: name, header, unit, file, missing rows, times, values.
    fn channels<'py>(&self, py: Python<'py>) -> Vec<ChannelOf<'py>> {
        let of = |channel: &seaplant_log::Channel| {
            let path = &self.0.sources()[channel.source].path;
            (
                channel.name.clone(),
                channel.column.clone(),
                channel.unit.as_ref().map(|unit| unit.symbol().to_owned()),
                path.display().to_string(),
                channel.missing,
                PyArray1::from_slice(py, channel.time_s()),
                PyArray1::from_slice(py, channel.values()),
            )
        };
        self.0.channels().iter().map(of).collect()
    }

    /// Returns the index of a channel by its name.
    fn place(&self, name: &str) -> PyResult<usize> {
        Ok(self.0.place(name).map_err(Failure::from)?)
    }

    /// Returns the notes on what the reader decided or dropped.
    fn notes(&self) -> Vec<String> {
        self.0.notes().iter().map(ToString::to_string).collect()
    }

    /// Returns the summary and irregularities of the log, as JSON.
    fn inspect(&self, py: Python<'_>) -> PyResult<String> {
        let log = Arc::clone(&self.0);
        apart(py, move || json(&seaplant_campaign::inspect(&log)))
    }
}

/// Returns whether a name is that of a quantity.
#[pyfunction]
pub fn is_quantity(name: &str) -> bool {
    name.parse::<seaplant::Quantity>().is_ok()
}

/// Finds the time column, as in a file, and the seconds in its unit, if one is stated.
#[pyfunction]
pub fn time_column(
    headers: Vec<(String, Option<String>)>,
    time: Option<String>,
    time_unit: Option<String>,
) -> PyResult<Option<(usize, Option<f64>)>> {
    let wanted = TimeColumn { column: time, unit: time_unit };
    match seaplant_log::time_column(&headers, &wanted) {
        Err(seaplant_log::Error::NoTime { .. }) => Ok(None),
        found => Ok(Some(found.map_err(Failure::from)?)),
    }
}

/// Returns the seconds in the unit of times that state none.
#[pyfunction]
pub fn calendar_second(times: PyReadonlyArray1<'_, f64>) -> f64 {
    seaplant_log::calendar_second(&numbers(&times))
}
