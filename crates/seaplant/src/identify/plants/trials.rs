//! Held-out trials of a plant of several axes, one by one.

use std::collections::BTreeMap;

use crate::judge::{GoodFor, Tested};
use crate::results::{PlantScore, Score};
use crate::{Caveat, Dof};

use super::Records;
use super::doubts::falls_short;
use super::under_way::drift_angles;

/// The motion that held-out trials confirm, and how well they are predicted there.
pub(super) struct Confirmed<'a> {
    score: &'a PlantScore,
    pub(super) good_for: GoodFor,
}

impl<'a> Confirmed<'a> {
    pub(super) fn new(score: &'a PlantScore, records: &Records<'_>) -> Self {
        let record =
            |trial: &str| records.hold_out.iter().find(|record| record.trial == trial).copied();
        let all = score.by_trial.iter().flat_map(|(trial, axes)| {
            axes.iter().map(move |(dof, own)| (trial.as_str(), *dof, own))
        });
        let tested = |(trial, axis, own): (&'a str, Dof, &Score)| {
            let pooled = score.by_axis.get(&axis)?;
            let series = record(trial).and_then(|record| record.velocity[axis.index()].clone());
            Some(Tested {
                trial,
                axis,
                error: own.mean_abs_error,
                free_error: None,
                null_error: own.null_error,
                usual_null_error: pooled.null_error,
                r_squared: own.r_squared,
                is_explained: own.is_of_disturbance(),
                is_vouched: pooled.is_vouched(),
                speed: series,
                acceleration: None,
            })
        };
        let tested: Vec<Tested<'_>> = all.filter_map(tested).collect();
        let drift = records
            .hold_out
            .iter()
            .filter_map(|record| Some((record.trial.as_str(), drift_angles(record)?)));
        let drift: BTreeMap<&str, [f64; 2]> = drift.collect();
        Self { score, good_for: GoodFor::new(&tested, &drift) }
    }

    /// Whether all trials together show an axis to be predicted.
    fn is_predicted(&self, dof: Dof) -> bool {
        self.score.by_axis.get(&dof).is_some_and(|pooled| !falls_short(pooled))
    }

    /// Names each trial that all of them together hide; axes that these show to be badly predicted are
    /// left to other caveats.
    pub(super) fn caveats(&self) -> Vec<Caveat> {
        self.good_for.caveats(|dof| self.is_predicted(dof))
    }

    /// Whether trials are worse than without a plant in an axis that all together show to be predicted.
    pub(super) fn has_hidden(&self) -> bool {
        self.good_for.not_as_in.iter().any(|worse| self.is_predicted(worse.axis))
    }

    /// The least R² of some axes over the trials that confirm them.
    pub(super) fn least_r2(&self, axes: &[Dof]) -> Option<f64> {
        let r2 = axes.iter().filter_map(|dof| {
            let own = &self.good_for.motion.get(dof)?.trials;
            let of = |trial: &String| self.score.by_trial.get(trial)?.get(dof)?.r_squared;
            own.iter().filter_map(of).min_by(f64::total_cmp)
        });
        r2.min_by(f64::total_cmp)
    }

    /// The same of one axis.
    pub(super) fn of_axis(&self, dof: Dof) -> GoodFor {
        self.good_for.of_axis(dof)
    }
}
