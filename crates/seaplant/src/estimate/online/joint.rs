//! Joint extended Kalman filter of motion, disturbance and coefficients.

use std::sync::Arc;

use nalgebra::{SVector, Vector6};

use super::noise::JointNoise;
use super::possible::Possible;
use super::step::Step;
use crate::Error;
use crate::motion::{Decay, Flow, HeldForces, Prepared, Slice, advance};
use crate::plant::Plant;

/// Maximum length of a slice of a step, s.
const SLICE_S: f64 = 0.1;

/// Maximum number of slices per step.
const MOST_SLICES: usize = 64;

/// Number of rows of ν and f, which precede those of θ.
const MOTION: usize = 12;

/// Kalman filter of the filter error method with the coefficients as slow states:
///
/// ```text
/// ν̇ = M⁻¹ (τ + f − n(ν, η)),   ḟ = −f/T + w,   θ̇ = w_θ,   y = ν + noise
/// ```
///
/// # Source
/// [Jategaonkar2015, ch. 7].
pub(super) struct Joint {
    plant: Prepared<6>,
    flow: Flow<6, 6>,
    slices: Vec<Slice>,
    pushes: HeldForces,
    theta: Vec<f64>,
    velocity: SVector<f64, 6>,
    disturbance: SVector<f64, 6>,
    /// Covariance with rows of ν (6), f (6) and θ, row by row.
    covariance: Vec<f64>,
    /// Six numbers per row: those of ν in F P, then the correction of a sample.
    top: Vec<[f64; 6]>,
    /// For each measured axis its gain, and the covariance with the measurement.
    gains: [Vec<f64>; 6],
    crossed: [Vec<f64>; 6],
    noise: JointNoise,
    /// Random walk of the coefficients, relative to each, per √s.
    wander: f64,
    /// True for coefficients to be estimated.
    is_free: Vec<bool>,
    is_moving: bool,
}

impl Joint {
    /// Creates a filter from a plant and the variances of its coefficients; those without a
    /// variance stay constant.
    ///
    /// # Errors
    /// [`Error::Plant`] if M is singular.
    pub(super) fn new(
        plant: &Plant,
        variances: &[f64],
        (noise, wander): (JointNoise, f64),
    ) -> Result<Self, Error> {
        let p = plant.coefficients().len();
        let n = MOTION + p;
        let mut covariance = vec![0.0; n * n];
        for (k, variance) in variances.iter().enumerate() {
            covariance[(MOTION + k) * (n + 1)] = *variance;
        }
        Ok(Self {
            plant: Prepared::new(plant)?,
            flow: Flow::of_coefficients(p),
            slices: vec![slice_for(plant.structure().signals().len()); MOST_SLICES],
            pushes: HeldForces::zeros(6, MOST_SLICES),
            theta: plant.coefficients().to_vec(),
            velocity: SVector::zeros(),
            disturbance: SVector::zeros(),
            covariance,
            top: vec![[0.0; 6]; n],
            gains: std::array::from_fn(|_| vec![0.0; n]),
            crossed: std::array::from_fn(|_| vec![0.0; n]),
            noise,
            wander,
            is_free: variances.iter().map(|variance| *variance > 0.0).collect(),
            is_moving: false,
        })
    }

    /// Returns the coefficients.
    pub(super) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Returns the variance of a coefficient.
    pub(super) fn variance(&self, k: usize) -> f64 {
        self.covariance[(MOTION + k) * (self.top.len() + 1)].max(0.0)
    }

    /// Sets the noise.
    pub(super) fn set_noise(&mut self, noise: JointNoise) {
        self.noise = noise;
    }

    /// Restarts after a gap, with unknown motion and disturbance.
    pub(super) fn restart(&mut self) {
        self.is_moving = false;
    }

    /// Adds a standard deviation to each coefficient, relative to its value.
    pub(super) fn reopen(&mut self, part: f64) {
        let n = self.top.len();
        for k in (0..self.theta.len()).filter(|k| self.is_free[*k]) {
            self.covariance[(MOTION + k) * (n + 1)] += (part * self.theta[k]).powi(2);
        }
    }

    /// Processes a step.
    pub(super) fn update(&mut self, step: &Step, possible: &Possible) {
        if !self.is_moving {
            self.begin(&step.velocity[0]);
        }
        self.predict(step);
        self.correct(&step.velocity[2]);
        possible.project(&mut self.theta);
        self.plant.renumber(&self.theta);
    }

    fn begin(&mut self, velocity: &Vector6<f64>) {
        self.velocity = self.plant.on_axes(velocity);
        self.disturbance = SVector::zeros();
        let n = self.top.len();
        for i in 0..MOTION {
            for j in 0..n {
                self.covariance[i * n + j] = 0.0;
                self.covariance[j * n + i] = 0.0;
            }
            let std = if i < 6 { self.noise.velocity[i] } else { self.noise.disturbance[i - 6] };
            self.covariance[i * (n + 1)] = std * std;
        }
        self.is_moving = true;
    }

    /// Divides a step into slices; returns their number.
    fn slice(&mut self, step: &Step) -> usize {
        let count = (step.length_s / SLICE_S).ceil().clamp(1.0, MOST_SLICES as f64) as usize;
        let part = 1.0 / count as f64;
        // Attitude and motion on axes outside the plant are interpolated linearly within a step.
        let at = |x: f64| {
            let down = step.down_body[0] * (1.0 - x) + step.down_body[2] * x;
            (step.velocity[0] * (1.0 - x) + step.velocity[2] * x, down.normalize())
        };
        for (k, slice) in self.slices[..count].iter_mut().enumerate() {
            let places = [0.0, 0.5, 1.0].map(|x| part * (k as f64 + x));
            let nodes = places.map(at);
            slice.from_s = step.length_s * part * k as f64;
            slice.length_s = step.length_s * part;
            let around = Arc::make_mut(&mut slice.around);
            around.down_body = nodes.map(|(_, down)| down);
            around.others = nodes.map(|(velocity, _)| velocity);
            for (signals, x) in slice.signals.iter_mut().zip(places) {
                for (i, signal) in signals.iter_mut().enumerate() {
                    *signal = step.signals[0][i] * (1.0 - x) + step.signals[2][i] * x;
                }
            }
        }
        count
    }

    fn predict(&mut self, step: &Step) {
        let count = self.slice(step);
        let force = self.plant.on_axes(&step.force);
        let pushes = self.pushes.each_mut().take(count);
        pushes.for_each(|(own, _)| own.copy_from_slice(force.as_slice()));
        let decay = Decay { rate: self.noise.correlation_s.map(f64::recip) };
        let Self { plant, slices, pushes, velocity, disturbance, flow, .. } = self;
        advance(
            plant,
            (&slices[..count], pushes.over(0..count)),
            velocity,
            disturbance,
            &decay,
            flow,
        );
        self.velocity = self.flow.motion;
        let fade = decay.rate.map(|rate| (-rate * step.length_s).exp());
        self.disturbance.component_mul_assign(&fade);
        self.predict_covariance(&fade);
        self.add_noise(step.length_s);
    }

    /// Computes `P ← F P Fᵀ`: F is `[Φ_ν, Φ_f, Φ_θ]` in the rows of ν, the decay in those of f and
    /// the identity in those of θ.
    fn predict_covariance(&mut self, fade: &SVector<f64, 6>) {
        let Self { flow, covariance, top, .. } = self;
        let n = top.len();
        for (top, row) in top.iter_mut().zip(covariance.chunks_exact(n)) {
            *top = weighted(&flow.columns, row);
        }
        let mut own = [[0.0; 6]; 6];
        for (column, top) in flow.columns.iter().zip(top.iter()) {
            for (own, weight) in own.iter_mut().zip(column.iter()) {
                own.iter_mut().zip(top).for_each(|(sum, x)| *sum += weight * x);
            }
        }
        for (i, own) in own.iter().enumerate() {
            covariance[i * n..i * n + 6].copy_from_slice(own);
        }
        for (j, top) in top.iter().enumerate().skip(6) {
            let left = if j < MOTION { fade[j - 6] } else { 1.0 };
            for (i, x) in top.iter().enumerate() {
                covariance[i * n + j] = x * left;
                covariance[j * n + i] = x * left;
            }
        }
        for i in 6..MOTION {
            for j in i..n {
                let left = if j < MOTION { fade[j - 6] } else { 1.0 };
                let x = covariance[i * n + j] * fade[i - 6] * left;
                covariance[i * n + j] = x;
                covariance[j * n + i] = x;
            }
        }
    }

    /// Adds the process noise of a step: exact variances of the disturbance and its integrals, and
    /// the random walk of the coefficients.
    fn add_noise(&mut self, h: f64) {
        let n = self.top.len();
        let inverse = *self.plant.inverse();
        for place in 0..6 {
            let (power, time_s) =
                (self.noise.disturbance[place].powi(2), self.noise.correlation_s[place]);
            let (once, twice) = ((-h / time_s).exp_m1(), (-2.0 * h / time_s).exp_m1());
            let moved = 2.0 * power * time_s * time_s * (h / time_s + 2.0 * once - 0.5 * twice);
            let cross = power * time_s * once * once;
            let column = inverse.column(place);
            for i in 0..6 {
                for j in 0..6 {
                    self.covariance[i * n + j] += column[i] * column[j] * moved;
                }
                self.covariance[i * n + 6 + place] += column[i] * cross;
                self.covariance[(6 + place) * n + i] += column[i] * cross;
            }
            self.covariance[(6 + place) * (n + 1)] -= power * twice;
        }
        for k in (0..self.theta.len()).filter(|k| self.is_free[*k]) {
            let wander = self.wander * self.theta[k];
            self.covariance[(MOTION + k) * (n + 1)] += wander * wander * h;
        }
    }

    /// Corrects by the measured velocity, one axis after the other; the covariance is updated at
    /// the end.
    fn correct(&mut self, measured: &Vector6<f64>) {
        let n = self.top.len();
        let axes = *self.plant.axes();
        for (place, axis) in axes.into_iter().enumerate() {
            let Some(axis) = axis else {
                self.gains[place].fill(0.0);
                self.crossed[place].fill(0.0);
                continue;
            };
            let (before, now) = self.crossed.split_at_mut(place);
            let crossed = &mut now[0];
            crossed.copy_from_slice(&self.covariance[place * n..(place + 1) * n]);
            for (earlier, gain) in before.iter().zip(&self.gains) {
                let part = earlier[place];
                crossed.iter_mut().zip(gain).for_each(|(x, gain)| *x -= part * gain);
            }
            let inverse = 1.0 / (crossed[place] + self.noise.velocity[place].powi(2));
            let e = measured[axis] - self.velocity[place];
            for (gain, x) in self.gains[place].iter_mut().zip(crossed) {
                *gain = *x * inverse;
            }
            let gain = &self.gains[place];
            for k in 0..6 {
                self.velocity[k] += gain[k] * e;
                self.disturbance[k] += gain[6 + k] * e;
            }
            for (theta, gain) in self.theta.iter_mut().zip(&gain[MOTION..]) {
                *theta += gain * e;
            }
        }
        self.subtract_gains();
    }

    /// Subtracts gains times covariances with the measurements from P: computes the lower triangle
    /// and mirrors it.
    fn subtract_gains(&mut self) {
        let n = self.top.len();
        let Self { covariance, gains: [a, b, c, d, e, f], crossed, .. } = self;
        for i in 0..n {
            let [p, q, r, s, t, u] = crossed.each_ref().map(|x| x[i]);
            let (above, row) = covariance.split_at_mut(i * n);
            let row = &mut row[..=i];
            let m = row.len();
            let (a, b, c) = (&a[..m], &b[..m], &c[..m]);
            let (d, e, f) = (&d[..m], &e[..m], &f[..m]);
            for j in 0..m {
                row[j] -= p * a[j] + q * b[j] + r * c[j] + s * d[j] + t * e[j] + u * f[j];
            }
            for (j, x) in row[..i].iter().enumerate() {
                above[j * n + i] = *x;
            }
        }
    }
}

/// Computes the sum of the columns weighted by x.
fn weighted(columns: &[SVector<f64, 6>], x: &[f64]) -> [f64; 6] {
    let mut sum = [0.0; 6];
    for (column, &x) in columns.iter().zip(x) {
        sum.iter_mut().zip(&column.data.0[0]).for_each(|(sum, of)| *sum += x * of);
    }
    sum
}

/// Returns an empty slice with room for some signals.
fn slice_for(signals: usize) -> Slice {
    Slice { signals: std::array::from_fn(|_| vec![0.0; signals]), ..Slice::default() }
}
