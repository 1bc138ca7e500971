//! A logged wrench of which no thrusters are known, behind a lag and a delay.

use super::{Actuator, FINEST_S, NO_LAG_S};
use crate::estimate::propellers::SignalIntegral;
use crate::{BetweenSamples, Timed};

/// A force that moves smoothly from sample to sample, as its means over steps of at most 0.05 s; `None` for a
/// single sample.
pub(super) fn finely_held(series: &Timed) -> Option<Timed> {
    // A force is no square of anything: its own samples are followed.
    let mut between = SignalIntegral::new(series, BetweenSamples::SmoothSpeed);
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for pair in series.time_s().windows(2) {
        let steps = ((pair[1] - pair[0]) / FINEST_S).ceil();
        let length_s = (pair[1] - pair[0]) / steps;
        let mut before = between.until(pair[0]).0;
        for k in 0..steps as usize {
            let after = between.until(pair[0] + (k as f64 + 1.0) * length_s).0;
            times.push(pair[0] + k as f64 * length_s);
            values.push((after - before) / length_s);
            before = after;
        }
    }
    times.push(series.last_s());
    values.push(*series.values().last()?);
    Timed::new("force", times, values).ok()
}

/// A logged force and what lags behind it at each of its samples.
pub(super) struct Lagging<'a> {
    logged: &'a Timed,
    actuator: Actuator,
    /// τ and ∂τ/∂T at the samples, without the delay.
    states: Vec<(f64, f64)>,
    /// ∫u dt up to the samples.
    integrals: Vec<f64>,
}

/// What is known at an instant.
pub(super) struct At {
    integral: f64,
    pub(super) force: f64,
    by_lag: f64,
}

impl<'a> Lagging<'a> {
    pub(super) fn new(logged: &'a Timed, actuator: Actuator) -> Self {
        let (t, u) = (logged.time_s(), logged.values());
        let mut lagging = Self {
            logged,
            actuator,
            states: Vec::with_capacity(t.len()),
            integrals: Vec::with_capacity(t.len()),
        };
        // Before its first sample the force was as there.
        lagging.states.push((u[0], 0.0));
        lagging.integrals.push(0.0);
        for k in 1..t.len() {
            let at = lagging.after(k - 1, t[k] - t[k - 1]);
            lagging.states.push((at.force, at.by_lag));
            lagging.integrals.push(at.integral);
        }
        lagging
    }

    /// Some time after a sample, before the next.
    fn after(&self, sample: usize, s: f64) -> At {
        let u = self.logged.values()[sample];
        let (state, by_lag) = self.states[sample];
        let lag = self.actuator.lag_s;
        let integral = self.integrals[sample] + u * s;
        if lag < NO_LAG_S {
            return At { integral, force: u, by_lag: 0.0 };
        }
        // Before the first sample there is no change that anything could lag behind.
        let s = s.max(0.0);
        let left = (-s / lag).exp();
        At {
            integral,
            force: u + (state - u) * left,
            by_lag: (by_lag + (state - u) * s / (lag * lag)) * left,
        }
    }

    pub(super) fn reader(&'a self) -> Reader<'a> {
        Reader { lagging: self, sample: 0 }
    }

    /// The mean between two instants, and its derivatives by lag and delay.
    pub(super) fn mean(
        &self,
        before: &At,
        after: &At,
        length_s: f64,
    ) -> (f64, [f64; Actuator::COUNT]) {
        let lag = self.actuator.lag_s;
        let change = after.force - before.force;
        let mean = (after.integral - before.integral - lag * change) / length_s;
        let by_lag = -(change + lag * (after.by_lag - before.by_lag)) / length_s;
        let mut by = [0.0; Actuator::COUNT];
        [by[0], by[1]] = [by_lag, -change / length_s];
        (mean, by)
    }
}

/// Reads a force at instants that do not decrease by more than a slice.
pub(super) struct Reader<'a> {
    lagging: &'a Lagging<'a>,
    sample: usize,
}

impl Reader<'_> {
    pub(super) fn at(&mut self, t: f64) -> At {
        let times = self.lagging.logged.time_s();
        let t = t - self.lagging.actuator.delay_s;
        while self.sample > 0 && times[self.sample] > t {
            self.sample -= 1;
        }
        while times.get(self.sample + 1).is_some_and(|next| *next <= t) {
            self.sample += 1;
        }
        self.lagging.after(self.sample, t - times[self.sample])
    }
}
