//! A plant of one axis by one method.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{OnlineHistory, Score};
use crate::estimate::{Decision, Filters, Innovations};
use crate::judge::Verdict;
use crate::terms::Term;
use crate::{Caveat, Dof, Estimate, LumpedParameters, Method, Stability};

/// A parameter with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// The estimate.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Lower end of its 95 % interval.
    pub low95: f64,
    /// Upper end of its 95 % interval.
    pub high95: f64,
    /// Its unit.
    pub unit: String,
}

impl Parameter {
    /// An estimate with its unit.
    pub fn new(estimate: Estimate, unit: &str) -> Self {
        let Estimate { value, std, low95, high95 } = estimate;
        Self { value, std, low95, high95, unit: unit.to_owned() }
    }
}

/// The parameters of `τ = m v̇ + d_Q v|v| + d_L v + b`; absent if not fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameters {
    /// Rigid-body plus added mass.
    pub mass: Parameter,
    /// d_Q.
    pub quadratic_drag: Option<Parameter>,
    /// d_L.
    pub linear_drag: Option<Parameter>,
    /// b.
    pub bias_force: Option<Parameter>,
}

/// One method's plant of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantResult {
    /// How it was found.
    pub method: Method,
    /// The terms that were fitted.
    pub terms: Vec<Term>,
    /// Whether the plant comes to rest by itself.
    pub stable: bool,
    /// In which way it does or does not.
    pub stability: Stability,
    /// Physical parameters.
    pub parameters: Parameters,
    /// Lumped parameters.
    pub lumped: LumpedParameters,
    /// Standard deviations of the lumped parameters.
    pub lumped_std: LumpedParameters,
    /// Correlations of `[m, d_Q, d_L, b]`.
    pub correlation: [[f64; 4]; 4],
    /// Parameters of the thrusters and the water that were fitted beside the plant.
    pub nuisances: BTreeMap<String, Parameter>,
    /// Why the model has the parts that it has.
    #[serde(default)]
    pub structure: Vec<Decision>,
    /// Whether steady runs agree with it; absent where there were none to fit.
    #[serde(default)]
    pub steady_test: Option<SteadyTestResult>,
    /// The part of the variances of mass and quadratic drag that uncertain thrust curves
    /// make; absent if no curve has an uncertainty.
    #[serde(default)]
    pub thrust_part: Option<ThrustPart>,
    /// How the errors of one-step predictions follow each other, by fitted trial; empty of methods
    /// that make none.
    #[serde(default)]
    pub innovations: Vec<Innovations>,
    /// How the parameters went there; absent of methods that do not work sample by sample.
    #[serde(default)]
    pub history: Option<OnlineHistory>,
    /// How the fit went.
    pub regression: RegressionResult,
    /// Its error on the trials that it was fitted to.
    pub fit: Score,
    /// Its error on trials that it had not seen.
    pub hold_out: Option<Score>,
    /// Where no trial was held out: the error on fitted trials, or thirds of a single one, each
    /// predicted by a plant that was fitted to the others.
    #[serde(default)]
    pub left_out: Option<Score>,
    /// How white innovations are: Box–Pierce over 40 lags, divided by 40; 1 if they are. Absent
    /// of methods that make none.
    #[serde(default)]
    pub whiteness: Option<f64>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
    /// What to make of it.
    #[serde(default)]
    pub verdict: Verdict,
}

/// The plant that equation error finds of a record in shards: not scored, for nobody has the
/// record in one piece.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccumulatedPlant {
    /// Which degree of freedom.
    pub dof: Dof,
    /// The terms that were fitted.
    pub terms: Vec<Term>,
    /// Physical parameters.
    pub parameters: Parameters,
    /// Lumped parameters.
    pub lumped: LumpedParameters,
    /// How the fit went.
    pub regression: RegressionResult,
    /// Doubts.
    pub caveats: Vec<Caveat>,
}

/// Whether runs at constant thrust ask for the plant that other trials ask for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SteadyTestResult {
    /// Twice what the log-likelihood gains if the two may differ.
    pub likelihood_ratio: f64,
    /// How many numbers may then differ.
    pub numbers: usize,
    /// How often chance alone would make as large a gain.
    pub p_value: f64,
    /// Whether they agree, and steady runs are part of the fit.
    pub agrees: bool,
    /// The plant of unsteady trials, if the two may differ.
    pub unsteady: Parameters,
    /// The plant of steady runs, of the same mass.
    pub steady: Parameters,
}

/// Parts of variances, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrustPart {
    /// Of the mass.
    pub mass: f64,
    /// Of quadratic drag; absent if it was not fitted.
    pub quadratic_drag: Option<f64>,
}

/// How a regression went.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegressionResult {
    /// Rows.
    pub samples: usize,
    /// Rows that would say as much if they were independent.
    pub effective_samples: f64,
    /// Condition number of the columns at unit length.
    pub condition: f64,
    /// Variance inflation of each fitted term but the bias.
    pub variance_inflation: BTreeMap<Term, f64>,
    /// Root mean square of what was minimised: of equation errors, m/s² or rad/s², by SRIV
    /// m/s or rad/s; of output errors, in the unit of what was measured.
    pub residual_rms: f64,
    /// The filters that were used.
    pub filters: Filters,
}

/// The recommended method with one choice of terms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SubsetResult {
    /// The terms.
    pub terms: Vec<Term>,
    /// The parameters.
    pub lumped: LumpedParameters,
    /// Whether the plant comes to rest by itself.
    pub stable: bool,
    /// e on the fitted trials.
    pub fit_error: Option<f64>,
    /// e on held-out trials.
    pub hold_out_error: Option<f64>,
    /// Condition number of the scaled columns.
    pub condition: f64,
}

/// True values of a twin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TruePlant {
    /// kg or kg m².
    pub mass: f64,
    /// N/(m/s)² or N m/(rad/s)².
    pub quadratic_drag: f64,
    /// N/(m/s) or N m/(rad/s).
    pub linear_drag: f64,
    /// N or N m.
    pub bias_force: f64,
}
