//! Tests for differences between fits of the same vehicle.

mod plants;
mod thrusters;

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use self::plants::{ComparedPlant, coefficients, stated};
use self::thrusters::histories;
pub use self::thrusters::{
    DiveThrusters, ThrusterCause, ThrusterChange, ThrusterHistory, follow_thrusters,
    other_thrusters,
};
use crate::exchange::PlantModel;
use crate::plant::own_terms;
use crate::results::{Parameter, Parameters, PlantResult, Results};
use crate::{Caveat, CaveatCode, Dof, Method};

/// Comparison of fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Differences {
    /// Each degree of freedom that two or more fits have.
    pub dofs: BTreeMap<Dof, DofDifference>,
    /// Each further coefficient of plants of several axes, by name: `mass.sway-yaw`, `yaw: |v|r`,
    /// `lever.z`; empty unless there are two such plants.
    pub coefficients: BTreeMap<String, ParameterDifference>,
    /// What each thruster gives over the fits, in their order; without those that fewer than two determine.
    pub thrusters: BTreeMap<String, ThrusterHistory>,
    /// Reasons to doubt the tests.
    pub caveats: Vec<Caveat>,
}

/// One of the plants to compare.
#[derive(Clone, Copy, Debug)]
pub enum Compared<'a> {
    /// A fit.
    Fit(&'a Results),
    /// A plant file or published table.
    Table(&'a PlantModel),
}

/// A parameter of a fit or a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Stated {
    /// The value.
    pub value: f64,
    /// Its standard deviation; absent from a table without errors.
    pub std: Option<f64>,
    /// Its 95 % interval; absent from a table without errors.
    pub interval95: Option<[f64; 2]>,
    /// Its unit.
    pub unit: String,
}

/// Comparison of the plants of one degree of freedom.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DofDifference {
    /// Each fit's method; absent for a fit without such a plant, and for tables.
    pub methods: Vec<Option<Method>>,
    /// The joint test of all parameters; absent unless two fits have them.
    pub test: Option<DifferenceTest>,
    /// Each parameter of any fit: `mass`, `quadratic_drag`, `linear_drag`, `bias_force`.
    pub parameters: BTreeMap<String, ParameterDifference>,
}

/// Comparison of one parameter of several fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ParameterDifference {
    /// Each fit's estimate.
    pub estimates: Vec<Option<Stated>>,
    /// The test for a difference; absent for fewer than two estimates.
    pub test: Option<DifferenceTest>,
}

/// A test for a difference between estimates.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DifferenceTest {
    /// Cochran's Q.
    pub q: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// Probability of as large a Q by chance.
    pub p_value: f64,
    /// True if they differ: `p_value` is below 0.05 after Holm's correction for the number of tests
    /// of its kind.
    pub differs: bool,
}

/// Significance level.
const LEVEL: f64 = 0.05;

/// Tests whether fits of one vehicle differ by more than their uncertainties explain.
///
/// For estimates θᵢ with covariances Σᵢ, `Q = Σᵢ (θᵢ − θ̄)ᵀ Σᵢ⁻¹ (θᵢ − θ̄)` about the weighted mean
/// `θ̄ = (Σ Σᵢ⁻¹)⁻¹ Σ Σᵢ⁻¹ θᵢ` is χ² with k(n − 1) degrees of freedom if they are independent
/// estimates of equal parameters: for two estimates of one number it is their squared difference
/// over the sum of their variances. Every degree of freedom has a joint test of the parameters that
/// all its fits have, and a test of each parameter.
///
/// # Source
/// W. G. Cochran, "The combination of estimates from different experiments", *Biometrics* 10, 1954;
/// S. Holm, "A simple sequentially rejective multiple test procedure", 1979.
///
/// ```
/// use seaplant::{Compared::Fit, Dof, Method, differences};
/// # use seaplant::results::Results;
/// # use seaplant::twin::{TwinSpec, make};
/// # use seaplant::{IdentifyOptions, Trial, TrialSetup, identify};
/// # fn fit(seed: u64, payload_kg: f64) -> Result<Results, seaplant::Error> {
/// #     let mut spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 120.0, seed, ..TwinSpec::jason2() };
/// #     spec.plants.get_mut(&Dof::Surge).expect("a plant").mass += payload_kg;
/// #     let dive = make(&spec)?;
/// #     let trials: Vec<Trial> = dive.trials.iter().map(|log| {
/// #         let (name, role, dofs) = (log.name.clone(), log.role, log.dofs.clone());
/// #         Trial::new(TrialSetup { name, role, dofs, ..TrialSetup::default() }, &log.recording, &dive.vehicle)
/// #     }).collect::<Result<_, _>>()?;
/// #     let methods = vec![Method::FilterError];
/// #     Ok(identify(&dive.vehicle, &trials, &IdentifyOptions { methods, ..IdentifyOptions::default() }).results)
/// # }
/// let (spring, summer, autumn) = (fit(1, 0.0)?, fit(2, 0.0)?, fit(3, 200.0)?); // 200 kg of payload
/// let differs = |found: seaplant::Differences| found.dofs[&Dof::Surge].test.expect("two fits").differs;
/// assert!(!differs(differences(&[Fit(&spring), Fit(&summer)], None)));
/// assert!(differs(differences(&[Fit(&spring), Fit(&autumn)], None)));
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn differences(compared: &[Compared<'_>], method: Option<Method>) -> Differences {
    let together: Vec<Option<ComparedPlant<'_>>> =
        compared.iter().map(|one| ComparedPlant::new(*one, method)).collect();
    let mut dofs = BTreeMap::new();
    for dof in Dof::ALL {
        let several = |k: usize| together[k].as_ref().filter(|plant| plant.has(dof));
        let has_several = (0..compared.len()).filter_map(several).count() > 1;
        let plant_of = |(k, one): (usize, &Compared<'_>)| {
            let alone = || ComparedAxis::new(*one, dof, method);
            let several = || ComparedAxis::of_plant(several(k)?, dof);
            if has_several { several().or_else(alone) } else { alone().or_else(several) }
        };
        let plants: Vec<Option<ComparedAxis>> = compared.iter().enumerate().map(plant_of).collect();
        if plants.iter().flatten().count() > 1 {
            dofs.insert(dof, dof_difference(&plants));
        }
    }
    let mut coefficients = coefficients(&together);
    let thrusters = histories(compared);
    correct(&mut dofs, &mut coefficients);
    let caveats = caveats(compared, &dofs);
    Differences { dofs, coefficients, thrusters, caveats }
}

/// Names of parameters, in the order of `[m, d_Q, d_L, b]`.
const NAMES: [&str; 4] = ["mass", "quadratic_drag", "linear_drag", "bias_force"];

/// The plant of one degree of freedom.
struct ComparedAxis {
    method: Option<Method>,
    parameters: [Option<Stated>; 4],
    /// Correlations; absent from a table without errors.
    correlation: Option<[[f64; 4]; 4]>,
}

impl ComparedAxis {
    fn new(compared: Compared<'_>, dof: Dof, method: Option<Method>) -> Option<Self> {
        match compared {
            Compared::Fit(fit) => Self::of_fit(dof, plant(fit, dof, method)?),
            Compared::Table(model) => Self::of_model(model, dof),
        }
    }

    /// Creates the plant of one axis of a plant of several.
    fn of_plant(plant: &ComparedPlant<'_>, dof: Dof) -> Option<Self> {
        Some(Self { method: plant.method(dof), ..Self::of_model(&plant.model, dof)? })
    }

    fn of_fit(dof: Dof, plant: &PlantResult) -> Option<Self> {
        let own = plant.by_axis.get(&dof)?;
        let Parameters { mass, quadratic_drag, linear_drag, bias_force, .. } = own;
        let all = [Some(mass), quadratic_drag.as_ref(), linear_drag.as_ref(), bias_force.as_ref()];
        let stated = |parameter: &Parameter| Stated {
            value: parameter.value,
            std: Some(parameter.std),
            interval95: Some([parameter.low95, parameter.high95]),
            unit: parameter.unit.clone(),
        };
        let terms = own_terms(dof).map(|(term, sign)| (term.to_string(), sign));
        let correlation = |i: usize, j: usize| {
            let [(a, of_a), (b, of_b)] = [&terms[i], &terms[j]];
            of_a * of_b * plant.correlation.of(a, b).unwrap_or(0.0)
        };
        Some(Self {
            method: Some(plant.method),
            parameters: all.map(|parameter| parameter.map(stated)),
            correlation: Some(std::array::from_fn(|i| std::array::from_fn(|j| correlation(i, j)))),
        })
    }

    fn of_model(model: &PlantModel, dof: Dof) -> Option<Self> {
        if !model.plant.axes().contains(&dof) {
            return None;
        }
        let bases = own_terms(dof);
        let structure = model.plant.structure();
        let places = bases.map(|(basis, _)| structure.index_of(&basis));
        let stated = |k: usize| Some(stated(model, places[k]?, bases[k].1, bases[k].0.unit()));
        let correlation = model.covariance.as_ref().map(|covariance| {
            let correlation_of = |i: usize, j: usize| {
                let (a, b) = (places[i]?, places[j]?);
                let scale = (covariance[(a, a)] * covariance[(b, b)]).sqrt();
                (scale > 0.0).then(|| bases[i].1 * bases[j].1 * covariance[(a, b)] / scale)
            };
            std::array::from_fn(|i| std::array::from_fn(|j| correlation_of(i, j).unwrap_or(0.0)))
        });
        Some(Self { method: None, parameters: std::array::from_fn(stated), correlation })
    }
}

fn plant(fit: &Results, dof: Dof, method: Option<Method>) -> Option<&PlantResult> {
    match method {
        None => fit.plants.get(dof.name()).filter(|plant| plant.is_alone()),
        Some(method) => fit.method_of(dof, method),
    }
}

fn dof_difference(plants: &[Option<ComparedAxis>]) -> DofDifference {
    let mut parameters = BTreeMap::new();
    for (k, name) in NAMES.into_iter().enumerate() {
        let estimates: Vec<Option<Stated>> =
            plants.iter().map(|plant| plant.as_ref()?.parameters[k].clone()).collect();
        if estimates.iter().any(Option::is_some) {
            let known: Vec<Gaussian> = estimates.iter().flatten().filter_map(gaussian).collect();
            let test = homogeneity(&known);
            parameters.insert(name.to_owned(), ParameterDifference { estimates, test });
        }
    }
    let methods = plants.iter().map(|plant| plant.as_ref()?.method).collect();
    let known: Vec<&ComparedAxis> = plants.iter().flatten().collect();
    DofDifference { methods, test: jointly(&known), parameters }
}

/// An estimate and its covariance.
struct Gaussian {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
}

/// Returns a parameter with its variance; `None` if that is not positive and finite.
fn gaussian(parameter: &Stated) -> Option<Gaussian> {
    let variance = parameter.std?.powi(2);
    (variance.is_finite() && variance > 0.0).then(|| Gaussian {
        mean: DVector::from_element(1, parameter.value),
        covariance: DMatrix::from_element(1, 1, variance),
    })
}

/// Tests all parameters that every plant with standard deviations has.
fn jointly(plants: &[&ComparedAxis]) -> Option<DifferenceTest> {
    let plants: Vec<(&ComparedAxis, &[[f64; 4]; 4])> =
        plants.iter().filter_map(|plant| Some((*plant, plant.correlation.as_ref()?))).collect();
    let everywhere = |k: &usize| plants.iter().all(|(plant, _)| plant.parameters[*k].is_some());
    let shared: Vec<usize> = (0..NAMES.len()).filter(everywhere).collect();
    let gaussians: Vec<Gaussian> = plants
        .iter()
        .map(|(plant, correlation)| {
            let parameter = |k: usize| plant.parameters[shared[k]].as_ref();
            let mean = |k: usize| parameter(k).map_or(0.0, |p| p.value);
            let std = |k: usize| parameter(k).and_then(|p| p.std).unwrap_or(0.0);
            let n = shared.len();
            let covariance = |row: usize, column: usize| {
                let correlation =
                    if row == column { 1.0 } else { correlation[shared[row]][shared[column]] };
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

/// Computes Cochran's Q; `None` for fewer than two estimates, or a covariance that is not positive
/// definite.
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

/// Applies Holm's correction, separately to the joint tests and to those of parameters.
fn correct(
    dofs: &mut BTreeMap<Dof, DofDifference>,
    coefficients: &mut BTreeMap<String, ParameterDifference>,
) {
    let mut plants = Vec::new();
    let mut parameters = Vec::new();
    for difference in dofs.values_mut() {
        plants.extend(&mut difference.test);
        parameters.extend(difference.parameters.values_mut().filter_map(|p| p.test.as_mut()));
    }
    parameters.extend(coefficients.values_mut().filter_map(|p| p.test.as_mut()));
    by_holm(plants);
    by_holm(parameters);
}

/// Decides which of some tests differ by more than chance.
fn by_holm(mut tests: Vec<&mut DifferenceTest>) {
    tests.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    let count = tests.len();
    for (k, test) in tests.into_iter().enumerate() {
        if test.p_value * (count - k) as f64 >= LEVEL {
            break;
        }
        test.differs = true;
    }
}

fn caveats(compared: &[Compared<'_>], dofs: &BTreeMap<Dof, DofDifference>) -> Vec<Caveat> {
    let fits: Vec<&Results> = compared
        .iter()
        .filter_map(|one| match one {
            Compared::Fit(fit) => Some(*fit),
            Compared::Table(_) => None,
        })
        .collect();
    let mut caveats = Vec::new();
    let vehicles: BTreeSet<&str> = fits.iter().map(|fit| fit.vehicle.as_str()).collect();
    if vehicles.len() > 1 {
        let names: Vec<&str> = vehicles.into_iter().collect();
        let message = format!("the fits are of vehicles of different names: {}", names.join(", "));
        caveats.push(Caveat::warning(CaveatCode::NotComparable, message));
    }
    caveats.extend(other_thrusters(compared));
    let shared = shared_logs(&fits);
    if shared > 0 {
        let logs = if shared == 1 { "one log is".to_owned() } else { format!("{shared} logs are") };
        let message = format!(
            "{logs} used by more than one of the fits: the tests assume independent fits; compare fits of different dives"
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
            "in {} the fits use different methods, and the intervals leave out the errors of each method; compare fits by the same method",
            mixed.join(", ")
        );
        caveats.push(Caveat::warning(CaveatCode::NotComparable, message));
    }
    caveats
}

/// Returns the number of logs of trials that more than one fit used.
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
        gaussian(&stated(value, Some(std))).expect("a variance")
    }

    fn stated(value: f64, std: Option<f64>) -> Stated {
        Stated { value, std, interval95: None, unit: String::new() }
    }

    #[test]
    fn two_numbers_are_tested_by_their_difference() {
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
    fn correlated_parameters_are_tested_jointly() {
        let gaussian = |mean: [f64; 2]| Gaussian {
            mean: DVector::from_row_slice(&mean),
            covariance: DMatrix::from_row_slice(2, 2, &[1.0, 0.9, 0.9, 1.0]),
        };
        // A difference along the correlation is less significant than one across it: with Σ of both
        // 2 [1 r; r 1], (1, 1) has Q = 2 / (2 (1 + r)), (1, -1) has 2 / (2 (1 - r)).
        let along = homogeneity(&[gaussian([0.0, 0.0]), gaussian([1.0, 1.0])]).expect("two");
        let across = homogeneity(&[gaussian([0.0, 0.0]), gaussian([1.0, -1.0])]).expect("two");
        assert!((along.q - 1.0 / 1.9).abs() < 1e-12, "{}", along.q);
        assert!((across.q - 10.0).abs() < 1e-9 && across.degrees == 2, "{}", across.q);
    }

    #[test]
    fn nothing_is_tested_without_two_uncertainties() {
        assert_eq!(homogeneity(&[estimate(1.0, 1.0)]), None);
        assert!(gaussian(&stated(1.0, Some(0.0))).is_none());
        assert!(gaussian(&stated(1.0, None)).is_none());
    }

    #[test]
    fn tables_are_compared_axis_by_axis() {
        let table = |drag: f64, std: Option<f64>| -> PlantModel {
            let file: crate::exchange::PlantFile = serde_json::from_value(serde_json::json!({
                "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand",
                "axes": ["surge"],
                "coefficients": { "mass.surge": { "value": 100.0, "std": std },
                                  "surge: |u|u": { "value": drag, "std": std } }
            }))
            .expect("a table");
            file.model().expect("possible")
        };
        let (one, two, bare) = (table(20.0, Some(1.0)), table(30.0, Some(1.0)), table(30.0, None));
        let all = [&one, &two, &bare].map(Compared::Table);
        let surge = &differences(&all, None).dofs[&Dof::Surge];
        let drag = &surge.parameters["quadratic_drag"];
        // (30 − 20)² / (1² + 1²): the table without errors is listed but not tested.
        assert!((drag.test.expect("two").q - 50.0).abs() < 1e-9);
        assert_eq!(drag.estimates[2].as_ref().expect("stated").std, None);
        assert!(surge.test.expect("two").differs && !surge.parameters.contains_key("bias_force"));
    }

    #[test]
    fn many_tests_have_a_stricter_level() {
        let test = |p_value| DifferenceTest { q: 0.0, degrees: 1, p_value, differs: false };
        let difference = |p_value: f64| DofDifference {
            methods: Vec::new(),
            test: Some(test(p_value)),
            parameters: BTreeMap::new(),
        };
        let given = [(Dof::Surge, 0.01), (Dof::Sway, 0.04), (Dof::Heave, 0.03), (Dof::Yaw, 0.9)];
        let mut dofs: BTreeMap<Dof, DofDifference> =
            given.into_iter().map(|(dof, p)| (dof, difference(p))).collect();
        correct(&mut dofs, &mut BTreeMap::new());
        // 0.01 · 4 < 0.05; then 0.03 · 3 > 0.05 ends it, although 0.03 and 0.04 are below 0.05
        // each.
        let differing: Vec<Dof> = dofs
            .iter()
            .filter(|(_, d)| d.test.is_some_and(|test| test.differs))
            .map(|(dof, _)| *dof)
            .collect();
        assert_eq!(differing, [Dof::Surge]);
    }
}
