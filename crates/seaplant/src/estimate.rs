//! The estimators: trials in, a fitted plant out.

mod axis_plant;
mod candidate;
mod descend;
mod equation_error;
mod filter_error;
mod filtered;
mod first_look;
pub(crate) mod fit;
mod inputs;
pub(crate) mod method;
pub(crate) mod model;
mod nomoto;
pub mod online;
mod output_error;
mod paper;
mod plant_fit;
mod propellers;
mod records;
pub mod steady;
mod weighted_least_squares;

use std::collections::BTreeMap;

use nalgebra::Matrix4;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

pub use candidate::{Candidate, Decision};
pub use equation_error::{DelayedFit, EquationError, EquationErrorStatistics, Shard, ShardClock};
pub(crate) use filter_error::MOST_TRIALS;
pub use filter_error::{FilterError, SteadyTest};
use first_look::first_look;
pub(crate) use fit::{Estimate, Fit};
pub(crate) use method::Method;
pub(crate) use model::simulated_speed;
pub use nomoto::{NomotoFit, NomotoOrder, RudderLaw, SteeringTrial, fit_nomoto};
pub use output_error::{Loss, OutputError, OutputErrorBootstrap, OutputErrorIntervals};
pub use paper::Paper;
pub use plant_fit::{
    Actuator, AxisNoise, CurrentDrift, ExpectedActuator, ExpectedNoise, ExpectedNoises, GainBeside,
    Information, PlantFit, PlantPlan, ScaleClaim, SwellForce, Tried, UnseenExponent, fit_plant,
    fit_plant_freely, information, information_before,
};
pub(crate) use plant_fit::{
    INSTRUMENTS, LikelihoodStep, NEGLIGIBLE_POWER, Swing, damping_power, fit_alone, is_pushed,
    restless_thrust,
};
pub use records::Records;
pub use weighted_least_squares::WeightedLeastSquares;

use crate::signal::LowPass;
use crate::terms::Term;
use crate::trial::{ReadyAxis, ReadyStretch};
use crate::{AxisRecord, BetweenSamples, Caveat, CaveatCode, Error, LumpedParameters, Terms};

/// The least standard deviation of mass and drag that a fit states, as a part: propeller speeds are
/// rounded, and not logged between samples.
pub const PRECISION: f64 = 1e-3;

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
    /// Lag of a propeller whose speed falls, towards full reverse, over that of one whose speed rises.
    pub falling_lag_ratio: Option<Estimate>,
    /// Time that a propeller needs from rest to [`Nuisances::full_speed`] at its greatest rate,
    /// s.
    pub slew_s: Option<Estimate>,
    /// Thrust lost to inflow only by propellers that push the way the vehicle goes: `k |n| v`.
    pub inflow_ahead: Option<Estimate>,
    /// Exponent of thrust over propeller speed, 2 by its curve, and the same thrust at
    /// [`Nuisances::full_speed`].
    pub exponent: Option<Estimate>,
    /// Part of [`Nuisances::full_speed`] below which propellers do not turn.
    pub dead_band: Option<Estimate>,
    /// The greatest propeller speed of the fitted trials: rad/s, or √N where thrust is logged.
    pub full_speed: f64,
    /// Exponent of thrust over supply voltage, and the same thrust at [`Nuisances::mean_voltage_v`].
    pub voltage_exponent: Option<Estimate>,
    /// The mean supply voltage of the fitted trials, V.
    pub mean_voltage_v: f64,
    /// Relative growth of thrust from the beginning to the end of each trial, beside what its log says.
    pub change_within: Option<Estimate>,
    /// The same from the first trial to the last.
    pub change_between: Option<Estimate>,
    /// What thrust does between its logged samples.
    pub between: BetweenSamples,
    /// Measured over true velocity, as position tells.
    pub velocity_scale: Option<Estimate>,
    /// First-order lag of the velocity sensor, s.
    pub sensor_lag_s: Option<Estimate>,
    /// Time over which the velocity sensor averages, s.
    pub sensor_window_s: Option<Estimate>,
    /// Waves that push the vehicle.
    pub swell: Option<Waves>,
    /// Jitter of thrust: standard deviation of the time at which a change of thrust acts, s.
    pub thrust_jitter_s: Option<Estimate>,
    /// Standard deviation of what the current varies by in a trial, m/s.
    pub current_drift: Option<Estimate>,
    /// Current along the degree of freedom, m/s, by trial.
    pub current: BTreeMap<String, Estimate>,
    /// What turning does to body velocity, as a part of what it does to a rigid body: with
    /// added masses, `(m_y/m_x)` in surge and its inverse in sway.
    pub turning: Option<Estimate>,
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

/// Degrees of freedom ν above which [`t_quantile_975`] is a series in 1/ν: statrs is 7 % off at 1e7, and
/// does not return at 3e7.
const MANY: f64 = 1e4;

/// Computes the 97.5 % quantile of Student's t.
///
/// With z that of the normal distribution, of many degrees of freedom ν it is
/// `z + (z³ + z) / (4 ν) + (5 z⁵ + 16 z³ + 3 z) / (96 ν²)`, within 1e-11 from ν = 1e4 on.
///
/// # Source
/// \[AbramowitzStegun1964, 26.7.5\].
pub fn t_quantile_975(freedom: f64) -> f64 {
    if freedom > MANY {
        let z = Normal::standard().inverse_cdf(0.975);
        let (first, second) = (z.powi(3) + z, 5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z);
        return z + (first / 4.0 + second / (96.0 * freedom)) / freedom;
    }
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

/// A filter leaves its mark this many periods of its cut-off deep at the edges of a
/// stretch; a stretch shorter than that is all edge.
fn least_rows(filter: LowPass, sample_hz: f64) -> usize {
    (3 * (filter.order + 1) + 1).max((sample_hz / filter.cutoff_hz).ceil() as usize)
}

/// The rate of the coarsest record of several, Hz; they share one filter.
fn slowest_source_hz(axes: &[AxisRecord]) -> f64 {
    axes.iter().map(|axis| 1.0 / axis.motion.series().period_s()).fold(f64::INFINITY, f64::min)
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
