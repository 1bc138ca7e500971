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
use super::{FirstFit, Fitted, gains, search};
use crate::plant::{Basis, Effect, EffectForce, Pusher, Structure};
use crate::signal::rms;
use crate::{Dof, Error, TrialRecord};

/// Between these s has to be, to first order from a plant that was fitted as if they were not exchanged.
const EXCHANGED: [f64; 2] = [0.5, 1.5];

/// A disturbance that is so large beside the logged forces of its axis may be those of exchanged thrusters.
const MASKED: f64 = 0.5;

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

/// Two thrusters that may be exchanged.
struct Suspects {
    pair: [String; 2],
    /// They are, if a fit with their logs exchanged costs less.
    cost: f64,
}

impl FirstFit {
    /// The same with thrusters that follow each other's log, begun anew by `first_fit`, and the records with these; none
    /// where all follow their own.
    pub(super) fn with_exchanges(
        mut self,
        records: &[&TrialRecord],
        first_fit: impl Fn(&[&TrialRecord]) -> Result<Self, Error>,
    ) -> Result<(Self, Vec<TrialRecord>), Error> {
        let mut wired: Vec<TrialRecord> = Vec::new();
        while self.fitted.exchanged.len() < MOST_PAIRS {
            let now: Vec<&TrialRecord> = match (self.prompt.is_empty(), wired.is_empty()) {
                (false, _) => self.prompt.iter().collect(),
                (true, false) => wired.iter().collect(),
                (true, true) => records.to_vec(),
            };
            let (fitted, suspects) = self.fitted.with_suspects(&now)?;
            self.fitted = fitted;
            let Some(Suspects { pair, cost }) = suspects else { break };
            let exchanged = [self.fitted.exchanged.clone(), vec![pair]].concat();
            let again = records.iter().map(|record| record.with_all_exchanged(&exchanged));
            let again = again.collect::<Result<Vec<_>, Error>>()?;
            // Lever arms and lags that made up for the exchange are not kept. A plant that does not settle is not
            // the likelier one.
            let Ok(next) = first_fit(&again.iter().collect::<Vec<_>>()) else { break };
            if next.fitted.optimum.cost >= cost {
                break;
            }
            self = Self { fitted: Fitted { exchanged, ..next.fitted }, ..next };
            wired = again;
        }
        Ok((self, wired))
    }
}

impl Fitted {
    /// The same with thrusters as they act, and two of them that may follow each other's log, if any do.
    fn with_suspects(
        mut self,
        records: &[&TrialRecord],
    ) -> Result<(Self, Option<Suspects>), Error> {
        let group = gains::gains(&self.problem.structure, false);
        if group.len() < 2 {
            return Ok((self, None));
        }
        self = self.with_speeds_as_they_are(records)?;
        let beside = search::beside(&self.problem, &self.optimum.point, &group)?;
        let worth = -beside.step().dot(&beside.beyond);
        let are_gains_off = worth >= gains::needed(group.len()) * self.colour_of(&group)?;
        let is_suspect = are_gains_off || self.disturbance_over_force(records) >= MASKED;
        let pair = if is_suspect { self.best_exchange(&group, records)? } else { None };
        Ok((self, pair))
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

    /// The likeliest exchange of two thrusters.
    fn best_exchange(
        &self,
        group: &[Basis],
        records: &[&TrialRecord],
    ) -> Result<Option<Suspects>, Error> {
        let clearly = search::ADMITTED * self.colour_of(group)?;
        let pushers = pushers(&self.problem.structure, group);
        let mut best: Option<([String; 2], f64)> = None;
        for pair in self.pairs(group, &pushers)?.into_iter().filter(|pair| pair.worth > clearly) {
            let names = pair.places.map(|k| pushers[k].name.clone());
            let tried = records.iter().map(|record| record.with_exchanged(&names[0], &names[1]));
            let tried = tried.collect::<Result<Vec<_>, Error>>()?;
            let tried = self.speeds_as_they_are(&tried.iter().collect::<Vec<_>>())?;
            // One that does not settle, or whose lever arms are far from these, may be likelier all the same.
            let cost = self.cost_with(&tried.iter().collect::<Vec<_>>());
            let cost = cost.map_or(self.optimum.cost, |cost| cost.min(self.optimum.cost));
            if best.as_ref().is_none_or(|(_, least)| cost < *least) {
                best = Some((names, cost));
            }
        }
        let Some((pair, _)) = best else { return Ok(None) };
        // Gains of all have more numbers, and explain a thruster that stands still better.
        let of_gains = self.with_group(group, false).map_or(f64::INFINITY, |fit| fit.optimum.cost);
        Ok(Some(Suspects { pair, cost: of_gains.min(self.optimum.cost - 0.5 * clearly) }))
    }

    /// What a fit of the same plant to other records comes to.
    fn cost_with(&self, records: &[&TrialRecord]) -> Result<f64, Error> {
        let problem = self.problem.of(records);
        Ok(problem.descent(self.optimum.point.clone(), Tolerance::COARSE)?.cost)
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
