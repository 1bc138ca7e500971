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
    /// Creates a parameter from an estimate and its unit.
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

/// The plant of one degree of freedom by one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantResult {
    /// The method of identification.
    pub method: Method,
    /// The fitted terms.
    pub terms: Vec<Term>,
    /// True if the plant comes to rest without thrust.
    pub stable: bool,
    /// Type of its stability.
    pub stability: Stability,
    /// Physical parameters.
    pub parameters: Parameters,
    /// Lumped parameters.
    pub lumped: LumpedParameters,
    /// Standard deviations of the lumped parameters.
    pub lumped_std: LumpedParameters,
    /// Correlations of `[m, d_Q, d_L, b]`.
    pub correlation: [[f64; 4]; 4],
    /// Fitted parameters of the thrusters and the water in addition to the plant.
    pub nuisances: BTreeMap<String, Parameter>,
    /// Decisions on the candidate terms of the model.
    #[serde(default)]
    pub structure: Vec<Decision>,
    /// The test for agreement with steady runs; absent without such runs.
    #[serde(default)]
    pub steady_test: Option<SteadyTestResult>,
    /// Share of uncertain thrust curves in the variances of mass and quadratic drag; absent if no
    /// curve has an uncertainty.
    #[serde(default)]
    pub thrust_part: Option<ThrustPart>,
    /// Autocorrelation of the errors of one-step predictions, by fitted trial; empty for methods
    /// without them.
    #[serde(default)]
    pub innovations: Vec<Innovations>,
    /// Parameters over time; absent for methods that are not recursive.
    #[serde(default)]
    pub history: Option<OnlineHistory>,
    /// Statistics of the regression.
    pub regression: RegressionResult,
    /// Its error on the fitted trials.
    pub fit: Score,
    /// Its error on unseen trials.
    pub hold_out: Option<Score>,
    /// Without held-out trials: the error on fitted trials, or thirds of a single one, each
    /// predicted by a plant fitted to the others.
    #[serde(default)]
    pub left_out: Option<Score>,
    /// Whiteness of innovations: Box–Pierce over 40 lags, divided by 40; 1 if they are white.
    /// Absent for methods without innovations.
    #[serde(default)]
    pub whiteness: Option<f64>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
    /// The verdict.
    #[serde(default)]
    pub verdict: Verdict,
}

/// The plant by equation error of a record in shards; it has no score, as the whole record is not
/// available.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AccumulatedPlant {
    /// The degree of freedom.
    pub dof: Dof,
    /// The fitted terms.
    pub terms: Vec<Term>,
    /// Physical parameters.
    pub parameters: Parameters,
    /// Lumped parameters.
    pub lumped: LumpedParameters,
    /// Statistics of the regression.
    pub regression: RegressionResult,
    /// Caveats.
    pub caveats: Vec<Caveat>,
}

/// Test for agreement of steady runs with other trials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SteadyTestResult {
    /// Twice the increase of log-likelihood if the two may differ.
    pub likelihood_ratio: f64,
    /// Number of parameters that may then differ.
    pub numbers: usize,
    /// Probability of as large an increase by chance.
    pub p_value: f64,
    /// True if they agree, and steady runs are part of the fit.
    pub agrees: bool,
    /// The plant of unsteady trials, if the two may differ.
    pub unsteady: Parameters,
    /// The plant of steady runs, with the same mass.
    pub steady: Parameters,
}

/// Fractions of variances, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrustPart {
    /// That of mass.
    pub mass: f64,
    /// That of quadratic drag; absent if it was not fitted.
    pub quadratic_drag: Option<f64>,
}

/// Statistics of a regression.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegressionResult {
    /// Number of rows.
    pub samples: usize,
    /// Equivalent number of independent rows.
    pub effective_samples: f64,
    /// Condition number of the columns, scaled to unit length.
    pub condition: f64,
    /// Variance inflation of each fitted term except the bias.
    pub variance_inflation: BTreeMap<Term, f64>,
    /// Root mean square of the residuals: of equation errors, m/s² or rad/s²;
    /// of output errors, in the unit of the measurement.
    pub residual_rms: f64,
    /// The filters.
    pub filters: Filters,
}

/// The plant of the recommended method for a subset of terms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SubsetResult {
    /// The terms.
    pub terms: Vec<Term>,
    /// The parameters.
    pub lumped: LumpedParameters,
    /// True if the plant comes to rest without thrust.
    pub stable: bool,
    /// Mean absolute error e on the fitted trials.
    pub fit_error: Option<f64>,
    /// Mean absolute error e on held-out trials.
    pub hold_out_error: Option<f64>,
    /// Condition number of the scaled columns.
    pub condition: f64,
}

/// True values of a twin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TruePlant {
    /// Rigid-body plus added mass, kg or kg m².
    pub mass: f64,
    /// d_Q, N/(m/s)² or N m/(rad/s)².
    pub quadratic_drag: f64,
    /// d_L, N/(m/s) or N m/(rad/s).
    pub linear_drag: f64,
    /// b, N or N m.
    pub bias_force: f64,
}
