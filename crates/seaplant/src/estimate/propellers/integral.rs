//! Integrals of logged signals between any two instants.

use crate::Timed;

/// ∫ x dt of a signal that is held or moves linearly from sample to sample, for times that rise.
#[derive(Clone, Debug)]
pub(crate) struct SignalIntegral<'a> {
    series: &'a Timed,
    linear: bool,
    /// The sample in effect.
    at: usize,
    /// The integral up to it.
    before: f64,
}

impl<'a> SignalIntegral<'a> {
    pub(crate) fn new(series: &'a Timed, linear: bool) -> Self {
        Self { series, linear, at: 0, before: 0.0 }
    }

    /// Where the signal jumps most between where it was last looked at and `to_s`, if by more than
    /// `least`.
    #[inline]
    pub(crate) fn jump_before(&self, to_s: f64, least: f64) -> Option<f64> {
        if self.linear {
            return None;
        }
        let (t, x) = (self.series.time_s(), self.series.values());
        let (mut greatest, mut found) = (least, None);
        for k in self.at + 1..t.len() {
            if t[k] >= to_s {
                break;
            }
            let jump = (x[k] - x[k - 1]).abs();
            if jump > greatest {
                (greatest, found) = (jump, Some(t[k]));
            }
        }
        found
    }

    /// The integral up to `t_s`, from the first sample on, and the signal there.
    #[inline]
    pub(crate) fn until(&mut self, t_s: f64) -> (f64, f64) {
        let (t, x) = (self.series.time_s(), self.series.values());
        while self.at + 1 < t.len() && t[self.at + 1] <= t_s {
            let end = if self.linear { x[self.at + 1] } else { x[self.at] };
            self.before += 0.5 * (x[self.at] + end) * (t[self.at + 1] - t[self.at]);
            self.at += 1;
        }
        let (from, since) = (x[self.at], t_s - t[self.at]);
        // Before the first sample and after the last the signal is held.
        if !self.linear || since <= 0.0 || self.at + 1 == t.len() {
            return (self.before + from * since, from);
        }
        let slope = (x[self.at + 1] - from) / (t[self.at + 1] - t[self.at]);
        (self.before + from * since + 0.5 * slope * since * since, from + slope * since)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(time_s: &[f64], values: &[f64]) -> Timed {
        Timed::new("test", time_s.to_vec(), values.to_vec()).expect("valid")
    }

    #[test]
    fn an_integral_of_held_samples_goes_on_before_and_after_them() {
        let held = series(&[0.0, 1.0, 3.0], &[2.0, -1.0, 4.0]);
        let mut integral = SignalIntegral::new(&held, false);
        assert_eq!(integral.until(-0.5), (-1.0, 2.0));
        assert_eq!(integral.until(0.5), (1.0, 2.0));
        assert_eq!(integral.until(2.0), (1.0, -1.0));
        assert_eq!(integral.until(4.0), (4.0, 4.0));
    }

    #[test]
    fn the_greatest_jump_ahead_is_found_if_it_is_large_enough() {
        let held = series(&[0.0, 1.0, 2.0, 3.0], &[0.0, 1.0, -4.0, -5.0]);
        let mut integral = SignalIntegral::new(&held, false);
        integral.until(0.5);
        assert_eq!(integral.jump_before(2.5, 0.5), Some(2.0));
        assert_eq!(integral.jump_before(2.0, 0.5), Some(1.0));
        assert_eq!(integral.jump_before(2.0, 1.5), None);
        assert_eq!(SignalIntegral::new(&held, true).jump_before(2.5, 0.5), None);
    }

    #[test]
    fn an_integral_of_linear_samples_is_that_of_trapezia() {
        let moving = series(&[0.0, 1.0, 3.0], &[2.0, -1.0, 4.0]);
        let mut integral = SignalIntegral::new(&moving, true);
        assert_eq!(integral.until(-0.5), (-1.0, 2.0));
        assert_eq!(integral.until(0.5), (0.625, 0.5));
        assert_eq!(integral.until(2.0), (0.75, 1.5));
        assert_eq!(integral.until(4.0), (7.5, 4.0));
    }
}
