//! Aligns a sender's clock with the receiver's.

/// Offset of a sender's clock, which counts from its start, to the receiver's.
#[derive(Default)]
pub(super) struct Clock {
    /// For each start of the sender, the smallest delay of its clock behind the receiver's, s.
    behind_s: Vec<f64>,
    latest_s: f64,
    /// True if the last stamp was much earlier than the one before.
    went_back: bool,
}

/// A sender's stamp: its time, and the start that it counts from.
#[derive(Clone, Copy)]
pub(super) struct Stamp {
    pub(super) time_s: f64,
    start: Option<usize>,
}

impl Stamp {
    pub(super) const NONE: Self = Self { time_s: f64::NAN, start: None };
}

/// A clock goes back this far only when it restarts, s.
const BACK_S: f64 = 5.0;
/// Largest spread of transmission delays, including clock drift, s.
const LATE_S: f64 = 10.0;
const EARLY_S: f64 = 1.0;

impl Clock {
    /// Adds a stamp that counts from the sender's start.
    pub(super) fn hear(&mut self, time_s: f64, received_s: f64) -> Stamp {
        let back = time_s < self.latest_s - BACK_S;
        if back && !self.went_back {
            // A single early stamp may be an old measurement.
            self.went_back = true;
            return Stamp::NONE;
        }
        let behind_s = received_s - time_s;
        match self.behind_s.last_mut() {
            Some(least) if !back => *least = least.min(behind_s),
            _ => self.behind_s.push(behind_s),
        }
        (self.latest_s, self.went_back) = (time_s, false);
        Stamp { time_s, start: Some(self.behind_s.len() - 1) }
    }

    /// Assigns a stamp that may have another epoch to the current start.
    pub(super) fn place(&self, time_s: f64) -> Stamp {
        Stamp { time_s, start: self.behind_s.len().checked_sub(1) }
    }

    /// Unwraps a stamp whose counter overflows after each `period_s`.
    pub(super) fn unwrap(&self, time_s: f64, period_s: f64) -> f64 {
        time_s + ((self.latest_s - time_s) / period_s).round() * period_s
    }

    /// Converts a stamp to the receiver's clock; `None` where that is impossible.
    pub(super) fn received(&self, stamp: Stamp, received_s: f64) -> Option<f64> {
        let time_s = stamp.time_s + self.behind_s.get(stamp.start?)?;
        (-EARLY_S..=LATE_S).contains(&(received_s - time_s)).then_some(time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quickest_message_sets_the_clock() {
        let mut clock = Clock::default();
        let stamps = [(1.0, 1001.3), (2.0, 1002.1), (3.0, 1003.9)];
        let stamps =
            stamps.map(|(sent_s, received_s)| (clock.hear(sent_s, received_s), received_s));
        let times = stamps.map(|(stamp, received_s)| clock.received(stamp, received_s).unwrap());
        for (time, wanted) in times.iter().zip([1001.1, 1002.1, 1003.1]) {
            assert!((time - wanted).abs() < 1e-9, "{time}");
        }
    }

    #[test]
    fn a_start_anew_has_a_clock_of_its_own() {
        let mut clock = Clock::default();
        let first = clock.hear(500.0, 1500.0);
        let unbelieved = clock.hear(1.0, 1601.0);
        assert!(clock.received(unbelieved, 1601.0).is_none());
        let second = clock.hear(2.0, 1602.0);
        assert_eq!(clock.received(first, 1500.0), Some(1500.0));
        assert_eq!(clock.received(second, 1602.0), Some(1602.0));
    }

    #[test]
    fn a_stamp_that_wraps_is_unwrapped() {
        let mut clock = Clock::default();
        clock.hear(4300.0, 5300.0);
        let period_s = 4294.967296;
        assert!((clock.unwrap(4300.1 - period_s, period_s) - 4300.1).abs() < 1e-9);
    }
}
