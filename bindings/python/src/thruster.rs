use std::path::PathBuf;

use numpy::PyReadonlyArray1;
use pyo3::prelude::*;
use seaplant_campaign::{Bench, BenchColumns, bollard_result, fit_bench, read_bench};

use crate::convert::{Failure, apart, json, numbers, parse};

/// Fits a thrust curve to a bollard-pull table, as JSON.
#[pyfunction]
pub fn fit_bench_table(
    py: Python<'_>,
    path: PathBuf,
    columns: &str,
    neutral: Option<f64>,
) -> PyResult<String> {
    let columns: BenchColumns = parse("columns", columns)?;
    apart(py, move || fit(&read_bench(&path, &columns, None)?, neutral))
}

/// Fits a thrust curve to inputs and forces, as JSON.
#[pyfunction]
pub fn fit_bench_points(
    py: Python<'_>,
    inputs: PyReadonlyArray1<'_, f64>,
    forces: PyReadonlyArray1<'_, f64>,
    input_unit: String,
    force_unit: String,
    neutral: Option<f64>,
) -> PyResult<String> {
    let (inputs, forces) = (numbers(&inputs), numbers(&forces));
    apart(py, move || {
        fit(&Bench::from_points(&inputs, &input_unit, &forces, &force_unit)?, neutral)
    })
}

fn fit(bench: &Bench, neutral: Option<f64>) -> Result<String, Failure> {
    json(&bollard_result(bench, &fit_bench(bench, neutral)?))
}
