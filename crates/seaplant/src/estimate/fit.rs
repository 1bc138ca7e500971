//! A fitted plant.

use nalgebra::Matrix4;

use super::{
    Decision, Filters, Innovations, Method, Nuisances, PhysicalEstimates, SteadyTest,
    t_quantile_975,
};
use crate::estimate::online::OnlineHistory;
use crate::estimate::plant_fit::FilterStart;
use crate::regression::LeastSquares;
use crate::terms::Term;
use crate::{
    Caveat, Dof, LumpedParameters, Model, PhysicalParameters, Terms, ThrustModel, VelocitySensor,
};

/// A fitted plant with its uncertainty.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Degree of freedom.
    pub dof: Dof,
    /// Estimation method.
    pub method: Method,
    /// Fitted terms.
    pub terms: Terms,
    /// The parameters.
    pub lumped: LumpedParameters,
    /// Covariance of `[α, β, μ, bias]`; zero for terms that were not fitted.
    pub covariance: Matrix4<f64>,
    /// The part of it due to uncertain thrust curves.
    pub thrust_covariance: Matrix4<f64>,
    /// Degrees of freedom of the intervals' t quantiles.
    pub t_freedom: f64,
    /// Condition number of the scaled columns.
    pub condition: f64,
    /// Variance inflation factor of each fitted term except the bias.
    pub inflation: Vec<(Term, f64)>,
    /// Number of rows of the regression.
    pub samples: usize,
    /// Effective number of independent rows.
    pub effective_samples: f64,
    /// Root mean square of the minimised residual: of equation errors, m/s² or rad/s², or m/s or
    /// rad/s if a filter integrates them; of output errors, in the unit of the measurement.
    pub residual_rms: f64,
    /// Filters that were actually used.
    pub filters: Filters,
    /// Nuisances fitted in addition to the plant.
    pub nuisances: Nuisances,
    /// Decisions on the structure of the model.
    pub structure: Vec<Decision>,
    /// Test of agreement with steady runs, if there were any.
    pub steady_test: Option<SteadyTest>,
    /// Innovations of the filter error method, by trial; empty for other methods.
    pub innovations: Vec<Innovations>,
    /// History of the coefficients, for methods that work sample by sample.
    pub history: Option<OnlineHistory>,
    /// Caveats of the estimator.
    pub caveats: Vec<Caveat>,
    /// Optimum of the filter error method, from which fits of other terms start.
    pub(crate) start: Option<FilterStart>,
}

/// A number with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Value.
    pub value: f64,
    /// Standard deviation.
    pub std: f64,
    /// Lower end of its 95 % interval.
    pub low95: f64,
    /// Upper end of its 95 % interval.
    pub high95: f64,
}

impl Estimate {
    /// Creates an estimate with the symmetric 95 % interval of Student's t.
    pub fn new(value: f64, std: f64, t_freedom: f64) -> Self {
        let half = t_quantile_975(t_freedom) * std;
        Self { value, std, low95: value - half, high95: value + half }
    }

    /// Returns the estimate with a number added.
    pub(crate) fn moved(self, by: f64) -> Self {
        let Self { value, std, low95, high95 } = self;
        Self { value: value + by, std, low95: low95 + by, high95: high95 + by }
    }

    /// Returns the estimate multiplied by a number.
    pub(crate) fn times(self, by: f64) -> Self {
        let Self { value, std, low95, high95 } = self;
        let (a, b) = (by * low95, by * high95);
        Self { value: by * value, std: by.abs() * std, low95: a.min(b), high95: a.max(b) }
    }

    /// Returns true if the interval includes a number.
    pub fn covers(&self, truth: f64) -> bool {
        (self.low95..=self.high95).contains(&truth)
    }
}

impl Fit {
    /// Returns mass, drag and bias force.
    pub fn physical(&self) -> PhysicalParameters {
        self.lumped.to_physical()
    }

    /// Returns mass, drag and bias force with first-order uncertainty.
    pub fn estimates(&self) -> PhysicalEstimates {
        PhysicalEstimates::of(&self.lumped, &self.covariance, self.terms, self.t_freedom)
    }

    /// Adds the uncertainty of thrust curves: each of `others` is the plant estimated with one
    /// curve changed by a standard deviation.
    pub(crate) fn with_thrust_off(mut self, others: &[LumpedParameters]) -> Self {
        for other in others {
            let shift = other.to_vector() - self.lumped.to_vector();
            self.thrust_covariance += shift * shift.transpose();
        }
        self.covariance += self.thrust_covariance;
        self
    }

    /// Returns the same as if the scale of thrust were known for sure.
    pub(crate) fn of_sure_thrust(&self) -> Self {
        let covariance = self.covariance - self.thrust_covariance;
        Self { covariance, thrust_covariance: Matrix4::zeros(), ..self.clone() }
    }

    /// Returns the plant in a form for simulation.
    pub fn model(&self) -> Model {
        let value = |estimate: &Option<Estimate>| estimate.map(|estimate| estimate.value);
        let nuisances = &self.nuisances;
        let current = nuisances.current.iter();
        Model {
            lumped: self.lumped,
            thrust: ThrustModel {
                lag_s: value(&nuisances.lag_s).unwrap_or(0.0),
                delay_s: value(&nuisances.delay_s).unwrap_or(0.0),
                reverse_ratio: value(&nuisances.reverse_ratio).unwrap_or(1.0),
                inflow: value(&nuisances.inflow).unwrap_or(0.0),
                lag_ratio: value(&nuisances.lag_ratio).unwrap_or(1.0),
                falling_lag_ratio: value(&nuisances.falling_lag_ratio).unwrap_or(1.0),
                slew_s: value(&nuisances.slew_s).unwrap_or(0.0),
                inflow_ahead: value(&nuisances.inflow_ahead).unwrap_or(0.0),
                exponent: value(&nuisances.exponent).unwrap_or(2.0),
                full_speed: nuisances.full_speed,
                dead_band: value(&nuisances.dead_band).unwrap_or(0.0),
                voltage_exponent: value(&nuisances.voltage_exponent).unwrap_or(0.0),
                mean_voltage_v: nuisances.mean_voltage_v,
                change_within: value(&nuisances.change_within).unwrap_or(0.0),
                between: nuisances.between,
                turning: value(&nuisances.turning).unwrap_or(0.0),
                current: current.map(|(trial, u)| (trial.clone(), u.value)).collect(),
            },
            sensor: VelocitySensor {
                lag_s: value(&nuisances.sensor_lag_s).unwrap_or(0.0),
                window_s: value(&nuisances.sensor_window_s).unwrap_or(0.0),
                scale: value(&nuisances.velocity_scale).unwrap_or(1.0),
            },
        }
    }

    /// Returns the correlations of `[m, d_Q, d_L, b]`; zero where a term was not fitted.
    pub fn correlation(&self) -> Matrix4<f64> {
        let covariance = self.lumped.physical_covariance(&self.covariance);
        covariance.map_with_location(|i, j, c| {
            let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
            if scale > 0.0 { c / scale } else { 0.0 }
        })
    }

    pub(super) fn of_regression(
        dof: Dof,
        method: Method,
        terms: Terms,
        found: LeastSquares,
        filters: Filters,
        caveats: Vec<Caveat>,
    ) -> Self {
        Self {
            dof,
            method,
            terms,
            lumped: found.lumped,
            covariance: found.covariance,
            thrust_covariance: Matrix4::zeros(),
            t_freedom: found.t_freedom,
            condition: found.condition,
            inflation: found.inflation,
            samples: found.samples,
            effective_samples: found.effective_samples,
            residual_rms: found.residual_rms,
            filters,
            nuisances: Nuisances::default(),
            structure: Vec::new(),
            steady_test: None,
            innovations: Vec::new(),
            history: None,
            caveats,
            start: None,
        }
    }
}
