//! Other fits of the same vehicle: with the lags of propeller and vehicle exchanged, and of steady runs.

use nalgebra::Matrix4;

use super::{FittedAxis, LEAST_LAG_S, usual_speed};
use crate::estimate::Method;
use crate::estimate::axis_plant::lumped_plant;
use crate::estimate::plant_fit::actuator::Actuator;
use crate::estimate::plant_fit::descent::Tolerance;
use crate::estimate::plant_fit::problem::Problem;
use crate::estimate::plant_fit::schedule::Attitude;
use crate::estimate::plant_fit::start::begun;
use crate::plant::{Basis, Parameterisation, Product};
use crate::{AxisRecord, Error, LumpedParameters, TrialRecord};

/// The optimum beside an exchange of the lags of propeller and vehicle.
pub(in crate::estimate) struct Exchanged {
    pub(in crate::estimate) mass: f64,
    /// Lag of the propeller, s.
    pub(in crate::estimate) lag_s: f64,
    /// What its log-likelihood is less by, without what is known of lags before.
    pub(in crate::estimate) loss: f64,
}

impl FittedAxis {
    /// Fits with the lags of propeller and vehicle exchanged; `None` where a vehicle is slower than any
    /// propeller, or no optimum is reached.
    pub(in crate::estimate) fn with_lags_exchanged(
        &self,
        axes: &[AxisRecord],
    ) -> Option<Exchanged> {
        let (problem, optimum) = self.fitted.parts();
        let actuator = optimum.point.actuator;
        let axis = problem.structure.axes()[0];
        let coefficients = problem.physical.coefficients(&optimum.point.free);
        let at = |term: Basis| problem.structure.index_of(&term).map_or(0.0, |k| coefficients[k]);
        let mass = at(Basis::Mass(axis, axis));
        let linear = at(Basis::Product(axis, Product::linear(axis)));
        let quadratic = at(Basis::Product(axis, Product::quadratic(axis)));
        let vehicle_s = mass / (linear + 2.0 * quadratic * usual_speed(axes));
        let (_, slowest_s) = Actuator::LIMITS[Actuator::LAG];
        if !(vehicle_s > 0.0 && vehicle_s < slowest_s) || actuator.slew_s > 0.0 {
            return None;
        }
        let factor = vehicle_s / actuator.lag_s.max(LEAST_LAG_S);
        let mut free = problem.clone();
        free.fits[Actuator::LAG] = true;
        free.lag_std_s = f64::INFINITY;
        let mut point = optimum.point.clone();
        let mut exchanged = coefficients.clone();
        if let Some(k) = problem.structure.index_of(&Basis::Mass(axis, axis)) {
            exchanged[k] /= factor;
        }
        point.free = problem.physical.free(&exchanged);
        point.actuator.lag_s = vehicle_s;
        let other = free.descent_at_noise(point, Tolerance::COARSE).ok()?;
        let mut here = optimum.point.clone();
        here.actuator.lag_s = actuator.lag_s.max(LEAST_LAG_S);
        let here = free.descent_at_noise(here, Tolerance::COARSE).ok()?;
        let mass = free.physical.coefficients(&other.point.free);
        let mass = mass[free.structure.index_of(&Basis::Mass(axis, axis))?];
        let loss = other.cost - here.cost;
        Some(Exchanged { mass, lag_s: other.point.actuator.lag_s, loss })
    }

    /// Fits drag and bias force to steady runs, with the mass and the thrusters of this fit; returns the
    /// lumped plant with its covariance.
    ///
    /// # Errors
    /// As [`OneAxis::fit`].
    pub(in crate::estimate) fn steady_plant(
        &self,
        steady: &[AxisRecord],
    ) -> Result<(LumpedParameters, Matrix4<f64>), Error> {
        let (problem, optimum) = self.fitted.parts();
        let records: Vec<TrialRecord> =
            steady.iter().map(AxisRecord::as_trial).collect::<Result<_, Error>>()?;
        let references: Vec<&TrialRecord> = records.iter().collect();
        let coefficients = problem.physical.coefficients(&optimum.point.free);
        let terms = problem.structure.terms().iter().zip(coefficients.iter());
        let is_kept = |term: &Basis| matches!(term, Basis::Mass(..) | Basis::Effect(_));
        let structure = terms
            .filter(|(term, _)| is_kept(term))
            .try_fold(problem.structure.clone(), |structure, (term, x)| {
                structure.holding(*term, *x)
            })?;
        let held = Problem::new(&structure, &references, None, false, Attitude::Known);
        let mut held = held.with_known_actuator(optimum.point.actuator);
        held.has_current = problem.has_current;
        let (start, least_squares, fitted) = begun(held, &references)?;
        let found = fitted.refined()?.finished(start, &least_squares, Method::FilterError)?;
        Ok(lumped_plant(&found.plant, &found.covariance))
    }
}
