//! Plants of any axes: the filter error method on any set of axes, from a start by equation
//! error.

mod actuator;
mod descent;
mod equation_error;
mod filter;
mod free;
mod gains;
mod independence;
mod information;
mod known;
mod noise_descent;
mod one_axis;
mod plan;
mod problem;
mod report;
mod schedule;
mod search;
mod sensor_lag;
mod start;
mod step;
mod swaps;
mod thrust;
mod uncertainty;

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::Candidate;
use crate::plant::{Basis, Plant, RigidBody, Signal, Structure, Symmetry};
use crate::{Dof, Error, Method, ThrusterFault, TrialRecord, VelocityReport};
pub use actuator::Actuator;
use descent::{Optimum, Tolerance};
use equation_error::Solved;
use filter::{Drift, InstrumentNoise, NoiseNumber, Swell};
pub use gains::GainBeside;
use gains::{OfScale, Scaled};
pub use information::{
    ExpectedActuator, ExpectedNoise, ExpectedNoises, Information, information, information_before,
};
pub use known::ScaleClaim;
pub(super) use one_axis::{Exchanged, FilterStart, FittedAxis, Lever, OneAxis, force_rms};
pub use plan::PlantPlan;
use problem::{CURRENT_STD, Problem};
use report::Reported;
use schedule::Attitude;
pub use search::Tried;
pub(crate) use search::{NEGLIGIBLE_POWER, damping_power};
use start::begun;
pub(crate) use step::LikelihoodStep;
pub(crate) use thrust::restless_thrust;
use uncertainty::{
    Asked, attitude_noise, current_drift, disturbances, inflation, instruments, inverse,
    of_coefficients, swell_force, whiteness,
};

/// Names of the instruments' noise in results, and units.
pub(crate) const INSTRUMENTS: [(&str, &str); InstrumentNoise::COUNT] = InstrumentNoise::NAMES;

/// A coupled plant fitted to trials.
#[derive(Clone, Debug)]
pub struct PlantFit {
    /// The plant.
    pub plant: Plant,
    /// How it was found.
    pub method: Method,
    /// Covariance of its coefficients, shape (p, p).
    pub covariance: DMatrix<f64>,
    /// The part of it that thrust makes whose scale is not known for sure.
    pub thrust_covariance: DMatrix<f64>,
    /// The current of each trial, north and east, m/s, with standard deviations.
    pub currents: BTreeMap<String, [(f64, f64); 2]>,
    /// How thrust follows what is logged of it.
    pub actuator: Actuator,
    /// Standard deviations of its numbers; none of one that the trials do not show.
    pub actuator_std: [Option<f64>; Actuator::COUNT],
    /// Whether propellers lag; else a logged wrench does.
    pub has_thrusters: bool,
    /// Disturbance and noise of each axis.
    pub disturbances: BTreeMap<Dof, AxisNoise>,
    /// Standard deviation of a sample of roll and of pitch, rad, and that of its estimate, where
    /// attitude is a state.
    pub attitude_noise: Option<(f64, f64)>,
    /// Noise of the instruments that measure position, depth, heading and acceleration, by its name in
    /// results, and that of its estimate.
    pub instruments: BTreeMap<&'static str, (f64, f64)>,
    /// How the current changes about its mean of a trial, if the trials show that.
    pub current_drift: Option<CurrentDrift>,
    /// Force of waves on each axis, if the trials show one.
    pub swell: Option<SwellForce>,
    /// How translations are reported, late beside thrust and rates or from elsewhere than is stated, if
    /// the trials show that; they were taken to be as they were before it.
    pub report: VelocityReport,
    /// Standard deviations of its delay and lag, s; none of what the trials do not show.
    pub report_std: [Option<f64>; 2],
    /// Those of its levers, m.
    pub lever_std: [Option<f64>; 3],
    /// ln-likelihood.
    pub log_likelihood: f64,
    /// Numbers measured.
    pub samples: usize,
    /// Steps to the optimum.
    pub iterations: usize,
    /// The start: what least squares on the equation of motion gave.
    pub start: Plant,
    /// Box and Pierce's statistic of each axis's innovations over 40 lags, divided by 40: 1 if
    /// they are white.
    pub whiteness: BTreeMap<Dof, f64>,
    /// Probability that innovations which are independent of the thrusters correlate with them as much as
    /// those of each axis do. Empty where all innovations are white; axes with too little data are
    /// missing.
    pub independence: BTreeMap<Dof, f64>,
    /// How many combinations of coefficients the motion tells, by least squares.
    pub rank: usize,
    /// What each coefficient's variance is multiplied with because others look like it.
    pub inflation: Vec<f64>,
    /// Couplings in damping that were tried, and smooth thrust.
    pub tried: Vec<Tried>,
    /// How far slowly logged thrust on each axis is at a sample from the mean of its neighbours, relative to all
    /// thrust on it, where it moves smoothly from sample to sample: 1 − cos ωT for a sinusoid.
    pub beyond_neighbours: BTreeMap<Dof, f64>,
    /// Thrusters that stood still or pushed the other way in a trial; they were taken to do so.
    pub faults: Vec<ThrusterFault>,
    /// Thrusters that follow each other's log; the plant is that of what they do.
    pub exchanged: Vec<[String; 2]>,
    /// What each thruster gives beside the others, where the trials determine it.
    pub gains: BTreeMap<String, GainBeside>,
    /// What each known force says of the scale of thrust, where they contradict each other.
    pub claims: Vec<ScaleClaim>,
}

/// What stands beside the plant on one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisNoise {
    /// Standard deviation of the disturbance, N or N m, and that of its estimate.
    pub disturbance: (f64, f64),
    /// Its correlation time, s, likewise.
    pub correlation_s: (f64, f64),
    /// Standard deviation of a sample of velocity, m/s or rad/s, likewise.
    pub velocity: (f64, f64),
}

/// How a current changes in the course of a trial: a Gauss–Markov velocity north, and one east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurrentDrift {
    /// Standard deviation of each, m/s, and that of its estimate.
    pub std_m_s: (f64, f64),
    /// Their correlation time, s, likewise.
    pub correlation_s: (f64, f64),
}

/// A force of waves in a narrow band of frequencies about one.
#[derive(Clone, Debug, PartialEq)]
pub struct SwellForce {
    /// Standard deviation on each axis, N or N m, and that of its estimate.
    pub force: BTreeMap<Dof, (f64, f64)>,
    /// Period of the band's centre, s, likewise.
    pub period_s: (f64, f64),
    /// Damping ratio of the band, likewise: 0 for one frequency.
    pub damping: (f64, f64),
}

/// Fits a structure to trials by the filter error method.
///
/// States are ν_r and a Gauss–Markov force on each axis, and where roll and pitch are axes and both
/// they and their rates were measured the world's down in body axes, `k̇ = k × ω`; else attitude is
/// taken as measured. Waves add a force in a narrow band of frequencies, and thrust may lag behind
/// its log, be delayed, or act before its log says, where the trials show it. The start is the best
/// of several fits by equation error. M ⪰ M_RB where the rigid body is known, else M ≻ 0; an axis's
/// own damping is not below zero. Where `search` says so, damping of one axis by another is added if
/// the trials ask for it and the plant still takes power out of its motion.
///
/// # Errors
/// [`Error::TooShort`] if the trials hold fewer rows than coefficients; [`Error::Plant`] if the
/// fit does not settle.
///
/// # Source
/// [Jategaonkar2015, ch. 5], with the gains of the filter taken as known in each step.
pub fn fit_plant(
    structure: &Structure,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
    search: bool,
) -> Result<PlantFit, Error> {
    fit_as(structure, records, rigid_body, (search, Method::FilterError))
}

/// Fits a structure to trials by the output error method: its motion is left to itself.
///
/// As [`fit_plant`], but without disturbances, so that the plant alone has to explain the motion
/// from start to end. Standard deviations allow for the colour of the misfit.
///
/// # Errors
/// As [`fit_plant`].
///
/// # Source
/// [Jategaonkar2015, ch. 4]; covariance of \[White1982\].
pub fn fit_plant_freely(
    structure: &Structure,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
    search: bool,
) -> Result<PlantFit, Error> {
    fit_as(structure, records, rigid_body, (search, Method::OutputError))
}

/// Fits one axis alone, with thrusters and velocity sensor as in a fit of several axes.
///
/// # Errors
/// As [`fit_plant`].
pub(crate) fn fit_alone(
    fit: &PlantFit,
    dof: Dof,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
) -> Result<PlantFit, Error> {
    let structure = Structure::of(&[dof], Symmetry::Diagonal)?;
    let prompt: Vec<TrialRecord> =
        records.iter().map(|record| record.with_translations_before(&fit.report)).collect();
    let records: Vec<&TrialRecord> = prompt.iter().collect();
    let rigid_body = rigid_body.map(RigidBody::mass_matrix);
    let problem = Problem::new(&structure, &records, rigid_body, false, Attitude::Known);
    let (first, least_squares, mut fitted) =
        begun(problem.with_known_actuator(fit.actuator), &records)?;
    fitted.reported = Reported { how: fit.report, ..Reported::default() };
    fitted.finished(first, &least_squares, Method::FilterError)
}

fn fit_as(
    structure: &Structure,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
    (search, method): (bool, Method),
) -> Result<PlantFit, Error> {
    let is_free = method == Method::OutputError;
    let rigid_body = rigid_body.map(RigidBody::mass_matrix);
    let with_constants = match search {
        true => search::with_constants(structure, records)?,
        false => structure.clone(),
    };
    let first_fit = |records: &[&TrialRecord]| {
        let problem = Problem::new(&with_constants, records, rigid_body, is_free, Attitude::Known);
        FirstFit::new(problem, structure, records)
    };
    let begun = first_fit(records)?;
    let (begun, wired) = match search {
        true => begun.with_exchanges(records, first_fit)?,
        false => (begun, Vec::new()),
    };
    let wired: Vec<&TrialRecord> = wired.iter().collect();
    let records = if wired.is_empty() { records } else { &wired };
    let FirstFit { first, least_squares, fitted, prompt } = begun;
    let prompt: Vec<&TrialRecord> = prompt.iter().collect();
    let records = if prompt.is_empty() { records } else { &prompt };
    let (fitted, acting) = match search {
        true => fitted.with_thrusters_that_act(records)?,
        false => (fitted, Vec::new()),
    };
    let acting: Vec<&TrialRecord> = acting.iter().collect();
    let records = if acting.is_empty() { records } else { &acting };
    let fitted = match search {
        true => {
            let before = fitted.optimum.cost;
            let fitted = fitted.with_gains_that_show(records)?.with_load_that_shows()?;
            let found = fitted.with_speeds_as_they_are(records)?.searched(records)?;
            // What a coupling explains an actuator need not.
            let found = match found.optimum.cost == before {
                true => found,
                false => found.with_actuator_that_shows()?.with_drift_that_shows()?,
            };
            found.with_speeds_as_they_are(records)?
        }
        false => fitted,
    };
    let fitted = match Attitude::of(records, structure) {
        Attitude::State if !is_free => fitted.with_attitude(records)?.with_actuator_that_shows()?,
        _ => fitted,
    };
    fitted.refined()?.finished(first, &least_squares, method)
}

/// The fit of a plant before thrusters are looked at one by one.
struct FirstFit {
    /// By equation error.
    first: Plant,
    least_squares: Solved,
    fitted: Fitted,
    /// Records with velocities as prompt as their report shows; none where they are as logged.
    prompt: Vec<TrialRecord>,
}

impl FirstFit {
    fn new(
        problem: Problem,
        structure: &Structure,
        records: &[&TrialRecord],
    ) -> Result<Self, Error> {
        let (first, least_squares, fitted) = begun(problem, records)?;
        let fitted = fitted.without_unseen_beside(structure)?;
        let fitted = fitted.with_smooth_thrust_that_shows(&SMOOTH)?;
        let (fitted, prompt) = fitted.with_report_that_shows(records)?;
        let fitted = fitted.with_actuator_that_shows()?.with_slew_that_shows()?;
        let fitted = fitted.with_drift_that_shows()?.with_swell_that_shows()?;
        Ok(Self { first, least_squares, fitted, prompt })
    }
}

/// What thrust may do between its samples.
const SMOOTH: [Candidate; 2] = [Candidate::SmoothSpeed, Candidate::SmoothThrust];

/// An optimum and what it is one of.
#[derive(Clone)]
struct Fitted {
    problem: Problem,
    optimum: Optimum,
    tried: Vec<Tried>,
    /// How translations are reported; the problem's are as they were before that.
    reported: Reported,
    /// Thrusters that did not act as logged; the problem's do as they did.
    faults: Vec<ThrusterFault>,
    /// Thrusters that follow each other's log, likewise.
    exchanged: Vec<[String; 2]>,
    /// What thrust was tried to do between its samples, other than to be held.
    smooth: Vec<Tried>,
}

impl Fitted {
    fn new(problem: Problem, optimum: Optimum) -> Self {
        let (tried, reported, faults, exchanged) = Default::default();
        Self { problem, optimum, tried, reported, faults, exchanged, smooth: Vec::new() }
    }

    /// The problem, and its optimum.
    fn parts(&self) -> (&Problem, &Optimum) {
        (&self.problem, &self.optimum)
    }

    /// Another optimum of the same trials, with what was found of sensors and thrusters before.
    fn moved_to(&self, problem: Problem, optimum: Optimum) -> Self {
        let (reported, faults) = (self.reported, self.faults.clone());
        let (exchanged, smooth) = (self.exchanged.clone(), self.smooth.clone());
        Self { problem, optimum, tried: Vec::new(), reported, faults, exchanged, smooth }
    }

    /// The same where what reads the speed of propellers reads that which they have, behind the one
    /// that is logged. The optimum is that of speeds before: the next descent begins there.
    fn with_speeds_as_they_are(mut self, records: &[&TrialRecord]) -> Result<Self, Error> {
        if self.reads_speeds() {
            let records = self.speeds_as_they_are(records)?;
            self.problem = self.problem.of(&records.iter().collect::<Vec<_>>());
        }
        Ok(self)
    }

    /// Whether the plant reads speed or thrust of propellers.
    fn reads_speeds(&self) -> bool {
        self.problem.structure.signals().iter().any(Signal::is_of_known_thruster)
    }

    /// Records with the speeds that propellers have.
    fn speeds_as_they_are(&self, records: &[&TrialRecord]) -> Result<Vec<TrialRecord>, Error> {
        let with_speeds = |record: &&TrialRecord| {
            let signals = self.optimum.point.actuator.signals(record)?;
            Ok(TrialRecord { signals, ..(*record).clone() })
        };
        records.iter().map(with_speeds).collect()
    }

    /// The same with the couplings in damping that the trials ask for.
    ///
    /// In rounds, as a missing coupling colours the innovations of its axis and hides others.
    fn searched(self, records: &[&TrialRecord]) -> Result<Self, Error> {
        let candidates = search::candidates(&self.problem.structure);
        let mut search = Search { base: self, found: None, scores: BTreeMap::new() };
        for _ in 0..MOST_ROUNDS {
            let before = search.admitted();
            let added = search.asked_for(&candidates)?;
            if added.is_empty() {
                break;
            }
            search.admit(added, records)?;
            search.replace_by_rivals();
            if search.admitted() == before {
                break;
            }
        }
        let admitted = search.admitted();
        let Search { base, found, scores } = search;
        let chosen = found.unwrap_or(base);
        let structure = &chosen.problem.structure;
        let worths = chosen.worths()?;
        let tried = search::tried(structure, &candidates, &scores, &admitted, &worths);
        Ok(Self { tried, ..chosen })
    }

    /// The optimum with some terms beside those of `base`, from this one.
    fn with_terms(&self, base: &Structure, terms: &[Basis]) -> Result<Self, Error> {
        let problem = self.problem.with_terms(search::with_all(base, terms)?);
        let start = search::widened(&problem, &self.problem, &self.optimum.point);
        let is_new = |term: &Basis| self.problem.structure.index_of(term).is_none();
        // A plant that only lacks some of the terms is near its optimum already.
        let optimum = if problem.structure.terms().iter().any(is_new) {
            problem.optimum(start, Tolerance::COARSE)?
        } else {
            problem.descent_at_noise(start, Tolerance::COARSE)?
        };
        Ok(self.moved_to(problem, optimum))
    }

    /// The same without what the trials do not show of the terms beside those of a structure.
    fn without_unseen_beside(self, structure: &Structure) -> Result<Self, Error> {
        let mut left: Vec<Basis> = self.problem.structure.terms().to_vec();
        left.retain(|term| structure.index_of(term).is_none());
        let mut now = self;
        while !left.is_empty() {
            let plant = now.problem.plant(&now.optimum.point.free)?;
            let gone = search::dropped(&left, &plant, &now.covariance(), now.bar()?, false);
            if gone.is_empty() {
                break;
            }
            left.retain(|term| !gone.contains(term));
            now = now.with_terms(structure, &left)?;
        }
        Ok(now)
    }

    /// The same with thrust that moves smoothly between its slow samples by one of these laws, if that is clearly
    /// likelier than to be held.
    ///
    /// The ratio of the likelihoods of two laws with as many numbers exceeds x by chance at most once in x times.
    fn with_smooth_thrust_that_shows(self, laws: &[Candidate]) -> Result<Self, Error> {
        let Self { problem, optimum, .. } = &self;
        if problem.slow_period_s == 0.0 || optimum.point.actuator.is_smooth() {
            return Ok(self);
        }
        let colour = if problem.is_free { self.colour_of_all()? } else { 1.0 };
        let mut smooth = Vec::new();
        let mut best: Option<(Optimum, usize)> = None;
        for &law in laws.iter().filter(|law| problem.has_thrusters || law.is_of_force()) {
            let mut point = optimum.point.clone();
            point.actuator.between = Candidate::between_samples([law]);
            // A descent that does not settle finds no such thrust.
            let found = problem.descent(point, Tolerance::COARSE).ok();
            let ratio = found.as_ref().map_or(0.0, |x| 2.0 * (optimum.cost - x.cost) / colour);
            let least = best.as_ref().map_or(f64::INFINITY, |(best, _)| best.cost);
            if let Some(found) = found.filter(|x| ratio > search::CLEAR_GAIN && x.cost < least) {
                best = Some((found, smooth.len()));
            }
            smooth.push(Tried {
                name: law.name().to_owned(),
                admitted: false,
                likelihood_ratio: ratio,
                p_value: (-0.5 * ratio).exp().min(1.0),
            });
        }
        let Some((found, which)) = best else { return Ok(Self { smooth, ..self }) };
        smooth[which].admitted = true;
        let iterations = optimum.iterations + found.iterations;
        Self { optimum: Optimum { iterations, ..found }, smooth, ..self }.with_actuator_that_shows()
    }

    /// The same without what the trials do not show of the actuator.
    fn with_actuator_that_shows(mut self) -> Result<Self, Error> {
        loop {
            let unseen = self.unseen_of_actuator();
            if unseen.is_empty() {
                return Ok(self);
            }
            let (mut point, fits) = (self.optimum.point.clone(), self.problem.fits);
            let mut numbers = point.actuator.numbers();
            for k in unseen {
                self.problem.fits[k] = false;
                numbers[k] = 0.0;
            }
            point.actuator = point.actuator.with(numbers);
            // A fit that does not settle without them needs them.
            let Ok(optimum) = self.problem.descent_at_noise(point, Tolerance::COARSE) else {
                self.problem.fits = fits;
                return Ok(self);
            };
            let iterations = self.optimum.iterations + optimum.iterations;
            self.optimum = Optimum { iterations, ..optimum };
        }
    }

    /// The same with propellers whose speed has a greatest rate of change, if that is likelier by more
    /// than chance than the lag, the ratio of lags and the delay that imitate it.
    ///
    /// A slew time has no slope where it is zero, so that the descent begins at several.
    fn with_slew_that_shows(self) -> Result<Self, Error> {
        let Self { problem, optimum, .. } = &self;
        let actuator = optimum.point.actuator;
        let is_late = actuator.lag_s > 0.0 || actuator.delay_s > 0.0;
        if !problem.has_thrusters || !is_late || actuator.slew_s > 0.0 {
            return Ok(self);
        }
        let mut limited = problem.clone();
        limited.fits[Actuator::SLEW] = true;
        limited.fits[Actuator::LAG] = true;
        limited.fits[Actuator::LAG_RATIO] = false;
        let pieces = limited.in_pieces();
        let part = pieces.as_ref().unwrap_or(&limited);
        let start = |slew_s: &f64| {
            // Half a slew time is the mean lateness of a change from full speed to none.
            let lag_s = (actuator.lag_s - 0.5 * slew_s).max(FIRST_LAG_BESIDE_SLEW_S);
            let actuator = Actuator { slew_s: *slew_s, lag_s, log_lag_ratio: 0.0, ..actuator };
            let mut point = optimum.point.clone();
            point.actuator = actuator;
            (part.cost(&point), point)
        };
        let starts = FIRST_SLEWS_S.iter().map(start);
        let Some((_, start)) = starts.min_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(self) };
        // A descent that does not settle finds no slew time.
        let Ok(nearer) = part.descent_at_noise(start, Tolerance::COARSE) else { return Ok(self) };
        if nearer.cost >= part.cost(&optimum.point) {
            return Ok(self);
        }
        let found = match pieces.is_some() {
            true => limited.descent_at_noise(nearer.point, Tolerance::COARSE),
            false => Ok(nearer),
        };
        let Ok(found) = found else { return Ok(self) };
        self.or_if_likelier(limited, found, search::ADMITTED)
    }

    /// The same with thrust that changes under the load of all thrusters, if that is likelier by more than
    /// chance beside the colour of innovations.
    fn with_load_that_shows(self) -> Result<Self, Error> {
        let Self { problem, optimum, .. } = &self;
        if !problem.has_thrusters || problem.fits[Actuator::LOADED] {
            return Ok(self);
        }
        let mut loaded = problem.clone();
        loaded.fits[Actuator::LOADED] = true;
        if loaded.score(&optimum.point, Actuator::LOADED).is_none_or(|x| x < search::ADMITTED) {
            return Ok(self);
        }
        // A descent that does not settle finds no change.
        let Ok(found) = loaded.descent_at_noise(optimum.point.clone(), Tolerance::COARSE) else {
            return Ok(self);
        };
        let colour = self.colour_of_translations()?;
        self.or_if_likelier(loaded, found, search::ADMITTED * colour)
    }

    /// Returns this fit, or that of a problem with more numbers of the actuator if twice the gain in
    /// ln-likelihood exceeds `least`.
    fn or_if_likelier(self, problem: Problem, found: Optimum, least: f64) -> Result<Self, Error> {
        if 2.0 * (self.optimum.cost - found.cost) <= least {
            return Ok(self);
        }
        let iterations = self.optimum.iterations + found.iterations;
        let optimum = Optimum { iterations, ..found };
        Self { problem, optimum, ..self }.with_actuator_that_shows()
    }

    /// The same with a current that changes in the course of trials, if the trials show that: by a
    /// score test, and by what likelihood then gains. `−g² / (I_ss − I_sr I_rr⁻¹ I_rs)` with the
    /// logarithm s of its standard deviation where this is next to nothing, and r all other noise.
    fn with_drift_that_shows(mut self) -> Result<Self, Error> {
        let Self { problem, optimum, .. } = &self;
        let is_asked = problem.has_current && !problem.is_free;
        if !is_asked || optimum.point.noise.drift.is_some() {
            return Ok(self);
        }
        let with = |drift: Drift| {
            let mut point = optimum.point.clone();
            point.noise.drift = Some(drift);
            point
        };
        let tried = with(Drift::TRIED);
        let slope = problem.by_noise(&tried).zip(problem.noise_information(&tried));
        let Some(((_, gradient), information)) = slope else { return Ok(self) };
        let s = tried.noise.place(NoiseNumber::Drift);
        // Beside one axis, a disturbance that was fitted for it hides it from its score.
        let is_alone = problem.structure.axes().len() == 1;
        let rest = inverse(&information.view((0, 0), (s, s)).into_owned());
        let cross = information.view((0, s), (s, 1)).into_owned();
        let left = information[(s, s)] - cross.dot(&(&rest * &cross));
        let is_asked_for = gradient[s] < 0.0 && gradient[s].powi(2) >= search::ADMITTED * left;
        if !is_asked_for && !is_alone {
            return Ok(self);
        }
        let start = |part: f64| {
            let mut start = with(Drift::FIRST);
            start.noise.disturbance *= part;
            (problem.cost(&start), start)
        };
        let parts = if is_alone { LEFT_BESIDE_DRIFT.as_slice() } else { &[1.0] };
        let starts = parts.iter().map(|part| start(*part));
        let Some((_, start)) = starts.min_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(self) };
        let found = problem.descent(start, Tolerance::COARSE);
        if let Some(found) = found.ok().filter(|x| 2.0 * (optimum.cost - x.cost) > search::ADMITTED)
        {
            let iterations = optimum.iterations + found.iterations;
            self.optimum = Optimum { iterations, ..found };
        }
        Ok(self)
    }

    /// The same with a force of waves on each axis, where that is likelier by more than chance and explains
    /// most of what colours the innovations of an axis.
    fn with_swell_that_shows(self) -> Result<Self, Error> {
        let found = self.with_swell()?;
        Ok(match found {
            Some(found) if found.explains_colour_of(&self)? => found,
            _ => self,
        })
    }

    /// Returns true if most of what colours the innovations of an axis of another fit does not colour those of
    /// this one.
    fn explains_colour_of(&self, other: &Self) -> Result<bool, Error> {
        let (white, left) = (other.whiteness()?, self.whiteness()?);
        let explains = |dof: &Dof| {
            white(*dof) > COLOURED && left(*dof) - 1.0 < LEFT_PART * (white(*dof) - 1.0)
        };
        Ok(self.problem.structure.axes().iter().any(explains))
    }

    /// The same with a force of waves on each axis, where innovations are coloured and that is likelier by more
    /// than chance. Its frequency has no slope without a force, so that the descent begins at the likeliest of
    /// several; a band that is not narrow is none of waves.
    fn with_swell(&self) -> Result<Option<Self>, Error> {
        let Self { problem, optimum, .. } = self;
        let noise = &optimum.point.noise;
        if problem.is_free || noise.swell.is_some() {
            return Ok(None);
        }
        let white = self.whiteness()?;
        if problem.structure.axes().iter().all(|dof| white(*dof) <= COLOURED) {
            return Ok(None);
        }
        let pieces = problem.in_pieces();
        let data = pieces.as_ref().unwrap_or(problem);
        let is_alone = problem.structure.axes().len() == 1;
        let mass = problem.plant(&optimum.point.free)?.mass_matrix().diagonal();
        let start = |is_noise: bool, period_s: f64, part: f64| {
            let mut point = optimum.point.clone();
            let frequency = TAU / period_s;
            let (taken, left) = match is_noise {
                true => {
                    (mass.component_mul(&noise.velocity) * frequency, &mut point.noise.velocity)
                }
                false => (noise.disturbance.clone(), &mut point.noise.disturbance),
            };
            *left *= (1.0 - part).sqrt();
            let std = taken * part.sqrt();
            point.noise.swell = Some(Swell { std, frequency, damping: Swell::FIRST_DAMPING });
            (data.cost(&point), point)
        };
        // Waves were taken for a part of the disturbance or, of one axis, of the noise of its velocity.
        let short = if is_alone { SHORT_PERIODS_S.as_slice() } else { &[] };
        let taken_for = if is_alone { &[false, true][..] } else { &[false] };
        let mut starts = Vec::new();
        for &is_noise in taken_for {
            for period_s in short.iter().chain(&FIRST_PERIODS_S) {
                starts.extend(FIRST_SWELL_PARTS.map(|part| start(is_noise, *period_s, part)));
            }
        }
        let Some((_, start)) = starts.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return Ok(None);
        };
        // One axis is asked as its other candidates are.
        let by_number = if is_alone { (problem.samples() as f64).ln() } else { search::ADMITTED };
        let needed = by_number * (problem.structure.axes().len() + 2) as f64;
        let is_likelier = |cost: f64| 2.0 * (optimum.cost - cost) > needed;
        // Waves that matter are likelier before the plant has changed, too.
        if !is_likelier(problem.cost(&start)) {
            return Ok(None);
        }
        // A descent that does not settle finds no waves.
        let Ok(found) = problem.descent(start, Tolerance::OF_NOISE) else { return Ok(None) };
        let is_narrow = found.point.noise.swell.as_ref().is_some_and(Swell::is_narrow);
        if !is_narrow || !is_likelier(found.cost) {
            return Ok(None);
        }
        let iterations = optimum.iterations + found.iterations;
        Ok(Some(Self { optimum: Optimum { iterations, ..found }, ..self.clone() }))
    }

    /// Numbers of the actuator to drop: one after the other that worth least beside the others, as
    /// one can stand for another, while that is too little; what is left follows as for couplings.
    fn unseen_of_actuator(&self) -> Vec<usize> {
        let p = self.problem.structure.terms().len();
        let covariance = inverse(&self.optimum.information);
        let Problem { fits, requires, .. } = &self.problem;
        let fitted: Vec<usize> =
            (0..Actuator::COUNT).filter(|k| fits[*k] && !requires[*k]).collect();
        let places: Vec<usize> = fitted.iter().map(|k| p + k).collect();
        let own = self.optimum.point.actuator.numbers();
        let mut asked = Asked {
            numbers: DVector::from_row_slice(&own).select_rows(&fitted),
            covariance: covariance.select_rows(&places).select_columns(&places),
        };
        let unseen = asked.without_unseen(|k, value| Actuator::shows(fitted[k], value));
        unseen.into_iter().map(|k| fitted[k]).collect()
    }

    /// The same at the optimum itself.
    fn refined(self) -> Result<Self, Error> {
        let optimum = self.problem.descent(self.optimum.point, Tolerance::FINE)?;
        let iterations = self.optimum.iterations + optimum.iterations;
        Ok(Self { optimum: Optimum { iterations, ..optimum }, ..self })
    }

    /// What the colour of an axis's innovations exaggerates likelihood by, at least 1: Box and
    /// Pierce's statistic, or of motion left to itself how many samples say as much as one.
    fn whiteness(&self) -> Result<impl Fn(Dof) -> f64 + use<>, Error> {
        let white = if self.problem.is_free {
            self.problem.samples_per_independent(&self.optimum.point)?
        } else {
            whiteness(&self.problem, &self.optimum.point, self.reported.keep)?
        };
        Ok(move |dof: Dof| white.get(&dof).copied().unwrap_or(1.0).max(1.0))
    }

    /// The greatest of it.
    fn colour_of_all(&self) -> Result<f64, Error> {
        let white = self.whiteness()?;
        Ok(self.problem.structure.axes().iter().map(|dof| white(*dof)).fold(1.0, f64::max))
    }

    /// The greatest of it on surge, sway and heave.
    fn colour_of_translations(&self) -> Result<f64, Error> {
        let white = self.whiteness()?;
        let axes = self.problem.structure.axes().iter().filter(|dof| !dof.is_rotation());
        Ok(axes.map(|dof| white(*dof)).fold(1.0, f64::max))
    }

    /// What a term has to gain, and what its gain is divided by on each axis.
    fn bar(&self) -> Result<(f64, impl Fn(Dof) -> f64), Error> {
        let is_free = self.problem.is_free;
        let needed = if is_free { search::ADMITTED_OF_FREE } else { search::ADMITTED };
        Ok((needed, self.whiteness()?))
    }

    /// Covariance of coefficients, numbers of the actuator and currents: of the scores of blocks where
    /// innovations are coloured.
    fn covariance_by_colour(&self) -> Result<DMatrix<f64>, Error> {
        let Self { problem, optimum, .. } = self;
        let whiteness = whiteness(problem, &optimum.point, self.reported.keep)?;
        let is_coloured = problem.is_free || whiteness.values().any(|colour| *colour > COLOURED);
        let of_blocks = || problem.covariance_of_blocks(&optimum.point, &optimum.information);
        let of_blocks = is_coloured.then(of_blocks).flatten();
        Ok(of_blocks.unwrap_or_else(|| inverse(&optimum.information)))
    }

    /// Covariance of the coefficients.
    fn covariance(&self) -> DMatrix<f64> {
        let p = self.problem.structure.terms().len();
        inverse(&self.optimum.information).view((0, 0), (p, p)).into_owned()
    }

    /// θ²/σ² of each term.
    fn worths(&self) -> Result<BTreeMap<Basis, f64>, Error> {
        let plant = self.problem.plant(&self.optimum.point.free)?;
        let covariance = self.covariance();
        let terms = plant.structure().terms().iter().zip(plant.coefficients()).enumerate();
        Ok(terms.map(|(k, (term, x))| (*term, x * x / covariance[(k, k)])).collect())
    }

    fn finished(
        self,
        start: Plant,
        least_squares: &Solved,
        method: Method,
    ) -> Result<PlantFit, Error> {
        let thrust_covariance = self.thrust_covariance()?;
        let alike = self.gains_to_first_order()?;
        let lost = self.lost_between_samples()?;
        let Self { problem, optimum, mut tried, reported, faults, exchanged, smooth } = self;
        tried.extend(smooth);
        let plant = problem.plant(&optimum.point.free)?;
        let p = problem.structure.terms().len();
        let whiteness = whiteness(&problem, &optimum.point, reported.keep)?;
        let is_coloured = problem.is_free || whiteness.values().any(|colour| *colour > COLOURED);
        let of_blocks = || problem.covariance_of_blocks(&optimum.point, &optimum.information);
        let covariance = is_coloured.then(of_blocks).flatten();
        let is_tested = is_coloured && !problem.is_free;
        let independence = is_tested.then(|| problem.independence(&optimum.point));
        let covariance = covariance.unwrap_or_else(|| inverse(&optimum.information));
        let covariance = problem.with_known_uncertainty(&optimum, covariance);
        let colour = whiteness.values().copied().fold(1.0, f64::max);
        let claims = problem.contradictory_claims(&optimum, colour);
        let noise_covariance = inverse(&optimum.noise_information);
        let std_of_actuator = |k: usize| problem.fits[k].then(|| covariance[(p + k, p + k)].sqrt());
        let q = p + Actuator::COUNT;
        // Of a current that nothing shows, the scores of blocks leave none of what was known before.
        let std = |k: usize| {
            let variance = covariance[(q + k, q + k)];
            if variance > 0.0 { variance.sqrt() } else { CURRENT_STD }
        };
        let current = |(trial, name): (usize, &String)| {
            let [north, east] = optimum.point.currents[trial];
            (name.clone(), [(north, std(2 * trial)), (east, std(2 * trial + 1))])
        };
        let currents = problem.trials.iter().enumerate().map(current);
        let of_plant = of_coefficients(&plant, &covariance) + &thrust_covariance + lost;
        let mut inflation = inflation(&optimum.information, p);
        // Known forces tell the scale of thrust, whatever the mean of the gains.
        let scaled = match problem.fits[Actuator::SCALE] {
            true => None,
            false => Scaled::of(&plant, (&of_plant, &thrust_covariance))?,
        };
        let Scaled { plant, covariance: of_plant, thrust_covariance, scale } =
            scaled.unwrap_or(Scaled { plant, covariance: of_plant, thrust_covariance, scale: 1.0 });
        inflation.resize(plant.coefficients().len(), 1.0);
        let mut noise = optimum.point.noise.clone();
        noise.disturbance *= scale;
        noise.swell = noise.swell.map(|swell| Swell { std: swell.std * scale, ..swell });
        let place = p + Actuator::SCALE;
        let of_scale = problem.fits[Actuator::SCALE].then(|| OfScale {
            scale: optimum.point.actuator.log_scale.exp(),
            covariance: covariance.column(place).rows(0, p).into_owned(),
            variance: covariance[(place, place)],
        });
        let gains = match gains::of_plant(&plant, &of_plant, of_scale.as_ref()) {
            Some(fitted) => fitted,
            None => {
                alike.into_iter().map(|(name, own)| (name, own.scaled(of_scale.as_ref()))).collect()
            }
        };
        let axes = problem.structure.axes().iter().copied();
        Ok(PlantFit {
            plant: plant.pruned()?,
            method,
            inflation,
            covariance: of_plant,
            thrust_covariance,
            actuator: optimum.point.actuator,
            actuator_std: std::array::from_fn(std_of_actuator),
            has_thrusters: problem.has_thrusters,
            currents: if problem.has_current { currents.collect() } else { BTreeMap::new() },
            disturbances: disturbances(&problem.structure, &noise, &noise_covariance, |i| {
                problem.is_unmeasured(i)
            }),
            attitude_noise: attitude_noise(&optimum.point.noise, &noise_covariance),
            instruments: instruments(&optimum.point.noise, &noise_covariance),
            report: reported.how,
            report_std: reported.std,
            lever_std: reported.lever_std,
            current_drift: current_drift(&optimum.point.noise, &noise_covariance),
            swell: swell_force(&problem.structure, &noise, &noise_covariance),
            log_likelihood: -optimum.cost,
            samples: problem.samples(),
            iterations: optimum.iterations,
            start,
            whiteness,
            independence: independence.unwrap_or_default(),
            rank: (least_squares.rank + p).saturating_sub(least_squares.terms),
            tried,
            beyond_neighbours: match optimum.point.actuator.is_smooth() {
                true => axes.zip(problem.beyond_neighbours).collect(),
                false => BTreeMap::new(),
            },
            faults,
            exchanged,
            gains,
            claims,
        })
    }
}

impl Fitted {
    /// The same with attitude as a state: from the optimum with smoothed attitude, which is near and
    /// costs less than half to find.
    fn with_attitude(self, records: &[&TrialRecord]) -> Result<Self, Error> {
        let as_they_are = match self.reads_speeds() {
            true => self.speeds_as_they_are(records)?,
            false => Vec::new(),
        };
        let as_they_are: Vec<&TrialRecord> = as_they_are.iter().collect();
        let records = if as_they_are.is_empty() { records } else { &as_they_are };
        let problem = self.problem.with_attitude(records);
        let start = self.optimum.point.with_attitude(&problem);
        let optimum = problem.descent(start, Tolerance::COARSE)?;
        let iterations = self.optimum.iterations + optimum.iterations;
        let optimum = Optimum { iterations, ..optimum };
        Ok(Self { problem, optimum, ..self })
    }
}

/// Innovations of more, in what [`PlantFit::whiteness`] says, are coloured: white noise exceeds it once
/// in a thousand. Samples then say less than their number, and the covariance is that of the scores
/// of blocks.
const COLOURED: f64 = 1.7;

/// Parts of the disturbance of one axis beside which a descent may begin where a current changes.
const LEFT_BESIDE_DRIFT: [f64; 3] = [1.0, 0.2, 0.03];

/// Part of the colour of an axis's innovations that may be left where waves explain it.
const LEFT_PART: f64 = 0.25;

/// Periods of swell at which a descent begins, s, and parts of a disturbance's power.
const FIRST_PERIODS_S: [f64; 6] = [3.0, 4.2, 5.8, 8.0, 11.0, 15.0];
/// The same of one axis, which a small boat may have that short waves rock.
const SHORT_PERIODS_S: [f64; 3] = [1.0, 1.4, 2.0];
const FIRST_SWELL_PARTS: [f64; 3] = [0.1, 0.5, 0.9];

/// Slew times at which a descent begins, s, …
const FIRST_SLEWS_S: [f64; 3] = [0.2, 0.5, 1.2];
/// … and the least lag beside one.
const FIRST_LAG_BESIDE_SLEW_S: f64 = 0.02;

/// Rounds of admitting and dropping couplings.
const MOST_ROUNDS: usize = 4;

/// A search for couplings in damping.
struct Search {
    /// The plant without them.
    base: Fitted,
    /// The plant with those that are admitted.
    found: Option<Fitted>,
    /// What each candidate would have gained when it was last outside.
    scores: BTreeMap<Basis, f64>,
}

impl Search {
    fn now(&self) -> &Fitted {
        self.found.as_ref().unwrap_or(&self.base)
    }

    /// The terms that the plant has now beside those of the base.
    fn admitted(&self) -> Vec<Basis> {
        let base = &self.base.problem.structure;
        let all = self.now().problem.structure.terms();
        all.iter().filter(|term| base.index_of(term).is_none()).copied().collect()
    }

    /// Couplings outside that the innovations ask for.
    fn asked_for(&mut self, candidates: &[Basis]) -> Result<Vec<Basis>, Error> {
        let now = self.now();
        let outside = |term: &&Basis| now.problem.structure.index_of(term).is_none();
        let outside: Vec<Basis> = candidates.iter().filter(outside).copied().collect();
        if outside.is_empty() {
            return Ok(outside);
        }
        let scores = search::scores(&now.problem, &now.optimum.point, &outside)?;
        let admitted = search::admitted(&now.problem.structure, &outside, &scores, now.bar()?);
        self.scores.extend(outside.into_iter().zip(scores));
        Ok(admitted)
    }

    /// Has the likelier of two terms that stand for each other.
    ///
    /// Beside the reverse-thrust ratio neither of the two forms of inflow may be worth much where both
    /// are fitted, and which of them is dropped is left to chance.
    fn replace_by_rivals(&mut self) {
        for term in self.admitted() {
            let structure = &self.now().problem.structure;
            let Some(rival) = search::rival(structure, &term) else { continue };
            if structure.index_of(&rival).is_some() {
                continue;
            }
            let mut terms = self.admitted();
            terms.retain(|own| *own != term);
            terms.push(rival);
            // A plant that does not settle is not the likelier one.
            let Ok(other) = self.now().with_terms(&self.base.problem.structure, &terms) else {
                continue;
            };
            if other.optimum.cost < self.now().optimum.cost {
                self.found = Some(other);
            }
        }
    }

    /// Fits the plant with terms more, without those that turn out to be worth too little.
    fn admit(&mut self, added: Vec<Basis>, records: &[&TrialRecord]) -> Result<(), Error> {
        let mut terms = self.admitted();
        terms.extend(added);
        while !terms.is_empty() {
            // A wider plant that does not settle says that its terms are not told apart.
            let Ok(wider) = self.now().with_terms(&self.base.problem.structure, &terms) else {
                return Ok(());
            };
            let plant = wider.problem.plant(&wider.optimum.point.free)?;
            let must_go = !search::is_dissipative(&plant, records);
            let covariance = wider.covariance();
            let gone = search::dropped(&terms, &plant, &covariance, wider.bar()?, must_go);
            self.found = Some(wider);
            if gone.is_empty() {
                return Ok(());
            }
            terms.retain(|term| !gone.contains(term));
        }
        self.found = None;
        Ok(())
    }
}

impl PlantFit {
    /// Records with thrusters as they acted; none where all acted as logged.
    ///
    /// # Errors
    /// Those of [`crate::Timed::new`] if a force is not finite.
    pub(crate) fn as_driven(&self, records: &[&TrialRecord]) -> Result<Vec<TrialRecord>, Error> {
        if self.faults.is_empty() && self.exchanged.is_empty() {
            return Ok(Vec::new());
        }
        let acting = |record: &&TrialRecord| {
            let own = self.faults.iter().filter(|fault| fault.trial == record.trial);
            let first = record.with_all_exchanged(&self.exchanged)?;
            own.into_iter()
                .try_fold(first, |record, fault| record.with_gain(&fault.thruster, fault.gain))
        };
        records.iter().map(acting).collect()
    }

    /// Records that were not fitted, with exchanged thrusters as they act; none where none are.
    ///
    /// # Errors
    /// As [`Self::as_driven`].
    pub(crate) fn as_wired(&self, records: &[&TrialRecord]) -> Result<Vec<TrialRecord>, Error> {
        if self.exchanged.is_empty() {
            return Ok(Vec::new());
        }
        records.iter().map(|record| record.with_all_exchanged(&self.exchanged)).collect()
    }

    /// Noise of instruments as a filter takes it.
    fn instrument_noise(&self) -> InstrumentNoise {
        let mut noise = InstrumentNoise::NONE;
        for (k, (name, _)) in InstrumentNoise::NAMES.iter().enumerate() {
            if let Some((value, _)) = self.instruments.get(name) {
                (noise.numbers[k], noise.active[k]) = (*value, true);
            }
        }
        noise
    }

    /// The current of a trial, north and east, m/s; zero of one that was not fitted.
    pub fn current_of(&self, trial: &str) -> [f64; 2] {
        self.currents.get(trial).map_or([0.0; 2], |current| current.map(|(value, _)| value))
    }

    /// The mean of the trials' currents, by their variances, m/s.
    pub fn mean_current(&self) -> [f64; 2] {
        std::array::from_fn(|direction| {
            let all = self.currents.values().map(|current| current[direction]);
            let (sum, weight) = all.fold((0.0, 0.0), |(sum, weight), (value, std)| {
                let own = 1.0 / (std * std).max(f64::MIN_POSITIVE);
                (sum + own * value, weight + own)
            });
            if weight > 0.0 { sum / weight } else { 0.0 }
        })
    }

    /// The same as if the scale of thrust were known for sure: what the motion tells, and what can be
    /// compared with another fit of the same trials.
    pub(crate) fn of_sure_thrust(&self) -> Self {
        let covariance = &self.covariance - &self.thrust_covariance;
        let thrust_covariance = DMatrix::zeros(covariance.nrows(), covariance.ncols());
        Self { covariance, thrust_covariance, ..self.clone() }
    }

    /// Standard deviation of a coefficient.
    pub fn std(&self, term: &Basis) -> Option<f64> {
        let k = self.plant.structure().index_of(term)?;
        Some(self.covariance[(k, k)].sqrt())
    }
}

#[cfg(test)]
mod tests;
