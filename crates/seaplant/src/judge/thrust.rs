//! What thrust itself gives away: a wrong sign, a controller behind it, one speed only.

use nalgebra::{DMatrix, DVector};

use super::good_for::range;
use crate::caveat::spoken;
use crate::estimate::{EquationError, Records};
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Fit};

/// Delays with which the sign of thrust is looked at, s: within what a propeller needs.
const DELAYS_S: [f64; 7] = [0.0, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2];

/// Thrust is reversed if its coefficient is so many standard deviations below zero.
const SURE_STD: f64 = 5.0;

/// That thrust pushes the other way than its log says: least squares with the delay that suits
/// best asks for a mass below zero, and drag is that of a vehicle once its sign is turned.
pub(crate) fn reversed(records: Records<'_>, by: &EquationError) -> Option<Caveat> {
    let dof = records.dof().ok()?;
    let best = |delays_s: &[f64]| by.fit_best_delay(records, delays_s.iter().copied()).ok();
    // A quick vehicle with slow thrust fits a wrong sign and a wrong delay together.
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

/// Past samples of thrust and velocity that may tell the next thrust …
const PAST: usize = 3;
/// … at this rate, Hz.
const FEEDBACK_HZ: f64 = 2.0;
/// Velocity must tell this part of what past thrust leaves open.
const FEEDBACK_PART: f64 = 0.3;
/// Thrust that its own past leaves open by less than this part is a known programme.
const OPEN_PART: f64 = 0.02;

/// That thrust answers velocity, as under a controller: what disturbs the vehicle is then in its
/// thrust, too.
///
/// Least squares of each thrust on the last three, without and with the last three velocities.
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
    let by_thrust = left(&rows, &next, PAST + 1)?;
    let by_both = left(&rows, &next, 2 * PAST + 1)?;
    let told = 1.0 - by_both / by_thrust;
    (by_thrust > OPEN_PART * variation && told > FEEDBACK_PART).then(|| {
        let message = format!(
            "thrust in {dof} depends on velocity, as under feedback control: past velocity explains {:.0} % of the thrust that past thrust does not; disturbances then act on thrust, too, which biases methods that take thrust as independent; log some minutes with the controller off",
            100.0 * told
        );
        Caveat::note(CaveatCode::ThrustFollowsVelocity, message)
    })
}

/// Σ error² of least squares on the first columns of rows.
fn left(rows: &[[f64; 2 * PAST + 1]], next: &[f64], columns: usize) -> Option<f64> {
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
        let told: f64 = row[..columns].iter().zip(value.iter()).map(|(x, c)| x * c).sum();
        (next - told).powi(2)
    };
    Some(rows.iter().zip(next).map(error).sum())
}

/// Slower than this an axis stands still, m/s or rad/s.
pub(crate) const STILL: f64 = 1e-4;

/// That an axis stands still in all of the trials: what is fitted to it is noise.
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

/// Speeds within this part of the greatest are one speed.
const ONE_SPEED_PART: f64 = 0.25;

/// That the vehicle keeps one speed nearly always: drag is known at that speed alone, and how it
/// grows with speed is not.
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
