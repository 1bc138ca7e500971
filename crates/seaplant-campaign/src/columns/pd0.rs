//! Recognises the channels of a Teledyne RDI PD0 file: the velocity of the bottom relative to the
//! instrument.

use seaplant::Quantity;
use seaplant::quantity::Axis;
use seaplant_log::{Channel, Log};

use super::claim::{Claim, WORLD_VELOCITY};

const SHIP: &str =
    "in the ship's axes, as the instrument was set to turn it; is its rotation_deg 0 then?";
const INSTRUMENT: &str = "in the instrument's axes: which of them is forward, starboard and down depends on how it is \
     mounted, and it is the bottom's velocity, so the vehicle's is the opposite; map it as \
     dvl.velocity.x, .y, .z";
const BEAM: &str = "along a beam of the instrument; set it to ship coordinates";

/// Returns the quantity of a channel of a PD0 file; `None` for other channels, and where its name
/// determines it.
pub(super) fn claim(log: &Log, channel: &Channel) -> Option<Result<Claim, String>> {
    if !log.sources()[channel.source].format.starts_with("Teledyne RDI PD0") {
        return None;
    }
    let field = channel.column.strip_prefix("bottom_track.")?;
    let (frame, way) = field.split_once(".velocity_")?;
    // The bottom's relative velocity is opposite to the vehicle's.
    let (axis, negate) = match (frame, way) {
        (_, "error") => return Some(Err("an error, not a measurement".to_owned())),
        ("ship", "forward") => (Axis::X, true),
        ("ship", "starboard") => (Axis::Y, true),
        ("ship", "up") => (Axis::Z, false),
        ("instrument", _) => return Some(Err(INSTRUMENT.to_owned())),
        ("beam", _) => return Some(Err(BEAM.to_owned())),
        ("earth", _) => return Some(Err(WORLD_VELOCITY.to_owned())),
        _ => return None,
    };
    Some(Ok(Claim {
        quantity: Quantity::DvlVelocity(axis),
        strength: 6,
        unit: None,
        negate,
        why: "the bottom's velocity past the vehicle".to_owned(),
        doubt: Some(SHIP.to_owned()),
    }))
}
