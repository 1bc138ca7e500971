//! Readers stand whatever a file holds: see `harness.rs`.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

#[path = "../common/mod.rs"]
mod common;
mod harness;

mod packed;
mod ros;
mod text;
mod xlsx;
