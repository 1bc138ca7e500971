//! Commands that fit plants and compare them.

use std::fmt;
use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueHint};
use seaplant::{Method, Terms};

use super::completer::plants;
use super::method;

/// A method, or all of them.
#[derive(Clone, Copy, Debug)]
pub enum MethodChoice {
    /// Every method that there is.
    All,
    /// One.
    One(Method),
}

/// Name that selects all methods.
const ALL: &str = "all";

impl MethodChoice {
    /// Returns the methods, each once, in the order in which they were named.
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

pub(super) fn methods() -> impl TypedValueParser<Value = MethodChoice> {
    let names = Method::ALL.map(Method::name).into_iter().chain([ALL]);
    PossibleValuesParser::new(names).try_map(|name| match name.as_str() {
        ALL => Ok(MethodChoice::All),
        one => one.parse::<Method>().map(MethodChoice::One),
    })
}

/// Fit every degree of freedom of a campaign and write the report.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant identify campaign.toml\n  seaplant identify campaign.toml --method paper --terms force,quadratic --out paper-alone\n  seaplant identify campaign.toml --plan plan/plan.json"
)]
pub struct Identify {
    /// The campaign file.
    #[arg(value_hint = ValueHint::FilePath)]
    pub campaign: PathBuf,
    /// A method; repeat the option for several. The first one gives the recommended plant.
    #[arg(long = "method", value_name = "METHOD", value_parser = methods())]
    pub methods: Vec<MethodChoice>,
    /// The terms to fit, in place of the campaign's: force, quadratic, linear, bias.
    #[arg(long, value_name = "LIST")]
    pub terms: Option<Terms>,
    /// The plan.json of the dive: also report what of it was driven, and which goals are met.
    #[cfg(not(target_family = "wasm"))]
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub plan: Option<PathBuf>,
    /// The folder to write to; `results` beside the campaign file if not given.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: Option<PathBuf>,
    /// Also overwrite files that Seaplant did not write or that were changed since; never an input.
    #[arg(long)]
    pub force: bool,
}

/// Score a fitted plant, or a published one, on the trials of a campaign.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant validate results/results.json another-dive/campaign.toml\n  seaplant validate published:bluerov2-wu-2018 campaign.toml"
)]
pub struct Validate {
    /// The results.json of a fit, a plant file, or published:NAME.
    #[arg(value_hint = ValueHint::FilePath, add = plants())]
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
    after_help = "Examples:\n  seaplant compare spring/results autumn/results\n  seaplant compare dive*/results/results.json --method filter-error\n  seaplant compare dive*/results --out life.html"
)]
pub struct Compare {
    /// The results of each fit (the folder or its results.json), a plant file, or published:NAME.
    #[arg(required = true, num_args = 2.., value_name = "RESULTS", value_hint = ValueHint::AnyPath, add = plants())]
    pub results: Vec<PathBuf>,
    /// The method whose plants to compare; the recommended ones if not given.
    #[arg(long, value_parser = method())]
    pub method: Option<Method>,
    /// Write what each thruster gives from dive to dive as a page to this file (.html); the results are
    /// dives of one vehicle, in order.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub out: Option<PathBuf>,
    /// Also overwrite a file that Seaplant did not write.
    #[arg(long)]
    pub force: bool,
}

/// Identify a campaign again whenever one of its files changes.
#[cfg(not(target_family = "wasm"))]
#[derive(Debug, Args)]
#[command(
    after_help = "Example, between dives:\n  seaplant watch campaign.toml\n\nIt ends with Ctrl-C. Each round shows which parameters changed by more than chance."
)]
pub struct Watch {
    /// The campaign, methods and output.
    #[command(flatten)]
    pub identify: Identify,
    /// Time without changes after which files count as complete, s.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = settle)]
    pub settle_s: f64,
    /// Stop after this many rounds.
    #[arg(long, value_name = "N")]
    pub rounds: Option<u64>,
}

/// Parses a positive number of seconds up to a limit.
#[cfg(not(target_family = "wasm"))]
fn settle(text: &str) -> Result<f64, String> {
    let seconds: f64 = text.parse().map_err(|_| "is not a number of seconds".to_owned())?;
    let sound = (0.01..=3600.0).contains(&seconds);
    sound.then_some(seconds).ok_or_else(|| "must be from 0.01 to 3600 s".to_owned())
}
