//! The motion of a plant: ν̇ with its derivatives, and simulation in small steps.

mod attitude;
mod flow;
mod held;
mod known;
mod pair;
mod products;
mod rate;
mod simulate;
mod smooth;
mod state_space;

use nalgebra::{Vector3, Vector6};

pub use attitude::down_body;
pub(crate) use attitude::{body_from_world, euler_rates, interpolated as interpolated_attitude};
pub(crate) use flow::{Around, Decay, Flow, HeldForces, PUSHED_BY, Slice, advance, with_down};
pub use known::{KnownForce, KnownKind};
pub(crate) use known::{Load, acting as known_at, changes as known_changes};
pub(crate) use products::{
    apply, subtract_outer, subtract_outers, times, times_sparse_transposed, times_transposed,
};
pub(crate) use rate::Prepared;
pub(crate) use simulate::Moving;
pub use simulate::{Inputs, Simulated, Wind, simulate};
pub(crate) use smooth::smoothed_attitude;
pub use state_space::{STATE_NAMES, State, StateSpace};

use crate::Error;
use crate::plant::Plant;

/// Evaluates an expression with a number of axes, rounded up to 1, 3, 4 or 6, as a constant. Each
/// size costs time to compile.
macro_rules! with_places {
    ($n:expr, $N:ident => $body:expr) => {
        match $n {
            1 => {
                const $N: usize = 1;
                $body
            }
            2 | 3 => {
                const $N: usize = 3;
                $body
            }
            4 => {
                const $N: usize = 4;
                $body
            }
            _ => {
                const $N: usize = 6;
                $body
            }
        }
    };
}
pub(crate) use with_places;

impl Plant {
    /// Returns `ν̇_r = M⁻¹ (τ − n(ν_r, η))` on the plant's axes, zero on others; m/s² and rad/s²,
    /// shape (6,).
    ///
    /// `force` and `velocity` (relative to the water) have shape (6,). On axes outside the plant,
    /// force has no effect and velocity is prescribed: it contributes to the Coriolis terms. The
    /// signals of effects are zero.
    ///
    /// # Errors
    /// [`Error::Plant`] if M cannot be inverted.
    ///
    /// # Example
    /// ```
    /// use nalgebra::{Vector3, Vector6};
    /// use seaplant::Dof;
    /// use seaplant::plant::{Plant, Structure, Symmetry};
    /// let surge = Structure::of(&[Dof::Surge], Symmetry::None)?;
    /// let plant = Plant::new(surge, vec![100.0, 5.0, 20.0])?;
    /// let (mut force, mut velocity) = (Vector6::zeros(), Vector6::zeros());
    /// (force[0], velocity[0]) = (50.0, 1.0);
    /// let rate = plant.acceleration(&force, &velocity, &Vector3::z())?;
    /// assert!((rate[0] - 0.25).abs() < 1e-12);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn acceleration(
        &self,
        force: &Vector6<f64>,
        velocity: &Vector6<f64>,
        down_body: &Vector3<f64>,
    ) -> Result<Vector6<f64>, Error> {
        Ok(Prepared::of_six(self, None)?.rate(velocity, down_body, force, &[]))
    }
}
