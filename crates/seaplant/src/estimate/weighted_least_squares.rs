//! Weighted least squares: rows weighted by their inverse standard deviation.

mod noise;

use nalgebra::Vector4;

use super::filtered::Filtered;
use super::{EquationError, Fit, Method, Records};
use crate::Error;
use crate::regression::{LeastSquares, Regression, Row};
use crate::signal::rms;
use noise::{Memory, Variance};

/// Weighted least squares, with the filters of equation error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WeightedLeastSquares(pub EquationError);

impl WeightedLeastSquares {
    /// Fits the plant by feasible generalised least squares on the equation of motion.
    ///
    /// The rows are those of [`EquationError::fit`]. Their errors `e_k = σ_k u_k` have a variance
    /// that depends on speed, `σ² = a + c v²` – velocity noise contributes `(2β v)²` times its
    /// variance through v|v|, and a wrong drag or a current act likewise – and an autocorrelation:
    /// u is an autoregression over instants `1 / 2f_c` apart, f_c being the cut-off frequency of
    /// the filter, since nearer ones carry no new information. Each row is divided by σ_k, the
    /// prediction from earlier rows is subtracted, and least squares minimises
    /// `Σ (u_k − Σᵢ φᵢ u_{k−iD})²`. a and c follow from a regression of e² on v², φ from the
    /// autocorrelation of u with its order, at most eight, selected by BIC; fit and weights are
    /// iterated until they converge.
    ///
    /// With a slowly varying force (a tether), equation error attributes to drag whatever
    /// correlates with v|v|; the weights reduce the slow components. The first rows of every
    /// section serve only for prediction of the next. Intervals are from batch means of the
    /// weighted rows, and remain valid if the weights are wrong.
    ///
    /// The residual of the fit is that of the unweighted equation, m/s² or rad/s².
    ///
    /// # Errors
    /// As [`EquationError::fit`]; [`Error::NotConverged`] if fit and weights do not converge.
    ///
    /// # Source
    /// Weights by the inverse variance: \[Aitken1936\]; a variance linear in known numbers:
    /// \[Amemiya1977\]; repeated autoregression: \[Cochrane1949\], in identification \[Young2011\].
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let filtered = Filtered::of(records.into(), &self.0)?;
        let (dof, terms) = (filtered.dof, filtered.terms);
        let rows = filtered.rows()?;
        let first = filtered.stretches.iter().zip(&rows).fold(
            Regression::new(filtered.duration_s(), terms),
            |mut regression, (stretch, rows)| {
                regression.start_stretch(stretch.ready.grid.period_s);
                regression.add(rows);
                regression
            },
        );
        let equation = Equation { filtered: &filtered, rows };
        let found = equation.weigh(first.solve(dof)?)?;
        let Filtered { filters, caveats, .. } = filtered;
        Ok(Fit::of_regression(dof, Method::WeightedLeastSquares, terms, found, filters, caveats))
    }
}

/// Maximum number of rounds of fit and weights.
const MOST_ROUNDS: usize = 300;

/// They have converged when no coefficient changes by more than this fraction of its standard
/// deviation.
const SETTLED: f64 = 1e-4;

/// The filtered equation.
struct Equation<'a> {
    filtered: &'a Filtered<'a>,
    rows: Vec<Vec<Row>>,
}

impl Equation<'_> {
    /// Iterates fit and weights, from plain least squares, until they converge.
    fn weigh(&self, plain: LeastSquares) -> Result<LeastSquares, Error> {
        let mut found = plain;
        // The order is fixed after the first round, since a changing order would prevent
        // convergence.
        let mut order = None;
        for _ in 0..MOST_ROUNDS {
            let errors = self.errors(&found);
            let variance = Variance::of(&self.rows, &errors);
            let memory = Memory::of(&self.weighed(&errors, &variance), self.spacing(), order);
            order = Some(memory.order());
            let next = self.fit(&variance, &memory)?;
            let moved = next.lumped.to_vector() - found.lumped.to_vector();
            let std = next.covariance.diagonal().map(f64::sqrt);
            found = next;
            if is_within(&moved, &std) {
                found.residual_rms = rms(self.errors(&found).iter().flatten());
                return Ok(found);
            }
        }
        Err(Error::NotConverged { dof: self.filtered.dof, iterations: MOST_ROUNDS })
    }

    /// Returns the number of rows between instants that the filter leaves independent.
    fn spacing(&self) -> usize {
        let cutoff_hz = self.filtered.filters.every_term.map_or(f64::INFINITY, |f| f.cutoff_hz);
        let rates = self.filtered.stretches.iter().map(|stretch| stretch.sample_hz);
        let fastest = rates.fold(0.0, f64::max);
        ((0.5 * fastest / cutoff_hz).round() as usize).max(1)
    }

    /// Computes v̇ − F Φ of each row.
    fn errors(&self, found: &LeastSquares) -> Vec<Vec<f64>> {
        let plant = found.lumped;
        let error = |[tau, quadratic, linear, v_dot]: &Row| {
            let drag = plant.beta * quadratic + plant.mu * linear;
            v_dot - plant.alpha * tau - drag - plant.bias
        };
        self.rows.iter().map(|rows| rows.iter().map(error).collect()).collect()
    }

    fn weighed(&self, errors: &[Vec<f64>], variance: &Variance) -> Vec<Vec<f64>> {
        let of = |(rows, errors): (&Vec<Row>, &Vec<f64>)| {
            let weights = rows.iter().map(|row| variance.weight(row));
            weights.zip(errors).map(|(weight, e)| weight * e).collect()
        };
        self.rows.iter().zip(errors).map(of).collect()
    }

    fn fit(&self, variance: &Variance, memory: &Memory) -> Result<LeastSquares, Error> {
        let mut regression = Regression::new(self.filtered.duration_s(), self.filtered.terms);
        for (stretch, rows) in self.filtered.stretches.iter().zip(&self.rows) {
            let mut ones: Vec<f64> = rows.iter().map(|row| variance.weight(row)).collect();
            let weighed = rows.iter().zip(&ones).map(|(row, weight)| row.map(|x| weight * x));
            let mut weighed: Vec<Row> = weighed.collect();
            memory.forget(&mut weighed, |row, before, part| {
                row.iter_mut().zip(before).for_each(|(x, before)| *x -= part * before);
            });
            memory.forget(&mut ones, |one, before, part| *one -= part * before);
            regression.start_stretch(stretch.ready.grid.period_s);
            let known = memory.reach().min(rows.len());
            regression.add_transformed(&weighed[known..], &ones[known..]);
        }
        regression.solve(self.filtered.dof)
    }
}

/// Returns true if no coefficient changed by more than [`SETTLED`] standard deviations.
fn is_within(moved: &Vector4<f64>, std: &Vector4<f64>) -> bool {
    moved.iter().zip(std).all(|(moved, std)| moved.abs() <= SETTLED * std)
}
