//! Unwrapping of heading, across whole turns lost in the log and in gaps.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use crate::signal::slope_of_line;
use crate::{Gap, Timed};

/// An unwrapped heading, continuous except across cuts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turns {
    pub(super) heading: Timed,
    /// Gaps across which the number of turns is unknown.
    pub(super) cuts: Vec<Gap>,
}

/// An interval longer than this many sampling periods is a gap, in which turns may be lost …
const GAP_PERIODS: f64 = 2.5;
/// … if it is longer than this too, s: no vehicle makes half a turn in less.
const LEAST_GAP_S: f64 = 0.25;

/// No vehicle turns faster, rad/s.
const FASTEST_RAD_S: f64 = 10.0;

/// Factor by which rates within a gap may exceed those measured outside of gaps.
const MARGIN: f64 = 1.5;

/// Window for the rate of turn: a second of heading, or three samples.
const SLOPE_S: f64 = 1.0;
const SLOPE_PERIODS: f64 = 3.0;

/// Range of a wrapped heading, with rounding.
const ONE_TURN: f64 = 1.001 * TAU;

/// Fraction of values outside of one turn from which a heading counts as continuous; fewer may be
/// outliers.
const OUTSIDE_PART: f64 = 0.01;

/// Least number of samples of a piece.
const LEAST_PIECE: usize = 3;

impl Turns {
    /// Unwraps a heading: between neighbours by the nearest turn; across a gap by the measured rate
    /// or by the rates at both ends, where these leave no other choice; otherwise the record is
    /// cut. A heading that is logged continuous is unchanged.
    pub(super) fn count(heading: &Timed, rate: Option<&Timed>) -> Self {
        let runs = runs(heading);
        let continuous = is_written_continuous(heading, &runs);
        let (time_s, mut values) = (heading.time_s(), heading.values().to_vec());
        if continuous {
            unwrap_run(time_s, &mut values, FASTEST_RAD_S);
            return Self { heading: with_values(heading, values), cuts: Vec::new() };
        }
        for run in &runs {
            unwrap_run(&time_s[run.clone()], &mut values[run.clone()], 0.0);
        }
        let window_s = SLOPE_S.max(SLOPE_PERIODS * heading.period_s());
        let turned = RatesOfTurn::new(time_s, &values, &runs, window_s);
        let drift = rate.map(|rate| Drift::of(rate, time_s, &values, &runs));
        let mut pieces: Vec<Range<usize>> = vec![runs[0].clone()];
        for (k, run) in runs.iter().enumerate().skip(1) {
            let [from, to] = [run.start - 1, run.start];
            let by_rate = drift.as_ref().and_then(|drift| drift.across(time_s[from], time_s[to]));
            let change = by_rate.or_else(|| turned.across(k, time_s[to] - time_s[from]));
            let off = values[to] - values[from] - change.unwrap_or(0.0);
            let turns = (off / TAU).round() * TAU;
            values[run.clone()].iter_mut().for_each(|x| *x -= turns);
            match (change, pieces.last_mut()) {
                (Some(_), Some(piece)) => piece.end = run.end,
                _ => pieces.push(run.clone()),
            }
        }
        Self::in_pieces(heading, &values, pieces)
    }

    /// Drops pieces with too few samples.
    fn in_pieces(heading: &Timed, values: &[f64], mut pieces: Vec<Range<usize>>) -> Self {
        if pieces.iter().any(|piece| piece.len() >= LEAST_PIECE) {
            pieces.retain(|piece| piece.len() >= LEAST_PIECE);
        }
        let t = heading.time_s();
        let gap =
            |pair: &[Range<usize>]| Gap { from_s: t[pair[0].end - 1], to_s: t[pair[1].start] };
        let cuts = pieces.windows(2).map(gap).collect();
        if pieces.iter().map(Range::len).sum::<usize>() == t.len() {
            return Self { heading: with_values(heading, values.to_vec()), cuts };
        }
        let all = |x: &[f64]| {
            pieces.iter().flat_map(|piece| &x[piece.clone()]).copied().collect::<Vec<f64>>()
        };
        let left = Timed::new("heading", all(t), all(values));
        Self { heading: left.unwrap_or_else(|_| heading.clone()), cuts }
    }
}

/// Finite angles stay finite, and the times are the same.
fn with_values(heading: &Timed, values: Vec<f64>) -> Timed {
    heading.with_values("heading", values).unwrap_or_else(|_| heading.clone())
}

/// Returns the ranges of rows between gaps.
fn runs(heading: &Timed) -> Vec<Range<usize>> {
    let t = heading.time_s();
    let longest_s = (GAP_PERIODS * heading.period_s()).max(LEAST_GAP_S);
    let starts = (1..t.len()).filter(|k| t[*k] - t[*k - 1] > longest_s);
    let mut from = 0;
    let mut runs = Vec::new();
    for start in starts.chain([t.len()]) {
        runs.push(from..start);
        from = start;
    }
    runs
}

/// Returns whether a log counts turns itself: its values span more than one, beyond outliers.
fn is_written_continuous(heading: &Timed, runs: &[Range<usize>]) -> bool {
    let values = heading.values().iter().copied();
    let (low, high) =
        (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max));
    if high - low <= ONE_TURN {
        return false;
    }
    let jumps = |run: &Range<usize>| {
        heading.values()[run.clone()].windows(2).any(|pair| (pair[1] - pair[0]).abs() > PI)
    };
    if !runs.iter().any(jumps) {
        return true;
    }
    let mut sorted = heading.values().to_vec();
    sorted.sort_by(f64::total_cmp);
    let (mut to, mut most) = (0, 0);
    for (from, low) in sorted.iter().enumerate() {
        while sorted.get(to).is_some_and(|x| x - low <= ONE_TURN) {
            to += 1;
        }
        most = most.max(to - from);
    }
    let outside = sorted.len() - most;
    outside >= LEAST_PIECE && outside as f64 > OUTSIDE_PART * sorted.len() as f64
}

/// Moves each sample to the turn nearest to the one before, if it is more than half a turn away and
/// further than the vehicle turns at a rate, rad/s.
fn unwrap_run(time_s: &[f64], values: &mut [f64], rate: f64) {
    let mut turns = 0.0;
    for k in 1..values.len() {
        let change = values[k] + turns - values[k - 1];
        if change.abs() > (rate * (time_s[k] - time_s[k - 1])).max(PI) {
            turns -= (change / TAU).round() * TAU;
        }
        values[k] += turns;
    }
}

/// Rates of turn outside of gaps.
struct RatesOfTurn {
    /// Rates of turn at the first and the last samples of each run, rad/s; `None` for a run that is
    /// too short.
    ends: Vec<Option<[f64; 2]>>,
    /// The greatest rate, rad/s, and the greatest change of it in a second, rad/s².
    fastest: f64,
    sharpest: f64,
}

impl RatesOfTurn {
    fn new(time_s: &[f64], values: &[f64], runs: &[Range<usize>], window_s: f64) -> Self {
        let mut turned = Self { ends: Vec::new(), fastest: 0.0, sharpest: 0.0 };
        let mut is_known = false;
        for run in runs {
            let rates = rates(&time_s[run.clone()], &values[run.clone()], window_s);
            turned.ends.push(rates.first().zip(rates.last()).map(|(a, b)| [a.1, b.1]));
            for pair in rates.windows(2) {
                let change = (pair[1].1 - pair[0].1).abs() / (pair[1].0 - pair[0].0);
                turned.sharpest = turned.sharpest.max(change);
                is_known = true;
            }
            turned.fastest = rates.iter().fold(turned.fastest, |most, rate| most.max(rate.1.abs()));
        }
        if !is_known {
            (turned.fastest, turned.sharpest) = (FASTEST_RAD_S, f64::INFINITY);
        }
        turned
    }

    /// Returns the change across the gap before a run, to within half a turn; `None` if more than
    /// one number of turns is possible.
    fn across(&self, run: usize, gap_s: f64) -> Option<f64> {
        if MARGIN * self.fastest * gap_s < PI {
            return Some(0.0);
        }
        // A bounded acceleration deviates from the mean of the two rates by no more than this.
        let beside = MARGIN * self.sharpest * gap_s * gap_s / 4.0;
        let ends = self.ends[run - 1].zip(self.ends[run]);
        ends.filter(|_| beside < PI).map(|(before, after)| 0.5 * (before[1] + after[0]) * gap_s)
    }
}

/// Returns times and rates of turn over consecutive windows of a run.
fn rates(time_s: &[f64], values: &[f64], window_s: f64) -> Vec<(f64, f64)> {
    let mut found = Vec::new();
    let mut from = 0;
    while from + 2 < time_s.len() {
        let to = time_s.partition_point(|t| *t <= time_s[from] + window_s).max(from + 3);
        // The last window includes a remainder too short for a window of its own.
        let to = if time_s.len() - to < 3 { time_s.len() } else { to };
        let (t, x) = (&time_s[from..to], &values[from..to]);
        found.push((t.iter().sum::<f64>() / t.len() as f64, slope_of_line(t, x)));
        from = to;
    }
    found
}

/// A measured rate of turn with the statistics of its drift from heading.
struct Drift<'a> {
    rate: &'a Timed,
    gaps: Vec<Gap>,
    /// Mean and standard deviation of the error of the rate, rad/s.
    mean_error: f64,
    std_error: f64,
}

/// Length of the stretches of heading that determine the drift, s.
const DRIFT_S: f64 = 5.0;

impl<'a> Drift<'a> {
    fn of(rate: &'a Timed, time_s: &[f64], values: &[f64], runs: &[Range<usize>]) -> Self {
        let mut lacking = Vec::new();
        for run in runs {
            let mut from = run.start;
            for k in run.clone() {
                let span_s = time_s[k] - time_s[from];
                let is_covered = rate.first_s() <= time_s[from] && time_s[k] <= rate.last_s();
                if span_s >= DRIFT_S && is_covered {
                    let turned = integral(rate, time_s[from], time_s[k]);
                    lacking.push((values[k] - values[from] - turned) / span_s);
                }
                from = if span_s >= DRIFT_S || !is_covered { k } else { from };
            }
        }
        let n = lacking.len() as f64;
        let mean_error = lacking.iter().sum::<f64>() / n;
        let std_error = (lacking.iter().map(|x| (x - mean_error).powi(2)).sum::<f64>() / n).sqrt();
        let gaps = rate.gaps((GAP_PERIODS * rate.period_s()).max(LEAST_GAP_S));
        Self { rate, gaps, mean_error, std_error }
    }

    /// Returns the change across a gap; `None` if the rate has a gap there too, or may have drifted
    /// by half a turn.
    fn across(&self, from_s: f64, to_s: f64) -> Option<f64> {
        const SIGMAS: f64 = 3.0;
        let is_covered = self.rate.first_s() <= from_s && to_s <= self.rate.last_s();
        let next = self.gaps.partition_point(|gap| gap.to_s <= from_s);
        let has_gap = self.gaps.get(next).is_some_and(|gap| gap.from_s < to_s);
        let drift = SIGMAS * self.std_error * (to_s - from_s);
        // Without any stretch, drift is NaN and the comparison fails.
        (drift < PI && is_covered && !has_gap)
            .then(|| integral(self.rate, from_s, to_s) + self.mean_error * (to_s - from_s))
    }
}

/// Integrates `∫ x dt` of linearly interpolated samples.
pub(super) fn integral(x: &Timed, from_s: f64, to_s: f64) -> f64 {
    let t = x.time_s();
    let inside = t.partition_point(|t| *t <= from_s)..t.partition_point(|t| *t < to_s);
    let mut before = (from_s, x.at(from_s));
    let mut sum = 0.0;
    let ends = inside.map(|k| (t[k], x.values()[k])).chain([(to_s, x.at(to_s))]);
    for (time_s, value) in ends {
        sum += 0.5 * (time_s - before.0) * (value + before.1);
        before = (time_s, value);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the heading of a small vehicle over many turns: ±1.5 rad/s in 20 s, and a trend.
    fn truth(t: f64) -> f64 {
        4.8 * (0.314 * t).sin() + 0.3 * t
    }

    fn rate(t: f64) -> f64 {
        1.507 * (0.314 * t).cos() + 0.3
    }

    fn times(gaps: &[(f64, f64)]) -> Vec<f64> {
        let is_covered = |t: &f64| !gaps.iter().any(|(from, to)| t > from && t < to);
        (0..2400).map(|k| 0.1 * f64::from(k)).filter(is_covered).collect()
    }

    fn series(times: &[f64], of: impl Fn(f64) -> f64) -> Timed {
        let values: Vec<f64> = times.iter().map(|t| of(*t)).collect();
        Timed::new("heading", times.to_vec(), values).expect("valid")
    }

    fn wrapped(t: f64) -> f64 {
        truth(t).rem_euclid(TAU)
    }

    /// Returns the greatest error of each piece, apart from an offset of whole turns.
    fn worst(turns: &Turns) -> f64 {
        let (t, x) = (turns.heading.time_s(), turns.heading.values());
        let mut offset = x[0] - truth(t[0]);
        let mut worst = 0.0_f64;
        for k in 0..t.len() {
            if turns.cuts.iter().any(|cut| cut.to_s == t[k]) {
                offset = x[k] - truth(t[k]);
            }
            worst = worst.max((x[k] - truth(t[k]) - offset).abs());
        }
        worst
    }

    /// Rounding of sums of whole turns, rad.
    const ROUNDING: f64 = 1e-9;

    #[test]
    fn a_gap_in_which_half_a_turn_was_possible_is_cut() {
        let gaps = [(30.0, 31.0), (55.0, 64.0), (100.0, 112.0)];
        let turns = Turns::count(&series(&times(&gaps), wrapped), None);
        let cut: Vec<i32> = turns.cuts.iter().map(|cut| cut.to_s as i32).collect();
        assert_eq!(cut, [64, 112], "{:?}", turns.cuts);
        assert!(worst(&turns) < ROUNDING);
    }

    #[test]
    fn a_rate_with_a_bias_counts_the_turns_in_a_gap() {
        let gaps = [(55.0, 64.0), (100.0, 130.0)];
        let gyro = series(&times(&[]), |t| rate(t) + 0.02);
        let turns = Turns::count(&series(&times(&gaps), wrapped), Some(&gyro));
        assert!(turns.cuts.is_empty(), "{:?}", turns.cuts);
        assert!(worst(&turns) < ROUNDING);
        // A rate with a gap itself, or of opposite sign, is not used.
        for gyro in [series(&times(&gaps), rate), series(&times(&[]), |t| -rate(t))] {
            assert_eq!(Turns::count(&series(&times(&gaps), wrapped), Some(&gyro)).cuts.len(), 2);
        }
    }

    #[test]
    fn a_heading_that_is_logged_continuous_is_unchanged() {
        let continuous = series(&times(&[(55.0, 64.0), (100.0, 130.0)]), truth);
        let turns = Turns::count(&continuous, None);
        assert_eq!((turns.heading, turns.cuts), (continuous, Vec::new()));
        // A single value far off does not make a wrapped heading a continuous one.
        let times = times(&[]);
        let mut values: Vec<f64> = times.iter().map(|t| wrapped(*t)).collect();
        values[700] = 400.0;
        let turns = Turns::count(&Timed::new("heading", times, values).expect("valid"), None);
        let x = turns.heading.values();
        assert!((x[600] - x[0] - truth(60.0) + truth(0.0)).abs() < ROUNDING);
    }

    #[test]
    fn a_vehicle_that_hardly_turns_may_lack_heading_for_a_minute() {
        let still = |t: f64| (0.02 * (0.3 * t).sin()).rem_euclid(TAU);
        let turns = Turns::count(&series(&times(&[(50.0, 110.0)]), still), None);
        assert!(turns.cuts.is_empty());
        let x = turns.heading.values();
        assert!(x.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 0.05));
    }

    #[test]
    fn a_year_without_heading_is_one_cut() {
        let mut t = times(&[]);
        t.splice(..0, [-1.7e9, -1.7e9 + 0.1, -1.7e9 + 0.2]);
        assert_eq!(Turns::count(&series(&t, wrapped), None).cuts.len(), 1);
    }

    proptest::proptest! {
        #[test]
        fn pieces_are_right_wherever_the_gaps_are(
            from in proptest::collection::vec((5.0..230.0, 0.1..15.0), 1..6),
            turn in 0.0..TAU,
        ) {
            let gaps: Vec<(f64, f64)> = from.iter().map(|(from, s)| (*from, from + s)).collect();
            let heading = series(&times(&gaps), |t| (truth(t) + turn).rem_euclid(TAU));
            let turns = Turns::count(&heading, None);
            proptest::prop_assert!(worst(&turns) < ROUNDING, "{:?}", turns.cuts);
        }
    }
}
