//! Rotations outside a plant: their Euler angles stay constant.

use nalgebra::{Matrix3, Vector3, Vector6};

use crate::Dof;
use crate::plant::Plant;

/// ω of a vehicle with some Euler angles held, with its derivatives.
pub(crate) struct HeldTurn {
    /// ω, rad/s.
    pub(crate) omega: Vector3<f64>,
    /// ∂ω by the given rates, shape (3, 3); columns of other rates are zero.
    pub(crate) by_rates: Matrix3<f64>,
    /// ∂ω by the world's down in body axes, shape (3, 3).
    pub(crate) by_down: Matrix3<f64>,
}

/// Returns ω from the rates of some rotations while the Euler angles of the others are held.
///
/// `ω = φ̇ e₁ + θ̇ (0, k_z, −k_y)/√(k_y² + k_z²) + ψ̇ k` with k the world's down in body axes; the
/// Euler rates of held angles are zero, and those of the others follow from their p, q and r.
/// `moves` marks roll, pitch and yaw with a given rate; other entries of `rates` are ignored.
pub(crate) fn held_turn(moves: [bool; 3], rates: &Vector3<f64>, down: &Vector3<f64>) -> HeldTurn {
    let (q, r) = (rates.y, rates.z);
    let (kx, ky, kz) = (down.x, down.y, down.z);
    let mut by_rates = Matrix3::zeros();
    let mut by_down = Matrix3::zeros();
    for axis in (0..3).filter(|axis| moves[*axis]) {
        by_rates[(axis, axis)] = 1.0;
    }
    match moves {
        [_, true, true] if !moves[0] => {
            // p = k_x ψ̇, ψ̇ = (q k_y + r k_z)/(k_y² + k_z²).
            let square = ky * ky + kz * kz;
            let heading = (q * ky + r * kz) / square;
            by_rates[(0, 1)] = kx * ky / square;
            by_rates[(0, 2)] = kx * kz / square;
            by_down[(0, 0)] = heading;
            by_down[(0, 1)] = kx * (q - 2.0 * ky * heading) / square;
            by_down[(0, 2)] = kx * (r - 2.0 * kz * heading) / square;
        }
        [rolls, false, true] => {
            // ψ̇ = r/k_z rotates about k: p = k_x ψ̇, q = k_y ψ̇.
            let held = if rolls { 1..2 } else { 0..2 };
            for axis in held {
                by_rates[(axis, 2)] = down[axis] / kz;
                by_down[(axis, axis)] = r / kz;
                by_down[(axis, 2)] = -r * down[axis] / (kz * kz);
            }
        }
        [_, true, false] => {
            // θ̇ rotates about (0, k_z, −k_y).
            by_rates[(2, 1)] = -ky / kz;
            by_down[(2, 1)] = -q / kz;
            by_down[(2, 2)] = q * ky / (kz * kz);
        }
        _ => {}
    }
    HeldTurn { omega: by_rates * rates, by_rates, by_down }
}

/// Returns whether roll, pitch and yaw are axes of a plant.
pub(crate) fn rotations(plant: &Plant) -> [bool; 3] {
    [Dof::Roll, Dof::Pitch, Dof::Yaw].map(|dof| plant.axes().contains(&dof))
}

impl Plant {
    /// Returns a velocity with p, q and r of rotations outside the plant set to the values that
    /// hold their Euler angles; m/s and rad/s, shape (6,).
    ///
    /// A pitched vehicle that turns keeps its roll angle not by `p = 0` but by `p = −ψ̇ sin θ`. The
    /// rates of such rotations in `velocity` are ignored; `down_body` is the world's down in body
    /// axes.
    ///
    /// # Example
    /// ```
    /// use nalgebra::Vector6;
    /// use seaplant::Dof;
    /// use seaplant::motion::down_body;
    /// use seaplant::plant::{Plant, Structure, Symmetry};
    /// let structure = Structure::of(&[Dof::Surge, Dof::Pitch, Dof::Yaw], Symmetry::Diagonal)?;
    /// let plant = Plant::new(structure.clone(), vec![1.0; structure.terms().len()])?;
    /// let velocity = Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.2);
    /// let held = plant.with_held_angles(&velocity, &down_body(0.0, 0.3));
    /// // r = ψ̇ cos θ.
    /// assert!((held[3] + 0.2 * 0.3_f64.tan()).abs() < 1e-12);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn with_held_angles(
        &self,
        velocity: &Vector6<f64>,
        down_body: &Vector3<f64>,
    ) -> Vector6<f64> {
        let mut held = *velocity;
        let rates = velocity.fixed_rows::<3>(3).into_owned();
        let turn = held_turn(rotations(self), &rates, down_body);
        held.fixed_rows_mut::<3>(3).copy_from(&turn.omega);
        held
    }
}

#[cfg(test)]
mod tests {
    use super::super::down_body;
    use super::*;

    /// Returns the rates of roll, pitch and heading due to ω, [Fossen2021, eq. (2.41)].
    fn euler_rates(roll: f64, pitch: f64, omega: &Vector3<f64>) -> [f64; 3] {
        let across = omega.y * roll.sin() + omega.z * roll.cos();
        [
            omega.x + pitch.tan() * across,
            omega.y * roll.cos() - omega.z * roll.sin(),
            across / pitch.cos(),
        ]
    }

    fn sets() -> impl Iterator<Item = [bool; 3]> {
        (0..8).map(|k| [k & 1 != 0, k & 2 != 0, k & 4 != 0])
    }

    #[test]
    fn angles_of_rotations_that_a_plant_lacks_do_not_change() {
        let (roll, pitch) = (0.4, -0.7);
        let rates = Vector3::new(0.3, -0.5, 0.9);
        for moves in sets() {
            let found = held_turn(moves, &rates, &down_body(roll, pitch)).omega;
            let angles = euler_rates(roll, pitch, &found);
            for axis in 0..3 {
                if moves[axis] {
                    assert_eq!(found[axis], rates[axis], "{moves:?}");
                } else {
                    assert!(angles[axis].abs() < 1e-12, "{moves:?}: {angles:?}");
                }
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_rates() {
        let (rates, down) = (Vector3::new(0.3, -0.5, 0.9), down_body(0.4, -0.7));
        for moves in sets() {
            let found = held_turn(moves, &rates, &down);
            for k in 0..3 {
                let step = Vector3::ith(k, 1e-6);
                let by = |a: HeldTurn, b: HeldTurn| (a.omega - b.omega) / 2e-6;
                let rate = by(
                    held_turn(moves, &(rates + step), &down),
                    held_turn(moves, &(rates - step), &down),
                );
                assert!((rate - found.by_rates.column(k)).amax() < 1e-8, "{moves:?} {k}");
                let tilt = by(
                    held_turn(moves, &rates, &(down + step)),
                    held_turn(moves, &rates, &(down - step)),
                );
                assert!((tilt - found.by_down.column(k)).amax() < 1e-8, "{moves:?} {k}");
            }
        }
    }
}
