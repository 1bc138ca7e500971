//! Thrust as it acts: after lag and delay, with the reverse ratio, and what inflow takes.

use super::approach::{Changing, Propulsion, Segment};
use super::parameters::{Unknown, Values};
use super::schedule::{SignalIntegral, Stop};
use crate::{ThrusterTrack, Timed};

/// The unknowns that shape thrust, in the order of [`Push::tau_by`].
pub(crate) const SHAPING: [Unknown; 7] = [
    Unknown::Lag,
    Unknown::LogLagRatio,
    Unknown::Slew,
    Unknown::Delay,
    Unknown::LogReverseRatio,
    Unknown::LogForwardRatio,
    Unknown::Exponent,
];

/// The first of them shape propeller speed; the others what thrust it makes.
pub(crate) const OF_SPEED: usize = 4;

/// Places among [`SHAPING`].
const DELAY: usize = 3;
const REVERSE: usize = 4;
const FORWARD: usize = 5;
const EXPONENT: usize = 6;

/// Thrust over one step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Push {
    /// Mean force τ*, N or N m.
    pub(crate) tau: f64,
    /// Its derivatives by [`SHAPING`].
    pub(crate) tau_by: [f64; SHAPING.len()],
    /// `Σ lever² |n|` of the propellers that push forward, and of those that push backward.
    pub(crate) gamma: [f64; 2],
    /// Their derivatives by the unknowns that shape propeller speed.
    pub(crate) gamma_by: [[f64; OF_SPEED]; 2],
    /// What turning does to the velocity of a rigid body, m/s².
    pub(crate) turning: f64,
}

/// All thrusters on their way through a trial.
///
/// n* follows the delayed speed by `ṅ* = (n(t − D) − n*)/T_l`, at most at a given rate. It
/// approaches a held speed in pieces that are linear or exponential, so that the mean of
/// n*|n*| over a step is known in closed form.
pub(crate) struct Drive<'a> {
    propellers: Vec<Propeller<'a>>,
    turning: Option<SignalIntegral<'a>>,
    propulsion: Propulsion,
    delay_s: f64,
    law: ThrustLaw,
}

/// A speed that jumps by more than this part of the greatest within a step is followed before the
/// jump and after it: the thrust of a mean speed is not the mean thrust. A smaller jump is part of
/// the mean, which is off by a four-hundredth of full thrust at most.
const JUMP_PART: f64 = 0.1;

/// A jump this near to an end of a step is at that end, s: decimal stamps differ in their last digits,
/// and the mean over what rounding leaves is no speed.
const SLIVER_S: f64 = 1e-6;

/// A propeller is settled this long before a trial starts, s: what it is told at the start
/// is new to it.
const JUST_BEFORE_S: f64 = 1e-6;

/// One of them.
struct Propeller<'a> {
    track: &'a ThrusterTrack,
    asked: SignalIntegral<'a>,
    /// The integral of the speed asked for up to here, and that speed.
    before: (f64, f64),
    /// The speed that it has.
    speed: Changing,
}

impl Propeller<'_> {
    /// Brings it through a part of a step, towards one speed; lengths are those of the part and of
    /// the step, s.
    #[inline]
    fn go(
        &mut self,
        propulsion: &Propulsion,
        law: &ThrustLaw,
        asked: Changing,
        [part_s, step_s]: [f64; 2],
        push: &mut Push,
    ) {
        let track = self.track;
        let add = |segment: &Segment| push.add(track, law, segment, step_s);
        self.speed = propulsion.through(self.speed, asked, part_s, add);
    }

    /// What a later end of the part just passed does: its speed changes on, and so does what is
    /// added up; `weight` is 1 over the length of the step, below zero of an end that comes sooner.
    fn end_later(
        &mut self,
        propulsion: &Propulsion,
        law: &ThrustLaw,
        asked: Changing,
        weight: f64,
        push: &mut Push,
    ) {
        let slope = propulsion.slope(&self.speed, &asked);
        self.speed.by[DELAY] += slope * weight.signum();
        push.end_later(self.track, law, self.speed.x, weight);
    }
}

impl<'a> Drive<'a> {
    /// Settled at the speed asked for until the trial starts.
    pub(crate) fn new(
        tracks: &'a [ThrusterTrack],
        turning: Option<&'a Timed>,
        values: &Values,
        from_s: f64,
    ) -> Self {
        let delay_s = values.get(Unknown::Delay);
        let linear = values.shape.linear;
        let propeller = |track: &'a ThrusterTrack| {
            let mut asked = SignalIntegral::new(&track.speed, linear);
            let settled = asked.until(from_s - delay_s - JUST_BEFORE_S).1;
            let before = asked.until(from_s - delay_s);
            Propeller { track, asked, before, speed: Changing::constant(settled) }
        };
        Self {
            propellers: tracks.iter().map(propeller).collect(),
            turning: turning.map(|turning| SignalIntegral::new(turning, false)),
            propulsion: Propulsion::of(values),
            delay_s,
            law: ThrustLaw::of(values),
        }
    }

    /// The thrust of all over the step that ends at a stop.
    #[inline]
    pub(crate) fn until(&mut self, stop: &Stop) -> Push {
        let h = stop.length_s;
        let at = |turning: &mut SignalIntegral<'_>| turning.until(stop.time_s - 0.5 * h).1;
        let mut push = Push { turning: self.turning.as_mut().map_or(0.0, at), ..Push::default() };
        self.propulsion.step(h);
        let law = self.law;
        let to_s = stop.time_s - self.delay_s;
        for propeller in &mut self.propellers {
            let before = propeller.before;
            let jump_s = propeller.asked.jump_before(to_s, JUMP_PART * law.full_speed);
            let within = to_s - h + SLIVER_S..to_s - SLIVER_S;
            let jump_s = jump_s.filter(|jump_s| within.contains(jump_s));
            let first = jump_s.map(|jump_s| {
                let middle = propeller.asked.until(jump_s);
                (middle.0, jump_s - (to_s - h))
            });
            let after = propeller.asked.until(to_s);
            propeller.before = after;
            let Some((middle, first_s)) = first else {
                let mut asked = Changing::constant((after.0 - before.0) / h);
                asked.by[DELAY] = (before.1 - after.1) / h;
                propeller.go(&self.propulsion, &law, asked, [h, h], &mut push);
                continue;
            };
            // A later jump makes what is before it longer, and what is after it shorter.
            let second_s = h - first_s;
            let mut asked = Changing::constant((middle - before.0) / first_s);
            asked.by[DELAY] = (before.1 - asked.x) / first_s;
            propeller.go(&self.propulsion, &law, asked, [first_s, h], &mut push);
            propeller.end_later(&self.propulsion, &law, asked, 1.0 / h, &mut push);
            let mut asked = Changing::constant((after.0 - middle) / second_s);
            asked.by[DELAY] = (asked.x - after.1) / second_s;
            propeller.go(&self.propulsion, &law, asked, [second_s, h], &mut push);
            propeller.end_later(&self.propulsion, &law, asked, -1.0 / h, &mut push);
        }
        push
    }
}

/// From propeller speed to thrust.
#[derive(Clone, Copy)]
struct ThrustLaw {
    kappa: f64,
    /// Exponent of thrust over propeller speed, less 2, and the speed where it changes nothing.
    exponent: f64,
    full_speed: f64,
    ln_full_speed: f64,
    /// Whether the exponent is other than 2, or the slope by it is asked for.
    has_exponent: bool,
}

impl ThrustLaw {
    fn of(values: &Values) -> Self {
        let (exponent, full_speed) = (values.get(Unknown::Exponent), values.shape.full_speed);
        Self {
            kappa: values.get(Unknown::LogReverseRatio).exp(),
            exponent,
            full_speed,
            ln_full_speed: full_speed.ln(),
            has_exponent: full_speed > 0.0 && (exponent != 0.0 || values.shape.exponent),
        }
    }
}

impl Push {
    /// The derivative of the mean force by an unknown; zero of one that does not shape it.
    pub(crate) fn by(&self, unknown: Unknown) -> f64 {
        SHAPING.iter().position(|own| *own == unknown).map_or(0.0, |k| self.tau_by[k])
    }

    /// Adds what a later end of a part of a step does, by the delay.
    fn end_later(&mut self, track: &ThrusterTrack, law: &ThrustLaw, speed: f64, weight: f64) {
        let (sign, strength) =
            if speed < 0.0 { (-1.0, law.kappa * track.reverse) } else { (1.0, track.forward) };
        let gain = match law.has_exponent && speed != 0.0 {
            true => (law.exponent * (speed.abs().ln() - law.ln_full_speed)).exp(),
            false => 1.0,
        };
        let force = sign * track.lever * strength * gain * speed * speed;
        self.tau_by[DELAY] += weight * force;
        let way = usize::from(sign * track.lever < 0.0);
        self.gamma_by[way][DELAY] += weight * track.lever * track.lever * speed.abs();
    }

    /// Adds the thrust of the part of a step in which the propeller turns one way.
    #[inline]
    fn add(&mut self, track: &ThrusterTrack, law: &ThrustLaw, segment: &Segment, h: f64) {
        let (sign, strength) =
            if segment.reversed { (-1.0, law.kappa * track.reverse) } else { (1.0, track.forward) };
        let part = 1.0 / h;
        let mut force = segment.square.times(part * sign * track.lever * strength);
        let mean_square = segment.square.x / segment.length_s;
        if law.has_exponent && mean_square > 0.0 {
            // The exponent acts on the mean square of a part of a step: exact at 2, and to
            // second order in how much speed changes within it.
            let ratio = 0.5 * mean_square.ln() - law.ln_full_speed;
            if law.exponent != 0.0 {
                let (x, gain) = (force.x, (law.exponent * ratio).exp());
                force = force.times(gain * (1.0 + 0.5 * law.exponent));
                force.x = x * gain;
            }
            self.tau_by[EXPONENT] += force.x * ratio;
        }
        self.tau += force.x;
        for (all, by) in self.tau_by.iter_mut().zip(force.by) {
            *all += by;
        }
        self.tau_by[if segment.reversed { REVERSE } else { FORWARD }] += force.x;
        let area = segment.path.times(part * sign * track.lever * track.lever);
        let way = usize::from(sign * track.lever < 0.0);
        self.gamma[way] += area.x;
        for (all, by) in self.gamma_by[way].iter_mut().zip(area.by) {
            *all += by;
        }
    }
}
