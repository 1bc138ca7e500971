//! Tests the complete program, run as a user runs it.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

mod bad_files;
mod bad_results;
mod book;
mod bounds;
mod cases;
mod clocks;
mod compare;
mod control;
mod dataflash;
mod demo;
mod export;
mod formats;
mod known_forces;
mod look;
mod memory;
mod methods;
mod overwriting;
mod page;
mod plan;
mod predict;
mod proposed;
mod real_data;
mod ros;
mod settings;
mod several_axes;
mod snapshots;
mod tables;
mod terminal;
mod watch;
mod workshop;
mod writing;
