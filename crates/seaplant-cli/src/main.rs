//! seaplant
fn main() {}
