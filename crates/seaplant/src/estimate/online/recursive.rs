//! Recursive least squares on the equation of motion, every term filtered alike.

use nalgebra::Vector6;

use super::factor::{Factor, dot};
use super::instruments::Instruments;
use super::noise::Colour;
use super::possible::Possible;
use super::step::Step;

/// Scaled by its diagonal, information has this added: what nothing tells stays near zero.
const RIDGE: f64 = 1e-9;

/// Residuals are averaged over no more than this, s.
const RESIDUAL_S: f64 = 60.0;

/// The least variance of an axis's residual, as a part of the mean square of its terms.
const LEAST_VARIANCE: f64 = 1e-9;

/// Residuals this many time constants of the filter apart are compared for their colour.
const COLOUR_LAGS: f64 = 3.0;

/// A sample with less than this part of the usual power is one of rest.
const REST_PART: f64 = 0.01;

/// Of the power of what the coefficients explain, noise may have this part.
const MOST_NOISE: f64 = 0.9;

/// The longest such lag, samples.
const MOST_LAGS: usize = 256;

/// One axis: its information matrix Σ φ φᵀ and vector Σ φ y, over the terms that act on it.
struct Axis {
    index: usize,
    terms: Vec<usize>,
    information: Vec<f64>,
    vector: Vec<f64>,
    /// What noise adds to both: Σ (φ − z) φᵀ and Σ (φ − z) y, z the regressors of simulated motion.
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
/// Each column of the equation, force included, passes `1/(1 + s/ω)²`. Information is forgotten
/// only along what a sample determines, so that rest forgets nothing.
///
/// What noise adds to the products of regressors is taken off: with z the regressors of simulated
/// motion, θ solves `Σ z φᵀ θ = Σ z y`, by one step of `Σ φ φᵀ θ ← Σ z y + Σ (φ − z) φᵀ θ` a sample.
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
    /// The coefficients that are known.
    held: Vec<Option<f64>>,
    elapsed_s: f64,
    samples: usize,
}

impl Recursive {
    pub(super) fn new(
        step: &Step,
        touched: &[Vec<usize>; 6],
        held: Vec<Option<f64>>,
        (cutoff_hz, memory_s): (f64, f64),
    ) -> Self {
        let p = step.count();
        let axes = (0..6).filter(|i| step.own()[*i]).map(|index| Axis {
            index,
            terms: touched[index].clone(),
            information: vec![0.0; touched[index].len().pow(2)],
            vector: vec![0.0; touched[index].len()],
            excess: vec![0.0; touched[index].len().pow(2)],
            excess_vector: vec![0.0; touched[index].len()],
            row: vec![0.0; touched[index].len()],
            instrument: vec![0.0; touched[index].len()],
            along: vec![0.0; touched[index].len()],
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
            factor: Factor::of(p),
            theta: held.iter().map(|held| held.unwrap_or(0.0)).collect(),
            before: vec![0.0; p],
            instruments: Instruments::of(step),
            held,
            elapsed_s: 0.0,
            samples: 0,
        }
    }

    /// Begins anew after a gap: filters are empty, on both sides of the equation alike.
    pub(super) fn restart(&mut self) {
        self.filtered.iter_mut().flatten().for_each(|column| *column = Vector6::zeros());
        self.force = [Vector6::zeros(); 2];
        self.axes.iter_mut().for_each(|axis| axis.past.clear());
        self.instruments.restart();
    }

    /// Takes a step in; the residuals of it, before it, are then [`Self::rows`]. Motion is
    /// simulated once the coefficients make a plant.
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
        // Information holds that of so many samples.
        let held = (self.elapsed_s.min(self.memory_s) / h).max(1.0);
        let lag = ((COLOUR_LAGS / (self.cutoff_rad_s * h)).ceil() as usize).clamp(1, MOST_LAGS);
        for axis in &mut self.axes {
            let instruments = if simulates { &self.instruments.filtered } else { &self.filtered };
            for (a, k) in axis.terms.iter().enumerate() {
                axis.row[a] = self.filtered[1][*k][axis.index];
                axis.instrument[a] = instruments[1][*k][axis.index];
            }
            let y = self.force[1][axis.index];
            axis.weigh(&self.theta, y, weight, lag);
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

    /// θ of the information of all axes, each weighted by its residual; instruments that tell next
    /// to nothing are left, and begin anew.
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

    /// A step of the iteration; whether it is one that converges.
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
                // The lower half is all that is read.
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

    /// The standard deviation of a coefficient if residuals were white; `scratch` has shape (p,).
    pub(super) fn white_std(&self, k: usize, scratch: &mut [f64]) -> f64 {
        if self.held[k].is_some() {
            return 0.0;
        }
        scratch.fill(0.0);
        scratch[k] = 1.0;
        self.factor.solve(scratch);
        // What nothing told yet has no information to invert.
        if scratch[k] > 0.0 { scratch[k].sqrt() } else { f64::INFINITY }
    }

    /// What each coefficient is held at, if it is.
    pub(super) fn held(&self) -> &[Option<f64>] {
        &self.held
    }

    /// Keeps so much of what was learnt only.
    pub(super) fn forget(&mut self, keep: f64) {
        for axis in &mut self.axes {
            let all = axis.information.iter_mut().chain(&mut axis.vector);
            all.chain(&mut axis.excess).chain(&mut axis.excess_vector).for_each(|x| *x *= keep);
        }
    }

    /// The coefficients.
    pub(super) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Of each axis: the terms that act on it, their filtered regressors, the residual and its
    /// variance.
    pub(super) fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.axes.iter().map(|axis| Row {
            axis: axis.index,
            terms: &axis.terms,
            regressors: &axis.row,
            residual: axis.residual,
            variance: axis.floored(),
        })
    }

    /// What the residual of each axis says of noise; of axes whose residual is not known yet,
    /// nothing.
    pub(super) fn colours(&self, step_s: f64) -> impl Iterator<Item = Colour> {
        let scaled = self.axes.iter().filter(|axis| axis.is_scaled());
        scaled.map(move |axis| Colour {
            axis: axis.index,
            variance: axis.floored(),
            product: axis.product,
            lag_s: axis.past.len().max(1) as f64 * step_s,
        })
    }

    /// The information of all axes, row by row, less for the colour of residuals; shape (p, p).
    /// Coefficients that are held have none.
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

    /// Samples that would say as much if they were independent, of the axis with least colour.
    pub(super) fn independent_samples(&self) -> f64 {
        let colour = self.axes.iter().map(Axis::colour).fold(f64::INFINITY, f64::min);
        self.samples as f64 / colour.max(1.0)
    }

    /// Steps taken.
    pub(super) fn samples(&self) -> usize {
        self.samples
    }
}

/// Leaves a row and its column of a matrix, row by row, without anything in them.
fn clear(matrix: &mut [f64], p: usize, k: usize) {
    for i in 0..p {
        matrix[i * p + k] = 0.0;
        matrix[k * p + i] = 0.0;
    }
}

/// What one sample says of one axis.
pub(super) struct Row<'a> {
    pub(super) axis: usize,
    pub(super) terms: &'a [usize],
    pub(super) regressors: &'a [f64],
    pub(super) residual: f64,
    pub(super) variance: f64,
}

impl Axis {
    /// The residual of a sample, and what it says of the noise.
    fn weigh(&mut self, theta: &[f64], y: f64, weight: f64, lag: usize) {
        let terms = self.row.iter().zip(&self.terms).map(|(x, k)| x * theta[*k]);
        let (sum, size) = terms.fold((0.0, 0.0), |(sum, size), x| (sum + x, size + x.abs()));
        self.residual = y - sum;
        self.variance += weight * (self.residual * self.residual - self.variance);
        self.size += weight * ((size + y.abs()).powi(2) - self.size);
        if self.past.len() >= lag {
            // The oldest is as far back as the lag.
            let product = self.past[0] * self.residual;
            self.product += weight * (product - self.product);
            self.past.remove(0);
        }
        self.past.push(self.residual);
    }

    /// Whether a force is known on the axis, be it a Coriolis force of another's mass: until then
    /// coefficients of zero fit exactly, and the axis says nothing.
    fn is_scaled(&self) -> bool {
        self.size > 0.0
    }

    fn floored(&self) -> f64 {
        self.variance.max(LEAST_VARIANCE * self.size).max(f64::MIN_POSITIVE)
    }

    /// How many samples say as much as one that is independent.
    fn colour(&self) -> f64 {
        let rho = (self.product / self.floored()).clamp(0.0, 0.95);
        self.past.len().max(1) as f64 * (1.0 + rho) / (1.0 - rho)
    }

    /// Whether the row says next to nothing beside what is held of so many samples.
    fn is_at_rest(&self, held: f64) -> bool {
        let n = self.row.len();
        let part = |(k, phi): (usize, &f64)| {
            let own = self.information[k * (n + 1)];
            if own > 0.0 { held * phi * phi / own } else { 1.0 }
        };
        let power: f64 = self.row.iter().enumerate().map(part).sum();
        power < REST_PART * n as f64
    }

    /// Adds the row to the information, after forgetting along it.
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

    /// Forgets what the row says of the coefficients.
    fn forget_along(&mut self, keep: f64) {
        let n = self.row.len();
        for (along, row) in self.along.iter_mut().zip(self.information.chunks_exact(n)) {
            *along = dot(row, &self.row);
        }
        let (power, told) = (dot(&self.along, &self.row), dot(&self.vector, &self.row));
        if power <= f64::MIN_POSITIVE {
            return;
        }
        let part = (1.0 - keep) / power;
        let rows = self.information.chunks_exact_mut(n).zip(&mut self.vector);
        for ((information, vector), along) in rows.zip(&self.along) {
            *vector -= part * along * told;
            let by = part * along;
            information.iter_mut().zip(&self.along).for_each(|(x, other)| *x -= by * other);
        }
    }
}
