//! What the likelihood's parabola at an optimum says of parts of the model, without a fit.

use std::collections::BTreeMap;

use nalgebra::{Cholesky, DMatrix, DVector};

use super::candidate::Candidate;
use super::problem::Problem;
use super::search::Fitted;
use crate::estimate::descend::{scaled_inverse, unit_diagonal};

/// Score tests of candidates that a model lacks, each by itself and all together.
pub(super) struct Scores {
    /// `gᵀ (I_cc − I_cb I_bb⁻¹ I_bc)⁻¹ g` of each candidate.
    alone: BTreeMap<Candidate, f64>,
    /// The worth that each would have beside all others: (θ/σ)² after a step to the minimum of the
    /// parabola of all.
    together: BTreeMap<Candidate, f64>,
}

impl Scores {
    /// Computes Rao's score tests at the optimum without the candidates.
    ///
    /// # Source
    /// \[Rao1948\].
    pub(super) fn at(model: &Fitted<'_>, candidates: &[Candidate]) -> Self {
        let none = Self { alone: BTreeMap::new(), together: BTreeMap::new() };
        if candidates.is_empty() {
            return none;
        }
        let wide = with_all(&model.problem, candidates);
        let theta = widened(model, &wide);
        let (_, gradient, information) = wide.evaluate(&theta);
        let scale = unit_diagonal(&information).diagonal();
        let gradient = gradient.component_mul(&scale);
        let information = DMatrix::from_fn(wide.len(), wide.len(), |i, j| {
            information[(i, j)] * scale[i] * scale[j]
        });
        let places = |c: Candidate| places_of(&wide, c);
        let new: Vec<usize> = candidates.iter().flat_map(|c| places(*c)).collect();
        let base: Vec<usize> = (0..wide.len()).filter(|j| !new.contains(j)).collect();
        let pick = |rows: &[usize], columns: &[usize]| {
            information.select_rows(rows).select_columns(columns)
        };
        let Some(of_base) = Cholesky::new(pick(&base, &base)) else { return none };
        let left = |of: &[usize]| pick(of, of) - pick(of, &base) * of_base.solve(&pick(&base, of));
        let mut scores = none;
        for candidate in candidates {
            let own = places(*candidate);
            let g = gradient.select_rows(&own);
            let score = Cholesky::new(left(&own)).map_or(0.0, |left| g.dot(&left.solve(&g)));
            scores.alone.insert(*candidate, score);
        }
        if let Some(left) = Cholesky::new(left(&new)) {
            let covariance = left.inverse();
            let step = -(&covariance * gradient.select_rows(&new));
            for candidate in candidates {
                let own = places(*candidate);
                let at: Vec<usize> = (0..new.len()).filter(|k| own.contains(&new[*k])).collect();
                scores.together.insert(*candidate, worth(&step, &covariance, &at));
            }
        }
        scores
    }

    /// Returns the score of a candidate by itself; 0 of one that was not tested.
    pub(super) fn of(&self, candidate: Candidate) -> f64 {
        self.alone.get(&candidate).copied().unwrap_or(0.0)
    }

    /// Whether a candidate is worth more than it needs, by itself or beside all others.
    pub(super) fn is_any_significant(&self, needed: impl Fn(Candidate) -> f64) -> bool {
        let mut all = self.alone.iter().chain(&self.together);
        all.any(|(candidate, score)| *score > needed(*candidate))
    }
}

/// The minimum of the parabola at an optimum, while candidates are left out of it.
pub(super) struct Minimum {
    theta: DVector<f64>,
    covariance: DMatrix<f64>,
}

impl Minimum {
    /// Returns `None` if some number is not determined.
    pub(super) fn of(fitted: &Fitted<'_>) -> Option<Self> {
        let covariance = scaled_inverse(&fitted.optimum.information)?;
        Some(Self { theta: fitted.optimum.theta.clone(), covariance })
    }

    /// Returns twice the log-likelihood that the model loses without a candidate.
    pub(super) fn worth(&self, fitted: &Fitted<'_>, candidate: Candidate) -> f64 {
        worth(&self.theta, &self.covariance, &places_of(&fitted.problem, candidate))
    }

    /// Moves to the minimum at which the numbers of a candidate are zero.
    pub(super) fn leave_out(&mut self, fitted: &Fitted<'_>, candidate: Candidate) {
        let own = places_of(&fitted.problem, candidate);
        let cross = self.covariance.select_columns(&own);
        let Some(of_own) = Cholesky::new(cross.select_rows(&own)) else { return };
        self.theta -= &cross * of_own.solve(&self.theta.select_rows(&own));
        self.covariance -= &cross * of_own.solve(&cross.transpose());
        for j in own {
            self.theta[j] = 0.0;
        }
    }
}

/// `θᵀ Σ⁻¹ θ` of some numbers; 0 where that is not determined.
fn worth(theta: &DVector<f64>, covariance: &DMatrix<f64>, places: &[usize]) -> f64 {
    let own = theta.select_rows(places);
    let of_own = covariance.select_rows(places).select_columns(places);
    Cholesky::new(of_own).map_or(0.0, |of_own| own.dot(&of_own.solve(&own)))
}

/// Where the numbers of a candidate stand.
fn places_of(problem: &Problem<'_>, candidate: Candidate) -> Vec<usize> {
    let unknowns = candidate.unknowns();
    let of = |record: usize| {
        unknowns.iter().filter_map(move |(unknown, _)| problem.index(*unknown, record)).collect()
    };
    let mut places: Vec<usize> =
        (0..problem.records.len()).flat_map(|k| -> Vec<usize> { of(k) }).collect();
    places.sort_unstable();
    places.dedup();
    places
}

fn with_all<'a>(problem: &Problem<'a>, candidates: &[Candidate]) -> Problem<'a> {
    let mut unknowns = problem.unknowns().to_vec();
    unknowns.extend(candidates.iter().flat_map(|c| c.unknowns()).map(|(unknown, _)| unknown));
    Problem::new(problem.records, &unknowns, problem.priors, problem.fixed)
}

/// The optimum of a model among the numbers of a wider one, which are zero beside it.
fn widened(model: &Fitted<'_>, wide: &Problem<'_>) -> DVector<f64> {
    let mut theta = DVector::zeros(wide.len());
    for record in 0..wide.records.len() {
        for &unknown in wide.unknowns() {
            if let Some(place) = wide.index(unknown, record) {
                let known = model.problem.index(unknown, record);
                theta[place] = known.map_or(0.0, |known| model.optimum.theta[known]);
            }
        }
    }
    theta
}
