//! The commands, one a file.

pub mod completions;
pub mod demo;
pub mod identify;
pub mod init;
pub mod inspect;
pub mod man;
pub mod monte_carlo;
pub mod schema;
pub mod simulate;
pub mod thruster;
pub mod twin;
pub mod validate;
