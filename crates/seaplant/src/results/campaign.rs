//! Thrusters, instruments and trials as used.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CurveResult, Parameter};
use crate::{Caveat, ClockOffset, Dof, Role};

/// A thruster as used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrusterResult {
    /// Its name.
    pub name: String,
    /// Point of application of thrust, m.
    pub position_m: [f64; 3],
    /// Unit vector of positive thrust.
    pub direction: [f64; 3],
    /// Input of its curve.
    pub input: String,
    /// Description of its curve.
    pub curve: String,
    /// Relative standard deviation of its coefficients ahead and in reverse; absent if not stated.
    #[serde(default)]
    pub thrust_std: Option<[f64; 2]>,
    /// Its curve; absent from older results.
    #[serde(default)]
    pub law: Option<CurveResult>,
}

/// A thrust curve fitted to bollard-pull data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BollardPullResult {
    /// File of the table.
    pub file: String,
    /// Unit of the measured input: rad/s or us.
    pub input_unit: String,
    /// The input of zero thrust.
    pub neutral: f64,
    /// Coefficient of positive thrust.
    pub forward: Option<Parameter>,
    /// Coefficient of negative thrust.
    pub reverse: Option<Parameter>,
    /// Half-width of the band around neutral without thrust.
    pub deadband: Option<Parameter>,
    /// Root mean square misfit, N.
    pub residual_rms: f64,
    /// 1 − Σ misfit² / Σ(thrust − mean)².
    pub r_squared: f64,
    /// The measured points, (input, N).
    pub points: Vec<(f64, f64)>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
}

/// An instrument as used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorResult {
    /// Name of the instrument.
    pub name: String,
    /// Position, m.
    pub position_m: [f64; 3],
    /// Roll, pitch and yaw of its alignment, deg.
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample.
    pub std: Option<f64>,
    /// Unit of the standard deviation.
    pub unit: String,
    /// Logging rate, Hz, if it was logged.
    pub rate_hz: Option<f64>,
}

/// A trial as used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialResult {
    /// Its name.
    pub name: String,
    /// Its role.
    pub role: Role,
    /// The files of its log.
    pub files: Vec<String>,
    /// The files with clocks corrected by an estimated offset.
    #[serde(default)]
    pub offsets: Vec<FileOffset>,
    /// Each degree of freedom that it excites.
    pub axes: BTreeMap<Dof, AxisResult>,
}

/// A file with a clock corrected to those of its trial's other files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FileOffset {
    /// Path in the campaign.
    pub file: String,
    /// The offset and its estimation.
    pub clock: ClockOffset,
}

/// One degree of freedom of a trial.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisResult {
    /// Its start, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
    /// Rate of the regression's grid, Hz.
    pub sample_hz: f64,
    /// Rate at which motion was measured, Hz.
    pub source_hz: f64,
    /// The measured quantity: velocity, position or acceleration.
    pub motion: String,
    /// Dominant frequency of force, Hz.
    pub dominant_hz: Option<f64>,
    /// Amplitude of force at that frequency, N or N m.
    pub dominant_amplitude: f64,
    /// Greatest force, N or N m.
    pub force_max: f64,
    /// Root mean square force, N or N m.
    pub force_rms: f64,
    /// Greatest speed, m/s or rad/s; absent if neither velocity nor position was measured.
    pub speed_max: Option<f64>,
    /// Root mean square velocity, m/s or rad/s; absent if neither velocity nor position was
    /// measured.
    pub speed_rms: Option<f64>,
    /// Stroke of the oscillation, amplitude of velocity times period, m or rad; for a steady run,
    /// the distance travelled.
    #[serde(default)]
    pub stroke: Option<f64>,
    /// Ratio of the stroke to the hull's size across it, if known.
    #[serde(default)]
    pub keulegan_carpenter: Option<f64>,
    /// Duration of gaps without samples, s.
    pub gap_s: f64,
}
