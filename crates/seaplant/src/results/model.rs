//! Models of one axis from results.

use super::PlantResult;
use crate::{Model, ThrustModel, VelocitySensor};

/// Prefix of the name of a trial's current in results.
const CURRENT_OF: &str = "current: ";

impl Model {
    /// Creates the model of an axis that was identified alone from results; `None` for other plants.
    pub fn of_result(result: &PlantResult) -> Option<Self> {
        let lumped = result.alone.as_ref()?.lumped;
        let value = |name: &str| result.nuisances.get(name).map(|nuisance| nuisance.value);
        let current = result.nuisances.iter().filter_map(|(name, nuisance)| {
            Some((name.strip_prefix(CURRENT_OF)?.to_owned(), nuisance.value))
        });
        let thrust = ThrustModel {
            lag_s: value("lag").unwrap_or(0.0),
            delay_s: value("delay").unwrap_or(0.0),
            reverse_ratio: value("reverse_ratio").unwrap_or(1.0),
            inflow: value("inflow").unwrap_or(0.0),
            lag_ratio: value("lag_ratio").unwrap_or(1.0),
            falling_lag_ratio: value("falling_lag_ratio").unwrap_or(1.0),
            slew_s: value("slew").unwrap_or(0.0),
            inflow_ahead: value("inflow_ahead").unwrap_or(0.0),
            exponent: value("thrust_exponent").unwrap_or(2.0),
            dead_band: value("dead_band").unwrap_or(0.0),
            full_speed: value("full_speed").unwrap_or(1.0),
            voltage_exponent: value("voltage_exponent").unwrap_or(0.0),
            mean_voltage_v: value("mean_voltage").unwrap_or(1.0),
            change_within: value("thrust_change_within").unwrap_or(0.0),
            between: result.between_samples(),
            turning: value("turning").unwrap_or(0.0),
            current: current.collect(),
        };
        let sensor = VelocitySensor {
            lag_s: value("sensor_lag").unwrap_or(0.0),
            window_s: value("sensor_window").unwrap_or(0.0),
            scale: value("velocity_scale").unwrap_or(1.0),
        };
        Some(Self { lumped, thrust, sensor })
    }

    /// Formats the name of a trial's current in results.
    pub(crate) fn current_name(trial: &str) -> String {
        format!("{CURRENT_OF}{trial}")
    }
}
