//! Groups files that were logged simultaneously; other files are separate trials.

use std::collections::BTreeSet;
use std::path::Path;

use seaplant_log::{Channel, Epoch, Log};

/// Files of one recording, which together make a trial.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Session {
    /// Indices into the log's sources.
    pub sources: Vec<usize>,
    /// The time of its first sample, in the files' clock, s.
    pub start_s: f64,
    /// The time of its last sample, s.
    pub end_s: f64,
}

impl Session {
    /// Creates a session of one file; if it has no samples, the start is after the end.
    pub fn new(log: &Log, source: usize) -> Self {
        let alone =
            Self { sources: vec![source], start_s: f64::INFINITY, end_s: f64::NEG_INFINITY };
        let times = |(_, channel): (usize, &Channel)| {
            Some((*channel.time_s().first()?, *channel.time_s().last()?))
        };
        let spans: Vec<(f64, f64)> = alone.channels(log).filter_map(times).collect();
        let start_s = spans.iter().map(|span| span.0).fold(f64::INFINITY, f64::min);
        let end_s = spans.iter().map(|span| span.1).fold(f64::NEG_INFINITY, f64::max);
        Self { start_s, end_s, ..alone }
    }

    /// Iterates over its channels, with their indices in the log.
    pub fn channels<'a>(&self, log: &'a Log) -> impl Iterator<Item = (usize, &'a Channel)> {
        let sources = self.sources.clone();
        let all = log.channels().iter().enumerate();
        all.filter(move |(_, channel)| sources.contains(&channel.source))
    }
}

/// Groups files: those that overlap in time were logged simultaneously, unless they share most of
/// their columns and each counts time from its own start, as recordings of one kind at several
/// times do.
pub(crate) fn sessions(log: &Log) -> Vec<Session> {
    let mut found: Vec<Session> = Vec::new();
    for source in 0..log.sources().len() {
        let alone = Session::new(log, source);
        let (start_s, end_s) = (alone.start_s, alone.end_s);
        if start_s > end_s {
            continue;
        }
        let folder = |source: usize| log.sources()[source].path.parent().map(Path::to_owned);
        // Instruments may log to separate folders; a folder of several files is a recording.
        let others = (0..log.sources().len()).filter(|&other| other != source);
        let loner = others.into_iter().all(|other| folder(other) != folder(source));
        let joins = |session: &&mut Session| {
            let together = start_s <= session.end_s && session.start_s <= end_s;
            let near =
                loner || session.sources.iter().any(|&other| folder(other) == folder(source));
            let repeats = session.sources.iter().any(|&other| {
                are_alike(log, other, source)
                    && !(is_of_calendar(log, other) && is_of_calendar(log, source))
            });
            together && near && !repeats
        };
        match found.iter_mut().rev().find(joins) {
            Some(session) => {
                session.sources.push(source);
                session.start_s = session.start_s.min(start_s);
                session.end_s = session.end_s.max(end_s);
            }
            None => found.push(alone),
        }
    }
    found
}

/// Returns whether a file's clock counts from 1970, so that an overlap is real.
fn is_of_calendar(log: &Log, source: usize) -> bool {
    log.sources()[source].epoch == Epoch::Unix
}

/// Returns whether two files share more than half of their columns.
pub(crate) fn are_alike(log: &Log, one: usize, other: usize) -> bool {
    let columns = |source: usize| -> BTreeSet<&str> {
        let of_file = log.channels().iter().filter(|channel| channel.source == source);
        of_file.map(|channel| channel.column.as_str()).collect()
    };
    let (one, other) = (columns(one), columns(other));
    2 * one.intersection(&other).count() > one.len().min(other.len())
}
