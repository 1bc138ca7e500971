//! Which parts the model gets: the search over candidates.

mod grow;
mod worth;

use nalgebra::DVector;

use super::candidate::{Candidate, Decision, Turn};
use super::minimise::{Effort, Optimum, ROUNDING, limits, minimise};
use super::parabola::{Minimum, Scores};
use super::parameters::{Unknown, Values};
use super::problem::{Prior, Problem, Record};
use super::whiteness::Whiteness;
use crate::parallel;

/// Another law with as many numbers must gain this much, twice the log-likelihood, to replace
/// the usual one: odds of seven to one.
const CLEAR_GAIN: f64 = 4.0;

/// Iterations after which starts are compared: the best go on.
const SCREENING: usize = 6;

/// How many starts go on.
const FINALISTS: usize = 2;

/// The search for a model's structure.
#[derive(Clone)]
pub(crate) struct Search<'a> {
    pub(crate) records: &'a [Record],
    pub(crate) priors: &'a [Prior],
    pub(crate) fixed: Values,
    /// Where fits that follow no other start.
    pub(crate) starts: &'a [Values],
    /// Trials that are not fitted, to judge candidates by.
    pub(crate) hold_out: &'a [Record],
    /// How many candidates are tried.
    pub(crate) tried: usize,
    /// Whether velocity or position was measured, or acceleration alone.
    pub(crate) knows_velocity: bool,
}

/// A model that was fitted.
#[derive(Clone)]
pub(crate) struct Fitted<'a> {
    pub(crate) problem: Problem<'a>,
    pub(crate) optimum: Optimum,
}

/// A model with the candidates that it has.
#[derive(Clone)]
struct Model<'a> {
    fitted: Fitted<'a>,
    kept: Vec<Candidate>,
}

impl<'a> Fitted<'a> {
    /// Fits all numbers of a problem, starting from another fit where it has them.
    pub(crate) fn of(problem: Problem<'a>, from: Option<&Fitted<'_>>, at: &Values) -> Self {
        Self::within(problem, from, at, Effort::COARSE)
    }

    pub(crate) fn within(
        problem: Problem<'a>,
        from: Option<&Fitted<'_>>,
        at: &Values,
        effort: Effort,
    ) -> Self {
        let known = |unknown, record| from.and_then(|from| from.value(unknown, record));
        let start = |unknown, record| known(unknown, record).unwrap_or_else(|| at.get(unknown));
        Self::from_start(problem, start, effort)
    }

    /// Fits all numbers of a problem from the start of each unknown in each record.
    pub(crate) fn from_start(
        problem: Problem<'a>,
        start: impl Fn(Unknown, usize) -> f64,
        effort: Effort,
    ) -> Self {
        let mut theta = DVector::zeros(problem.len());
        for record in 0..problem.records.len() {
            for &unknown in problem.unknowns() {
                let Some(place) = problem.index(unknown, record) else { continue };
                let (low, high) = limits(unknown, &problem.fixed.shape);
                theta[place] = start(unknown, record).clamp(low, high);
            }
        }
        let optimum = minimise(&problem, theta, effort);
        Self { problem, optimum }
    }

    /// Returns the estimate for a record, or that of the first record where there is none.
    pub(crate) fn value(&self, unknown: Unknown, record: usize) -> Option<f64> {
        let record = if record < self.problem.records.len() { record } else { 0 };
        self.problem.index(unknown, record).map(|place| self.optimum.theta[place])
    }

    /// Compares two fits of one problem: converged ones first, then by cost.
    pub(crate) fn compare(&self, other: &Self) -> std::cmp::Ordering {
        let by_cost = self.optimum.cost.total_cmp(&other.optimum.cost);
        other.optimum.converged.cmp(&self.optimum.converged).then(by_cost)
    }
}

/// Whether fits from different starts have come to the same optimum.
fn are_one(fits: &[Fitted<'_>]) -> bool {
    let costs = || fits.iter().map(|fitted| fitted.optimum.cost);
    let (least, most) = (costs().fold(f64::MAX, f64::min), costs().fold(f64::MIN, f64::max));
    fits.iter().all(|fitted| fitted.optimum.converged) && most - least < 2.0 * ROUNDING
}

impl<'a> Search<'a> {
    /// Fits the unknowns, starting from another fit where it has them.
    pub(crate) fn fit(
        &self,
        unknowns: &[Unknown],
        linear: bool,
        from: Option<&Fitted<'_>>,
        at: &Values,
    ) -> Fitted<'a> {
        Fitted::of(self.problem(unknowns, linear), from, at)
    }

    /// Fits the same model to the records of this search, to the optimum itself.
    pub(crate) fn again(&self, fitted: &Fitted<'_>) -> Fitted<'a> {
        let Problem { fixed, .. } = fitted.problem;
        let problem = Problem::new(self.records, fitted.problem.unknowns(), self.priors, fixed);
        Fitted::within(problem, Some(fitted), &fixed, Effort::FINE)
    }

    /// Returns the best fit from several starts.
    ///
    /// Where the start before and that of output error lead to one optimum, the likelihood has no
    /// other to speak of. Else the fits from all starts are compared before they have ended.
    pub(crate) fn fit_from_all(
        &self,
        unknowns: &[Unknown],
        from: Option<&Fitted<'_>>,
    ) -> Option<Fitted<'a>> {
        let problem = self.problem(unknowns, false);
        let mut origins: Vec<(Option<&Fitted<'_>>, &Values)> = from
            .map(|from| (Some(from), &self.fixed))
            .into_iter()
            .chain(self.starts.iter().map(|start| (None, start)))
            .collect();
        let within = |(from, at): &(Option<&Fitted<'_>>, &Values), effort| {
            Fitted::within(problem.clone(), *from, at, effort)
        };
        let mut ended = Vec::new();
        // Acceleration alone has optima with and without linear drag, far apart.
        if self.knows_velocity && origins.len() > FINALISTS {
            let apart = [origins.remove(0), origins.pop()?];
            ended = parallel::map(&apart, |origin| within(origin, Effort::COARSE));
            if are_one(&ended) {
                return ended.into_iter().min_by(Fitted::compare);
            }
        }
        let mut begun = parallel::map(&origins, |origin| within(origin, Effort::begun(SCREENING)));
        begun.sort_by(|a, b| a.optimum.cost.total_cmp(&b.optimum.cost));
        begun.truncate(if self.knows_velocity { FINALISTS } else { begun.len() });
        ended.extend(parallel::map(&begun, |begun| match begun.optimum.converged {
            true => begun.clone(),
            false => Fitted::of(begun.problem.clone(), Some(begun), &self.fixed),
        }));
        ended.into_iter().min_by(Fitted::compare)
    }

    fn problem(&self, unknowns: &[Unknown], linear: bool) -> Problem<'a> {
        let mut fixed = self.fixed;
        fixed.shape.linear = linear;
        Problem::new(self.records, unknowns, self.priors, fixed)
    }

    /// Searches the model that the logs support.
    ///
    /// One pass at the optimum of the plant alone gives the scores of the first candidates, each by
    /// itself and all together. If nothing is significant the plant alone goes on. Else all are
    /// fitted at once, since one fault hides another (under a current and a delay together, a lag
    /// alone makes nothing better), and the information matrix there says which to leave out.
    /// Then candidates that the logs still support are added. Held-out trials have the last word.
    pub(crate) fn run(
        &self,
        base: Fitted<'a>,
        candidates: &[Candidate],
    ) -> (Fitted<'a>, Vec<Decision>) {
        let first: Vec<Candidate> =
            candidates.iter().copied().filter(|c| c.turn() == Turn::First).collect();
        let mut model = self.first(base, first);
        self.eliminate(&mut model);
        self.grow(&mut model, candidates);
        let kept = self.judge(&mut model);
        let scores = self.scores(&model.fitted, candidates);
        let decisions = parallel::map(candidates, |candidate| {
            let kept = kept.iter().find(|decision| decision.candidate == *candidate);
            kept.cloned().unwrap_or_else(|| self.left_out(*candidate, &model, &scores))
        });
        (model.fitted, decisions)
    }

    fn first(&self, base: Fitted<'a>, first: Vec<Candidate>) -> Model<'a> {
        let (terms, others): (Vec<Candidate>, Vec<Candidate>) =
            first.iter().partition(|candidate| candidate.is_term());
        if first.is_empty() {
            return Model { fitted: base, kept: first };
        }
        let plant = match self.full(&base, &terms) {
            Some(fitted) => Model { fitted, kept: terms },
            None => Model { fitted: base, kept: Vec::new() },
        };
        let scores = self.scores(&plant.fitted, &others);
        if !scores.is_any_significant(|candidate| self.needed(candidate)) {
            return plant;
        }
        if let Some(fitted) = self.full(&plant.fitted, &first) {
            return Model { fitted, kept: first };
        }
        // Too many for these logs: only those that the scores name.
        let named = |c: &Candidate| c.is_term() || scores.of(*c) > self.needed(*c);
        let kept: Vec<Candidate> = first.into_iter().filter(named).collect();
        match self.full(&plant.fitted, &kept) {
            Some(fitted) => Model { fitted, kept },
            None => plant,
        }
    }

    /// The model with all of the candidates; `None` if no optimum is reached.
    fn full(&self, base: &Fitted<'a>, candidates: &[Candidate]) -> Option<Fitted<'a>> {
        let mut unknowns = base.problem.unknowns().to_vec();
        unknowns.extend(candidates.iter().flat_map(|c| c.unknowns()).map(|(unknown, _)| unknown));
        self.fit_from_all(&unknowns, Some(base)).filter(|fitted| fitted.optimum.converged)
    }

    /// Leaves out what is not worth its place, by the information matrix, and fits what is left.
    fn eliminate(&self, model: &mut Model<'a>) {
        let mut needed_anyway = Vec::new();
        loop {
            let gone = self.superfluous(model, &needed_anyway);
            let Some(least) = gone.first().copied() else { return };
            let all = self.without_all(model, &gone);
            if gone.len() > 1 && self.criterion(&all) < self.criterion(model) {
                *model = all;
                continue;
            }
            // Where the parabola misleads, the likelihood decides on one at a time.
            let without = if gone.len() > 1 { self.without_all(model, &[least]) } else { all };
            model.fitted = self.at_least(least, model.fitted.clone(), &without.fitted);
            match self.decide(least, &model.fitted, &without.fitted).admitted {
                true => needed_anyway.push(least),
                false => *model = without,
            }
        }
    }

    /// The candidates that the parabola at the optimum finds not worth their place, the least
    /// worthy first: after each, the others move to where the parabola without it has its minimum.
    fn superfluous(&self, model: &Model<'a>, needed_anyway: &[Candidate]) -> Vec<Candidate> {
        let Model { fitted, kept } = model;
        let Some(mut parabola) = Minimum::of(fitted) else { return Vec::new() };
        let is_needed = |c: &Candidate, gone: &[Candidate]| {
            kept.iter().any(|other| other.needs() == Some(*c) && !gone.contains(other))
        };
        let mut gone = Vec::new();
        loop {
            let open = kept.iter().copied().filter(|c| {
                let is_open = c.has_score() && !gone.contains(c) && !needed_anyway.contains(c);
                is_open && !is_needed(c, &gone)
            });
            // A term may stay for its size, whatever its worth.
            let worthless = open.filter_map(|c| {
                let worth = parabola.worth(fitted, c);
                let decision = self.decision(c, worth, self.size(c, fitted), None);
                (!decision.admitted).then_some((worth - decision.needed, c))
            });
            let Some((_, least)) = worthless.min_by(|a, b| a.0.total_cmp(&b.0)) else {
                return gone;
            };
            gone.push(least);
            parabola.leave_out(fitted, least);
        }
    }

    /// The model without some candidates.
    fn without_all(&self, model: &Model<'a>, gone: &[Candidate]) -> Model<'a> {
        let kept = model.kept.iter().copied().filter(|c| !gone.contains(c)).collect();
        Model { fitted: self.changed(&model.fitted, gone, None, Effort::COARSE), kept }
    }

    /// The model with some candidates less, and one more.
    fn changed(
        &self,
        model: &Fitted<'a>,
        less: &[Candidate],
        more: Option<Candidate>,
        effort: Effort,
    ) -> Fitted<'a> {
        let mut unknowns = model.problem.unknowns().to_vec();
        unknowns.retain(|unknown| !less.iter().any(|less| less.has(*unknown)));
        let mut at = self.fixed;
        for (unknown, start) in more.into_iter().flat_map(Candidate::unknowns) {
            unknowns.push(unknown);
            at.set(unknown, start);
        }
        if more == Some(Candidate::Swell) {
            self.first_waves(model, &mut at);
        }
        let was_linear = model.problem.is_linear() && !less.contains(&Candidate::LinearThrust);
        let linear = was_linear || more == Some(Candidate::LinearThrust);
        Fitted::within(self.problem(&unknowns, linear), Some(model), &at, effort)
    }

    /// Waves are first looked for where the errors of prediction have most of their power, and
    /// as strong as the disturbance that has to stand for them.
    fn first_waves(&self, model: &Fitted<'a>, at: &mut Values) {
        let values = model.problem.values(&model.optimum.theta, 0);
        at.set(Unknown::LogSwell, values.get(Unknown::LogDisturbance));
        if let Some(frequency_hz) = Whiteness::of(model).dominant_hz {
            at.set(Unknown::LogSwellFrequency, (std::f64::consts::TAU * frequency_hz).ln());
        }
    }

    fn without(&self, model: &Fitted<'a>, candidate: Candidate) -> Fitted<'a> {
        self.changed(model, &[candidate], None, Effort::COARSE)
    }

    /// Scores of the candidates that are not in a model, from one pass.
    fn scores(&self, model: &Fitted<'a>, candidates: &[Candidate]) -> Scores {
        let is_new = |c: &Candidate| {
            let unknowns = c.unknowns();
            let has = |unknown| model.problem.index(unknown, 0).is_some();
            let possible = c
                .needs()
                .is_none_or(|other| other.unknowns().into_iter().all(|(unknown, _)| has(unknown)));
            c.has_score() && possible && !unknowns.into_iter().any(|(unknown, _)| has(unknown))
        };
        let new: Vec<Candidate> = candidates.iter().copied().filter(is_new).collect();
        Scores::at(model, &new)
    }
}
