//! Reduces long series for figures.

/// Keeps at most `most` points of a series, including the extremes of every part.
///
/// The series is cut into equal spans of x; each keeps its minimum and its maximum in their order,
/// and the end points are kept. A peak of one sample survives.
pub(crate) fn decimate(x: &[f64], y: &[f64], most: usize) -> Vec<(f64, f64)> {
    let points = || x.iter().copied().zip(y.iter().copied());
    let n = x.len().min(y.len());
    let bins = most.saturating_sub(2) / 2;
    if n <= most || bins == 0 {
        return points().take(n).collect();
    }
    let (first, span) = (x[0], x[n - 1] - x[0]);
    let bin_of = |x: f64| {
        let part = if span > 0.0 { (x - first) / span } else { 0.0 };
        ((part * bins as f64) as usize).min(bins - 1)
    };
    let mut kept = vec![(x[0], y[0])];
    let mut from = 1;
    while from < n - 1 {
        let bin = bin_of(x[from]);
        let mut to = from;
        let (mut least, mut greatest) = (from, from);
        while to < n - 1 && bin_of(x[to]) == bin {
            if y[to] < y[least] {
                least = to;
            }
            if y[to] > y[greatest] {
                greatest = to;
            }
            to += 1;
        }
        let (early, late) = (least.min(greatest), least.max(greatest));
        kept.push((x[early], y[early]));
        if late > early {
            kept.push((x[late], y[late]));
        }
        from = to;
    }
    kept.push((x[n - 1], y[n - 1]));
    kept
}

/// Ratio of a pause to the usual step from which it is a gap, which no line crosses.
const GAP_STEPS: f64 = 5.0;

/// Returns the ranges of a series of instants without gaps.
pub(crate) fn runs(x: &[f64]) -> Vec<std::ops::Range<usize>> {
    let mut steps: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let middle = steps.len() / 2;
    let longest = if steps.is_empty() {
        f64::INFINITY
    } else {
        GAP_STEPS * *steps.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    let mut runs = Vec::new();
    let mut from = 0;
    for k in 1..=x.len() {
        if k == x.len() || x[k] - x[k - 1] > longest {
            runs.push(from..k);
            from = k;
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_of_one_sample_survive() {
        let x: Vec<f64> = (0..48_000).map(|k| 0.1 * f64::from(k)).collect();
        let mut y: Vec<f64> = x.iter().map(|t| (0.785 * t).sin()).collect();
        y[777] = 9.0;
        y[31_234] = -7.0;
        let kept = decimate(&x, &y, 1500);
        assert!(kept.len() <= 1500, "{}", kept.len());
        assert!(kept.contains(&(x[777], 9.0)) && kept.contains(&(x[31_234], -7.0)));
        assert_eq!((kept[0], kept[kept.len() - 1]), ((x[0], y[0]), (x[47_999], y[47_999])));
        assert!(kept.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

    #[test]
    fn short_series_are_unchanged() {
        assert_eq!(decimate(&[0.0, 1.0], &[5.0, 6.0], 1500), [(0.0, 5.0), (1.0, 6.0)]);
        assert_eq!(decimate(&[], &[], 1500), []);
    }

    #[test]
    fn a_series_at_one_instant_keeps_its_extremes() {
        let y: Vec<f64> = (0..5000).map(f64::from).collect();
        let kept = decimate(&[3.0; 5000], &y, 100);
        assert!(kept.len() <= 100 && kept.contains(&(3.0, 4998.0)));
    }

    #[test]
    fn no_line_crosses_a_gap() {
        assert_eq!(runs(&[0.0, 0.1, 0.2, 9.0, 9.1]), [0..3, 3..5]);
        assert_eq!(runs(&[0.0, 0.1]), vec![0..2; 1]);
        assert_eq!(runs(&[]), []);
    }
}
