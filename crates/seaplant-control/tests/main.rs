//! Tests of controllers by their public functions.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

#[path = "../../seaplant/tests/declared.rs"]
mod declared;
mod vehicle;

mod c_header;
mod loops;
mod margins;
