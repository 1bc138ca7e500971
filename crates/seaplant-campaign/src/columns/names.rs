//! Recognises the quantity of a column by its name, unit and values.

use seaplant::quantity::{Attitude, Axis, World};
use seaplant::{Dof, Quantity, ThrusterInput};
use seaplant_log::{Channel, Dimension, Unit};

use super::afloat;
use super::claim::{ACCELERATION, COMMANDED, Claim, LAYOUT, NO_AXIS, NO_UNIT, WORLD_VELOCITY};
use crate::remarks::looks_like_degrees;
use crate::units::dimension_of;
use crate::words::{
    COMMAND, HEADING, PITCH, ROLL, counts_turns, is_named_thruster, tells_of_thruster,
    unit_by_name, words,
};

/// Words that imply a quantity: one of each group must be in the name.
struct Rule {
    groups: &'static [&'static [&'static str]],
    quantity: Quantity,
    strength: u8,
    /// True if the header must state a unit, because the words are too common.
    needs_unit: bool,
    doubt: Option<&'static str>,
}

const fn rule(
    groups: &'static [&'static [&'static str]],
    quantity: Quantity,
    strength: u8,
) -> Rule {
    Rule { groups, quantity, strength, needs_unit: false, doubt: None }
}

const fn by_unit(groups: &'static [&'static [&'static str]], quantity: Quantity) -> Rule {
    Rule { groups, quantity, strength: 1, needs_unit: true, doubt: None }
}

const fn doubtful(
    groups: &'static [&'static [&'static str]],
    quantity: Quantity,
    doubt: &'static str,
) -> Rule {
    Rule { groups, quantity, strength: 1, needs_unit: false, doubt: Some(doubt) }
}

const TURNING: &[&str] = &[
    "rate", "velo", "vel", "velocity", "angvelo", "angvel", "omega", "gyro", "gyr", "dot",
    "angular",
];
const MOVING: &[&str] = &["velo", "vel", "velocity", "speed"];
const DVL: &[&str] = &["dvl", "bt", "bottom"];
const FORCE: &[&str] = &["tau", "wrench", "force", "moment", "torque"];

const FRAME: &str = "is it of the instrument, in its axes? if it is of the vehicle, write velocity.DOF; if north, east and down, leave it out";
const AHEAD: &str = "a speed is surge only while the vehicle goes straight ahead, and has no sign";
const NORTH: &str = "is x north and y east? both must be metres in one level frame";

#[rustfmt::skip]
static RULES: &[Rule] = &[
    rule(&[&["gx", "wx", "rollrate"]], Quantity::Rate(Axis::X), 3),
    rule(&[&["gy", "wy", "pitchrate"]], Quantity::Rate(Axis::Y), 3),
    rule(&[&["gz", "wz", "yawrate"]], Quantity::Rate(Axis::Z), 3),
    rule(&[&["roll", "phi", "x", "p"], TURNING], Quantity::Rate(Axis::X), 3),
    rule(&[&["pitch", "theta", "y", "q"], TURNING], Quantity::Rate(Axis::Y), 3),
    rule(&[&["yaw", "psi", "heading", "hdg", "turn", "z", "r"], TURNING], Quantity::Rate(Axis::Z), 3),
    rule(&[&["p"]], Quantity::Rate(Axis::X), 2),
    rule(&[&["q"]], Quantity::Rate(Axis::Y), 2),
    rule(&[&["r"]], Quantity::Rate(Axis::Z), 2),
    by_unit(&[ROLL], Quantity::Rate(Axis::X)),
    by_unit(&[PITCH], Quantity::Rate(Axis::Y)),
    by_unit(&[HEADING], Quantity::Rate(Axis::Z)),

    rule(&[DVL, &["x", "vx", "u", "surge", "forward", "fwd"]], Quantity::DvlVelocity(Axis::X), 4),
    rule(&[DVL, &["y", "vy", "v", "sway", "starboard", "stbd"]], Quantity::DvlVelocity(Axis::Y), 4),
    rule(&[DVL, &["z", "vz", "w", "heave", "down"]], Quantity::DvlVelocity(Axis::Z), 4),
    doubtful(&[&["vx"]], Quantity::DvlVelocity(Axis::X), FRAME),
    doubtful(&[&["vy"]], Quantity::DvlVelocity(Axis::Y), FRAME),
    doubtful(&[&["vz"]], Quantity::DvlVelocity(Axis::Z), FRAME),
    doubtful(&[MOVING, &["x"]], Quantity::DvlVelocity(Axis::X), FRAME),
    doubtful(&[MOVING, &["y"]], Quantity::DvlVelocity(Axis::Y), FRAME),
    doubtful(&[MOVING, &["z"]], Quantity::DvlVelocity(Axis::Z), FRAME),
    rule(&[&["surge"]], Quantity::Velocity(Dof::Surge), 3),
    rule(&[&["sway"]], Quantity::Velocity(Dof::Sway), 3),
    rule(&[&["heave"]], Quantity::Velocity(Dof::Heave), 3),
    rule(&[&["u", "um"]], Quantity::Velocity(Dof::Surge), 2),
    rule(&[&["v", "vm"]], Quantity::Velocity(Dof::Sway), 2),
    rule(&[&["w", "wm"]], Quantity::Velocity(Dof::Heave), 2),
    doubtful(&[&["speed", "sog", "stw"]], Quantity::Velocity(Dof::Surge), AHEAD),

    rule(&[&["depth"]], Quantity::Depth, 3),
    rule(&[&["z"]], Quantity::Depth, 1),
    rule(&[&["down"]], Quantity::Position(World::Down), 2),
    rule(&[&["north", "northing"]], Quantity::Position(World::North), 3),
    rule(&[&["east", "easting"]], Quantity::Position(World::East), 3),
    doubtful(&[&["x"]], Quantity::Position(World::North), NORTH),
    doubtful(&[&["y"]], Quantity::Position(World::East), NORTH),

    rule(&[ROLL], Quantity::Attitude(Attitude::Roll), 2),
    rule(&[PITCH], Quantity::Attitude(Attitude::Pitch), 2),
    rule(&[HEADING], Quantity::Attitude(Attitude::Heading), 2),

    rule(&[&["voltage", "volt", "volts", "batt", "battery", "vbat", "vbatt", "supply"]], Quantity::SupplyVoltage, 2),

    rule(&[FORCE, &["x", "u", "surge"]], Quantity::Wrench(Dof::Surge), 3),
    rule(&[FORCE, &["y", "v", "sway"]], Quantity::Wrench(Dof::Sway), 3),
    rule(&[FORCE, &["z", "w", "heave"]], Quantity::Wrench(Dof::Heave), 3),
    rule(&[FORCE, &["k", "p", "roll", "x"]], Quantity::Wrench(Dof::Roll), 2),
    rule(&[FORCE, &["m", "q", "pitch", "y"]], Quantity::Wrench(Dof::Pitch), 2),
    rule(&[FORCE, &["n", "r", "yaw", "z"]], Quantity::Wrench(Dof::Yaw), 2),
    by_unit(&[&["x", "fx"]], Quantity::Wrench(Dof::Surge)),
    by_unit(&[&["y", "fy"]], Quantity::Wrench(Dof::Sway)),
    by_unit(&[&["z", "fz"]], Quantity::Wrench(Dof::Heave)),
    by_unit(&[&["k", "mx"]], Quantity::Wrench(Dof::Roll)),
    by_unit(&[&["m", "my"]], Quantity::Wrench(Dof::Pitch)),
    by_unit(&[&["n", "mz"]], Quantity::Wrench(Dof::Yaw)),
];

/// Words of quantities that Seaplant does not use, with the reasons.
const FOREIGN: &[(&[&str], &str)] = &[
    (&["aileron"], "of an aircraft's control surface"),
    (&["sound"], "the speed of sound"),
    (&["acc", "accel", "acceleration"], ACCELERATION),
    (
        &["error", "err", "std", "stddev", "sigma", "var", "variance", "cov", "covariance"],
        "an error, not a measurement",
    ),
    (&["temp", "temperature"], "a temperature"),
    (&["mag", "magnetometer"], "of a magnetometer"),
    (
        &["altitude", "alt", "height"],
        "a height above the bottom, not a depth; if it is above the surface, map depth with negate = true",
    ),
    (
        &["beam", "beam1", "beam2", "beam3", "beam4"],
        "of one beam of the instrument; map its velocity along x, y and z",
    ),
    (&["layout"], LAYOUT),
    (&["light", "lights", "camera", "tilt", "pan", "gripper", "winch"], "of an accessory"),
    (
        &["quality", "status", "valid", "flag", "mode", "count", "counter", "index"],
        "a state, not a measurement",
    ),
];
const LONE_QUATERNION: &str = "of a quaternion, whose angles are read where its columns end in x, y, z and w, with a norm of 1";
const OF_THRUSTER: &str = "of a thruster, it seems; if it is its input, map it as thruster.NAME.speed, .pwm, .command or .force, with its unit";
/// Words of velocities that are not in body axes.
const WORLD: &[&str] = &["ned", "enu", "world", "global", "north", "east", "local", "vn", "ve"];

/// Returns the quantity that a column claims to hold, or why it holds none.
///
/// `context` is the name of its file: in `dvl.csv`, `velocity x` is a DVL's.
pub(super) fn claim(channel: &Channel, context: &str) -> Result<Claim, String> {
    let own = words(&channel.name);
    if is_of_quaternion(&own) {
        return Err(LONE_QUATERNION.to_owned());
    }
    let has = |word: &str| own.iter().any(|own| own == word);
    if let Some(claim) = felt(channel, &own) {
        return Ok(claim);
    }
    if let Some((_, why)) = FOREIGN.iter().find(|(words, _)| words.iter().any(|word| has(word))) {
        return Err((*why).to_owned());
    }
    let named = unit_by_name(&channel.name);
    let mut all = own.clone();
    // A unit is not a word about the quantity: `x_m` is no moment.
    if channel.unit.is_none() && named.is_some() {
        let unit_words = if named.is_some_and(|unit| unit.contains('/')) { 2 } else { 1 };
        let spelt_apart = own.last().is_some_and(|last| last == "s");
        all.truncate(own.len() - if spelt_apart { unit_words } else { 1 });
    }
    let context = words(context);
    all.extend(context.into_iter().filter(|word| ["dvl", "pwm"].contains(&word.as_str())));
    let stated = channel.unit.clone().or_else(|| Unit::parse(named?).ok());
    if let Some(found) = thruster(channel, &own, stated.as_ref()) {
        return Ok(Claim {
            unit: found.unit.or(named.filter(|_| channel.unit.is_none())),
            ..found
        });
    }
    if let Some(found) = afloat::claim(channel, &own, stated.as_ref()) {
        return Ok(Claim {
            unit: found.unit.or(named.filter(|_| channel.unit.is_none())),
            ..found
        });
    }
    if own.iter().any(|word| COMMAND.contains(&word.as_str())) {
        return Err(COMMANDED.to_owned());
    }
    let moves = stated.as_ref().is_some_and(|unit| unit.dimension() == Dimension::Velocity);
    if moves && own.iter().any(|word| WORLD.contains(&word.as_str())) {
        return Err(WORLD_VELOCITY.to_owned());
    }
    if let Some(claim) = bare_force(channel, &all, (stated.as_ref(), named)) {
        return Ok(claim);
    }
    let rule = best_rule(&all, stated.as_ref());
    let rule = rule.ok_or_else(|| unknown(stated.as_ref()))?;
    let is_force = matches!(rule.quantity, Quantity::Wrench(_) | Quantity::SupplyVoltage);
    if is_named_thruster(&own) && !is_force {
        return Err(OF_THRUSTER.to_owned());
    }
    Ok(of_rule(channel, rule, named))
}

/// Returns the specific force along one of an accelerometer's axes, by its name.
fn felt(channel: &Channel, own: &[String]) -> Option<Claim> {
    let has = |words: &[&str]| own.iter().any(|word| words.contains(&word.as_str()));
    let axes = [(Axis::X, ["x", "ax"]), (Axis::Y, ["y", "ay"]), (Axis::Z, ["z", "az"])];
    let of_axis = |(axis, words): &(Axis, [&str; 2])| has(words).then_some(*axis);
    let axis = axes.iter().find_map(of_axis)?;
    let named = unit_by_name(&channel.name);
    let stated = channel.unit.clone().or_else(|| Unit::parse(named?).ok());
    let fits = stated.as_ref().is_none_or(|unit| unit.resolve(Dimension::Acceleration).is_ok());
    if !has(&["acc", "accel", "acceleration", "accelerometer"]) || !fits {
        return None;
    }
    let unit = named.filter(|_| channel.unit.is_none());
    let missing = channel.unit.is_none() && unit.is_none();
    Some(Claim {
        quantity: Quantity::Acceleration(axis),
        strength: 3,
        unit,
        negate: false,
        why: why(channel, unit).to_owned(),
        doubt: missing.then(|| "no unit is stated; add unit = \"m/s2\" or \"g\"".to_owned()),
    })
}

/// Returns the force of a column that is called nothing but that, as `tau` in N: surge's, or a moment yaw's, until it is
/// known what else is logged.
fn bare_force(
    channel: &Channel,
    words: &[String],
    (stated, named): (Option<&Unit>, Option<&'static str>),
) -> Option<Claim> {
    let is_bare = words.iter().all(|word| FORCE.contains(&word.as_str()));
    let dof = match stated?.dimension() {
        Dimension::Force => Dof::Surge,
        Dimension::Moment => Dof::Yaw,
        _ => return None,
    };
    let unit = named.filter(|_| channel.unit.is_none());
    (is_bare && !words.is_empty()).then(|| Claim {
        quantity: Quantity::Wrench(dof),
        strength: 0,
        unit,
        negate: false,
        why: why(channel, unit).to_owned(),
        doubt: Some(NO_AXIS.to_owned()),
    })
}

/// Returns whether a name is that of a component of a quaternion.
fn is_of_quaternion(own: &[String]) -> bool {
    let has = |known: &[&str]| own.iter().any(|word| known.contains(&word.as_str()));
    has(&["qw", "qx", "qy", "qz"])
        || has(&["quaternion", "quat", "orientation"]) && has(&["x", "y", "z", "w"])
}

fn unknown(unit: Option<&Unit>) -> String {
    match unit {
        Some(_) => "its name and unit are not recognised as a quantity".to_owned(),
        None => "its name is not recognised as a quantity, and it has no unit".to_owned(),
    }
}

fn best_rule(words: &[String], unit: Option<&Unit>) -> Option<&'static Rule> {
    let holds = |rule: &&Rule| {
        let said =
            rule.groups.iter().all(|group| words.iter().any(|w| group.contains(&w.as_str())));
        let turns = matches!(rule.quantity, Quantity::Rate(_)) && unit.is_some_and(counts_turns);
        let fits = unit.map_or(!rule.needs_unit, |unit| {
            unit.resolve(dimension_of(rule.quantity.kind())).is_ok()
        });
        said && fits && !turns
    };
    // Of equally strong rules the first applies.
    RULES.iter().filter(holds).rev().max_by_key(|rule| rule.strength)
}

fn of_rule(channel: &Channel, rule: &Rule, named: Option<&'static str>) -> Claim {
    let unit = named.filter(|_| channel.unit.is_none());
    let missing = channel.unit.is_none() && unit.is_none();
    let doubts = [
        rule.doubt.map(str::to_owned),
        missing.then(|| NO_UNIT.to_owned()),
        doubt_of_values(channel, &rule.quantity),
    ];
    let doubts: Vec<String> = doubts.into_iter().flatten().collect();
    Claim {
        quantity: rule.quantity.clone(),
        strength: rule.strength,
        unit,
        negate: false,
        why: why(channel, unit).to_owned(),
        doubt: (!doubts.is_empty()).then(|| doubts.join("; ")),
    }
}

fn why(channel: &Channel, named: Option<&str>) -> &'static str {
    match (&channel.unit, named) {
        (Some(_), _) => "by its name and unit",
        (None, Some(_)) => "by its name, which ends in its unit",
        (None, None) => "by its name",
    }
}

fn doubt_of_values(channel: &Channel, quantity: &Quantity) -> Option<String> {
    let (min, max) = (channel.min()?, channel.max()?);
    match quantity {
        Quantity::Depth if -min > max => {
            Some("most of it is negative: if it points up, add negate = true".to_owned())
        }
        Quantity::Attitude(angle) => {
            let radians = channel.unit.as_ref().is_some_and(|unit| unit.factor() == 1.0);
            let largest = max.abs().max(min.abs());
            (radians && looks_like_degrees(*angle, largest))
                .then(|| "its values look like degrees: if they are, add unit = \"deg\"".to_owned())
        }
        _ => None,
    }
}

/// Returns the thruster whose input a column holds, by its unit, name and values.
fn thruster(channel: &Channel, words: &[String], unit: Option<&Unit>) -> Option<Claim> {
    let named = tells_of_thruster(words);
    let (input, unit, why) = match unit {
        Some(unit) => (thruster_input(unit, named)?, None, why(channel, None).to_owned()),
        None if named => by_values(channel, words)?,
        None => return None,
    };
    let quantity = Quantity::Thruster { name: thruster_name(&channel.name), input };
    let doubt = (input == ThrusterInput::Speed && channel.unit.is_none() && unit.is_none())
        .then(|| "no unit is stated; add unit = \"rpm\", \"rev/s\" or \"rad/s\"".to_owned());
    Some(Claim { quantity, strength: 2, unit, negate: false, why, doubt })
}

fn thruster_input(unit: &Unit, named: bool) -> Option<ThrusterInput> {
    match unit.dimension() {
        Dimension::PulseWidth => Some(ThrusterInput::Pwm),
        Dimension::AngularVelocity if named || counts_turns(unit) => Some(ThrusterInput::Speed),
        Dimension::Ratio if named => Some(ThrusterInput::Command),
        _ if named && unit.resolve(Dimension::Force).is_ok() => Some(ThrusterInput::Force),
        _ => None,
    }
}

/// Infers the kind of input of a thruster's column without a unit from its values.
fn by_values(
    channel: &Channel,
    words: &[String],
) -> Option<(ThrusterInput, Option<&'static str>, String)> {
    let has = |known: &[&str]| words.iter().any(|word| known.contains(&word.as_str()));
    if has(&["speed", "velocity", "omega"]) && !has(&["pwm"]) {
        return Some((ThrusterInput::Speed, None, "by its name".to_owned()));
    }
    let (min, max) = (channel.min()?, channel.max()?);
    if min >= 800.0 && max <= 2200.0 {
        let why = "by its name and its values, which are pulse widths".to_owned();
        return Some((ThrusterInput::Pwm, Some("us"), why));
    }
    if min >= -1.0 && max <= 1.0 {
        let why = "by its name and its values, which stay within 1".to_owned();
        return Some((ThrusterInput::Command, Some("1"), why));
    }
    None
}

/// Removes the words that describe the logged quantity: `port motor rpm` becomes `port motor`.
fn thruster_name(name: &str) -> String {
    const INPUTS: &[&str] =
        &["pwm", "rpm", "rps", "speed", "cmd", "command", "force", "us", "input", "output", "raw"];
    let is_mark = |c: char| c.is_whitespace() || "_-.:/".contains(c);
    let mut left = name.trim();
    while let Some(at) = left.rfind(is_mark) {
        let mark = left[at..].chars().next().map_or(1, char::len_utf8);
        let last = left[at + mark..].to_lowercase();
        if !(INPUTS.contains(&last.as_str()) || last.is_empty()) {
            break;
        }
        left = left[..at].trim_end_matches(is_mark);
    }
    if left.is_empty() { name.trim().to_owned() } else { left.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thruster_keeps_what_names_it() {
        assert_eq!(thruster_name("port motor rpm"), "port motor");
        assert_eq!(thruster_name("T1_pwm_raw"), "T1");
        assert_eq!(thruster_name("fore-aft port"), "fore-aft port");
        assert_eq!(thruster_name("pwm"), "pwm");
        assert_eq!(thruster_name("_pwm"), "_pwm");
    }
}
