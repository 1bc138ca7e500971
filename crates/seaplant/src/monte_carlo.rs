//! Monte Carlo evaluation of methods on twins: errors, coverage and verdicts over many seeds.

mod vehicle;

pub use vehicle::{
    CoefficientRow, FoundCoefficient, VehicleSample, sample_vehicle, summarise_vehicle,
};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::estimate::Candidate;
use crate::results::{Parameter, PlantResult, Results, TermDecision, Trust};
use crate::series::median;
use crate::twin::{TwinPlant, TwinSpec, make};
use crate::{Dof, Error, Estimate, IdentifyOptions, Method, Role, Trial, identify};

/// A parameter of the plant.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterName {
    /// Rigid-body plus added mass.
    Mass,
    /// d_Q.
    QuadraticDrag,
    /// b.
    BiasForce,
}

/// The result of one method for one degree of freedom of one twin.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The twin's seed.
    pub seed: u64,
    /// The degree of freedom.
    pub dof: Dof,
    /// The method.
    pub method: Method,
    /// Its parameters, or the reason of its failure.
    pub found: Result<Vec<Found>, String>,
    /// Candidate terms that it included or excluded.
    pub structure: Vec<TermDecision>,
    /// The verdict and the true errors; for the recommended method only.
    pub judged: Option<Judged>,
}

/// The verdict on a recommended plant, with its true errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Judged {
    /// The verdict.
    pub trust: Trust,
    /// Relative error of mass.
    pub mass_error: f64,
    /// Relative error of drag at the mean speed of held-out trials: quadratic and linear drag are
    /// anticorrelated, so their sum is compared.
    pub drag_error: f64,
}

/// One parameter, estimated and true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// The parameter.
    pub name: ParameterName,
    /// The estimate.
    pub estimate: Estimate,
    /// The true value.
    pub truth: f64,
}

/// The rate at which a candidate is included: of false alarms, or of detections.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Admission {
    /// The degree of freedom.
    pub dof: Dof,
    /// The method.
    pub method: Method,
    /// The candidate.
    pub candidate: Candidate,
    /// Fits that include it, in %.
    pub admitted_percent: f64,
    /// Fits that tested it.
    pub fits: usize,
}

/// Counts of recommended plants with a wrong verdict.
///
/// A plant is wrong if its mass is off by more than 10 % or its drag, at the mean speed of held-out
/// trials, by more than 20 %; it is good if they are within 5 % and 10 %.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Assurance {
    /// The degree of freedom.
    pub dof: Dof,
    /// Recommended plants.
    pub plants: usize,
    /// Wrong plants.
    pub wrong: usize,
    /// False assurance: wrong plants with the verdict usable.
    pub wrong_but_usable: usize,
    /// Wrong plants with the verdict usable with care.
    pub wrong_but_usable_with_care: usize,
    /// Good plants.
    pub good: usize,
    /// False alarms: good plants with the verdict doubtful, or do not use.
    pub good_but_doubted: usize,
}

/// Errors and coverage over all seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Row {
    /// The degree of freedom.
    pub dof: Dof,
    /// The method.
    pub method: Method,
    /// The parameter.
    pub parameter: ParameterName,
    /// Median of |error|, in % of the truth.
    pub median_abs_error_percent: f64,
    /// Median error, in % of the truth, which is the bias.
    pub median_error_percent: f64,
    /// Share of the 95 % intervals that include the truth, in %.
    pub coverage_percent: f64,
    /// Fits with a result.
    pub answers: usize,
    /// Fits without a result.
    pub failures: usize,
}

/// Simulates the twin of one seed and identifies every degree of freedom with every method, from
/// its fitted trial and its held-out one.
///
/// # Errors
/// [`Error::TwinSpec`] for an invalid specification; a failed fit is a sample.
pub fn sample(spec: &TwinSpec, options: &IdentifyOptions) -> Result<Vec<Sample>, Error> {
    let twin = make(spec)?;
    let unsteady = twin.trials.iter().filter(|trial| trial.role != Role::Steady);
    let trials: Vec<Trial> = unsteady.map(|trial| trial.trial(&twin)).collect::<Result<_, _>>()?;
    let options = IdentifyOptions { subsets: false, ..options.clone() };
    let results = identify(&twin.vehicle, &trials, &options).results;
    let pairs = spec.dofs.iter().flat_map(|dof| options.methods.iter().map(move |m| (*dof, *m)));
    Ok(pairs.map(|(dof, method)| sample_of(spec, &results, dof, method)).collect())
}

fn sample_of(spec: &TwinSpec, results: &Results, dof: Dof, method: Method) -> Sample {
    let truth = &spec.plants[&dof];
    let plant = results.method_of(dof, method);
    let failed = || {
        let failed_fit =
            results.failures.iter().find(|f| f.dof == dof && f.method == method.name());
        failed_fit.map_or("no plant was found".to_owned(), |failure| failure.message.clone())
    };
    let recommended = results.plants.get(dof.name()).filter(|plant| plant.method == method);
    Sample {
        seed: spec.seed,
        dof,
        method,
        found: plant.and_then(|plant| compare(dof, truth, plant)).ok_or_else(failed),
        structure: plant.map_or(Vec::new(), |plant| plant.structure.clone()),
        judged: recommended.and_then(|plant| Judged::new(dof, truth, plant)),
    }
}

fn compare(dof: Dof, truth: &TwinPlant, plant: &PlantResult) -> Option<Vec<Found>> {
    let found = plant.by_axis.get(&dof)?;
    let all = [
        (ParameterName::Mass, Some(&found.mass), truth.mass),
        (ParameterName::QuadraticDrag, found.quadratic_drag.as_ref(), truth.d_quadratic),
        (ParameterName::BiasForce, found.bias_force.as_ref(), truth.bias_force),
    ];
    let found = all.into_iter().filter_map(|(name, parameter, truth)| {
        let Parameter { value, std, low95, high95, .. } = *parameter?;
        Some(Found { name, estimate: Estimate { value, std, low95, high95 }, truth })
    });
    Some(found.collect())
}

/// Bounds of the relative errors of mass and drag, for a wrong plant and for a good one.
const WRONG: (f64, f64) = (0.10, 0.20);
const GOOD: (f64, f64) = (0.05, 0.10);

impl Judged {
    /// Compares a plant with the truth; `None` if no trial was held out.
    fn new(dof: Dof, truth: &TwinPlant, plant: &PlantResult) -> Option<Self> {
        // The error of a model at rest is the mean speed.
        let (speed, own) = (plant.held_out(dof)?.null_error, plant.by_axis.get(&dof)?);
        let value = |parameter: &Option<Parameter>| parameter.as_ref().map_or(0.0, |p| p.value);
        let (quadratic, linear) = (value(&own.quadratic_drag), value(&own.linear_drag));
        let at_speed = |quadratic: f64, linear: f64| quadratic * speed * speed + linear * speed;
        Some(Self {
            trust: plant.verdict.trust,
            mass_error: own.mass.value / truth.mass - 1.0,
            drag_error: at_speed(quadratic, linear) / at_speed(truth.d_quadratic, truth.d_linear)
                - 1.0,
        })
    }

    /// Returns whether both errors are within bounds; NaN is not.
    fn within(&self, (mass, drag): (f64, f64)) -> bool {
        self.mass_error.abs() <= mass && self.drag_error.abs() <= drag
    }
}

/// Counts wrong verdicts by degree of freedom.
pub fn assurance(judged: &[(Dof, Judged)]) -> Vec<Assurance> {
    let of_dof = |dof| {
        let selected = judged.iter().filter(|(own, _)| *own == dof);
        let judged: Vec<Judged> = selected.map(|(_, judged)| *judged).collect();
        let (good, wrong): (Vec<Judged>, Vec<Judged>) = (
            judged.iter().copied().filter(|plant| plant.within(GOOD)).collect(),
            judged.iter().copied().filter(|plant| !plant.within(WRONG)).collect(),
        );
        let count = |plants: &[Judged], verdicts: &[Trust]| {
            plants.iter().filter(|plant| verdicts.contains(&plant.trust)).count()
        };
        (!judged.is_empty()).then(|| Assurance {
            dof,
            plants: judged.len(),
            wrong: wrong.len(),
            wrong_but_usable: count(&wrong, &[Trust::Usable]),
            wrong_but_usable_with_care: count(&wrong, &[Trust::UsableWithCare]),
            good: good.len(),
            good_but_doubted: count(&good, &[Trust::Doubtful, Trust::DoNotUse]),
        })
    };
    Dof::ALL.into_iter().filter_map(of_dof).collect()
}

/// Computes errors and coverage for each degree of freedom, method and parameter.
pub fn summarise(samples: &[Sample]) -> Vec<Row> {
    let mut rows = Vec::new();
    for dof in Dof::ALL {
        for method in Method::ALL {
            let selected: Vec<&Sample> =
                samples.iter().filter(|s| s.dof == dof && s.method == method).collect();
            let failures = selected.iter().filter(|sample| sample.found.is_err()).count();
            for parameter in
                [ParameterName::Mass, ParameterName::QuadraticDrag, ParameterName::BiasForce]
            {
                let found =
                    selected.iter().filter_map(|sample| sample.found.as_ref().ok()).flatten();
                let found: Vec<&Found> = found.filter(|found| found.name == parameter).collect();
                rows.extend(row(dof, method, parameter, &found, failures));
            }
        }
    }
    rows
}

/// Counts how often each candidate is included.
pub fn admissions(samples: &[Sample]) -> Vec<Admission> {
    let mut all = Vec::new();
    for dof in Dof::ALL {
        for method in Method::ALL {
            for candidate in Candidate::ALL {
                let selected = samples.iter().filter(|s| s.dof == dof && s.method == method);
                let decisions = selected.flat_map(|sample| &sample.structure);
                let decided: Vec<bool> = decisions
                    .filter(|decision| decision.candidate == candidate.name())
                    .map(|decision| decision.admitted)
                    .collect();
                let fits = decided.len();
                if fits > 0 {
                    let admitted = decided.iter().filter(|admitted| **admitted).count();
                    let admitted_percent = 100.0 * admitted as f64 / fits as f64;
                    all.push(Admission { dof, method, candidate, admitted_percent, fits });
                }
            }
        }
    }
    all
}

fn row(
    dof: Dof,
    method: Method,
    parameter: ParameterName,
    found: &[&Found],
    failures: usize,
) -> Option<Row> {
    let error = |f: &&Found| 100.0 * (f.estimate.value - f.truth) / f.truth;
    let mut errors: Vec<f64> = found.iter().map(error).collect();
    let mut sizes: Vec<f64> = errors.iter().map(|e| e.abs()).collect();
    let covered = found.iter().filter(|f| f.estimate.covers(f.truth)).count();
    Some(Row {
        dof,
        method,
        parameter,
        median_abs_error_percent: median(&mut sizes)?,
        median_error_percent: median(&mut errors)?,
        coverage_percent: 100.0 * covered as f64 / found.len() as f64,
        answers: found.len(),
        failures,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample_of(error: f64, std: f64) -> Sample {
        let estimate = Estimate::new(100.0 * (1.0 + error), std, 1e6);
        let found = Found { name: ParameterName::Mass, estimate, truth: 100.0 };
        let structure = vec![TermDecision {
            candidate: Candidate::LinearDrag.name().to_owned(),
            likelihood_ratio: 1.0,
            p_value: None,
            needed: Some(8.5),
            size: None,
            admitted: error > 0.0,
        }];
        Sample {
            seed: 1,
            dof: Dof::Surge,
            method: Method::Paper,
            found: Ok(vec![found]),
            structure,
            judged: None,
        }
    }

    #[test]
    fn errors_coverage_and_failures_agree_with_hand_calculation() {
        let failed = Sample { found: Err("no trial".to_owned()), ..sample_of(0.0, 1.0) };
        let samples = [sample_of(0.01, 1.0), sample_of(-0.03, 1.0), sample_of(0.05, 10.0), failed];
        let rows = summarise(&samples);
        assert_eq!(rows.len(), 1);
        assert!((rows[0].median_abs_error_percent - 3.0).abs() < 1e-9);
        assert!((rows[0].median_error_percent - 1.0).abs() < 1e-9);
        assert!((rows[0].coverage_percent - 200.0 / 3.0).abs() < 1e-9);
        assert_eq!((rows[0].answers, rows[0].failures), (3, 1));
    }

    #[test]
    fn counts_how_often_a_candidate_is_included() {
        let samples = [sample_of(0.01, 1.0), sample_of(-0.03, 1.0), sample_of(0.05, 10.0)];
        let found = admissions(&samples);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].candidate, found[0].fits), (Candidate::LinearDrag, 3));
        assert!((found[0].admitted_percent - 200.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn false_assurance_and_false_alarms_agree_with_hand_calculation() {
        use Trust::{DoNotUse, Doubtful, Usable, UsableWithCare};
        let judged =
            |trust, mass_error, drag_error| (Dof::Surge, Judged { trust, mass_error, drag_error });
        let samples = [
            judged(Usable, 0.01, -0.02),
            judged(Usable, -0.11, 0.0),
            judged(UsableWithCare, 0.0, 0.3),
            judged(DoNotUse, 0.0, f64::NAN),
            judged(Doubtful, 0.04, 0.09),
            judged(Doubtful, 0.07, 0.15),
        ];
        let expected = Assurance {
            dof: Dof::Surge,
            plants: 6,
            wrong: 3,
            wrong_but_usable: 1,
            wrong_but_usable_with_care: 1,
            good: 2,
            good_but_doubted: 1,
        };
        assert_eq!(assurance(&samples), [expected]);
    }

    #[test]
    fn only_the_recommended_plant_is_judged_and_by_its_total_drag() {
        let mut spec = TwinSpec { duration_s: 120.0, ..TwinSpec::jason2() };
        spec.dofs = [Dof::Surge].into();
        let methods = vec![Method::OutputError, Method::Paper];
        let samples = sample(&spec, &IdentifyOptions { methods, ..Default::default() });
        let samples = samples.expect("a twin that can be");
        let judged: Vec<Method> =
            samples.iter().filter(|s| s.judged.is_some()).map(|s| s.method).collect();
        assert_eq!(judged, [Method::OutputError]);
        let plant = samples[0].judged.expect("just found");
        assert!(plant.within(GOOD) && plant.trust >= Trust::UsableWithCare, "{plant:?}");
        let drag = samples[0].found.as_ref().expect("fitted")[1];
        let error = drag.estimate.value / drag.truth - 1.0;
        assert!((plant.drag_error - error).abs() < 1e-12, "without linear drag that is all");
    }

    #[test]
    fn a_failed_fit_reports_its_reason() {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), ..TwinSpec::jason2() };
        let results =
            identify(&make(&spec).expect("a twin").vehicle, &[], &IdentifyOptions::default())
                .results;
        let sample = super::sample_of(&spec, &results, Dof::Surge, Method::Paper);
        assert_eq!(sample.found, Err("no plant was found".to_owned()));
    }

    #[test]
    fn equal_seeds_give_equal_samples() {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 60.0, ..TwinSpec::jason2() };
        let options =
            IdentifyOptions { methods: vec![Method::EquationError], ..Default::default() };
        assert_eq!(sample(&spec, &options), sample(&spec, &options));
    }
}
