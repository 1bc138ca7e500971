//! Definition of the command line.

mod completer;
mod fits;
mod logs;
#[cfg(not(target_family = "wasm"))]
mod plans;
mod plants;
mod tools;
mod twins;

use std::ffi::OsString;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand, ValueEnum};
use seaplant::Method;

#[cfg(not(target_family = "wasm"))]
pub use fits::Watch;
use fits::methods;
pub use fits::{Compare, Identify, MethodChoice, Validate};
pub use logs::{Init, Inspect, MessageStamp, Plot, Reading};
#[cfg(not(target_family = "wasm"))]
pub use plans::Plan;
pub use plants::{Control, Export, Simulate};
#[cfg(not(target_family = "wasm"))]
pub use tools::Page;
pub use tools::{Completions, Man, Schema, SchemaKind, Thruster, Vehicle};
pub use twins::{Demo, MonteCarlo, Twin};

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
    /// The command.
    #[command(subcommand)]
    pub command: Command,
    /// Print the result as JSON, for other programs.
    #[arg(long, global = true)]
    pub json: bool,
    /// Print nothing but errors and the requested result.
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Print the progress of fits on standard error, a line of JSON each, for other programs.
    #[arg(long = "progress-json", global = true, hide = true)]
    pub progress: bool,
    /// When to use colour.
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub color: Color,
}

impl Arguments {
    /// Returns the arguments that words state, of which the first is the program.
    ///
    /// # Errors
    /// The words that are none, or a request for help or version.
    pub fn of(
        words: impl IntoIterator<Item = impl Into<OsString> + Clone>,
    ) -> Result<Self, clap::Error> {
        let mut command = with_numbers_below_zero(Self::command());
        let found = command.try_get_matches_from_mut(words)?;
        Self::from_arg_matches(&found).map_err(|error| error.format(&mut command))
    }
}

/// Lets every option take a number below zero, to be refused with what the option expects, not as an unknown option.
fn with_numbers_below_zero(command: clap::Command) -> clap::Command {
    let option = |argument: clap::Arg| {
        let takes_value = argument.get_action().takes_values() && !argument.is_positional();
        argument.allow_negative_numbers(takes_value)
    };
    command.mut_args(option).mut_subcommands(with_numbers_below_zero)
}

/// When to use colour.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Color {
    /// In a terminal that supports it.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

impl Color {
    /// Applies the choice to everything that prints.
    pub fn write_global(self) {
        match self {
            Self::Auto => anstream::ColorChoice::Auto,
            Self::Always => anstream::ColorChoice::Always,
            Self::Never => anstream::ColorChoice::Never,
        }
        .write_global();
    }
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Make the Jason 2 campaign with a digital twin, identify it and write the report.
    Demo(Demo),
    /// Write a starting vehicle.toml and campaign.toml from a log.
    Init(Init),
    /// Show a log's channels: units, rates, spans, gaps and suspicious values.
    Inspect(Inspect),
    /// Draw a log's channels, in the terminal or as an HTML page to mark trials on.
    Plot(Plot),
    /// Fit every degree of freedom of a campaign and write the report.
    Identify(Identify),
    /// Simulate a plant with given inputs, or with the thrust of a log.
    Simulate(Simulate),
    /// Score a fitted plant on the trials of a campaign.
    Validate(Validate),
    /// Compare fits and plant tables, and test whether they differ by more than chance.
    Compare(Compare),
    /// Export a plant to a format of a simulator or controller.
    Export(Export),
    /// Make a controller for a plant: gains, stability margins and tracking errors.
    Control(Control),
    #[cfg(not(target_family = "wasm"))]
    /// Plan the next trial: manoeuvres, minutes for each, and the intervals they lead to.
    Plan(Box<Plan>),
    #[cfg(not(target_family = "wasm"))]
    /// Identify a campaign again whenever one of its files changes.
    Watch(Watch),
    #[cfg(not(target_family = "wasm"))]
    /// Serve the page, from log to verdict in a browser, on this machine only.
    Page(Page),
    /// Fit a thrust curve to a bollard-pull table.
    Thruster(Thruster),
    /// Show a vehicle file: its thrusters, and how each one moves the vehicle.
    Vehicle(Vehicle),
    /// Make the logs of a simulated vehicle whose true plant is known.
    Twin(Twin),
    /// Measure errors and coverage of the methods on a twin, over many seeds.
    MonteCarlo(MonteCarlo),
    /// Print the JSON Schema of a file, for editors and programs.
    Schema(Schema),
    /// Print a completion script for a shell.
    Completions(Completions),
    /// Write the manual pages.
    Man(Man),
}

/// Lists the names, which help, completion and suggestions use.
fn method() -> impl TypedValueParser<Value = Method> {
    PossibleValuesParser::new(Method::ALL.map(Method::name)).try_map(|name| name.parse::<Method>())
}
