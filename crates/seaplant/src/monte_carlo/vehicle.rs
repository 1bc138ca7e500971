//! Monte Carlo evaluation of plants of several axes.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Judged;
use crate::exchange::PlantModel;
use crate::plant::{Basis, Product};
use crate::results::{Coefficient, PlantResult, Results, Verdict};
use crate::series::median;
use crate::twin::{TrueVehicle, VehicleTwinSpec, make_vehicle};
use crate::{Dof, Error, Estimate, IdentifyOptions, Method, Trial, identify};

/// The result for one twin of several axes.
#[derive(Clone, Debug, PartialEq)]
pub struct VehicleSample {
    /// The twin's seed.
    pub seed: u64,
    /// Its coefficients, or the reason of the failure.
    pub found: Result<Vec<FoundCoefficient>, String>,
    /// The verdict on each axis with damping by its own velocity, and the true errors.
    pub judged: BTreeMap<Dof, Judged>,
}

/// One coefficient, estimated and true.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundCoefficient {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The estimate.
    pub estimate: Estimate,
    /// The true value; zero if the vehicle lacks the term.
    pub truth: f64,
}

/// Errors and coverage of one coefficient over all seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CoefficientRow {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The true value; zero if the vehicle lacks the term.
    pub truth: f64,
    /// Median of |error|, in its unit.
    pub median_abs_error: f64,
    /// Median error, in its unit, which is the bias.
    pub median_error: f64,
    /// Share of the 95 % intervals that include the truth, in %.
    pub coverage_percent: f64,
    /// Plants that have it.
    pub answers: usize,
}

/// Simulates the twin of one seed and identifies it as planned, by filter error.
///
/// # Errors
/// As [`make_vehicle`]; a failed identification is a sample.
pub fn sample_vehicle(spec: &VehicleTwinSpec, model: &PlantModel) -> Result<VehicleSample, Error> {
    let twin = make_vehicle(spec, model)?;
    let trials: Vec<Trial> =
        twin.trials.iter().map(|trial| trial.trial(&twin)).collect::<Result<_, _>>()?;
    let options = IdentifyOptions {
        methods: vec![Method::FilterError],
        together: twin.together.clone(),
        ..IdentifyOptions::default()
    };
    let results = identify(&twin.vehicle, &trials, &options).results;
    let truth = twin.truth.vehicle.as_ref();
    let plant = results.together().map(|(_, plant)| plant).next().zip(truth);
    Ok(VehicleSample {
        seed: spec.seed,
        found: plant.map(|(plant, truth)| compare(plant, truth)).ok_or_else(|| why(&results)),
        judged: plant.map(|(plant, truth)| judged(plant, truth)).unwrap_or_default(),
    })
}

fn why(results: &Results) -> String {
    let first = results.failures.first();
    first.map_or("no plant was found".to_owned(), |failure| failure.message.clone())
}

/// Compares coefficients with the truth, except for fixed ones, which have no interval.
fn compare(plant: &PlantResult, truth: &TrueVehicle) -> Vec<FoundCoefficient> {
    let comparison = |(name, found): (&String, &Coefficient)| {
        let Coefficient { value, std, low95, high95, unit, .. } = found.clone();
        (high95 > low95).then(|| FoundCoefficient {
            name: name.clone(),
            unit,
            estimate: Estimate { value, std, low95, high95 },
            truth: truth.coefficients.get(name).copied().unwrap_or(0.0),
        })
    };
    plant.parameters.iter().filter_map(comparison).collect()
}

fn judged(plant: &PlantResult, truth: &TrueVehicle) -> BTreeMap<Dof, Judged> {
    let assess = |(&dof, verdict): (&Dof, &Verdict)| {
        // The error of a model at rest is the mean speed.
        let speed = plant.hold_out.as_ref()?.by_axis.get(&dof)?.null_error;
        let found = |name: &str| plant.parameters.get(name).map_or(0.0, |x| x.value);
        let of_truth = |name: &str| truth.coefficients.get(name).copied().unwrap_or(0.0);
        let drag = |value_of: &dyn Fn(&str) -> f64| {
            let of_product = |product| value_of(&Basis::Product(dof, product).to_string());
            of_product(Product::linear(dof)) * speed
                + of_product(Product::quadratic(dof)) * speed * speed
        };
        let mass = Basis::Mass(dof, dof).to_string();
        let judged = Judged {
            trust: verdict.trust,
            mass_error: found(&mass) / of_truth(&mass) - 1.0,
            drag_error: drag(&found) / drag(&of_truth) - 1.0,
        };
        (drag(&of_truth) > 0.0).then_some((dof, judged))
    };
    plant.verdicts.iter().filter_map(assess).collect()
}

/// Computes errors and coverage of each coefficient, in order of name.
pub fn summarise_vehicle(samples: &[VehicleSample]) -> Vec<CoefficientRow> {
    let mut by_name: BTreeMap<&str, Vec<&FoundCoefficient>> = BTreeMap::new();
    for found in samples.iter().filter_map(|sample| sample.found.as_ref().ok()).flatten() {
        by_name.entry(&found.name).or_default().push(found);
    }
    by_name.into_values().filter_map(|found| row(&found)).collect()
}

fn row(found: &[&FoundCoefficient]) -> Option<CoefficientRow> {
    let first = found.first()?;
    let mut errors: Vec<f64> = found.iter().map(|f| f.estimate.value - f.truth).collect();
    let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
    let covered = found.iter().filter(|f| f.estimate.covers(f.truth)).count();
    Some(CoefficientRow {
        name: first.name.clone(),
        unit: first.unit.clone(),
        truth: first.truth,
        median_abs_error: median(&mut sizes)?,
        median_error: median(&mut errors)?,
        coverage_percent: 100.0 * covered as f64 / found.len() as f64,
        answers: found.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::PlantFile;
    use crate::results::Trust;

    fn sample_of(seed: u64, value: f64, std: f64) -> VehicleSample {
        let estimate = Estimate::new(value, std, 1e6);
        let found = |name: &str, truth| FoundCoefficient {
            name: name.to_owned(),
            unit: "kg".to_owned(),
            estimate,
            truth,
        };
        let found = vec![found("mass.surge", 100.0), found("mass.surge-pitch", 0.0)];
        VehicleSample { seed, found: Ok(found), judged: BTreeMap::new() }
    }

    #[test]
    fn errors_and_coverage_agree_with_hand_calculation() {
        let failed =
            VehicleSample { seed: 4, found: Err("too short".to_owned()), judged: BTreeMap::new() };
        let samples =
            [sample_of(1, 101.0, 1.0), sample_of(2, 97.0, 1.0), sample_of(3, 105.0, 10.0), failed];
        let rows = summarise_vehicle(&samples);
        assert_eq!(rows.len(), 2);
        assert!((rows[0].median_abs_error - 3.0).abs() < 1e-9, "{rows:?}");
        assert!((rows[0].median_error - 1.0).abs() < 1e-9, "{rows:?}");
        assert!((rows[0].coverage_percent - 200.0 / 3.0).abs() < 1e-9, "{rows:?}");
        assert_eq!((rows[0].answers, rows[1].truth, rows[1].coverage_percent), (3, 0.0, 0.0));
    }

    /// A boat with a pair of thrusters that is driven for four minutes.
    #[test]
    fn a_twin_is_identified_and_compared_with_its_truth() {
        let thruster = |name: &str, y: f64| {
            serde_json::json!({
                "name": name, "position_m": [0.0, y, 0.0], "direction": [1.0, 0.0, 0.0],
                "curve": { "kind": "quadratic", "input": "command", "forward": 40.0, "reverse": 30.0 }
            })
        };
        let file: PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
            "axes": ["surge", "yaw"], "mass_matrix": [100.0, 20.0], "linear_damping": [30.0, 15.0],
            "thruster": [thruster("port", -0.5), thruster("starboard", 0.5)]
        }))
        .expect("a table");
        let spec =
            VehicleTwinSpec { duration_s: 120.0, hold_out_s: 120.0, ..VehicleTwinSpec::default() };
        let sample = sample_vehicle(&spec, &file.model().expect("possible")).expect("can be made");
        let found = sample.found.expect("a plant");
        let mass = found.iter().find(|x| x.name == "mass.surge").expect("fitted");
        assert_eq!(mass.truth, 100.0);
        assert!((mass.estimate.value - 100.0).abs() < 2.0, "{mass:?}");
        let judged = sample.judged[&Dof::Yaw];
        assert!(judged.mass_error.abs() < 0.05 && judged.drag_error.abs() < 0.1, "{judged:?}");
        assert!(judged.trust >= Trust::UsableWithCare, "{judged:?}");
    }
}
