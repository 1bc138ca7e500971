//! Tests of the readers by their public functions.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

mod common;
#[path = "../../seaplant/tests/declared.rs"]
mod declared;
#[path = "../../seaplant/tests/imports/mod.rs"]
mod imports;

mod arrow;
mod dataflash;
mod errors;
mod formats;
mod matlab;
mod nmea;
mod notes;
mod numbers;
mod one_way_imports;
mod packed;
mod pd0;
mod properties;
mod real_files;
mod reference;
mod ros;
mod survey;
mod tlog;
mod ulog;
mod xlsx;
