//! Known channels of ArduSub, and of ArduPilot in a boat, about which the user need not be asked.

use seaplant::quantity::{Attitude, Axis, WindFrame, WindPart, World};
use seaplant::{Quantity, ThrusterInput};
use seaplant_log::{Channel, Log};

use super::claim::{Claim, NOT_NEEDED, WORLD_VELOCITY};
use crate::preset::VehiclePreset;

/// A channel and its quantity.
struct Known {
    column: &'static str,
    quantity: Quantity,
    strength: u8,
    /// True if its sign is reversed: a height in place of a depth.
    negate: bool,
}

const fn known(column: &'static str, quantity: Quantity, strength: u8) -> Known {
    Known { column, quantity, strength, negate: false }
}

const fn height(column: &'static str, strength: u8) -> Known {
    Known { column, quantity: Quantity::Depth, strength, negate: true }
}

#[rustfmt::skip]
static KNOWN: &[Known] = &[
    known("ATT.Roll", Quantity::Attitude(Attitude::Roll), 4),
    known("ATT.Pitch", Quantity::Attitude(Attitude::Pitch), 4),
    known("ATT.Yaw", Quantity::Attitude(Attitude::Heading), 4),
    known("RATE.R", Quantity::Rate(Axis::X), 4),
    known("RATE.P", Quantity::Rate(Axis::Y), 4),
    known("RATE.Y", Quantity::Rate(Axis::Z), 4),
    known("XKF1[0].PN", Quantity::Position(World::North), 4),
    known("XKF1[0].PE", Quantity::Position(World::East), 4),
    known("NKF1[0].PN", Quantity::Position(World::North), 3),
    known("NKF1[0].PE", Quantity::Position(World::East), 3),
    known("NKF1.PN", Quantity::Position(World::North), 2),
    known("NKF1.PE", Quantity::Position(World::East), 2),
    height("BAR2.Alt", 3),
    height("BARO.Alt", 2),
    known("BAT[0].Volt", Quantity::SupplyVoltage, 4),
    known("BAT.Volt", Quantity::SupplyVoltage, 3),
    known("ATTITUDE.roll", Quantity::Attitude(Attitude::Roll), 4),
    known("ATTITUDE.pitch", Quantity::Attitude(Attitude::Pitch), 4),
    known("ATTITUDE.yaw", Quantity::Attitude(Attitude::Heading), 4),
    known("ATTITUDE.rollspeed", Quantity::Rate(Axis::X), 4),
    known("ATTITUDE.pitchspeed", Quantity::Rate(Axis::Y), 4),
    known("ATTITUDE.yawspeed", Quantity::Rate(Axis::Z), 4),
    known("LOCAL_POSITION_NED.x", Quantity::Position(World::North), 4),
    known("LOCAL_POSITION_NED.y", Quantity::Position(World::East), 4),
    height("GLOBAL_POSITION_INT.relative_alt", 4),
    height("VFR_HUD.alt", 3),
    known("IMU[0].AccX", Quantity::Acceleration(Axis::X), 4),
    known("IMU[0].AccY", Quantity::Acceleration(Axis::Y), 4),
    known("IMU[0].AccZ", Quantity::Acceleration(Axis::Z), 4),
    known("IMU.AccX", Quantity::Acceleration(Axis::X), 3),
    known("IMU.AccY", Quantity::Acceleration(Axis::Y), 3),
    known("IMU.AccZ", Quantity::Acceleration(Axis::Z), 3),
    known("RAW_IMU.xacc", Quantity::Acceleration(Axis::X), 3),
    known("RAW_IMU.yacc", Quantity::Acceleration(Axis::Y), 3),
    known("RAW_IMU.zacc", Quantity::Acceleration(Axis::Z), 3),
    known("SCALED_IMU.xacc", Quantity::Acceleration(Axis::X), 4),
    known("SCALED_IMU.yacc", Quantity::Acceleration(Axis::Y), 4),
    known("SCALED_IMU.zacc", Quantity::Acceleration(Axis::Z), 4),
    known("SCALED_IMU2.xacc", Quantity::Acceleration(Axis::X), 2),
    known("SCALED_IMU2.yacc", Quantity::Acceleration(Axis::Y), 2),
    known("SCALED_IMU2.zacc", Quantity::Acceleration(Axis::Z), 2),
    known("SYS_STATUS.voltage_battery", Quantity::SupplyVoltage, 4),
];

/// Channels of a boat, whose receiver or estimator knows its motion over ground.
#[rustfmt::skip]
static KNOWN_AFLOAT: &[Known] = &[
    known("XKF1[0].VN", Quantity::WorldVelocity(World::North), 4),
    known("XKF1[0].VE", Quantity::WorldVelocity(World::East), 4),
    known("XKF1.VN", Quantity::WorldVelocity(World::North), 3),
    known("XKF1.VE", Quantity::WorldVelocity(World::East), 3),
    known("NKF1[0].VN", Quantity::WorldVelocity(World::North), 3),
    known("NKF1[0].VE", Quantity::WorldVelocity(World::East), 3),
    known("NKF1.VN", Quantity::WorldVelocity(World::North), 2),
    known("NKF1.VE", Quantity::WorldVelocity(World::East), 2),
    known("LOCAL_POSITION_NED.vx", Quantity::WorldVelocity(World::North), 4),
    known("LOCAL_POSITION_NED.vy", Quantity::WorldVelocity(World::East), 4),
    known("WIND.SpdTru", Quantity::Wind(WindFrame::True, WindPart::Speed), 4),
    known("WIND.DrTru", Quantity::Wind(WindFrame::True, WindPart::Direction), 4),
    known("WIND.SpdApp", Quantity::Wind(WindFrame::Relative, WindPart::Speed), 4),
    known("WIND.DrApp", Quantity::Wind(WindFrame::Relative, WindPart::Direction), 4),
    known("WIND.speed", Quantity::Wind(WindFrame::True, WindPart::Speed), 3),
    known("WIND.direction", Quantity::Wind(WindFrame::True, WindPart::Direction), 3),
];

/// The boat autopilot's function numbers of outputs that drive propellers.
const THROTTLES: [(f64, &str); 3] =
    [(70.0, "throttle"), (73.0, "throttle left"), (74.0, "throttle right")];

/// Returns the quantity of an autopilot's channel; `None` for other channels.
pub(super) fn claim(log: &Log, channel: &Channel) -> Option<Result<Claim, String>> {
    if !is_of_autopilot(log, channel) {
        return None;
    }
    let column = without_sender(&channel.column);
    let motor = output(&column).and_then(|output| motor(log, output));
    let found = motor.or_else(|| depth_of_barometer(log, &column)).or_else(|| {
        let afloat = KNOWN_AFLOAT.iter().filter(|_| is_boat(log));
        let known = KNOWN.iter().chain(afloat).find(|known| known.column == column)?;
        Some((known.quantity.clone(), known.strength, known.negate))
    });
    let Some((quantity, strength, negate)) = found else {
        return Some(Err(reason(&column).to_owned()));
    };
    let unit = channel.unit.is_none().then(|| unit_of(&quantity));
    let why = match (negate, is_boat(log)) {
        (true, _) => "as ArduSub logs it, a height",
        (false, false) => "as ArduSub logs it",
        (false, true) => "as ArduPilot logs it",
    };
    let why = why.to_owned();
    Some(Ok(Claim { quantity, strength, unit, negate, why, doubt: None }))
}

/// Returns why a channel is not mapped.
fn reason(column: &str) -> &'static str {
    const STEP: &str = "how far the vehicle moved or turned between two samples, not a velocity";
    const WORLD: &[&str] = &[
        "XKF1[0].VN",
        "XKF1[0].VE",
        "XKF1[0].VD",
        "NKF1[0].VN",
        "NKF1[0].VE",
        "NKF1[0].VD",
        "NKF1.VN",
        "NKF1.VE",
        "NKF1.VD",
        "LOCAL_POSITION_NED.vx",
        "LOCAL_POSITION_NED.vy",
        "LOCAL_POSITION_NED.vz",
    ];
    match column.split_once('.') {
        _ if WORLD.contains(&column) => WORLD_VELOCITY,
        Some(("VISO", "PX" | "PY" | "PZ" | "AX" | "AY" | "AZ")) => STEP,
        Some(("VISION_POSITION_DELTA", _)) => STEP,
        _ => NOT_NEEDED,
    }
}

/// Returns the unit in which ArduSub logs a quantity; its early logs state none.
fn unit_of(quantity: &Quantity) -> &'static str {
    match quantity {
        Quantity::Thruster { .. } => "us",
        Quantity::Attitude(_) => "deg",
        Quantity::Rate(_) => "deg/s",
        Quantity::SupplyVoltage => "V",
        Quantity::Acceleration(_) => "m/s2",
        Quantity::WorldVelocity(_) | Quantity::Wind(_, WindPart::Speed) => "m/s",
        Quantity::Wind(_, WindPart::Direction) => "deg",
        _ => "m",
    }
}

fn is_of_autopilot(log: &Log, channel: &Channel) -> bool {
    let format = &log.sources()[channel.source].format;
    ["ArduPilot DataFlash", "MAVLink telemetry"].iter().any(|known| format.starts_with(known))
}

/// Shortens `ATTITUDE[1.1].roll`, which several systems send, to `ATTITUDE.roll`, for an autopilot.
fn without_sender(column: &str) -> String {
    column.replacen("[1.1]", "", 1)
}

/// Returns the number of the autopilot's output that a channel holds.
fn output(column: &str) -> Option<u8> {
    let of_telemetry =
        || column.strip_prefix("SERVO_OUTPUT_RAW.servo")?.strip_suffix("_raw")?.parse().ok();
    let of_log = || column.strip_prefix("RCOU.C")?.parse().ok();
    of_log().or_else(of_telemetry)
}

/// Returns whether the settings are those of a boat, with throttles in place of motors.
fn is_boat(log: &Log) -> bool {
    (1..=16).any(|output| {
        let function = log.settings().get(&format!("SERVO{output}_FUNCTION"));
        function.is_some_and(|function| THROTTLES.iter().any(|(known, _)| known == function))
    })
}

/// Returns the motor that an output drives, by the settings if there are any.
fn motor(log: &Log, output: u8) -> Option<(Quantity, u8, bool)> {
    /// Function number of an output that drives motor 1; those up to motor 8 follow.
    const MOTOR_1: f64 = 33.0;
    const MOTORS: u8 = 8;
    let settings = log.settings();
    let function = settings.get(&format!("SERVO{output}_FUNCTION"));
    let throttle = function.and_then(|own| THROTTLES.iter().find(|(known, _)| known == own));
    if let Some((_, name)) = throttle {
        let name = (*name).to_owned();
        return Some((Quantity::Thruster { name, input: ThrusterInput::Pwm }, 4, false));
    }
    let number = match function {
        Some(function) => function - MOTOR_1 + 1.0,
        None if settings.contains_key("SERVO1_FUNCTION") => return None,
        None => f64::from(output),
    };
    let motors = preset(log).map_or(MOTORS, |preset| preset.thrusters().len() as u8);
    let number = (1..=motors).find(|motor| f64::from(*motor) == number)?;
    let name = format!("motor {number}");
    Some((Quantity::Thruster { name, input: ThrusterInput::Pwm }, 4, false))
}

/// Returns the barometer used as depth sensor: the configured one, else the last.
fn depth_of_barometer(log: &Log, column: &str) -> Option<(Quantity, u8, bool)> {
    let instance: u8 = column.strip_prefix("BARO[")?.strip_suffix("].Alt")?.parse().ok()?;
    let strength = match log.settings().get("BARO_PRIMARY") {
        Some(primary) if *primary == f64::from(instance) => 9,
        _ => 4 + instance.min(4),
    };
    Some((Quantity::Depth, strength, true))
}

/// Returns the known vehicle whose frame the log's settings state.
pub(crate) fn preset(log: &Log) -> Option<VehiclePreset> {
    let frame = log.settings().get("FRAME_CONFIG")?;
    match *frame {
        1.0 => Some(VehiclePreset::BlueRov2),
        2.0 => Some(VehiclePreset::BlueRov2Heavy),
        _ => None,
    }
}

/// Returns whether the autopilot is set to reverse a thruster.
pub(crate) fn is_reversed(log: &Log, thruster: &str) -> bool {
    let setting = thruster.strip_prefix("motor ").map(|motor| format!("MOT_{motor}_DIRECTION"));
    setting.and_then(|setting| log.settings().get(&setting)).is_some_and(|way| *way < 0.0)
}
