use pyo3::prelude::*;
use schemars::schema_for;
use seaplant::results::{AccumulatedPlant, Results};
use seaplant::twin::Truth;
use seaplant_campaign::{
    CampaignFile, Inspection, MonteCarloTable, TwinFile, Validation, VehicleFile,
    VehicleMonteCarloTable,
};

use crate::convert::{Failure, json};

/// Returns the version of the library.
#[pyfunction]
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Returns the JSON Schema of data exchanged with Python.
#[pyfunction]
pub fn schema(kind: &str) -> PyResult<String> {
    let schema = match kind {
        "results" => schema_for!(Results),
        "accumulated" => schema_for!(AccumulatedPlant),
        "validation" => schema_for!(Validation),
        "inspection" => schema_for!(Inspection),
        "monte-carlo" => schema_for!(MonteCarloTable),
        "vehicle-monte-carlo" => schema_for!(VehicleMonteCarloTable),
        "truth" => schema_for!(Truth),
        "vehicle" => schema_for!(VehicleFile),
        "campaign" => schema_for!(CampaignFile),
        "twin" => schema_for!(TwinFile),
        other => return Err(Failure::Input(format!("there is no schema of {other}")).into()),
    };
    Ok(json(&schema)?)
}
