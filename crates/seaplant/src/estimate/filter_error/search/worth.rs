//! What a candidate must bring, and whether it does.

use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{CLEAR_GAIN, Fitted, Model, Search};
use crate::estimate::descend::scaled_inverse;
use crate::estimate::filter_error::candidate::{Candidate, Decision};
use crate::estimate::filter_error::held_out::HeldOut;
use crate::estimate::filter_error::minimise::{Effort, ROUNDING};
use crate::estimate::filter_error::parabola::Scores;
use crate::estimate::filter_error::parameters::{Unknown, Usual};
use crate::estimate::filter_error::problem::Record;
use crate::parallel;

/// Linear drag below this part of the quadratic is none, however sharply it is seen: below
/// what a thrust curve or a log's clock is good for.
const SLIGHT_LINEAR_DRAG: f64 = 0.01;

/// A bias force stays in the model unless the logs show that it is below this part of the
/// thrust: a vehicle is seldom neutral, and a simulation without its weight drifts away.
const SLIGHT_BIAS: f64 = 0.02;

/// Mean speeds of trials that differ by less than this part of the greatest show nothing of what
/// follows them.
const SPEEDS_DIFFER: f64 = 0.3;

/// A ratio of current to speed is the same in all trials by chance once in a thousand.
const SAME_RATIO: f64 = 1e-3;

/// Whether the currents of trials are in proportion to the mean speeds of the vehicle: water does
/// not know how fast a vehicle goes, so that this is something else, such as drag.
fn follows_speed(fitted: &Fitted<'_>) -> bool {
    let records = fitted.problem.records.iter().enumerate();
    let pairs: Vec<(f64, f64)> = records
        .filter_map(|(k, record)| Some((record.mean_velocity?, fitted.value(Unknown::Current, k)?)))
        .collect();
    are_in_proportion(&pairs)
}

/// Whether the second numbers are in proportion to the first, which differ, by more than chance.
fn are_in_proportion(pairs: &[(f64, f64)]) -> bool {
    let speeds = || pairs.iter().map(|(speed, _)| *speed);
    let (least, most) = (speeds().fold(f64::MAX, f64::min), speeds().fold(f64::MIN, f64::max));
    if pairs.len() < 3 || most - least < SPEEDS_DIFFER * most.abs().max(least.abs()) {
        return false;
    }
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let ratio = sum(&|(v, u)| u * v) / sum(&|(v, _)| v * v);
    let left = sum(&|(v, u)| (u - ratio * v).powi(2));
    let freedom = (pairs.len() - 1) as f64;
    let explained = sum(&|(v, _)| (ratio * v).powi(2)) * freedom / left.max(f64::MIN_POSITIVE);
    FisherSnedecor::new(1.0, freedom).is_ok_and(|chance| chance.sf(explained) < SAME_RATIO)
}

impl<'a> Search<'a> {
    /// Twice the cost, and what each number must bring.
    pub(super) fn criterion(&self, model: &Model<'_>) -> f64 {
        let needed: f64 = model.kept.iter().map(|candidate| self.needed(*candidate)).sum();
        2.0 * model.fitted.optimum.cost + needed
    }

    fn ln_samples(&self) -> f64 {
        let samples: usize = self.records.iter().map(Record::samples).sum();
        (samples as f64).ln()
    }

    /// Leaves out what makes held-out trials worse by more than chance, and what a better optimum
    /// without it shows not to be worth its place, the worst first. Why each part of the model that
    /// is left stays.
    pub(super) fn judge(&self, model: &mut Model<'a>) -> Vec<Decision> {
        loop {
            let without = parallel::map(&model.kept, |c| self.without(&model.fitted, *c));
            for (candidate, without) in model.kept.iter().zip(&without) {
                model.fitted = self.at_least(*candidate, model.fitted.clone(), without);
            }
            let pairs: Vec<(Candidate, Fitted<'a>)> =
                model.kept.iter().copied().zip(without).collect();
            let judged = parallel::map(&pairs, |(candidate, without)| {
                self.judged(*candidate, &model.fitted, without)
            });
            let judged: Vec<(Decision, Fitted<'a>)> =
                judged.into_iter().zip(pairs.into_iter().map(|(_, without)| without)).collect();
            let worst = judged
                .iter()
                .filter(|(decision, without)| !decision.admitted && without.optimum.converged)
                .min_by(|a, b| {
                    let gain = |decision: &Decision| {
                        let beyond = (decision.likelihood_ratio - decision.needed).min(0.0);
                        beyond + decision.hold_out_ratio.unwrap_or(0.0).min(0.0)
                    };
                    gain(&a.0).total_cmp(&gain(&b.0))
                });
            let Some((decision, without)) = worst else {
                let kept = |decision| Decision { admitted: true, ..decision };
                return judged.into_iter().map(|(decision, _)| kept(decision)).collect();
            };
            model.kept.retain(|kept| *kept != decision.candidate);
            model.fitted = without.clone();
        }
    }

    /// Why a candidate is not part of the model.
    pub(super) fn left_out(
        &self,
        candidate: Candidate,
        model: &Model<'a>,
        scores: &Scores,
    ) -> Decision {
        let (fitted, ratio) = (&model.fitted, scores.of(candidate));
        // What the logs support and held-out trials refuse is shown with both.
        let is_close = ratio > self.needed(candidate);
        let with = is_close.then(|| self.changed(fitted, &[], Some(candidate), Effort::COARSE));
        let decision = match with.filter(|with| with.optimum.converged) {
            Some(with) => self.judged(candidate, &with, fitted),
            None => self.decision(candidate, ratio, None, None),
        };
        Decision { admitted: false, ..decision }
    }

    fn numbers(&self, candidate: Candidate) -> f64 {
        let of = |(unknown, _): (Unknown, f64)| {
            if unknown.is_of_trial() { self.records.len() } else { 1 }
        };
        candidate.unknowns().into_iter().map(of).sum::<usize>() as f64
    }

    /// What a candidate must bring: by the extended Bayesian information criterion, which asks
    /// for more where many are tried, since the best of many looks good by chance. A term of
    /// the equation of motion is asked about by itself. Acceleration alone hardly shows the bend
    /// of drag: there linear drag stays, for mass and quadratic drag would make up for it.
    ///
    /// # Source
    /// [ChenChen2008]: `ln n` for each number, and `2 ln P` for each of P candidates.
    pub(super) fn needed(&self, candidate: Candidate) -> f64 {
        if candidate == Candidate::LinearDrag && !self.knows_velocity {
            return 0.0;
        }
        let tried = if candidate.is_term() { 1.0 } else { self.tried as f64 };
        (self.numbers(candidate) * self.ln_samples() + 2.0 * tried.ln()).max(CLEAR_GAIN)
    }

    pub(super) fn decision(
        &self,
        candidate: Candidate,
        likelihood_ratio: f64,
        size: Option<f64>,
        held_out: Option<HeldOut>,
    ) -> Decision {
        let needed = self.needed(candidate);
        let refused = held_out.is_some_and(|held_out| {
            // What held-out trials lose is evidence, too.
            let loss = (2.0 * held_out.gain).min(0.0);
            held_out.speaks_against() || likelihood_ratio + loss < needed
        });
        let supported = likelihood_ratio > needed;
        let admitted = match candidate {
            // A term that the logs ask for leaves only if it is small.
            Candidate::LinearDrag => supported && size.is_none_or(|size| size > SLIGHT_LINEAR_DRAG),
            Candidate::Bias => supported || size.is_some_and(|size| size > SLIGHT_BIAS),
            _ => supported && !refused,
        };
        let hold_out_ratio = held_out.map(|held_out| 2.0 * held_out.gain);
        Decision { candidate, likelihood_ratio, needed, size, hold_out_ratio, admitted }
    }

    /// Whether a candidate is worth its place, by a fit with it and one without.
    pub(super) fn decide(
        &self,
        candidate: Candidate,
        with: &Fitted<'_>,
        without: &Fitted<'_>,
    ) -> Decision {
        let ratio = 2.0 * (without.optimum.cost - with.optimum.cost);
        // Nested optima differ by rounding, at least.
        let ratio = if ratio.abs() < 2.0 * ROUNDING { ratio.max(0.0) } else { ratio };
        let decision = self.decision(candidate, ratio, self.size(candidate, with), None);
        let is_possible = candidate != Candidate::Current || !follows_speed(with);
        Decision { admitted: decision.admitted && is_possible, ..decision }
    }

    /// The larger of two nested models, which cannot fit worse than the smaller: where it does, it
    /// has ended in a worse optimum, and starts again from that of the smaller.
    pub(super) fn at_least(
        &self,
        candidate: Candidate,
        with: Fitted<'a>,
        without: &Fitted<'a>,
    ) -> Fitted<'a> {
        if with.optimum.cost < without.optimum.cost + ROUNDING {
            return with;
        }
        let again = self.changed(without, &[], Some(candidate), Effort::COARSE);
        if again.optimum.cost < with.optimum.cost { again } else { with }
    }

    /// [`Search::decide`], with what held-out trials say.
    fn judged(&self, candidate: Candidate, with: &Fitted<'_>, without: &Fitted<'_>) -> Decision {
        let decision = self.decide(candidate, with, without);
        if self.hold_out.is_empty()
            || (decision.candidate == Candidate::Current && !decision.admitted)
        {
            return decision;
        }
        let Decision { likelihood_ratio, size, .. } = decision;
        let held_out = HeldOut::of(with, without, self.hold_out);
        self.decision(candidate, likelihood_ratio, size, Some(held_out))
    }

    /// How much a term does in a model that has it.
    pub(super) fn size(&self, candidate: Candidate, with: &Fitted<'_>) -> Option<f64> {
        let Usual { speed, thrust, .. } = self.fixed.shape.usual;
        let values = with.problem.values(&with.optimum.theta, 0);
        match candidate {
            Candidate::LinearDrag => {
                let (linear, quadratic) = (values.get(Unknown::Mu), values.get(Unknown::Beta));
                Some(if linear < 0.0 { linear / (quadratic * speed) } else { 0.0 })
            }
            Candidate::Bias => {
                let place = with.problem.index(Unknown::Bias, 0)?;
                let variance = scaled_inverse(&with.optimum.information)?[(place, place)];
                let farthest = values.get(Unknown::Bias).abs() + 1.96 * variance.sqrt();
                Some(farthest / (values.get(Unknown::Alpha) * thrust))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn currents_in_proportion_to_speed_are_told_from_a_current() {
        let with = |currents: [f64; 4]| {
            let pairs: Vec<(f64, f64)> = [0.3, 0.6, 0.9, 1.2].into_iter().zip(currents).collect();
            are_in_proportion(&pairs)
        };
        assert!(with([0.030, 0.061, 0.089, 0.120]));
        assert!(!with([0.1, 0.1, 0.1, 0.1]));
        assert!(!with([0.05, -0.02, 0.11, 0.08]));
        assert!(!are_in_proportion(&[(0.5, 0.1), (0.5, 0.1), (0.5, 0.1)]));
    }
}
