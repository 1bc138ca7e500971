//! Stretches of equal values.

/// Consecutive samples of one value: `from..to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Run {
    pub from: usize,
    pub to: usize,
    pub value: f64,
}

impl Run {
    pub fn len(&self) -> usize {
        self.to - self.from
    }

    /// Returns the time from its first sample to its last, s.
    pub fn span_s(&self, time_s: &[f64]) -> f64 {
        time_s[self.to - 1] - time_s[self.from]
    }
}

/// Returns all runs, single samples included, in order; none extends across a sample that does not
/// follow the one before.
pub(super) fn runs_within(values: &[f64], follows: impl Fn(usize) -> bool) -> Vec<Run> {
    let mut found: Vec<Run> = Vec::new();
    for (k, &value) in values.iter().enumerate() {
        match found.last_mut() {
            Some(run) if run.value == value && follows(k) => run.to = k + 1,
            _ => found.push(Run { from: k, to: k + 1, value }),
        }
    }
    found
}

/// Counts distinct values.
pub(super) fn distinct(values: &[f64]) -> usize {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    sorted.len()
}

/// Returns the quantile of the values; `None` if there are none.
pub(super) fn quantile(values: impl IntoIterator<Item = f64>, part: f64) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return None;
    }
    let k = ((values.len() - 1) as f64 * part).round() as usize;
    Some(*values.select_nth_unstable_by(k, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_part_a_series_where_it_changes() {
        let found: Vec<(usize, f64)> = runs_within(&[1.0, 1.0, 2.0, 1.0], |_| true)
            .iter()
            .map(|run| (run.len(), run.value))
            .collect();
        assert_eq!(found, [(2, 1.0), (1, 2.0), (1, 1.0)]);
        assert_eq!(distinct(&[1.0, 1.0, 2.0, 1.0]), 2);
    }
}
