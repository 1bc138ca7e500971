//! The energy of a battery, and the power of thrusters.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::drive::Driven;
use crate::rig::Rig;

/// The battery that a plan may use up, and what draws on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Battery {
    /// Usable energy, Wh.
    pub energy_wh: f64,
    /// Electrical power of one thruster at its greatest thrust, W.
    pub thruster_w: f64,
    /// Power of everything else, W.
    pub other_w: f64,
}

/// Seconds in an hour.
pub(crate) const HOUR_S: f64 = 3600.0;

impl Battery {
    /// Checks the numbers.
    ///
    /// # Errors
    /// [`Error::Limit`] by name.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let positive = [
            ("battery.energy_wh", self.energy_wh, self.energy_wh > 0.0),
            ("battery.thruster_w", self.thruster_w, self.thruster_w > 0.0),
            ("battery.other_w", self.other_w, self.other_w >= 0.0),
        ];
        match positive.into_iter().find(|(_, value, holds)| !(*holds && value.is_finite())) {
            None => Ok(()),
            Some((name, value, _)) => Err(Error::Limit {
                name,
                found: value.to_string(),
                expected: "above 0 (power of other loads: 0 or more)".to_owned(),
            }),
        }
    }

    /// Returns the mean power of a run, W: thrust T of a propeller takes power in proportion to
    /// `|T|^(3/2)`, by momentum theory.
    ///
    /// # Source
    /// [Fossen2021, ch. 9]: quadratic thrust and torque, hence cubic power, in propeller speed.
    pub(crate) fn watts(&self, rig: &Rig, driven: &Driven, thrust_part: f64) -> f64 {
        let of_thruster = |k: usize| {
            let curve = &rig.thrusters[k].curve;
            let power = |input: &f64| {
                let thrust = curve.force(*input, None);
                let full = rig.allowed[k][usize::from(thrust > 0.0)].abs() / thrust_part;
                self.thruster_w * (thrust.abs() / full).powf(1.5)
            };
            driven.inputs[k].iter().map(power).sum::<f64>() / driven.inputs[k].len() as f64
        };
        self.other_w + (0..rig.thrusters.len()).map(of_thruster).sum::<f64>()
    }
}
