//! The quantities to which the columns of a log are mapped.

pub(crate) mod channel;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The frame of a wind measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum WindFrame {
    /// Relative to the moving vehicle.
    Relative,
    /// Relative to the ground.
    True,
}

/// A component of wind: its speed, or the direction from which it comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the sentence above says it")]
pub enum WindPart {
    Speed,
    Direction,
}

/// An axis of an instrument or of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "x, y and z are what they are")]
pub enum Axis {
    X,
    Y,
    Z,
}

/// A world-fixed direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the compass says it")]
pub enum World {
    North,
    East,
    Down,
}

/// An attitude angle: yaw, then pitch, then roll rotate the world's axes to the body's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the sentence above says it")]
pub enum Attitude {
    Roll,
    Pitch,
    Heading,
}

/// The dimension of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "each is a kind of unit by name")]
pub enum Kind {
    AngularVelocity,
    PulseWidth,
    Ratio,
    Force,
    Moment,
    Velocity,
    Length,
    Angle,
    Voltage,
    Acceleration,
}

impl Kind {
    /// Returns the unit in which Seaplant stores such a quantity.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::AngularVelocity => "rad/s",
            Self::PulseWidth => "us",
            Self::Ratio => "1",
            Self::Force => "N",
            Self::Moment => "N m",
            Self::Velocity => "m/s",
            Self::Length => "m",
            Self::Angle => "rad",
            Self::Voltage => "V",
            Self::Acceleration => "m/s^2",
        }
    }
}

/// What a thruster curve reads.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum ThrusterInput {
    /// Propeller speed, rad/s.
    Speed,
    /// Pulse width, µs.
    Pwm,
    /// Command, −1 to 1.
    Command,
    /// Force itself, N.
    Force,
}

impl ThrusterInput {
    /// Returns the name in channels and curves.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Speed => "speed",
            Self::Pwm => "pwm",
            Self::Command => "command",
            Self::Force => "force",
        }
    }

    /// Returns the unit in which Seaplant stores this input.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Speed => "rad/s",
            Self::Pwm => "us",
            Self::Command => "1",
            Self::Force => "N",
        }
    }
}
