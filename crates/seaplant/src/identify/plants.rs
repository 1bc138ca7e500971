//! Identification of plants of several axes: fit, scores and caveats.

mod change;
mod doubts;
mod known;
mod online;
mod prime;
mod restoring;
mod rivals;
mod scale;
mod score;
mod sensor_place;
mod steady;
mod thrusters;
mod trials;
mod under_way;

pub(super) use scale::WIDEST_SCALE;
pub use score::{compare_fitted_plant, score_fitted_plant, score_table};

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix6};

use super::IdentifyOptions;
use super::verdict::{Evidence, Judgement};
use crate::axes::listed;
use crate::estimate::{
    Actuator, INSTRUMENTS, PlantFit, Tried, fit_alone, fit_plant, fit_plant_freely, restless_thrust,
};
use crate::judge::{OffBecause, STILL, may_be_off};
use crate::plant::{
    Basis, EffectForce, Plant, Product, RigidBody, Signal, Structure, ThrusterNumber,
};
use crate::results::{
    Coefficient, Correlation, Driven, Failure, Identifiability, MatrixResult, Parameter,
    Parameters, PlantResult, PlantScore, Results, Score, TermDecision, ToldBy,
};
use crate::{
    Caveat, CaveatCode, Dof, Error, Estimate, Method, PlantPlan, Role, SteeringGear, Timed, Trial,
    TrialRecord, Vehicle,
};

/// Identifies every requested plant of several axes; calls `begins` with the axes of each
/// beforehand.
pub(super) fn identify(
    vehicle: &Vehicle,
    trials: &[Trial],
    options: &IdentifyOptions,
    results: &mut Results,
    begins: &mut dyn FnMut(&[Dof]),
) {
    for plan in &options.together {
        begins(&plan.axes);
        match plant(plan, vehicle, trials, options) {
            Ok((name, plant, (online, failures))) => {
                results.methods.entry(name.clone()).or_default().extend(online);
                results.plants.insert(name, plant);
                results.failures.extend(failures);
            }
            Err(error) => {
                results.failures.push(failure(&plan.axes, Method::FilterError, &error));
            }
        }
    }
}

/// Converts the error of a method on several axes.
fn failure(axes: &[Dof], method: Method, error: &Error) -> Failure {
    Failure {
        dof: axes.first().copied().unwrap_or(Dof::Surge),
        method: format!("{method} of {} together", listed(axes)),
        message: error.to_string(),
    }
}

/// Records of trials by purpose.
#[derive(Default)]
pub(super) struct Records<'a> {
    pub(super) fit: Vec<&'a TrialRecord>,
    pub(super) hold_out: Vec<&'a TrialRecord>,
    /// Caveats on the logs of the fitted trials.
    of_logs: Vec<Caveat>,
    /// Caveats for trials that are left out.
    left_out: Vec<Caveat>,
}

impl<'a> Records<'a> {
    /// # Errors
    /// The error of the first trial to fit, if none of them can be used; [`Error::NoTrial`] if
    /// there is none.
    pub(super) fn of(trials: &'a [Trial], axes: &[Dof]) -> Result<Self, Error> {
        let mut records = Self::default();
        let mut refused = None;
        for trial in trials.iter().filter(|trial| trial.role() != Role::Steady) {
            match (trial.record(axes), trial.role()) {
                (Ok(record), Role::Fit) => {
                    records.fit.push(record);
                    records.of_logs.extend_from_slice(trial.caveats_of_log());
                }
                (Ok(record), _) => records.hold_out.push(record),
                (Err(error), role) => {
                    let message = format!("trial `{}` is left out: {error}", trial.name());
                    let caveat = Caveat::warning(CaveatCode::TrialLeftOut, message);
                    records.left_out.push(caveat);
                    if role == Role::Fit {
                        refused.get_or_insert(error);
                    }
                }
            }
        }
        match (records.fit.is_empty(), refused) {
            (true, Some(error)) => Err(error),
            (true, None) => Err(Error::NoTrial { dof: axes[0] }),
            (false, _) => Ok(records),
        }
    }

    /// Replaces the fitted records, and those held out, by the given ones, if there are any.
    fn with_trials<'b>(self, acted: &'b [TrialRecord], wired: &'b [TrialRecord]) -> Records<'b>
    where
        'a: 'b,
    {
        let fit = if acted.is_empty() { self.fit } else { acted.iter().collect() };
        let hold_out = if wired.is_empty() { self.hold_out } else { wired.iter().collect() };
        let Self { of_logs, left_out, .. } = self;
        Records { fit, hold_out, of_logs, left_out }
    }
}

/// Plants by methods that work sample by sample, and the failures of such methods.
type Online = (BTreeMap<Method, PlantResult>, Vec<Failure>);

fn plant(
    plan: &PlantPlan,
    vehicle: &Vehicle,
    trials: &[Trial],
    options: &IdentifyOptions,
) -> Result<(String, PlantResult, Online), Error> {
    let records = Records::of(trials, &plan.axes)?;
    let all = || records.fit.iter().chain(&records.hold_out);
    let is_logged = |signal: &Signal| all().all(|record| record.signals.contains_key(signal));
    let structure = plan.structure(vehicle, is_logged)?;
    for record in all() {
        check_signals(&structure, record)?;
    }
    check_motion(&structure, &records.fit)?;
    check_scale(&structure, &records.fit)?;
    let refuted = known::refuted_body(&structure, &records.fit, trials, vehicle);
    let body = vehicle.rigid_body.as_ref().filter(|_| refuted.is_none());
    let (scored, other) = best(&structure, &records, body, plan.search)?;
    let alike = other.filter(|other| rivals::predicts_as_well(other, &scored));
    let disputed =
        alike.as_ref().and_then(|other| rivals::disagreement(&scored, other, &records.fit));
    let alike = alike.map(|other| other.fit);
    let rival = alike.as_ref().filter(|_| disputed.is_some());
    let Scored { fit, of_fit, of_hold_out } = scored;
    let by_mass = known::scale(&fit, &records.fit, vehicle);
    let by_forces = scale::scale(&fit);
    let is_known = by_forces.is_some_and(|(scale, half)| half <= WIDEST_SCALE * scale);
    let unsure_scale = by_mass.as_ref().filter(|_| !is_known).map(known::OtherScale::std);
    let as_driven = fit.as_driven(&records.fit)?;
    let as_wired = fit.as_wired(&records.hold_out)?;
    let records = records.with_trials(&as_driven, &as_wired);
    let mut plant = result(&fit, vehicle.rigid_body.as_ref());
    plant.thruster_estimates = thrusters::estimates(&fit, &plant);
    plant.fit = of_fit;
    plant.hold_out = of_hold_out;
    plant.nondimensional = prime::prime(&fit, &records.fit, vehicle);
    plant.driven = driven(&records);
    plant.single_axes = scores_alone(&fit, &records, body);
    let mut of_axes = known::doubts(&fit, &plant.parameters, &records.fit, vehicle);
    let beyond = fit.beyond_neighbours.iter();
    of_axes.extend(beyond.filter_map(|(&dof, x)| Some((dof, restless_thrust(dof, *x)?))));
    of_axes.extend(sensor_place::doubts(&fit, &records.fit, vehicle));
    plant.caveats = doubts::doubts(&fit, &plant, &records, vehicle, &of_axes);
    let below =
        refuted.or_else(|| known::hardly_above_body(&fit, &structure, &records.fit, vehicle));
    let refuted_scale = scale::refuted(&fit, vehicle, by_mass.as_ref(), is_known);
    let good_for = plant.hold_out.as_ref().map(|held| trials::confirmed(held, &records));
    // Axes that all trials together show to be badly predicted are left to other caveats.
    let is_predicted = |dof: Dof| plant.held_out(dof).is_some_and(|pooled| !pooled.falls_short());
    let worse: Vec<Caveat> =
        good_for.iter().flat_map(|good_for| good_for.caveats(is_predicted)).collect();
    let mut numbers = known::numbers(&fit, rival, plant.hold_out.as_ref(), &records.fit);
    for one in sensor_place::centred(&fit, &records.fit, vehicle) {
        let own = numbers.iter_mut().filter(|(dof, number)| *dof == one.swing.by && number.is_mass);
        own.for_each(|(_, number)| number.others.push((OffBecause::SensorPlace, one.inertia[1])));
    }
    if let Some(other) = by_mass.as_ref().filter(|_| !is_known) {
        for (_, number) in &mut numbers {
            let value = other.times * number.estimate.value;
            number.others.push((OffBecause::ThrustScale, value));
        }
    }
    let scale = by_mass.map(|other| match by_forces {
        None => other.caveat,
        Some((by_forces, _)) => Caveat {
            message: format!(
                "known forces and the stated mass contradict each other: with thrust {by_forces:.3} times its curve, as known forces have it, {}",
                other.caveat.message
            ),
            ..other.caveat
        },
    });
    let own = below.into_iter().chain(disputed).chain(scale).chain(worse);
    plant.caveats.splice(0..0, own);
    let online = online::plants(&fit, &records, (vehicle, body), options);
    plant.caveats.splice(0..0, records.left_out);
    let axes = numbers.iter().map(|(dof, _)| *dof);
    let evidence = Evidence {
        of_axes: of_axes.iter().map(|(dof, caveat)| (*dof, caveat)).collect(),
        against_all: refuted_scale.or(doubts::too_early(&fit)),
        lacking: plant.axes.iter().copied().filter(|dof| doubts::lacks(&fit, *dof)).collect(),
        is_early: fit.actuator.delay_s < 0.0,
        good_for,
        may_be_off: axes.zip(may_be_off(numbers.iter().map(|(_, number)| number))).collect(),
    };
    (plant.verdict, plant.verdicts) = Judgement { plant: &plant, evidence: &evidence }.verdicts();
    if unsure_scale.is_some() || alike.is_some() {
        let fit = alike.iter().fold(fit, PlantFit::or);
        let fit = unsure_scale.into_iter().fold(fit, PlantFit::of_unsure_scale);
        plant = with_intervals_of(plant, result(&fit, vehicle.rigid_body.as_ref()));
    }
    Ok((structure.name(), plant, online))
}

/// A plant with the intervals of another result of the same numbers; what was said of it was of how well motion
/// determines it.
fn with_intervals_of(plant: PlantResult, other: PlantResult) -> PlantResult {
    PlantResult {
        parameters: other.parameters,
        by_axis: other.by_axis,
        mass_matrix: other.mass_matrix,
        linear_damping: other.linear_damping,
        quadratic_damping: other.quadratic_damping,
        correlation: other.correlation,
        ..plant
    }
}

/// A fit with its open-loop scores on the trials.
struct Scored {
    fit: PlantFit,
    of_fit: PlantScore,
    of_hold_out: Option<PlantScore>,
}

impl Scored {
    fn new(fit: PlantFit, records: &Records<'_>) -> Result<Self, Error> {
        let own = |record: &TrialRecord| fit.current_of(&record.trial);
        let beside = score::Standing::beside(&fit);
        let as_driven = fit.as_driven(&records.fit)?;
        let as_driven: Vec<&TrialRecord> = as_driven.iter().collect();
        let fitted = if as_driven.is_empty() { records.fit.as_slice() } else { &as_driven };
        let of_fit = score::score(&fit.plant, &beside, (fitted, fitted), own)?;
        let wired = fit.as_wired(&records.hold_out)?;
        let wired: Vec<&TrialRecord> = wired.iter().collect();
        let held_out = if wired.is_empty() { records.hold_out.as_slice() } else { &wired };
        let mut of_hold_out = match held_out {
            [] => None,
            // A trial outside the fit has no estimated current.
            held => {
                Some(score::score(&fit.plant, &beside, (fitted, held), |_| fit.mean_current())?)
            }
        };
        if let Some(score) = &mut of_hold_out {
            for (dof, change) in change::changes(&fit, held_out)? {
                score.by_axis.entry(dof).and_modify(|score| score.likely_change = Some(change));
            }
        }
        Ok(Self { fit, of_fit, of_hold_out })
    }

    /// Computes Σ ln(1 − R²) over the axes of the held-out trials, or of the fitted ones.
    fn misfit(&self) -> f64 {
        let score = self.of_hold_out.as_ref().unwrap_or(&self.of_fit);
        let of = |score: &Score| score.r_squared.map_or(f64::INFINITY, |r2| (1.0 - r2).ln());
        score.by_axis.values().map(of).sum()
    }
}

/// Fits by filter error; where the plant has effects or the fit does not converge, by output error
/// as well. Returns the fit that predicts better, and the other one.
///
/// Filter error predicts motion from sample to sample, and attributes a missing force of a rudder,
/// a propeller or wind to disturbance; output error has to explain all of the motion.
///
/// # Errors
/// The error of filter error, if neither method converges; [`Error::Plant`] with the reason where
/// thrust hardly changes.
fn best(
    structure: &Structure,
    records: &Records<'_>,
    body: Option<&RigidBody>,
    search: bool,
) -> Result<(Scored, Option<Scored>), Error> {
    let filtered = fit_plant(structure, &records.fit, body, search);
    let filtered = filtered.and_then(|fit| Scored::new(fit, records));
    let filtered = match filtered {
        Ok(only) if !structure.reads_beside_thrusters() => return Ok((only, None)),
        filtered => filtered,
    };
    let free = fit_plant_freely(structure, &records.fit, body, search);
    let free = free.and_then(|fit| Scored::new(fit, records));
    match (filtered, free) {
        (Ok(filtered), Ok(free)) => Ok(match free.misfit() < filtered.misfit() {
            true => (free, Some(filtered)),
            false => (filtered, Some(free)),
        }),
        (Ok(only), Err(_)) | (Err(_), Ok(only)) => Ok((only, None)),
        (Err(error), Err(_)) => Err(steady::reason(structure, &records.fit).unwrap_or(error)),
    }
}

/// Scores a separate fit of each driven axis with measured velocity, on held-out trials if there
/// are any; thrusters and sensors are as in the fit of all axes.
fn scores_alone(
    fit: &PlantFit,
    records: &Records<'_>,
    body: Option<&RigidBody>,
) -> BTreeMap<Dof, Score> {
    let scored = if records.hold_out.is_empty() { &records.fit } else { &records.hold_out };
    let of = |&dof: &Dof| {
        records.fit.iter().find(|record| record.is_driven(dof))?;
        // Without a measured velocity, one axis takes as long to fit as all of them.
        if !records.fit.iter().all(|record| record.is_measured(dof)) {
            return None;
        }
        // An axis that cannot be fitted separately has no such score.
        let alone = fit_alone(fit, dof, &records.fit, body).ok()?;
        let beside = score::Standing::beside(&alone);
        let current = alone.mean_current();
        let trials = (records.fit.as_slice(), scored.as_slice());
        let score = score::score(&alone.plant, &beside, trials, |_| current).ok()?;
        Some((dof, *score.by_axis.get(&dof)?))
    };
    match fit.plant.axes() {
        [_] => BTreeMap::new(),
        axes => axes.iter().filter_map(of).collect(),
    }
}

/// Returns the maximum speed and force of each axis over all trials.
fn driven(records: &Records<'_>) -> BTreeMap<Dof, Driven> {
    let greatest = |series: Option<&Timed>| {
        series.map_or(0.0, |x| x.values().iter().fold(0.0_f64, |most, x| most.max(x.abs())))
    };
    let mut driven: BTreeMap<Dof, Driven> = BTreeMap::new();
    for record in records.fit.iter().chain(&records.hold_out) {
        for dof in Dof::ALL {
            let (velocity, force) =
                (record.velocity[dof.index()].as_ref(), record.force[dof.index()].as_ref());
            if velocity.is_some() {
                let known = driven.entry(dof).or_default();
                *known =
                    known.or(Driven { speed_max: greatest(velocity), force_max: greatest(force) });
            }
        }
    }
    driven
}

/// Checks that each axis moves, since otherwise its coefficients are undetermined.
///
/// # Errors
/// [`Error::Plant`] with the axis, if its speed is below the limit in all trials.
fn check_motion(structure: &Structure, records: &[&TrialRecord]) -> Result<(), Error> {
    for &dof in structure.axes() {
        let speeds = records.iter().filter_map(|record| record.velocity[dof.index()].as_ref());
        let greatest =
            speeds.flat_map(|series| series.values()).fold(0.0_f64, |m, x| m.max(x.abs()));
        if greatest < STILL {
            let reason = format!(
                "{dof} does not move in any trial to fit (its greatest speed is {greatest:.1e} {}); leave it out of axes, or drive it",
                dof.units().velocity
            );
            return Err(Error::Plant { axes: structure.name(), reason });
        }
    }
    Ok(())
}

/// Checks that every signal of the plant is logged in a trial.
///
/// # Errors
/// [`Error::MissingChannel`] with the missing signal.
fn check_signals(structure: &Structure, record: &TrialRecord) -> Result<(), Error> {
    let lacks = |signal: &&Signal| !record.signals.contains_key(signal);
    let Some(signal) = structure.signals().iter().find(lacks) else { return Ok(()) };
    let advice = match signal {
        Signal::Angle { .. } => "map it under [channels], or take it away from vehicle.toml",
        Signal::Drive(_)
        | Signal::PropellerSpeed(_)
        | Signal::Thrust(_)
        | Signal::ThrustBy { .. } => "map its speed, pulse width or command under [channels]",
        Signal::AirForward | Signal::AirStarboard => {
            "map wind.true.speed and wind.true.direction, or those of wind.relative"
        }
    };
    Err(Error::MissingChannel {
        trial: record.trial.clone(),
        what: signal.to_string(),
        advice: advice.to_owned(),
    })
}

/// Checks that the scale of force is determined: without a known force, motion is the same if all
/// coefficients are doubled.
///
/// # Errors
/// [`Error::Plant`] if no force is known and no coefficient is held.
fn check_scale(structure: &Structure, records: &[&TrialRecord]) -> Result<(), Error> {
    let is_held = structure.terms().iter().any(|term| structure.held(term).is_some());
    let is_driven = |dof: &Dof| records.iter().any(|record| record.is_driven(*dof));
    if is_held || structure.axes().iter().any(is_driven) {
        return check_scale_across(structure, is_driven);
    }
    let has = |dof: Dof| structure.axes().contains(&dof);
    let first = Dof::ALL.into_iter().find(|dof| has(*dof)).unwrap_or(Dof::Surge);
    let reason = format!(
        "the scale of force is not determined: no thrust is known, and with every mass, drag and thrust twice as large the motion is the same; state a thrust curve, or the area_m2 and lift_slope of a fin, or hold one mass in [[plant]], such as hold = {{ \"mass.{first}\" = 260 }} for dry mass and what the water adds"
    );
    Err(Error::Plant { axes: structure.name(), reason })
}

/// Checks that the scale of sway and yaw is determined. The scale of surge reaches them through
/// m₁₁ur and m₁₁uv, unless the plant has terms of the same form.
///
/// # Errors
/// [`Error::Plant`] if the plant has both terms, and no force or coefficient of sway and yaw is
/// known.
fn check_scale_across(
    structure: &Structure,
    is_driven: impl Fn(&Dof) -> bool,
) -> Result<(), Error> {
    let is_free =
        |name: &str| structure.term_named(name).is_some_and(|term| structure.held(&term).is_none());
    let is_across = |dof: &Dof| matches!(dof, Dof::Sway | Dof::Yaw);
    let is_known = |term: &Basis| {
        structure.held(term).is_some() && structure.axes_of(term).iter().any(is_across)
    };
    let is_open = is_free("sway: ur") && is_free("yaw: uv");
    let is_determined = structure.axes().iter().any(|dof| is_across(dof) && is_driven(dof));
    if !is_open || is_determined || structure.terms().iter().any(is_known) {
        return Ok(());
    }
    let reason = "the scale of sway and yaw is not determined: with \"sway: ur\" and \"yaw: uv\" free, these axes move alike with every other number of theirs twice as large; leave one of the two out, or hold mass.sway in [[plant]]";
    Err(Error::Plant { axes: structure.name(), reason: reason.to_owned() })
}

/// Names in results of the difference between the actual and the stated position of a velocity
/// sensor.
const LEVERS: [&str; 3] = ["lever_x", "lever_y", "lever_z"];

/// Names in results of the rotation from its stated to its actual mounting.
const MISALIGNMENTS: [&str; 3] = ["misalignment_x", "misalignment_y", "misalignment_z"];

fn result(fit: &PlantFit, rigid_body: Option<&RigidBody>) -> PlantResult {
    let structure = fit.plant.structure();
    let named = structure.names().into_iter().enumerate().map(|(k, name)| (name, k));
    let parameters: BTreeMap<String, Coefficient> =
        named.clone().map(|(name, k)| (name, coefficient(fit, k))).collect();
    let not_told = parameters.iter().filter(|(_, x)| x.told_by == ToldBy::Nothing);
    let rigid = rigid_body.map(|body| on_axes(structure.axes(), &body.mass_matrix()));
    let mass = fit.plant.mass_matrix();
    PlantResult {
        symmetry: structure.symmetry(),
        effects: structure.effects().to_vec(),
        mass_matrix: matrix(fit, &mass, |i, j| Basis::Mass(i.min(j), i.max(j))),
        added_mass: rigid.as_ref().map(|rigid| rows(&(mass - rigid))),
        rigid_body_mass_matrix: rigid.as_ref().map(rows),
        linear_damping: matrix(fit, &fit.plant.linear_damping(), |on, of| {
            Basis::Product(on, Product::linear(of))
        }),
        quadratic_damping: matrix(fit, &fit.plant.quadratic_damping(), |on, of| {
            Basis::Product(on, Product::quadratic(of))
        }),
        correlation: correlation(fit),
        nuisances: nuisances(fit),
        identifiability: Some(Identifiability {
            coefficients: structure.terms().len(),
            rank: fit.rank,
            variance_inflation: named.map(|(name, k)| (name, fit.inflation[k])).collect(),
            not_told: not_told.map(|(name, _)| name.clone()).collect(),
        }),
        structure: fit.tried.iter().map(decision).collect(),
        thruster_faults: fit.faults.clone(),
        thrusters_exchanged: fit.exchanged.clone(),
        samples: fit.samples,
        log_likelihood: Some(fit.log_likelihood),
        by_axis: Parameters::by_axis(structure.axes(), &parameters),
        parameters,
        ..PlantResult::empty(structure.axes().to_vec(), fit.method)
    }
}

fn decision(tried: &Tried) -> TermDecision {
    let Tried { admitted, likelihood_ratio, p_value, .. } = *tried;
    let candidate = tried.name.clone();
    TermDecision {
        candidate,
        admitted,
        likelihood_ratio,
        p_value: Some(p_value),
        needed: None,
        size: None,
    }
}

fn coefficient(fit: &PlantFit, k: usize) -> Coefficient {
    coefficient_of(&fit.plant, k, fit.covariance[(k, k)].sqrt(), fit.samples as f64)
}

/// Returns a coefficient of a plant with its standard deviation.
fn coefficient_of(plant: &Plant, k: usize, std: f64, freedom: f64) -> Coefficient {
    let (term, value) = (plant.structure().terms()[k], plant.coefficients()[k]);
    let Estimate { low95, high95, .. } = Estimate::new(value, std, freedom);
    let is_own_damping = matches!(term, Basis::Product(on, product)
        if [Product::linear(on), Product::quadratic(on)].contains(&product));
    let is_positive = is_own_damping || matches!(term, Basis::Mass(i, j) if i == j);
    let is_of_fin = matches!(term, Basis::Effect(k)
        if plant.structure().effects()[k].is_positive());
    let (is_own_damping, is_positive) = (is_own_damping || is_of_fin, is_positive || is_of_fin);
    let told_by = if plant.structure().held(&term).is_some() {
        ToldBy::Stated
    } else if is_own_damping && value <= 0.0 {
        ToldBy::Limit
    } else if high95 - low95 > 2.0 * value.abs() && is_positive {
        ToldBy::Nothing
    } else {
        ToldBy::Data
    };
    Coefficient {
        value,
        std,
        low95: if is_positive { low95.max(0.0) } else { low95 },
        high95,
        unit: plant.structure().unit_of(&term),
        on: plant.structure().axes_of(&term),
        told_by,
    }
}

/// The largest standard deviation that results state.
const MOST_STD: f64 = 1e150;

fn on_axes(axes: &[Dof], six: &Matrix6<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(axes.len(), axes.len(), |i, j| six[(axes[i].index(), axes[j].index())])
}

fn rows(matrix: &DMatrix<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

fn matrix(fit: &PlantFit, value: &DMatrix<f64>, term: impl Fn(Dof, Dof) -> Basis) -> MatrixResult {
    let axes = fit.plant.axes();
    let std = DMatrix::from_fn(axes.len(), axes.len(), |i, j| {
        fit.std(&term(axes[i], axes[j])).unwrap_or(0.0).min(MOST_STD)
    });
    MatrixResult { value: rows(value), std: rows(&std) }
}

fn correlation(fit: &PlantFit) -> Correlation {
    let std = |k: usize| fit.covariance[(k, k)].sqrt();
    let p = fit.covariance.nrows();
    let value = DMatrix::from_fn(p, p, |i, j| {
        let both = std(i) * std(j);
        let is_known = both > 0.0 && both.is_finite();
        if is_known { fit.covariance[(i, j)] / both } else { f64::from(u8::from(i == j)) }
    });
    Correlation { names: fit.plant.structure().names(), value: rows(&value) }
}

fn nuisances(fit: &PlantFit) -> BTreeMap<String, Parameter> {
    let parameter = |(value, std): (f64, f64), unit: &str| {
        Parameter::new(Estimate::new(value, std, fit.samples as f64), unit)
    };
    let mut all = BTreeMap::new();
    let lag = if fit.has_thrusters { "lag" } else { "force_lag" };
    let actuator = fit.actuator;
    let Actuator { log_reverse_ratio, log_lag_ratio, log_falling_lag_ratio, .. } = actuator;
    let ratios = [log_reverse_ratio, log_lag_ratio, log_falling_lag_ratio];
    let [reverse, slowing, falling] = ratios.map(f64::exp);
    let Actuator { log_change_within, log_change_between, log_change_loaded, .. } = actuator;
    let changes = [log_change_within, log_change_between, log_change_loaded];
    let [within, between, loaded] = changes.map(f64::exp_m1);
    let scale = actuator.log_scale.exp();
    let numbers = [
        (lag, actuator.lag_s, 1.0, "s"),
        ("delay", actuator.delay_s, 1.0, "s"),
        ("reverse_ratio", reverse, reverse, "1"),
        ("lag_ratio", slowing, slowing, "1"),
        ("thrust_exponent", 2.0 + actuator.beyond_square, 1.0, "1"),
        ("slew", actuator.slew_s, 1.0, "s"),
        ("voltage_exponent", actuator.voltage_exponent, 1.0, "1"),
        ("dead_band", actuator.dead_band, 1.0, "1"),
        ("thrust_change_within", within, 1.0 + within, "1"),
        ("thrust_change_between", between, 1.0 + between, "1"),
        ("thrust_change_loaded", loaded, 1.0 + loaded, "1"),
        ("thrust_scale", scale, scale, "1"),
        ("falling_lag_ratio", falling, falling, "1"),
    ];
    for ((name, value, slope, unit), std) in numbers.into_iter().zip(fit.actuator_std) {
        if let Some(std) = std {
            all.insert(name.to_owned(), parameter((value, slope * std), unit));
        }
    }
    let needs_full_speed = ["thrust_exponent", "slew", "dead_band", "thrust_change_loaded"];
    let has_own_dead_band = fit.plant.structure().effects().iter().any(|effect| {
        matches!(effect.force, EffectForce::Own { number: ThrusterNumber::DeadBand, .. })
    });
    if has_own_dead_band || needs_full_speed.iter().any(|name| all.contains_key(*name)) {
        all.insert("full_speed".to_owned(), parameter((actuator.full_speed, 0.0), "rad/s"));
    }
    if all.contains_key("voltage_exponent") {
        let mean_v = actuator.ln_voltage[0].exp();
        all.insert("mean_voltage".to_owned(), parameter((mean_v, 0.0), "V"));
    }
    for (trial, [north, east]) in &fit.currents {
        all.insert(format!("current north: {trial}"), parameter(*north, "m/s"));
        all.insert(format!("current east: {trial}"), parameter(*east, "m/s"));
    }
    let late = [("translation_delay", fit.report.delay_s), ("translation_lag", fit.report.lag_s)];
    for ((name, value), std) in late.into_iter().zip(fit.report_std) {
        if let Some(std) = std {
            all.insert(name.to_owned(), parameter((value, std), "s"));
        }
    }
    let SteeringGear { delay_s, slew_s_rad } = fit.actuator.steering;
    let [delay_std, slew_std] = fit.steering_std;
    if let Some(std) = delay_std {
        all.insert("steering_delay".to_owned(), parameter((delay_s, std), "s"));
    }
    if let Some(std) = slew_std {
        let rate = (1.0 / slew_s_rad, std / slew_s_rad.powi(2));
        all.insert("steering_rate".to_owned(), parameter(rate, "rad/s"));
    }
    let place = [
        (LEVERS, fit.report.lever_m, fit.lever_std, "m"),
        (MISALIGNMENTS, fit.report.misalignment_rad, fit.misalignment_std, "rad"),
    ];
    for (names, values, stds, unit) in place {
        for ((name, value), std) in names.into_iter().zip(values).zip(stds) {
            if let Some(std) = std {
                all.insert(name.to_owned(), parameter((value, std), unit));
            }
        }
    }
    if let Some(drift) = fit.current_drift {
        all.insert("current_drift".to_owned(), parameter(drift.std_m_s, "m/s"));
        all.insert("current_drift_correlation".to_owned(), parameter(drift.correlation_s, "s"));
    }
    if let Some(jitter) = fit.thrust_jitter_s {
        all.insert("thrust_jitter".to_owned(), parameter(jitter, "s"));
    }
    if let Some(swell) = &fit.swell {
        for (dof, force) in &swell.force {
            all.insert(format!("swell: {dof}"), parameter(*force, dof.units().force));
        }
        all.insert("swell_period".to_owned(), parameter(swell.period_s, "s"));
        all.insert("swell_damping".to_owned(), parameter(swell.damping, "1"));
    }
    if let Some(noise) = fit.attitude_noise {
        all.insert("attitude noise".to_owned(), parameter(noise, "rad"));
    }
    for (name, unit) in INSTRUMENTS {
        if let Some(noise) = fit.instruments.get(name) {
            all.insert(name.to_owned(), parameter(*noise, unit));
        }
    }
    for (dof, noise) in &fit.disturbances {
        let units = dof.units();
        let is_free = fit.method == Method::OutputError;
        if !is_free {
            all.insert(format!("disturbance: {dof}"), parameter(noise.disturbance, units.force));
            let correlation = parameter(noise.correlation_s, "s");
            all.insert(format!("disturbance correlation: {dof}"), correlation);
        }
        // None of an axis whose velocity is not measured.
        if noise.velocity.1.is_finite() {
            let name = if is_free { "misfit" } else { "velocity noise" };
            all.insert(format!("{name}: {dof}"), parameter(noise.velocity, units.velocity));
        }
    }
    all
}
