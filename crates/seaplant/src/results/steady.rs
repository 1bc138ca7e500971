//! Drag from steady stretches.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Parameter;
use crate::Caveat;

/// What steady stretches say of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SteadyResult {
    /// Every stretch by itself.
    pub segments: Vec<SegmentResult>,
    /// The mean of the stretches' drags.
    pub mean_quadratic_drag: f64,
    /// d_Q of all together, beside a bias force.
    pub quadratic_drag: Option<Parameter>,
    /// Bias force of all together.
    pub bias_force: Option<Parameter>,
    /// Up and down at one thrust.
    pub pairs: Vec<PairResult>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
}

/// One steady stretch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentResult {
    /// Which trial.
    pub trial: String,
    /// Its start, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
    /// Mean force, N or N m.
    pub force: f64,
    /// Force as a part of the greatest of all stretches.
    pub force_part: f64,
    /// Mean velocity, m/s or rad/s.
    pub velocity: f64,
    /// Standard deviation of that mean.
    pub velocity_std: f64,
    /// d_Q = τ / v|v|.
    pub quadratic_drag: Parameter,
    /// e with the stretch's own drag.
    pub mean_abs_error: f64,
    /// e with the joint drag and bias force.
    pub joint_error: Option<f64>,
}

/// Two steady stretches at one thrust, one each way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PairResult {
    /// The stretch with positive force.
    pub positive: String,
    /// The stretch with negative force.
    pub negative: String,
    /// The bias force that explains their difference.
    pub bias_force: Parameter,
}
