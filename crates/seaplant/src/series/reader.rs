//! Sequential reading of series.

use super::Timed;

/// A reader with the results of [`Timed::at`], without a search, at times that never decrease.
#[derive(Clone, Debug)]
pub(crate) struct Reader<'a> {
    series: &'a Timed,
    /// Index of the first sample after the last requested time.
    after: usize,
}

impl<'a> Reader<'a> {
    /// Creates a reader that starts before sample `after`.
    pub(super) fn from(series: &'a Timed, after: usize) -> Self {
        Self { series, after }
    }

    pub(crate) fn at(&mut self, t_s: f64) -> f64 {
        self.pass(t_s);
        self.series.before(self.after, t_s)
    }

    /// Returns the value of [`Timed::held_at`].
    pub(crate) fn held_at(&mut self, t_s: f64) -> f64 {
        self.pass(t_s);
        self.series.values[self.after.max(1) - 1]
    }

    fn pass(&mut self, t_s: f64) {
        while self.series.time_s.get(self.after).is_some_and(|t| *t <= t_s) {
            self.after += 1;
        }
    }
}

/// The integral ∫ x dt of a held signal from a start time, at times that never decrease.
pub(super) struct HeldIntegral<'a> {
    series: &'a Timed,
    held: usize,
    to_held: f64,
}

impl<'a> HeldIntegral<'a> {
    pub(super) fn from(series: &'a Timed, t_s: f64) -> Self {
        let held = series.time_s().partition_point(|&t| t <= t_s).max(1) - 1;
        Self { series, held, to_held: 0.0 }
    }

    pub(super) fn up_to(&mut self, t_s: f64) -> f64 {
        let (time_s, values) = (self.series.time_s(), self.series.values());
        while self.held + 1 < values.len() && time_s[self.held + 1] <= t_s {
            self.to_held += values[self.held] * (time_s[self.held + 1] - time_s[self.held]);
            self.held += 1;
        }
        self.to_held + values[self.held] * (t_s - time_s[self.held])
    }
}
