//! Plants as commands take them: results, plant files, published tables.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use seaplant::Method;
use seaplant::exchange::PlantModel;
use seaplant_campaign::read_plant_file;

use super::validate::read_results;

/// The results.json in a folder, or the path as it is.
pub fn file_of(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("results.json") } else { path.to_owned() }
}

/// The plant that a file of results, a plant file or a published table holds.
pub fn read_plant(path: &Path, method: Option<Method>) -> Result<PlantModel> {
    let path = file_of(path);
    let named = || path.display().to_string();
    // A file that is not there is for the reader of results to tell: it says what to give.
    let is_there = path.exists() || path.to_string_lossy().starts_with("published:");
    let file = if is_there { read_plant_file(&path)? } else { None };
    let Some(file) = file else {
        let results = read_results(&path)?;
        return PlantModel::of_results(&results, &named(), method).with_context(named);
    };
    if let Some(method) = method {
        bail!("{} is a table, and no plant by {method}; leave --method out", path.display());
    }
    file.model().with_context(named)
}
