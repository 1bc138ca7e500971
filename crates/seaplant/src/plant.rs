//! Plants: the equation of motion of any set of axes, and the lumped and physical parameters of
//! one.
//!
//! ```text
//! M ν̇_r + C(M, ν_r) ν_r + D(ν_r) ν_r + (further terms) + g(η) = τ,     ν_r = ν − R(η)ᵀ u_c
//! ```
//!
//! A [`Structure`] lists the terms, each a [`Basis`] with its regressor; a [`Plant`] adds their
//! coefficients; a [`Parameterisation`] maps free parameters to physically possible coefficients.
//! With a constant irrotational current only the total M is identifiable, and C follows from it.

mod basis;
mod coefficients;
mod effect;
mod foil;
mod hull;
pub(crate) mod lumped;
mod notation;
mod open_water;
mod parameterisation;
mod rigid_body;
mod structure;

pub(crate) use basis::own_terms;
pub use basis::{Basis, Factor, Instant, NO_WAY, Product};
pub(crate) use basis::{kirchhoff, kirchhoff_slope, sign};
pub use coefficients::Plant;
pub use effect::{Effect, EffectForce, Pusher, Signal, ThrusterNumber};
pub(crate) use effect::{MOST_READ, hull_way};
pub use foil::{Foil, PropellerAhead};
pub use hull::HullModel;
pub use open_water::{OpenWater, RudderFlow, WakeByDrift};
pub use parameterisation::{Parameterisation, Physical, Plain};
pub use rigid_body::{Buoyancy, GRAVITY, RigidBody};
pub(crate) use structure::name_of_axes;
pub use structure::{Structure, Symmetry};
