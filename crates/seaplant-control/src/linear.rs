//! Closed loop at a speed, as a discrete-time linear system with the controller's period.

use nalgebra::{DMatrix, Vector3, Vector6};
use seaplant::plant::{Basis, Plant};

use crate::Actuators;

/// Gains at a working point, N/m, N/(m/s), N/(m s) by index of the plant's axes.
#[derive(Clone, Debug)]
pub(crate) struct LinearGains {
    pub(crate) kp: DMatrix<f64>,
    pub(crate) kd: DMatrix<f64>,
    pub(crate) ki: DMatrix<f64>,
}

/// Step of velocity for numerical slopes, m/s and rad/s.
const STEP: f64 = 1e-5;

/// Returns ∂n/∂ν of the plant's axes at a velocity, shape (n, n): damping and Coriolis.
pub(crate) fn slope(plant: &Plant, velocity: &Vector6<f64>) -> DMatrix<f64> {
    let axes = plant.axes();
    let mut slope = DMatrix::zeros(axes.len(), axes.len());
    for (j, of) in axes.iter().enumerate() {
        let at = |step: f64| {
            let mut moved = *velocity;
            moved[of.index()] += step;
            plant.resistance(&moved, &Vector3::z())
        };
        let by = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        for (i, on) in axes.iter().enumerate() {
            slope[(i, j)] = by[on.index()];
        }
    }
    slope
}

/// Returns the righting stiffness of a level vehicle, N m/rad, on the diagonal of the plant's axes.
pub(crate) fn righting(plant: &Plant) -> DMatrix<f64> {
    let lever = plant.coefficient(&Basis::Lever(2)).unwrap_or(0.0);
    let of = |dof: &seaplant::Dof| match dof {
        seaplant::Dof::Roll | seaplant::Dof::Pitch => lever,
        _ => 0.0,
    };
    DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(
        plant.axes().len(),
        plant.axes().iter().map(of),
    ))
}

/// Returns the growth of the slowest-decaying disturbance in one step of the controller: below 1 if
/// the loop is stable.
///
/// States are displacement, velocity, force after the lag, the integral and delayed commands;
/// between steps the plant moves under the held command. A delay is rounded up to complete steps.
pub(crate) fn growth(
    plant: &Plant,
    (damping, righting): (&DMatrix<f64>, &DMatrix<f64>),
    gains: &LinearGains,
    actuators: &Actuators,
    period_s: f64,
) -> Option<f64> {
    let n = plant.axes().len();
    let inverse = plant.mass_matrix().try_inverse()?;
    let lags: Vec<f64> = plant.axes().iter().map(|dof| actuators.lag_s[dof.index()]).collect();
    let delay = plant.axes().iter().map(|dof| actuators.delay_s[dof.index()]).fold(0.0, f64::max);
    let late = (delay / period_s - 1e-9).ceil().max(0.0) as usize;
    // ẋ = v, v̇ = M⁻¹ (f − D v − G x), ḟ = (u − f)/T; u is held.
    let mut a = DMatrix::zeros(4 * n, 4 * n);
    let restoring = &inverse * righting;
    let damped = &inverse * damping;
    for i in 0..n {
        a[(i, n + i)] = 1.0;
        for j in 0..n {
            a[(n + i, j)] = -restoring[(i, j)];
            a[(n + i, n + j)] = -damped[(i, j)];
            let column = if lags[j] > 0.0 { 2 * n + j } else { 3 * n + j };
            a[(n + i, column)] = inverse[(i, j)];
        }
        if lags[i] > 0.0 {
            a[(2 * n + i, 2 * n + i)] = -1.0 / lags[i];
            a[(2 * n + i, 3 * n + i)] = 1.0 / lags[i];
        }
    }
    let moved = (a * period_s).exp();
    // x, v, f, ∫x, delayed u, the oldest first.
    let (size, first) = (4 * n + late * n, 4 * n);
    let mut step = DMatrix::zeros(size, size);
    step.view_mut((0, 0), (3 * n, 3 * n)).copy_from(&moved.view((0, 0), (3 * n, 3 * n)));
    step.view_mut((3 * n, 3 * n), (n, n)).fill_with_identity();
    for i in 0..n {
        step[(3 * n + i, i)] = period_s;
    }
    let mut command = DMatrix::zeros(n, size);
    command.view_mut((0, 0), (n, n)).copy_from(&-&gains.kp);
    command.view_mut((0, n), (n, n)).copy_from(&-&gains.kd);
    command.view_mut((0, 3 * n), (n, n)).copy_from(&-&gains.ki);
    let by_command = moved.view((0, 3 * n), (3 * n, n)).into_owned();
    if late == 0 {
        let mut top = step.view_mut((0, 0), (3 * n, size));
        top += &by_command * &command;
    } else {
        step.view_mut((0, first), (3 * n, n)).copy_from(&by_command);
        for k in 0..late - 1 {
            step.view_mut((first + k * n, first + (k + 1) * n), (n, n)).fill_with_identity();
        }
        step.view_mut((size - n, 0), (n, size)).copy_from(&command);
    }
    Some(spectral_radius(step))
}

/// Number of squarings for a spectral radius accurate to a millionth.
const SQUARINGS: i32 = 26;

/// Computes `lim ‖Aᵏ‖^(1/k)` by squaring, which, unlike an iteration for eigenvalues, always
/// terminates.
fn spectral_radius(mut matrix: DMatrix<f64>) -> f64 {
    let mut logarithm = 0.0;
    for k in 0..SQUARINGS {
        let norm = matrix.norm();
        if !(norm > 0.0 && norm.is_finite()) {
            return if norm == 0.0 { 0.0 } else { f64::INFINITY };
        }
        logarithm += norm.ln() / 2_f64.powi(k);
        matrix /= norm;
        matrix = &matrix * &matrix;
    }
    logarithm.exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spectral_radius_is_that_of_the_eigenvalues() {
        // A rotation by 1 rad that shrinks to 0.9, with a nilpotent block.
        let (sin, cos) = 1.0_f64.sin_cos();
        let mut matrix = DMatrix::zeros(4, 4);
        matrix.view_mut((0, 0), (2, 2)).copy_from_slice(&[
            0.9 * cos,
            0.9 * sin,
            -0.9 * sin,
            0.9 * cos,
        ]);
        matrix[(2, 3)] = 50.0;
        assert!((spectral_radius(matrix) - 0.9).abs() < 1e-6);
    }
}
