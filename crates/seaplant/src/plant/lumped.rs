//! The four parameters of one degree of freedom.

use std::fmt;

use nalgebra::{Matrix4, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::caveat::spoken;

/// Lumped parameters of `v̇ = α τ + β v|v| + μ v + bias`.
///
/// # Source
/// [Jason2, eq. (4)]; the paper writes `bias` as ν.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LumpedParameters {
    /// α = 1/m, 1/kg or 1/(kg m²).
    pub alpha: f64,
    /// β = −d_Q/m, 1/m or 1.
    pub beta: f64,
    /// μ = −d_L/m, 1/s.
    pub mu: f64,
    /// −b/m, m/s² or rad/s².
    pub bias: f64,
}

/// Physical parameters of `τ = m v̇ + d_Q v|v| + d_L v + b`.
///
/// # Source
/// [Jason2, eq. (2)].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PhysicalParameters {
    /// Rigid-body plus added mass m, kg or kg m².
    pub mass: f64,
    /// d_Q, N/(m/s)² or N m/(rad/s)².
    pub d_quadratic: f64,
    /// d_L, N/(m/s) or N m/(rad/s).
    pub d_linear: f64,
    /// b, N or N m.
    pub bias_force: f64,
}

/// Stability of a plant without thrust.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Stability {
    /// Drag opposes motion at every speed.
    Stable,
    /// Drag opposes motion only below a speed; beyond it velocity diverges.
    StableBelow {
        /// The limit, m/s or rad/s.
        speed: f64,
    },
    /// Rest is unstable: the model accelerates to a limit speed.
    UnstableAtRest {
        /// The limit, m/s or rad/s.
        speed: f64,
    },
    /// Nothing opposes motion.
    Unstable,
}

impl LumpedParameters {
    /// Returns the acceleration at a force and a velocity.
    #[inline]
    pub fn acceleration(&self, tau: f64, v: f64) -> f64 {
        self.alpha * tau + (self.beta * v.abs() + self.mu) * v + self.bias
    }

    /// Returns `[α, β, μ, bias]`.
    pub fn to_vector(self) -> Vector4<f64> {
        Vector4::new(self.alpha, self.beta, self.mu, self.bias)
    }

    /// Creates parameters from `[α, β, μ, bias]`.
    pub fn from_vector(theta: &Vector4<f64>) -> Self {
        Self { alpha: theta[0], beta: theta[1], mu: theta[2], bias: theta[3] }
    }

    /// Converts to m = 1/α, d_Q = −β/α, d_L = −μ/α, b = −bias/α.
    ///
    /// # Source
    /// [Jason2, table 2].
    ///
    /// ```
    /// use seaplant::LumpedParameters;
    /// let surge = LumpedParameters { alpha: 7.71e-5, beta: -1.72e-1, mu: 0.0, bias: 1.97e-2 };
    /// assert!((surge.to_physical().mass - 12970.2).abs() < 0.1);
    /// ```
    pub fn to_physical(self) -> PhysicalParameters {
        PhysicalParameters {
            mass: 1.0 / self.alpha,
            d_quadratic: -self.beta / self.alpha,
            d_linear: -self.mu / self.alpha,
            bias_force: -self.bias / self.alpha,
        }
    }

    /// Propagates the covariance of `[α, β, μ, bias]` to that of `[m, d_Q, d_L, b]`, to first
    /// order.
    pub fn physical_covariance(&self, lumped: &Matrix4<f64>) -> Matrix4<f64> {
        let a = self.alpha;
        let of_alpha = Vector4::new(-1.0, self.beta, self.mu, self.bias) / (a * a);
        let mut jacobian = Matrix4::from_diagonal_element(-1.0 / a);
        jacobian.set_column(0, &of_alpha);
        jacobian * lumped * jacobian.transpose()
    }

    /// Determines whether the plant comes to rest without thrust.
    ///
    /// ```
    /// use seaplant::{LumpedParameters, Stability};
    /// let plant = LumpedParameters { alpha: 1e-4, beta: -0.2, mu: 0.1, bias: 0.0 };
    /// assert_eq!(plant.stability(), Stability::UnstableAtRest { speed: 0.5 });
    /// ```
    pub fn stability(&self) -> Stability {
        let (beta, mu) = (self.beta, self.mu);
        if beta <= 0.0 && mu <= 0.0 && beta + mu < 0.0 {
            Stability::Stable
        } else if beta > 0.0 && mu < 0.0 {
            Stability::StableBelow { speed: -mu / beta }
        } else if beta < 0.0 && mu > 0.0 {
            Stability::UnstableAtRest { speed: -mu / beta }
        } else {
            Stability::Unstable
        }
    }
}

impl PhysicalParameters {
    /// Converts to α = 1/m, β = −d_Q/m, μ = −d_L/m, bias = −b/m.
    pub fn to_lumped(self) -> LumpedParameters {
        LumpedParameters {
            alpha: 1.0 / self.mass,
            beta: -self.d_quadratic / self.mass,
            mu: -self.d_linear / self.mass,
            bias: -self.bias_force / self.mass,
        }
    }
}

impl Stability {
    /// Returns whether drag opposes motion at every speed.
    pub fn is_stable(&self) -> bool {
        matches!(self, Self::Stable)
    }
}

impl fmt::Display for Stability {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stable => write!(f, "stable"),
            Self::StableBelow { speed } => write!(f, "diverges beyond {}", spoken(*speed)),
            Self::UnstableAtRest { speed } => {
                write!(f, "moves without thrust, up to {}", spoken(*speed))
            }
            Self::Unstable => write!(f, "unstable"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn propagates_covariance_from_lumped_to_physical() {
        let plant = LumpedParameters { alpha: 1e-4, beta: -0.2, mu: -0.01, bias: 0.02 };
        let std = Vector4::new(1e-6, 2e-3, 1e-3, 1e-4);
        let covariance = Matrix4::from_diagonal(&std.component_mul(&std));
        let physical = plant.physical_covariance(&covariance);
        // By hand: sd(m) = sd(α)/α²; sd(d_Q)² = (sd(β)/α)² + (β sd(α)/α²)².
        assert!((physical[(0, 0)].sqrt() - 100.0).abs() < 1e-9);
        assert!((physical[(1, 1)].sqrt() - (20_f64.powi(2) + 20_f64.powi(2)).sqrt()).abs() < 1e-9);
    }

    #[test]
    fn distinguishes_the_types_of_instability() {
        let plant = |beta, mu| LumpedParameters { alpha: 1.0, beta, mu, bias: 0.0 }.stability();
        assert_eq!(plant(-1.0, 0.0), Stability::Stable);
        assert_eq!(plant(0.0, -1.0), Stability::Stable);
        assert_eq!(plant(0.5, -1.0), Stability::StableBelow { speed: 2.0 });
        assert_eq!(plant(0.0, 0.0), Stability::Unstable);
        assert_eq!(plant(1.0, 1.0), Stability::Unstable);
    }
}
