//! Which nuisances and terms the logs ask for.

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::minimise::{Optimum, minimise};
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
}

impl Candidate {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Lag,
        Self::Delay,
        Self::ReverseRatio,
        Self::Current,
        Self::Inflow,
        Self::LeverFirst,
        Self::LeverSecond,
        Self::LinearDrag,
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
            _ => true,
        }
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
    /// Twice the gain in log-likelihood on held-out trials, with everything held that was
    /// fitted; absent without such trials, or if it was not asked for.
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

/// The search for a model's structure.
pub(crate) struct Search<'a> {
    pub(crate) records: &'a [Record],
    pub(crate) priors: &'a [Prior],
    pub(crate) fixed: Values,
    /// Trials that are not fitted, to judge candidates by.
    pub(crate) hold_out: &'a [Record],
}

/// A model that was fitted.
pub(crate) struct Fitted<'a> {
    pub(crate) problem: Problem<'a>,
    pub(crate) optimum: Optimum,
}

impl<'a> Search<'a> {
    /// Fits the unknowns, starting from another fit where it has them.
    pub(crate) fn fit(
        &self,
        unknowns: &[Unknown],
        from: Option<&Fitted<'_>>,
        at: &Values,
    ) -> Fitted<'a> {
        let problem = Problem::new(self.records, unknowns, self.priors, self.fixed);
        let mut theta = DVector::zeros(problem.len());
        for record in 0..self.records.len() {
            for &unknown in unknowns {
                let known = from.and_then(|from| {
                    let place = from.problem.index(unknown, record)?;
                    Some(from.optimum.theta[place])
                });
                if let Some(place) = problem.index(unknown, record) {
                    theta[place] = known.unwrap_or_else(|| at.get(unknown));
                }
            }
        }
        let optimum = minimise(&problem, theta);
        Fitted { problem, optimum }
    }

    /// Admits candidates one by one: the one with the greatest gain first, as long as the
    /// gain is worth it and held-out trials are predicted no worse.
    pub(crate) fn run(
        &self,
        base: Fitted<'a>,
        candidates: &[Candidate],
    ) -> (Fitted<'a>, Vec<Decision>) {
        let mut left = candidates.to_vec();
        let mut model = base;
        let mut decisions = Vec::new();
        while !left.is_empty() {
            let scores = self.scores(&model, &left);
            let Some((best, decision)) = self.best(&model, &left, &scores) else {
                decisions.extend(
                    left.iter()
                        .zip(&scores)
                        .map(|(candidate, score)| self.rejected(*candidate, *score)),
                );
                break;
            };
            left.retain(|candidate| *candidate != decision.candidate);
            if decision.admitted {
                model = best;
            }
            decisions.push(decision);
        }
        (model, decisions)
    }

    fn numbers(&self, candidate: Candidate) -> f64 {
        if candidate == Candidate::Current { self.records.len() as f64 } else { 1.0 }
    }

    fn needed(&self, candidate: Candidate) -> f64 {
        let samples: usize = self.records.iter().map(|r| r.schedule.samples()).sum();
        self.numbers(candidate) * (samples as f64).ln()
    }

    fn rejected(&self, candidate: Candidate, score: f64) -> Decision {
        Decision {
            candidate,
            likelihood_ratio: score,
            needed: self.needed(candidate),
            hold_out_ratio: None,
            admitted: false,
        }
    }

    /// Fits those candidates that may be worth it; the one with the greatest gain.
    fn best(
        &self,
        model: &Fitted<'a>,
        left: &[Candidate],
        scores: &[f64],
    ) -> Option<(Fitted<'a>, Decision)> {
        // A score test is a parabola where the likelihood is none; half is near enough.
        let promising: Vec<Candidate> = left
            .iter()
            .zip(scores)
            .filter(|(candidate, score)| **score > 0.5 * self.needed(**candidate))
            .map(|(candidate, _)| *candidate)
            .collect();
        let fits = promising.into_iter().map(|candidate| {
            let fitted = self.with(model, candidate);
            let ratio = 2.0 * (model.optimum.cost - fitted.optimum.cost);
            (fitted, self.rejected(candidate, ratio))
        });
        let worth = |fit: &(Fitted<'a>, Decision)| fit.1.likelihood_ratio - fit.1.needed;
        let (fitted, mut decision) = fits
            .filter(|fit| fit.0.optimum.converged && worth(fit) > 0.0)
            .max_by(|a, b| worth(a).total_cmp(&worth(b)))?;
        let held_out =
            |fit: &Fitted<'_>| fit.problem.cost_of_others(&fit.optimum.theta, self.hold_out);
        if !self.hold_out.is_empty() {
            decision.hold_out_ratio = Some(2.0 * (held_out(model) - held_out(&fitted)));
        }
        decision.admitted = decision.hold_out_ratio.is_none_or(|ratio| ratio > HOLD_OUT_SLACK);
        Some((fitted, decision))
    }

    /// The model with one candidate more.
    fn with(&self, model: &Fitted<'a>, candidate: Candidate) -> Fitted<'a> {
        let problem = &model.problem;
        let mut unknowns = [problem.shared.clone(), problem.own.clone()].concat();
        unknowns.push(candidate.unknown());
        let mut at = self.fixed;
        at.set(candidate.unknown(), candidate.start());
        self.fit(&unknowns, Some(model), &at)
    }

    /// Rao's score test of each candidate at the optimum without it:
    /// `gᵀ (I_cc − I_cb I_bb⁻¹ I_bc)⁻¹ g`.
    fn scores(&self, model: &Fitted<'a>, left: &[Candidate]) -> Vec<f64> {
        let score = |candidate: &Candidate| self.score(model, *candidate).unwrap_or(0.0);
        left.iter().map(score).collect()
    }

    fn score(&self, model: &Fitted<'a>, candidate: Candidate) -> Option<f64> {
        let mut unknowns = [model.problem.shared.clone(), model.problem.own.clone()].concat();
        unknowns.push(candidate.unknown());
        let problem = Problem::new(self.records, &unknowns, self.priors, self.fixed);
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
