//! Tests of plans by their public functions.

#[path = "../../seaplant/tests/declared.rs"]
mod declared;
#[path = "../../seaplant/tests/imports/mod.rs"]
mod imports;

mod one_way_imports;
mod plans;
