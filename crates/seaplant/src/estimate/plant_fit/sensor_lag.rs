//! Velocity sensors that smooth what they show.

use nalgebra::{Matrix2, Vector2};

/// A velocity sensor that smooths: with a first-order lag T, or as the mean over a window W.
///
/// ```text
/// y = v / (1 + T s)     or     y = v / (1 + W s/2 + W² s²/12)
/// ```
///
/// The second is the mean `(1 − e^(−W s)) / (W s)` with the Padé approximation of the exponential of degree two,
/// right to the third order of W s.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SensorLag {
    /// T or W, s; 0 of a sensor that does not smooth.
    pub(super) time_s: f64,
    /// True of a window.
    pub(super) is_window: bool,
}

/// How a sensor's states `[y, ẏ]` move over a step in which velocity changes linearly; of a lag, y alone.
pub(super) struct LagStep {
    /// Effect of the states before it, shape (2, 2).
    pub(super) transition: Matrix2<f64>,
    /// Effect of velocity at the beginning and at the end of it.
    pub(super) taken: [Vector2<f64>; 2],
}

impl SensorLag {
    /// Returns the step of `h` seconds.
    pub(super) fn step(&self, h: f64) -> LagStep {
        if !self.is_window {
            let x = h / self.time_s;
            let (keep, mean) = ((-x).exp(), -(-x).exp_m1() / x);
            let transition = Matrix2::new(keep, 0.0, 0.0, 0.0);
            let taken = [mean - keep, 1.0 - mean].map(|part| Vector2::new(part, 0.0));
            return LagStep { transition, taken };
        }
        // ÿ = ω² (v − y) − 2 ζ ω ẏ with ω = √12/W and ζ = √3/2.
        let omega = 12_f64.sqrt() / self.time_s;
        let (sigma, turning) = (0.75_f64.sqrt() * omega, 0.5 * omega);
        let (sin, cos) = (turning * h).sin_cos();
        let fade = (-sigma * h).exp();
        let part = sigma / turning * sin;
        let transition =
            Matrix2::new(cos + part, sin / turning, -omega * omega / turning * sin, cos - part)
                * fade;
        let inverse =
            Matrix2::new(-2.0 * sigma / (omega * omega), -(omega * omega).recip(), 1.0, 0.0);
        let input = Vector2::new(0.0, omega * omega);
        let held = inverse * (transition - Matrix2::identity()) * input;
        let risen = inverse * (held / h - input);
        LagStep { transition, taken: [held - risen, risen] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// States after a step by many small ones, from y and ẏ, under a velocity that rises from 1 by 3 m/s².
    fn by_small_steps(sensor: SensorLag, h: f64, mut y: f64, mut slope: f64) -> [f64; 2] {
        let n = 200_000;
        let dt = h / f64::from(n);
        for k in 0..n {
            let v = 1.0 + 3.0 * (f64::from(k) + 0.5) * dt;
            if sensor.is_window {
                let w = sensor.time_s;
                let bend = (v - y - 0.5 * w * slope) * 12.0 / (w * w);
                y += dt * (slope + 0.5 * dt * bend);
                slope += dt * bend;
            } else {
                y += dt * (v - y) / sensor.time_s;
            }
        }
        [y, slope]
    }

    #[test]
    fn steps_follow_their_equations() {
        for (is_window, start) in [(false, [0.4, 0.0]), (true, [0.4, -0.7])] {
            let (sensor, h) = (SensorLag { time_s: 0.6, is_window }, 0.13);
            let LagStep { transition, taken } = sensor.step(h);
            let found = transition * Vector2::from(start) + taken[0] + taken[1] * (1.0 + 3.0 * h);
            let expected = by_small_steps(sensor, h, start[0], start[1]);
            let states = if is_window { 2 } else { 1 };
            for k in 0..states {
                assert!((found[k] - expected[k]).abs() < 1e-5, "{is_window}: {found} {expected:?}");
            }
        }
    }

    #[test]
    fn a_window_shows_the_velocity_of_its_middle() {
        // Of a velocity that rises evenly the mean is that half a window ago.
        let sensor = SensorLag { time_s: 0.8, is_window: true };
        let (mut states, h) = (Vector2::zeros(), 0.1);
        for k in 0..100 {
            let LagStep { transition, taken } = sensor.step(h);
            let at = |k: i32| 2.0 * h * f64::from(k);
            states = transition * states + taken[0] * at(k) + taken[1] * at(k + 1);
        }
        assert!((states[0] - 2.0 * (100.0 * h - 0.4)).abs() < 1e-6, "{states}");
    }
}
