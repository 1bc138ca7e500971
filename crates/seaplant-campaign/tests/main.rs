//! Tests of campaigns by their public functions.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

mod common;
#[path = "../../seaplant/tests/declared.rs"]
mod declared;
#[path = "../../seaplant/tests/imports/mod.rs"]
mod imports;
#[allow(dead_code, reason = "these tests use a part of it")]
#[path = "../../seaplant-log/tests/common/mcap.rs"]
mod mcap;

mod autopilot;
mod boat;
mod campaign;
mod clocks;
mod growing_log;
mod hard_logs;
mod inspect;
mod one_way_imports;
mod presets;
mod propose;
mod propose_ros;
