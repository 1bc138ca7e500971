//! The twin's true values, for the assessment of estimates.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Disturbance, NoiseLevel, TwinSpec};
use crate::Dof;

/// The twin's true values, in the units of the results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Truth {
    /// The seed of every random number.
    pub seed: u64,
    /// Noise level of the instruments.
    pub noise: NoiseLevel,
    /// Disturbances of the vehicle, and errors of its analyst.
    pub disturbances: BTreeSet<Disturbance>,
    /// The plant of each degree of freedom.
    pub plants: BTreeMap<Dof, TrueParameters>,
    /// Drag in steady runs, by degree of freedom.
    pub steady: BTreeMap<Dof, TrueSteady>,
    /// True values of nuisance parameters.
    pub nuisances: TrueNuisances,
    /// Mean current in each trial, m/s: along the degree of freedom, in yaw to the north.
    pub mean_current_m_s: BTreeMap<String, f64>,
    /// The vehicle of several axes, if several move at once.
    #[serde(default)]
    pub vehicle: Option<TrueVehicle>,
}

/// True values of a vehicle of several axes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueVehicle {
    /// Name of its plant.
    pub name: String,
    /// Its coefficients, by their names in results.
    pub coefficients: BTreeMap<String, f64>,
    /// Standard deviation of the tether's force on each driven axis, N or N m.
    pub tether: BTreeMap<Dof, f64>,
    /// Mean current in each trial, north and east, m/s.
    pub mean_current_m_s: BTreeMap<String, [f64; 2]>,
}

/// The true plant of one degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueParameters {
    /// Rigid-body plus added mass, kg or kg m².
    pub mass: f64,
    /// d_Q, N/(m/s)² or N m/(rad/s)².
    pub quadratic_drag: f64,
    /// d_L, N/(m/s) or N m/(rad/s).
    pub linear_drag: f64,
    /// b, N or N m.
    pub bias_force: f64,
}

/// True values of steady runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueSteady {
    /// d_Q, N/(m/s)².
    pub quadratic_drag: f64,
    /// b, N.
    pub bias_force: f64,
}

/// True values of the nuisance parameters of an estimator. If disabled, a ratio is 1, the exponent
/// 2, and others 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct TrueNuisances {
    /// Time constant of the propellers, s, if it is equal for speeding up and slowing down.
    pub lag_s: f64,
    /// Delay of the propellers, s.
    pub delay_s: f64,
    /// Ratio of reverse thrust to that of the analyst's curve.
    pub reverse_ratio: f64,
    /// Mean current, m/s, about which that of each trial varies.
    pub current_m_s: f64,
    /// k_in of `F = k n|n| − k_in |n| v`, N s²/(rad m).
    pub inflow: f64,
    /// Standard deviation of the tether's force, N.
    pub tether_n: f64,
    /// Correlation time of the tether's force, s.
    pub tether_correlation_s: f64,
    /// Distance by which the DVL is ahead of, and below, its position in the analyst's vehicle, m.
    pub lever_m: f64,
    /// Amplitude of the swell, N.
    pub swell_n: f64,
    /// Time constant of propellers that speed up, s.
    pub lag_up_s: f64,
    /// Time constant of propellers that slow down, s.
    pub lag_down_s: f64,
    /// Time of a propeller from rest to its greatest speed, s.
    pub slew_s: f64,
    /// k_in of a propeller that pushes in the direction of motion, if only such lose thrust, N
    /// s²/(rad m).
    pub inflow_one_sided: f64,
    /// p of F ∝ |n|^p.
    pub thrust_exponent: f64,
    /// Part of the greatest command below which propellers do not turn.
    pub dead_band: f64,
    /// Fraction of thrust lost by the end of a degree of freedom's last trial.
    pub sag_part: f64,
    /// Standard deviation of the narrow-band swell, N.
    pub swell_std_n: f64,
    /// Standard deviation of the drifting current, m/s.
    pub drift_std_m_s: f64,
    /// Averaging window of the DVL, s.
    pub averaging_s: f64,
    /// Time constant of the DVL, s.
    pub velocity_lag_s: f64,
    /// Scale factor of the DVL.
    pub dvl_scale: f64,
}

impl Truth {
    pub(super) fn new(spec: &TwinSpec, mean_current_m_s: BTreeMap<String, f64>) -> Self {
        let of_dof = |dof: &Dof| {
            let plant = spec.plants[dof];
            let parameters = TrueParameters {
                mass: plant.mass,
                quadratic_drag: plant.d_quadratic,
                linear_drag: plant.d_linear,
                bias_force: plant.bias_force,
            };
            (*dof, parameters)
        };
        let steady = TrueSteady {
            quadratic_drag: spec.steady.d_quadratic,
            bias_force: spec.steady.bias_force,
        };
        let heave = spec.dofs.get(&Dof::Heave).copied();
        Self {
            seed: spec.seed,
            noise: spec.noise,
            disturbances: spec.disturbances.clone(),
            plants: spec.dofs.iter().map(of_dof).collect(),
            steady: heave.into_iter().map(|dof| (dof, steady)).collect(),
            nuisances: TrueNuisances::new(spec),
            mean_current_m_s,
            vehicle: None,
        }
    }
}

impl TrueNuisances {
    fn new(spec: &TwinSpec) -> Self {
        use Disturbance as D;
        let strength = &spec.strength;
        let misled = spec.has(D::Thrcoef);
        let (lag_up_s, lag_down_s) = spec.lags();
        Self {
            lag_s: if lag_up_s == lag_down_s { lag_up_s } else { 0.0 },
            delay_s: spec.strength_of(D::Delay, strength.delay_s),
            reverse_ratio: if misled {
                spec.thrusters.reverse / spec.thrusters.forward
            } else {
                1.0
            },
            current_m_s: spec.strength_of(D::Current, strength.current_m_s),
            inflow: spec.inflow(),
            tether_n: spec.strength_of(D::Tether, strength.tether_n),
            tether_correlation_s: spec.strength_of(D::Tether, strength.tether_correlation_s),
            lever_m: spec.strength_of(D::Lever, strength.lever_m),
            swell_n: spec.strength_of(D::Swell, strength.swell_n),
            lag_up_s,
            lag_down_s,
            slew_s: spec.strength_of(D::Slew, strength.slew_s),
            inflow_one_sided: spec.inflow_one_sided(),
            thrust_exponent: spec.exponent(),
            dead_band: spec.strength_of(D::DeadBand, strength.dead_band),
            sag_part: spec.strength_of(D::BatterySag, strength.sag_part),
            swell_std_n: spec.strength_of(D::SwellNarrowBand, strength.swell_std_n),
            drift_std_m_s: spec.strength_of(D::CurrentDrift, strength.drift_std_m_s),
            averaging_s: spec.strength_of(D::VelocityAveraging, strength.averaging_s),
            velocity_lag_s: spec.strength_of(D::VelocityLag, strength.velocity_lag_s),
            dvl_scale: 1.0 + spec.strength_of(D::DvlScale, strength.dvl_scale_error),
        }
    }
}

impl Default for TrueNuisances {
    /// Returns the values of a twin without disturbances.
    fn default() -> Self {
        Self::new(&TwinSpec::jason2())
    }
}
