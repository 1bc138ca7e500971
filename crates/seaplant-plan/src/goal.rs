//! Goals of a trial: intervals of coefficients, drag, steady speed, velocity on a mission, margins.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// Unit of a phase margin.
pub(crate) const DEGREES: &str = "deg";
/// A half-width of a 95 % interval in standard deviations.
pub(crate) const HALF_95: f64 = 1.959_964;

/// Half of the widest 95 % interval that meets a goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Width {
    /// Half of it, relative to the value.
    Part(f64),
    /// Half of it, in SI units.
    Amount(f64),
}

/// A goal: the interval of a coefficient by its name (`mass.surge`, `yaw: |r|r`), the drag of an
/// axis (`drag.surge`), the steady speed at half of its greatest force (`speed.surge`), its velocity
/// on the reference mission (`mission.surge`, root mean square), or the phase margin of a controller
/// in degrees (`margin.surge`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Goal {
    /// The coefficient, drag, speed, velocity or margin.
    pub name: String,
    /// Its interval.
    pub width: Width,
}

impl std::str::FromStr for Goal {
    type Err = Error;

    /// Reads `mass.surge=5%` or, in SI units, `mass.surge=2.5`.
    fn from_str(text: &str) -> Result<Self, Error> {
        let refuse =
            |reason: &str| Error::Goal { text: text.to_owned(), reason: reason.to_owned() };
        let usage = "write a name, = and half the width of its 95 % interval, as mass.surge=5% or \"surge: |u|u=12\"";
        let Some((name, width)) = text.rsplit_once('=') else { return Err(refuse(usage)) };
        let (name, width) = (name.trim(), width.trim());
        let (number, is_part) = match width.strip_suffix('%') {
            Some(part) => (part.trim(), true),
            None => (width, false),
        };
        let number: f64 = number.parse().map_err(|_| refuse(usage))?;
        if name.is_empty() || !(number > 0.0 && number.is_finite()) {
            return Err(refuse("half the width of an interval is above zero; as mass.surge=5%"));
        }
        let width = if is_part { Width::Part(number / 100.0) } else { Width::Amount(number) };
        Ok(Self { name: name.to_owned(), width })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_read_with_names_that_hold_signs() {
        let goal: Goal = "surge: |u|u = 12".parse().expect("a goal");
        assert_eq!(goal, Goal { name: "surge: |u|u".to_owned(), width: Width::Amount(12.0) });
        let goal: Goal = "mass.surge=5 %".parse().expect("a goal");
        assert_eq!(goal.width, Width::Part(0.05));
        for wrong in ["mass.surge", "mass.surge=-1%", "=5%", "mass.surge=five"] {
            let error = wrong.parse::<Goal>().expect_err(wrong).to_string();
            assert!(error.contains("mass.surge=5%"), "{error}");
        }
    }
}
