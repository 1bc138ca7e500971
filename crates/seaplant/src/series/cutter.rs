//! Windows of several series that share their times.

use std::ops::Range;
use std::sync::Arc;

use super::{Intervals, Timed};

/// A part of a time base that several series share.
pub(super) struct PartOfBase {
    pub(super) base: Arc<[f64]>,
    pub(super) rows: Range<usize>,
    pub(super) time_s: Arc<[f64]>,
    pub(super) steps: Intervals,
}

/// Cuts series to windows; those that share their times still do so afterwards.
#[derive(Default)]
pub(crate) struct Cutter(Vec<PartOfBase>);

impl Cutter {
    /// Cuts out the samples of [`Timed::window`].
    pub(crate) fn window(&mut self, series: &Timed, (from_s, to_s): (f64, f64)) -> Option<Timed> {
        series.part(series.rows(from_s, to_s), &mut self.0)
    }

    /// Cuts out the samples of [`Timed::window_held`].
    pub(crate) fn window_held(
        &mut self,
        series: &Timed,
        (from_s, to_s): (f64, f64),
    ) -> Option<Timed> {
        series.part(series.rows_held(from_s, to_s), &mut self.0)
    }

    /// Cuts out the samples that [`Timed::at`] needs within the window.
    pub(crate) fn around(&mut self, series: &Timed, (from_s, to_s): (f64, f64)) -> Timed {
        let from = series.time_s.partition_point(|&t| t <= from_s).saturating_sub(1);
        let to = series.time_s.partition_point(|&t| t < to_s) + 1;
        // Never empty: it has at least the sample at or before the window, or the first.
        let part = series.part(from..to.min(series.len()), &mut self.0);
        part.unwrap_or_else(|| series.clone())
    }
}
