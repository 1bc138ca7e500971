//! Thrusters that do not follow their own log: two of which each does what the log of the other says, as
//! channels or places in the vehicle file are exchanged, one that pushes the other way, and one that stands still
//! in all trials.
//!
//! A thruster at place i that follows the log of j adds the force
//!
//! ```text
//! s (w_i − w_j) (F_j − F_i),   s = 1 where they are exchanged, 0 where they are not,
//! ```
//!
//! one that pushes the other way `−2 s w_i F_i`, and one that stands still `−s w_i F_i`. Of each the slope of the
//! likelihood by s is known from one pass of the filter.

use std::cmp::Ordering;

use nalgebra::DVector;

use super::descent::Tolerance;
use super::differences::{Difference, needed, thruster_of};
use super::{FirstFit, Fitted, search};
use crate::plant::{Basis, Effect, EffectForce, Pusher, Structure};
use crate::series::median;
use crate::signal::rms;
use crate::trial::Miswired;
use crate::{Dof, Error, TrialRecord};

/// Between these s has to be, to first order from a plant that was fitted as if it were 0, and is far off for it.
const MISWIRED: [f64; 2] = [0.5, 3.0];

/// A thruster is tried the other way as well if its gain beside all others, to the same order, is so much less …
const PERHAPS_REVERSED: f64 = -0.8;

/// … and as one that stands still if it is as much less as this.
const PERHAPS_STILL: f64 = -0.4;

/// Gains say that a thruster pushes the other way if it gives less than this part of what most give.
const OTHER_WAY: f64 = -0.5;

/// A disturbance that is so large beside the logged forces of its axis may be those of such thrusters.
const MASKED: f64 = 0.5;

/// So many faults of the wiring at most are found.
const MOST: usize = 2;

/// So many are tried in each round.
const TRIED: usize = 4;

/// How thrusters follow the logs.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Wiring {
    /// Pairs of which each does what the log of the other says.
    pub(super) exchanged: Vec<[String; 2]>,
    /// Thrusters that push the other way.
    pub(super) reversed: Vec<String>,
    /// Thrusters that stand still in all trials, until they have gains.
    still: Vec<String>,
}

/// A fault of one thruster, or of two.
#[derive(Clone, Debug, PartialEq)]
enum Fault {
    Miswired(Miswired),
    /// One stands still.
    Still(String),
}

impl Fault {
    /// A record with thrust as it acts with this fault.
    fn of(&self, record: &TrialRecord) -> Result<TrialRecord, Error> {
        match self {
            Self::Miswired(which) => record.with_miswired(which),
            Self::Still(name) => record.with_gain(name, 0.0),
        }
    }
}

impl Wiring {
    fn count(&self) -> usize {
        self.exchanged.len() + self.reversed.len() + self.still.len()
    }

    /// The same with another fault; one that is found twice is none.
    fn with(mut self, other: Fault) -> Self {
        match other {
            Fault::Miswired(Miswired::Exchanged(pair)) if self.exchanged.last() == Some(&pair) => {
                self.exchanged.pop();
            }
            Fault::Miswired(Miswired::Exchanged(pair)) => self.exchanged.push(pair),
            Fault::Miswired(Miswired::Reversed(name)) if self.reversed.contains(&name) => {
                self.reversed.retain(|own| *own != name);
            }
            Fault::Miswired(Miswired::Reversed(name)) => self.reversed.push(name),
            Fault::Still(name) => self.still.push(name),
        }
        self
    }

    /// True of the gain of a thruster that stands still.
    fn stands_still(&self, structure: &Structure, gain: &Basis) -> bool {
        let thruster = thruster_of(structure, gain);
        thruster.is_some_and(|thruster| self.still.contains(&thruster.name))
    }

    /// A record with logs as the thrusters follow them.
    fn of(&self, record: &TrialRecord) -> Result<TrialRecord, Error> {
        let exchanged = record.with_all_exchanged(&self.exchanged)?;
        let gains = self.reversed.iter().map(|name| (name, -1.0));
        let mut gains = gains.chain(self.still.iter().map(|name| (name, 0.0)));
        gains.try_fold(exchanged, |record, (name, gain)| record.with_gain(name, gain))
    }

    /// Records with logs as the thrusters follow them; none where all follow their own.
    fn of_all(&self, records: &[&TrialRecord]) -> Result<Vec<TrialRecord>, Error> {
        match self.count() {
            0 => Ok(Vec::new()),
            _ => records.iter().map(|record| self.of(record)).collect(),
        }
    }
}

/// A fault that may be.
struct Suspect {
    which: Fault,
    /// Twice what the likelihood gains by it, to first order.
    worth: f64,
}

/// The likeliest fault.
struct Found {
    which: Fault,
    /// It is there if a fit with it costs less …
    cost: f64,
    /// … and less than one with gains of all thrusters, which explain one that stands still better; infinite where
    /// these say it themselves. With gains as well it is to cost clearly less.
    with_gains: f64,
    clearly: f64,
}

impl FirstFit {
    /// The same with thrusters that do not follow their own log, begun anew by `first_fit`, and the records with
    /// these; none where all follow their own.
    pub(super) fn with_wiring_that_shows(
        mut self,
        records: &[&TrialRecord],
        first_fit: impl Fn(&[&TrialRecord]) -> Result<Self, Error>,
    ) -> Result<(Self, Vec<TrialRecord>), Error> {
        let mut wired: Vec<TrialRecord> = Vec::new();
        while self.fitted.wiring.count() < MOST {
            let now = acting(&self.prompt, &wired, records);
            let (fitted, found) = self.fitted.with_miswired(&now)?;
            self.fitted = fitted;
            let Some(found) = found else { break };
            let wiring = self.fitted.wiring.clone().with(found.which.clone());
            let again = wiring.of_all(records)?;
            // Lever arms and lags that made up for the fault are not kept. A plant that does not settle is not
            // the likelier one.
            let Ok(next) = first_fit(&again.iter().collect::<Vec<_>>()) else { break };
            if !next.is_likelier(&found, &wiring, &acting(&next.prompt, &again, records))? {
                break;
            }
            self = Self { fitted: Fitted { wiring, ..next.fitted }, ..next };
            wired = again;
        }
        match self.fitted.wiring.still.is_empty() {
            true => Ok((self, wired)),
            false => self.with_gains_of_still(records),
        }
    }

    /// The same with the logs of thrusters that stand still as they are, and gains from there on.
    fn with_gains_of_still(
        mut self,
        records: &[&TrialRecord],
    ) -> Result<(Self, Vec<TrialRecord>), Error> {
        self.fitted.wiring.still.clear();
        let wired = self.fitted.wiring.of_all(records)?;
        let logged = acting(&[], &wired, records);
        if !self.prompt.is_empty() {
            let how = self.fitted.reported.how;
            let prompt = logged.iter().map(|record| record.with_translations_before(&how));
            self.prompt = prompt.collect();
        }
        let now = acting(&self.prompt, &wired, records);
        self.fitted.problem = self.fitted.problem.of(&now);
        let terms = self.fitted.problem.structure.terms().len();
        self.fitted = self.fitted.with_differences_that_show(&now)?;
        if self.fitted.problem.structure.terms().len() == terms {
            // Without gains the optimum is still that of records without this thrust.
            let point = self.fitted.optimum.point.clone();
            self.fitted.optimum = self.fitted.problem.optimum(point, Tolerance::COARSE)?;
        }
        Ok((self, wired))
    }

    /// Whether a fit with a fault is likelier than one without, and than gains of all thrusters.
    fn is_likelier(
        &self,
        found: &Found,
        wiring: &Wiring,
        records: &[&TrialRecord],
    ) -> Result<bool, Error> {
        let cost = self.fitted.optimum.cost;
        if cost >= found.cost {
            return Ok(false);
        }
        if cost < found.with_gains {
            return Ok(true);
        }
        let fitted = self.fitted.clone().with_speeds_as_they_are(records)?;
        let mut group = Difference::Gain.terms(&fitted.problem.structure);
        group.retain(|term| !wiring.stands_still(&fitted.problem.structure, term));
        let least = found.with_gains - found.clearly;
        Ok(fitted.with_group(&group, Difference::Gain).is_ok_and(|fit| fit.optimum.cost < least))
    }
}

impl Fitted {
    /// The same with thrusters as they act, and the likeliest fault of their wiring, if there may be any.
    fn with_miswired(mut self, records: &[&TrialRecord]) -> Result<(Self, Option<Found>), Error> {
        let mut group = Difference::Gain.terms(&self.problem.structure);
        group.retain(|term| !self.wiring.stands_still(&self.problem.structure, term));
        if group.len() < 2 {
            return Ok((self, None));
        }
        self = self.with_speeds_as_they_are(records)?;
        let beside = search::beside(&self.problem, &self.optimum.point, &group)?;
        let step = beside.step();
        let worth = -step.dot(&beside.beyond);
        let are_gains_off = worth >= needed(group.len()) * self.colour_of(&group)?;
        let is_suspect = are_gains_off || self.disturbance_over_force(records) >= MASKED;
        let found = if is_suspect { self.likeliest_fault(&group, &step, records)? } else { None };
        Ok((self, found))
    }

    /// The greatest ratio of the disturbance of an axis to the force that is logged on it.
    fn disturbance_over_force(&self, records: &[&TrialRecord]) -> f64 {
        let of = |(dof, disturbance): (&Dof, &f64)| {
            let logged = records.iter().filter_map(|record| record.force[dof.index()].as_ref());
            let force = rms(logged.flat_map(|force| force.values()));
            if force > 0.0 { disturbance / force } else { 0.0 }
        };
        let axes = self.problem.structure.axes().iter();
        axes.zip(&self.optimum.point.noise.disturbance).map(of).fold(0.0, f64::max)
    }

    /// The likeliest fault of the wiring, where gains ask for a step.
    fn likeliest_fault(
        &self,
        group: &[Basis],
        step: &DVector<f64>,
        records: &[&TrialRecord],
    ) -> Result<Option<Found>, Error> {
        let clearly = 0.5 * search::ADMITTED * self.colour_of(group)?;
        let mut suspects = self.suspects(group, 2.0 * clearly)?;
        let pushers = pushers(&self.problem.structure, group);
        let (lowest, least) = step.argmin();
        let name = || pushers[lowest].name.clone();
        let perhaps = [
            (PERHAPS_REVERSED, Fault::Miswired(Miswired::Reversed(name()))),
            (PERHAPS_STILL, Fault::Still(name())),
        ];
        for (bound, which) in perhaps {
            if least < bound && !suspects.iter().any(|one| one.which == which) {
                suspects.push(Suspect { which, worth: 2.0 * clearly });
            }
        }
        let mut best: Option<(Fault, f64)> = None;
        for Suspect { which, .. } in suspects {
            let tried = records.iter().map(|record| which.of(record));
            let tried = tried.collect::<Result<Vec<_>, Error>>()?;
            let tried = self.speeds_as_they_are(&tried.iter().collect::<Vec<_>>())?;
            // One that does not settle, or whose lever arms are far from these, may be likelier all the same.
            let cost = self.cost_with(&tried.iter().collect::<Vec<_>>());
            let cost = cost.map_or(self.optimum.cost, |cost| cost.min(self.optimum.cost));
            if best.as_ref().is_none_or(|(_, least)| cost < *least) {
                best = Some((which, cost));
            }
        }
        let Some((which, _)) = best else { return Ok(None) };
        let with_gains = match self.with_group(group, Difference::Gain) {
            Ok(fit) if fit.says_reversed(group, &which)? => f64::INFINITY,
            Ok(fit) => fit.optimum.cost,
            Err(_) => f64::INFINITY,
        };
        Ok(Some(Found { which, cost: self.optimum.cost - clearly, with_gains, clearly }))
    }

    /// Whether gains say that a thruster pushes the other way than most.
    fn says_reversed(&self, group: &[Basis], which: &Fault) -> Result<bool, Error> {
        let Fault::Miswired(Miswired::Reversed(name)) = which else { return Ok(false) };
        let plant = self.problem.plant(&self.optimum.point.free)?;
        let gain = |term: &Basis| 1.0 + plant.coefficient(term).unwrap_or(0.0);
        let mut all: Vec<f64> = group.iter().map(gain).collect();
        let thrusters = pushers(&self.problem.structure, group);
        let own = thrusters.iter().position(|own| own.name == *name).map(|k| all[k]);
        let usual = median(&mut all);
        Ok(own.zip(usual).is_some_and(|(own, usual)| own < OTHER_WAY * usual))
    }

    /// What a fit of the same plant to other records comes to.
    fn cost_with(&self, records: &[&TrialRecord]) -> Result<f64, Error> {
        let problem = self.problem.of(records);
        Ok(problem.descent(self.optimum.point.clone(), Tolerance::COARSE)?.cost)
    }

    /// Faults that may be, those that gain most first.
    fn suspects(&self, group: &[Basis], needed: f64) -> Result<Vec<Suspect>, Error> {
        let pushers = pushers(&self.problem.structure, group);
        let n = group.len();
        let mut structure = self.problem.structure.clone();
        let mut terms = group.to_vec();
        for i in 0..n {
            for j in (0..n).filter(|j| *j != i) {
                let thruster = Pusher { name: pushers[j].name.clone(), ..pushers[i].clone() };
                let name = format!("{} at {}", pushers[j].name, pushers[i].name);
                let force = EffectForce::Gain { thruster, reverse: false };
                structure = structure.with_effect(Effect { name, force }, false)?;
                terms.push(Basis::Effect(structure.effects().len() - 1));
            }
        }
        // The log of j at the place of i.
        let place = |i: usize, j: usize| match i.cmp(&j) {
            Ordering::Equal => i,
            Ordering::Less => n + i * (n - 1) + j - 1,
            Ordering::Greater => n + i * (n - 1) + j,
        };
        let problem = self.problem.with_terms(structure);
        let beside = search::beside(&problem, &self.optimum.point, &terms)?;
        let worth = |parts: &[(usize, f64)]| {
            let mut along = DVector::zeros(terms.len());
            parts.iter().for_each(|(at, part)| along[*at] = *part);
            let slope = along.dot(&beside.beyond);
            let curvature = along.dot(&(&beside.left * &along));
            let s = -slope / curvature;
            let may_be = curvature > 0.0 && (MISWIRED[0]..MISWIRED[1]).contains(&s);
            may_be.then(|| slope * slope / curvature)
        };
        let name = |k: usize| pushers[k].name.clone();
        let mut suspects = Vec::new();
        for i in 0..n {
            for (step, which) in [
                (-2.0, Fault::Miswired(Miswired::Reversed(name(i)))),
                (-1.0, Fault::Still(name(i))),
            ] {
                suspects.extend(worth(&[(i, step)]).map(|worth| Suspect { which, worth }));
            }
            for j in 0..i {
                let exchanged =
                    worth(&[(place(j, i), 1.0), (place(i, j), 1.0), (i, -1.0), (j, -1.0)]);
                let which = Fault::Miswired(Miswired::Exchanged([name(j), name(i)]));
                suspects.extend(exchanged.map(|worth| Suspect { which, worth }));
            }
        }
        suspects.retain(|one| one.worth > needed);
        suspects.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        suspects.truncate(TRIED);
        Ok(suspects)
    }
}

/// The records that a fit is of: with prompt velocities, with thrusters as they act, or as logged.
pub(super) fn acting<'a>(
    prompt: &'a [TrialRecord],
    wired: &'a [TrialRecord],
    logged: &[&'a TrialRecord],
) -> Vec<&'a TrialRecord> {
    match (prompt.is_empty(), wired.is_empty()) {
        (false, _) => prompt.iter().collect(),
        (true, false) => wired.iter().collect(),
        (true, true) => logged.to_vec(),
    }
}

/// The thrusters of gains.
fn pushers(structure: &Structure, group: &[Basis]) -> Vec<Pusher> {
    group.iter().filter_map(|term| thruster_of(structure, term)).cloned().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_that_is_found_twice_is_none() {
        let pair = || Fault::Miswired(Miswired::Exchanged(["a".to_owned(), "b".to_owned()]));
        let reversed = || Fault::Miswired(Miswired::Reversed("a".to_owned()));
        let both = Wiring::default().with(reversed()).with(pair());
        assert_eq!(both.count(), 2);
        assert_eq!(both.with(pair()).with(reversed()), Wiring::default());
    }
}
