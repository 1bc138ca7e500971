//! Output error of a surge trial, timed: the Rust side of `side_by_side_output_error/run.sh`.
//!
//! `output_error make FILE N` writes N velocities, then N forces, as little-endian doubles, and to
//! FILE.start the initial values of every program: α, β, μ, bias and v₀. `output_error time FILE
//! TIMES` fits them that many times and prints one `name value` per line.

use std::fs::File;
use std::hint::black_box;
use std::io::{BufWriter, Write};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use seaplant::estimate::{EquationError, OutputError, Records};
use seaplant::{AxisRecord, LumpedParameters, Terms};
use seaplant_bench::SurgeSignals;

const SEED: u64 = 1;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["make", file, n] => make(file, n.parse().context("N is a number of samples")?),
        ["time", file, times] => time(file, times.parse().context("TIMES is a number")?),
        _ => bail!("use: output_error make FILE N, or: output_error time FILE TIMES"),
    }
}

fn terms() -> Terms {
    "force,quadratic,linear,bias".parse().expect("a plant")
}

fn start(record: &[AxisRecord]) -> Result<LumpedParameters> {
    Ok(EquationError::default().fit(Records::from(record).with_terms(terms()))?.lumped)
}

fn make(file: &str, n: usize) -> Result<()> {
    let signals = SurgeSignals::seeded(n, SEED)?;
    let mut out = BufWriter::new(File::create(file).with_context(|| file.to_owned())?);
    for x in signals.v.iter().chain(&signals.tau) {
        out.write_all(&x.to_le_bytes())?;
    }
    out.flush()?;
    let first = signals.v[0];
    let LumpedParameters { alpha, beta, mu, bias } = start(&[signals.record()?])?;
    let start = format!("{alpha:e} {beta:e} {mu:e} {bias:e} {first:e}\n");
    Ok(std::fs::write(format!("{file}.start"), start)?)
}

fn read(file: &str) -> Result<SurgeSignals> {
    let bytes = std::fs::read(file).with_context(|| file.to_owned())?;
    let (doubles, _) = bytes.as_chunks::<8>();
    let mut v: Vec<f64> = doubles.iter().map(|x| f64::from_le_bytes(*x)).collect();
    let tau = v.split_off(v.len() / 2);
    Ok(SurgeSignals { v, tau })
}

fn read_start(file: &str) -> Result<LumpedParameters> {
    let text = std::fs::read_to_string(format!("{file}.start"))?;
    let numbers: Vec<f64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
    let [alpha, beta, mu, bias, _] = numbers[..] else { bail!("{file}.start has five numbers") };
    Ok(LumpedParameters { alpha, beta, mu, bias })
}

fn time(file: &str, times: usize) -> Result<()> {
    let record = [read(file)?.record()?];
    let near = read_start(file)?;
    let records = Records::from(&record).with_terms(terms());
    let fit = |near: &LumpedParameters| OutputError::default().fit_from(black_box(records), near);
    for k in 0..times {
        let started = Instant::now();
        let found = fit(&near)?;
        let fit_s = started.elapsed().as_secs_f64();
        if k == 0 {
            let LumpedParameters { alpha, beta, mu, bias } = found.lumped;
            println!("alpha {alpha:e}\nbeta {beta:e}\nmu {mu:e}\nbias {bias:e}");
            println!("cold_s {fit_s:e}");
        }
        println!("fit_s {fit_s:e}");
        let started = Instant::now();
        fit(&start(&record)?)?;
        println!("whole_s {:e}", started.elapsed().as_secs_f64());
    }
    Ok(())
}
