//! The meaning of a column of a log.

use std::fmt;
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Attitude, Axis, Kind, WindFrame, WindPart, World};
use crate::{Dof, Error, ThrusterInput};

/// A quantity that a trial can hold, independent of its name in the file.
///
/// ```
/// use seaplant::{Quantity, ThrusterInput};
/// let quantity: Quantity = "thruster.fore-aft port.speed".parse()?;
/// assert_eq!(
///     quantity,
///     Quantity::Thruster { name: "fore-aft port".into(), input: ThrusterInput::Speed }
/// );
/// assert_eq!(quantity.to_string(), "thruster.fore-aft port.speed");
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// `thruster.NAME.speed|pwm|command|force`.
    Thruster {
        /// The thruster's name in the vehicle file.
        name: String,
        /// The logged input.
        input: ThrusterInput,
    },
    /// `wrench.DOF`: a body force computed elsewhere.
    Wrench(Dof),
    /// `dvl.velocity.x|y|z`: velocity of the instrument, in its own frame.
    DvlVelocity(Axis),
    /// `velocity.DOF`: velocity of the vehicle origin, body frame.
    Velocity(Dof),
    /// `position.north|east|down`.
    Position(World),
    /// `depth`, positive down.
    Depth,
    /// `attitude.roll|pitch|heading`.
    Attitude(Attitude),
    /// `rate.roll|pitch|yaw`: body angular velocity.
    Rate(Axis),
    /// `acceleration.x|y|z`: specific force of an accelerometer, in its own frame.
    Acceleration(Axis),
    /// `supply.voltage`.
    SupplyVoltage,
    /// `rudder.NAME.angle`, `fin.NAME.angle`: positive by the right-hand rule about its axis.
    SurfaceAngle {
        /// The type of surface.
        kind: Surface,
        /// The surface's name in the vehicle file.
        name: String,
    },
    /// `thruster.NAME.azimuth`: angle of rotation about its axis.
    Azimuth(String),
    /// `wind.relative.speed|direction`, apparent wind on board, or `wind.true.speed|direction`.
    ///
    /// Direction is where the wind comes from: clockwise from the bow if it is relative, from
    /// north if it is true.
    Wind(WindFrame, WindPart),
    /// `position.latitude`.
    Latitude,
    /// `position.longitude`.
    Longitude,
    /// `velocity.north|east|down`, over ground.
    WorldVelocity(World),
    /// `ground.speed`.
    GroundSpeed,
    /// `ground.course`, clockwise from north.
    GroundCourse,
}

/// A control surface.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Surface {
    /// A rudder.
    Rudder,
    /// Any other fin.
    Fin,
}

impl Surface {
    /// Returns the name in channels and vehicle files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rudder => "rudder",
            Self::Fin => "fin",
        }
    }
}

const INPUTS: [ThrusterInput; 4] =
    [ThrusterInput::Speed, ThrusterInput::Pwm, ThrusterInput::Command, ThrusterInput::Force];

impl Quantity {
    /// Returns whether the quantity is an input of the vehicle rather than its motion.
    pub fn is_of_thrust(&self) -> bool {
        matches!(
            self,
            Self::Thruster { .. }
                | Self::Wrench(_)
                | Self::SupplyVoltage
                | Self::SurfaceAngle { .. }
                | Self::Azimuth(_)
        )
    }

    /// Returns every quantity but those of thrusters, rudders and fins, which have names.
    pub fn all_but_named() -> Vec<Self> {
        use {Attitude as A, Axis as X, World as W};
        let mut all = vec![Self::Depth, Self::SupplyVoltage];
        all.extend(Dof::ALL.map(Self::Wrench));
        all.extend(Dof::ALL.map(Self::Velocity));
        all.extend([X::X, X::Y, X::Z].map(Self::DvlVelocity));
        all.extend([X::X, X::Y, X::Z].map(Self::Rate));
        all.extend([X::X, X::Y, X::Z].map(Self::Acceleration));
        all.extend([W::North, W::East, W::Down].map(Self::Position));
        all.extend([A::Roll, A::Pitch, A::Heading].map(Self::Attitude));
        all.extend([W::North, W::East, W::Down].map(Self::WorldVelocity));
        all.extend([Self::Latitude, Self::Longitude, Self::GroundSpeed, Self::GroundCourse]);
        for frame in [WindFrame::Relative, WindFrame::True] {
            all.extend([WindPart::Speed, WindPart::Direction].map(|part| Self::Wind(frame, part)));
        }
        all
    }

    /// Returns the dimension of the quantity.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Thruster { input: ThrusterInput::Speed, .. } | Self::Rate(_) => {
                Kind::AngularVelocity
            }
            Self::Thruster { input: ThrusterInput::Pwm, .. } => Kind::PulseWidth,
            Self::Thruster { input: ThrusterInput::Command, .. } => Kind::Ratio,
            Self::Thruster { input: ThrusterInput::Force, .. } => Kind::Force,
            Self::Wrench(dof) if dof.is_rotation() => Kind::Moment,
            Self::Wrench(_) => Kind::Force,
            Self::Velocity(dof) if dof.is_rotation() => Kind::AngularVelocity,
            Self::Velocity(_) | Self::DvlVelocity(_) | Self::WorldVelocity(_) => Kind::Velocity,
            Self::GroundSpeed | Self::Wind(_, WindPart::Speed) => Kind::Velocity,
            Self::Position(_) | Self::Depth => Kind::Length,
            Self::Attitude(_) | Self::SurfaceAngle { .. } | Self::Azimuth(_) => Kind::Angle,
            Self::Latitude | Self::Longitude | Self::GroundCourse => Kind::Angle,
            Self::Wind(_, WindPart::Direction) => Kind::Angle,
            Self::SupplyVoltage => Kind::Voltage,
            Self::Acceleration(_) => Kind::Acceleration,
        }
    }

    /// Parses a quantity of a thruster, rudder or fin.
    fn parse_named(text: &str) -> Option<Self> {
        let (kind, rest) = text.split_once('.')?;
        let (name, what) = rest.rsplit_once('.').filter(|(name, _)| !name.is_empty())?;
        let name = name.to_owned();
        match (kind, what) {
            ("thruster", "azimuth") => Some(Self::Azimuth(name)),
            ("thruster", input) => {
                let input = INPUTS.into_iter().find(|known| known.name() == input)?;
                Some(Self::Thruster { name, input })
            }
            ("rudder", "angle") => Some(Self::SurfaceAngle { kind: Surface::Rudder, name }),
            ("fin", "angle") => Some(Self::SurfaceAngle { kind: Surface::Fin, name }),
            _ => None,
        }
    }

    /// Returns advice for a wind channel without a frame.
    fn frameless(text: &str) -> Option<String> {
        let part = text.strip_prefix("wind.")?;
        ["speed", "direction"].contains(&part).then(|| {
            format!("say whether it is felt on board, wind.relative.{part}, or over ground, wind.true.{part}")
        })
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Thruster { name, input } => write!(f, "thruster.{name}.{}", input.name()),
            Self::Wrench(dof) => write!(f, "wrench.{dof}"),
            Self::DvlVelocity(axis) => {
                write!(f, "dvl.velocity.{}", pick(*axis, ["x", "y", "z"]))
            }
            Self::Velocity(dof) => write!(f, "velocity.{dof}"),
            Self::Position(World::North) => write!(f, "position.north"),
            Self::Position(World::East) => write!(f, "position.east"),
            Self::Position(World::Down) => write!(f, "position.down"),
            Self::Depth => write!(f, "depth"),
            Self::Attitude(Attitude::Roll) => write!(f, "attitude.roll"),
            Self::Attitude(Attitude::Pitch) => write!(f, "attitude.pitch"),
            Self::Attitude(Attitude::Heading) => write!(f, "attitude.heading"),
            Self::Rate(axis) => write!(f, "rate.{}", pick(*axis, ["roll", "pitch", "yaw"])),
            Self::Acceleration(axis) => write!(f, "acceleration.{}", pick(*axis, ["x", "y", "z"])),
            Self::SupplyVoltage => write!(f, "supply.voltage"),
            Self::SurfaceAngle { kind, name } => write!(f, "{}.{name}.angle", kind.name()),
            Self::Azimuth(name) => write!(f, "thruster.{name}.azimuth"),
            Self::Wind(frame, part) => {
                let frame = if *frame == WindFrame::True { "true" } else { "relative" };
                let part = if *part == WindPart::Speed { "speed" } else { "direction" };
                write!(f, "wind.{frame}.{part}")
            }
            Self::Latitude => write!(f, "position.latitude"),
            Self::Longitude => write!(f, "position.longitude"),
            Self::WorldVelocity(World::North) => write!(f, "velocity.north"),
            Self::WorldVelocity(World::East) => write!(f, "velocity.east"),
            Self::WorldVelocity(World::Down) => write!(f, "velocity.down"),
            Self::GroundSpeed => write!(f, "ground.speed"),
            Self::GroundCourse => write!(f, "ground.course"),
        }
    }
}

fn pick(axis: Axis, names: [&'static str; 3]) -> &'static str {
    names[axis as usize]
}

impl FromStr for Quantity {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        if let Some(named) = Self::parse_named(text) {
            return Ok(named);
        }
        Self::all_but_named().into_iter().find(|known| known.to_string() == text).ok_or_else(
            || {
                let all: Vec<String> =
                    Self::all_but_named().iter().map(Self::to_string).collect();
                let advice = Self::frameless(text).unwrap_or_else(|| {
                    format!(
                        "it may be thruster.NAME.speed, .pwm, .command, .force or .azimuth, rudder.NAME.angle, fin.NAME.angle, or one of {}",
                        all.join(", ")
                    )
                });
                Error::UnknownQuantity { found: text.to_owned(), advice }
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quantity_reads_back_what_it_writes() {
        for quantity in Quantity::all_but_named() {
            assert_eq!(quantity.to_string().parse::<Quantity>().as_ref(), Ok(&quantity));
        }
    }

    #[test]
    fn a_thruster_may_have_dots_in_its_name() {
        let parsed: Quantity = "thruster.a.b.pwm".parse().expect("a thruster");
        assert_eq!(parsed, Quantity::Thruster { name: "a.b".into(), input: ThrusterInput::Pwm });
    }

    #[test]
    fn rudders_and_azimuths_have_names() {
        for text in ["rudder.port.angle", "fin.upper stern.angle", "thruster.pod 1.azimuth"] {
            assert_eq!(text.parse::<Quantity>().expect("named").to_string(), text);
        }
        assert!("rudder..angle".parse::<Quantity>().is_err());
        let message = "wind.speed".parse::<Quantity>().expect_err("which frame?").to_string();
        assert!(message.contains("wind.relative.speed"), "{message}");
    }

    #[test]
    fn refuses_an_unknown_quantity_with_what_there_is() {
        let message = "dvl.speed".parse::<Quantity>().expect_err("unknown").to_string();
        assert!(message.contains("dvl.velocity.x"), "{message}");
    }
}
