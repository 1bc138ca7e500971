//! Detects irregularities of angles: jumps of a turn, and values in another unit than stated.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use seaplant::quantity::Attitude;
use seaplant_log::Dimension;

use super::facts::{Facts, short};
use super::remark::Remark;
use crate::words::{PITCH, ROLL};

/// A little more than rounding error.
const SPARE: f64 = 1.001;

/// Counts steps of about one turn, where all others are less than half of one and the values stay
/// within it.
fn turns(facts: &Facts<'_>, turn: f64) -> usize {
    let about = |step: &f64| (0.75 * turn..=1.1 * turn).contains(step);
    let strange = facts.steps().any(|step| step > 0.5 * turn && !about(&step));
    let (min, max) = facts.min_max();
    let within = min >= -SPARE * turn && max <= SPARE * turn;
    if strange || !within { 0 } else { facts.steps().filter(about).count() }
}

/// Returns a turn in the unit that the header states.
fn stated_turn(facts: &Facts<'_>) -> Option<f64> {
    facts.channel.unit.as_ref().map(|unit| TAU / unit.factor())
}

pub(super) fn wraps(facts: &Facts<'_>) -> Option<Remark> {
    if !facts.is_angle() {
        return None;
    }
    // Headings in the wrong unit also wrap.
    let candidates = stated_turn(facts).into_iter().chain([360.0, TAU]);
    let turn = candidates.into_iter().find(|turn| turns(facts, *turn) > 0)?;
    Some(Remark::Wraps { times: turns(facts, turn), jump: facts.with_unit(turn) })
}

/// Detects a heading that continues where others wrap.
pub(super) fn unwrapped(facts: &Facts<'_>) -> Option<Remark> {
    let turn = stated_turn(facts).filter(|_| facts.is_angle() && facts.is_heading())?;
    let (min, max) = facts.min_max();
    let smooth = facts.steps().all(|step| step < 0.5 * turn);
    let far = max - min > 1.1 * turn && !is_in_degrees(facts);
    (smooth && far)
        .then(|| Remark::Unwrapped { turns: short(((max - min) / turn * 10.0).round() / 10.0) })
}

/// Detects degrees under a header that states radians, or the reverse.
pub(super) fn unit_misfit(facts: &Facts<'_>) -> Option<Remark> {
    let unit = facts.channel.unit.as_ref().filter(|unit| unit.dimension() == Dimension::Angle)?;
    if unit.factor() == 1.0 {
        let reaches = || facts.with_unit(facts.largest());
        return is_in_degrees(facts).then(|| Remark::LooksLikeDegrees { reaches: reaches() });
    }
    // A course held within 3 degrees is no evidence of radians; one that fills a turn is.
    let (min, max) = facts.min_max();
    let within_a_turn = max - min <= SPARE * TAU && min >= -SPARE * PI && max <= SPARE * TAU;
    let fills_a_turn = max - min > 4.0 && within_a_turn;
    let fine = facts.values.iter().any(|x| x.fract() != 0.0);
    let is_degrees = (unit.factor() - PI / 180.0).abs() < 1e-12;
    let radians = is_degrees && facts.is_heading() && fine && within_a_turn;
    (radians && (turns(facts, TAU) > 0 || fills_a_turn))
        .then(|| Remark::LooksLikeRadians { from: short(min), to: facts.with_unit(max) })
}

/// Returns whether an angle stated in radians is implausible: it wraps as degrees do, or exceeds
/// its range.
fn is_in_degrees(facts: &Facts<'_>) -> bool {
    let radians = facts.channel.unit.as_ref().is_some_and(|unit| unit.factor() == 1.0);
    let largest = facts.largest();
    let named = [
        (Attitude::Heading, facts.is_heading()),
        (Attitude::Roll, facts.has_word(ROLL)),
        (Attitude::Pitch, facts.has_word(PITCH)),
    ];
    let beyond = named.into_iter().any(|(angle, is)| is && looks_like_degrees(angle, largest));
    radians && (turns(facts, 360.0) > 0 || beyond)
}

/// Returns whether an angle of this size is implausible in radians: for a heading, more than five
/// turns.
pub(crate) fn looks_like_degrees(angle: Attitude, largest: f64) -> bool {
    largest
        > match angle {
            Attitude::Roll => SPARE * PI,
            Attitude::Pitch => SPARE * FRAC_PI_2,
            Attitude::Heading => 30.0,
        }
}
