//! The joint extended Kalman filter: motion, disturbance and coefficients in one state.

use nalgebra::{SVector, Vector6};

use super::possible::Possible;
use super::step::Step;
use crate::Error;
use crate::motion::{Decay, Flow, HeldForce, Prepared, Slice, advance};
use crate::plant::Plant;

/// The longest slice of a step, s.
const SLICE_S: f64 = 0.1;

/// Slices of a step at most.
const MOST_SLICES: usize = 64;

/// Correlation time of the disturbance on each axis, s.
const CORRELATION_S: f64 = 10.0;

/// The disturbance is no smaller than this part of the force that is typical.
const LEAST_DISTURBANCE: f64 = 1e-3;

/// The filter of filter error with the coefficients as slow states:
///
/// ```text
/// ν̇ = M⁻¹ (τ + f − n(ν, η)),   ḟ = −f/T + w,   θ̇ = w_θ,   y = ν + noise
/// ```
///
/// # Source
/// [Jategaonkar2015, ch. 7].
pub(super) struct Joint {
    plant: Prepared<6>,
    flow: Flow<6>,
    slices: Vec<Slice>,
    pushes: Vec<HeldForce>,
    theta: Vec<f64>,
    velocity: SVector<f64, 6>,
    disturbance: SVector<f64, 6>,
    /// Rows of ν (6), f (6) and θ; all of it, row by row.
    covariance: Vec<f64>,
    top: Vec<f64>,
    gain: Vec<f64>,
    noise: JointNoise,
    /// Which coefficients are to be found.
    is_free: Vec<bool>,
    is_moving: bool,
}

/// How strong noise is, by place of the plant's axes.
#[derive(Clone, Copy)]
pub(super) struct JointNoise {
    /// Standard deviation of a sample of velocity, m/s or rad/s.
    pub(super) velocity: Vector6<f64>,
    /// Standard deviation of the disturbance, N or N m.
    pub(super) disturbance: Vector6<f64>,
    /// How fast coefficients wander, as a part of each in √s.
    pub(super) wander: f64,
}

impl Joint {
    /// A filter from a plant and the variances of its coefficients; those without stay as they
    /// are.
    ///
    /// # Errors
    /// [`Error::Plant`] if M cannot be inverted.
    pub(super) fn new(plant: &Plant, variances: &[f64], noise: JointNoise) -> Result<Self, Error> {
        let p = plant.coefficients().len();
        let n = 12 + p;
        let mut covariance = vec![0.0; n * n];
        for (k, variance) in variances.iter().enumerate() {
            covariance[(12 + k) * (n + 1)] = *variance;
        }
        Ok(Self {
            plant: Prepared::new(plant)?,
            flow: Flow::of_plant(p),
            slices: vec![slice_for(plant.structure().signals().len()); MOST_SLICES],
            pushes: Vec::with_capacity(MOST_SLICES),
            theta: plant.coefficients().to_vec(),
            velocity: SVector::zeros(),
            disturbance: SVector::zeros(),
            covariance,
            top: vec![0.0; 6 * n],
            gain: vec![0.0; n],
            noise,
            is_free: variances.iter().map(|variance| *variance > 0.0).collect(),
            is_moving: false,
        })
    }

    /// The coefficients.
    pub(super) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// The variance of a coefficient.
    pub(super) fn variance(&self, k: usize) -> f64 {
        self.covariance[(12 + k) * (self.gain.len() + 1)].max(0.0)
    }

    /// Begins anew after a gap: motion and disturbance are not known.
    pub(super) fn restart(&mut self) {
        self.is_moving = false;
    }

    /// Lets coefficients wander further: by so large a part of each.
    pub(super) fn reopen(&mut self, part: f64) {
        let n = self.gain.len();
        for k in (0..self.theta.len()).filter(|k| self.is_free[*k]) {
            self.covariance[(12 + k) * (n + 1)] += (part * self.theta[k]).powi(2);
        }
    }

    /// Takes a step in.
    pub(super) fn update(&mut self, step: &Step, possible: &Possible) {
        if !self.is_moving {
            self.begin(&step.velocity[0]);
        }
        self.predict(step);
        let axes = *self.plant.axes();
        for (place, axis) in axes.iter().enumerate() {
            if let Some(axis) = axis {
                self.correct(place, step.velocity[2][*axis]);
            }
        }
        possible.project(&mut self.theta);
        self.plant.renumber(&self.theta);
    }

    fn begin(&mut self, velocity: &Vector6<f64>) {
        self.velocity = self.plant.on_axes(velocity);
        self.disturbance = SVector::zeros();
        let n = self.gain.len();
        for i in 0..12 {
            for j in 0..n {
                self.covariance[i * n + j] = 0.0;
                self.covariance[j * n + i] = 0.0;
            }
            let std = if i < 6 { self.noise.velocity[i] } else { self.noise.disturbance[i - 6] };
            self.covariance[i * (n + 1)] = std * std;
        }
        self.is_moving = true;
    }

    /// Cuts a step into slices; tells how many.
    fn slice(&mut self, step: &Step) -> usize {
        let count = (step.length_s / SLICE_S).ceil().clamp(1.0, MOST_SLICES as f64) as usize;
        let part = 1.0 / count as f64;
        // Within a step, motion that is not the plant's and attitude change linearly.
        let at = |x: f64| {
            let down = step.down_body[0] * (1.0 - x) + step.down_body[2] * x;
            (step.velocity[0] * (1.0 - x) + step.velocity[2] * x, down.normalize())
        };
        for (k, slice) in self.slices[..count].iter_mut().enumerate() {
            let places = [0.0, 0.5, 1.0].map(|x| part * (k as f64 + x));
            let nodes = places.map(at);
            slice.from_s = step.length_s * part * k as f64;
            slice.length_s = step.length_s * part;
            slice.down_body = nodes.map(|(_, down)| down);
            slice.others = nodes.map(|(velocity, _)| velocity);
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
        self.pushes.clear();
        let push = HeldForce { force: step.force, ..HeldForce::default() };
        self.pushes.resize(count, push);
        let (h, n) = (step.length_s, self.gain.len());
        let decay = Decay { rate: SVector::repeat(1.0 / CORRELATION_S) };
        let Self { plant, slices, pushes, velocity, disturbance, flow, .. } = self;
        advance(plant, (&slices[..count], pushes), velocity, disturbance, &decay, flow);
        let fade = (-h / CORRELATION_S).exp();
        self.velocity = self.flow.velocity;
        self.disturbance *= fade;
        // The first six rows of F P; the others are those of P, faded.
        self.top.fill(0.0);
        for (i, top) in self.top.chunks_exact_mut(n).enumerate() {
            for (column, row) in self.flow.columns.iter().zip(self.covariance.chunks_exact(n)) {
                let weight = column[i];
                if weight != 0.0 {
                    top.iter_mut().zip(row).for_each(|(sum, x)| *sum += weight * x);
                }
            }
        }
        for i in 0..6 {
            for j in 0..6 {
                let column = |k: usize| self.flow.columns[k][j] * self.top[i * n + k];
                self.covariance[i * n + j] = (0..n).map(column).sum();
            }
            for j in 6..n {
                let x = self.top[i * n + j] * if j < 12 { fade } else { 1.0 };
                self.covariance[i * n + j] = x;
                self.covariance[j * n + i] = x;
            }
        }
        for i in 6..12 {
            for j in 6..n {
                let x = self.covariance[i * n + j] * fade * if j < 12 { fade } else { 1.0 };
                self.covariance[i * n + j] = x;
                self.covariance[j * n + i] = x;
            }
        }
        self.add_noise(h);
    }

    fn add_noise(&mut self, h: f64) {
        let n = self.gain.len();
        let inverse = *self.plant.inverse();
        for place in 0..6 {
            let sigma = self.noise.disturbance[place];
            let q = 2.0 * sigma * sigma / CORRELATION_S;
            let column = inverse.column(place);
            for i in 0..6 {
                for j in 0..6 {
                    self.covariance[i * n + j] += column[i] * column[j] * q * h * h * h / 3.0;
                }
                let cross = column[i] * 0.5 * q * h * h;
                self.covariance[i * n + 6 + place] += cross;
                self.covariance[(6 + place) * n + i] += cross;
            }
            self.covariance[(6 + place) * (n + 1)] += q * h;
        }
        for k in (0..self.theta.len()).filter(|k| self.is_free[*k]) {
            let wander = self.noise.wander * self.theta[k];
            self.covariance[(12 + k) * (n + 1)] += wander * wander * h;
        }
    }

    fn correct(&mut self, place: usize, y: f64) {
        let n = self.gain.len();
        let variance = self.covariance[place * (n + 1)] + self.noise.velocity[place].powi(2);
        let e = y - self.velocity[place];
        for k in 0..n {
            self.gain[k] = self.covariance[k * n + place] / variance;
        }
        for k in 0..6 {
            self.velocity[k] += self.gain[k] * e;
            self.disturbance[k] += self.gain[6 + k] * e;
        }
        for (theta, gain) in self.theta.iter_mut().zip(&self.gain[12..]) {
            *theta += gain * e;
        }
        for (row, gain) in self.covariance.chunks_exact_mut(n).zip(&self.gain) {
            let gain = gain * variance;
            row.iter_mut().zip(&self.gain).for_each(|(x, other)| *x -= gain * other);
        }
    }
}

/// A slice with room for so many signals.
fn slice_for(signals: usize) -> Slice {
    Slice { signals: std::array::from_fn(|_| vec![0.0; signals]), ..Slice::default() }
}

impl JointNoise {
    /// Noise of what was seen so far: velocity, residual of the equation and force, by axis.
    pub(super) fn of(
        axes: &[usize],
        velocity: &Vector6<f64>,
        residual: &Vector6<f64>,
        force: &Vector6<f64>,
        wander: f64,
    ) -> Self {
        let placed = |x: &dyn Fn(usize) -> f64| {
            Vector6::from_fn(|place, _| axes.get(place).map_or(1.0, |axis| x(*axis)))
        };
        Self {
            velocity: placed(&|i| velocity[i].max(f64::EPSILON)),
            disturbance: placed(&|i| {
                residual[i].max(LEAST_DISTURBANCE * force[i]).max(f64::EPSILON)
            }),
            wander,
        }
    }
}
