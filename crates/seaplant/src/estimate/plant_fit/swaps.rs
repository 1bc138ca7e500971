//! Two thrusters of which each does what the log of the other says: their channels, or their places in the
//! vehicle file, are exchanged.
//!
//! A thruster at place i that follows the log of j adds the force
//!
//! ```text
//! s (w_i − w_j) (F_j − F_i),   s = 1 where they are exchanged, 0 where they are not
//! ```
//!
//! Of each pair the slope of the likelihood by s is known from one pass of the filter.

use nalgebra::DVector;

use super::descent::Tolerance;
use super::{Fitted, Optimum, gains, search};
use crate::plant::{Basis, Effect, EffectForce, Pusher, Structure};
use crate::{Error, TrialRecord};

/// Between these s has to be, to first order from a plant that was fitted as if they were not exchanged.
const EXCHANGED: [f64; 2] = [0.5, 1.5];

/// So many pairs at most are exchanged.
const MOST_PAIRS: usize = 2;

/// So many pairs are tried in each round.
const TRIED: usize = 3;

/// Two thrusters, by their places in the group of those with a gain.
struct Pair {
    places: [usize; 2],
    /// Twice what the likelihood gains if they are exchanged, to first order.
    worth: f64,
}

impl Fitted {
    /// The same with thrusters that follow each other's log, and the records with these; none where all
    /// follow their own.
    pub(super) fn with_thrusters_exchanged(
        mut self,
        records: &[&TrialRecord],
    ) -> Result<(Self, Vec<TrialRecord>), Error> {
        let mut found: Vec<TrialRecord> = Vec::new();
        let group = gains::gains(&self.problem.structure, false);
        if group.len() < 2 {
            return Ok((self, found));
        }
        self = self.with_speeds_as_they_are(records)?;
        while self.exchanged.len() < MOST_PAIRS {
            // Without a sign that gains are off, nothing is exchanged.
            let beside = search::beside(&self.problem, &self.optimum.point, &group)?;
            let step = beside.step();
            let worth = -step.dot(&beside.beyond);
            if worth < gains::needed(group.len()) * self.colour_of(&group)? {
                break;
            }
            let Some(better) = self.best_exchange(&group, records, &found)? else { break };
            (self, found) = better;
        }
        Ok((self, found))
    }

    /// The likeliest exchange of two thrusters, if that is likelier than gains of all.
    fn best_exchange(
        &self,
        group: &[Basis],
        records: &[&TrialRecord],
        found: &[TrialRecord],
    ) -> Result<Option<(Self, Vec<TrialRecord>)>, Error> {
        let pushers = pushers(&self.problem.structure, group);
        let mut best: Option<(Self, Vec<TrialRecord>)> = None;
        for pair in self.pairs(group, &pushers)? {
            let [a, b] = pair.places.map(|k| pushers[k].name.as_str());
            let now: Vec<TrialRecord> = match found.is_empty() {
                true => records.iter().map(|record| (*record).clone()).collect(),
                false => found.to_vec(),
            };
            let tried = now.iter().map(|record| record.with_exchanged(a, b));
            let tried = tried.collect::<Result<Vec<_>, Error>>()?;
            let seen: Vec<&TrialRecord> = tried.iter().collect();
            let seen = self.speeds_as_they_are(&seen)?;
            let problem = self.problem.of(&seen.iter().collect::<Vec<_>>());
            let point = self.optimum.point.clone();
            // A plant that does not settle is not the likelier one.
            let Ok(optimum) = problem.descent(point, Tolerance::COARSE) else { continue };
            let least = best.as_ref().map_or(self.optimum.cost, |(own, _)| own.optimum.cost);
            if optimum.cost >= least {
                continue;
            }
            let iterations = self.optimum.iterations + optimum.iterations;
            let mut better = self.moved_to(problem, Optimum { iterations, ..optimum });
            better.exchanged.push([a.to_owned(), b.to_owned()]);
            best = Some((better, tried));
        }
        let Some((own, records)) = best else { return Ok(None) };
        let gained = 2.0 * (self.optimum.cost - own.optimum.cost);
        let is_clear = gained > search::ADMITTED * own.colour_of(group)?;
        // Gains of all have more numbers, and explain a thruster that stands still better.
        let of_gains = self.with_group(group, false).map(|fit| fit.optimum.cost);
        let is_likelier = of_gains.map_or(true, |cost| own.optimum.cost < cost);
        Ok((is_clear && is_likelier).then_some((own, records)))
    }

    /// Pairs that may be exchanged, those that gain most first.
    fn pairs(&self, group: &[Basis], pushers: &[Pusher]) -> Result<Vec<Pair>, Error> {
        let n = group.len();
        let mut structure = self.problem.structure.clone();
        let mut terms = group.to_vec();
        let mut place = vec![vec![0; n]; n];
        for i in 0..n {
            for j in 0..n {
                place[i][j] = if i == j { i } else { terms.len() };
                if i != j {
                    let thruster = Pusher { name: pushers[j].name.clone(), ..pushers[i].clone() };
                    let name = format!("{} at {}", pushers[j].name, pushers[i].name);
                    let force = EffectForce::Gain { thruster, reverse: false };
                    structure = structure.with_effect(Effect { name, force }, false)?;
                    terms.push(Basis::Effect(structure.effects().len() - 1));
                }
            }
        }
        let problem = self.problem.with_terms(structure);
        let beside = search::beside(&problem, &self.optimum.point, &terms)?;
        let mut pairs = Vec::new();
        for i in 0..n {
            for j in 0..i {
                let mut along = DVector::zeros(terms.len());
                for (of, at, sign) in [(j, i, 1.0), (i, j, 1.0), (i, i, -1.0), (j, j, -1.0)] {
                    along[place[at][of]] = sign;
                }
                let slope = along.dot(&beside.beyond);
                let curvature = along.dot(&(&beside.left * &along));
                let s = -slope / curvature;
                if curvature > 0.0 && (EXCHANGED[0]..EXCHANGED[1]).contains(&s) {
                    pairs.push(Pair { places: [j, i], worth: slope * slope / curvature });
                }
            }
        }
        pairs.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        pairs.truncate(TRIED);
        Ok(pairs)
    }
}

/// The thrusters of gains.
fn pushers(structure: &Structure, group: &[Basis]) -> Vec<Pusher> {
    let of = |term: &Basis| {
        let Basis::Effect(k) = term else { return None };
        match &structure.effects()[*k].force {
            EffectForce::Gain { thruster, .. } => Some(thruster.clone()),
            _ => None,
        }
    };
    group.iter().filter_map(of).collect()
}
