//! A thousand bootstrap fits of output error to a 600 s trial, timed on every processor:
//! `cargo run --release -p seaplant-bench --bin bootstrap [DRAWS] [THREADS]`.

use std::num::NonZero;
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result};
use seaplant::estimate::{EquationError, OutputError, OutputErrorBootstrap, Records};
use seaplant::{LumpedParameters, Terms};
use seaplant_bench::SurgeSignals;

const SEED: u64 = 1;
const ROUNDS: usize = 5;

/// 600 s at 10 Hz, both ends included.
const TRIAL_ROWS: usize = 6001;

fn main() -> Result<()> {
    let mut numbers = std::env::args().skip(1).map(|x| x.parse::<u64>().context("a number"));
    let draws = numbers.next().transpose()?.unwrap_or(1000);
    let processors = thread::available_parallelism().map_or(1, NonZero::get) as u64;
    let threads = numbers.next().transpose()?.unwrap_or(processors).max(1);

    let record = [SurgeSignals::seeded(TRIAL_ROWS, SEED)?.record()?];
    let terms: Terms = "force,quadratic,linear,bias".parse()?;
    let records = Records::from(&record).with_terms(terms);
    let start = EquationError::default().fit(records)?.lumped;
    let (fit, bootstrap) = OutputErrorBootstrap::of(records, &start, &OutputError::default())?;
    for _ in 0..ROUNDS {
        let started = Instant::now();
        let drawn = all_draws(&bootstrap, draws, threads);
        let all_s = started.elapsed().as_secs_f64();
        let again = bootstrap.fit_with(&fit, &drawn)?;
        let ratio = (again.covariance[(0, 0)] / fit.covariance[(0, 0)]).sqrt();
        println!(
            "{} of {draws} fits of {TRIAL_ROWS} samples on {threads} threads: {all_s:.3} s; std of α {ratio:.2} times the sandwich's",
            drawn.len()
        );
    }
    Ok(())
}

/// Distributes the draws over the threads in turn.
fn all_draws(bootstrap: &OutputErrorBootstrap, draws: u64, threads: u64) -> Vec<LumpedParameters> {
    let of = |first: u64| {
        (first..draws)
            .step_by(threads as usize)
            .filter_map(|number| bootstrap.draw(SEED, number))
            .collect::<Vec<_>>()
    };
    thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|first| scope.spawn(move || of(first))).collect();
        // A thread that panicked has printed the reason; the count reveals missing draws.
        running.into_iter().flat_map(|thread| thread.join().unwrap_or_default()).collect()
    })
}
