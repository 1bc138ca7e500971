//! Which nuisances and terms the logs ask for.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::minimise::{Optimum, minimise, scaled_inverse};
use super::parameters::{Unknown, Values};
use super::problem::{Prior, Problem, Record};
use crate::AxisRecord;

/// Something that may or may not be part of the model.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Candidate {
    /// First-order lag of propeller speed.
    Lag,
    /// Delay of thrust.
    Delay,
    /// Reverse thrust that differs from its curve.
    ReverseRatio,
    /// A constant current along the degree of freedom, in each trial its own.
    Current,
    /// Thrust lost to inflow.
    Inflow,
    /// A lever arm of the velocity sensor that navigation did not know, along the first of
    /// [`lever_axes`](crate::lever_axes).
    LeverFirst,
    /// The same along the second.
    LeverSecond,
    /// Drag that is linear in speed.
    LinearDrag,
    /// A constant force.
    Bias,
    /// What turning does to body velocity: see [`AxisRecord::turning`].
    Turning,
}

impl Candidate {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Lag,
        Self::Delay,
        Self::ReverseRatio,
        Self::Current,
        Self::Inflow,
        Self::LeverFirst,
        Self::LeverSecond,
        Self::LinearDrag,
        Self::Bias,
        Self::Turning,
    ];

    /// As files write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Lag => "lag",
            Self::Delay => "delay",
            Self::ReverseRatio => "reverse-ratio",
            Self::Current => "current",
            Self::Inflow => "inflow",
            Self::LeverFirst => "lever-first",
            Self::LeverSecond => "lever-second",
            Self::LinearDrag => "linear-drag",
            Self::Bias => "bias",
            Self::Turning => "turning",
        }
    }

    pub(crate) const fn unknown(self) -> Unknown {
        match self {
            Self::Lag => Unknown::Lag,
            Self::Delay => Unknown::Delay,
            Self::ReverseRatio => Unknown::LogReverseRatio,
            Self::Current => Unknown::Current,
            Self::Inflow => Unknown::Inflow,
            Self::LeverFirst => Unknown::LeverFirst,
            Self::LeverSecond => Unknown::LeverSecond,
            Self::LinearDrag => Unknown::Mu,
            Self::Bias => Unknown::Bias,
            Self::Turning => Unknown::Turning,
        }
    }

    /// Whether it can be at all: a rotation knows no current along it, and a lever arm
    /// shows only where the vehicle's turning was logged.
    pub(crate) fn exists_in(self, axes: &[AxisRecord]) -> bool {
        match self {
            Self::Current => axes.iter().all(|axis| !axis.dof.is_rotation()),
            Self::LeverFirst | Self::LeverSecond => {
                axes.iter().all(|axis| axis.lever_rates.is_some())
            }
            Self::Turning => axes.iter().all(|axis| axis.turning.is_some()),
            _ => true,
        }
    }

    /// Whether it is a term of the equation of motion, which a user may ask for.
    pub(crate) const fn is_term(self) -> bool {
        matches!(self, Self::LinearDrag | Self::Bias)
    }

    /// Where a fit with it starts; at zero a lag has nothing to follow.
    const fn start(self) -> f64 {
        match self {
            Self::Lag => 0.15,
            _ => 0.0,
        }
    }
}

/// Why a candidate was taken into the model, or left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Decision {
    /// Which.
    pub candidate: Candidate,
    /// Twice the gain in log-likelihood: fitted, or where a fit was not worth it, by the
    /// score test.
    pub likelihood_ratio: f64,
    /// What the Bayesian information criterion asks for: numbers added times ln n.
    pub needed: f64,
    /// How much it does, for a term: linear drag as a part of quadratic drag at the usual
    /// speed, zero unless both brake; a bias force, at the end of its interval that is farther from zero, as a part
    /// of the usual thrust.
    pub size: Option<f64>,
    /// Twice the gain in log-likelihood on held-out trials, with everything held that was
    /// fitted but what each trial has by itself; absent without such trials, or if it was not
    /// asked for.
    pub hold_out_ratio: Option<f64>,
    /// Whether it is part of the model.
    pub admitted: bool,
}

/// The likelihood of held-out trials may fall by this when a candidate is admitted: what
/// is fitted to one trial misses another by its own uncertainty.
///
/// Likelihood, one step ahead, and not the error of a simulation: under a current the true
/// parameters simulate worse than wrong ones.
const HOLD_OUT_SLACK: f64 = -4.0;

/// Linear drag below this part of the quadratic is none, however sharply it is seen: below
/// what a thrust curve or a log's clock is good for.
const SLIGHT_LINEAR_DRAG: f64 = 0.01;

/// A bias force stays in the model unless the logs show that it is below this part of the
/// thrust: a vehicle is seldom neutral, and a simulation without its weight drifts away.
const SLIGHT_BIAS: f64 = 0.02;

/// A candidate that spoils prediction goes before one that is merely not needed.
const SEVERE: f64 = 1e3;

/// Cost of held-out trials, at the numbers that were fitted to the others. A current is of a
/// place and a heading, so that each is given the one that suits it best: by that of another
/// heading it would speak against the very model that two headings need.
fn cost_of_others(fit: &Fitted<'_>, others: &[Record]) -> f64 {
    let cost = |record| {
        let problem = fit.problem.of_another(&fit.optimum.theta, record);
        match problem.len() {
            0 => problem.cost(&DVector::zeros(0)),
            n => minimise(&problem, DVector::zeros(n)).cost,
        }
    };
    others.iter().map(cost).sum()
}

/// The search for a model's structure.
pub(crate) struct Search<'a> {
    pub(crate) records: &'a [Record],
    pub(crate) priors: &'a [Prior],
    pub(crate) fixed: Values,
    /// Where a fit that follows no other starts.
    pub(crate) start: Values,
    /// Trials that are not fitted, to judge candidates by.
    pub(crate) hold_out: &'a [Record],
    /// What is usual in the fitted trials.
    pub(crate) usual: Usual,
    /// The logarithm of the shortest time in which a disturbance may forget, s.
    pub(crate) quickest: f64,
}

/// Root mean squares over the fitted trials.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Usual {
    /// m/s or rad/s.
    pub(crate) speed: f64,
    /// N or N m.
    pub(crate) thrust: f64,
}

/// A model that was fitted.
pub(crate) struct Fitted<'a> {
    pub(crate) problem: Problem<'a>,
    pub(crate) optimum: Optimum,
}

impl<'a> Fitted<'a> {
    /// Fits all numbers of a problem, starting from another fit where it has them.
    pub(crate) fn of(problem: Problem<'a>, from: Option<&Fitted<'_>>, at: &Values) -> Self {
        let mut theta = DVector::zeros(problem.len());
        for record in 0..problem.records.len() {
            for &unknown in problem.unknowns() {
                let Some(place) = problem.index(unknown, record) else { continue };
                let known = from.and_then(|from| from.value(unknown, record));
                theta[place] = known.unwrap_or_else(|| at.get(unknown));
            }
        }
        let optimum = minimise(&problem, theta);
        Self { problem, optimum }
    }

    /// What was found for a trial; of one that was not there, what the first has.
    fn value(&self, unknown: Unknown, record: usize) -> Option<f64> {
        let record = if record < self.problem.records.len() { record } else { 0 };
        self.problem.index(unknown, record).map(|place| self.optimum.theta[place])
    }
}

impl<'a> Search<'a> {
    /// Fits the unknowns, starting from another fit where it has them.
    pub(crate) fn fit(
        &self,
        unknowns: &[Unknown],
        from: Option<&Fitted<'_>>,
        at: &Values,
    ) -> Fitted<'a> {
        let problem = Problem::new(self.records, unknowns, self.priors, self.fixed)
            .with_quickest(self.quickest);
        Fitted::of(problem, from, at)
    }

    /// Starts with every candidate in the model and leaves out, one by one, the one that is
    /// worth least, until each that is left is worth its place.
    ///
    /// Backwards, since one fault hides another: under a current and a delay together, a
    /// lag alone makes nothing better.
    pub(crate) fn run(
        &self,
        base: Fitted<'a>,
        candidates: &[Candidate],
    ) -> (Fitted<'a>, Vec<Decision>) {
        if candidates.is_empty() {
            return (base, Vec::new());
        }
        let mut kept = candidates.to_vec();
        let mut model = self.full(&base, &kept);
        if !model.optimum.converged {
            // Too much for these logs: begin with what the score test sees.
            let is_seen = |c: &Candidate| self.score(&base, *c).unwrap_or(0.0) > self.needed(*c);
            kept.retain(|c| c.is_term() || is_seen(c));
            model = self.full(&base, &kept);
        }
        let mut needed_anyway = Vec::new();
        while let Some((least, without)) = self.least_worth(&model, &kept, &needed_anyway) {
            let decision = self.decide(least, &model, &without);
            if !decision.admitted {
                kept.retain(|candidate| *candidate != least);
                model = without;
            } else if decision.likelihood_ratio < decision.needed {
                needed_anyway.push(least);
            } else {
                break;
            }
        }
        self.take_back(candidates, &mut kept, &mut model);
        let decisions =
            candidates.iter().map(|&c| self.final_decision(c, &model, kept.contains(&c)));
        let decisions = decisions.collect();
        (model, decisions)
    }

    fn final_decision(&self, candidate: Candidate, model: &Fitted<'a>, kept: bool) -> Decision {
        if kept {
            let without = self.without(model, candidate);
            return Decision { admitted: true, ..self.decide(candidate, model, &without) };
        }
        let ratio = self.score(model, candidate).unwrap_or(0.0);
        // What the logs ask for and held-out trials refuse is shown with both.
        let is_close = candidate.is_term() || ratio > self.needed(candidate);
        let with = is_close.then(|| self.with(model, &[candidate]));
        let decision = match with.filter(|with| with.optimum.converged) {
            Some(with) => self.decide(candidate, &with, model),
            None => self.decision(candidate, ratio, None, None),
        };
        Decision { admitted: false, ..decision }
    }

    /// The model with all of the candidates, from several starts: a disturbance that
    /// forgets quickly can take the place of a fault that was not in the model yet.
    fn full(&self, base: &Fitted<'a>, candidates: &[Candidate]) -> Fitted<'a> {
        let mut unknowns = base.problem.unknowns().to_vec();
        unknowns.extend(candidates.iter().map(|candidate| candidate.unknown()));
        let fresh = self.fit(&unknowns, None, &self.start);
        let grown = self.with(base, candidates);
        let rank = |fit: &Fitted<'_>| (!fit.optimum.converged, fit.optimum.cost);
        if rank(&fresh) <= rank(&grown) { fresh } else { grown }
    }

    /// Takes back what was left out too early: worth its place in the model as it is now.
    fn take_back(
        &self,
        candidates: &[Candidate],
        kept: &mut Vec<Candidate>,
        model: &mut Fitted<'a>,
    ) {
        let left_in = kept.clone();
        for &candidate in candidates.iter().filter(|c| !left_in.contains(c)) {
            if self.score(model, candidate).unwrap_or(0.0) < self.needed(candidate) {
                continue;
            }
            let with = self.with(model, &[candidate]);
            if with.optimum.converged && self.decide(candidate, &with, model).admitted {
                kept.push(candidate);
                *model = with;
            }
        }
    }

    fn numbers(&self, candidate: Candidate) -> f64 {
        if candidate == Candidate::Current { self.records.len() as f64 } else { 1.0 }
    }

    fn needed(&self, candidate: Candidate) -> f64 {
        let samples: usize = self.records.iter().map(|r| r.measurements.samples()).sum();
        self.numbers(candidate) * (samples as f64).ln()
    }

    fn decision(
        &self,
        candidate: Candidate,
        likelihood_ratio: f64,
        size: Option<f64>,
        hold_out_ratio: Option<f64>,
    ) -> Decision {
        let needed = self.needed(candidate);
        let predicts = hold_out_ratio.is_none_or(|ratio| ratio > HOLD_OUT_SLACK);
        let supported = likelihood_ratio > needed && predicts;
        let admitted = match candidate {
            Candidate::LinearDrag => supported && size.is_none_or(|size| size > SLIGHT_LINEAR_DRAG),
            Candidate::Bias => supported || size.is_some_and(|size| size > SLIGHT_BIAS),
            _ => supported,
        };
        Decision { candidate, likelihood_ratio, needed, size, hold_out_ratio, admitted }
    }

    /// Whether a candidate is worth its place, by a fit with it and one without.
    fn decide(&self, candidate: Candidate, with: &Fitted<'_>, without: &Fitted<'_>) -> Decision {
        let ratio = 2.0 * (without.optimum.cost - with.optimum.cost);
        let others = |fit: &Fitted<'_>| cost_of_others(fit, self.hold_out);
        let hold_out = (!self.hold_out.is_empty()).then(|| 2.0 * (others(without) - others(with)));
        self.decision(candidate, ratio, self.size(candidate, with), hold_out)
    }

    /// How much a term does in a model that has it.
    fn size(&self, candidate: Candidate, with: &Fitted<'_>) -> Option<f64> {
        let Usual { speed, thrust } = self.usual;
        let values = with.problem.values(&with.optimum.theta, 0);
        match candidate {
            Candidate::LinearDrag => {
                let quadratic = values.get(Unknown::Beta) * speed;
                // Beside thrust that drives, one of two drags that do is no drag at all.
                let both_brake = values.get(Unknown::Mu) < 0.0 && quadratic < 0.0;
                Some(if both_brake { values.get(Unknown::Mu) / quadratic } else { 0.0 })
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
        model: &Fitted<'a>,
        kept: &[Candidate],
        needed_anyway: &[Candidate],
    ) -> Option<(Candidate, Fitted<'a>)> {
        let linear = Candidate::LinearDrag;
        if kept.contains(&linear) && self.size(linear, model) == Some(0.0) {
            return Some((linear, self.without(model, linear)));
        }
        let wald = |candidate: &Candidate| self.wald(model, *candidate) - self.needed(*candidate);
        let open = || kept.iter().copied().filter(|c| !needed_anyway.contains(c));
        let least = open().min_by(|a, b| wald(a).total_cmp(&wald(b)))?;
        if wald(&least) < 0.0 {
            return Some((least, self.without(model, least)));
        }
        // Wald's test trusts a parabola; where it keeps all, the likelihood itself decides.
        open().map(|candidate| (candidate, self.without(model, candidate))).min_by(|a, b| {
            let worth = |(candidate, without): &(Candidate, Fitted<'a>)| {
                let decision = self.decide(*candidate, model, without);
                let held_out = decision.hold_out_ratio.unwrap_or(0.0).min(0.0);
                decision.likelihood_ratio - decision.needed + SEVERE * held_out.min(HOLD_OUT_SLACK)
            };
            worth(a).total_cmp(&worth(b))
        })
    }

    /// (θ/σ)² of a candidate, its largest if it is one of each trial.
    fn wald(&self, model: &Fitted<'a>, candidate: Candidate) -> f64 {
        let Some(covariance) = scaled_inverse(&model.optimum.information) else { return 0.0 };
        let of = |record| {
            let place = model.problem.index(candidate.unknown(), record)?;
            Some(model.optimum.theta[place].powi(2) / covariance[(place, place)])
        };
        let each = (0..self.records.len()).filter_map(of);
        let (sum, max) = each.fold((0.0, 0.0_f64), |(sum, max), x| (sum + x, max.max(x)));
        if candidate == Candidate::Current { sum } else { max }
    }

    /// The model with candidates more.
    fn with(&self, model: &Fitted<'a>, candidates: &[Candidate]) -> Fitted<'a> {
        let mut unknowns = model.problem.unknowns().to_vec();
        let mut at = self.fixed;
        for candidate in candidates {
            unknowns.push(candidate.unknown());
            at.set(candidate.unknown(), candidate.start());
        }
        self.fit(&unknowns, Some(model), &at)
    }

    /// The model with one candidate less.
    fn without(&self, model: &Fitted<'a>, candidate: Candidate) -> Fitted<'a> {
        let mut unknowns = model.problem.unknowns().to_vec();
        unknowns.retain(|unknown| *unknown != candidate.unknown());
        self.fit(&unknowns, Some(model), &self.fixed)
    }

    /// Rao's score test of a candidate at the optimum without it:
    /// `gᵀ (I_cc − I_cb I_bb⁻¹ I_bc)⁻¹ g`.
    fn score(&self, model: &Fitted<'a>, candidate: Candidate) -> Option<f64> {
        let mut unknowns = model.problem.unknowns().to_vec();
        unknowns.push(candidate.unknown());
        let problem = Problem::new(self.records, &unknowns, self.priors, self.fixed)
            .with_quickest(self.quickest);
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
