//! Least squares on the equation of motion solved for accelerations.

use nalgebra::{DMatrix, DVector};

use super::{Rows, Solved, rms};
use crate::estimate::descend::Parabola;
use crate::plant::{Basis, Parameterisation, Physical, Structure};

/// Maximum number of steps: sufficient for a start.
const MOST_STEPS: usize = 40;

/// The descent stops when a step reduces the cost by less than this fraction.
const NO_GAIN: f64 = 1e-6;

/// Damping of Gauss–Newton steps: initial value, factor, limit.
const DAMPING: f64 = 1e-3;
const DAMPING_FACTOR: f64 = 8.0;
const MOST_DAMPING: f64 = 1e8;

/// Minimises `Σ ‖W M⁻¹ (Y θ − τ)‖²` from given coefficients, where W holds the inverse residual of
/// each axis; `None` if M is singular at some step.
pub(super) fn descent(
    structure: &Structure,
    physical: &Physical,
    rows: &Rows,
    from: &Solved,
) -> Option<Solved> {
    let problem = Problem { structure, physical, rows };
    let mut free = physical.free(&from.coefficients);
    let mut damping = DAMPING;
    for _ in 0..MOST_STEPS {
        let weights = problem.weights(&free)?;
        let (gradient, hessian, cost) = problem.slope(&free, &weights)?;
        let Some((moved, there)) =
            problem.step(&free, &weights, (&gradient, &hessian, cost), &mut damping)
        else {
            break;
        };
        free = moved;
        if cost - there < NO_GAIN * cost {
            break;
        }
    }
    let coefficients = physical.coefficients(&free);
    let misfit = &rows.y * &coefficients - &rows.force;
    let n = structure.axes().len();
    let residual = (0..n).map(|axis| rms(misfit.iter().skip(axis).step_by(n))).collect();
    Some(Solved { coefficients, residual, rank: from.rank, terms: from.terms })
}

struct Problem<'a> {
    structure: &'a Structure,
    physical: &'a Physical,
    rows: &'a Rows,
}

impl Problem<'_> {
    fn mass(&self, coefficients: &DVector<f64>) -> DMatrix<f64> {
        let axes = self.structure.axes();
        let n = axes.len();
        DMatrix::from_fn(n, n, |i, j| {
            let term = Basis::Mass(axes[i.min(j)], axes[i.max(j)]);
            self.structure.index_of(&term).map_or(0.0, |k| coefficients[k])
        })
    }

    /// Computes `M⁻¹ (Y θ − τ)`, shape (axes, windows), and M⁻¹.
    fn misfit(&self, free: &DVector<f64>) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let coefficients = self.physical.coefficients(free);
        let inverse = self.mass(&coefficients).try_inverse()?;
        let force = &self.rows.y * &coefficients - &self.rows.force;
        let n = self.structure.axes().len();
        let by_window = DMatrix::from_column_slice(n, force.len() / n, force.as_slice());
        let misfit = &inverse * by_window;
        misfit.iter().all(|e| e.is_finite()).then_some((misfit, inverse))
    }

    /// Returns the inverse root mean square residual of each axis.
    fn weights(&self, free: &DVector<f64>) -> Option<Vec<f64>> {
        let (misfit, _) = self.misfit(free)?;
        Some(misfit.row_iter().map(|row| 1.0 / rms(row.iter()).max(f64::MIN_POSITIVE)).collect())
    }

    fn cost(&self, free: &DVector<f64>, weights: &[f64]) -> f64 {
        let Some((misfit, _)) = self.misfit(free) else { return f64::INFINITY };
        let rows = misfit.row_iter().zip(weights);
        rows.map(|(row, w)| 0.5 * w * w * row.norm_squared()).sum()
    }

    /// Computes gradient and Gauss–Newton matrix by the free parameters, and the cost.
    fn slope(
        &self,
        free: &DVector<f64>,
        weights: &[f64],
    ) -> Option<(DVector<f64>, DMatrix<f64>, f64)> {
        let (misfit, inverse) = self.misfit(free)?;
        let (n, terms) = (self.structure.axes().len(), self.structure.terms());
        let by_free = self.physical.jacobian(free);
        let (mut gradient, mut hessian) =
            (DVector::zeros(terms.len()), DMatrix::zeros(terms.len(), terms.len()));
        let mut cost = 0.0;
        for (k, e) in misfit.column_iter().enumerate() {
            let mut by = self.rows.y.rows(k * n, n).into_owned();
            for (term, mut column) in terms.iter().zip(by.column_iter_mut()) {
                // ∂(M⁻¹ r) = M⁻¹ (∂r − ∂M e).
                let Basis::Mass(a, b) = term else { continue };
                let place = |dof| self.structure.axes().iter().position(|own| *own == dof);
                let (Some(a), Some(b)) = (place(*a), place(*b)) else { continue };
                column[a] -= e[b];
                if a != b {
                    column[b] -= e[a];
                }
            }
            let mut by = &inverse * by * &by_free;
            let mut e = e.into_owned();
            for (axis, w) in weights.iter().enumerate() {
                by.row_mut(axis).scale_mut(*w);
                e[axis] *= w;
            }
            gradient += by.transpose() * &e;
            hessian += by.transpose() * &by;
            cost += 0.5 * e.norm_squared();
        }
        Some((gradient, hessian, cost))
    }

    /// Finds a step that reduces the cost; returns the new parameters and their cost, `None` if
    /// there is none.
    fn step(
        &self,
        free: &DVector<f64>,
        weights: &[f64],
        (gradient, hessian, cost): (&DVector<f64>, &DMatrix<f64>, f64),
        damping: &mut f64,
    ) -> Option<(DVector<f64>, f64)> {
        let lowest = self.physical.lowest().into_iter();
        let limits: Vec<(f64, f64)> =
            lowest.map(|low| (low.unwrap_or(f64::NEG_INFINITY), f64::INFINITY)).collect();
        let parabola = Parabola::new((gradient, hessian), (free, &limits), |_| false);
        while *damping < MOST_DAMPING {
            if let Some(step) = parabola.step(*damping) {
                let moved =
                    DVector::from_fn(free.len(), |k, _| (free[k] + step[k]).max(limits[k].0));
                let there = self.cost(&moved, weights);
                if there < cost {
                    *damping /= DAMPING_FACTOR;
                    return Some((moved, there));
                }
            }
            *damping *= DAMPING_FACTOR;
        }
        None
    }
}
