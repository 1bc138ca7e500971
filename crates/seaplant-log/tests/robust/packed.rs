//! Gzip and zstd archives.

use seaplant_log::ReadOptions;

use crate::common::python::made;
use crate::harness::{Limits, hammer};

#[test]
fn archives() {
    let Some(made) = made("packed") else { return };
    // A table packs to less than a byte per sample.
    let limits = Limits { samples_per_byte: 100.0, ..Limits::default() };
    for name in ["seed.gz", "seed.zst"] {
        let seed = std::fs::read(made.file(name)).unwrap();
        hammer(name, &seed, &ReadOptions::default(), limits, |_| {});
    }
}
