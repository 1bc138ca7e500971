//! Recognises the quantities in the columns of logs by names, units and values.

use seaplant::Quantity;
use seaplant_log::Log;

mod afloat;
mod angles;
mod autopilot;
mod claim;
mod mapping;
mod names;
mod pd0;
mod px4;
mod ros;
mod ros_field;
mod ros_thruster;
mod session;

pub(crate) use autopilot::{is_reversed, preset};
pub(crate) use mapping::{Mapped, Mapping, map};
pub(crate) use ros_thruster::UNTOLD;
pub(crate) use session::{Session, are_alike, sessions};

/// A column and its recognised quantity.
pub(crate) struct Recognised {
    pub quantity: Quantity,
    /// Index into the log's channels.
    pub channel: usize,
    /// The unit, where the header does not state it.
    pub unit: Option<&'static str>,
    pub negate: bool,
}

/// Recognises the columns of each file by their names.
pub(crate) fn recognise(log: &Log) -> Vec<Vec<Recognised>> {
    let files: Vec<Session> =
        (0..log.sources().len()).map(|file| Session::new(log, file)).collect();
    let of_file = |mapped: Vec<Mapped>| {
        let recognised = mapped.into_iter().map(|Mapped { claim, channel, .. }| Recognised {
            quantity: claim.quantity,
            channel,
            unit: claim.unit,
            negate: claim.negate,
        });
        recognised.collect()
    };
    map(log, &files).sessions.into_iter().map(of_file).collect()
}
