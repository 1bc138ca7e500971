//! Converts the notes of a reader to caveats of a trial.

use std::collections::BTreeSet;
use std::path::Path;

use seaplant::{Caveat, CaveatCode};
use seaplant_log::{Log, Note};

use crate::Error;
use crate::campaign_file::{ChannelMap, TrialEntry};

/// Fraction of missing cells from which a caveat is a warning.
const SMALL_PART: f64 = 0.01;

/// Returns the notes on a log as caveats of its trial.
pub(crate) fn doubts(entry: &TrialEntry, log: &Log, channels: &ChannelMap) -> Vec<Caveat> {
    let places = channels.values().filter_map(|mapped| log.place(&mapped.column).ok());
    let used: BTreeSet<(&Path, &str)> = places
        .map(|place| &log.channels()[place])
        .map(|channel| (log.sources()[channel.source].path.as_path(), channel.column.as_str()))
        .collect();
    log.notes().iter().map(|note| doubt(entry, note, &used)).collect()
}

/// Grades a note by its consequences: a wrong unit of time scales mass by its square, and cells that
/// are left out may all have one sign.
fn doubt(entry: &TrialEntry, note: &Note, used: &BTreeSet<(&Path, &str)>) -> Caveat {
    let message = format!("trial `{}`: {note}", entry.name);
    let lost = match note {
        Note::TimeUnitReplaced { .. } => {
            return Caveat::warning(CaveatCode::SuspiciousUnit, message);
        }
        Note::NotANumber { path, column, count, rows, .. }
            if used.contains(&(path.as_path(), column.as_str())) =>
        {
            *count as f64 / *rows as f64
        }
        Note::MissingTime { count, rows, .. } => *count as f64 / *rows as f64,
        _ => 0.0,
    };
    if lost > SMALL_PART {
        let message = format!("{message} ({:.0} % of its rows); correct the log", 100.0 * lost);
        return Caveat::warning(CaveatCode::Log, message);
    }
    Caveat::note(CaveatCode::Log, message)
}

/// Rejects a log whose time has no unit and cannot be in seconds.
///
/// # Errors
/// [`Error::Value`] where no channel of a file has more than a sample in ten seconds.
pub(crate) fn check_time_units(path: &Path, entry: &TrialEntry, log: &Log) -> Result<(), Error> {
    /// Lowest sample rate of motion from which a plant can be identified, Hz.
    const SLOWEST_HZ: f64 = 0.1;
    for note in log.notes() {
        let (Note::TimeUnitAssumed { path: file, column, period_s }, Some(unit)) =
            (note, note.likely_time_unit())
        else {
            continue;
        };
        let own = log.channels().iter().filter(|c| log.sources()[c.source].path == *file);
        if own.filter_map(|channel| channel.rate_hz()).any(|rate_hz| rate_hz >= SLOWEST_HZ) {
            continue;
        }
        let reason = format!(
            "{}: the time column {column:?} states no unit, and in seconds its rows would be {period_s} s apart: is it {unit}? Add time = {{ unit = \"{unit}\" }} to the campaign, or unit = \"s\" if it is in seconds",
            file.display()
        );
        return Err(Error::value(path, format!("trial `{}`", entry.name), reason));
    }
    Ok(())
}
