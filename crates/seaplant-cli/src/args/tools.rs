//! Commands outside of the path from a log to a plant.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};

/// Fit a thrust curve to a bollard-pull table.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant thruster bollard-pull.csv\n  seaplant thruster T200-16V.csv --input RPM --input-unit rpm --plot t200.svg"
)]
pub struct Thruster {
    /// The table: a column of inputs (rad/s, rpm, (rad/s)^2, us or a command) and one of
    /// forces (N, kgf, lbf).
    #[arg(value_hint = ValueHint::FilePath)]
    pub table: PathBuf,
    /// The column of inputs; recognised by its unit if not given.
    #[arg(long, value_name = "COLUMN")]
    pub input: Option<String>,
    /// The unit of the inputs, if the header does not state it.
    #[arg(long, value_name = "UNIT")]
    pub input_unit: Option<String>,
    /// The column of forces; recognised by its unit if not given.
    #[arg(long, value_name = "COLUMN")]
    pub force: Option<String>,
    /// The unit of the forces, if the header does not state it.
    #[arg(long, value_name = "UNIT")]
    pub force_unit: Option<String>,
    /// The input at which thrust is zero: 0, or 1500 for pulse widths, if not given.
    #[arg(long, value_name = "INPUT")]
    pub neutral: Option<f64>,
    /// Draw the curve to this .svg or .png file.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub plot: Option<PathBuf>,
    /// Also overwrite a file that this command did not write; never an input.
    #[arg(long)]
    pub overwrite: bool,
}

/// Show a vehicle file: its thrusters, and how each one moves the vehicle.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  seaplant vehicle vehicle.toml")]
pub struct Vehicle {
    /// The vehicle file; it may still be incomplete.
    #[arg(value_hint = ValueHint::FilePath)]
    pub vehicle: PathBuf,
}

/// Serve the page on the loopback address, for this machine only, until Ctrl-C.
#[cfg(not(target_family = "wasm"))]
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  seaplant page FOLDER")]
pub struct Page {
    /// The folder that scripts/page made, or its index.html; by default `page` beside the program.
    #[arg(value_hint = ValueHint::AnyPath)]
    pub page: Option<PathBuf>,
    /// The port; 0 for any that is free.
    #[arg(long, value_name = "PORT", default_value_t = 8036)]
    pub port: u16,
}

/// A kind of file.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum SchemaKind {
    /// results.json.
    Results,
    /// vehicle.toml.
    Vehicle,
    /// campaign.toml.
    Campaign,
    /// The file that `seaplant twin` reads.
    Twin,
    /// A plant file, as `seaplant export --to json` writes and published tables are.
    Plant,
    /// A profile of inputs for `seaplant simulate`.
    Profile,
    #[cfg(not(target_family = "wasm"))]
    /// A request for `seaplant plan`.
    Request,
    #[cfg(not(target_family = "wasm"))]
    /// plan.json, as `seaplant plan` writes it.
    Plan,
}

/// Print the JSON Schema of a file, for editors and programs.
#[derive(Debug, Args)]
pub struct Schema {
    /// Which file.
    pub kind: SchemaKind,
}

/// Print a completion script for a shell.
#[derive(Debug, Args)]
#[command(
    after_help = "Example:\n  seaplant completions bash > ~/.local/share/bash-completion/completions/seaplant"
)]
pub struct Completions {
    /// Which shell.
    pub shell: clap_complete::Shell,
}

/// Write the manual pages.
#[derive(Debug, Args)]
pub struct Man {
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "man", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,

    /// Also overwrite files that this command did not write.
    #[arg(long)]
    pub force: bool,
}
