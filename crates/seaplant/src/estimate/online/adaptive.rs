//! The adaptive observer.

use nalgebra::{Matrix6, Vector6};

use super::factor::Factor;
use super::possible::Possible;
use super::step::Step;

/// Duration of the first gain, s; each further one lasts twice as long.
const FIRST_GAIN_S: f64 = 10.0;

/// Maximum duration of a gain, s.
const LONGEST_GAIN_S: f64 = 600.0;

/// Fraction of its diagonal that is added to the power of the regressors: limits the adaptation
/// rate in directions without excitation.
const RIDGE: f64 = 1e-4;

/// Observer of ν with adaptive coefficients, without a measured acceleration.
///
/// ```text
/// ν̂̇ = M̂⁻¹ (τ − n̂(ν, η)) − a Δ,   Δ = ν̂ − ν,   θ̂̇ = Γ Yᵀ(ν̂̇ + a Δ, ν, η) Δ
/// ```
///
/// With `V = ½ Δᵀ M Δ + ½ θ̃ᵀ Γ⁻¹ θ̃` it has `V̇ = −a Δᵀ M Δ`. Γ is `(a/T) S⁻¹`, where S is the
/// mean of `Yᵀ M̂⁻¹ Y` so far, and constant between updates: excited coefficients adapt with the
/// time constant T where motion is slower than a.
///
/// # Source
/// \[Smallwood2003\], for one axis.
pub(super) struct Adaptive {
    observer_rate: f64,
    adaptation_s: f64,
    theta: Vec<f64>,
    slope: Vec<f64>,
    delta: Vector6<f64>,
    mass: Matrix6<f64>,
    inverse: Matrix6<f64>,
    power: Vec<f64>,
    gain: Factor,
    gain_time_s: f64,
    next_gain_s: f64,
    has_gain: bool,
    columns: Vec<Vector6<f64>>,
}

impl Adaptive {
    pub(super) fn new(count: usize, observer_rate: f64, adaptation_s: f64) -> Self {
        Self {
            observer_rate,
            adaptation_s,
            theta: vec![0.0; count],
            slope: vec![0.0; count],
            delta: Vector6::zeros(),
            mass: Matrix6::identity(),
            inverse: Matrix6::identity(),
            power: vec![0.0; count * count],
            gain: Factor::new(count),
            gain_time_s: 0.0,
            next_gain_s: FIRST_GAIN_S,
            has_gain: false,
            columns: vec![Vector6::zeros(); count],
        }
    }

    /// Starts from given coefficients.
    pub(super) fn start(&mut self, theta: &[f64], possible: &Possible) {
        self.theta.copy_from_slice(theta);
        self.set_mass(possible);
    }

    /// Sets the observer rate a, 1/s.
    pub(super) fn set_rate(&mut self, observer_rate: f64) {
        self.observer_rate = observer_rate;
    }

    fn set_mass(&mut self, possible: &Possible) {
        possible.project(&mut self.theta);
        self.mass = possible.mass(&self.theta);
        if let Some(inverse) = self.mass.try_inverse() {
            self.inverse = inverse;
        }
    }

    /// Restarts the motion after a gap.
    pub(super) fn restart(&mut self) {
        self.delta = Vector6::zeros();
    }

    /// Returns the coefficients.
    pub(super) fn theta(&self) -> &[f64] {
        &self.theta
    }

    /// Processes a step, with the exact solution for coefficients that are constant over it.
    pub(super) fn update(&mut self, step: &Step, possible: &Possible, adapts: bool) {
        let (h, a) = (step.length_s, self.observer_rate);
        let rate = self.rate(step);
        let fade = (-a * h).exp();
        let after = self.delta * fade + (rate - step.acceleration) * ((1.0 - fade) / a);
        let mean = (self.delta + after) * 0.5;
        self.delta = after;
        for (k, column) in self.columns.iter_mut().enumerate() {
            *column = step.column(k, &rate);
            if possible.is_held(k) {
                *column = Vector6::zeros();
            }
            self.slope[k] = column.dot(&mean);
        }
        self.measure_power(h);
        if !(adapts && self.has_gain) {
            return;
        }
        self.gain.solve(&mut self.slope);
        let part = h * a / self.adaptation_s;
        let part = part / (1.0 + part * self.loop_gain(&mean) * (1.0 - fade) / a);
        for (theta, slope) in self.theta.iter_mut().zip(&self.slope) {
            *theta += part * slope;
        }
        for k in possible.not_negative() {
            self.raise_to_zero(k);
        }
        self.set_mass(possible);
    }

    /// Computes the loop gain, by the norm of M: the change of ν̂'s rate through the change of the
    /// coefficients, relative to Δ. A step is shortened where its length would make the loop
    /// overshoot.
    fn loop_gain(&self, mean: &Vector6<f64>) -> f64 {
        let columns = self.columns.iter().zip(&self.slope);
        let force: Vector6<f64> = columns.map(|(column, slope)| column * *slope).sum();
        let response = force.dot(&(self.inverse * force)).max(0.0);
        let error = mean.dot(&(self.mass * mean));
        if error > 0.0 { (response / error).sqrt() } else { 0.0 }
    }

    /// Moves a negative coefficient to zero, along the shortest path in the norm of Γ⁻¹, so that V
    /// does not increase.
    fn raise_to_zero(&mut self, k: usize) {
        let below = self.theta[k];
        if below >= 0.0 {
            return;
        }
        self.slope.fill(0.0);
        self.slope[k] = 1.0;
        self.gain.solve(&mut self.slope);
        let own = self.slope[k];
        if own > 0.0 {
            for (theta, slope) in self.theta.iter_mut().zip(&self.slope) {
                *theta -= below / own * slope;
            }
        }
    }

    /// Returns M̂⁻¹ (τ − n̂) on the plant's axes.
    fn rate(&self, step: &Step) -> Vector6<f64> {
        let force = step.force - step.resistance(&self.theta);
        let rate = self.inverse * force;
        Vector6::from_fn(|i, _| if step.own()[i] { rate[i] } else { 0.0 })
    }

    fn measure_power(&mut self, h: f64) {
        let p = self.theta.len();
        self.gain_time_s += h;
        // A mean over the whole time so far.
        let part = h / self.gain_time_s;
        for i in 0..p {
            let weighted = self.inverse * self.columns[i];
            for j in 0..=i {
                let now = weighted.dot(&self.columns[j]);
                let power = &mut self.power[i * p + j];
                *power += part * (now - *power);
            }
        }
        if self.gain_time_s >= self.next_gain_s {
            self.take_gain();
        }
    }

    /// Updates Γ from the mean power so far.
    fn take_gain(&mut self) {
        self.gain.set(&self.power, RIDGE);
        self.next_gain_s += self.next_gain_s.min(LONGEST_GAIN_S);
        self.has_gain = true;
    }
}

#[cfg(test)]
mod tests {
    use super::super::Sample;
    use super::*;
    use crate::Dof;
    use crate::Timed;
    use crate::motion::{Inputs, simulate};
    use crate::plant::{Plant, Structure, Symmetry};

    /// Relative error of V̇ with steps of 2 ms.
    const STEPS: f64 = 2e-2;

    fn plant(structure: &Structure, by: f64) -> Plant {
        // M11, M22, M26, M66, u, |u|u, v, |v|v, r, |r|r.
        let truth = [20.0, 25.0, 0.6, 0.5, 5.0, 30.0, 8.0, 60.0, 0.1, 1.2];
        Plant::new(structure.clone(), truth.map(|x| by * x).to_vec()).expect("possible")
    }

    /// Returns `n` samples of a planar vehicle in steps of `h` seconds.
    fn samples(truth: &Plant, h: f64, n: usize) -> Vec<Sample> {
        let times: Vec<f64> = (0..=n).map(|k| h * k as f64).collect();
        let mut inputs = Inputs::default();
        for (axis, size, rate) in [(0, 30.0, 0.9), (1, 40.0, 1.3), (5, 0.8, 1.7)] {
            let force: Vec<f64> =
                times.iter().map(|t| size * (rate * (t + 0.5 * h)).sin()).collect();
            inputs.force[axis] = Some(Timed::new("force", times.clone(), force).expect("valid"));
        }
        let moved = simulate(truth, &inputs, &Vector6::zeros(), &times).expect("stable");
        let at = |k: usize| Sample {
            time_s: times[k],
            velocity: moved.velocity[k],
            force: Vector6::from_fn(|i, _| {
                inputs.force[i].as_ref().map_or(0.0, |force| force.held_at(times[k]))
            }),
            ..Sample::default()
        };
        (0..=n).map(at).collect()
    }

    #[test]
    fn lyapunov_function_decreases_at_the_theoretical_rate() {
        let axes = [Dof::Surge, Dof::Sway, Dof::Yaw];
        let structure = Structure::of(&axes, Symmetry::PortStarboard).expect("three axes");
        let truth = plant(&structure, 1.0);
        let (h, a) = (0.002, 1.5);
        let samples = samples(&truth, h, 19_500);
        let possible = Possible::of(&structure, None);
        let mut step = Step::new(&structure);
        let mut adaptive = Adaptive::new(structure.terms().len(), a, 10.0);
        adaptive.start(plant(&structure, 1.15).coefficients(), &possible);
        let (mut paid, mut first, mut last) = (0.0, None, 0.0);
        let mass = possible.mass(truth.coefficients());
        for k in 1..samples.len() {
            let before = (k > 1).then(|| &samples[k - 2]);
            step.take(before, &samples[k - 1], &samples[k]);
            // After 20 s the gains are constant.
            let had = adaptive.next_gain_s;
            adaptive.update(&step, &possible, true);
            if adaptive.next_gain_s < 40.0 {
                continue;
            }
            let wrong: Vec<f64> =
                adaptive.theta.iter().zip(truth.coefficients()).map(|(x, y)| x - y).collect();
            let kinetic = 0.5 * adaptive.delta.dot(&(mass * adaptive.delta));
            let v = kinetic + 0.5 * gain_norm(&adaptive, &wrong);
            if first.is_none() || had < 40.0 {
                (first, paid) = (Some(v), 0.0);
            } else {
                paid += 2.0 * a * h * kinetic;
            }
            last = v;
        }
        let first = first.expect("the gains are fixed");
        let off = (first - last - paid).abs() / (first - last);
        assert!(first > 1.2 * last && off < STEPS, "{first} − {last} against {paid}");
    }

    /// Computes θ̃ᵀ Γ⁻¹ θ̃ with the power from which Γ was computed.
    fn gain_norm(adaptive: &Adaptive, wrong: &[f64]) -> f64 {
        let scale = adaptive.adaptation_s / adaptive.observer_rate;
        scale * adaptive.gain.norm(wrong)
    }
}
