//! Thrusters.

use schemars::JsonSchema;
use seaplant::exact;
use serde::{Deserialize, Serialize};

use super::curve::{CurveEntry, UncertaintyEntry};

/// A thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThrusterEntry {
    /// How channels call it: `thruster.NAME.speed`.
    pub name: String,
    /// Where it pushes, m: x forward, y starboard, z down.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub position_m: Option<[f64; 3]>,
    /// The way that positive thrust pushes the vehicle; any length but zero.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub direction: Option<[f64; 3]>,
    /// What `thruster.NAME.azimuth` turns it about, by the right hand: [0, 0, 1] turns it to
    /// starboard; `direction` is that at zero azimuth.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub azimuth_axis: Option<[f64; 3]>,
    /// Whether positive input pushes against `direction`, as of motors that ArduPilot reverses
    /// (`MOT_1_DIRECTION` is -1).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reversed: bool,
    /// From input to force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<CurveEntry>,
    /// How well its strength is known; carried into mass and drag. Thrusters of one degree of
    /// freedom are taken to be off together.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_uncertainty: Option<UncertaintyEntry>,
}

impl ThrusterEntry {
    /// One of which nothing but the name is said.
    pub(super) fn called(name: &str) -> Self {
        let name = name.to_owned();
        Self {
            name,
            position_m: None,
            direction: None,
            azimuth_axis: None,
            reversed: false,
            curve: None,
            thrust_uncertainty: None,
        }
    }
}
