//! How the schemes begin from least squares, and the noise that they reckon with.

use super::joint::Joint;
use super::noise::{JointNoise, Seen};
use super::told::covariance;
use super::{Engine, Online, THIRD_DIFFERENCE};
use crate::plant::{Basis, Plant};

/// The observer's rate is at most this times the power of velocity over that of its noise, 1/s:
/// noise biases damping by `a M σ²`.
const QUIET_RATE: f64 = 0.002;

/// … but no less than this, 1/s.
const LEAST_RATE: f64 = 0.5;

/// No start before the standard deviation of every own mass is below this part of it …
const KNOWN_PART: f64 = 0.03;

/// … but no later than after so many times the usual start.
const LONGEST_START: f64 = 10.0;

/// The variances that a filter starts from are those of least squares times this.
const START_VARIANCE: f64 = 4.0;

/// The filter takes its noise from residuals anew after so long, s.
const NOISE_S: f64 = 60.0;

/// No own mass is below this part of typical force over typical acceleration.
const LEAST_MASS: f64 = 0.05;

impl Online {
    /// The observer's rate that the noise of measured velocity allows, 1/s.
    pub(super) fn quiet_rate(&self) -> f64 {
        let of = |i: usize| {
            let noise = self.rough[i] / THIRD_DIFFERENCE;
            if noise > 0.0 { QUIET_RATE * self.speed[i] / noise } else { f64::INFINITY }
        };
        let least = self.structure.axes().iter().map(|dof| of(dof.index()));
        let least = least.fold(f64::INFINITY, f64::min);
        least.max(LEAST_RATE).min(self.options.observer_rate)
    }

    /// Whether least squares know every own mass well enough to go on from, or have had long
    /// enough to.
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
        let rate = self.quiet_rate();
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

    /// The joint filter from what least squares know.
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

    /// Noise as residuals have it now, for a plant of these coefficients.
    fn noise(&self, theta: &[f64]) -> JointNoise {
        let step_s = self.step.length_s;
        let seen = Seen {
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
        JointNoise::of(&axes, self.recursive.colours(step_s), &seen)
    }

    /// The filter takes the noise of residuals anew from time to time.
    pub(super) fn listen(&mut self) {
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
