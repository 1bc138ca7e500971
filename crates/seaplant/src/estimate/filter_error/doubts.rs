//! What gives reason to doubt a fit.

use crate::caveat::spoken;
use crate::estimate::Fit;
use crate::estimate::plant_fit::{Exchanged, force_rms};
use crate::terms::Term;
use crate::{AxisRecord, Caveat, CaveatCode, Dof};

pub(super) fn fitted_to_some(dof: Dof, some: usize, all: usize) -> Caveat {
    let message = format!(
        "the model of {dof} is fitted to {some} of {all} trials, spread evenly; all of them score it"
    );
    Caveat::note(CaveatCode::SearchedOnPart, message)
}

pub(super) fn fitted_to_pieces(dof: Dof, part: usize, whole: usize) -> Caveat {
    let message = format!(
        "the model of {dof} is fitted to {part} of {whole} samples, in pieces spread over the record; all of them score it"
    );
    Caveat::note(CaveatCode::SearchedOnPart, message)
}

pub(super) fn struck_out(dof: Dof, spikes: usize, samples: usize) -> Option<Caveat> {
    (spikes > 0).then(|| {
        let message = format!(
            "{spikes} of {} samples in {dof} are spikes: far from what the model predicts, while the next sample is not; the filter error method left them out",
            samples + spikes
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

/// Gravity in an accelerometer that is tilted by more than two degrees, m/s².
const TILTED: f64 = 0.35;

/// No vehicle changes its speed by more than this in a trial, m/s.
const MOST_CHANGE_M_S: f64 = 10.0;

/// An accelerometer whose mean over a trial is more than any change of speed.
pub(super) fn tilted_accelerometer(dof: Dof, axes: &[AxisRecord]) -> Option<Caveat> {
    let offset = |axis: &AxisRecord| {
        let felt = &axis.acceleration.as_ref()?.mean;
        let mean = felt.values().iter().sum::<f64>() / felt.len() as f64;
        let of_speed = MOST_CHANGE_M_S / (felt.last_s() - felt.first_s());
        (mean.abs() > TILTED + of_speed).then(|| (axis.trial.clone(), mean))
    };
    let all = axes.iter().filter_map(offset);
    let (trial, mean) = all.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let message = format!(
        "trial `{trial}`: along {dof} the accelerometer reads {mean:.2} m/s² in the mean, as if it were tilted by {:.1}° relative to the attitude sensor; the offset is estimated, but not what a tilt adds from other axes: set [sensor.imu] rotation_deg, or level it",
        (mean.abs() / 9.81).min(1.0).asin().to_degrees()
    );
    Some(Caveat::warning(CaveatCode::TiltedAccelerometer, message))
}

/// Whether another mass, with the lags of propeller and vehicle exchanged, explains the logs as
/// well, so that only what is believed of propellers tells them apart.
///
/// Thrust to speed is two first-order lags in a row, and a linear system does not show which
/// comes first.
pub(super) fn lag_or_mass(fit: &Fit, exchanged: Option<Exchanged>) -> Option<Caveat> {
    let Exchanged { mass, lag_s, loss } = exchanged?;
    let own = fit.physical().mass;
    (loss < AS_LIKELY && (mass / own).ln().abs() > CLEARLY_ANOTHER).then(|| {
        let units = fit.dof.units();
        let message = format!(
            "the logs in {} also agree with a mass of {} {} with a propeller lag of {} s: the lag of the propeller and that of the vehicle look alike, and only the usual lag of propellers favours {} {}; log the measured propeller speed",
            fit.dof,
            spoken(mass),
            units.mass,
            spoken(lag_s),
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
