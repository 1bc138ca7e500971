//! Start of the schemes from least squares, and their noise.

use super::estimate::covariance;
use super::joint::Joint;
use super::noise::{JointNoise, MotionStatistics};
use super::{Engine, Online, THIRD_DIFFERENCE};
use crate::plant::{Basis, Plant};

/// Upper limit of the observer rate times the ratio of noise power to velocity power, 1/s: noise
/// biases damping by `a M σ²`.
const QUIET_RATE: f64 = 0.002;

/// Lower limit of that rate, 1/s.
const LEAST_RATE: f64 = 0.5;

/// The start waits until the relative standard deviation of every diagonal mass is below this …
const KNOWN_PART: f64 = 0.03;

/// … but at most for this many times the usual start.
const LONGEST_START: f64 = 10.0;

/// Initial variances of the filter relative to those of least squares.
const START_VARIANCE: f64 = 4.0;

/// Interval at which the filter's noise is updated from residuals, s.
const NOISE_S: f64 = 60.0;

/// Lower limit of a mass as a fraction of typical force over typical acceleration.
const LEAST_MASS: f64 = 0.05;

impl Online {
    /// Returns the observer rate that the noise of measured velocity allows, 1/s.
    pub(super) fn allowed_observer_rate(&self) -> f64 {
        let of = |i: usize| {
            let noise = self.rough[i] / THIRD_DIFFERENCE;
            if noise > 0.0 { QUIET_RATE * self.speed[i] / noise } else { f64::INFINITY }
        };
        let least = self.structure.axes().iter().map(|dof| of(dof.index()));
        let least = least.fold(f64::INFINITY, f64::min);
        least.max(LEAST_RATE).min(self.options.observer_rate)
    }

    /// Returns true if least squares determine every diagonal mass well enough, or have had the
    /// maximum time.
    pub(super) fn may_start(&mut self) -> bool {
        let (elapsed_s, start_s) = (self.elapsed_s, self.options.start_s);
        if elapsed_s < start_s || elapsed_s >= LONGEST_START * start_s {
            return elapsed_s >= start_s;
        }
        let Self { structure, recursive, projected, .. } = self;
        let mut own = structure.terms().iter().enumerate();
        own.all(|(k, term)| match term {
            Basis::Mass(i, j) if i == j => {
                recursive.white_std(k, projected) < KNOWN_PART * recursive.theta()[k]
            }
            _ => true,
        })
    }

    pub(super) fn start(&mut self) {
        let rate = self.allowed_observer_rate();
        for dof in self.structure.axes() {
            let i = dof.index();
            if self.acceleration[i] > 0.0 && self.force[i] > 0.0 {
                let typical = (self.force[i] / self.acceleration[i]).sqrt();
                self.possible.set_least(*dof, LEAST_MASS * typical);
            }
        }
        self.projected.copy_from_slice(self.recursive.theta());
        self.possible.project(&mut self.projected);
        self.is_started = match &mut self.engine {
            Engine::Recursive => true,
            Engine::Adaptive(adaptive) => {
                adaptive.set_rate(rate);
                adaptive.start(&self.projected, &self.possible);
                true
            }
            Engine::Ekf(_) => {
                let joint = self.joint();
                let is_sound = joint.is_some();
                self.engine = Engine::Ekf(joint.map(Box::new));
                is_sound
            }
        };
    }

    /// Creates the joint filter from the result of least squares.
    fn joint(&mut self) -> Option<Joint> {
        let covariance = covariance(&self.recursive);
        let most = |k: usize| 4.0 * self.projected[k].powi(2).max(f64::EPSILON);
        let variances: Vec<f64> = (0..self.projected.len())
            .map(|k| START_VARIANCE * covariance[(k, k)].min(most(k)))
            .collect();
        let wander = self.options.wander_per_minute / 60.0_f64.sqrt();
        let plant = Plant::new(self.structure.clone(), self.projected.clone()).ok()?;
        self.next_noise_s = self.elapsed_s + NOISE_S;
        Joint::new(&plant, &variances, (self.noise(&self.projected), wander)).ok()
    }

    /// Estimates the noise from the residuals for given coefficients.
    fn noise(&self, theta: &[f64]) -> JointNoise {
        let step_s = self.step.length_s;
        let motion = MotionStatistics {
            velocity: (self.rough / THIRD_DIFFERENCE).map(f64::sqrt),
            force: self.force.map(f64::sqrt),
            mass: &self.possible.mass(theta),
            step_s,
            corner_rad_s: std::f64::consts::TAU * self.options.cutoff_hz,
        };
        let mut axes = [None; 6];
        axes.iter_mut()
            .zip(self.structure.axes())
            .for_each(|(axis, dof)| *axis = Some(dof.index()));
        JointNoise::estimate(&axes, self.recursive.residual_statistics(step_s), &motion)
    }

    /// Updates the filter's noise from the residuals at intervals.
    pub(super) fn update_noise(&mut self) {
        if self.elapsed_s < self.next_noise_s {
            return;
        }
        self.next_noise_s = self.elapsed_s + NOISE_S;
        if let Engine::Ekf(Some(joint)) = &self.engine {
            let noise = self.noise(joint.theta());
            if let Engine::Ekf(Some(joint)) = &mut self.engine {
                joint.set_noise(noise);
            }
        }
    }
}
