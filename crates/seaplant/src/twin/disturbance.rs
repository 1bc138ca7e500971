//! What disturbs a twin: the names.

use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::Error;

/// What disturbs the vehicle or misleads its analyst.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Disturbance {
    /// The cable pulls, slowly changing.
    Tether,
    /// The water moves; in yaw it makes a Munk moment.
    Current,
    /// Propellers follow their logged speed with a first-order lag.
    Lag,
    /// Propellers follow their logged speed late.
    Delay,
    /// The analyst takes the forward thrust coefficient for reverse as well.
    Thrcoef,
    /// The analyst has the DVL in the wrong place, and the vehicle rolls and pitches.
    Lever,
    /// Waves push, as one sinusoid.
    Swell,
    /// Thrust falls with the speed of advance, and grows while the propeller backs.
    Inflow,
    /// Propellers speed up with one time constant and slow down with another, in place of `lag`.
    LagTwoWay,
    /// Propellers change their speed at a limited rate.
    Slew,
    /// Thrust falls with the speed of advance, and stays as it is while the propeller backs.
    InflowOneSided,
    /// Thrust grows with another power of propeller speed than the square.
    ThrustExponent,
    /// Thrust falls as the battery empties.
    BatterySag,
    /// Irregular waves push, in a narrow band of periods.
    SwellNarrowBand,
    /// The current changes over minutes.
    CurrentDrift,
    /// The DVL logs the mean velocity of a past interval.
    VelocityAveraging,
    /// The DVL logs velocity behind a first-order lag.
    VelocityLag,
    /// The DVL has a wrong scale.
    DvlScale,
    /// Some samples of the DVL and of heading are far off.
    Spikes,
    /// The DVL loses the bottom now and then.
    Dropouts,
    /// Time stamps are off, each by its own error.
    StampJitter,
    /// Propeller speed is logged less often than it changes.
    SlowThrustLog,
    /// The attitude sensor gives no data now and then.
    HeadingGaps,
    /// Heading drifts.
    HeadingDrift,
}

impl Disturbance {
    /// All of them; the word `all` means the first six.
    pub const ALL: [Self; 24] = [
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

    /// As files and flags write it.
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

    /// Reads `none`, `all` (tether to lever), or names with commas between them.
    ///
    /// # Errors
    /// [`Error::TwinSpec`] for a name that is no disturbance.
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
    fn files_and_flags_write_the_same_names() {
        for disturbance in Disturbance::ALL {
            let written = serde_json::to_string(&disturbance).expect("a name");
            assert_eq!(written, format!("\"{disturbance}\""));
            assert_eq!(disturbance.name().parse(), Ok(disturbance));
        }
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let message = "tide".parse::<Disturbance>().expect_err("no such").to_string();
        assert!(message.contains("`tide`") && message.contains("current-drift"), "{message}");
    }
}
