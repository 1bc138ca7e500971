//! What held-out trials would have of mass and drag of each axis.

use std::collections::BTreeMap;

use super::known::{drag_terms, usual_speed};
use crate::estimate::{LikelihoodStep, PlantFit};
use crate::plant::Basis;
use crate::results::{LikelyChange, Part};
use crate::{Dof, Error, Estimate, TrialRecord};

/// Of each axis that has a drag of its own.
///
/// # Errors
/// As [`PlantFit::likelihood_step`].
pub(super) fn changes(
    fit: &PlantFit,
    records: &[&TrialRecord],
) -> Result<BTreeMap<Dof, LikelyChange>, Error> {
    let Some(step) = fit.likelihood_step(records)? else { return Ok(BTreeMap::new()) };
    let of = |&dof: &Dof| {
        let place = fit.plant.structure().index_of(&Basis::Mass(dof, dof))?;
        let drag = drag_terms(fit, dof, usual_speed(dof, records));
        let change = LikelyChange {
            mass: part(fit, &step, dof, &[(place, 1.0)])?,
            drag: part(fit, &step, dof, &drag)?,
            whiteness: *step.whiteness.get(&dof)?,
            surprise: *step.surprise.get(&dof)?,
        };
        // A trial may hold too little of an axis to tell.
        (change.whiteness.is_finite() && change.surprise.is_finite()).then_some((dof, change))
    };
    Ok(fit.plant.axes().iter().filter_map(of).collect())
}

/// The change of a weighted sum of an axis's coefficients, in parts of it; how certain it is as a
/// difference of two estimates, that of the fit and that of the trials, whose colour exaggerates
/// likelihood.
fn part(fit: &PlantFit, step: &LikelihoodStep, dof: Dof, weights: &[(usize, f64)]) -> Option<Part> {
    let sum = |of: &dyn Fn(usize) -> f64| weights.iter().map(|(k, w)| w * of(*k)).sum::<f64>();
    let all = sum(&|k| fit.plant.coefficients()[k]);
    let colour = step.whiteness.get(&dof)?.max(1.0);
    // Thrust of another scale moves both alike.
    let covariance = colour * &step.covariance + &fit.covariance - &fit.thrust_covariance;
    let pairs = weights.iter().flat_map(|a| weights.iter().map(move |b| (a, b)));
    let variance: f64 = pairs.map(|((i, a), (j, b))| a * b * covariance[(*i, *j)]).sum();
    let change = sum(&|k| step.change[k]) / all;
    let std = variance.max(0.0).sqrt() / all.abs();
    (all != 0.0 && change.is_finite() && std.is_finite())
        .then(|| Estimate::new(change, std, fit.samples as f64).into())
}
