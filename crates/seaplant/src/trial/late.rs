//! Translations that are reported late beside thrust and rates of turn.

use super::CoupledRecord;
use crate::Timed;

/// How an instrument reports surge, sway and heave: behind a first-order lag, and late.
///
/// ```text
/// T ẏ = ν(t − d) − y
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Late {
    /// d, s.
    pub delay_s: f64,
    /// T, s; zero if there is no lag.
    pub lag_s: f64,
}

impl Late {
    /// What is reported at some times of a velocity that is `values` there, but for the delay.
    pub(crate) fn behind_lag(&self, time_s: &[f64], mut values: Vec<f64>) -> Vec<f64> {
        if self.lag_s == 0.0 {
            return values;
        }
        let mut before = values.first().copied().unwrap_or_default();
        for k in 1..values.len() {
            let (keep, age_s, h) = self.of_step(time_s[k] - time_s[k - 1]);
            // The mean of a straight line from the last value to this, as old as that mean is.
            let mean = values[k] + (before - values[k]) * age_s / h;
            before = values[k];
            values[k] = keep * values[k - 1] + (1.0 - keep) * mean;
        }
        values
    }

    /// What is left of the report before after a step, and how long before its end a straight line
    /// has the mean that the lag takes of it; and the step, all in s.
    fn of_step(&self, h: f64) -> (f64, f64, f64) {
        let keep = (-h / self.lag_s).exp();
        (keep, self.lag_s - h * keep / (1.0 - keep), h)
    }

    /// The velocity that a series reports, before lag and delay.
    ///
    /// `ν = (yₖ − a yₖ₋₁) / (1 − a)` with `a = exp(−h/T)` is its mean over the step, with the lag's
    /// weights; it stands where that mean is. Noise that is white before the lag is white again.
    fn reported_by(&self, series: &Timed) -> Timed {
        let shifted = series.shifted(-self.delay_s);
        if self.lag_s == 0.0 {
            return shifted;
        }
        let (time_s, values) = (shifted.time_s(), shifted.values());
        let longest = shifted.longest_usual_s();
        let before = |k: usize| {
            let (keep, age_s, h) = self.of_step(time_s[k] - time_s[k - 1]);
            let mean = (values[k] - keep * values[k - 1]) / (1.0 - keep);
            (h <= longest).then_some((time_s[k] - age_s, mean))
        };
        let (time_s, values): (Vec<f64>, Vec<f64>) = (1..time_s.len()).filter_map(before).unzip();
        Timed::new("velocity", time_s, values).unwrap_or(shifted)
    }
}

impl CoupledRecord {
    /// The same with measured translations so much earlier, s: of an instrument that reports them
    /// late.
    pub(crate) fn with_translations_earlier(&self, by_s: f64) -> Self {
        self.with_translations_before(&Late { delay_s: by_s, lag_s: 0.0 })
    }

    /// The same with translations as they were before their instrument.
    pub(crate) fn with_translations_before(&self, late: &Late) -> Self {
        let mut earlier = self.clone();
        let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
        for (series, by_slope) in earlier.velocity.iter_mut().zip(self.by_slope).take(3) {
            if let Some(series) = series.as_mut().filter(|_| !by_slope) {
                *series = late.reported_by(series);
                (first, last) = (first.max(series.first_s()), last.min(series.last_s()));
            }
        }
        let (from, to) = self.window_s;
        earlier.window_s = (from.max(first), to.min(last));
        earlier
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Grid;

    /// A swing behind a lag, T ẏ = sin ωt − y, from its solution; sampled unevenly.
    #[test]
    fn what_a_lag_hides_comes_back() {
        let late = Late { delay_s: 0.1, lag_s: 0.4 };
        let omega = 0.9_f64;
        let (gain, phase) = {
            let x = omega * late.lag_s;
            (1.0 / x.hypot(1.0), -x.atan())
        };
        let time_s: Vec<f64> =
            (0..200).map(|k| 0.15 * f64::from(k) + 0.03 * f64::from(k % 3)).collect();
        let reported = |t: &f64| gain * (omega * (t - late.delay_s) + phase).sin();
        let values: Vec<f64> = time_s.iter().map(reported).collect();
        let series = Timed::new("velocity", time_s.clone(), values.clone()).expect("a series");
        let found = late.reported_by(&series);
        assert_eq!(found.len(), 199);
        for (t, v) in found.time_s().iter().zip(found.values()) {
            assert!((v - (omega * t).sin()).abs() < 2e-3, "{t}: {v}");
        }
        // And forth, once the beginning is forgotten.
        let moved = time_s.iter().map(|t| (omega * (t - late.delay_s)).sin()).collect();
        let there = late.behind_lag(&time_s, moved);
        for (a, b) in there.iter().zip(&values).skip(20) {
            assert!((a - b).abs() < 2e-3, "{a} {b}");
        }
    }

    #[test]
    fn nothing_is_told_across_a_gap() {
        let grid = Grid { start_s: 0.0, period_s: 0.1, len: 40 };
        let time_s: Vec<f64> = grid.times().map(|t| if t > 2.0 { t + 5.0 } else { t }).collect();
        let series = Timed::new("velocity", time_s, vec![1.0; 40]).expect("a series");
        let found = Late { delay_s: 0.0, lag_s: 0.3 }.reported_by(&series);
        assert_eq!(found.len(), 38);
        assert!(found.values().iter().all(|v| (v - 1.0).abs() < 1e-12));
    }
}
