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
    kappa: f64,
    /// Exponent of thrust over propeller speed, less 2, and the speed where it changes nothing.
    exponent: f64,
    full_speed: f64,
}

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
            kappa: values.get(Unknown::LogReverseRatio).exp(),
            exponent: values.get(Unknown::Exponent),
            full_speed: values.shape.full_speed,
        }
    }

    /// The thrust of all over the step that ends at a stop.
    #[inline]
    pub(crate) fn until(&mut self, stop: &Stop) -> Push {
        let h = stop.length_s;
        let at = |turning: &mut SignalIntegral<'_>| turning.until(stop.time_s - 0.5 * h).1;
        let mut push = Push { turning: self.turning.as_mut().map_or(0.0, at), ..Push::default() };
        self.propulsion.step(h);
        let law =
            ThrustLaw { kappa: self.kappa, exponent: self.exponent, full_speed: self.full_speed };
        for propeller in &mut self.propellers {
            let after = propeller.asked.until(stop.time_s - self.delay_s);
            let before = std::mem::replace(&mut propeller.before, after);
            let mut asked = Changing::constant((after.0 - before.0) / h);
            asked.by[DELAY] = (before.1 - after.1) / h;
            let track = propeller.track;
            propeller.speed = self
                .propulsion
                .through(propeller.speed, asked, h, |segment| push.add(track, &law, segment, h));
        }
        push
    }
}

/// From propeller speed to thrust.
struct ThrustLaw {
    kappa: f64,
    exponent: f64,
    full_speed: f64,
}

impl Push {
    /// Adds the thrust of the part of a step in which the propeller turns one way.
    #[inline]
    fn add(&mut self, track: &ThrusterTrack, law: &ThrustLaw, segment: &Segment, h: f64) {
        let (sign, strength) =
            if segment.reversed { (-1.0, law.kappa * track.reverse) } else { (1.0, track.forward) };
        let part = 1.0 / h;
        let mut force = segment.square.times(part * sign * track.lever * strength);
        let mean_square = segment.square.x / segment.length_s;
        if mean_square > 0.0 && law.full_speed > 0.0 {
            // The exponent acts on the mean square of a part of a step: exact at 2, and to
            // second order in how much speed changes within it.
            let ratio = 0.5 * mean_square.ln() - law.full_speed.ln();
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
