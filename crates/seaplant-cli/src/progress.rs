//! A bar for what takes a while: how much of the logs was read, how fast, how long it will take;
//! which fit is made, how many there are, and how long they will take.

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

/// What is done sooner needs no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// How often the bar moves.
const STEP: Duration = Duration::from_millis(100);

/// Reads logs under the eye of the user: with a bar in a terminal, unless less was asked for.
pub fn watched<T>(output: Output, read: impl FnOnce() -> T) -> T {
    let before = progress();
    under_a_bar(output, read, |wait| show_reading(before, wait))
}

/// What may take longer than this, s, is said before.
const WORTH_SAYING_S: f64 = 10.0;

/// Makes the fits of a campaign under the eye of the user: says before what they may take, where
/// that is long, and then how long they will.
pub fn fitted(output: Output, campaign: &Campaign, command: &str) -> Identification {
    if output.progress {
        return fitted_in_lines(campaign, command);
    }
    if is_silent(output) {
        return campaign.identify(command);
    }
    let stages = campaign.stages();
    let expected = left::whole(&stages);
    if expected.1 > WORTH_SAYING_S {
        // Standard error that is gone cannot be helped.
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

/// Makes the fits of a campaign, and prints a line of JSON on standard error before each: its number,
/// the number of all, its axes and method, and the least and most time left, s.
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
        // Standard error that is gone cannot be helped.
        let _ = writeln!(anstream::stderr(), "{line}");
    })
}

/// `8 fits of up to 9602 samples each; expected to take 2 s to 1 min`.
fn announced(stages: &[Stage], expected: (f64, f64)) -> String {
    let (fits, samples) = (stages.len(), stages.iter().map(|s| s.samples).max().unwrap_or(0));
    let fits = if fits == 1 { "1 fit".to_owned() } else { format!("{fits} fits") };
    format!("{fits} of up to {samples} samples each; expected to take {}", left::spoken(expected))
}

/// Writes a report under the eye of the user.
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

/// How far the fits have come.
#[derive(Clone, Debug)]
struct Pace {
    /// The fit that was begun last.
    stage: Option<Stage>,
    /// What those took that are done.
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

/// Works, and shows how it goes meanwhile, if that takes a while and is to be seen.
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

/// Shows which fit is made, and how long all will take, until the other end of `wait` is gone.
fn show_fits(stages: &[Stage], pace: impl Fn() -> Pace, wait: &Receiver<()>) {
    let bar = ProgressBar::new(stages.len() as u64).with_elapsed(PATIENCE);
    bar.set_style(style("{bar:30} {pos} of {len} fits, {msg}"));
    while wait.recv_timeout(STEP) == Err(RecvTimeoutError::Timeout) {
        let pace = pace();
        let Some(Stage { axes, method, done, .. }) = pace.stage else { continue };
        let names: Vec<&str> = axes.iter().map(|dof| dof.name()).collect();
        let (before, now) = (pace.before.as_secs_f64(), pace.since.elapsed().as_secs_f64());
        let left = left::spoken(left::left(stages, done, before, now));
        bar.set_position(done as u64);
        bar.set_message(format!("{} by {method}; {left} left", names.join(", ")));
    }
    bar.finish_and_clear();
}

/// Shows how much was read until the other end of `wait` is gone.
fn show_reading(before: Progress, wait: &Receiver<()>) {
    let reading = style("{bar:30} {bytes}/{total_bytes} read, {bytes_per_sec}, {eta} left");
    let done = style("{bar:30} {bytes} read; decoding");
    let bar = ProgressBar::new(0);
    // Of what was read before the bar came, too.
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
