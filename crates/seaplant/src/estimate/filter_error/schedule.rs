//! The steps of a trial: where the filter predicts to, and what was measured there.

use crate::navigation::Motion;
use crate::{AxisRecord, Timed};

/// The longest step, s: drag changes a vehicle's speed over seconds.
pub(crate) const LONGEST_STEP_S: f64 = 0.1;

/// What was measured at the end of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Measured {
    /// m/s or rad/s.
    pub(crate) velocity: Option<f64>,
    /// m or rad.
    pub(crate) position: Option<f64>,
    /// What a metre of unknown lever arm adds to the velocity, for two axes.
    pub(crate) lever: [f64; 2],
}

/// The instants of a trial at which the filter stops.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Schedule {
    /// Instants, s: the first measurement, then the end of each step.
    pub(crate) time_s: Vec<f64>,
    /// What was measured at each.
    pub(crate) measured: Vec<Measured>,
    /// Whether position is among it.
    pub(crate) has_position: bool,
}

impl Schedule {
    /// The steps of one record: every measurement is the end of one, and none is longer
    /// than 0.1 s.
    pub(crate) fn of(axis: &AxisRecord) -> Self {
        let series = axis.motion.series();
        let has_position = matches!(axis.motion, Motion::Position(_));
        let mut schedule = Self { time_s: Vec::new(), measured: Vec::new(), has_position };
        for (&t, &y) in series.time_s().iter().zip(series.values()) {
            schedule.step_to(t);
            schedule.measured.push(if has_position {
                Measured { position: Some(y), ..Default::default() }
            } else {
                let lever = axis.lever_rates.as_ref().map(|[a, b]| [a.at(t), b.at(t)]);
                Measured { velocity: Some(y), position: None, lever: lever.unwrap_or_default() }
            });
            schedule.time_s.push(t);
        }
        schedule
    }

    /// Steps through instants at which nothing is measured.
    pub(crate) fn through(times_s: &[f64]) -> Self {
        let mut schedule = Self { time_s: Vec::new(), measured: Vec::new(), has_position: false };
        for &t in times_s {
            schedule.step_to(t);
            schedule.measured.push(Measured::default());
            schedule.time_s.push(t);
        }
        schedule
    }

    /// Adds the steps without measurement on the way to `t_s`.
    fn step_to(&mut self, t_s: f64) {
        let Some(&before) = self.time_s.last() else { return };
        // Half a millionth of a step forgives the rounding of decimal time stamps.
        let steps = ((t_s - before) / LONGEST_STEP_S - 5e-7).ceil().max(1.0) as usize;
        let h = (t_s - before) / steps as f64;
        for k in 1..steps {
            self.time_s.push(before + k as f64 * h);
            self.measured.push(Measured::default());
        }
    }

    /// How many measurements there are.
    pub(crate) fn samples(&self) -> usize {
        let is_any = |m: &&Measured| m.velocity.is_some() || m.position.is_some();
        self.measured.iter().filter(is_any).count()
    }

    /// Length of step k, which ends at instant k + 1.
    pub(crate) fn length(&self, k: usize) -> f64 {
        self.time_s[k + 1] - self.time_s[k]
    }
}

/// ∫ x dt of a held signal, for any time.
pub(crate) struct HeldIntegral<'a> {
    series: &'a Timed,
    /// The integral up to each sample.
    before: Vec<f64>,
}

impl<'a> HeldIntegral<'a> {
    pub(crate) fn new(series: &'a Timed) -> Self {
        let (t, x) = (series.time_s(), series.values());
        let mut before = Vec::with_capacity(x.len());
        let mut sum = 0.0;
        before.push(sum);
        for k in 1..x.len() {
            sum += x[k - 1] * (t[k] - t[k - 1]);
            before.push(sum);
        }
        Self { series, before }
    }

    /// The integral up to `t_s` and the signal there; `from` is where the search starts
    /// and is moved on, so that rising times cost one step each.
    pub(crate) fn at(&self, t_s: f64, from: &mut usize) -> (f64, f64) {
        let (t, x) = (self.series.time_s(), self.series.values());
        while *from + 1 < t.len() && t[*from + 1] <= t_s {
            *from += 1;
        }
        (self.before[*from] + x[*from] * (t_s - t[*from]), x[*from])
    }
}
