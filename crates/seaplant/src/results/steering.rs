//! Models of steering, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Parameter;
use crate::Caveat;
use crate::estimate::RudderLaw;

/// Nomoto's model of how yaw rate follows a rudder:
/// `T ṙ + r + α r³ = K (δ − δ₀)`, or
/// `T₁T₂ r̈ + (T₁ + T₂) ṙ + r + α r³ = K (δ − δ₀ + T₃ δ̇)`; by `rudder_law` `sine` with `½ sin 2δ`
/// in the place of δ.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NomotoResult {
    /// The rudder.
    pub rudder: String,
    /// First or second order.
    pub order: u8,
    /// What stands for δ: the law that explains more.
    pub rudder_law: RudderLaw,
    /// K.
    pub gain: Parameter,
    /// T, or T₁ + T₂ − T₃.
    pub time: Parameter,
    /// The times of the second order.
    pub second: Option<SecondOrder>,
    /// α, where r³ explains more.
    pub cubic: Option<Parameter>,
    /// δ₀: the angle that keeps the course.
    pub neutral_angle: Parameter,
    /// Whether a straight course is kept.
    pub is_stable: bool,
    /// R² of yaw rate on the trials that it was fitted to, simulated freely from their start.
    pub fit_r2: f64,
    /// The same on held-out trials, by trial, from the start of each that fits it best, as that of
    /// the fitted ones; none of one in which it runs away.
    pub hold_out_r2: BTreeMap<String, Option<f64>>,
    /// Doubts.
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
