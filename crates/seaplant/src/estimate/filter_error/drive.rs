//! Thrust as it acts: after lag and delay, with the reverse ratio, and what inflow takes.

use super::parameters::{Unknown, Values};
use super::schedule::{HeldIntegral, Stop};
use crate::{ThrusterTrack, Timed};

/// The unknowns that shape thrust, in the order of [`Drive`]'s derivatives.
pub(crate) const SHAPING: [Unknown; 4] =
    [Unknown::Lag, Unknown::Delay, Unknown::LogReverseRatio, Unknown::LogForwardRatio];

/// Thrust over one step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Push {
    /// Mean force τ*, N or N m.
    pub(crate) tau: f64,
    /// Its derivatives by lag, delay, ln κ and the logarithm of positive thrust.
    pub(crate) tau_by: [f64; 4],
    /// γ = Σ lever² |n| of the inflow term.
    pub(crate) gamma: f64,
    /// Its derivatives by lag and delay; strengths do not change it.
    pub(crate) gamma_by: [f64; 4],
    /// What turning does to the velocity of a rigid body, m/s².
    pub(crate) turning: f64,
}

/// All thrusters on their way through a trial.
///
/// n* follows the delayed speed by `ṅ* = (n(t − D) − n*)/T_l`, which approaches a held
/// speed exponentially, so that the mean of n*|n*| over a step is known in closed form.
pub(crate) struct Drive<'a> {
    propellers: Vec<Propeller<'a>>,
    turning: Option<HeldIntegral<'a>>,
    lag_s: f64,
    delay_s: f64,
    kappa: f64,
    /// What remains of a difference in speed after a step, and the length of that step.
    decay: Decay,
    length_s: f64,
}

/// A propeller is settled this long before a trial starts, s: what it is told at the start
/// is new to it.
const JUST_BEFORE_S: f64 = 1e-6;

/// One of them.
struct Propeller<'a> {
    track: &'a ThrusterTrack,
    asked: HeldIntegral<'a>,
    /// The integral of the speed asked for up to here, and that speed.
    before: (f64, f64),
    /// The speed that it has.
    speed: Changing,
}

impl<'a> Drive<'a> {
    /// Settled at the speed asked for until the trial starts.
    pub(crate) fn new(
        tracks: &'a [ThrusterTrack],
        turning: Option<&'a Timed>,
        values: &Values,
        from_s: f64,
    ) -> Self {
        let (lag_s, delay_s) = (values.get(Unknown::Lag), values.get(Unknown::Delay));
        let propeller = |track: &'a ThrusterTrack| {
            let mut asked = HeldIntegral::new(&track.speed);
            let settled = asked.until(from_s - delay_s - JUST_BEFORE_S).1;
            let before = asked.until(from_s - delay_s);
            let speed = Changing { x: settled, by_lag: 0.0, by_delay: 0.0 };
            Propeller { track, asked, before, speed }
        };
        Self {
            propellers: tracks.iter().map(propeller).collect(),
            turning: turning.map(HeldIntegral::new),
            lag_s,
            delay_s,
            kappa: values.get(Unknown::LogReverseRatio).exp(),
            decay: Decay::after(0.0, lag_s),
            length_s: 0.0,
        }
    }

    /// The thrust of all over the step that ends at a stop.
    #[inline]
    pub(crate) fn until(&mut self, stop: &Stop) -> Push {
        let h = stop.length_s;
        if h != self.length_s {
            (self.decay, self.length_s) = (Decay::after(h, self.lag_s), h);
        }
        let at = |turning: &mut HeldIntegral<'_>| turning.until(stop.time_s - 0.5 * h).1;
        let mut push = Push { turning: self.turning.as_mut().map_or(0.0, at), ..Push::default() };
        for propeller in &mut self.propellers {
            let after = propeller.asked.until(stop.time_s - self.delay_s);
            let before = std::mem::replace(&mut propeller.before, after);
            let asked = Changing {
                x: (after.0 - before.0) / h,
                by_lag: 0.0,
                by_delay: (before.1 - after.1) / h,
            };
            let approach = Approach { asked, start: propeller.speed, lag_s: self.lag_s };
            push.add(propeller.track, self.kappa, &approach, self.decay);
            propeller.speed = approach.speed(self.decay);
        }
        push
    }
}

impl Push {
    /// Adds the thrust of one step, which the propeller may end in the other direction.
    #[inline]
    fn add(&mut self, track: &ThrusterTrack, kappa: f64, approach: &Approach, end: Decay) {
        let h = end.after_s;
        let begin = Decay::after(0.0, approach.lag_s);
        match approach.reverses_at(h).map(|turn| Decay::after(turn, approach.lag_s)) {
            None => {
                // Without lag it has the speed asked for at once, however it turned before.
                let reversed = approach.speed(end).x < 0.0;
                self.add_part(track, kappa, reversed, approach, [begin, end], h);
            }
            Some(turn) => {
                let reversed = approach.start.x < 0.0;
                self.add_part(track, kappa, reversed, approach, [begin, turn], h);
                self.add_part(track, kappa, !reversed, approach, [turn, end], h);
            }
        }
    }

    /// Adds the thrust of the part of a step in which the propeller turns one way.
    #[inline]
    fn add_part(
        &mut self,
        track: &ThrusterTrack,
        kappa: f64,
        reversed: bool,
        approach: &Approach,
        [from, to]: [Decay; 2],
        h: f64,
    ) {
        let (sign, strength) =
            if reversed { (-1.0, kappa * track.reverse) } else { (1.0, track.forward) };
        let part = |upto: Changing, from: Changing| upto.less(from).times(1.0 / h);
        let square = part(approach.integral_of_square(to), approach.integral_of_square(from));
        let thrust = square.times(sign * track.lever * strength);
        self.tau += thrust.x;
        self.tau_by[0] += thrust.by_lag;
        self.tau_by[1] += thrust.by_delay;
        self.tau_by[if reversed { 2 } else { 3 }] += thrust.x;
        let path = part(approach.integral(to), approach.integral(from));
        let area = path.times(sign * track.lever * track.lever);
        self.gamma += area.x;
        self.gamma_by[0] += area.by_lag;
        self.gamma_by[1] += area.by_delay;
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

/// What remains of a difference in speed after a while.
#[derive(Clone, Copy, Debug)]
struct Decay {
    /// How long, s.
    after_s: f64,
    /// E = e^(−t/T).
    left: f64,
    /// E t/T.
    left_times: f64,
}

impl Decay {
    /// At no lag, or at no time, the limits.
    fn after(t: f64, lag_s: f64) -> Self {
        if t <= 0.0 {
            return Self { after_s: 0.0, left: 1.0, left_times: 0.0 };
        }
        let ratio = t / lag_s.max(f64::MIN_POSITIVE);
        let left = (-ratio).exp();
        // Beyond this the product is below the smallest number, and ratio may be infinite.
        Self { after_s: t, left, left_times: if ratio < 700.0 { left * ratio } else { 0.0 } }
    }
}

impl Approach {
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

    fn speed(&self, Decay { left, left_times, .. }: Decay) -> Changing {
        let offset = self.offset().x;
        let by_t = offset * left_times / self.lag_s.max(f64::MIN_POSITIVE);
        let by_t = if left_times == 0.0 { 0.0 } else { by_t };
        self.chain(self.asked.x + offset * left, 1.0, left, by_t)
    }

    /// When the propeller stops on its way to the other direction, if within a step.
    fn reverses_at(&self, h: f64) -> Option<f64> {
        let (asked, offset) = (self.asked.x, self.offset().x);
        let turns = asked * self.start.x < 0.0;
        turns.then(|| self.lag_s * (-offset / asked).ln()).filter(|t| *t > 0.0 && *t < h)
    }

    /// ∫₀ᵗ n dt = asked t + offset T (1 − E).
    fn integral(
        &self,
        Decay { after_s: t, left: decay, left_times: decay_ratio }: Decay,
    ) -> Changing {
        let (asked, offset, lag) = (self.asked.x, self.offset().x, self.lag_s);
        let gone = 1.0 - decay;
        self.chain(asked * t + offset * lag * gone, t, lag * gone, offset * (gone - decay_ratio))
    }

    /// ∫₀ᵗ n² dt = asked² t + 2 asked offset T (1 − E) + ½ offset² T (1 − E²).
    fn integral_of_square(
        &self,
        Decay { after_s: t, left: decay, left_times: decay_ratio }: Decay,
    ) -> Changing {
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
