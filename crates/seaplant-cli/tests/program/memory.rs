//! Memory consumption with a long log.

use std::process::{Command, Stdio};
use std::time::Duration;

use crate::workshop::Workshop;

/// Limit for eight hours at 10 Hz at its peak, in bytes, by the default methods: 127 to 150 MB were seen.
const MOST_BYTES: f64 = 170e6;

#[test]
fn eight_hours_at_10_hz_are_identified_in_170_mb() {
    if !cfg!(target_os = "linux") {
        eprintln!("skipped: the peak of a program's memory is read where Linux tells it");
        return;
    }
    let peak = peak_bytes(8 * 3600);
    assert!(peak < MOST_BYTES, "{:.0} MB", peak / 1e6);
}

/// Returns the peak memory of identifying a twin's surge trial of 12 channels.
fn peak_bytes(seconds: u32) -> f64 {
    let workshop = Workshop::empty();
    let spec = format!("duration_s = {seconds}\nhold_out_s = 120\ndofs = [\"surge\"]\n");
    workshop.write("spec.toml", spec);
    workshop.success(&["twin", "spec.toml", "--out", "log", "--quiet"]);
    let mut program = Command::new(env!("CARGO_BIN_EXE_seaplant"))
        .current_dir(workshop.path())
        .args(["identify", "log/campaign.toml", "--out", "found", "--quiet"])
        // What glibc keeps for each thread varies at random by 20 MB.
        .env("MALLOC_ARENA_MAX", "1")
        .stdin(Stdio::null())
        .spawn()
        .expect("the program starts");
    let mut peak = 0.0;
    loop {
        peak = peak_so_far(program.id()).unwrap_or(peak);
        if let Some(status) = program.try_wait().expect("it can be waited for") {
            assert!(status.success(), "{status}");
            return peak;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// Returns the peak so far; `None` once the program has ended.
fn peak_so_far(process: u32) -> Option<f64> {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024.0 * kibibytes)
}
