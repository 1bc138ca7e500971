//! Unsteady trials and steady runs in one fit, and whether they ask for one plant.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::fit::{freedom, lumped, plant_covariance, terms_of};
use super::parameters::Unknown;
use super::problem::{Kind, Problem};
use super::search::{Fitted, Search};
use crate::estimate::PhysicalEstimates;
use crate::estimate::descend::scaled_inverse;

/// Whether steady runs ask for the drag and bias force that unsteady trials ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyTest {
    /// Twice what the log-likelihood gains if they may differ.
    pub likelihood_ratio: f64,
    /// How many numbers may then differ: terms but the mass.
    pub numbers: usize,
    /// How often chance alone would make as large a gain.
    pub p_value: f64,
    /// Whether they agree, and steady runs are part of the fit.
    pub agrees: bool,
    /// The plant of unsteady trials, if the two may differ.
    pub unsteady: PhysicalEstimates,
    /// The plant of steady runs, of the same mass.
    pub steady: PhysicalEstimates,
}

/// They agree unless chance alone would part them as far once in a hundred campaigns.
const LEAST_P: f64 = 0.01;

/// What steady runs may have by themselves: the mass is the same, since it hardly shows.
const MAY_DIFFER: [Unknown; 3] = [Unknown::Beta, Unknown::Mu, Unknown::Bias];

/// All records fitted with one plant, and with two.
pub(super) struct TwoPlants<'a> {
    pub(super) together: Fitted<'a>,
    apart: Fitted<'a>,
}

impl<'a> TwoPlants<'a> {
    /// `None` if no optimum is reached.
    pub(super) fn fit(unsteady: &Fitted<'_>, search: &Search<'a>) -> Option<Self> {
        let unknowns = unsteady.problem.unknowns();
        let together = search.again(unsteady);
        let Search { records, priors, .. } = *search;
        let fixed = together.problem.fixed;
        let problem = Problem::apart(records, unknowns, &MAY_DIFFER, priors, fixed);
        let apart = Fitted::of(problem, Some(&together), &fixed);
        let converged = together.optimum.converged && apart.optimum.converged;
        converged.then_some(Self { together, apart })
    }

    /// `None` if some number is not seen at all.
    pub(super) fn test(&self) -> Option<SteadyTest> {
        let Fitted { problem, optimum } = &self.apart;
        let numbers = problem.len() - self.together.problem.len();
        let likelihood_ratio = 2.0 * (self.together.optimum.cost - optimum.cost);
        let p_value = ChiSquared::new(numbers as f64).ok()?.sf(likelihood_ratio.max(0.0));
        let all = scaled_inverse(&optimum.information)?;
        let terms = terms_of(problem).ok()?;
        let estimates = |kind: Kind| {
            let record = problem.records.iter().position(|record| record.kind == kind)?;
            let covariance = plant_covariance(problem, &all, record);
            let plant = lumped(problem, optimum, record);
            Some(PhysicalEstimates::of(&plant, &covariance, terms, freedom(problem)))
        };
        Some(SteadyTest {
            likelihood_ratio,
            numbers,
            p_value,
            agrees: p_value >= LEAST_P,
            unsteady: estimates(Kind::Unsteady)?,
            steady: estimates(Kind::Steady)?,
        })
    }
}
