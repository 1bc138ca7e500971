//! Consequences of a plant, and the range of motion in its trials.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Dof;

/// A number that follows from a plant's coefficients.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Consequence {
    /// Name, with the force for which it holds.
    pub name: String,
    /// The axis.
    pub axis: Dof,
    /// The value.
    pub value: f64,
    /// Its 95 % interval; absent if the covariance is unknown, or if it is unbounded.
    pub interval95: Option<[f64; 2]>,
    /// Its unit.
    pub unit: String,
}

/// Two digits of a number, towards zero: a force or speed that was within the trials.
pub(crate) fn two_digits(x: f64) -> f64 {
    let unit = 10_f64.powi(x.abs().log10().floor() as i32 - 1);
    // Divided once more, so that 2300 is no 2300.0000000000005.
    let digits = (x / unit).trunc();
    if unit < 1.0 { digits / (1.0 / unit).round() } else { digits * unit.round() }
}

/// Range of motion and force on an axis in the trials of a plant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Driven {
    /// Greatest speed, m/s or rad/s.
    pub speed_max: f64,
    /// Greatest force, N or N m.
    pub force_max: f64,
}

impl Driven {
    /// Returns the greater of each.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            speed_max: self.speed_max.max(other.speed_max),
            force_max: self.force_max.max(other.force_max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::two_digits;

    #[test]
    fn forces_are_cut_to_two_digits() {
        for (force, cut) in
            [(2378.686, 2300.0), (99.9, 99.0), (5.27, 5.2), (0.0123, 0.012), (3.0, 3.0)]
        {
            assert_eq!(two_digits(force), cut);
        }
    }
}
