//! Options of online identification.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// Upper limit of times, rates and thresholds.
const LARGEST: f64 = 1e6;

/// Scheme of online identification.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Adaptive observer.
    #[default]
    Adaptive,
    /// Recursive least squares.
    Recursive,
    /// Joint extended Kalman filter.
    Ekf,
}

/// Options of online identification, in physical units.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OnlineOptions {
    /// Duration of the least squares start, s; up to ten times as long, until the motion determines
    /// every mass.
    pub start_s: f64,
    /// Maximum rate of the observer's correction by measured velocity, 1/s; lower where that is
    /// noisy.
    pub observer_rate: f64,
    /// Time constant of the adaptive coefficients, s.
    pub adaptation_s: f64,
    /// Corner frequency of the filter on every term of recursive least squares, Hz.
    pub cutoff_hz: f64,
    /// Memory of recursive least squares, s; infinite if absent, for a constant plant.
    pub memory_s: Option<f64>,
    /// Random walk of the filter's coefficients, as a fraction of each in a minute.
    pub wander_per_minute: f64,
    /// Threshold of the change detection; a higher one gives fewer detections.
    pub change_threshold: f64,
    /// A longer step counts as a gap, s.
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
    /// [`Error::Setting`] for a time, rate or threshold that is not positive, or far beyond what
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
