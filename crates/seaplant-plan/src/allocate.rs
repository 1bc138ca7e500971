//! Allocates minutes to manoeuvres by a convex program with a certified gap.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, SolverStatus, SupportedConeT};
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// The objective that the allocation of minutes minimises.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Criterion {
    /// The widest interval among the goals, each as a part of its goal.
    #[default]
    Worst,
    /// The mean square of the intervals, each as a part of its goal: A-optimality.
    Mean,
    /// The volume of the ellipsoid of all coefficients: D-optimality.
    Volume,
}

impl Criterion {
    /// All criteria.
    pub const ALL: [Self; 3] = [Self::Worst, Self::Mean, Self::Volume];

    /// Returns the name in files and flags.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Worst => "worst",
            Self::Mean => "mean",
            Self::Volume => "volume",
        }
    }
}

/// Combinations of coefficients, G, and the standard deviation allowed for them together.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// G, shape (p, r), for each plant that the vehicle may have.
    pub weights: Vec<DMatrix<f64>>,
    /// The greatest standard deviation `√(tr Gᵀ C G)` that meets the goal.
    pub std: f64,
}

/// Electrical power of manoeuvres, and the mean that a battery allows.
#[derive(Clone, Debug, PartialEq)]
pub struct Power {
    /// Power of each manoeuvre, W, shape (K,).
    pub watts: Vec<f64>,
    /// The greatest mean over the time, W.
    pub most: f64,
}

/// Information of some manoeuvres and the goals.
///
/// ```text
/// M_d(w) = B + T Σ w_k J_k,d        w ≥ 0, Σ w = 1, d the plants that the vehicle may have
/// worst    min max_i mean_d  tr G_iᵀ M_d⁻¹ G_i / s_i²
/// mean     min Σ_i  mean_d  tr G_iᵀ M_d⁻¹ G_i / s_i²
/// volume   min −mean_d ln det M_d / p
/// ```
///
/// each with Σ w_k P_k ≤ P where the power of the manoeuvres is limited.
#[derive(Clone, Debug)]
pub struct Program {
    /// J, shape (p, p), of each manoeuvre and each plant, by second.
    pub rates: Vec<Vec<DMatrix<f64>>>,
    /// B, shape (p, p): prior information.
    pub before: DMatrix<f64>,
    /// The goals.
    pub targets: Vec<Target>,
    /// The objective.
    pub criterion: Criterion,
    /// T, s.
    pub seconds: f64,
    /// The power of the manoeuvres, if a battery limits it.
    pub power: Option<Power>,
}

/// Shares of the time, and the certified distance to the optimum.
#[derive(Clone, Debug, PartialEq)]
pub struct Allocation {
    /// w, shape (K,).
    pub shares: Vec<f64>,
    /// The objective there: for `worst` and `mean` in squares of goals, for `volume` −ln det / p.
    pub value: f64,
    /// No shares have an objective below this one.
    pub bound: f64,
    /// The certified gap: for `worst` and `mean` the fraction by which intervals could be narrower;
    /// for `volume` that of their geometric mean.
    pub gap: f64,
}

/// Each manoeuvre keeps this share of an equal one, so that M stays regular; the loss of
/// information is at most this fraction, and added to the gap.
const FLOOR: f64 = 1e-3;
/// The gap at which the program is solved.
const SOLVED: f64 = 4e-3;
/// Number of steps after which the best so far is used, with its gap.
const MOST_STEPS: usize = 150;
/// The level of the next point between bound and best, as a fraction.
const LEVEL: f64 = 0.35;

/// A linear function nowhere above a convex one: value and slope at a point.
struct Cut {
    value: f64,
    slope: DVector<f64>,
    at: DVector<f64>,
}

impl Program {
    /// Allocates the time.
    ///
    /// A level bundle method: every point adds a plane below each objective; the minimum of their
    /// maximum, a linear program, bounds what any shares can reach.
    ///
    /// # Errors
    /// [`Error::Allocation`] if there is nothing to allocate, every manoeuvre needs more power than
    /// allowed, or the solver stops.
    ///
    /// # Source
    /// \[Kiefer1974\]: for `volume`, the bound is that of the general equivalence theorem,
    /// `max_k tr(M⁻¹ J_k) = p` at the optimum; \[Lemarechal1995\] for the method.
    ///
    /// # Example
    /// ```
    /// use nalgebra::{DMatrix, dmatrix};
    /// use seaplant_plan::{Criterion, Program, Target};
    /// // Two manoeuvres that each tell one number, one of them four times as well.
    /// let program = Program {
    ///     rates: vec![vec![dmatrix![4.0, 0.0; 0.0, 0.0]], vec![dmatrix![0.0, 0.0; 0.0, 1.0]]],
    ///     before: DMatrix::zeros(2, 2),
    ///     targets: [dmatrix![1.0; 0.0], dmatrix![0.0; 1.0]]
    ///         .map(|g| Target { weights: vec![g], std: 1.0 })
    ///         .to_vec(),
    ///     criterion: Criterion::Worst,
    ///     seconds: 1.0,
    ///     power: None,
    /// };
    /// let found = program.solve()?;
    /// assert!((found.shares[1] - 0.8).abs() < 0.01 && found.gap < 0.01);
    /// # Ok::<(), seaplant_plan::Error>(())
    /// ```
    pub fn solve(&self) -> Result<Allocation, Error> {
        let count = self.rates.len();
        let no = |reason: &str| Error::Allocation { reason: reason.to_owned() };
        if count == 0 {
            return Err(no("there is no manoeuvre"));
        }
        if self.criterion != Criterion::Volume && self.targets.is_empty() {
            return Err(no("there is no goal; give one, or the criterion volume"));
        }
        if let Some(Power { watts, most }) = &self.power
            && watts.iter().all(|watts| watts > most)
        {
            return Err(no("every manoeuvre needs more power than the battery has for so long"));
        }
        let equal = DVector::repeat(count, 1.0 / count as f64);
        let mut at = match self.power {
            Some(_) => self.nearest_below(&[], 0.0, &equal)?,
            None => equal,
        };
        let mut best = (f64::INFINITY, at.clone());
        let mut bound = f64::NEG_INFINITY;
        let mut cuts = Vec::new();
        for _ in 0..MOST_STEPS {
            let here = self.cuts(&at).ok_or_else(|| no("the information is singular"))?;
            let value = here.iter().map(|cut| cut.value).fold(f64::NEG_INFINITY, f64::max);
            if value < best.0 {
                best = (value, at.clone());
            }
            // Planes far below the maximum do not affect the bound.
            let near = value - 0.9 * value.abs();
            let is_volume = self.criterion == Criterion::Volume;
            cuts.extend(here.into_iter().filter(|cut| is_volume || cut.value >= near));
            bound = bound.max(self.least_of_cuts(&cuts, count)?);
            if self.gap(best.0, bound) < SOLVED || count == 1 {
                break;
            }
            let level = bound + LEVEL * (best.0 - bound);
            at = self.nearest_below(&cuts, level, &best.1)?;
        }
        let (value, shares) = best;
        let gap = if count == 1 { 0.0 } else { self.gap(value, bound) + FLOOR };
        Ok(Allocation { shares: shares.iter().copied().collect(), value, bound, gap })
    }

    /// Returns the fraction by which intervals could be narrower.
    fn gap(&self, value: f64, bound: f64) -> f64 {
        match self.criterion {
            Criterion::Volume => 1.0 - (-0.5 * (value - bound).max(0.0)).exp(),
            _ => 1.0 - (bound.max(0.0) / value).sqrt(),
        }
    }

    /// Returns the ratio of each target's variance to the allowed one, at shares of the time.
    pub fn ratios(&self, shares: &[f64]) -> Option<Vec<f64>> {
        let inverses = self.inverses(&DVector::from_row_slice(shares))?;
        Some(self.targets.iter().map(|target| ratio(target, &inverses)).collect())
    }

    fn inverses(&self, shares: &DVector<f64>) -> Option<Vec<DMatrix<f64>>> {
        let plants = self.rates.first()?.len();
        let of = |d: usize| {
            let mut matrix = self.before.clone();
            for (share, rates) in shares.iter().zip(&self.rates) {
                matrix += &rates[d] * (share * self.seconds);
            }
            inverse(&matrix)
        };
        (0..plants).map(of).collect()
    }

    /// Returns the planes below the objectives at a point.
    fn cuts(&self, at: &DVector<f64>) -> Option<Vec<Cut>> {
        let inverses = self.inverses(at)?;
        let n = inverses.len() as f64;
        if self.criterion == Criterion::Volume {
            let p = self.before.nrows() as f64;
            let value = inverses.iter().map(|of| ln_det(of) / (p * n)).sum();
            let by = |rates: &Vec<DMatrix<f64>>| {
                let traces = rates.iter().zip(&inverses).map(|(rate, of)| rate.dot(of));
                -self.seconds * traces.sum::<f64>() / (p * n)
            };
            let slope = DVector::from_iterator(self.rates.len(), self.rates.iter().map(by));
            return Some(vec![Cut { value, slope, at: at.clone() }]);
        }
        let of = |target: &Target| {
            let value = ratio(target, &inverses);
            let solved: Vec<DMatrix<f64>> =
                inverses.iter().zip(&target.weights).map(|(of, g)| of * g).collect();
            let by = |rates: &Vec<DMatrix<f64>>| {
                let forms = rates.iter().zip(&solved).map(|(rate, x)| x.dot(&(rate * x)));
                -self.seconds * forms.sum::<f64>() / (n * target.std * target.std)
            };
            let slope = DVector::from_iterator(self.rates.len(), self.rates.iter().map(by));
            Cut { value, slope, at: at.clone() }
        };
        let all = self.targets.iter().map(of);
        match self.criterion {
            Criterion::Mean => all
                .reduce(|sum, one| Cut {
                    value: sum.value + one.value,
                    slope: sum.slope + one.slope,
                    at: sum.at,
                })
                .map(|sum| vec![sum]),
            _ => Some(all.collect()),
        }
    }

    /// Returns the minimum of the planes' maximum on the simplex.
    fn least_of_cuts(&self, cuts: &[Cut], count: usize) -> Result<f64, Error> {
        let scale = cuts.iter().map(|cut| cut.value.abs()).fold(f64::INFINITY, f64::min).max(1e-9);
        // w, then t: t ≥ (value + slope (w − at)) / scale.
        let mut rows = Vec::new();
        let mut ends = Vec::new();
        for cut in cuts {
            let size = cut.slope.amax().max(scale) / scale;
            let mut row: Vec<f64> = cut.slope.iter().map(|x| x / scale / size).collect();
            row.push(-1.0 / size);
            rows.push(row);
            ends.push((cut.slope.dot(&cut.at) - cut.value) / scale / size);
        }
        let mut goal = vec![0.0; count + 1];
        goal[count] = 1.0;
        let nothing = CscMatrix::zeros((count + 1, count + 1));
        let x = self.on_simplex(&nothing, &goal, (rows, ends), count)?;
        // The value of the planes there, less the solver's tolerance.
        let w = DVector::from_row_slice(&x[..count]);
        let plane = |cut: &Cut| cut.value + cut.slope.dot(&(&w - &cut.at));
        let greatest = cuts.iter().map(plane).fold(f64::NEG_INFINITY, f64::max);
        Ok(greatest - TOLERANCE * greatest.abs())
    }

    /// Returns the shares nearest to given ones for which all planes are below a level.
    fn nearest_below(
        &self,
        cuts: &[Cut],
        level: f64,
        to: &DVector<f64>,
    ) -> Result<DVector<f64>, Error> {
        let count = to.len();
        let (mut rows, mut ends) = (Vec::new(), Vec::new());
        for cut in cuts {
            let size = cut.slope.amax().max(1e-12);
            rows.push(cut.slope.iter().map(|x| x / size).collect::<Vec<f64>>());
            ends.push((level - cut.value + cut.slope.dot(&cut.at)) / size);
        }
        let goal: Vec<f64> = to.iter().map(|x| -x).collect();
        let x = self.on_simplex(&CscMatrix::identity(count), &goal, (rows, ends), count)?;
        let floor = FLOOR / count as f64;
        let w = DVector::from_iterator(count, x.iter().map(|x| x.max(floor)));
        Ok(&w / w.sum())
    }

    /// Minimises `½ xᵀ P x + qᵀ x` with rows below their bounds, over x whose first `count` numbers are
    /// shares within the allowed power.
    fn on_simplex(
        &self,
        p: &CscMatrix<f64>,
        q: &[f64],
        (rows, ends): (Vec<Vec<f64>>, Vec<f64>),
        count: usize,
    ) -> Result<Vec<f64>, Error> {
        let width = q.len();
        let floor = FLOOR / count as f64;
        let mut all = vec![vec![0.0; width]];
        all[0][..count].fill(1.0);
        let mut b = vec![1.0];
        for (row, end) in rows.into_iter().zip(ends) {
            all.push(row);
            b.push(end);
        }
        if let Some(Power { watts, most }) = &self.power {
            let mut row: Vec<f64> = watts.iter().map(|watts| watts / most).collect();
            row.resize(width, 0.0);
            all.push(row);
            b.push(1.0);
        }
        for k in 0..count {
            let mut row = vec![0.0; width];
            row[k] = -1.0;
            all.push(row);
            b.push(-floor);
        }
        let below = all.len() - 1;
        let a = CscMatrix::from(&all);
        let cones = [SupportedConeT::ZeroConeT(1), SupportedConeT::NonnegativeConeT(below)];
        let settings = DefaultSettings { verbose: false, ..DefaultSettings::default() };
        let refuse = |reason: String| Error::Allocation { reason };
        let mut solver = DefaultSolver::new(p, q, &a, &b, &cones, settings)
            .map_err(|error| refuse(error.to_string()))?;
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => Ok(solver.solution.x.clone()),
            status => Err(refuse(format!("the solver of the linear program says {status:?}"))),
        }
    }
}

/// The tolerated error of a solver's point, as a part.
const TOLERANCE: f64 = 1e-5;

fn ratio(target: &Target, inverses: &[DMatrix<f64>]) -> f64 {
    let forms = inverses.iter().zip(&target.weights).map(|(of, g)| g.dot(&(of * g)));
    forms.sum::<f64>() / (inverses.len() as f64 * target.std * target.std)
}

/// Inverts a positive definite matrix, scaled first.
pub(crate) fn inverse(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    let scale = DVector::from_fn(n, |k, _| matrix[(k, k)].max(f64::MIN_POSITIVE).sqrt().recip());
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]))
}

fn ln_det(matrix: &DMatrix<f64>) -> f64 {
    let factor = matrix.clone().cholesky();
    factor.map_or(f64::INFINITY, |f| 2.0 * f.l_dirty().diagonal().map(f64::ln).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For the line through two points on [−1, 1] the ends are D-optimal, half each [Kiefer1974].
    #[test]
    fn half_of_the_time_at_each_end_is_best_for_a_line() {
        let of = |x: f64| vec![DMatrix::from_row_slice(2, 2, &[1.0, x, x, x * x])];
        let program = Program {
            rates: [-1.0, -0.5, 0.0, 0.3, 1.0].map(of).to_vec(),
            before: DMatrix::zeros(2, 2),
            targets: Vec::new(),
            criterion: Criterion::Volume,
            seconds: 60.0,
            power: None,
        };
        let found = program.solve().expect("regular");
        assert!((found.shares[0] - 0.5).abs() < 0.02, "{found:?}");
        assert!((found.shares[4] - 0.5).abs() < 0.02, "{found:?}");
        assert!(found.gap < 0.01);
        // The equivalence theorem: tr(M⁻¹ J_k) ≤ p, with equality where time is allocated.
        let inverse = &program.inverses(&DVector::from_vec(found.shares)).expect("regular")[0];
        for rates in &program.rates {
            // A share of 0.48 in place of ½ is 1/0.96 of it.
            assert!(60.0 * rates[0].dot(inverse) < 2.0 / 0.96);
        }
    }

    /// With J = diag(a) alone and diag(b) alone, `Σ 1/(w a)` is minimal at w ∝ 1/√a.
    #[test]
    fn the_mean_takes_shares_by_the_roots() {
        let rates = [(1.0, 0.0), (0.0, 16.0)]
            .map(|(a, b)| vec![DMatrix::from_diagonal(&DVector::from_vec(vec![a, b]))]);
        let target = |k: usize| Target {
            weights: vec![DMatrix::from_fn(2, 1, |i, _| f64::from(u8::from(i == k)))],
            std: 1.0,
        };
        let program = Program {
            rates: rates.to_vec(),
            before: DMatrix::zeros(2, 2),
            targets: vec![target(0), target(1)],
            criterion: Criterion::Mean,
            seconds: 1.0,
            power: None,
        };
        let found = program.solve().expect("regular");
        assert!((found.shares[0] - 0.8).abs() < 0.02, "{found:?}");
        assert!(found.gap < 0.01 && found.bound <= found.value, "{found:?}");
        assert!((found.value - 1.5625).abs() < 0.01, "{found:?}");
    }

    /// Of two manoeuvres that tell different numbers, the one of 300 W may take a quarter of the
    /// time where 150 W is allowed and the other needs 100 W; without a limit, half.
    #[test]
    fn shares_stay_within_the_allowed_power() {
        let rates = [(1.0, 0.0), (0.0, 1.0)]
            .map(|(a, b)| vec![DMatrix::from_diagonal(&DVector::from_vec(vec![a, b]))]);
        let target = |k: usize| Target {
            weights: vec![DMatrix::from_fn(2, 1, |i, _| f64::from(u8::from(i == k)))],
            std: 1.0,
        };
        let of = |most: f64| Program {
            rates: rates.to_vec(),
            before: DMatrix::zeros(2, 2),
            targets: vec![target(0), target(1)],
            criterion: Criterion::Worst,
            seconds: 1.0,
            power: Some(Power { watts: vec![300.0, 100.0], most }),
        };
        let limited = of(150.0).solve().expect("feasible");
        assert!((limited.shares[0] - 0.25).abs() < 0.01 && limited.gap < 0.01, "{limited:?}");
        assert!((of(250.0).solve().expect("feasible").shares[0] - 0.5).abs() < 0.01);
        let refused = of(90.0).solve().expect_err("both need more").to_string();
        assert!(refused.contains("power"), "{refused}");
    }

    /// A goal of two numbers together has the sum of their variances: `1/w + 1/(4 (1 − w))` is minimal
    /// at w = 2/3.
    #[test]
    fn a_goal_of_several_numbers_is_their_sum_of_variances() {
        let rates = [(1.0, 0.0), (0.0, 4.0)]
            .map(|(a, b)| vec![DMatrix::from_diagonal(&DVector::from_vec(vec![a, b]))]);
        let program = Program {
            rates: rates.to_vec(),
            before: DMatrix::zeros(2, 2),
            targets: vec![Target { weights: vec![DMatrix::identity(2, 2)], std: 1.0 }],
            criterion: Criterion::Worst,
            seconds: 1.0,
            power: None,
        };
        let found = program.solve().expect("regular");
        assert!((found.shares[0] - 2.0 / 3.0).abs() < 0.02, "{found:?}");
        assert!((found.value - 2.25).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn nothing_to_allocate_is_an_error() {
        let program = Program {
            rates: Vec::new(),
            before: DMatrix::zeros(1, 1),
            targets: Vec::new(),
            criterion: Criterion::Volume,
            seconds: 1.0,
            power: None,
        };
        assert!(program.solve().expect_err("nothing").to_string().contains("no manoeuvre"));
    }
}
