//! Drag from steady stretches.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Parameter;
use crate::Caveat;

/// Drag of one degree of freedom from steady stretches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SteadyResult {
    /// Each stretch.
    pub segments: Vec<SegmentResult>,
    /// The mean of the stretches' drags.
    pub mean_quadratic_drag: f64,
    /// Joint estimate of d_Q, with a bias force.
    pub quadratic_drag: Option<Parameter>,
    /// Joint estimate of the bias force.
    pub bias_force: Option<Parameter>,
    /// Pairs of opposite directions at one thrust.
    pub pairs: Vec<PairResult>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
}

/// One steady stretch.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SegmentResult {
    /// Name of the trial.
    pub trial: String,
    /// Its start, s.
    pub from_s: f64,
    /// Its end, s.
    pub to_s: f64,
    /// Mean force, N or N m.
    pub force: f64,
    /// Force as a fraction of the greatest of all stretches.
    pub force_part: f64,
    /// Mean velocity, m/s or rad/s.
    pub velocity: f64,
    /// Standard deviation of the mean velocity.
    pub velocity_std: f64,
    /// d_Q = τ / v|v|.
    pub quadratic_drag: Parameter,
    /// Mean absolute error e with the stretch's own drag.
    pub mean_abs_error: f64,
    /// Mean absolute error e with the joint drag and bias force.
    pub joint_error: Option<f64>,
}

/// Two steady stretches at one thrust in opposite directions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PairResult {
    /// The stretch with positive force.
    pub positive: String,
    /// The stretch with negative force.
    pub negative: String,
    /// The bias force that explains their difference.
    pub bias_force: Parameter,
}
