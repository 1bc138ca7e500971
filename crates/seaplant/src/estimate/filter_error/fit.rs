//! From records to a fitted plant.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::candidate::{Candidate, Decision};
use super::kalman::Innovation;
use super::minimise::{Optimum, POSITION_PRECISION_S, VELOCITY_PRECISION, limits};
use super::parameters::{Shape, Unknown, Usual, Values};
use super::problem::{Belief, Kind, Prior, Problem, Record};
use super::schedule::{Instrument, Measurements};
use super::search::{Fitted, Search};
use super::spikes::{innovations_of_another, strike_out};
use super::strength::covariance_with_thrust;
use super::together::TwoPlants;
use crate::caveat::spoken;
use crate::estimate::descend::{scaled_inverse, unit_diagonal};
use crate::estimate::{
    DelayedFit, Estimate, Fit, Innovations, Method, Nuisances, OutputErrorOptions, PRECISION,
    Waves, check_trials, fit_output_error,
};
use crate::judge::robust_covariance;
use crate::judge::simulated_speed;
use crate::regression::batch_s;
use crate::signal::{autocorrelation, rms, sample_noise};
use crate::terms::Term;
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Error, LumpedParameters, Terms, Timed};

/// The choices of the filter error method.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilterErrorOptions {
    /// What may be taken into the model where the logs ask for it.
    pub candidates: Vec<Candidate>,
    /// What is part of the model whatever the logs say.
    pub required: Vec<Candidate>,
}

impl Default for FilterErrorOptions {
    fn default() -> Self {
        Self { candidates: Candidate::ALL.to_vec(), required: Vec::new() }
    }
}

/// The records of one degree of freedom, by what they are for.
#[derive(Clone, Copy, Debug)]
pub struct Records<'a> {
    /// Fitted.
    pub fit: &'a [AxisRecord],
    /// Predicted, to judge by.
    pub hold_out: &'a [AxisRecord],
    /// Runs at constant thrust: fitted together with the others if they agree with them.
    pub steady: &'a [AxisRecord],
    /// Mass in air, kg, if it is known: the mass in water is no less.
    pub dry_mass_kg: Option<f64>,
}

/// Fits the plant by maximum likelihood on the innovations of a Kalman filter.
///
/// States are velocity, a slow disturbance and, where it was measured, position:
/// `v̇ = α τ* + β(v−u)|v−u| + (μ − α k_in Σ|n|)(v−u) + bias + d`, `ḋ = −d/T_d + w`, `ṗ = v`;
/// waves, a current that varies and a velocity sensor that smooths add states of their own.
/// Velocity and position are taken in at their own times, each with its own noise. Thrust
/// τ* follows the logged one after a lag on propeller speed and a delay, with reverse
/// thrust scaled by κ; u is a current, constant in each trial. It minimises
/// `½ Σ (ln S + e²/S)` plus weak priors, by scoring on the Fisher information with
/// analytic sensitivities, from several starts. Each [`Candidate`] is admitted if the Bayesian
/// information criterion asks for it and held-out records are not predicted worse by more
/// than chance; a bias force is left out if the logs show that it is too small to matter.
///
/// Steady records are fitted with the others if a likelihood-ratio test finds that they ask
/// for the same drag and bias force; else they are not, and [`Fit::steady_test`] has both.
///
/// `start` is a fit to begin with, by equation error, with the delay that suits it best.
///
/// # Errors
/// [`Error::NoTrial`] without records to fit; [`Error::NotConverged`] if no optimum is
/// reached.
///
/// # Source
/// [Jategaonkar2015, ch. 5]: filter error method; score test: \[Young2011\].
pub fn fit_filter_error(
    dof: Dof,
    records: Records<'_>,
    terms: Option<Terms>,
    start: &DelayedFit,
    options: &FilterErrorOptions,
) -> Result<Fit, Error> {
    check_trials(dof, records.fit)?;
    let some = some_of(records.fit);
    let axes = some.as_deref().unwrap_or(records.fit);
    let all_of = |axes: &[AxisRecord], kind| -> Vec<Record> {
        axes.iter().map(|axis| Record::of(axis, kind)).collect()
    };
    let whole = all_of(axes, Kind::Unsteady);
    let mut unsteady = part_to_search(&whole).unwrap_or_else(|| whole.clone());
    let is_part = samples_of(&unsteady) < samples_of(&whole);
    let mut others = all_of(records.hold_out, Kind::Unsteady);
    let first = Beginning::of(axes, start, records.dry_mass_kg);
    let can_be = |candidate: &&Candidate| {
        candidate.exists_in(axes) && !(candidate.is_term() && terms.is_some())
    };
    let required: Vec<Candidate> = options.required.iter().filter(can_be).copied().collect();
    let mut unknowns = first.unknowns(terms);
    unknowns.extend(required.iter().flat_map(|c| c.unknowns()).map(|(unknown, _)| unknown));
    let linear = required.contains(&Candidate::LinearThrust);
    let searched = options.candidates.iter().filter(can_be);
    let candidates: Vec<Candidate> = searched.filter(|c| !required.contains(c)).copied().collect();
    let (mut spiked, begun) = strike_first(&mut unsteady, &mut others, &first, &unknowns, linear);
    let starts = match candidates.is_empty() {
        true => Vec::new(),
        false => starts(&first.values, axes, start),
    };
    let search = Search {
        records: &unsteady,
        priors: &first.priors,
        fixed: first.fixed(),
        starts: &starts,
        hold_out: &others,
        tried: candidates.len().max(1),
        knows_velocity: axes.iter().any(AxisRecord::knows_velocity),
    };
    let base = search.fit(&unknowns, linear, None, &begun);
    let (fitted, structure) = search.run(base, &candidates);
    if !fitted.optimum.converged {
        return Err(Error::NotConverged { dof, iterations: fitted.optimum.iterations });
    }
    let (of_search, on_part) = (fitted.clone(), search.clone());
    // A model that knows more takes less for a spike.
    let (mut clean, more);
    if is_part {
        clean = whole;
        let Fitted { problem, optimum } = &fitted;
        more =
            strike_out(&mut clean, |_, own| innovations_of_another(problem, &optimum.theta, own));
        spiked = more;
    } else {
        clean = unsteady.clone();
        let found = |k, _: &Record| fitted.problem.innovations(&fitted.optimum.theta, k);
        more = strike_out(&mut clean, found);
        spiked += more;
    }
    let search = Search { records: &clean, ..search.clone() };
    let fitted = if more == 0 && !is_part { fitted } else { search.again(&fitted) };
    if is_part && !fitted.optimum.converged {
        return Err(Error::NotConverged { dof, iterations: fitted.optimum.iterations });
    }
    let mut fit = into_fit(dof, &fitted, structure, axes)?;
    if !records.steady.is_empty() {
        let steady = all_of(records.steady, Kind::Steady);
        let all = [clean.clone(), steady].concat();
        let all_axes = [axes, records.steady].concat();
        fit = join(fit, &fitted, &Search { records: &all, ..search.clone() }, &all_axes)?;
    }
    fit.caveats.extend(hurried_disturbance(&fit, axes));
    fit.caveats.extend(accelerometer_doubts(&fit));
    fit.caveats.extend(hidden_drag(&fit, axes));
    fit.caveats.extend(struck_out(dof, spiked, &clean));
    if !candidates.is_empty() {
        let (fitted, search) = if is_part { (&of_search, &on_part) } else { (&fitted, &search) };
        fit.caveats.extend(lag_or_mass(&fit, fitted, search));
    }
    if is_part {
        fit.caveats.push(searched_on_part(dof, samples_of(&unsteady), samples_of(&clean)));
    }
    if some.is_some() {
        fit.caveats.push(fitted_to_some(dof, axes.len(), records.fit.len()));
    }
    Ok(fit)
}

/// Of more trials than this some are fitted: each may have a current of its own, and a step takes
/// time with the cube of their number.
pub(crate) const MOST_TRIALS: usize = 300;

/// Evenly spread ones of many trials; `None` of few.
fn some_of(axes: &[AxisRecord]) -> Option<Vec<AxisRecord>> {
    let place = |k: usize| k * axes.len() / MOST_TRIALS;
    (axes.len() > MOST_TRIALS).then(|| (0..MOST_TRIALS).map(|k| axes[place(k)].clone()).collect())
}

fn fitted_to_some(dof: Dof, some: usize, all: usize) -> Caveat {
    let message = format!(
        "the model of {dof} is fitted to {some} of {all} trials, spread evenly; all of them score it"
    );
    Caveat::note(CaveatCode::SearchedOnPart, message)
}

/// Of more samples than this, what the model has is searched on a part: the search takes a hundred
/// times what the last fit does, and more samples hardly change which terms there are.
pub(crate) const MOST_SEARCHED: usize = 40_000;

fn samples_of(records: &[Record]) -> usize {
    records.iter().map(Record::samples).sum()
}

/// Evenly spread pieces of long records; `None` of short ones, and where a piece has nothing to
/// start from.
fn part_to_search(records: &[Record]) -> Option<Vec<Record>> {
    let part = MOST_SEARCHED as f64 / samples_of(records) as f64;
    if part >= 1.0 {
        return None;
    }
    records.iter().map(|record| record.spread(part)).collect()
}

fn searched_on_part(dof: Dof, part: usize, whole: usize) -> Caveat {
    let message = format!(
        "which terms the model of {dof} has was decided on {part} of {whole} samples, in pieces spread over the record; the numbers are fitted to all of them"
    );
    Caveat::note(CaveatCode::SearchedOnPart, message)
}

/// Strikes out what the simplest model takes for spikes, from fitted and held-out records; how
/// many there were in the fitted ones, and the values of that model.
fn strike_first(
    fitted: &mut [Record],
    others: &mut [Record],
    first: &Beginning,
    unknowns: &[Unknown],
    linear: bool,
) -> (usize, Values) {
    let records = fitted.to_vec();
    let mut fixed = first.fixed();
    fixed.shape.linear = linear;
    let problem = Problem::new(&records, unknowns, &first.priors, fixed);
    let base = Fitted::of(problem, None, &first.values);
    let Fitted { problem, optimum } = &base;
    strike_out(others, |_, other| innovations_of_another(problem, &optimum.theta, other));
    let spikes = strike_out(fitted, |k, _| problem.innovations(&optimum.theta, k));
    let is_own = |unknown: &&Unknown| !unknown.is_of_trial();
    let mut values = first.values;
    for unknown in unknowns.iter().filter(is_own) {
        values.set(*unknown, problem.values(&optimum.theta, 0).get(*unknown));
    }
    (spikes, values)
}

fn struck_out(dof: Dof, spikes: usize, records: &[Record]) -> Option<Caveat> {
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
fn hidden_drag(fit: &Fit, axes: &[AxisRecord]) -> Option<Caveat> {
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
fn accelerometer_doubts(fit: &Fit) -> Vec<Caveat> {
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
            "the accelerometer in {} is smoothed before it is logged, with a {what} of {:.2} ± {:.2} s, which is allowed for here",
            fit.dof, time.value, time.std
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
fn lag_or_mass(fit: &Fit, fitted: &Fitted<'_>, search: &Search<'_>) -> Option<Caveat> {
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

/// Fits all trials, steady ones among them, if these ask for the same plant as the others.
fn join(
    fit: Fit,
    unsteady: &Fitted<'_>,
    search: &Search<'_>,
    axes: &[AxisRecord],
) -> Result<Fit, Error> {
    let Some(two) = TwoPlants::fit(unsteady, search) else { return Ok(fit) };
    let Some(test) = two.test() else { return Ok(fit) };
    let fit = match test.agrees {
        true => into_fit(fit.dof, &two.together, fit.structure, axes)?,
        false => fit,
    };
    Ok(Fit { steady_test: Some(test), ..fit })
}

/// The delays that a first look tries, s: every tenth of a second up to one.
pub fn first_delays() -> impl Iterator<Item = f64> {
    (0..=10).map(|tenth| 0.1 * f64::from(tenth))
}

/// Where the search begins, and what is believed before it.
struct Beginning {
    values: Values,
    priors: Vec<Prior>,
    /// Of each instrument that there is.
    noise: Vec<Unknown>,
}

impl Beginning {
    fn of(axes: &[AxisRecord], start: &DelayedFit, dry_mass_kg: Option<f64>) -> Self {
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
    fn fixed(&self) -> Values {
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
    fn unknowns(&self, terms: Option<Terms>) -> Vec<Unknown> {
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
fn plant(values: &mut Values, lumped: &LumpedParameters) {
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
fn starts(common: &Values, axes: &[AxisRecord], start: &DelayedFit) -> Vec<Values> {
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
        let options = OutputErrorOptions::default();
        if let Ok(fit) = fit_output_error(start.fit.dof, &timely, terms, own, &options)
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

const fn unknown_of(term: Term) -> Unknown {
    match term {
        Term::Force => Unknown::Alpha,
        Term::Quadratic => Unknown::Beta,
        Term::Linear => Unknown::Mu,
        Term::Bias => Unknown::Bias,
    }
}

/// A velocity sensor at rest reads about this part of the usual speed.
const OFFSET_PART: f64 = 0.1;

/// A fit of the lag starts no lower: at its limit, zero, it could not say which way to go.
const LEAST_LAG_S: f64 = 0.05;

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

fn force_rms(axes: &[AxisRecord]) -> f64 {
    rms(axes.iter().flat_map(|axis| axis.force.values()))
}

fn speed_rms(axes: &[AxisRecord]) -> f64 {
    let velocities: Vec<Timed> = axes.iter().filter_map(|axis| axis.velocity().ok()).collect();
    rms(velocities.iter().flat_map(|velocity| velocity.values()))
}

/// The plant of one record's kind.
pub(super) fn lumped(problem: &Problem<'_>, optimum: &Optimum, record: usize) -> LumpedParameters {
    let values = problem.values(&optimum.theta, record);
    let [alpha, beta, mu, bias] = Term::ALL.map(|term| values.get(unknown_of(term)));
    LumpedParameters { alpha, beta, mu, bias }
}

/// The terms that are fitted.
pub(super) fn terms_of(problem: &Problem<'_>) -> Result<Terms, Error> {
    let is_fitted = |term: &Term| problem.index(unknown_of(*term), 0).is_some();
    Terms::new(&Term::ALL.into_iter().filter(is_fitted).collect::<Vec<_>>())
}

/// Measurements that are left when all numbers are fitted.
pub(super) fn freedom(problem: &Problem<'_>) -> f64 {
    let samples = problem.samples();
    (samples - problem.len().min(samples - 1)) as f64
}

fn into_fit(
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
pub(super) fn plant_covariance(
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

/// A disturbance below this part of what thrust does is none to speak of.
const SLIGHT_DISTURBANCE: f64 = 0.05;

/// Tethers, currents and swell change over longer than this, s.
const QUICK_S: f64 = 1.0;

/// A disturbance that is quicker than anything that pulls at a vehicle from outside.
fn hurried_disturbance(fit: &Fit, axes: &[AxisRecord]) -> Option<Caveat> {
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

/// Innovations correlated by more than this from one to the next are not white.
const CORRELATED: f64 = 0.15;

fn caveats(fit: &Fit, innovations: &[Vec<f64>]) -> Vec<Caveat> {
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
                "thrust in {} follows its log with a {name} of {:.2} ± {:.2} s, which this method estimates; methods that ignore it give a wrong drag",
                fit.dof, estimate.value, estimate.std
            );
            caveats.push(Caveat::note(CaveatCode::LagOrDelay, message));
        }
    }
    caveats
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
