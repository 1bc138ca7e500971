//! Equation error estimation of a plant: least squares on the equation of motion, without
//! accelerations.

mod accelerations;

use nalgebra::{DMatrix, DVector, Vector6};

use crate::motion::{Load, down_body, interpolated_attitude};
use crate::plant::{Instant, Physical, Structure, kirchhoff};
use crate::signal::rms;
use crate::{Dof, Error, Grid, TrialRecord};

/// Result of least squares on the equation of motion.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Solved {
    /// One coefficient per term; zero for those that the motion does not determine.
    pub(super) coefficients: DVector<f64>,
    /// Root mean square residual on each axis of the structure, N or N m.
    pub(super) residual: Vec<f64>,
    /// Number of combinations of coefficients that the motion determines.
    pub(super) rank: usize,
    /// Number of coefficients.
    pub(super) terms: usize,
}

/// Singular values below this fraction of the greatest are treated as zero; columns are scaled.
const RANK_PART: f64 = 1e-7;

/// Number of passes; each weights the axes by the residuals of the previous one.
const PASSES: usize = 3;

/// Ratio of a window's length to the interval between windows: they overlap by half, as their test
/// functions are zero at both ends.
const OVERLAP: usize = 2;

/// Solves least squares on forces and, where needed, on accelerations; returns the solutions that
/// exist.
///
/// On an axis without a known force the equation is `0 = Σ θ_k Y_k`, which θ = 0 satisfies best; as
/// acceleration, `0 = M⁻¹ Σ θ_k Y_k`, it excludes that solution.
///
/// # Errors
/// As [`fit`].
pub(super) fn fits(
    structure: &Structure,
    physical: &Physical,
    records: &[&TrialRecord],
    window_s: f64,
) -> Result<Vec<Solved>, Error> {
    let by_force = fit(structure, records, window_s)?;
    let is_driven = |dof: &Dof| records.iter().any(|record| record.is_driven(*dof));
    if structure.axes().iter().all(is_driven) {
        return Ok(vec![by_force]);
    }
    let rows = rows(structure, records, window_s)?;
    let by_acceleration = accelerations::descent(structure, physical, &rows, &by_force);
    Ok(by_acceleration.into_iter().chain([by_force]).collect())
}

/// Rows of the equation of motion, integrated with test functions: one for each axis and window.
///
/// With φ(t) zero at both ends of a window, `∫ φ M ν̇ dt = −∫ φ̇ M ν dt`: no signal has to be
/// differentiated.
struct Rows {
    y: DMatrix<f64>,
    force: DVector<f64>,
}

/// Fits a structure with test functions of a given length, s.
///
/// Assumes no current. Axes are weighted by the inverse of their residual.
///
/// # Errors
/// [`Error::TooShort`] if no trial is as long as one window.
fn fit(structure: &Structure, records: &[&TrialRecord], window_s: f64) -> Result<Solved, Error> {
    let mut rows = rows(structure, records, window_s)?;
    let terms = structure.terms().iter().enumerate();
    let held: Vec<(usize, f64)> =
        terms.filter_map(|(k, term)| Some((k, structure.held(term)?))).collect();
    for &(k, value) in &held {
        rows.force -= rows.y.column(k) * value;
        rows.y.column_mut(k).fill(0.0);
    }
    let n = structure.axes().len();
    let mut weights = vec![1.0; n];
    let mut found = None;
    for _ in 0..PASSES {
        let solved = solve(&rows, &weights);
        let misfit = &rows.y * &solved.coefficients - &rows.force;
        let residual: Vec<f64> =
            (0..n).map(|axis| rms(misfit.iter().skip(axis).step_by(n))).collect();
        weights = residual.iter().map(|r| 1.0 / r.max(f64::MIN_POSITIVE)).collect();
        let terms = solved.terms - held.len();
        found = Some(Solved { residual, terms, ..solved });
    }
    if let Some(found) = &mut found {
        held.iter().for_each(|(k, value)| found.coefficients[*k] = *value);
    }
    found.ok_or(Error::TooShort { name: "the fit".to_owned(), found: 0, needed: 1 })
}

fn solve(rows: &Rows, weights: &[f64]) -> Solved {
    let n = weights.len();
    let mut y = rows.y.clone();
    let mut force = rows.force.clone();
    for (k, weight) in (0..y.nrows()).map(|k| (k, weights[k % n])) {
        y.row_mut(k).scale_mut(weight);
        force[k] *= weight;
    }
    let scale: Vec<f64> =
        y.column_iter().map(|column| column.norm().max(f64::MIN_POSITIVE)).collect();
    for (mut column, scale) in y.column_iter_mut().zip(&scale) {
        column /= *scale;
    }
    let normal = y.transpose() * &y;
    let right = y.transpose() * force;
    let eigen = normal.symmetric_eigen();
    let greatest = eigen.eigenvalues.max();
    let floor = greatest * RANK_PART * RANK_PART.sqrt();
    let mut coefficients = DVector::zeros(scale.len());
    let mut rank = 0;
    for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > floor {
            rank += 1;
            coefficients += vector * (vector.dot(&right) / value);
        }
    }
    for (x, scale) in coefficients.iter_mut().zip(&scale) {
        *x /= *scale;
    }
    Solved { coefficients, residual: Vec::new(), rank, terms: scale.len() }
}

fn rows(structure: &Structure, records: &[&TrialRecord], window_s: f64) -> Result<Rows, Error> {
    let (n, p) = (structure.axes().len(), structure.terms().len());
    let (mut y, mut force) = (Vec::new(), Vec::new());
    for record in records {
        let sampled = Sampled::new(record, structure);
        let length = (window_s / sampled.grid.period_s).round().max(4.0) as usize;
        for first in (0..sampled.grid.len.saturating_sub(length)).step_by((length / OVERLAP).max(1))
        {
            let (columns, pushed) = sampled.window(structure, first, length);
            for axis in 0..n {
                y.extend((0..p).map(|k| columns[k][structure.axes()[axis].index()]));
                force.push(pushed[structure.axes()[axis].index()]);
            }
        }
    }
    if force.len() < p {
        return Err(Error::TooShort {
            name: format!("the trials of {} together", structure.name()),
            found: force.len() / n,
            needed: p.div_ceil(n),
        });
    }
    Ok(Rows { y: DMatrix::from_row_slice(force.len(), p, &y), force: force.into() })
}

/// A record resampled to a uniform grid.
struct Sampled {
    grid: Grid,
    velocity: Vec<Vector6<f64>>,
    force: Vec<Vector6<f64>>,
    down: Vec<nalgebra::Vector3<f64>>,
    signals: Vec<Vec<f64>>,
}

/// Computes the wrench of known forces minus that of their inertia; accelerations are central
/// differences, as the mass changes within windows.
fn load_wrench(
    load: &Load,
    velocity: &[Vector6<f64>],
    (k, period_s): (usize, f64),
    down: &nalgebra::Vector3<f64>,
) -> Vector6<f64> {
    let (before, after) = (k.saturating_sub(1), (k + 1).min(velocity.len() - 1));
    let span_s = (after - before).max(1) as f64 * period_s;
    let acceleration = (velocity[after] - velocity[before]) / span_s;
    let now = &velocity[k];
    load.wrench(down) - load.mass * acceleration - kirchhoff(&(load.mass * now), now)
}

/// Limits of the grid's period, s.
const PERIOD_S: std::ops::RangeInclusive<f64> = 0.02..=1.0;

impl Sampled {
    fn new(record: &TrialRecord, structure: &Structure) -> Self {
        let series =
            structure.axes().iter().filter_map(|dof| record.velocity[dof.index()].as_ref());
        let period_s = series.map(|series| series.period_s()).fold(f64::INFINITY, f64::min);
        let period_s = period_s.clamp(*PERIOD_S.start(), *PERIOD_S.end());
        let grid = Grid::spanning(record.window_s.0, record.window_s.1, period_s);
        let columns = |series: &[Option<crate::Timed>; 6], means: bool| {
            let of =
                |x: &crate::Timed| if means { x.held_means(grid) } else { x.interpolate(grid) };
            let columns: Vec<Vec<f64>> =
                series.iter().map(|x| x.as_ref().map_or_else(|| vec![0.0; grid.len], of)).collect();
            (0..grid.len).map(|k| Vector6::from_fn(|i, _| columns[i][k])).collect()
        };
        let [roll, pitch, _] = record.attitude.each_ref();
        let down = |t: f64| {
            down_body(
                interpolated_attitude(roll.as_ref(), t),
                interpolated_attitude(pitch.as_ref(), t),
            )
        };
        let velocity = columns(&record.velocity, false);
        let down: Vec<nalgebra::Vector3<f64>> = grid.times().map(down).collect();
        let mut force: Vec<Vector6<f64>> = columns(&record.force, true);
        for (k, t) in grid.times().enumerate() {
            if let Some(load) = Load::at(&record.known, t) {
                force[k] += load_wrench(&load, &velocity, (k, grid.period_s), &down[k]);
            }
        }
        Self {
            grid,
            velocity,
            force,
            down,
            signals: grid.times().map(|t| record.signals_at(structure.signals(), t)).collect(),
        }
    }

    /// Computes `∫ φ Y_k dt` of each term and `∫ φ τ dt`, with `∫ φ dt = 1`.
    fn window(
        &self,
        structure: &Structure,
        first: usize,
        length: usize,
    ) -> (Vec<Vector6<f64>>, Vector6<f64>) {
        let mut columns = vec![Vector6::zeros(); structure.terms().len()];
        let mut force = Vector6::zeros();
        let width = length as f64;
        for k in 0..=length {
            // φ = sin⁴(π x), normalised to a mean of one.
            let (sin, cos) = (std::f64::consts::PI * k as f64 / width).sin_cos();
            let phi = sin.powi(4) / (0.375 * width);
            let slope = 4.0 * sin.powi(3) * cos * std::f64::consts::PI
                / (0.375 * width * width * self.grid.period_s);
            let velocity = self.velocity[first + k];
            let signals = &self.signals[first + k];
            let moving = Instant {
                acceleration: Vector6::zeros(),
                velocity,
                down_body: self.down[first + k],
            };
            // The regressor is linear in acceleration: −φ̇ ν replaces φ ν̇.
            let turned = Instant {
                acceleration: -slope * velocity,
                velocity: Vector6::zeros(),
                down_body: moving.down_body,
            };
            for (column, term) in columns.iter_mut().zip(structure.terms()) {
                *column += phi * structure.regressor(term, &moving, signals);
                if matches!(term, crate::plant::Basis::Mass(..)) {
                    *column += term.regressor(&turned);
                }
            }
            force += phi * self.force[first + k];
        }
        (columns, force)
    }
}
