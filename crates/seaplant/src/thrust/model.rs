//! How thrust acts of what is logged of it.

use std::collections::BTreeMap;

/// What stands between logged thrust and the water; by default nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct ThrustModel {
    /// First-order lag of propeller speed, s.
    pub lag_s: f64,
    /// Delay of thrust, s.
    pub delay_s: f64,
    /// Reverse thrust over what the curve says.
    pub reverse_ratio: f64,
    /// Thrust lost to inflow: each thruster gives `k_in |n| v` less.
    pub inflow: f64,
    /// Lag of a propeller that slows down over that of one that speeds up.
    pub lag_ratio: f64,
    /// Time that a propeller needs from rest to `full_speed` at its greatest rate, s; 0 without
    /// a limit.
    pub slew_s: f64,
    /// Thrust lost to inflow by propellers that push the way the vehicle goes.
    pub inflow_ahead: f64,
    /// Exponent of thrust over propeller speed: 2 is what the curve says.
    pub exponent: f64,
    /// The propeller speed at which the exponent leaves thrust as it is, rad/s.
    pub full_speed: f64,
    /// Whether propeller speeds move linearly from one logged sample to the next; else they are
    /// held.
    pub linear: bool,
    /// What turning does to body velocity, as a part of what it does to a rigid body.
    pub turning: f64,
    /// Current along the degree of freedom, m/s, by trial.
    pub current: BTreeMap<String, f64>,
}

impl Default for ThrustModel {
    fn default() -> Self {
        Self {
            lag_s: 0.0,
            delay_s: 0.0,
            reverse_ratio: 1.0,
            inflow: 0.0,
            lag_ratio: 1.0,
            slew_s: 0.0,
            inflow_ahead: 0.0,
            exponent: 2.0,
            full_speed: 1.0,
            linear: false,
            turning: 0.0,
            current: BTreeMap::new(),
        }
    }
}

impl ThrustModel {
    /// Whether thrust acts as it was logged, in water at rest.
    pub(crate) fn is_plain(&self) -> bool {
        let plain = Self { full_speed: self.full_speed, ..Self::default() };
        *self == plain
    }

    /// The current of a trial: its own, else the mean of those that are known.
    pub fn current_of(&self, trial: &str) -> f64 {
        let mean = self.current.values().sum::<f64>() / self.current.len().max(1) as f64;
        self.current.get(trial).copied().unwrap_or(mean)
    }
}
