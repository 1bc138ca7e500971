//! Thrust as it acts: after lag and delay, with the reverse ratio, and what inflow takes.

use super::approach::{Changing, Propulsion, Segment};
use super::integral::{DeadBand, SignalIntegral};
use crate::{BetweenSamples, Supply, ThrusterTrack, Timed};

/// What stands between the logged speed of propellers and their thrust.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct DriveLaw {
    /// First-order lag of propeller speed, s.
    pub(crate) lag_s: f64,
    /// Logarithm of the lag of a propeller that slows down over that of one that speeds up.
    pub(crate) log_lag_ratio: f64,
    /// Logarithm of the lag of a propeller whose speed falls, towards full reverse, over that of one whose speed rises.
    pub(crate) log_falling_lag_ratio: f64,
    /// Time from rest to full speed at the greatest rate, s; 0 without a limit.
    pub(crate) slew_s: f64,
    /// Delay of thrust, s.
    pub(crate) delay_s: f64,
    /// Part of the greatest propeller speed below which propellers do not turn.
    pub(crate) dead_band: f64,
    /// Logarithm of reverse thrust over what its curve says.
    pub(crate) log_reverse_ratio: f64,
    /// Exponent of thrust over propeller speed, less 2.
    pub(crate) beyond_square: f64,
    /// The greatest propeller speed, where another exponent and a dead band leave thrust as it is.
    pub(crate) full_speed: f64,
    /// What propellers do between their logged samples.
    pub(crate) between: BetweenSamples,
    /// True if the derivative by the exponent is asked for.
    pub(crate) has_exponent: bool,
    /// True if that by the dead band is.
    pub(crate) has_dead_band: bool,
    /// Exponent of thrust over supply voltage.
    pub(crate) voltage_exponent: f64,
    /// Logarithm of the voltage at which thrust is as curves say that state none.
    pub(crate) ln_mean_voltage: f64,
}

/// What thrust is differentiated by, in the order of [`Push::tau_by`]. The first shape propeller speed, the
/// others what thrust it makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DriveNumber {
    Lag,
    LagRatio,
    FallingLagRatio,
    Slew,
    Delay,
    DeadBand,
    /// Logarithm of reverse thrust.
    Reverse,
    /// Logarithm of forward thrust.
    Forward,
    Exponent,
    /// Exponent of thrust over supply voltage.
    Voltage,
}

impl DriveNumber {
    pub(crate) const COUNT: usize = Self::Voltage as usize + 1;

    /// How many shape propeller speed.
    pub(crate) const OF_SPEED: usize = Self::DeadBand as usize + 1;
}

/// Thrust over one step.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Push {
    /// Mean force τ*, N or N m.
    pub(crate) tau: f64,
    /// Its derivatives by [`DriveNumber`].
    pub(crate) tau_by: [f64; DriveNumber::COUNT],
    /// `Σ lever² |n|` of the propellers that push forward, and of those that push backward.
    pub(crate) gamma: [f64; 2],
    /// Their derivatives by what shapes propeller speed.
    pub(crate) gamma_by: [[f64; DriveNumber::OF_SPEED]; 2],
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
    asked: Asked<'a>,
    /// The command up to here.
    before: AskedAt,
    /// The speed that it has.
    speed: Changing,
}

/// The command of a propeller.
struct Asked<'a> {
    signal: SignalIntegral<'a>,
    /// Its derivative by the dead band, if required.
    by_dead_band: Option<SignalIntegral<'a>>,
    full_speed: f64,
}

/// The integral of a command up to an instant, the command there, and the derivatives of both by the dead band.
#[derive(Clone, Copy)]
struct AskedAt {
    integral: f64,
    value: f64,
    by_dead_band: (f64, f64),
}

impl<'a> Asked<'a> {
    fn of(track: &'a ThrusterTrack, law: &DriveLaw) -> Self {
        let DriveLaw { dead_band: part, full_speed, .. } = *law;
        let signal = SignalIntegral::of(track, law.between, DeadBand { part, full_speed });
        let is_asked = law.has_dead_band && full_speed > 0.0;
        let by_dead_band = is_asked.then(|| signal.by_dead_band());
        Self { signal, by_dead_band, full_speed }
    }

    #[inline]
    fn until(&mut self, t_s: f64) -> AskedAt {
        let (integral, value) = self.signal.until(t_s);
        let by_dead_band = self.by_dead_band.as_mut().map_or((0.0, 0.0), |by| by.until(t_s));
        AskedAt { integral, value, by_dead_band }
    }

    /// Returns the speed for a mean of the signal, with its derivatives by the dead band and by the delay, of which the
    /// signal has these.
    #[inline]
    fn speed(&self, mean: f64, by_dead_band: f64, by_delay: f64) -> Changing {
        let mut asked = Changing::constant(self.signal.speed(mean));
        let own = |by: f64| self.signal.speed_slope(asked.x, by, self.full_speed);
        let (by_dead_band, by_delay) = (own(by_dead_band), own(by_delay));
        asked.by[DriveNumber::DeadBand as usize] = by_dead_band;
        asked.by[DriveNumber::Delay as usize] = by_delay;
        asked
    }

    /// Returns the mean speed between two instants, of which `moves` says whether they move with the delay.
    #[inline]
    fn mean(&self, from: &AskedAt, to: &AskedAt, length_s: f64, moves: [bool; 2]) -> Changing {
        let mean = (to.integral - from.integral) / length_s;
        let by_dead_band = (to.by_dead_band.0 - from.by_dead_band.0) / length_s;
        let at = |moves: bool, at: &AskedAt| if moves { at.value } else { mean };
        let by_delay = (at(moves[0], from) - at(moves[1], to)) / length_s;
        self.speed(mean, by_dead_band, by_delay)
    }
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
        self.speed.by[DriveNumber::Delay as usize] += slope * weight.signum();
        push.end_later(self.track, law, self.speed.x, weight);
    }
}

impl<'a> Drive<'a> {
    /// Settled at the speed asked for until the trial starts.
    pub(crate) fn new(
        tracks: &'a [ThrusterTrack],
        turning: Option<&'a Timed>,
        law: &DriveLaw,
        from_s: f64,
    ) -> Self {
        let delay_s = law.delay_s;
        let propeller = |track: &'a ThrusterTrack| {
            let mut asked = Asked::of(track, law);
            let settled = asked.until(from_s - delay_s - JUST_BEFORE_S);
            let before = asked.until(from_s - delay_s);
            let by_delay = match law.between {
                BetweenSamples::Held => 0.0,
                _ => (settled.value - before.value) / JUST_BEFORE_S,
            };
            let speed = asked.speed(settled.value, settled.by_dead_band.1, by_delay);
            Propeller { track, asked, before, speed }
        };
        Self {
            propellers: tracks.iter().map(propeller).collect(),
            turning: turning.map(|turning| SignalIntegral::new(turning, BetweenSamples::Held)),
            propulsion: Propulsion::of(law),
            delay_s,
            law: ThrustLaw::of(law),
        }
    }

    /// The thrust of all over the step of `h` seconds that ends at `time_s`.
    #[inline]
    pub(crate) fn until(&mut self, time_s: f64, h: f64) -> Push {
        let at = |turning: &mut SignalIntegral<'_>| turning.until(time_s - 0.5 * h).1;
        let mut push = Push { turning: self.turning.as_mut().map_or(0.0, at), ..Push::default() };
        self.propulsion.step(h);
        let to_s = time_s - self.delay_s;
        for propeller in &mut self.propellers {
            let law = self.law.supplied(propeller.track, time_s - 0.5 * h);
            let before = propeller.before;
            let jump_s = propeller.asked.signal.jump_before(to_s, JUMP_PART * law.full_speed);
            let within = to_s - h + SLIVER_S..to_s - SLIVER_S;
            let jump_s = jump_s.filter(|jump_s| within.contains(jump_s));
            let first = jump_s.map(|jump_s| {
                let middle = propeller.asked.until(jump_s);
                (middle, jump_s - (to_s - h))
            });
            let after = propeller.asked.until(to_s);
            propeller.before = after;
            let Some((middle, first_s)) = first else {
                let asked = propeller.asked.mean(&before, &after, h, [true, true]);
                propeller.go(&self.propulsion, &law, asked, [h, h], &mut push);
                continue;
            };
            // A later jump makes what is before it longer, and what is after it shorter.
            let second_s = h - first_s;
            let asked = propeller.asked.mean(&before, &middle, first_s, [true, false]);
            propeller.go(&self.propulsion, &law, asked, [first_s, h], &mut push);
            propeller.end_later(&self.propulsion, &law, asked, 1.0 / h, &mut push);
            let asked = propeller.asked.mean(&middle, &after, second_s, [false, true]);
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
    /// Exponent of thrust over supply voltage, and the logarithm of the voltage where it changes nothing.
    voltage_exponent: f64,
    ln_mean_voltage: f64,
    /// Logarithm of the supply voltage over that, and what it makes of thrust.
    supply: f64,
    supply_gain: f64,
}

impl ThrustLaw {
    fn of(law: &DriveLaw) -> Self {
        let DriveLaw { beyond_square: exponent, full_speed, .. } = *law;
        Self {
            kappa: law.log_reverse_ratio.exp(),
            exponent,
            full_speed,
            ln_full_speed: full_speed.ln(),
            has_exponent: full_speed > 0.0 && (exponent != 0.0 || law.has_exponent),
            voltage_exponent: law.voltage_exponent,
            ln_mean_voltage: law.ln_mean_voltage,
            supply: 0.0,
            supply_gain: 1.0,
        }
    }

    /// Returns the law of a thruster at an instant, with its supply voltage.
    fn supplied(&self, track: &ThrusterTrack, time_s: f64) -> Self {
        let Some(Supply { ln_volts, of_curve }) = track.supply.as_deref() else { return *self };
        let supply = ln_volts.at(time_s) - of_curve.unwrap_or(self.ln_mean_voltage);
        Self { supply, supply_gain: (self.voltage_exponent * supply).exp(), ..*self }
    }

    /// Returns the sign of thrust by the way in which a propeller turns, and what it has per square of speed.
    fn strength(&self, track: &ThrusterTrack, is_reversed: bool) -> (f64, f64) {
        match is_reversed {
            true => (-1.0, self.supply_gain * self.kappa * track.reverse),
            false => (1.0, self.supply_gain * track.forward),
        }
    }
}

impl Push {
    /// Adds what a later end of a part of a step does, by the delay.
    fn end_later(&mut self, track: &ThrusterTrack, law: &ThrustLaw, speed: f64, weight: f64) {
        let (sign, strength) = law.strength(track, speed < 0.0);
        let gain = match law.has_exponent && speed != 0.0 {
            true => (law.exponent * (speed.abs().ln() - law.ln_full_speed)).exp(),
            false => 1.0,
        };
        let force = sign * track.lever * strength * gain * speed * speed;
        self.tau_by[DriveNumber::Delay as usize] += weight * force;
        let way = usize::from(sign * track.lever < 0.0);
        self.gamma_by[way][DriveNumber::Delay as usize] +=
            weight * track.lever * track.lever * speed.abs();
    }

    /// Adds the thrust of the part of a step in which the propeller turns one way.
    #[inline]
    fn add(&mut self, track: &ThrusterTrack, law: &ThrustLaw, segment: &Segment, h: f64) {
        let (sign, strength) = law.strength(track, segment.reversed);
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
            self.tau_by[DriveNumber::Exponent as usize] += force.x * ratio;
        }
        self.tau_by[DriveNumber::Voltage as usize] += force.x * law.supply;
        self.tau += force.x;
        for (all, by) in self.tau_by.iter_mut().zip(force.by) {
            *all += by;
        }
        let way = if segment.reversed { DriveNumber::Reverse } else { DriveNumber::Forward };
        self.tau_by[way as usize] += force.x;
        let area = segment.path.times(part * sign * track.lever * track.lever);
        let way = usize::from(sign * track.lever < 0.0);
        self.gamma[way] += area.x;
        for (all, by) in self.gamma_by[way].iter_mut().zip(area.by) {
            *all += by;
        }
    }
}
