//! How far a plant of several axes may be trusted.

use super::doubts::{coloured, falls_short, refutes};
use crate::estimate::CoupledFit;
use crate::results::{AxisScore, CoupledPlant, Trust, Verdict};
use crate::{CaveatCode, Dof, Severity};

/// Judges a plant by its caveats, its innovations and its error on trials that it has not seen.
pub(super) fn verdict(plant: &CoupledPlant, fit: &CoupledFit) -> Verdict {
    let with = |severity| plant.caveats.iter().filter(move |c| c.severity == severity);
    let codes: Vec<CaveatCode> =
        with(Severity::Severe).chain(with(Severity::Warning)).map(|c| c.code).collect();
    let of = |trust, reason: String| Verdict { trust, reason, codes: codes.clone() };
    let first_sentence = |message: &str| message.split(": ").next().unwrap_or_default().to_owned();
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
        let reason = format!(
            "what it fails to predict in {dof} is strongly correlated in time, so that it lacks something that its numbers make up for"
        );
        return of(Trust::Doubtful, reason);
    }
    let (hidden, seen): (Vec<_>, Vec<_>) =
        score.by_axis.iter().partition(|(_, score)| falls_short(score));
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
            "forces that are not logged hide what it predicts of held-out trials".to_owned()
        }
        _ => format!(
            "predicts {} of held-out trials with R² of {least:.2} or more; forces that are not logged hide {} in them",
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
