//! The estimators: trials in, a fitted plant out.

mod coupled;
mod descend;
mod equation_error;
mod filter_error;
mod filtered;
mod nomoto;
pub mod online;
mod output_error;
mod paper;
mod sriv;
pub mod steady;
mod total_least_squares;
mod weighted_least_squares;

use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

use nalgebra::Matrix4;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

pub use coupled::{
    Actuator, AxisNoise, CoupledFit, CurrentDrift, Tried, fit_coupled, fit_coupled_freely,
};
pub(crate) use coupled::{NEGLIGIBLE_POWER, damping_power};
pub use equation_error::{
    DelayedFit, EquationErrorOptions, EquationErrorStatistics, Shard, ShardClock, fit_best_delay,
    fit_equation_error,
};
pub use filter_error::{
    Candidate, Decision, FilterErrorOptions, Records, SteadyTest, first_delays, fit_filter_error,
};
pub(crate) use filter_error::{MOST_SEARCHED, MOST_TRIALS, drive_over, first_look};
pub use nomoto::{NomotoFit, NomotoOrder, RudderLaw, SteeringTrial, fit_nomoto};
pub use output_error::{
    Loss, OutputErrorBootstrap, OutputErrorIntervals, OutputErrorOptions, fit_output_error,
};
pub use paper::{PaperOptions, fit_paper};
pub use sriv::fit_sriv;
pub use total_least_squares::fit_total_least_squares;
pub use weighted_least_squares::fit_weighted_least_squares;

pub use crate::regression::{BlockBootstrap, Intervals};

use crate::regression::LeastSquares;
use crate::results::OnlineHistory;
use crate::signal::LowPass;
use crate::terms::Term;
use crate::trial::{ReadyAxis, ReadyStretch};
use crate::{
    AxisRecord, Caveat, CaveatCode, Dof, Error, LumpedParameters, Model, PhysicalParameters, Terms,
    ThrustModel, VelocitySensor,
};

/// No log tells mass and drag more precisely than to this part: propeller speeds are rounded, and
/// nobody saw what they did between samples.
const PRECISION: f64 = 1e-3;

/// How a plant was found.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// As Smallwood and Whitcomb did: velocity filtered, thrust not.
    Paper,
    /// Least squares on the equation of motion, every term filtered alike.
    EquationError,
    /// Least squares between simulated and measured motion.
    OutputError,
    /// Maximum likelihood on the innovations of a Kalman filter, with what stands between
    /// thrust and water.
    FilterError,
    /// Equation error with each equation weighted by how sure it is.
    WeightedLeastSquares,
    /// Equation error with noise in the regressors, too.
    TotalLeastSquares,
    /// Instrumental variables from the simulated plant.
    Sriv,
    /// An observer whose coefficients adapt, sample by sample.
    Adaptive,
    /// Least squares, sample by sample.
    Recursive,
    /// A Kalman filter with the coefficients in its state, sample by sample.
    Ekf,
}

impl Method {
    /// All methods, the recommended one first.
    pub const ALL: [Self; 10] = [
        Self::FilterError,
        Self::OutputError,
        Self::EquationError,
        Self::Paper,
        Self::WeightedLeastSquares,
        Self::TotalLeastSquares,
        Self::Sriv,
        Self::Adaptive,
        Self::Recursive,
        Self::Ekf,
    ];

    /// The methods that are used where nothing else is said, the recommended one first; the
    /// others are there to compare with.
    pub const DEFAULT: [Self; 4] =
        [Self::FilterError, Self::OutputError, Self::EquationError, Self::Paper];

    /// The method to believe where nothing else is said.
    pub const RECOMMENDED: Self = Self::FilterError;

    /// As files and flags write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::EquationError => "equation-error",
            Self::OutputError => "output-error",
            Self::FilterError => "filter-error",
            Self::WeightedLeastSquares => "weighted-least-squares",
            Self::TotalLeastSquares => "total-least-squares",
            Self::Sriv => "sriv",
            Self::Adaptive => "adaptive",
            Self::Recursive => "recursive",
            Self::Ekf => "ekf",
        }
    }

    /// How it works sample by sample, if it does.
    pub const fn scheme(self) -> Option<online::Scheme> {
        match self {
            Self::Adaptive => Some(online::Scheme::Adaptive),
            Self::Recursive => Some(online::Scheme::Recursive),
            Self::Ekf => Some(online::Scheme::Ekf),
            _ => None,
        }
    }

    /// Whether it takes force as it was logged, so that a lag goes unseen by
    /// the method itself. The paper's has faults that are told before that one.
    pub(crate) const fn takes_force_as_logged(self) -> bool {
        matches!(
            self,
            Self::EquationError
                | Self::WeightedLeastSquares
                | Self::TotalLeastSquares
                | Self::Sriv
                | Self::OutputError
                | Self::Adaptive
                | Self::Recursive
                | Self::Ekf
        )
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Method {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|method| method.name() == text).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            Error::UnknownMethod { found: text.to_owned(), known }
        })
    }
}

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
}

/// How the errors of one-step predictions follow each other: white noise, if the model of the plant,
/// the disturbance and the noise is right.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Innovations {
    /// Which trial.
    pub trial: String,
    /// How many errors.
    pub samples: usize,
    /// Their autocorrelation at lags of 0, 1, 2 … samples; of white noise it stays within
    /// ±1.96/√samples in 95 of 100 lags.
    pub autocorrelation: Vec<f64>,
}

/// The filters of a regression.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Filters {
    /// On velocity, before v|v| is formed and v differentiated.
    pub velocity: Option<LowPass>,
    /// On every term alike, after that.
    pub every_term: Option<LowPass>,
}

/// What is fitted beside the plant; `None` for what is not part of the model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Nuisances {
    /// First-order lag of propeller speed, s.
    pub lag_s: Option<Estimate>,
    /// Delay of thrust, s.
    pub delay_s: Option<Estimate>,
    /// Reverse thrust over what its curve says.
    pub reverse_ratio: Option<Estimate>,
    /// Thrust lost to inflow: `k_in |n| v` for each thruster.
    pub inflow: Option<Estimate>,
    /// Lag of a propeller that slows down over that of one that speeds up.
    pub lag_ratio: Option<Estimate>,
    /// Time that a propeller needs from rest to [`Nuisances::full_speed`] at its greatest rate,
    /// s.
    pub slew_s: Option<Estimate>,
    /// Thrust lost to inflow only by propellers that push the way the vehicle goes: `k |n| v`.
    pub inflow_ahead: Option<Estimate>,
    /// Exponent of thrust over propeller speed, 2 by its curve, and the same thrust at
    /// [`Nuisances::full_speed`].
    pub exponent: Option<Estimate>,
    /// The greatest propeller speed of the fitted trials: rad/s, or √N where thrust is logged.
    pub full_speed: f64,
    /// Whether propeller speeds move linearly from one logged sample to the next.
    pub linear_thrust: bool,
    /// Measured over true velocity, as position tells.
    pub velocity_scale: Option<Estimate>,
    /// First-order lag of the velocity sensor, s.
    pub sensor_lag_s: Option<Estimate>,
    /// Time over which the velocity sensor averages, s.
    pub sensor_window_s: Option<Estimate>,
    /// Waves that push the vehicle.
    pub swell: Option<Waves>,
    /// Standard deviation of what the current varies by in a trial, m/s.
    pub current_drift: Option<Estimate>,
    /// Current along the degree of freedom, m/s, by trial.
    pub current: BTreeMap<String, Estimate>,
    /// What turning does to body velocity, as a part of what it does to a rigid body: with
    /// added masses, `(m_y/m_x)` in surge and its inverse in sway.
    pub turning: Option<Estimate>,
    /// What the velocity sensor reads at rest, m/s or rad/s, by trial; where position tells.
    pub velocity_offset: BTreeMap<String, Estimate>,
    /// Lever arm of the velocity sensor that navigation did not know, m, along the two
    /// [`lever_axes`](crate::lever_axes).
    pub lever_m: [Option<Estimate>; 2],
    /// Standard deviation of the slow disturbance, m/s² or rad/s².
    pub disturbance: Option<Estimate>,
    /// Its correlation time, s.
    pub correlation_s: Option<Estimate>,
    /// Standard deviation of a velocity sample, m/s or rad/s.
    pub velocity_noise: Option<Estimate>,
    /// Standard deviation of a position sample, m or rad.
    pub position_noise: Option<Estimate>,
    /// Standard deviation of a mean acceleration, m/s².
    pub acceleration_noise: Option<Estimate>,
    /// What the accelerometer reads at rest, m/s², by trial.
    pub acceleration_offset: BTreeMap<String, Estimate>,
    /// Standard deviation of the gravity that attitude errors leak into acceleration, m/s².
    pub leak: Option<Estimate>,
    /// Its correlation time, s.
    pub leak_correlation_s: Option<Estimate>,
}

/// Waves: a force in a narrow band of frequencies.
///
/// # Source
/// [Fossen2021, ch. 10]: linear wave response model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Waves {
    /// Standard deviation of the acceleration, m/s² or rad/s².
    pub strength: Estimate,
    /// Period of the greatest waves, s.
    pub period_s: Estimate,
    /// Relative damping: the smaller, the narrower the band.
    pub damping: Estimate,
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

/// The 97.5 % quantile of Student's t.
pub fn t_quantile_975(freedom: f64) -> f64 {
    // Location 0, scale 1 and at least one degree of freedom make a distribution.
    StudentsT::new(0.0, 1.0, freedom.max(1.0)).map_or(f64::INFINITY, |t| t.inverse_cdf(0.975))
}

/// Physical parameters with their uncertainty; `None` for a term that was not fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhysicalEstimates {
    /// Rigid-body plus added mass, kg or kg m².
    pub mass: Estimate,
    /// Quadratic drag.
    pub d_quadratic: Option<Estimate>,
    /// Linear drag.
    pub d_linear: Option<Estimate>,
    /// Bias force, N or N m.
    pub bias_force: Option<Estimate>,
}

impl PhysicalEstimates {
    /// Those of a lumped plant, carried over to first order; `covariance` is that of
    /// `[α, β, μ, bias]`.
    pub(crate) fn of(
        lumped: &LumpedParameters,
        covariance: &Matrix4<f64>,
        terms: Terms,
        t_freedom: f64,
    ) -> Self {
        let covariance = lumped.physical_covariance(covariance);
        let physical = lumped.to_physical();
        let of = |term: Term, value: f64| {
            let std = covariance[(term as usize, term as usize)].sqrt();
            terms.has(term).then(|| Estimate::new(value, std, t_freedom))
        };
        Self {
            mass: Estimate::new(physical.mass, covariance[(0, 0)].sqrt(), t_freedom),
            d_quadratic: of(Term::Quadratic, physical.d_quadratic),
            d_linear: of(Term::Linear, physical.d_linear),
            bias_force: of(Term::Bias, physical.bias_force),
        }
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

    fn of_regression(
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
        }
    }
}

/// A filter leaves its mark this many periods of its cut-off deep at the edges of a
/// stretch; a stretch shorter than that is all edge.
fn least_rows(filter: LowPass, sample_hz: f64) -> usize {
    (3 * (filter.order + 1) + 1).max((sample_hz / filter.cutoff_hz).ceil() as usize)
}

/// The rate of the coarsest record of several, Hz; they share one filter.
fn slowest_source_hz(axes: &[AxisRecord]) -> f64 {
    axes.iter().map(|axis| 1.0 / axis.motion.series().period_s()).fold(f64::INFINITY, f64::min)
}

fn check_trials(dof: Dof, axes: &[AxisRecord]) -> Result<(), Error> {
    if axes.is_empty() { Err(Error::NoTrial { dof }) } else { Ok(()) }
}

/// A uniform stretch and where it is from.
struct Stretch<'a> {
    axis: &'a AxisRecord,
    ready: ReadyStretch,
    sample_hz: f64,
}

impl Stretch<'_> {
    fn duration_s(&self) -> f64 {
        self.ready.grid.len as f64 * self.ready.grid.period_s
    }
}

/// Every stretch of every trial that is long enough, with its trial's record and rate.
///
/// A trial that is too short for the filters is left out with a caveat, unless all are.
fn all_stretches<'a>(
    axes: &'a [AxisRecord],
    least: impl Fn(f64) -> usize,
    caveats: &mut Vec<Caveat>,
) -> Result<Vec<Stretch<'a>>, Error> {
    let mut all = Vec::new();
    let mut refused = None;
    for axis in axes {
        // The rate is found with the grid, which needs the least length at that rate.
        let ReadyAxis { sample_hz, stretches, .. } = axis.ready(0)?;
        let (least, before) = (least(sample_hz), all.len());
        let long = stretches.into_iter().filter(|ready| ready.grid.len >= least);
        all.extend(long.map(|ready| Stretch { axis, ready, sample_hz }));
        if all.len() > before {
            continue;
        }
        match axis.ready(least) {
            Err(short @ Error::TooShort { .. }) => {
                let message = format!("a trial is left out of this fit: {short}");
                caveats.push(Caveat::warning(CaveatCode::TrialLeftOut, message));
                refused = Some(short);
            }
            other => {
                other?;
            }
        }
    }
    match refused {
        Some(short) if all.is_empty() => Err(short),
        _ => Ok(all),
    }
}
