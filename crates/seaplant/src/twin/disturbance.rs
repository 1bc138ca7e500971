//! Names of the disturbances of a twin.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// A disturbance of the vehicle, or an error of its analyst.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Disturbance {
    /// A slowly varying force of the tether.
    Tether,
    /// A current; in yaw it causes a Munk moment.
    Current,
    /// A first-order lag of propeller speed.
    Lag,
    /// A delay of propeller speed.
    Delay,
    /// The analyst uses the forward thrust coefficient in reverse too.
    Thrcoef,
    /// The analyst has a wrong lever arm of the DVL, and the vehicle rolls and pitches.
    Lever,
    /// A wave force, as one sinusoid.
    Swell,
    /// Thrust falls with the speed of advance, and grows while the propeller pushes against the
    /// motion.
    Inflow,
    /// Lags with separate time constants for propellers that speed up and slow down, instead of
    /// `lag`.
    LagTwoWay,
    /// A limited rate of propeller speed.
    Slew,
    /// Thrust falls with the speed of advance, and is unchanged while the propeller pushes against
    /// the motion.
    InflowOneSided,
    /// Another exponent of thrust over propeller speed than 2.
    ThrustExponent,
    /// Propellers do not turn at small commands.
    DeadBand,
    /// Thrust falls as the battery discharges.
    BatterySag,
    /// An irregular wave force in a narrow band of periods.
    SwellNarrowBand,
    /// A current that varies over minutes.
    CurrentDrift,
    /// The DVL logs the mean velocity over a past interval.
    VelocityAveraging,
    /// The DVL logs velocity with a first-order lag.
    VelocityLag,
    /// A scale error of the DVL.
    DvlScale,
    /// Outliers in samples of the DVL and of heading.
    Spikes,
    /// Gaps of the DVL without bottom lock.
    Dropouts,
    /// A random error of each time stamp.
    StampJitter,
    /// Propeller speed is logged less often than it changes.
    SlowThrustLog,
    /// Gaps of the attitude sensor.
    HeadingGaps,
    /// A drift of heading.
    HeadingDrift,
}

impl Disturbance {
    /// All disturbances; the word `all` means the first six.
    pub const ALL: [Self; 25] = [
        Self::Tether,
        Self::Current,
        Self::Lag,
        Self::Delay,
        Self::Thrcoef,
        Self::Lever,
        Self::Swell,
        Self::Inflow,
        Self::LagTwoWay,
        Self::Slew,
        Self::InflowOneSided,
        Self::ThrustExponent,
        Self::DeadBand,
        Self::BatterySag,
        Self::SwellNarrowBand,
        Self::CurrentDrift,
        Self::VelocityAveraging,
        Self::VelocityLag,
        Self::DvlScale,
        Self::Spikes,
        Self::Dropouts,
        Self::StampJitter,
        Self::SlowThrustLog,
        Self::HeadingGaps,
        Self::HeadingDrift,
    ];

    /// Returns the name in files and flags.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tether => "tether",
            Self::Current => "current",
            Self::Lag => "lag",
            Self::Delay => "delay",
            Self::Thrcoef => "thrcoef",
            Self::Lever => "lever",
            Self::Swell => "swell",
            Self::Inflow => "inflow",
            Self::LagTwoWay => "lag-two-way",
            Self::Slew => "slew",
            Self::InflowOneSided => "inflow-one-sided",
            Self::ThrustExponent => "thrust-exponent",
            Self::DeadBand => "dead-band",
            Self::BatterySag => "battery-sag",
            Self::SwellNarrowBand => "swell-narrow-band",
            Self::CurrentDrift => "current-drift",
            Self::VelocityAveraging => "velocity-averaging",
            Self::VelocityLag => "velocity-lag",
            Self::DvlScale => "dvl-scale",
            Self::Spikes => "spikes",
            Self::Dropouts => "dropouts",
            Self::StampJitter => "stamp-jitter",
            Self::SlowThrustLog => "slow-thrust-log",
            Self::HeadingGaps => "heading-gaps",
            Self::HeadingDrift => "heading-drift",
        }
    }

    /// Parses `none`, `all` (tether to lever), or names separated by commas.
    ///
    /// # Errors
    /// [`Error::TwinSpec`] for an unknown name.
    ///
    /// ```
    /// use seaplant::twin::Disturbance;
    /// assert!(Disturbance::parse_list("none")?.is_empty());
    /// assert_eq!(Disturbance::parse_list("all")?.len(), 6);
    /// assert_eq!(Disturbance::parse_list("swell, tether")?.len(), 2);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn parse_list(text: &str) -> Result<BTreeSet<Self>, Error> {
        match text.trim() {
            "none" => Ok(BTreeSet::new()),
            "all" => Ok(Self::ALL[..6].iter().copied().collect()),
            names => names.split(',').map(|name| name.trim().parse()).collect(),
        }
    }
}

impl fmt::Display for Disturbance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Disturbance {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|known| known.name() == text).ok_or_else(|| Error::TwinSpec {
            name: "list of disturbances".to_owned(),
            found: format!("`{text}`"),
            expected: format!("none, all, or some of {}", Self::ALL.map(Self::name).join(", ")),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_and_flags_use_the_same_names() {
        for disturbance in Disturbance::ALL {
            let written = serde_json::to_string(&disturbance).expect("a name");
            assert_eq!(written, format!("\"{disturbance}\""));
            assert_eq!(disturbance.name().parse(), Ok(disturbance));
        }
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_known_ones() {
        let message = "tide".parse::<Disturbance>().expect_err("no such").to_string();
        assert!(message.contains("`tide`") && message.contains("current-drift"), "{message}");
    }
}
