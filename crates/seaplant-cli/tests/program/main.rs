//! The whole program, run as a user runs it.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

mod bad_files;
mod bad_results;
mod book;
mod clocks;
mod compare;
mod dataflash;
mod demo;
mod formats;
mod memory;
mod methods;
mod proposed;
mod real_data;
mod ros;
mod snapshots;
mod tables;
mod terminal;
mod watch;
mod workshop;
mod writing;
