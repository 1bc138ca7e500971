//! What an optimum says of the plant, and how certain that is.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix4};

use super::doubts::caveats;
use crate::estimate::descend::{scaled_inverse, unit_diagonal};
use crate::estimate::filter_error::candidate::Decision;
use crate::estimate::filter_error::kalman::Innovation;
use crate::estimate::filter_error::minimise::Optimum;
use crate::estimate::filter_error::parameters::Unknown;
use crate::estimate::filter_error::problem::Problem;
use crate::estimate::filter_error::search::Fitted;
use crate::estimate::filter_error::strength::covariance_with_thrust;
use crate::estimate::{Estimate, Fit, Innovations, Method, Nuisances, PRECISION, Waves};
use crate::regression::batch_s;
use crate::signal::autocorrelation;
use crate::statistics::robust_covariance;
use crate::terms::Term;
use crate::{AxisRecord, Dof, Error, LumpedParameters, Terms};

pub(super) const fn unknown_of(term: Term) -> Unknown {
    match term {
        Term::Force => Unknown::Alpha,
        Term::Quadratic => Unknown::Beta,
        Term::Linear => Unknown::Mu,
        Term::Bias => Unknown::Bias,
    }
}

/// The plant of one record's kind.
pub(in crate::estimate::filter_error) fn lumped(
    problem: &Problem<'_>,
    optimum: &Optimum,
    record: usize,
) -> LumpedParameters {
    let values = problem.values(&optimum.theta, record);
    let [alpha, beta, mu, bias] = Term::ALL.map(|term| values.get(unknown_of(term)));
    LumpedParameters { alpha, beta, mu, bias }
}

/// The terms that are fitted.
pub(in crate::estimate::filter_error) fn terms_of(problem: &Problem<'_>) -> Result<Terms, Error> {
    let is_fitted = |term: &Term| problem.index(unknown_of(*term), 0).is_some();
    Terms::new(&Term::ALL.into_iter().filter(is_fitted).collect::<Vec<_>>())
}

/// Measurements that are left when all numbers are fitted.
pub(in crate::estimate::filter_error) fn freedom(problem: &Problem<'_>) -> f64 {
    let samples = problem.samples();
    (samples - problem.len().min(samples - 1)) as f64
}

pub(super) fn into_fit(
    dof: Dof,
    fitted: &Fitted<'_>,
    structure: Vec<Decision>,
    axes: &[AxisRecord],
) -> Result<Fit, Error> {
    let Fitted { problem, optimum } = fitted;
    let stuck = || Error::NotConverged { dof, iterations: optimum.iterations };
    let of_model = scaled_inverse(&optimum.information).ok_or_else(stuck)?;
    let with_thrust = covariance_with_thrust(problem, &optimum.theta, axes);
    let of_thrust = with_thrust.map_or_else(|| 0.0 * &of_model, |all| all - &of_model);
    let scores =
        problem.scores(&optimum.theta, batch_s(axes.iter().map(AxisRecord::seconds).sum()));
    let of_logs = robust_covariance(&optimum.information, &scores).unwrap_or(of_model);
    let all = with_precision(problem, optimum, of_logs) + &of_thrust;
    let samples = problem.samples();
    let freedom = freedom(problem);
    let innovations: Vec<Vec<f64>> = (0..problem.records.len())
        .map(|k| {
            problem.innovations(&optimum.theta, k).iter().map(Innovation::normalised).collect()
        })
        .collect();
    let values = problem.values(&optimum.theta, 0);
    let mut fit = Fit {
        dof,
        method: Method::FilterError,
        terms: terms_of(problem)?,
        lumped: lumped(problem, optimum, 0),
        covariance: plant_covariance(problem, &all, 0),
        thrust_covariance: plant_covariance(problem, &of_thrust, 0),
        t_freedom: freedom.min(scores.len().saturating_sub(1).max(1) as f64),
        condition: condition(&optimum.information),
        inflation: Vec::new(),
        samples,
        effective_samples: samples as f64,
        residual_rms: values.get(Unknown::LogDisturbance).exp(),
        filters: Default::default(),
        nuisances: nuisances(problem, optimum, &all, freedom),
        structure,
        steady_test: None,
        innovations: axes.iter().zip(&innovations).map(|(axis, e)| of_trial(axis, e)).collect(),
        history: None,
        caveats: Vec::new(),
        optimum: Some(values),
    };
    fit.caveats = caveats(&fit, &innovations);
    Ok(fit)
}

/// Where velocity is known only by integrating acceleration, it is known to a tenth, and the filter,
/// which goes by the slope of drag there, leaves out its bend: drag is off by some hundredths …
const PRECISION_OF_DRAG: f64 = 0.02;
/// … and mass by less.
const PRECISION_OF_MASS: f64 = 0.01;

/// A covariance with that.
fn with_precision(
    problem: &Problem<'_>,
    optimum: &Optimum,
    mut covariance: DMatrix<f64>,
) -> DMatrix<f64> {
    let alone = problem.goes_by_acceleration();
    let of_drag = if alone { PRECISION_OF_DRAG } else { PRECISION };
    let of_mass = if alone { PRECISION_OF_MASS } else { PRECISION };
    let parts = [(Unknown::Alpha, of_mass), (Unknown::Beta, of_drag), (Unknown::Mu, of_drag)];
    for (unknown, part) in parts {
        if let Some(place) = problem.index(unknown, 0) {
            covariance[(place, place)] += (part * optimum.theta[place]).powi(2);
        }
    }
    covariance
}

/// Covariance of `[α, β, μ, bias]` of one record's kind.
pub(in crate::estimate::filter_error) fn plant_covariance(
    problem: &Problem<'_>,
    all: &DMatrix<f64>,
    record: usize,
) -> Matrix4<f64> {
    let place = Term::ALL.map(|term| problem.index(unknown_of(term), record));
    Matrix4::from_fn(|i, j| match (place[i], place[j]) {
        (Some(i), Some(j)) => all[(i, j)],
        _ => 0.0,
    })
}

fn nuisances(
    problem: &Problem<'_>,
    optimum: &Optimum,
    all: &DMatrix<f64>,
    freedom: f64,
) -> Nuisances {
    let estimate = |unknown, record| {
        let place = problem.index(unknown, record)?;
        Some(Estimate::new(optimum.theta[place], all[(place, place)].sqrt(), freedom))
    };
    let exponential = |estimate: Estimate| Estimate {
        value: estimate.value.exp(),
        std: estimate.std * estimate.value.exp(),
        low95: estimate.low95.exp(),
        high95: estimate.high95.exp(),
    };
    let by_trial = |unknown| -> BTreeMap<String, Estimate> {
        let records = problem.records.iter().enumerate();
        records
            .filter_map(|(k, record)| Some((record.trial.clone(), estimate(unknown, k)?)))
            .collect()
    };
    Nuisances {
        lag_s: estimate(Unknown::Lag, 0),
        delay_s: estimate(Unknown::Delay, 0),
        reverse_ratio: estimate(Unknown::LogReverseRatio, 0).map(exponential),
        inflow: estimate(Unknown::Inflow, 0),
        current: by_trial(Unknown::Current),
        velocity_offset: by_trial(Unknown::VelocityOffset),
        lag_ratio: estimate(Unknown::LogLagRatio, 0).map(exponential),
        slew_s: estimate(Unknown::Slew, 0),
        inflow_ahead: estimate(Unknown::InflowAhead, 0),
        exponent: estimate(Unknown::Exponent, 0).map(|off| off.moved(2.0)),
        full_speed: problem.fixed.shape.full_speed,
        linear_thrust: problem.is_linear(),
        velocity_scale: estimate(Unknown::VelocityScale, 0).map(|off| off.moved(1.0)),
        sensor_lag_s: estimate(Unknown::LogSensorLag, 0).map(exponential),
        sensor_window_s: estimate(Unknown::LogSensorWindow, 0).map(exponential),
        swell: waves(&estimate, exponential),
        current_drift: estimate(Unknown::LogDrift, 0).map(exponential),
        turning: estimate(Unknown::Turning, 0),
        lever_m: [estimate(Unknown::LeverFirst, 0), estimate(Unknown::LeverSecond, 0)],
        disturbance: estimate(Unknown::LogDisturbance, 0).map(exponential),
        correlation_s: estimate(Unknown::LogCorrelation, 0).map(exponential),
        acceleration_noise: estimate(Unknown::LogAccelerationNoise, 0).map(exponential),
        acceleration_offset: by_trial(Unknown::AccelerationOffset),
        leak: estimate(Unknown::LogLeak, 0).map(exponential),
        leak_correlation_s: estimate(Unknown::LogLeakCorrelation, 0).map(exponential),
        velocity_noise: estimate(Unknown::LogVelocityNoise, 0).map(exponential),
        position_noise: estimate(Unknown::LogPositionNoise, 0).map(exponential),
    }
}

/// Waves in the numbers that a seaman knows.
fn waves(
    estimate: &dyn Fn(Unknown, usize) -> Option<Estimate>,
    exponential: impl Fn(Estimate) -> Estimate,
) -> Option<Waves> {
    let frequency = estimate(Unknown::LogSwellFrequency, 0)?;
    let log_period = Estimate {
        value: std::f64::consts::TAU.ln() - frequency.value,
        low95: std::f64::consts::TAU.ln() - frequency.high95,
        high95: std::f64::consts::TAU.ln() - frequency.low95,
        ..frequency
    };
    Some(Waves {
        strength: exponential(estimate(Unknown::LogSwell, 0)?),
        period_s: exponential(log_period),
        damping: exponential(estimate(Unknown::LogSwellDamping, 0)?),
    })
}

/// As many samples as memory is looked for.
const LAGS: usize = 40;

fn of_trial(axis: &AxisRecord, innovations: &[f64]) -> Innovations {
    let lags = 0..=LAGS.min(innovations.len().saturating_sub(1));
    Innovations {
        trial: axis.trial.clone(),
        samples: innovations.len(),
        autocorrelation: autocorrelation(innovations, lags),
    }
}

fn condition(information: &DMatrix<f64>) -> f64 {
    let scale = unit_diagonal(information);
    let scaled = &scale * information * &scale;
    if !scaled.iter().all(|x| x.is_finite()) {
        return f64::INFINITY;
    }
    let eigen = scaled.symmetric_eigenvalues();
    (eigen.max() / eigen.min().max(f64::MIN_POSITIVE)).sqrt()
}
