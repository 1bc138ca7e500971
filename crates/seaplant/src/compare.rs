//! Whether fits of the same vehicle differ by more than chance.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use crate::results::{Parameter, Parameters, PlantResult, Results};
use crate::{Caveat, CaveatCode, Dof, Method};

/// Fits beside each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Differences {
    /// Each degree of freedom that two fits or more have.
    pub dofs: BTreeMap<Dof, DofDifference>,
    /// What makes the tests doubtful.
    pub caveats: Vec<Caveat>,
}

/// The plants of one degree of freedom beside each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DofDifference {
    /// Each fit's method; absent where it has no such plant.
    pub methods: Vec<Option<Method>>,
    /// All parameters together; absent if no two fits have them all.
    pub test: Option<DifferenceTest>,
    /// Each parameter that any fit has: `mass`, `quadratic_drag`, `linear_drag`, `bias_force`.
    pub parameters: BTreeMap<String, ParameterDifference>,
}

/// One parameter of several fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterDifference {
    /// Each fit's estimate.
    pub estimates: Vec<Option<Parameter>>,
    /// Whether they differ; absent of fewer than two.
    pub test: Option<DifferenceTest>,
}

/// How well chance explains that estimates differ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DifferenceTest {
    /// Cochran's Q.
    pub q: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// How often chance alone makes as large a Q.
    pub p_value: f64,
    /// Whether they differ: `p_value` is below 0.05 after Holm's correction for the number of
    /// tests of its kind.
    pub differs: bool,
}

/// Chance is accused of a difference down to here.
const LEVEL: f64 = 0.05;

/// Tells whether fits of one vehicle differ by more than their uncertainties explain.
///
/// Of estimates θᵢ with covariances Σᵢ, `Q = Σᵢ (θᵢ − θ̄)ᵀ Σᵢ⁻¹ (θᵢ − θ̄)` about the weighted mean
/// `θ̄ = (Σ Σᵢ⁻¹)⁻¹ Σ Σᵢ⁻¹ θᵢ` is χ² with k(n − 1) degrees of freedom if they are independent and
/// alike: of two estimates of one number it is their squared difference over the sum of their
/// variances. Every degree of freedom is tested as a whole, on the parameters that all its fits
/// have, and each parameter by itself.
///
/// # Source
/// W. G. Cochran, "The combination of estimates from different experiments", *Biometrics* 10, 1954;
/// S. Holm, "A simple sequentially rejective multiple test procedure", 1979.
///
/// ```
/// use seaplant::{Dof, Method, differences};
/// # use seaplant::results::Results;
/// # use seaplant::twin::{TwinSpec, make};
/// # use seaplant::{IdentifyOptions, Trial, TrialSetup, identify};
/// # fn fit(seed: u64, payload_kg: f64) -> Result<Results, seaplant::Error> {
/// #     let mut spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 120.0, seed, ..TwinSpec::jason2() };
/// #     spec.plants.get_mut(&Dof::Surge).expect("a plant").mass += payload_kg;
/// #     let dive = make(&spec)?;
/// #     let trials: Vec<Trial> = dive.trials.iter().map(|log| {
/// #         let (name, role, dofs) = (log.name.clone(), log.role, vec![log.dof]);
/// #         Trial::new(TrialSetup { name, role, dofs, ..TrialSetup::default() }, &log.recording, &dive.vehicle)
/// #     }).collect::<Result<_, _>>()?;
/// #     let methods = vec![Method::FilterError];
/// #     Ok(identify(&dive.vehicle, &trials, &IdentifyOptions { methods, ..IdentifyOptions::default() }).results)
/// # }
/// let (spring, summer, autumn) = (fit(1, 0.0)?, fit(2, 0.0)?, fit(3, 200.0)?); // 200 kg of payload
/// let differs = |found: seaplant::Differences| found.dofs[&Dof::Surge].test.expect("two fits").differs;
/// assert!(!differs(differences(&[&spring, &summer], None)));
/// assert!(differs(differences(&[&spring, &autumn], None)));
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn differences(fits: &[&Results], method: Option<Method>) -> Differences {
    let mut dofs = BTreeMap::new();
    for dof in Dof::ALL {
        let plants: Vec<Option<&PlantResult>> =
            fits.iter().map(|fit| plant(fit, dof, method)).collect();
        if plants.iter().flatten().count() > 1 {
            dofs.insert(dof, of_dof(&plants));
        }
    }
    correct(&mut dofs);
    let caveats = caveats(fits, &dofs);
    Differences { dofs, caveats }
}

fn plant(fit: &Results, dof: Dof, method: Option<Method>) -> Option<&PlantResult> {
    match method {
        None => fit.plants.get(&dof),
        Some(method) => fit.methods.get(&dof)?.get(&method),
    }
}

/// Name, estimate, and place in the correlation matrix.
type Pick = (&'static str, fn(&Parameters) -> Option<&Parameter>);

const PICKS: [Pick; 4] = [
    ("mass", |p| Some(&p.mass)),
    ("quadratic_drag", |p| p.quadratic_drag.as_ref()),
    ("linear_drag", |p| p.linear_drag.as_ref()),
    ("bias_force", |p| p.bias_force.as_ref()),
];

fn of_dof(plants: &[Option<&PlantResult>]) -> DofDifference {
    let mut parameters = BTreeMap::new();
    for (name, pick) in PICKS {
        let estimates: Vec<Option<Parameter>> =
            plants.iter().map(|plant| pick(&plant.as_ref()?.parameters).cloned()).collect();
        if estimates.iter().any(Option::is_some) {
            let known: Vec<Gaussian> = estimates.iter().flatten().filter_map(single).collect();
            let test = homogeneity(&known);
            parameters.insert(name.to_owned(), ParameterDifference { estimates, test });
        }
    }
    let methods = plants.iter().map(|plant| plant.map(|plant| plant.method)).collect();
    let known: Vec<&PlantResult> = plants.iter().flatten().copied().collect();
    DofDifference { methods, test: jointly(&known), parameters }
}

/// An estimate of some numbers and its covariance.
struct Gaussian {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// `None` if its uncertainty is not a number above zero.
fn single(parameter: &Parameter) -> Option<Gaussian> {
    let variance = parameter.std * parameter.std;
    (variance.is_finite() && variance > 0.0).then(|| Gaussian {
        mean: DVector::from_element(1, parameter.value),
        covariance: DMatrix::from_element(1, 1, variance),
    })
}

/// All parameters that every plant has.
fn jointly(plants: &[&PlantResult]) -> Option<DifferenceTest> {
    let everywhere = |k: &usize| plants.iter().all(|p| PICKS[*k].1(&p.parameters).is_some());
    let shared: Vec<usize> = (0..PICKS.len()).filter(everywhere).collect();
    let gaussians: Vec<Gaussian> = plants
        .iter()
        .map(|plant| {
            let of = |k: usize| PICKS[shared[k]].1(&plant.parameters);
            let mean = |k: usize| of(k).map_or(0.0, |p| p.value);
            let std = |k: usize| of(k).map_or(0.0, |p| p.std);
            let n = shared.len();
            let covariance = |row: usize, column: usize| {
                let correlation = if row == column {
                    1.0
                } else {
                    plant.correlation[shared[row]][shared[column]]
                };
                correlation * std(row) * std(column)
            };
            Gaussian {
                mean: DVector::from_fn(n, |k, _| mean(k)),
                covariance: DMatrix::from_fn(n, n, covariance),
            }
        })
        .collect();
    homogeneity(&gaussians)
}

/// Cochran's Q; `None` of fewer than two estimates, or of a covariance that is none.
fn homogeneity(estimates: &[Gaussian]) -> Option<DifferenceTest> {
    let numbers = estimates.first()?.mean.len();
    if estimates.len() < 2 || numbers == 0 {
        return None;
    }
    let weights: Vec<DMatrix<f64>> = estimates
        .iter()
        .map(|estimate| Some(estimate.covariance.clone().cholesky()?.inverse()))
        .collect::<Option<_>>()?;
    let total: DMatrix<f64> = weights.iter().sum();
    let weighted: DVector<f64> =
        weights.iter().zip(estimates).map(|(weight, estimate)| weight * &estimate.mean).sum();
    let mean = total.cholesky()?.solve(&weighted);
    let q: f64 = weights
        .iter()
        .zip(estimates)
        .map(|(weight, estimate)| {
            let off = &estimate.mean - &mean;
            off.dot(&(weight * &off))
        })
        .sum();
    let degrees = numbers * (estimates.len() - 1);
    let p_value = ChiSquared::new(degrees as f64).ok()?.sf(q.max(0.0));
    Some(DifferenceTest { q, degrees, p_value, differs: false })
}

/// Decides by Holm's method, among the tests of whole plants and among those of parameters.
fn correct(dofs: &mut BTreeMap<Dof, DofDifference>) {
    let mut plants = Vec::new();
    let mut parameters = Vec::new();
    for difference in dofs.values_mut() {
        plants.extend(&mut difference.test);
        parameters.extend(difference.parameters.values_mut().filter_map(|p| p.test.as_mut()));
    }
    for mut tests in [plants, parameters] {
        tests.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
        let count = tests.len();
        for (k, test) in tests.into_iter().enumerate() {
            if test.p_value * (count - k) as f64 >= LEVEL {
                break;
            }
            test.differs = true;
        }
    }
}

fn caveats(fits: &[&Results], dofs: &BTreeMap<Dof, DofDifference>) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    let vehicles: BTreeSet<&str> = fits.iter().map(|fit| fit.vehicle.as_str()).collect();
    if vehicles.len() > 1 {
        let names: Vec<&str> = vehicles.into_iter().collect();
        let message = format!("the fits are of vehicles of different names: {}", names.join(", "));
        caveats.push(Caveat::warning(CaveatCode::NotComparable, message));
    }
    let shared = shared_logs(fits);
    if shared > 0 {
        let logs = if shared == 1 { "log is".to_owned() } else { format!("{shared} logs are") };
        let message = format!(
            "{logs} behind more than one of the fits: the tests take fits for independent, and these are not; compare fits of other dives"
        );
        caveats.push(Caveat::warning(CaveatCode::NotComparable, message));
    }
    let mixed: Vec<&str> = dofs
        .iter()
        .filter(|(_, d)| d.methods.iter().flatten().collect::<BTreeSet<_>>().len() > 1)
        .map(|(dof, _)| dof.name())
        .collect();
    if !mixed.is_empty() {
        let message = format!(
            "in {} the fits are by different methods, whose own errors are not in their intervals; compare one method with itself",
            mixed.join(", ")
        );
        caveats.push(Caveat::warning(CaveatCode::NotComparable, message));
    }
    caveats
}

/// How many logs with trials more than one fit has read.
fn shared_logs(fits: &[&Results]) -> usize {
    let mut readers: BTreeMap<&str, usize> = BTreeMap::new();
    for fit in fits {
        let logs: BTreeSet<&String> = fit.trials.iter().flat_map(|trial| &trial.files).collect();
        let inputs = fit.provenance.inputs.iter().filter(|input| logs.contains(&input.path));
        let hashes: BTreeSet<&str> = inputs.map(|input| input.sha256.as_str()).collect();
        hashes.into_iter().for_each(|hash| *readers.entry(hash).or_default() += 1);
    }
    readers.values().filter(|readers| **readers > 1).count()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(value: f64, std: f64) -> Gaussian {
        let unit = String::new();
        let (low95, high95) = (value - 1.96 * std, value + 1.96 * std);
        single(&Parameter { value, std, low95, high95, unit }).expect("a variance")
    }

    #[test]
    fn two_numbers_are_judged_by_their_difference() {
        let test = homogeneity(&[estimate(10.0, 3.0), estimate(18.0, 4.0)]).expect("two");
        // (18 - 10)² / (3² + 4²)
        assert!((test.q - 2.56).abs() < 1e-12 && test.degrees == 1);
        // 2 (1 - Φ(1.6)), of a table.
        assert!((test.p_value - 0.109_598_6).abs() < 1e-6, "{}", test.p_value);
    }

    #[test]
    fn three_numbers_about_their_weighted_mean() {
        let found = [estimate(1.0, 1.0), estimate(2.0, 1.0), estimate(6.0, 2.0)];
        let test = homogeneity(&found).expect("three");
        // Weights 1, 1, 1/4; mean 4.5 / 2.25 = 2; Q = 1 + 0 + 4.
        assert!((test.q - 5.0).abs() < 1e-12 && test.degrees == 2);
        // exp(-5/2)
        assert!((test.p_value - (-2.5_f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn correlated_parameters_are_judged_together() {
        let of = |mean: [f64; 2]| Gaussian {
            mean: DVector::from_row_slice(&mean),
            covariance: DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.9, 1.0]),
        };
        // Along the correlation a difference is cheap, across it is dear: with Σ of both 2 [1 r; r 1],
        // (1, 1) costs 2 / (2 (1 + r)), (1, -1) costs 2 / (2 (1 - r)).
        let along = homogeneity(&[of([0.0, 0.0]), of([1.0, 1.0])]).expect("two");
        let across = homogeneity(&[of([0.0, 0.0]), of([1.0, -1.0])]).expect("two");
        assert!((along.q - 1.0 / 1.9).abs() < 1e-12, "{}", along.q);
        assert!((across.q - 10.0).abs() < 1e-9 && across.degrees == 2, "{}", across.q);
    }

    #[test]
    fn nothing_is_tested_without_two_uncertainties() {
        assert_eq!(homogeneity(&[estimate(1.0, 1.0)]), None);
        let unit = String::new();
        let exact = Parameter { value: 1.0, std: 0.0, low95: 1.0, high95: 1.0, unit };
        assert!(single(&exact).is_none());
    }

    #[test]
    fn many_tests_are_held_to_a_stricter_level() {
        let test = |p_value| DifferenceTest { q: 0.0, degrees: 1, p_value, differs: false };
        let of = |p_value: f64| DofDifference {
            methods: Vec::new(),
            test: Some(test(p_value)),
            parameters: BTreeMap::new(),
        };
        let given = [(Dof::Surge, 0.01), (Dof::Sway, 0.04), (Dof::Heave, 0.03), (Dof::Yaw, 0.9)];
        let mut dofs: BTreeMap<Dof, DofDifference> =
            given.into_iter().map(|(dof, p)| (dof, of(p))).collect();
        correct(&mut dofs);
        // 0.01 · 4 < 0.05; then 0.03 · 3 > 0.05 ends it, though 0.03 and 0.04 are below 0.05 alone.
        let differing: Vec<Dof> = dofs
            .iter()
            .filter(|(_, d)| d.test.is_some_and(|test| test.differs))
            .map(|(dof, _)| *dof)
            .collect();
        assert_eq!(differing, [Dof::Surge]);
    }
}
