//! A lever arm of the velocity sensor that navigation did not know.

use nalgebra::{DMatrix, DVector};

use super::{OneAxis, axis_of};
use crate::estimate::candidate::Candidate;
use crate::estimate::plant_fit::Fitted;
use crate::estimate::plant_fit::descent::Tolerance;
use crate::estimate::plant_fit::uncertainty::{Asked, inverse};
use crate::{AxisRecord, TrialRecord};

/// A lever arm along the two axes of [`lever_axes`](crate::lever_axes), m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate) struct Lever {
    pub(in crate::estimate) value: [f64; 2],
    pub(in crate::estimate) std: [f64; 2],
}

/// Greatest number of steps of the lever arm: each is some half of what is left, for noise stands for the rest.
const MOST_STEPS: usize = 10;

/// Part of its standard deviation below which a step is negligible.
const SETTLED: f64 = 0.5;

/// A lever arm below this, m, is none: the place of a sensor is not known better.
const LEAST_LEVER_M: f64 = 0.02;

/// The lever arm by which costs are compared, m.
const TRIED_M: f64 = 0.1;

impl OneAxis<'_> {
    /// The same with a lever arm of the velocity sensor, if the trials show one; `None` unless it is another than
    /// before.
    ///
    /// At fixed gains innovations are linear in a lever arm, so that their costs at some lever arms tell the
    /// likeliest. `records` are as measured, and `before` is the lever arm that the fit's are free of.
    pub(super) fn with_lever_that_shows(
        &self,
        fitted: &Fitted,
        records: &[TrialRecord],
        before: Option<Lever>,
    ) -> Option<Levered> {
        if !self.may_have(Candidate::Lever) {
            return None;
        }
        let bar =
            if self.required.contains(&Candidate::Lever) { 0.0 } else { self.lever_bar(fitted) };
        let mut least = if before.is_some() { 0.0 } else { bar };
        let mut now = before;
        let mut here = self.records_without_lever(records, value_of(before))?;
        let mut found: Option<Levered> = None;
        for _ in 0..MOST_STEPS {
            let own = found.as_ref().map_or(fitted, |found| &found.fitted);
            let step = self.lever_beside(own, &here);
            let Some(next) = step.and_then(|step| step.from(value_of(now), bar)) else { break };
            let moves = |k: usize| (next.value[k] - value_of(now)[k]).abs() > SETTLED * next.std[k];
            if !(moves(0) || moves(1)) {
                break;
            }
            let Some(moved) = self.records_without_lever(records, next.value) else { break };
            here = moved;
            let problem = own.problem.of(&here.iter().collect::<Vec<_>>());
            let Ok(optimum) = problem.descent(own.optimum.point.clone(), Tolerance::COARSE) else {
                break;
            };
            let ratio = 2.0 * (fitted.optimum.cost - optimum.cost);
            if ratio <= least {
                break;
            }
            least = ratio;
            let fitted = own.moved_to(problem, optimum);
            found = Some(Levered { fitted, lever: next, records: here.clone(), ratio });
            now = Some(next);
        }
        found
    }

    /// Twice what the log-likelihood has to gain by two numbers.
    pub(super) fn lever_bar(&self, fitted: &Fitted) -> f64 {
        let tried = self.tried();
        2.0 * (fitted.problem.samples() as f64).ln() + 2.0 * tried.ln()
    }

    fn records_without_lever(
        &self,
        records: &[TrialRecord],
        lever: [f64; 2],
    ) -> Option<Vec<TrialRecord>> {
        let axis = axis_of(self.dof).index();
        let without = |(record, own): (&TrialRecord, &AxisRecord)| {
            let mut moved = record.clone();
            moved.velocity[axis] = own.without_lever(record.velocity[axis].as_ref()?, lever);
            moved.velocity[axis].is_some().then_some(moved)
        };
        records.iter().zip(self.axes).map(without).collect()
    }

    /// The step to the lever arm that is likeliest beside an optimum.
    fn lever_beside(&self, fitted: &Fitted, records: &[TrialRecord]) -> Option<LeverStep> {
        let (problem, optimum) = fitted.parts();
        let (_, gains) = problem.by_plant(&optimum.point)?;
        let cost = |lever: [f64; 2]| {
            let there = self.records_without_lever(records, lever)?;
            let there = problem.without_pieces(&there.iter().collect::<Vec<_>>());
            Some(there.at_gains(&optimum.point, &gains))
        };
        let h = TRIED_M;
        let here = cost([0.0; 2])?;
        let [[up, down], [above, below]] =
            [[cost([h, 0.0])?, cost([-h, 0.0])?], [cost([0.0, h])?, cost([0.0, -h])?]];
        let both = cost([h, h])?;
        let slope = DVector::from_vec(vec![up - down, above - below]) / (2.0 * h);
        let across = both - up - above + here;
        let curvature = DMatrix::from_row_slice(
            2,
            2,
            &[up + down - 2.0 * here, across, across, above + below - 2.0 * here],
        ) / (h * h);
        let white = fitted.whiteness().ok()?;
        let covariance = inverse(&curvature);
        let colour = white(axis_of(self.dof));
        Some(LeverStep { step: -(&covariance * slope), covariance, colour })
    }
}

/// A fit with a lever arm.
pub(super) struct Levered {
    pub(super) fitted: Fitted,
    pub(super) lever: Lever,
    /// Of a sensor without it.
    pub(super) records: Vec<TrialRecord>,
    /// Twice what the log-likelihood gains.
    pub(super) ratio: f64,
}

fn value_of(lever: Option<Lever>) -> [f64; 2] {
    lever.map_or([0.0; 2], |lever| lever.value)
}

/// A step of the lever arm, m.
struct LeverStep {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
    /// What the colour of innovations exaggerates its worth by.
    colour: f64,
}

impl LeverStep {
    /// The lever arm after the step from another, without what is not worth a bar; `None` if that is unknown.
    fn from(&self, now: [f64; 2], bar: f64) -> Option<Lever> {
        let Self { step, covariance, colour } = self;
        let numbers = step + DVector::from(now.to_vec());
        let mut asked = Asked { numbers, covariance: covariance.clone() };
        // What is worth it explains colour: what that exaggerates is seen without it.
        asked.without_unseen(|_, _| bar);
        let is_none = asked.numbers.amax() < LEAST_LEVER_M;
        let value = [0, 1].map(|k| if is_none { 0.0 } else { asked.numbers[k] });
        let std = [0, 1].map(|k| (colour * asked.covariance[(k, k)].max(0.0)).sqrt());
        std.iter().all(|std| std.is_finite()).then_some(Lever { value, std })
    }
}
