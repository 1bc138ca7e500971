//! Which parts the model gets: the search over candidates.

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::candidate::{Candidate, Decision, Turn};
use super::held_out::HeldOut;
use super::minimise::{MOST_ITERATIONS, Optimum, ROUNDING, limits, minimise};
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
        Self::within(problem, from, at, MOST_ITERATIONS)
    }

    fn within(
        problem: Problem<'a>,
        from: Option<&Fitted<'_>>,
        at: &Values,
        iterations: usize,
    ) -> Self {
        let mut theta = DVector::zeros(problem.len());
        for record in 0..problem.records.len() {
            for &unknown in problem.unknowns() {
                let Some(place) = problem.index(unknown, record) else { continue };
                let known = from.and_then(|from| from.value(unknown, record));
                let (low, high) = limits(unknown, &problem.fixed.shape);
                theta[place] = known.unwrap_or_else(|| at.get(unknown)).clamp(low, high);
            }
        }
        let optimum = minimise(&problem, theta, iterations);
        Self { problem, optimum }
    }

    /// What was found for a trial; of one that was not there, what the first has.
    fn value(&self, unknown: Unknown, record: usize) -> Option<f64> {
        let record = if record < self.problem.records.len() { record } else { 0 };
        self.problem.index(unknown, record).map(|place| self.optimum.theta[place])
    }

    /// Unconverged last, then by cost.
    fn rank(&self) -> (bool, f64) {
        (!self.optimum.converged, self.optimum.cost)
    }
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

    /// Fits the same model to the records of this search.
    pub(crate) fn again(&self, fitted: &Fitted<'_>) -> Fitted<'a> {
        let Problem { fixed, .. } = fitted.problem;
        let problem = Problem::new(self.records, fitted.problem.unknowns(), self.priors, fixed);
        Fitted::of(problem, Some(fitted), &fixed)
    }

    /// The best of the fits from all starts, which are compared before they have ended.
    pub(crate) fn fit_from_all(
        &self,
        unknowns: &[Unknown],
        from: Option<&Fitted<'_>>,
    ) -> Option<Fitted<'a>> {
        let problem = self.problem(unknowns, false);
        let origins: Vec<(Option<&Fitted<'_>>, &Values)> = from
            .map(|from| (Some(from), &self.fixed))
            .into_iter()
            .chain(self.starts.iter().map(|start| (None, start)))
            .collect();
        let mut begun = parallel::map(&origins, |(from, at)| {
            Fitted::within(problem.clone(), *from, at, SCREENING)
        });
        begun.sort_by(|a, b| a.optimum.cost.total_cmp(&b.optimum.cost));
        // Acceleration alone has optima with and without linear drag, far apart.
        begun.truncate(if self.knows_velocity { FINALISTS } else { begun.len() });
        let ended = parallel::map(&begun, |begun| match begun.optimum.converged {
            true => begun.clone(),
            false => Fitted::of(begun.problem.clone(), Some(begun), &self.fixed),
        });
        ended
            .into_iter()
            .min_by(|a, b| a.rank().0.cmp(&b.rank().0).then(a.rank().1.total_cmp(&b.rank().1)))
    }

    fn problem(&self, unknowns: &[Unknown], linear: bool) -> Problem<'a> {
        let mut fixed = self.fixed;
        fixed.shape.linear = linear;
        Problem::new(self.records, unknowns, self.priors, fixed)
    }

    /// Starts with the first candidates in the model and leaves out, one by one, the one that
    /// is worth least, until each that is left is worth its place. Then adds what the logs
    /// still ask for, and leaves out what was only in its place. Held-out trials have the last
    /// word.
    ///
    /// Backwards first, since one fault hides another: under a current and a delay together, a
    /// lag alone makes nothing better.
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
        let decisions = parallel::map(candidates, |candidate| {
            let kept = kept.iter().find(|decision| decision.candidate == *candidate);
            kept.cloned().unwrap_or_else(|| self.left_out(*candidate, &model))
        });
        (model.fitted, decisions)
    }

    fn first(&self, base: Fitted<'a>, mut kept: Vec<Candidate>) -> Model<'a> {
        if kept.is_empty() {
            return Model { fitted: base, kept };
        }
        if let Some(fitted) = self.full(&base, &kept) {
            return Model { fitted, kept };
        }
        // Too much for these logs: begin with what the score test sees.
        let is_seen = |c: &Candidate| self.score(&base, *c).unwrap_or(0.0) > self.needed(*c);
        kept.retain(|c| c.is_term() || is_seen(c));
        match self.full(&base, &kept) {
            Some(fitted) => Model { fitted, kept },
            None => Model { fitted: base, kept: Vec::new() },
        }
    }

    /// The model with all of the candidates; `None` if no optimum is reached.
    fn full(&self, base: &Fitted<'a>, candidates: &[Candidate]) -> Option<Fitted<'a>> {
        let mut unknowns = base.problem.unknowns().to_vec();
        unknowns.extend(candidates.iter().flat_map(|c| c.unknowns()).map(|(unknown, _)| unknown));
        self.fit_from_all(&unknowns, Some(base)).filter(|fitted| fitted.optimum.converged)
    }

    /// Leaves out what is not worth its place.
    fn eliminate(&self, model: &mut Model<'a>) {
        let mut needed_anyway = Vec::new();
        while let Some((least, without)) = self.least_worth(model, &needed_anyway) {
            model.fitted = self.at_least(least, model.fitted.clone(), &without);
            let decision = self.decide(least, &model.fitted, &without);
            if !decision.admitted {
                model.kept.retain(|kept| *kept != least);
                model.fitted = without;
            } else if decision.likelihood_ratio < decision.needed {
                needed_anyway.push(least);
            } else {
                break;
            }
        }
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
        let promises = parallel::map(&open, |c| match c.has_score() {
            true => self.score(&model.fitted, *c).unwrap_or(0.0) > self.needed(*c),
            false => !is_white || c.may_hide() && c.imitators().iter().any(is_kept),
        });
        open.into_iter().zip(promises).filter(|(_, promises)| *promises).map(|(c, _)| c).collect()
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
        let fitted = self.changed(&model.fitted, less, Some(candidate), PROBING);
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
    fn left_out(&self, candidate: Candidate, model: &Model<'a>) -> Decision {
        let fitted = &model.fitted;
        let ratio = match candidate.has_score() {
            true => self.score(fitted, candidate).unwrap_or(0.0),
            false => 0.0,
        };
        // What the logs ask for and held-out trials refuse is shown with both.
        let is_close = candidate.is_term() || ratio > self.needed(candidate);
        let with = is_close.then(|| self.changed(fitted, &[], Some(candidate), MOST_ITERATIONS));
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
        let again = self.changed(without, &[], Some(candidate), MOST_ITERATIONS);
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

    /// The candidate that is worth least, and the model without it.
    ///
    /// Those that Wald's test does not see are not refitted one by one: the least of them
    /// goes first.
    fn least_worth(
        &self,
        model: &Model<'a>,
        needed_anyway: &[Candidate],
    ) -> Option<(Candidate, Fitted<'a>)> {
        let (fitted, kept) = (&model.fitted, &model.kept);
        let linear = Candidate::LinearDrag;
        if kept.contains(&linear) && self.size(linear, fitted) == Some(0.0) {
            return Some((linear, self.without(fitted, linear)));
        }
        let covariance = scaled_inverse(&fitted.optimum.information);
        let wald = |candidate: &Candidate| {
            let of = |covariance| self.wald(fitted, *candidate, covariance);
            covariance.as_ref().map_or(0.0, of) - self.needed(*candidate)
        };
        let is_needed = |c: &Candidate| kept.iter().any(|other| other.needs() == Some(*c));
        let open: Vec<Candidate> =
            kept.iter().copied().filter(|c| !needed_anyway.contains(c) && !is_needed(c)).collect();
        let seen = open.iter().copied().filter(|c| c.has_score());
        let least = seen.min_by(|a, b| wald(a).total_cmp(&wald(b)));
        if let Some(least) = least.filter(|least| wald(least) < 0.0) {
            return Some((least, self.without(fitted, least)));
        }
        // Wald's test trusts a parabola; where it keeps all, the likelihood itself decides.
        let without = parallel::map(&open, |candidate| self.without(fitted, *candidate));
        open.into_iter().zip(without).min_by(|a, b| {
            let worth = |(candidate, without): &(Candidate, Fitted<'a>)| {
                let decision = self.decide(*candidate, fitted, without);
                decision.likelihood_ratio - decision.needed
            };
            worth(a).total_cmp(&worth(b))
        })
    }

    /// (θ/σ)² of a candidate, its largest if it has several numbers that are not of trials.
    fn wald(&self, fitted: &Fitted<'a>, candidate: Candidate, covariance: &DMatrix<f64>) -> f64 {
        let places = candidate.unknowns().into_iter().flat_map(|(unknown, _)| {
            (0..self.records.len()).filter_map(move |record| fitted.problem.index(unknown, record))
        });
        let each = places.map(|at| fitted.optimum.theta[at].powi(2) / covariance[(at, at)]);
        let (sum, max) = each.fold((0.0, 0.0_f64), |(sum, max), x| (sum + x, max.max(x)));
        if candidate == Candidate::Current { sum } else { max }
    }

    /// The model with some candidates less, and one more.
    fn changed(
        &self,
        model: &Fitted<'a>,
        less: &[Candidate],
        more: Option<Candidate>,
        iterations: usize,
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
        Fitted::within(self.problem(&unknowns, linear), Some(model), &at, iterations)
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
        self.changed(model, &[candidate], None, MOST_ITERATIONS)
    }

    /// Rao's score test of a candidate at the optimum without it:
    /// `gᵀ (I_cc − I_cb I_bb⁻¹ I_bc)⁻¹ g`.
    fn score(&self, model: &Fitted<'a>, candidate: Candidate) -> Option<f64> {
        let mut unknowns = model.problem.unknowns().to_vec();
        unknowns.extend(candidate.unknowns().into_iter().map(|(unknown, _)| unknown));
        let problem = self.problem(&unknowns, model.problem.is_linear());
        let mut theta = DVector::zeros(problem.len());
        let mut base = Vec::new();
        let mut added = Vec::new();
        for record in 0..self.records.len() {
            for &unknown in &unknowns {
                let place = problem.index(unknown, record)?;
                match model.problem.index(unknown, record) {
                    Some(known) => {
                        theta[place] = model.optimum.theta[known];
                        base.push(place);
                    }
                    None => added.push(place),
                }
            }
        }
        for places in [&mut base, &mut added] {
            places.sort_unstable();
            places.dedup();
        }
        let (_, gradient, information) = problem.evaluate(&theta);
        let pick = |rows: &[usize], columns: &[usize]| {
            DMatrix::from_fn(rows.len(), columns.len(), |i, j| information[(rows[i], columns[j])])
        };
        let solved = pick(&base, &base).cholesky()?.solve(&pick(&base, &added));
        let left_over = pick(&added, &added) - pick(&added, &base) * solved;
        let g = DVector::from_fn(added.len(), |j, _| gradient[added[j]]);
        Some(g.dot(&left_over.cholesky()?.solve(&g)))
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
