//! A bar for what takes a while: how much of the logs was read, how fast, how long it will take.

use std::io::{IsTerminal, stderr};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use seaplant_log::{Progress, progress};

use crate::output::Output;

/// What is done sooner needs no bar.
const PATIENCE: Duration = Duration::from_secs(1);

/// How often the bar moves.
const STEP: Duration = Duration::from_millis(100);

/// Reads logs under the eye of the user: with a bar in a terminal, unless less was asked for.
pub fn watched<T>(output: Output, read: impl FnOnce() -> T) -> T {
    if output.quiet || output.json || !stderr().is_terminal() {
        return read();
    }
    let before = progress();
    thread::scope(|scope| {
        let (done, wait) = channel();
        scope.spawn(move || show(before, &wait));
        let result = read();
        drop(done);
        result
    })
}

/// Shows a bar until the other end of `wait` is gone.
fn show(before: Progress, wait: &Receiver<()>) {
    if wait.recv_timeout(PATIENCE) != Err(RecvTimeoutError::Timeout) {
        return;
    }
    let style = |template| {
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
    };
    let reading = style("{bar:30} {bytes}/{total_bytes} read, {bytes_per_sec}, {eta} left");
    let done = style("{bar:30} {bytes} read; going through them");
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
