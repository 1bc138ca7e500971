//! Recursive least squares on the equation of motion, with equally filtered terms.

use nalgebra::Vector6;

use super::factor::{Factor, dot};
use super::instruments::Instruments;
use super::noise::ResidualStatistics;
use super::possible::Possible;
use super::step::Step;

/// Ridge added to the information at unit diagonal: coefficients that are not determined stay near
/// zero.
const RIDGE: f64 = 1e-9;

/// Maximum averaging time of residuals, s.
const RESIDUAL_S: f64 = 60.0;

/// Lower limit of the residual's variance on an axis, as a fraction of the mean square of its
/// terms.
const LEAST_VARIANCE: f64 = 1e-9;

/// Lag at which the residual's autocorrelation is measured, in time constants of the filter.
const COLOUR_LAGS: f64 = 3.0;

/// A sample with less than this fraction of the mean power is at rest.
const REST_PART: f64 = 0.01;

/// Maximum fraction of the explained power that may be due to noise.
const MOST_NOISE: f64 = 0.9;

/// Maximum such lag, samples.
const MOST_LAGS: usize = 256;

/// One axis: its information matrix Σ φ φᵀ and vector Σ φ y, over the terms that act on it.
struct Axis {
    index: usize,
    terms: Vec<usize>,
    information: Vec<f64>,
    vector: Vec<f64>,
    /// Contributions of noise to both: Σ (φ − z) φᵀ and Σ (φ − z) y, z being the regressors of the
    /// simulated motion.
    excess: Vec<f64>,
    excess_vector: Vec<f64>,
    row: Vec<f64>,
    instrument: Vec<f64>,
    along: Vec<f64>,
    residual: f64,
    /// Mean squares of residual and terms.
    variance: f64,
    size: f64,
    past: Vec<f64>,
    product: f64,
}

/// Recursive least squares with directional forgetting.
///
/// Each column of the equation, including force, passes `1/(1 + s/ω)²`. Information is forgotten
/// only in the direction that a sample determines, so that nothing is forgotten at rest.
///
/// Contributions of noise to the products of regressors are removed: with z the regressors of the
/// simulated motion, θ solves `Σ z φᵀ θ = Σ z y`, by one iteration of
/// `Σ φ φᵀ θ ← Σ z y + Σ (φ − z) φᵀ θ` per sample.
///
/// # Source
/// [Cao2000]: directional forgetting of the information matrix; [Young2011]: instruments.
pub(super) struct Recursive {
    cutoff_rad_s: f64,
    memory_s: f64,
    filtered: [Vec<Vector6<f64>>; 2],
    force: [Vector6<f64>; 2],
    axes: Vec<Axis>,
    sum: Vec<f64>,
    factor: Factor,
    theta: Vec<f64>,
    before: Vec<f64>,
    instruments: Instruments,
    /// Values of held coefficients.
    held: Vec<Option<f64>>,
    elapsed_s: f64,
    samples: usize,
}

impl Recursive {
    pub(super) fn new(
        step: &Step,
        terms_by_axis: &[Vec<usize>; 6],
        held: Vec<Option<f64>>,
        (cutoff_hz, memory_s): (f64, f64),
    ) -> Self {
        let p = step.count();
        let axes = (0..6).filter(|i| step.own()[*i]).map(|index| Axis {
            index,
            terms: terms_by_axis[index].clone(),
            information: vec![0.0; terms_by_axis[index].len().pow(2)],
            vector: vec![0.0; terms_by_axis[index].len()],
            excess: vec![0.0; terms_by_axis[index].len().pow(2)],
            excess_vector: vec![0.0; terms_by_axis[index].len()],
            row: vec![0.0; terms_by_axis[index].len()],
            instrument: vec![0.0; terms_by_axis[index].len()],
            along: vec![0.0; terms_by_axis[index].len()],
            residual: 0.0,
            variance: 0.0,
            size: 0.0,
            past: Vec::with_capacity(MOST_LAGS),
            product: 0.0,
        });
        Self {
            cutoff_rad_s: std::f64::consts::TAU * cutoff_hz,
            memory_s,
            filtered: [vec![Vector6::zeros(); p], vec![Vector6::zeros(); p]],
            force: [Vector6::zeros(); 2],
            axes: axes.collect(),
            sum: vec![0.0; p * p],
            factor: Factor::new(p),
            theta: held.iter().map(|held| held.unwrap_or(0.0)).collect(),
            before: vec![0.0; p],
            instruments: Instruments::new(step),
            held,
            elapsed_s: 0.0,
            samples: 0,
        }
    }

    /// Restarts after a gap with empty filters on both sides of the equation.
    pub(super) fn restart(&mut self) {
        self.filtered.iter_mut().flatten().for_each(|column| *column = Vector6::zeros());
        self.force = [Vector6::zeros(); 2];
        self.axes.iter_mut().for_each(|axis| axis.past.clear());
        self.instruments.restart();
    }

    /// Processes a step; [`Self::rows`] then returns its residuals before the update. The motion is
    /// simulated once the coefficients form a plant.
    pub(super) fn update(&mut self, step: &Step, possible: &Possible, simulates: bool) {
        let part = self.filter(step);
        if simulates {
            let measured = (part, &self.filtered);
            self.instruments.update(step, &self.theta, possible, measured);
        }
        let h = step.length_s;
        self.elapsed_s += h;
        self.samples += 1;
        let weight = (h / self.elapsed_s.min(RESIDUAL_S)).min(1.0);
        let keep = if self.memory_s.is_finite() { (-h / self.memory_s).exp() } else { 1.0 };
        // Number of samples in the information.
        let held = (self.elapsed_s.min(self.memory_s) / h).max(1.0);
        let lag = ((COLOUR_LAGS / (self.cutoff_rad_s * h)).ceil() as usize).clamp(1, MOST_LAGS);
        for axis in &mut self.axes {
            let instruments = if simulates { &self.instruments.filtered } else { &self.filtered };
            for (a, k) in axis.terms.iter().enumerate() {
                axis.row[a] = self.filtered[1][*k][axis.index];
                axis.instrument[a] = instruments[1][*k][axis.index];
            }
            let y = self.force[1][axis.index];
            axis.update_residual(&self.theta, y, weight, lag);
            let forgets = keep < 1.0 && !axis.is_at_rest(held);
            axis.take(y, if forgets { keep } else { 1.0 });
        }
        self.solve();
    }

    fn filter(&mut self, step: &Step) -> f64 {
        let part = 1.0 - (-self.cutoff_rad_s * step.length_s).exp();
        let [first, second] = &mut self.filtered;
        for (k, (first, second)) in first.iter_mut().zip(second).enumerate() {
            *first += (step.column(k, &step.acceleration) - *first) * part;
            *second += (*first - *second) * part;
        }
        self.force[0] += (step.force - self.force[0]) * part;
        self.force[1] += (self.force[0] - self.force[1]) * part;
        part
    }

    /// Solves for θ with the information of all axes, weighted by their residuals; if the
    /// instruments contribute almost nothing, they are ignored and restarted.
    fn solve(&mut self) {
        self.before.copy_from_slice(&self.theta);
        if self.step_to_solution() {
            return;
        }
        for axis in &mut self.axes {
            axis.excess.iter_mut().chain(&mut axis.excess_vector).for_each(|x| *x = 0.0);
        }
        self.instruments.restart();
        self.before.fill(0.0);
        self.step_to_solution();
    }

    /// Makes one step of the iteration; returns true if it converges.
    fn step_to_solution(&mut self) -> bool {
        let p = self.theta.len();
        let (mut power, mut noise) = (0.0, 0.0);
        self.sum.fill(0.0);
        self.theta.fill(0.0);
        for axis in self.axes.iter_mut().filter(|axis| axis.is_scaled()) {
            let weight = 1.0 / axis.floored();
            let Axis { terms, information, vector, excess, excess_vector, along, .. } = axis;
            let (n, before) = (terms.len(), along);
            before.iter_mut().zip(terms.iter()).for_each(|(x, k)| *x = self.before[*k]);
            let rows = information.chunks_exact(n).zip(excess.chunks_exact(n));
            for (a, (own, excess)) in rows.enumerate() {
                let i = terms[a];
                let added = dot(excess, before);
                self.theta[i] += weight * (vector[a] - excess_vector[a] + added);
                noise += weight * before[a] * added;
                power += weight * before[a] * dot(own, before);
                // Only the lower triangle is used.
                let sum = &mut self.sum[i * p..(i + 1) * p];
                terms[..=a].iter().zip(own).for_each(|(j, own)| sum[*j] += weight * own);
            }
        }
        for k in 0..p {
            let Some(value) = self.held[k] else { continue };
            for i in 0..p {
                self.theta[i] -= self.sum[i.max(k) * p + i.min(k)] * value;
            }
            clear(&mut self.sum, p, k);
        }
        self.factor.set(&self.sum, RIDGE);
        self.factor.solve(&mut self.theta);
        for (theta, held) in self.theta.iter_mut().zip(&self.held) {
            *theta = held.unwrap_or(*theta);
        }
        let is_less = noise == 0.0 || noise.abs() < MOST_NOISE * power;
        is_less && self.theta.iter().all(|theta| theta.is_finite())
    }

    /// Returns the standard deviation of a coefficient for white residuals; `scratch` has shape
    /// (p,).
    pub(super) fn white_std(&self, k: usize, scratch: &mut [f64]) -> f64 {
        if self.held[k].is_some() {
            return 0.0;
        }
        scratch.fill(0.0);
        scratch[k] = 1.0;
        self.factor.solve(scratch);
        // A coefficient without information has an infinite standard deviation.
        if scratch[k] > 0.0 { scratch[k].sqrt() } else { f64::INFINITY }
    }

    /// Returns the values of held coefficients.
    pub(super) fn held(&self) -> &[Option<f64>] {
        &self.held
    }

    /// Keeps a fraction of the information.
    pub(super) fn forget(&mut self, keep: f64) {
        for axis in &mut self.axes {
            let all = axis.information.iter_mut().chain(&mut axis.vector);
            all.chain(&mut axis.excess).chain(&mut axis.excess_vector).for_each(|x| *x *= keep);
        }
    }

    /// Returns the coefficients.
    pub(super) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Returns, for each axis, its terms, their filtered regressors, the residual and its variance.
    pub(super) fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.axes.iter().map(|axis| Row {
            axis: axis.index,
            terms: &axis.terms,
            regressors: &axis.row,
            residual: axis.residual,
            variance: axis.floored(),
        })
    }

    /// Returns the residual statistics of each axis that has a residual.
    pub(super) fn residual_statistics(
        &self,
        step_s: f64,
    ) -> impl Iterator<Item = ResidualStatistics> {
        let scaled = self.axes.iter().filter(|axis| axis.is_scaled());
        scaled.map(move |axis| ResidualStatistics {
            axis: axis.index,
            variance: axis.floored(),
            product: axis.product,
            lag_s: axis.past.len().max(1) as f64 * step_s,
        })
    }

    /// Returns the information of all axes, row by row, reduced for the autocorrelation of
    /// residuals, shape (p, p); zero for held coefficients.
    pub(super) fn information(&self) -> Vec<f64> {
        let p = self.theta.len();
        let mut sum = vec![0.0; p * p];
        for axis in self.axes.iter().filter(|axis| axis.is_scaled()) {
            let weight = 1.0 / (axis.floored() * axis.colour());
            let n = axis.terms.len();
            for (a, &i) in axis.terms.iter().enumerate() {
                for (b, &j) in axis.terms.iter().enumerate() {
                    let excess = 0.5 * (axis.excess[a * n + b] + axis.excess[b * n + a]);
                    sum[i * p + j] += weight * (axis.information[a * n + b] - excess);
                }
            }
        }
        for k in (0..p).filter(|k| self.held[*k].is_some()) {
            clear(&mut sum, p, k);
        }
        sum
    }

    /// Returns the effective number of independent samples, by the axis with the least
    /// autocorrelation.
    pub(super) fn independent_samples(&self) -> f64 {
        let colour = self.axes.iter().map(Axis::colour).fold(f64::INFINITY, f64::min);
        self.samples as f64 / colour.max(1.0)
    }

    /// Returns the number of steps.
    pub(super) fn samples(&self) -> usize {
        self.samples
    }
}

/// Sets a row and its column of a matrix to zero.
fn clear(matrix: &mut [f64], p: usize, k: usize) {
    for i in 0..p {
        matrix[i * p + k] = 0.0;
        matrix[k * p + i] = 0.0;
    }
}

/// Regression row of one sample on one axis.
pub(super) struct Row<'a> {
    pub(super) axis: usize,
    pub(super) terms: &'a [usize],
    pub(super) regressors: &'a [f64],
    pub(super) residual: f64,
    pub(super) variance: f64,
}

impl Axis {
    /// Updates the residual and its statistics.
    fn update_residual(&mut self, theta: &[f64], y: f64, weight: f64, lag: usize) {
        let terms = self.row.iter().zip(&self.terms).map(|(x, k)| x * theta[*k]);
        let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), x| (sum + x, size + x.abs()));
        self.residual = y - sum;
        self.variance += weight * (self.residual * self.residual - self.variance);
        self.size += weight * ((size + y.abs()).powi(2) - self.size);
        if self.past.len() >= lag {
            // The oldest residual is at the lag.
            let product = self.past[0] * self.residual;
            self.product += weight * (product - self.product);
            self.past.remove(0);
        }
        self.past.push(self.residual);
    }

    /// Returns true if a force is known on the axis, including Coriolis forces of another axis's
    /// mass. Until then zero coefficients fit exactly, and the axis carries no information.
    fn is_scaled(&self) -> bool {
        self.size > 0.0
    }

    fn floored(&self) -> f64 {
        self.variance.max(LEAST_VARIANCE * self.size).max(f64::MIN_POSITIVE)
    }

    /// Returns how many samples are worth one independent sample.
    fn colour(&self) -> f64 {
        let rho = (self.product / self.floored()).clamp(0.0, 0.95);
        self.past.len().max(1) as f64 * (1.0 + rho) / (1.0 - rho)
    }

    /// Returns true if the row adds almost no information to that of `held` samples.
    fn is_at_rest(&self, held: f64) -> bool {
        let n = self.row.len();
        let part = |(k, phi): (usize, &f64)| {
            let own = self.information[k * (n + 1)];
            if own > 0.0 { held * phi * phi / own } else { 1.0 }
        };
        let power: f64 = self.row.iter().enumerate().map(part).sum();
        power < REST_PART * n as f64
    }

    /// Adds the row to the information, after forgetting in its direction.
    fn take(&mut self, y: f64, keep: f64) {
        if keep < 1.0 {
            self.forget_along(keep);
        }
        let n = self.row.len();
        let rows = self.information.chunks_exact_mut(n).zip(self.excess.chunks_exact_mut(n));
        for (a, (information, excess)) in rows.enumerate() {
            let (phi, noise) = (self.row[a], self.row[a] - self.instrument[a]);
            self.vector[a] += phi * y;
            self.excess_vector[a] = keep * self.excess_vector[a] + noise * y;
            information.iter_mut().zip(&self.row).for_each(|(x, other)| *x += phi * other);
            excess.iter_mut().zip(&self.row).for_each(|(x, other)| *x = keep * *x + noise * other);
        }
    }

    /// Reduces the information in the direction of the row.
    fn forget_along(&mut self, keep: f64) {
        let n = self.row.len();
        for (along, row) in self.along.iter_mut().zip(self.information.chunks_exact(n)) {
            *along = dot(row, &self.row);
        }
        let (power, projection) = (dot(&self.along, &self.row), dot(&self.vector, &self.row));
        if power <= f64::MIN_POSITIVE {
            return;
        }
        let part = (1.0 - keep) / power;
        let rows = self.information.chunks_exact_mut(n).zip(&mut self.vector);
        for ((information, vector), along) in rows.zip(&self.along) {
            *vector -= part * along * projection;
            let by = part * along;
            information.iter_mut().zip(&self.along).for_each(|(x, other)| *x -= by * other);
        }
    }
}
