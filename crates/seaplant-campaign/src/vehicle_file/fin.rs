//! Rudders, fins and areas exposed to wind.

use std::path::Path;

use schemars::JsonSchema;
use seaplant::plant::RudderFlow;
use seaplant::{Fin, Surface, Windage, exact};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::campaign_file::EstimateWord;

/// A rudder or fin.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FinEntry {
    /// Its name in channels: `rudder.NAME.angle`, `fin.NAME.angle`.
    pub name: String,
    /// The point at which its force acts, m: x forward, y starboard, z down.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// Its axis: a positive angle turns its leading edge about this by the right hand. [0, 0, -1]
    /// is a rudder whose positive angle turns the bow to starboard.
    #[serde(deserialize_with = "exact::numbers")]
    pub axis: [f64; 3],
    /// Its area, m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area_m2: Option<f64>,
    /// `∂C_L/∂α`, 1/rad; estimated if it is left out or `\"estimate\"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lift_slope: Option<LiftEntry>,
    /// The angle of attack at which lift stops growing, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stall_deg: Option<f64>,
    /// The greatest rudder angle, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_deg: Option<f64>,
    /// The thruster in whose race it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slipstream: Option<String>,
    /// Known effects of hull and race on its flow: behind a thruster whose curve is `open-water`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flow: Option<FlowEntry>,
}

/// The flow at a rudder behind a ship, by the MMG standard method.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowEntry {
    /// ε: `(1 − w_R)/(1 − w_P)`.
    pub wake_ratio: f64,
    /// κ: fraction of the race's increase of speed that is reached at the rudder.
    pub race_factor: f64,
    /// η: the propeller's diameter over the rudder's span.
    pub diameter_to_span: f64,
    /// γ_R: one number, or two, for flow at the rudder from starboard and from port.
    pub straightening: StraighteningEntry,
    /// l_R: the x at which the sideways flow is that of the hull, m.
    pub flow_at_m: f64,
    /// t_R: the fraction of the rudder's drag that the hull recovers.
    #[serde(default)]
    pub steering_deduction: f64,
    /// a_H: the hull's contribution to the rudder's side force, as a fraction of it.
    #[serde(default)]
    pub hull_increase: f64,
    /// x_H: the x at which it acts, m; 0 if there is none.
    #[serde(default)]
    pub hull_at_m: f64,
}

/// Flow straightening of both sides, or of each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, or two: [from starboard, from port]")]
pub enum StraighteningEntry {
    /// For both sides.
    Both(f64),
    /// For flow from starboard, and for flow from port.
    Each([f64; 2]),
}

impl FlowEntry {
    pub(super) fn flow(self) -> RudderFlow {
        let straightening = match self.straightening {
            StraighteningEntry::Both(x) => [x; 2],
            StraighteningEntry::Each(each) => each,
        };
        RudderFlow {
            wake_ratio: self.wake_ratio,
            race_factor: self.race_factor,
            diameter_to_span: self.diameter_to_span,
            straightening,
            flow_at_m: self.flow_at_m,
            steering_deduction: self.steering_deduction,
            hull_increase: self.hull_increase,
            hull_at_m: self.hull_at_m,
        }
    }
}

/// A lift slope, or `"estimate"`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a lift slope in 1/rad or \"estimate\"")]
pub enum LiftEntry {
    /// A number, 1/rad.
    Stated(f64),
    /// Estimated from the trials.
    Told(EstimateWord),
}

impl FinEntry {
    pub(super) fn fin(&self, kind: Surface, path: &Path) -> Result<Fin, Error> {
        let lift_slope = match self.lift_slope {
            Some(LiftEntry::Stated(slope)) => Some(slope),
            Some(LiftEntry::Told(_)) | None => None,
        };
        let fin = Fin::new(kind, &self.name, self.position_m, self.axis).and_then(|fin| {
            Fin {
                area_m2: self.area_m2,
                lift_slope,
                stall_rad: self.stall_deg.map(f64::to_radians),
                limit_rad: self.limit_deg.map(f64::to_radians),
                slipstream: self.slipstream.clone(),
                flow: self.flow.map(FlowEntry::flow),
                ..fin
            }
            .checked()
        });
        fin.map_err(Error::model(path))
    }
}

/// Areas exposed to wind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct WindEntry {
    /// Area above the water from ahead, m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frontal_area_m2: Option<f64>,
    /// Area above the water from the side, m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lateral_area_m2: Option<f64>,
    /// Length over all, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length_m: Option<f64>,
}

impl WindEntry {
    pub(super) fn windage(&self, path: &Path) -> Result<Windage, Error> {
        let Self { frontal_area_m2, lateral_area_m2, length_m } = *self;
        let all = [
            ("frontal_area_m2", frontal_area_m2),
            ("lateral_area_m2", lateral_area_m2),
            ("length_m", length_m),
        ];
        let wrong = all.iter().find(|(_, x)| x.is_some_and(|x| !(x > 0.0 && x.is_finite())));
        if let Some((key, _)) = wrong {
            let reason = "must be a positive number; leave it out if it is not known";
            return Err(Error::value(path, format!("wind.{key}"), reason));
        }
        Ok(Windage { frontal_area_m2, lateral_area_m2, length_m })
    }
}
