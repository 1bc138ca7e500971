//! Where the search begins, and what is believed before it.

use super::outcome::unknown_of;
use crate::estimate::filter_error::candidate::Candidate;
use crate::estimate::filter_error::minimise::{POSITION_PRECISION_S, VELOCITY_PRECISION};
use crate::estimate::filter_error::parameters::{Shape, Unknown, Usual, Values};
use crate::estimate::filter_error::problem::{Belief, Prior};
use crate::estimate::filter_error::schedule::{Instrument, Measurements};
use crate::estimate::simulated_speed;
use crate::estimate::{DelayedFit, OutputError, Records};
use crate::signal::{rms, sample_noise};
use crate::terms::Term;
use crate::{AxisRecord, LumpedParameters, Terms, Timed};

/// The delays that a first look tries, s: every tenth of a second up to one.
pub fn first_delays() -> impl Iterator<Item = f64> {
    (0..=10).map(|tenth| 0.1 * f64::from(tenth))
}

/// Where the search begins, and what is believed before it.
pub(super) struct Beginning {
    pub(super) values: Values,
    pub(super) priors: Vec<Prior>,
    /// Of each instrument that there is.
    noise: Vec<Unknown>,
}

impl Beginning {
    pub(super) fn of(axes: &[AxisRecord], start: &DelayedFit, dry_mass_kg: Option<f64>) -> Self {
        let propellers = Propellers::of(axes);
        let alpha = start.fit.lumped.alpha.abs();
        let speed = usual_speed(axes, start);
        let usual = Usual { speed, thrust: force_rms(axes), alpha };
        let full_speed = propellers.full_speed;
        let mut values = Values::none(Shape { full_speed, usual, ..Shape::default() });
        for (unknown, start) in Candidate::ALL.into_iter().flat_map(Candidate::unknowns) {
            values.set(unknown, start);
        }
        let mut set = |unknown, value| values.set(unknown, value);
        // What comes late may lag or be delayed; in doubt, half and half.
        let late_s = start.delay_s.max(0.0);
        set(Unknown::Lag, (0.5 * late_s).max(LEAST_LAG_S));
        set(Unknown::Delay, start.delay_s - 0.5 * late_s);
        set(Unknown::Slew, 0.0);
        let disturbance = (TYPICAL_DISTURBANCE * alpha * usual.thrust).max(1e-9);
        let noise = instrument_noise(axes, usual.speed);
        noise.iter().for_each(|(unknown, log_std)| set(*unknown, *log_std));
        plant(&mut values, &start.fit.lumped);
        values.set(Unknown::LogDisturbance, disturbance.ln());
        values.set(Unknown::LogCorrelation, TYPICAL_CORRELATION_S.ln());
        values.set(Unknown::LogLeak, TYPICAL_LEAK.ln());
        values.set(Unknown::LogLeakCorrelation, TYPICAL_CORRELATION_S.ln());
        let mut priors = priors(axes, &propellers, dry_mass_kg);
        priors.push(normal(Unknown::LogDisturbance, disturbance.ln(), 2.0));
        priors.extend(noise.iter().map(|(unknown, log_std)| normal(*unknown, *log_std, 2.0)));
        Self { values, priors, noise: noise.into_iter().map(|(unknown, _)| unknown).collect() }
    }

    /// Values of what is not fitted: no nuisance, no term.
    pub(super) fn fixed(&self) -> Values {
        let mut fixed = Values::none(self.values.shape);
        for unknown in [
            Unknown::LogDisturbance,
            Unknown::LogCorrelation,
            Unknown::LogVelocityNoise,
            Unknown::LogPositionNoise,
            Unknown::LogAccelerationNoise,
            Unknown::LogLeak,
            Unknown::LogLeakCorrelation,
        ] {
            fixed.set(unknown, self.values.get(unknown));
        }
        fixed
    }

    /// The terms asked for, or those that every vehicle has; and the noise.
    pub(super) fn unknowns(&self, terms: Option<Terms>) -> Vec<Unknown> {
        let terms = terms.map_or(vec![Term::Force, Term::Quadratic], |terms| terms.fitted());
        let noise = [Unknown::LogDisturbance, Unknown::LogCorrelation];
        let has = |unknown| self.noise.contains(&unknown);
        let beside = has(Unknown::LogVelocityNoise) && has(Unknown::LogPositionNoise);
        let felt = [Unknown::LogLeak, Unknown::LogLeakCorrelation, Unknown::AccelerationOffset];
        let felt = felt.into_iter().filter(|_| has(Unknown::LogAccelerationNoise));
        let offset = beside.then_some(Unknown::VelocityOffset);
        let of_terms = terms.into_iter().map(unknown_of);
        of_terms.chain(noise).chain(self.noise.iter().copied()).chain(offset).chain(felt).collect()
    }
}

/// The noise of each instrument that there is, as its logarithm.
fn instrument_noise(axes: &[AxisRecord], speed: f64) -> Vec<(Unknown, f64)> {
    let measurements: Vec<Measurements> = axes.iter().flat_map(Measurements::parts_of).collect();
    let velocities = measurements.iter().filter_map(Measurements::velocity);
    let positions = measurements.iter().filter_map(Measurements::position);
    let felt = measurements.iter().filter_map(|m| m.of_instrument(Instrument::Acceleration));
    [
        (Unknown::LogVelocityNoise, sample_noise(velocities), VELOCITY_PRECISION),
        (Unknown::LogPositionNoise, sample_noise(positions), POSITION_PRECISION_S),
        (Unknown::LogAccelerationNoise, sample_noise(felt), 0.0),
    ]
    .into_iter()
    .filter_map(|(unknown, std, precision)| {
        Some((unknown, std?.max(precision * speed).max(1e-7).ln()))
    })
    .collect()
}

/// The thrusters of an axis, as far as propellers are alike.
struct Propellers {
    /// The greatest propeller speed.
    full_speed: f64,
    /// The greatest thrust of one, N.
    thrust: f64,
    /// √k of the strongest, N^½/(rad/s).
    gain: f64,
}

impl Propellers {
    fn of(axes: &[AxisRecord]) -> Self {
        let mut all = Self { full_speed: 0.0, thrust: 0.0, gain: f64::MIN_POSITIVE };
        for track in axes.iter().flat_map(AxisRecord::tracks) {
            let fastest = track.speed.values().iter().fold(0.0_f64, |max, n| max.max(n.abs()));
            all.full_speed = all.full_speed.max(fastest);
            all.thrust = all.thrust.max(track.forward.max(track.reverse) * fastest * fastest);
            all.gain = all.gain.max(track.forward.sqrt());
        }
        all
    }

    /// How slow a propeller of that thrust may be, s: 0.15 s at 50 N.
    ///
    /// Tip speeds are alike, so that thrust grows as the square of a propeller's size and the
    /// time of a turn as the size itself; it takes some turns to bring the water along.
    fn typical_lag_s(&self) -> f64 {
        (0.15 * (self.thrust / 50.0).sqrt()).clamp(0.1, 1.0)
    }
}

const fn normal(unknown: Unknown, mean: f64, std: f64) -> Prior {
    Prior { unknown, belief: Belief::Normal { mean, std } }
}

/// The lag of propellers that nothing is known of, s.
const UNKNOWN_LAG_S: f64 = 0.3;

/// How far a thrust curve may make the mass seem to be below the dry mass.
const DRY_MASS_LOG_STD: f64 = 0.1;

fn priors(axes: &[AxisRecord], propellers: &Propellers, dry_mass_kg: Option<f64>) -> Vec<Prior> {
    let is_translation = axes.iter().all(|axis| !axis.dof.is_rotation());
    // Water only adds to the mass.
    let dry = dry_mass_kg.filter(|dry| is_translation && *dry > 0.0).map(|dry| Prior {
        unknown: Unknown::Alpha,
        belief: Belief::AtMost { limit: 1.0 / dry, log_std: DRY_MASS_LOG_STD },
    });
    // Without a velocity, a quick disturbance stands in for drag that the model lacks.
    let sees_velocity = axes.iter().all(AxisRecord::knows_velocity);
    let memory = if sees_velocity { 1.5 } else { 0.7 };
    // Acceleration shows a lag in every step of thrust: there the size of the propeller, of which
    // a log of force says nothing, need not.
    let lag_s = match sees_velocity || propellers.thrust > 0.0 {
        true => propellers.typical_lag_s(),
        false => UNKNOWN_LAG_S,
    };
    // 1 N s²/(rad m) for thrusters of 0.04 N/(rad/s)², and alike for others.
    let inflow = 5.0 * propellers.gain;
    [
        normal(Unknown::Lag, 0.0, lag_s),
        normal(Unknown::LogLagRatio, 0.0, 1.0),
        normal(Unknown::Slew, 0.0, 1.0),
        normal(Unknown::Delay, 0.0, 0.5),
        normal(Unknown::LogReverseRatio, 0.0, 0.3),
        normal(Unknown::Current, 0.0, 0.15),
        normal(Unknown::Inflow, 0.0, inflow),
        normal(Unknown::InflowAhead, 0.0, inflow),
        normal(Unknown::Exponent, 0.0, 0.3),
        normal(Unknown::LeverFirst, 0.0, 0.5),
        normal(Unknown::LeverSecond, 0.0, 0.5),
        normal(Unknown::Turning, 1.0, 0.5),
        normal(Unknown::VelocityOffset, 0.0, OFFSET_PART * speed_rms(axes)),
        normal(Unknown::VelocityScale, 0.0, 0.1),
        normal(Unknown::LogSensorLag, (0.3_f64).ln(), 1.0),
        normal(Unknown::LogSensorWindow, (0.6_f64).ln(), 1.0),
        normal(Unknown::LogSwellFrequency, 0.0, 1.0),
        normal(Unknown::LogSwellDamping, (0.1_f64).ln(), 1.0),
        normal(Unknown::LogDrift, (0.05_f64).ln(), 1.0),
        normal(Unknown::LogCorrelation, TYPICAL_CORRELATION_S.ln(), memory),
        normal(Unknown::LogLeak, TYPICAL_LEAK.ln(), 1.0),
        normal(Unknown::LogLeakCorrelation, TYPICAL_CORRELATION_S.ln(), 1.0),
        normal(Unknown::AccelerationOffset, 0.0, USUAL_OFFSET),
    ]
    .into_iter()
    .chain(dry)
    .collect()
}

/// Sets a plant to start from.
pub(super) fn plant(values: &mut Values, lumped: &LumpedParameters) {
    // A wrong-signed mass is no place to start from; the scale of thrust is.
    values.set(Unknown::Alpha, lumped.alpha.abs().max(f64::MIN_POSITIVE));
    values.set(Unknown::Beta, lumped.beta.min(0.0));
    values.set(Unknown::Mu, lumped.mu.min(0.0));
    values.set(Unknown::Bias, lumped.bias);
}

/// Disturbances that forget as quickly and as slowly as these, s, are starts of their own.
const CORRELATIONS_S: [f64; 4] = [30.0, 3.0, 0.3, 300.0];

/// Starts from the plant of equation error with disturbances of several memories, and from
/// those of output error with and without linear drag. Of acceleration alone there is no output
/// error, and half of the first plant's drag is made linear.
pub(super) fn starts(common: &Values, axes: &[AxisRecord], start: &DelayedFit) -> Vec<Values> {
    let with = |lumped: &LumpedParameters, correlation_s: f64| {
        let mut values = *common;
        plant(&mut values, lumped);
        values.set(Unknown::LogCorrelation, correlation_s.ln());
        // As much at low frequencies, whatever the memory.
        let weaker = 0.5 * (correlation_s / TYPICAL_CORRELATION_S).ln();
        values.set(Unknown::LogDisturbance, common.get(Unknown::LogDisturbance) - weaker);
        values
    };
    let own = &start.fit.lumped;
    let mut all: Vec<Values> = CORRELATIONS_S.map(|t| with(own, t)).into();
    let timely: Vec<AxisRecord> = axes.iter().map(|axis| axis.delayed(start.delay_s)).collect();
    let quadratic = [Term::Force, Term::Quadratic, Term::Bias];
    for terms in [&quadratic[..], &Term::ALL] {
        let Ok(terms) = Terms::new(terms) else { continue };
        let records = Records::from(&timely).with_terms(terms);
        if let Ok(fit) = OutputError::default().fit_from(records, own)
            && fit.lumped.alpha > 0.0
        {
            all.push(with(&fit.lumped, CORRELATIONS_S[1]));
        }
    }
    if !axes.iter().any(AxisRecord::knows_velocity) {
        let usual = common.shape.usual.speed;
        let (beta, mu) = (0.5 * own.beta, own.mu + 0.5 * own.beta * usual);
        let shared = LumpedParameters { beta, mu, ..*own };
        all.extend([0, 1].map(|k| with(&shared, CORRELATIONS_S[k])));
    }
    all
}

/// A velocity sensor at rest reads about this part of the usual speed.
const OFFSET_PART: f64 = 0.1;

/// A fit of the lag starts no lower: at its limit, zero, it could not say which way to go.
pub(super) const LEAST_LAG_S: f64 = 0.05;

/// A tether or swell pulls with some hundredths of the thrust …
const TYPICAL_DISTURBANCE: f64 = 0.03;
/// … and changes over half a minute.
const TYPICAL_CORRELATION_S: f64 = 30.0;

/// Attitude is off by a third of a degree, which leaks as much gravity, m/s².
const TYPICAL_LEAK: f64 = 0.05;

/// An accelerometer reads about so much at rest, m/s²: its own offset, and a mount three degrees off.
const USUAL_OFFSET: f64 = 0.5;

/// As measured; of acceleration alone, as the first plant moves from rest.
fn usual_speed(axes: &[AxisRecord], start: &DelayedFit) -> f64 {
    if axes.iter().any(AxisRecord::knows_velocity) {
        return speed_rms(axes);
    }
    simulated_speed(&start.fit.lumped.into(), axes)
}

pub(super) fn force_rms(axes: &[AxisRecord]) -> f64 {
    rms(axes.iter().flat_map(|axis| axis.force.values()))
}

fn speed_rms(axes: &[AxisRecord]) -> f64 {
    let velocities: Vec<Timed> = axes.iter().filter_map(|axis| axis.velocity().ok()).collect();
    rms(velocities.iter().flat_map(|velocity| velocity.values()))
}
