//! Parquet and Arrow files.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn parquet_files() {
    let Some(made) = made("arrow") else { return };
    for codec in ["none", "snappy", "zstd", "lz4", "gzip"] {
        let seed = std::fs::read(made.file(&format!("seed-{codec}.parquet"))).unwrap();
        let name = format!("parquet-{codec}");
        hammer(&name, &seed, &ReadOptions::default(), Limits::default(), |_| {});
    }
}

#[test]
fn arrow_files() {
    let Some(made) = made("arrow") else { return };
    for file in ["seed-uncompressed.arrow", "seed-lz4.arrow", "seed-zstd.arrow", "seed.arrows"] {
        let seed = std::fs::read(made.file(file)).unwrap();
        hammer(file, &seed, &ReadOptions::default(), Limits::default(), |_| {});
    }
}
