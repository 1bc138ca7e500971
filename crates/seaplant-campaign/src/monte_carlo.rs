//! Runs a Monte Carlo study on several threads.

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use schemars::JsonSchema;
use seaplant::monte_carlo::{
    Admission, Assurance, CoefficientRow, Row, Sample, VehicleSample, admissions, assurance,
    sample, sample_vehicle, summarise, summarise_vehicle,
};
use seaplant::twin::{TwinSpec, VehicleTwinSpec};
use seaplant::{Error, IdentifyOptions};
use serde::{Deserialize, Serialize};

use crate::TwinError;
use crate::twin_file::plant_named;

/// Table of a study, with its specification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MonteCarloTable {
    /// Version of Seaplant that made it.
    pub version: String,
    /// Number of twins.
    pub runs: u64,
    /// The twin; that of the first run has its seed.
    pub spec: TwinSpec,
    /// Errors and coverage.
    pub rows: Vec<Row>,
    /// Frequency with which parts were admitted to the model.
    pub admissions: Vec<Admission>,
    /// Frequency with which wrong plants were recommended without warning.
    #[serde(default)]
    pub assurance: Vec<Assurance>,
}

/// Table of a study of a complete vehicle, with its specification.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleMonteCarloTable {
    /// Version of Seaplant that made it.
    pub version: String,
    /// Number of twins.
    pub runs: u64,
    /// The twin; that of the first run has its seed.
    pub spec: VehicleTwinSpec,
    /// Errors and coverage of each coefficient.
    pub coefficients: Vec<CoefficientRow>,
    /// Frequency with which axes were presented without warning although wrong.
    pub assurance: Vec<Assurance>,
    /// Reasons why plants were not identified, by seed.
    pub failures: BTreeMap<u64, String>,
}

/// More threads do not help, and some systems cannot create more.
const MOST_THREADS: usize = 1024;

/// Returns the result of each run, in order, using `threads` threads; `None` once `go_on`, which
/// every thread calls before each run, returns false.
fn study<T: Send, E: Send>(
    runs: u64,
    threads: usize,
    go_on: impl Fn(u64) -> bool + Sync,
    sample: impl Fn(u64) -> Result<T, E> + Sync,
) -> Result<Option<Vec<T>>, E> {
    let threads = threads.clamp(1, MOST_THREADS).min(usize::try_from(runs).unwrap_or(MOST_THREADS));
    let next = AtomicU64::new(0);
    let done: Mutex<Vec<(u64, Result<T, E>)>> = Mutex::default();
    let work = || {
        loop {
            let run = next.fetch_add(1, Ordering::Relaxed);
            if run >= runs || !go_on(run) {
                break;
            }
            let found = sample(run);
            // A poisoned lock means that another thread panicked, which the scope reports.
            if let Ok(mut done) = done.lock() {
                done.push((run, found));
            }
        }
    };
    thread::scope(|scope| (0..threads).for_each(|_| _ = scope.spawn(work)));
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    if (done.len() as u64) < runs {
        return Ok(None);
    }
    done.sort_by_key(|(run, _)| *run);
    done.into_iter().map(|(_, found)| found).collect::<Result<_, _>>().map(Some)
}

/// Makes `runs` twins, with seeds from that of `spec` upwards, fits each with every method, and
/// tabulates the errors.
///
/// The table does not depend on the number of threads. `go_on` is called before each run, by every
/// thread; `None` is returned once it returns false.
///
/// # Errors
/// As [`sample`].
pub fn monte_carlo(
    spec: &TwinSpec,
    options: &IdentifyOptions,
    runs: u64,
    threads: usize,
    go_on: impl Fn(u64) -> bool + Sync,
) -> Result<Option<MonteCarloTable>, Error> {
    let of_run =
        |run| sample(&TwinSpec { seed: spec.seed.wrapping_add(run), ..spec.clone() }, options);
    let Some(samples) = study(runs, threads, go_on, of_run)? else { return Ok(None) };
    let samples: Vec<Sample> = samples.into_iter().flatten().collect();
    let judged = samples.iter().filter_map(|sample| Some((sample.dof, sample.judged?)));
    Ok(Some(MonteCarloTable {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        runs,
        spec: spec.clone(),
        rows: summarise(&samples),
        admissions: admissions(&samples),
        assurance: assurance(&judged.collect::<Vec<_>>()),
    }))
}

/// Makes `runs` twins of a complete vehicle, with seeds from that of `spec` upwards, identifies
/// each, and tabulates the errors of every coefficient.
///
/// The table does not depend on the number of threads; `go_on` is as for [`monte_carlo`].
///
/// # Errors
/// As [`sample_vehicle`], and for a vehicle that cannot be read.
pub fn monte_carlo_of_several_axes(
    spec: &VehicleTwinSpec,
    runs: u64,
    threads: usize,
    go_on: impl Fn(u64) -> bool + Sync,
) -> Result<Option<VehicleMonteCarloTable>, TwinError> {
    let model = plant_named(&spec.vehicle)?;
    let of_run = |run| {
        let spec = VehicleTwinSpec { seed: spec.seed.wrapping_add(run), ..spec.clone() };
        sample_vehicle(&spec, &model)
    };
    let Some(samples) = study(runs, threads, go_on, of_run)? else { return Ok(None) };
    let judged = samples.iter().flat_map(|sample| sample.judged.iter().map(|(dof, x)| (*dof, *x)));
    let why = |sample: &VehicleSample| Some((sample.seed, sample.found.as_ref().err()?.clone()));
    Ok(Some(VehicleMonteCarloTable {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        runs,
        spec: spec.clone(),
        coefficients: summarise_vehicle(&samples),
        assurance: assurance(&judged.collect::<Vec<_>>()),
        failures: samples.iter().filter_map(why).collect(),
    }))
}

#[cfg(test)]
mod tests {
    use seaplant::{Dof, Method};

    use super::*;

    fn study(threads: usize, go_on: impl Fn(u64) -> bool + Sync) -> Option<MonteCarloTable> {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 60.0, ..TwinSpec::jason2() };
        let options =
            IdentifyOptions { methods: vec![Method::EquationError], ..Default::default() };
        monte_carlo(&spec, &options, 4, threads, go_on).expect("a twin that can be")
    }

    #[test]
    fn any_number_of_threads_makes_the_same_table() {
        let table = study(1, |_| true).expect("not stopped");
        assert_eq!(table.rows[0].answers, 4);
        assert_eq!(Some(table), study(3, |_| true));
    }

    #[test]
    fn a_plant_of_several_axes_makes_the_same_table_on_any_number_of_threads() {
        let spec = VehicleTwinSpec {
            axes: vec![Dof::Surge, Dof::Yaw],
            duration_s: 60.0,
            hold_out_s: 60.0,
            ..VehicleTwinSpec::default()
        };
        let study = |threads| {
            monte_carlo_of_several_axes(&spec, 2, threads, |_| true).expect("can be made")
        };
        let table = study(1).expect("not stopped");
        assert!(table.coefficients.iter().all(|row| row.answers == 2), "{table:?}");
        assert_eq!(table.assurance.len(), 6, "{:?}", table.assurance);
        assert_eq!(Some(table), study(2));
    }

    #[test]
    fn a_thousand_million_threads_are_as_many_as_there_are_runs() {
        assert_eq!(study(1_000_000_000, |_| true), study(1, |_| true));
    }

    #[test]
    fn stops_on_request() {
        assert_eq!(study(2, |run| run < 2), None);
    }
}
