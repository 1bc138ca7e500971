//! Unsteady trials and steady runs in one fit, and whether they ask for one plant.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::fit::{freedom, lumped, plant_covariance, terms_of};
use super::minimise::Effort;
use super::parameters::Unknown;
use super::problem::{Kind, Problem};
use super::search::{Fitted, Search};
use crate::estimate::PhysicalEstimates;
use crate::estimate::descend::{scaled_inverse, unit_diagonal};

/// Whether steady runs ask for the drag and bias force that unsteady trials ask for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyTest {
    /// Twice what the log-likelihood gains if they may differ; by Wald's test where they differ so
    /// clearly that no fit with one plant was made.
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

/// All records fitted with one plant for each kind, and with one for all where they agree.
pub(super) struct TwoPlants<'a> {
    apart: Fitted<'a>,
    /// Wald's statistic of the difference between the two plants, and how many numbers may differ.
    wald: (f64, usize),
    together: Option<Fitted<'a>>,
}

impl<'a> TwoPlants<'a> {
    /// Fits a plant to each kind, and one plant to all records where the two do not differ.
    ///
    /// Each kind starts from its own fit: a start that suits only a part of the records leads to a
    /// poor optimum. Two plants that clearly differ are not fitted together, which has none.
    ///
    /// Returns `None` if no optimum is reached.
    pub(super) fn fit(unsteady: &Fitted<'_>, search: &Search<'a>) -> Option<Self> {
        let Search { records, priors, .. } = *search;
        let (unknowns, fixed) = (unsteady.problem.unknowns(), unsteady.problem.fixed);
        let first = records.iter().position(|record| record.kind == Kind::Steady)?;
        let steady = steady_alone(unsteady, &Search { records: &records[first..], ..*search });
        let start = |fitted: &Fitted<'_>, unknown, record| {
            fitted.value(unknown, record).unwrap_or_else(|| fixed.get(unknown))
        };
        let each_from_its_own = |unknown: Unknown, record: usize| {
            let is_own = unknown.is_of_trial() || MAY_DIFFER.contains(&unknown);
            match record.checked_sub(first).filter(|_| is_own) {
                Some(record) => start(&steady, unknown, record),
                None => start(unsteady, unknown, record),
            }
        };
        let problem = Problem::apart(records, unknowns, &MAY_DIFFER, priors, fixed);
        let apart = Fitted::from_start(problem, each_from_its_own, Effort::FINE);
        let wald = apart.optimum.converged.then(|| difference(&apart, first))??;
        let together = (p_value(wald)? >= LEAST_P).then(|| {
            let problem = Problem::new(records, unknowns, priors, fixed);
            Fitted::within(problem, Some(&apart), &fixed, Effort::FINE)
        });
        let together = together.filter(|together| together.optimum.converged);
        Some(Self { apart, wald, together })
    }

    /// Returns the fit with one plant if the kinds agree by the likelihood ratio, and the test.
    ///
    /// Returns `None` if some number is not determined.
    pub(super) fn tested(self) -> Option<(Option<Fitted<'a>>, SteadyTest)> {
        let Self { apart, wald: (wald, numbers), together } = self;
        let Fitted { problem, optimum } = &apart;
        let gain = |together: &Fitted<'_>| 2.0 * (together.optimum.cost - optimum.cost);
        // More numbers always gain something: no gain means that an optimum was missed.
        let together = together.filter(|together| gain(together) > 0.0);
        let likelihood_ratio = together.as_ref().map_or(wald, gain);
        let p_value = p_value((likelihood_ratio, numbers))?;
        let together = together.filter(|_| p_value >= LEAST_P);
        let all = scaled_inverse(&optimum.information)?;
        let terms = terms_of(problem).ok()?;
        let estimates = |kind: Kind| {
            let record = problem.records.iter().position(|record| record.kind == kind)?;
            let covariance = plant_covariance(problem, &all, record);
            let plant = lumped(problem, optimum, record);
            Some(PhysicalEstimates::of(&plant, &covariance, terms, freedom(problem)))
        };
        let test = SteadyTest {
            likelihood_ratio,
            numbers,
            p_value,
            agrees: together.is_some(),
            unsteady: estimates(Kind::Unsteady)?,
            steady: estimates(Kind::Steady)?,
        };
        Some((together, test))
    }
}

/// Computes `Δᵀ Σ⁻¹ Δ` of the difference Δ between the plants of both kinds, and its length.
fn difference(apart: &Fitted<'_>, first_steady: usize) -> Option<(f64, usize)> {
    let Fitted { problem, optimum } = apart;
    let pairs = MAY_DIFFER.iter().filter_map(|unknown| {
        problem.index(*unknown, 0).zip(problem.index(*unknown, first_steady))
    });
    let pairs: Vec<(usize, usize)> = pairs.collect();
    let (of, less): (Vec<usize>, Vec<usize>) = pairs.into_iter().unzip();
    let all = scaled_inverse(&optimum.information)?;
    let block = |rows: &[usize], columns: &[usize]| all.select_rows(rows).select_columns(columns);
    let covariance = block(&of, &of) + block(&less, &less) - block(&of, &less) - block(&less, &of);
    let delta = optimum.theta.select_rows(&of) - optimum.theta.select_rows(&less);
    let scale = unit_diagonal(&covariance);
    let scaled = (&scale * covariance * &scale).cholesky()?;
    let delta = scale * delta;
    Some((delta.dot(&scaled.solve(&delta)), of.len()))
}

/// How often chance alone makes as large a statistic with so many degrees of freedom.
fn p_value((statistic, numbers): (f64, usize)) -> Option<f64> {
    Some(ChiSquared::new(numbers as f64).ok()?.sf(statistic))
}

/// Fits drag, bias force and noise of steady runs alone, at the mass and the nuisances of the
/// unsteady trials.
fn steady_alone<'a>(unsteady: &Fitted<'_>, search: &Search<'a>) -> Fitted<'a> {
    let fixed = unsteady.problem.values(&unsteady.optimum.theta, 0);
    let is_own = |unknown: &Unknown| {
        MAY_DIFFER.contains(unknown) || unknown.is_of_trial() || unknown.is_noise()
    };
    let own: Vec<Unknown> = unsteady.problem.unknowns().iter().copied().filter(is_own).collect();
    Fitted::of(Problem::new(search.records, &own, search.priors, fixed), None, &fixed)
}
