//! What is known at an instant.

use nalgebra::{Vector3, Vector6};

/// The most signals that the effects of a plant may read.
pub const MOST_SIGNALS: usize = 32;

/// What is known at an instant; body frame, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// When, s.
    pub time_s: f64,
    /// ν_r on all six axes, m/s and rad/s; of axes that the plant does not have, too.
    pub velocity: Vector6<f64>,
    /// k = Rᵀ e₃, see [`crate::motion::down_body`].
    pub down_body: Vector3<f64>,
    /// τ from this instant to the next, N and N m.
    pub force: Vector6<f64>,
    /// What the plant's effects read, in the order of [`Structure::signals`](crate::plant::Structure::signals): angles and the
    /// wind at this instant, drives from this instant to the next; zero beyond them.
    pub signals: [f64; MOST_SIGNALS],
}

impl Default for Sample {
    /// At rest, level, without force.
    fn default() -> Self {
        Self {
            time_s: 0.0,
            velocity: Vector6::zeros(),
            down_body: Vector3::z(),
            force: Vector6::zeros(),
            signals: [0.0; MOST_SIGNALS],
        }
    }
}
