//! Order of rows by time.

use std::sync::Arc;

use crate::log::median_period;

/// The times of rows.
pub(crate) enum Times {
    /// Strictly increasing, one for each row, as in a clean log.
    Clean(Arc<[f64]>),
    /// Sorted, each with its row; rows may be late, repeat a time or lack one.
    Rough(Vec<(f64, usize)>),
}

impl Times {
    /// Iterates over pairs of successive times.
    pub(crate) fn steps(&self) -> Box<dyn Iterator<Item = [f64; 2]> + '_> {
        match self {
            Self::Clean(times) => Box::new(times.windows(2).map(|w| [w[0], w[1]])),
            Self::Rough(times) => Box::new(times.windows(2).map(|w| [w[0].0, w[1].0])),
        }
    }
}

/// Irregular rows of one kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Oddity {
    pub(crate) count: usize,
    /// First of them.
    pub(crate) row: usize,
}

impl Oddity {
    fn from_rows(rows: impl Iterator<Item = usize> + Clone) -> Option<Self> {
        Some(Self { row: rows.clone().min()?, count: rows.count() })
    }
}

/// Properties of the order of rows.
pub(crate) struct Order {
    pub(crate) times: Times,
    /// Rows without a time.
    pub(crate) timeless: Option<Oddity>,
    /// Rows earlier than one before them, and the largest difference, s.
    pub(crate) late: Option<(Oddity, f64)>,
    /// Rows that repeat the time of another.
    pub(crate) repeated: Option<Oddity>,
    /// Number of distinct times.
    pub(crate) distinct: usize,
    /// Median time between distinct times, s; `None` for fewer than two.
    pub(crate) period_s: Option<f64>,
}

/// A clock that went back and stayed behind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reset {
    /// First row after it.
    pub(crate) row: usize,
    /// Time after it, s.
    pub(crate) from_s: f64,
    /// Latest time before it, s.
    pub(crate) to_s: f64,
}

impl Order {
    /// Examines the times of successive rows, `NaN` where a row has none.
    ///
    /// # Errors
    /// [`Reset`].
    pub(crate) fn new(time_s: &[f64]) -> Result<Self, Reset> {
        let increasing = time_s.windows(2).all(|w| w[0] < w[1]);
        if increasing && time_s.iter().all(|time| time.is_finite()) {
            let (distinct, period_s) = (time_s.len(), median_period(time_s));
            let times = Times::Clean(time_s.into());
            return Ok(Self {
                times,
                timeless: None,
                late: None,
                repeated: None,
                distinct,
                period_s,
            });
        }
        let all = || time_s.iter().copied().enumerate();
        let timeless =
            Oddity::from_rows(all().filter(|(_, time)| !time.is_finite()).map(|(row, _)| row));
        let timed: Vec<(usize, f64)> = all().filter(|(_, time)| time.is_finite()).collect();
        let late = late(&timed)?;
        let mut sorted: Vec<(f64, usize)> =
            timed.into_iter().map(|(row, time)| (time, row)).collect();
        // Ties are broken by row, so that the first in the file comes first.
        sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let repeats = sorted.windows(2).filter(|w| w[0].0 == w[1].0).map(|w| w[1].1);
        let repeated = Oddity::from_rows(repeats);
        let mut distinct: Vec<f64> = sorted.iter().map(|(time, _)| *time).collect();
        distinct.dedup();
        let (count, period_s) = (distinct.len(), median_period(&distinct));
        let times = Times::Rough(sorted);
        Ok(Self { times, timeless, late, repeated, distinct: count, period_s })
    }
}

/// Finds late rows: those with a later time in an earlier row.
///
/// `times` holds the rows that have a time, in the order of the file. A run of late rows is a
/// reset if it is longer than a tenth of the log, or lasts to the end; a single late row never is.
fn late(times: &[(usize, f64)]) -> Result<Option<(Oddity, f64)>, Reset> {
    let mut latest = f64::NEG_INFINITY;
    let mut late: Option<Oddity> = None;
    let mut backwards_by_s = 0.0_f64;
    // The current run of late rows.
    let mut run = None;
    let mut length = 0;
    for (k, &(row, time)) in times.iter().enumerate() {
        if time >= latest {
            (latest, run, length) = (time, None, 0);
            continue;
        }
        late.get_or_insert(Oddity { count: 0, row }).count += 1;
        length += 1;
        backwards_by_s = backwards_by_s.max(latest - time);
        let reset = *run.get_or_insert(Reset { row, from_s: latest, to_s: time });
        let lasts = k + 1 == times.len() || 10 * length > times.len();
        if length > 1 && lasts {
            return Err(reset);
        }
    }
    Ok(late.map(|late| (late, backwards_by_s)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_late_rows_are_counted() {
        let order = Order::new(&[0.0, 1.0, 1.0, 2.0]).unwrap();
        assert_eq!((order.late, order.distinct), (None, 3));
        assert_eq!(order.repeated, Some(Oddity { count: 1, row: 2 }));
        let order = Order::new(&[0.0, 5.0, 4.0, 6.0, 6.5, 6.0]).unwrap();
        assert_eq!(order.late, Some((Oddity { count: 2, row: 2 }, 1.0)));
    }

    #[test]
    fn many_late_rows_and_a_late_end_are_a_reset() {
        let with = |late: usize| {
            let mut times: Vec<f64> = (0..50).map(f64::from).collect();
            times.extend((0..late).map(|k| 40.0 + 0.1 * k as f64));
            times.extend((50..100 - late).map(|k| k as f64));
            Order::new(&times)
        };
        assert!(with(10).is_ok());
        assert_eq!(with(11).err(), Some(Reset { row: 50, from_s: 49.0, to_s: 40.0 }));
        assert!(Order::new(&[0.0, 1.0, 2.0, 3.0, 0.0, 1.0]).is_err());
    }

    #[test]
    fn rows_without_a_time_are_counted() {
        let order = Order::new(&[0.0, f64::NAN, 2.0, f64::INFINITY]).unwrap();
        assert_eq!(order.timeless, Some(Oddity { count: 2, row: 1 }));
        let Times::Rough(times) = order.times else { panic!("a row has no time") };
        assert_eq!(times, [(0.0, 0), (2.0, 2)]);
    }
}
