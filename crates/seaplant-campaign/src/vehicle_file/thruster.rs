//! Thrusters.

use std::path::Path;

use schemars::JsonSchema;
use seaplant::results::InputFile;
use seaplant::{Caveat, CaveatCode, ThrustUncertainty, Thruster, exact};
use serde::{Deserialize, Serialize};

use super::{CurveEntry, VehicleFile};
use crate::preset::VehiclePreset;
use crate::{Error, toml_file};

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

/// Standard deviations of thrust, as parts of it: 0.05 for 5 %.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct UncertaintyEntry {
    /// Of positive thrust.
    pub forward: f64,
    /// Of negative thrust.
    pub reverse: f64,
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

impl VehicleFile {
    /// The thrusters of a known vehicle, as far as the file does not say otherwise, and then
    /// those that it adds.
    pub(super) fn entries(&self) -> Vec<ThrusterEntry> {
        let known = self.preset.map(VehiclePreset::thrusters).unwrap_or_default();
        let stated = |name: &str| self.thruster.iter().find(|entry| entry.name == name).cloned();
        let completed = known.iter().map(|known| {
            let stated = stated(known.name).unwrap_or_else(|| ThrusterEntry::called(known.name));
            ThrusterEntry {
                position_m: stated.position_m.or(Some(known.position_m)),
                direction: stated.direction.or(Some(known.direction)),
                ..stated
            }
        });
        let is_known = |entry: &&ThrusterEntry| known.iter().any(|known| known.name == entry.name);
        let added = self.thruster.iter().filter(|entry| !is_known(entry)).cloned();
        completed.chain(added).collect()
    }

    pub(super) fn thruster(
        &self,
        entry: &ThrusterEntry,
        path: &Path,
        inputs: &mut Vec<InputFile>,
    ) -> Result<Thruster, Error> {
        let lacks = |key: &str| {
            let reason = toml_file::missing(path, key);
            Error::value(path, format!("thruster `{}`", entry.name), reason)
        };
        let position_m = entry.position_m.ok_or_else(|| lacks("position_m"))?;
        let direction = entry.direction.ok_or_else(|| lacks("direction"))?;
        let direction = if entry.reversed { direction.map(|d| -d) } else { direction };
        let curve =
            entry.curve.as_ref().or(self.thruster_curve.as_ref()).ok_or_else(|| {
                match self.preset {
                    Some(_) => {
                        let reason =
                            "missing field `curve`\nadd it, or a thruster_curve for all thrusters";
                        Error::value(path, format!("thruster `{}`", entry.name), reason)
                    }
                    None => lacks("curve"),
                }
            })?;
        let (curve_entry, curve) = (curve, curve.read(path, &entry.name, inputs)?);
        let usual = curve_entry.usual_uncertainty();
        let UncertaintyEntry { forward, reverse } = entry.thrust_uncertainty.unwrap_or(usual);
        Thruster::new(&entry.name, position_m, direction, curve)
            .and_then(|t| match entry.azimuth_axis {
                Some(axis) => t.turned_about(axis),
                None => Ok(t),
            })
            .and_then(|t| t.with_uncertainty(ThrustUncertainty { forward, reverse }))
            .map_err(Error::model(path))
    }

    /// Thrusters that nobody measured on this vehicle.
    pub(super) fn caveat(&self) -> Option<Caveat> {
        let preset = self.preset?;
        let measured = |name: &str| {
            self.thruster.iter().any(|entry| entry.name == name && entry.position_m.is_some())
        };
        let assumed = preset.thrusters().iter().filter(|known| !measured(known.name)).count();
        let message = format!(
            "the positions of {assumed} thrusters are those of the preset {}, not measured, and moments \
             in roll, pitch and yaw depend on them: measure your vehicle and state position_m",
            preset.key()
        );
        (assumed > 0).then(|| Caveat::note(CaveatCode::PresetGeometry, message))
    }
}
