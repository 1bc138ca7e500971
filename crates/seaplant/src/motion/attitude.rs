//! Interpolation of attitude, and rotations by it.

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::Timed;

/// Returns `R(η)ᵀ`, which rotates a vector from the world's frame to the body's; `angles` are roll,
/// pitch and heading, rad.
pub(crate) fn body_from_world(angles: [f64; 3]) -> Matrix3<f64> {
    let [roll, pitch, heading] = angles;
    Rotation3::from_euler_angles(roll, pitch, heading).matrix().transpose()
}

/// Returns k = R(η)ᵀ e₃, the world's down in body axes; rad in, shape (3,) out.
///
/// ```
/// let k = seaplant::motion::down_body(0.0, 0.1);
/// assert!((k.x + 0.1_f64.sin()).abs() < 1e-12);
/// ```
pub fn down_body(roll: f64, pitch: f64) -> Vector3<f64> {
    Vector3::new(-pitch.sin(), pitch.cos() * roll.sin(), pitch.cos() * roll.cos())
}

/// Returns T(Θ), which turns p, q and r into the rates of roll, pitch and heading; rad in, shape (3, 3)
/// out [Fossen2021, eq. 2.41].
pub(crate) fn euler_rates(roll: f64, pitch: f64) -> Matrix3<f64> {
    let ((s, c), tangent, cosine) = (roll.sin_cos(), pitch.tan(), pitch.cos());
    Matrix3::new(1.0, s * tangent, c * tangent, 0.0, c, -s, 0.0, s / cosine, c / cosine)
}

/// Interpolates a series by the cubic through the four samples around a time; zero without a
/// series.
///
/// Linear interpolation between samples 0.1 s apart reduces an oscillation at 4 rad/s, and with it
/// the righting moment, by 1 to 2 %; the cubic by 0.01 %.
pub(crate) fn interpolated(series: Option<&Timed>, t_s: f64) -> f64 {
    let Some(series) = series else { return 0.0 };
    let (time_s, x) = (series.time_s(), series.values());
    let after = series.reached(t_s);
    // At the ends and across gaps, interpolation is linear.
    let is_inside = after >= 2 && after + 1 < time_s.len();
    let regular = |from: usize| time_s[from + 1] - time_s[from] < 2.0 * series.period_s();
    if !is_inside || !(after - 2..=after).all(regular) {
        return series.at(t_s);
    }
    let nodes: [f64; 4] = std::array::from_fn(|j| time_s[after - 2 + j]);
    let others = |j: usize| (0..4).filter(move |k| *k != j);
    let weight = |j: usize| {
        let above: f64 = others(j).map(|k| t_s - nodes[k]).product();
        let below: f64 = others(j).map(|k| nodes[j] - nodes[k]).product();
        above / below
    };
    (0..4).map(|j| weight(j) * x[after - 2 + j]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn down_agrees_with_the_rotation_matrix() {
        let (roll, pitch) = (0.4, -0.7);
        let k = body_from_world([roll, pitch, 2.0]) * Vector3::z();
        assert!((k - down_body(roll, pitch)).norm() < 1e-12);
    }

    #[test]
    fn a_fast_oscillation_keeps_its_amplitude_between_samples() {
        let time_s: Vec<f64> = (0..100).map(|k| 0.1 * f64::from(k)).collect();
        let roll = |t: f64| (4.0 * t).sin();
        let values: Vec<f64> = time_s.iter().map(|&t| roll(t)).collect();
        let angle = Timed::new("roll", time_s, values).expect("valid");
        let worst = (20..900).map(|k| 0.01 * f64::from(k));
        let worst = worst.map(|t| (interpolated(Some(&angle), t) - roll(t)).abs());
        assert!(worst.fold(0.0, f64::max) < 2e-3);
    }
}
