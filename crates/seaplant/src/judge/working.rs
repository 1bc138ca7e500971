//! Speed at which a plant was driven, and its drag there.

use nalgebra::Vector4;

use crate::{AxisRecord, Estimate, Fit};

/// Returns the root mean square speed of some records, m/s or rad/s; 0 without any.
pub(crate) fn working_speed(axes: &[AxisRecord]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for velocity in axes.iter().filter_map(|axis| axis.velocity().ok()) {
        sum += velocity.values().iter().map(|v| v * v).sum::<f64>();
        count += velocity.len();
    }
    (sum / count.max(1) as f64).sqrt()
}

/// Computes the drag `d_Q v|v| + d_L v` at a speed, N or N m. Where linear and quadratic drag are
/// hardly separable, their sum may still be well determined.
pub(crate) fn drag_at(fit: &Fit, speed: f64) -> Estimate {
    let physical = fit.physical();
    let covariance = fit.lumped.physical_covariance(&fit.covariance);
    let of = Vector4::new(0.0, speed * speed.abs(), speed, 0.0);
    let value = physical.d_quadratic * of[1] + physical.d_linear * of[2];
    Estimate::new(value, of.dot(&(covariance * of)).max(0.0).sqrt(), fit.t_freedom)
}
