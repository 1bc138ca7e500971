//! Samples at their own times, and uniform grids.

mod cutter;
mod reader;

use std::ops::Range;
use std::sync::Arc;

pub(crate) use cutter::Cutter;
use cutter::PartOfBase;
use reader::HeldIntegral;
pub(crate) use reader::Reader;

use crate::Error;

/// Samples of one quantity at their own times.
///
/// Times are seconds, finite and strictly increasing; values are finite. The
/// constructor checks this once, so that later code need not.
///
/// ```
/// use seaplant::Timed;
/// let depth = Timed::new("depth", vec![0.0, 1.0, 2.0], vec![5.0, 5.5, 6.5])?;
/// assert_eq!(depth.at(1.5), 6.0);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Timed {
    time_s: Arc<[f64]>,
    values: Arc<[f64]>,
    steps: Intervals,
}

/// Statistics of the intervals between samples, s; zero for a single sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Intervals {
    shortest: f64,
    median: f64,
    longest: f64,
}

/// Tolerance of times on a grid, as a fraction of its period: decimal time stamps are rounded.
const ROUNDING_PART: f64 = 1e-6;

/// Tolerance of equal times, s: seconds since 1970 are rounded to a quarter of a microsecond.
pub(crate) const ROUNDING_S: f64 = 1e-6;

/// Longest interval that is never a gap in a held signal, s.
const LEAST_HELD_GAP_S: f64 = 1.0;

impl Intervals {
    fn between(time_s: &[f64]) -> Self {
        let (mut shortest, mut longest) = (f64::INFINITY, f64::NEG_INFINITY);
        for pair in time_s.windows(2) {
            let step = pair[1] - pair[0];
            shortest = if step < shortest { step } else { shortest };
            longest = if step > longest { step } else { longest };
        }
        let (Some(first), Some(last), true) = (time_s.first(), time_s.last(), time_s.len() > 1)
        else {
            return Self { shortest: 0.0, median: 0.0, longest: 0.0 };
        };
        let mean = (last - first) / (time_s.len() - 1) as f64;
        let steady = longest - shortest <= ROUNDING_PART * mean + ROUNDING_S;
        Self { shortest, median: if steady { mean } else { median_step(time_s) }, longest }
    }
}

fn median_step(time_s: &[f64]) -> f64 {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    median(&mut steps).unwrap_or(0.0)
}

/// Equally spaced instants: `start_s + k period_s` for k = 0 … len − 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The first instant, s.
    pub start_s: f64,
    /// The interval, s.
    pub period_s: f64,
    /// The number of instants.
    pub len: usize,
}

/// A stretch without samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The last sample before it, s.
    pub from_s: f64,
    /// The first sample after it, s.
    pub to_s: f64,
}

impl Grid {
    /// Creates the grid from `from_s` to `to_s` (both included where they lie on it).
    pub fn spanning(from_s: f64, to_s: f64, period_s: f64) -> Self {
        // Half a millionth of a step absorbs the rounding of decimal time stamps.
        let len = ((to_s - from_s) / period_s + 5e-7).floor().max(0.0) as usize + 1;
        Self { start_s: from_s, period_s, len }
    }

    /// Returns the k-th instant, s.
    pub fn time(&self, k: usize) -> f64 {
        self.start_s + k as f64 * self.period_s
    }

    /// Returns the grid of a range of its instants.
    pub fn part(&self, of: Range<usize>) -> Self {
        Self { start_s: self.time(of.start), period_s: self.period_s, len: of.len() }
    }

    /// Returns all instants, s.
    pub fn times(&self) -> impl Iterator<Item = f64> + '_ {
        (0..self.len).map(|k| self.time(k))
    }
}

impl Timed {
    /// Checks and stores samples; `name` identifies them in errors.
    ///
    /// # Errors
    /// [`Error::Length`] if there is not one value per time, [`Error::TooShort`]
    /// without any, [`Error::NotFinite`] for a time or value that is NaN or
    /// infinite, [`Error::TimeOrder`] where time does not increase.
    pub fn new(
        name: &str,
        time_s: impl Into<Arc<[f64]>>,
        values: impl Into<Arc<[f64]>>,
    ) -> Result<Self, Error> {
        let (time_s, values) = (time_s.into(), values.into());
        let name = || name.to_owned();
        if time_s.len() != values.len() {
            return Err(Error::Length {
                name: name(),
                found: values.len(),
                expected: time_s.len(),
            });
        }
        if time_s.is_empty() {
            return Err(Error::TooShort { name: name(), found: 0, needed: 1 });
        }
        if let Some(index) =
            time_s.iter().zip(values.iter()).position(|(t, x)| !(t.is_finite() && x.is_finite()))
        {
            return Err(Error::NotFinite { name: name(), index });
        }
        if let Some(before) = time_s.windows(2).position(|pair| pair[1] <= pair[0]) {
            let index = before + 1;
            return Err(Error::TimeOrder {
                name: name(),
                index,
                from_s: time_s[before],
                to_s: time_s[index],
            });
        }
        Ok(Self::checked(time_s, values))
    }

    fn checked(time_s: Arc<[f64]>, values: Arc<[f64]>) -> Self {
        Self { steps: Intervals::between(&time_s), time_s, values }
    }

    /// Creates a series on a grid; `values` holds one finite value an instant.
    ///
    /// # Errors
    /// As [`Timed::new`].
    pub fn on_grid(name: &str, grid: Grid, values: Vec<f64>) -> Result<Self, Error> {
        Self::new(name, grid.times().collect::<Arc<[f64]>>(), values)
    }

    /// Returns the times, s, shape (n,).
    pub fn time_s(&self) -> &[f64] {
        &self.time_s
    }

    /// Returns the values, shape (n,).
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the number of samples, which is never zero.
    #[expect(clippy::len_without_is_empty, reason = "a series is never empty")]
    pub fn len(&self) -> usize {
        self.values.len()
    }

    /// Returns the first time, s.
    pub fn first_s(&self) -> f64 {
        self.time_s[0]
    }

    /// Returns the last time, s.
    pub fn last_s(&self) -> f64 {
        self.time_s[self.len() - 1]
    }

    /// Returns the median interval between samples, s; zero for a single sample.
    ///
    /// If all intervals are equal except for the rounding of time stamps, it is their mean, which
    /// that rounding does not affect.
    pub fn period_s(&self) -> f64 {
        self.steps.median
    }

    /// Returns the longest interval between samples, s; zero for a single sample.
    pub fn longest_step_s(&self) -> f64 {
        self.steps.longest
    }

    /// Transforms each value; the function must return finite values.
    pub fn map(&self, f: impl Fn(f64) -> f64) -> Self {
        Self { values: self.values.iter().map(|&x| f(x)).collect(), ..self.clone() }
    }

    /// Replaces the values at the same times; there must be one finite value for each.
    ///
    /// # Errors
    /// [`Error::Length`] if there is not one value per time, [`Error::NotFinite`].
    pub fn with_values(&self, name: &str, values: Vec<f64>) -> Result<Self, Error> {
        self.with_shared_values(name, values.into())
    }

    /// Does the same as [`Timed::with_values`] without copying the values.
    pub(crate) fn with_shared_values(&self, name: &str, values: Arc<[f64]>) -> Result<Self, Error> {
        let name = || name.to_owned();
        if values.len() != self.len() {
            let (found, expected) = (values.len(), self.len());
            return Err(Error::Length { name: name(), found, expected });
        }
        if let Some(index) = values.iter().position(|x| !x.is_finite()) {
            return Err(Error::NotFinite { name: name(), index });
        }
        Ok(Self { time_s: Arc::clone(&self.time_s), values, steps: self.steps })
    }

    /// Returns whether two series have the same times.
    pub fn is_sampled_with(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.time_s, &other.time_s) || self.time_s == other.time_s
    }

    /// Returns the samples from `from_s` to `to_s`, both included; `None` if there are none.
    pub fn window(&self, from_s: f64, to_s: f64) -> Option<Self> {
        self.part(self.rows(from_s, to_s), &mut Vec::new())
    }

    /// Returns the window of a held signal, which includes the sample in force at `from_s`.
    pub fn window_held(&self, from_s: f64, to_s: f64) -> Option<Self> {
        self.part(self.rows_held(from_s, to_s), &mut Vec::new())
    }

    fn rows(&self, from_s: f64, to_s: f64) -> Range<usize> {
        let from = self.time_s.partition_point(|&t| t < from_s);
        from..self.time_s.partition_point(|&t| t <= to_s)
    }

    fn rows_held(&self, from_s: f64, to_s: f64) -> Range<usize> {
        let held = self.reached(from_s);
        self.rows(self.time_s[held.max(1) - 1].min(from_s), to_s)
    }

    /// Cuts out a range of samples; shares its times with `known` if those are the same part of the
    /// same time base, else adds them.
    fn part(&self, rows: Range<usize>, known: &mut Vec<PartOfBase>) -> Option<Self> {
        if rows == (0..self.len()) {
            return Some(self.clone());
        }
        if rows.is_empty() {
            return None;
        }
        let values = self.values[rows.clone()].into();
        let same = |part: &&PartOfBase| Arc::ptr_eq(&part.base, &self.time_s) && part.rows == rows;
        if let Some(PartOfBase { time_s, steps, .. }) = known.iter().find(same) {
            return Some(Self { time_s: Arc::clone(time_s), values, steps: *steps });
        }
        let part = Self::checked(self.time_s[rows.clone()].into(), values);
        let (base, time_s) = (Arc::clone(&self.time_s), Arc::clone(&part.time_s));
        known.push(PartOfBase { base, rows, time_s, steps: part.steps });
        Some(part)
    }

    /// Shifts every time by `offset_s`.
    pub fn shifted(&self, offset_s: f64) -> Self {
        let time_s = self.time_s.iter().map(|t| t + offset_s).collect();
        Self::checked(time_s, Arc::clone(&self.values))
    }

    /// Returns the value at `t_s` by linear interpolation; beyond the ends, the end value.
    pub fn at(&self, t_s: f64) -> f64 {
        self.before(self.reached(t_s), t_s)
    }

    /// Returns the number of samples at or before `t_s`.
    ///
    /// A regular sampling period gives it without a search.
    pub(crate) fn reached(&self, t_s: f64) -> usize {
        let is_it = |count: usize| {
            let (before, after) = (count.checked_sub(1), self.time_s.get(count));
            before.is_none_or(|k| self.time_s.get(k).is_some_and(|t| *t <= t_s))
                && after.is_none_or(|t| *t > t_s)
        };
        // The cast turns a negative number and NaN into zero.
        let near = ((t_s - self.time_s[0]) / self.steps.median) as usize;
        (near..near.saturating_add(3))
            .find(|count| is_it(*count))
            .unwrap_or_else(|| self.time_s.partition_point(|&t| t <= t_s))
    }

    /// Returns a reader of the series for times that never decrease.
    pub(crate) fn reader(&self) -> Reader<'_> {
        Reader::from(self, 0)
    }

    /// Returns the value at `t_s`, which lies between sample `after` and the one before it.
    fn before(&self, after: usize, t_s: f64) -> f64 {
        if after == 0 {
            return self.values[0];
        }
        if after == self.len() {
            return self.values[after - 1];
        }
        let (t0, t1) = (self.time_s[after - 1], self.time_s[after]);
        let weight = (t_s - t0) / (t1 - t0);
        self.values[after - 1] + weight * (self.values[after] - self.values[after - 1])
    }

    /// Returns the value in force at `t_s` if each sample is held until the next.
    pub fn held_at(&self, t_s: f64) -> f64 {
        self.values[self.reached(t_s).max(1) - 1]
    }

    /// Prepends a sample `before_s` ahead of the first.
    pub(crate) fn preceded_by(&self, before_s: f64, value: f64) -> Self {
        let time_s: Arc<[f64]> =
            std::iter::once(self.first_s() - before_s).chain(self.time_s.iter().copied()).collect();
        let values = std::iter::once(value).chain(self.values.iter().copied()).collect();
        Self { steps: Intervals::between(&time_s), time_s, values }
    }

    /// Converts linear interpolation to a held signal with steps of at most `step_s`: each step
    /// holds the interpolated value at its middle. Gaps remain.
    ///
    /// ```
    /// use seaplant::Timed;
    /// let thrust = Timed::new("thrust", vec![0.0, 1.0], vec![0.0, 8.0])?;
    /// assert_eq!(thrust.interpolated(0.5).values(), [2.0, 6.0, 8.0]);
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn interpolated(&self, step_s: f64) -> Self {
        let (mut time_s, mut values) = (Vec::new(), Vec::new());
        let longest_s = self.longest_usual_s();
        for k in 1..self.len() {
            let (from_s, to_s) = (self.time_s[k - 1], self.time_s[k]);
            if to_s - from_s > longest_s {
                time_s.push(from_s);
                values.push(self.values[k - 1]);
                continue;
            }
            let steps = ((to_s - from_s) / step_s).ceil().max(1.0);
            for step in 0..steps as usize {
                let part = step as f64 / steps;
                let middle = part + 0.5 / steps;
                time_s.push(from_s + part * (to_s - from_s));
                values.push(self.values[k - 1] + middle * (self.values[k] - self.values[k - 1]));
            }
        }
        time_s.push(self.last_s());
        values.push(self.values[self.len() - 1]);
        Self { steps: Intervals::between(&time_s), time_s: time_s.into(), values: values.into() }
    }

    /// Returns the longest interval that is not a gap in a signal logged on change: a second, or
    /// five times the 90th percentile of its intervals.
    pub(crate) fn longest_usual_s(&self) -> f64 {
        if self.longest_step_s() <= LEAST_HELD_GAP_S {
            return LEAST_HELD_GAP_S;
        }
        let mut steps: Vec<f64> = self.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let tenth = steps.len() * 9 / 10;
        let (_, long, _) = steps.select_nth_unstable_by(tenth, f64::total_cmp);
        (5.0 * *long).max(LEAST_HELD_GAP_S)
    }

    /// Returns the intervals longer than `longest_s`.
    pub fn gaps(&self, longest_s: f64) -> Vec<Gap> {
        if self.longest_step_s() <= longest_s {
            return Vec::new();
        }
        self.time_s
            .windows(2)
            .filter(|pair| pair[1] - pair[0] > longest_s)
            .map(|pair| Gap { from_s: pair[0], to_s: pair[1] })
            .collect()
    }

    /// Interpolates linearly at each instant of a grid.
    pub fn interpolate(&self, grid: Grid) -> Vec<f64> {
        if let Some(rows) = self.samples_on(grid) {
            return self.values[rows].to_vec();
        }
        let after = self.time_s.partition_point(|&t| t <= grid.start_s);
        let mut reader = Reader::from(self, after);
        grid.times().map(|t| reader.at(t)).collect()
    }

    /// Returns the range of samples that coincide one by one with the instants of a grid, if they
    /// do.
    fn samples_on(&self, grid: Grid) -> Option<Range<usize>> {
        let near = ROUNDING_PART * grid.period_s + ROUNDING_S;
        let from = self.time_s.partition_point(|&t| t < grid.start_s - near);
        let to = from + grid.len;
        let at = self.time_s.get(from..to)?.iter().zip(grid.times());
        // Counting all of them is faster than stopping at the first that differs.
        let off = at.filter(|(t, instant)| (*t - instant).abs() > near).count();
        (off == 0).then_some(from..to)
    }

    /// Averages a held signal over `[t − ½ period, t + ½ period]` around each instant of a grid.
    ///
    /// A thrust logged at t acts until the next is logged. Its value at t alone would lead a
    /// centred difference of velocity by half a sample, which biases the drag estimate.
    pub fn held_means(&self, grid: Grid) -> Vec<f64> {
        let half = 0.5 * grid.period_s;
        if let Some(rows) = self.samples_on(grid).filter(|_| self.steps.shortest >= half) {
            // Each sample covers half of the interval that follows its predecessor.
            let mut means = self.values[rows.clone()].to_vec();
            let before = rows.start.saturating_sub(1)..rows.end - 1;
            let late = usize::from(rows.start == 0);
            let means_after = means[late..].iter_mut();
            means_after.zip(&self.values[before]).for_each(|(x, before)| *x = 0.5 * (*x + before));
            return means;
        }
        let mut integral = HeldIntegral::from(self, grid.start_s - half);
        let mut before = integral.up_to(grid.start_s - half);
        (0..grid.len)
            .map(|k| {
                let until = integral.up_to(grid.time(k) + half);
                let mean = (until - before) / grid.period_s;
                before = until;
                mean
            })
            .collect()
    }
}

/// Returns the median, reordering the values; `None` if there are none.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    let (_, median, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    Some(*median)
}

/// Merges the times of several series; equal times are kept once.
pub(crate) fn union<'a>(series: impl Iterator<Item = &'a [f64]>) -> Vec<f64> {
    let mut all: Vec<f64> = series.flatten().copied().collect();
    all.sort_by(f64::total_cmp);
    all.dedup_by(|later, earlier| *later - *earlier <= ROUNDING_S);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(time_s: &[f64], values: &[f64]) -> Timed {
        Timed::new("test", time_s, values).expect("valid by construction")
    }

    #[test]
    fn averages_a_held_signal_over_each_interval() {
        // Held: 2 until t = 1, then 4.
        let thrust = series(&[0.0, 1.0], &[2.0, 4.0]);
        let grid = Grid { start_s: 0.0, period_s: 1.0, len: 3 };
        assert_eq!(thrust.held_means(grid), [2.0, 3.0, 4.0]);
    }

    #[test]
    fn averages_many_samples_into_few() {
        let thrust = series(&[0.0, 0.25, 0.5, 0.75, 1.0], &[1.0, -1.0, 1.0, -1.0, 1.0]);
        let grid = Grid { start_s: 0.5, period_s: 0.5, len: 1 };
        assert!(thrust.held_means(grid)[0].abs() < 1e-15);
    }

    #[test]
    fn counts_samples_on_a_grid_in_a_log_with_gaps_and_beyond_both_ends() {
        let grid: Vec<f64> = (0..50).map(|k| 3.0 + 0.1 * f64::from(k)).collect();
        let with_gap = grid.iter().enumerate().map(|(k, t)| t + if k < 20 { 0.0 } else { 7.3 });
        let uneven = (0..50).map(|k| f64::from(k * k) * 0.01);
        for time_s in [grid.clone(), with_gap.collect(), uneven.collect(), vec![2.0]] {
            let series = series(&time_s, &vec![0.0; time_s.len()]);
            let between = time_s.windows(2).map(|pair| 0.5 * (pair[0] + pair[1]));
            let all = between.chain(time_s.iter().copied()).chain([-1e9, 0.0, 13.0, 1e9]);
            for t_s in all {
                assert_eq!(series.reached(t_s), time_s.iter().filter(|t| **t <= t_s).count());
            }
        }
    }

    #[test]
    fn keeps_the_sample_in_force_when_a_held_signal_is_cut() {
        let thrust = series(&[0.0, 10.0, 20.0], &[1.0, 2.0, 3.0]);
        let cut = thrust.window_held(12.0, 19.0).expect("the sample at 10 s is in force");
        assert_eq!(cut.values(), [2.0]);
    }

    #[test]
    fn refuses_time_that_does_not_increase() {
        let refused = Timed::new("depth", vec![0.0, 1.0, 1.0], vec![0.0; 3]);
        assert!(matches!(refused, Err(Error::TimeOrder { index: 2, .. })));
    }

    #[test]
    fn refuses_a_value_that_is_not_a_number() {
        let refused = Timed::new("depth", vec![0.0, 1.0], vec![0.0, f64::NAN]);
        assert!(matches!(refused, Err(Error::NotFinite { index: 1, .. })));
    }

    #[test]
    fn interpolates_alike_one_by_one_and_on_a_grid() {
        let x = series(&[0.0, 0.3, 1.1], &[1.0, 4.0, -2.0]);
        let grid = Grid { start_s: -0.2, period_s: 0.17, len: 9 };
        let single: Vec<f64> = grid.times().map(|t| x.at(t)).collect();
        assert_eq!(x.interpolate(grid), single);
    }

    #[test]
    fn does_not_interpolate_across_years() {
        let mut time_s: Vec<f64> = (0..20).map(|k| 0.5 * f64::from(k)).collect();
        time_s.extend((0..20).map(|k| 1.7e9 + 0.5 * f64::from(k)));
        let fine = series(&time_s, &time_s.clone()).interpolated(0.05);
        assert_eq!(fine.len(), 2 * (19 * 10 + 1));
        assert_eq!(fine.gaps(1.0).len(), 1);
    }

    #[test]
    fn a_reader_agrees_with_a_search() {
        let x = series(&[0.0, 0.3, 1.1, 1.2], &[1.0, 4.0, -2.0, 7.0]);
        let (mut reader, mut held) = (x.reader(), x.reader());
        for t in [-1.0, 0.0, 0.0, 0.1, 0.3, 1.15, 1.2, 5.0] {
            assert_eq!(reader.at(t), x.at(t), "{t}");
            assert_eq!(held.held_at(t), x.held_at(t), "{t}");
        }
    }

    #[test]
    fn windows_share_times_where_the_series_share_them() {
        let time_s: Arc<[f64]> = (0..9).map(f64::from).collect();
        let constant = |x: f64| Timed::new("test", Arc::clone(&time_s), vec![x; 9]).expect("valid");
        let mut cutter = Cutter::default();
        let mut window = |x: &Timed| cutter.window(x, (1.5, 6.0)).expect("five samples");
        let (a, b) = (window(&constant(1.0)), window(&constant(2.0)));
        assert_eq!(a.time_s(), [2.0, 3.0, 4.0, 5.0, 6.0]);
        assert!(Arc::ptr_eq(&a.time_s, &b.time_s) && b.values() == [2.0; 5]);
        // Other times stay separate, and the sample in force is one more.
        let held = cutter.window_held(&constant(3.0), (1.5, 6.0)).expect("six samples");
        assert_eq!(held.time_s()[0], 1.0);
        assert_eq!(held, constant(3.0).window_held(1.5, 6.0).expect("six samples"));
    }

    #[test]
    fn samples_around_a_window_interpolate_as_the_series() {
        let x = series(&[0.0, 1.0, 2.0, 3.0, 4.0], &[1.0, 4.0, -2.0, 7.0, 3.0]);
        for window in [(1.2, 2.7), (1.0, 3.0), (-5.0, 0.5), (3.5, 9.0), (5.0, 9.0), (-9.0, -5.0)] {
            let part = Cutter::default().around(&x, window);
            let within = |part_of: f64| window.0 + part_of * (window.1 - window.0);
            for t in [0.0, 0.3, 0.5, 1.0].map(within) {
                assert_eq!(part.at(t), x.at(t), "{window:?}, {t}");
            }
        }
    }
}
