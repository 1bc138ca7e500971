//! Two series of one motion, resampled to equal instants and bandwidth.

use crate::signal::{Stretch, uniform_stretches};
use crate::{Error, Grid, Timed};

/// Step of the lattice relative to the period of the slower series. Both series are then smoothed
/// to well below their bandwidth, so that interpolation loses nothing: otherwise offsets of half a
/// sample would be favoured or penalised relative to whole ones.
const COARSER: f64 = 2.0;

/// Least length of a stretch without a gap, in lattice instants.
const LEAST_STRETCH: usize = 16;

/// Largest number of instants of a lattice; longer records get a coarser one.
const MOST_INSTANTS: f64 = 1_048_576.0;

/// Returns the step of a lattice for two series, of which the slower has period `period_s`, s.
pub(super) fn step_s(period_s: f64, series: [&Timed; 2]) -> f64 {
    let spans_s = series.map(|series| series.last_s() - series.first_s());
    (COARSER * period_s).max(spans_s[0].max(spans_s[1]) / MOST_INSTANTS)
}

/// Returns whether a series is mostly gap, like one whose clock was reset by years: no lattice can
/// span it.
pub(super) fn is_mostly_gap(series: &Timed) -> bool {
    const PART: f64 = 100.0;
    let instants = (series.last_s() - series.first_s()) / series.period_s();
    instants > MOST_INSTANTS && instants > PART * series.len() as f64
}

/// A series smoothed to the bandwidth of a lattice and cut at its gaps.
pub(super) struct Smooth {
    stretches: Vec<Stretch>,
}

impl Smooth {
    /// # Errors
    /// [`Error::TooShort`] if nothing is left.
    pub(super) fn new(name: &str, series: &Timed, step_s: f64) -> Result<Self, Error> {
        let stretches = uniform_stretches(series, step_s, LEAST_STRETCH)?.stretches;
        if stretches.is_empty() {
            let (name, found) = (name.to_owned(), series.len());
            let needed = (LEAST_STRETCH as f64 * COARSER) as usize;
            return Err(Error::TooShort { name, found, needed });
        }
        Ok(Self { stretches })
    }

    /// Returns the first and the last time, s.
    pub(super) fn span_s(&self) -> [f64; 2] {
        let last = &self.stretches[self.stretches.len() - 1];
        [self.stretches[0].series.first_s(), last.series.last_s()]
    }

    /// Returns the value at a time at least `margin_s` from any gap, by cubic interpolation of the
    /// four samples around it.
    pub(super) fn at(&self, t_s: f64, margin_s: f64) -> Option<f64> {
        let after = self.stretches.partition_point(|part| part.series.first_s() <= t_s - margin_s);
        let series = &self.stretches[after.checked_sub(1)?].series;
        (t_s + margin_s <= series.last_s()).then(|| cubic(series, t_s))
    }

    /// Returns the values at the instants of a lattice; `NaN` in gaps.
    pub(super) fn on(&self, grid: Grid) -> Vec<f64> {
        grid.times().map(|t| self.at(t, 0.0).unwrap_or(f64::NAN)).collect()
    }
}

/// Interpolates equally spaced samples by a Catmull–Rom cubic, linear in the end intervals.
fn cubic(series: &Timed, t_s: f64) -> f64 {
    let (x, last) = (series.values(), series.len() - 1);
    let place = (t_s - series.first_s()) / series.period_s();
    let before = (place.floor().max(0.0) as usize).min(last.saturating_sub(1));
    let part = place - before as f64;
    let [b, c] = [x[before], x[(before + 1).min(last)]];
    let a = if before > 0 { x[before - 1] } else { 2.0 * b - c };
    let d = if before + 2 <= last { x[before + 2] } else { 2.0 * c - b };
    let slope = c - a;
    let curve = 2.0 * a - 5.0 * b + 4.0 * c - d;
    let twist = 3.0 * (b - c) + d - a;
    b + 0.5 * part * (slope + part * (curve + part * twist))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_interpolated_exactly() {
        let grid = Grid { start_s: 3.0, period_s: 0.5, len: 9 };
        let parabola = |t: f64| 2.0 - t + 0.3 * t * t;
        let series =
            Timed::on_grid("x", grid, grid.times().map(parabola).collect()).expect("valid");
        for t in [3.0, 3.5, 3.6, 4.25, 6.4, 7.0] {
            assert!((cubic(&series, t) - parabola(t)).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn a_clock_reset_by_years_makes_no_lattice() {
        let mut times: Vec<f64> = (0..1000).map(|k| 0.1 * f64::from(k)).collect();
        times.extend((0..1000).map(|k| 1.6e9 + 0.1 * f64::from(k)));
        let leap = Timed::new("x", times.clone(), times).expect("valid");
        assert!(is_mostly_gap(&leap));
        assert!(leap.last_s() / step_s(0.1, [&leap, &leap]) < 1.1 * MOST_INSTANTS);
    }

    #[test]
    fn there_is_no_value_in_a_gap_or_near_it() {
        let times = (0..1000).map(|k| 0.1 * f64::from(k)).filter(|t| !(40.0..50.0).contains(t));
        let times: Vec<f64> = times.collect();
        let series = Timed::new("x", times.clone(), times).expect("valid");
        let smooth = Smooth::new("x", &series, 0.2).expect("long enough");
        assert!((smooth.at(30.03, 1.0).expect("a sample") - 30.03).abs() < 1e-6);
        for t in [-0.5, 0.5, 39.5, 45.0, 50.5, 99.5, 100.5] {
            assert_eq!(smooth.at(t, 1.0), None, "{t}");
        }
    }
}
