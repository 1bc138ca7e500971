//! Tests of the library by its public functions.
#![allow(clippy::print_stderr, reason = "a skipped test must be seen")]

mod imports;
mod release;

mod against_scipy;
mod alien_plants;
mod alien_ship;
mod alien_torpedo;
mod caveats;
mod clock;
mod declared;
mod filter_error_twin;
mod identify;
mod information_against_pyomo;
mod mistakes;
mod one_fit_of_everything;
mod one_way_imports;
mod online;
mod online_allocations;
mod output_error;
mod output_error_against_scipy;
mod output_error_coverage;
mod output_error_twin;
mod plant_cases;
mod regressions_against_numpy;
mod regressions_with_noise;
mod rudders;
mod supply_voltage;
mod twin_bias;
mod usv;
mod vehicle_twin;
mod without_velocity;
mod yaw;
