//! Logged channels with their rates and noise, and warnings about missing or slow ones.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use seaplant::Dof;
use seaplant::estimate::{ExpectedNoise, ExpectedNoises};
use serde::{Deserialize, Serialize};

use crate::{Error, Manoeuvre};

/// Rates and noise of the logged channels; every field has a default, of a vehicle with a DVL, a gyroscope,
/// attitude and depth. Zero Hz means that a channel is not logged.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Logging {
    /// Inputs of thrusters, Hz.
    pub thrusters_hz: f64,
    /// Velocity over ground by a DVL, Hz …
    pub velocity_hz: f64,
    /// … and the standard deviation of a sample, m/s.
    pub velocity_std_m_s: f64,
    /// Rates by a gyroscope, Hz …
    pub rate_hz: f64,
    /// … and the standard deviation of a sample, rad/s.
    pub rate_std_rad_s: f64,
    /// Roll, pitch and heading, Hz …
    pub attitude_hz: f64,
    /// … and the standard deviation of a sample, rad.
    pub attitude_std_rad: f64,
    /// Depth, Hz …
    pub depth_hz: f64,
    /// … and the standard deviation of a sample, m.
    pub depth_std_m: f64,
    /// Position north and east, Hz …
    pub position_hz: f64,
    /// … and the standard deviation of a sample, m.
    pub position_std_m: f64,
}

impl Default for Logging {
    fn default() -> Self {
        Self {
            thrusters_hz: 10.0,
            velocity_hz: 10.0,
            velocity_std_m_s: 0.005,
            rate_hz: 10.0,
            rate_std_rad_s: 0.002,
            attitude_hz: 10.0,
            attitude_std_rad: 0.002,
            depth_hz: 10.0,
            depth_std_m: 0.01,
            position_hz: 0.0,
            position_std_m: 0.5,
        }
    }
}

impl Logging {
    /// Checks rates and standard deviations.
    ///
    /// # Errors
    /// [`Error::Setting`] for a rate below zero, or a standard deviation that is not above it.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |name, found: f64, expected| {
            Err(Error::Setting { name, found: found.to_string(), expected })
        };
        let rates = [
            ("thrusters_hz", self.thrusters_hz),
            ("velocity_hz", self.velocity_hz),
            ("rate_hz", self.rate_hz),
            ("attitude_hz", self.attitude_hz),
            ("depth_hz", self.depth_hz),
            ("position_hz", self.position_hz),
        ];
        for (name, hz) in rates {
            if !(hz >= 0.0 && hz.is_finite()) {
                return refuse(name, hz, "0 (not logged) or more");
            }
        }
        if self.thrusters_hz == 0.0 {
            return refuse(
                "thrusters_hz",
                0.0,
                "above 0: without thrust nothing can be identified",
            );
        }
        let stds = [
            ("velocity_std_m_s", self.velocity_std_m_s),
            ("rate_std_rad_s", self.rate_std_rad_s),
            ("attitude_std_rad", self.attitude_std_rad),
            ("depth_std_m", self.depth_std_m),
            ("position_std_m", self.position_std_m),
        ];
        for (name, std) in stds {
            if !(std > 0.0 && std.is_finite()) {
                return refuse(name, std, "above 0");
            }
        }
        Ok(())
    }

    /// Returns the noise of these instruments, with disturbances by axis.
    pub(crate) fn noises(&self, disturbances: &BTreeMap<Dof, (f64, f64)>) -> ExpectedNoises {
        let own = |(dof, (disturbance, correlation_s)): (&Dof, &(f64, f64))| {
            let velocity =
                if dof.is_rotation() { self.rate_std_rad_s } else { self.velocity_std_m_s };
            let noise = ExpectedNoise {
                disturbance: *disturbance,
                correlation_s: *correlation_s,
                velocity,
            };
            (*dof, noise)
        };
        let names = [
            ("position_noise", self.position_std_m),
            ("depth_noise", self.depth_std_m),
            ("heading_noise", self.attitude_std_rad),
        ];
        ExpectedNoises {
            axes: disturbances.iter().map(own).collect(),
            attitude: self.attitude_std_rad,
            instruments: names.map(|(name, std)| (name.to_owned(), std)).into(),
        }
    }

    /// Returns warnings before the dive: rates too slow for the lag, missing channels, clocks.
    pub(crate) fn doubts(
        &self,
        axes: &[Dof],
        lag_s: f64,
        manoeuvres: &[&Manoeuvre],
    ) -> Vec<String> {
        let mut doubts = Vec::new();
        let slowest = 1.0 / self.thrusters_hz;
        if lag_s > 0.0 && slowest > lag_s {
            doubts.push(format!(
                "thrusters are logged every {slowest:.2} s, and their lag is about {lag_s:.2} s: lag and delay cannot be told apart; log thrusters at {:.0} Hz or more",
                (2.0 / lag_s).ceil()
            ));
        }
        let has = |axis: fn(&Dof) -> bool| axes.iter().any(axis);
        let along = has(|dof| matches!(dof, Dof::Surge | Dof::Sway));
        if along && self.velocity_hz == 0.0 && self.position_hz == 0.0 {
            doubts.push(
                "neither velocity nor position is logged: surge and sway cannot be identified; log a DVL or position".to_owned(),
            );
        }
        if has(|dof| *dof == Dof::Heave) && self.velocity_hz == 0.0 && self.depth_hz == 0.0 {
            doubts.push(
                "neither vertical velocity nor depth is logged: heave cannot be identified"
                    .to_owned(),
            );
        }
        if has(|dof| dof.is_rotation()) && self.rate_hz == 0.0 {
            doubts.push(
                "rates are not logged: the slope of attitude stands for them, which widens every interval of roll, pitch and yaw; log a gyroscope".to_owned(),
            );
        }
        if self.attitude_hz == 0.0 {
            doubts.push("attitude is not logged: gravity and current cannot be turned into the vehicle's axes; log roll, pitch and heading".to_owned());
        }
        if self.velocity_hz > 0.0 && lag_s > 0.0 && 1.0 / self.velocity_hz > 3.0 * lag_s {
            doubts.push(format!(
                "velocity is logged every {:.1} s, much longer than the lag of thrusters ({lag_s:.2} s): the lag stays uncertain, and mass with it",
                1.0 / self.velocity_hz
            ));
        }
        let fastest = manoeuvres.iter().map(|one| one.period_s).fold(f64::INFINITY, f64::min);
        let slowest = [self.velocity_hz, self.rate_hz].into_iter().filter(|hz| *hz > 0.0);
        let slowest = slowest.fold(f64::INFINITY, f64::min);
        if slowest.is_finite() && fastest * slowest < SAMPLES_A_PERIOD {
            doubts.push(format!(
                "motion is sampled {:.0} times in the shortest period of {fastest:.0} s; log at {:.0} Hz or more",
                fastest * slowest,
                (SAMPLES_A_PERIOD / fastest).ceil()
            ));
        }
        let turns = manoeuvres.iter().any(|one| one.axes.contains(&Dof::Yaw));
        if !turns && axes.contains(&Dof::Yaw) {
            doubts.push("no manoeuvre turns the vehicle: clocks of separate logs cannot be aligned by turns; use one clock".to_owned());
        }
        doubts
    }
}

/// Minimum number of samples per period to resolve its highest harmonics.
const SAMPLES_A_PERIOD: f64 = 30.0;
