//! Recognises thrusters in ROS topics: one topic for each, lists, joints, outputs of mavros.

use seaplant::{Quantity, ThrusterInput};
use seaplant_log::{Channel, Dimension, Log};

use super::claim::Claim;
use super::ros_field::Field;
use crate::words::{counts_turns, tells_of_thruster, words};

/// Why a thruster is not mapped: the user is asked.
pub(crate) const UNTOLD: &str = "a thruster's input, it seems, whose unit cannot be inferred from its values: map it as thruster.NAME.speed, \
     .pwm, .command or .force, with its unit";
const ANGLE: &str = "the angle of a joint";
const EFFORT: &str =
    "the effort of a joint, a motor's torque perhaps; if it is thrust, map thruster.NAME.force";
const STATE: &str = "a state of a thruster, not its input";
/// Words of thrusters' other measurements.
const STATES: &[&str] = &[
    "temperature",
    "temp",
    "voltage",
    "current",
    "power",
    "status",
    "fault",
    "error",
    "enabled",
    "armed",
    "mode",
    "count",
    "consumption",
];
const OUTPUT: &str = "does this output drive that motor?";

/// Returns the thruster whose input a channel holds; `None` for other channels.
pub(super) fn claim(
    log: &Log,
    channel: &Channel,
    field: &Field<'_>,
) -> Option<Result<Claim, String>> {
    let output = field.topic.ends_with("/rc/out") || field.path.starts_with("esc_status");
    if !output && !is_of_thruster(field) {
        return None;
    }
    if output {
        return Some(of_output(channel, field.path));
    }
    let base = field.path.split('[').next().unwrap_or_default();
    match base.rsplit('.').next().unwrap_or_default() {
        // Vectors are totals of all thrusters; the others are not separate inputs.
        "x" | "y" | "z" | "w" | "throttle" => return None,
        _ if base.starts_with("header") || base.starts_with("layout") => return None,
        "position" => return Some(Err(ANGLE.to_owned())),
        "effort" => return Some(Err(EFFORT.to_owned())),
        _ if STATES.iter().any(|state| field.has(state)) => return Some(Err(STATE.to_owned())),
        _ => {}
    }
    let Some((input, unit, why)) = input(log, channel, field, base) else {
        let measures = channel.unit.is_some();
        return Some(Err(if measures { STATE } else { UNTOLD }.to_owned()));
    };
    let unit = unit.filter(|_| channel.unit.is_none());
    let quantity = Quantity::Thruster { name: name(field), input };
    let why = why.to_owned();
    Some(Ok(Claim { quantity, strength: 2, unit, negate: false, why, doubt: None }))
}

/// Returns whether the topic, a field or a joint names a thruster.
fn is_of_thruster(field: &Field<'_>) -> bool {
    tells_of_thruster(&words(field.topic)) || tells_of_thruster(&words(field.path))
}

/// Returns the output of an autopilot, which ArduSub's motors use in order.
fn of_output(channel: &Channel, path: &str) -> Result<Claim, String> {
    let (before, after) = path.split_once('[').unwrap_or((path, ""));
    let (index, field) = after.split_once(']').unwrap_or((after, ""));
    let index: u8 = index.parse().map_err(|_| STATE.to_owned())?;
    let name = format!("motor {}", u16::from(index) + 1);
    let input = match (before, field) {
        ("channels", "") => ThrusterInput::Pwm,
        ("esc_status", ".rpm") => ThrusterInput::Speed,
        _ => return Err(STATE.to_owned()),
    };
    // An unused output.
    if channel.is_constant() && channel.max() == Some(0.0) {
        return Err("an output that is not used".to_owned());
    }
    let quantity = Quantity::Thruster { name, input };
    let (why, doubt) = ("by its message".to_owned(), Some(OUTPUT.to_owned()));
    Ok(Claim { quantity, strength: 2, unit: None, negate: false, why, doubt })
}

type Input = (ThrusterInput, Option<&'static str>, &'static str);

/// Returns the kind of input by its unit, its name and the values of all thrusters of its kind.
fn input(log: &Log, channel: &Channel, field: &Field<'_>, base: &str) -> Option<Input> {
    if let Some(unit) = &channel.unit {
        let input = match unit.dimension() {
            Dimension::PulseWidth => ThrusterInput::Pwm,
            Dimension::AngularVelocity => ThrusterInput::Speed,
            Dimension::Force => ThrusterInput::Force,
            Dimension::Ratio if !counts_turns(unit) => ThrusterInput::Command,
            _ => return None,
        };
        return Some((input, None, "by its topic and unit"));
    }
    if base == "velocity" {
        return Some((ThrusterInput::Speed, Some("rad/s"), "by its message, whose joints turn"));
    }
    if field.has("rpm") {
        return Some((ThrusterInput::Speed, Some("rpm"), "by its name"));
    }
    let (min, max) = span(log, channel);
    if min >= 800.0 && max <= 2200.0 {
        let why = "by its topic and its values, which are pulse widths";
        return Some((ThrusterInput::Pwm, Some("us"), why));
    }
    if min >= -1.0 && max <= 1.0 && min < max {
        let why = "by its topic and its values, which stay within 1";
        return Some((ThrusterInput::Command, Some("1"), why));
    }
    if field.has("thrust") || field.has("force") {
        return Some((ThrusterInput::Force, Some("N"), "by its name"));
    }
    None
}

/// Returns the smallest and the largest value of a channel and of all with the same name but for a
/// number or a name: the others reveal the unit of a thruster at rest.
fn span(log: &Log, channel: &Channel) -> (f64, f64) {
    let alike = pattern(&channel.column);
    let all = log.channels().iter().filter(|other| pattern(&other.column) == alike);
    let ends = all.filter_map(|other| other.min().zip(other.max()));
    ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (min, max)| {
        (low.min(min), high.max(max))
    })
}

/// Removes digits and brackets from a column's name.
fn pattern(column: &str) -> String {
    let mut within = false;
    let keep = |c: &char| {
        within = (within || *c == '[') && *c != ']';
        !within && !c.is_ascii_digit()
    };
    column.chars().filter(keep).collect()
}

/// Returns the name of the thruster: the one in brackets, else the topic's words from the one for
/// thrusters on.
fn name(field: &Field<'_>) -> String {
    let index = field.path.split_once('[').map(|(_, rest)| rest.split(']').next().unwrap_or(rest));
    let named = index.filter(|index| index.parse::<u32>().is_err());
    if let Some(name) = named {
        return name.to_owned();
    }
    // Below the topic's name there is usually only `data`, unless the field is the thruster.
    let fields = field.path.split('[').next().unwrap_or_default().split('.');
    let fields = fields.filter(|_| !tells_of_thruster(&words(field.topic)));
    let segments: Vec<&str> = field.topic.split('/').chain(fields).collect();
    let start = segments.iter().position(|segment| tells_of_thruster(&words(segment)));
    let from = start.map_or(&segments[..], |start| &segments[start..]);
    let mut left: Vec<String> = from.iter().flat_map(|segment| parts(segment)).collect();
    left.extend(index.map(str::to_owned));
    // `thrusters 0`, but `port` of `thrusters port`.
    if left.len() > 1 && ["thrusters", "motors", "propellers"].contains(&left[0].as_str()) {
        left[0].pop();
        if left[1..].iter().all(|word| word.parse::<u32>().is_err()) {
            left.remove(0);
        }
    }
    if left.iter().all(|word| word.parse::<u32>().is_ok()) {
        left.insert(0, "thruster".to_owned());
    }
    left.join(" ")
}

/// Returns the words of a segment without those that describe the content: `cmd_thruster1` becomes
/// `thruster` and 1.
fn parts(segment: &str) -> Vec<String> {
    const SENT: &[&str] = &[
        "cmd", "command", "input", "output", "pwm", "rpm", "speed", "thrust", "force", "setpoint",
        "raw", "joint", "data", "state", "vel", "velocity",
    ];
    let mut found: Vec<String> = Vec::new();
    for word in segment.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()) {
        let digits = word.len() - word.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        let (name, number) = word.split_at(word.len() - digits);
        let name = name.to_lowercase();
        found.extend(
            [name.as_str(), number].iter().filter(|part| !part.is_empty()).map(ToString::to_string),
        );
    }
    found.retain(|word| !SENT.contains(&word.as_str()));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name_of(column: &str) -> String {
        name(&Field::parse(column).expect("a topic"))
    }

    #[test]
    fn a_thruster_is_called_as_its_topic_calls_it() {
        for (column, expected) in [
            ("/thruster_1/cmd/data", "thruster 1"),
            ("/rexrov/thrusters/0/input/data", "thruster 0"),
            ("/thrusters/port/cmd/data", "port"),
            ("/port_thruster/cmd/data", "port thruster"),
            ("/model/rov/joint/thruster3_joint/cmd_thrust/data", "thruster 3"),
            ("/bluerov2/cmd_thruster2/data", "thruster 2"),
            ("/thruster_cmd/data[4]", "thruster 4"),
            ("/thrusters/velocity[fore-aft port]", "fore-aft port"),
            ("/motors/rpm/data[2]", "motor 2"),
            ("/status/motor3_rpm", "motor 3"),
            ("/status/pwm[1]", "thruster 1"),
        ] {
            assert_eq!(name_of(column), expected, "{column}");
        }
    }
}
