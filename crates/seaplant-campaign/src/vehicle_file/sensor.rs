//! Instruments.

use std::path::Path;

use schemars::JsonSchema;
use seaplant::{Sensor, Sensors, exact};
use serde::{Deserialize, Serialize};

use crate::Error;

/// The instruments.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SensorEntries {
    /// Doppler velocity log.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dvl: Option<DvlEntry>,
    /// Depth sensor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<PositionEntry>,
    /// Roll, pitch and heading.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub attitude: Option<AttitudeEntry>,
    /// Positioning antenna, beacon or marker.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<PositionEntry>,
    /// Accelerometer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuEntry>,
}

/// An accelerometer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ImuEntry {
    /// Its position, m, body frame.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw that rotate the vehicle's axes to the instrument's, deg.
    #[serde(deserialize_with = "exact::numbers")]
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample, m/s².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m_s2: Option<f64>,
    /// True if each logged sample is the mean since the one before; otherwise it is the value at
    /// its instant.
    pub averages: bool,
}

/// A Doppler velocity log.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DvlEntry {
    /// Its position, m, body frame.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// Roll, pitch, yaw that rotate the vehicle's axes to the instrument's, deg.
    #[serde(deserialize_with = "exact::numbers")]
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m_s: Option<f64>,
}

/// An instrument that measures position.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PositionEntry {
    /// Its position, m, body frame.
    #[serde(deserialize_with = "exact::numbers")]
    pub position_m: [f64; 3],
    /// Standard deviation of one sample, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_m: Option<f64>,
}

/// An instrument that measures attitude.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AttitudeEntry {
    /// Roll, pitch, yaw that rotate the vehicle's axes to the instrument's, deg.
    #[serde(deserialize_with = "exact::numbers")]
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample, deg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub std_deg: Option<f64>,
}

impl SensorEntries {
    /// Checks standard deviations: one of zero or less would give an instrument arbitrary weight.
    pub(super) fn check(&self, path: &Path) -> Result<(), Error> {
        let stated = [
            ("dvl.std_m_s", self.dvl.as_ref().and_then(|dvl| dvl.std_m_s)),
            ("depth.std_m", self.depth.as_ref().and_then(|depth| depth.std_m)),
            ("attitude.std_deg", self.attitude.as_ref().and_then(|attitude| attitude.std_deg)),
            ("position.std_m", self.position.as_ref().and_then(|position| position.std_m)),
            ("imu.std_m_s2", self.imu.as_ref().and_then(|imu| imu.std_m_s2)),
        ];
        for (key, std) in stated {
            if std.is_some_and(|std| !(std > 0.0 && std.is_finite())) {
                let reason = "must be a positive number; leave it out if it is not known";
                return Err(Error::value(path, format!("sensor.{key}"), reason));
            }
        }
        Ok(())
    }

    pub(super) fn into_sensors(self) -> Sensors {
        let sensor = |position_m: [f64; 3], rotation_deg: [f64; 3], std| Sensor {
            position_body: position_m.into(),
            rotation_rad: rotation_deg.map(f64::to_radians),
            std,
        };
        let (dvl, depth) = (self.dvl.unwrap_or_default(), self.depth.unwrap_or_default());
        let (attitude, position) =
            (self.attitude.unwrap_or_default(), self.position.unwrap_or_default());
        let (level, imu) = ([0.0; 3], self.imu.unwrap_or_default());
        Sensors {
            dvl: sensor(dvl.position_m, dvl.rotation_deg, dvl.std_m_s),
            depth: sensor(depth.position_m, level, depth.std_m),
            attitude: sensor(
                [0.0; 3],
                attitude.rotation_deg,
                attitude.std_deg.map(f64::to_radians),
            ),
            position: sensor(position.position_m, level, position.std_m),
            imu: sensor(imu.position_m, imu.rotation_deg, imu.std_m_s2),
            imu_averages: imu.averages,
        }
    }
}
