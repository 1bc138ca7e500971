//! A lever arm of the velocity sensor that navigation did not know.

use nalgebra::{DMatrix, DVector};

use super::{FittedAxis, OneAxis, axis_of, decision};
use crate::estimate::Fit;
use crate::estimate::candidate::Candidate;
use crate::estimate::plant_fit::Fitted;
use crate::estimate::plant_fit::problem::Problem;
use crate::estimate::plant_fit::uncertainty::{Asked, inverse};
use crate::{AxisRecord, Error, TrialRecord};

/// A lever arm along the two axes of [`lever_axes`](crate::lever_axes), m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimate) struct Lever {
    pub(in crate::estimate) value: [f64; 2],
    pub(in crate::estimate) std: [f64; 2],
}

/// Steps of the lever arm after which it has settled: it hardly depends on the plant.
const MOST_STEPS: usize = 3;

/// Part of its standard deviation below which a step is negligible.
const SETTLED: f64 = 0.5;

/// A lever arm below this, m, is none: the place of a sensor is not known better.
const LEAST_LEVER_M: f64 = 0.02;

/// The lever arm by which costs are compared, m.
const TRIED_M: f64 = 0.1;

impl OneAxis<'_> {
    /// Fits the plant, and a lever arm of the velocity sensor if the trials show one.
    ///
    /// At fixed gains innovations are linear in a lever arm, so that their costs at some lever arms tell the
    /// likeliest. With that taken out of the velocities all is fitted again, until the lever arm has settled.
    ///
    /// # Errors
    /// As [`Self::fit`].
    pub(in crate::estimate) fn fit_with_lever(&self) -> Result<(Fit, FittedAxis), Error> {
        let (mut fit, mut fitted) = self.fit()?;
        if !self.may_have(Candidate::Lever) || self.from.is_some() {
            return Ok((fit, fitted));
        }
        let is_required = self.required.contains(&Candidate::Lever);
        let needed =
            2.0 * (fitted.samples() as f64).ln() + 2.0 * (self.candidates.len() as f64).ln();
        let before = fitted.cost_of_sample();
        let mut lever = Lever { value: [0.0; 2], std: [0.0; 2] };
        let mut ratio = 0.0;
        for _ in 0..MOST_STEPS {
            let bar = if is_required { 0.0 } else { needed };
            let Some(next) = fitted.next_lever(lever.value, bar) else { break };
            let moves = |k: usize| (next.value[k] - lever.value[k]).abs() > SETTLED * next.std[k];
            if !(moves(0) || moves(1)) {
                break;
            }
            let axes: Vec<AxisRecord> =
                self.axes.iter().map(|axis| axis.with_lever(next.value)).collect();
            // With a lever arm that leaves no optimum there is none.
            let Ok(found) = (OneAxis { axes: &axes, ..*self }).fit() else { break };
            let gained = before - found.1.cost_of_sample();
            ratio = 2.0 * gained * found.1.samples() as f64;
            if ratio <= bar {
                break;
            }
            (lever, (fit, fitted)) = (next, found);
        }
        let admitted = lever.value != [0.0; 2];
        fit.structure.push(decision(Candidate::Lever, ratio, needed, admitted));
        fitted.lever = admitted.then_some(lever);
        Ok((fit, fitted))
    }

    /// The lever arm that is likeliest beside an optimum, and the worth of what it lacks.
    pub(super) fn lever_beside(
        &self,
        fitted: &Fitted,
        records: &[&TrialRecord],
    ) -> Option<LeverStep> {
        let axis = axis_of(self.dof);
        if !self.may_have(Candidate::Lever) {
            return None;
        }
        let (problem, optimum) = fitted.parts();
        let (_, gains) = problem.by_plant(&optimum.point)?;
        let moved = |record: &&TrialRecord, own: &AxisRecord, lever: [f64; 2]| {
            let mut moved = (*record).clone();
            let velocity = moved.velocity[axis.index()].as_ref()?;
            moved.velocity[axis.index()] = own.without_lever(velocity, lever);
            Some(moved)
        };
        let cost = |lever: [f64; 2]| {
            let records = records.iter().zip(self.axes);
            let records: Vec<TrialRecord> =
                records.map(|(record, own)| moved(record, own, lever)).collect::<Option<_>>()?;
            let there: Problem = problem.of(&records.iter().collect::<Vec<_>>());
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
        let colour = white(axis);
        let covariance = inverse(&curvature);
        Some(LeverStep { step: -(&covariance * slope), covariance, colour })
    }
}

/// A step of the lever arm from that of the velocities.
pub(super) struct LeverStep {
    step: DVector<f64>,
    covariance: DMatrix<f64>,
    /// What the colour of innovations exaggerates its worth by.
    colour: f64,
}

impl FittedAxis {
    fn samples(&self) -> usize {
        self.fitted.parts().0.samples()
    }

    /// Spikes differ from fit to fit, so that costs are compared by sample.
    fn cost_of_sample(&self) -> f64 {
        self.fitted.parts().1.cost / self.samples() as f64
    }

    /// The lever arm without what is not worth a bar, from that which velocities are free of; `None` if it
    /// is unknown.
    fn next_lever(&self, now: [f64; 2], bar: f64) -> Option<Lever> {
        let LeverStep { step, covariance, colour } = self.lever_step.as_ref()?;
        let numbers = step + DVector::from(now.to_vec());
        let mut asked = Asked { numbers, covariance: covariance.clone() };
        asked.without_unseen(|_, _| bar * colour);
        let is_none = asked.numbers.amax() < LEAST_LEVER_M;
        let value = [0, 1].map(|k| if is_none { 0.0 } else { asked.numbers[k] });
        let std = [0, 1].map(|k| (colour * asked.covariance[(k, k)].max(0.0)).sqrt());
        std.iter().all(|std| std.is_finite()).then_some(Lever { value, std })
    }
}
