//! What was found of a plant of several axes, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Driven, Parameter, Part, Verdict};
use crate::judge::{NOT_WHITE, beyond, confirms};
use crate::plant::{Basis, Effect, EffectForce, Plant, Structure, Symmetry};
use crate::{Caveat, Dof, Error, Method, ThrusterFault};

/// A plant of several axes:
/// `M ν̇_r + C(M, ν_r) ν_r + D(ν_r) ν_r + … + g(η) = τ` with ν_r relative to the water.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CoupledPlant {
    /// Its axes, in SNAME order: rows and columns of every matrix.
    pub axes: Vec<Dof>,
    /// How it was found.
    pub method: Method,
    /// Which axes M may couple.
    pub symmetry: Symmetry,
    /// Its coefficients by name: `mass.surge`, `mass.surge-pitch`, `yaw: |v|r`,
    /// `weight-minus-buoyancy`, `lever.z`, and those of `effects`.
    pub parameters: BTreeMap<String, Coefficient>,
    /// Forces of rudders, fins, propellers of unknown strength and wind.
    #[serde(default)]
    pub effects: Vec<Effect>,
    /// M: rigid body plus added mass.
    pub mass_matrix: MatrixResult,
    /// M of the dry vehicle, where that is known.
    #[serde(default)]
    pub rigid_body_mass_matrix: Option<Vec<Vec<f64>>>,
    /// What the water adds, where the dry vehicle is known.
    #[serde(default)]
    pub added_mass: Option<Vec<Vec<f64>>>,
    /// What multiplies ν_r; zero where no term is.
    pub linear_damping: MatrixResult,
    /// What multiplies |ν|ν of each axis; zero where no term is.
    pub quadratic_damping: MatrixResult,
    /// Correlations of the coefficients.
    pub correlation: Correlation,
    /// Currents by trial; disturbance and noise by axis.
    pub nuisances: BTreeMap<String, Parameter>,
    /// Coefficients without dimension, where the vehicle's length is known.
    #[serde(default)]
    pub nondimensional: Option<PrimeSystem>,
    /// How well the trials determine the coefficients.
    pub identifiability: Identifiability,
    /// The terms that were tried beside the usual ones.
    #[serde(default)]
    pub structure: Vec<TermDecision>,
    /// Thrusters that stood still or pushed the other way in a trial; they were taken to do so.
    #[serde(default)]
    pub thruster_faults: Vec<ThrusterFault>,
    /// Pairs of thrusters of which each does what the log of the other says; they were taken to do so.
    #[serde(default)]
    pub thrusters_exchanged: Vec<[String; 2]>,
    /// What each thruster gives over what its curve says, where most others give what theirs say; without
    /// those of which the trials do not determine it.
    #[serde(default)]
    pub thruster_estimates: BTreeMap<String, ThrusterEstimate>,
    /// Numbers measured.
    pub samples: usize,
    /// ln-likelihood at the optimum.
    pub log_likelihood: f64,
    /// Its error on the trials that it was fitted to, simulated freely from their start.
    pub fit: CoupledScore,
    /// Its error on trials that it had not seen.
    #[serde(default)]
    pub hold_out: Option<CoupledScore>,
    /// The error, on the same trials, of each driven axis with a plant of its own: what
    /// coupling explains is what this has more.
    #[serde(default)]
    pub single_axes: BTreeMap<Dof, AxisScore>,
    /// What to make of it.
    #[serde(default)]
    pub verdict: Verdict,
    /// What to make of each of its axes: a plant is doubtful if one of them is.
    #[serde(default)]
    pub verdicts: BTreeMap<Dof, Verdict>,
    /// How far each axis was driven in its trials.
    #[serde(default)]
    pub driven: BTreeMap<Dof, Driven>,
    /// Doubts.
    pub caveats: Vec<Caveat>,
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
    /// What determines it.
    pub told_by: ToldBy,
}

/// Coefficients in the prime system: forces over `½ρ L T U²`, moments over `½ρ L² T U²`, masses
/// over `½ρ L² T`, velocities over U and rates over U/L.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrimeSystem {
    /// L, m.
    pub length_m: f64,
    /// T, m: the draught, or L where no draught is stated.
    pub depth_m: f64,
    /// ρ, kg/m³.
    pub density_kg_m3: f64,
    /// U, m/s: the mean speed of the fitted trials. Coefficients of second degree do not depend
    /// on it.
    pub speed_m_s: f64,
    /// By the names of the coefficients.
    pub coefficients: BTreeMap<String, PrimeCoefficient>,
}

/// A coefficient without dimension.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PrimeCoefficient {
    /// How tables call it: `Y'_vvr`, with the sign of a force on the vehicle; `m22'` is a mass.
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

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ToldBy {
    /// The trials.
    Data,
    /// A limit of what is possible: not below zero, or not below the rigid body.
    Limit,
    /// Neither: its interval is wider than the number itself.
    Nothing,
    /// Not the trials: it was stated, and is held.
    Stated,
}

/// A matrix with standard deviations, by row and column in the order of the axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MatrixResult {
    /// The numbers.
    pub value: Vec<Vec<f64>>,
    /// Their standard deviations; zero where there is no term.
    pub std: Vec<Vec<f64>>,
}

/// Correlations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Correlation {
    /// Rows and columns.
    pub names: Vec<String>,
    /// Correlations, −1 to 1.
    pub value: Vec<Vec<f64>>,
}

/// How well trials determine coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Identifiability {
    /// How many coefficients there are.
    pub coefficients: usize,
    /// How many combinations of them the motion determines.
    pub rank: usize,
    /// What each coefficient's variance is multiplied with because others look like it.
    pub variance_inflation: BTreeMap<String, f64>,
    /// Coefficients whose interval is wider than the number itself.
    pub not_told: Vec<String>,
}

/// A term that was tried, and what came of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TermDecision {
    /// The term, or terms that go together.
    pub terms: Vec<String>,
    /// Whether the plant has it.
    pub admitted: bool,
    /// Twice what the log-likelihood gains by it.
    pub likelihood_ratio: f64,
    /// How often chance alone would make as large a gain.
    pub p_value: f64,
}

/// The error of a plant on some trials, simulated freely.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CoupledScore {
    /// Over all trials.
    pub by_axis: BTreeMap<Dof, AxisScore>,
    /// By trial.
    pub trials: BTreeMap<String, BTreeMap<Dof, AxisScore>>,
}

/// The error of a plant in one axis; what a simulation that runs away has none of is absent.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisScore {
    /// Mean |model − measured| of velocity, m/s or rad/s.
    pub mean_abs_error: Option<f64>,
    /// The same of a model that never moves.
    pub null_error: f64,
    /// Mean change of the model's velocity by a draw of the disturbance that was found, m/s or
    /// rad/s: so far does that alone take the true plant from what is measured; with the noise of
    /// velocities that are slopes of positions.
    pub disturbance_error: Option<f64>,
    /// Mean |model − measured| of roll and pitch where the model begins anew every 10 s from what
    /// is measured, rad/s: they swing about their rest, and who has lost their phase once is as far
    /// off as one that knows nothing of them.
    pub restarted_error: Option<f64>,
    /// The same of a rate that stays as it is at each beginning.
    pub kept_error: Option<f64>,
    /// What held-out trials would have of mass and drag.
    pub change: Option<AxisChange>,
    /// 1 − Σ(model − measured)² / Σ(measured − mean)².
    pub r2: Option<f64>,
    /// Samples compared.
    pub samples: usize,
}

/// What trials that were not fitted would have of an axis: a step of their own likelihood from the
/// plant, with the disturbances that were found, and a current of each trial's own, beside it.
///
/// Forces that nobody logs take a free simulation away from what is measured; they only make these
/// intervals wider.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisChange {
    /// The part by which they would have the mass greater; its interval is that of a difference.
    pub mass: Part,
    /// The same of the drag at the usual speed.
    pub drag: Part,
    /// Whether what the filter fails to predict of them is white: Box and Pierce's statistic over 40
    /// lags, divided by 40; 1 if it is.
    pub whiteness: f64,
    /// Mean square of that in parts of what the filter expects of it: 1 if noise and disturbances
    /// are as in the fitted trials.
    pub surprise: f64,
}

/// Above this, something else moves the vehicle in unseen trials.
const SURPRISED: f64 = 1.5;

impl AxisChange {
    /// Whether trials that the plant has not seen know it, and find it right.
    pub(crate) fn vouches(&self) -> bool {
        confirms(self.mass, self.drag) && self.whiteness < NOT_WHITE && self.surprise < SURPRISED
    }

    /// How far it goes for sure, in parts of what a user minds, if it goes beyond that.
    pub(crate) fn beyond(&self) -> Option<f64> {
        Some(beyond(self.mass, self.drag)).filter(|parts| *parts > 1.0)
    }
}

/// What begins anew follows an axis if its error is less than this part of that of a rate that stays.
const FOLLOWED: f64 = 0.5;

/// An error that is greater than what a disturbance does by this factor is not its doing.
const DISTURBED: f64 = 1.5;

impl AxisScore {
    /// Whether what disturbs the vehicle explains the error, so that it says nothing of the plant.
    pub(crate) fn is_of_disturbance(&self) -> bool {
        let both = self.mean_abs_error.zip(self.disturbance_error);
        both.is_some_and(|(error, disturbance)| error < DISTURBED * disturbance)
    }

    /// Whether held-out trials find the plant right, however far forces that nobody logs take a free
    /// simulation from them.
    pub(crate) fn is_vouched(&self) -> bool {
        self.change.is_some_and(|change| change.vouches())
    }

    /// Whether the plant follows a roll or pitch for some seconds, if not over a whole trial.
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

/// What a thruster gives over what its curve says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThrusterGain {
    /// Of thrust above zero.
    pub forward: f64,
    /// Of thrust below zero.
    pub reverse: f64,
    /// Their standard deviations; that of the common scale is in both.
    pub std: [f64; 2],
}

impl CoupledPlant {
    /// Gains of thrusters by name, where the plant has them.
    ///
    /// `1 + e` ahead and `1 + e + e_r` in reverse, with e the coefficient `NAME.excess-thrust` and e_r
    /// `NAME.excess-reverse-thrust`.
    pub fn thruster_gains(&self) -> BTreeMap<String, ThrusterGain> {
        let mut found: BTreeMap<String, [Option<&str>; 2]> = BTreeMap::new();
        for effect in &self.effects {
            if let EffectForce::Gain { thruster, reverse } = &effect.force {
                let places = found.entry(thruster.name.clone()).or_default();
                places[usize::from(*reverse)] = Some(&effect.name);
            }
        }
        let of = |names: [Option<&str>; 2]| {
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
        found.into_iter().map(|(name, names)| (name, of(names))).collect()
    }

    /// The correlation of two coefficients; zero of one that there is none of.
    fn correlation_of(&self, names: [Option<&str>; 2]) -> f64 {
        let Correlation { names: all, value } = &self.correlation;
        let place = |name: Option<&str>| all.iter().position(|own| Some(own.as_str()) == name);
        let [i, j] = names.map(place);
        i.zip(j).and_then(|(i, j)| value.get(i)?.get(j).copied()).unwrap_or(0.0)
    }
}

/// Whether a term is the gain of a thruster.
pub(crate) fn is_gain(structure: &Structure, term: &Basis) -> bool {
    let Basis::Effect(k) = term else { return false };
    matches!(structure.effects()[*k].force, EffectForce::Gain { .. })
}

/// A plant with the coefficients that results hold.
///
/// # Errors
/// [`Error::PlantTerm`] for a name that is no term, [`Error::Plant`] for coefficients that
/// make no plant.
pub fn plant_of_result(result: &CoupledPlant) -> Result<Plant, Error> {
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
    fn a_swing_is_followed_whose_error_is_less_than_half_that_of_a_kept_rate() {
        let score = |restarted_error, kept_error| AxisScore {
            restarted_error,
            kept_error,
            ..AxisScore::default()
        };
        assert!(score(Some(0.04), Some(0.1)).is_followed());
        assert!(!score(Some(0.06), Some(0.1)).is_followed());
        // Nothing but roll and pitch is begun anew.
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
