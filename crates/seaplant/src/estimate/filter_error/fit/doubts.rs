//! What gives reason to doubt a fit.

use super::start::{LEAST_LAG_S, force_rms};
use crate::caveat::{estimated, spoken};
use crate::estimate::Fit;
use crate::estimate::filter_error::minimise::limits;
use crate::estimate::filter_error::parameters::Unknown;
use crate::estimate::filter_error::problem::{Prior, Record};
use crate::estimate::filter_error::search::{Fitted, Search};
use crate::terms::Term;
use crate::{AxisRecord, Caveat, CaveatCode, Dof};

pub(super) fn fitted_to_some(dof: Dof, some: usize, all: usize) -> Caveat {
    let message = format!(
        "the model of {dof} is fitted to {some} of {all} trials, spread evenly; all of them score it"
    );
    Caveat::note(CaveatCode::SearchedOnPart, message)
}

pub(super) fn searched_on_part(dof: Dof, part: usize, whole: usize) -> Caveat {
    let message = format!(
        "which terms the model of {dof} has was decided on {part} of {whole} samples, in pieces spread over the record; the numbers are fitted to all of them"
    );
    Caveat::note(CaveatCode::SearchedOnPart, message)
}

pub(super) fn struck_out(dof: Dof, spikes: usize, records: &[Record]) -> Option<Caveat> {
    let left: usize = records.iter().map(Record::samples).sum();
    (spikes > 0).then(|| {
        let message = format!(
            "{spikes} of {} samples in {dof} are spikes: far from what the model predicts, while the next sample is not; the filter error method left them out",
            left + spikes
        );
        Caveat::note(CaveatCode::Outliers, message)
    })
}

/// Linear drag that acceleration alone did not find, and that mass may have made up for.
pub(super) fn hidden_drag(fit: &Fit, axes: &[AxisRecord]) -> Option<Caveat> {
    let is_blind = !axes.iter().any(AxisRecord::knows_velocity);
    (is_blind && !fit.terms.has(Term::Linear)).then(|| {
        let message = format!(
            "no linear drag was found in {}, and acceleration alone hardly determines it: mass may be about 10 % too large instead; run at several steady speeds, or log a velocity, depth or position",
            fit.dof
        );
        Caveat::warning(CaveatCode::WideInterval, message)
    })
}

/// An accelerometer that reads as much at rest is tilted by more than two degrees, m/s².
const TILTED: f64 = 0.35;

/// What the fit says of the accelerometer.
pub(super) fn accelerometer_doubts(fit: &Fit) -> Vec<Caveat> {
    let offsets = fit.nuisances.acceleration_offset.iter();
    let most = offsets.max_by(|a, b| a.1.value.abs().total_cmp(&b.1.value.abs()));
    let tilted = most.filter(|(_, offset)| offset.low95.max(-offset.high95) > TILTED);
    let tilted = tilted.map(|(trial, offset)| {
        let message = format!(
            "trial `{trial}`: along {} the accelerometer reads {:.2} m/s² at rest, as if it were tilted by {:.1}° relative to the attitude sensor; the offset is estimated, but not what a tilt adds from other axes: set [sensor.imu] rotation_deg, or level it",
            fit.dof,
            offset.value,
            (offset.value.abs() / 9.81).clamp(0.0, 1.0).asin().to_degrees()
        );
        Caveat::warning(CaveatCode::TiltedAccelerometer, message)
    });
    let smooths = [("lag", fit.nuisances.sensor_lag_s), ("window", fit.nuisances.sensor_window_s)];
    let smooths = smooths.into_iter().filter_map(|(what, time)| Some((what, time?)));
    let smooths = smooths.filter(|_| most.is_some()).map(|(what, time)| {
        let message = format!(
            "the accelerometer in {} is smoothed before it is logged, with a {what} of {} s, which is allowed for here",
            fit.dof,
            estimated(time.value, time.std)
        );
        Caveat::note(CaveatCode::LagOrDelay, message)
    });
    tilted.into_iter().chain(smooths).collect()
}

/// Whether another mass, with the lags of propeller and vehicle exchanged, explains the logs as
/// well, so that only what is believed of propellers and dry mass tells them apart.
///
/// Thrust to speed is two first-order lags in a row, and a linear system does not show which
/// comes first.
pub(super) fn lag_or_mass(fit: &Fit, fitted: &Fitted<'_>, search: &Search<'_>) -> Option<Caveat> {
    let Fitted { problem, optimum } = fitted;
    let values = problem.values(&optimum.theta, 0);
    let slope = |speed: f64| -(values.get(Unknown::Mu) + 2.0 * values.get(Unknown::Beta) * speed);
    let vehicle_s = 1.0 / slope(search.fixed.shape.usual.speed);
    let propeller_s = values.get(Unknown::Lag).max(LEAST_LAG_S);
    // A vehicle that is slower than any propeller cannot be taken for one.
    let (_, slowest_s) = limits(Unknown::Lag, &problem.fixed.shape);
    if !(vehicle_s > 0.0 && vehicle_s < slowest_s) || problem.index(Unknown::Slew, 0).is_some() {
        return None;
    }
    let unbiased: Vec<Prior> = search
        .priors
        .iter()
        .filter(|prior| !matches!(prior.unknown, Unknown::Lag | Unknown::Alpha))
        .copied()
        .collect();
    let mut unknowns = problem.unknowns().to_vec();
    if !unknowns.contains(&Unknown::Lag) {
        unknowns.push(Unknown::Lag);
    }
    let plain = Search { priors: &unbiased, ..search.clone() };
    let mut exchanged = values;
    let factor = vehicle_s / propeller_s;
    exchanged.set(Unknown::Lag, vehicle_s);
    for unknown in [Unknown::Alpha, Unknown::Beta, Unknown::Mu, Unknown::Bias] {
        exchanged.set(unknown, factor * values.get(unknown));
    }
    let linear = problem.is_linear();
    let other = plain.fit(&unknowns, linear, None, &exchanged);
    let here = plain.fit(&unknowns, linear, Some(fitted), &exchanged);
    let mass = |fitted: &Fitted<'_>| {
        1.0 / fitted.problem.values(&fitted.optimum.theta, 0).get(Unknown::Alpha)
    };
    let (own, other_mass) = (1.0 / values.get(Unknown::Alpha), mass(&other));
    let as_likely = other.optimum.cost < here.optimum.cost + AS_LIKELY;
    let differs = (other_mass / own).ln().abs() > CLEARLY_ANOTHER;
    let other_lag = other.problem.values(&other.optimum.theta, 0).get(Unknown::Lag);
    (other.optimum.converged && as_likely && differs).then(|| {
        let units = fit.dof.units();
        let message = format!(
            "the logs in {} also agree with a mass of {} {} with a propeller lag of {} s: the lag of the propeller and that of the vehicle look alike, and only the usual lag of propellers{} favours {} {}; state dry_mass_kg, or log the measured propeller speed",
            fit.dof,
            spoken(other_mass),
            units.mass,
            spoken(other_lag),
            if search.priors.len() > unbiased.len() + 1 { " and the dry mass" } else { "" },
            spoken(own),
            units.mass
        );
        Caveat::warning(CaveatCode::LagOrMass, message)
    })
}

/// Half a unit of likelihood ratio of 4: the odds are below seven to one.
const AS_LIKELY: f64 = 2.0;

/// The logarithm by which another mass is clearly another: 30 %.
const CLEARLY_ANOTHER: f64 = 0.26;

/// A disturbance below this part of what thrust does is none to speak of.
const SLIGHT_DISTURBANCE: f64 = 0.05;

/// Tethers, currents and swell change over longer than this, s.
const QUICK_S: f64 = 1.0;

/// A disturbance that is quicker than anything that pulls at a vehicle from outside.
pub(super) fn hurried_disturbance(fit: &Fit, axes: &[AxisRecord]) -> Option<Caveat> {
    let (correlation_s, disturbance) =
        fit.nuisances.correlation_s.zip(fit.nuisances.disturbance)?;
    let thrust = fit.lumped.alpha * force_rms(axes);
    let matters = disturbance.value > SLIGHT_DISTURBANCE * thrust;
    (matters && correlation_s.value < QUICK_S).then(|| {
        let message = format!(
            "what moves the vehicle in {} beside its thrust changes within {} s and is {:.0} % as strong as the thrust: the model lacks a fast effect (another axis, the rudder, a smoothed or noisy sensor), and its intervals are approximate",
            fit.dof,
            spoken(correlation_s.value),
            100.0 * disturbance.value / thrust
        );
        Caveat::warning(CaveatCode::ResidualsNotWhite, message)
    })
}

/// Innovations correlated by more than this from one to the next are not white.
const CORRELATED: f64 = 0.15;

pub(super) fn caveats(fit: &Fit, innovations: &[Vec<f64>]) -> Vec<Caveat> {
    let mut caveats = Vec::new();
    let correlation = innovations
        .iter()
        .map(|e| {
            let product: f64 = e.windows(2).map(|pair| pair[0] * pair[1]).sum();
            product / e.iter().map(|e| e * e).sum::<f64>().max(f64::MIN_POSITIVE)
        })
        .fold(0.0_f64, |worst, r| if r.abs() > worst.abs() { r } else { worst });
    if correlation.abs() > CORRELATED {
        let message = format!(
            "what the {} model fails to predict is correlated from one sample to the next ({correlation:+.2}): the model lacks something (waves, another axis, a smoothed sensor), and the intervals are too narrow",
            fit.dof
        );
        caveats.push(Caveat::warning(CaveatCode::ResidualsNotWhite, message));
    }
    let late = [("lag", fit.nuisances.lag_s), ("delay", fit.nuisances.delay_s)];
    for (name, estimate) in late {
        if let Some(estimate) = estimate.filter(|estimate| !estimate.covers(0.0)) {
            let message = format!(
                "thrust in {} follows its log with a {name} of {} s, which this method estimates; methods that ignore it give a wrong drag",
                fit.dof,
                estimated(estimate.value, estimate.std)
            );
            caveats.push(Caveat::note(CaveatCode::LagOrDelay, message));
        }
    }
    caveats
}
