//! Held-out trials of a plant of several axes, one by one.

use std::collections::BTreeMap;

use crate::Dof;
use crate::judge::{GoodFor, Tested, vouched};
use crate::results::{PlantScore, Score};

use super::Records;
use super::under_way::drift_angles;

/// Returns the motion that held-out trials confirm.
pub(super) fn confirmed(score: &PlantScore, records: &Records<'_>) -> GoodFor {
    let record =
        |trial: &str| records.hold_out.iter().find(|record| record.trial == trial).copied();
    let all = score
        .by_trial
        .iter()
        .flat_map(|(trial, axes)| axes.iter().map(move |(dof, own)| (trial.as_str(), *dof, own)));
    let tested = |(trial, axis, own): (_, Dof, &Score)| {
        let pooled = score.by_axis.get(&axis)?;
        let is_vouched = vouched(pooled, score.trials(axis).map(|(_, own)| own));
        let speed = record(trial).and_then(|record| record.velocity[axis.index()].clone());
        Some(Tested { speed, ..Tested::new(trial, axis, own, (pooled, is_vouched)) })
    };
    let tested: Vec<Tested<'_>> = all.filter_map(tested).collect();
    let drift = records
        .hold_out
        .iter()
        .filter_map(|record| Some((record.trial.as_str(), drift_angles(record)?)));
    let drift: BTreeMap<&str, [f64; 2]> = drift.collect();
    GoodFor::new(&tested, &drift)
}
