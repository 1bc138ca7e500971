//! Which parts the model gets: the search over candidates.

use nalgebra::DVector;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::candidate::{Candidate, Decision, Turn};
use super::held_out::HeldOut;
use super::minimise::{Effort, Optimum, ROUNDING, limits, minimise};
use super::parabola::{Minimum, Scores};
use super::parameters::{Unknown, Usual, Values};
use super::problem::{Prior, Problem, Record};
use super::whiteness::Whiteness;
use crate::estimate::descend::scaled_inverse;
use crate::parallel;

/// Linear drag below this part of the quadratic is none, however sharply it is seen: below
/// what a thrust curve or a log's clock is good for.
const SLIGHT_LINEAR_DRAG: f64 = 0.01;

/// A bias force stays in the model unless the logs show that it is below this part of the
/// thrust: a vehicle is seldom neutral, and a simulation without its weight drifts away.
const SLIGHT_BIAS: f64 = 0.02;

/// Another law with as many numbers must gain this much, twice the log-likelihood, to replace
/// the usual one: odds of seven to one.
const CLEAR_GAIN: f64 = 4.0;

/// Iterations after which starts are compared: the best go on.
const SCREENING: usize = 6;

/// How many starts go on.
const FINALISTS: usize = 2;

/// Iterations after which candidates are compared.
const PROBING: usize = 8;

/// A model grows at most this often.
const MOST_GROWTH: usize = 5;

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

/// Mean speeds of trials that differ by less than this part of the greatest show nothing of what
/// follows them.
const SPEEDS_DIFFER: f64 = 0.3;

/// A ratio of current to speed is the same in all trials by chance once in a thousand.
const SAME_RATIO: f64 = 1e-3;

/// Whether the currents of trials are in proportion to the mean speeds of the vehicle: water does
/// not know how fast a vehicle goes, so that this is something else, such as drag.
fn follows_speed(fitted: &Fitted<'_>) -> bool {
    let records = fitted.problem.records.iter().enumerate();
    let pairs: Vec<(f64, f64)> = records
        .filter_map(|(k, record)| Some((record.mean_velocity?, fitted.value(Unknown::Current, k)?)))
        .collect();
    are_in_proportion(&pairs)
}

/// Whether the second numbers are in proportion to the first, which differ, by more than chance.
fn are_in_proportion(pairs: &[(f64, f64)]) -> bool {
    let speeds = || pairs.iter().map(|(speed, _)| *speed);
    let (least, most) = (speeds().fold(f64::MAX, f64::min), speeds().fold(f64::MIN, f64::max));
    if pairs.len() < 3 || most - least < SPEEDS_DIFFER * most.abs().max(least.abs()) {
        return false;
    }
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let ratio = sum(&|(v, u)| u * v) / sum(&|(v, _)| v * v);
    let left = sum(&|(v, u)| (u - ratio * v).powi(2));
    let freedom = (pairs.len() - 1) as f64;
    let explained = sum(&|(v, _)| (ratio * v).powi(2)) * freedom / left.max(f64::MIN_POSITIVE);
    FisherSnedecor::new(1.0, freedom).is_ok_and(|chance| chance.sf(explained) < SAME_RATIO)
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

    /// Adds what the logs still ask for, as long as the Bayesian information criterion gains.
    ///
    /// Candidates are compared before their fits have ended. The best go on, with whatever they
    /// make superfluous left out. What gained nothing is not tried again.
    fn grow(&self, model: &mut Model<'a>, candidates: &[Candidate]) {
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

    /// Twice the cost, and what each number must bring.
    fn criterion(&self, model: &Model<'_>) -> f64 {
        let needed: f64 = model.kept.iter().map(|candidate| self.needed(*candidate)).sum();
        2.0 * model.fitted.optimum.cost + needed
    }

    fn ln_samples(&self) -> f64 {
        let samples: usize = self.records.iter().map(Record::samples).sum();
        (samples as f64).ln()
    }

    /// Leaves out what makes held-out trials worse by more than chance, and what a better optimum
    /// without it shows not to be worth its place, the worst first. Why each part of the model that
    /// is left stays.
    fn judge(&self, model: &mut Model<'a>) -> Vec<Decision> {
        loop {
            let without = parallel::map(&model.kept, |c| self.without(&model.fitted, *c));
            for (candidate, without) in model.kept.iter().zip(&without) {
                model.fitted = self.at_least(*candidate, model.fitted.clone(), without);
            }
            let pairs: Vec<(Candidate, Fitted<'a>)> =
                model.kept.iter().copied().zip(without).collect();
            let judged = parallel::map(&pairs, |(candidate, without)| {
                self.judged(*candidate, &model.fitted, without)
            });
            let judged: Vec<(Decision, Fitted<'a>)> =
                judged.into_iter().zip(pairs.into_iter().map(|(_, without)| without)).collect();
            let worst = judged
                .iter()
                .filter(|(decision, without)| !decision.admitted && without.optimum.converged)
                .min_by(|a, b| {
                    let gain = |decision: &Decision| {
                        let beyond = (decision.likelihood_ratio - decision.needed).min(0.0);
                        beyond + decision.hold_out_ratio.unwrap_or(0.0).min(0.0)
                    };
                    gain(&a.0).total_cmp(&gain(&b.0))
                });
            let Some((decision, without)) = worst else {
                let kept = |decision| Decision { admitted: true, ..decision };
                return judged.into_iter().map(|(decision, _)| kept(decision)).collect();
            };
            model.kept.retain(|kept| *kept != decision.candidate);
            model.fitted = without.clone();
        }
    }

    /// Why a candidate is not part of the model.
    fn left_out(&self, candidate: Candidate, model: &Model<'a>, scores: &Scores) -> Decision {
        let (fitted, ratio) = (&model.fitted, scores.of(candidate));
        // What the logs support and held-out trials refuse is shown with both.
        let is_close = ratio > self.needed(candidate);
        let with = is_close.then(|| self.changed(fitted, &[], Some(candidate), Effort::COARSE));
        let decision = match with.filter(|with| with.optimum.converged) {
            Some(with) => self.judged(candidate, &with, fitted),
            None => self.decision(candidate, ratio, None, None),
        };
        Decision { admitted: false, ..decision }
    }

    fn numbers(&self, candidate: Candidate) -> f64 {
        let of = |(unknown, _): (Unknown, f64)| {
            if unknown.is_of_trial() { self.records.len() } else { 1 }
        };
        candidate.unknowns().into_iter().map(of).sum::<usize>() as f64
    }

    /// What a candidate must bring: by the extended Bayesian information criterion, which asks
    /// for more where many are tried, since the best of many looks good by chance. A term of
    /// the equation of motion is asked about by itself. Acceleration alone hardly shows the bend
    /// of drag: there linear drag stays, for mass and quadratic drag would make up for it.
    ///
    /// # Source
    /// [ChenChen2008]: `ln n` for each number, and `2 ln P` for each of P candidates.
    fn needed(&self, candidate: Candidate) -> f64 {
        if candidate == Candidate::LinearDrag && !self.knows_velocity {
            return 0.0;
        }
        let tried = if candidate.is_term() { 1.0 } else { self.tried as f64 };
        (self.numbers(candidate) * self.ln_samples() + 2.0 * tried.ln()).max(CLEAR_GAIN)
    }

    fn decision(
        &self,
        candidate: Candidate,
        likelihood_ratio: f64,
        size: Option<f64>,
        held_out: Option<HeldOut>,
    ) -> Decision {
        let needed = self.needed(candidate);
        let refused = held_out.is_some_and(|held_out| {
            // What held-out trials lose is evidence, too.
            let loss = (2.0 * held_out.gain).min(0.0);
            held_out.speaks_against() || likelihood_ratio + loss < needed
        });
        let supported = likelihood_ratio > needed;
        let admitted = match candidate {
            // A term that the logs ask for leaves only if it is small.
            Candidate::LinearDrag => supported && size.is_none_or(|size| size > SLIGHT_LINEAR_DRAG),
            Candidate::Bias => supported || size.is_some_and(|size| size > SLIGHT_BIAS),
            _ => supported && !refused,
        };
        let hold_out_ratio = held_out.map(|held_out| 2.0 * held_out.gain);
        Decision { candidate, likelihood_ratio, needed, size, hold_out_ratio, admitted }
    }

    /// Whether a candidate is worth its place, by a fit with it and one without.
    fn decide(&self, candidate: Candidate, with: &Fitted<'_>, without: &Fitted<'_>) -> Decision {
        let ratio = 2.0 * (without.optimum.cost - with.optimum.cost);
        // Nested optima differ by rounding, at least.
        let ratio = if ratio.abs() < 2.0 * ROUNDING { ratio.max(0.0) } else { ratio };
        let decision = self.decision(candidate, ratio, self.size(candidate, with), None);
        let is_possible = candidate != Candidate::Current || !follows_speed(with);
        Decision { admitted: decision.admitted && is_possible, ..decision }
    }

    /// The larger of two nested models, which cannot fit worse than the smaller: where it does, it
    /// has ended in a worse optimum, and starts again from that of the smaller.
    fn at_least(&self, candidate: Candidate, with: Fitted<'a>, without: &Fitted<'a>) -> Fitted<'a> {
        if with.optimum.cost < without.optimum.cost + ROUNDING {
            return with;
        }
        let again = self.changed(without, &[], Some(candidate), Effort::COARSE);
        if again.optimum.cost < with.optimum.cost { again } else { with }
    }

    /// [`Search::decide`], with what held-out trials say.
    fn judged(&self, candidate: Candidate, with: &Fitted<'_>, without: &Fitted<'_>) -> Decision {
        let decision = self.decide(candidate, with, without);
        if self.hold_out.is_empty()
            || (decision.candidate == Candidate::Current && !decision.admitted)
        {
            return decision;
        }
        let Decision { likelihood_ratio, size, .. } = decision;
        let held_out = HeldOut::of(with, without, self.hold_out);
        self.decision(candidate, likelihood_ratio, size, Some(held_out))
    }

    /// How much a term does in a model that has it.
    fn size(&self, candidate: Candidate, with: &Fitted<'_>) -> Option<f64> {
        let Usual { speed, thrust, .. } = self.fixed.shape.usual;
        let values = with.problem.values(&with.optimum.theta, 0);
        match candidate {
            Candidate::LinearDrag => {
                let (linear, quadratic) = (values.get(Unknown::Mu), values.get(Unknown::Beta));
                Some(if linear < 0.0 { linear / (quadratic * speed) } else { 0.0 })
            }
            Candidate::Bias => {
                let place = with.problem.index(Unknown::Bias, 0)?;
                let variance = scaled_inverse(&with.optimum.information)?[(place, place)];
                let farthest = values.get(Unknown::Bias).abs() + 1.96 * variance.sqrt();
                Some(farthest / (values.get(Unknown::Alpha) * thrust))
            }
            _ => None,
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn currents_in_proportion_to_speed_are_told_from_a_current() {
        let with = |currents: [f64; 4]| {
            let pairs: Vec<(f64, f64)> = [0.3, 0.6, 0.9, 1.2].into_iter().zip(currents).collect();
            are_in_proportion(&pairs)
        };
        assert!(with([0.030, 0.061, 0.089, 0.120]));
        assert!(!with([0.1, 0.1, 0.1, 0.1]));
        assert!(!with([0.05, -0.02, 0.11, 0.08]));
        assert!(!are_in_proportion(&[(0.5, 0.1), (0.5, 0.1), (0.5, 0.1)]));
    }
}
