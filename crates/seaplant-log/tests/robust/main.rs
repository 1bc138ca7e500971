//! Readers handle any content of a file: see `harness.rs`.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

#[path = "../../fuzz/src/checks.rs"]
mod checks;
#[allow(dead_code, reason = "these tests use a part of it")]
#[path = "../common/mod.rs"]
mod common;
mod harness;
mod hostile;

mod arrow;
mod corpus;
mod dataflash;
mod matlab;
mod nmea;
mod packed;
mod pd0;
mod ros;
mod survey;
mod text;
mod tlog;
mod ulog;
mod xlsx;
