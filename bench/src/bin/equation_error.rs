//! Equation error of a long surge trial, timed: the Rust side of `side_by_side/run.sh`.
//!
//! `equation_error make FILE N` writes N velocities, then N forces, as little-endian
//! doubles. `equation_error time FILE` fits them once and prints one `name value` a line.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use seaplant::estimate::EquationError;
use seaplant_bench::SurgeSignals;

const SEED: u64 = 1;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", file, n] => make(file, n.parse().context("N is a number of samples")?),
        ["time", file] => time(file),
        _ => bail!("use: equation_error make FILE N, or: equation_error time FILE"),
    }
}

fn make(file: &str, n: usize) -> Result<()> {
    let signals = SurgeSignals::seeded(n, SEED)?;
    let mut out = BufWriter::new(File::create(file).with_context(|| file.to_owned())?);
    for x in signals.v.iter().chain(&signals.tau) {
        out.write_all(&x.to_le_bytes())?;
    }
    Ok(out.flush()?)
}

fn read(file: &str) -> Result<SurgeSignals> {
    let bytes = std::fs::read(file).with_context(|| file.to_owned())?;
    let (doubles, _) = bytes.as_chunks::<8>();
    let mut v: Vec<f64> = doubles.iter().map(|x| f64::from_le_bytes(*x)).collect();
    let tau = v.split_off(v.len() / 2);
    Ok(SurgeSignals { v, tau })
}

fn time(file: &str) -> Result<()> {
    let signals = read(file)?;
    println!("memory_s {:e}", streaming_s(&signals));
    let started = Instant::now();
    let record = signals.record()?;
    println!("record_s {:e}", started.elapsed().as_secs_f64());

    let started = Instant::now();
    let uniform = record.uniform(0)?;
    println!("uniform_s {:e}", started.elapsed().as_secs_f64());
    drop(uniform);

    let started = Instant::now();
    let fit = EquationError::default().fit(&[record])?;
    println!("fit_s {:e}", started.elapsed().as_secs_f64());

    println!("alpha {:e}", fit.lumped.alpha);
    println!("beta {:e}", fit.lumped.beta);
    println!("bias {:e}", fit.lumped.bias);
    println!("condition {:e}", fit.condition);
    println!("residual_rms {:e}", fit.residual_rms);
    Ok(())
}

/// Measures how long it takes to read both signals from memory once: the best of three.
fn streaming_s(signals: &SurgeSignals) -> f64 {
    let once = |_| {
        let started = Instant::now();
        std::hint::black_box(lane_sum(&signals.v) + lane_sum(&signals.tau));
        started.elapsed().as_secs_f64()
    };
    (0..3).map(once).fold(f64::INFINITY, f64::min)
}

/// Sums in eight lanes, so that memory is the bottleneck.
fn lane_sum(x: &[f64]) -> f64 {
    let mut lanes = [0.0; 8];
    for eight in x.as_chunks::<8>().0 {
        lanes.iter_mut().zip(eight).for_each(|(lane, x)| *lane += x);
    }
    lanes.iter().sum()
}
