//! Progress bars: for reading logs the amount, speed and remaining time; for fits the current one,
//! their number and the remaining time.

mod left;

use std::io::{IsTerminal, Write as _, stderr};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use seaplant::Stage;
use seaplant::results::Identification;
use seaplant_campaign::Campaign;
use seaplant_log::{Progress, progress};
use serde_json::json;

use crate::output::Output;

/// Duration below which no bar is shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// Interval of updates.
const STEP: Duration = Duration::from_millis(100);

/// Reads logs with a bar in a terminal, unless `quiet`.
pub fn watched<T>(output: Output, read: impl FnOnce() -> T) -> T {
    let before = progress();
    under_a_bar(output, read, |wait| show_reading(before, wait))
}

/// Expected duration from which it is announced, s.
const WORTH_SAYING_S: f64 = 10.0;

/// Makes the fits of a campaign with progress: first announces a long duration, then shows the
/// remaining time.
pub fn fitted(output: Output, campaign: &Campaign, command: &str) -> Identification {
    if output.progress {
        return fitted_in_lines(campaign, command);
    }
    if is_silent(output) {
        return campaign.identify(command);
    }
    let stages = campaign.stages();
    let expected = left::total(&stages);
    if expected.1 > WORTH_SAYING_S {
        // If standard error is closed there is nothing else to do.
        let _ = writeln!(anstream::stderr(), "{}", announced(&stages, expected));
    }
    let now = Mutex::new(Pace { stage: None, before: Duration::ZERO, since: Instant::now() });
    let pace = || now.lock().unwrap_or_else(PoisonError::into_inner);
    let mut watch = |stage: &Stage| {
        let mut pace = pace();
        let (stage, before) = (Some(stage.clone()), pace.elapsed());
        *pace = Pace { stage, before, since: Instant::now() };
    };
    under_a_bar(
        output,
        || campaign.identify_watched(command, &mut watch),
        |wait| show_fits(&stages, || pace().clone(), wait),
    )
}

/// Makes the fits of a campaign, and prints a line of JSON on standard error before each: its
/// number, the total, its axes and method, and the least and most time left, s.
fn fitted_in_lines(campaign: &Campaign, command: &str) -> Identification {
    let stages = campaign.stages();
    let start = Instant::now();
    campaign.identify_watched(command, &mut |stage: &Stage| {
        let left_s = left::left(&stages, stage.done, start.elapsed().as_secs_f64(), 0.0);
        let (done, of) = (stage.done, stages.len());
        let (axes, method) = (&stage.axes, stage.method.name());
        let line = json!({
            "done": done, "of": of, "axes": axes, "method": method, "left_s": [left_s.0, left_s.1],
        });
        // If standard error is closed there is nothing else to do.
        let _ = writeln!(anstream::stderr(), "{line}");
    })
}

/// Formats `8 fits of up to 9602 samples each; expected to take 2 s to 1 min`.
fn announced(stages: &[Stage], expected: (f64, f64)) -> String {
    let (fits, samples) = (stages.len(), stages.iter().map(|s| s.samples).max().unwrap_or(0));
    let fits = if fits == 1 { "1 fit".to_owned() } else { format!("{fits} fits") };
    format!(
        "{fits} of up to {samples} samples each; expected to take {}",
        left::formatted(expected)
    )
}

/// Writes a report with a bar.
pub fn written<T>(output: Output, write: impl FnOnce() -> T) -> T {
    under_a_bar(output, write, |wait| {
        let bar = ProgressBar::new_spinner().with_elapsed(PATIENCE);
        bar.set_style(style("writing the report; {elapsed} so far"));
        while wait.recv_timeout(STEP) == Err(RecvTimeoutError::Timeout) {
            bar.tick();
        }
        bar.finish_and_clear();
    })
}

/// Progress of the fits.
#[derive(Clone, Debug)]
struct Pace {
    /// The current fit.
    stage: Option<Stage>,
    /// Time of the completed fits.
    before: Duration,
    since: Instant,
}

impl Pace {
    fn elapsed(&self) -> Duration {
        self.before + self.since.elapsed()
    }
}

fn is_silent(output: Output) -> bool {
    output.quiet || output.json || !stderr().is_terminal()
}

/// Runs work and shows its progress if it takes long and output is visible.
fn under_a_bar<T>(
    output: Output,
    work: impl FnOnce() -> T,
    show: impl FnOnce(&Receiver<()>) + Send,
) -> T {
    if is_silent(output) {
        return work();
    }
    thread::scope(|scope| {
        let (done, wait) = channel();
        scope.spawn(move || {
            if wait.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                show(&wait);
            }
        });
        let result = work();
        drop(done);
        result
    })
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Shows the current fit and the remaining time until the other end of `wait` is dropped.
fn show_fits(stages: &[Stage], pace: impl Fn() -> Pace, wait: &Receiver<()>) {
    let bar = ProgressBar::new(stages.len() as u64).with_elapsed(PATIENCE);
    bar.set_style(style("{bar:30} {pos} of {len} fits, {msg}"));
    while wait.recv_timeout(STEP) == Err(RecvTimeoutError::Timeout) {
        let pace = pace();
        let Some(Stage { axes, method, done, .. }) = pace.stage else { continue };
        let names: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
        let (before, now) = (pace.before.as_secs_f64(), pace.since.elapsed().as_secs_f64());
        let left = left::formatted(left::left(stages, done, before, now));
        bar.set_position(done as u64);
        bar.set_message(format!("{} by {method}; {left} left", names.join(", ")));
    }
    bar.finish_and_clear();
}

/// Shows how much was read until the other end of `wait` is dropped.
fn show_reading(before: Progress, wait: &Receiver<()>) {
    let reading = style("{bar:30} {bytes}/{total_bytes} read, {bytes_per_sec}, {eta} left");
    let done = style("{bar:30} {bytes} read; decoding");
    let bar = ProgressBar::new(0);
    // The bar also counts what was read before it appeared.
    let bar = bar.with_elapsed(PATIENCE);
    while wait.recv_timeout(STEP) == Err(RecvTimeoutError::Timeout) {
        let now = progress();
        let of = now.of.saturating_sub(before.of);
        let read = now.read.saturating_sub(before.read).min(of);
        bar.set_style(if read < of { reading.clone() } else { done.clone() });
        bar.set_length(of);
        bar.set_position(read);
    }
    bar.finish_and_clear();
}
