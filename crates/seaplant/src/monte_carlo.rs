//! How well a method does on a twin: errors and coverage over many seeds.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::estimate::{Candidate, Decision};
use crate::identify::fit_of_trials;
use crate::series::median;
use crate::twin::{TwinSpec, TwinTrial, make};
use crate::{Dof, Error, Estimate, Fit, IdentifyOptions, Method, Role, Trial, TrialSetup};

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

/// What one method found of one degree of freedom of one twin.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// The twin's seed.
    pub seed: u64,
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which method.
    pub method: Method,
    /// What it found, or why it did not.
    pub found: Result<Vec<Found>, Error>,
    /// Which parts it took into its model, and which not.
    pub structure: Vec<Decision>,
}

/// One parameter, found and true.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Which.
    pub name: ParameterName,
    /// As found.
    pub estimate: Estimate,
    /// As it is.
    pub truth: f64,
}

/// How often a part was taken into the model: a false alarm, or a detection.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Admission {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which method.
    pub method: Method,
    /// Which part.
    pub candidate: Candidate,
    /// Fits that have it, in %.
    pub admitted_percent: f64,
    /// Fits that decided.
    pub fits: usize,
}

/// Errors and coverage over all seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Row {
    /// Which degree of freedom.
    pub dof: Dof,
    /// Which method.
    pub method: Method,
    /// Which parameter.
    pub parameter: ParameterName,
    /// Median of |error|, in % of the truth.
    pub median_abs_error_percent: f64,
    /// Median error, in % of the truth: what is left of it is bias.
    pub median_error_percent: f64,
    /// Part of the 95 % intervals that hold the truth, in %.
    pub coverage_percent: f64,
    /// Fits that gave an answer.
    pub answers: usize,
    /// Fits that gave none.
    pub failures: usize,
}

/// Makes the twin of one seed and fits every degree of freedom with every method.
///
/// # Errors
/// [`Error::TwinSpec`] for a twin that cannot be made; a fit that fails is a sample.
pub fn sample(spec: &TwinSpec, options: &IdentifyOptions) -> Result<Vec<Sample>, Error> {
    let twin = make(spec)?;
    let mut samples = Vec::new();
    for &dof in &spec.dofs {
        let of = |role| -> Result<Vec<Trial>, Error> {
            let wanted = |trial: &&TwinTrial| trial.dof == dof && trial.role == role;
            let trials = twin.trials.iter().filter(wanted);
            trials.map(|trial| as_trial(trial, &twin.vehicle)).collect()
        };
        let (fit, hold_out) = (of(Role::Fit)?, of(Role::HoldOut)?);
        for &method in &options.methods {
            let fitted = fit_of_trials(dof, &twin.vehicle, &fit, &hold_out, method, options);
            let structure = fitted.as_ref().map_or(Vec::new(), |fit| fit.structure.clone());
            let found = fitted.map(|fit| compare(spec, dof, &fit));
            samples.push(Sample { seed: spec.seed, dof, method, found, structure });
        }
    }
    Ok(samples)
}

fn as_trial(trial: &TwinTrial, vehicle: &crate::Vehicle) -> Result<Trial, Error> {
    let setup = TrialSetup {
        name: trial.name.clone(),
        role: trial.role,
        dofs: vec![trial.dof],
        ..Default::default()
    };
    Trial::new(setup, &trial.recording, vehicle)
}

fn compare(spec: &TwinSpec, dof: Dof, fit: &Fit) -> Vec<Found> {
    let estimates = fit.estimates();
    let truth = &spec.plants[&dof];
    [
        (ParameterName::Mass, Some(estimates.mass), truth.mass),
        (ParameterName::QuadraticDrag, estimates.d_quadratic, truth.d_quadratic),
        (ParameterName::BiasForce, estimates.bias_force, truth.bias_force),
    ]
    .into_iter()
    .filter_map(|(name, estimate, truth)| Some(Found { name, estimate: estimate?, truth }))
    .collect()
}

/// Errors and coverage of each degree of freedom, method and parameter.
pub fn summarise(samples: &[Sample]) -> Vec<Row> {
    let mut rows = Vec::new();
    for dof in Dof::ALL {
        for method in Method::ALL {
            let of: Vec<&Sample> =
                samples.iter().filter(|s| s.dof == dof && s.method == method).collect();
            let failures = of.iter().filter(|sample| sample.found.is_err()).count();
            for parameter in
                [ParameterName::Mass, ParameterName::QuadraticDrag, ParameterName::BiasForce]
            {
                let found = of.iter().filter_map(|sample| sample.found.as_ref().ok()).flatten();
                let found: Vec<&Found> = found.filter(|found| found.name == parameter).collect();
                rows.extend(row(dof, method, parameter, &found, failures));
            }
        }
    }
    rows
}

/// How often each part was taken into the model.
pub fn admissions(samples: &[Sample]) -> Vec<Admission> {
    let mut all = Vec::new();
    for dof in Dof::ALL {
        for method in Method::ALL {
            for candidate in Candidate::ALL {
                let of = samples.iter().filter(|s| s.dof == dof && s.method == method);
                let decisions = of.flat_map(|sample| &sample.structure);
                let decided: Vec<bool> = decisions
                    .filter(|decision| decision.candidate == candidate)
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
        let structure = vec![Decision {
            candidate: Candidate::LinearDrag,
            likelihood_ratio: 1.0,
            needed: 8.5,
            size: None,
            hold_out_ratio: None,
            admitted: error > 0.0,
        }];
        Sample {
            seed: 1,
            dof: Dof::Surge,
            method: Method::Paper,
            found: Ok(vec![found]),
            structure,
        }
    }

    #[test]
    fn counts_errors_coverage_and_failures_by_hand() {
        let failed =
            Sample { found: Err(Error::NoTrial { dof: Dof::Surge }), ..sample_of(0.0, 1.0) };
        let samples = [sample_of(0.01, 1.0), sample_of(-0.03, 1.0), sample_of(0.05, 10.0), failed];
        let rows = summarise(&samples);
        assert_eq!(rows.len(), 1);
        assert!((rows[0].median_abs_error_percent - 3.0).abs() < 1e-9);
        assert!((rows[0].median_error_percent - 1.0).abs() < 1e-9);
        assert!((rows[0].coverage_percent - 200.0 / 3.0).abs() < 1e-9);
        assert_eq!((rows[0].answers, rows[0].failures), (3, 1));
    }

    #[test]
    fn counts_how_often_a_part_was_taken_in() {
        let samples = [sample_of(0.01, 1.0), sample_of(-0.03, 1.0), sample_of(0.05, 10.0)];
        let found = admissions(&samples);
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].candidate, found[0].fits), (Candidate::LinearDrag, 3));
        assert!((found[0].admitted_percent - 200.0 / 3.0).abs() < 1e-9);
    }

    #[test]
    fn equal_seeds_give_equal_samples() {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 60.0, ..TwinSpec::jason2() };
        let options =
            IdentifyOptions { methods: vec![Method::EquationError], ..Default::default() };
        assert_eq!(sample(&spec, &options), sample(&spec, &options));
    }
}
