//! Measurements and inputs at an instant.

use nalgebra::{Vector3, Vector6};

/// Maximum number of signals that the effects of a plant may use.
pub const MOST_SIGNALS: usize = 32;

/// Measurements and inputs at an instant; body frame, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time, s.
    pub time_s: f64,
    /// ν_r on all six axes, m/s and rad/s, including axes outside the plant.
    pub velocity: Vector6<f64>,
    /// k = Rᵀ e₃, see [`crate::motion::down_body`].
    pub down_body: Vector3<f64>,
    /// τ, mean from this instant to the next, N and N m.
    pub force: Vector6<f64>,
    /// Signals of the plant's effects, in the order of
    /// [`Structure::signals`](crate::plant::Structure::signals): angles and wind at this instant,
    /// held inputs from this instant to the next; zero beyond them.
    pub signals: [f64; MOST_SIGNALS],
}

impl Default for Sample {
    /// Returns a sample at rest, level, without force.
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
