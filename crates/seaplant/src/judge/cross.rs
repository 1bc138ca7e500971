//! Cross-validation where no trial was held out.

use super::null::Nulls;
use super::score::{Score, Scored, score};
use crate::{AxisRecord, Error, Fit};

/// Number of parts of a record; each is left out in turn.
pub(crate) const FOLDS: usize = 3;

/// Fits a plant without each part of its records and predicts that part.
///
/// Parts are trials, or thirds of a single one. `None` if a part is too short for prediction, or
/// the rest for a fit.
///
/// # Errors
/// Those of the simulation except divergence, which is a score.
pub(crate) fn left_out(
    axes: &[AxisRecord],
    refit: &dyn Fn(&[AxisRecord]) -> Result<Fit, Error>,
) -> Result<Option<Scored>, Error> {
    let mut all: Option<Scored> = None;
    for part in folds(axes) {
        let rest: Vec<AxisRecord> = folds(axes)
            .into_iter()
            .filter(|other| other.iter().all(|axis| !part.contains(axis)))
            .flatten()
            .collect();
        let Ok(fit) = refit(&rest) else { return Ok(None) };
        let scored = score(&fit.model(), &part, &Nulls::of(&rest))?;
        all = Some(match all {
            None => scored,
            Some(before) => joined(before, scored),
        });
    }
    Ok(all)
}

/// Returns the records in disjoint parts: groups of trials, or thirds of a single one.
fn folds(axes: &[AxisRecord]) -> Vec<Vec<AxisRecord>> {
    if let [single] = axes {
        let motion = single.motion.series();
        let (from_s, span_s) = (motion.first_s(), motion.last_s() - motion.first_s());
        let edge = |k: usize| from_s + span_s * k as f64 / FOLDS as f64;
        let third = |k: usize| single.window([edge(k), edge(k + 1)]).map(|axis| vec![axis]);
        return (0..FOLDS).filter_map(third).collect();
    }
    let folds = axes.len().min(FOLDS);
    let of = |k: usize| axes.iter().skip(k).step_by(folds).cloned().collect();
    (0..folds).map(of).collect()
}

fn joined(before: Scored, other: Scored) -> Scored {
    let weight =
        |scored: &Scored| scored.of_trials().map(|trial| trial.samples).sum::<usize>() as f64;
    let (a, b) = (weight(&before), weight(&other));
    let mean = |x: Option<f64>, y: Option<f64>| Some((a * x? + b * y?) / (a + b));
    let (one, two) = (before.score, other.score);
    let best_null = one.best_null.zip(two.best_null).map(|(x, y)| {
        let better = if x.mean_abs_error * b < y.mean_abs_error * a { x } else { y };
        let error = (a * x.mean_abs_error + b * y.mean_abs_error) / (a + b);
        super::null::NullScore { mean_abs_error: error, ..better }
    });
    let has_run_away = one.mean_abs_error.is_none() || two.mean_abs_error.is_none();
    let parts = if has_run_away { Vec::new() } else { [before.parts, other.parts].concat() };
    let score = Score {
        quantity: one.quantity,
        mean_abs_error: mean(one.mean_abs_error, two.mean_abs_error),
        null_error: (a * one.null_error + b * two.null_error) / (a + b),
        best_null,
        offset_free_error: mean(one.offset_free_error, two.offset_free_error),
        samples: one.samples + two.samples,
        ..Score::default()
    };
    Scored { score, trials: [before.trials, other.trials].concat(), parts }
}
