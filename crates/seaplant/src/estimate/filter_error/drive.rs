//! Thrust as it acts: after lag and delay, with the reverse ratio, and what inflow takes.

use super::parameters::{Unknown, Values};
use super::schedule::{HeldIntegral, Schedule};
use crate::ThrusterTrack;

/// The unknowns that shape thrust, in the order of [`Drive`]'s derivatives.
pub(crate) const SHAPING: [Unknown; 3] = [Unknown::Lag, Unknown::Delay, Unknown::LogReverseRatio];

/// Thrust over each step of a schedule.
#[derive(Clone, Debug, Default)]
pub(crate) struct Drive {
    /// Mean force τ*, N or N m.
    pub(crate) tau: Vec<f64>,
    /// Its derivatives by lag, delay and ln κ.
    pub(crate) tau_by: Vec<[f64; 3]>,
    /// γ = Σ lever² |n| of the inflow term.
    pub(crate) gamma: Vec<f64>,
    /// Its derivatives by lag and delay; ln κ does not change it.
    pub(crate) gamma_by: Vec<[f64; 3]>,
}

impl Drive {
    /// Thrust of all thrusters over each step.
    ///
    /// n* follows the delayed speed by `ṅ* = (n(t − D) − n*)/T_l`, which approaches a held
    /// speed exponentially, so that the mean of n*|n*| over a step is known in closed form.
    pub(crate) fn of(tracks: &[ThrusterTrack], schedule: &Schedule, values: &Values) -> Self {
        let steps = schedule.time_s.len() - 1;
        let mut drive = Self {
            tau: vec![0.0; steps],
            tau_by: vec![[0.0; 3]; steps],
            gamma: vec![0.0; steps],
            gamma_by: vec![[0.0; 3]; steps],
        };
        for track in tracks {
            drive.add(track, schedule, values);
        }
        drive
    }

    fn add(&mut self, track: &ThrusterTrack, schedule: &Schedule, values: &Values) {
        let (lag_s, delay_s) = (values.get(Unknown::Lag), values.get(Unknown::Delay));
        let kappa = values.get(Unknown::LogReverseRatio).exp();
        let integral = HeldIntegral::new(&track.speed);
        let mut from = 0;
        let mut before = integral.at(schedule.time_s[0] - delay_s, &mut from);
        // The propeller has settled when the trial starts.
        let mut start = Changing { x: before.1, by_lag: 0.0, by_delay: 0.0 };
        for k in 0..self.tau.len() {
            let h = schedule.length(k);
            let after = integral.at(schedule.time_s[k + 1] - delay_s, &mut from);
            let asked = Changing {
                x: (after.0 - before.0) / h,
                by_lag: 0.0,
                by_delay: (before.1 - after.1) / h,
            };
            let approach = Approach { asked, start, lag_s };
            self.add_step(k, track, kappa, &approach, h);
            start = approach.speed(h);
            before = after;
        }
    }

    /// Adds the force of one step, which the propeller may end in the other direction.
    fn add_step(
        &mut self,
        k: usize,
        track: &ThrusterTrack,
        kappa: f64,
        approach: &Approach,
        h: f64,
    ) {
        let turn = approach.reverses_at(h);
        let mut begin = 0.0;
        for end in [turn.unwrap_or(h), h] {
            if end <= begin {
                continue;
            }
            let reversed = approach.speed(0.5 * (begin + end)).x < 0.0;
            let (sign, strength) =
                if reversed { (-1.0, kappa * track.reverse) } else { (1.0, track.forward) };
            let part = |upto: Changing, from: Changing| upto.less(from).times(1.0 / h);
            let square = part(approach.integral_of_square(end), approach.integral_of_square(begin));
            let thrust = square.times(sign * track.lever * strength);
            self.tau[k] += thrust.x;
            self.tau_by[k][0] += thrust.by_lag;
            self.tau_by[k][1] += thrust.by_delay;
            self.tau_by[k][2] += if reversed { thrust.x } else { 0.0 };
            let path = part(approach.integral(end), approach.integral(begin));
            let area = path.times(sign * track.lever * track.lever);
            self.gamma[k] += area.x;
            self.gamma_by[k][0] += area.by_lag;
            self.gamma_by[k][1] += area.by_delay;
            begin = end;
        }
    }
}

/// A number with its derivatives by lag and delay.
#[derive(Clone, Copy, Debug)]
struct Changing {
    x: f64,
    by_lag: f64,
    by_delay: f64,
}

impl Changing {
    fn times(self, factor: f64) -> Self {
        let Self { x, by_lag, by_delay } = self;
        Self { x: factor * x, by_lag: factor * by_lag, by_delay: factor * by_delay }
    }

    fn less(self, other: Self) -> Self {
        Self {
            x: self.x - other.x,
            by_lag: self.by_lag - other.by_lag,
            by_delay: self.by_delay - other.by_delay,
        }
    }
}

/// A propeller on its way to the speed asked for: `n(t) = asked + (start − asked) e^(−t/T)`.
#[derive(Clone, Copy, Debug)]
struct Approach {
    asked: Changing,
    start: Changing,
    lag_s: f64,
}

impl Approach {
    /// E = e^(−t/T) and E t/T; at no lag, or at no time, the limits.
    fn decay(&self, t: f64) -> (f64, f64) {
        if t <= 0.0 {
            return (1.0, 0.0);
        }
        let ratio = t / self.lag_s.max(f64::MIN_POSITIVE);
        let decay = (-ratio).exp();
        // Beyond this the product is below the smallest number, and ratio may be infinite.
        (decay, if ratio < 700.0 { decay * ratio } else { 0.0 })
    }

    /// How far there is to go at the start.
    fn offset(&self) -> Changing {
        self.start.less(self.asked)
    }

    /// A function of (asked, offset, T) with its partial derivatives, by the chain rule.
    fn chain(&self, x: f64, by_asked: f64, by_offset: f64, by_t: f64) -> Changing {
        let offset = self.offset();
        Changing {
            x,
            by_lag: by_asked * self.asked.by_lag + by_offset * offset.by_lag + by_t,
            by_delay: by_asked * self.asked.by_delay + by_offset * offset.by_delay,
        }
    }

    fn speed(&self, t: f64) -> Changing {
        let (decay, decay_ratio) = self.decay(t);
        let offset = self.offset().x;
        let by_t = offset * decay_ratio / self.lag_s.max(f64::MIN_POSITIVE);
        let by_t = if decay_ratio == 0.0 { 0.0 } else { by_t };
        self.chain(self.asked.x + offset * decay, 1.0, decay, by_t)
    }

    /// When the propeller stops on its way to the other direction, if within a step.
    fn reverses_at(&self, h: f64) -> Option<f64> {
        let (asked, offset) = (self.asked.x, self.offset().x);
        let turns = asked * self.start.x < 0.0;
        turns.then(|| self.lag_s * (-offset / asked).ln()).filter(|t| *t > 0.0 && *t < h)
    }

    /// ∫₀ᵗ n dt = asked t + offset T (1 − E).
    fn integral(&self, t: f64) -> Changing {
        let (decay, decay_ratio) = self.decay(t);
        let (asked, offset, lag) = (self.asked.x, self.offset().x, self.lag_s);
        let gone = 1.0 - decay;
        self.chain(asked * t + offset * lag * gone, t, lag * gone, offset * (gone - decay_ratio))
    }

    /// ∫₀ᵗ n² dt = asked² t + 2 asked offset T (1 − E) + ½ offset² T (1 − E²).
    fn integral_of_square(&self, t: f64) -> Changing {
        let (decay, decay_ratio) = self.decay(t);
        let (asked, offset, lag) = (self.asked.x, self.offset().x, self.lag_s);
        let (gone, gone2) = (1.0 - decay, 1.0 - decay * decay);
        self.chain(
            asked * asked * t + lag * offset * (2.0 * asked * gone + 0.5 * offset * gone2),
            2.0 * asked * t + 2.0 * offset * lag * gone,
            lag * (2.0 * asked * gone + offset * gone2),
            2.0 * asked * offset * (gone - decay_ratio)
                + 0.5 * offset * offset * (gone2 - 2.0 * decay * decay_ratio),
        )
    }
}
