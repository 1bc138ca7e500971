//! How a plant of one axis predicts.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ScoredMotion;
use crate::judge::{NullScore, PlantChange};

/// The error of a plant on some trials; what a diverging simulation has none of is absent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Score {
    /// What was compared: where no velocity was measured, e and R² are of acceleration, in means
    /// over half a second without the accelerometer's offset.
    #[serde(default)]
    pub quantity: ScoredMotion,
    /// e = mean |v_model − v| on raw velocity.
    pub mean_abs_error: Option<f64>,
    /// e of a model that never moves, or of one that never accelerates.
    pub null_error: f64,
    /// The best model without a plant; absent if a simulation diverged.
    #[serde(default)]
    pub best_null: Option<NullScore>,
    /// e with an initial velocity, a constant force and, in translations, a current fitted to each
    /// trial (of long ones, to each 150 s): what methods are compared by.
    #[serde(default)]
    pub offset_free_error: Option<f64>,
    /// The change of the plant that would make the errors least; absent where they do not determine it.
    #[serde(default)]
    pub change: Option<PlantChange>,
    /// 1 − Σ(v_model − v)² / Σ(v − mean v)², over all trials.
    pub r_squared: Option<f64>,
    /// Each trial.
    pub trials: Vec<TrialScore>,
}

/// The error of a plant on one trial.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrialScore {
    /// Which trial.
    pub trial: String,
    /// e = mean |v_model − v| on raw velocity; absent if the simulation diverged.
    pub mean_abs_error: Option<f64>,
    /// e of a model that never moves.
    pub null_error: f64,
    /// R² of velocity.
    pub r_squared: Option<f64>,
    /// R² of position, where position was measured.
    pub position_r_squared: Option<f64>,
    /// Mean |model − measured| of position, m or rad.
    pub position_mean_abs_error: Option<f64>,
    /// Samples compared.
    pub samples: usize,
}
