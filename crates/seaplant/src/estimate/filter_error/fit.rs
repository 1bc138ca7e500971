//! From records to a fitted plant.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::minimise::{Optimum, limits, scaled_inverse, unit_diagonal};
use super::parameters::{UNKNOWNS, Unknown, Values};
use super::problem::{Prior, Problem, Record};
use super::structure::{Candidate, Decision, Fitted, Search};
use crate::estimate::{DelayedFit, Estimate, Fit, Method, Nuisances, check_trials};
use crate::navigation::Motion;
use crate::terms::Term;
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Error, Model, Terms, ThrustModel};

/// The choices of the filter error method.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilterErrorOptions {
    /// What may be taken into the model where the logs ask for it.
    pub candidates: Vec<Candidate>,
}

impl Default for FilterErrorOptions {
    fn default() -> Self {
        Self { candidates: Candidate::ALL.to_vec() }
    }
}

/// Fits the plant by maximum likelihood on the innovations of a Kalman filter.
///
/// States are velocity, a slow disturbance and, where it is what was measured, position:
/// `v̇ = α τ* + β(v−u)|v−u| + (μ − α k_in Σ|n|)(v−u) + bias + d`, `ḋ = −d/T_d + w`. Thrust
/// τ* follows the logged one after a lag on propeller speed and a delay, with reverse
/// thrust scaled by κ; u is a current, constant in each trial. It minimises
/// `½ Σ (ln S + e²/S)` plus weak priors, by scoring on the Fisher information with
/// analytic sensitivities. Lag, delay, κ, u, k_in and, unless `terms` are given, linear
/// drag are admitted one by one, if the Bayesian information criterion asks for them and
/// held-out records are predicted no worse.
///
/// `start` is a fit to begin with, by equation error, with the delay that suits it best.
///
/// # Errors
/// [`Error::NoTrial`] without records; [`Error::NotConverged`] if no optimum is reached.
///
/// # Source
/// [Jategaonkar2015, ch. 5]: filter error method; score test: \[Young2011\].
pub fn fit_filter_error(
    dof: Dof,
    axes: &[AxisRecord],
    hold_out: &[AxisRecord],
    terms: Option<Terms>,
    start: &DelayedFit,
    options: &FilterErrorOptions,
) -> Result<Fit, Error> {
    check_trials(dof, axes)?;
    let records: Vec<Record> = axes.iter().map(Record::of).collect();
    let others: Vec<Record> = hold_out.iter().map(Record::of).collect();
    let first = Beginning::of(axes, start);
    let search = Search {
        records: &records,
        priors: &first.priors,
        fixed: first.fixed(),
        start: first.values,
        hold_out: &others,
    };
    let base = search.fit(&first.unknowns(terms.unwrap_or_default()), None, &first.values);
    let candidates: Vec<Candidate> = options
        .candidates
        .iter()
        .copied()
        .filter(|c| c.exists_in(axes) && (*c != Candidate::LinearDrag || terms.is_none()))
        .collect();
    let (fitted, structure) = search.run(base, &candidates);
    if !fitted.optimum.converged {
        return Err(Error::NotConverged { dof, iterations: fitted.optimum.iterations });
    }
    let mut fit = into_fit(dof, &fitted, structure, &records)?;
    fit.caveats.extend(hurried_disturbance(&fit, axes));
    Ok(fit)
}

/// The delays that a first look tries, s: every tenth of a second up to one.
pub fn first_delays() -> impl Iterator<Item = f64> {
    (0..=10).map(|tenth| 0.1 * f64::from(tenth))
}

/// Where the search begins, and what is believed before it.
struct Beginning {
    values: Values,
    priors: Vec<Prior>,
    noise: Unknown,
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
        let force_rms = rms(axes.iter().flat_map(|axis| axis.force.values()).copied());
        let disturbance = (TYPICAL_DISTURBANCE * lumped.alpha.abs() * force_rms).max(1e-9);
        set(Unknown::LogDisturbance, disturbance.ln());
        set(Unknown::LogCorrelation, TYPICAL_CORRELATION_S.ln());
        let is_position = axes.iter().any(|axis| matches!(axis.motion, Motion::Position(_)));
        let noise = if is_position { Unknown::LogPositionNoise } else { Unknown::LogVelocityNoise };
        let noise_std = sample_noise(axes).max(1e-7);
        set(Unknown::LogPositionNoise, noise_std.ln());
        set(Unknown::LogVelocityNoise, noise_std.ln());
        let speeds = axes.iter().flat_map(AxisRecord::tracks).map(|t| t.forward.sqrt());
        let gain = speeds.fold(0.0_f64, f64::max).max(f64::MIN_POSITIVE);
        let prior = |unknown, mean, std| Prior { unknown, mean, std };
        let priors = vec![
            prior(Unknown::Lag, 0.0, 0.5),
            prior(Unknown::Delay, 0.0, 0.5),
            prior(Unknown::LogReverseRatio, 0.0, 0.3),
            prior(Unknown::Current, 0.0, 0.15),
            // 1 N s²/(rad m) for thrusters of 0.04 N/(rad/s)², and alike for others.
            prior(Unknown::Inflow, 0.0, 5.0 * gain),
            prior(Unknown::LeverFirst, 0.0, 0.5),
            prior(Unknown::LeverSecond, 0.0, 0.5),
            prior(Unknown::LogCorrelation, TYPICAL_CORRELATION_S.ln(), 1.5),
            prior(Unknown::LogDisturbance, disturbance.ln(), 2.0),
            prior(noise, noise_std.ln(), 2.0),
        ];
        Self { values, priors, noise }
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

    fn unknowns(&self, terms: Terms) -> Vec<Unknown> {
        let of = |term| match term {
            Term::Force => Unknown::Alpha,
            Term::Quadratic => Unknown::Beta,
            Term::Linear => Unknown::Mu,
            Term::Bias => Unknown::Bias,
        };
        let noise = [Unknown::LogDisturbance, Unknown::LogCorrelation, self.noise];
        terms.fitted().into_iter().map(of).chain(noise).collect()
    }
}

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

/// The noise of one sample, from third differences: what a vehicle cannot do in three
/// samples. White noise of variance σ² has third differences of variance 20 σ².
fn sample_noise(axes: &[AxisRecord]) -> f64 {
    let thirds = axes.iter().flat_map(|axis| axis.motion.series().values().windows(4));
    rms(thirds.map(|y| y[3] - 3.0 * y[2] + 3.0 * y[1] - y[0])) / 20_f64.sqrt()
}

fn model(problem: &Problem<'_>, optimum: &Optimum) -> Model {
    let values = problem.values(&optimum.theta, 0);
    let of = |unknown| values.get(unknown);
    let current = problem.records.iter().enumerate().filter_map(|(k, record)| {
        let place = problem.index(Unknown::Current, k)?;
        Some((record.trial.clone(), optimum.theta[place]))
    });
    Model {
        lumped: crate::LumpedParameters {
            alpha: of(Unknown::Alpha),
            beta: of(Unknown::Beta),
            mu: of(Unknown::Mu),
            bias: of(Unknown::Bias),
        },
        thrust: ThrustModel {
            lag_s: of(Unknown::Lag),
            delay_s: of(Unknown::Delay),
            reverse_ratio: of(Unknown::LogReverseRatio).exp(),
            inflow: of(Unknown::Inflow),
            current: current.collect(),
        },
    }
}

fn into_fit(
    dof: Dof,
    fitted: &Fitted<'_>,
    structure: Vec<Decision>,
    records: &[Record],
) -> Result<Fit, Error> {
    let Fitted { problem, optimum } = fitted;
    let stuck = || Error::NotConverged { dof, iterations: optimum.iterations };
    let all = scaled_inverse(&optimum.information).ok_or_else(stuck)?;
    let model = model(problem, optimum);
    let terms: Vec<Term> = [
        (Term::Force, Unknown::Alpha),
        (Term::Quadratic, Unknown::Beta),
        (Term::Linear, Unknown::Mu),
        (Term::Bias, Unknown::Bias),
    ]
    .into_iter()
    .filter(|(_, unknown)| problem.index(*unknown, 0).is_some())
    .map(|(term, _)| term)
    .collect();
    let samples = problem.samples();
    let freedom = (samples - problem.len().min(samples - 1)) as f64;
    let innovations: Vec<Vec<f64>> =
        (0..records.len()).map(|k| problem.innovations(&optimum.theta, k)).collect();
    let values = problem.values(&optimum.theta, 0);
    let mut fit = Fit {
        dof,
        method: Method::FilterError,
        terms: Terms::new(&terms)?,
        lumped: model.lumped,
        covariance: plant_covariance(problem, &all),
        t_freedom: freedom,
        condition: condition(&optimum.information),
        inflation: Vec::new(),
        samples,
        effective_samples: samples as f64,
        residual_rms: values.get(Unknown::LogDisturbance).exp(),
        filters: Default::default(),
        nuisances: nuisances(problem, optimum, &all, freedom),
        structure,
        caveats: Vec::new(),
    };
    fit.caveats = caveats(&fit, &innovations);
    Ok(fit)
}

fn plant_covariance(problem: &Problem<'_>, all: &DMatrix<f64>) -> Matrix4<f64> {
    let place = [Unknown::Alpha, Unknown::Beta, Unknown::Mu, Unknown::Bias]
        .map(|unknown| problem.index(unknown, 0));
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
    let currents = problem
        .records
        .iter()
        .enumerate()
        .filter_map(|(k, record)| Some((record.trial.clone(), estimate(Unknown::Current, k)?)));
    Nuisances {
        lag_s: estimate(Unknown::Lag, 0),
        delay_s: estimate(Unknown::Delay, 0),
        reverse_ratio: estimate(Unknown::LogReverseRatio, 0).map(exponential),
        inflow: estimate(Unknown::Inflow, 0),
        current: currents.collect::<BTreeMap<_, _>>(),
        lever_m: [estimate(Unknown::LeverFirst, 0), estimate(Unknown::LeverSecond, 0)],
        disturbance: estimate(Unknown::LogDisturbance, 0).map(exponential),
        correlation_s: estimate(Unknown::LogCorrelation, 0).map(exponential),
        velocity_noise: estimate(Unknown::LogVelocityNoise, 0).map(exponential),
        position_noise: estimate(Unknown::LogPositionNoise, 0).map(exponential),
    }
}

/// A disturbance below this part of what thrust does is none to speak of.
const SLIGHT_DISTURBANCE: f64 = 0.05;

/// A disturbance that wants to forget faster than the method lets it.
fn hurried_disturbance(fit: &Fit, axes: &[AxisRecord]) -> Option<Caveat> {
    let shortest_s = limits(Unknown::LogCorrelation).0.exp();
    let (correlation_s, disturbance) =
        fit.nuisances.correlation_s.zip(fit.nuisances.disturbance)?;
    let thrust = fit.lumped.alpha * rms(axes.iter().flat_map(|axis| axis.force.values()).copied());
    let matters = disturbance.value > SLIGHT_DISTURBANCE * thrust;
    // At the limit itself, give or take rounding.
    (matters && correlation_s.value < 1.001 * shortest_s).then(|| {
        let message = format!(
            "what moves the vehicle in {} beside its thrust changes within {shortest_s} s, the least that the method allows for, and is {:.0} % as strong as the thrust: the model lacks something quick (another axis, the rudder, a smoothed or noisy sensor), and its intervals are rough",
            fit.dof,
            100.0 * disturbance.value / thrust
        );
        Caveat::warning(CaveatCode::ResidualsNotWhite, message)
    })
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
