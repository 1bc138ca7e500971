//! Recognises columns of boats and ships: rudders, fins, wind, and satellite navigation.

use seaplant::Quantity;
use seaplant::Surface;
use seaplant::quantity::{WindFrame, WindPart, World};
use seaplant_log::{Channel, Dimension, Unit};

use super::claim::Claim;

const RUDDER: &[&str] = &["rudder", "delta", "helm"];
const FIN: &[&str] = &["fin", "fins", "elevator", "sternplane", "bowplane", "flap"];

/// Returns the quantity that the words of a column's name and its unit imply, if it is one of a
/// boat.
pub(super) fn claim(channel: &Channel, words: &[String], unit: Option<&Unit>) -> Option<Claim> {
    let has = |all: &[&str]| words.iter().any(|word| all.contains(&word.as_str()));
    let is = |dimension| unit.is_none_or(|unit| unit.resolve(dimension).is_ok());
    let (quantity, doubt) = if has(&["wind"]) {
        wind(words, &is)?
    } else if has(RUDDER) || has(FIN) {
        if !is(Dimension::Angle) || has(&["rate", "dot", "force", "moment"]) {
            return None;
        }
        let kind = if has(RUDDER) { Surface::Rudder } else { Surface::Fin };
        let name = surface_name(words, kind);
        let doubt = "is a positive angle one that turns the bow to starboard? if not, turn its axis round in vehicle.toml";
        (Quantity::SurfaceAngle { kind, name }, Some(doubt))
    } else {
        (satellite(words, &is)?, None)
    };
    let mut doubts: Vec<String> = doubt.into_iter().map(str::to_owned).collect();
    if unit.is_none() {
        doubts.push("no unit is stated; add unit = \"...\"".to_owned());
    } else if unit.is_some_and(|unit| unit.factor() == 1.0)
        && looks_like_degrees(channel, &quantity)
    {
        doubts.push("its values look like degrees: if they are, add unit = \"deg\"".to_owned());
    }
    let doubt = (!doubts.is_empty()).then(|| doubts.join("; "));
    let why = if channel.unit.is_some() { "by its name and unit" } else { "by its name" };
    Some(Claim { quantity, strength: 3, unit: None, negate: false, why: why.to_owned(), doubt })
}

fn wind(
    words: &[String],
    is: &impl Fn(Dimension) -> bool,
) -> Option<(Quantity, Option<&'static str>)> {
    const FELT: &str = "is it the wind measured on board (relative) or over ground (true)?";
    let has = |all: &[&str]| words.iter().any(|word| all.contains(&word.as_str()));
    // Relative to the bow, but of the wind over ground: not a frame that channels have.
    if has(&["theoretical"]) {
        return None;
    }
    let is_true = has(&["true", "tws", "twd", "twa"]);
    let is_relative = has(&["relative", "rel", "apparent", "app", "aws", "awa"]);
    let frame = if is_true { WindFrame::True } else { WindFrame::Relative };
    let doubt = (is_true == is_relative).then_some(FELT);
    let is_direction = has(&["dir", "direction", "angle", "twd", "awa"]);
    if is_direction && is(Dimension::Angle) {
        return Some((Quantity::Wind(frame, WindPart::Direction), doubt));
    }
    let is_speed = has(&["speed", "velo", "vel", "velocity", "tws", "aws"]);
    (is_speed && is(Dimension::Velocity)).then_some((Quantity::Wind(frame, WindPart::Speed), doubt))
}

fn satellite(words: &[String], is: &impl Fn(Dimension) -> bool) -> Option<Quantity> {
    let has = |all: &[&str]| words.iter().any(|word| all.contains(&word.as_str()));
    if has(&["cmd", "setpoint", "desired", "target", "std", "error", "bt", "dvl"]) {
        return None;
    }
    // RMC and VTG of NMEA 0183 have one speed, that over ground.
    if has(&["rmc", "vtg"]) && has(&["speed"]) && is(Dimension::Velocity) {
        return Some(Quantity::GroundSpeed);
    }
    let known: [(&[&str], Dimension, Quantity); 7] = [
        (&["lat", "latitude"], Dimension::Angle, Quantity::Latitude),
        (&["lon", "lng", "longitude"], Dimension::Angle, Quantity::Longitude),
        (&["cog", "course"], Dimension::Angle, Quantity::GroundCourse),
        (&["sog"], Dimension::Velocity, Quantity::GroundSpeed),
        (&["vn", "north"], Dimension::Velocity, Quantity::WorldVelocity(World::North)),
        (&["ve", "east"], Dimension::Velocity, Quantity::WorldVelocity(World::East)),
        (&["vd"], Dimension::Velocity, Quantity::WorldVelocity(World::Down)),
    ];
    // A position may be called north too, so a velocity needs its unit.
    let fits = |(words, dimension, quantity): &(&[&str], Dimension, Quantity)| {
        let is_velocity = matches!(quantity, Quantity::WorldVelocity(_));
        has(words) && is(*dimension) && (!is_velocity || !is(Dimension::Length))
    };
    known.into_iter().find(fits).map(|(_, _, quantity)| quantity)
}

/// Returns `port rudder` if there are two rudders, else `rudder`.
fn surface_name(words: &[String], kind: Surface) -> String {
    let sides = ["port", "starboard", "stbd", "upper", "lower", "bow", "stern", "fore", "aft"];
    let mut parts: Vec<&str> =
        words.iter().map(String::as_str).filter(|word| sides.contains(word)).collect();
    let numbered = words.iter().find(|word| {
        let digits = word.trim_start_matches(|c: char| c.is_alphabetic());
        !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit())
    });
    let digits = numbered.map(|word| word.trim_start_matches(|c: char| c.is_alphabetic()));
    parts.push(kind.name());
    parts.extend(digits);
    parts.join(" ")
}

fn looks_like_degrees(channel: &Channel, quantity: &Quantity) -> bool {
    let most = if matches!(quantity, Quantity::SurfaceAngle { .. }) { 1.6 } else { 6.3 };
    let is_angle = quantity.kind() == seaplant::quantity::Kind::Angle;
    is_angle && channel.min().zip(channel.max()).is_some_and(|(a, b)| a.abs().max(b.abs()) > most)
}
