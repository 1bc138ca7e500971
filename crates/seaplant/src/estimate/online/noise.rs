//! Standard deviation and correlation time of unlogged forces, estimated from the residuals of
//! least squares.

use nalgebra::{Matrix6, Vector6};

/// Upper limit of the correlation time, s, and of the averaging time of residuals.
const LONGEST_S: f64 = 60.0;

/// Lower limit of the correlation time, in steps.
const SHORTEST_STEPS: f64 = 1.0;

/// Lower limit of the disturbance, as a fraction of the root mean square force.
const LEAST_DISTURBANCE: f64 = 1e-3;

/// Number of halvings of the interval of the correlation time: its error is below 1 %.
const HALVINGS: usize = 12;

/// Noise of a joint filter, by index among the plant's axes.
#[derive(Clone, Copy)]
pub(super) struct JointNoise {
    /// Standard deviation of a sample of velocity, m/s or rad/s.
    pub(super) velocity: Vector6<f64>,
    /// Standard deviation of the disturbance, N or N m.
    pub(super) disturbance: Vector6<f64>,
    /// Correlation time of the disturbance, s.
    pub(super) correlation_s: Vector6<f64>,
}

/// Residual statistics of least squares on one axis, with terms filtered by `1/(1 + s/ω)²`.
#[derive(Clone, Copy)]
pub(super) struct ResidualStatistics {
    /// The axis.
    pub(super) axis: usize,
    /// Mean square of the residual, N² or (N m)².
    pub(super) variance: f64,
    /// Mean product of residuals at a lag of `lag_s`.
    pub(super) product: f64,
    /// Lag of `product`, s.
    pub(super) lag_s: f64,
}

/// Statistics of the motion so far, by axis.
pub(super) struct MotionStatistics<'a> {
    /// Standard deviation of a sample of velocity, m/s or rad/s.
    pub(super) velocity: Vector6<f64>,
    /// Root mean square of force, N or N m.
    pub(super) force: Vector6<f64>,
    /// Mass matrix M.
    pub(super) mass: &'a Matrix6<f64>,
    /// The step between two samples, s.
    pub(super) step_s: f64,
    /// The corner of the filter of least squares, rad/s.
    pub(super) corner_rad_s: f64,
}

impl JointNoise {
    /// Estimates the noise from the residuals: white noise on velocity, and a force f with
    /// `ḟ = −f/T + w` on each axis.
    pub(super) fn estimate(
        axes: &[Option<usize>; 6],
        residual_statistics: impl Iterator<Item = ResidualStatistics>,
        motion: &MotionStatistics<'_>,
    ) -> Self {
        let mut noise = Self {
            velocity: Vector6::repeat(1.0),
            disturbance: Vector6::repeat(1.0),
            correlation_s: Vector6::repeat(LONGEST_S),
        };
        for residual in residual_statistics {
            let i = residual.axis;
            let Some(place) = axes.iter().position(|axis| *axis == Some(i)) else { continue };
            let (std, correlation_s) = disturbance(&residual, motion);
            noise.velocity[place] = motion.velocity[i].max(f64::EPSILON);
            noise.disturbance[place] =
                std.max(LEAST_DISTURBANCE * motion.force[i]).max(f64::EPSILON);
            noise.correlation_s[place] = correlation_s;
        }
        noise
    }
}

/// Estimates standard deviation, N or N m, and correlation time, s, of the force on an axis from
/// its residual.
///
/// Velocity noise of variance s² contributes `m² s² h ω³/4 (1 − ω L) e^(−ω L)` to the filtered
/// residual at the lag L; the rest is due to the force.
fn disturbance(residual: &ResidualStatistics, motion: &MotionStatistics<'_>) -> (f64, f64) {
    let (omega, lag) = (motion.corner_rad_s, residual.lag_s);
    let of_noise = (motion.mass[(residual.axis, residual.axis)] * motion.velocity[residual.axis])
        .powi(2)
        * motion.step_s
        * omega.powi(3)
        * 0.25;
    let variance = residual.variance - of_noise;
    if variance <= 0.0 {
        return (0.0, LONGEST_S);
    }
    let product = residual.product - of_noise * (1.0 - omega * lag) * (-omega * lag).exp();
    let ratio = product / variance;
    let alike =
        |time_s: f64| filtered(omega, 1.0 / time_s, lag) / filtered(omega, 1.0 / time_s, 0.0);
    let (mut short, mut long) = (SHORTEST_STEPS * motion.step_s, LONGEST_S);
    for _ in 0..HALVINGS {
        let middle = (short * long).sqrt();
        if alike(middle) < ratio { short = middle } else { long = middle }
    }
    let time_s = (short * long).sqrt();
    ((variance / filtered(omega, 1.0 / time_s, 0.0)).sqrt(), time_s)
}

/// Computes the autocovariance at a lag L of a force with variance 1 and autocovariance
/// `e^(−a|τ|)`, filtered by `1/(1 + s/ω)²`:
///
/// ```text
/// ∫ ω/4 (1 + ω|τ|) e^(−ω|τ|) e^(−a|L − τ|) dτ
/// ```
fn filtered(omega: f64, a: f64, lag: f64) -> f64 {
    let (sum, less) = (omega + a, omega - a);
    let fade = (-a * lag).exp();
    let before = fade * (1.0 / sum + omega / (sum * sum));
    let after = (-omega * lag).exp() * (1.0 / sum + omega * (lag / sum + 1.0 / (sum * sum)));
    let within = if (less * lag).abs() < 1e-4 {
        lag + 0.5 * omega * lag * lag
    } else {
        let gone = (-less * lag).exp();
        (1.0 - gone) / less + omega * ((1.0 - gone) / (less * less) - gone * lag / less)
    };
    0.25 * omega * (before + fade * within + after)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Error of an integral by 20 000 trapezoids.
    const TRAPEZOIDS: f64 = 1e-5;

    #[test]
    fn autocovariance_matches_numerical_integration() {
        let omega = 3.0;
        for (a, lag) in [(0.1, 0.9), (3.0, 1.0), (12.0, 0.5), (0.7, 0.0)] {
            let at = |t: f64| {
                0.25 * omega
                    * (1.0 + omega * t.abs())
                    * (-omega * t.abs() - a * (lag - t).abs()).exp()
            };
            let h = 2e-3;
            let sum: f64 = (-10_000..10_000).map(|k| h * at(h * f64::from(k))).sum();
            let found = filtered(omega, a, lag);
            assert!((found - sum).abs() < TRAPEZOIDS, "{a} {lag}: {found} against {sum}");
        }
    }

    #[test]
    fn recovers_a_force_from_the_residual_it_causes() {
        let (omega, lag_s, mass) = (3.0, 1.0, Matrix6::identity() * 20.0);
        let velocity = Vector6::repeat(0.01);
        let motion = MotionStatistics {
            velocity,
            force: velocity,
            mass: &mass,
            step_s: 0.1,
            corner_rad_s: omega,
        };
        let of_noise = (20.0_f64 * 0.01).powi(2) * 0.1 * omega.powi(3) / 4.0;
        for (std, time_s) in [(4.0, 0.5), (2.0, 5.0), (3.0, 20.0)] {
            let force = |lag| std * std * filtered(omega, 1.0 / time_s, lag);
            let residual = ResidualStatistics {
                axis: 2,
                variance: force(0.0) + of_noise,
                product: force(lag_s) + of_noise * (1.0 - omega) * (-omega).exp(),
                lag_s,
            };
            let (found, found_s) = disturbance(&residual, &motion);
            assert!((found / std - 1.0).abs() < 0.01, "{found} of {std} N");
            assert!((found_s / time_s - 1.0).abs() < 0.01, "{found_s} of {time_s} s");
        }
    }

    #[test]
    fn velocity_noise_is_not_taken_for_a_force() {
        let mass = Matrix6::identity() * 20.0;
        let velocity = Vector6::repeat(0.1);
        let motion = MotionStatistics {
            velocity,
            force: velocity,
            mass: &mass,
            step_s: 0.1,
            corner_rad_s: 3.0,
        };
        let residual = ResidualStatistics { axis: 0, variance: 0.1, product: 0.0, lag_s: 1.0 };
        assert_eq!(disturbance(&residual, &motion).0, 0.0);
    }
}
