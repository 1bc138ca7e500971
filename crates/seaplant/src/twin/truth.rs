//! What is true of the twin, for whoever judges an estimate.

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
    /// How noisy the instruments were.
    pub noise: NoiseLevel,
    /// What disturbed the vehicle or misled its analyst.
    pub disturbances: BTreeSet<Disturbance>,
    /// The plant of each degree of freedom.
    pub plants: BTreeMap<Dof, TrueParameters>,
    /// The drag in steady runs, by degree of freedom.
    pub steady: BTreeMap<Dof, TrueSteady>,
    /// What the disturbances did to an analysis that knows them.
    pub nuisances: TrueNuisances,
    /// The mean current in each trial, m/s: along the degree of freedom, in yaw to the north.
    pub mean_current_m_s: BTreeMap<String, f64>,
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

/// The truth of steady runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueSteady {
    /// d_Q, N/(m/s)².
    pub quadratic_drag: f64,
    /// b, N.
    pub bias_force: f64,
}

/// True values of what an estimator may fit beside the plant; 0 or 1 where it is off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrueNuisances {
    /// Time constant of the propellers, s.
    pub lag_s: f64,
    /// Delay of the propellers, s.
    pub delay_s: f64,
    /// Thrust in reverse over what the analyst's curve gives.
    pub reverse_ratio: f64,
    /// Mean current, m/s, of which each trial's own deviates.
    pub current_m_s: f64,
    /// k_in of `F = k n|n| − k_in |n| v`, N s²/(rad m).
    pub inflow: f64,
    /// Standard deviation of the tether's pull, N.
    pub tether_n: f64,
    /// Correlation time of the tether's pull, s.
    pub tether_correlation_s: f64,
    /// By how much the DVL sits ahead of, and below, where the analyst has it, m.
    pub lever_m: f64,
    /// Amplitude of the swell, N.
    pub swell_n: f64,
}

impl Truth {
    pub(super) fn of(spec: &TwinSpec, mean_current_m_s: BTreeMap<String, f64>) -> Self {
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
            nuisances: TrueNuisances::of(spec),
            mean_current_m_s,
        }
    }
}

impl TrueNuisances {
    fn of(spec: &TwinSpec) -> Self {
        use Disturbance as D;
        let strength = &spec.strength;
        let misled = spec.has(D::Thrcoef);
        Self {
            lag_s: spec.strength_of(D::Lag, strength.lag_s),
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
        }
    }
}
