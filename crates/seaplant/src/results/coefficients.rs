//! Coefficients, matrices and decisions of a plant, as data.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Parameter, PlantResult};
use crate::estimate::Decision;
use crate::plant::{Basis, Effect, EffectForce, Plant, Structure, ThrusterNumber};
use crate::{Dof, Error};

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

/// A candidate of the model and the decision on it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TermDecision {
    /// The term, or what thrust or a sensor may do.
    pub candidate: String,
    /// True if the model includes it.
    pub admitted: bool,
    /// Twice the increase of log-likelihood, at least 0: fitted, or by the score test.
    pub likelihood_ratio: f64,
    /// Probability of as large an increase by chance, where that decides.
    #[serde(default)]
    pub p_value: Option<f64>,
    /// What the extended Bayesian information criterion asks for, where that decides: numbers added times ln n,
    /// and 2 ln P of P candidates that are tried.
    #[serde(default)]
    pub needed: Option<f64>,
    /// How much a term does, where that decides: linear drag as a part of quadratic drag at the usual speed, zero
    /// unless both brake; a bias force, at the end of its interval that is farther from zero, as a part of the
    /// usual thrust.
    #[serde(default)]
    pub size: Option<f64>,
}

impl From<&Decision> for TermDecision {
    fn from(decision: &Decision) -> Self {
        let Decision { candidate, likelihood_ratio, needed, size, admitted } = *decision;
        let candidate = candidate.name().to_owned();
        Self { candidate, admitted, likelihood_ratio, p_value: None, needed: Some(needed), size }
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

impl PlantResult {
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

    /// Returns what single thrusters have of a number beyond that of all, by name.
    pub fn own_numbers(&self, number: ThrusterNumber) -> BTreeMap<String, &Coefficient> {
        let of = |effect: &Effect| match &effect.force {
            EffectForce::Own { thruster, number: own } if *own == number => {
                Some((thruster.name.clone(), self.parameters.get(&effect.name)?))
            }
            _ => None,
        };
        self.effects.iter().filter_map(of).collect()
    }

    /// Returns the correlation of two coefficients; zero if one is absent.
    fn correlation_of(&self, [one, other]: [Option<&str>; 2]) -> f64 {
        one.zip(other).and_then(|(i, j)| self.correlation.of(i, j)).unwrap_or(0.0)
    }
}

impl Correlation {
    /// Returns the correlation of two coefficients by name; `None` if one is absent.
    pub fn of(&self, one: &str, other: &str) -> Option<f64> {
        let index = |name: &str| self.names.iter().position(|own| own == name);
        self.value.get(index(one)?)?.get(index(other)?).copied()
    }
}

/// Returns whether a term is the gain or another number of one thruster.
pub(crate) fn is_of_thruster(structure: &Structure, term: &Basis) -> bool {
    let Basis::Effect(k) = term else { return false };
    matches!(structure.effects()[*k].force, EffectForce::Gain { .. } | EffectForce::Own { .. })
}

/// Creates a plant from results.
///
/// # Errors
/// [`Error::PlantTerm`] for an invalid term, [`Error::Plant`] for invalid coefficients.
pub fn plant_of_result(result: &PlantResult) -> Result<Plant, Error> {
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
