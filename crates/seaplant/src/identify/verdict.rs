//! The verdict on a plant of one axis.

use crate::judge::{
    Judge, PREDICTS, Score, Trust, Verdict, explains, free_error, statement, vouched,
};
use crate::results::{GoodFor, MayBeOff, PlantResult};
use crate::{CaveatCode, Stability};

/// Maximum prediction error of a confirmed plant, relative to that of the best model without a
/// plant.
const BEATS_NULL: f64 = 0.85;

/// Factor up to which velocity noise may hide that a plant is better: noise brings the errors
/// closer together, but does not make the better one larger by more than chance.
const HIDDEN_BY_NOISE: f64 = 1.1;

/// Returns true for caveats that leave a plant unconfirmed even as warnings.
const fn is_doubt(code: CaveatCode) -> bool {
    matches!(code, CaveatCode::NotDetermined | CaveatCode::CoupledAxes)
}

/// Judges a plant by its stability, its caveats and its error on trials outside the fit. Takes the
/// confirmed motion and the possible errors of numbers from the present verdict.
pub(crate) fn verdict(plant: &PlantResult) -> Verdict {
    let mut verdict = judged_by_errors(plant);
    let Verdict { good_for, mut may_be_off, .. } = plant.verdict.clone();
    if let Some(exceptions) = good_for.as_ref().and_then(GoodFor::exceptions)
        && verdict.trust >= Trust::UsableWithCare
    {
        verdict.trust = Trust::UsableWithCare;
        verdict.reason += &format!("; but not {exceptions}");
    }
    may_be_off.retain(|off| off.matters(verdict.trust));
    Verdict { good_for, may_be_off, ..verdict }
}

fn judged_by_errors(plant: &PlantResult) -> Verdict {
    let dof = plant.first_axis();
    let judge = Judge(&plant.caveats);
    let of = |trust, reason: String| judge.verdict(trust, reason);
    let unit = dof.units().velocity;
    if let Some(alone) = plant.alone.as_ref().filter(|alone| !alone.stable) {
        let how = match alone.stability {
            Stability::Stable | Stability::Unstable => String::new(),
            _ => format!(" {unit}"),
        };
        return of(Trust::DoNotUse, format!("the model {}{how}", plant_is(&alone.stability)));
    }
    if let Some(verdict) = judge.severe() {
        return verdict;
    }
    let tested = plant.hold_out.as_ref().or(plant.left_out.as_ref());
    let own = tested.and_then(|tested| Some((tested, tested.by_axis.get(&dof)?)));
    let Some((tested, score)) = own else {
        return of(Trust::Doubtful, "no held-out trial has tested it".to_owned());
    };
    let trials = match &plant.hold_out {
        Some(held) => held_out(held.by_trial.len()),
        None => "trials that were left out in turn".to_owned(),
    };
    let unit = score.quantity.unit(dof);
    let Some(e) = score.mean_abs_error else {
        return of(Trust::DoNotUse, format!("its simulation of {trials} diverges"));
    };
    let against = format!(
        "{trials} with e = {} {unit} against {} for {}",
        spoken2(e),
        spoken2(score.null_error),
        score.quantity.null_model(),
    );
    let vouched = vouched(score, tested.trials(dof).map(|(_, score)| score));
    if free_error(score) > PREDICTS * score.null_error
        && !vouched
        && !explains(score.quantity, score.r_squared)
    {
        return of(Trust::Doubtful, format!("it predicts {against}"));
    }
    if let Some(reason) = no_better_than_null(score, &trials, unit, vouched) {
        return of(Trust::Doubtful, reason);
    }
    if plant.verdict.good_for.as_ref().is_some_and(GoodFor::is_nothing) && !vouched {
        return of(Trust::Doubtful, format!("none of {trials} by itself confirms it"));
    }
    if let Some(doubt) = judge.warnings().find(|caveat| is_doubt(caveat.code)) {
        return of(Trust::Doubtful, statement(&doubt.message));
    }
    let warns = |code| judge.warnings().any(|caveat| caveat.code == code);
    if warns(CaveatCode::AnotherPlantFits)
        && [plant.fitted(dof), Some(score)]
            .into_iter()
            .filter_map(|score| score?.change)
            .any(|change| change.refutes())
    {
        let reason = "what trials ask for is further off than a usable plant may be".to_owned();
        return of(Trust::Doubtful, reason);
    }
    let is_wide = warns(CaveatCode::WideInterval);
    if is_wide && warns(CaveatCode::NoBetterThanNull) {
        let reason = "its interval is wide, and on a held-out trial it is no better than a model that never moves";
        return of(Trust::Doubtful, reason.to_owned());
    }
    // An interval that is wide enough to include the values that trials support is not contradicted
    // by them.
    let off = &plant.verdict.may_be_off;
    let is_beyond = off.is_empty() || off.iter().any(MayBeOff::is_beyond_interval);
    if is_wide && is_beyond && warns(CaveatCode::AnotherPlantFits) {
        let reason = "its interval is wide, and the trials contradict it nevertheless".to_owned();
        return of(Trust::Doubtful, reason);
    }
    if is_wide && warns(CaveatCode::ResidualsNotWhite) {
        let reason = "its interval is wide, and something moves the vehicle that the model lacks";
        return of(Trust::Doubtful, reason.to_owned());
    }
    if plant.hold_out.is_none() && judge.warnings().next().is_none() {
        return of(Trust::UsableWithCare, format!("no trial was held out; it predicts {against}"));
    }
    judge.confirmed(Trust::Usable, &format!("predicts {against}"))
}

/// Null models get the trials' offsets, so that the plant does as well.
fn no_better_than_null(score: &Score, trials: &str, unit: &str, vouched: bool) -> Option<String> {
    let null = score.best_null?;
    let e = free_error(score);
    let most = if vouched { HIDDEN_BY_NOISE } else { BEATS_NULL };
    (e > most * null.mean_abs_error).then(|| {
        format!(
            "it predicts {trials} with e = {} {unit}, hardly better than {} with {}",
            spoken2(e),
            null.model.description(),
            spoken2(null.mean_abs_error)
        )
    })
}

/// Returns "the held-out trial" or "the 3 held-out trials".
fn held_out(trials: usize) -> String {
    match trials {
        0 | 1 => "the held-out trial".to_owned(),
        n => format!("the {n} held-out trials"),
    }
}

fn plant_is(stability: &Stability) -> String {
    match stability {
        Stability::Stable => "is stable".to_owned(),
        Stability::Unstable => "is unstable: nothing opposes motion".to_owned(),
        other => other.to_string(),
    }
}

/// Formats a number to two significant digits.
fn spoken2(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    let decimals = (1 - x.abs().log10().floor() as i32).clamp(0, 9) as usize;
    format!("{x:.decimals$}")
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::identify;
    use crate::results::{NullModel, NullScore, PlantChange};
    use crate::twin::{TwinSpec, make};
    use crate::{Caveat, Dof, Estimate, IdentifyOptions, Method, Trial, TrialSetup};

    /// Returns a plant of the twin by equation error, without caveats.
    fn plant() -> PlantResult {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 120.0, ..TwinSpec::jason2() };
        let dive = make(&spec).expect("valid");
        let trial = |log: &crate::twin::TwinTrial| {
            let (name, role, dofs) = (log.name.clone(), log.role, log.dofs.clone());
            let setup = TrialSetup { name, role, dofs, ..TrialSetup::default() };
            Trial::new(setup, &log.recording, &dive.vehicle).expect("complete")
        };
        let trials: Vec<Trial> = dive.trials.iter().map(trial).collect();
        let options =
            IdentifyOptions { methods: vec![Method::EquationError], ..IdentifyOptions::default() };
        let mut plant = identify(&dive.vehicle, &trials, &options).results.plants["surge"].clone();
        plant.caveats.clear();
        plant
    }

    fn judged(change: impl FnOnce(&mut PlantResult)) -> Verdict {
        let mut plant = plant();
        change(&mut plant);
        verdict(&plant)
    }

    /// Adds a held-out score in which only the errors matter.
    fn scored(plant: &mut PlantResult, e: Option<f64>, null: Option<f64>) {
        let held = plant.hold_out.as_mut().expect("the twin has one");
        let trials = held.by_trial.values_mut().flat_map(BTreeMap::values_mut);
        trials.for_each(|trial| trial.position_r_squared = None);
        let score = held.by_axis.get_mut(&Dof::Surge).expect("its axis");
        (score.mean_abs_error, score.offset_free_error, score.change) = (e, e, None);
        score.null_error = 0.11;
        let model = NullModel::SteadySpeed;
        score.best_null = null.map(|mean_abs_error| NullScore { model, mean_abs_error });
    }

    #[test]
    fn a_predicting_plant_is_usable_and_with_warnings_usable_with_care() {
        let found = judged(|plant| scored(plant, Some(0.021), Some(0.09)));
        assert_eq!(found.trust, Trust::Usable);
        assert!(found.reason.contains("e = 0.021 m/s against 0.11"), "{}", found.reason);
        let warning = Caveat::warning(CaveatCode::Collinear, "x");
        let found = judged(|plant| plant.caveats = vec![warning]);
        assert_eq!(
            (found.trust, found.codes),
            (Trust::UsableWithCare, vec![CaveatCode::Collinear])
        );
    }

    #[test]
    fn an_untested_or_undetermined_plant_is_doubtful() {
        assert_eq!(judged(|plant| plant.hold_out = None).trust, Trust::Doubtful);
        let wide = Caveat::warning(CaveatCode::NotDetermined, "the mass is anything: drive on");
        let found = judged(|plant| plant.caveats = vec![wide]);
        assert_eq!((found.trust, found.reason.as_str()), (Trust::Doubtful, "the mass is anything"));
    }

    #[test]
    fn a_plant_is_doubtful_where_trials_ask_for_one_that_is_further_off_than_usable_plants_are() {
        let asks = |mass: f64| {
            judged(|plant| {
                let part = |value| Estimate::new(value, 0.01, 1e4).into();
                let change = PlantChange { mass: part(mass), drag: part(0.0), explained: 0.5 };
                let held = plant.hold_out.as_mut().expect("the twin has one");
                held.by_axis.get_mut(&Dof::Surge).expect("its axis").change = Some(change);
                plant.caveats = vec![Caveat::warning(CaveatCode::AnotherPlantFits, "x")];
            })
        };
        assert_eq!(asks(-0.17).trust, Trust::Doubtful);
        assert_eq!(asks(-0.07).trust, Trust::UsableWithCare);
    }

    #[test]
    fn a_plant_must_beat_the_best_model_without_one() {
        let found = judged(|plant| scored(plant, Some(0.021), Some(0.022)));
        assert_eq!(found.trust, Trust::Doubtful);
        assert!(found.reason.contains("the steady speed for the thrust"), "{}", found.reason);
        assert_eq!(judged(|plant| scored(plant, Some(0.1), None)).trust, Trust::Doubtful);
    }

    #[test]
    fn a_followed_path_confirms_a_plant_despite_noise() {
        let found = judged(|plant| {
            scored(plant, Some(0.1), Some(0.1));
            let held = plant.hold_out.as_mut().expect("the twin has one");
            let trials = held.by_trial.values_mut().flat_map(BTreeMap::values_mut);
            trials.for_each(|trial| trial.position_r_squared = Some(0.99));
        });
        assert_eq!(found.trust, Trust::Usable);
    }

    #[test]
    fn severe_caveats_instability_and_divergence_forbid_use() {
        let severe = Caveat::severe(CaveatCode::WrongSign, "x");
        let found = judged(|p| p.caveats = vec![severe]);
        assert_eq!(found.trust, Trust::DoNotUse);
        assert_eq!(found.reason, "severe caveat: wrong sign");
        assert_eq!(
            judged(|p| p.alone.as_mut().expect("alone").stable = false).trust,
            Trust::DoNotUse
        );
        assert_eq!(judged(|p| scored(p, None, None)).trust, Trust::DoNotUse);
    }
}
