//! What follows from a plant, and how far it was driven.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Dof;

/// A number that follows from a plant's coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Consequence {
    /// What it is, and under which force.
    pub name: String,
    /// Of which axis.
    pub axis: Dof,
    /// The number.
    pub value: f64,
    /// Its 95 % interval; absent if the covariance is not known, or leaves it open.
    pub interval95: Option<[f64; 2]>,
    /// Its unit.
    pub unit: String,
}

/// How far an axis was driven in the trials that a plant was identified from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Driven {
    /// Greatest speed, m/s or rad/s.
    pub speed_max: f64,
    /// Greatest force, N or N m.
    pub force_max: f64,
}

impl Driven {
    /// The wider of two.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            speed_max: self.speed_max.max(other.speed_max),
            force_max: self.force_max.max(other.force_max),
        }
    }
}
