use super::LowPass;
use crate::{Error, Gap, Grid, Timed};

/// A stretch of a series without gaps, and its uniform grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    /// The instants of the grid.
    pub grid: Grid,
    /// The series to interpolate: the samples, smoothed where the grid is coarser.
    pub series: Timed,
}

/// A series cut at its gaps.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretches {
    /// The stretches between the gaps.
    pub stretches: Vec<Stretch>,
    /// The gaps.
    pub gaps: Vec<Gap>,
}

/// A cut-off at this fraction of half the new rate leaves less than 1 % of aliases.
const ANTI_ALIAS_PART: f64 = 0.7;
const ANTI_ALIAS_ORDER: usize = 4;

/// A gap is longer than this many sampling periods …
const GAP_PERIODS: f64 = 5.0;
/// … and than this many seconds: two lost packets are bridged, a lost minute is not.
const GAP_SECONDS: f64 = 0.5;

/// Largest number of instants for each sample of a smoothed series.
const MOST_FINER: f64 = 4.0;

/// Resamples a series to a grid by linear interpolation, smoothed first where the grid is coarser
/// than the samples, to prevent aliasing.
///
/// # Errors
/// [`Error::TooShort`] if it must be smoothed and has too few samples for that.
///
/// ```
/// use seaplant::{Grid, Timed, signal::resample};
/// // 4 Hz sampled at 100 Hz would alias to 1 Hz on a 5 Hz grid.
/// let t: Vec<f64> = (0..1000).map(|k| 0.01 * k as f64).collect();
/// let x: Vec<f64> = t.iter().map(|t| (2.0 * std::f64::consts::PI * 4.0 * t).sin()).collect();
/// let y = resample(&Timed::new("x", t, x)?, Grid { start_s: 2.0, period_s: 0.2, len: 30 })?;
/// assert!(y.iter().all(|y| y.abs() < 0.02));
/// # Ok::<(), seaplant::Error>(())
/// ```
pub fn resample(series: &Timed, grid: Grid) -> Result<Vec<f64>, Error> {
    Ok(without_aliases(series, grid.period_s)?.interpolate(grid))
}

/// Smooths the series if it would alias on grids of this period.
fn without_aliases(series: &Timed, period_s: f64) -> Result<Timed, Error> {
    let native = series.period_s();
    // Up to this ratio the Nyquist frequency of the samples is about that of the grid.
    if native <= 0.0 || period_s < 1.5 * native {
        return Ok(series.clone());
    }
    // The median period of samples in bursts is shorter than their mean period.
    let mean_s = (series.last_s() - series.first_s()) / series.len() as f64;
    let native = native.max(mean_s / MOST_FINER);
    if period_s < 1.5 * native {
        return Ok(series.clone());
    }
    let fine = Grid::spanning(series.first_s(), series.last_s(), native);
    let filter = LowPass { cutoff_hz: ANTI_ALIAS_PART * 0.5 / period_s, order: ANTI_ALIAS_ORDER };
    let smooth = filter.zero_phase(&series.interpolate(fine), 1.0 / native)?;
    Timed::on_grid("the smoothed series", fine, smooth)
}

/// Cuts a series at its gaps and prepares each stretch for a uniform rate.
///
/// A gap is an interval above five sampling periods and half a second; shorter ones are
/// interpolated linearly. Stretches with fewer than `least` instants are dropped and reported as
/// part of the gap around them.
///
/// # Errors
/// As [`resample`].
pub fn uniform_stretches(series: &Timed, period_s: f64, least: usize) -> Result<Stretches, Error> {
    let mut gaps = series.gaps((GAP_PERIODS * series.period_s()).max(GAP_SECONDS));
    let edges: Vec<(f64, f64)> = std::iter::once(series.first_s())
        .chain(gaps.iter().map(|gap| gap.to_s))
        .zip(gaps.iter().map(|gap| gap.from_s).chain(std::iter::once(series.last_s())))
        .collect();
    let mut stretches = Vec::new();
    for (from_s, to_s) in edges {
        let grid = Grid::spanning(from_s, to_s, period_s);
        let part = series.window(from_s, to_s).filter(|_| grid.len >= least);
        match part {
            Some(part) => {
                stretches.push(Stretch { grid, series: without_aliases(&part, period_s)? });
            }
            None => gaps.push(Gap { from_s, to_s }),
        }
    }
    gaps.sort_by(|a, b| a.from_s.total_cmp(&b.from_s));
    gaps.dedup_by(|next, gap| {
        let joined = next.from_s <= gap.to_s;
        if joined {
            gap.to_s = gap.to_s.max(next.to_s);
        }
        joined
    });
    Ok(Stretches { stretches, gaps })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(times: impl Iterator<Item = f64>) -> Timed {
        let t: Vec<f64> = times.collect();
        let x = t.iter().map(|t| t * 2.0).collect::<Vec<_>>();
        Timed::new("x", t, x).expect("valid")
    }

    #[test]
    fn cuts_at_a_gap_and_drops_a_stretch_that_is_too_short() {
        let times = (0..300).map(|k| 0.1 * f64::from(k));
        let holes = times.filter(|t| !(10.0..15.0).contains(t) && !(15.3..20.0).contains(t));
        let cut = uniform_stretches(&series(holes), 0.1, 20).expect("long enough");
        assert_eq!(cut.stretches.len(), 2);
        assert_eq!(cut.gaps.len(), 1, "{:?}", cut.gaps);
        assert!(cut.gaps[0].to_s - cut.gaps[0].from_s > 9.9);
    }

    #[test]
    fn bridges_two_lost_samples() {
        let times = (0..300).filter(|k| !(100..102).contains(k)).map(|k| 0.1 * f64::from(k));
        let cut = uniform_stretches(&series(times), 0.1, 20).expect("long enough");
        assert_eq!((cut.stretches.len(), cut.gaps.len()), (1, 0));
        let Stretch { grid, series } = &cut.stretches[0];
        assert!((series.interpolate(*grid)[101] - 20.2).abs() < 1e-9);
    }
}
