//! What is odd about a channel's values, one detector each.

use std::fmt;

use seaplant_log::{Channel, Dimension};

use super::angles::{unit_misfit, unwrapped, wraps};
use super::runs::{Run, distinct, quantile, runs_within};
use crate::missing_code::{MissingCode, missing_codes};
use crate::propose::words::{HEADING, PITCH, ROLL, is_input, words};

/// Something odd, with the numbers that say so.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Remark {
    Constant { value: String, count: usize },
    Sentinel { value: String, count: usize },
    ZeroFilled { runs: usize, samples: usize, first_s: f64 },
    Saturated { count: usize, of: usize, end: &'static str, value: String },
    Frozen { value: String, from_s: f64, to_s: f64, samples: usize, others: usize },
    Held { every_s: f64, logged_s: f64 },
    Clock,
    Wraps { times: usize, jump: String },
    Unwrapped { turns: String },
    LooksLikeDegrees { reaches: String },
    LooksLikeRadians { from: String, to: String },
    Irregular { median_s: f64, p95_s: f64 },
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Constant { value, count } => {
                write!(f, "constant: all {count} samples are {value}")
            }
            Self::Sentinel { value, count } => write!(
                f,
                "{count} samples are {value}, far from all others: probably a code for missing data; remove them from the log"
            ),
            Self::ZeroFilled { runs, samples, first_s } => write!(
                f,
                "zero-filled: {} in {}, exactly 0 between values far from it, first at {first_s:.2} s: dropouts, perhaps; leave them empty in the log",
                times(*samples, "sample", "samples"),
                times(*runs, "stretch", "stretches")
            ),
            Self::Saturated { count, of, end, value } => {
                write!(f, "saturated: {count} of {of} samples are exactly at the {end}, {value}")
            }
            Self::Frozen { value, from_s, to_s, samples, others } => {
                write!(
                    f,
                    "frozen: {value} from {from_s:.2} to {to_s:.2} s ({samples} samples), although it changes otherwise"
                )?;
                if *others > 0 {
                    write!(f, "; {} more", times(*others, "such stretch", "such stretches"))?;
                }
                Ok(())
            }
            Self::Held { every_s, logged_s } => write!(
                f,
                "changes every {every_s:.3} s though logged every {logged_s:.3} s: old samples are repeated, which looks like standstill and jumps; log each sample once"
            ),
            Self::Clock => {
                write!(f, "rises evenly with time: a clock or a counter, not a measurement")
            }
            Self::Wraps { times: count, jump } => write!(
                f,
                "wraps {} (jumps of about {jump}); Seaplant unwraps it",
                times(*count, "time", "times")
            ),
            Self::Unwrapped { turns } => {
                write!(f, "spans {turns} turns without a jump: it is unwrapped already")
            }
            Self::LooksLikeDegrees { reaches } => write!(
                f,
                "reaches {reaches}, so it looks like degrees; state unit = \"deg\" if it is"
            ),
            Self::LooksLikeRadians { from, to } => write!(
                f,
                "spans {from} to {to}, so it looks like radians; state unit = \"rad\" if it is"
            ),
            Self::Irregular { median_s, p95_s } => write!(
                f,
                "irregular sampling: every {median_s:.3} s in the median, but one interval in twenty is longer than {p95_s:.3} s"
            ),
        }
    }
}

fn times(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// A channel as the detectors look at it.
pub(super) struct Facts<'a> {
    pub(super) channel: &'a Channel,
    words: Vec<String>,
    time_s: Vec<f64>,
    pub(super) values: Vec<f64>,
    /// Longer intervals than this, s, may be stretches of the log that were not read.
    pause_s: f64,
}

/// Few samples show no habit that a channel could break.
const LEAST_SAMPLES: usize = 20;

/// Everything odd about a channel.
pub(crate) fn remarks(channel: &Channel) -> Vec<Remark> {
    remarks_within(channel, f64::INFINITY)
}

/// Everything odd about a channel between pauses: intervals of `pause_s` and longer, over which
/// nothing is concluded.
pub(super) fn remarks_within(channel: &Channel, pause_s: f64) -> Vec<Remark> {
    let mut facts = Facts {
        channel,
        words: words(&channel.name),
        time_s: channel.time_s().to_vec(),
        values: channel.values().to_vec(),
        pause_s,
    };
    if let Some(constant) = constant(&facts) {
        return vec![constant];
    }
    let mut found = sentinels(&mut facts);
    found.extend(irregular(&facts));
    if facts.values.len() < LEAST_SAMPLES {
        found.extend([wraps(&facts), unit_misfit(&facts)].into_iter().flatten());
        return found;
    }
    let zero_filled = zero_filled(&facts);
    let saturated = saturated(&facts);
    let explained = explained(&zero_filled, &saturated, &facts);
    found.extend(frozen(&facts, &explained));
    found.extend(zero_filled);
    found.extend(saturated);
    let others = [held, clock, wraps, unwrapped, unit_misfit];
    found.extend(others.into_iter().filter_map(|detect| detect(&facts)));
    found
}

impl Facts<'_> {
    pub(super) fn with_unit(&self, value: f64) -> String {
        match &self.channel.unit {
            Some(unit) => format!("{} {unit}", short(value)),
            None => short(value),
        }
    }

    fn dimension(&self) -> Option<Dimension> {
        self.channel.unit.as_ref().map(|unit| unit.dimension())
    }

    fn is_input(&self) -> bool {
        is_input(self.channel, &self.words)
    }

    pub(super) fn has_word(&self, known: &[&str]) -> bool {
        self.words.iter().any(|word| known.contains(&word.as_str()))
    }

    pub(super) fn is_heading(&self) -> bool {
        self.has_word(HEADING)
    }

    pub(super) fn is_angle(&self) -> bool {
        match self.dimension() {
            Some(dimension) => dimension == Dimension::Angle,
            None => self.is_heading() || self.has_word(ROLL) || self.has_word(PITCH),
        }
    }

    pub(super) fn steps(&self) -> impl Iterator<Item = f64> + '_ {
        self.pairs().map(|[before, after]| (after - before).abs())
    }

    /// Each value and the next, unless a pause lies between.
    fn pairs(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let pairs = self.values.windows(2).map(|w| [w[0], w[1]]).enumerate();
        pairs.filter(|(k, _)| self.follows(k + 1)).map(|(_, pair)| pair)
    }

    /// The times from each sample to the next, s, without pauses.
    fn intervals(&self) -> impl Iterator<Item = f64> + '_ {
        let all = self.channel.time_s().windows(2).map(|w| w[1] - w[0]);
        all.filter(|interval_s| *interval_s < self.pause_s)
    }

    fn runs(&self) -> Vec<Run> {
        runs_within(&self.values, |k| self.follows(k))
    }

    /// Whether no pause lies before a sample.
    fn follows(&self, k: usize) -> bool {
        self.time_s[k] - self.time_s[k - 1] < self.pause_s
    }

    pub(super) fn min_max(&self) -> (f64, f64) {
        let fold = |(low, high): (f64, f64), x: &f64| (low.min(*x), high.max(*x));
        self.values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), fold)
    }

    pub(super) fn largest(&self) -> f64 {
        self.values.iter().fold(0.0, |largest, x| x.abs().max(largest))
    }
}

/// Five significant digits.
pub(crate) fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{}", x.abs());
    }
    let scale = 10f64.powi(4 - x.abs().log10().floor() as i32);
    let rounded = (x * scale).round() / scale;
    format!("{}", if rounded.is_finite() { rounded } else { x })
}

fn constant(facts: &Facts<'_>) -> Option<Remark> {
    let count = facts.values.len();
    let value = facts.with_unit(*facts.values.first()?);
    (count > 1 && facts.channel.is_constant()).then_some(Remark::Constant { value, count })
}

/// Values that mark the absence of one; they are taken out of `facts`.
fn sentinels(facts: &mut Facts<'_>) -> Vec<Remark> {
    let codes = missing_codes(&facts.values);
    let keep = |x: f64| codes.iter().all(|code| code.value != x);
    let kept = facts.time_s.iter().zip(&facts.values).filter(|(_, x)| keep(**x));
    let (time_s, values) = kept.map(|(t, x)| (*t, *x)).unzip();
    let remark = |code: &MissingCode| Remark::Sentinel {
        value: facts.with_unit(code.value),
        count: code.count,
    };
    let found = codes.iter().map(remark).collect();
    (facts.time_s, facts.values) = (time_s, values);
    found
}

/// Exact zeros between values from which no ordinary step leads to zero.
fn zero_filled(facts: &Facts<'_>) -> Option<Remark> {
    /// So many of the largest ordinary steps (95 %) away from zero.
    const JUMP: f64 = 5.0;
    let moving = facts.steps().filter(|step| *step > 0.0).count() * 2 > facts.values.len();
    if facts.is_input() || !moving {
        return None;
    }
    let off_zero = facts.pairs().filter(|w| w[0] != 0.0 && w[1] != 0.0);
    let ordinary = quantile(off_zero.map(|w| (w[1] - w[0]).abs()), 0.95)?;
    let far = |x: f64| x.abs() > JUMP * ordinary;
    let dropout = |run: &Run| {
        let before = run.from.checked_sub(1).map(|k| facts.values[k]);
        let after = facts.values.get(run.to).copied();
        run.value == 0.0 && before.zip(after).is_some_and(|(a, b)| far(a) && far(b))
    };
    let found: Vec<Run> = facts.runs().into_iter().filter(dropout).collect();
    Some(Remark::ZeroFilled {
        runs: found.len(),
        samples: found.iter().map(Run::len).sum(),
        first_s: facts.time_s[found.first()?.from],
    })
}

/// Many samples exactly at an end of a range of many levels.
fn saturated(facts: &Facts<'_>) -> Option<Remark> {
    /// Fewer make a command of few levels.
    const LEVELS: usize = 10;
    /// At least so many samples, such a part of all, so many times a level's share.
    const SAMPLES: usize = 10;
    const PART: f64 = 0.02;
    const SHARES: f64 = 5.0;
    /// So many times the next level's: the peak of a coarse sine has but one and a half.
    const NEIGHBOURS: usize = 4;
    let (n, levels) = (facts.values.len(), distinct(&facts.values));
    if levels < LEVELS {
        return None;
    }
    let (min, max) = facts.min_max();
    let at = |end: f64| facts.values.iter().filter(|x| **x == end).count();
    // Zero is where things rest.
    let ends = [("minimum", min), ("maximum", max)].into_iter().filter(|(_, end)| *end != 0.0);
    let (end, value, count) =
        ends.map(|(name, end)| (name, end, at(end))).max_by_key(|(_, _, count)| *count)?;
    let inner = facts.values.iter().copied().filter(|x| *x != value);
    let next = inner.min_by(|a, b| (a - value).abs().total_cmp(&(b - value).abs()))?;
    if count < NEIGHBOURS * at(next) {
        return None;
    }
    let many = count as f64 > (PART * n as f64).max(SHARES * n as f64 / levels as f64);
    let value = facts.with_unit(value);
    (many && count >= SAMPLES).then_some(Remark::Saturated { count, of: n, end, value })
}

/// Values whose long runs another remark explains.
fn explained(
    zero_filled: &Option<Remark>,
    saturated: &Option<Remark>,
    facts: &Facts<'_>,
) -> Vec<f64> {
    let (min, max) = facts.min_max();
    let zero = zero_filled.iter().map(|_| 0.0);
    zero.chain(saturated.iter().flat_map(|_| [min, max])).collect()
}

/// One value for long in a channel that else changes at nearly every sample; of a coarse one, for
/// much longer than it else ever stands.
fn frozen(facts: &Facts<'_>, explained: &[f64]) -> Option<Remark> {
    const LONGER_THAN_S: f64 = 5.0;
    const MORE_THAN: usize = 20;
    /// The part of all other steps that change the value; that of a coarse channel.
    const LIVELY: f64 = 0.9;
    const COARSE: f64 = 0.5;
    /// So many times what a coarse channel else stands at the most.
    const MUCH: usize = 10;
    if facts.is_input() {
        return None;
    }
    let all = facts.runs();
    let long = |run: &&Run| run.len() > MORE_THAN && run.span_s(&facts.time_s) > LONGER_THAN_S;
    let stuck: usize = all.iter().filter(long).map(|run| run.len() - 1).sum();
    let steps = facts.values.len() - 1 - stuck;
    let changes = all.len() - 1;
    if (changes as f64) < COARSE * steps as f64 || changes < LEAST_SAMPLES / 2 {
        return None;
    }
    let lively = changes as f64 >= LIVELY * steps as f64;
    let usual = all.iter().filter(|run| !long(run)).map(Run::len).max().unwrap_or(0);
    let long = |run: &&Run| long(run) && (lively || run.len() > MUCH * usual);
    let long: Vec<&Run> =
        all.iter().filter(long).filter(|run| !explained.contains(&run.value)).collect();
    let longest = long.iter().max_by_key(|run| run.len())?;
    Some(Remark::Frozen {
        value: facts.with_unit(longest.value),
        from_s: facts.time_s[longest.from],
        to_s: facts.time_s[longest.to - 1],
        samples: longest.len(),
        others: long.len() - 1,
    })
}

/// A slow instrument logged at a fast rate: each new value stands several times.
fn held(facts: &Facts<'_>) -> Option<Remark> {
    const CHANGES: usize = 5;
    let all = facts.runs();
    let changes = all.len() - 1;
    let often = changes * 10 > facts.values.len() * 6;
    // Levels that come back are those of a coarse resolution, as are equal steps.
    let levels_return = distinct(&facts.values) * 5 < all.len() * 4;
    let steps = || facts.steps().filter(|step| *step > 0.0);
    let (least, usual) = (quantile(steps(), 0.0)?, quantile(steps(), 0.5)?);
    if facts.is_input() || changes < CHANGES || often || levels_return || usual < 1.5 * least {
        return None;
    }
    let starts: Vec<f64> = all.iter().map(|run| facts.time_s[run.from]).collect();
    let between = || starts.windows(2).map(|w| w[1] - w[0]);
    let (every_s, slowest_s) = (quantile(between(), 0.5)?, quantile(between(), 0.9)?);
    let logged_s = quantile(facts.intervals(), 0.5)?;
    let regular = slowest_s <= 2.0 * every_s && every_s > 1.5 * logged_s;
    regular.then_some(Remark::Held { every_s, logged_s })
}

/// Values that follow time to a thousandth of their span.
fn clock(facts: &Facts<'_>) -> Option<Remark> {
    const PART: f64 = 1e-3;
    let rising = facts.values.windows(2).all(|w| w[0] < w[1]);
    if facts.is_input() || facts.is_angle() || !rising {
        return None;
    }
    let ((t0, t1), (x0, x1)) = (ends(&facts.time_s)?, ends(&facts.values)?);
    let slope = (x1 - x0) / (t1 - t0);
    let pairs = facts.time_s.iter().zip(&facts.values);
    let off = |(t, x): (&f64, &f64)| (x - x0 - slope * (t - t0)).abs();
    pairs.map(off).all(|off| off <= PART * (x1 - x0)).then_some(Remark::Clock)
}

fn ends(values: &[f64]) -> Option<(f64, f64)> {
    Some((*values.first()?, *values.last()?))
}

fn irregular(facts: &Facts<'_>) -> Option<Remark> {
    let intervals = || facts.intervals();
    if facts.channel.len() < LEAST_SAMPLES {
        return None;
    }
    let (median_s, p95_s) = (quantile(intervals(), 0.5)?, quantile(intervals(), 0.95)?);
    (p95_s > 2.0 * median_s).then_some(Remark::Irregular { median_s, p95_s })
}
