//! Thrusters.

use schemars::JsonSchema;
use seaplant::exact;
use serde::{Deserialize, Serialize};

use super::curve::{CurveEntry, UncertaintyEntry};

/// A thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ThrusterEntry {
    /// Its name in channels: `thruster.NAME.speed`.
    pub name: String,
    /// The point at which its force acts, m: x forward, y starboard, z down.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub position_m: Option<[f64; 3]>,
    /// The direction of positive thrust on the vehicle; any length but zero.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub direction: Option<[f64; 3]>,
    /// The axis about which `thruster.NAME.azimuth` turns it, by the right hand: [0, 0, 1] turns it
    /// to starboard; `direction` is that at zero azimuth.
    #[serde(
        default,
        deserialize_with = "exact::some_numbers",
        skip_serializing_if = "Option::is_none"
    )]
    pub azimuth_axis: Option<[f64; 3]>,
    /// True if positive input gives force against `direction`, as for motors that ArduPilot
    /// reverses (`MOT_1_DIRECTION` is -1).
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub reversed: bool,
    /// The curve from input to force.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<CurveEntry>,
    /// The uncertainty of its strength, propagated to mass and drag. Errors of the thrusters of one
    /// degree of freedom are assumed fully correlated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_uncertainty: Option<UncertaintyEntry>,
}

impl ThrusterEntry {
    /// Creates one with only a name.
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
