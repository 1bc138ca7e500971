//! Probable mistakes of the user, with the plants that they may explain.

use std::collections::BTreeMap;

use super::verdict::verdict;
use crate::diagnose::{Mistake, certain, mistakes};
use crate::results::{Failure, FittedPlant, PlantResult, Results, Trust, Verdict};
use crate::{Caveat, Dof, Trial, Vehicle};

/// Returns probable mistakes of the user: signs, exchanged channels, frames, mounting, units.
///
/// Each is a change of the trials to fit with which least squares explains far more of the
/// acceleration, with the correction in the campaign or the vehicle file.
pub fn likely_mistakes(vehicle: &Vehicle, trials: &[Trial]) -> Vec<Caveat> {
    mistakes(vehicle, trials).iter().map(Mistake::caveat).collect()
}

/// Adds the mistakes that may explain failed fits and doubtful plants to the results.
///
/// A mistake that is not certain is reported only if at least one of its axes is doubtful, and then for all of
/// them.
pub(super) fn name(vehicle: &Vehicle, trials: &[Trial], results: &mut Results) {
    let Results { failures, plants, methods, coupled, .. } = results;
    let verdicts = plants.values().map(|plant| &plant.verdict);
    let mut verdicts = verdicts.chain(coupled.values().map(|plant| &plant.verdict));
    let is_sound = failures.is_empty() && !verdicts.any(is_doubtful);
    let certain = certain(vehicle, trials, heave_kg(plants, coupled));
    if is_sound && certain.is_empty() {
        return;
    }
    let mut found = mistakes(vehicle, trials);
    found.retain(|mistake| {
        if certain.contains(mistake) {
            return true;
        }
        let is_of = |dof: &Dof| mistake.axes.contains(dof);
        let alone = plants.iter().any(|(dof, plant)| is_of(dof) && is_doubtful(&plant.verdict));
        let together =
            |plant: &FittedPlant| is_doubtful(&plant.verdict) && plant.axes.iter().any(&is_of);
        let failed =
            |one: &Failure| is_together(one) || is_of(&one.dof) && !plants.contains_key(&one.dof);
        alone || coupled.values().any(together) || failures.iter().any(failed)
    });
    for failure in failures {
        if is_together(failure) || !plants.contains_key(&failure.dof) {
            explain(failure, &found);
        }
    }
    for (dof, plant) in plants {
        doubt(*dof, plant, &found);
        let of_method = methods.get_mut(dof).and_then(|all| all.get_mut(&plant.method));
        of_method.into_iter().for_each(|same| doubt(*dof, same, &found));
    }
    coupled.values_mut().for_each(|plant| doubt_together(plant, &found));
}

/// Returns the mass of a plant in heave.
fn heave_kg(
    plants: &BTreeMap<Dof, PlantResult>,
    coupled: &BTreeMap<String, FittedPlant>,
) -> Option<f64> {
    let alone = plants.get(&Dof::Heave).map(|plant| plant.parameters.mass.value);
    let mut together = coupled.values().filter_map(|plant| plant.parameters.get("mass.heave"));
    alone.or_else(|| Some(together.next()?.value))
}

fn is_doubtful(verdict: &Verdict) -> bool {
    matches!(verdict.trust, Trust::Doubtful | Trust::DoNotUse)
}

/// Returns true if a failure is of a plant of several axes, of which it names only the first.
fn is_together(failure: &Failure) -> bool {
    failure.method.contains(" together")
}

/// Adds the mistakes to the message of a failed fit.
fn explain(failure: &mut Failure, found: &[Mistake]) {
    let is_of = |one: &&Mistake| is_together(failure) || one.axes.contains(&failure.dof);
    let said: String = found.iter().filter(is_of).map(|one| format!(". {}", one.message)).collect();
    failure.message += &said;
}

fn doubt(dof: Dof, plant: &mut PlantResult, found: &[Mistake]) {
    let own = found.iter().filter(|mistake| mistake.axes.contains(&dof));
    let own: Vec<Caveat> = own.map(Mistake::caveat).collect();
    if !own.is_empty() {
        plant.caveats.splice(0..0, own);
        plant.verdict = verdict(dof, plant);
    }
}

fn doubt_together(plant: &mut FittedPlant, found: &[Mistake]) {
    let is_of = |mistake: &&Mistake| mistake.axes.iter().any(|dof| plant.axes.contains(dof));
    let own: Vec<Caveat> = found.iter().filter(is_of).map(Mistake::caveat).collect();
    let Some(first) = own.first() else { return };
    let reason = format!("severe caveat: {}", first.code.words());
    let mut codes = plant.verdict.codes.clone();
    codes.splice(0..0, own.iter().map(|caveat| caveat.code));
    let before = std::mem::take(&mut plant.verdict);
    plant.verdict = Verdict { trust: Trust::DoNotUse, reason, codes, ..before };
    plant.verdicts.values_mut().for_each(|verdict| verdict.clone_from(&plant.verdict));
    plant.caveats.splice(0..0, own);
}
