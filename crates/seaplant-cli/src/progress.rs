//! A bar for what takes a while: how much of the logs was read, how fast, how long it will take;
//! which fit is made, and how many are left.

use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use seaplant::Stage;
use seaplant_log::{Progress, progress};

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

/// Makes fits under the eye of the user: `fit` tells of each.
pub fn fitting<T>(output: Output, fit: impl FnOnce(&mut dyn FnMut(Stage)) -> T) -> T {
    let now: Mutex<Option<Stage>> = Mutex::new(None);
    let stage = || now.lock().unwrap_or_else(PoisonError::into_inner);
    under_a_bar(
        output,
        || fit(&mut |next| *stage() = Some(next)),
        |wait| {
            show_fits(|| *stage(), wait);
        },
    )
}

/// Works, and shows how it goes meanwhile, if that takes a while and is to be seen.
fn under_a_bar<T>(
    output: Output,
    work: impl FnOnce() -> T,
    show: impl FnOnce(&Receiver<()>) + Send,
) -> T {
    if output.quiet || output.json || !stderr().is_terminal() {
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

/// Shows which fit is made until the other end of `wait` is gone.
fn show_fits(stage: impl Fn() -> Option<Stage>, wait: &Receiver<()>) {
    let bar = ProgressBar::new(0).with_elapsed(PATIENCE);
    bar.set_style(style("{bar:30} {pos} of {len} fits, {msg}; {elapsed} so far"));
    while wait.recv_timeout(STEP) == Err(RecvTimeoutError::Timeout) {
        let Some(Stage { dof, method, done, of }) = stage() else { continue };
        bar.set_length(of as u64);
        bar.set_position(done as u64);
        bar.set_message(format!("{dof} by {method}"));
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
