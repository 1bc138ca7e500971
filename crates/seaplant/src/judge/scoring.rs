//! Doubts that follow from the errors of a plant on trials.

use super::change::LikelyChange;
use super::score::{PREDICTS, PlantScore, Score};
use super::verdict::vouched;
use crate::{Caveat, CaveatCode, Dof, Role};

/// Returns the doubts that follow from the scores of a plant on held-out trials, or else on those that it was
/// fitted to.
pub(crate) fn scoring(fit: &PlantScore, hold_out: Option<&PlantScore>) -> Vec<Caveat> {
    let (score, trials) = match hold_out {
        Some(held) => (held, "the held-out trials"),
        None => (fit, "the trials that it was fitted to"),
    };
    let of = |(dof, own): (&Dof, &Score)| {
        let errors = Errors { dof: *dof, trials, own, fitted: fit.by_axis.get(dof) };
        let is_vouched = vouched(own, score.trials(*dof).map(|(_, own)| own));
        errors.doubt(is_vouched, score.by_axis.len() == 1)
    };
    let mut all: Vec<Caveat> = score.by_axis.iter().filter_map(of).collect();
    all.dedup();
    if hold_out.is_none() {
        let message = format!(
            "it is scored on the trials that it was fitted to, which makes it look better than it is: hold out one trial with role = \"{}\"",
            Role::HoldOut.name()
        );
        all.push(Caveat::note(CaveatCode::ScoredOnFit, message));
    }
    all.extend(hold_out.and_then(another_plant));
    all
}

/// Errors of a plant in one axis.
struct Errors<'a> {
    dof: Dof,
    /// Name of the trials of `own` in sentences.
    trials: &'a str,
    own: &'a Score,
    fitted: Option<&'a Score>,
}

impl Errors<'_> {
    /// Returns a caveat if the plant predicts the axis too badly; it is severe if nothing explains that and the plant has
    /// no other axis.
    fn doubt(&self, is_vouched: bool, is_alone: bool) -> Option<Caveat> {
        let Self { dof, trials, own, .. } = *self;
        if own.mean_abs_error.is_none() {
            let message = format!("simulated over {trials}, the plant diverges");
            return Some(Caveat::severe(CaveatCode::Unstable, message));
        }
        let what = own.shortfall(dof, trials)?;
        let code = CaveatCode::NoBetterThanNull;
        if is_vouched {
            let why = match own.likely_change {
                Some(LikelyChange { mass, drag, .. }) => format!(
                    ", as forces that are not logged add up; allowing for these, the trials support the same plant: mass {}, drag {}",
                    mass.spoken(),
                    drag.spoken()
                ),
                None => "; yet these trials support no other plant, or the simulated path follows the measured one".to_owned(),
            };
            let message = format!("{what}{why}");
            return Some(Caveat::note(code, message));
        }
        let why = if !own.fails() {
            ""
        } else if own.is_of_disturbance() {
            ", about as much as forces that are not logged cause: these trials hardly test the plant there; excite the axis more"
        } else if own.is_followed() {
            "; begun anew every 10 s from what is measured it follows the axis: over a whole trial it loses the phase"
        } else if is_alone && self.is_no_model() {
            return Some(Caveat::severe(code, format!("{what}: it is no model of this motion")));
        } else {
            ""
        };
        Some(Caveat::warning(code, format!("{what}{why}")))
    }

    /// Returns true if the plant is worse than a model that never moves, or worse than the mean of each trial, both of
    /// fitted trials and of unseen ones.
    fn is_no_model(&self) -> bool {
        let contradicts = |score: &Score| {
            let is_far = score.free_error() > PREDICTS * score.null_error;
            score.r_squared.is_some_and(|r2| r2 < 0.0) && is_far
        };
        self.own.free_error() >= self.own.null_error
            || contradicts(self.own) && self.fitted.is_some_and(contradicts)
    }
}

/// Returns a caveat if held-out trials support another mass or drag, for the axis in which the change is largest.
fn another_plant(score: &PlantScore) -> Option<Caveat> {
    let beyond = |dof: &Dof| score.by_axis[dof].likely_change.and_then(|change| change.beyond());
    let axes = score.by_axis.keys().filter_map(|dof| Some((dof, beyond(dof)?)));
    let (dof, _) = axes.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let LikelyChange { mass, drag, .. } = score.by_axis[dof].likely_change?;
    let message = format!(
        "allowing for forces that are not logged, the held-out trials ask for another plant in {dof}: mass {}, drag {}; the model lacks something, or the trials differ in vehicle, trim or thrust",
        mass.spoken(),
        drag.spoken()
    );
    Some(Caveat::warning(CaveatCode::AnotherPlantFits, message))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::judge::{NullModel, NullScore};
    use crate::{Estimate, Severity};

    #[test]
    fn a_trial_that_asks_for_another_plant_is_a_warning() {
        let part = |value, std| Estimate::new(value, std, 1e4).into();
        let of = |mass: f64| {
            let (mass, drag) = (part(mass, 0.01), part(0.0, 0.05));
            let likely_change = Some(LikelyChange { mass, drag, whiteness: 1.0, surprise: 1.0 });
            let score = Score {
                mean_abs_error: Some(0.01),
                null_error: 0.1,
                likely_change,
                ..Score::default()
            };
            let by_axis = [(Dof::Sway, score)].into();
            let held = PlantScore { by_axis, ..PlantScore::default() };
            scoring(&PlantScore::default(), Some(&held))
        };
        let found = of(0.2);
        assert_eq!(found[0].code, CaveatCode::AnotherPlantFits);
        assert!(found[0].message.contains("sway: mass +20.0 ± 2.0 %"), "{}", found[0].message);
        assert_eq!(of(0.06), []);
    }

    /// Errors of a plant of one axis, or of two, on fitted and on held-out trials.
    fn of(fitted: Score, held: Score, is_alone: bool) -> Vec<Caveat> {
        let well = Score { mean_abs_error: Some(0.01), null_error: 0.1, ..Score::default() };
        let of = |own: Score| {
            let mut score = PlantScore::of_axis(Dof::Surge, own, [("t".to_owned(), own)]);
            if !is_alone {
                score.by_axis.insert(Dof::Yaw, well);
            }
            score
        };
        scoring(&of(fitted), Some(&of(held)))
    }

    #[test]
    fn a_plant_worse_than_the_mean_of_fitted_and_held_out_trials_is_no_model() {
        let bad = Score {
            mean_abs_error: Some(0.08),
            null_error: 0.1,
            r_squared: Some(-0.5),
            best_null: Some(NullScore { model: NullModel::NeverMoves, mean_abs_error: 0.1 }),
            ..Score::default()
        };
        let well = Score { mean_abs_error: Some(0.01), r_squared: Some(0.99), ..bad };
        let severity = |fitted, held, is_alone| of(fitted, held, is_alone)[0].severity;
        assert_eq!(severity(bad, bad, true), Severity::Severe);
        assert_eq!(severity(well, bad, true), Severity::Warning);
        assert_eq!(severity(bad, bad, false), Severity::Warning);
        // An offset by a current is no error of the plant.
        assert_eq!(of(bad, Score { offset_free_error: Some(0.01), ..bad }, true), []);
        let never_moves = Score { mean_abs_error: Some(0.12), r_squared: Some(0.1), ..bad };
        assert_eq!(severity(well, never_moves, true), Severity::Severe);
    }

    #[test]
    fn a_disturbance_of_the_size_of_the_error_explains_it() {
        let own = Score {
            mean_abs_error: Some(0.12),
            null_error: 0.1,
            disturbance_error: Some(0.1),
            ..Score::default()
        };
        let found = of(own, own, true);
        assert_eq!(found[0].severity, Severity::Warning);
        assert!(found[0].message.contains("hardly test the plant there"), "{}", found[0].message);
    }

    #[test]
    fn a_simulation_that_diverges_is_severe() {
        let own = Score { null_error: 0.1, ..Score::default() };
        assert_eq!(of(own, own, false)[0].severity, Severity::Severe);
    }
}
