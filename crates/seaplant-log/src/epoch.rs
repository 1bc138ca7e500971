//! Epochs of times, inferred from the magnitude of the times where the file does not state them.

use std::ops::Range;

pub(crate) const DAY_S: f64 = 86_400.0;

/// Epoch of a file's times.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub enum Epoch {
    /// The start of 1970, UTC.
    Unix,
    /// The midnight before the log, of an unknown day.
    Midnight,
    /// The start of the vehicle's computer.
    Start {
        /// The time of the start, s since 1970, if satellite navigation reported it.
        since_1970_s: Option<f64>,
    },
    /// The file states no epoch.
    #[default]
    Unstated,
}

/// The years 2000 to 2100 in seconds since 1970: no clock with another epoch has run that long.
const THIS_CENTURY_S: Range<f64> = 946_684_800.0..4_102_444_800.0;

impl Epoch {
    /// Infers the epoch from the first time of a log, s.
    pub(crate) fn of_time(first_s: f64) -> Self {
        if THIS_CENTURY_S.contains(&first_s) { Self::Unix } else { Self::Unstated }
    }
}

/// 1 January 1970 in MATLAB's count of days from the year 0.
pub(crate) const UNIX_EPOCH_DAY: f64 = 719_529.0;

/// Returns whether times without a unit are calendar days: all between the years 1950 and 2100, and
/// closer together than a log's samples can be in seconds.
pub(crate) fn are_datenums(time: &[f64], period: f64) -> bool {
    const YEARS: Range<f64> = 712_224.0..767_011.0;
    const NEAR: f64 = 1e-3;
    period < NEAR && time.iter().all(|time| YEARS.contains(time))
}

/// Returns the note on times that are calendar days.
pub(crate) fn datenums_in_words(column: &str) -> String {
    format!(
        "days of the calendar in {column:?} (datenum), taken as UTC: seconds since the Unix epoch"
    )
}

/// Returns the unit, in seconds and by name, of times without a stated unit that can only count
/// from 1970.
pub(crate) fn unit_since_1970(time: &[f64]) -> Option<(f64, &'static str)> {
    const UNITS: [(f64, &str); 3] =
        [(1e-3, "milliseconds"), (1e-6, "microseconds"), (1e-9, "nanoseconds")];
    let fits =
        |&(second, _): &(f64, &str)| time.iter().all(|t| THIS_CENTURY_S.contains(&(t * second)));
    UNITS.into_iter().find(fits).filter(|_| !time.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn magnitude_determines_counts_from_1970() {
        assert_eq!(Epoch::of_time(1_700_000_000.0), Epoch::Unix);
        assert_eq!(Epoch::of_time(86_399.0), Epoch::Unstated);
        assert_eq!(unit_since_1970(&[1.7e12, 1.7e12 + 100.0]), Some((1e-3, "milliseconds")));
        assert_eq!(unit_since_1970(&[1.7e18]), Some((1e-9, "nanoseconds")));
        assert_eq!(unit_since_1970(&[1.7e9]), None);
        assert_eq!(unit_since_1970(&[1.7e12, 5.0]), None);
    }
}
