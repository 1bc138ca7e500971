//! Candidates that are added to a model.

use super::{CLEAR_GAIN, FINALISTS, Fitted, Model, Search};
use crate::estimate::filter_error::candidate::Candidate;
use crate::estimate::filter_error::minimise::Effort;
use crate::estimate::filter_error::whiteness::Whiteness;
use crate::parallel;

/// Iterations after which candidates are compared.
const PROBING: usize = 8;

/// A model grows at most this often.
const MOST_GROWTH: usize = 5;

impl<'a> Search<'a> {
    /// Adds what the logs still ask for, as long as the Bayesian information criterion gains.
    ///
    /// Candidates are compared before their fits have ended. The best go on, with whatever they
    /// make superfluous left out. What gained nothing is not tried again.
    pub(super) fn grow(&self, model: &mut Model<'a>, candidates: &[Candidate]) {
        let mut refused = Vec::new();
        for _ in 0..MOST_GROWTH {
            let promising = self.promising(model, candidates, &refused);
            let before = self.criterion(model);
            let probed = parallel::map(&promising, |candidate| self.probed(model, *candidate));
            let mut worth: Vec<(f64, Model<'a>)> = Vec::new();
            for (candidate, probe) in promising.into_iter().zip(probed) {
                let after = self.criterion(&probe);
                if after < before { worth.push((after, probe)) } else { refused.push(candidate) }
            }
            worth.sort_by(|a, b| a.0.total_cmp(&b.0));
            worth.truncate(FINALISTS);
            let grown = parallel::map(&worth, |(_, probe)| self.grown(probe));
            let best = grown
                .into_iter()
                .flatten()
                .min_by(|a, b| self.criterion(a).total_cmp(&self.criterion(b)));
            match best {
                Some(best) if self.criterion(&best) < before - CLEAR_GAIN => *model = best,
                _ => break,
            }
        }
    }

    /// The candidates that may be worth a fit.
    fn promising(
        &self,
        model: &Model<'a>,
        candidates: &[Candidate],
        refused: &[Candidate],
    ) -> Vec<Candidate> {
        let is_white = Whiteness::of(&model.fitted).is_white();
        let is_kept = |other: &Candidate| model.kept.contains(other);
        let is_open = |c: &Candidate| {
            let possible = c.needs().is_none_or(|other| model.kept.contains(&other));
            possible && !model.kept.contains(c) && !refused.contains(c)
        };
        let open: Vec<Candidate> = candidates.iter().copied().filter(is_open).collect();
        let scores = self.scores(&model.fitted, &open);
        let promises = |c: &Candidate| match c.has_score() {
            true => scores.of(*c) > self.needed(*c),
            false => !is_white || c.may_hide() && c.imitators().iter().any(is_kept),
        };
        open.into_iter().filter(promises).collect()
    }

    /// The model with a candidate more, its rival left out, after a few iterations; or, if that is
    /// better, without what imitates it either.
    fn probed(&self, model: &Model<'a>, candidate: Candidate) -> Model<'a> {
        let beside = self.probed_without(model, candidate, &candidate.rivals());
        let imitators = candidate.imitators();
        if !model.kept.iter().any(|kept| imitators.contains(kept)) {
            return beside;
        }
        let less = [candidate.rivals(), imitators].concat();
        let instead = self.probed_without(model, candidate, &less);
        if self.criterion(&instead) < self.criterion(&beside) { instead } else { beside }
    }

    fn probed_without(
        &self,
        model: &Model<'a>,
        candidate: Candidate,
        less: &[Candidate],
    ) -> Model<'a> {
        let mut kept = model.kept.clone();
        kept.retain(|kept| !less.contains(kept));
        kept.push(candidate);
        let fitted = self.changed(&model.fitted, less, Some(candidate), Effort::begun(PROBING));
        Model { fitted, kept }
    }

    /// A model that has a candidate more, fitted to its end, without what is not worth its place
    /// beside it; `None` if no optimum is reached.
    fn grown(&self, probe: &Model<'a>) -> Option<Model<'a>> {
        let Model { fitted, kept } = probe;
        let fitted = match fitted.optimum.converged {
            true => fitted.clone(),
            false => Fitted::of(fitted.problem.clone(), Some(fitted), &self.fixed),
        };
        let mut grown = Model { fitted, kept: kept.clone() };
        if grown.fitted.optimum.converged {
            self.eliminate(&mut grown);
        }
        grown.fitted.optimum.converged.then_some(grown)
    }
}
