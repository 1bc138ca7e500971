//! The fit that comes of an optimum of one axis.

use nalgebra::DMatrix;

use super::sensor::Sensor;
use super::{NUMBERS, OneAxis, axis_of, decision};
use crate::caveat::estimated;
use crate::estimate::axis_plant::lumped_plant;
use crate::estimate::candidate::{Candidate, Decision};
use crate::estimate::descend::unit_diagonal;
use crate::estimate::plant_fit::actuator::Actuator;
use crate::estimate::plant_fit::filter::Innovation;
use crate::estimate::plant_fit::problem::Problem;
use crate::estimate::plant_fit::search::ADMITTED;
use crate::estimate::plant_fit::{Fitted, PlantFit, restless_thrust};
use crate::estimate::{Estimate, Fit, Innovations, Method, Nuisances, Waves};
use crate::plant::{Basis, Product, Structure};
use crate::signal::autocorrelation;
use crate::terms::Term;
use crate::{AxisRecord, Caveat, CaveatCode, Dof, Error, Terms};

impl OneAxis<'_> {
    /// Errors of one-step predictions, by trial, each divided by its standard deviation.
    pub(super) fn innovations(&self, fitted: &Fitted) -> Result<Vec<Vec<f64>>, Error> {
        let (problem, optimum) = fitted.parts();
        let mut by_trial = vec![Vec::new(); self.axes.len()];
        let found = problem.innovations(&optimum.point)?;
        for (schedule, own) in problem.schedules.iter().zip(found) {
            let of_axis = own.iter().filter(|innovation| innovation.axis.is_some());
            by_trial[schedule.trial].extend(of_axis.map(Innovation::normalised));
        }
        Ok(by_trial)
    }

    /// Adds what came of the candidates that are numbers of the actuator, effects or noise.
    pub(super) fn decide_others(
        &self,
        fit: &PlantFit,
        problem: &Problem,
        sensor: Option<Sensor>,
        decisions: &mut Vec<Decision>,
    ) {
        let numbers = fit.actuator.numbers();
        for candidate in self.candidates.iter().chain(self.required) {
            if decisions.iter().any(|decision| decision.candidate == *candidate) {
                continue;
            }
            let number = NUMBERS.iter().find(|(own, _)| own == candidate);
            let squared = |x: f64, std: f64| (x / std).powi(2);
            let (ratio, needed) = match (candidate, number) {
                (_, Some((_, k))) => {
                    let ratio = fit.actuator_std[*k].map(|std| squared(numbers[*k], std));
                    (ratio, Actuator::shows(*k, numbers[*k]).min(ADMITTED))
                }
                (Candidate::SensorLag | Candidate::SensorWindow, _) => {
                    let is_window = *candidate == Candidate::SensorWindow;
                    let own = sensor.filter(|sensor| sensor.lag.is_window == is_window);
                    (own.map(|own| squared(own.lag.time_s, own.std)), ADMITTED)
                }
                (Candidate::Swell, _) => {
                    let force = fit.swell.as_ref().and_then(|swell| swell.force.values().next());
                    (force.map(|(x, std)| squared(*x, *std)), ADMITTED)
                }
                (Candidate::CurrentDrift, _) => {
                    let drift = fit.current_drift.map(|drift| drift.std_m_s);
                    (drift.map(|(x, std)| squared(x, std)), ADMITTED)
                }
                (Candidate::ThrustJitter, _) => {
                    (fit.thrust_jitter_s.map(|(x, std)| squared(x, std)), ADMITTED)
                }
                (Candidate::Inflow | Candidate::InflowAhead, _) => {
                    let own = fit.tried.iter().find(|tried| tried.name == candidate.name());
                    let ratio = own.map_or(0.0, |tried| tried.likelihood_ratio);
                    let is_there = problem.structure.names().contains(&candidate.name().to_owned());
                    decisions.push(decision(*candidate, ratio, ADMITTED, is_there));
                    continue;
                }
                (Candidate::VelocityScale, _) => continue,
                _ => (self.required.contains(candidate).then_some(0.0), 0.0),
            };
            decisions.push(decision(*candidate, ratio.unwrap_or(0.0), needed, ratio.is_some()));
        }
    }

    pub(super) fn reported(
        &self,
        found: &PlantFit,
        problem: &Problem,
        decisions: &[Decision],
        innovations: Vec<Vec<f64>>,
    ) -> Result<Fit, Error> {
        let samples = found.samples;
        let numbers =
            problem.structure.terms().len() + problem.fits.iter().filter(|fits| **fits).count();
        let freedom = (samples - numbers.min(samples - 1)) as f64;
        let (lumped, mut covariance) = lumped_plant(&found.plant, &found.covariance);
        let (_, thrust_covariance) = lumped_plant(&found.plant, &found.thrust_covariance);
        if !self.axes.iter().any(AxisRecord::knows_velocity) {
            let parts = [PRECISION_OF_MASS, PRECISION_OF_DRAG, PRECISION_OF_DRAG, 0.0];
            for (k, part) in parts.into_iter().enumerate() {
                covariance[(k, k)] += (part * lumped.to_vector()[k]).powi(2);
            }
        }
        let axis = axis_of(self.dof);
        let nuisances = self.nuisances(found, problem, lumped.alpha, freedom);
        let of_trial = |(axis, errors): (&AxisRecord, &Vec<f64>)| Innovations {
            trial: axis.trial.clone(),
            samples: errors.len(),
            autocorrelation: autocorrelation(errors, 0..=LAGS.min(errors.len().saturating_sub(1))),
        };
        let mut fit = Fit {
            dof: self.dof,
            method: Method::FilterError,
            terms: terms_of(&found.plant.structure().clone(), axis)?,
            lumped,
            covariance,
            thrust_covariance,
            t_freedom: freedom,
            condition: 1.0,
            inflation: Vec::new(),
            samples,
            effective_samples: samples as f64,
            residual_rms: nuisances.disturbance.map_or(0.0, |x| x.value),
            filters: Default::default(),
            nuisances,
            structure: decisions.to_vec(),
            steady_test: None,
            innovations: self.axes.iter().zip(&innovations).map(of_trial).collect(),
            history: None,
            caveats: Vec::new(),
            start: None,
        };
        fit.caveats = caveats(&fit, &innovations);
        let beyond = found.beyond_neighbours.values().copied().fold(0.0, f64::max);
        fit.caveats.extend(restless_thrust(self.dof, beyond));
        fit.caveats.extend(found.thrust_by_another_power());
        fit.caveats.extend(found.thrust_by_voltage());
        fit.caveats.extend(found.thrust_that_changes());
        Ok(fit)
    }

    fn nuisances(
        &self,
        found: &PlantFit,
        problem: &Problem,
        alpha: f64,
        freedom: f64,
    ) -> Nuisances {
        let axis = axis_of(self.dof);
        let linear = |value: f64, std: f64| Estimate::new(value, std, freedom);
        let positive = |number| positive(number, freedom);
        let by = |k: usize| Some(linear(found.actuator.numbers()[k], found.actuator_std[k]?));
        let exponential = |x: Estimate| positive((x.value.exp(), x.std * x.value.exp()));
        let growth = |log: Estimate| linear(log.value.exp_m1(), log.std * log.value.exp());
        let by_effect = |name: &str| {
            let structure = found.plant.structure();
            let k = structure.index_of(&structure.term_named(name)?)?;
            Some(linear(found.plant.coefficients()[k], found.covariance[(k, k)].sqrt()))
        };
        let scaled = |(value, std): (f64, f64)| positive((alpha * value, alpha * std));
        let noise = found.disturbances.get(&axis);
        let instrument = |name: &str| found.instruments.get(name).copied().map(positive);
        let measured = noise.map(|own| own.velocity).filter(|(_, std)| std.is_finite());
        let currents = found.currents.iter().filter(|_| problem.has_current);
        let currents =
            currents.map(|(trial, [(value, std), _])| (trial.clone(), linear(*value, *std)));
        let position = if self.dof.is_rotation() { "heading_noise" } else { "position_noise" };
        let swell = found.swell.as_ref().and_then(|swell| {
            Some(Waves {
                strength: scaled(*swell.force.get(&axis)?),
                period_s: positive(swell.period_s),
                damping: positive(swell.damping),
            })
        });
        Nuisances {
            lag_s: by(Actuator::LAG),
            delay_s: by(Actuator::DELAY),
            reverse_ratio: by(Actuator::REVERSE).map(exponential),
            inflow: by_effect(Candidate::Inflow.name()),
            lag_ratio: by(Actuator::LAG_RATIO).map(exponential),
            falling_lag_ratio: by(Actuator::FALLING_LAG_RATIO).map(exponential),
            slew_s: by(Actuator::SLEW),
            inflow_ahead: by_effect(Candidate::InflowAhead.name()),
            exponent: by(Actuator::EXPONENT).map(|off| off.moved(2.0)),
            dead_band: by(Actuator::DEAD_BAND),
            full_speed: found.actuator.full_speed,
            voltage_exponent: by(Actuator::VOLTAGE),
            mean_voltage_v: found.actuator.ln_voltage[0].exp(),
            change_within: by(Actuator::CHANGE_WITHIN).map(growth),
            change_between: by(Actuator::CHANGE_BETWEEN).map(growth),
            between: found.actuator.between,
            velocity_scale: None,
            lever_m: Default::default(),
            sensor_lag_s: None,
            sensor_window_s: None,
            swell,
            thrust_jitter_s: found.thrust_jitter_s.map(positive),
            current_drift: found.current_drift.map(|drift| positive(drift.std_m_s)),
            current: currents.collect(),
            turning: by_effect(Candidate::Turning.name()).map(|force| Estimate {
                value: alpha * force.value,
                std: alpha * force.std,
                low95: alpha * force.low95,
                high95: alpha * force.high95,
            }),
            disturbance: noise.map(|own| scaled(own.disturbance)),
            correlation_s: noise.map(|own| positive(own.correlation_s)),
            velocity_noise: measured.map(positive),
            position_noise: instrument(position),
            acceleration_noise: instrument("acceleration_noise_x"),
            leak: instrument("gravity_leak"),
            leak_correlation_s: instrument("gravity_leak_correlation"),
        }
    }
}

/// The greatest standard deviation of a logarithm: what is not known at all is within twenty powers of ten.
const MOST_LOG_STD: f64 = 20.0;

/// Returns the estimate of a number above zero, whose logarithm has a symmetric interval.
pub(super) fn positive((value, std): (f64, f64), freedom: f64) -> Estimate {
    let log = Estimate::new(value.ln(), (std / value).min(MOST_LOG_STD), freedom);
    Estimate { value, std, low95: log.low95.exp(), high95: log.high95.exp() }
}

/// Number of lags of the autocorrelation of innovations.
const LAGS: usize = 40;

/// Where velocity is known only by integrating acceleration, it is known to a tenth, and the filter, which
/// goes by the slope of drag there, leaves out its bend: drag is off by some hundredths …
const PRECISION_OF_DRAG: f64 = 0.02;

/// … and mass by less.
const PRECISION_OF_MASS: f64 = 0.01;

fn terms_of(structure: &Structure, axis: Dof) -> Result<Terms, Error> {
    let term = |term: &Basis| match term {
        Basis::Mass(..) => Some(Term::Force),
        Basis::Product(_, product) if *product == Product::linear(axis) => Some(Term::Linear),
        Basis::Product(..) => Some(Term::Quadratic),
        Basis::One(_) => Some(Term::Bias),
        _ => None,
    };
    Terms::new(&structure.terms().iter().filter_map(term).collect::<Vec<_>>())
}

/// Condition number of the information on what is fitted, scaled to a unit diagonal.
pub(super) fn condition(information: &DMatrix<f64>) -> f64 {
    let told: Vec<usize> =
        (0..information.nrows()).filter(|k| information[(*k, *k)] > 0.0).collect();
    let own = information.select_rows(&told).select_columns(&told);
    let scale = unit_diagonal(&own);
    let scaled = &scale * own * &scale;
    if !scaled.iter().all(|x| x.is_finite()) {
        return f64::INFINITY;
    }
    let eigen = scaled.symmetric_eigenvalues();
    (eigen.max() / eigen.min().max(f64::MIN_POSITIVE)).sqrt()
}

/// Innovations correlated by more than this from one to the next are not white.
const CORRELATED: f64 = 0.15;

/// What innovations and lags give reason to doubt or to note.
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
            let how = match estimate.value < 0.0 {
                true => "acts before its log says by".to_owned(),
                false => format!("follows its log with a {name} of"),
            };
            let message = format!(
                "thrust in {} {how} {} s, which this method estimates; methods that ignore it give a wrong drag",
                fit.dof,
                estimated(estimate.value.abs(), estimate.std)
            );
            caveats.push(Caveat::note(CaveatCode::LagOrDelay, message));
        }
    }
    caveats
}
