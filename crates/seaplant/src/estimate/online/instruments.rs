//! Instrumental variables: a simulated motion without measurement noise and unlogged forces, and
//! its regressors.

use nalgebra::{Matrix6, Vector6};

use super::Sample;
use super::possible::Possible;
use super::step::Step;

/// Time constant with which the simulated velocity returns to the measured one, s: slower forces
/// hardly affect acceleration, and a plant without course stability stays near.
const BACK_S: f64 = 20.0;

/// The simulation restarts when its deviation exceeds this many times the mean speed.
const FAR: f64 = 3.0;

/// Simulation of the estimated plant under the logged force.
///
/// Velocity noise and unlogged forces enter both the regressors and the residual; least squares
/// takes their product for a smaller mass. The regressors of the simulated motion are free of them.
///
/// # Source
/// [Young2011]: instruments from the simulated plant.
pub(super) struct Instruments {
    step: Step,
    velocity: Option<Vector6<f64>>,
    rate: Vector6<f64>,
    usual: Vector6<f64>,
    theta: Vec<f64>,
    /// Its regressors, filtered once and twice.
    pub(super) filtered: [Vec<Vector6<f64>>; 2],
}

impl Instruments {
    pub(super) fn new(step: &Step) -> Self {
        let zeros = || vec![Vector6::zeros(); step.count()];
        Self {
            step: step.clone(),
            velocity: None,
            rate: Vector6::zeros(),
            usual: Vector6::zeros(),
            theta: vec![0.0; step.count()],
            filtered: [zeros(), zeros()],
        }
    }

    /// Restarts from the measured motion with the next step.
    pub(super) fn restart(&mut self) {
        self.velocity = None;
    }

    /// Processes a step: `part` is the filter's coefficient; `measured` are the filtered regressors
    /// of the measured motion, used at a restart.
    pub(super) fn update(
        &mut self,
        step: &Step,
        theta: &[f64],
        possible: &Possible,
        (part, measured): (f64, &[Vec<Vector6<f64>>; 2]),
    ) {
        self.theta.copy_from_slice(theta);
        possible.project(&mut self.theta);
        self.step.set_races(&self.theta, 0.0);
        let h = step.length_s;
        let square = |x: &Vector6<f64>| x.component_mul(x);
        self.usual += (square(&step.velocity[2]) - self.usual) * (h / BACK_S).min(1.0);
        let inverse = possible.mass(&self.theta).try_inverse();
        let (Some(from), Some(inverse)) = (self.velocity, inverse) else {
            return self.begin(step, measured);
        };
        let to = self.advance(step, from, &inverse);
        for (k, first) in self.filtered[0].iter_mut().enumerate() {
            *first += (self.step.column(k, &self.rate) - *first) * part;
        }
        let [first, second] = &mut self.filtered;
        for (first, second) in first.iter().zip(second) {
            *second += (*first - *second) * part;
        }
        let off = to - step.velocity[2];
        // NaN counts as far.
        let is_near =
            (0..6).all(|i| !step.own()[i] || off[i] * off[i] <= FAR * FAR * self.usual[i]);
        if !is_near {
            return self.begin(step, measured);
        }
        self.velocity = Some(to - off * (1.0 - (-h / BACK_S).exp()));
    }

    fn begin(&mut self, step: &Step, measured: &[Vec<Vector6<f64>>; 2]) {
        for (own, measured) in self.filtered.iter_mut().zip(measured) {
            own.copy_from_slice(measured);
        }
        self.velocity = Some(step.velocity[2]);
        self.rate = step.acceleration;
    }

    /// Integrates the simulated velocity over a step.
    fn advance(&mut self, step: &Step, from: Vector6<f64>, inverse: &Matrix6<f64>) -> Vector6<f64> {
        let (h, own) = (step.length_s, step.own());
        let of_plant = |simulated: Vector6<f64>, measured: &Vector6<f64>| {
            Vector6::from_fn(|i, _| if own[i] { simulated[i] } else { measured[i] })
        };
        let sample = |at: usize, time_s: f64, velocity: Vector6<f64>| Sample {
            time_s,
            velocity: of_plant(velocity, &step.velocity[at]),
            down_body: step.down_body[at],
            force: step.force,
            signals: step.signals[at],
        };
        let from_sample = sample(0, 0.0, from);
        let to_sample = sample(2, h, from + self.rate * h);
        self.step.take(None, &from_sample, &to_sample);
        let rate = inverse * (step.force - self.step.resistance(&self.theta));
        self.rate = of_plant(rate, &Vector6::zeros());
        of_plant(from + self.rate * h, &step.velocity[2])
    }
}
