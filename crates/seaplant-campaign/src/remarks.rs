//! Detects irregularities of a channel's values, one detector each.

use seaplant_log::Channel;

mod angles;
mod facts;
mod remark;
mod runs;

pub(crate) use angles::looks_like_degrees;
pub(crate) use facts::short;
pub(crate) use remark::Remark;

use angles::{unit_misfit, unwrapped, wraps};
use facts::Facts;
use runs::{Run, distinct, quantile};

use crate::missing_code::{MissingCode, missing_codes};
use crate::words::words;

/// Minimum number of samples from which a pattern is inferred.
const LEAST_SAMPLES: usize = 20;

/// Returns all irregularities of a channel.
pub(crate) fn remarks(channel: &Channel) -> Vec<Remark> {
    remarks_within(channel, f64::INFINITY)
}

/// Returns all irregularities of a channel between pauses: intervals of `pause_s` and longer,
/// across which nothing is concluded.
pub(crate) fn remarks_within(channel: &Channel, pause_s: f64) -> Vec<Remark> {
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

fn constant(facts: &Facts<'_>) -> Option<Remark> {
    let count = facts.values.len();
    let value = facts.with_unit(*facts.values.first()?);
    (count > 1 && facts.channel.is_constant()).then_some(Remark::Constant { value, count })
}

/// Detects codes for missing data, and removes them from `facts`.
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

/// Detects exact zeros between values from which no ordinary step leads to zero.
fn zero_filled(facts: &Facts<'_>) -> Option<Remark> {
    /// Minimum ratio of a step to zero to the largest ordinary steps (95 %).
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

/// Detects many samples exactly at an end of a range of many levels.
fn saturated(facts: &Facts<'_>) -> Option<Remark> {
    /// Fewer levels are those of a command.
    const LEVELS: usize = 10;
    /// Minimum number of samples, fraction of all, and multiple of a level's share.
    const SAMPLES: usize = 10;
    const PART: f64 = 0.02;
    const SHARES: f64 = 5.0;
    /// Multiple of the next level's count: the peak of a coarse sine has only one and a half.
    const NEIGHBOURS: usize = 4;
    let (n, levels) = (facts.values.len(), distinct(&facts.values));
    if levels < LEVELS {
        return None;
    }
    let (min, max) = facts.min_max();
    let at = |end: f64| facts.values.iter().filter(|x| **x == end).count();
    // Zero is where signals rest.
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

/// Returns values whose long runs another remark explains.
fn explained(
    zero_filled: &Option<Remark>,
    saturated: &Option<Remark>,
    facts: &Facts<'_>,
) -> Vec<f64> {
    let (min, max) = facts.min_max();
    let zero = zero_filled.iter().map(|_| 0.0);
    zero.chain(saturated.iter().flat_map(|_| [min, max])).collect()
}

/// Detects a long constant value in a channel that otherwise changes at nearly every sample; in a
/// coarse one, much longer than any other run.
fn frozen(facts: &Facts<'_>, explained: &[f64]) -> Option<Remark> {
    const LONGER_THAN_S: f64 = 5.0;
    const MORE_THAN: usize = 20;
    /// Fraction of all other steps that change the value; likewise of a coarse channel.
    const LIVELY: f64 = 0.9;
    const COARSE: f64 = 0.5;
    /// Multiple of a coarse channel's longest other run.
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

/// Detects a slow instrument logged at a fast rate: each new value is repeated.
fn held(facts: &Facts<'_>) -> Option<Remark> {
    const CHANGES: usize = 5;
    let all = facts.runs();
    let changes = all.len() - 1;
    let often = changes * 10 > facts.values.len() * 6;
    // Levels that recur come from a coarse resolution, as do equal steps.
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

/// Detects values that follow time to a thousandth of their span.
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
