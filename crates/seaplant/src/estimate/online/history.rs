//! History of the parameter estimates, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// History of the parameter estimates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OnlineHistory {
    /// Duration of the motion so far, s, over all fitted trials in sequence.
    pub time_s: Vec<f64>,
    /// Each parameter at these instants.
    pub parameters: BTreeMap<String, Vec<f64>>,
    /// Time, s of motion, after which each parameter stays within 5 % of its last value; absent if
    /// that is only within the last tenth.
    pub settled_s: BTreeMap<String, Option<f64>>,
    /// Smallest eigenvalue of the information at a unit diagonal: 1 if the parameters are
    /// determined independently of each other, 0 if some combination is not determined at all.
    pub excitation: f64,
    /// Detected changes of the plant.
    pub changes: Vec<PlantChanged>,
    /// Relative change of all masses at once that would have been detected within two minutes;
    /// absent where the motion is too short.
    pub noticeable_change: Option<f64>,
}

/// A detected change of the plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantChanged {
    /// The trial.
    pub trial: String,
    /// Estimated start, to the resolution of blocks of 15 s, s of the log.
    pub since_s: f64,
    /// Time of detection, s of the log.
    pub noticed_s: f64,
    /// Cumulative sum of the blocks' excess over the normal statistics, in standard deviations.
    pub statistic: f64,
}
