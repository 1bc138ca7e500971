//! What a user may say of the twin.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::{Dof, Error, PhysicalParameters, QuadraticThrust};

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

/// What disturbs the vehicle or misleads its analyst.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Disturbance {
    /// The cable pulls, slowly changing.
    Tether,
    /// The water moves; in yaw it makes a Munk moment.
    Current,
    /// Propellers follow their logged speed with a first-order lag.
    Lag,
    /// Propellers follow their logged speed late.
    Delay,
    /// The analyst takes the forward thrust coefficient for reverse as well.
    Thrcoef,
    /// The analyst has the DVL in the wrong place, and the vehicle rolls and pitches.
    Lever,
    /// Waves push to and fro.
    Swell,
    /// Propellers that move through the water thrust less.
    Inflow,
}

/// How strong each disturbance is; read only if it is on.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DisturbanceStrength {
    /// Standard deviation of the tether's pull, N; in yaw it acts at the thrusters' arm.
    pub tether_n: f64,
    /// Correlation time of the tether's pull, s.
    pub tether_correlation_s: f64,
    /// Mean current along the degree of freedom (in yaw: to the north), m/s.
    pub current_m_s: f64,
    /// Standard deviation of what the current varies by, m/s.
    pub current_std_m_s: f64,
    /// Correlation time of that, s.
    pub current_correlation_s: f64,
    /// Time constant of the propellers' lag, s.
    pub lag_s: f64,
    /// The propellers' delay, s, in whole steps of 0.02 s.
    pub delay_s: f64,
    /// By how much the analyst has the DVL too far aft, and too far up, m.
    pub lever_m: f64,
    /// Root mean square of the roll and pitch rates beside a wrong lever arm, rad/s.
    pub lever_rate_rad_s: f64,
    /// Amplitude of the swell, N; in yaw it acts at the thrusters' arm.
    pub swell_n: f64,
    /// Period of the swell, s.
    pub swell_period_s: f64,
    /// Part of a thruster's greatest forward thrust that an inflow of 1 m/s takes.
    pub inflow_loss: f64,
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

impl Default for DisturbanceStrength {
    fn default() -> Self {
        Self {
            tether_n: 75.0,
            tether_correlation_s: 30.0,
            current_m_s: 0.1,
            current_std_m_s: 0.02,
            current_correlation_s: 60.0,
            lag_s: 0.3,
            delay_s: 0.2,
            lever_m: 0.8,
            lever_rate_rad_s: 0.03,
            swell_n: 100.0,
            swell_period_s: 10.0,
            inflow_loss: 0.25,
        }
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

impl Disturbance {
    /// All eight; the word `all` means the first six.
    pub const ALL: [Self; 8] = [
        Self::Tether,
        Self::Current,
        Self::Lag,
        Self::Delay,
        Self::Thrcoef,
        Self::Lever,
        Self::Swell,
        Self::Inflow,
    ];

    /// As files and flags write it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tether => "tether",
            Self::Current => "current",
            Self::Lag => "lag",
            Self::Delay => "delay",
            Self::Thrcoef => "thrcoef",
            Self::Lever => "lever",
            Self::Swell => "swell",
            Self::Inflow => "inflow",
        }
    }

    /// Reads `none`, `all` (tether to lever), or names with commas between them.
    ///
    /// # Errors
    /// [`Error::TwinSpec`] for a name that is no disturbance.
    ///
    /// ```
    /// use seaplant::twin::Disturbance;
    /// assert!(Disturbance::parse_list("none")?.is_empty());
    /// assert_eq!(Disturbance::parse_list("all")?.len(), 6);
    /// assert_eq!(Disturbance::parse_list("swell, tether")?.len(), 2);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn parse_list(text: &str) -> Result<BTreeSet<Self>, Error> {
        match text.trim() {
            "none" => Ok(BTreeSet::new()),
            "all" => Ok(Self::ALL[..6].iter().copied().collect()),
            names => names.split(',').map(|name| name.trim().parse()).collect(),
        }
    }
}

impl fmt::Display for Disturbance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Disturbance {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|known| known.name() == text).ok_or_else(|| Error::TwinSpec {
            name: "list of disturbances".to_owned(),
            found: format!("`{text}`"),
            expected: format!("none, all, or some of {}", Self::ALL.map(Self::name).join(", ")),
        })
    }
}
