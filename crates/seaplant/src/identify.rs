//! The whole identification: trials in, every plant with its doubts out.

mod convert;
mod figures;
mod mistaken;
mod nomoto;
mod plants;
mod stages;
mod unsteady;
mod verdict;

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

pub use mistaken::likely_mistakes;
pub use plants::{compare_fitted_plant, score_fitted_plant, score_table};
pub use stages::{Stage, stages};

use convert::{accumulated, empty_results, steady_result};
use verdict::verdict;

use crate::diagnose::{
    Strokes, implausible, lateness, lateness_caveat, reverse_elsewhere, steady_against_unsteady,
    thrust_scale,
};
use crate::estimate::online::{OnlineOptions, fit_online};
use crate::estimate::steady::{SteadyOptions, fit_steady};
use crate::estimate::{
    EquationError, EquationErrorStatistics, FilterError, Fit, Method, OutputError, Paper, Records,
    WeightedLeastSquares,
};
use crate::exchange::{Draws, PlantModel};
use crate::judge::{mean_error, records};
use crate::plant::RigidBody;
use crate::results::{
    AccumulatedPlant, Consequence, Failure, Identification, PlantResult, Results, SteadyResult,
    SubsetResult, two_digits,
};
use crate::trial::ThrustError;
use crate::{
    AxisRecord, Caveat, CaveatCode, Dof, Error, LumpedParameters, Model, PlantPlan, Role, Terms,
    Trial, Vehicle, VelocitySource, parallel,
};

/// What to identify, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct IdentifyOptions {
    /// The methods, each once; the recommended plant is the first's, unless that is none of a
    /// vehicle or another's predicts unseen trials better by more than chance. Of the default ones
    /// the filter error method stands alone where acceleration is all that was measured.
    pub methods: Vec<Method>,
    /// The terms to fit where `terms_of` does not say otherwise; if not given, the default
    /// ones, and linear drag where the filter error method finds it.
    pub terms: Option<Terms>,
    /// The terms to fit in some degrees of freedom.
    pub terms_of: BTreeMap<Dof, Terms>,
    /// Where velocity comes from, if every method shall take it from the same; else the
    /// paper's method derives it from position and the others take what was measured.
    pub velocity: Option<VelocitySource>,
    /// Whether to fit the recommended method with every choice of terms, too.
    pub subsets: bool,
    /// Settings of the paper's method.
    pub paper: Paper,
    /// Settings of equation error.
    pub equation_error: EquationError,
    /// Settings of output error.
    pub output_error: OutputError,
    /// Settings of filter error.
    pub filter_error: FilterError,
    /// Settings of the methods that work sample by sample.
    pub online: OnlineOptions,
    /// What counts as steady.
    pub steady: SteadyOptions,
    /// Plants of several axes, beside those of each by itself.
    pub together: Vec<PlantPlan>,
}

impl Default for IdentifyOptions {
    fn default() -> Self {
        Self {
            methods: Method::DEFAULT.to_vec(),
            terms: None,
            terms_of: BTreeMap::new(),
            velocity: None,
            subsets: true,
            paper: Paper::default(),
            equation_error: EquationError::default(),
            output_error: OutputError::default(),
            filter_error: FilterError::default(),
            online: OnlineOptions::default(),
            steady: SteadyOptions::default(),
            together: Vec::new(),
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

/// [`identify`], calling back before each of its [`stages`], to show progress.
///
/// Axes are identified at the same time, so that stages begin in no certain order; their `done` counts
/// those that have begun.
pub fn identify_watched(
    vehicle: &Vehicle,
    trials: &[Trial],
    options: &IdentifyOptions,
    watch: &mut (dyn FnMut(&Stage) + Send),
) -> Identification {
    let empty =
        Identification { results: empty_results(vehicle, trials, options), models: Vec::new() };
    let stages = stages(vehicle, trials, options);
    let begun = Mutex::new((0, watch));
    let begins = |axes: &[Dof], method| {
        let here = |stage: &&Stage| stage.axes == axes && stage.method == method;
        let Some(stage) = stages.iter().find(here) else { return };
        let mut begun = begun.lock().unwrap_or_else(PoisonError::into_inner);
        let (done, watch) = &mut *begun;
        watch(&Stage { done: *done, ..stage.clone() });
        *done += 1;
    };
    let of_axes = parallel::map(&Dof::ALL, |&dof| {
        let mut found = empty.clone();
        let trials = &TrialsOf::new(dof, trials);
        let work = Work { dof, vehicle, options, trials, batch: None };
        let recommended = work.unsteady(&mut found, &mut |method| begins(&[dof], method));
        work.steady(recommended.as_ref(), &mut found);
        found
    });
    let mut found = empty;
    for Identification { results, models } in of_axes {
        found.models.extend(models);
        found.results.plants.extend(results.plants);
        found.results.methods.extend(results.methods);
        found.results.subsets.extend(results.subsets);
        found.results.steady.extend(results.steady);
        found.results.failures.extend(results.failures);
    }
    reverse_elsewhere(&mut found.results.plants, &mut found.results.steady);
    implausible(&mut found.results.plants, vehicle);
    judge(&mut found.results);
    plants::identify(vehicle, trials, options, &mut found.results, &mut |axes| {
        begins(axes, Method::FilterError);
    });
    nomoto::identify(vehicle, trials, options, &mut found.results);
    mistaken::name(vehicle, trials, &mut found.results);
    if !is_scale_told(&found.results) {
        let scale = thrust_scale(vehicle, &found.results);
        found.results.caveats.push(scale);
    }
    found.results.consequences = consequences(&found.results);
    let Results { plants, methods, .. } = &mut found.results;
    let methods_of_all = methods.values_mut().flat_map(BTreeMap::values_mut);
    plants.values_mut().chain(methods_of_all).for_each(|plant| add_added_mass(plant, vehicle));
    for (name, plant) in plants {
        methods.entry(name.clone()).or_default().insert(plant.method, plant.clone());
    }
    found
}

/// Adds the added mass of each axis, if the vehicle itself is known.
fn add_added_mass(plant: &mut PlantResult, vehicle: &Vehicle) {
    let body = vehicle.rigid_body.as_ref().map(RigidBody::mass_matrix);
    for (&dof, own) in &mut plant.by_axis {
        let of_body = body.map(|matrix| matrix[(dof.index(), dof.index())]);
        let dry = of_body.or(vehicle.dry_mass_kg.filter(|_| !dof.is_rotation()));
        if let Some(dry) = dry {
            *own = own.clone().with_dry(dry);
        }
    }
}

/// Returns true if known forces determine the scale of thrust of all plants.
fn is_scale_told(results: &Results) -> bool {
    let is_told = |plant: &PlantResult| {
        let scale = plant.nuisances.get("thrust_scale");
        scale.is_some_and(|x| 0.5 * (x.high95 - x.low95) <= plants::WIDEST_SCALE * x.value)
    };
    !results.plants.is_empty() && results.plants.values().all(is_told)
}

/// Computes what follows from the recommended plants: drag at the usual speed of the trials, and motion at
/// their greatest force, to two digits.
fn consequences(results: &Results) -> Vec<Consequence> {
    let mut all: Vec<Consequence> =
        Dof::ALL.into_iter().flat_map(|dof| drag_forces(dof, results)).collect();
    all.extend(of_forces(results));
    all
}

fn drag_forces(dof: Dof, results: &Results) -> impl Iterator<Item = Consequence> {
    let units = dof.units();
    results.drag_forces(dof).into_iter().take(1).map(move |(speed, force)| Consequence {
        name: format!("drag at {speed} {}", units.velocity),
        axis: dof,
        value: force.value,
        interval95: Some([force.low95, force.high95]),
        unit: units.force.to_owned(),
    })
}

fn of_forces(results: &Results) -> Vec<Consequence> {
    // Without a plant, or with one that no vehicle can have, nothing follows; its caveats say so.
    let Ok(model) = PlantModel::of_results(results, "results.json", None) else {
        return Vec::new();
    };
    let forces = model.driven.iter().map(|(&dof, driven)| (dof, driven.force_max));
    let forces = forces.filter(|(_, force)| *force > 0.0);
    let forces = forces.map(|(dof, force)| (dof, two_digits(force))).collect();
    let known = model.consequences(&forces, Draws::default());
    known.or_else(|_| model.consequences(&forces, Draws { count: 0, seed: 1 })).unwrap_or_default()
}

/// Gives every plant of an axis alone its verdict.
fn judge(results: &mut Results) {
    for plant in results.plants.values_mut() {
        plant.caveats.sort_by_key(|caveat| std::cmp::Reverse(caveat.severity));
        plant.verdict = verdict(plant);
    }
    let methods = results.methods.values_mut().flat_map(BTreeMap::values_mut);
    methods.for_each(|plant| plant.verdict = verdict(plant));
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

/// The trials of one degree of freedom, by role.
#[derive(Default)]
struct TrialsOf<'a> {
    fit: Vec<&'a Trial>,
    hold_out: Vec<&'a Trial>,
    steady: Vec<&'a Trial>,
    /// That trials say too little to be used.
    left_out: Vec<Caveat>,
}

impl<'a> TrialsOf<'a> {
    /// Sorts the trials that can be used by role; if none can be fitted, these stay, and the fit says why.
    fn new(dof: Dof, trials: &'a [Trial]) -> Self {
        let own = || trials.iter().filter(|trial| trial.dofs().contains(&dof));
        let refused = |trial: &Trial| trial.axis(dof, VelocitySource::Measured).err();
        let is_fit = |trial: &&Trial| trial.role() == Role::Fit;
        let is_usable = |trial: &&Trial| refused(trial).is_none();
        let has_fit = own().filter(is_fit).any(|trial| is_usable(&trial));
        let of = |role| -> Vec<&Trial> {
            let all = own().filter(|trial| trial.role() == role);
            all.filter(|trial| !has_fit && is_fit(trial) || is_usable(trial)).collect()
        };
        let left_out = own().filter_map(|trial| {
            let message = format!("trial `{}` is left out: {}", trial.name(), refused(trial)?);
            Some(Caveat::warning(CaveatCode::TrialLeftOut, message))
        });
        Self {
            fit: of(Role::Fit),
            hold_out: of(Role::HoldOut),
            steady: of(Role::Steady),
            left_out: left_out.collect(),
        }
    }
}

/// The identification of one degree of freedom.
#[derive(Clone, Copy)]
struct Work<'a> {
    dof: Dof,
    vehicle: &'a Vehicle,
    options: &'a IdentifyOptions,
    trials: &'a TrialsOf<'a>,
    /// What filter error found, for methods that go on from there.
    batch: Option<&'a Fit>,
}

impl Work<'_> {
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

    /// Which velocity a method works on.
    fn source(&self, method: Method) -> VelocitySource {
        let usual = match method {
            Method::Paper => VelocitySource::Position,
            _ => VelocitySource::Measured,
        };
        self.options.velocity.unwrap_or(usual)
    }

    fn fit(&self, method: Method, terms: Option<Terms>) -> Result<(Fit, Vec<AxisRecord>), Error> {
        let trials = self.trials;
        let source = self.source(method);
        let axes = self.axes(&trials.fit, source)?;
        if axes.is_empty() {
            return Err(Error::NoTrial { dof: self.dof });
        }
        if method != Method::FilterError && axes.iter().any(|axis| !axis.knows_velocity()) {
            return Err(Error::NoVelocity);
        }
        let fit = if method == Method::FilterError {
            // It carries thrust errors itself, by its own information.
            let steady = self.steady_axes(source)?;
            self.options.filter_error.fit(Records { fit: &axes, steady: &steady, terms })?
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
        let Self { options, batch, .. } = *self;
        let first = options.equation_error;
        let records = Records { terms, ..Records::from(axes) };
        match method {
            Method::Paper => options.paper.fit(records),
            Method::EquationError => first.fit(records),
            Method::WeightedLeastSquares => WeightedLeastSquares(first).fit(records),
            Method::OutputError => {
                options.output_error.fit_from(records, &first.fit(records)?.lumped)
            }
            Method::Adaptive | Method::Recursive | Method::Ekf => {
                let terms = terms.or(batch.map(|batch| batch.terms));
                fit_online(method, Records { terms, ..records }, batch, &options.online)
            }
            Method::FilterError => self.options.filter_error.fit(records),
        }
    }

    /// Whether thrust acts later than it was logged, of each method that takes it as
    /// logged; the scan is one for all of them.
    fn lateness(&self, fits: &[(Fit, Vec<AxisRecord>)]) -> BTreeMap<Method, Caveat> {
        let takes_as_logged = |(fit, _): &&(Fit, Vec<AxisRecord>)| {
            let goes_on = fit.method.scheme().is_some() && self.batch.is_some();
            fit.method.takes_force_as_logged() && !goes_on
        };
        let doubted: Vec<_> = fits.iter().filter(takes_as_logged).collect();
        let Some((first, axes)) = doubted.first() else { return BTreeMap::new() };
        let records = Records::from(axes).with_terms(first.terms);
        let Some(delay_s) = lateness(records, &self.options.equation_error) else {
            return BTreeMap::new();
        };
        let timely: Vec<AxisRecord> = axes.iter().map(|axis| axis.delayed(delay_s)).collect();
        let caveat = |(fit, _): &(Fit, Vec<AxisRecord>)| {
            let timely = self.fit_alone(fit.method, &timely, Some(fit.terms));
            (fit.method, lateness_caveat(fit, delay_s, timely.ok().as_ref()))
        };
        doubted.into_iter().map(caveat).collect()
    }

    /// The options that fit the structure that was found, and search for none.
    fn with_structure_of(&self, fit: &Fit) -> IdentifyOptions {
        let admitted = fit.structure.iter().filter(|decision| decision.admitted);
        let required = admitted.map(|decision| decision.candidate).collect();
        let filter_error = FilterError { candidates: Vec::new(), required };
        IdentifyOptions { filter_error, ..self.options.clone() }
    }

    /// The recommended method with every choice of terms, beside the same nuisances.
    fn subsets(&self, recommended: &Fit) -> Vec<SubsetResult> {
        if !self.options.subsets {
            return Vec::new();
        }
        let options = self.with_structure_of(recommended);
        let trials = TrialsOf { fit: self.trials.fit.clone(), ..TrialsOf::default() };
        let work = Work { options: &options, trials: &trials, ..*self };
        let [fitted, held_out] =
            [&self.trials.fit, &self.trials.hold_out].map(|trials| records(self.dof, trials).ok());
        let error = |model: &Model, records: &Option<Vec<AxisRecord>>| {
            mean_error(model, records.as_deref()?).ok()?
        };
        let of = |terms: Terms| {
            let fit = match terms == recommended.terms {
                true => recommended.clone(),
                false => work.of_terms(recommended, terms).ok()?,
            };
            let model = fit.model();
            Some(SubsetResult {
                terms: terms.fitted(),
                lumped: fit.lumped,
                stable: fit.lumped.stability().is_stable(),
                fit_error: error(&model, &fitted),
                hold_out_error: error(&model, &held_out)
                    .filter(|_| !self.trials.hold_out.is_empty()),
                condition: fit.condition,
            })
        };
        parallel::map(&Terms::subsets(), |terms| of(*terms)).into_iter().flatten().collect()
    }

    /// A fit of other terms than those of a fit, from where that one ended.
    fn of_terms(&self, fit: &Fit, terms: Terms) -> Result<Fit, Error> {
        if fit.method != Method::FilterError {
            return Ok(self.fit(fit.method, Some(terms))?.0);
        }
        let axes = self.axes(&self.trials.fit, self.source(fit.method))?;
        let records = Records { terms: Some(terms), ..Records::from(&axes[..]) };
        self.options.filter_error.fit_from(records, fit)
    }

    fn steady(&self, recommended: Option<&Fit>, found: &mut Identification) {
        if self.trials.steady.is_empty() {
            return;
        }
        match fit_steady(self.dof, &self.trials.steady, &self.options.steady) {
            Ok(fit) => {
                let plant = found.results.plants.get_mut(self.dof.name());
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
