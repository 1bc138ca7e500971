//! Results of a plant of several axes, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Driven, Parameter, Part, Verdict};
use crate::estimate::Candidate;
use crate::judge::{NOT_WHITE, beyond, confirms};
use crate::plant::{Basis, Effect, EffectForce, Plant, Structure, Symmetry};
use crate::{BetweenSamples, Caveat, Dof, Error, Method, ThrusterFault};

/// A plant of several axes:
/// `M ν̇_r + C(M, ν_r) ν_r + D(ν_r) ν_r + … + g(η) = τ` with ν_r relative to the water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FittedPlant {
    /// Its axes, in SNAME order: rows and columns of every matrix.
    pub axes: Vec<Dof>,
    /// The method of identification.
    pub method: Method,
    /// The axes that M may couple.
    pub symmetry: Symmetry,
    /// Its coefficients by name: `mass.surge`, `mass.surge-pitch`, `yaw: |v|r`,
    /// `weight-minus-buoyancy`, `lever.z`, and those of `effects`.
    pub parameters: BTreeMap<String, Coefficient>,
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
    /// Currents by trial; disturbance and noise by axis.
    pub nuisances: BTreeMap<String, Parameter>,
    /// Dimensionless coefficients, if the vehicle's length is known.
    #[serde(default)]
    pub nondimensional: Option<PrimeSystem>,
    /// Determination of the coefficients by the trials.
    pub identifiability: Identifiability,
    /// The candidate terms that were tested, and what thrust may do between its logged samples, `smooth-speed` and
    /// `smooth-thrust`.
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
    /// Number of measured values.
    pub samples: usize,
    /// Log-likelihood at the optimum.
    pub log_likelihood: f64,
    /// Its error on the fitted trials, simulated in open loop.
    pub fit: PlantScore,
    /// Its error on unseen trials.
    #[serde(default)]
    pub hold_out: Option<PlantScore>,
    /// The error, on the same trials, of a separate plant of each driven axis, for comparison: the
    /// difference is due to coupling.
    #[serde(default)]
    pub single_axes: BTreeMap<Dof, AxisScore>,
    /// The verdict.
    #[serde(default)]
    pub verdict: Verdict,
    /// The verdict on each of its axes: a plant is doubtful if one of them is.
    #[serde(default)]
    pub verdicts: BTreeMap<Dof, Verdict>,
    /// Range of motion and force on each axis in its trials.
    #[serde(default)]
    pub driven: BTreeMap<Dof, Driven>,
    /// Caveats.
    pub caveats: Vec<Caveat>,
}

impl FittedPlant {
    /// Returns what thrust was taken to do between its logged samples.
    pub fn between_samples(&self) -> BetweenSamples {
        let is_admitted = |candidate: &Candidate| {
            let is_of_it = |tried: &TermDecision| tried.terms == [candidate.name()];
            self.structure.iter().any(|tried| tried.admitted && is_of_it(tried))
        };
        Candidate::between_samples(Candidate::ALL.into_iter().filter(is_admitted))
    }
}

/// A coefficient with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Coefficient {
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
    /// The axes on which it acts.
    pub on: Vec<Dof>,
    /// The source that determines it.
    pub told_by: ToldBy,
}

/// Coefficients in the prime system: forces over `½ρ L T U²`, moments over `½ρ L² T U²`, masses
/// over `½ρ L² T`, velocities over U and rates over U/L.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrimeSystem {
    /// L, m.
    pub length_m: f64,
    /// T, m: the draught, or L if no draught is stated.
    pub depth_m: f64,
    /// ρ, kg/m³.
    pub density_kg_m3: f64,
    /// U, m/s: the mean speed of the fitted trials. Coefficients of second degree are independent
    /// of it.
    pub speed_m_s: f64,
    /// Coefficients by name.
    pub coefficients: BTreeMap<String, PrimeCoefficient>,
}

/// A dimensionless coefficient.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrimeCoefficient {
    /// Symbol: `Y'_vvr`, with the sign of a force on the vehicle; `m22'` for a mass.
    pub symbol: String,
    /// The estimate.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Lower end of its 95 % interval.
    pub low95: f64,
    /// Upper end of its 95 % interval.
    pub high95: f64,
}

/// Source of a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ToldBy {
    /// The trials.
    Data,
    /// A physical limit: zero, or the rigid body.
    Limit,
    /// Neither: its interval is wider than its value.
    Nothing,
    /// The vehicle or campaign file, which fixes it.
    Stated,
}

/// A matrix with standard deviations, by row and column in the order of the axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MatrixResult {
    /// The values.
    pub value: Vec<Vec<f64>>,
    /// Their standard deviations; zero without a term.
    pub std: Vec<Vec<f64>>,
}

/// Correlations of coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Correlation {
    /// Names of rows and columns.
    pub names: Vec<String>,
    /// Correlations, −1 to 1.
    pub value: Vec<Vec<f64>>,
}

/// Determination of coefficients by trials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identifiability {
    /// Number of coefficients.
    pub coefficients: usize,
    /// Number of combinations that the motion determines.
    pub rank: usize,
    /// Variance inflation factors of the coefficients by collinearity.
    pub variance_inflation: BTreeMap<String, f64>,
    /// Coefficients with an interval wider than the value.
    pub not_told: Vec<String>,
}

/// A candidate term and the decision on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TermDecision {
    /// The term, or terms that are tested together.
    pub terms: Vec<String>,
    /// True if the plant includes it.
    pub admitted: bool,
    /// Twice the increase of log-likelihood.
    pub likelihood_ratio: f64,
    /// Probability of as large an increase by chance.
    pub p_value: f64,
}

/// The error of a plant on some trials, simulated in open loop.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlantScore {
    /// Over all trials.
    pub by_axis: BTreeMap<Dof, AxisScore>,
    /// By trial.
    pub trials: BTreeMap<String, BTreeMap<Dof, AxisScore>>,
}

/// The error of a plant on one axis; values are absent if the simulation diverges.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisScore {
    /// Mean |model − measured| of velocity, m/s or rad/s.
    pub mean_abs_error: Option<f64>,
    /// Mean |measured| of velocity, the error of a model that never moves.
    pub null_error: f64,
    /// Mean change of the model's velocity by a draw of the estimated disturbance, m/s or rad/s,
    /// which is the expected error of the true plant; includes the noise of velocities from
    /// differentiated positions.
    pub disturbance_error: Option<f64>,
    /// Mean |model − measured| of roll and pitch with the model restarted from the measured state
    /// every 10 s, rad/s: over a whole trial, an error of phase of these oscillations would
    /// dominate.
    pub restarted_error: Option<f64>,
    /// The same error of a constant rate from each restart.
    pub kept_error: Option<f64>,
    /// Changes of mass and drag that held-out trials support.
    pub change: Option<AxisChange>,
    /// 1 − Σ(model − measured)² / Σ(measured − mean)².
    pub r2: Option<f64>,
    /// Number of compared samples.
    pub samples: usize,
}

/// Changes of an axis that unseen trials support: a step of their likelihood from the plant, with
/// the estimated disturbances and a current for each trial.
///
/// Unlogged forces affect an open-loop simulation, but only widen these intervals.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisChange {
    /// Relative change of mass; its interval is that of a difference.
    pub mass: Part,
    /// Relative change of drag at the usual speed.
    pub drag: Part,
    /// Whiteness of the filter's innovations on them: Box and Pierce's statistic over 40 lags,
    /// divided by 40; 1 if they are white.
    pub whiteness: f64,
    /// Mean square of the innovations, normalised by their predicted variance: 1 if noise and
    /// disturbances are as in the fitted trials.
    pub surprise: f64,
}

/// Normalised mean square of innovations above which unmodelled forces act in unseen trials.
const SURPRISED: f64 = 1.5;

impl AxisChange {
    /// Returns whether unseen trials confirm mass and drag.
    pub(crate) fn vouches(&self) -> bool {
        confirms(self.mass, self.drag) && self.whiteness < NOT_WHITE && self.surprise < SURPRISED
    }

    /// Returns the significant change, relative to the tolerance of users, if it exceeds 1.
    pub(crate) fn beyond(&self) -> Option<f64> {
        Some(beyond(self.mass, self.drag)).filter(|parts| *parts > 1.0)
    }
}

/// Ratio of errors below which a restarted model is better than a constant rate.
const FOLLOWED: f64 = 0.5;

/// Ratio of the error to that of a disturbance, above which the disturbance does not explain it.
const DISTURBED: f64 = 1.5;

impl AxisScore {
    /// Returns whether the disturbance explains the error, which is then not evidence against the
    /// plant.
    pub(crate) fn is_of_disturbance(&self) -> bool {
        let both = self.mean_abs_error.zip(self.disturbance_error);
        both.is_some_and(|(error, disturbance)| error < DISTURBED * disturbance)
    }

    /// Returns whether held-out trials confirm the plant, regardless of the effect of unlogged
    /// forces on an open-loop simulation.
    pub(crate) fn is_vouched(&self) -> bool {
        self.change.is_some_and(|change| change.vouches())
    }

    /// Returns whether the plant predicts roll or pitch over some seconds, if not over a whole
    /// trial.
    pub(crate) fn is_followed(&self) -> bool {
        let both = self.restarted_error.zip(self.kept_error);
        both.is_some_and(|(error, kept)| error < FOLLOWED * kept)
    }
}

/// What the trials of a fit say of one thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ThrusterEstimate {
    /// Thrust over that of its curve, ahead and in reverse unless `reverse` differs.
    pub gain: Parameter,
    /// The same of thrust below zero, where the trials show that it is another.
    #[serde(default)]
    pub reverse: Option<Parameter>,
    /// Thrust over what its curve says ahead, with the scale of all thrust, where known forces reveal it.
    #[serde(default)]
    pub of_curve: Option<Parameter>,
    /// Whether the plant has these gains; else the trials do not ask for any, and `gain` is what they
    /// say of it to first order.
    pub is_fitted: bool,
}

/// Ratio of a thruster's thrust to that of its curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrusterGain {
    /// For positive thrust.
    pub forward: f64,
    /// For negative thrust.
    pub reverse: f64,
    /// Their standard deviations, both including that of the common scale.
    pub std: [f64; 2],
}

impl FittedPlant {
    /// Returns the gains of thrusters by name, if the plant has them.
    ///
    /// `1 + e` ahead and `1 + e + e_r` in reverse, with e the coefficient `NAME.excess-thrust` and
    /// e_r `NAME.excess-reverse-thrust`.
    pub fn thruster_gains(&self) -> BTreeMap<String, ThrusterGain> {
        let mut found: BTreeMap<String, [Option<&str>; 2]> = BTreeMap::new();
        for effect in &self.effects {
            if let EffectForce::Gain { thruster, reverse } = &effect.force {
                let places = found.entry(thruster.name.clone()).or_default();
                places[usize::from(*reverse)] = Some(&effect.name);
            }
        }
        let gain = |names: [Option<&str>; 2]| {
            let known = names.map(|name| self.parameters.get(name?));
            let [value, std] = [
                known.map(|x| x.map_or(0.0, |x| x.value)),
                known.map(|x| x.map_or(0.0, |x| x.std)),
            ];
            let cross = self.correlation_of(names) * std[0] * std[1];
            let in_reverse = std[0].powi(2) + std[1].powi(2) + 2.0 * cross;
            let forward = 1.0 + value[0];
            let std = [std[0], in_reverse.max(0.0).sqrt()];
            ThrusterGain { forward, reverse: forward + value[1], std }
        };
        found.into_iter().map(|(name, names)| (name, gain(names))).collect()
    }

    /// Returns the correlation of two coefficients; zero if one is absent.
    fn correlation_of(&self, names: [Option<&str>; 2]) -> f64 {
        let Correlation { names: all, value } = &self.correlation;
        let index = |name: Option<&str>| all.iter().position(|own| Some(own.as_str()) == name);
        let [i, j] = names.map(index);
        i.zip(j).and_then(|(i, j)| value.get(i)?.get(j).copied()).unwrap_or(0.0)
    }
}

/// Returns whether a term is the gain of a thruster.
pub(crate) fn is_gain(structure: &Structure, term: &Basis) -> bool {
    let Basis::Effect(k) = term else { return false };
    matches!(structure.effects()[*k].force, EffectForce::Gain { .. })
}

/// Creates a plant from results.
///
/// # Errors
/// [`Error::PlantTerm`] for an invalid term, [`Error::Plant`] for invalid coefficients.
pub fn plant_of_result(result: &FittedPlant) -> Result<Plant, Error> {
    let mut structure = Structure::of(&result.axes, result.symmetry)?;
    structure = structure.without(|term| !result.parameters.contains_key(&term.to_string()));
    for effect in &result.effects {
        structure = structure.with_effect(effect.clone(), true)?;
    }
    let known = structure.names();
    for name in result.parameters.keys().filter(|name| !known.contains(name)) {
        structure = structure.with(name.parse()?)?;
    }
    let value = |name: String| {
        result.parameters.get(&name).map(|x| x.value).ok_or_else(|| Error::Plant {
            axes: structure.name(),
            reason: format!("its results hold the effect `{name}` without a coefficient"),
        })
    };
    let coefficients = structure.names().into_iter().map(value).collect::<Result<_, _>>()?;
    Plant::new(structure, coefficients)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_oscillation_is_predicted_if_the_error_is_below_half_that_of_a_constant_rate() {
        let score = |restarted_error, kept_error| AxisScore {
            restarted_error,
            kept_error,
            ..AxisScore::default()
        };
        assert!(score(Some(0.04), Some(0.1)).is_followed());
        assert!(!score(Some(0.06), Some(0.1)).is_followed());
        // Only roll and pitch are restarted.
        assert!(!score(None, None).is_followed());
    }

    #[test]
    fn a_disturbance_explains_an_error_of_its_own_size() {
        let score = |disturbance_error| AxisScore {
            mean_abs_error: Some(0.1),
            disturbance_error,
            ..AxisScore::default()
        };
        assert!(score(Some(0.08)).is_of_disturbance());
        assert!(!score(Some(0.05)).is_of_disturbance());
        assert!(!score(None).is_of_disturbance());
    }
}
