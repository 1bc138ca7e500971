//! The filter error method on one axis: which candidates its model gets, and the fit that comes of it.

mod beside;
mod elimination;
mod left_out;
mod lever;
mod report;
mod sensor;
mod spikes;

use std::collections::BTreeMap;

use nalgebra::DVector;

use super::actuator::Actuator;
use super::descent::Tolerance;
use super::equation_error::Solved;
use super::filter::Noise;
use super::problem::{Point, Problem, is_measured_over_ground};
use super::schedule::Attitude;
use super::search::{ADMITTED, CLEAR_GAIN, widened, with_all};
use super::start::{FirstPlant, LEAST_LAG_S, begun_beside};
use super::{Fitted, SMOOTH, Tried};
use crate::estimate::axis_plant::axis_structure;
use crate::estimate::candidate::{Candidate, Decision};
use crate::estimate::inputs::Inputs;
use crate::estimate::{DelayedFit, EquationError, Fit, Method, OutputError, Records};
use crate::plant::{
    Basis, Effect, EffectForce, Parameterisation, Plant, Product, Pusher, Structure,
};
use crate::signal::rms;
use crate::terms::Term;
use crate::{AxisRecord, Dof, Error, PhysicalParameters, Terms, ThrusterTrack, Timed, TrialRecord};
pub(in crate::estimate) use beside::Exchanged;
use elimination::replace;
pub(in crate::estimate) use lever::Lever;
use lever::Levered;
use report::condition;
use sensor::Sensor;
use spikes::{without_spikes, without_wild_samples};

/// A fit of one axis that is asked for.
#[derive(Clone, Copy)]
pub(in crate::estimate) struct OneAxis<'a> {
    pub(in crate::estimate) dof: Dof,
    pub(in crate::estimate) axes: &'a [AxisRecord],
    /// What is in the model where the trials ask for it.
    pub(in crate::estimate) candidates: &'a [Candidate],
    /// What is in the model whatever they say.
    pub(in crate::estimate) required: &'a [Candidate],
    /// The terms of the plant, unless the trials decide.
    pub(in crate::estimate) terms: Option<Terms>,
    /// A fit of the same trials with other terms, from whose optimum this one starts.
    pub(in crate::estimate) from: Option<&'a FilterStart>,
}

/// The optimum of a fit, from which fits of the same trials with other terms start.
#[derive(Clone, Debug, PartialEq)]
pub struct FilterStart {
    /// Coefficients by the names of their terms.
    coefficients: BTreeMap<String, f64>,
    actuator: Actuator,
    /// By trial, m/s.
    currents: BTreeMap<String, [f64; 2]>,
    noise: Noise,
    sensor: Option<Sensor>,
    /// Lever arm of the sensor that is taken out of its velocities, m.
    pub(in crate::estimate) lever_m: [f64; 2],
}

/// An optimum of one axis, with the records that it is fitted to.
pub(in crate::estimate) struct FittedAxis {
    fitted: Fitted,
    /// How many samples were left out as spikes.
    pub(in crate::estimate) spikes: usize,
    /// A lever arm of the sensor that is taken out of its velocities.
    pub(in crate::estimate) lever: Option<Lever>,
}

/// A disturbance below this part of the thrust is none that a current could stand behind.
const SLIGHT_DISTURBANCE: f64 = 0.005;

/// Fewer samples than this are few beside what may be fitted.
const FEW_SAMPLES: usize = 2000;

/// Slew time from which a fit begins that requires one, s.
const FIRST_SLEW_S: f64 = 0.3;

/// Dead band from which a fit begins that requires one.
const FIRST_DEAD_BAND: f64 = 0.03;

/// The candidate that each number of the actuator is.
const NUMBERS: [(Candidate, usize); 11] = [
    (Candidate::Lag, Actuator::LAG),
    (Candidate::Delay, Actuator::DELAY),
    (Candidate::ReverseRatio, Actuator::REVERSE),
    (Candidate::LagRatio, Actuator::LAG_RATIO),
    (Candidate::FallingLagRatio, Actuator::FALLING_LAG_RATIO),
    (Candidate::Exponent, Actuator::EXPONENT),
    (Candidate::Slew, Actuator::SLEW),
    (Candidate::Voltage, Actuator::VOLTAGE),
    (Candidate::DeadBand, Actuator::DEAD_BAND),
    (Candidate::ThrustChangeWithin, Actuator::CHANGE_WITHIN),
    (Candidate::ThrustChangeBetween, Actuator::CHANGE_BETWEEN),
];

/// No sensor shows a velocity more precisely than to this part of the usual speed, and no model predicts it:
/// what is smoother was smoothed by whoever logged it, and says nothing of the plant.
const VELOCITY_PRECISION: f64 = 1e-3;

/// Numbers of the actuator that are tried by their scores beside the others: they imitate these, or are rare.
const LATER: [usize; 5] = [
    Actuator::LAG_RATIO,
    Actuator::FALLING_LAG_RATIO,
    Actuator::EXPONENT,
    Actuator::CHANGE_WITHIN,
    Actuator::CHANGE_BETWEEN,
];

/// The force that turning makes, per unit of what it does to a rigid body: that of a propeller of unknown strength.
fn turning() -> Effect {
    let propeller = Candidate::Turning.name().to_owned();
    let (position_m, direction) = ([0.0; 3], [1.0, 0.0, 0.0]);
    let force = EffectForce::Thrust { propeller, position_m, direction };
    Effect { name: Candidate::Turning.name().to_owned(), force }
}

/// True of a term that is thrust lost to inflow.
fn is_inflow(structure: &Structure, term: &Basis) -> bool {
    let name = structure.name_of(term);
    [Candidate::Inflow, Candidate::InflowAhead].iter().any(|inflow| inflow.name() == name)
}

/// The axis of the plant that a fit works on.
fn axis_of(dof: Dof) -> Dof {
    AxisRecord::stand_in(dof)
}

impl OneAxis<'_> {
    /// Fits the plant and what the trials show beside it.
    ///
    /// # Errors
    /// As [`super::fit_plant`].
    pub(in crate::estimate) fn fit(&self) -> Result<(Fit, FittedAxis), Error> {
        let records: Vec<TrialRecord> =
            self.axes.iter().map(AxisRecord::as_trial).collect::<Result<_, Error>>()?;
        let (records, mut spikes) = without_wild_samples(records)?;
        let references: Vec<&TrialRecord> = records.iter().collect();
        if let Some(from) = self.from {
            let fitted = self.continued(from, &references)?;
            return self.finished(fitted, from.sensor, Vec::new(), None);
        }
        let (start, least_squares, fitted) = self.begun(&references)?;
        let (records, fewer) = without_spikes(&fitted, &references)?;
        spikes += fewer;
        let references: Vec<&TrialRecord> = records.iter().collect();
        let fitted = match fewer {
            0 => fitted,
            _ => {
                let problem = fitted.problem.of(&references);
                let from = fitted.optimum.point.clone();
                let optimum = problem.descent(from, Tolerance::COARSE)?;
                fitted.moved_to(problem, optimum)
            }
        };
        let mut decisions = Vec::new();
        let fitted = self.with_smooth_thrust_that_shows(fitted, &mut decisions)?;
        let fitted = fitted.with_speeds_as_they_are(&references)?;
        let measured = records;
        let needed = self.lever_bar(&fitted);
        let first = self.with_lever_that_shows(&fitted, &measured, None);
        let mut ratio = first.as_ref().map_or(0.0, |found| found.ratio);
        let (fitted, mut lever, mut records) = match first {
            Some(Levered { fitted, lever, records, .. }) => (fitted, Some(lever), records),
            None => (fitted, None, measured.clone()),
        };
        let references: Vec<&TrialRecord> = records.iter().collect();
        let fitted = self.eliminated(fitted, &mut decisions);
        let fitted = self.or_from_few(fitted, &references, &mut decisions);
        let mut fitted = self.with_all_that_shows(fitted, &references, &mut decisions)?;
        // Waves beside it may have been taken for a part of it.
        if let Some(again) = self.with_lever_that_shows(&fitted, &measured, lever) {
            ratio += again.ratio;
            (lever, records) = (Some(again.lever), again.records);
            fitted = self.eliminated(again.fitted, &mut decisions);
        }
        if self.may_have(Candidate::Lever) {
            decisions.push(decision(Candidate::Lever, ratio, needed, lever.is_some()));
        }
        let references: Vec<&TrialRecord> = records.iter().collect();
        let (fitted, sensor) = self.with_sensor_lag_that_shows(fitted, &references);
        let fitted = match sensor {
            Some(_) => {
                let fitted = self.eliminated(fitted, &mut decisions);
                self.with_all_that_shows(fitted, &references, &mut decisions)?
            }
            None => fitted,
        };
        let begun = Some((start, &least_squares));
        let (mut fit, mut fitted) = self.finished(fitted.refined()?, sensor, decisions, begun)?;
        (fitted.spikes, fitted.lever) = (spikes, lever);
        if let (Some(start), Some(lever)) = (&mut fit.start, lever) {
            start.lever_m = lever.value;
        }
        Ok((fit, fitted))
    }

    /// The same, or of few samples the likelier fit that begins with lag, delay and the terms alone: many faults at
    /// once explain few samples in several ways, and what is left of them need not be the likeliest.
    fn or_from_few(
        &self,
        fitted: Fitted,
        records: &[&TrialRecord],
        decisions: &mut Vec<Decision>,
    ) -> Fitted {
        if fitted.problem.samples() > FEW_SAMPLES {
            return fitted;
        }
        let is_usual =
            |own: &&Candidate| own.is_term() || matches!(own, Candidate::Lag | Candidate::Delay);
        let candidates: Vec<Candidate> = self.candidates.iter().filter(is_usual).copied().collect();
        let few = OneAxis { candidates: &candidates, ..*self };
        let Ok((_, _, other)) = few.begun(records) else { return fitted };
        let mut of_few = Vec::new();
        let other = few.eliminated(other, &mut of_few);
        or_likelier(fitted, decisions, (other, of_few))
    }

    /// The same with what is tried beside what a fit begins with.
    fn with_all_that_shows(
        &self,
        fitted: Fitted,
        records: &[&TrialRecord],
        decisions: &mut Vec<Decision>,
    ) -> Result<Fitted, Error> {
        let mut fitted = fitted;
        let before = fitted.optimum.cost;
        let has = |fitted: &Fitted| {
            let noise = &fitted.optimum.point.noise;
            [noise.swell.is_some(), noise.drift.is_some()]
        };
        let has_before = has(&fitted);
        if self.may_have(Candidate::Slew) {
            fitted = fitted.with_slew_that_shows()?;
        }
        if self.may_have(Candidate::ThrustJitter) {
            fitted = fitted.with_jitter_that_shows()?;
        }
        fitted = self.with_later_numbers(fitted);
        if self.may_have(Candidate::DeadBand) {
            fitted = fitted.with_dead_band_that_shows()?;
        }
        fitted = fitted.with_speeds_as_they_are(records)?.searched(records)?;
        let tried = std::mem::take(&mut fitted.tried);
        let pushed = fitted.optimum.point.noise.disturbance[0] / force_rms(self.axes);
        if self.may_have(Candidate::CurrentDrift) && pushed > SLIGHT_DISTURBANCE {
            fitted = self.with_drift_that_shows(fitted, records)?;
        }
        if self.may_have(Candidate::Swell) {
            fitted = self.with_swell_that_shows(fitted, records, decisions)?;
        }
        if fitted.optimum.cost != before {
            fitted = self.eliminated(fitted, decisions);
        }
        if has(&fitted) != has_before {
            fitted = self.or_with_all_again(fitted, records, decisions);
        }
        fitted = self.with_left_out_again(fitted, records, decisions);
        fitted = self.with_turning_again(fitted, decisions);
        Ok(Fitted { tried, ..fitted })
    }

    /// The same with waves, if the trials show them.
    ///
    /// Terms that waves had hidden may colour innovations as much as these did, so that waves are also accepted
    /// together with such terms.
    fn with_swell_that_shows(
        &self,
        fitted: Fitted,
        records: &[&TrialRecord],
        decisions: &mut Vec<Decision>,
    ) -> Result<Fitted, Error> {
        let Some(found) = fitted.with_swell()? else { return Ok(fitted) };
        if found.explains_colour_of(&fitted)? {
            return Ok(found);
        }
        let mut again = decisions.clone();
        let found = self.or_with_all_again(found, records, &mut again);
        if !found.explains_colour_of(&fitted)? {
            return Ok(fitted);
        }
        *decisions = again;
        Ok(found)
    }

    /// The same, or the likelier fit after a second elimination that begins with all terms and numbers again.
    ///
    /// The first one ran while the disturbance stood for waves or for a current that varies, and both hide
    /// small terms.
    fn or_with_all_again(
        &self,
        fitted: Fitted,
        records: &[&TrialRecord],
        decisions: &mut Vec<Decision>,
    ) -> Fitted {
        let Ok(wider) = self.with_all_again(&fitted, records) else { return fitted };
        let mut again = Vec::new();
        let other = self.eliminated(wider, &mut again);
        let Ok(other) = other.searched(records) else { return fitted };
        let other = self.eliminated(other, &mut again);
        or_likelier(fitted, decisions, (other, again))
    }

    /// The optimum with all terms and numbers that a fit begins with beside those of a fit.
    ///
    /// # Errors
    /// [`Error::Plant`] if the fit does not settle.
    fn with_all_again(&self, fitted: &Fitted, records: &[&TrialRecord]) -> Result<Fitted, Error> {
        let (problem, point) = self.with_all(fitted, records)?;
        let optimum = problem.descent(point, Tolerance::COARSE)?;
        Ok(fitted.moved_to(problem, optimum))
    }

    /// The problem with all terms and numbers that a fit begins with beside those of a fit, and a point of it.
    fn with_all(
        &self,
        fitted: &Fitted,
        records: &[&TrialRecord],
    ) -> Result<(Problem, Point), Error> {
        let (old, optimum) = fitted.parts();
        let first = self.structure()?;
        let is_missing = |term: &&Basis| old.structure.index_of(term).is_none();
        let missing: Vec<Basis> = first.terms().iter().filter(is_missing).copied().collect();
        let mut problem = old.with_terms(with_all(&old.structure, &missing)?);
        problem.has_current = is_measured_over_ground(axis_of(self.dof), records);
        problem.fits = problem.can_show;
        problem = self.limited(problem);
        let mut point = widened(&problem, old, &optimum.point);
        for (fits, fitted) in problem.fits.iter_mut().zip(old.fits) {
            *fits |= fitted;
        }
        if problem.fits[Actuator::LAG] {
            point.actuator.lag_s = point.actuator.lag_s.max(LEAST_LAG_S);
        }
        Ok((problem, point))
    }

    /// The same with a current that varies, if the trials show that. Its mean may have been left out before, and
    /// the disturbance taken for the rest of it.
    fn with_drift_that_shows(
        &self,
        fitted: Fitted,
        records: &[&TrialRecord],
    ) -> Result<Fitted, Error> {
        let is_over_ground = is_measured_over_ground(axis_of(self.dof), records);
        if fitted.problem.has_current || !is_over_ground {
            return fitted.with_drift_that_shows();
        }
        let mut with_mean = fitted.clone();
        with_mean.problem.has_current = true;
        let found = with_mean.with_drift_that_shows()?;
        let means = found.optimum.point.currents.len() as f64;
        let needed = ADMITTED + means * (found.problem.samples() as f64).ln();
        let gain = 2.0 * (fitted.optimum.cost - found.optimum.cost);
        let is_shown = found.optimum.point.noise.drift.is_some() && gain > needed;
        let along = found.optimum.point.currents.iter().map(|[along, _]| *along);
        let follow_speed = self.follow_speed(&along.collect::<Vec<_>>());
        Ok(if is_shown && !follow_speed { found } else { fitted })
    }

    /// Fits from the optimum of a fit with other terms.
    fn continued(&self, from: &FilterStart, records: &[&TrialRecord]) -> Result<Fitted, Error> {
        let structure = self.structure()?;
        let problem = Problem::new(&structure, records, None, false, Attitude::Known);
        let mut problem = self.limited(problem);
        if let Some(Sensor { lag, .. }) = from.sensor {
            problem = problem.with_sensor_lag(records, lag);
        }
        let axis = axis_of(self.dof);
        let known = |term: &Basis| from.coefficients.get(&structure.name_of(term)).copied();
        let [linear, quadratic] = [Product::linear(axis), Product::quadratic(axis)];
        let speed = usual_speed(self.axes);
        let drag = |product: Product| known(&Basis::Product(axis, product)).unwrap_or(0.0);
        let coefficient = |term: &Basis| match term {
            // One drag stands for the other where that is not fitted.
            Basis::Product(_, product) if *product == linear && known(term).is_none() => {
                LEAST_DRAG_PART * drag(quadratic) * speed
            }
            Basis::Product(_, product) if *product == quadratic && known(term).is_none() => {
                drag(linear) / speed
            }
            _ => known(term).unwrap_or(0.0),
        };
        let coefficients: Vec<f64> = structure.terms().iter().map(coefficient).collect();
        let current = |trial: &String| from.currents.get(trial).copied().unwrap_or_default();
        let currents = problem.trials.iter().map(current);
        let numbers = from.actuator.numbers();
        let numbers = std::array::from_fn(|k| if problem.fits[k] { numbers[k] } else { 0.0 });
        let point = Point {
            free: problem.physical.free(&DVector::from(coefficients)),
            actuator: Actuator {
                between: problem.first_actuator.between,
                ..from.actuator.with(numbers)
            },
            currents: match problem.has_current {
                true => currents.collect(),
                false => vec![[0.0; 2]; problem.trials.len()],
            },
            noise: from.noise.clone(),
            jitter_of: from.actuator,
        };
        // Other terms are compared beside the same noise.
        let optimum = problem.descent_at_noise(point, Tolerance::ROUGH)?;
        Fitted::new(problem, optimum).with_speeds_as_they_are(records)
    }

    /// What comes of an optimum.
    fn finished(
        &self,
        fitted: Fitted,
        sensor: Option<Sensor>,
        mut decisions: Vec<Decision>,
        begun: Option<(Plant, &Solved)>,
    ) -> Result<(Fit, FittedAxis), Error> {
        let innovations = self.innovations(&fitted)?;
        let (problem, optimum) = fitted.parts();
        let terms = problem.structure.terms().len();
        let told = Solved {
            coefficients: DVector::zeros(terms),
            residual: Vec::new(),
            rank: terms,
            terms,
        };
        let plant = problem.plant(&optimum.point.free)?;
        let (start, least_squares) = begun.unwrap_or((plant, &told));
        let condition = condition(&optimum.information);
        let found = fitted.clone().finished(start, least_squares, Method::FilterError)?;
        self.decide_others(&found, problem, sensor, &mut decisions);
        let mut fit = self.reported(&found, problem, &decisions, innovations)?;
        fit.condition = condition;
        if let Some(sensor) = sensor {
            sensor.report(&mut fit);
        }
        let currents = problem.trials.iter().cloned().zip(optimum.point.currents.iter().copied());
        let names = problem.structure.names().into_iter();
        let coefficients = problem.physical.coefficients(&optimum.point.free);
        fit.start = Some(FilterStart {
            coefficients: names.zip(coefficients.iter().copied()).collect(),
            actuator: optimum.point.actuator,
            currents: currents.collect(),
            noise: optimum.point.noise.clone(),
            sensor,
            lever_m: self.from.map_or([0.0; 2], |from| from.lever_m),
        });
        Ok((fit, FittedAxis { fitted, spikes: 0, lever: None }))
    }

    /// Finds the first optimum; where inflow leaves it undetermined, without that.
    fn begun(&self, records: &[&TrialRecord]) -> Result<(Plant, Solved, Fitted), Error> {
        let structure = self.structure()?;
        let first = self.first_plants()?;
        let of = |structure: &Structure| {
            let problem = Problem::new(structure, records, None, false, Attitude::Known);
            let others = first.iter().map(|first| self.first_plant(structure, first));
            begun_beside(self.limited(problem), records, &others.collect::<Vec<_>>())
        };
        let is_inflow = |term: &Basis| is_inflow(&structure, term);
        match of(&structure) {
            Err(_) if structure.terms().iter().any(is_inflow) => of(&structure.without(is_inflow)),
            found => found,
        }
    }

    /// The plant by equation error with thrust as late as suits it best, or of acceleration alone by a first look.
    fn by_equation_error(&self) -> Result<DelayedFit, Error> {
        let delays = (0..=MOST_FIRST_DELAYS).map(|tenth| 0.1 * f64::from(tenth));
        EquationError::default().fit_best_delay(self.axes, delays)
    }

    /// Plants to begin with: that of equation error, and those of output error with and without linear drag
    /// where they are others.
    fn first_plants(&self) -> Result<Vec<DelayedFit>, Error> {
        let first = self.by_equation_error()?;
        let timely: Vec<AxisRecord> =
            self.axes.iter().map(|axis| axis.delayed(first.delay_s)).collect();
        let quadratic = [Term::Force, Term::Quadratic, Term::Bias];
        let mut all = vec![first.clone()];
        for terms in [&quadratic[..], &Term::ALL] {
            let records = Records::from(&timely).with_terms(Terms::new(terms)?);
            let Ok(fit) = OutputError::default().fit_from(records, &first.fit.lumped) else {
                continue;
            };
            let differs = |other: &DelayedFit| {
                let [own, other] = [&fit, &other.fit].map(|fit| fit.physical());
                let drag = |plant: &PhysicalParameters| {
                    let speed = usual_speed(self.axes);
                    (plant.d_quadratic * speed + plant.d_linear) * speed
                };
                let part = |a: f64, b: f64| (a - b).abs() > ANOTHER_PLANT * b.abs();
                part(own.mass, other.mass) || part(drag(&own), drag(&other))
            };
            if all.iter().all(differs) {
                all.push(DelayedFit { fit, ..first });
            }
        }
        all.retain(|first| first.fit.lumped.alpha > 0.0);
        Ok(all)
    }

    fn first_plant(&self, structure: &Structure, first: &DelayedFit) -> FirstPlant {
        let axis = axis_of(self.dof);
        let plant = first.fit.physical();
        let coefficient = |term: &Basis| match term {
            Basis::Mass(..) => plant.mass,
            Basis::Product(_, product) if *product == Product::linear(axis) => plant.d_linear,
            Basis::Product(..) => plant.d_quadratic,
            Basis::One(_) => plant.bias_force,
            // Turning does to the vehicle what it does to a rigid body, about.
            _ if structure.name_of(term) == Candidate::Turning.name() => plant.mass,
            _ => 0.0,
        };
        let terms = structure.terms().len();
        let found = Solved {
            coefficients: DVector::from_iterator(terms, structure.terms().iter().map(coefficient)),
            residual: vec![first.fit.residual_rms * plant.mass],
            rank: terms,
            terms,
        };
        FirstPlant { found, late_s: first.delay_s }
    }

    /// The same with the numbers of the actuator that are tried later, if their scores ask for them.
    fn with_later_numbers(&self, fitted: Fitted) -> Fitted {
        let (problem, optimum) = fitted.parts();
        let mut wider = problem.clone();
        let shown = self.shown();
        for k in LATER {
            let has_lag = !Actuator::LAG_RATIOS.contains(&k) || problem.fits[Actuator::LAG];
            if !shown[k] || problem.fits[k] || !has_lag {
                continue;
            }
            let mut tried = problem.clone();
            tried.fits[k] = true;
            wider.fits[k] = tried.score(&optimum.point, k).is_some_and(|score| score > ADMITTED);
        }
        let wider = (wider.fits != problem.fits).then(|| (wider, optimum.point.clone()));
        let rival = self.with_exponent_for_inflow(&fitted, shown[Actuator::EXPONENT]);
        let settled = |(problem, point): (Problem, Point)| {
            let found = problem.descent_at_noise(point, Tolerance::COARSE).ok()?;
            Some((problem, found))
        };
        let two_lags = Actuator::LAG_RATIOS
            .into_iter()
            .filter_map(|ratio| with_two_lags_for_delay(&fitted, &shown, ratio).and_then(settled));
        // They are more numbers than a delay.
        let two_lags = two_lags.filter(|(_, found)| 2.0 * (optimum.cost - found.cost) > ADMITTED);
        let all = wider.into_iter().chain(rival).filter_map(settled).chain(two_lags);
        match all.min_by(|a, b| a.1.cost.total_cmp(&b.1.cost)) {
            Some((problem, found)) if found.cost < optimum.cost => fitted.moved_to(problem, found),
            _ => fitted,
        }
    }

    /// The problem with another exponent of thrust in the place of inflow, which imitates it.
    fn with_exponent_for_inflow(
        &self,
        fitted: &Fitted,
        is_shown: bool,
    ) -> Option<(Problem, Point)> {
        let (problem, optimum) = fitted.parts();
        let is_inflow = |term: &Basis| is_inflow(&problem.structure, term);
        let has_inflow = problem.structure.terms().iter().any(is_inflow);
        if !has_inflow || !is_shown || problem.fits[Actuator::EXPONENT] {
            return None;
        }
        let mut other = problem.with_terms(problem.structure.without(is_inflow));
        other.fits[Actuator::EXPONENT] = true;
        let point = widened(&other, problem, &optimum.point);
        Some((other, point))
    }

    /// Numbers of the actuator that the inputs can show.
    fn shown(&self) -> [bool; Actuator::COUNT] {
        let tracks: Vec<ThrusterTrack> = self.axes.iter().flat_map(AxisRecord::tracks).collect();
        let inputs = Inputs::new(&tracks);
        let mut shown = [false; Actuator::COUNT];
        for (candidate, k) in NUMBERS {
            let is_shown = match candidate {
                Candidate::Exponent => inputs.show_exponent(),
                Candidate::ReverseRatio => inputs.show_reverse_ratio(),
                Candidate::LagRatio | Candidate::FallingLagRatio => inputs.show_lag_ratio(),
                Candidate::Voltage => inputs.show_voltage(),
                Candidate::Slew | Candidate::DeadBand => false,
                _ => true,
            };
            shown[k] = is_shown && self.may_have(candidate);
        }
        shown
    }

    pub(in crate::estimate) fn may_have(&self, candidate: Candidate) -> bool {
        self.candidates.contains(&candidate) || self.required.contains(&candidate)
    }

    /// Returns the number of candidates that are tried; a dead band replaces an exponent, and is no further chance.
    fn tried(&self) -> f64 {
        let others = self.candidates.iter().filter(|own| **own != Candidate::DeadBand);
        others.count().max(1) as f64
    }

    /// The plant without what is only tried.
    fn structure(&self) -> Result<Structure, Error> {
        let has = |term: &Term| match (self.terms, term) {
            (Some(terms), _) => terms.has(*term),
            (None, Term::Force | Term::Quadratic) => true,
            (None, Term::Linear) => self.may_have(Candidate::LinearDrag),
            (None, Term::Bias) => self.may_have(Candidate::Bias),
        };
        let terms: Vec<Term> = Term::ALL.into_iter().filter(has).collect();
        let structure = axis_structure(axis_of(self.dof), Terms::new(&terms)?)?;
        let inflows = [(Candidate::Inflow, false), (Candidate::InflowAhead, true)];
        let pushers = self.pushers();
        let wanted = inflows.into_iter().filter(|(candidate, _)| self.may_have(*candidate));
        let wanted = wanted.filter(|_| !pushers.is_empty());
        let structure =
            wanted.into_iter().try_fold(structure, |structure, (candidate, ahead)| {
                let thrusters = pushers.clone();
                let force = EffectForce::Inflow { thrusters, ahead };
                let effect = Effect { name: candidate.name().to_owned(), force };
                // Inflow is fitted from the start, as other faults hide it; its rival is tried.
                structure.with_effect(effect, !ahead || self.required.contains(&candidate))
            })?;
        let structure = match self.may_have(Candidate::Turning) {
            true => structure.with_effect(turning(), true)?,
            false => structure,
        };
        Ok(structure.trying(Vec::new()))
    }

    /// The thrusters as inflow sees them; none where there are more than an effect may read.
    fn pushers(&self) -> Vec<Pusher> {
        let tracks = self.axes.first().map(AxisRecord::tracks).unwrap_or_default();
        if tracks.len() > MOST_PUSHERS {
            return Vec::new();
        }
        let pusher = |(k, track): (usize, &ThrusterTrack)| {
            let name = (k + 1).to_string();
            match self.dof.is_rotation() {
                true => {
                    Pusher { name, position_m: [track.lever, 0.0, 0.0], direction: [0.0, 1.0, 0.0] }
                }
                false => Pusher { name, position_m: [0.0; 3], direction: [track.lever, 0.0, 0.0] },
            }
        };
        tracks.iter().enumerate().map(pusher).collect()
    }

    /// A problem with what may be fitted, and no more.
    fn limited(&self, mut problem: Problem) -> Problem {
        let shown = self.shown();
        // Thrusters that push ahead and astern in proportion differ by chance, and by that tell the ratio of both.
        problem.fits[Actuator::REVERSE] = true;
        problem.fits = std::array::from_fn(|k| problem.fits[k] && shown[k]);
        LATER.into_iter().for_each(|k| problem.fits[k] = false);
        for (candidate, k) in NUMBERS {
            problem.requires[k] = self.required.contains(&candidate);
            problem.fits[k] |= problem.requires[k];
        }
        let least = VELOCITY_PRECISION * usual_speed(self.axes);
        problem.sample_noise.iter_mut().for_each(|std| *std = std.max(least));
        problem.lag_std_s = lag_std_s(self.axes);
        if !problem.fits[Actuator::LAG] {
            problem.first_actuator.lag_s = 0.0;
        }
        if problem.requires[Actuator::SLEW] {
            problem.first_actuator.slew_s = FIRST_SLEW_S;
        }
        if problem.requires[Actuator::DEAD_BAND] {
            problem.first_actuator.dead_band = FIRST_DEAD_BAND;
        }
        problem.first_actuator.between = Candidate::between_samples(self.required.iter().copied());
        problem.has_current &=
            self.may_have(Candidate::Current) || self.may_have(Candidate::CurrentDrift);
        problem
    }

    /// The same with thrust that moves smoothly between its samples, if that is clearly likelier.
    fn with_smooth_thrust_that_shows(
        &self,
        fitted: Fitted,
        decisions: &mut Vec<Decision>,
    ) -> Result<Fitted, Error> {
        let laws: Vec<Candidate> =
            SMOOTH.into_iter().filter(|law| self.candidates.contains(law)).collect();
        let fitted = fitted.with_smooth_thrust_that_shows(&laws)?;
        let named = |tried: &Tried| laws.iter().find(|law| law.name() == tried.name);
        decisions.extend(fitted.smooth.iter().filter_map(|tried| {
            Some(decision(*named(tried)?, tried.likelihood_ratio, CLEAR_GAIN, tried.admitted))
        }));
        Ok(fitted)
    }
}

/// Returns a fit, or another one with its decisions if that is likelier by the Bayesian information criterion.
fn or_likelier(
    fitted: Fitted,
    decisions: &mut Vec<Decision>,
    (other, of_other): (Fitted, Vec<Decision>),
) -> Fitted {
    if criterion(&other) >= criterion(&fitted) {
        return fitted;
    }
    replace(decisions, of_other);
    other
}

/// Twice the cost, and what each number of the model has to bring.
fn criterion(fitted: &Fitted) -> f64 {
    let (problem, optimum) = fitted.parts();
    let numbers = problem.fits.iter().filter(|fits| **fits).count();
    let currents = if problem.has_current { problem.trials.len() } else { 0 };
    let count = numbers + currents + problem.structure.terms().len();
    2.0 * optimum.cost + count as f64 * (problem.samples() as f64).ln()
}

/// The problem with a lag that differs by a ratio of lags in the place of a delay, which two of them resemble.
fn with_two_lags_for_delay(
    fitted: &Fitted,
    shown: &[bool; Actuator::COUNT],
    ratio: usize,
) -> Option<(Problem, Point)> {
    let (problem, optimum) = fitted.parts();
    let is_delay_alone = problem.fits[Actuator::DELAY] && !problem.fits[Actuator::LAG];
    let mut point = optimum.point.clone();
    let mut numbers = point.actuator.numbers();
    let late_s = numbers[Actuator::DELAY];
    let may_lag = shown[Actuator::LAG] && shown[ratio];
    if !is_delay_alone || !may_lag || late_s < LEAST_LAG_S || problem.requires[Actuator::DELAY] {
        return None;
    }
    let mut other = problem.clone();
    (other.fits[Actuator::LAG], other.fits[ratio]) = (true, true);
    (numbers[Actuator::LAG], numbers[Actuator::DELAY]) = (late_s, 0.0);
    point.actuator = point.actuator.with(numbers);
    Some((other, point))
}

/// Delays that a first look tries: tenths of a second up to one.
const MOST_FIRST_DELAYS: u32 = 10;

/// Plants whose masses or drags differ by more than this part are different ones to begin with.
const ANOTHER_PLANT: f64 = 0.1;

/// Part of quadratic drag at the usual speed from which linear drag starts where it was not fitted.
const LEAST_DRAG_PART: f64 = 0.1;

/// Signals that an effect may read.
const MOST_PUSHERS: usize = 16;

const fn decision(candidate: Candidate, ratio: f64, needed: f64, admitted: bool) -> Decision {
    Decision { candidate, likelihood_ratio: ratio.max(0.0), needed, size: None, admitted }
}

/// Root mean square of measured velocities.
fn usual_speed(axes: &[AxisRecord]) -> f64 {
    let velocities: Vec<Timed> = axes.iter().filter_map(|axis| axis.velocity().ok()).collect();
    rms(velocities.iter().flat_map(|velocity| velocity.values().iter().copied()))
}

/// Root mean square of logged force.
pub(in crate::estimate) fn force_rms(axes: &[AxisRecord]) -> f64 {
    rms(axes.iter().flat_map(|axis| axis.force.values().iter().copied()))
}

/// The lag of propellers that nothing is known of, s.
const UNKNOWN_LAG_S: f64 = 0.3;

/// How slow propellers may be, s: 0.15 s at 50 N.
///
/// Tip speeds are alike, so that thrust grows as the square of a propeller's size and the time of a turn as
/// the size itself; it takes some turns to bring the water along. Acceleration shows a lag in every step of
/// thrust: there the size of the propeller, of which a log of force says nothing, need not.
fn lag_std_s(axes: &[AxisRecord]) -> f64 {
    let strongest = axes.iter().flat_map(AxisRecord::tracks).fold(0.0_f64, |most, track| {
        let fastest = track.speed.values().iter().fold(0.0_f64, |max, n| max.max(n.abs()));
        most.max(track.forward.max(track.reverse) * fastest * fastest)
    });
    match axes.iter().all(AxisRecord::knows_velocity) || strongest > 0.0 {
        true => (0.15 * (strongest / 50.0).sqrt()).clamp(0.1, 1.0),
        false => UNKNOWN_LAG_S,
    }
}
