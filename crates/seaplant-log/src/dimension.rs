//! Physical quantities that units measure.

use std::fmt;

/// Physical quantity of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Dimension {
    /// Time, s.
    Time,
    /// Length, m.
    Length,
    /// Velocity, m/s.
    Velocity,
    /// Acceleration, m/s².
    Acceleration,
    /// Angle, rad.
    Angle,
    /// Angular velocity, rad/s; the speed of a propeller too.
    AngularVelocity,
    /// Angular acceleration, rad/s².
    AngularAcceleration,
    /// Force, N.
    Force,
    /// Moment, N m.
    Moment,
    /// Mass, kg.
    Mass,
    /// Pulse width of a servo or speed-controller command: **µs, not s**, the one exception to SI.
    PulseWidth,
    /// Voltage, V.
    Voltage,
    /// Current, A.
    Current,
    /// Power, W.
    Power,
    /// Pressure, Pa.
    Pressure,
    /// A ratio, such as a command from −1 to 1.
    Ratio,
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Time => "time",
            Self::Length => "length",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::Angle => "angle",
            Self::AngularVelocity => "angular velocity",
            Self::AngularAcceleration => "angular acceleration",
            Self::Force => "force",
            Self::Moment => "moment",
            Self::Mass => "mass",
            Self::PulseWidth => "pulse width",
            Self::Voltage => "voltage",
            Self::Current => "current",
            Self::Power => "power",
            Self::Pressure => "pressure",
            Self::Ratio => "ratio",
        })
    }
}
