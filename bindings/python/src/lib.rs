//! The native half of the Python package `seaplant`: handles to logs, vehicles, trials and
//! results, and the functions of the library on them.
//!
//! Nothing is computed here. Numbers are exchanged as NumPy arrays, everything else as the JSON
//! that files hold, so that Python has the same names, defaults and checks as files have; the typed
//! half in `python/seaplant` makes dataclasses of it. Long work runs on a separate thread without
//! Python's lock, while the caller's thread checks for Ctrl-C.
//!
//! The code that PyO3's macros generate is the only exception to this workspace's ban on unsafe
//! code; none is written here.

mod campaign;
mod control;
mod convert;
mod log;
mod online;
mod plant;
mod results;
mod schema;
mod shards;
mod thruster;
mod trial;
mod twin;
mod vehicle;

/// The native half of the package `seaplant`.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use crate::campaign::{Campaign, method_names};
    #[pymodule_export]
    use crate::control::Controller;
    #[pymodule_export]
    use crate::log::{Log, calendar_second, is_quantity, time_column};
    #[pymodule_export]
    use crate::online::Online;
    #[pymodule_export]
    use crate::plant::{Plant, state_names};
    #[pymodule_export]
    use crate::results::{Results, follow_thrusters, rounded, steady_drag};
    #[pymodule_export]
    use crate::schema::{schema, version};
    #[pymodule_export]
    use crate::shards::{Shards, shard_clock, shard_margin_s};
    #[pymodule_export]
    use crate::thruster::{fit_bench_points, fit_bench_table};
    #[pymodule_export]
    use crate::trial::Trial;
    #[pymodule_export]
    use crate::twin::{Twin, monte_carlo, read_twin_spec};
    #[pymodule_export]
    use crate::vehicle::Vehicle;
}
