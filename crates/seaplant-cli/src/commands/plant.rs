//! Reads plants given to commands: results, plant files, published tables.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use seaplant::Method;
use seaplant::exchange::PlantModel;
use seaplant_campaign::{nearest_published, read_plant_file};

use super::validate::read_results;

/// Returns the results.json in a folder, or the path unchanged.
pub fn file_of(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("results.json") } else { path.to_owned() }
}

/// Reads the plant from results, a plant file or a published table.
pub fn read_plant(path: &Path, method: Option<Method>) -> Result<PlantModel> {
    let path = file_of(path);
    match read_table(&path)? {
        None => {
            let named = || path.display().to_string();
            let results = read_results(&path)?;
            PlantModel::of_results(&results, &named(), method).with_context(named)
        }
        Some(_) if method.is_some() => {
            bail!("{} is a table, not a fit by a method; leave --method out", path.display())
        }
        Some(model) => Ok(model),
    }
}

/// Reads the plant from a plant file or published table; `None` for results.
pub fn read_table(path: &Path) -> Result<Option<PlantModel>> {
    // The reader of results reports a file that does not exist, with advice.
    if !path.exists() && !path.to_string_lossy().starts_with("published:") {
        if let Some(near) = nearest_published(path) {
            bail!("there is no file `{}`; did you mean `{near}`?", path.display());
        }
        return Ok(None);
    }
    let Some(file) = read_plant_file(path)? else { return Ok(None) };
    file.model().map(Some).with_context(|| path.display().to_string())
}
