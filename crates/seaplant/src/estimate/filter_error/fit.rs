//! From records to a fitted plant.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::minimise::{Optimum, scaled_inverse, unit_diagonal};
use super::parameters::{UNKNOWNS, Unknown, Values};
use super::problem::{Kind, Prior, Problem, Record};
use super::schedule::Measurements;
use super::strength::covariance_with_thrust;
use super::structure::{Candidate, Decision, Fitted, Search, Usual};
use super::together::TwoPlants;
use crate::caveat::spoken;
use crate::estimate::{DelayedFit, Estimate, Fit, Innovations, Method, Nuisances, check_trials};
use crate::signal::autocorrelation;
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
}

/// Fits the plant by maximum likelihood on the innovations of a Kalman filter.
///
/// States are velocity, a slow disturbance and, where it was measured, position:
/// `v̇ = α τ* + β(v−u)|v−u| + (μ − α k_in Σ|n|)(v−u) + bias + d`, `ḋ = −d/T_d + w`, `ṗ = v`.
/// Velocity and position are taken in at their own times, each with its own noise. Thrust
/// τ* follows the logged one after a lag on propeller speed and a delay, with reverse
/// thrust scaled by κ; u is a current, constant in each trial. It minimises
/// `½ Σ (ln S + e²/S)` plus weak priors, by scoring on the Fisher information with
/// analytic sensitivities. Lag, delay, κ, u, k_in and, unless `terms` are given, linear
/// drag are admitted if the Bayesian information criterion asks for them and held-out
/// records are predicted no worse; a bias force is left out if the logs show that it is
/// too small to matter.
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
    let axes = records.fit;
    check_trials(dof, axes)?;
    let all_of = |axes: &[AxisRecord], kind| -> Vec<Record> {
        axes.iter().map(|axis| Record::of(axis, kind)).collect()
    };
    let unsteady = all_of(axes, Kind::Unsteady);
    let others = all_of(records.hold_out, Kind::Unsteady);
    let first = Beginning::of(axes, start);
    let mut search = Search {
        records: &unsteady,
        priors: &first.priors,
        fixed: first.fixed(),
        start: first.values,
        hold_out: &others,
        usual: Usual { speed: speed_rms(axes), thrust: force_rms(axes) },
        quickest: QUICK_S.ln(),
    };
    let can_be = |candidate: &&Candidate| {
        candidate.exists_in(axes) && !(candidate.is_term() && terms.is_some())
    };
    let required = options.required.iter().filter(can_be);
    let mut unknowns = first.unknowns(terms);
    unknowns.extend(required.map(|candidate| candidate.unknown()));
    let searched = options.candidates.iter().filter(can_be);
    let candidates: Vec<Candidate> =
        searched.filter(|candidate| !unknowns.contains(&candidate.unknown())).copied().collect();
    let base = search.fit(&unknowns, None, &first.values);
    let (fitted, structure) = search.run(base, &candidates);
    if !fitted.optimum.converged {
        return Err(Error::NotConverged { dof, iterations: fitted.optimum.iterations });
    }
    let fitted = quicker(&mut search, fitted);
    let mut fit = into_fit(dof, &fitted, structure, axes)?;
    if !records.steady.is_empty() {
        let steady = all_of(records.steady, Kind::Steady);
        let all = [unsteady.clone(), steady].concat();
        let all_axes = [axes, records.steady].concat();
        fit = join(fit, &fitted, &Search { records: &all, ..search }, &all_axes)?;
    }
    fit.caveats.extend(hurried_disturbance(&fit, axes));
    Ok(fit)
}

/// Lets the disturbance be as quick as a sample where it wants to be quicker than anything
/// that pulls at a vehicle from outside, as where a sensor smooths.
///
/// Not before the structure is found: a disturbance that forgets at once can take the place
/// of a lag.
fn quicker<'a>(search: &mut Search<'a>, fitted: Fitted<'a>) -> Fitted<'a> {
    let place = fitted.problem.index(Unknown::LogCorrelation, 0);
    let is_held = place.is_some_and(|place| fitted.optimum.theta[place] <= search.quickest);
    if !is_held {
        return fitted;
    }
    let wider = Search { quickest: QUICKEST_S.ln(), ..*search };
    let found = wider.fit(fitted.problem.unknowns(), Some(&fitted), &search.fixed);
    if !found.optimum.converged {
        return fitted;
    }
    *search = wider;
    found
}

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
    fn of(axes: &[AxisRecord], start: &DelayedFit) -> Self {
        let mut values = Values([0.0; UNKNOWNS]);
        let lumped = start.fit.lumped;
        let mut set = |unknown, value| values.set(unknown, value);
        // A wrong-signed mass is no place to start from; the scale of thrust is.
        set(Unknown::Alpha, lumped.alpha.abs().max(f64::MIN_POSITIVE));
        set(Unknown::Beta, lumped.beta.min(0.0));
        set(Unknown::Mu, lumped.mu.min(0.0));
        set(Unknown::Bias, lumped.bias);
        // What comes late may lag or be delayed; in doubt, half and half.
        let late_s = start.delay_s.max(0.0);
        set(Unknown::Lag, (0.5 * late_s).max(LEAST_LAG_S));
        set(Unknown::Delay, start.delay_s - 0.5 * late_s);
        let disturbance = (TYPICAL_DISTURBANCE * lumped.alpha.abs() * force_rms(axes)).max(1e-9);
        set(Unknown::LogDisturbance, disturbance.ln());
        set(Unknown::LogCorrelation, TYPICAL_CORRELATION_S.ln());
        let measurements: Vec<Measurements> = axes.iter().map(Measurements::of).collect();
        let velocities = measurements.iter().filter_map(Measurements::velocity);
        let positions = measurements.iter().filter_map(Measurements::position);
        let noise = [
            (Unknown::LogVelocityNoise, sample_noise(velocities)),
            (Unknown::LogPositionNoise, sample_noise(positions)),
        ];
        let noise: Vec<(Unknown, f64)> =
            noise.into_iter().filter_map(|(u, std)| Some((u, std?.max(1e-7).ln()))).collect();
        noise.iter().for_each(|(unknown, log_std)| set(*unknown, *log_std));
        let speeds = axes.iter().flat_map(AxisRecord::tracks).map(|t| t.forward.sqrt());
        let gain = speeds.fold(0.0_f64, f64::max).max(f64::MIN_POSITIVE);
        let prior = |unknown, mean, std| Prior { unknown, mean, std };
        let mut priors = vec![
            prior(Unknown::Lag, 0.0, 0.5),
            prior(Unknown::Delay, 0.0, 0.5),
            prior(Unknown::LogReverseRatio, 0.0, 0.3),
            prior(Unknown::Current, 0.0, 0.15),
            // 1 N s²/(rad m) for thrusters of 0.04 N/(rad/s)², and alike for others.
            prior(Unknown::Inflow, 0.0, 5.0 * gain),
            prior(Unknown::LeverFirst, 0.0, 0.5),
            prior(Unknown::LeverSecond, 0.0, 0.5),
            prior(Unknown::Turning, 1.0, 0.5),
            prior(Unknown::VelocityOffset, 0.0, OFFSET_PART * speed_rms(axes)),
            prior(Unknown::LogCorrelation, TYPICAL_CORRELATION_S.ln(), 1.5),
            prior(Unknown::LogDisturbance, disturbance.ln(), 2.0),
        ];
        priors.extend(noise.iter().map(|(unknown, log_std)| prior(*unknown, *log_std, 2.0)));
        Self { values, priors, noise: noise.into_iter().map(|(unknown, _)| unknown).collect() }
    }

    /// Values of what is not fitted: no nuisance, no term.
    fn fixed(&self) -> Values {
        let mut fixed = Values([0.0; UNKNOWNS]);
        for unknown in [
            Unknown::LogDisturbance,
            Unknown::LogCorrelation,
            Unknown::LogVelocityNoise,
            Unknown::LogPositionNoise,
        ] {
            fixed.set(unknown, self.values.get(unknown));
        }
        fixed
    }

    /// The terms asked for, or those that every vehicle has; and the noise.
    fn unknowns(&self, terms: Option<Terms>) -> Vec<Unknown> {
        let terms = terms.map_or(vec![Term::Force, Term::Quadratic], |terms| terms.fitted());
        let noise = [Unknown::LogDisturbance, Unknown::LogCorrelation];
        let offset = (self.noise.len() > 1).then_some(Unknown::VelocityOffset);
        let of_terms = terms.into_iter().map(unknown_of);
        of_terms.chain(noise).chain(self.noise.iter().copied()).chain(offset).collect()
    }
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

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, n), x| (sum + x * x, n + 1));
    (sum / count.max(1) as f64).sqrt()
}

fn force_rms(axes: &[AxisRecord]) -> f64 {
    rms(axes.iter().flat_map(|axis| axis.force.values()).copied())
}

fn speed_rms(axes: &[AxisRecord]) -> f64 {
    let velocities: Vec<Timed> = axes.iter().filter_map(|axis| axis.velocity().ok()).collect();
    rms(velocities.iter().flat_map(|velocity| velocity.values()).copied())
}

/// The noise of one sample, from third differences: what a vehicle cannot do in three
/// samples. White noise of variance σ² has third differences of variance 20 σ².
fn sample_noise<'a>(series: impl Iterator<Item = &'a Timed>) -> Option<f64> {
    let mut thirds = series.flat_map(|series| series.values().windows(4)).peekable();
    thirds.peek()?;
    Some(rms(thirds.map(|y| y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0])) / 20_f64.sqrt())
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
    let of_logs = scaled_inverse(&optimum.information).ok_or_else(stuck)?;
    let with_thrust = covariance_with_thrust(problem, &optimum.theta, axes);
    let all = with_thrust.unwrap_or_else(|| of_logs.clone());
    let of_thrust = &all - of_logs;
    let samples = problem.samples();
    let freedom = freedom(problem);
    let innovations: Vec<Vec<f64>> =
        (0..problem.records.len()).map(|k| problem.innovations(&optimum.theta, k)).collect();
    let values = problem.values(&optimum.theta, 0);
    let mut fit = Fit {
        dof,
        method: Method::FilterError,
        terms: terms_of(problem)?,
        lumped: lumped(problem, optimum, 0),
        covariance: plant_covariance(problem, &all, 0),
        thrust_covariance: plant_covariance(problem, &of_thrust, 0),
        t_freedom: freedom,
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
        caveats: Vec::new(),
    };
    fit.caveats = caveats(&fit, &innovations);
    Ok(fit)
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
        turning: estimate(Unknown::Turning, 0),
        lever_m: [estimate(Unknown::LeverFirst, 0), estimate(Unknown::LeverSecond, 0)],
        disturbance: estimate(Unknown::LogDisturbance, 0).map(exponential),
        correlation_s: estimate(Unknown::LogCorrelation, 0).map(exponential),
        velocity_noise: estimate(Unknown::LogVelocityNoise, 0).map(exponential),
        position_noise: estimate(Unknown::LogPositionNoise, 0).map(exponential),
    }
}

/// A disturbance below this part of what thrust does is none to speak of.
const SLIGHT_DISTURBANCE: f64 = 0.05;

/// Tethers, currents and swell change over longer than this, s …
const QUICK_S: f64 = 1.0;

/// … and a disturbance that forgets within this is noise.
const QUICKEST_S: f64 = 0.05;

/// A disturbance that is quicker than anything that pulls at a vehicle from outside.
fn hurried_disturbance(fit: &Fit, axes: &[AxisRecord]) -> Option<Caveat> {
    let (correlation_s, disturbance) =
        fit.nuisances.correlation_s.zip(fit.nuisances.disturbance)?;
    let thrust = fit.lumped.alpha * force_rms(axes);
    let matters = disturbance.value > SLIGHT_DISTURBANCE * thrust;
    (matters && correlation_s.value < QUICK_S).then(|| {
        let message = format!(
            "what moves the vehicle in {} beside its thrust changes within {} s and is {:.0} % as strong as the thrust: the model lacks something quick (another axis, the rudder, a smoothed or noisy sensor), and its intervals are rough",
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
            "what the {} model fails to predict is correlated from one sample to the next ({correlation:+.2}): something moves the vehicle that the model does not know (waves, another axis, a smoothed sensor), and the intervals are too narrow",
            fit.dof
        );
        caveats.push(Caveat::warning(CaveatCode::ResidualsNotWhite, message));
    }
    let late = [("lag", fit.nuisances.lag_s), ("delay", fit.nuisances.delay_s)];
    for (name, estimate) in late {
        if let Some(estimate) = estimate.filter(|estimate| !estimate.covers(0.0)) {
            let message = format!(
                "thrust in {} follows its log with a {name} of {:.2} ± {:.2} s, which is allowed for here; methods that ignore it get the drag wrong",
                fit.dof, estimate.value, estimate.std
            );
            caveats.push(Caveat::note(CaveatCode::LagOrDelay, message));
        }
    }
    caveats
}

fn condition(information: &DMatrix<f64>) -> f64 {
    let scale = unit_diagonal(information);
    let eigen = (&scale * information * &scale).symmetric_eigenvalues();
    (eigen.max() / eigen.min().max(f64::MIN_POSITIVE)).sqrt()
}
