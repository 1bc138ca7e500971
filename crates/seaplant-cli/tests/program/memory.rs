//! Memory consumption with a long log.

use std::process::{Command, Stdio};
use std::time::Duration;

use crate::workshop::Workshop;

/// Limit for a day at 10 Hz at its peak, in bytes, by the default methods.
const MOST_BYTES_A_DAY: f64 = 215e6;

const SAMPLES_A_DAY: f64 = 864_000.0;

/// Durations of two logs, s; their difference cancels fixed costs.
const LOGS_S: [u32; 2] = [2 * 3600, 8 * 3600];

#[test]
fn a_day_at_10_hz_is_identified_in_215_mb() {
    if !cfg!(target_os = "linux") {
        eprintln!("skipped: the peak of a program's memory is read where Linux tells it");
        return;
    }
    let [short, long] = LOGS_S.map(peak_bytes);
    let [first, last] = LOGS_S.map(|seconds| 10.0 * f64::from(seconds));
    let a_sample = (long - short) / (last - first);
    let a_day = short + (SAMPLES_A_DAY - first) * a_sample;
    assert!(a_day < MOST_BYTES_A_DAY, "{a_sample:.0} bytes a sample, {:.0} MB a day", a_day / 1e6);
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
