//! A fitted plant.

use nalgebra::Matrix4;

use super::{
    Decision, Filters, Innovations, Method, Nuisances, PhysicalEstimates, SteadyTest,
    t_quantile_975,
};
use crate::estimate::filter_error::Values;
use crate::estimate::online::OnlineHistory;
use crate::regression::LeastSquares;
use crate::terms::Term;
use crate::{
    Caveat, Dof, LumpedParameters, Model, PhysicalParameters, Terms, ThrustModel, VelocitySensor,
};

/// A fitted plant and how sure it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Which degree of freedom.
    pub dof: Dof,
    /// How it was found.
    pub method: Method,
    /// Which terms were fitted.
    pub terms: Terms,
    /// The parameters.
    pub lumped: LumpedParameters,
    /// Covariance of `[α, β, μ, bias]`; zero where not fitted.
    pub covariance: Matrix4<f64>,
    /// The part of it that uncertain thrust curves make.
    pub thrust_covariance: Matrix4<f64>,
    /// Degrees of freedom for the t quantiles of its intervals.
    pub t_freedom: f64,
    /// Condition number of the scaled columns.
    pub condition: f64,
    /// Variance inflation of each fitted term but the bias.
    pub inflation: Vec<(Term, f64)>,
    /// Rows of the regression.
    pub samples: usize,
    /// Rows that would say as much if they were independent.
    pub effective_samples: f64,
    /// Root mean square of what was minimised: of equation errors, m/s² or rad/s², or
    /// m/s or rad/s if a filter integrates them; of output errors, in the unit of what was
    /// measured.
    pub residual_rms: f64,
    /// The filters that were in fact used.
    pub filters: Filters,
    /// What was fitted beside the plant.
    pub nuisances: Nuisances,
    /// Why the model has the parts that it has.
    pub structure: Vec<Decision>,
    /// Whether steady runs agree with it, where there were any to fit.
    pub steady_test: Option<SteadyTest>,
    /// What the filter of the filter error method could not predict, by trial; empty of others.
    pub innovations: Vec<Innovations>,
    /// How the coefficients went there, of methods that work sample by sample.
    pub history: Option<OnlineHistory>,
    /// Doubts that the estimator itself has.
    pub caveats: Vec<Caveat>,
    /// Where the filter error method ended: fits of other terms begin there.
    pub(crate) optimum: Option<Values>,
}

/// A number with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
    /// Lower end of its 95 % interval.
    pub low95: f64,
    /// Upper end of its 95 % interval.
    pub high95: f64,
}

impl Estimate {
    /// A number with the symmetric 95 % interval of Student's t.
    pub fn new(value: f64, std: f64, t_freedom: f64) -> Self {
        let half = t_quantile_975(t_freedom) * std;
        Self { value, std, low95: value - half, high95: value + half }
    }

    /// The same with a number added.
    pub(crate) fn moved(self, by: f64) -> Self {
        let Self { value, std, low95, high95 } = self;
        Self { value: value + by, std, low95: low95 + by, high95: high95 + by }
    }

    /// Whether the interval holds a number.
    pub fn covers(&self, truth: f64) -> bool {
        (self.low95..=self.high95).contains(&truth)
    }
}

impl Fit {
    /// Mass, drag and bias force.
    pub fn physical(&self) -> PhysicalParameters {
        self.lumped.to_physical()
    }

    /// Mass, drag and bias force with their uncertainty, carried over to first order.
    pub fn estimates(&self) -> PhysicalEstimates {
        PhysicalEstimates::of(&self.lumped, &self.covariance, self.terms, self.t_freedom)
    }

    /// Adds what uncertain thrust curves do: each of `others` is the plant that the same
    /// logs give if one curve is off by a standard deviation.
    pub(crate) fn with_thrust_off(mut self, others: &[LumpedParameters]) -> Self {
        for other in others {
            let shift = other.to_vector() - self.lumped.to_vector();
            self.thrust_covariance += shift * shift.transpose();
        }
        self.covariance += self.thrust_covariance;
        self
    }

    /// The plant, ready to be driven.
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
                slew_s: value(&nuisances.slew_s).unwrap_or(0.0),
                inflow_ahead: value(&nuisances.inflow_ahead).unwrap_or(0.0),
                exponent: value(&nuisances.exponent).unwrap_or(2.0),
                full_speed: nuisances.full_speed,
                linear: nuisances.linear_thrust,
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

    /// Correlations of `[m, d_Q, d_L, b]`; zero where a term was not fitted.
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
            optimum: None,
        }
    }
}
