//! Reads arbitrary bytes from the fuzzer. Formats are detected from content, so one target serves
//! all of them; the seed files steer it. See `scripts/fuzz`.
#![no_main]

mod checks;

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use seaplant_log::{Error, ReadOptions, Stamp, is_guarded, read_bytes};

/// Stops the fuzzer from ending at panics of other crates' readers, which are caught.
fn pass_over_guarded_panics() {
    let end = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !is_guarded() {
            end(panic);
        }
    }));
}

fn check(bytes: &[u8], options: &ReadOptions) -> Result<(), Error> {
    let log = read_bytes(Path::new("fuzzed"), bytes, options)?;
    checks::channels_are_sound(log.channels()).unwrap();
    Ok(())
}

fuzz_target!(init: pass_over_guarded_panics(), |bytes: &[u8]| {
    let mut mended = bytes.to_vec();
    checks::mend(&mut mended);
    if mended != bytes {
        let _ = check(bytes, &ReadOptions::default());
    }
    // Possibly a table without a time column.
    if check(&mended, &ReadOptions::default()).is_err() {
        let equal_sampling_hz = Some(10.0);
        let _ = check(&mended, &ReadOptions { equal_sampling_hz, stamp: Stamp::Receive, ..ReadOptions::default() });
    }
});
