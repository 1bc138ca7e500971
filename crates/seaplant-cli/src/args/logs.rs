//! Commands that look at logs.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum, ValueHint};
use seaplant_campaign::VehiclePreset;

/// Parses a known vehicle by its name in vehicle.toml.
fn preset() -> impl TypedValueParser<Value = VehiclePreset> {
    let named = |name: String| VehiclePreset::ALL.into_iter().find(|known| known.key() == name);
    PossibleValuesParser::new(VehiclePreset::ALL.map(VehiclePreset::key))
        .try_map(move |name| named(name).ok_or("no such preset"))
}

/// Write a starting vehicle.toml and campaign.toml from a log.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant init dive12.csv\n  seaplant init thrusters.csv dvl.csv --out dive12"
)]
pub struct Init {
    /// The log, or the files that were logged simultaneously.
    #[arg(required = true, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = ".", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// A known vehicle: bluerov2 or bluerov2-heavy.
    #[arg(long, value_name = "NAME", value_parser = preset())]
    pub preset: Option<VehiclePreset>,
    /// Overwrite existing files.
    #[arg(long)]
    pub force: bool,
    /// Options of reading the log.
    #[command(flatten)]
    pub reading: Reading,
}

/// Options of reading a log.
#[derive(Debug, Args)]
pub struct Reading {
    /// The time column of a table, if its name does not say so.
    #[arg(long, value_name = "COLUMN")]
    pub time: Option<String>,
    /// The rate of a table without a time column.
    #[arg(long, value_name = "HZ", conflicts_with = "time")]
    pub equal_sampling_hz: Option<f64>,
    /// The sheet of a workbook; its first if not given.
    #[arg(long, value_name = "NAME")]
    pub sheet: Option<String>,
    /// The time of a ROS message to use.
    #[arg(long, value_name = "WHICH", default_value = "header")]
    pub stamp: MessageStamp,
}

/// The choice between a message's two times.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MessageStamp {
    /// The time in its header; for messages without one, the time of receipt.
    Header,
    /// The time at which it was recorded.
    Receive,
}

/// Show a log's channels: units, rates, spans, gaps and suspicious values.
///
/// A file of more than 64 MiB is surveyed: its index is read, where its format has one, and parts
/// from its first byte to its last. Estimates are marked by ≈.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant inspect thrusters.csv dvl.csv\n  seaplant inspect dive.mcap --whole"
)]
pub struct Inspect {
    /// The log, or the files that were logged simultaneously.
    #[arg(required = true, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// Show only columns whose name contains this; may be given several times.
    #[arg(long, value_name = "TEXT")]
    pub only: Vec<String>,
    /// Also read every sample of large files, count gaps, and hash them.
    #[arg(long)]
    pub whole: bool,
    /// Options of reading the log.
    #[command(flatten)]
    pub reading: Reading,
}

/// Draw a log's channels, in the terminal or as an HTML page to mark trials on.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant plot dive12.csv\n  seaplant plot dive12.BIN --only ATT --only RCOU --out dive12.html"
)]
pub struct Plot {
    /// The log, or the files that were logged simultaneously.
    #[arg(required = true, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// Draw only columns whose name contains this; may be given several times.
    #[arg(long, value_name = "TEXT")]
    pub only: Vec<String>,
    /// The page to write (.html): zoom to a stretch and mark it for the lines of its trial in campaign.toml.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Also overwrite a file that is not such a page; never an input.
    #[arg(long)]
    pub force: bool,
    /// Options of reading the log.
    #[command(flatten)]
    pub reading: Reading,
}
