//! The whole identification: trials in, every plant with its doubts out.

mod convert;
mod figures;

use std::collections::BTreeMap;

use convert::{accumulated, empty_results, plant_result, steady_result};

use crate::diagnose::{
    Evidence, Strokes, better_elsewhere, caveats, disagreement, implausible, lateness,
    lateness_caveat, reverse_elsewhere, scoring, steady_against_unsteady, thrust_scale,
    worse_trials,
};
use crate::estimate::steady::{SteadyOptions, fit_steady};
use crate::estimate::{
    EquationErrorOptions, EquationErrorStatistics, FilterErrorOptions, Fit, Method,
    OutputErrorOptions, PaperOptions, Records, first_delays, fit_best_delay, fit_equation_error,
    fit_filter_error, fit_output_error, fit_paper, fit_sriv, fit_total_least_squares,
    fit_weighted_least_squares,
};
use crate::results::{
    AccumulatedPlant, Failure, FittedModel, Identification, PlantResult, Score, SteadyResult,
    SubsetResult, TrialScore,
};
use crate::trial::ThrustError;
use crate::{
    Agreement, AxisRecord, Caveat, Comparison, Dof, Error, LumpedParameters, Model, Role, Terms,
    Trial, Vehicle, VelocitySource, evaluate,
};

/// What to identify, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifyOptions {
    /// The methods, each once; the recommended plant is the first's.
    pub methods: Vec<Method>,
    /// The terms to fit where `terms_of` does not say otherwise; if not given, the default
    /// ones, and linear drag where the filter error method finds it.
    pub terms: Option<Terms>,
    /// The terms to fit in some degrees of freedom.
    pub terms_of: BTreeMap<Dof, Terms>,
    /// Where velocity comes from, if every method shall take it from the same; else the
    /// paper's method derives it from position and the others take what was measured.
    pub velocity: Option<VelocitySource>,
    /// Settings of the paper's method.
    pub paper: PaperOptions,
    /// Settings of equation error.
    pub equation_error: EquationErrorOptions,
    /// Settings of output error.
    pub output_error: OutputErrorOptions,
    /// Settings of filter error.
    pub filter_error: FilterErrorOptions,
    /// What counts as steady.
    pub steady: SteadyOptions,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self {
            methods: Method::DEFAULT.to_vec(),
            terms: None,
            terms_of: BTreeMap::new(),
            velocity: None,
            paper: PaperOptions::default(),
            equation_error: EquationErrorOptions::default(),
            output_error: OutputErrorOptions::default(),
            filter_error: FilterErrorOptions::default(),
            steady: SteadyOptions::default(),
        }
    }
}

impl IdentifyOptions {
    /// The terms that were asked for in one degree of freedom.
    pub fn terms_for(&self, dof: Dof) -> Option<Terms> {
        self.terms_of.get(&dof).copied().or(self.terms)
    }
}

/// Identifies every degree of freedom of the trials with every method, scores each plant
/// on fitted and held-out trials, finds steady drag, and gathers the doubts.
///
/// What cannot be done in one degree of freedom or by one method is listed among the
/// results' failures; it does not stop the others.
pub fn identify(vehicle: &Vehicle, trials: &[Trial], options: &IdentifyOptions) -> Identification {
    identify_watched(vehicle, trials, options, &mut |_| {})
}

/// A fit that is about to be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stage {
    /// Of which degree of freedom.
    pub dof: Dof,
    /// By which method.
    pub method: Method,
    /// How many were made before it.
    pub done: usize,
    /// How many there are in all.
    pub of: usize,
}

/// [`identify`], that tells of each fit before it is made, for those who wait.
pub fn identify_watched(
    vehicle: &Vehicle,
    trials: &[Trial],
    options: &IdentifyOptions,
    watch: &mut dyn FnMut(Stage),
) -> Identification {
    let mut found =
        Identification { results: empty_results(vehicle, trials, options), models: Vec::new() };
    let with_fits = |dof: &&Dof| !TrialsOf::new(**dof, trials).fit.is_empty();
    let of = Dof::ALL.iter().filter(with_fits).count() * options.methods.len();
    let mut done = 0;
    for dof in Dof::ALL {
        let work = Work { dof, vehicle, options, trials: &TrialsOf::new(dof, trials) };
        let recommended = work.unsteady(&mut found, &mut |method| {
            watch(Stage { dof, method, done, of });
            done += 1;
        });
        work.steady(recommended.as_ref(), &mut found);
    }
    reverse_elsewhere(&mut found.results.plants, &mut found.results.steady);
    implausible(&mut found.results.plants, vehicle);
    for (dof, plant) in &found.results.plants {
        let methods = found.results.methods.entry(*dof).or_default();
        if let Some(same) = methods.get_mut(&plant.method) {
            same.caveats.clone_from(&plant.caveats);
        }
    }
    found.results.caveats.push(thrust_scale(vehicle));
    found
}

/// Quadratic drag from the steady stretches of trials, whatever these are for.
///
/// # Errors
/// As [`fit_steady`].
pub fn steady_drag(
    dof: Dof,
    trials: &[&Trial],
    options: &SteadyOptions,
) -> Result<SteadyResult, Error> {
    Ok(steady_result(&fit_steady(dof, trials, options)?))
}

/// The plant that equation error finds of records in shards.
///
/// # Errors
/// As [`EquationErrorStatistics::fit`].
pub fn accumulated_plant(shards: &EquationErrorStatistics) -> Result<AccumulatedPlant, Error> {
    Ok(accumulated(&shards.fit()?))
}

/// Fits one degree of freedom with one method, and no more than that.
pub(crate) fn fit_of_trials(
    dof: Dof,
    vehicle: &Vehicle,
    fit: &[Trial],
    hold_out: &[Trial],
    method: Method,
    options: &IdentifyOptions,
) -> Result<Fit, Error> {
    let trials = TrialsOf {
        fit: fit.iter().collect(),
        hold_out: hold_out.iter().collect(),
        steady: Vec::new(),
    };
    let work = Work { dof, vehicle, options, trials: &trials };
    Ok(work.fit(method, options.terms_for(dof))?.0)
}

/// The trials of one degree of freedom, by role.
struct TrialsOf<'a> {
    fit: Vec<&'a Trial>,
    hold_out: Vec<&'a Trial>,
    steady: Vec<&'a Trial>,
}

impl<'a> TrialsOf<'a> {
    fn new(dof: Dof, trials: &'a [Trial]) -> Self {
        let of =
            |role| trials.iter().filter(|t| t.role() == role && t.dofs().contains(&dof)).collect();
        Self { fit: of(Role::Fit), hold_out: of(Role::HoldOut), steady: of(Role::Steady) }
    }
}

/// The identification of one degree of freedom.
#[derive(Clone, Copy)]
struct Work<'a> {
    dof: Dof,
    vehicle: &'a Vehicle,
    options: &'a IdentifyOptions,
    trials: &'a TrialsOf<'a>,
}

impl Work<'_> {
    /// Every method's plant; with the recommended fit.
    fn unsteady(&self, found: &mut Identification, watch: &mut dyn FnMut(Method)) -> Option<Fit> {
        if self.trials.fit.is_empty() {
            return None;
        }
        let mut fits = Vec::new();
        for &method in &self.options.methods {
            watch(method);
            match self.fit(method, self.options.terms_for(self.dof)) {
                Ok(fit) => fits.push(fit),
                Err(error) => found.results.failures.push(self.failure(method.name(), &error)),
            }
        }
        let recommended = fits.first().map(|(fit, _)| fit.clone());
        let late = self.lateness(&fits);
        for (fit, axes) in &fits {
            let late = late.get(&fit.method);
            match self.plant(fit, axes, recommended.as_ref(), late) {
                Ok(plant) => {
                    let (dof, method, model) = (self.dof, fit.method, fit.model());
                    found.models.push(FittedModel { dof, method, model });
                    if recommended.as_ref().is_some_and(|first| first.method == fit.method) {
                        found.results.plants.insert(self.dof, plant.clone());
                    }
                    found.results.methods.entry(self.dof).or_default().insert(fit.method, plant);
                }
                Err(error) => {
                    found.results.failures.push(self.failure(fit.method.name(), &error));
                }
            }
        }
        if let Some(plant) = found.results.plants.get_mut(&self.dof) {
            let others = found.results.methods.entry(self.dof).or_default();
            plant.caveats.extend(better_elsewhere(self.dof, plant, others));
        }
        if let Some(fit) = &recommended {
            found.results.subsets.insert(self.dof, self.subsets(fit));
        }
        recommended
    }

    fn failure(&self, method: &str, error: &Error) -> Failure {
        Failure { dof: self.dof, method: method.to_owned(), message: error.to_string() }
    }

    fn axes(&self, trials: &[&Trial], source: VelocitySource) -> Result<Vec<AxisRecord>, Error> {
        trials.iter().map(|trial| trial.axis(self.dof, source)).collect()
    }

    /// The steady trials; of those with given segments, these.
    fn steady_axes(&self, source: VelocitySource) -> Result<Vec<AxisRecord>, Error> {
        let mut axes = Vec::new();
        for trial in &self.trials.steady {
            let axis = trial.axis(self.dof, source)?;
            match trial.setup().segments_s.as_slice() {
                [] => axes.push(axis),
                given => axes.extend(given.iter().filter_map(|span| axis.window(*span))),
            }
        }
        Ok(axes)
    }

    fn fit(&self, method: Method, terms: Option<Terms>) -> Result<(Fit, Vec<AxisRecord>), Error> {
        let Self { options, trials, .. } = *self;
        let usual = match method {
            Method::Paper => VelocitySource::Position,
            _ => VelocitySource::Measured,
        };
        let source = options.velocity.unwrap_or(usual);
        let axes = self.axes(&trials.fit, source)?;
        let fit = if method == Method::FilterError {
            let hold_out = self.axes(&trials.hold_out, source)?;
            let steady = self.steady_axes(source)?;
            // It carries thrust errors itself, by its own information.
            self.fit_filter_error(
                Records { fit: &axes, hold_out: &hold_out, steady: &steady },
                terms,
            )?
        } else {
            with_thrust_errors(&axes, &|axes| self.fit_alone(method, axes, terms))?
        };
        Ok((fit, axes))
    }

    /// A fit of some records by themselves.
    fn fit_alone(
        &self,
        method: Method,
        axes: &[AxisRecord],
        terms: Option<Terms>,
    ) -> Result<Fit, Error> {
        let Self { dof, options, .. } = *self;
        let first = &options.equation_error;
        let chosen = terms.unwrap_or_default();
        match method {
            Method::Paper => fit_paper(dof, axes, chosen, &options.paper),
            Method::EquationError => fit_equation_error(dof, axes, chosen, first),
            Method::WeightedLeastSquares => fit_weighted_least_squares(dof, axes, chosen, first),
            Method::TotalLeastSquares => fit_total_least_squares(dof, axes, chosen, first),
            Method::Sriv => fit_sriv(dof, axes, chosen, first),
            Method::OutputError => {
                let start = fit_equation_error(dof, axes, chosen, first)?.lumped;
                fit_output_error(dof, axes, chosen, &start, &options.output_error)
            }
            Method::FilterError => {
                self.fit_filter_error(Records { fit: axes, hold_out: &[], steady: &[] }, terms)
            }
        }
    }

    fn fit_filter_error(&self, records: Records<'_>, terms: Option<Terms>) -> Result<Fit, Error> {
        let first = &self.options.equation_error;
        let chosen = terms.unwrap_or_default();
        let start = fit_best_delay(self.dof, records.fit, chosen, first, first_delays())?;
        fit_filter_error(self.dof, records, terms, &start, &self.options.filter_error)
    }

    /// Whether thrust acts later than it was logged, of each method that takes it as
    /// logged; the scan is one for all of them.
    fn lateness(&self, fits: &[(Fit, Vec<AxisRecord>)]) -> BTreeMap<Method, Caveat> {
        let takes_as_logged =
            |(fit, _): &&(Fit, Vec<AxisRecord>)| fit.method.takes_force_as_logged();
        let doubted: Vec<_> = fits.iter().filter(takes_as_logged).collect();
        let options = &self.options.equation_error;
        let Some((first, axes)) = doubted.first() else { return BTreeMap::new() };
        let Some(delay_s) = lateness(self.dof, axes, first.terms, options) else {
            return BTreeMap::new();
        };
        let timely: Vec<AxisRecord> = axes.iter().map(|axis| axis.delayed(delay_s)).collect();
        let caveat = |(fit, _): &(Fit, Vec<AxisRecord>)| {
            let timely = self.fit_alone(fit.method, &timely, Some(fit.terms));
            (fit.method, lateness_caveat(fit, delay_s, timely.ok().as_ref()))
        };
        doubted.into_iter().map(caveat).collect()
    }

    fn plant(
        &self,
        fit: &Fit,
        axes: &[AxisRecord],
        recommended: Option<&Fit>,
        late: Option<&Caveat>,
    ) -> Result<PlantResult, Error> {
        let fit_score = score_plant(self.dof, &fit.model(), &self.trials.fit)?;
        let hold_out = match self.trials.hold_out.as_slice() {
            [] => None,
            trials => Some(score_plant(self.dof, &fit.model(), trials)?),
        };
        let evidence = Evidence { fit, axes, trials: &self.trials.fit, vehicle: self.vehicle };
        let mut doubts = caveats(&evidence)?;
        doubts.extend(late.cloned());
        if let Some(recommended) = recommended.filter(|first| first.method != fit.method) {
            doubts.extend(disagreement(recommended, fit));
        }
        let of = |score: &Score| (score.mean_abs_error, score.null_error);
        doubts.extend(scoring(self.dof, of(&fit_score), hold_out.as_ref().map(of)));
        doubts.extend(hold_out.iter().flat_map(|score| worse_trials(self.dof, score)));
        doubts.sort_by_key(|caveat| std::cmp::Reverse(caveat.severity));
        doubts.dedup();
        Ok(plant_result(fit, fit_score, hold_out, doubts))
    }

    /// The recommended method with every choice of terms, beside the same nuisances.
    fn subsets(&self, recommended: &Fit) -> Vec<SubsetResult> {
        let admitted = recommended.structure.iter().filter(|decision| decision.admitted);
        let required = admitted.map(|decision| decision.candidate).collect();
        let filter_error = FilterErrorOptions { candidates: Vec::new(), required };
        let options = IdentifyOptions { filter_error, ..self.options.clone() };
        let trials =
            TrialsOf { fit: self.trials.fit.clone(), hold_out: Vec::new(), steady: Vec::new() };
        let work = Work { options: &options, trials: &trials, ..*self };
        let error = |model: &Model, trials: &[&Trial]| {
            score_plant(self.dof, model, trials).ok()?.mean_abs_error
        };
        let of = |terms: Terms| {
            let (fit, _) = work.fit(recommended.method, Some(terms)).ok()?;
            let model = fit.model();
            Some(SubsetResult {
                terms: terms.fitted(),
                lumped: fit.lumped,
                stable: fit.lumped.stability().is_stable(),
                fit_error: error(&model, &self.trials.fit),
                hold_out_error: error(&model, &self.trials.hold_out)
                    .filter(|_| !self.trials.hold_out.is_empty()),
                condition: fit.condition,
            })
        };
        Terms::subsets().into_iter().filter_map(of).collect()
    }

    fn steady(&self, recommended: Option<&Fit>, found: &mut Identification) {
        if self.trials.steady.is_empty() {
            return;
        }
        match fit_steady(self.dof, &self.trials.steady, &self.options.steady) {
            Ok(fit) => {
                let plant = found.results.plants.get_mut(&self.dof);
                if let Some((plant, unsteady)) = plant.zip(recommended) {
                    let strokes = Strokes::of(self.dof, &found.results.trials);
                    plant.caveats.extend(steady_against_unsteady(unsteady, &fit, &strokes));
                }
                found.results.steady.insert(self.dof, steady_result(&fit));
            }
            Err(error) => found.results.failures.push(self.failure("steady", &error)),
        }
    }
}

/// Fits records, and once more for each thrust curve that may be off, by as much as that.
fn with_thrust_errors(
    axes: &[AxisRecord],
    fit: &dyn Fn(&[AxisRecord]) -> Result<Fit, Error>,
) -> Result<Fit, Error> {
    let found = fit(axes)?;
    let errors = axes.first().map(AxisRecord::thrust_errors).unwrap_or_default();
    let with_off = |error: ThrustError| {
        let off: Result<Vec<AxisRecord>, Error> =
            axes.iter().map(|axis| axis.with_thrust_off(error)).collect();
        Ok(fit(&off?)?.lumped)
    };
    let others: Vec<LumpedParameters> =
        errors.into_iter().map(with_off).collect::<Result<_, Error>>()?;
    Ok(found.with_thrust_off(&others))
}

/// Scores a plant on trials: e on raw velocity, beside a model that never moves.
///
/// # Errors
/// Those of [`Trial::axis`]; a simulation that runs away is no error but has no score.
pub fn score_plant(dof: Dof, model: &Model, trials: &[&Trial]) -> Result<Score, Error> {
    Ok(total_score(&compare(dof, model, trials)?))
}

/// One trial simulated, or not.
enum Outcome {
    Compared(Box<Comparison>),
    Diverged { trial: String, null_error: f64, samples: usize },
}

fn compare(dof: Dof, model: &Model, trials: &[&Trial]) -> Result<Vec<Outcome>, Error> {
    let of = |trial: &&Trial| match evaluate(dof, model, trial) {
        Ok(comparison) => Ok(Outcome::Compared(Box::new(comparison))),
        Err(Error::Diverged { .. }) => {
            let velocity = trial.axis(dof, VelocitySource::Measured)?.velocity()?;
            let samples = velocity.len();
            let null_error =
                velocity.values().iter().map(|v| v.abs()).sum::<f64>() / samples as f64;
            Ok(Outcome::Diverged { trial: trial.name().to_owned(), null_error, samples })
        }
        Err(other) => Err(other),
    };
    trials.iter().map(of).collect()
}

fn total_score(outcomes: &[Outcome]) -> Score {
    let compared = outcomes.iter().filter_map(|outcome| match outcome {
        Outcome::Compared(comparison) => Some(comparison),
        Outcome::Diverged { .. } => None,
    });
    let pairs = compared.flat_map(|c| c.measured.iter().copied().zip(c.simulated.iter().copied()));
    let all = Agreement::over(pairs, 0.0);
    let mut diverged = false;
    let mut null = (0.0, 0);
    let mut trials = Vec::new();
    for outcome in outcomes {
        let score = match outcome {
            Outcome::Compared(comparison) => trial_score(comparison),
            Outcome::Diverged { trial, null_error, samples } => {
                diverged = true;
                TrialScore {
                    trial: trial.clone(),
                    mean_abs_error: None,
                    null_error: *null_error,
                    r_squared: None,
                    position_r_squared: None,
                    position_mean_abs_error: None,
                    samples: *samples,
                }
            }
        };
        null.0 += score.null_error * score.samples as f64;
        null.1 += score.samples;
        trials.push(score);
    }
    Score {
        mean_abs_error: (!diverged).then_some(all.mean_abs_error),
        null_error: if null.1 == 0 { 0.0 } else { null.0 / null.1 as f64 },
        r_squared: all.r_squared.filter(|_| !diverged),
        trials,
    }
}

fn trial_score(comparison: &Comparison) -> TrialScore {
    let position = comparison.position.as_ref().map(|position| position.agreement);
    TrialScore {
        trial: comparison.trial.clone(),
        mean_abs_error: Some(comparison.velocity.mean_abs_error),
        null_error: comparison.velocity.null_error,
        r_squared: comparison.velocity.r_squared,
        position_r_squared: position.and_then(|agreement| agreement.r_squared),
        position_mean_abs_error: position.map(|agreement| agreement.mean_abs_error),
        samples: comparison.velocity.samples,
    }
}
