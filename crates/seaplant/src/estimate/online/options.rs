//! The choices of online identification.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// No time, rate or threshold is greater.
const LARGEST: f64 = 1e6;

/// How to identify online.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// The adaptive observer.
    #[default]
    Adaptive,
    /// Recursive least squares.
    Recursive,
    /// The joint extended Kalman filter.
    Ekf,
}

/// The choices of online identification, in units that a person can choose by.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OnlineOptions {
    /// Least squares of so many seconds make the start, s; of up to ten times as many, until the
    /// motion determines every mass.
    pub start_s: f64,
    /// How fast the observer follows measured velocity at most, 1/s; slower where that is noisy.
    pub observer_rate: f64,
    /// In what time the adaptive coefficients follow, s.
    pub adaptation_s: f64,
    /// Corner of the filter on every term of recursive least squares, Hz.
    pub cutoff_hz: f64,
    /// How long recursive least squares remembers, s; infinite for a plant that does not change.
    pub memory_s: Option<f64>,
    /// How far coefficients of the filter may wander in a minute, as a part of each.
    pub wander_per_minute: f64,
    /// The threshold of the sum that tells a change of the plant; higher is rarer.
    pub change_threshold: f64,
    /// A longer step is a gap, s.
    pub longest_step_s: f64,
}

impl Default for OnlineOptions {
    fn default() -> Self {
        Self {
            start_s: 20.0,
            observer_rate: 8.0,
            adaptation_s: 40.0,
            cutoff_hz: 0.5,
            memory_s: None,
            wander_per_minute: 0.002,
            change_threshold: 9.0,
            longest_step_s: 1.0,
        }
    }
}

impl OnlineOptions {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Setting`] for a time, rate or threshold that is not above zero, or far beyond what
    /// any vehicle needs.
    pub fn check(&self) -> Result<(), Error> {
        let positive = [
            ("start_s", self.start_s),
            ("observer_rate", self.observer_rate),
            ("adaptation_s", self.adaptation_s),
            ("cutoff_hz", self.cutoff_hz),
            ("memory_s", self.memory_s.unwrap_or(1.0)),
            ("change_threshold", self.change_threshold),
            ("longest_step_s", self.longest_step_s),
        ];
        let refuse = |name: &str, found: f64, expected: String| {
            let name = name.to_owned();
            Err(Error::Setting { name, found: found.to_string(), expected })
        };
        for (name, found) in positive {
            if !(found > 0.0 && found <= LARGEST) {
                return refuse(name, found, format!("above zero and at most {LARGEST}"));
            }
        }
        if !(0.0..=1.0).contains(&self.wander_per_minute) {
            let expected = "zero or more, and at most 1".to_owned();
            return refuse("wander_per_minute", self.wander_per_minute, expected);
        }
        Ok(())
    }
}
