//! How far a plant of several axes may be trusted, as a whole and axis by axis.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::doubts::{
    falls_short, is_coloured, is_too_early, restoring_refutes, restoring_says, shortfall,
    shows_no_dependence,
};
use super::known::OtherScale;
use super::trials::Confirmed;
use crate::estimate::PlantFit;
use crate::judge::{Judge, Number, may_be_off, statement};
use crate::results::{PlantResult, PlantScore, Score, Trust, Verdict};
use crate::{Caveat, CaveatCode, Dof, Severity, Vehicle};

/// What a plant is judged by, beside its caveats and scores.
pub(super) struct Evidence<'a> {
    pub(super) fit: &'a PlantFit,
    /// Held-out trials one by one, if there are any.
    pub(super) of_trials: Option<&'a Confirmed<'a>>,
    pub(super) numbers: &'a [(Dof, Number)],
    /// Why thrust has another scale; see [`refuted_scale`].
    pub(super) refuted_scale: Option<&'static str>,
}

impl Evidence<'_> {
    /// Adds the motion that trials confirm, and how far numbers may be off; of one axis, or of all.
    fn with(&self, axis: Option<Dof>, verdict: Verdict) -> Verdict {
        let good_for = self.of_trials.map(|trials| match axis {
            Some(dof) => trials.of_axis(dof),
            None => trials.good_for.clone(),
        });
        let own = self.numbers.iter().filter(|(dof, _)| axis.is_none_or(|axis| axis == *dof));
        let mut may_be_off = may_be_off(own.map(|(_, number)| number));
        may_be_off.retain(|off| off.matters(verdict.trust));
        Verdict { good_for, may_be_off, ..verdict }
    }
}

/// Judges a plant by its caveats, its innovations and its error on trials that it has not seen: as a
/// whole, and axis by axis.
///
/// What makes all of it doubtful or unfit to use counts for every axis. Where single axes are
/// doubtful, the others may be used with care. Doubts of roll and pitch alone leave the plant usable with
/// care: these axes are held near rest by weight and buoyancy, and their mass and drag hardly
/// change the motion along the others, which held-out trials test by themselves. Where thrust acts
/// before its log says, what an axis lacks may be thrust, which all axes then lack.
pub(super) fn verdicts(
    plant: &PlantResult,
    evidence: &Evidence<'_>,
    of_axes: &[(Dof, Caveat)],
) -> (Verdict, BTreeMap<Dof, Verdict>) {
    let fit = evidence.fit;
    let own: BTreeMap<Dof, String> = match &plant.hold_out {
        Some(held) => {
            let of = |dof| Some((dof, doubt(dof, held.by_axis.get(&dof), fit, of_axes)?));
            plant.axes.iter().filter_map(|dof| of(*dof)).collect()
        }
        None => BTreeMap::new(),
    };
    let whole = judged(plant, evidence, of_axes, &own);
    let untested = plant.hold_out.as_ref().map(untested).unwrap_or_default();
    let doubtful = |reason| Verdict::new(Trust::Doubtful, reason, whole.codes.clone());
    let is_of_all =
        whole.trust == Trust::DoNotUse || is_too_early(fit) || evidence.refuted_scale.is_some();
    let of = |&dof: &Dof| {
        let score = plant.hold_out.as_ref().and_then(|held| held.by_axis.get(&dof));
        let verdict = match own.get(&dof).cloned() {
            _ if is_of_all || own.is_empty() && untested.is_empty() => whole.clone(),
            Some(reason) => doubtful(reason),
            None if untested.contains(&dof) => doubtful(masked(&untested)),
            None => beside_doubtful(score, &whole),
        };
        (dof, evidence.with(Some(dof), verdict))
    };
    let by_axis = plant.axes.iter().map(of).collect();
    (evidence.with(None, whole), by_axis)
}

/// Judges a plant as a whole; `own` are the doubts of its axes.
fn judged(
    plant: &PlantResult,
    evidence: &Evidence<'_>,
    of_axes: &[(Dof, Caveat)],
    own: &BTreeMap<Dof, String>,
) -> Verdict {
    let fit = evidence.fit;
    let judge = Judge(&plant.caveats);
    let of = |trust, reason: String| judge.verdict(trust, reason);
    if let Some(verdict) = judge.severe() {
        return verdict;
    }
    let Some(score) = &plant.hold_out else {
        return of(Trust::Doubtful, "no held-out trial has tested it".to_owned());
    };
    if let Some(reason) = evidence.refuted_scale {
        return of(Trust::Doubtful, reason.to_owned());
    }
    let is_of_axis = |caveat: &Caveat| of_axes.iter().any(|(_, own)| own == caveat);
    let is_unknown =
        |caveat: &&Caveat| caveat.code == CaveatCode::NotDetermined && !is_of_axis(caveat);
    if let Some(doubt) = judge.warnings().find(is_unknown) {
        return of(Trust::Doubtful, statement(&doubt.message));
    }
    if is_too_early(fit) {
        return of(Trust::Doubtful, TOO_EARLY.to_owned());
    }
    let lacks_thrust =
        |dof: &Dof| fit.actuator.delay_s < 0.0 && lacks(fit, *dof, score.by_axis.get(dof));
    if let Some(reason) = doubt_of_all(&plant.axes, own, lacks_thrust) {
        return of(Trust::Doubtful, reason.clone());
    }
    let untested = untested(score);
    if !untested.is_empty() {
        return of(Trust::Doubtful, masked(&untested));
    }
    let doubts: Vec<String> =
        own.iter().map(|(dof, reason)| format!("; {dof} is doubtful: {reason}")).collect();
    let (hidden, seen): (Vec<_>, Vec<_>) = score
        .by_axis
        .iter()
        .filter(|(dof, _)| !own.contains_key(dof))
        .partition(|(_, score)| falls_short(score));
    // What all trials together have says nothing of those that are worse than without a plant.
    let hiding = evidence.of_trials.filter(|trials| trials.has_hidden());
    let seen_axes: Vec<Dof> = seen.iter().map(|(dof, _)| **dof).collect();
    let pooled = seen.iter().filter_map(|(_, score)| score.r_squared).fold(f64::INFINITY, f64::min);
    let r2 = hiding.map_or(Some(pooled), |trials| trials.least_r2(&seen_axes)).unwrap_or(pooled);
    // Rounded down: "or more" has to hold.
    let least = (100.0 * r2).floor() / 100.0;
    let allowed = match hidden.iter().all(|(_, score)| score.is_vouched()) {
        true => ", which ask for the same plant there where these are allowed for",
        false => "",
    };
    let names = |of: &[(&Dof, &Score)]| {
        of.iter().map(|(dof, _)| dof.to_string()).collect::<Vec<_>>().join(", ")
    };
    let all = if own.is_empty() { "every axis".to_owned() } else { names(&seen) };
    let predicts = match (seen.is_empty(), hidden.is_empty()) {
        (_, true) => format!("predicts {all} of held-out trials with R² of {least:.2} or more"),
        (true, _) => {
            format!(
                "forces that are not logged mask its prediction of whole held-out trials{allowed}"
            )
        }
        _ => format!(
            "predicts {} of held-out trials with R² of {least:.2} or more; over whole trials, forces that are not logged mask {}{allowed}",
            names(&seen),
            names(&hidden)
        ),
    };
    let exceptions = hiding.and_then(|trials| trials.good_for.exceptions());
    let but = exceptions.map_or(String::new(), |trials| format!("; but not {trials}"));
    let predicts = format!("{predicts}{but}{}", doubts.concat());
    let has_exceptions = hiding.is_some() || !own.is_empty();
    let best = if has_exceptions { Trust::UsableWithCare } else { Trust::Usable };
    judge.confirmed(best, &predicts)
}

/// The doubt of a single axis that makes a plant of some axes doubtful as a whole: of another axis than
/// roll and pitch, of one that lacks thrust, or of a plant without others.
fn doubt_of_all<'a>(
    axes: &[Dof],
    own: &'a BTreeMap<Dof, String>,
    lacks_thrust: impl Fn(&Dof) -> bool,
) -> Option<&'a String> {
    let is_tilt = |dof: &Dof| matches!(dof, Dof::Roll | Dof::Pitch);
    let has_others = axes.iter().any(|dof| !is_tilt(dof));
    let is_of_all = |dof: &Dof| !has_others || !is_tilt(dof) || lacks_thrust(dof);
    own.iter().find(|(dof, _)| is_of_all(dof)).map(|(_, reason)| reason)
}

/// The axes that held-out trials do not test, if that is half of them or more: few tests passed by
/// the others are no test of the plant.
fn untested(score: &PlantScore) -> Vec<Dof> {
    let is_untested =
        |score: &Score| falls_short(score) && !score.is_followed() && !score.is_vouched();
    let axes = score.by_axis.iter().filter(|(_, score)| is_untested(score));
    let axes: Vec<Dof> = axes.map(|(dof, _)| *dof).collect();
    if 2 * axes.len() >= score.by_axis.len() { axes } else { Vec::new() }
}

/// Returns why thrust has another scale, if two of what is stated say so: mass, weight in water and righting
/// lever. One may be wrong by itself, as with water in the hull or a guessed centre of gravity; but masses below those of
/// any body of that mass are impossible, unless known forces tell the scale.
pub(super) fn refuted_scale(
    fit: &PlantFit,
    vehicle: &Vehicle,
    by_mass: Option<&OtherScale>,
    is_scale_known: bool,
) -> Option<&'static str> {
    if by_mass.is_some_and(|other| restoring_says(fit, vehicle, other.way)) {
        Some(SCALE_BY_MASS)
    } else if restoring_refutes(fit, vehicle) {
        Some(SCALE_BY_LEVER)
    } else {
        let is_below = by_mass.is_some_and(|other| other.way == Ordering::Less) && !is_scale_known;
        is_below.then_some(SCALE_BELOW_BODIES)
    }
}

/// Why no axis may be trusted where masses are below those of any body.
const SCALE_BELOW_BODIES: &str = "the masses of surge, sway and heave are together less than those of any body of the stated mass: thrust has another scale, and with it all masses and drags, or the stated mass is wrong";

/// Why no axis may be trusted where mass and restoring refute the scale of thrust.
const SCALE_BY_MASS: &str = "the stated mass and the stated weight and buoyancy both say that thrust has another scale, and with it all masses and drags";

/// Why no axis may be trusted where weight in water and righting lever do.
const SCALE_BY_LEVER: &str = "the stated weight in water and righting lever both say that thrust has another scale, and with it all masses and drags";

/// Why no axis may be trusted where thrust is logged so slowly or so late.
const TOO_EARLY: &str =
    "thrust acts long before its log says: what it did between its samples is not known";

fn masked(axes: &[Dof]) -> String {
    let names: Vec<String> = axes.iter().map(Dof::to_string).collect();
    format!(
        "held-out trials do not test {}: forces that are not logged do as much there as the plant",
        names.join(", ")
    )
}

/// Why an axis is doubtful, if it is.
fn doubt(
    dof: Dof,
    score: Option<&Score>,
    fit: &PlantFit,
    of_axes: &[(Dof, Caveat)],
) -> Option<String> {
    let is_own = |(on, caveat): &&(Dof, Caveat)| {
        *on == dof
            && caveat.severity == Severity::Warning
            && matches!(caveat.code, CaveatCode::NotDetermined | CaveatCode::InstrumentElsewhere)
    };
    if let Some((_, caveat)) = of_axes.iter().find(is_own) {
        return Some(statement(&caveat.message));
    }
    if let Some(reason) = score.and_then(|score| refuted(dof, score)) {
        return Some(reason);
    }
    lacks(fit, dof, score).then(|| lacks_something(dof))
}

/// Held-out motion that a plant explains to this part lacks little.
const EXPLAINED: f64 = 0.98;

/// Whether the colour of an axis's innovations says that the plant lacks what matters. Of ten thousand
/// samples a correlation of 0.02 is clear already; a plant that explains nearly all motion of trials
/// that it has not seen, from thrust alone, lacks little all the same, and where innovations
/// show no dependence on thrust, it lacks a disturbance, which is no part of it.
fn lacks(fit: &PlantFit, dof: Dof, score: Option<&Score>) -> bool {
    let explained = score.and_then(|score| score.r_squared).is_some_and(|r2| r2 > EXPLAINED);
    is_coloured(fit, dof) && !explained && !shows_no_dependence(fit, dof)
}

/// What held-out trials refute an axis by.
fn refuted(dof: Dof, score: &Score) -> Option<String> {
    let is_explained = score.is_of_disturbance() || score.is_followed() || score.is_vouched();
    if falls_short(score) && !is_explained {
        shortfall(dof, score, "held-out trials")
    } else {
        None
    }
}

/// An axis without a doubt of its own in a plant that is doubtful for others.
fn beside_doubtful(score: Option<&Score>, whole: &Verdict) -> Verdict {
    let r2 = score.and_then(|score| score.r_squared);
    let predicted = match r2.filter(|_| score.is_some_and(|score| !falls_short(score))) {
        Some(r2) => format!("predicts held-out trials with R² of {r2:.2}"),
        None => "forces that are not logged mask it in held-out trials".to_owned(),
    };
    let reason = format!("{predicted}; other axes of the plant are doubtful");
    Verdict::new(Trust::UsableWithCare, reason, whole.codes.clone())
}

fn lacks_something(dof: Dof) -> String {
    format!(
        "what it fails to predict in {dof} is strongly correlated in time: the model lacks something, and its coefficients compensate for it"
    )
}

#[cfg(test)]
mod tests {
    use super::super::doubts::scores;
    use super::*;
    use crate::Estimate;
    use crate::results::LikelyChange;

    /// A model that never moves has an error of 0.1.
    fn axis(error: f64, disturbance: f64) -> Score {
        Score {
            mean_abs_error: Some(error),
            null_error: 0.1,
            disturbance_error: Some(disturbance),
            r_squared: Some(1.0 - (error / 0.1).powi(2)),
            ..Score::default()
        }
    }

    /// A trial that knows mass and drag within these parts, and would have so much more mass.
    fn asks(mass: f64, drag_std: f64) -> Option<LikelyChange> {
        let part = |value, std| Estimate::new(value, std, 1e4).into();
        let (mass, drag) = (part(mass, 0.01), part(0.0, drag_std));
        Some(LikelyChange { mass, drag, whiteness: 1.0, surprise: 1.0 })
    }

    #[test]
    fn a_trial_that_asks_for_the_same_plant_vouches_for_it() {
        // Free, it is off by more than is known to disturb it.
        let axis = |likely_change| Score { likely_change, ..axis(0.09, 0.01) };
        assert!(refuted(Dof::Sway, &axis(asks(0.0, 0.3))).is_some(), "drag is not known");
        assert!(refuted(Dof::Sway, &axis(asks(0.2, 0.05))).is_some(), "it asks for another mass");
        let vouched = axis(asks(0.01, 0.05));
        assert_eq!(refuted(Dof::Sway, &vouched), None);
        assert_eq!(untested(&scored(&[vouched, vouched])), []);
        let coloured = LikelyChange { whiteness: 3.0, ..asks(0.0, 0.05).expect("some") };
        assert!(refuted(Dof::Sway, &axis(Some(coloured))).is_some(), "the model lacks something");
        let disturbed = LikelyChange { surprise: 2.0, ..asks(0.0, 0.05).expect("some") };
        assert!(refuted(Dof::Sway, &axis(Some(disturbed))).is_some(), "something else moves it");
    }

    #[test]
    fn a_trial_that_asks_for_another_plant_is_a_warning() {
        let of = |likely_change| {
            let score = Score { likely_change, ..axis(0.01, 0.01) };
            let score = PlantScore { by_axis: [(Dof::Sway, score)].into(), ..scored(&[]) };
            scores(&scored(&[]), Some(&score))
        };
        let found = of(asks(0.2, 0.05));
        assert_eq!(found[0].code, CaveatCode::AnotherPlantFits);
        assert!(found[0].message.contains("sway: mass +20.0 ± 2.0 %"), "{}", found[0].message);
        assert_eq!(of(asks(0.06, 0.05)), []);
    }

    fn scored(axes: &[Score]) -> PlantScore {
        let by_axis = Dof::ALL.into_iter().zip(axes.iter().copied()).collect();
        PlantScore { by_axis, ..PlantScore::default() }
    }

    #[test]
    fn a_plant_is_tested_where_most_of_its_axes_are() {
        let (good, masked) = (axis(0.01, 0.01), axis(0.09, 0.09));
        assert_eq!(untested(&scored(&[good, good, masked])), []);
        assert_eq!(untested(&scored(&[masked, good, good, masked])), [Dof::Surge, Dof::Roll]);
        // A swing that is followed for seconds is a test passed.
        let followed =
            Score { restarted_error: Some(0.01), kept_error: Some(0.1), ..axis(0.09, 0.09) };
        assert_eq!(untested(&scored(&[masked, good, good, followed])), []);
    }

    #[test]
    fn doubts_of_roll_and_pitch_alone_leave_the_others_usable() {
        let whole = |axes: &[Dof], doubtful: &[Dof], lacks_thrust: Option<Dof>| {
            let own = doubtful.iter().map(|dof| (*dof, dof.to_string())).collect();
            doubt_of_all(axes, &own, |dof| lacks_thrust == Some(*dof)).cloned()
        };
        assert_eq!(whole(&Dof::ALL, &[], None), None);
        assert_eq!(whole(&Dof::ALL, &[Dof::Roll, Dof::Pitch], None), None);
        let pitch = Some("pitch".to_owned());
        assert_eq!(whole(&Dof::ALL, &[Dof::Roll, Dof::Pitch], Some(Dof::Pitch)), pitch);
        assert_eq!(whole(&Dof::ALL, &[Dof::Roll, Dof::Yaw], None), Some("yaw".to_owned()));
        assert_eq!(whole(&[Dof::Roll, Dof::Pitch], &[Dof::Pitch], None), pitch);
    }

    #[test]
    fn an_axis_is_refuted_by_an_error_that_nothing_else_explains() {
        let of = |score: Score| refuted(Dof::Sway, &score);
        let reason = of(axis(0.09, 0.01)).expect("0.09 of 0.1, and disturbances make 0.01");
        assert!(reason.contains("the error of sway is 0.09"), "{reason}");
        assert_eq!(of(axis(0.09, 0.09)), None);
        assert_eq!(of(axis(0.01, 0.0)), None);
        let followed =
            Score { restarted_error: Some(0.01), kept_error: Some(0.1), ..axis(0.09, 0.01) };
        assert_eq!(of(followed), None);
        let flat = Score { r_squared: Some(0.02), ..axis(0.04, 0.0) };
        assert!(of(flat).expect("explains nothing").contains("2 % of the variation of sway"));
    }
}
