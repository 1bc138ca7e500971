//! Reading a log, timed: the Rust side of `side_by_side_logs/run.sh`.
//!
//! `read_log FILE` reads it once into channels and prints one `name value` a line.

use std::path::Path;
use std::time::Instant;

use anyhow::{Result, bail};
use seaplant_log::{ReadOptions, Stamp, read};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file] = &arguments[..] else { bail!("use: read_log FILE") };
    let options = ReadOptions { stamp: Stamp::Receive, ..ReadOptions::default() };
    let started = Instant::now();
    let log = read(Path::new(file), &options)?;
    println!("read_s {:e}", started.elapsed().as_secs_f64());
    let samples: usize = log.channels().iter().map(|channel| channel.len()).sum();
    let total: f64 = log.channels().iter().flat_map(|channel| channel.values()).sum();
    println!("channels {}\nsamples {samples}\nsum {total:e}", log.channels().len());
    Ok(())
}
