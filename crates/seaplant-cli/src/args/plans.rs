//! The command that plans a trial.

use std::path::PathBuf;

use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueHint};
use seaplant::Dof;
use seaplant_plan::Criterion;

use super::completer::plants;

fn dof() -> impl TypedValueParser<Value = Dof> {
    PossibleValuesParser::new(Dof::ALL.map(Dof::name)).try_map(|name| name.parse::<Dof>())
}

fn criterion() -> impl TypedValueParser<Value = Criterion> {
    PossibleValuesParser::new(Criterion::ALL.map(Criterion::name))
        .map(|name| Criterion::ALL.into_iter().find(|one| one.name() == name).unwrap_or_default())
}

/// Plan the next trial: manoeuvres, their duration, and the intervals after it.
///
/// The prior plant comes from hull formulas and a vehicle.toml, from a published table or plant
/// file, or from results with their covariance. Manoeuvres are as strong as the limits allow;
/// minutes go to those that narrow the intervals of the goals, with a certificate. Files to play
/// and to print are written to --out.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  seaplant plan vehicle.toml --out plan\n  seaplant plan published:bluerov2-heavy-von-benzon-2022 --goal mass.surge=5% --goal drag.yaw=10% --box 5,5 --out plan\n  seaplant plan results/results.json --minutes 20 --out next"
)]
pub struct Plan {
    /// A vehicle.toml, the results.json of a fit, a plant file, or published:NAME.
    #[arg(value_hint = ValueHint::FilePath, add = plants())]
    pub plant: PathBuf,
    /// The folder to write plan.json, plan.html, plan.svg, commands and plan.lua to.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub out: PathBuf,
    /// A goal, as mass.surge=5%, drag.yaw=10%, speed.surge=3% or "surge: |u|u=12" in SI units: half
    /// of a 95 % interval. With --mission also mission.surge=5%, with --bandwidth margin.yaw=3 in
    /// degrees. Repeat it for several; if not given, velocity on the mission to 5 % and margins to 5°,
    /// or mass to 5 % and drag to 10 % of every axis with thrust.
    #[arg(long = "goal", value_name = "GOAL")]
    pub goals: Vec<String>,
    /// A request in TOML: goals, limits, logged channels; `seaplant schema request` prints its
    /// keys. Or the plan.json of an earlier plan, for its request. Options here override it.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub request: Option<PathBuf>,
    /// A reference mission in CSV, `time [s]` and the force on axes as `surge [N]`: a goal
    /// mission.AXIS is the velocity that the plant predicts on it.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub mission: Option<PathBuf>,
    /// Bandwidth of the controller whose phase margin is a goal, Hz; the request has its other keys.
    #[arg(long, value_name = "HZ")]
    pub bandwidth: Option<f64>,
    /// A weight to hang on, for the scale of thrust (goal thrust.scale): N in water, kg, and if it does not
    /// hang at the origin its place x,y,z in body axes, m.
    #[arg(
        long,
        value_name = "N,KG[,X,Y,Z]",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    pub weight: Vec<f64>,
    /// The battery: usable Wh, W of one thruster at its greatest thrust, W of everything else.
    #[arg(
        long,
        value_name = "WH,W,W",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    pub battery: Vec<f64>,
    /// The objective that the minutes minimise: the widest interval of the goals, their mean
    /// square, or the volume of all.
    #[arg(long, value_parser = criterion())]
    pub criterion: Option<Criterion>,
    /// Minutes of driving; as many as the goals need if not given.
    #[arg(long, value_name = "MIN")]
    pub minutes: Option<f64>,
    /// An axis of the plant; for a vehicle.toml by default those with thrust. Repeat it for
    /// several.
    #[arg(long = "axis", value_parser = dof())]
    pub axes: Vec<Dof>,
    /// The greatest distance north or south, and east or west, of the start, m.
    #[arg(
        long = "box",
        value_name = "N,E",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    pub room: Vec<f64>,
    /// The least and the greatest depth, m.
    #[arg(
        long,
        value_name = "LEAST,GREATEST",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    pub depth: Vec<f64>,
    /// Depth at which manoeuvres begin, m.
    #[arg(long, value_name = "M")]
    pub start_depth: Option<f64>,
    /// The greatest speed, m/s.
    #[arg(long, value_name = "M/S")]
    pub speed: Option<f64>,
    /// The greatest rate of turn, rad/s.
    #[arg(long, value_name = "RAD/S")]
    pub rate: Option<f64>,
    /// The greatest angle of roll and of pitch, degrees.
    #[arg(long, value_name = "DEG")]
    pub tilt: Option<f64>,
    /// The fraction of its greatest thrust that a thruster may give, per cent.
    #[arg(long, value_name = "PER CENT")]
    pub thrust: Option<f64>,
    /// The length of tether, or greatest straight distance from the start, m.
    #[arg(long, value_name = "M")]
    pub tether: Option<f64>,
    /// Standard deviation of the expected disturbance on each axis, per cent of the force that
    /// drives it within the limits; results state their own.
    #[arg(long, value_name = "PER CENT")]
    pub disturbance: Option<f64>,
    /// The expected current, north and east, m/s, as 0.2,-0.1.
    #[arg(
        long,
        value_name = "N,E",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    pub current: Vec<f64>,
    /// The input of full thrust from neutral, as "1650 rpm" or 400, where a curve states no end.
    #[arg(long, value_name = "INPUT")]
    pub full_input: Option<String>,
    /// Number of plants drawn from the prior, over which the plan is averaged.
    #[arg(long, value_name = "N")]
    pub draws: Option<usize>,
    /// Simulated runs in disturbances that check the limits.
    #[arg(long, value_name = "N")]
    pub checks: Option<usize>,
    /// Also print the minutes that driving without a plan would need: the paper's sinusoid and
    /// joystick, and a sweep, of each axis in turn.
    #[arg(long)]
    pub compare: bool,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Also drive the plan with a simulated vehicle, whose plant differs from the prior's mean, and
    /// write its campaign and logs to this folder.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub rehearse: Option<PathBuf>,
    /// Also overwrite files that Seaplant did not write or that were changed since; never an input.
    #[arg(long)]
    pub force: bool,
}
