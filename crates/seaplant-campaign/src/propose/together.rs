//! Detects axes that a trial moves together, which a plant of several axes explains.

use seaplant::quantity::{Attitude, Axis};
use seaplant::{Dof, Quantity};
use seaplant_log::Log;

use super::activity::{Series, Window, customary, velocity};
use crate::columns::{Mapped, Mapping, Session};

/// Steered axes; roll and pitch follow.
const STEERED: [Dof; 4] = [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw];
/// Fewer axes may be one axis and its effects on others.
const FEWEST: usize = 3;
/// Minimum size of an axis that counts as moved, as a multiple of a typical one, and as a fraction
/// of the size of the axis that moves most.
const LEAST_SIZE: f64 = 1.0;
const LEAST_PART: f64 = 0.25;

/// Returns the steered axes that move together in a window, if there are at least three.
pub(super) fn moved(log: &Log, session: &Session, mapped: &[Mapped], window: &Window) -> Vec<Dof> {
    let is_measured = |dof: Dof| {
        dof.is_rotation() || mapped.iter().any(|mapped| is_velocity(mapped.quantity(), dof))
    };
    let moves = |dof: Dof| {
        let velocity = velocity(log, session, mapped, dof).filter(|_| is_measured(dof))?;
        Some(velocity.within(window)).filter(|velocity| !velocity.is_empty())
    };
    let turn = moves(Dof::Yaw);
    let size = |dof: Dof| {
        let velocity = moves(dof)?;
        let swings = |turn: &Series| !dof.is_rotation() && velocity.swings_with(turn);
        let size = velocity.rms() / customary(dof);
        Some((dof, if turn.as_ref().is_some_and(swings) { 0.0 } else { size }))
    };
    let sizes: Vec<(Dof, f64)> = STEERED.into_iter().filter_map(size).collect();
    let largest = sizes.iter().map(|(_, size)| *size).fold(0.0, f64::max);
    let takes_part = |size: f64| size >= LEAST_SIZE.max(LEAST_PART * largest);
    let moved: Vec<Dof> =
        sizes.into_iter().filter(|(_, size)| takes_part(*size)).map(|(dof, _)| dof).collect();
    if moved.len() < FEWEST { Vec::new() } else { moved }
}

/// Returns whether a quantity is the velocity of a translation in body axes.
fn is_velocity(quantity: &Quantity, dof: Dof) -> bool {
    let axis = match dof {
        Dof::Surge => Axis::X,
        Dof::Sway => Axis::Y,
        _ => Axis::Z,
    };
    *quantity == Quantity::Velocity(dof) || *quantity == Quantity::DvlVelocity(axis)
}

/// Returns whether the velocity of each translation and all three angles are measured, as a plant
/// of six axes needs.
pub(super) fn measures_all(mapping: &Mapping) -> bool {
    let translations = [Dof::Surge, Dof::Sway, Dof::Heave];
    let angles = [Attitude::Roll, Attitude::Pitch, Attitude::Heading];
    translations.into_iter().all(|dof| mapping.has(|quantity| is_velocity(quantity, dof)))
        && angles.into_iter().all(|angle| mapping.has(|x| *x == Quantity::Attitude(angle)))
}
