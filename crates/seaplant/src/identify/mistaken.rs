//! Probable mistakes of the user, with the plants that they may explain.

use std::collections::BTreeMap;

use super::verdict::verdict;
use crate::diagnose::{Mistake, certain, mistakes};
use crate::results::{Failure, PlantResult, Results, Trust, Verdict};
use crate::trial::Miswired;
use crate::{Caveat, CaveatCode, Dof, Role, Severity, Trial, Vehicle};

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
    let Results { failures, plants, .. } = results;
    let is_sound = failures.is_empty() && !plants.values().any(|plant| is_doubtful(&plant.verdict));
    let certain = certain(vehicle, trials, heave_kg(plants));
    if is_sound && certain.is_empty() {
        return;
    }
    let mut found = mistakes(vehicle, trials);
    found.retain(|mistake| {
        if certain.contains(mistake) {
            return true;
        }
        let is_of = |dof: &Dof| mistake.axes.contains(dof);
        let doubtful =
            |plant: &PlantResult| is_doubtful(&plant.verdict) && plant.axes.iter().any(&is_of);
        let failed = |one: &Failure| is_together(one) || is_of(&one.dof) && !has_plant(plants, one);
        plants.values().any(doubtful) || failures.iter().any(failed)
    });
    let impossible = impossible_values(trials);
    for failure in failures {
        if is_together(failure) || !has_plant(plants, failure) {
            failure.message += &impossible;
            explain(failure, &found);
        }
    }
    plants.values_mut().for_each(|plant| doubt(plant, &found));
}

/// Returns sentences on values that no vehicle reaches, of the first fitted trial with any: a plant has these as
/// caveats, but a failed fit has no plant.
fn impossible_values(trials: &[Trial]) -> String {
    let severe = |caveat: &&Caveat| {
        caveat.code == CaveatCode::SuspiciousUnit && caveat.severity == Severity::Severe
    };
    let said = |trial: &Trial| -> String {
        let all = trial.caveats_of_log().iter().filter(severe);
        all.map(|caveat| format!(". {}", caveat.message)).collect()
    };
    let fitted = trials.iter().filter(|trial| trial.role() == Role::Fit);
    fitted.map(said).find(|said| !said.is_empty()).unwrap_or_default()
}

/// Returns whether the axis of a failed fit has a plant by another method.
fn has_plant(plants: &BTreeMap<String, PlantResult>, failure: &Failure) -> bool {
    plants.get(failure.dof.name()).is_some_and(PlantResult::is_alone)
}

/// Returns the mass of a plant in heave.
fn heave_kg(plants: &BTreeMap<String, PlantResult>) -> Option<f64> {
    let mass = |plant: &PlantResult| Some(plant.parameters.get("mass.heave")?.value);
    let alone = plants.get(Dof::Heave.name()).and_then(mass);
    alone.or_else(|| plants.values().find_map(mass))
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

/// Returns whether a plant takes thrusters as they act.
fn has_allowed_for(plant: &PlantResult, mistake: &Mistake) -> bool {
    match &mistake.thrusters {
        None => false,
        Some(Miswired::Exchanged([a, b])) => {
            let is_pair = |[c, d]: &[String; 2]| [c, d] == [a, b] || [d, c] == [a, b];
            plant.thrusters_exchanged.iter().any(is_pair)
        }
        Some(Miswired::Reversed(name)) => {
            plant.thruster_gains().get(name).is_some_and(|gain| gain.forward < 0.0)
        }
    }
}

fn doubt(plant: &mut PlantResult, found: &[Mistake]) {
    let is_of = |mistake: &&Mistake| mistake.axes.iter().any(|dof| plant.axes.contains(dof));
    let own = found.iter().filter(is_of).filter(|mistake| !has_allowed_for(plant, mistake));
    let own: Vec<Caveat> = own.map(Mistake::caveat).collect();
    let Some(first) = own.first() else { return };
    let reason = format!("severe caveat: {}", first.code.words());
    let mut codes = plant.verdict.codes.clone();
    codes.splice(0..0, own.iter().map(|caveat| caveat.code));
    plant.caveats.splice(0..0, own);
    if plant.is_alone() {
        plant.verdict = verdict(plant);
        return;
    }
    let before = std::mem::take(&mut plant.verdict);
    plant.verdict = Verdict { trust: Trust::DoNotUse, reason, codes, ..before };
    plant.verdicts.values_mut().for_each(|verdict| verdict.clone_from(&plant.verdict));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Method;

    fn doubted(thrusters: Miswired) -> bool {
        let mut plant = PlantResult::empty(vec![Dof::Surge, Dof::Yaw], Method::FilterError);
        plant.thrusters_exchanged = vec![["a".to_owned(), "b".to_owned()]];
        let (axes, message) = (vec![Dof::Yaw], "one".to_owned());
        doubt(&mut plant, &[Mistake { axes, message, thrusters: Some(thrusters) }]);
        plant.verdict.trust == Trust::DoNotUse
    }

    #[test]
    fn a_plant_is_not_doubted_for_what_it_has_allowed_for() {
        let pair = |a: &str, b: &str| Miswired::Exchanged([a.to_owned(), b.to_owned()]);
        assert!(!doubted(pair("a", "b")) && !doubted(pair("b", "a")));
        assert!(doubted(pair("a", "c")) && doubted(Miswired::Reversed("a".to_owned())));
    }
}
