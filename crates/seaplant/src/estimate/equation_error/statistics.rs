//! Equation error over a record in shards, combined exactly.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::EquationError;
use crate::estimate::filtered::{filters_for, for_each_tile, margin_rows};
use crate::estimate::{Filters, Fit, Method, least_rows};
use crate::regression::{Regression, Row, Sums, batches_of};
use crate::trial::{ReadyAxis, ReadyStretch};
use crate::{AxisRecord, Caveat, Dof, Error, Grid, Terms};

/// Common clock of all shards of a record: row k of the regression is at `start_s + k / sample_hz`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ShardClock {
    /// Name of the record; shards of several records may be combined.
    pub record: String,
    /// First instant of the record, s.
    pub start_s: f64,
    /// Rate of the regression's rows, Hz: the higher of the rates of motion and force.
    pub sample_hz: f64,
    /// Rate of the logged motion, Hz.
    pub source_hz: f64,
}

/// Sufficient statistics of shards of records on one degree of freedom, for the equation error
/// estimate and its intervals.
///
/// For every four seconds, the rows `[F v̇]` are reduced to the triangle R of their QR
/// decomposition. Triangles of the same rows in other shards, and of neighbouring batches, combine
/// by `[R₁; R₂] = Q R` without squaring the condition number: the estimate is that of all rows
/// together, within rounding, for any division into shards and order of merging. A day takes 4 MB
/// at any rate.
///
/// Rows are those of [`EquationError::fit`], which gives the same estimate for a record without
/// gaps; its batches of 20 s, from which intervals follow, are the same for records up to 20
/// minutes. Intervals are from batch means.
///
/// # Source
/// Incremental QR of blocks of rows: \[Demmel2012\].
///
/// # Example
/// ```
/// use seaplant::estimate::{EquationError, EquationErrorStatistics, Shard, ShardClock};
/// use seaplant::twin::{TwinSpec, make};
/// use seaplant::{Dof, Terms, Trial, TrialSetup, VelocitySource};
///
/// let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 240.0, ..TwinSpec::jason2() };
/// let twin = make(&spec)?;
/// let setup = TrialSetup { dofs: vec![Dof::Surge], ..TrialSetup::default() };
/// let trial = Trial::new(setup, &twin.trials[0].recording, &twin.vehicle)?;
/// let part = &trial.axis(Dof::Surge, VelocitySource::Measured)?;
///
/// // Both halves are cut from one record here; workers have them from files of their own.
/// let (clock, terms) = (ShardClock::of(part)?, Terms::default());
/// let half = |from_s, to_s| {
///     let shard = Shard { part, offset_s: 0.0, from_s, to_s };
///     EquationErrorStatistics::of(shard, &clock, terms, &EquationError::default())
/// };
/// let mut whole = half(None, Some(100.0))?;
/// whole.merge(&half(Some(100.0), None)?)?;
/// assert!((whole.fit()?.physical().mass / 12_970.2 - 1.0).abs() < 0.01);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EquationErrorStatistics {
    dof: Dof,
    terms: Vec<crate::Term>,
    filters: Filters,
    caveats: Vec<Caveat>,
    records: BTreeMap<String, RecordSums>,
}

/// Statistics of one record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct RecordSums {
    clock: ShardClock,
    /// Rows that are covered by shards, in order, without overlap.
    covered: Vec<Range<u64>>,
    sums: Sums,
}

/// Duration of a stored batch, s: a fifth of the batches for the intervals.
const KEPT_S: f64 = 4.0;

/// Tolerance of an instant on the grid, as a fraction of its period.
const ON_GRID: f64 = 1e-6;

/// A part of a record, and the rows to take from it.
#[derive(Clone, Copy, Debug)]
pub struct Shard<'a> {
    /// The part, with an additional margin of [`ShardClock::margin_s`] on either side, where the
    /// record has it.
    pub part: &'a AxisRecord,
    /// Offset that converts its times to the clock, s.
    pub offset_s: f64,
    /// The first row is at or after this instant of the clock; absent for the start of the record.
    pub from_s: Option<f64>,
    /// The last row is before this instant of the clock; absent for the end of the record.
    pub to_s: Option<f64>,
}

impl EquationErrorStatistics {
    /// Computes the statistics of a shard.
    ///
    /// # Errors
    /// [`Error::Shard`] for a clock without rates, and for a shard without its margin;
    /// [`Error::Cutoff`], and those of [`AxisRecord::uniform`].
    pub fn of(
        shard: Shard<'_>,
        clock: &ShardClock,
        terms: Terms,
        options: &EquationError,
    ) -> Result<Self, Error> {
        let Shard { part, offset_s, from_s, to_s } = shard;
        let (filters, caveats) = clock.filters(options)?;
        let motion = part.motion.series();
        let ends = [motion.first_s() + offset_s, motion.last_s() + offset_s];
        clock.check_margin(ends, from_s, to_s, clock.margin_of(&filters)?)?;
        let wanted = clock.rows(from_s.unwrap_or(clock.start_s), to_s, ends[1]);
        let sums = clock.sums(part, offset_s, &wanted, &filters, terms)?;
        let record = RecordSums { clock: clock.clone(), covered: vec![wanted], sums };
        let records = BTreeMap::from([(clock.record.clone(), record)]);
        Ok(Self { dof: part.dof, terms: terms.fitted(), filters, caveats, records })
    }

    /// Adds the statistics of other shards, of this record or others.
    ///
    /// # Errors
    /// [`Error::Shard`] for another degree of freedom, other terms or filters, another clock, or
    /// rows that are already included.
    pub fn merge(&mut self, other: &Self) -> Result<(), Error> {
        let of = |sums: &Self| (sums.dof, sums.terms.clone(), sums.filters);
        let name = || other.records.keys().next().cloned().unwrap_or_default();
        if of(self) != of(other) {
            let reason = "is of another degree of freedom, other terms or other filters; reduce \
                          all shards alike";
            return Err(Error::Shard { record: name(), reason: reason.to_owned() });
        }
        let mut records = self.records.clone();
        for (name, theirs) in &other.records {
            match records.get_mut(name) {
                None => {
                    records.insert(name.clone(), theirs.clone());
                }
                Some(ours) => ours.merge(theirs)?,
            }
        }
        self.records = records;
        let new = other.caveats.iter().filter(|caveat| !self.caveats.contains(caveat));
        let new: Vec<Caveat> = new.cloned().collect();
        self.caveats.extend(new);
        Ok(())
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.records.values().map(|record| record.sums.rows()).sum()
    }

    /// Fits the plant to all rows.
    ///
    /// # Errors
    /// [`Error::NoTrial`] without rows, [`Error::NotExciting`].
    pub fn fit(&self) -> Result<Fit, Error> {
        let terms = Terms::new(&self.terms)?;
        let seconds = |record: &RecordSums| record.sums.rows() as f64 / record.clock.sample_hz;
        let total_s: f64 = self.records.values().map(seconds).sum();
        let wanted_s = total_s / batches_of(total_s) as f64;
        let group = ((wanted_s / KEPT_S).round() as u64).max(1);
        let batches = self.records.values().flat_map(|record| record.sums.grouped(group));
        let found = Regression::of_batches(batches.collect(), terms).solve(self.dof)?;
        let (dof, filters, caveats) = (self.dof, self.filters, self.caveats.clone());
        Ok(Fit::of_regression(dof, Method::EquationError, terms, found, filters, caveats))
    }
}

impl ShardClock {
    /// Returns the clock of a complete record.
    ///
    /// # Errors
    /// Those of [`AxisRecord::uniform`].
    pub fn of(record: &AxisRecord) -> Result<Self, Error> {
        let ReadyAxis { sample_hz, source_hz, .. } = record.ready(0)?;
        let start_s = record.motion.series().first_s();
        Ok(Self { record: record.trial.clone(), start_s, sample_hz, source_hz })
    }

    /// Returns the margin that a shard needs on either side, s, after which the filters have
    /// forgotten its edges.
    ///
    /// # Errors
    /// [`Error::Shard`] for a clock without rates, [`Error::Cutoff`].
    pub fn margin_s(&self, options: &EquationError) -> Result<f64, Error> {
        self.margin_of(&self.filters(options)?.0)
    }

    fn margin_of(&self, filters: &Filters) -> Result<f64, Error> {
        let rows = margin_rows(filters, self.sample_hz)?.max(self.least_rows(filters));
        // Differentiation of velocity and averaging of force use neighbouring rows.
        Ok((rows + 2) as f64 / self.sample_hz)
    }

    fn least_rows(&self, filters: &Filters) -> usize {
        filters.every_term.map_or(0, |filter| least_rows(filter, self.sample_hz))
    }

    fn filters(&self, options: &EquationError) -> Result<(Filters, Vec<Caveat>), Error> {
        let is_rate = |rate: f64| rate.is_finite() && rate > 0.0;
        if !(is_rate(self.sample_hz) && is_rate(self.source_hz) && self.start_s.is_finite()) {
            let reason = "has no clock: give a finite start and rates above 0 Hz";
            return Err(self.refuse(reason.to_owned()));
        }
        let mut caveats = Vec::new();
        Ok((filters_for(self.source_hz, options, &mut caveats), caveats))
    }

    /// Reduces the requested rows of a part of a record.
    fn sums(
        &self,
        part: &AxisRecord,
        offset_s: f64,
        wanted: &Range<u64>,
        filters: &Filters,
        terms: Terms,
    ) -> Result<Sums, Error> {
        let batch_rows = (KEPT_S * self.sample_hz).round().max(1.0) as u64;
        let mut sums = Sums::default();
        for stretch in part.ready(0)?.stretches {
            let Some((first, grid)) = self.lay(&stretch, offset_s) else { continue };
            let inside = |row: u64| row.saturating_sub(first).min(grid.len as u64) as usize;
            let rows = inside(wanted.start)..inside(wanted.end);
            if grid.len < self.least_rows(filters) || rows.is_empty() {
                continue;
            }
            let take = |from: usize, rows: &[Row]| {
                sums.add_in_batches(first + from as u64, rows, batch_rows, terms);
            };
            for_each_tile(&stretch, grid, rows, self.sample_hz, filters, take)?;
        }
        Ok(sums)
    }

    fn refuse(&self, reason: String) -> Error {
        Error::Shard { record: self.record.clone(), reason }
    }

    /// Checks that a shard extends far enough beyond the requested rows.
    fn check_margin(
        &self,
        [first_s, last_s]: [f64; 2],
        from_s: Option<f64>,
        to_s: Option<f64>,
        margin_s: f64,
    ) -> Result<(), Error> {
        let period_s = 1.0 / self.sample_hz;
        let needed_from = from_s.map_or(self.start_s, |from| (from - margin_s).max(self.start_s));
        if first_s > needed_from + period_s {
            return Err(self.refuse(format!(
                "starts at {first_s} s and needs samples from {needed_from} s on: {margin_s:.1} s \
                 before its first row; give it more of its neighbour"
            )));
        }
        match to_s {
            Some(to_s) if last_s < to_s + margin_s - period_s => Err(self.refuse(format!(
                "ends at {last_s} s and needs samples to {} s: {margin_s:.1} s after its last row; \
                 give it more of its neighbour, or no end where the record ends",
                to_s + margin_s
            ))),
            _ => Ok(()),
        }
    }

    /// Returns the indices of the rows from `from_s` to before `to_s`, or to the last.
    fn rows(&self, from_s: f64, to_s: Option<f64>, last_s: f64) -> Range<u64> {
        let row =
            |time_s: f64| ((time_s - self.start_s) * self.sample_hz - ON_GRID).ceil().max(0.0);
        let end = to_s.map_or_else(|| self.last_row(last_s) + 1, |to_s| row(to_s) as u64);
        let start = row(from_s) as u64;
        start..end.max(start)
    }

    fn last_row(&self, last_s: f64) -> u64 {
        ((last_s - self.start_s) * self.sample_hz + ON_GRID).floor().max(0.0) as u64
    }

    /// Returns the index of the first row of a section and the grid of its rows in the time of the
    /// shard; `None` if it has none.
    fn lay(&self, stretch: &ReadyStretch, offset_s: f64) -> Option<(u64, Grid)> {
        let from_s = stretch.grid.start_s + offset_s;
        let to_s = stretch.grid.time(stretch.grid.len - 1) + offset_s;
        let rows = self.rows(from_s, None, to_s);
        let period_s = 1.0 / self.sample_hz;
        let start_s = self.start_s + rows.start as f64 * period_s - offset_s;
        let len = (rows.end - rows.start) as usize;
        (len > 0).then_some((rows.start, Grid { start_s, period_s, len }))
    }
}

impl RecordSums {
    /// Marks rows as covered by a shard.
    fn cover(&mut self, rows: Range<u64>) -> Result<(), Error> {
        if let Some(twice) =
            self.covered.iter().find(|known| rows.start < known.end && known.start < rows.end)
        {
            let from_s = rows.start.max(twice.start) as f64 / self.clock.sample_hz;
            return Err(self.clock.refuse(format!(
                "has rows that another had, too, from {:.3} s on; let each begin where the last \
                 ends",
                self.clock.start_s + from_s
            )));
        }
        self.covered.push(rows);
        self.covered.sort_by_key(|rows| rows.start);
        self.covered.dedup_by(|next, last| {
            let joins = next.start == last.end;
            if joins {
                last.end = next.end;
            }
            joins
        });
        Ok(())
    }

    fn merge(&mut self, other: &Self) -> Result<(), Error> {
        if self.clock != other.clock {
            let reason = "has another clock; make one for all shards of a record";
            return Err(self.clock.refuse(reason.to_owned()));
        }
        for rows in &other.covered {
            self.cover(rows.clone())?;
        }
        self.sums.merge(&other.sums);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::{TwinSpec, make};
    use crate::{Estimate, Trial, TrialSetup, VelocitySource};

    /// Returns the surge trial of a simulated twin, complete or a shard of it.
    fn record(from_s: Option<f64>, to_s: Option<f64>) -> AxisRecord {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), ..TwinSpec::jason2() };
        let twin = make(&spec).expect("valid");
        let name = twin.trials[0].name.clone();
        let setup = TrialSetup { name, dofs: vec![Dof::Surge], from_s, to_s, ..Default::default() };
        let trial = Trial::new(setup, &twin.trials[0].recording, &twin.vehicle).expect("complete");
        trial.axis(Dof::Surge, VelocitySource::Measured).expect("there")
    }

    fn shard(
        part: &AxisRecord,
        clock: &ShardClock,
        [from_s, to_s]: [Option<f64>; 2],
    ) -> Result<EquationErrorStatistics, Error> {
        let shard = Shard { part, offset_s: 0.0, from_s, to_s };
        let (terms, options) = (Terms::default(), EquationError::default());
        EquationErrorStatistics::of(shard, clock, terms, &options)
    }

    fn whole_sums(whole: &AxisRecord, clock: &ShardClock) -> EquationErrorStatistics {
        shard(whole, clock, [None, None]).expect("whole")
    }

    /// Returns the relative differences of two fits' estimates and of their standard deviations.
    fn differences(one: &Fit, two: &Fit) -> [f64; 2] {
        let of = |fit: &Fit| {
            let estimates = fit.estimates();
            let all = [Some(estimates.mass), estimates.d_quadratic, estimates.bias_force];
            all.into_iter().flatten().collect::<Vec<_>>()
        };
        let greatest = |part: fn(&Estimate) -> f64| {
            let pairs = of(one).into_iter().zip(of(two));
            pairs.map(|(a, b)| (part(&a) / part(&b) - 1.0).abs()).fold(0.0, f64::max)
        };
        [greatest(|estimate| estimate.value), greatest(|estimate| estimate.std)]
    }

    /// Relative error of an estimate: filters forget their past within rounding.
    const EXACT: f64 = 1e-12;
    /// Relative error of a standard deviation: residuals are a thousandth of the numbers that they
    /// are the difference of.
    const EXACT_STD: f64 = 1e-10;

    fn is_same(one: &Fit, two: &Fit) -> bool {
        let [value, std] = differences(one, two);
        value < EXACT && std < EXACT_STD
    }

    #[test]
    fn shards_give_the_estimate_of_the_complete_record() {
        let whole = record(None, None);
        let clock = ShardClock::of(&whole).expect("long");
        let one = whole_sums(&whole, &clock);
        let margin = clock.margin_s(&EquationError::default()).expect("filters");
        let cuts = [0.0, 57.3, 58.0, 191.77, 320.0, 480.0];
        let shards = cuts.windows(2).map(|cut| {
            let wanted = [(cut[0] > 0.0).then_some(cut[0]), (cut[1] < 480.0).then_some(cut[1])];
            let part = record(wanted[0].map(|t| t - margin), wanted[1].map(|t| t + margin));
            shard(&part, &clock, wanted).expect("with its margin")
        });
        // In any order, some of them merged before.
        let shards: Vec<_> = shards.collect();
        let mut later = shards[3].clone();
        later.merge(&shards[1]).expect("apart");
        let mut all = shards[4].clone();
        for shard in [&shards[2], &later, &shards[0]] {
            all.merge(shard).expect("apart");
        }
        assert_eq!(all.rows(), one.rows());
        let (one, all) = (one.fit().expect("exciting"), all.fit().expect("exciting"));
        assert!(is_same(&all, &one), "{:?}", differences(&all, &one));

        let plain = EquationError::default().fit(&[whole]).expect("exciting");
        assert!(is_same(&all, &plain), "{:?}", differences(&all, &plain));
        assert_eq!((all.samples, all.t_freedom), (plain.samples, plain.t_freedom));
    }

    #[test]
    fn a_shard_on_another_clock_is_converted_to_that_of_the_record() {
        let whole = record(None, None);
        let clock = ShardClock::of(&whole).expect("long");
        let here = shard(&whole, &clock, [Some(100.0), Some(200.0)]).expect("inside");
        let there = ShardClock { start_s: clock.start_s + 1.0e4, ..clock };
        let (from_s, to_s) = (Some(10_100.0), Some(10_200.0));
        let shifted = Shard { part: &whole, offset_s: 1.0e4, from_s, to_s };
        let (terms, options) = (Terms::default(), EquationError::default());
        let shifted = EquationErrorStatistics::of(shifted, &there, terms, &options);
        let shifted = shifted.expect("inside");
        // Times near ten thousand seconds are rounded to 2e-12 s.
        let [value, _] =
            differences(&here.fit().expect("exciting"), &shifted.fit().expect("exciting"));
        assert!(value < 1e-9, "{value}");
    }

    #[test]
    fn statistics_survive_serialisation() {
        let whole = record(None, None);
        let sums = whole_sums(&whole, &ShardClock::of(&whole).expect("long"));
        let text = serde_json::to_string(&sums).expect("numbers");
        assert_eq!(serde_json::from_str::<EquationErrorStatistics>(&text).expect("ours"), sums);
    }

    #[test]
    fn refuses_shards_without_margin_and_duplicate_rows() {
        let whole = record(None, None);
        let clock = ShardClock::of(&whole).expect("long");
        let part = record(Some(100.0), Some(200.0));
        let refused = shard(&part, &clock, [Some(100.0), Some(150.0)]);
        assert!(refused.expect_err("cut").to_string().contains("before its first row"));
        let refused = shard(&part, &clock, [Some(150.0), Some(200.0)]);
        assert!(refused.expect_err("cut").to_string().contains("after its last row"));

        let mut first = shard(&whole, &clock, [None, Some(200.0)]).expect("there");
        let second = shard(&whole, &clock, [Some(199.85), None]).expect("there");
        let before = first.clone();
        let refused = first.merge(&second).expect_err("a row too many").to_string();
        assert!(refused.contains("that another had, too"), "{refused}");
        assert_eq!(first, before);
        let other = ShardClock { start_s: 0.05, ..clock };
        let other = shard(&whole, &other, [Some(300.0), None]).expect("there");
        assert!(first.merge(&other).expect_err("shifted").to_string().contains("clock"));
    }

    #[test]
    fn combines_records_of_several_dives() {
        let whole = record(None, None);
        let clock = ShardClock::of(&whole).expect("long");
        let mut dives = whole_sums(&whole, &clock);
        let again = whole_sums(&whole, &ShardClock { record: "again".to_owned(), ..clock });
        let one = dives.fit().expect("exciting");
        dives.merge(&again).expect("another record");
        let two = dives.fit().expect("exciting");
        assert!((two.lumped.alpha / one.lumped.alpha - 1.0).abs() < EXACT);
        assert_eq!(two.samples, 2 * one.samples);
    }
}
