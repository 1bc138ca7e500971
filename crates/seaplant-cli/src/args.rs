//! What a user may write on the command line.

use std::fmt;
use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use seaplant::twin::Disturbance;
use seaplant::{Dof, Method, Terms};
use seaplant_campaign::VehiclePreset;
use seaplant_control::Law;
use seaplant_export::EXPORTERS;

/// Identifies the dynamic model of a marine vehicle from its logs: effective mass (rigid body
/// plus added mass), drag, their uncertainty, and reasons for doubt.
#[derive(Debug, Parser)]
#[command(
    name = "seaplant",
    version,
    long_version = env!("SEAPLANT_BUILD"),
    propagate_version = true,
    after_help = "Start with `seaplant demo`, which makes a campaign, identifies it and writes the report.\n\
                  With a log of your own: `seaplant inspect LOG`, `seaplant init LOG`, finish the two files\n\
                  that it writes, then `seaplant identify campaign.toml`."
)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// Print the result as JSON, for other programs.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print nothing but errors and what was asked for.
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// When to use colour.
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub color: Color,
}

/// When to use colour.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Color {
    /// In a terminal that shows it.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

impl Color {
    /// Makes the choice known to everything that prints.
    pub fn write_global(self) {
        match self {
            Self::Auto => anstream::ColorChoice::Auto,
            Self::Always => anstream::ColorChoice::Always,
            Self::Never => anstream::ColorChoice::Never,
        }
        .write_global();
    }
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make the Jason 2 campaign with a digital twin, identify it and write the report.
    Demo(Demo),
    /// Write a starting vehicle.toml and campaign.toml from what a log holds.
    Init(Init),
    /// Show a log's channels: units, rates, spans, gaps and suspicious values.
    Inspect(Inspect),
    /// Draw a log's channels, in the terminal or as a page on which trials are marked.
    Plot(Plot),
    /// Fit every degree of freedom of a campaign and write the report.
    Identify(Identify),
    /// Predict what a plant would do, or drive it with another log's thrust.
    Simulate(Simulate),
    /// Score a fitted plant on the trials of a campaign.
    Validate(Validate),
    /// Compare fits and plant tables, and test whether they differ by more than chance.
    Compare(Compare),
    /// Write a plant for a simulator or a controller.
    Export(Export),
    /// Make a controller for a plant: gains with their margins, and what they follow.
    Control(Control),
    /// Identify a campaign again whenever one of its files changes.
    Watch(Watch),
    /// Fit a thrust curve to a bollard-pull table.
    Thruster(Thruster),
    /// Make the logs of a simulated vehicle whose true plant is known.
    Twin(Twin),
    /// Measure how well methods do on a twin: errors and coverage over many seeds.
    MonteCarlo(MonteCarlo),
    /// Print the JSON Schema of a file, for editors and programs.
    Schema(Schema),
    /// Print a completion script for a shell.
    Completions(Completions),
    /// Write the manual pages.
    Man(Man),
}

/// Make the Jason 2 campaign with a digital twin, identify it and write the report.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant demo\n  seaplant demo --disturbances tether,lag --seed 7 --out lagging"
)]
pub struct Demo {
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = "seaplant-demo", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// A whole vehicle in place of Jason 2: a published table, such as rexrov, or a plant file
    /// with thrusters.
    #[arg(long, value_name = "NAME", value_hint = ValueHint::FilePath)]
    pub vehicle: Option<String>,
    /// Where every random number starts.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// What disturbs the twin: none, all (tether, current, lag, delay, thrcoef and lever), or
    /// names separated by commas; an unknown name is answered with the list.
    #[arg(long, value_name = "LIST", default_value = "none", value_parser = disturbances)]
    pub disturbances: String,
    /// Write over files that are not as Seaplant wrote them, too; never over what is read.
    #[arg(long)]
    pub force: bool,
}

/// A vehicle by the name that vehicle.toml has for it.
fn preset() -> impl TypedValueParser<Value = VehiclePreset> {
    let named = |name: String| VehiclePreset::ALL.into_iter().find(|known| known.key() == name);
    PossibleValuesParser::new(VehiclePreset::ALL.map(VehiclePreset::key))
        .try_map(move |name| named(name).ok_or("no such preset"))
}

/// Help, completion and the hint at a near name need the names.
fn method() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(Method::ALL.map(Method::name)).try_map(|name| name.parse::<Method>())
}

/// A method, or all of them.
#[derive(Clone, Copy, Debug)]
pub enum MethodChoice {
    /// Every method that there is.
    All,
    /// One.
    One(Method),
}

/// How all methods are asked for.
const ALL: &str = "all";

impl MethodChoice {
    /// The methods, each once, in the order in which they were named.
    pub fn methods(choices: &[Self]) -> Vec<Method> {
        let mut methods = Vec::new();
        for choice in choices {
            let named = match choice {
                Self::All => Method::ALL.to_vec(),
                Self::One(method) => vec![*method],
            };
            for method in named {
                if !methods.contains(&method) {
                    methods.push(method);
                }
            }
        }
        methods
    }
}

impl fmt::Display for MethodChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => f.write_str(ALL),
            Self::One(method) => method.fmt(f),
        }
    }
}

fn methods() -> impl TypedValueParser<Value = MethodChoice> {
    let names = Method::ALL.map(Method::name).into_iter().chain([ALL]);
    PossibleValuesParser::new(names).try_map(|name| match name.as_str() {
        ALL => Ok(MethodChoice::All),
        one => one.parse::<Method>().map(MethodChoice::One),
    })
}

fn dof() -> impl TypedValueParser<Value = Dof> {
    PossibleValuesParser::new(Dof::ALL.map(Dof::name)).try_map(|name| name.parse::<Dof>())
}

/// The list as it was written, if it is one.
fn disturbances(list: &str) -> Result<String, seaplant::Error> {
    Disturbance::parse_list(list).map(|_| list.to_owned())
}

/// Write a starting vehicle.toml and campaign.toml from what a log holds.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant init dive12.csv\n  seaplant init thrusters.csv dvl.csv --out dive12"
)]
pub struct Init {
    /// The log, or the files that were logged side by side.
    #[arg(required = true, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", default_value = ".", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// The vehicle, if it is a known one: bluerov2 or bluerov2-heavy.
    #[arg(long, value_name = "NAME", value_parser = preset())]
    pub preset: Option<VehiclePreset>,
    /// Write over files that are there.
    #[arg(long)]
    pub force: bool,
    /// How to read the log.
    #[command(flatten)]
    pub reading: Reading,
}

/// How to read a log.
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
    /// Which time of a ROS message counts.
    #[arg(long, value_name = "WHICH", default_value = "header")]
    pub stamp: MessageStamp,
}

/// Which time of a message counts.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum MessageStamp {
    /// That in its header; of messages without one, that of receipt.
    Header,
    /// That at which it was recorded.
    Receive,
}

/// Show a log's channels: units, rates, spans, gaps and suspicious values.
///
/// A file of more than 64 MiB is surveyed: its index is read, where its format has one, and parts
/// from its first byte to its last. What is estimated is marked by ≈.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant inspect thrusters.csv dvl.csv\n  seaplant inspect dive.mcap --whole"
)]
pub struct Inspect {
    /// The log, or the files that were logged side by side.
    #[arg(required = true, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// Show only columns whose name contains this; may be given several times.
    #[arg(long, value_name = "TEXT")]
    pub only: Vec<String>,
    /// Read every sample of large files, too, count gaps, and hash them.
    #[arg(long)]
    pub whole: bool,
    /// How to read the log.
    #[command(flatten)]
    pub reading: Reading,
}

/// Draw a log's channels, in the terminal or as a page on which trials are marked.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant plot dive12.csv\n  seaplant plot dive12.BIN --only ATT --only RCOU --out dive12.html"
)]
pub struct Plot {
    /// The log, or the files that were logged side by side.
    #[arg(required = true, value_name = "LOG", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// Draw only columns whose name contains this; may be given several times.
    #[arg(long, value_name = "TEXT")]
    pub only: Vec<String>,
    /// The page to write (.html): drag over a stretch to get the lines of its trial for campaign.toml.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Write over a file that is not such a page, too; never over what is read.
    #[arg(long)]
    pub force: bool,
    /// How to read the log.
    #[command(flatten)]
    pub reading: Reading,
}

/// Fit every degree of freedom of a campaign and write the report.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant identify campaign.toml\n  seaplant identify campaign.toml --method paper --terms force,quadratic --out paper-alone"
)]
pub struct Identify {
    /// The campaign file.
    #[arg(value_hint = ValueHint::FilePath)]
    pub campaign: PathBuf,
    /// A method. Give it once for each; the first gives the recommended plant.
    #[arg(long = "method", value_name = "METHOD", value_parser = methods())]
    pub methods: Vec<MethodChoice>,
    /// The terms to fit, in place of the campaign's: force, quadratic, linear, bias.
    #[arg(long, value_name = "LIST")]
    pub terms: Option<Terms>,
    /// The folder to write to; `results` beside the campaign file if not given.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Write over files that are not as Seaplant wrote them, too; never over what is read.
    #[arg(long)]
    pub force: bool,
}

/// Predict what a plant would do under inputs alone, or drive it with another log's thrust.
///
/// Inputs alone are --step, a profile in TOML, or a table whose columns are time, wrench.AXIS,
/// thruster.NAME.INPUT and supply.voltage, with units. Any other log is read through its campaign, and
/// simulated and measured velocity stand beside each other.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant simulate results/results.json --step \"surge 200 N\" --for 60\n  seaplant simulate results/results.json profile.toml --out motion.csv\n  seaplant simulate results/results.json dive13.csv --dof heave --out heave.csv"
)]
pub struct Simulate {
    /// The results.json of a fit; for inputs alone also a plant file or published:NAME.
    #[arg(value_hint = ValueHint::FilePath)]
    pub results: PathBuf,
    /// A profile, a table of inputs, or the log or files that were logged side by side.
    #[arg(value_name = "INPUTS", value_hint = ValueHint::FilePath)]
    pub logs: Vec<PathBuf>,
    /// A constant force from rest, as "surge 200 N" or "yaw 5 N m"; give it once for each axis.
    #[arg(long = "step", value_name = "FORCE", conflicts_with = "logs", requires = "duration_s")]
    pub steps: Vec<String>,
    /// For how long, s.
    #[arg(long = "for", value_name = "S")]
    pub duration_s: Option<f64>,
    /// A velocity to begin with, as "surge 0.5 m/s"; give it once for each axis.
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
    /// How many draws of the coefficients make the band; 0 for none.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(0..=10_000))]
    pub draws: u16,
    /// Where the draws' random numbers start.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// Disturb each draw as the trials were, so that the band includes that.
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
    /// Write over files that are not as Seaplant wrote them, too; never over what is read.
    #[arg(long)]
    pub force: bool,
}

fn formats() -> PossibleValuesParser {
    PossibleValuesParser::new(
        EXPORTERS.map(|exporter| PossibleValue::new(exporter.name()).help(exporter.about())),
    )
}

/// Write a plant for a simulator or a controller.
///
/// Every file states its units, frames, source, settings and uncertainty. What a format cannot hold,
/// and what of the plant is not known, is listed in the files and here.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant export results/results.json --to gazebo --out model\n  seaplant export published:bluerov2-wu-2018 --to fmu --out model"
)]
pub struct Export {
    /// The results.json of a fit, a plant file (seaplant/plant in TOML or JSON), or
    /// published:NAME.
    #[arg(value_hint = ValueHint::FilePath)]
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
    /// Write over files that are not as Seaplant wrote them, too; never over what is read.
    #[arg(long)]
    pub force: bool,
}

fn law() -> impl TypedValueParser<Value = Law> {
    PossibleValuesParser::new(Law::ALL.map(Law::name)).try_map(|name| name.parse::<Law>())
}

/// Make a controller for a plant: gains with their margins, and what they follow.
///
/// Gains come from a bandwidth and a damping ratio, or from the error and the force that are worth
/// each other. Lag, delay and limits are those of the plant's thrusters, as far as they are known;
/// margins are taken over draws of the coefficients.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant control results/results.json --bandwidth \"surge 0.05 Hz\" --out controller\n  seaplant control published:bluerov2-heavy-von-benzon-2022 --bandwidth \"yaw 0.2 Hz\" --law pid"
)]
pub struct Control {
    /// The results.json of a fit, a plant file, or published:NAME.
    #[arg(value_hint = ValueHint::FilePath)]
    pub plant: PathBuf,
    /// The natural frequency of an axis's closed loop, as "surge 0.05 Hz"; give it once for each
    /// axis.
    #[arg(long = "bandwidth", value_name = "AXIS")]
    pub bandwidths: Vec<String>,
    /// The error that is worth a force, as "surge 0.1 m 400 N", in place of a bandwidth: a linear
    /// quadratic regulator.
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
    /// Let the model of the law adapt.
    #[arg(long)]
    pub adaptive: bool,
    /// In what time it follows, s.
    #[arg(long = "adaptation", value_name = "S", default_value_t = 60.0)]
    pub adaptation_s: f64,
    /// The greatest force on an axis, as "surge 2000 N"; of thrusters with measured tables it is
    /// known.
    #[arg(long = "limit", value_name = "FORCE")]
    pub limits: Vec<String>,
    /// The lag of an axis's thrusters, as "surge 0.3 s", in place of the plant's.
    #[arg(long = "lag", value_name = "AXIS")]
    pub lags: Vec<String>,
    /// The delay of an axis's thrusters, as "surge 0.2 s", in place of the plant's.
    #[arg(long = "delay", value_name = "AXIS")]
    pub delays: Vec<String>,
    /// How often the controller acts, Hz.
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
    /// How many draws of the coefficients the worst case is of.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u16).range(0..=10_000))]
    pub draws: u16,
    /// Where random numbers start.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// The method whose plants of single axes to use; the recommended one's if not given.
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
    /// Make one for a plant that should not be used, or with too small a margin; the files carry
    /// the reasons.
    #[arg(long)]
    pub anyway: bool,
    /// The folder to write control.toml, control.json, the C headers and ArduSub's parameters to;
    /// if not given, nothing is written.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Write over files that are not as Seaplant wrote them, too; never over what is read.
    #[arg(long)]
    pub force: bool,
}

/// Score a fitted plant, or a published one, on the trials of a campaign.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant validate results/results.json another-dive/campaign.toml\n  seaplant validate published:bluerov2-wu-2018 campaign.toml"
)]
pub struct Validate {
    /// The results.json of a fit, a plant file, or published:NAME, each axis by itself.
    #[arg(value_hint = ValueHint::FilePath)]
    pub results: PathBuf,
    /// The campaign whose trials to score on.
    #[arg(value_hint = ValueHint::FilePath)]
    pub campaign: PathBuf,
    /// The method whose plants to use; the recommended one's if not given.
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
}

/// Compare fits and plant tables, and test whether they differ by more than chance.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant compare spring/results autumn/results\n  seaplant compare dive*/results/results.json --method filter-error"
)]
pub struct Compare {
    /// The results of each fit (the folder or its results.json), a plant file, or published:NAME.
    #[arg(required = true, num_args = 2.., value_name = "RESULTS", value_hint = ValueHint::AnyPath)]
    pub results: Vec<PathBuf>,
    /// The method whose plants to compare; the recommended ones if not given.
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
}

/// Identify a campaign again whenever one of its files changes.
#[derive(Debug, Args)]
#[command(
    after_help = "Example, between dives:\n  seaplant watch campaign.toml\n\nIt ends with Ctrl-C. Each round shows which parameters changed by more than chance."
)]
pub struct Watch {
    /// What to identify, and how.
    #[command(flatten)]
    pub identify: Identify,
    /// For how long files must stay as they are before they count as complete, s.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = settle)]
    pub settle_s: f64,
    /// End after so many rounds.
    #[arg(long, value_name = "N")]
    pub rounds: Option<u64>,
}

/// Seconds that are some and not too many.
fn settle(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "is not a number of seconds".to_owned())?;
    let sound = (0.01..=3600.0).contains(&seconds);
    sound.then_some(seconds).ok_or_else(|| "must be from 0.01 to 3600 s".to_owned())
}

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
    /// The input that means stop: 0, or 1500 for pulse widths, if not given.
    #[arg(long, value_name = "INPUT", allow_negative_numbers = true)]
    pub neutral: Option<f64>,
    /// Draw the curve to this .svg or .png file.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub plot: Option<PathBuf>,
    /// Write over a file that this command did not draw, too; never over what is read.
    #[arg(long)]
    pub overwrite: bool,
}

/// Make the logs of a vehicle whose truth is known.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant twin twin.toml --out logs\n  echo 'disturbances = [\"current\"]' > twin.toml && seaplant twin twin.toml --out logs"
)]
pub struct Twin {
    /// What the twin is and does, in TOML; `seaplant schema twin` prints its keys.
    #[arg(value_hint = ValueHint::FilePath)]
    pub spec: PathBuf,
    /// The folder to write to.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// Write over files that are not as Seaplant wrote them, too; never over what is read.
    #[arg(long)]
    pub force: bool,
}

/// Measure how well methods do on a twin: errors and coverage over many seeds.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant monte-carlo --disturbances tether --runs 30\n  seaplant monte-carlo twin.toml --method filter-error --out table.json"
)]
pub struct MonteCarlo {
    /// What the twin is and does, in TOML; the Jason 2 twin if not given.
    #[arg(value_hint = ValueHint::FilePath)]
    pub spec: Option<PathBuf>,
    /// What disturbs it, in place of what the file says: none, all, or a list.
    #[arg(long, value_name = "LIST")]
    pub disturbances: Option<String>,
    /// The degrees of freedom, in place of what the file says. Give it once for each.
    #[arg(long = "dof")]
    pub dofs: Vec<Dof>,
    /// A method; those that `identify` uses by itself if not given. Give it once for each.
    #[arg(long = "method", value_name = "METHOD", value_parser = methods())]
    pub methods: Vec<MethodChoice>,
    /// How many twins to make, with seeds from that of the file upwards.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u64).range(..=1_000_000))]
    pub runs: u64,
    /// How many to work on side by side; as many as there are processors if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// The JSON file to write the table to.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Write over a file that this command did not write, too; never over what is read.
    #[arg(long)]
    pub force: bool,
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
}
