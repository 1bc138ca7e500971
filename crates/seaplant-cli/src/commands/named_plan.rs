//! The plan of a dive, as `identify` compares it with the logs.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use seaplant::Trial;
use seaplant::results::{Identification, InputFile};
use seaplant_campaign::read_bounded;
use seaplant_plan::{Plan, check_outcome, outcome};
use sha2::{Digest, Sha256};

use super::identify::quoted;

/// A plan with the file that it was read from.
pub struct NamedPlan {
    plan: Plan,
    file: InputFile,
}

/// Largest size of a plan, bytes.
const MOST_BYTES: u64 = 1 << 26;

/// Reads a plan.json; returns it with the bytes of the file.
pub fn read_plan(path: &Path) -> Result<(Plan, Vec<u8>)> {
    let bytes = read_bounded(path, MOST_BYTES)?;
    let plan = serde_json::from_slice(&bytes).map_err(|error| {
        anyhow!(
            "{}: is not a plan ({error}); name the plan.json that `seaplant plan` wrote",
            path.display()
        )
    })?;
    Ok((plan, bytes))
}

impl NamedPlan {
    /// Reads a plan.json, if one is named, and checks, before the fit, that the trials can be
    /// compared with it.
    pub fn open(path: Option<&Path>, trials: &[Trial]) -> Result<Option<Self>> {
        let Some(path) = path else { return Ok(None) };
        let (plan, bytes) = read_plan(path)?;
        let sha256 = Sha256::digest(&bytes).iter().map(|byte| format!("{byte:02x}")).collect();
        let path = path.display().to_string();
        check_outcome(&plan, trials).with_context(|| path.clone())?;
        let file = InputFile { path, bytes: bytes.len() as u64, sha256 };
        Ok(Some(Self { plan, file }))
    }

    /// Adds the comparison to an identification whose results will be written to a folder.
    pub fn compared(
        &self,
        trials: &[Trial],
        mut found: Identification,
        folder: &Path,
    ) -> Result<Identification> {
        let (results, file) = (&mut found.results, &self.file);
        let written = quoted(&folder.join("results.json"));
        let request = quoted(Path::new(&file.path));
        let next = format!("seaplant plan {written} --request {request}");
        let compared = outcome(&self.plan, &file.path, trials, results, &next)
            .with_context(|| file.path.clone())?;
        results.plan = Some(compared);
        results.provenance.inputs.push(file.clone());
        Ok(found)
    }
}
