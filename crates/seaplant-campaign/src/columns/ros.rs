//! Recognises channels of ROS messages: their fields and the frames of REP 103 are more informative
//! than names.

use seaplant::quantity::{Attitude, Axis, World};
use seaplant::{Dof, Quantity};
use seaplant_log::{Channel, Dimension, Log};

use super::claim::{ACCELERATION, COMMANDED, Claim, LAYOUT, QUATERNION, WORLD_VELOCITY};
use super::ros_field::Field;
use super::ros_thruster;
use crate::words::COMMAND;

const BY_REP_103: &str = "by its message and REP 103";
const NORTH_IS_X: &str = "by its message and REP 103, with north for the x of its frame";
const PRESSURE: &str =
    "a pressure; log the depth in metres, or work it out and log it in a table beside";
const NOTHING: &str = "its message and field are not recognised as a quantity";
const SMOOTHED: &str = "of a filter, which smooths and lags; the DVL's own velocity is mapped";
const THROTTLE: &str = "of all thrusters together";
const PILOT: &str = "of the pilot, not of a thruster";

const WHOSE: &str = "is it the vehicle's, in its own axes? if a DVL's, write dvl.velocity; if along the world's axes, leave it out";
const TURNED: &str = "y to port and z up, as REP 103 has it? without negate if the driver has y to starboard and z down";
const AS_BUILT: &str = "are the instrument's axes y to starboard and z down? set negate = true if y is to port and z up";
const ON_VEHICLE: &str = "is it the force on the vehicle, in its axes, at its origin?";
const LEVEL: &str = "is it a place in a level frame with z up?";

/// Returns the quantity of a channel of a ROS bag; `None` for other channels, and where its name
/// must decide.
pub(super) fn claim(log: &Log, channel: &Channel) -> Option<Result<Claim, String>> {
    let format = &log.sources()[channel.source].format;
    if !["MCAP", "ROS 1 bag", "ROS 2 bag"].iter().any(|known| format.starts_with(known)) {
        return None;
    }
    let field = Field::parse(&channel.column)?;
    if field.topic.ends_with("/rc/in") || field.topic.ends_with("/rc/override") {
        return Some(Err(PILOT.to_owned()));
    }
    if let Some(found) = ros_thruster::claim(log, channel, &field) {
        return Some(found);
    }
    let found = of_message(log, channel, &field)?;
    // A force is often a command.
    let is_force = found.as_ref().is_ok_and(|claim| matches!(claim.quantity, Quantity::Wrench(_)));
    let commanded = field.has_any(COMMAND) && !is_force;
    Some(if commanded { Err(COMMANDED.to_owned()) } else { found })
}

/// Returns the quantity of a field by its message; `None` where its name must decide.
fn of_message(log: &Log, channel: &Channel, field: &Field<'_>) -> Option<Result<Claim, String>> {
    let last = field.path.rsplit('.').next().unwrap_or_default();
    Some(match last {
        "x" | "y" | "z" | "w" if is_quaternion(log, channel) => Err(QUATERNION.to_owned()),
        "roll" | "pitch" | "yaw" if is_quaternion(log, channel) => attitude(field, last),
        "x" | "y" | "z" => vector(log, channel, field, axis(last)),
        "throttle" => Err(THROTTLE.to_owned()),
        _ if field.path.starts_with("layout.") => Err(LAYOUT.to_owned()),
        "fluid_pressure" => Err(PRESSURE.to_owned()),
        "data" if field.topic.ends_with("/rel_alt") => Ok(Claim {
            unit: Some("m"),
            negate: true,
            ..claim_of(Quantity::Depth, 3, "by its topic, a height above where it started")
        }),
        "data" if field.topic.ends_with("/compass_hdg") => Ok(Claim {
            unit: Some("deg"),
            ..claim_of(Quantity::Attitude(Attitude::Heading), 2, "by its topic")
        }),
        // Single letters are not informative in an unknown message.
        _ if last.split('[').next().is_some_and(|name| name.len() < 2) => Err(NOTHING.to_owned()),
        _ => return None,
    })
}

fn axis(letter: &str) -> Axis {
    match letter {
        "x" => Axis::X,
        "y" => Axis::Y,
        _ => Axis::Z,
    }
}

/// Returns whether a number, or an angle, belongs to a quaternion: it has a `w` next to it.
fn is_quaternion(log: &Log, channel: &Channel) -> bool {
    let Some((of, _)) = channel.column.rsplit_once('.') else { return false };
    let beside = |other: &Channel| {
        let w = other.column.strip_prefix(of);
        other.source == channel.source && w == Some(".w")
    };
    log.channels().iter().any(beside)
}

/// Creates a claim without questions.
fn claim_of(quantity: Quantity, strength: u8, why: &str) -> Claim {
    Claim { quantity, strength, unit: None, negate: false, why: why.to_owned(), doubt: None }
}

/// Returns the angle: roll about x is the same in both frames; pitch and yaw are reversed.
fn attitude(field: &Field<'_>, angle: &str) -> Result<Claim, String> {
    let quantity = match angle {
        "roll" => Attitude::Roll,
        "pitch" => Attitude::Pitch,
        _ => Attitude::Heading,
    };
    // In odometry, it is in the frame of the positions that it must rotate.
    let strength = if field.path.starts_with("pose.pose.") { 7 } else { 5 };
    let strength = strength - u8::from(field.has("raw"));
    let why = if quantity == Attitude::Heading {
        "by its message and REP 103, from the x of its frame"
    } else {
        BY_REP_103
    };
    let negate = quantity != Attitude::Roll;
    Ok(Claim { negate, ..claim_of(Quantity::Attitude(quantity), strength, why) })
}

/// Returns the quantity of a vector's component; y and z are opposite to ours.
fn vector(log: &Log, channel: &Channel, field: &Field<'_>, axis: Axis) -> Result<Claim, String> {
    let negate = axis != Axis::X;
    let letter = field.path.rsplit('.').next().unwrap_or_default();
    let ends = |of: &str| field.ends(&format!("{of}.{letter}"));
    let dimension = channel.unit.as_ref().map(|unit| unit.dimension());
    let found = match dimension {
        Some(Dimension::AngularVelocity) if ends("angular_velocity") => {
            claim_of(Quantity::Rate(axis), 6 - u8::from(field.has("raw")), BY_REP_103)
        }
        Some(Dimension::AngularVelocity) if is_of_world(field) => {
            return Err(WORLD_VELOCITY.to_owned());
        }
        Some(Dimension::AngularVelocity) => claim_of(Quantity::Rate(axis), 4, BY_REP_103),
        Some(Dimension::Acceleration) if ends("linear_acceleration") => {
            claim_of(Quantity::Acceleration(axis), 6 - u8::from(field.has("raw")), BY_REP_103)
        }
        Some(Dimension::Acceleration) => return Err(ACCELERATION.to_owned()),
        Some(Dimension::Velocity) => return velocity(log, field, axis),
        Some(Dimension::Length) => return position(channel, field, axis),
        Some(Dimension::Force) if ends("force") => {
            let doubt = Some(ON_VEHICLE.to_owned());
            Claim { doubt, ..claim_of(Quantity::Wrench(along(axis)), 3, BY_REP_103) }
        }
        Some(Dimension::Moment) if ends("torque") => {
            let doubt = Some(ON_VEHICLE.to_owned());
            Claim { doubt, ..claim_of(Quantity::Wrench(about(axis)), 3, BY_REP_103) }
        }
        _ => return Err(NOTHING.to_owned()),
    };
    Ok(Claim { negate, ..found })
}

/// Returns whether a message holds pose and velocity, which implies that the velocity is the
/// vehicle's.
fn is_odometry(field: &Field<'_>) -> bool {
    field.path.starts_with("twist.twist.")
}

/// Returns whether a velocity is along world axes, as the topics of mavros state.
fn is_of_world(field: &Field<'_>) -> bool {
    let world = ["local", "world", "global", "enu", "ned", "map"];
    !is_odometry(field) && !field.has("body") && field.has_any(&world)
}

fn is_of_dvl(field: &Field<'_>) -> bool {
    field.has_any(&["dvl", "bottom"])
}

fn velocity(log: &Log, field: &Field<'_>, axis: Axis) -> Result<Claim, String> {
    let turned = axis != Axis::X;
    let built = || field.path.rsplit_once('.').is_some_and(|(of, _)| of == "velocity");
    if is_of_dvl(field) && !is_odometry(field) {
        let quantity = Quantity::DvlVelocity(axis);
        let (negate, doubt) = if built() { (false, AS_BUILT) } else { (turned, TURNED) };
        let doubt = turned.then(|| doubt.to_owned());
        return Ok(Claim { negate, doubt, ..claim_of(quantity, 6, "by its message") });
    }
    if is_of_world(field) {
        return Err(WORLD_VELOCITY.to_owned());
    }
    if has_dvl(log) {
        return Err(SMOOTHED.to_owned());
    }
    let doubt = (!is_odometry(field) && !field.has("body")).then(|| WHOSE.to_owned());
    let strength = if is_odometry(field) { 6 } else { 4 };
    let quantity = Quantity::Velocity(along(axis));
    Ok(Claim { negate: turned, doubt, ..claim_of(quantity, strength, BY_REP_103) })
}

/// Returns whether a DVL's velocity is present.
fn has_dvl(log: &Log) -> bool {
    log.channels().iter().any(|channel| {
        let velocity = channel.unit.as_ref().map(|unit| unit.dimension());
        let field = Field::parse(&channel.column).filter(|_| velocity == Some(Dimension::Velocity));
        let moves = field.filter(|field| field.path.ends_with(".x") && !is_odometry(field));
        moves.is_some_and(|field| is_of_dvl(&field)) && !channel.is_constant()
    })
}

/// Maps north, east and down to x, −y and −z, which turn with −yaw as the vehicle does.
fn position(channel: &Channel, field: &Field<'_>, axis: Axis) -> Result<Claim, String> {
    let of_depth = field.has_any(&["depth", "pressure"]);
    if of_depth && axis == Axis::Z {
        return Ok(depth(channel));
    }
    if of_depth {
        return Err(NOTHING.to_owned());
    }
    let quantity = Quantity::Position(match axis {
        Axis::X => World::North,
        Axis::Y => World::East,
        Axis::Z => World::Down,
    });
    let odometry = field.path.starts_with("pose.pose.position.");
    let doubt = (!field.ends(&format!("position.{}", letter(axis)))).then(|| LEVEL.to_owned());
    let strength = if odometry { 7 } else { 5 };
    let negate = axis != Axis::X;
    Ok(Claim { negate, doubt, ..claim_of(quantity, strength, NORTH_IS_X) })
}

const fn letter(axis: Axis) -> &'static str {
    match axis {
        Axis::X => "x",
        Axis::Y => "y",
        Axis::Z => "z",
    }
}

/// Returns a depth by its topic, with the sign by its values.
fn depth(channel: &Channel) -> Claim {
    let (min, max) = (channel.min().unwrap_or(0.0), channel.max().unwrap_or(0.0));
    let negate = -min > max;
    let why = if negate {
        "by its topic, a height by its sign"
    } else {
        "by its topic, positive down by its sign"
    };
    Claim { negate, ..claim_of(Quantity::Depth, 5, why) }
}

const fn along(axis: Axis) -> Dof {
    match axis {
        Axis::X => Dof::Surge,
        Axis::Y => Dof::Sway,
        Axis::Z => Dof::Heave,
    }
}

const fn about(axis: Axis) -> Dof {
    match axis {
        Axis::X => Dof::Roll,
        Axis::Y => Dof::Pitch,
        Axis::Z => Dof::Yaw,
    }
}
