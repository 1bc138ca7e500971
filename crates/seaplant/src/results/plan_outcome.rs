//! A planned dive after it, as data: what was driven, and which goals are met.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Dof;

/// A plan compared with the logs and the fit: what was driven, what was not, and what is still
/// open.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanOutcome {
    /// The plan's file.
    pub file: String,
    /// The vehicle of the plan.
    pub vehicle: String,
    /// Minutes of the plan.
    pub minutes_planned: f64,
    /// Minutes of its manoeuvres that the fitted trials contain.
    pub minutes_driven: f64,
    /// Its manoeuvres, in its order.
    pub manoeuvres: Vec<ManoeuvreOutcome>,
    /// The axes that it drives.
    pub axes: BTreeMap<Dof, AxisOutcome>,
    /// Its goals.
    pub goals: Vec<GoalOutcome>,
    /// What is still open: minutes that remain, and the next plan.
    pub open: Vec<String>,
    /// Doubts about the comparison.
    pub doubts: Vec<String>,
}

/// A manoeuvre of a plan, as the logs contain it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ManoeuvreOutcome {
    /// Its name in the plan.
    pub name: String,
    /// The axes that it drives.
    pub axes: Vec<Dof>,
    /// Minutes of the plan.
    pub minutes_planned: f64,
    /// Minutes of fitted trials in which the logged forces follow it.
    pub minutes_driven: f64,
    /// Where.
    pub stretches: Vec<DrivenStretch>,
    /// The logged forces there over those of the plan; absent if it was not driven.
    #[serde(default)]
    pub force_ratio: Option<f64>,
}

/// A stretch of a trial in which a manoeuvre was driven.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DrivenStretch {
    /// The trial.
    pub trial: String,
    /// Its start, in the trial's time, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
}

/// An axis that a plan drives.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisOutcome {
    /// Minutes of manoeuvres that drive it.
    pub minutes_planned: f64,
    /// Minutes of these that the logs contain.
    pub minutes_driven: f64,
    /// Least and greatest velocity of the plan, m/s or rad/s.
    pub velocity_planned: [f64; 2],
    /// Least and greatest velocity in all fitted trials: the first and the last percent are left
    /// out; absent where no trial measures it.
    #[serde(default)]
    pub velocity_reached: Option<[f64; 2]>,
}

/// A goal of a plan and its interval after the dive.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct GoalOutcome {
    /// The goal.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The value that the plan believed.
    pub believed: f64,
    /// The estimate; absent if the fit has no such number.
    #[serde(default)]
    pub value: Option<f64>,
    /// Half of the 95 % interval that the plan promised, for its own value.
    pub promised: f64,
    /// Half intervals between which the plan promised nine of ten vehicles that its prior allows.
    #[serde(default)]
    pub promised_range90: Option<[f64; 2]>,
    /// Half of the 95 % interval of the fit.
    #[serde(default)]
    pub obtained: Option<f64>,
    /// Half of the widest interval that meets the goal, for the estimate where there is one.
    pub wanted: f64,
    /// True if the interval of the fit meets the goal.
    pub is_met: bool,
}
