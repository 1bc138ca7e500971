//! How far a plant of several axes may be trusted, as a whole and axis by axis.

use std::collections::BTreeMap;

use super::doubts::{coloured, falls_short, is_coloured, is_refuted, refutes};
use crate::caveat::spoken;
use crate::estimate::CoupledFit;
use crate::results::{AxisScore, CoupledPlant, CoupledScore, Trust, Verdict};
use crate::{Caveat, CaveatCode, Dof, Severity};

/// Judges a plant by its caveats, its innovations and its error on trials that it has not seen.
pub(super) fn verdict(plant: &CoupledPlant, fit: &CoupledFit) -> Verdict {
    let with = |severity| plant.caveats.iter().filter(move |c| c.severity == severity);
    let codes: Vec<CaveatCode> =
        with(Severity::Severe).chain(with(Severity::Warning)).map(|c| c.code).collect();
    let of = |trust, reason: String| Verdict { trust, reason, codes: codes.clone() };
    if let Some(severe) = with(Severity::Severe).next() {
        return of(Trust::DoNotUse, format!("severe caveat: {}", severe.code.words()));
    }
    let Some(score) = &plant.hold_out else {
        return of(Trust::Doubtful, "no held-out trial has tested it".to_owned());
    };
    let is_doubt = |code| match code {
        CaveatCode::NoBetterThanNull => refutes(score),
        code => code == CaveatCode::NotDetermined,
    };
    if let Some(doubt) = with(Severity::Warning).find(|caveat| is_doubt(caveat.code)) {
        return of(Trust::Doubtful, first_sentence(&doubt.message));
    }
    if let Some(dof) = coloured(fit) {
        return of(Trust::Doubtful, lacks_something(dof));
    }
    let (hidden, seen): (Vec<_>, Vec<_>) =
        score.by_axis.iter().partition(|(_, score)| falls_short(score));
    let untested = untested(score);
    if !untested.is_empty() {
        return of(Trust::Doubtful, masked(&untested));
    }
    let r2 = seen.iter().filter_map(|(_, score)| score.r2);
    let least = r2.fold(f64::INFINITY, f64::min);
    let names = |of: &[(&Dof, &AxisScore)]| {
        of.iter().map(|(dof, _)| dof.to_string()).collect::<Vec<_>>().join(", ")
    };
    let predicts = match (seen.is_empty(), hidden.is_empty()) {
        (_, true) => {
            format!("predicts every axis of held-out trials with R² of {least:.2} or more")
        }
        (true, _) => {
            "forces that are not logged mask its prediction of whole held-out trials".to_owned()
        }
        _ => format!(
            "predicts {} of held-out trials with R² of {least:.2} or more; over whole trials, forces that are not logged mask {}",
            names(&seen),
            names(&hidden)
        ),
    };
    match with(Severity::Warning).count() {
        0 => of(Trust::Usable, format!("no warning, {predicts}")),
        1 => of(Trust::UsableWithCare, format!("1 warning, {predicts}")),
        n => of(Trust::UsableWithCare, format!("{n} warnings, {predicts}")),
    }
}

/// Judges each axis: a plant is doubtful where one of its axes is, and the others may be used with
/// care. What makes all of it doubtful or unfit to use counts for every axis.
pub(super) fn by_axis(
    plant: &CoupledPlant,
    fit: &CoupledFit,
    of_axes: &[(Dof, Caveat)],
) -> BTreeMap<Dof, Verdict> {
    let whole = &plant.verdict;
    let of = |&dof: &Dof| {
        let verdict = match &plant.hold_out {
            Some(held) if whole.trust == Trust::Doubtful => {
                let score = held.by_axis.get(&dof);
                let own = || doubt(dof, score, fit, of_axes);
                let untested = untested(held);
                let own = if untested.contains(&dof) { Some(masked(&untested)) } else { own() };
                match own {
                    Some(reason) => Verdict { reason, ..whole.clone() },
                    None => beside_doubtful(score, whole),
                }
            }
            _ => whole.clone(),
        };
        (dof, verdict)
    };
    plant.axes.iter().map(of).collect()
}

/// The axes that held-out trials do not test, if that is half of them or more: few tests passed by
/// the others are no test of the plant.
fn untested(score: &CoupledScore) -> Vec<Dof> {
    let is_untested = |score: &AxisScore| falls_short(score) && !score.is_followed();
    let axes = score.by_axis.iter().filter(|(_, score)| is_untested(score));
    let axes: Vec<Dof> = axes.map(|(dof, _)| *dof).collect();
    if 2 * axes.len() >= score.by_axis.len() { axes } else { Vec::new() }
}

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
    score: Option<&AxisScore>,
    fit: &CoupledFit,
    of_axes: &[(Dof, Caveat)],
) -> Option<String> {
    let is_own = |(on, caveat): &&(Dof, Caveat)| {
        *on == dof
            && caveat.severity == Severity::Warning
            && caveat.code == CaveatCode::NotDetermined
    };
    if let Some((_, caveat)) = of_axes.iter().find(is_own) {
        return Some(first_sentence(&caveat.message));
    }
    if let Some(score) = score.filter(|score| is_refuted(score)) {
        let error = score.mean_abs_error.map_or("unbounded".to_owned(), spoken);
        let reason = format!(
            "on the held-out trials the error of {dof} is {error} {}, and that of a model that never moves {}",
            dof.units().velocity,
            spoken(score.null_error)
        );
        return Some(reason);
    }
    is_coloured(fit, dof).then(|| lacks_something(dof))
}

/// An axis without a doubt of its own in a plant that is doubtful for others.
fn beside_doubtful(score: Option<&AxisScore>, whole: &Verdict) -> Verdict {
    let r2 = score.and_then(|score| score.r2);
    let predicted = match r2.filter(|_| score.is_some_and(|score| !falls_short(score))) {
        Some(r2) => format!("predicts held-out trials with R² of {r2:.2}"),
        None => "forces that are not logged mask it in held-out trials".to_owned(),
    };
    let reason = format!("{predicted}; other axes of the plant are doubtful");
    Verdict { trust: Trust::UsableWithCare, reason, codes: whole.codes.clone() }
}

fn first_sentence(message: &str) -> String {
    message.split(": ").next().unwrap_or_default().to_owned()
}

fn lacks_something(dof: Dof) -> String {
    format!(
        "what it fails to predict in {dof} is strongly correlated in time: the model lacks something, and its coefficients compensate for it"
    )
}
