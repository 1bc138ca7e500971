//! Converts quantities of the core to dimensions of logs.

use seaplant::ThrusterInput;
use seaplant::quantity::Kind;
use seaplant_log::Dimension;

pub(crate) const fn dimension_of(kind: Kind) -> Dimension {
    match kind {
        Kind::AngularVelocity => Dimension::AngularVelocity,
        Kind::PulseWidth => Dimension::PulseWidth,
        Kind::Ratio => Dimension::Ratio,
        Kind::Force => Dimension::Force,
        Kind::Moment => Dimension::Moment,
        Kind::Velocity => Dimension::Velocity,
        Kind::Length => Dimension::Length,
        Kind::Angle => Dimension::Angle,
        Kind::Voltage => Dimension::Voltage,
        Kind::Acceleration => Dimension::Acceleration,
    }
}

pub(crate) const fn dimension_of_input(input: ThrusterInput) -> Dimension {
    match input {
        ThrusterInput::Speed => Dimension::AngularVelocity,
        ThrusterInput::Pwm => Dimension::PulseWidth,
        ThrusterInput::Command => Dimension::Ratio,
        ThrusterInput::Force => Dimension::Force,
    }
}
