//! A known weight that is hung on the vehicle and taken off, to determine the scale of thrust.

use schemars::JsonSchema;
use seaplant::motion::{KnownForce, KnownKind};
use seaplant::plant::GRAVITY;
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::rig::Rig;

/// A weight that can be hung on the vehicle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HungWeight {
    /// Weight in water, N.
    pub weight_n: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Place at which it hangs, from the vehicle's origin in body axes, m.
    #[serde(default)]
    pub position_m: [f64; 3],
}

impl HungWeight {
    /// Checks that the vehicle can lift it.
    ///
    /// # Errors
    /// [`Error::Limit`] by name.
    pub(crate) fn check(&self, rig: &Rig) -> Result<(), Error> {
        let refuse = |name, found: f64, expected: String| {
            Err(Error::Limit { name, found: found.to_string(), expected })
        };
        let most = LIFTED * rig.most[2];
        if !(self.weight_n > 0.0 && self.weight_n < most) {
            let expected = match most > 0.0 {
                true => {
                    format!("above 0 and below {most:.1} N: that the vehicle still holds its depth")
                }
                false => {
                    "none: no thrusters push heave by itself, so that nothing lifts it".to_owned()
                }
            };
            return refuse("weight.weight_n", self.weight_n, expected);
        }
        if !(self.mass_kg > 0.0 && self.mass_kg.is_finite()) {
            return refuse("weight.mass_kg", self.mass_kg, "above 0".to_owned());
        }
        let in_air = self.mass_kg * GRAVITY;
        if self.weight_n > in_air {
            let expected = format!("at most {in_air:.1} N: what {} kg weigh in air", self.mass_kg);
            return refuse("weight.weight_n", self.weight_n, expected);
        }
        match self.position_m.iter().find(|x| !x.is_finite()) {
            Some(wrong) => refuse("weight.position_m", *wrong, "numbers".to_owned()),
            None => Ok(()),
        }
    }

    /// Returns the times at which it hangs on a vehicle: the first half of every period.
    pub(crate) fn hung(&self, period_s: f64, seconds: f64) -> Vec<KnownForce> {
        let count = (seconds / period_s).ceil() as usize;
        let of = |k: usize| {
            let from_s = k as f64 * period_s;
            let to_s = (from_s + 0.5 * period_s).min(seconds);
            let Self { weight_n, mass_kg, position_m } = *self;
            let kind = KnownKind::Weight { weight_n, mass_kg };
            KnownForce { kind, position_m, std_n: 0.0, from_s, to_s }
        };
        (0..count).map(of).collect()
    }
}

/// Greatest weight as a fraction of the greatest force in heave.
const LIFTED: f64 = 0.8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_hangs_in_the_first_half_of_every_period() {
        let weight = HungWeight { weight_n: 20.0, mass_kg: 2.5, position_m: [0.0; 3] };
        let times: Vec<[f64; 2]> =
            weight.hung(120.0, 270.0).iter().map(|one| [one.from_s, one.to_s]).collect();
        assert_eq!(times, [[0.0, 60.0], [120.0, 180.0], [240.0, 270.0]]);
    }
}
