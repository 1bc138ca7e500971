//! What users get wrong, tried on the logs: signs, exchanged channels, frames, mounting, units.
//!
//! Each mistake is a change of the log. Least squares on the equation of motion, whose coefficients
//! have the signs that those of a vehicle have, says how much of the change of velocity the forces
//! explain with and without it. It needs no filter and no start, and takes a fraction of a second.

mod angles;
mod change;
mod instruments;
mod units;
mod weak;

use change::{Change, view};
use weak::{Explained, Look, View, explained, look};

use crate::trial::Logged;
use crate::{Caveat, CaveatCode, Dof, Role, Trial, Vehicle};

/// A mistake that explains the logs, and how to correct it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mistake {
    /// The axes whose motion it explains.
    pub(crate) axes: Vec<Dof>,
    /// What it is, how much better it explains the logs, and the line to change.
    pub(crate) message: String,
}

impl Mistake {
    /// It, as a doubt about plants.
    pub(crate) fn caveat(&self) -> Caveat {
        Caveat::severe(CaveatCode::LikelyMistake, self.message.clone())
    }
}

/// With a change less than this part of the misfit is left, all axes multiplied: of logs without a
/// mistake no change leaves less than 0.9 …
const MUCH_BETTER: f64 = 0.4;
/// … in one axis no more than this part of that without it, …
const BETTER: f64 = 0.6;
/// … and no more than this part of the variation: what forces explain half of, they cause; …
const EXPLAINS: f64 = 0.5;
/// … in no axis more than so many times as much, as by chance where little is explained anyway; …
const NOT_WORSE: f64 = 2.0;
/// … and log-likelihood grows by so much: chance in one of a million logs for one number, and the
/// changes tried are some dozens.
const SURE: f64 = 25.0;

/// Axes in which less than this part is left are said to be explained by a change.
const NOTICED: f64 = 0.8;

/// Others that leave less than so many times as much in all are named, too.
const AS_GOOD: f64 = 1.3;

/// Changes of more channels have to leave less, by this part each.
const PRICE: f64 = 0.05;

/// No more mistakes than this are made at once.
const MOST: usize = 3;

/// The mistakes of signs and places that explain the logs of trials to fit.
pub(crate) fn mistakes(vehicle: &Vehicle, trials: &[Trial]) -> Vec<Mistake> {
    let fitted = trials.iter().filter(|trial| trial.role() == Role::Fit);
    let logs: Vec<&Logged> = fitted.filter_map(Trial::logged).collect();
    let Some(bench) = Bench::new(&logs) else {
        return instruments::mistakes(&logs, &vehicle.sensors, &[]);
    };
    let Found { mistakes, changes, axes } = bench.search(vehicle);
    let reversed = |dof: &Dof| {
        changes.iter().any(|change| matches!(change, Change::Reversed(axes) if axes.contains(dof)))
    };
    let is_right = |(dof, found): &&Of| found.left < EXPLAINS && !reversed(dof);
    let right: Vec<Dof> = axes.iter().filter(is_right).map(|(dof, _)| *dof).collect();
    let mut all = instruments::mistakes(&logs, &vehicle.sensors, &right);
    all.extend(mistakes);
    all.extend(units::mistakes(vehicle, &logs, &axes));
    all
}

/// Changes that explain the logs.
struct Found {
    mistakes: Vec<Mistake>,
    changes: Vec<Change>,
    /// What is left with all of them.
    axes: Vec<Of>,
}

/// What is left of an axis.
type Of = (Dof, Explained);

/// By how much less is left, ln, over all axes.
fn worth(as_is: &[Of], with: &[Of]) -> f64 {
    let gain = |((_, a), (_, b)): (&Of, &Of)| (a.left / b.left).ln();
    as_is.iter().zip(with).map(gain).sum()
}

/// Whether a change explains the logs so much better that it is named.
fn is_sure(as_is: &[Of], with: &[Of]) -> bool {
    let both = || as_is.iter().zip(with).map(|((_, a), (_, b))| (a, b));
    let is_better =
        |(a, b): (&Explained, &Explained)| b.left < BETTER * a.left && b.left < EXPLAINS;
    let likelihood: f64 =
        both().map(|(a, b)| 0.5 * a.windows as f64 * (a.left / b.left).ln()).sum();
    as_is.len() == with.len()
        && worth(as_is, with) > -MUCH_BETTER.ln()
        && both().any(is_better)
        && both().all(|(a, b)| b.left < NOT_WORSE * a.left)
        && likelihood > SURE
}

/// The logs, and how each axis is looked at.
struct Bench<'a> {
    logs: &'a [&'a Logged],
    looks: Vec<(Dof, Look)>,
}

impl<'a> Bench<'a> {
    fn new(logs: &'a [&'a Logged]) -> Option<Self> {
        let views: Vec<View> = logs.iter().map(|log| view(log, &[])).collect();
        let of = |dof: &Dof| Some((*dof, look(&on_axis(logs, &views, *dof), *dof)?.0));
        let looks: Vec<(Dof, Look)> = Dof::ALL.iter().filter_map(of).collect();
        (!looks.is_empty()).then_some(Self { logs, looks })
    }

    /// The changes that explain the logs far better, the best first; and what they leave.
    fn search(&self, vehicle: &Vehicle) -> Found {
        let all = Change::all(self.logs);
        let (mut made, mut found) = (Vec::<Change>::new(), Vec::new());
        let mut as_is = self.axes(&made);
        while found.len() < MOST {
            let tried = |change: &Change| {
                let with: Vec<Change> = made.iter().chain([change]).cloned().collect();
                let axes = self.axes(&with);
                let worth = worth(&as_is, &axes) - PRICE * change.channels() as f64;
                (change.clone(), axes, worth)
            };
            let mut tried: Vec<(Change, Vec<Of>, f64)> = all.iter().map(tried).collect();
            tried.retain(|(_, axes, _)| is_sure(&as_is, axes));
            tried.sort_by(|a, b| b.2.total_cmp(&a.2));
            let Some((best, axes, worth)) = tried.first().cloned() else { break };
            let is_as_good =
                |(_, _, other): &&(Change, Vec<Of>, f64)| *other > worth - AS_GOOD.ln();
            let others: Vec<&Change> =
                tried.iter().skip(1).filter(is_as_good).map(|(change, ..)| change).collect();
            found.push(self.mistake(vehicle, &best, &others, [&as_is, &axes]));
            made.push(best);
            as_is = axes;
        }
        Found { mistakes: found, changes: made, axes: as_is }
    }

    /// What is left of each axis with changes.
    fn axes(&self, changes: &[Change]) -> Vec<Of> {
        let views: Vec<View> = self.logs.iter().map(|log| view(log, changes)).collect();
        let of = |(dof, look): &(Dof, Look)| {
            Some((*dof, explained(&on_axis(self.logs, &views, *dof), *dof, *look)?))
        };
        self.looks.iter().filter_map(of).collect()
    }

    fn mistake(
        &self,
        vehicle: &Vehicle,
        change: &Change,
        others: &[&Change],
        [as_is, with]: [&[Of]; 2],
    ) -> Mistake {
        let mut better: Vec<(Dof, f64, f64)> = as_is
            .iter()
            .zip(with)
            .filter(|((_, a), (_, b))| b.left < NOTICED * a.left)
            .map(|((dof, a), (_, b))| (*dof, a.left, b.left))
            .collect();
        better.sort_by(|a, b| (a.2 / a.1).total_cmp(&(b.2 / b.1)));
        let part = |left: f64| format!("{:.0} %", 100.0 * (1.0 - left));
        let most: Vec<String> = better
            .iter()
            .take(2)
            .map(|(dof, a, b)| {
                format!("{} of the changes of {dof} velocity in place of {}", part(*b), part(*a))
            })
            .collect();
        let advice = |change: &Change| change.advice(self.logs, &vehicle.sensors);
        let mut message = format!(
            "{}: if so, least squares explains {}; {}",
            change.words(),
            most.join(", and "),
            advice(change)
        );
        for other in others.iter().take(2) {
            message +=
                &format!("; or {}, which explains as much: {}", other.words(), advice(other));
        }
        let mut axes: Vec<Dof> = better.iter().map(|(dof, ..)| *dof).collect();
        axes.sort();
        Mistake { axes, message }
    }
}

/// The views of the trials that are to identify an axis.
fn on_axis<'v>(logs: &[&Logged], views: &'v [View], dof: Dof) -> Vec<&'v View> {
    let both = logs.iter().zip(views);
    both.filter(|(log, _)| log.axes.contains(&dof)).map(|(_, view)| view).collect()
}
