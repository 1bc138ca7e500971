//! `results.json`: written, read and described.

use seaplant::exchange::check_results;
use seaplant::results::{Results, SCHEMA};
use serde::Deserialize;

use crate::Error;

/// The only field that is read before the version is known.
#[derive(Deserialize)]
struct Envelope {
    schema: Option<String>,
}

/// Returns the JSON Schema of `results.json`.
pub fn results_schema() -> serde_json::Value {
    schemars::schema_for!(Results).to_value()
}

/// Reads `results.json`.
///
/// # Errors
/// [`Error::NoSchema`] or [`Error::Schema`] if it is another file or another version,
/// [`Error::Json`] if it is damaged, [`Error::Number`] if numbers in it contradict each other.
///
/// ```
/// let error = seaplant_report::parse_results(r#"{"schema": "seaplant/results/99"}"#).unwrap_err();
/// assert!(error.to_string().contains("seaplant/results/99"));
/// ```
pub fn parse_results(json: &str) -> Result<Results, Error> {
    let envelope: Envelope = serde_json::from_str(json)?;
    match envelope.schema {
        None => Err(Error::NoSchema),
        Some(found) if found != SCHEMA => Err(Error::Schema { found, known: SCHEMA }),
        Some(_) => {
            let results = serde_json::from_str(json)?;
            check_results(&results)?;
            Ok(results)
        }
    }
}

pub(crate) fn bytes(results: &Results) -> Result<Vec<u8>, Error> {
    let mut bytes = serde_json::to_vec_pretty(results)?;
    bytes.push(b'\n');
    Ok(bytes)
}
