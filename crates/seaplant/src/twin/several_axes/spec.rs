//! The specification of the twin of a vehicle of several axes.

use std::collections::{BTreeMap, BTreeSet};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::motion::{KnownForce, KnownKind};
use crate::twin::validate::{above_zero, not_negative, refused};
use crate::twin::{Disturbance, DisturbanceStrength, NoiseLevel, TwinSpec};
use crate::{Dof, Error, Role, axes_by_name, schema_of_axes};

/// The specification of the twin of a vehicle of several axes; every field has a default.
///
/// ```
/// use seaplant::Dof;
/// use seaplant::twin::{Driving, VehicleTwinSpec};
/// let spec = VehicleTwinSpec { driving: Driving::Mixture, ..VehicleTwinSpec::default() };
/// assert_eq!(spec.duration_s, 300.0);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VehicleTwinSpec {
    /// Its plant and thrusters: `published:NAME`, or a plant file.
    pub vehicle: String,
    /// Seed of all random numbers: equal seeds give equal logs.
    pub seed: u64,
    /// Noise level of the instruments.
    pub noise: NoiseLevel,
    /// Disturbances of the vehicle, and errors of its analyst.
    pub disturbances: BTreeSet<Disturbance>,
    /// The driven axes, or `six`, `planar` or `vertical`; all axes on which the thrusters act if
    /// left out.
    #[serde(deserialize_with = "axes_by_name")]
    #[schemars(schema_with = "schema_of_axes")]
    pub axes: Vec<Dof>,
    /// Excitation in the fitted trials.
    pub driving: Driving,
    /// Duration of each fitted trial, s.
    pub duration_s: f64,
    /// Duration of the held-out trial, s.
    pub hold_out_s: f64,
    /// Depth of the vehicle's origin at the start of each trial, m.
    pub start_depth_m: f64,
    /// Speed along a driven axis, as far as the thrusters allow, m/s.
    pub speed_m_s: f64,
    /// Angular velocity in yaw, rad/s.
    pub rate_rad_s: f64,
    /// Amplitude of roll and pitch, rad.
    pub tilt_rad: f64,
    /// Largest propeller speed, rpm, for thrust as a function of propeller speed; that of the
    /// vehicle's thrusters if left out.
    pub max_rpm: Option<f64>,
    /// Standard deviation of the tether's force on each axis, as a fraction of the amplitude of the
    /// force on it; instead of `strength.tether_n`.
    pub tether_part: f64,
    /// Amplitude of the swell, and standard deviation of the narrow-band swell, as fractions of the
    /// same; instead of `strength.swell_n` and `strength.swell_std_n`.
    pub swell_part: f64,
    /// Ratio of true thrust to that of the vehicle file.
    pub thrust_scale: f64,
    /// The same of single thrusters, by name, times `thrust_scale`: 0.8 of a fouled one, 0 of one that stands still,
    /// −1 of one that pushes the other way.
    pub thruster_gains: BTreeMap<String, f64>,
    /// Pairs of thrusters that are exchanged: each does what the log of the other says.
    pub thrusters_exchanged: Vec<[String; 2]>,
    /// A weight that is hung on and taken off in the fitted trials.
    pub weight: Option<TwinWeight>,
    /// Strength of each disturbance, if it is enabled.
    pub strength: DisturbanceStrength,
}

/// A weight that is hung on a twin and taken off.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TwinWeight {
    /// Its weight in water, N.
    pub weight_n: f64,
    /// Its mass, kg.
    pub mass_kg: f64,
    /// Its position, from the origin: forward, starboard, down, m.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// Number of times it is hung on in each trial: for the second half of as many equal intervals.
    #[serde(default = "once")]
    pub times: u32,
}

const fn once() -> u32 {
    1
}

/// Excitation in the fitted trials.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Driving {
    /// All driven axes at once, in two trials.
    #[default]
    Free,
    /// One axis at a time, in a trial each.
    Sweeps,
    /// One trial of all at once, and one of each axis.
    Mixture,
}

impl Default for VehicleTwinSpec {
    fn default() -> Self {
        Self {
            vehicle: "published:bluerov2-heavy-von-benzon-2022".to_owned(),
            seed: 1,
            noise: NoiseLevel::Middle,
            disturbances: BTreeSet::new(),
            axes: Vec::new(),
            driving: Driving::Free,
            duration_s: 300.0,
            hold_out_s: 200.0,
            start_depth_m: 150.0,
            speed_m_s: 0.5,
            rate_rad_s: 0.4,
            tilt_rad: 0.25,
            max_rpm: None,
            tether_part: 0.05,
            swell_part: 0.05,
            thrust_scale: 1.0,
            thruster_gains: BTreeMap::new(),
            thrusters_exchanged: Vec::new(),
            weight: None,
            strength: DisturbanceStrength::default(),
        }
    }
}

/// Largest roll and pitch, rad, well within the range of Euler angles.
const MOST_TILT: f64 = 0.6;

impl VehicleTwinSpec {
    /// Returns the settings in common with the twin of one axis.
    pub(super) fn shared(&self) -> Result<TwinSpec, Error> {
        self.refuse_forces()?;
        if let Some(weight) = &self.weight {
            above_zero("weight.weight_n", weight.weight_n)?;
            above_zero("weight.mass_kg", weight.mass_kg)?;
            above_zero("weight.times", f64::from(weight.times))?;
        }
        let scale = ("thrust_scale", self.thrust_scale);
        [("speed_m_s", self.speed_m_s), ("rate_rad_s", self.rate_rad_s), scale]
            .iter()
            .try_for_each(|(name, value)| above_zero(name, *value))?;
        [("tether_part", self.tether_part), ("swell_part", self.swell_part)]
            .iter()
            .try_for_each(|(name, value)| not_negative(name, *value))?;
        if !(0.0..=MOST_TILT).contains(&self.tilt_rad) {
            let expected = format!("from 0 to {MOST_TILT}");
            return Err(refused("tilt_rad", &self.tilt_rad.to_string(), &expected));
        }
        let spec = TwinSpec {
            seed: self.seed,
            noise: self.noise,
            disturbances: self.disturbances.clone(),
            duration_s: self.duration_s,
            hold_out_s: self.hold_out_s,
            start_depth_m: self.start_depth_m,
            strength: self.strength,
            ..TwinSpec::jason2()
        };
        spec.validate()?;
        Ok(spec)
    }

    /// Where the thrusters that the spec names stand among those of a vehicle: of each, which it
    /// follows, and its gain.
    ///
    /// # Errors
    /// [`Error::TwinSpec`] for a name that none of them has, or a gain that is not finite.
    pub(super) fn acting(&self, names: &[&str]) -> Result<Vec<(usize, f64)>, Error> {
        let place = |key: &str, name: &String| {
            let expected = format!("one of {}", names.join(", "));
            let found = names.iter().position(|own| own == name);
            found.ok_or_else(|| refused(key, name, &expected))
        };
        let mut acting: Vec<(usize, f64)> = (0..names.len()).map(|at| (at, 1.0)).collect();
        for (name, gain) in &self.thruster_gains {
            if !gain.is_finite() {
                let key = format!("thruster_gains.{name}");
                return Err(refused(&key, &gain.to_string(), "a number"));
            }
            acting[place("thruster_gains", name)?].1 = *gain;
        }
        for [a, b] in &self.thrusters_exchanged {
            let [a, b] = [place("thrusters_exchanged", a)?, place("thrusters_exchanged", b)?];
            (acting[a].0, acting[b].0) = (b, a);
        }
        Ok(acting)
    }

    /// Returns the weight of a trial, each time it is hung on.
    pub(super) fn known_forces(&self, role: Role, duration_s: f64) -> Vec<KnownForce> {
        let Some(weight) = self.weight.filter(|_| role == Role::Fit) else { return Vec::new() };
        let TwinWeight { weight_n, mass_kg, position_m, times } = weight;
        let part_s = duration_s / f64::from(times);
        let weight_at = |k: u32| KnownForce {
            kind: KnownKind::Weight { weight_n, mass_kg },
            position_m,
            std_n: 0.0,
            from_s: (f64::from(k) + 0.5) * part_s,
            to_s: (f64::from(k) + 1.0) * part_s,
        };
        (0..times).map(weight_at).collect()
    }

    /// Refuses forces in newtons, which suit Jason 2 only.
    fn refuse_forces(&self) -> Result<(), Error> {
        let usual = DisturbanceStrength::default();
        let forces = [
            ("tether_n", self.strength.tether_n, usual.tether_n, "tether_part"),
            ("swell_n", self.strength.swell_n, usual.swell_n, "swell_part"),
            ("swell_std_n", self.strength.swell_std_n, usual.swell_std_n, "swell_part"),
        ];
        match forces.into_iter().find(|(_, value, usual, _)| value != usual) {
            None => Ok(()),
            Some((name, value, _, instead)) => {
                let expected = format!("left out: of a whole vehicle {instead} says it");
                Err(refused(&format!("strength.{name}"), &value.to_string(), &expected))
            }
        }
    }
}
