//! The commands, one a file.

use seaplant_log::{Channel, ReadOptions, Stamp, TimeColumn};

use crate::args::{MessageStamp, Reading};

pub mod compare;
pub mod completions;
pub mod control;
pub mod demo;
pub mod export;
pub mod identify;
pub mod init;
pub mod inspect;
pub mod man;
mod manoeuvre;
pub mod monte_carlo;
#[cfg(not(target_family = "wasm"))]
mod named_plan;
#[cfg(not(target_family = "wasm"))]
pub mod page;
#[cfg(not(target_family = "wasm"))]
pub mod plan;
pub mod plant;
pub mod plot;
pub mod predict;
pub mod schema;
pub mod simulate;
pub mod thruster;
pub mod twin;
pub mod validate;
pub mod vehicle;
#[cfg(not(target_family = "wasm"))]
pub mod watch;

/// Returns whether a channel's column contains one of some words, ignoring case; true without
/// words.
fn is_wanted(channel: &Channel, only: &[String]) -> bool {
    contains_any(&channel.column, only)
}

fn contains_any(column: &str, only: &[String]) -> bool {
    let column = column.to_lowercase();
    only.is_empty() || only.iter().any(|word| column.contains(&word.to_lowercase()))
}

/// Converts the user's options of reading logs.
fn read_options(reading: &Reading) -> ReadOptions {
    ReadOptions {
        time: reading.time.clone().map(|column| TimeColumn { column: Some(column), unit: None }),
        equal_sampling_hz: reading.equal_sampling_hz,
        sheet: reading.sheet.clone(),
        stamp: match reading.stamp {
            MessageStamp::Header => Stamp::Header,
            MessageStamp::Receive => Stamp::Receive,
        },
        ..Default::default()
    }
}
