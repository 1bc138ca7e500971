//! Thrusters, instruments and trials as they were used.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{CurveResult, Parameter};
use crate::{Caveat, ClockOffset, Dof, Role};

/// A thruster as it was used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrusterResult {
    /// Its name.
    pub name: String,
    /// Where it pushes, m.
    pub position_m: [f64; 3],
    /// Unit vector of positive thrust.
    pub direction: [f64; 3],
    /// What its curve reads.
    pub input: String,
    /// Its curve in words.
    pub curve: String,
    /// Standard deviation of its strength ahead and in reverse, as parts of it; absent if
    /// nothing was said.
    #[serde(default)]
    pub thrust_std: Option<[f64; 2]>,
    /// Its curve in numbers; absent of results that were written without them.
    #[serde(default)]
    pub law: Option<CurveResult>,
}

/// A thrust curve fitted to bollard-pull data.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BollardPullResult {
    /// The table's file.
    pub file: String,
    /// The input that was measured: rad/s or us.
    pub input_unit: String,
    /// The input that means stop.
    pub neutral: f64,
    /// Coefficient of positive thrust.
    pub forward: Option<Parameter>,
    /// Coefficient of negative thrust.
    pub reverse: Option<Parameter>,
    /// Input that gives no thrust yet.
    pub deadband: Option<Parameter>,
    /// Root mean square misfit, N.
    pub residual_rms: f64,
    /// 1 − Σ misfit² / Σ(thrust − mean)².
    pub r_squared: f64,
    /// The measured points, (input, N).
    pub points: Vec<(f64, f64)>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
}

/// An instrument as it was used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorResult {
    /// Which.
    pub name: String,
    /// Where it sits, m.
    pub position_m: [f64; 3],
    /// How it is turned, deg.
    pub rotation_deg: [f64; 3],
    /// Standard deviation of one sample.
    pub std: Option<f64>,
    /// Unit of that.
    pub unit: String,
    /// The rate at which it was logged, Hz, where it was.
    pub rate_hz: Option<f64>,
}

/// A trial as it was used.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialResult {
    /// Its name.
    pub name: String,
    /// What it was for.
    pub role: Role,
    /// The files that it was read from.
    pub files: Vec<String>,
    /// The files whose clocks were moved by an estimated offset.
    #[serde(default)]
    pub offsets: Vec<FileOffset>,
    /// Each degree of freedom that it exercises.
    pub axes: BTreeMap<Dof, AxisResult>,
}

/// A file whose clock was moved to those of its trial's other files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FileOffset {
    /// Which, as the campaign names it.
    pub file: String,
    /// By how much, and how that was found.
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
    /// Whether motion was measured as velocity, as position or as acceleration.
    pub motion: String,
    /// Frequency at which force is greatest, Hz.
    pub dominant_hz: Option<f64>,
    /// Amplitude of force there, N or N m.
    pub dominant_amplitude: f64,
    /// Greatest force, N or N m.
    pub force_max: f64,
    /// Root mean square force, N or N m.
    pub force_rms: f64,
    /// Greatest speed, m/s or rad/s; absent where neither velocity nor position was measured.
    pub speed_max: Option<f64>,
    /// Root mean square velocity, m/s or rad/s; absent likewise.
    pub speed_rms: Option<f64>,
    /// How far it oscillates, amplitude of velocity times period, m or rad; of a steady
    /// run, all its way.
    #[serde(default)]
    pub stroke: Option<f64>,
    /// The stroke over the size of the hull across it, where that is known.
    #[serde(default)]
    pub keulegan_carpenter: Option<f64>,
    /// Seconds left out for want of samples.
    pub gap_s: f64,
}
