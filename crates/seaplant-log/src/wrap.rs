//! Unwraps clocks that restart from their lowest value: at midnight, at the end of a week, at the
//! overflow of a counter.

use crate::epoch::DAY_S;

/// A cyclic clock.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cycle {
    /// Its lowest value and its period, in the unit of the column.
    low: f64,
    length: f64,
    name: &'static str,
}

/// Name of the period that ends at midnight.
pub(crate) const DAY: &str = "the day";

/// Result of unwrapping.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wrapped {
    /// Number of overflows.
    pub(crate) count: usize,
    /// First row after the first overflow.
    pub(crate) row: usize,
    /// Time before and after, in the unit of the column.
    pub(crate) step: [f64; 2],
    /// Name of the period: "the day".
    pub(crate) cycle: &'static str,
}

/// Unwraps times of day that pass midnight; seconds.
///
/// A time more than half a day before its predecessor belongs to the next day. One that much after
/// it is a late row of the day before, if any midnight has passed.
pub(crate) fn carry_on_days(time_s: &mut [f64]) -> Option<Wrapped> {
    let midnight = Cycle { low: 0.0, length: DAY_S, name: DAY };
    unwrap(time_s, midnight, 0.5 * DAY_S)
}

/// Unwraps numbers that restart at the end of a day, of a GPS week, or of a counter: only where
/// they come within twenty steps of both ends.
///
/// `second` is one second in the unit of the column.
pub(crate) fn carry_on_counts(time: &mut [f64], second: f64) -> Option<Wrapped> {
    /// A gap or a lost packet, but not the start of another log.
    const STEPS: f64 = 20.0;
    let backward = |w: &&[f64]| w[1] < w[0];
    let step = usual_step(time)?;
    let jump = time.windows(2).find(backward).map(|w| [w[0], w[1]])?;
    let near = STEPS * step;
    let fits = |cycle: &Cycle| {
        let high = cycle.low + cycle.length;
        let [from, to] = jump;
        let inside = time.iter().all(|t| t.is_nan() || (cycle.low..=high).contains(t));
        inside && high - from <= near && to - cycle.low <= near && near < 0.1 * cycle.length
    };
    let cycle = cycles(time, second).into_iter().find(fits)?;
    unwrap(time, cycle, cycle.length - 2.0 * near)
}

/// Returns the periods that may apply.
fn cycles(time: &[f64], second: f64) -> Vec<Cycle> {
    let mut known = vec![
        Cycle { low: 0.0, length: DAY_S * second, name: DAY },
        Cycle { low: 0.0, length: 7.0 * DAY_S * second, name: "the week" },
    ];
    if time.iter().all(|t| t.is_nan() || t.fract() == 0.0) {
        let full = |bits: i32| f64::from(bits).exp2();
        known.extend([
            Cycle { low: 0.0, length: full(32), name: "a counter of 32 bits" },
            Cycle { low: -full(31), length: full(32), name: "a signed counter of 32 bits" },
            Cycle { low: 0.0, length: full(31), name: "a counter of 31 bits" },
            Cycle { low: 0.0, length: full(16), name: "a counter of 16 bits" },
        ]);
    }
    known
}

/// Returns the median of the forward steps.
fn usual_step(time: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0.0).collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Adds a period after each backward step of more than `far`, and subtracts it at an equal forward
/// step, which a late row causes.
fn unwrap(time: &mut [f64], cycle: Cycle, far: f64) -> Option<Wrapped> {
    let mut found: Option<Wrapped> = None;
    let mut turns = 0.0;
    let mut before = f64::NAN;
    for (row, t) in time.iter_mut().enumerate().filter(|(_, t)| !t.is_nan()) {
        let now = *t;
        if before - now > far {
            turns += 1.0;
            let step = [before, now];
            let first = Wrapped { count: 0, row, step, cycle: cycle.name };
            found.get_or_insert(first).count += 1;
        } else if now - before > far && turns > 0.0 {
            turns -= 1.0;
        }
        before = now;
        *t = now + turns * cycle.length;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn midnight_carries_on_even_across_a_late_row() {
        let mut time = [86_398.0, 86_399.5, 0.5, 86_399.9, 1.0, f64::NAN, 2.0];
        let found = carry_on_days(&mut time).unwrap();
        assert_eq!(time[..5], [86_398.0, 86_399.5, 86_400.5, 86_399.9, 86_401.0]);
        assert_eq!(time[6], 86_402.0);
        assert_eq!((found.row, found.step), (2, [86_399.5, 0.5]));
    }

    #[test]
    fn each_cycle_is_determined_by_both_its_ends() {
        let count = |full: f64, low: f64, step: f64| -> Vec<f64> {
            (-30..30).map(|k| low + (f64::from(k) * step + full).rem_euclid(full)).collect()
        };
        for (full, low, step, second, name) in [
            (86_400.0, 0.0, 0.1, 1.0, "the day"),
            (86_400e3, 0.0, 100.0, 1e3, "the day"),
            (604_800.0, 0.0, 0.5, 1.0, "the week"),
            (4_294_967_296.0, 0.0, 20_000.0, 1e6, "a counter of 32 bits"),
            (4_294_967_296.0, -2_147_483_648.0, 20_000.0, 1e6, "a signed counter of 32 bits"),
            (2_147_483_648.0, 0.0, 1000.0, 1e6, "a counter of 31 bits"),
            (65_536.0, 0.0, 50.0, 1e3, "a counter of 16 bits"),
        ] {
            let mut time = count(full, low, step);
            let found = carry_on_counts(&mut time, second).unwrap_or_else(|| panic!("{name}"));
            assert_eq!((found.cycle, found.row, found.count), (name, 30, 1));
            let even = time.windows(2).all(|w| (w[1] - w[0] - step).abs() < 1e-6 * step);
            assert!(even, "{name}");
        }
    }

    #[test]
    fn a_clock_that_merely_starts_again_is_left_alone() {
        for mut time in [
            vec![500.0, 501.0, 502.0, 0.0, 1.0, 2.0],
            vec![86_000.0, 86_001.0, 86_002.0, 0.0, 1.0],
            vec![86_398.0, 86_399.0, 300.0, 301.0],
            vec![86_390.5, 86_400.5, 1.0, 2.0],
            vec![1.0, 2.0, 1.5, 3.0],
        ] {
            let before = time.clone();
            assert_eq!(carry_on_counts(&mut time, 1.0), None);
            assert_eq!(time, before);
        }
    }
}
