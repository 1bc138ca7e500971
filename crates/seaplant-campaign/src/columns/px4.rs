//! Known topics of PX4, about which the user need not be asked.

use seaplant::quantity::{Attitude, Axis, World};
use seaplant::{Quantity, ThrusterInput};
use seaplant_log::{Channel, Log};

use super::claim::{Claim, NOT_NEEDED, WORLD_VELOCITY};

/// A channel, its quantity, and the strength of evidence.
type Known = (&'static str, Quantity, u8);

/// The accelerometer is averaged from one sample of `sensor_combined` to the next.
#[rustfmt::skip]
static KNOWN: &[Known] = &[
    ("vehicle_attitude.roll", Quantity::Attitude(Attitude::Roll), 4),
    ("vehicle_attitude.pitch", Quantity::Attitude(Attitude::Pitch), 4),
    ("vehicle_attitude.yaw", Quantity::Attitude(Attitude::Heading), 4),
    ("vehicle_angular_velocity.xyz[0]", Quantity::Rate(Axis::X), 4),
    ("vehicle_angular_velocity.xyz[1]", Quantity::Rate(Axis::Y), 4),
    ("vehicle_angular_velocity.xyz[2]", Quantity::Rate(Axis::Z), 4),
    ("sensor_combined.gyro_rad[0]", Quantity::Rate(Axis::X), 3),
    ("sensor_combined.gyro_rad[1]", Quantity::Rate(Axis::Y), 3),
    ("sensor_combined.gyro_rad[2]", Quantity::Rate(Axis::Z), 3),
    ("sensor_combined.accelerometer_m_s2[0]", Quantity::Acceleration(Axis::X), 4),
    ("sensor_combined.accelerometer_m_s2[1]", Quantity::Acceleration(Axis::Y), 4),
    ("sensor_combined.accelerometer_m_s2[2]", Quantity::Acceleration(Axis::Z), 4),
    ("vehicle_acceleration.xyz[0]", Quantity::Acceleration(Axis::X), 3),
    ("vehicle_acceleration.xyz[1]", Quantity::Acceleration(Axis::Y), 3),
    ("vehicle_acceleration.xyz[2]", Quantity::Acceleration(Axis::Z), 3),
    ("vehicle_local_position.x", Quantity::Position(World::North), 4),
    ("vehicle_local_position.y", Quantity::Position(World::East), 4),
    ("vehicle_local_position.z", Quantity::Depth, 4),
    ("battery_status.voltage_v", Quantity::SupplyVoltage, 4),
];

/// Returns the quantity of a channel of PX4; `None` for other channels.
pub(super) fn claim(log: &Log, channel: &Channel) -> Option<Result<Claim, String>> {
    if !log.sources()[channel.source].format.starts_with("PX4 ULog") {
        return None;
    }
    let column = channel.column.replacen("[0].", ".", 1);
    let known = KNOWN.iter().find(|(known, ..)| *known == column);
    let found = known.map(|(_, quantity, strength)| (quantity.clone(), *strength));
    let Some((quantity, strength)) = found.or_else(|| motor(log, channel, &column)) else {
        let moves = column.strip_prefix("vehicle_local_position.");
        let of_world = moves.is_some_and(|field| ["vx", "vy", "vz"].contains(&field));
        return Some(Err(if of_world { WORLD_VELOCITY } else { NOT_NEEDED }.to_owned()));
    };
    let unit = channel.unit.is_none().then(|| unit_of(&quantity));
    let doubt = (quantity == Quantity::Depth)
        .then(|| "it counts from where the estimator started, not from the surface".to_owned());
    let why = "as PX4 logs it".to_owned();
    Some(Ok(Claim { quantity, strength, unit, negate: false, why, doubt }))
}

fn unit_of(quantity: &Quantity) -> &'static str {
    match quantity {
        Quantity::Thruster { input: ThrusterInput::Pwm, .. } => "us",
        Quantity::Thruster { .. } => "1",
        Quantity::Attitude(_) => "rad",
        Quantity::Rate(_) => "rad/s",
        Quantity::Acceleration(_) => "m/s2",
        Quantity::SupplyVoltage => "V",
        _ => "m",
    }
}

/// Returns the motor that a channel drives: by the control allocator's output, else by the outputs
/// of logs without it.
fn motor(log: &Log, channel: &Channel, column: &str) -> Option<(Quantity, u8)> {
    let number = |prefix: &str| -> Option<usize> {
        let index: usize = column.strip_prefix(prefix)?.strip_suffix(']')?.parse().ok()?;
        Some(index + 1)
    };
    const ASKED: &str = "actuator_motors.control[";
    let has_asked = || log.channels().iter().any(|other| other.column.starts_with(ASKED));
    let (number, input) = match (number(ASKED), number("actuator_outputs.output[")) {
        (Some(number), _) => (number, ThrusterInput::Command),
        (None, Some(number)) if !has_asked() => (number, ThrusterInput::Pwm),
        _ => return None,
    };
    let range = (channel.min()?, channel.max()?);
    let is_pulse = range.0 >= 800.0 && range.1 <= 2200.0;
    let fits = (input == ThrusterInput::Pwm) == is_pulse;
    let count = log.settings().get("CA_ROTOR_COUNT").copied();
    let is_there = match count {
        Some(count) if count > 0.0 => number as f64 <= count,
        _ => !channel.is_constant(),
    };
    let name = format!("motor {number}");
    (fits && is_there).then_some((Quantity::Thruster { name, input }, 4))
}
