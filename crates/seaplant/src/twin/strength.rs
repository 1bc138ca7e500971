//! Strength of the disturbances of a twin.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Strength of each disturbance, used only if it is enabled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DisturbanceStrength {
    /// Standard deviation of the tether's force, N; in yaw it acts at the thrusters' arm.
    pub tether_n: f64,
    /// Correlation time of the tether's force, s.
    pub tether_correlation_s: f64,
    /// Mean current along the degree of freedom (in yaw: to the north), m/s.
    pub current_m_s: f64,
    /// Standard deviation of the current about its mean, m/s.
    pub current_std_m_s: f64,
    /// Correlation time of these variations, s.
    pub current_correlation_s: f64,
    /// Time constant of the propellers' lag, s.
    pub lag_s: f64,
    /// Delay of the propellers, s, in whole steps of 0.02 s.
    pub delay_s: f64,
    /// Error of the DVL's position in the analyst's vehicle, aft and up, m.
    pub lever_m: f64,
    /// Root mean square of the roll and pitch rates under `lever`, rad/s.
    pub lever_rate_rad_s: f64,
    /// Amplitude of the swell, N; in yaw it acts at the thrusters' arm.
    pub swell_n: f64,
    /// Period of the swell, s; for `swell-narrow-band` that of its peak.
    pub swell_period_s: f64,
    /// Loss of thrust at an inflow of 1 m/s, as a fraction of the greatest forward thrust.
    pub inflow_loss: f64,
    /// Time constant of propellers that speed up under `lag-two-way`, s.
    pub lag_up_s: f64,
    /// Time constant of propellers that slow down, s.
    pub lag_down_s: f64,
    /// Time of a propeller from rest to its greatest speed under `slew`, s.
    pub slew_s: f64,
    /// Loss of thrust under `inflow-one-sided` at a speed of advance of 1 m/s, as a fraction of the
    /// greatest forward thrust.
    pub inflow_one_sided_loss: f64,
    /// p of F ∝ |n|^p under `thrust-exponent`; the analyst's curve is correct at the greatest
    /// speed.
    pub thrust_exponent: f64,
    /// Part of the greatest command below which propellers do not turn under `dead-band`; the analyst's curve is
    /// correct at the greatest speed.
    pub dead_band: f64,
    /// Fraction of thrust lost under `battery-sag` by the end of a degree of freedom's last trial,
    /// linear in time from the start of its first.
    pub sag_part: f64,
    /// Standard deviation of the narrow-band swell, N; in yaw it acts at the thrusters' arm.
    pub swell_std_n: f64,
    /// Damping ratio of the narrow-band swell: half its relative bandwidth.
    pub swell_damping: f64,
    /// Standard deviation of the drifting current, m/s.
    pub drift_std_m_s: f64,
    /// Correlation time of the drifting current, s.
    pub drift_correlation_s: f64,
    /// Averaging window under `velocity-averaging`, s.
    pub averaging_s: f64,
    /// Time constant of the DVL under `velocity-lag`, s.
    pub velocity_lag_s: f64,
    /// Relative scale error of the DVL; positive if it reads too high.
    pub dvl_scale_error: f64,
    /// Fraction of samples that are outliers.
    pub spike_part: f64,
    /// Largest error of an outlier on each axis of the DVL, m/s; errors are uniform up to it.
    pub spike_m_s: f64,
    /// Largest error of an outlier of heading, deg.
    pub spike_heading_deg: f64,
    /// Mean duration of a gap under `dropouts` and `heading-gaps`, s; each lasts half to one and a
    /// half times as long.
    pub gap_s: f64,
    /// Mean time between two gaps, s.
    pub gap_interval_s: f64,
    /// Largest error of a time stamp, s, early or late; errors are uniform up to it.
    pub stamp_jitter_s: f64,
    /// Time between two logged propeller speeds under `slow-thrust-log`, s, in whole steps of 0.1
    /// s.
    pub thrust_log_s: f64,
    /// Drift of heading, deg/min.
    pub heading_drift_deg_min: f64,
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
            lag_up_s: 0.15,
            lag_down_s: 0.45,
            slew_s: 0.6,
            inflow_one_sided_loss: 0.25,
            thrust_exponent: 1.8,
            dead_band: 0.06,
            sag_part: 0.15,
            swell_std_n: 70.0,
            swell_damping: 0.05,
            drift_std_m_s: 0.05,
            drift_correlation_s: 150.0,
            averaging_s: 1.0,
            velocity_lag_s: 0.3,
            dvl_scale_error: 0.03,
            spike_part: 0.005,
            spike_m_s: 1.0,
            spike_heading_deg: 30.0,
            gap_s: 8.0,
            gap_interval_s: 100.0,
            stamp_jitter_s: 0.02,
            thrust_log_s: 0.5,
            heading_drift_deg_min: 1.0,
        }
    }
}
