//! Infers the unit of angles whose header states none from the values of all angles in their file.

use std::f64::consts::TAU;

use seaplant::Quantity;
use seaplant::quantity::Attitude;
use seaplant_log::{Channel, Log};

use super::claim::{Claim, NO_UNIT};
use crate::remarks::{Remark, looks_like_degrees, remarks, short};

const FRAME: &str =
    "from a quaternion: add negate = true if its axes are those of ROS (y to port, z up)";

/// Sets the unit of roll, pitch and heading without one, where the values of one of them in the
/// same file are unambiguous: an instrument writes all three alike.
pub(super) fn state_units(log: &Log, claims: &mut [(usize, Claim)]) {
    let channel = |index: usize| &log.channels()[index];
    let open: Vec<usize> =
        (0..claims.len()).filter(|&k| is_open(channel(claims[k].0), &claims[k].1)).collect();
    for &k in &open {
        let source = channel(claims[k].0).source;
        let of_file = open.iter().filter(|&&other| channel(claims[other].0).source == source);
        let mut units =
            of_file.filter_map(|&other| unit(channel(claims[other].0), &claims[other].1));
        let Some(unit) = units.next().filter(|first| units.all(|other| other == *first)) else {
            continue;
        };
        let claim = &mut claims[k].1;
        claim.unit = Some(unit);
        claim.why = "by its name, and its unit by the values of the file's angles".to_owned();
        claim.doubt = None;
    }
}

/// Raises the question of the frame of an angle that was computed from a quaternion of the same
/// file.
pub(super) fn ask_frame(log: &Log, channel: &Channel, claim: Claim) -> Claim {
    let of_quaternion = |stem: &str| {
        let is_w = |other: &Channel| {
            let rest = other.name.strip_prefix(stem);
            other.source == channel.source
                && rest.is_some_and(|rest| {
                    rest.trim_start_matches(['.', '_', ' ']).eq_ignore_ascii_case("w")
                })
        };
        log.channels().iter().any(is_w)
    };
    let stem = channel.name.rsplit_once('.').map(|(stem, _)| stem);
    let turns = matches!(claim.quantity, Quantity::Attitude(Attitude::Pitch | Attitude::Heading));
    let doubt = (turns && stem.is_some_and(of_quaternion)).then(|| FRAME.to_owned());
    Claim { doubt: claim.doubt.or(doubt), ..claim }
}

/// Returns whether only the unit of an angle is unknown.
fn is_open(channel: &Channel, claim: &Claim) -> bool {
    matches!(claim.quantity, Quantity::Attitude(_))
        && channel.unit.is_none()
        && claim.unit.is_none()
        && claim.doubt.as_deref() == Some(NO_UNIT)
}

/// Returns the only possible unit of an angle by its values: degrees beyond the range of roll and
/// pitch in radians, else that of the turn by which a heading wraps.
fn unit(channel: &Channel, claim: &Claim) -> Option<&'static str> {
    let Quantity::Attitude(angle) = claim.quantity else { return None };
    let largest = channel.min()?.abs().max(channel.max()?.abs());
    let is_heading = angle == Attitude::Heading;
    if !is_heading && looks_like_degrees(angle, largest) {
        return Some("deg");
    }
    let wraps_by = |turn: f64| {
        let wraps =
            |remark: &Remark| matches!(remark, Remark::Wraps { jump, .. } if *jump == short(turn));
        remarks(channel).iter().any(wraps)
    };
    [(360.0, "deg"), (TAU, "rad")]
        .into_iter()
        .find(|(turn, _)| is_heading && wraps_by(*turn))
        .map(|(_, unit)| unit)
}
