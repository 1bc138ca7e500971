//! Commands that use a plant.

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueHint};
use seaplant::{Dof, Method};
use seaplant_control::Law;
use seaplant_export::EXPORTERS;

use super::completer::plants;
use super::method;

fn dof() -> impl TypedValueParser<Value = Dof> {
    PossibleValuesParser::new(Dof::ALL.map(Dof::name)).try_map(|name| name.parse::<Dof>())
}

/// Simulate a plant with given inputs, or with the thrust of a log.
///
/// Inputs alone are --step, a profile in TOML, or a table whose columns are time, wrench.AXIS,
/// thruster.NAME.INPUT and supply.voltage, with units. Any other log is read through its campaign,
/// and simulated and measured velocity are compared.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant simulate results/results.json --step \"surge 200 N\" --for 60\n  seaplant simulate results/results.json profile.toml --out motion.csv\n  seaplant simulate results/results.json dive13.csv --dof heave --out heave.csv"
)]
pub struct Simulate {
    /// The results.json of a fit; for inputs alone also a plant file or published:NAME.
    #[arg(value_hint = ValueHint::FilePath, add = plants())]
    pub results: PathBuf,
    /// A profile, a table of inputs, or the log or files that were logged simultaneously.
    #[arg(value_name = "INPUTS", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// A constant force from rest, as "surge 200 N", "yaw 5 N m" or "surge 60 %" of the thrusters'
    /// maximum; repeat it for each axis.
    #[arg(long = "step", value_name = "FORCE", conflicts_with = "logs", requires = "duration_s")]
    pub steps: Vec<String>,
    /// Duration of the simulation, s.
    #[arg(long = "for", value_name = "S")]
    pub duration_s: Option<f64>,
    /// Initial velocity, as "surge 0.5 m/s"; repeat it for each axis.
    #[arg(long = "from", value_name = "VELOCITY")]
    pub start: Vec<String>,
    /// Velocity of the water north and east, m/s, as 0.2,-0.1.
    #[arg(
        long,
        value_name = "N,E",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    pub current: Vec<f64>,
    /// Number of draws of the coefficients for the band; 0 for none.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(0..=10_000))]
    pub draws: u16,
    /// Seed of the draws.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Add disturbances like those of the trials to each draw, so that the band includes them.
    #[arg(long)]
    pub disturbed: bool,
    /// The campaign whose vehicle and channels the log shares; the fit's own if not given.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub campaign: Option<PathBuf>,
    /// The degree of freedom, if the results hold several.
    #[arg(long, value_parser = dof())]
    pub dof: Option<Dof>,
    /// The method whose plant to use; the recommended one's if not given.
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
    /// The CSV file to write, or of inputs alone a page with charts (.html); a log's is printed if
    /// not given.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Also overwrite files that Seaplant did not write or that were changed since; never an input.
    #[arg(long)]
    pub force: bool,
}

fn formats() -> PossibleValuesParser {
    PossibleValuesParser::new(
        EXPORTERS.map(|exporter| PossibleValue::new(exporter.name()).help(exporter.about())),
    )
}

/// Export a plant to a format of a simulator or controller.
///
/// Every file states its units, frames, source, settings and uncertainty. The plant's unknowns and
/// the limitations of the format are listed in the files and here.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant export results/results.json --to gazebo --out model\n  seaplant export published:bluerov2-wu-2018 --to fmu --out model"
)]
pub struct Export {
    /// The results.json of a fit, a plant file (seaplant/plant in TOML or JSON), or
    /// published:NAME.
    #[arg(value_hint = ValueHint::FilePath, add = plants())]
    pub plant: PathBuf,
    /// The format.
    #[arg(long, value_name = "FORMAT", value_parser = formats())]
    pub to: String,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// The method whose plants of single axes to use; the recommended one's if not given.
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
    /// Export a plant that should not be used; the files carry the reasons.
    #[arg(long)]
    pub anyway: bool,
    /// Also overwrite files that Seaplant did not write or that were changed since; never an input.
    #[arg(long)]
    pub force: bool,
}

fn law() -> impl TypedValueParser<Value = Law> {
    PossibleValuesParser::new(Law::ALL.map(Law::name)).try_map(|name| name.parse::<Law>())
}

/// Make a controller for a plant: gains, stability margins and tracking errors.
///
/// Gains come from a bandwidth and a damping ratio, or from an error and a force of equal cost.
/// Lag, delay and limits are those of the plant's thrusters, as far as they are known; margins are
/// taken over draws of the coefficients.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant control results/results.json --bandwidth \"surge 0.05 Hz\" --out controller\n  seaplant control published:bluerov2-heavy-von-benzon-2022 --bandwidth \"yaw 0.2 Hz\" --law pid"
)]
pub struct Control {
    /// The results.json of a fit, a plant file, or published:NAME.
    #[arg(value_hint = ValueHint::FilePath, add = plants())]
    pub plant: PathBuf,
    /// The natural frequency of an axis's closed loop, as "surge 0.05 Hz"; give it once for each
    /// axis.
    #[arg(long = "bandwidth", value_name = "AXIS")]
    pub bandwidths: Vec<String>,
    /// The error and the force of equal cost, as "surge 0.1 m 400 N", in place of a bandwidth: a
    /// linear quadratic regulator.
    #[arg(long = "lqr", value_name = "AXIS")]
    pub regulators: Vec<String>,
    /// The damping ratio of axes with a bandwidth.
    #[arg(long, value_name = "RATIO", default_value_t = 1.0)]
    pub damping: f64,
    /// The integral time of PID, s; 10 over the bandwidth in rad/s if not given.
    #[arg(long = "integral", value_name = "S")]
    pub integral_s: Option<f64>,
    /// The law.
    #[arg(long, value_parser = law(), default_value = "non-exact")]
    pub law: Law,
    /// Adapt the model of the control law while it runs.
    #[arg(long)]
    pub adaptive: bool,
    /// Time constant of the adaptation, s.
    #[arg(long = "adaptation", value_name = "S", default_value_t = 60.0)]
    pub adaptation_s: f64,
    /// The greatest force on an axis, as "surge 2000 N"; for thrusters with measured tables it is
    /// known.
    #[arg(long = "limit", value_name = "FORCE")]
    pub limits: Vec<String>,
    /// The lag of an axis's thrusters, as "surge 0.3 s", in place of the plant's.
    #[arg(long = "lag", value_name = "AXIS")]
    pub lags: Vec<String>,
    /// The delay of an axis's thrusters, as "surge 0.2 s", in place of the plant's.
    #[arg(long = "delay", value_name = "AXIS")]
    pub delays: Vec<String>,
    /// Sample rate of the controller, Hz.
    #[arg(long, value_name = "HZ", default_value_t = 10.0)]
    pub sample_hz: f64,
    /// Velocity of the water north and east in the second run, m/s, as 0.2,-0.1.
    #[arg(
        long,
        value_name = "N,E",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true,
        default_value = "0.2,0.1"
    )]
    pub current: Vec<f64>,
    /// Number of draws of the coefficients for the worst case.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(0..=10_000))]
    pub draws: u16,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// The method whose plants of single axes to use; the recommended one's if not given.
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
    /// Make one even if the plant should not be used or a margin is too small; the files carry
    /// the reasons.
    #[arg(long)]
    pub anyway: bool,
    /// The folder to write control.toml, control.json, the C headers and ArduSub's parameters to;
    /// if not given, nothing is written.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Also overwrite files that Seaplant did not write or that were changed since; never an input.
    #[arg(long)]
    pub force: bool,
}
