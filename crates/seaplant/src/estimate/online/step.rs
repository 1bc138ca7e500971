//! The equation of motion over one step, without an acceleration.

use nalgebra::{Vector3, Vector6};

use super::{MOST_SIGNALS, Sample};
use crate::plant::{Basis, Instant, Signal, Structure};

/// Means over a step between two samples.
///
/// ```text
/// Σ θ_k Ȳ_k = τ̄,    Ȳ_k = E_k δν/h + (1/h) ∫ Y_k(0, ν, η) dt
/// ```
///
/// with the integral by Simpson's rule. Only the momentum, which M multiplies, is differentiated,
/// as an increment.
#[derive(Clone)]
pub(super) struct Step {
    structure: Structure,
    /// True for signals that are held from one sample to the next.
    holds: [bool; MOST_SIGNALS],
    own: [bool; 6],
    /// Of each term of a fin in a race, the coefficient of its slipstream over that of its lift.
    races: Vec<f64>,
    /// Regressors without acceleration, on the plant's axes.
    still: Vec<Vector6<f64>>,
    /// δν/h, m/s² and rad/s².
    pub(super) acceleration: Vector6<f64>,
    /// τ, N and N m.
    pub(super) force: Vector6<f64>,
    /// h, s.
    pub(super) length_s: f64,
    /// ν at the start, middle and end.
    pub(super) velocity: [Vector6<f64>; 3],
    /// k = Rᵀ e₃ at the same instants.
    pub(super) down_body: [Vector3<f64>; 3],
    /// Signals of the effects at the same instants.
    pub(super) signals: [[f64; MOST_SIGNALS]; 3],
}

impl Step {
    pub(super) fn new(structure: &Structure) -> Self {
        let signals = structure.signals();
        let holds = std::array::from_fn(|k| signals.get(k).is_some_and(Signal::is_held));
        let mut own = [false; 6];
        structure.axes().iter().for_each(|dof| own[dof.index()] = true);
        Self {
            races: vec![0.0; structure.terms().len()],
            still: vec![Vector6::zeros(); structure.terms().len()],
            structure: structure.clone(),
            holds,
            own,
            acceleration: Vector6::zeros(),
            force: Vector6::zeros(),
            length_s: 0.0,
            velocity: [Vector6::zeros(); 3],
            down_body: [Vector3::z(); 3],
            signals: [[0.0; MOST_SIGNALS]; 3],
        }
    }

    /// Takes the races of fins from the present coefficients; returns true if any has moved by more than a part.
    pub(super) fn set_races(&mut self, theta: &[f64], part: f64) -> bool {
        let terms = self.structure.terms();
        let coefficient = |effect: usize| {
            let at = terms.iter().position(|term| *term == Basis::Effect(effect));
            at.map_or(0.0, |at| theta[at])
        };
        let mut has_moved = false;
        for (race, term) in self.races.iter_mut().zip(terms) {
            let Basis::Effect(effect) = term else { continue };
            let before = std::mem::replace(race, self.structure.race(*effect, coefficient));
            has_moved |= (*race - before).abs() > part * before.max(*race);
        }
        has_moved
    }

    /// Computes the step from a sample to the next; `before` precedes both.
    pub(super) fn take(&mut self, before: Option<&Sample>, from: &Sample, to: &Sample) {
        let h = to.time_s - from.time_s;
        self.length_s = h;
        self.acceleration = self.masked((to.velocity - from.velocity) / h);
        self.force = self.masked(from.force);
        let bend = before.map_or(Vector6::zeros(), |before| {
            let h0 = from.time_s - before.time_s;
            let (now, then) =
                ((to.velocity - from.velocity) / h, (from.velocity - before.velocity) / h0);
            (now - then) * (2.0 / (h + h0))
        });
        let middle = (from.velocity + to.velocity) * 0.5 - bend * (h * h / 8.0);
        self.velocity = [from.velocity, middle, to.velocity];
        let across = (from.down_body + to.down_body).normalize();
        self.down_body = [from.down_body, across, to.down_body];
        self.signals = [0.0, 0.5, 1.0].map(|part| {
            std::array::from_fn(|k| {
                let part = if self.holds[k] { 0.0 } else { part };
                from.signals[k] + part * (to.signals[k] - from.signals[k])
            })
        });
        for k in 0..self.still.len() {
            let mut sum = Vector6::zeros();
            for (instant, weight) in SIMPSON.into_iter().enumerate() {
                let at = Instant {
                    acceleration: Vector6::zeros(),
                    velocity: self.velocity[instant],
                    down_body: self.down_body[instant],
                };
                let term = &self.structure.terms()[k];
                let (signals, race) = (&self.signals[instant], self.races[k]);
                sum += self.structure.regressor_in_race(term, &at, signals, race) * weight;
            }
            self.still[k] = self.masked(sum);
        }
    }

    fn masked(&self, x: Vector6<f64>) -> Vector6<f64> {
        Vector6::from_fn(|i, _| if self.own[i] { x[i] } else { 0.0 })
    }

    /// Returns the number of terms.
    pub(super) fn count(&self) -> usize {
        self.still.len()
    }

    /// Returns true for the axes of the plant.
    pub(super) fn own(&self) -> &[bool; 6] {
        &self.own
    }

    /// Returns Ȳ_k for an acceleration of the plant's axes.
    pub(super) fn column(&self, k: usize, acceleration: &Vector6<f64>) -> Vector6<f64> {
        match self.structure.terms()[k] {
            term @ Basis::Mass(..) => self.still[k] + self.masked(term.inertial(acceleration)),
            _ => self.still[k],
        }
    }

    /// Returns n̂ = Σ θ_k Ȳ_k without acceleration, N and N m.
    pub(super) fn resistance(&self, theta: &[f64]) -> Vector6<f64> {
        self.still.iter().zip(theta).map(|(column, theta)| column * *theta).sum()
    }
}

/// Weights of start, middle and end.
const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
