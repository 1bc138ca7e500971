//! What times count from, told by their size where nothing else tells.

use std::ops::Range;

pub(crate) const DAY_S: f64 = 86_400.0;

/// What the times of a file count from.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub enum Epoch {
    /// The start of 1970, UTC.
    Unix,
    /// The midnight before the log, of a day that is not told.
    Midnight,
    /// The start of the vehicle's computer.
    Start {
        /// When that was, s since 1970, where satellites told.
        since_1970_s: Option<f64>,
    },
    /// Nothing that the file states.
    #[default]
    Unstated,
}

/// The years 2000 to 2100 in seconds since 1970: a clock of any other kind has run that long
/// never.
const THIS_CENTURY_S: Range<f64> = 946_684_800.0..4_102_444_800.0;

impl Epoch {
    /// By the size of the first time of a log, s.
    pub(crate) fn of_time(first_s: f64) -> Self {
        if THIS_CENTURY_S.contains(&first_s) { Self::Unix } else { Self::Unstated }
    }
}

/// 1 January 1970 in the days that MATLAB counts from the year 0.
pub(crate) const UNIX_EPOCH_DAY: f64 = 719_529.0;

/// Whether times without a unit are days of the calendar: all between the years 1950 and 2100, and
/// nearer to each other than a log's samples can be in seconds.
pub(crate) fn are_datenums(time: &[f64], period: f64) -> bool {
    const YEARS: Range<f64> = 712_224.0..767_011.0;
    const NEAR: f64 = 1e-3;
    period < NEAR && time.iter().all(|time| YEARS.contains(time))
}

/// What is said of times that are days of the calendar.
pub(crate) fn datenums_in_words(column: &str) -> String {
    format!(
        "days of the calendar in {column:?} (datenum), taken as UTC: seconds since the Unix epoch"
    )
}

/// The unit of times without one that can only be a count since 1970: its seconds, and its name.
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
    fn size_tells_what_only_1970_can_explain() {
        assert_eq!(Epoch::of_time(1_700_000_000.0), Epoch::Unix);
        assert_eq!(Epoch::of_time(86_399.0), Epoch::Unstated);
        assert_eq!(unit_since_1970(&[1.7e12, 1.7e12 + 100.0]), Some((1e-3, "milliseconds")));
        assert_eq!(unit_since_1970(&[1.7e18]), Some((1e-9, "nanoseconds")));
        assert_eq!(unit_since_1970(&[1.7e9]), None);
        assert_eq!(unit_since_1970(&[1.7e12, 5.0]), None);
    }
}
