//! A Monte Carlo study on as many threads as are wanted.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use schemars::JsonSchema;
use seaplant::monte_carlo::{
    Admission, Assurance, Row, Sample, admissions, assurance, sample, summarise,
};
use seaplant::twin::TwinSpec;
use seaplant::{Error, IdentifyOptions};
use serde::{Deserialize, Serialize};

/// The table of a study, and what it was made from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MonteCarloTable {
    /// Version of Seaplant that made it.
    pub version: String,
    /// How many twins.
    pub runs: u64,
    /// The twin; that of the first run has its seed.
    pub spec: TwinSpec,
    /// Errors and coverage.
    pub rows: Vec<Row>,
    /// How often parts were taken into the model.
    pub admissions: Vec<Admission>,
    /// How often recommended plants were presented as what they are not.
    #[serde(default)]
    pub assurance: Vec<Assurance>,
}

/// The number of a run, and what came of it.
type RunOf = (u64, Result<Vec<Sample>, Error>);

/// More threads than this help nowhere, and some systems make no more.
const MOST_THREADS: usize = 1024;

/// Makes `runs` twins, with seeds from that of `spec` upwards, fits each with every method,
/// and says how far off they are.
///
/// The table is the same whatever the number of threads. `go_on` is asked before each run,
/// by every thread; `None` comes back once it says no.
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
    let threads = threads.clamp(1, MOST_THREADS).min(usize::try_from(runs).unwrap_or(MOST_THREADS));
    let next = AtomicU64::new(0);
    let done: Mutex<Vec<RunOf>> = Mutex::default();
    let work = || {
        loop {
            let run = next.fetch_add(1, Ordering::Relaxed);
            if run >= runs || !go_on(run) {
                break;
            }
            let samples =
                sample(&TwinSpec { seed: spec.seed.wrapping_add(run), ..spec.clone() }, options);
            // A poisoned lock means that another thread panicked; the scope tells.
            if let Ok(mut done) = done.lock() {
                done.push((run, samples));
            }
        }
    };
    thread::scope(|scope| (0..threads).for_each(|_| _ = scope.spawn(work)));
    let mut done = done.into_inner().unwrap_or_else(|poisoned| poisoned.into_inner());
    if (done.len() as u64) < runs {
        return Ok(None);
    }
    done.sort_by_key(|(run, _)| *run);
    let mut samples = Vec::new();
    for (_, of_seed) in done {
        samples.extend(of_seed?);
    }
    Ok(Some(MonteCarloTable {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        runs,
        spec: spec.clone(),
        rows: summarise(&samples),
        admissions: admissions(&samples),
        assurance: assurance(&samples),
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
    fn a_thousand_million_threads_are_as_many_as_there_are_runs() {
        assert_eq!(study(1_000_000_000, |_| true), study(1, |_| true));
    }

    #[test]
    fn stops_when_it_is_told_to() {
        assert_eq!(study(2, |run| run < 2), None);
    }
}
