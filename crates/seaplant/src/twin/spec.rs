//! What a user may say of the twin.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use super::{Disturbance, DisturbanceStrength};
use crate::{Dof, PhysicalParameters, QuadraticThrust};

/// What the twin is and does; every field defaults to the Jason 2 twin.
///
/// In a file, `[plants.surge]` or `[excitation.yaw]` replaces that one and leaves the
/// other degrees of freedom as they are.
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
    /// What the vehicle is called.
    pub name: String,
    /// Where every random number starts: equal seeds give equal logs.
    pub seed: u64,
    /// How noisy the instruments are.
    pub noise: NoiseLevel,
    /// What disturbs the vehicle or misleads its analyst.
    pub disturbances: BTreeSet<Disturbance>,
    /// The degrees of freedom that are tried out: any of surge, sway, heave and yaw.
    pub dofs: BTreeSet<Dof>,
    /// Length of each trial that is fitted, s.
    pub duration_s: f64,
    /// Length of each held-out trial, s.
    pub hold_out_s: f64,
    /// Mass in air, kg.
    pub dry_mass_kg: f64,
    /// Length, width and height of the hull, m, if they are to be known.
    #[serde(deserialize_with = "crate::exact::some_numbers")]
    pub size_m: Option<[f64; 3]>,
    /// Depth of the vehicle's origin at the start of each trial, m.
    pub start_depth_m: f64,
    /// The true plant of each degree of freedom.
    #[serde(deserialize_with = "over_jason2_plants")]
    pub plants: BTreeMap<Dof, TwinPlant>,
    /// What the pilot does in each degree of freedom.
    #[serde(deserialize_with = "over_jason2_excitation")]
    pub excitation: BTreeMap<Dof, Excitation>,
    /// The runs at constant vertical thrust.
    pub steady: SteadyRuns,
    /// The thrusters, all alike.
    pub thrusters: TwinThrusters,
    /// An accelerometer in place of the DVL, if the vehicle has none.
    pub accelerometer: Option<TwinAccelerometer>,
    /// How strong each disturbance is, if it is on.
    pub strength: DisturbanceStrength,
}

/// `τ = m v̇ + d_Q v|v| + d_L v + b`, the truth of one degree of freedom.
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
    /// Of the sinusoid: N, N m, or in heave m of depth.
    pub amplitude: f64,
    /// Of the sinusoid, rad/s.
    pub frequency_rad_s: f64,
    /// The most that the joystick asks for: N, N m, or in heave m/s.
    pub joystick: f64,
}

/// Runs at constant vertical thrust, from rest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SteadyRuns {
    /// Thrusts downwards, as parts of the most that reversed thrusters give.
    pub down: Vec<f64>,
    /// Thrusts upwards, as parts of the same.
    pub up: Vec<f64>,
    /// Length of each run, s.
    pub duration_s: f64,
    /// Quadratic drag in these runs, N/(m/s)².
    pub d_quadratic: f64,
    /// Bias force in these runs, N.
    pub bias_force: f64,
}

/// A thruster: `F = k ω|ω|` with a coefficient each way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwinThrusters {
    /// k forward, N/(rad/s)².
    pub forward: f64,
    /// k in reverse, N/(rad/s)².
    pub reverse: f64,
    /// The fastest that a propeller is told to turn, rpm.
    pub max_rpm: f64,
}

/// An accelerometer that is logged 50 times a second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TwinAccelerometer {
    /// Where it sits, m, body frame.
    pub position_m: [f64; 3],
    /// Standard deviation of vibration in each sample, m/s².
    pub noise: f64,
    /// What each axis reads at rest beside gravity, m/s².
    pub offset: f64,
    /// Standard deviation of gravity that slow attitude errors leak into each axis, m/s².
    pub leak: f64,
    /// How long these last, s.
    pub leak_s: f64,
}

impl Default for TwinAccelerometer {
    fn default() -> Self {
        Self { position_m: [0.1, 0.0, -0.05], noise: 0.15, offset: 0.05, leak: 0.06, leak_s: 60.0 }
    }
}

/// How noisy the instruments are.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum NoiseLevel {
    /// DVL 0.3 mm/s, heading 0.03°, depth nothing but its quantum.
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

/// [Jason2, table 5].
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

/// [Jason2, table 4]; the joystick is ours.
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
    /// The same as parameters of the plant model.
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
    /// The true thrust law, in propeller speed, rad/s.
    pub fn law(&self) -> QuadraticThrust {
        QuadraticThrust { forward: self.forward, reverse: self.reverse, ..Default::default() }
    }

    /// The fastest that a propeller is told to turn, rad/s.
    pub fn max_speed(&self) -> f64 {
        self.max_rpm * super::RPM
    }
}
