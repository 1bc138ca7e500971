//! A plant by one method.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    Coefficient, Correlation, Driven, Identifiability, MatrixResult, OnlineHistory, PlantScore,
    PrimeSystem, Score, TermDecision, ThrusterEstimate,
};
use crate::estimate::{Candidate, Filters, Innovations};
use crate::judge::Verdict;
use crate::plant::{Basis, Effect, Symmetry, name_of_axes, own_terms};
use crate::terms::Term;
use crate::{
    BetweenSamples, Caveat, Dof, Estimate, LumpedParameters, Method, Stability, ThrusterFault,
};

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

impl From<&Coefficient> for Parameter {
    fn from(coefficient: &Coefficient) -> Self {
        let Coefficient { value, std, low95, high95, unit, .. } = coefficient.clone();
        Self { value, std, low95, high95, unit }
    }
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
    /// Mass less that of the vehicle itself, if its rigid body is known or, of translations, its mass in air.
    #[serde(default)]
    pub added_mass: Option<Parameter>,
}

/// The plant of some axes by one method:
/// `M ν̇_r + C(M, ν_r) ν_r + D(ν_r) ν_r + … + g(η) = τ` with ν_r relative to the water; of one axis
/// `m v̇ + d_Q v|v| + d_L v + b = τ`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantResult {
    /// Its axes, in SNAME order: rows and columns of every matrix.
    pub axes: Vec<Dof>,
    /// The method of identification.
    pub method: Method,
    /// The axes that M may couple.
    pub symmetry: Symmetry,
    /// Its coefficients by name: `mass.surge`, `mass.surge-pitch`, `surge: |u|u`, `yaw: |v|r`,
    /// `weight-minus-buoyancy`, `lever.z`, and those of `effects`.
    pub parameters: BTreeMap<String, Coefficient>,
    /// Mass, drag by its own velocity and constant force of each axis, from `parameters`.
    pub by_axis: BTreeMap<Dof, Parameters>,
    /// Forces of rudders, fins, propellers of unknown strength and wind.
    #[serde(default)]
    pub effects: Vec<Effect>,
    /// M: rigid body plus added mass.
    pub mass_matrix: MatrixResult,
    /// M of the rigid body, if known.
    #[serde(default)]
    pub rigid_body_mass_matrix: Option<Vec<Vec<f64>>>,
    /// Added mass, if the rigid body is known.
    #[serde(default)]
    pub added_mass: Option<Vec<Vec<f64>>>,
    /// The matrix that multiplies ν_r; zero without a term.
    pub linear_damping: MatrixResult,
    /// The matrix that multiplies |ν|ν of each axis; zero without a term.
    pub quadratic_damping: MatrixResult,
    /// Correlations of the coefficients.
    pub correlation: Correlation,
    /// Fitted parameters of thrusters, water and instruments: lag, delay, currents by trial, disturbance
    /// and noise.
    pub nuisances: BTreeMap<String, Parameter>,
    /// Dimensionless coefficients, if the vehicle's length is known.
    #[serde(default)]
    pub nondimensional: Option<PrimeSystem>,
    /// Determination of the coefficients of several axes by the trials.
    #[serde(default)]
    pub identifiability: Option<Identifiability>,
    /// The candidates that were tested: terms, what thrusters and sensors may do, and what thrust may do
    /// between its logged samples, `smooth-speed` and `smooth-thrust`.
    #[serde(default)]
    pub structure: Vec<TermDecision>,
    /// Thrusters that were at rest or reversed in a trial, for which the fit allows.
    #[serde(default)]
    pub thruster_faults: Vec<ThrusterFault>,
    /// Pairs of thrusters of which each does what the log of the other says; they were taken to do so.
    #[serde(default)]
    pub thrusters_exchanged: Vec<[String; 2]>,
    /// What each thruster gives over what its curve says, where most others give what theirs say; without
    /// those of which the trials do not determine it.
    #[serde(default)]
    pub thruster_estimates: BTreeMap<String, ThrusterEstimate>,
    /// Number of measured values, or of rows of a regression.
    pub samples: usize,
    /// Log-likelihood at the optimum; absent for methods without one.
    #[serde(default)]
    pub log_likelihood: Option<f64>,
    /// What a fit of one axis alone has in addition.
    #[serde(default)]
    pub alone: Option<Alone>,
    /// Autocorrelation of the errors of one-step predictions, by fitted trial; empty for methods
    /// without them.
    #[serde(default)]
    pub innovations: Vec<Innovations>,
    /// Whiteness of innovations: Box–Pierce over 40 lags, divided by 40; 1 if they are white.
    /// Absent for methods without innovations.
    #[serde(default)]
    pub whiteness: Option<f64>,
    /// Parameters over time; absent for methods that are not recursive.
    #[serde(default)]
    pub history: Option<OnlineHistory>,
    /// Its error on the fitted trials, simulated in open loop.
    pub fit: PlantScore,
    /// Its error on unseen trials.
    #[serde(default)]
    pub hold_out: Option<PlantScore>,
    /// Without held-out trials: the error on fitted trials, or thirds of a single one, each
    /// predicted by a plant fitted to the others.
    #[serde(default)]
    pub left_out: Option<PlantScore>,
    /// The error, on the same trials, of a separate plant of each driven axis, for comparison: the
    /// difference is due to coupling.
    #[serde(default)]
    pub single_axes: BTreeMap<Dof, Score>,
    /// Range of motion and force on each axis in its trials; for a plant of several axes.
    #[serde(default)]
    pub driven: BTreeMap<Dof, Driven>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
    /// The verdict.
    #[serde(default)]
    pub verdict: Verdict,
    /// The verdict on each of several axes: a plant is doubtful if one of them is.
    #[serde(default)]
    pub verdicts: BTreeMap<Dof, Verdict>,
}

impl PlantResult {
    /// Creates a plant of some axes without coefficients, which are to be filled in.
    pub fn empty(axes: Vec<Dof>, method: Method) -> Self {
        let none = MatrixResult { value: Vec::new(), std: Vec::new() };
        Self {
            axes,
            method,
            symmetry: Symmetry::None,
            parameters: BTreeMap::new(),
            by_axis: BTreeMap::new(),
            effects: Vec::new(),
            mass_matrix: none.clone(),
            rigid_body_mass_matrix: None,
            added_mass: None,
            linear_damping: none.clone(),
            quadratic_damping: none,
            correlation: Correlation { names: Vec::new(), value: Vec::new() },
            nuisances: BTreeMap::new(),
            nondimensional: None,
            identifiability: None,
            structure: Vec::new(),
            thruster_faults: Vec::new(),
            thrusters_exchanged: Vec::new(),
            thruster_estimates: BTreeMap::new(),
            samples: 0,
            log_likelihood: None,
            alone: None,
            innovations: Vec::new(),
            whiteness: None,
            history: None,
            fit: PlantScore::default(),
            hold_out: None,
            left_out: None,
            single_axes: BTreeMap::new(),
            driven: BTreeMap::new(),
            caveats: Vec::new(),
            verdict: Verdict::default(),
            verdicts: BTreeMap::new(),
        }
    }

    /// Returns its name in results: its axes, joined by `-`.
    pub fn name(&self) -> String {
        name_of_axes(&self.axes)
    }

    /// Returns the first axis, which is that of a plant of one axis; surge if a file has none.
    pub fn first_axis(&self) -> Dof {
        self.axes.first().copied().unwrap_or(Dof::Surge)
    }

    /// Returns whether it is of one axis that was identified alone, with its lumped parameters.
    pub fn is_alone(&self) -> bool {
        self.alone.is_some()
    }

    /// Returns the error on fitted trials in an axis.
    pub fn fitted(&self, dof: Dof) -> Option<&Score> {
        self.fit.by_axis.get(&dof)
    }

    /// Returns the error on unseen trials in an axis.
    pub fn held_out(&self, dof: Dof) -> Option<&Score> {
        self.hold_out.as_ref()?.by_axis.get(&dof)
    }

    /// Returns what thrust was taken to do between its logged samples.
    pub fn between_samples(&self) -> BetweenSamples {
        let is_admitted = |candidate: &Candidate| {
            let is_of_it = |tried: &TermDecision| tried.candidate == candidate.name();
            self.structure.iter().any(|tried| tried.admitted && is_of_it(tried))
        };
        Candidate::between_samples(Candidate::ALL.into_iter().filter(is_admitted))
    }
}

/// What a fit of one axis alone has beyond a plant's coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Alone {
    /// The fitted terms.
    pub terms: Vec<Term>,
    /// True if the plant comes to rest without thrust.
    pub stable: bool,
    /// Type of its stability.
    pub stability: Stability,
    /// Lumped parameters.
    pub lumped: LumpedParameters,
    /// Standard deviations of the lumped parameters.
    pub lumped_std: LumpedParameters,
    /// The test for agreement with steady runs; absent without such runs.
    #[serde(default)]
    pub steady_test: Option<SteadyTestResult>,
    /// Share of uncertain thrust curves in the variances of mass and quadratic drag; absent if no
    /// curve has an uncertainty.
    #[serde(default)]
    pub thrust_part: Option<ThrustPart>,
    /// Statistics of the regression.
    pub regression: RegressionResult,
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
    /// Number of rows of the regression.
    pub samples: usize,
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

/// True values of an axis of a twin.
#[derive(Clone, Copy, Debug, PartialEq)]
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

impl TruePlant {
    /// Returns the values of an axis among coefficients by name, as in [`Results::truth`]; absent if it has no mass.
    ///
    /// [`Results::truth`]: super::Results::truth
    pub fn of(dof: Dof, truth: &BTreeMap<String, f64>) -> Option<Self> {
        let value = |(term, sign): (Basis, f64)| Some(sign * truth.get(&term.to_string())?);
        let [mass, quadratic_drag, linear_drag, bias_force] = own_terms(dof).map(value);
        Some(Self {
            mass: mass?,
            quadratic_drag: quadratic_drag.unwrap_or(0.0),
            linear_drag: linear_drag.unwrap_or(0.0),
            bias_force: bias_force.unwrap_or(0.0),
        })
    }

    /// Returns its coefficients by name.
    pub fn coefficients(&self, dof: Dof) -> [(String, f64); 4] {
        let values = [self.mass, self.quadratic_drag, self.linear_drag, self.bias_force];
        let terms = own_terms(dof);
        std::array::from_fn(|k| (terms[k].0.to_string(), terms[k].1 * values[k]))
    }
}

impl Parameters {
    /// Returns mass, drag by its own velocity and constant force of an axis among coefficients by name; absent without
    /// a mass.
    pub(crate) fn of(dof: Dof, coefficients: &BTreeMap<String, Coefficient>) -> Option<Self> {
        let own = |(term, sign): (Basis, f64)| {
            let Coefficient { value, std, low95, high95, unit, .. } =
                coefficients.get(&term.to_string())?;
            let (value, std, low95, high95) = (*value, *std, *low95, *high95);
            let estimate = Estimate { value, std, low95, high95 };
            Some(Parameter::new(estimate.times(sign), unit))
        };
        let [mass, quadratic_drag, linear_drag, bias_force] = own_terms(dof).map(own);
        Some(Self { mass: mass?, quadratic_drag, linear_drag, bias_force, added_mass: None })
    }

    /// Returns them with added mass, from the mass or inertia of the vehicle itself.
    pub(crate) fn with_dry(self, dry: f64) -> Self {
        let Parameter { value, std, low95, high95, unit } = self.mass.clone();
        let (value, low95, high95) = (value - dry, low95 - dry, high95 - dry);
        Self { added_mass: Some(Parameter { value, std, low95, high95, unit }), ..self }
    }

    /// Returns mass, drag by its own velocity and constant force of each axis among coefficients by name.
    pub fn by_axis(
        axes: &[Dof],
        coefficients: &BTreeMap<String, Coefficient>,
    ) -> BTreeMap<Dof, Self> {
        axes.iter().filter_map(|dof| Some((*dof, Self::of(*dof, coefficients)?))).collect()
    }
}
