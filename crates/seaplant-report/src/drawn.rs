//! Selects the trials that are drawn: all of a usual campaign; of very many, the worst and some
//! others.

use std::collections::{BTreeMap, BTreeSet};

use seaplant::results::{PlantResult, Results, Score, Series};
use seaplant::{Comparison, Dof, Role};

use crate::number::count;

/// Maximum number of trials of one role that are drawn per axis.
const MOST: usize = 40;

/// The drawn trials of each axis, and of each plant of several axes.
#[derive(Default)]
pub(crate) struct Drawn {
    /// By axis or plant, and role.
    picked: BTreeMap<(String, Role), Picked>,
}

struct Picked {
    names: BTreeSet<String>,
    of: usize,
}

/// Trials in order, each with the error of the recommended plant.
type Errors = Vec<(String, f64)>;

impl Drawn {
    pub(crate) fn select(results: &Results) -> Self {
        let mut all: BTreeMap<(String, Role), Errors> = BTreeMap::new();
        let scores: BTreeMap<_, _> =
            results.alone().map(|(dof, plant, _)| (dof, errors(dof, plant))).collect();
        for trial in &results.trials {
            for dof in trial.axes.keys() {
                let error = scores.get(dof).and_then(|errors| errors.get(trial.name.as_str()));
                let of_axis = all.entry((dof.name().to_owned(), trial.role)).or_default();
                of_axis.push((trial.name.clone(), error.copied().unwrap_or(0.0)));
            }
        }
        for (name, plant) in results.together() {
            let held_out = plant.hold_out.iter().map(|score| (Role::HoldOut, score));
            for (role, score) in held_out.chain([(Role::Fit, &plant.fit)]) {
                // Each axis in units of its own.
                let part = |of: &Score| of.mean_abs_error.unwrap_or(f64::INFINITY) / of.null_error;
                let errors = score.by_trial.iter().map(|(trial, axes)| {
                    (trial.clone(), axes.values().map(part).fold(0.0, f64::max))
                });
                all.insert((name.clone(), role), errors.collect());
            }
        }
        Self { picked: all.into_iter().map(|(key, errors)| (key, Picked::from(errors))).collect() }
    }

    /// Returns whether a series has a figure and a chart.
    pub(crate) fn has(&self, series: &Series) -> bool {
        let (of, role, trial) = match series {
            Series::Comparison(figure) => {
                let Comparison { dof, trial, .. } = &figure.comparison;
                let of = figure.plant.as_deref().unwrap_or(dof.name());
                (of, figure.role, trial)
            }
            Series::Spectrum(figure) => (figure.dof.name(), Role::Fit, &figure.trial),
            Series::Steady(figure) => (figure.dof.name(), Role::Steady, &figure.trial),
        };
        let picked = self.picked.get(&(of.to_owned(), role));
        picked.is_none_or(|picked| !picked.is_part() || picked.names.contains(trial))
    }

    /// Describes which trials of an axis, or of a plant of several, are drawn, if not all are.
    pub(crate) fn note(&self, of: &str, role: Role) -> Option<String> {
        let picked = self.picked.get(&(of.to_owned(), role))?;
        picked.is_part().then(|| {
            format!(
                "{} of {} trials are drawn: those with the largest errors, and others spread evenly. The folder series has all of them.",
                picked.names.len(),
                count(picked.of as u64)
            )
        })
    }
}

impl Picked {
    fn is_part(&self) -> bool {
        self.names.len() < self.of
    }
}

impl From<Errors> for Picked {
    /// Selects all, or the half of [`MOST`] with the largest errors, and as many spread over all.
    fn from(mut errors: Errors) -> Self {
        let of = errors.len();
        if of <= MOST {
            return Self { names: errors.into_iter().map(|(name, _)| name).collect(), of };
        }
        let spread = (0..MOST / 2).map(|k| errors[k * of / (MOST / 2)].0.clone());
        let mut names: BTreeSet<String> = spread.collect();
        errors.sort_by(|a, b| b.1.total_cmp(&a.1));
        names.extend(errors.into_iter().take(MOST / 2).map(|(name, _)| name));
        Self { names, of }
    }
}

/// Returns the simulation error of a plant on each trial; infinite where it diverged.
fn errors(dof: Dof, plant: &PlantResult) -> BTreeMap<&str, f64> {
    let scores = plant.hold_out.iter().chain([&plant.fit]).flat_map(|score| score.trials(dof));
    scores
        .map(|(trial, score)| (trial.as_str(), score.mean_abs_error.unwrap_or(f64::INFINITY)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_very_many_trials_the_worst_and_some_others_are_drawn() {
        let errors = |count: usize| -> Errors {
            (0..count).map(|k| (format!("run {k}"), if k == 777 { 9.0 } else { 0.1 })).collect()
        };
        let few = Picked::from(errors(MOST));
        assert_eq!((few.names.len(), few.of), (MOST, MOST));
        let many = Picked::from(errors(10_000));
        assert!(many.names.len() <= MOST && many.of == 10_000);
        for name in ["run 0", "run 777", "run 5000", "run 9500"] {
            assert!(many.names.contains(name), "{name}");
        }
        let key = ("surge".to_owned(), Role::Fit);
        let drawn = Drawn { picked: [(key, many)].into() };
        let note = drawn.note("surge", Role::Fit).expect("not all are drawn");
        let words = format!(" of {} trials are drawn", count(10_000_u64));
        assert!(note.contains(&words), "{note}");
        assert_eq!(drawn.note("surge", Role::HoldOut), None);
    }
}
