//! Finds the stretches with working thrusters, and the axes that move during them.

use std::f64::consts::TAU;

use seaplant::quantity::{Attitude, Axis, World};
use seaplant::{Dof, Quantity, ThrusterInput};
use seaplant_log::{Channel, Log, Unit};

use crate::columns::{Mapped, Session};
use crate::units::dimension_of;
use crate::words::words;

/// A stretch of a session with thrust, s after the session's first sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    /// Start and end of the trial.
    pub from_s: f64,
    pub to_s: f64,
    /// Stretch in which thrusters work.
    pub active_s: Option<(f64, f64)>,
}

/// Idle time that separates two trials, s.
const IDLE_S: f64 = 30.0;
/// Margin of a trial before and after thrust: coasting reveals drag.
const BEFORE_S: f64 = 2.0;
const AFTER_S: f64 = 10.0;
/// Minimum number of samples of motion in a trial.
const LEAST_SAMPLES: usize = 10;

/// A series in SI units, s after the session's first sample.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Series {
    time_s: Vec<f64>,
    values: Vec<f64>,
}

/// Returns the stretches of a session with thrust; the complete session if there is none.
pub(super) fn windows(log: &Log, session: &Session, mapped: &[Mapped]) -> Vec<Window> {
    let span_s = session.end_s - session.start_s;
    let mut active: Vec<(f64, f64)> =
        inputs(log, session, mapped).iter().flat_map(active_intervals).collect();
    active.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut merged: Vec<(f64, f64)> = Vec::new();
    for (from, to) in active {
        match merged.last_mut() {
            Some(last) if from - last.1 <= IDLE_S => last.1 = last.1.max(to),
            _ => merged.push((from, to)),
        }
    }
    let window = |&(from, to): &(f64, f64)| Window {
        from_s: (from - BEFORE_S).max(0.0).floor(),
        to_s: (to + AFTER_S).min(span_s).ceil(),
        active_s: Some((from, to)),
    };
    let found: Vec<Window> =
        merged.iter().map(window).filter(|w| has_motion(log, session, mapped, w)).collect();
    if found.is_empty() {
        return vec![Window { from_s: 0.0, to_s: span_s.ceil(), active_s: None }];
    }
    found
}

fn has_motion(log: &Log, session: &Session, mapped: &[Mapped], window: &Window) -> bool {
    let motion = || mapped.iter().filter(|mapped| !is_input(mapped.quantity()));
    let enough = |mapped: &Mapped| {
        let series = series(log, session, mapped);
        let inside = |t: &&f64| (window.from_s..=window.to_s).contains(*t);
        series.time_s.iter().filter(inside).count() >= LEAST_SAMPLES
    };
    motion().next().is_none() || motion().any(enough)
}

fn is_input(quantity: &Quantity) -> bool {
    matches!(quantity, Quantity::Thruster { .. } | Quantity::Wrench(_))
}

/// Converts a channel to SI units; unchanged if no unit is known.
fn series(log: &Log, session: &Session, mapped: &Mapped) -> Series {
    let channel: &Channel = &log.channels()[mapped.channel];
    let dimension = dimension_of(mapped.quantity().kind());
    let unit = match (mapped.claim.unit, &channel.unit) {
        (Some(stated), _) => Unit::parse_as(stated, dimension).ok(),
        (None, stated) => stated.as_ref().and_then(|unit| unit.resolve(dimension).ok()),
    };
    let sign = if mapped.claim.negate { -1.0 } else { 1.0 };
    let si = |x: &f64| sign * unit.as_ref().map_or(*x, |unit| unit.to_si(*x));
    Series {
        time_s: channel.time_s().iter().map(|t| t - session.start_s).collect(),
        values: channel.values().iter().map(si).collect(),
    }
}

/// Returns inputs as deviations from neutral.
fn inputs(log: &Log, session: &Session, mapped: &[Mapped]) -> Vec<Series> {
    let input = |mapped: &Mapped| {
        let mut series = series(log, session, mapped);
        let stop = match mapped.quantity() {
            Quantity::Thruster { input: ThrusterInput::Pwm, .. } => STOPPED_US,
            _ => 0.0,
        };
        series.values.iter_mut().for_each(|x| *x -= stop);
        if stop != 0.0 {
            // Speed controllers rest a little off neutral.
            series.values.iter_mut().filter(|x| x.abs() < REST_US).for_each(|x| *x = 0.0);
        }
        series
    };
    mapped.iter().filter(|mapped| is_input(mapped.quantity())).map(input).collect()
}

/// Pulse width at which a hobby speed controller stops, us, and the tolerance of rest.
const STOPPED_US: f64 = 1500.0;
const REST_US: f64 = 15.0;

/// Returns the intervals in which an input deviates from rest by more than a twentieth of its
/// maximum.
fn active_intervals(input: &Series) -> Vec<(f64, f64)> {
    const PART: f64 = 0.05;
    let largest = input.values.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    let at = |k: usize| input.time_s.get(k).copied();
    let last = input.time_s.last().copied().unwrap_or(0.0);
    let active = |(k, x): (usize, &f64)| {
        let works = largest > 0.0 && x.abs() > PART * largest;
        works.then(|| at(k).map(|from| (from, at(k + 1).unwrap_or(last)))).flatten()
    };
    input.values.iter().enumerate().filter_map(active).collect()
}

/// Returns whether some input varies while it works, by more than a twentieth of its size.
pub(super) fn thrust_varies(
    log: &Log,
    session: &Session,
    mapped: &[Mapped],
    window: &Window,
) -> bool {
    const PART: f64 = 0.05;
    let Some((from_s, to_s)) = window.active_s else { return false };
    let varies = |input: &Series| {
        let works = input.within(&Window { from_s, to_s, active_s: None });
        let n = works.values.len() as f64;
        let mean = works.values.iter().sum::<f64>() / n;
        let spread = works.values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
        n > 0.0 && spread.sqrt() > PART * mean.abs()
    };
    inputs(log, session, mapped).iter().any(varies)
}

/// Returns whether an input that works in the session is named after a degree of freedom.
fn is_named_after(log: &Log, mapped: &[Mapped], dof: Dof) -> bool {
    let known: &[&str] = match dof {
        Dof::Surge => &["surge", "fore", "forward", "main", "longitudinal"],
        Dof::Sway => &["sway", "lateral", "lat", "transverse", "tunnel"],
        Dof::Heave => &["heave", "vertical", "vert"],
        Dof::Roll | Dof::Pitch | Dof::Yaw => &[],
    };
    // `fore-aft` acts along x; the fore one of two lateral thrusters does not.
    let named = |name: &str| words(name).first().is_some_and(|word| known.contains(&word.as_str()));
    mapped.iter().any(|mapped| {
        let works = !log.channels()[mapped.channel].is_constant();
        works && mapped.thruster().is_some_and(named)
    })
}

/// A degree of freedom, and how strongly it appears to be driven, from 0 to 1.
pub(super) type Score = (Dof, f64);

/// Ranks degrees of freedom by how strongly they appear to be driven; empty where no motion is
/// mapped.
///
/// A score is the size of the velocity relative to a typical one, times its squared correlation
/// with the input that it follows best; a vehicle's roll and pitch are rarely intended.
pub(super) fn driven(
    log: &Log,
    session: &Session,
    mapped: &[Mapped],
    window: &Window,
) -> Vec<Score> {
    const UNCORRELATED: f64 = 0.3;
    /// A misaligned instrument measures surge and sway alike; the thrusters' names distinguish
    /// them.
    const NAMED: f64 = 1.2;
    let inputs = inputs(log, session, mapped);
    let score = |dof: Dof| {
        let velocity = velocity(log, session, mapped, dof)?.within(window);
        if velocity.values.len() < LEAST_SAMPLES {
            return None;
        }
        let usual = customary(dof);
        let meant = match dof {
            Dof::Surge | Dof::Heave | Dof::Yaw => 1.0,
            Dof::Sway => 0.9,
            Dof::Roll | Dof::Pitch => 0.3,
        };
        let follows = inputs.iter().map(|input| velocity.follows(input)).fold(0.0, f64::max);
        let size = velocity.rms() / (velocity.rms() + usual);
        let meant = if is_named_after(log, mapped, dof) { NAMED * meant } else { meant };
        Some((dof, meant * size * (UNCORRELATED + (1.0 - UNCORRELATED) * follows)))
    };
    let mut scores: Vec<Score> = Dof::ALL.into_iter().filter_map(score).collect();
    scores.sort_by(|a, b| b.1.total_cmp(&a.1));
    scores
}

/// A translation with this correlation to the rate of turn comes from the lever arm of its
/// instrument.
const SWINGS: f64 = 0.8;

/// Returns a typical velocity of a vehicle in slow motion, m/s or rad/s.
pub(super) const fn customary(dof: Dof) -> f64 {
    match dof {
        Dof::Surge | Dof::Sway | Dof::Heave => 0.05,
        Dof::Yaw => 0.1,
        Dof::Roll | Dof::Pitch => 0.3,
    }
}

/// Returns the body velocity along a degree of freedom, measured or derived.
pub(super) fn velocity(
    log: &Log,
    session: &Session,
    mapped: &[Mapped],
    dof: Dof,
) -> Option<Series> {
    let find = |quantity: &Quantity| {
        let found = mapped.iter().find(|mapped| mapped.quantity() == quantity)?;
        Some(series(log, session, found))
    };
    let slope = |quantity: Quantity| Some(find(&quantity)?.derivative());
    let angle = |which| Some(find(&Quantity::Attitude(which))?.unwrapped().derivative());
    let measured = find(&Quantity::Velocity(dof));
    let dvl = |axis| find(&Quantity::DvlVelocity(axis));
    let felt = |axis| Some(find(&Quantity::Acceleration(axis))?.forgetful_integral());
    match dof {
        Dof::Surge => measured
            .or_else(|| dvl(Axis::X))
            .or_else(|| ground_speed(&find, dof))
            .or_else(|| felt(Axis::X)),
        Dof::Sway => measured
            .or_else(|| dvl(Axis::Y))
            .or_else(|| ground_speed(&find, dof))
            .or_else(|| felt(Axis::Y)),
        Dof::Heave => measured
            .or_else(|| slope(Quantity::Depth))
            .or_else(|| slope(Quantity::Position(World::Down)))
            .or_else(|| dvl(Axis::Z)),
        Dof::Roll => find(&Quantity::Rate(Axis::X)).or_else(|| angle(Attitude::Roll)),
        Dof::Pitch => find(&Quantity::Rate(Axis::Y)).or_else(|| angle(Attitude::Pitch)),
        Dof::Yaw => find(&Quantity::Rate(Axis::Z)).or_else(|| angle(Attitude::Heading)),
    }
}

/// Derives surge or sway from positions and heading.
fn ground_speed(find: &impl Fn(&Quantity) -> Option<Series>, dof: Dof) -> Option<Series> {
    let north = find(&Quantity::Position(World::North))?.derivative();
    let east = find(&Quantity::Position(World::East))?.derivative();
    let heading = find(&Quantity::Attitude(Attitude::Heading))?;
    let along = |(&t, &v_north): (&f64, &f64)| {
        let (sin, cos) = heading.held_at(t).sin_cos();
        let v_east = east.held_at(t);
        if dof == Dof::Surge { v_north * cos + v_east * sin } else { v_east * cos - v_north * sin }
    };
    let values = north.time_s.iter().zip(&north.values).map(along).collect();
    Some(Series { time_s: north.time_s, values })
}

impl Series {
    pub(super) fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub(super) fn within(&self, window: &Window) -> Self {
        let pairs = self.time_s.iter().zip(&self.values);
        let inside = pairs.filter(|(t, _)| (window.from_s..=window.to_s).contains(*t));
        let (time_s, values) = inside.map(|(t, x)| (*t, *x)).unzip();
        Self { time_s, values }
    }

    /// Returns the value of the last sample before `t`, or the first sample's.
    fn held_at(&self, t: f64) -> f64 {
        let after = self.time_s.partition_point(|sample| *sample <= t);
        self.values.get(after.saturating_sub(1)).copied().unwrap_or(0.0)
    }

    fn unwrapped(mut self) -> Self {
        let mut turns = 0.0;
        let mut before = self.values.first().copied().unwrap_or(0.0);
        for x in &mut self.values {
            turns -= ((*x - before) / TAU).round() * TAU;
            before = *x;
            *x += turns;
        }
        self
    }

    /// Differentiates over about a second, so that resolution does not dominate.
    fn derivative(&self) -> Self {
        const HALF_S: f64 = 0.5;
        let n = self.time_s.len();
        let slope = |k: usize| {
            let t = self.time_s[k];
            let low = self.time_s.partition_point(|s| *s < t - HALF_S).min(k.saturating_sub(1));
            let high = self.time_s.partition_point(|s| *s <= t + HALF_S).max(k + 2).min(n) - 1;
            let step = self.time_s[high] - self.time_s[low];
            if step > 0.0 { (self.values[high] - self.values[low]) / step } else { 0.0 }
        };
        Self { time_s: self.time_s.clone(), values: (0..n).map(slope).collect() }
    }

    /// Integrates with a time constant of seconds, as drag lets a vehicle lose its speed, after
    /// removing the mean, which comes from gravity and offsets.
    fn forgetful_integral(&self) -> Self {
        const FORGOTTEN_S: f64 = 3.0;
        let (mut kept, mut before) = (0.0, self.time_s.first().copied().unwrap_or(0.0));
        let mut pass = |(&t, &x): (&f64, &f64)| {
            let step = t - before;
            before = t;
            kept = kept * (-step / FORGOTTEN_S).exp() + x * step;
            kept
        };
        let mut values: Vec<f64> = self.time_s.iter().zip(&self.values).map(&mut pass).collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        values.iter_mut().for_each(|x| *x -= mean);
        Self { time_s: self.time_s.clone(), values }
    }

    pub(super) fn rms(&self) -> f64 {
        let sum: f64 = self.values.iter().map(|x| x * x).sum();
        (sum / self.values.len() as f64).sqrt()
    }

    /// Returns whether it correlates with a turn, as the velocity of an instrument away from the
    /// axis does.
    pub(super) fn swings_with(&self, turn: &Series) -> bool {
        let turn: Vec<f64> = self.time_s.iter().map(|t| turn.held_at(*t)).collect();
        correlation(&turn, &self.values).abs() > SWINGS
    }

    /// Returns the squared correlation with an input, signed-squared and lagged as by a hull.
    fn follows(&self, input: &Series) -> f64 {
        const LAGS_S: [f64; 2] = [1.0, 4.0];
        let driven = |lag_s: f64| {
            let (mut state, mut before) = (0.0, self.time_s[0]);
            let mut respond = |&t: &f64| {
                let push = input.held_at(t);
                state += (push * push.abs() - state) * (1.0 - (-(t - before) / lag_s).exp());
                before = t;
                state
            };
            self.time_s.iter().map(&mut respond).collect::<Vec<f64>>()
        };
        let squared = LAGS_S.iter().map(|lag_s| correlation(&driven(*lag_s), &self.values).powi(2));
        squared.fold(0.0, f64::max)
    }
}

/// Computes Pearson's correlation, 0 if one of the two does not vary.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let pairs = || a.iter().zip(b).map(|(a, b)| (a - mean_a, b - mean_b));
    let (ab, aa, bb) =
        pairs().fold((0.0, 0.0, 0.0), |(ab, aa, bb), (a, b)| (ab + a * b, aa + a * a, bb + b * b));
    let scale = (aa * bb).sqrt();
    if scale > 0.0 { ab / scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_is_unwrapped_before_its_slope_is_taken() {
        let values: Vec<f64> = (0..100).map(|k| (f64::from(k) * 0.1) % TAU).collect();
        let time_s = (0..100).map(f64::from).collect();
        let slopes = Series { time_s, values }.unwrapped().derivative().values;
        assert!(slopes.iter().all(|slope| (slope - 0.1).abs() < 1e-12));
    }

    #[test]
    fn an_input_is_active_where_it_is_off_rest() {
        let input = Series { time_s: vec![0.0, 1.0, 2.0, 3.0], values: vec![0.0, 5.0, 0.1, 5.0] };
        assert_eq!(active_intervals(&input), [(1.0, 2.0), (3.0, 3.0)]);
    }
}
