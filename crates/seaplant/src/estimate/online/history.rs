//! How parameters went to where they ended, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How parameters went to where they ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OnlineHistory {
    /// Motion so far, s, over all fitted trials in turn.
    pub time_s: Vec<f64>,
    /// Each parameter at these instants.
    pub parameters: BTreeMap<String, Vec<f64>>,
    /// When each came within 5 % of its last value to stay there, s of motion; absent if it had
    /// not before the last tenth.
    pub settled_s: BTreeMap<String, Option<f64>>,
    /// The least eigenvalue of the information at a unit diagonal: 1 if each parameter is
    /// determined by itself, 0 if some combination is not at all.
    pub excitation: f64,
    /// When the plant seemed to change.
    pub changes: Vec<PlantChanged>,
    /// By what part every mass would have had to change at once to be noticed within two minutes;
    /// absent where the motion is too short to tell.
    pub noticeable_change: Option<f64>,
}

/// A change of the plant that was noticed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantChanged {
    /// In which trial.
    pub trial: String,
    /// When it began, to blocks of 15 s, s of the log.
    pub since_s: f64,
    /// When it was noticed, s of the log.
    pub noticed_s: f64,
    /// The sum of what blocks exceed the usual by, in standard deviations.
    pub statistic: f64,
}
