//! Commands that make a twin.

use std::path::PathBuf;

use clap::{Args, ValueHint};
use seaplant::Dof;
use seaplant::twin::Disturbance;

use super::{MethodChoice, methods};

/// Make the Jason 2 campaign with a digital twin, identify it and write the report.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant demo\n  seaplant demo --disturbances tether,lag --seed 7 --out lagging"
)]
pub struct Demo {
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "seaplant-demo", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// A vehicle with several axes in place of Jason 2: a published table, such as rexrov, or a
    /// plant file with thrusters.
    #[arg(long, value_name = "NAME", value_hint = ValueHint::FilePath)]
    pub vehicle: Option<String>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Disturbances of the twin: none, all (tether, current, lag, delay, thrcoef and lever), or
    /// names separated by commas; an unknown name is answered with the list.
    #[arg(long, value_name = "LIST", default_value = "none", value_parser = disturbances)]
    pub disturbances: String,
    /// Also overwrite files that Seaplant did not write or that were changed since; never an input.
    #[arg(long)]
    pub force: bool,
}

/// Returns the list as written, if it is valid.
fn disturbances(list: &str) -> Result<String, seaplant::Error> {
    Disturbance::parse_list(list).map(|_| list.to_owned())
}

/// Make the logs of a vehicle with known truth.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant twin twin.toml --out logs\n  echo 'disturbances = [\"current\"]' > twin.toml && seaplant twin twin.toml --out logs"
)]
pub struct Twin {
    /// The specification of the twin, in TOML; `seaplant schema twin` prints its keys.
    #[arg(value_hint = ValueHint::FilePath)]
    pub spec: PathBuf,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Also overwrite files that Seaplant did not write or that were changed since; never an input.
    #[arg(long)]
    pub force: bool,
}

/// Measure errors and coverage of the methods on a twin, over many seeds; for several axes those of
/// every coefficient.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant monte-carlo --disturbances tether --runs 30\n  seaplant monte-carlo twin.toml --method filter-error --out table.json\n  echo 'vehicle = \"published:rexrov\"' > whole.toml && seaplant monte-carlo whole.toml --disturbances tether"
)]
pub struct MonteCarlo {
    /// The specification of the twin, in TOML; the Jason 2 twin if not given.
    #[arg(value_hint = ValueHint::FilePath)]
    pub spec: Option<PathBuf>,
    /// The disturbances, in place of those in the file: none, all, or a list.
    #[arg(long, value_name = "LIST")]
    pub disturbances: Option<String>,
    /// The degrees of freedom, in place of what the file says. Repeat the option for several.
    #[arg(long = "dof")]
    pub dofs: Vec<Dof>,
    /// A method; those that `identify` uses by itself if not given. Repeat the option for several.
    #[arg(long = "method", value_name = "METHOD", value_parser = methods())]
    pub methods: Vec<MethodChoice>,
    /// Number of twins; seeds count up from that of the file.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u64).range(..=1_000_000))]
    pub runs: u64,
    /// Number of threads; one for each processor if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// The JSON file to write the table to.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Also overwrite a file that this command did not write; never an input.
    #[arg(long)]
    pub force: bool,
}
