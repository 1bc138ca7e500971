//! A plan.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use seaplant::Dof;
use serde::{Deserialize, Serialize};

use crate::allocate::Criterion;
use crate::forecast::{Chart, Forecast};
use crate::manoeuvre::{Kind, Manoeuvre};
use crate::request::Request;

/// The schema of [`Plan`] in files.
pub const PLAN_SCHEMA: &str = "seaplant/trial-plan/1";

/// A plan: manoeuvres, the minutes of each, and the predicted intervals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// [`PLAN_SCHEMA`].
    pub schema: String,
    /// Name of the vehicle.
    pub vehicle: String,
    /// The axes of its plant.
    pub axes: Vec<Dof>,
    /// Source of the prior plant, and its uncertainty.
    pub prior: String,
    /// The request.
    pub request: Request,
    /// Manoeuvres in their order.
    pub manoeuvres: Vec<Planned>,
    /// Minutes of driving.
    pub minutes: f64,
    /// Energy that they take from the battery, Wh; none if its power is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy_wh: Option<f64>,
    /// Minutes that the goals need, with no manoeuvre of less than a minute; none if they cannot be met.
    pub minutes_needed: Option<f64>,
    /// Predicted intervals of the goals.
    pub goals: Vec<Forecast>,
    /// Predicted intervals of every coefficient.
    pub coefficients: Vec<Forecast>,
    /// Optimality certificate of the minutes.
    pub certificate: Certificate,
    /// Minutes that each kind of unplanned driving needs for the same goals, axis by axis in equal
    /// parts, if requested; none for a kind that cannot meet them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub unplanned: BTreeMap<Kind, Option<f64>>,
    /// Half 95 % intervals of the goals against minutes.
    pub chart: Chart,
    /// Runs in disturbances.
    pub check: LimitCheck,
    /// Warnings to resolve before the dive.
    pub doubts: Vec<String>,
    /// Notes.
    pub notes: Vec<String>,
}

/// A manoeuvre with its time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Planned {
    /// The manoeuvre.
    pub manoeuvre: Manoeuvre,
    /// Minutes of driving.
    pub minutes: f64,
    /// Its share of the time before it was rounded.
    pub share: f64,
    /// Least and greatest velocity of each driven axis, m/s and rad/s.
    pub velocity: BTreeMap<Dof, [f64; 2]>,
    /// The limit that keeps it from stronger forces.
    pub limited_by: String,
    /// The manoeuvre in words.
    pub words: String,
}

/// Optimality certificate of the minutes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Certificate {
    /// The minimised objective.
    pub criterion: Criterion,
    /// Upper bound on the fraction by which other shares of these manoeuvres could narrow the
    /// intervals.
    pub gap: f64,
    /// The count of candidate manoeuvres.
    pub candidates: usize,
}

/// Runs in disturbances, each with another plant drawn from the prior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitCheck {
    /// The count of runs.
    pub runs: usize,
    /// The count of runs beyond a limit.
    pub broken: usize,
    /// The greatest fraction of a limit that was used.
    pub greatest: f64,
    /// Name of that limit.
    pub of: String,
    /// Runs beyond a limit, by limit and by manoeuvre.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub by_limit: BTreeMap<String, BTreeMap<String, usize>>,
}
