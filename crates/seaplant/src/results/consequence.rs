//! Consequences of a plant, and the range of motion in its trials.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Dof;

/// A number that follows from a plant's coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Consequence {
    /// Name, with the force for which it holds.
    pub name: String,
    /// The axis.
    pub axis: Dof,
    /// The value.
    pub value: f64,
    /// Its 95 % interval; absent if the covariance is unknown, or if it is unbounded.
    pub interval95: Option<[f64; 2]>,
    /// Its unit.
    pub unit: String,
}

/// Range of motion and force on an axis in the trials of a plant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Driven {
    /// Greatest speed, m/s or rad/s.
    pub speed_max: f64,
    /// Greatest force, N or N m.
    pub force_max: f64,
}

impl Driven {
    /// Returns the greater of each.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            speed_max: self.speed_max.max(other.speed_max),
            force_max: self.force_max.max(other.force_max),
        }
    }
}
