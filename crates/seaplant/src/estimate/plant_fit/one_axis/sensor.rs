//! A velocity sensor that smooths, in place of thrust that lags.

use super::report::positive;
use super::{LATER, LEAST_LAG_S, OneAxis, axis_of};
use crate::TrialRecord;
use crate::estimate::Fit;
use crate::estimate::candidate::Candidate;
use crate::estimate::plant_fit::actuator::Actuator;
use crate::estimate::plant_fit::descent::Tolerance;
use crate::estimate::plant_fit::problem::Point;
use crate::estimate::plant_fit::search::ADMITTED;
use crate::estimate::plant_fit::sensor_lag::SensorLag;
use crate::estimate::plant_fit::{COLOURED, Fitted};

impl OneAxis<'_> {
    /// The same with a velocity sensor that lags, if that is likelier by more than chance than what imitates
    /// it, and its lag with its standard deviation, s.
    ///
    /// The likelihood is that of the best plant at each lag: about its maximum, a parabola of the logarithm
    /// of the lag.
    pub(super) fn with_sensor_lag_that_shows(
        &self,
        fitted: Fitted,
        records: &[&TrialRecord],
    ) -> (Fitted, Option<Sensor>) {
        let smooths = [(Candidate::SensorLag, false), (Candidate::SensorWindow, true)];
        let smooths = || smooths.into_iter().filter(|(candidate, _)| self.may_have(*candidate));
        let actuator = fitted.optimum.point.actuator;
        let is_late = actuator.lag_s.max(actuator.delay_s).max(actuator.slew_s) > LEAST_LATE_S;
        let is_white = || {
            let white = fitted.whiteness().map(|white| white(axis_of(self.dof)));
            white.is_ok_and(|white| white < COLOURED)
        };
        let is_required = smooths().any(|(candidate, _)| self.required.contains(&candidate));
        if !is_late && is_white() && !is_required {
            return (fitted, None);
        }
        // What the sensor is late by need not be that of thrust.
        let mut start = fitted.optimum.point.clone();
        let mut sensor = fitted.problem.clone();
        let shown = self.shown();
        let [slowing, falling] = Actuator::LAG_RATIOS;
        for k in [Actuator::LAG, Actuator::DELAY, slowing, falling, Actuator::SLEW] {
            sensor.fits[k] = sensor.requires[k] || shown[k] && !LATER.contains(&k);
        }
        let mut numbers = actuator.numbers();
        numbers[Actuator::LAG] = LEAST_LAG_S;
        (numbers[slowing], numbers[falling]) = (0.0, 0.0);
        if !sensor.fits[Actuator::SLEW] {
            numbers[Actuator::SLEW] = 0.0;
        }
        start.actuator = actuator.with(numbers);
        let at = |lag: SensorLag, from: &Point, with_noise: bool| {
            let problem = sensor.with_sensor_lag(records, lag);
            let optimum = match with_noise {
                true => problem.descent(from.clone(), Tolerance::COARSE),
                false => problem.descent_at_noise(from.clone(), Tolerance::COARSE),
            };
            Some(Lagging { lag, fitted: fitted.moved_to(problem, optimum.ok()?) })
        };
        let kinds: Vec<bool> = smooths().map(|(_, is_window)| is_window).collect();
        let least = if is_required { f64::INFINITY } else { fitted.optimum.cost };
        let Some((found, std)) = likeliest(&at, &start, &kinds, least) else {
            return (fitted, None);
        };
        match 2.0 * (fitted.optimum.cost - found.cost()) > ADMITTED || is_required {
            true => (found.fitted, Some(Sensor { lag: found.lag, std })),
            false => (fitted, None),
        }
    }
}

/// A velocity sensor that lags, with the standard deviation of its time, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sensor {
    pub(super) lag: SensorLag,
    pub(super) std: f64,
}

impl Sensor {
    /// Adds the sensor to the nuisances of a fit.
    pub(super) fn report(self, fit: &mut Fit) {
        let Self { lag: SensorLag { time_s, is_window }, std } = self;
        let own = Some(positive((time_s, std), fit.t_freedom));
        match is_window {
            true => fit.nuisances.sensor_window_s = own,
            false => fit.nuisances.sensor_lag_s = own,
        }
    }
}

/// A lag or a delay of thrust in whose place a sensor may lag, s.
const LEAST_LATE_S: f64 = 0.02;

/// A fit with a velocity sensor that lags.
struct Lagging {
    lag: SensorLag,
    fitted: Fitted,
}

impl Lagging {
    fn cost(&self) -> f64 {
        self.fitted.optimum.cost
    }
}

/// Lags of a velocity sensor at which the search begins, s.
const FIRST_SENSOR_LAGS_S: [f64; 3] = [0.12, 0.3, 0.75];

/// Factors from one lag to the next about the best, from coarse to fine.
const NEARER: [f64; 2] = [1.4, 1.15];

/// Window that smooths as a lag does, over that lag: both have the same variance about their delay.
const WINDOW_OF_LAG: f64 = 3.464_101_615_137_754_6;

/// Fits with a sensor from a point, with the noise or at that of the point.
type FitWithSensor<'a> = dyn Fn(SensorLag, &Point, bool) -> Option<Lagging> + 'a;

/// Finds the likeliest sensor of some kinds, windows or not, with the standard deviation of its time; `None` if
/// the first lags make no fit likelier than `least` costs.
fn likeliest(
    at: &FitWithSensor<'_>,
    start: &Point,
    kinds: &[bool],
    least: f64,
) -> Option<(Lagging, f64)> {
    let scale = |is_window: bool| if is_window { WINDOW_OF_LAG } else { 1.0 };
    let of = |time_s: f64, is_window: bool| SensorLag { time_s, is_window };
    let kind = *kinds.first()?;
    let first = FIRST_SENSOR_LAGS_S.iter();
    let first = first.filter_map(|time_s| at(of(scale(kind) * time_s, kind), start, false));
    let first = first.min_by(|a, b| a.cost().total_cmp(&b.cost()))?;
    let mut best = at(first.lag, &first.fitted.optimum.point, true)?;
    if best.cost() >= least {
        return None;
    }
    for other in &kinds[1..] {
        let time_s = best.lag.time_s * scale(*other) / scale(kind);
        let other = at(of(time_s, *other), &best.fitted.optimum.point, true);
        if let Some(other) = other.filter(|other| other.cost() < best.cost()) {
            best = other;
        }
    }
    let mut std = best.lag.time_s;
    for factor in NEARER {
        let (lag, cost) = (best.lag, best.cost());
        let nearer = |factor: f64| {
            at(of(factor * lag.time_s, lag.is_window), &best.fitted.optimum.point, false)
        };
        let (less, more) = (nearer(factor.recip())?, nearer(factor)?);
        let x = factor.ln();
        let slope = 0.5 * (more.cost() - less.cost()) / x;
        let curvature = (more.cost() - 2.0 * cost + less.cost()) / (x * x);
        let mut all = vec![less, more];
        if curvature > 0.0 {
            std = lag.time_s / curvature.sqrt();
            all.extend(nearer((-slope / curvature).clamp(-x, x).exp()));
        }
        let found = all.into_iter().min_by(|a, b| a.cost().total_cmp(&b.cost()));
        if let Some(found) = found.filter(|found| found.cost() < cost) {
            best = found;
        }
    }
    Some((best, std))
}
