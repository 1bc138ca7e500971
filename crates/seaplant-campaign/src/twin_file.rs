//! twin.toml: for a vehicle that moves one axis at a time, or several together.

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use seaplant::exchange::PlantModel;
use seaplant::twin::{TwinCampaign, TwinSpec, VehicleTwinSpec, make, make_vehicle};
use serde::{Deserialize, Serialize};

use crate::bounded::text_of;
use crate::published::published_path;
use crate::toml_file::resolve;
use crate::{Error, read_plant_file, read_toml};

/// Specification of a twin: with `vehicle` it has several axes, otherwise each axis moves by
/// itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum TwinFile {
    /// One axis at a time.
    OneAxis(Box<TwinSpec>),
    /// A plant of several axes.
    SeveralAxes(Box<VehicleTwinSpec>),
}

impl TwinFile {
    /// Reads a twin.toml.
    ///
    /// # Errors
    /// [`Error::Io`] or [`Error::Toml`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let table = toml::from_str::<toml::Table>(&text_of(path)).unwrap_or_default();
        if !table.contains_key("vehicle") {
            return read_toml(path).map(|spec| Self::OneAxis(Box::new(spec)));
        }
        let mut spec: VehicleTwinSpec = read_toml(path)?;
        if published_path(&spec.vehicle).is_none() {
            let full = resolve(path, Path::new(&spec.vehicle))?;
            spec.vehicle = full.display().to_string();
        }
        Ok(Self::SeveralAxes(Box::new(spec)))
    }

    /// Makes the logs.
    ///
    /// # Errors
    /// As [`make`] and [`make_vehicle`], and for a vehicle that cannot be read.
    pub fn make(&self) -> Result<TwinCampaign, TwinError> {
        match self {
            Self::OneAxis(spec) => Ok(make(spec)?),
            Self::SeveralAxes(spec) => Ok(make_vehicle(spec, &plant_named(&spec.vehicle)?)?),
        }
    }
}

/// Reason why a twin cannot be made: its vehicle's file, or its specification.
#[derive(Debug, thiserror::Error)]
pub enum TwinError {
    /// The file of its vehicle.
    #[error(transparent)]
    File(#[from] Error),
    /// The twin.
    #[error(transparent)]
    Twin(#[from] seaplant::Error),
}

/// Returns the plant of a published table, with or without `published:`, or of a plant file.
pub(crate) fn plant_named(name: &str) -> Result<PlantModel, TwinError> {
    let path = published_path(name).unwrap_or_else(|| PathBuf::from(name));
    match read_plant_file(&path)? {
        Some(file) => Ok(file.model()?),
        None => {
            let reason = "is no plant file; `seaplant export RESULTS --to json` writes one of results, and `published:NAME` is a table that comes with the program";
            Err(Error::value(&path, "schema", reason).into())
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<TwinFile, Error> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("twin.toml");
        std::fs::write(&path, text).expect("written");
        TwinFile::read(&path)
    }

    #[test]
    fn a_vehicle_makes_a_twin_of_several_axes() {
        let several =
            read("vehicle = \"published:rexrov\"\ndriving = \"sweeps\"\n").expect("valid");
        assert!(matches!(several, TwinFile::SeveralAxes(_)), "{several:?}");
        let one = read("dofs = [\"surge\"]\n").expect("valid");
        assert!(matches!(one, TwinFile::OneAxis(_)), "{one:?}");
    }

    #[test]
    fn keys_of_the_other_twin_are_refused() {
        let error = read("vehicle = \"rexrov\"\ndofs = [\"surge\"]\n").expect_err("of one axis");
        assert!(error.to_string().contains("unknown field `dofs`"), "{error}");
    }

    #[test]
    fn a_published_vehicle_is_found_by_its_bare_name() {
        assert_eq!(plant_named("rexrov").expect("published").name, "RexROV");
        let error = plant_named("published:rexrow").expect_err("unknown").to_string();
        assert!(error.contains("did you mean `rexrov`"), "{error}");
    }
}
