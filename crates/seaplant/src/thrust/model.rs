//! The actuator model: the difference between logged and acting thrust.

use std::collections::BTreeMap;

/// What logged thrust does from one sample to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BetweenSamples {
    /// It is held.
    #[default]
    Held,
    /// The speed of propellers moves smoothly.
    SmoothSpeed,
    /// Their thrust, or the logged force, moves smoothly.
    SmoothThrust,
}

/// The actuator model between logged thrust and water; identity by default.
#[derive(Clone, Debug, PartialEq)]
pub struct ThrustModel {
    /// First-order lag of propeller speed, s.
    pub lag_s: f64,
    /// Delay of thrust, s.
    pub delay_s: f64,
    /// Ratio of reverse thrust to that of the curve.
    pub reverse_ratio: f64,
    /// Loss of thrust by inflow: each thruster loses `k_in |n| v`.
    pub inflow: f64,
    /// Ratio of the lag of a decelerating propeller to that of an accelerating one.
    pub lag_ratio: f64,
    /// Ratio of the lag of a propeller whose speed falls, towards full reverse, to that of one whose speed rises.
    pub falling_lag_ratio: f64,
    /// Time of a propeller from rest to `full_speed` at its greatest rate, s; 0 without a limit.
    pub slew_s: f64,
    /// Loss of thrust by inflow of propellers that push in the direction of motion.
    pub inflow_ahead: f64,
    /// Exponent of thrust over propeller speed: 2 for the curve itself.
    pub exponent: f64,
    /// The propeller speed at which thrust is independent of the exponent and of a dead band, rad/s.
    pub full_speed: f64,
    /// Part of `full_speed` below which propellers do not turn.
    pub dead_band: f64,
    /// Exponent of thrust over supply voltage, for thrusters whose curves do not account for it.
    pub voltage_exponent: f64,
    /// The supply voltage at which thrust is independent of that exponent, V, of curves that state none.
    pub mean_voltage_v: f64,
    /// Relative growth of thrust from the beginning to the end of each trial.
    pub change_within: f64,
    /// What thrust does between its logged samples.
    pub between: BetweenSamples,
    /// Ratio of the Coriolis effect of rotation on body velocity to that of a rigid body.
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
            falling_lag_ratio: 1.0,
            slew_s: 0.0,
            inflow_ahead: 0.0,
            exponent: 2.0,
            full_speed: 1.0,
            dead_band: 0.0,
            voltage_exponent: 0.0,
            mean_voltage_v: 1.0,
            change_within: 0.0,
            between: BetweenSamples::Held,
            turning: 0.0,
            current: BTreeMap::new(),
        }
    }
}

impl ThrustModel {
    /// Returns whether logged thrust acts unchanged, in still water.
    pub(crate) fn is_plain(&self) -> bool {
        let Self { full_speed, mean_voltage_v, .. } = *self;
        let plain = Self { full_speed, mean_voltage_v, ..Self::default() };
        *self == plain
    }

    /// Returns the current of a trial: its own, otherwise the mean of the known ones.
    pub fn current_of(&self, trial: &str) -> f64 {
        let mean = self.current.values().sum::<f64>() / self.current.len().max(1) as f64;
        self.current.get(trial).copied().unwrap_or(mean)
    }
}
