//! From records to a fitted plant.

mod doubts;
mod outcome;
mod start;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::candidate::Candidate;
use super::minimise::Effort;
use super::parameters::{Unknown, Values};
use super::problem::{Kind, Problem, Record};
use super::search::{Fitted, Search};
use super::spikes::{innovations_of_another, strike_out};
use super::together::TwoPlants;
use crate::estimate::inputs::Inputs;
use crate::estimate::{DelayedFit, EquationError, Fit, Records};
use crate::{AxisRecord, Error, ThrusterTrack};
use doubts::{
    accelerometer_doubts, fitted_to_some, hidden_drag, hurried_disturbance, lag_or_mass,
    searched_on_part, struck_out,
};
use outcome::into_fit;
pub(super) use outcome::{freedom, lumped, plant_covariance, terms_of};
pub use start::first_delays;
use start::{Beginning, starts};

/// The filter error method with its choices.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FilterError {
    /// What may be taken into the model where the logs ask for it.
    pub candidates: Vec<Candidate>,
    /// What is part of the model whatever the logs say.
    pub required: Vec<Candidate>,
}

impl Default for FilterError {
    fn default() -> Self {
        Self { candidates: Candidate::ALL.to_vec(), required: Vec::new() }
    }
}

impl FilterError {
    /// Fits the plant by maximum likelihood on the innovations of a Kalman filter.
    ///
    /// States are velocity, a slow disturbance and, where it was measured, position:
    /// `v̇ = α τ* + β(v−u)|v−u| + (μ − α k_in Σ|n|)(v−u) + bias + d`, `ḋ = −d/T_d + w`, `ṗ = v`;
    /// waves, a current that varies and a velocity sensor that smooths add states of their own.
    /// Velocity and position are taken in at their own times, each with its own noise. Thrust
    /// τ* follows the logged one after a lag on propeller speed and a delay, with reverse
    /// thrust scaled by κ; u is a current, constant in each trial. It minimises
    /// `½ Σ (ln S + e²/S)` plus weak priors, by scoring on the Fisher information with
    /// analytic sensitivities, from several starts. Each [`Candidate`] is admitted if the Bayesian
    /// information criterion asks for it and held-out records are not predicted worse by more
    /// than chance; a bias force is left out if the logs show that it is too small to matter.
    ///
    /// Steady records are fitted with the others if a likelihood-ratio test finds that they ask
    /// for the same drag and bias force; else they are not, and [`Fit::steady_test`] has both.
    ///
    /// # Errors
    /// As [`Records::dof`] and [`EquationError::fit_best_delay`], from which it starts;
    /// [`Error::NotConverged`] if no optimum is reached.
    ///
    /// # Source
    /// [Jategaonkar2015, ch. 5]: filter error method; score test: \[Rao1948\].
    ///
    /// # Example
    /// ```
    /// use seaplant::estimate::FilterError;
    /// use seaplant::twin::{TwinSpec, make};
    /// use seaplant::{Dof, Trial, TrialSetup, VelocitySource};
    ///
    /// let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 240.0, ..TwinSpec::jason2() };
    /// let twin = make(&spec)?;
    /// let setup = TrialSetup { dofs: vec![Dof::Surge], ..TrialSetup::default() };
    /// let trial = Trial::new(setup, &twin.trials[0].recording, &twin.vehicle)?;
    /// let records = [trial.axis(Dof::Surge, VelocitySource::Measured)?];
    /// let fit = FilterError::default().fit(&records)?;
    /// assert!(fit.estimates().mass.covers(12_970.2));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn fit<'a>(&self, records: impl Into<Records<'a>>) -> Result<Fit, Error> {
        let records = records.into();
        let start = EquationError::default().fit_best_delay(records, first_delays())?;
        self.fit_from(records, &start)
    }

    /// As [`FilterError::fit`], from a start that is given: that of equation error with settings of
    /// one's own, by the delay that suits it best, or a fit of this method with other terms.
    ///
    /// # Errors
    /// As [`FilterError::fit`].
    pub fn fit_from<'a>(
        &self,
        records: impl Into<Records<'a>>,
        start: &DelayedFit,
    ) -> Result<Fit, Error> {
        let records = records.into();
        let (dof, terms) = (records.dof()?, records.terms);
        let some = some_of(records.fit);
        let axes = some.as_deref().unwrap_or(records.fit);
        let all_of = |axes: &[AxisRecord], kind| -> Vec<Record> {
            axes.iter().map(|axis| Record::of(axis, kind)).collect()
        };
        let whole = all_of(axes, Kind::Unsteady);
        let mut unsteady = part_to_search(&whole).unwrap_or_else(|| whole.clone());
        let is_part = samples_of(&unsteady) < samples_of(&whole);
        let mut others = all_of(records.hold_out, Kind::Unsteady);
        let first = Beginning::of(axes, start, records.dry_mass_kg);
        let can_be = |candidate: &&Candidate| {
            candidate.exists_in(axes) && !(candidate.is_term() && terms.is_some())
        };
        let required: Vec<Candidate> = self.required.iter().filter(can_be).copied().collect();
        let mut unknowns = first.unknowns(terms);
        unknowns.extend(required.iter().flat_map(|c| c.unknowns()).map(|(unknown, _)| unknown));
        let linear = required.contains(&Candidate::LinearThrust);
        let tracks: Vec<ThrusterTrack> = axes.iter().flat_map(AxisRecord::tracks).collect();
        let inputs = Inputs::new(&tracks);
        let is_shown = |candidate: &&Candidate| match candidate {
            Candidate::Exponent => inputs.show_exponent(),
            Candidate::ReverseRatio => inputs.show_reverse_ratio(),
            Candidate::LagRatio => inputs.show_lag_ratio(),
            _ => true,
        };
        let searched = self.candidates.iter().filter(can_be).filter(is_shown);
        let candidates: Vec<Candidate> =
            searched.filter(|c| !required.contains(c)).copied().collect();
        let (mut spiked, begun) =
            strike_first(&mut unsteady, &mut others, (&first, start), &unknowns, linear);
        let starts = match candidates.is_empty() {
            true => Vec::new(),
            false => starts(&first.values, axes, start),
        };
        let search = Search {
            records: &unsteady,
            priors: &first.priors,
            fixed: first.fixed(),
            starts: &starts,
            hold_out: &others,
            tried: candidates.len().max(1),
            knows_velocity: axes.iter().any(AxisRecord::knows_velocity),
        };
        let base = search.fit(&unknowns, linear, None, &begun);
        let (fitted, structure) = search.run(base, &candidates);
        if !fitted.optimum.converged {
            return Err(Error::NotConverged { dof, iterations: fitted.optimum.iterations });
        }
        let (of_search, on_part) = (fitted.clone(), search.clone());
        // A model that knows more takes less for a spike.
        let (mut clean, more);
        if is_part {
            clean = whole;
            let Fitted { problem, optimum } = &fitted;
            more = strike_out(&mut clean, |_, own| {
                innovations_of_another(problem, &optimum.theta, own)
            });
            spiked = more;
        } else {
            clean = unsteady.clone();
            let found = |k, _: &Record| fitted.problem.innovations(&fitted.optimum.theta, k);
            more = strike_out(&mut clean, found);
            spiked += more;
        }
        let search = Search { records: &clean, ..search.clone() };
        let fitted = search.again(&fitted);
        if !fitted.optimum.converged {
            return Err(Error::NotConverged { dof, iterations: fitted.optimum.iterations });
        }
        let mut fit = into_fit(dof, &fitted, structure, axes)?;
        if !records.steady.is_empty() {
            let steady = all_of(records.steady, Kind::Steady);
            let all = [clean.clone(), steady].concat();
            let all_axes = [axes, records.steady].concat();
            fit = join(fit, &fitted, &Search { records: &all, ..search.clone() }, &all_axes)?;
        }
        fit.caveats.extend(hurried_disturbance(&fit, axes));
        fit.caveats.extend(accelerometer_doubts(&fit));
        fit.caveats.extend(hidden_drag(&fit, axes));
        fit.caveats.extend(struck_out(dof, spiked, &clean));
        if !candidates.is_empty() {
            let (fitted, search) =
                if is_part { (&of_search, &on_part) } else { (&fitted, &search) };
            fit.caveats.extend(lag_or_mass(&fit, fitted, search));
        }
        if is_part {
            fit.caveats.push(searched_on_part(dof, samples_of(&unsteady), samples_of(&clean)));
        }
        if some.is_some() {
            fit.caveats.push(fitted_to_some(dof, axes.len(), records.fit.len()));
        }
        Ok(fit)
    }
}

/// Of more trials than this some are fitted: each may have a current of its own, and a step takes
/// time with the cube of their number.
pub(crate) const MOST_TRIALS: usize = 300;

/// Evenly spread ones of many trials; `None` of few.
fn some_of(axes: &[AxisRecord]) -> Option<Vec<AxisRecord>> {
    let place = |k: usize| k * axes.len() / MOST_TRIALS;
    (axes.len() > MOST_TRIALS).then(|| (0..MOST_TRIALS).map(|k| axes[place(k)].clone()).collect())
}

/// Of more samples than this, what the model has is searched on a part: the search takes a hundred
/// times what the last fit does, and more samples hardly change which terms there are.
pub(crate) const MOST_SEARCHED: usize = 40_000;

fn samples_of(records: &[Record]) -> usize {
    records.iter().map(Record::samples).sum()
}

/// Evenly spread pieces of long records; `None` of short ones, and where a piece has nothing to
/// start from.
fn part_to_search(records: &[Record]) -> Option<Vec<Record>> {
    let part = MOST_SEARCHED as f64 / samples_of(records) as f64;
    if part >= 1.0 {
        return None;
    }
    records.iter().map(|record| record.spread(part)).collect()
}

/// Strikes out what the simplest model takes for spikes, from fitted and held-out records; how
/// many there were in the fitted ones, and the values of that model.
fn strike_first(
    fitted: &mut [Record],
    others: &mut [Record],
    (first, start): (&Beginning, &DelayedFit),
    unknowns: &[Unknown],
    linear: bool,
) -> (usize, Values) {
    let records = fitted.to_vec();
    let mut fixed = first.fixed();
    fixed.shape.linear = linear;
    let problem = Problem::new(&records, unknowns, &first.priors, fixed);
    let base = match &start.fit.optimum {
        Some(known) => Fitted::within(problem, None, known, Effort::begun(0)),
        None => Fitted::of(problem, None, &first.values),
    };
    let Fitted { problem, optimum } = &base;
    strike_out(others, |_, other| innovations_of_another(problem, &optimum.theta, other));
    let spikes = strike_out(fitted, |k, _| problem.innovations(&optimum.theta, k));
    let is_own = |unknown: &&Unknown| !unknown.is_of_trial();
    let mut values = first.values;
    for unknown in unknowns.iter().filter(is_own) {
        values.set(*unknown, problem.values(&optimum.theta, 0).get(*unknown));
    }
    (spikes, values)
}

/// Fits all trials, steady ones among them, if these ask for the same plant as the others.
fn join(
    fit: Fit,
    unsteady: &Fitted<'_>,
    search: &Search<'_>,
    axes: &[AxisRecord],
) -> Result<Fit, Error> {
    let Some(two) = TwoPlants::fit(unsteady, search) else { return Ok(fit) };
    let Some((together, test)) = two.tested() else { return Ok(fit) };
    let fit = match together {
        Some(together) => into_fit(fit.dof, &together, fit.structure, axes)?,
        None => fit,
    };
    Ok(Fit { steady_test: Some(test), ..fit })
}
