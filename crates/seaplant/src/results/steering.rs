//! Models of steering, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Parameter;
use crate::Caveat;
use crate::estimate::RudderLaw;

/// Nomoto's model of yaw rate as a response to a rudder: `T ṙ + r + α r³ = K (δ − δ₀)`, or `T₁T₂
/// r̈ + (T₁ + T₂) ṙ + r + α r³ = K (δ − δ₀ + T₃ δ̇)`; with `rudder_law` `sine`, `½ sin 2δ` instead
/// of δ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NomotoResult {
    /// The rudder.
    pub rudder: String,
    /// First or second order.
    pub order: u8,
    /// The function of δ that explains more.
    pub rudder_law: RudderLaw,
    /// K.
    pub gain: Parameter,
    /// T, or T₁ + T₂ − T₃.
    pub time: Parameter,
    /// The times of the second order.
    pub second: Option<SecondOrder>,
    /// α, if r³ is significant.
    pub cubic: Option<Parameter>,
    /// δ₀: the angle of a straight course.
    pub neutral_angle: Parameter,
    /// True if a straight course is stable.
    pub is_stable: bool,
    /// R² of yaw rate on the fitted trials, simulated in open loop from their start.
    pub fit_r2: f64,
    /// R² on held-out trials, by trial, each from the initial state of best fit, as for the fitted
    /// ones; null for a trial that diverges.
    pub hold_out_r2: BTreeMap<String, Option<f64>>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
}

/// Times of the second order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SecondOrder {
    /// T₁ + T₂.
    pub time_sum: Parameter,
    /// T₁ T₂.
    pub time_product: Parameter,
    /// T₃.
    pub zero_time: Parameter,
}
