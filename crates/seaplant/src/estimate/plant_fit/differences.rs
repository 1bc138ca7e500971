//! Thrusters that are not alike: a gain, a lag and a dead band for each, where the trials ask for them.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::descent::{Optimum, Tolerance};
use super::search;
use super::uncertainty::inverse;
use super::{Actuator, Fitted};
use crate::plant::{Basis, EffectForce, Plant, Pusher, Structure, ThrusterNumber};
use crate::series::median;
use crate::{Error, TrialRecord};

/// Differences are admitted whose gain in likelihood chance makes as rarely: once in 100 000.
const CHANCE: f64 = 1e-5;

/// Thrusters whose gains, dead bands, and lags in seconds differ by less are alike.
pub(super) const LEAST_MINDED: f64 = 0.01;

/// So far from the thrust of curves likelihood is no parabola.
const FAR: f64 = 0.35;

/// A way in which thrusters may differ from each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Difference {
    /// In what they give of the thrust of their curves.
    Gain,
    /// In what they give of it in reverse beyond that.
    InReverse,
    /// In their lag, or their dead band.
    Own(ThrusterNumber),
}

impl Difference {
    const ALL: [Self; 4] = [
        Self::Gain,
        Self::InReverse,
        Self::Own(ThrusterNumber::Lag),
        Self::Own(ThrusterNumber::DeadBand),
    ];

    /// Returns the difference that a term stands for, if it is that of one thruster.
    pub(super) fn of_term(structure: &Structure, term: &Basis) -> Option<Self> {
        let Basis::Effect(k) = term else { return None };
        match &structure.effects()[*k].force {
            EffectForce::Gain { reverse: false, .. } => Some(Self::Gain),
            EffectForce::Gain { reverse: true, .. } => Some(Self::InReverse),
            EffectForce::Own { number, .. } => Some(Self::Own(*number)),
            _ => None,
        }
    }

    /// Returns the terms for it that a plant may have beside its own.
    pub(super) fn terms(self, structure: &Structure) -> Vec<Basis> {
        let all = (0..structure.effects().len()).map(Basis::Effect);
        let own = all.filter(|term| Self::of_term(structure, term) == Some(self));
        own.filter(|term| structure.index_of(term).is_none()).collect()
    }
}

impl Fitted {
    /// Finds the optimum with such terms of thrusters; gains in reverse are in place of the ratio of all.
    pub(super) fn with_group(&self, group: &[Basis], of: Difference) -> Result<Self, Error> {
        let structure = search::with_all(&self.problem.structure, group)?;
        let mut problem = self.problem.with_terms(structure);
        let mut start = search::widened(&problem, &self.problem, &self.optimum.point);
        if of == Difference::InReverse {
            problem.fits[Actuator::REVERSE] = false;
            start.actuator.log_reverse_ratio = 0.0;
        }
        let optimum = problem.optimum(start, Tolerance::COARSE)?;
        Ok(self.moved_to(problem, optimum))
    }

    /// Returns the joint significance of terms, θᵀ C⁻¹ θ, and the greatest of them; of their differences from the
    /// last where one number could stand for all.
    fn worth_of(&self, terms: &[Basis], differing: bool) -> Result<(f64, f64), Error> {
        let plant = self.problem.plant(&self.optimum.point.free)?;
        let places: Vec<usize> =
            terms.iter().filter_map(|term| plant.structure().index_of(term)).collect();
        let theta = DVector::from_row_slice(plant.coefficients()).select_rows(&places);
        let covariance = self.covariance().select_rows(&places).select_columns(&places);
        let n = places.len();
        let contrasts = match differing {
            true => DMatrix::from_fn(n - 1, n, |i, j| match j {
                _ if j == i => 1.0,
                _ if j == n - 1 => -1.0,
                _ => 0.0,
            }),
            false => DMatrix::identity(n, n),
        };
        let theta = &contrasts * theta;
        let covariance = &contrasts * covariance * contrasts.transpose();
        Ok((theta.dot(&(inverse(&covariance) * &theta)), theta.amax()))
    }

    /// Adds gains, lags and dead bands of thrusters where the trials support them: those with the highest score
    /// first, since thrusters that differ in one seem to differ in others.
    ///
    /// Thrust as many times larger on all of them looks like mass and drag as many times larger: unless
    /// a coefficient is held, one that is like most others keeps the gain of its curve, and
    /// [`Scaled::of`](super::gains::Scaled::of) then has the mean of all be that of the curves. One keeps the lag and
    /// the dead band of all likewise.
    pub(super) fn with_differences_that_show(
        mut self,
        records: &[&TrialRecord],
    ) -> Result<Self, Error> {
        if Difference::Gain.terms(&self.problem.structure).len() < 2 {
            return Ok(self);
        }
        self = self.with_speeds_as_they_are(records)?;
        let mut open = Difference::ALL.to_vec();
        loop {
            let most = self
                .asked_of_thrusters(&open)?
                .into_iter()
                .max_by(|a, b| a.beyond_chance.total_cmp(&b.beyond_chance));
            let Some(AskedOfThrusters { of, group, needed, .. }) = most else { return Ok(self) };
            open.retain(|other| *other != of);
            // Differences that the trials do not determine leave the plant without an optimum.
            let Ok(wider) = self.with_group(&group, of) else { continue };
            // Other faults colour innovations, which exaggerates the score; what counts is what is
            // left of them.
            let (mut worth, greatest) = wider.worth_of(&group, of == Difference::InReverse)?;
            if greatest > FAR && !matches!(of, Difference::Own(_)) {
                worth = worth.max(2.0 * (self.optimum.cost - wider.optimum.cost));
            }
            if worth > needed * wider.colour_of(&group)? && greatest > LEAST_MINDED {
                self = match of {
                    Difference::Own(_) => wider.with_own_numbers_as_they_are(records)?,
                    _ => wider.with_speeds_as_they_are(records)?,
                };
            }
        }
    }

    /// Repeats the fit with the change of thrust by each thruster's own lag and dead band, in place of its derivative,
    /// until they stay.
    fn with_own_numbers_as_they_are(mut self, records: &[&TrialRecord]) -> Result<Self, Error> {
        for _ in 0..MOST_STEPS {
            let before = own_numbers(&self.problem.plant(&self.optimum.point.free)?);
            self = self.with_speeds_as_they_are(records)?;
            let start = self.optimum.point.clone();
            let optimum = self.problem.optimum(start, Tolerance::COARSE)?;
            let iterations = self.optimum.iterations + optimum.iterations;
            self.optimum = Optimum { iterations, ..optimum };
            let after = own_numbers(&self.problem.plant(&self.optimum.point.free)?);
            let is_near = |(own, before): (&Own, &Own)| {
                let [late, dead] = [own.lag_s - before.lag_s, own.dead_band - before.dead_band];
                late.abs().max(dead.abs()) < NEAR
            };
            if after.values().zip(before.values()).all(is_near) {
                break;
            }
        }
        self.with_speeds_as_they_are(records)
    }

    /// Returns the terms of the differences whose score supports them, from one pass of the filter.
    fn asked_of_thrusters(&self, open: &[Difference]) -> Result<Vec<AskedOfThrusters>, Error> {
        let structure = &self.problem.structure;
        let groups = open.iter().map(|of| (*of, of.terms(structure)));
        let groups: Vec<(Difference, Vec<Basis>)> =
            groups.filter(|(_, group)| group.len() > 1).collect();
        let all: Vec<Basis> = groups.iter().flat_map(|(_, group)| group.clone()).collect();
        if all.is_empty() {
            return Ok(Vec::new());
        }
        let beside = search::beside(&self.problem, &self.optimum.point, &all)?;
        let (mut first, mut asked) = (0, Vec::new());
        for (of, mut group) in groups {
            let (count, needed) = (group.len(), needed(group.len()));
            let left = beside.left.view((first, first), (count, count)).into_owned();
            let beyond = beside.beyond.rows(first, count);
            let step = -(inverse(&left) * beyond);
            first += count;
            let beyond_chance = -step.dot(&beyond) / needed;
            if beyond_chance < 1.0 {
                continue;
            }
            let is_common_known = match of {
                Difference::Gain => has_scale(structure),
                Difference::InReverse => true,
                Difference::Own(ThrusterNumber::Lag) => !self.problem.fits[Actuator::LAG],
                Difference::Own(ThrusterNumber::DeadBand) => {
                    !self.problem.fits[Actuator::DEAD_BAND]
                }
            };
            if !is_common_known {
                let middle = median(&mut step.iter().copied().collect::<Vec<f64>>()).unwrap_or(0.0);
                let off = |k: &usize| (step[*k] - middle).abs();
                let usual = (0..group.len()).min_by(|a, b| off(a).total_cmp(&off(b)));
                usual.map(|k| group.remove(k));
            }
            asked.push(AskedOfThrusters { of, group, needed, beyond_chance });
        }
        Ok(asked)
    }
}

/// Largest number of such repetitions.
const MOST_STEPS: usize = 4;
/// Change of a lag, s, and of a dead band below which they stay.
const NEAR: f64 = 2e-3;

/// Terms in which thrusters differ, and their score over what it needs.
struct AskedOfThrusters {
    of: Difference,
    group: Vec<Basis>,
    needed: f64,
    beyond_chance: f64,
}

/// Returns the joint significance that differences of this many thrusters need.
pub(super) fn needed(count: usize) -> f64 {
    ChiSquared::new(count as f64).map_or(f64::INFINITY, |chi| chi.inverse_cdf(1.0 - CHANCE))
}

/// Numbers of one thruster beyond those of all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Own {
    /// Lag, s.
    pub(super) lag_s: f64,
    /// Dead band, as a part of full speed.
    pub(super) dead_band: f64,
    /// Gain beyond that of all, ahead and in reverse.
    pub(super) gain: [f64; 2],
}

/// Returns the numbers of each thruster of a plant beyond those of all.
pub(super) fn own_numbers(plant: &Plant) -> BTreeMap<String, Own> {
    let structure = plant.structure();
    let mut all: BTreeMap<String, Own> = BTreeMap::new();
    for effect in structure.effects() {
        let EffectForce::Own { thruster: Pusher { name, .. }, number } = &effect.force else {
            continue;
        };
        let term = |of| plant.coefficient(&term_of(structure, name, of)?);
        let value = |of| term(of).unwrap_or(0.0);
        let own = all.entry(name.clone()).or_default();
        let both = value(Difference::Gain);
        own.gain = [both, both + value(Difference::InReverse)];
        match number {
            ThrusterNumber::Lag => own.lag_s = value(Difference::Own(*number)),
            ThrusterNumber::DeadBand => own.dead_band = value(Difference::Own(*number)),
        }
    }
    all
}

/// Returns the term of a thruster for a difference.
pub(super) fn term_of(structure: &Structure, thruster: &str, of: Difference) -> Option<Basis> {
    let is_own = |term: &Basis| {
        let is_of = thruster_of(structure, term).is_some_and(|own| own.name == thruster);
        is_of && Difference::of_term(structure, term) == Some(of)
    };
    (0..structure.effects().len()).map(Basis::Effect).find(is_own)
}

/// Returns the thruster of a gain, a lag or a dead band.
pub(super) fn thruster_of<'a>(structure: &'a Structure, term: &Basis) -> Option<&'a Pusher> {
    let Basis::Effect(k) = term else { return None };
    match &structure.effects()[*k].force {
        EffectForce::Gain { thruster, .. } | EffectForce::Own { thruster, .. } => Some(thruster),
        _ => None,
    }
}

/// Returns true if a coefficient is held, which determines the scale of all.
pub(super) fn has_scale(structure: &Structure) -> bool {
    structure.terms().iter().any(|term| structure.held(term).is_some())
}
