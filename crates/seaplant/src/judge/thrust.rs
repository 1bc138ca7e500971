//! Tests of the thrust: wrong sign, feedback control, a single speed.

use nalgebra::{DMatrix, DVector};

use super::good_for::range;
use crate::caveat::spoken;
use crate::estimate::{EquationError, Records};
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Fit};

/// Delays of the thrust for the test of its sign, s: the range of propellers.
const DELAYS_S: [f64; 7] = [0.0, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2];

/// Number of standard deviations below zero at which the coefficient of thrust counts as negative.
const SURE_STD: f64 = 5.0;

/// Returns a caveat if the sign of thrust is reversed: least squares with the best delay gives a
/// negative mass, and with the sign of thrust changed the drag is physically possible.
pub(crate) fn reversed(records: Records<'_>, by: &EquationError) -> Option<Caveat> {
    let dof = records.dof().ok()?;
    let best = |delays_s: &[f64]| by.fit_best_delay(records, delays_s.iter().copied()).ok();
    // For a fast vehicle with slow thrust, a wrong sign may fit together with a wrong delay.
    let [as_logged, late] = [best(&DELAYS_S[..1])?, best(&DELAYS_S)?].map(|found| found.fit);
    let is_below = |fit: &Fit| {
        fit.lumped.alpha < -SURE_STD * fit.covariance[(0, 0)].sqrt()
            && fit.physical().d_quadratic < 0.0
    };
    let turned = late.physical();
    (is_below(&as_logged) && is_below(&late)).then(|| {
        let units = dof.units();
        let message = format!(
            "thrust in {dof} seems reversed: with its sign turned the vehicle would have {} {} and quadratic drag {} {}; check `direction` and `reversed` of its thrusters, and the sign of velocity (`negate`; depth is positive down)",
            spoken(-turned.mass),
            units.mass,
            spoken(-turned.d_quadratic),
            units.quadratic_drag
        );
        Caveat::severe(CaveatCode::ThrustReversed, message)
    })
}

/// Number of past samples of thrust and velocity that predict the next thrust …
const PAST: usize = 3;
/// … at this rate, Hz.
const FEEDBACK_HZ: f64 = 2.0;
/// Fraction of the thrust's unpredicted variation that velocity must explain.
const FEEDBACK_PART: f64 = 0.3;
/// Thrust whose past leaves less than this fraction of its variation unpredicted is a known
/// programme.
const OPEN_PART: f64 = 0.02;

/// Returns a caveat if thrust depends on velocity, as under feedback control: disturbances then
/// affect thrust as well.
///
/// Compares least squares predictions of thrust from its last three samples, without and with the
/// last three velocities.
///
/// # Source
/// C. W. J. Granger, "Investigating causal relations by econometric models", *Econometrica* 37,
/// 1969.
pub(crate) fn feedback(dof: Dof, axes: &[AxisRecord]) -> Option<Caveat> {
    let mut rows: Vec<[f64; 2 * PAST + 1]> = Vec::new();
    let mut next: Vec<f64> = Vec::new();
    for axis in axes {
        let uniform = axis.uniform(0).ok()?;
        let every = (uniform.sample_hz / FEEDBACK_HZ).round().max(1.0) as usize;
        for stretch in &uniform.stretches {
            let pick = |x: &[f64]| x.iter().step_by(every).copied().collect::<Vec<_>>();
            let (tau, v) = (pick(&stretch.tau), pick(&stretch.v));
            for k in PAST..tau.len() {
                let mut row = [1.0; 2 * PAST + 1];
                row[..PAST].copy_from_slice(&tau[k - PAST..k]);
                row[PAST + 1..].copy_from_slice(&v[k - PAST..k]);
                rows.push(row);
                next.push(tau[k]);
            }
        }
    }
    let count = next.len();
    if count < 20 * (2 * PAST + 1) {
        return None;
    }
    let mean = next.iter().sum::<f64>() / count as f64;
    let variation: f64 = next.iter().map(|tau| (tau - mean).powi(2)).sum();
    let by_thrust = squared_errors(&rows, &next, PAST + 1)?;
    let by_both = squared_errors(&rows, &next, 2 * PAST + 1)?;
    let explained = 1.0 - by_both / by_thrust;
    (by_thrust > OPEN_PART * variation && explained > FEEDBACK_PART).then(|| {
        let message = format!(
            "thrust in {dof} depends on velocity, as under feedback control: past velocity explains {:.0} % of the thrust that past thrust does not; disturbances then act on thrust, too, which biases methods that take thrust as independent; log some minutes with the controller off",
            100.0 * explained
        );
        Caveat::note(CaveatCode::ThrustFollowsVelocity, message)
    })
}

/// Computes Σ error² of least squares on the first `columns` columns.
fn squared_errors(rows: &[[f64; 2 * PAST + 1]], next: &[f64], columns: usize) -> Option<f64> {
    let mut information = DMatrix::zeros(columns, columns);
    let mut score = DVector::zeros(columns);
    for (row, next) in rows.iter().zip(next) {
        let row = DVector::from_column_slice(&row[..columns]);
        information.ger(1.0, &row, &row, 1.0);
        score.axpy(*next, &row, 1.0);
    }
    let scale = DVector::from_fn(columns, |j, _| 1.0 / information[(j, j)].sqrt());
    if !scale.iter().all(|x| x.is_finite()) {
        return None;
    }
    let scaled = information.component_mul(&(&scale * scale.transpose()));
    let value = scaled.cholesky()?.solve(&score.component_mul(&scale)).component_mul(&scale);
    let error = |(row, next): (&[f64; 2 * PAST + 1], &f64)| {
        let predicted: f64 = row[..columns].iter().zip(value.iter()).map(|(x, c)| x * c).sum();
        (next - predicted).powi(2)
    };
    Some(rows.iter().zip(next).map(error).sum())
}

/// Speed below which an axis does not move, m/s or rad/s.
pub(crate) const STILL: f64 = 1e-4;

/// Returns a severe caveat if an axis does not move in any of the trials: its fit is to noise.
pub(crate) fn still(dof: Dof, axes: &[AxisRecord]) -> Option<Caveat> {
    let speeds = axes.iter().filter_map(|axis| axis.velocity().ok());
    let usual: Vec<f64> = speeds.filter_map(|speed| range(speed.values())).flatten().collect();
    let greatest = usual.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
    (!usual.is_empty() && greatest < STILL).then(|| {
        let message = format!(
            "{dof} does not move in any trial to fit (its speed is {greatest:.1e} {} at most): drive it, or leave it out",
            dof.units().velocity
        );
        Caveat::severe(CaveatCode::NotDetermined, message)
    })
}

/// Range of speeds, relative to the maximum, that counts as a single speed.
const ONE_SPEED_PART: f64 = 0.25;

/// Returns a caveat if the vehicle has nearly constant speed: drag is determined at that speed
/// only, and not its dependence on speed.
pub(crate) fn one_speed(dof: Dof, axes: &[AxisRecord]) -> Option<Caveat> {
    let mut speeds: Vec<f64> = Vec::new();
    for velocity in axes.iter().filter_map(|axis| axis.velocity().ok()) {
        speeds.extend(velocity.values().iter().map(|v| v.abs()));
    }
    speeds.sort_by(f64::total_cmp);
    let at = |part: f64| speeds.get((part * speeds.len() as f64) as usize).copied();
    let (low, high) = (at(0.1)?, at(0.9)?);
    (high > 0.0 && high - low < ONE_SPEED_PART * high).then(|| {
        let message = format!(
            "the {dof} trials keep one speed, {} to {} {} most of the time: drag is determined at that speed only, and mass poorly; drive at other speeds, too",
            spoken(low),
            spoken(high),
            dof.units().velocity
        );
        Caveat::warning(CaveatCode::OneSpeed, message)
    })
}
