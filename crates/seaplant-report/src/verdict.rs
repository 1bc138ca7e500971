//! What to make of a plant, in one sentence.

use seaplant::results::PlantResult;
use seaplant::{Dof, Severity};
use serde::Serialize;

use crate::number::significant;
use crate::words;

/// How far a plant may be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Trust {
    /// A reason not to use it was found.
    DoNotUse,
    /// Nothing vouches for it.
    Doubtful,
    /// It predicts, and there are warnings to read.
    UsableWithCare,
    /// It predicts, and nothing speaks against it.
    Usable,
}

/// What to make of a plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Verdict {
    /// How far it may be trusted.
    pub trust: Trust,
    /// Why, in one sentence without its first word and full stop.
    pub reason: String,
}

/// A model that predicts vouches for its plant if its error is below this part of the
/// error of a model that never moves.
const PREDICTS: f64 = 0.5;

impl Trust {
    /// As the report writes it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::DoNotUse => "do not use",
            Self::Doubtful => "doubtful",
            Self::UsableWithCare => "usable with care",
            Self::Usable => "usable",
        }
    }
}

/// Judges a plant by its stability, its error on held-out trials and its caveats.
pub fn verdict(dof: Dof, plant: &PlantResult) -> Verdict {
    let of = |trust, reason: String| Verdict { trust, reason };
    let count = |severity| plant.caveats.iter().filter(|c| c.severity == severity).count();
    let severe = count(Severity::Severe);
    if !plant.stable {
        let unit = dof.units().velocity;
        let how = match plant.stability {
            seaplant::Stability::Stable | seaplant::Stability::Unstable => String::new(),
            _ => format!(" {unit}"),
        };
        return of(Trust::DoNotUse, format!("the model {}{how}", plant_is(&plant.stability)));
    }
    if severe > 0 {
        let first = plant.caveats.iter().find(|c| c.severity == Severity::Severe);
        let what = first.map_or_else(String::new, |c| words::caveat(c.code).to_lowercase());
        let more =
            if severe > 1 { format!(" and {} more below", severe - 1) } else { String::new() };
        return of(Trust::DoNotUse, format!("severe caveat: {what}{more}"));
    }
    let Some(score) = &plant.hold_out else {
        return of(Trust::Doubtful, "no held-out trial has tested it".to_owned());
    };
    let trials = words::held_out(score);
    let Some(e) = score.mean_abs_error else {
        return of(Trust::DoNotUse, format!("its simulation of {trials} runs away"));
    };
    let against = format!(
        "{trials} with e = {} {unit} against {} for a model that never moves",
        significant(e, 2),
        significant(score.null_error, 2),
        unit = dof.units().velocity,
    );
    if e >= score.null_error {
        return of(Trust::DoNotUse, format!("it predicts {against}"));
    }
    if e > PREDICTS * score.null_error {
        return of(Trust::Doubtful, format!("it predicts {against}"));
    }
    match count(Severity::Warning) {
        0 => of(Trust::Usable, format!("no warning, predicts {against}")),
        1 => of(Trust::UsableWithCare, format!("1 warning, predicts {against}")),
        n => of(Trust::UsableWithCare, format!("{n} warnings, predicts {against}")),
    }
}

fn plant_is(stability: &seaplant::Stability) -> String {
    match stability {
        seaplant::Stability::Stable => "is stable".to_owned(),
        seaplant::Stability::Unstable => "is unstable: nothing opposes motion".to_owned(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use seaplant::{Caveat, CaveatCode};

    use super::*;
    use crate::fixture;

    fn judged(change: impl FnOnce(&mut PlantResult)) -> Verdict {
        let mut plant = fixture::plant();
        change(&mut plant);
        verdict(Dof::Surge, &plant)
    }

    #[test]
    fn a_plant_that_predicts_is_usable() {
        let found = judged(|plant| plant.caveats.clear());
        assert_eq!(found.trust, Trust::Usable);
        assert!(found.reason.contains("e = 0.021 m/s against 0.11"), "{}", found.reason);
    }

    #[test]
    fn warnings_ask_for_care() {
        let warning = Caveat::warning(CaveatCode::Collinear, "x");
        assert_eq!(judged(|p| p.caveats = vec![warning]).trust, Trust::UsableWithCare);
    }

    #[test]
    fn without_a_held_out_trial_a_plant_is_doubtful() {
        assert_eq!(judged(|plant| plant.hold_out = None).trust, Trust::Doubtful);
    }

    #[test]
    fn severe_unstable_diverging_or_useless_plants_are_not_to_be_used() {
        let severe = Caveat::severe(CaveatCode::WrongSign, "x");
        assert_eq!(judged(|p| p.caveats = vec![severe]).trust, Trust::DoNotUse);
        assert_eq!(judged(|p| p.stable = false).trust, Trust::DoNotUse);
        let score = |p: &mut PlantResult, e| {
            p.hold_out.as_mut().expect("fixture has one").mean_abs_error = e;
        };
        assert_eq!(judged(|p| score(p, None)).trust, Trust::DoNotUse);
        assert_eq!(judged(|p| score(p, Some(0.2))).trust, Trust::DoNotUse);
        assert_eq!(judged(|p| score(p, Some(0.1))).trust, Trust::Doubtful);
    }
}
