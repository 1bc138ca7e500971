//! Asks again for what was left out of a model, beside what is left of it.

use nalgebra::DMatrix;

use super::elimination::{Parabola, all_numbers, narrowed, places, replace};
use super::{OneAxis, decision, or_likelier};
use crate::TrialRecord;
use crate::estimate::candidate::{Candidate, Decision};
use crate::estimate::plant_fit::Fitted;
use crate::estimate::plant_fit::actuator::Actuator;
use crate::estimate::plant_fit::descent::Tolerance;
use crate::estimate::plant_fit::problem::Problem;
use crate::estimate::plant_fit::search::scores;
use crate::estimate::plant_fit::uncertainty::inverse;
use crate::plant::{Basis, Effect};

impl OneAxis<'_> {
    /// The same with what was left out while others stood for it, if that is likelier by the Bayesian information
    /// criterion.
    pub(super) fn with_left_out_again(
        &self,
        fitted: Fitted,
        records: &[&TrialRecord],
        decisions: &mut Vec<Decision>,
    ) -> Fitted {
        // A fit that does not settle with them does without.
        let Some(wider) = self.with_left_out_that_shows(&fitted, records) else { return fitted };
        let mut again = decisions.clone();
        let other = self.eliminated(wider, &mut again);
        or_likelier(fitted, decisions, (other, again))
    }

    /// The same with turning that was left out, if likelihood gains by it what it has to. A body that turns is known to
    /// feel it, so that colour of the innovations, which makes others worth less, does not count against it.
    pub(super) fn with_turning_again(
        &self,
        fitted: Fitted,
        decisions: &mut Vec<Decision>,
    ) -> Fitted {
        let (problem, optimum) = fitted.parts();
        let structure = &problem.structure;
        let is_turning = |effect: &Effect| effect.name == Candidate::Turning.name();
        let Some(k) = structure.effects().iter().position(is_turning) else { return fitted };
        let term = [Basis::Effect(k)];
        if structure.index_of(&term[0]).is_some() {
            return fitted;
        }
        let needed = (problem.samples() as f64).ln() + 2.0 * self.tried().ln();
        let score = scores(problem, &optimum.point, &term);
        if !score.is_ok_and(|score| score[0] > needed) {
            return fitted;
        }
        // A fit that does not settle with it does without.
        let Ok(wider) = fitted.with_terms(structure, &term) else { return fitted };
        let ratio = 2.0 * (optimum.cost - wider.optimum.cost);
        if ratio <= needed {
            return fitted;
        }
        replace(decisions, vec![decision(Candidate::Turning, ratio, needed, true)]);
        wider
    }

    /// The optimum with those that one pass of the filter says are worth their place; `None` if none are.
    fn with_left_out_that_shows(
        &self,
        fitted: &Fitted,
        records: &[&TrialRecord],
    ) -> Option<Fitted> {
        let (old, optimum) = fitted.parts();
        let (wide, point) = self.with_all(fitted, records).ok()?;
        let left_out = |candidate: &Candidate| {
            let missing = places(*candidate, old).is_none();
            missing.then(|| Some((*candidate, places(*candidate, &wide)?))).flatten()
        };
        let left_out: Vec<(Candidate, Vec<usize>)> =
            self.candidates.iter().filter_map(left_out).collect();
        if left_out.is_empty() {
            return None;
        }
        let (slope, _) = wide.by_plant(&point)?;
        let fitted_numbers = places_of_fitted(&wide, old);
        let drifts = optimum.point.noise.drift.is_some();
        let is_worth_it = |(candidate, own): &(Candidate, Vec<usize>)| {
            let free: Vec<usize> = fitted_numbers.iter().chain(own).copied().collect();
            let of_free = slope.information.select_rows(&free).select_columns(&free);
            let covariance = inverse(&of_free);
            let step = -(&covariance * slope.gradient.select_rows(&free));
            let mut beside = Parabola {
                theta: all_numbers(&wide, &point),
                covariance: DMatrix::zeros(slope.gradient.len(), slope.gradient.len()),
            };
            for (j, &row) in free.iter().enumerate() {
                beside.theta[row] += step[j];
                for (k, &column) in free.iter().enumerate() {
                    beside.covariance[(row, column)] = covariance[(j, k)];
                }
            }
            // Inflow never adds to thrust.
            let is_barred = matches!(candidate, Candidate::Inflow) && beside.theta[own[0]] < 0.0;
            let judged = self.judged(*candidate, &beside, own, (&wide, drifts));
            // What stays because it is not known to be slight does not come back for that.
            !is_barred && judged.admitted && judged.likelihood_ratio > judged.needed
        };
        let (back, out): (Vec<_>, Vec<_>) = left_out.into_iter().partition(is_worth_it);
        if back.is_empty() {
            return None;
        }
        let out: Vec<Candidate> = out.into_iter().map(|(candidate, _)| candidate).collect();
        let (problem, point) = narrowed(&wide, &point, &out);
        let optimum = problem.descent(point, Tolerance::COARSE).ok()?;
        Some(fitted.moved_to(problem, optimum))
    }
}

/// Where the numbers that a narrower problem fits stand among those of a wider one.
fn places_of_fitted(wide: &Problem, old: &Problem) -> Vec<usize> {
    let terms = old.structure.terms().iter().filter_map(|term| wide.structure.index_of(term));
    let p = wide.structure.terms().len();
    let numbers = (0..Actuator::COUNT).filter(|k| old.fits[*k]).map(|k| p + k);
    let currents = if old.has_current { 2 * old.trials.len() } else { 0 };
    let first = p + Actuator::COUNT;
    terms.chain(numbers).chain(first..first + currents).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::{Disturbance, TwinSpec, make};
    use crate::{AxisRecord, Dof, Trial, TrialSetup, VelocitySource};

    /// Surge of a twin with such disturbances.
    fn record(disturbances: &str) -> AxisRecord {
        let spec = TwinSpec {
            dofs: [Dof::Surge].into(),
            duration_s: 240.0,
            disturbances: Disturbance::parse_list(disturbances).expect("known"),
            ..TwinSpec::jason2()
        };
        let twin = make(&spec).expect("can be made");
        let setup = TrialSetup { dofs: vec![Dof::Surge], ..Default::default() };
        let trial = Trial::new(setup, &twin.trials[0].recording, &twin.vehicle).expect("complete");
        trial.axis(Dof::Surge, VelocitySource::Measured).expect("measured")
    }

    /// Whether a fit of this record that lacks the lag has one again.
    fn lag_comes_back(axis: AxisRecord) -> bool {
        let record = axis.as_trial().expect("valid");
        let asked = OneAxis {
            dof: Dof::Surge,
            axes: &[axis],
            candidates: &[Candidate::Lag, Candidate::Bias],
            required: &[],
            terms: None,
            from: None,
        };
        let (_, _, all) = asked.begun(&[&record]).expect("an optimum");
        let without = asked.without(&all, &[Candidate::Lag]).expect("an optimum");
        assert!(!without.problem.fits[Actuator::LAG]);
        let again = asked.with_left_out_again(without, &[&record], &mut Vec::new());
        again.problem.fits[Actuator::LAG]
    }

    #[test]
    fn a_lag_that_was_left_out_comes_back_where_there_is_one() {
        assert!(lag_comes_back(record("lag")));
        assert!(!lag_comes_back(record("none")));
    }
}
