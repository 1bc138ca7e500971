use crate::Timed;
use crate::series::median;

/// A filter for samples that deviate far from their neighbours' median.
///
/// A sample is an outlier if `|x − median| > threshold · max(1.4826 MAD, floor)`
/// over the `2 half_width + 1` samples around it.
///
/// # Source
/// \[Hampel1974\]: the Hampel identifier.
///
/// ```
/// use seaplant::{Timed, signal::Hampel};
/// let mut v: Vec<f64> = (0..50).map(|k| 0.01 * k as f64).collect();
/// v[20] = 9.0;
/// let v = Timed::new("u", (0..50).map(|k| 0.1 * k as f64).collect::<Vec<_>>(), v)?;
/// let masked = Hampel { half_width: 5, threshold: 8.0, floor: 0.01 }.mask(&v);
/// assert_eq!(masked.removed_s, [2.0]);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hampel {
    /// Number of neighbours on either side.
    pub half_width: usize,
    /// The threshold in standard deviations.
    pub threshold: f64,
    /// Lower bound of the standard deviation, in units of the signal: that of a quantised or smooth
    /// signal may be zero.
    pub floor: f64,
}

/// A series without its outliers.
#[derive(Clone, Debug, PartialEq)]
pub struct Masked {
    /// The remaining samples.
    pub series: Timed,
    /// Times of the removed samples, s.
    pub removed_s: Vec<f64>,
}

impl Masked {
    /// Removes samples by their indices, in order; keeps the series if none would remain.
    pub(crate) fn without(series: &Timed, removed: &[usize]) -> Self {
        let (t, x) = (series.time_s(), series.values());
        if removed.is_empty() || removed.len() == x.len() {
            return Self { series: series.clone(), removed_s: Vec::new() };
        }
        let left = Timed::new("the plausible samples", without(t, removed), without(x, removed))
            .unwrap_or_else(|_| series.clone());
        Self { series: left, removed_s: removed.iter().map(|&k| t[k]).collect() }
    }
}

/// Converts a median absolute deviation to a standard deviation of normal noise.
const MAD_TO_STD: f64 = 1.4826;

impl Hampel {
    /// Removes the outliers of a series.
    pub fn mask(&self, series: &Timed) -> Masked {
        let x = series.values();
        let mut around = Vec::new();
        let removed: Vec<usize> =
            (0..x.len()).filter(|&k| self.is_outlier(x, k, &mut around)).collect();
        Masked::without(series, &removed)
    }

    /// Returns whether sample `k` is an outlier; `around` is scratch space for its neighbours.
    fn is_outlier(&self, x: &[f64], k: usize, around: &mut Vec<f64>) -> bool {
        let from = k.saturating_sub(self.half_width);
        let to = (k + self.half_width + 1).min(x.len());
        let least_off = self.threshold * self.floor;
        let (low, high) = x[from..to]
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)));
        // The median lies between them.
        if high - low <= least_off {
            return false;
        }
        around.clear();
        around.extend_from_slice(&x[from..to]);
        let Some(centre) = median(around) else { return false };
        let off = (x[k] - centre).abs();
        if off <= least_off {
            return false;
        }
        around.iter_mut().for_each(|x| *x = (*x - centre).abs());
        let spread = median(around).unwrap_or(0.0) * MAD_TO_STD;
        off > self.threshold * spread.max(self.floor)
    }
}

/// Removes values by their indices, in order.
fn without(x: &[f64], removed: &[usize]) -> Vec<f64> {
    let mut removed = removed.iter().copied().peekable();
    let kept = x.iter().enumerate().filter(|(k, _)| removed.next_if_eq(k).is_none());
    kept.map(|(_, x)| *x).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_are_removed_at_any_position() {
        const FILTER: Hampel = Hampel { half_width: 5, threshold: 8.0, floor: 0.01 };
        let t: Vec<f64> = (0..60).map(f64::from).collect();
        let plain: Vec<f64> = t.iter().map(|t| 0.3 * (0.2 * t).sin()).collect();
        let mut spiked = plain.clone();
        for k in [0, 20, 21, 59] {
            spiked[k] += 5.0;
        }
        let masked = FILTER.mask(&Timed::new("v", t.clone(), spiked).expect("valid"));
        assert_eq!(masked.removed_s, [0.0, 20.0, 21.0, 59.0]);
        let kept = (1..59).filter(|k| ![20, 21].contains(k));
        assert!(masked.series.values().iter().eq(kept.map(|k| &plain[k])));
        let masked = FILTER.mask(&Timed::new("v", t, plain).expect("valid"));
        assert_eq!((masked.series.len(), masked.removed_s.len()), (60, 0));
    }
}
