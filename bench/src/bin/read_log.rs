//! Reads a log, and prints how long that took and what it held: `read_log FILE`.

use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use seaplant_log::{ReadOptions, read};

fn main() -> anyhow::Result<()> {
    let path = std::env::args().nth(1).context("which file?")?;
    let start = Instant::now();
    let log = read(Path::new(&path), &ReadOptions::default())?;
    let elapsed = start.elapsed().as_secs_f64();
    let samples: usize = log.channels().iter().map(|channel| channel.len()).sum();
    let sum: f64 = log.channels().iter().flat_map(|channel| channel.values()).sum();
    println!("read_s {elapsed}");
    println!("channels {}", log.channels().len());
    println!("samples {samples}");
    println!("sum {sum:e}");
    Ok(())
}
