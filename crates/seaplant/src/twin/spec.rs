//! The specification of the twin.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::{Disturbance, DisturbanceStrength};
use crate::{Dof, PhysicalParameters, QuadraticThrust};

/// The specification of the twin; every field defaults to the Jason 2 twin.
///
/// In a file, `[plants.surge]` or `[excitation.yaw]` replaces that entry and keeps those of the
/// other degrees of freedom.
///
/// # Source
/// [Jason2, tables 3–6].
///
/// ```
/// use seaplant::twin::{Disturbance, TwinSpec};
/// let spec = TwinSpec { disturbances: Disturbance::parse_list("tether,lag")?, ..TwinSpec::jason2() };
/// spec.validate()?;
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwinSpec {
    /// Name of the vehicle.
    pub name: String,
    /// Seed of all random numbers: equal seeds give equal logs.
    pub seed: u64,
    /// Noise level of the instruments.
    pub noise: NoiseLevel,
    /// Disturbances of the vehicle, and errors of its analyst.
    pub disturbances: BTreeSet<Disturbance>,
    /// The degrees of freedom with trials: any of surge, sway, heave and yaw.
    pub dofs: BTreeSet<Dof>,
    /// Duration of each fitted trial, s.
    pub duration_s: f64,
    /// Duration of each held-out trial, s.
    pub hold_out_s: f64,
    /// Mass in air, kg.
    pub dry_mass_kg: f64,
    /// Length, width and height of the hull, m, if they are known to the analyst.
    #[serde(deserialize_with = "crate::exact::some_numbers")]
    pub size_m: Option<[f64; 3]>,
    /// Depth of the vehicle's origin at the start of each trial, m.
    pub start_depth_m: f64,
    /// The true plant of each degree of freedom.
    #[serde(deserialize_with = "over_jason2_plants")]
    pub plants: BTreeMap<Dof, TwinPlant>,
    /// Excitation by the pilot in each degree of freedom.
    #[serde(deserialize_with = "over_jason2_excitation")]
    pub excitation: BTreeMap<Dof, Excitation>,
    /// Runs at constant vertical thrust.
    pub steady: SteadyRuns,
    /// The thrusters, which are identical.
    pub thrusters: TwinThrusters,
    /// An accelerometer instead of the DVL.
    pub accelerometer: Option<TwinAccelerometer>,
    /// Strength of each disturbance, if it is enabled.
    pub strength: DisturbanceStrength,
}

/// The true plant of one degree of freedom, `τ = m v̇ + d_Q v|v| + d_L v + b`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TwinPlant {
    /// Rigid-body plus added mass, kg or kg m².
    pub mass: f64,
    /// Quadratic drag, N/(m/s)² or N m/(rad/s)².
    pub d_quadratic: f64,
    /// Linear drag, N/(m/s) or N m/(rad/s).
    #[serde(default)]
    pub d_linear: f64,
    /// Bias force, N or N m.
    #[serde(default)]
    pub bias_force: f64,
}

/// A sinusoid and the pilot's joystick: of force, or in heave of depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Excitation {
    /// Amplitude of the sinusoid: N, N m, or in heave m of depth.
    pub amplitude: f64,
    /// Frequency of the sinusoid, rad/s.
    pub frequency_rad_s: f64,
    /// Largest command of the joystick: N, N m, or in heave m/s.
    pub joystick: f64,
}

/// Runs at constant vertical thrust, from rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SteadyRuns {
    /// Downward thrusts, as fractions of the greatest thrust in reverse.
    pub down: Vec<f64>,
    /// Upward thrusts, as fractions of the same.
    pub up: Vec<f64>,
    /// Duration of each run, s.
    pub duration_s: f64,
    /// Quadratic drag in these runs, N/(m/s)².
    pub d_quadratic: f64,
    /// Bias force in these runs, N.
    pub bias_force: f64,
}

/// A thruster: `F = k ω|ω|` with a coefficient for each direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwinThrusters {
    /// k forward, N/(rad/s)².
    pub forward: f64,
    /// k in reverse, N/(rad/s)².
    pub reverse: f64,
    /// Largest propeller speed, rpm.
    pub max_rpm: f64,
}

/// An accelerometer, logged 50 times a second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwinAccelerometer {
    /// Its position, m, body frame.
    pub position_m: [f64; 3],
    /// Standard deviation of vibration in each sample, m/s².
    pub noise: f64,
    /// Offset of each axis, m/s².
    pub offset: f64,
    /// Standard deviation of the component of gravity on each axis due to slow attitude errors,
    /// m/s².
    pub leak: f64,
    /// Correlation time of these, s.
    pub leak_s: f64,
}

impl Default for TwinAccelerometer {
    fn default() -> Self {
        Self { position_m: [0.1, 0.0, -0.05], noise: 0.15, offset: 0.05, leak: 0.06, leak_s: 60.0 }
    }
}

/// Noise level of the instruments.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseLevel {
    /// DVL 0.3 mm/s, heading 0.03°, depth without noise but quantised.
    Low,
    /// DVL 3 mm/s, heading 0.1°, depth 2 cm.
    #[default]
    Middle,
    /// DVL 10 mm/s, heading 0.3°, depth 7 cm.
    High,
}

impl Default for TwinSpec {
    fn default() -> Self {
        Self {
            name: "Jason 2 twin".to_owned(),
            seed: 1,
            noise: NoiseLevel::Middle,
            disturbances: BTreeSet::new(),
            dofs: jason2_plants().into_keys().collect(),
            duration_s: 480.0,
            hold_out_s: 300.0,
            dry_mass_kg: 3400.0,
            size_m: Some([3.4, 2.2, 2.4]),
            start_depth_m: 150.0,
            plants: jason2_plants(),
            excitation: jason2_excitation(),
            accelerometer: None,
            steady: SteadyRuns::default(),
            thrusters: TwinThrusters::default(),
            strength: DisturbanceStrength::default(),
        }
    }
}

/// Returns the plants of [Jason2, table 5].
fn jason2_plants() -> BTreeMap<Dof, TwinPlant> {
    let plant =
        |mass, d_quadratic, bias_force| TwinPlant { mass, d_quadratic, d_linear: 0.0, bias_force };
    BTreeMap::from([
        (Dof::Surge, plant(12970.2, 2230.9, -255.5)),
        (Dof::Sway, plant(18903.6, 9187.1, 76.7)),
        (Dof::Heave, plant(20283.9, 16369.2, 9.29)),
        (Dof::Yaw, plant(11049.7, 16353.6, 117.1)),
    ])
}

/// Returns the excitation of [Jason2, table 4]; the joystick is not from the paper.
#[expect(clippy::approx_constant, reason = "the table rounds 2π/6 so")]
fn jason2_excitation() -> BTreeMap<Dof, Excitation> {
    let sine =
        |amplitude, frequency_rad_s, joystick| Excitation { amplitude, frequency_rad_s, joystick };
    BTreeMap::from([
        (Dof::Surge, sine(1800.0, 0.785, 500.0)),
        (Dof::Sway, sine(1500.0, 0.3925, 500.0)),
        (Dof::Heave, sine(0.5, 0.3925, 0.05)),
        (Dof::Yaw, sine(2000.0, 1.0472, 600.0)),
    ])
}

fn over_jason2_plants<'de, D: Deserializer<'de>>(
    source: D,
) -> Result<BTreeMap<Dof, TwinPlant>, D::Error> {
    let mut plants = jason2_plants();
    plants.extend(BTreeMap::<Dof, TwinPlant>::deserialize(source)?);
    Ok(plants)
}

fn over_jason2_excitation<'de, D: Deserializer<'de>>(
    source: D,
) -> Result<BTreeMap<Dof, Excitation>, D::Error> {
    let mut excitation = jason2_excitation();
    excitation.extend(BTreeMap::<Dof, Excitation>::deserialize(source)?);
    Ok(excitation)
}

impl Default for SteadyRuns {
    fn default() -> Self {
        Self {
            down: vec![0.3, 0.6, 0.8, 1.0],
            up: vec![0.3, 0.6, 1.0],
            duration_s: 120.0,
            d_quadratic: 5500.0,
            bias_force: 250.0,
        }
    }
}

impl Default for TwinThrusters {
    fn default() -> Self {
        Self { forward: 0.0402, reverse: 0.0328, max_rpm: 1650.0 }
    }
}

impl TwinPlant {
    /// Returns the parameters of the plant model.
    pub fn physical(&self) -> PhysicalParameters {
        PhysicalParameters {
            mass: self.mass,
            d_quadratic: self.d_quadratic,
            d_linear: self.d_linear,
            bias_force: self.bias_force,
        }
    }
}

impl TwinThrusters {
    /// Returns the true thrust law, in propeller speed, rad/s.
    pub fn law(&self) -> QuadraticThrust {
        QuadraticThrust { forward: self.forward, reverse: self.reverse, ..Default::default() }
    }

    /// Returns the largest propeller speed, rad/s.
    pub fn max_speed(&self) -> f64 {
        self.max_rpm * super::RPM
    }
}
