//! Damages files at random and checks that reading them neither panics, nor hangs, nor uses memory
//! out of proportion to the file.
//!
//! Seeded, so that failures are reproducible; the bytes that failed are kept in the target folder.
//! `SEAPLANT_ROBUST_SECONDS=600` runs each seed file for that long instead of [`ROUNDS`] times.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

use seaplant_log::{Channel, Log, Note, ReadOptions, Thoroughness, read_bytes, survey};

use crate::checks::channels_are_sound;

/// Number of damaged copies of each seed file.
const ROUNDS: u64 = 2000;

/// Number of damaged files per survey.
const SURVEY_EVERY: u64 = 3;

/// Limits of a reader's resources.
#[derive(Clone, Copy)]
pub struct Limits {
    /// Processor time for one file: elapsed time depends on other processes.
    pub time: Duration,
    /// Samples per byte of the file. Formats that pack more densely than a byte per sample need
    /// more.
    pub samples_per_byte: f64,
    /// Address space, as multiples of the file, in addition to [`SPARE_BYTES`].
    pub memory_factor: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { time: Duration::from_secs(5), samples_per_byte: 2.0, memory_factor: 100 }
    }
}

/// Memory that a reader may use however small the file; the allocator reserves some for each new
/// thread.
const SPARE_BYTES: u64 = 256 << 20;

/// Memory is measured for the whole process.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// Damages `seed` in many ways and reads each copy. `repair` recomputes checksums and the like
/// every other time, so that both the check and the decoder are reached.
pub fn hammer(
    name: &str,
    seed: &[u8],
    options: &ReadOptions,
    limits: Limits,
    repair: impl Fn(&mut Vec<u8>),
) {
    run(name, seed, options, limits, |mut bytes, round| {
        if round % 2 == 0 {
            repair(&mut bytes);
        }
        bytes
    });
}

/// Damages `seed`, a part of a file, in many ways, and reads the complete file that `wrap` makes of
/// it.
pub fn hammer_within(
    name: &str,
    seed: &[u8],
    options: &ReadOptions,
    limits: Limits,
    wrap: impl Fn(&[u8]) -> Vec<u8>,
) {
    run(name, seed, options, limits, |part, _| wrap(&part));
}

/// Reads a file unchanged; returns the log, if it is one.
pub fn replay(name: &str, bytes: &[u8], options: &ReadOptions, limits: Limits) -> Option<Log> {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    check(name, bytes, options, limits, 0)
}

fn run(
    name: &str,
    seed: &[u8],
    options: &ReadOptions,
    limits: Limits,
    finish: impl Fn(Vec<u8>, u64) -> Vec<u8>,
) {
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let seconds = std::env::var("SEAPLANT_ROBUST_SECONDS").ok();
    let seconds = seconds.map(|text| Duration::from_secs(text.parse().expect("whole seconds")));
    let (start, mut round) = (Instant::now(), 0);
    check(name, &finish(seed.to_vec(), 1), options, limits, 0);
    while seconds.map_or(round < ROUNDS, |seconds| start.elapsed() < seconds) {
        round += 1;
        let mut dice = Dice(round);
        let mut bytes = seed.to_vec();
        for _ in 0..=dice.below(4) {
            damage(&mut bytes, &mut dice);
        }
        check(name, &finish(bytes, round), options, limits, round);
    }
    if seconds.is_some() {
        eprintln!("{name}: {round} damaged files in {:.0} s", start.elapsed().as_secs_f64());
    }
}

/// Reads one file, and keeps it if the reader fails; returns the log, if it is one.
fn check(
    name: &str,
    bytes: &[u8],
    options: &ReadOptions,
    limits: Limits,
    round: u64,
) -> Option<Log> {
    let (start, before) = (cpu_time(), peak_bytes());
    let path = Path::new("damaged");
    let read = catch_unwind(AssertUnwindSafe(|| read_bytes(path, bytes, options)));
    // For most formats this reads the file once more.
    let surveyed = catch_unwind(AssertUnwindSafe(|| match round % SURVEY_EVERY {
        0 => survey_bytes(name, bytes, options),
        _ => Default::default(),
    }));
    let (elapsed, peak) = (cpu_time() - start, peak_bytes());
    let Ok(read) = read else { fail(name, bytes, round, "the reader panicked") };
    let Ok(surveyed) = surveyed else { fail(name, bytes, round, "the survey panicked") };
    if elapsed > limits.time {
        fail(name, bytes, round, &format!("the reader took {:.1} s", elapsed.as_secs_f64()));
    }
    if peak > before + SPARE_BYTES + limits.memory_factor * bytes.len() as u64 {
        let taken = (peak - before) >> 20;
        fail(name, bytes, round, &format!("the reader took {taken} MiB for {} bytes", bytes.len()));
    }
    match read {
        Ok(log) => {
            if let Err(reason) = sound(log.channels(), log.notes(), bytes.len(), limits) {
                fail(name, bytes, round, &reason);
            }
            if let Err(reason) = sound(&surveyed.0, &surveyed.1, bytes.len(), limits) {
                fail(name, bytes, round, &format!("surveyed: {reason}"));
            }
            Some(log)
        }
        Err(error) => {
            let message = error.to_string();
            if message.len() > 4000 {
                fail(name, bytes, round, &format!("a message of {} bytes", message.len()));
            }
            None
        }
    }
}

/// Returns the channels and notes of a survey in small parts; none if it fails.
fn survey_bytes(name: &str, bytes: &[u8], options: &ReadOptions) -> (Vec<Channel>, Vec<Note>) {
    const HOW: Thoroughness = Thoroughness { whole_up_to: 0, parts: 2, part_bytes: 1000 };
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("surveyed-{name}"));
    std::fs::write(&path, bytes).expect("the target folder can be written");
    let Ok(survey) = survey(&path, options, HOW) else { return Default::default() };
    let channels = survey.channels().iter().map(|channel| channel.read.clone());
    (channels.collect(), survey.notes().to_vec())
}

/// Checks the invariants of every log.
fn sound(channels: &[Channel], notes: &[Note], bytes: usize, limits: Limits) -> Result<(), String> {
    let samples: usize = channels.iter().map(|channel| channel.len()).sum();
    if samples as f64 > limits.samples_per_byte * bytes as f64 {
        return Err(format!("{samples} samples from {bytes} bytes"));
    }
    channels_are_sound(channels)?;
    let notes: usize = notes.iter().map(|note| note.to_string().len()).sum();
    if notes > 100_000 + 10 * bytes {
        return Err(format!("notes of {notes} bytes"));
    }
    Ok(())
}

fn fail(name: &str, bytes: &[u8], round: u64, reason: &str) -> ! {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("damaged-{name}-{round}"));
    std::fs::write(&path, bytes).expect("the target folder can be written");
    panic!("{name}, round {round}: {reason}; the file is {}", path.display());
}

/// Returns the processor time of this process, to a hundredth of a second, the unit of Linux;
/// elsewhere the elapsed time since it started.
fn cpu_time() -> Duration {
    static START: OnceLock<Instant> = OnceLock::new();
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // The name of the program, in brackets, may hold blanks; fields 14 and 15 are user and system
    // time.
    let fields = stat.rsplit_once(") ").map(|(_, rest)| rest.split(' ').skip(11).take(2));
    let ticks: Option<u64> = fields.map(|two| two.filter_map(|n| n.parse::<u64>().ok()).sum());
    ticks.map_or_else(
        || START.get_or_init(Instant::now).elapsed(),
        |n| Duration::from_millis(10 * n),
    )
}

/// Returns the peak address space of this process; 0 where the system does not report it.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:"));
    let kilobytes =
        line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
    kilobytes.map_or(0, |kilobytes| kilobytes << 10)
}

/// Sebastiano Vigna's SplitMix64.
pub struct Dice(pub u64);

impl Dice {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }
}

/// Applies one random damage.
fn damage(bytes: &mut Vec<u8>, dice: &mut Dice) {
    if bytes.is_empty() {
        bytes.push(dice.next() as u8);
        return;
    }
    let at = dice.below(bytes.len());
    let length = 1 + dice.below(64).min(bytes.len() - at - 1);
    match dice.below(10) {
        0..=2 => bytes[at] ^= 1 << dice.below(8),
        3 => bytes[at] = dice.next() as u8,
        4 => bytes.truncate(at),
        5 => extreme_number(bytes, at, dice),
        6 => drop(bytes.drain(at..at + length)),
        7 => {
            let piece = bytes[at..at + length].to_vec();
            let to = dice.below(bytes.len());
            bytes.splice(to..to, piece);
        }
        8 => {
            let piece = bytes[at..at + length].to_vec();
            let to = dice.below(bytes.len() - length + 1);
            bytes[to..to + length].copy_from_slice(&piece);
        }
        _ => bytes[at..at + length].fill(if dice.below(2) == 0 { 0 } else { 0xff }),
    }
}

/// Writes an implausible length, count or offset.
fn extreme_number(bytes: &mut [u8], at: usize, dice: &mut Dice) {
    let width = [1, 2, 4, 8][dice.below(4)].min(bytes.len() - at);
    let len = bytes.len() as u64;
    let numbers = [0, 1, u64::MAX, u64::MAX >> 1, 1 << 31, 1 << 24, len, len - 1, 0xffff, 0x7fff];
    let number = numbers[dice.below(numbers.len())];
    let number = if dice.below(2) == 0 { number.to_le_bytes() } else { number.to_be_bytes() };
    let from = if number[0] == 0 { 8 - width } else { 0 };
    bytes[at..at + width].copy_from_slice(&number[from..from + width]);
}
