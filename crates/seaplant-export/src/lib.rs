//! Exports plants for other software: one exporter per format.
//!
//! ```
//! use seaplant::exchange::PlantFile;
//! use seaplant_export::{Exporter, Permission, export, exporter};
//! let table: PlantFile = serde_json::from_str(
//!     r#"{ "schema": "seaplant/plant/1", "name": "disc", "source": "worked by hand",
//!          "axes": ["surge"], "mass_matrix": [40.0], "quadratic_damping": [30.0] }"#,
//! ).expect("a table");
//! let c = exporter("c")?;
//! let made = export(c, &table.model()?, Permission::default())?;
//! assert_eq!(made.files[0].path, "seaplant_plant.h");
//! // What the format cannot hold, or the plant does not know, is always said.
//! assert!(made.notes.iter().any(|note| note.contains("sway")));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The library of the mathematics knows nothing of file formats; this crate knows nothing of logs.

mod actuators;
mod c;
mod casadi;
mod code;
mod error;
mod flu;
mod fmu;
mod gazebo;
mod json;
mod link;
mod octave;
mod python;
mod remarks;
mod ros2;
mod rust;
mod stonefish;
mod template;
mod uuv;

use seaplant::exchange::PlantModel;

pub use error::Error;
pub use remarks::doubts;

/// A file of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExportedFile {
    /// Path relative to the folder.
    pub path: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Result of an export.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exported {
    /// The files, the one to begin with first.
    pub files: Vec<ExportedFile>,
    /// Limitations of the format, unknowns and warnings; also in the files.
    pub notes: Vec<String>,
}

/// A format in which a plant can be written.
pub trait Exporter: Sync {
    /// Returns the name on the command line.
    fn name(&self) -> &'static str;

    /// Describes the format in half a line.
    fn about(&self) -> &'static str;

    /// Returns the files of a plant.
    ///
    /// # Errors
    /// [`Error::Unsuitable`] if the format has no place for what the plant is; [`Error::Write`]
    /// if an archive cannot be made.
    fn files(&self, model: &PlantModel) -> Result<Exported, Error>;
}

/// All formats, in the order in which help lists them.
pub const EXPORTERS: [&dyn Exporter; 11] = [
    &c::C,
    &rust::Rust,
    &python::Python,
    &casadi::Casadi,
    &octave::Octave,
    &fmu::Fmu,
    &gazebo::Gazebo,
    &uuv::UuvSimulator,
    &stonefish::Stonefish,
    &ros2::Ros2,
    &json::Json,
];

/// Returns the exporter of a name.
///
/// # Errors
/// [`Error::UnknownFormat`], with all names.
pub fn exporter(name: &str) -> Result<&'static dyn Exporter, Error> {
    EXPORTERS.into_iter().find(|exporter| exporter.name() == name).ok_or_else(|| {
        let known: Vec<&str> = EXPORTERS.iter().map(|exporter| exporter.name()).collect();
        Error::UnknownFormat { found: name.to_owned(), known: known.join(", ") }
    })
}

/// Permission to export a plant that should not be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Permission {
    /// Such plants are refused.
    #[default]
    Checked,
    /// Such plants are exported with the reasons against them.
    Anyway,
}

/// Writes a plant in a format.
///
/// # Errors
/// [`Error::DoNotUse`] if its verdict is "do not use" and `permission` does not override that;
/// those of [`Exporter::files`].
pub fn export(
    exporter: &dyn Exporter,
    model: &PlantModel,
    permission: Permission,
) -> Result<Exported, Error> {
    let reasons = model.reasons_against();
    if permission == Permission::Checked && !reasons.is_empty() {
        return Err(Error::DoNotUse { reasons: reasons.join("; ") });
    }
    exporter.files(model)
}
