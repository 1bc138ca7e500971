//! The search for couplings in damping.

use std::collections::BTreeMap;

use super::descent::Tolerance;
use super::{Fitted, search};
use crate::plant::{Basis, Structure};
use crate::{Dof, Error, TrialRecord};

impl Fitted {
    /// The same with the couplings in damping that the trials support.
    ///
    /// In rounds, as a missing coupling colours the innovations of its axis and hides others.
    pub(super) fn searched(self, records: &[&TrialRecord]) -> Result<Self, Error> {
        let candidates = search::candidates(&self.problem.structure);
        let mut search = Search { base: self, found: None, scores: BTreeMap::new() };
        for _ in 0..MOST_ROUNDS {
            let before = search.admitted();
            let added = search.asked_for(&candidates)?;
            if added.is_empty() {
                break;
            }
            search.admit(added, records)?;
            search.replace_by_rivals();
            search.replace_by_neighbours()?;
            if search.admitted() == before {
                break;
            }
        }
        let admitted = search.admitted();
        let Search { base, found, scores } = search;
        let chosen = found.unwrap_or(base);
        let structure = &chosen.problem.structure;
        let worths = chosen.worths()?;
        let tried = search::tried(structure, &candidates, &scores, &admitted, &worths);
        Ok(Self { tried, ..chosen })
    }

    /// The optimum with some terms beside those of `base`, from this one.
    pub(super) fn with_terms(&self, base: &Structure, terms: &[Basis]) -> Result<Self, Error> {
        let problem = self.problem.with_terms(search::with_all(base, terms)?);
        let start = search::widened(&problem, &self.problem, &self.optimum.point);
        let is_new = |term: &Basis| self.problem.structure.index_of(term).is_none();
        // A plant that only lacks some of the terms is near its optimum already.
        let optimum = if problem.structure.terms().iter().any(is_new) {
            problem.optimum(start, Tolerance::COARSE)?
        } else {
            problem.descent_at_noise(start, Tolerance::COARSE)?
        };
        Ok(self.moved_to(problem, optimum))
    }
}

/// Rounds of admitting and dropping couplings.
const MOST_ROUNDS: usize = 4;

/// A search for couplings in damping.
struct Search {
    /// The plant without them.
    base: Fitted,
    /// The plant with those that are admitted.
    found: Option<Fitted>,
    /// The gain of each candidate when it was last outside the plant.
    scores: BTreeMap<Basis, f64>,
}

impl Search {
    fn now(&self) -> &Fitted {
        self.found.as_ref().unwrap_or(&self.base)
    }

    /// The terms that the plant has now beside those of the base.
    fn admitted(&self) -> Vec<Basis> {
        let base = &self.base.problem.structure;
        let all = self.now().problem.structure.terms();
        all.iter().filter(|term| base.index_of(term).is_none()).copied().collect()
    }

    /// Couplings outside the plant whose scores exceed the bar.
    fn asked_for(&mut self, candidates: &[Basis]) -> Result<Vec<Basis>, Error> {
        let now = self.now();
        let outside = |term: &&Basis| now.problem.structure.index_of(term).is_none();
        let outside: Vec<Basis> = candidates.iter().filter(outside).copied().collect();
        if outside.is_empty() {
            return Ok(outside);
        }
        let scores = search::scores(&now.problem, &now.optimum.point, &outside)?;
        let admitted = search::admitted(&now.problem.structure, &outside, &scores, now.bar()?);
        self.scores.extend(outside.into_iter().zip(scores));
        Ok(admitted)
    }

    /// Has the likelier of two terms that stand for each other.
    ///
    /// Beside the reverse-thrust ratio neither of the two forms of inflow may be worth much where both
    /// are fitted, and which of them is dropped is left to chance.
    fn replace_by_rivals(&mut self) {
        for term in self.admitted() {
            let structure = &self.now().problem.structure;
            let Some(rival) = search::rival(structure, &term) else { continue };
            if structure.index_of(&rival).is_none() {
                self.replace_if_likelier(&[term], &[rival]);
            }
        }
    }

    /// Has lift of the hull at the two places that are next to where two act together, if that is likelier: the farther
    /// apart two of them are, the more they overstate the damping of turning.
    fn replace_by_neighbours(&mut self) -> Result<(), Error> {
        for along in [Dof::Sway, Dof::Heave] {
            let Fitted { problem, optimum, .. } = self.now();
            let plant = problem.plant(&optimum.point.free)?;
            if let Some((far, near)) = search::nearer_lifts(&plant, &self.admitted(), along) {
                self.replace_if_likelier(&far, &near);
            }
        }
        Ok(())
    }

    /// Has other terms in the place of some, if the plant with them is likelier; one that does not settle is not.
    fn replace_if_likelier(&mut self, terms: &[Basis], others: &[Basis]) {
        let mut all = self.admitted();
        all.retain(|own| !terms.contains(own));
        all.extend_from_slice(others);
        if let Ok(other) = self.now().with_terms(&self.base.problem.structure, &all)
            && other.optimum.cost < self.now().optimum.cost
        {
            self.found = Some(other);
        }
    }

    /// Fits the plant with terms more, without those that turn out to be worth too little.
    fn admit(&mut self, added: Vec<Basis>, records: &[&TrialRecord]) -> Result<(), Error> {
        let mut terms = self.admitted();
        terms.extend(added);
        while !terms.is_empty() {
            // A wider plant that does not settle says that its terms are not told apart.
            let Ok(wider) = self.now().with_terms(&self.base.problem.structure, &terms) else {
                return Ok(());
            };
            let plant = wider.problem.plant(&wider.optimum.point.free)?;
            let must_go = !search::is_dissipative(&plant, records);
            let covariance = wider.covariance();
            let gone = search::dropped(&terms, &plant, &covariance, wider.bar()?, must_go);
            self.found = Some(wider);
            if gone.is_empty() {
                return Ok(());
            }
            terms.retain(|term| !gone.contains(term));
        }
        self.found = None;
        Ok(())
    }
}
