//! Reads whatever bytes the fuzzer finds. Formats are told by content, so that one target does for
//! all of them, steered by the files that it starts from; see `scripts/fuzz`.
#![no_main]

mod checks;

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use seaplant_log::{Error, ReadOptions, Stamp, is_guarded, read_bytes};

/// The fuzzer ends at every panic, but those of other crates' readers are caught.
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
    // A table without a column of time, perhaps.
    if check(&mended, &ReadOptions::default()).is_err() {
        let equal_sampling_hz = Some(10.0);
        let _ = check(&mended, &ReadOptions { equal_sampling_hz, stamp: Stamp::Receive, ..ReadOptions::default() });
    }
});
