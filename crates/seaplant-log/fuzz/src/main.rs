//! Reads whatever bytes the fuzzer finds. Formats are told by content, so that one target does for
//! all of them, steered by the files that it starts from.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use seaplant_log::{ReadOptions, is_guarded, read_bytes};

/// The fuzzer ends at every panic, but those of other crates' readers are caught.
fn pass_over_guarded_panics() {
    let end = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !is_guarded() {
            end(panic);
        }
    }));
}

fuzz_target!(init: pass_over_guarded_panics(), |bytes: &[u8]| {
    let Ok(log) = read_bytes(Path::new("fuzzed"), bytes, &ReadOptions::default()) else { return };
    for channel in log.channels() {
        assert!(channel.time_s().windows(2).all(|w| w[0] < w[1]));
        assert!(channel.time_s().iter().chain(channel.values()).all(|x| x.is_finite()));
    }
});
