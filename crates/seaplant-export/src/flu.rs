//! Converts from x forward, y starboard, z down to x forward, y port, z up.

use nalgebra::{Matrix3, Matrix6, Vector3};
use seaplant::Dof;
use seaplant::plant::Product;

/// Returns the sign of an axis's force or velocity: T = diag(1, −1, −1, 1, −1, −1).
pub(crate) const fn sign(dof: Dof) -> f64 {
    match dof {
        Dof::Surge | Dof::Roll => 1.0,
        Dof::Sway | Dof::Heave | Dof::Pitch | Dof::Yaw => -1.0,
    }
}

/// Computes `T M T`.
pub(crate) fn matrix(m: &Matrix6<f64>) -> Matrix6<f64> {
    Matrix6::from_fn(|i, j| sign(Dof::ALL[i]) * sign(Dof::ALL[j]) * m[(i, j)])
}

/// Converts a vector in body axes.
pub(crate) fn vector(v: &Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, -v.y, -v.z)
}

/// Converts an inertia.
pub(crate) fn inertia(m: &Matrix3<f64>) -> Matrix3<f64> {
    let t = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
    t * m * t
}

/// Returns the sign of a product's coefficient: of its row and of each factor except moduli.
pub(crate) fn of_product(on: Dof, product: &Product) -> f64 {
    let plain = product.factors().filter(|factor| !factor.modulus);
    sign(on) * plain.map(|factor| sign(factor.of)).product::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use seaplant::plant::Basis;

    fn flips(term: &str) -> bool {
        let Ok(Basis::Product(on, product)) = term.parse() else { panic!("{term}") };
        of_product(on, &product) < 0.0
    }

    #[test]
    fn only_the_odd_couplings_turn_their_sign() {
        let kept = ["surge: u", "sway: r", "yaw: v", "heave: q", "pitch: w", "yaw: uv", "sway: ur"];
        let turned = [
            "surge: w",
            "surge: q",
            "heave: u",
            "pitch: u",
            "heave: uu",
            "pitch: uu",
            "roll: v",
            "roll: r",
            "sway: p",
            "yaw: p",
        ];
        assert!(kept.into_iter().all(|term| !flips(term)));
        assert!(turned.into_iter().all(flips));
        let mut m = Matrix6::zeros();
        for (i, j) in [(0, 2), (0, 4), (1, 3), (3, 5), (2, 4), (1, 5)] {
            m[(i, j)] = 1.0;
        }
        let turned = matrix(&m);
        for (i, j) in [(0, 2), (0, 4), (1, 3), (3, 5)] {
            assert_eq!(turned[(i, j)], -1.0, "{i} {j}");
        }
        assert_eq!((turned[(2, 4)], turned[(1, 5)]), (1.0, 1.0));
    }
}
