//! Held-out trials that a plant predicts badly, where all of them together hide it.

use crate::caveat::spoken;
use crate::results::{AxisScore, CoupledScore};
use crate::{Caveat, CaveatCode, Dof};

use super::doubts::falls_short;

/// A trial tests an axis if its mean speed there is this part of that of all trials.
const TESTS: f64 = 0.3;

/// Names each held-out trial on which an axis is predicted no better than by a model that never
/// moves, or that keeps its mean speed.
///
/// Trials whose error forces that are not logged explain, and axes that all trials together show to
/// be badly predicted, are left to the other caveats.
pub(super) fn worse_trials(score: &CoupledScore) -> Vec<Caveat> {
    let all = score
        .trials
        .iter()
        .flat_map(|(trial, axes)| axes.iter().map(move |(dof, own)| (trial.as_str(), *dof, own)));
    all.filter_map(|(trial, dof, own)| worse(trial, dof, own, score.by_axis.get(&dof)?)).collect()
}

fn worse(trial: &str, dof: Dof, own: &AxisScore, pooled: &AxisScore) -> Option<Caveat> {
    let error = own.mean_abs_error?;
    let is_tested = own.null_error >= TESTS * pooled.null_error;
    let is_hidden = !falls_short(pooled) && !pooled.is_vouched() && !own.is_of_disturbance();
    let null = spoken(own.null_error);
    let than = match own.r2 {
        _ if !(is_tested && is_hidden) => return None,
        _ if error >= own.null_error => format!("a model that never moves ({null})"),
        Some(r2) if r2 < 0.0 => format!("a model that keeps its mean speed (R² {r2:.1})"),
        _ => return None,
    };
    let message = format!(
        "on held-out trial `{trial}` the error of {dof} is {} {}, no better than {than}, although it is over all held-out trials; do not use the plant for that kind of motion",
        spoken(error),
        dof.units().velocity
    );
    Some(Caveat::warning(CaveatCode::NoBetterThanNull, message))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(error: f64, null_error: f64, r2: f64) -> AxisScore {
        let (mean_abs_error, r2) = (Some(error), Some(r2));
        AxisScore { mean_abs_error, null_error, r2, samples: 100, ..AxisScore::default() }
    }

    fn named(pooled: AxisScore, own: AxisScore) -> Option<String> {
        let of = |score| [(Dof::Yaw, score)].into();
        let trials = [("berthing".to_owned(), of(own))].into();
        let caveats = worse_trials(&CoupledScore { by_axis: of(pooled), trials });
        caveats.into_iter().next().map(|caveat| caveat.message)
    }

    #[test]
    fn a_trial_worse_than_no_plant_is_named_where_all_trials_hide_it() {
        let good = axis(0.01, 0.1, 0.9);
        let worse = named(good, axis(0.09, 0.08, -0.4)).expect("named");
        assert!(worse.contains("`berthing`") && worse.contains("never moves"), "{worse}");
        let worse = named(good, axis(0.05, 0.08, -2.7)).expect("named");
        assert!(worse.contains("mean speed (R² -2.7)"), "{worse}");
        assert_eq!(named(good, axis(0.01, 0.08, 0.8)), None);
    }

    #[test]
    fn a_trial_that_hardly_moves_or_is_disturbed_says_nothing_of_the_plant() {
        let good = axis(0.01, 0.1, 0.9);
        assert_eq!(named(good, axis(0.02, 0.01, -2.0)), None);
        let disturbed = AxisScore { disturbance_error: Some(0.08), ..axis(0.09, 0.08, -0.4) };
        assert_eq!(named(good, disturbed), None);
        // All trials together are bad: another caveat says so.
        assert_eq!(named(axis(0.09, 0.1, -0.4), axis(0.09, 0.08, -0.4)), None);
    }
}
