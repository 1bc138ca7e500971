//! An optimum, and the parts of a model that trials may ask for beside it.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

use super::descent::{Optimum, Tolerance};
use super::filter::{Drift, NoiseNumber, Swell};
use super::problem::Problem;
use super::report::Reported;
use super::steering::Steering;
use super::uncertainty::{Asked, inverse, whiteness};
use super::wiring::Wiring;
use super::{Actuator, Candidate, Tried, search};
use crate::plant::{Basis, Signal, Structure};
use crate::{Dof, Error, ThrusterFault, TrialRecord};

/// The laws of thrust between its samples that are tried.
pub(super) const SMOOTH: [Candidate; 2] = [Candidate::SmoothSpeed, Candidate::SmoothThrust];

/// A problem with its optimum.
#[derive(Clone)]
pub(super) struct Fitted {
    pub(super) problem: Problem,
    pub(super) optimum: Optimum,
    pub(super) tried: Vec<Tried>,
    /// Delay, lag and lever arm of the velocity sensor; the records of the problem are corrected for them.
    pub(super) reported: Reported,
    /// The gear of rudders and fins, likewise.
    pub(super) steering: Steering,
    /// Thrusters that did not act as logged; the records of the problem are corrected for them.
    pub(super) faults: Vec<ThrusterFault>,
    /// Thrusters that do not follow their own log, likewise.
    pub(super) wiring: Wiring,
    /// Laws of thrust between its samples that were tried.
    pub(super) smooth: Vec<Tried>,
}

impl Fitted {
    pub(super) fn new(problem: Problem, optimum: Optimum) -> Self {
        let (tried, reported, steering, faults, wiring, smooth) = Default::default();
        Self { problem, optimum, tried, reported, steering, faults, wiring, smooth }
    }

    /// The problem, and its optimum.
    pub(super) fn parts(&self) -> (&Problem, &Optimum) {
        (&self.problem, &self.optimum)
    }

    /// Another optimum of the same trials; the sensor and the thrusters stay as found before.
    pub(super) fn moved_to(&self, problem: Problem, optimum: Optimum) -> Self {
        Self { problem, optimum, tried: Vec::new(), ..self.clone() }
    }

    /// The same where what reads the speed of propellers reads that which they have, behind the one
    /// that is logged. The optimum is that of speeds before: the next descent begins there.
    pub(super) fn with_speeds_as_they_are(
        mut self,
        records: &[&TrialRecord],
    ) -> Result<Self, Error> {
        if self.reads_speeds() {
            let records = self.speeds_as_they_are(records)?;
            self.problem = self.problem.of(&records.iter().collect::<Vec<_>>());
        }
        Ok(self)
    }

    /// Returns true if the plant depends on the speed or thrust of propellers.
    pub(super) fn reads_speeds(&self) -> bool {
        self.problem.structure.signals().iter().any(Signal::is_of_known_thruster)
    }

    /// Records with the speeds that propellers have.
    pub(super) fn speeds_as_they_are(
        &self,
        records: &[&TrialRecord],
    ) -> Result<Vec<TrialRecord>, Error> {
        let plant = self.problem.plant(&self.optimum.point.free)?;
        let with_speeds = |record: &&TrialRecord| {
            let signals = self.optimum.point.actuator.signals(record, &plant)?;
            Ok(TrialRecord { signals, ..(*record).clone() })
        };
        records.iter().map(with_speeds).collect()
    }

    /// The same without terms beyond a structure that the trials do not support.
    pub(super) fn without_unseen_beside(self, structure: &Structure) -> Result<Self, Error> {
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
    pub(super) fn with_smooth_thrust_that_shows(self, laws: &[Candidate]) -> Result<Self, Error> {
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

    /// The same without numbers of the actuator that the trials do not support.
    pub(super) fn with_actuator_that_shows(mut self) -> Result<Self, Error> {
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
    pub(super) fn with_slew_that_shows(self) -> Result<Self, Error> {
        let Self { problem, optimum, .. } = &self;
        let actuator = optimum.point.actuator;
        let is_late = actuator.lag_s > 0.0 || actuator.delay_s > 0.0;
        if !problem.has_thrusters || !is_late || actuator.slew_s > 0.0 {
            return Ok(self);
        }
        let mut limited = problem.clone();
        limited.fits[Actuator::SLEW] = true;
        limited.fits[Actuator::LAG] = true;
        for ratio in Actuator::LAG_RATIOS {
            limited.fits[ratio] = false;
        }
        let pieces = limited.in_pieces();
        let part = pieces.as_ref().unwrap_or(&limited);
        let start = |slew_s: &f64| {
            // Half a slew time is the mean lateness of a change from full speed to none.
            let lag_s = (actuator.lag_s - 0.5 * slew_s).max(FIRST_LAG_BESIDE_SLEW_S);
            let mut numbers = actuator.numbers();
            (numbers[Actuator::SLEW], numbers[Actuator::LAG]) = (*slew_s, lag_s);
            Actuator::LAG_RATIOS.into_iter().for_each(|ratio| numbers[ratio] = 0.0);
            let mut point = optimum.point.clone();
            point.actuator = actuator.with(numbers);
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

    /// The same with a dead band of propellers in the place of another exponent of thrust, if that is clearly
    /// likelier: both make thrust weaker at low speed.
    pub(super) fn with_dead_band_that_shows(self) -> Result<Self, Error> {
        let Self { problem, optimum, .. } = &self;
        let actuator = optimum.point.actuator;
        let is_weaker = problem.fits[Actuator::EXPONENT] && actuator.beyond_square > 0.0;
        if !problem.has_thrusters || !is_weaker || problem.requires[Actuator::EXPONENT] {
            return Ok(self);
        }
        let mut other = problem.clone();
        other.fits[Actuator::EXPONENT] = false;
        other.fits[Actuator::DEAD_BAND] = true;
        let mut point = optimum.point.clone();
        let dead_band = DEAD_BAND_PER_EXPONENT * actuator.beyond_square;
        point.actuator = Actuator { beyond_square: 0.0, dead_band, ..actuator };
        // A descent that does not settle finds no dead band.
        let Ok(found) = other.descent_at_noise(point, Tolerance::COARSE) else { return Ok(self) };
        self.or_if_likelier(other, found, search::CLEAR_GAIN)
    }

    /// The same with thrust that changes under the load of all thrusters, if that is likelier by more than
    /// chance beside the colour of innovations.
    pub(super) fn with_load_that_shows(self) -> Result<Self, Error> {
        let problem = &self.problem;
        let is_alone = problem.structure.axes().len() == 1;
        if !problem.has_thrusters || is_alone || problem.fits[Actuator::LOADED] {
            return Ok(self);
        }
        let Some((loaded, found)) = self.beside_number(Actuator::LOADED) else { return Ok(self) };
        let colour = self.colour_of_translations()?;
        self.or_if_likelier(loaded, found, search::ADMITTED * colour)
    }

    /// The same with propellers whose lag differs while their speed falls and while it rises, if that is likelier by
    /// more than chance.
    pub(super) fn with_falling_lag_that_shows(self) -> Result<Self, Error> {
        const K: usize = Actuator::FALLING_LAG_RATIO;
        let problem = &self.problem;
        if !problem.can_show[K] || !problem.fits[Actuator::LAG] || problem.fits[K] {
            return Ok(self);
        }
        let Some((other, found)) = self.beside_number(K) else { return Ok(self) };
        self.or_if_likelier(other, found, search::ADMITTED)
    }

    /// The optimum with one more number of the actuator; `None` if its score does not ask for it, or the descent does
    /// not settle.
    fn beside_number(&self, k: usize) -> Option<(Problem, Optimum)> {
        let (problem, optimum) = self.parts();
        let mut wider = problem.clone();
        wider.fits[k] = true;
        wider.score(&optimum.point, k).filter(|score| *score >= search::ADMITTED)?;
        let found = wider.descent_at_noise(optimum.point.clone(), Tolerance::COARSE).ok()?;
        Some((wider, found))
    }

    /// The same with jitter of thrust, if that is likelier by more than chance.
    ///
    /// Thrust that changes between two samples of its log acts up to a period before the second one. The
    /// mean of this lead is a negative delay. The rest would be fitted as a disturbance with a short
    /// correlation time, which acts at all times.
    pub(super) fn with_jitter_that_shows(mut self) -> Result<Self, Error> {
        let Self { problem, optimum, .. } = &self;
        let has_log = problem.thrust_period_s > 0.0;
        if problem.is_free || !has_log || optimum.point.noise.jitter_s.is_some() {
            return Ok(self);
        }
        let is_likelier = |cost: f64| 2.0 * (optimum.cost - cost) > search::ADMITTED;
        let start = |part: f64| {
            let mut point = optimum.point.clone();
            point.noise.jitter_s = Some(part * problem.thrust_period_s);
            point.jitter_of = point.actuator;
            (problem.cost(&point), point)
        };
        // Jitter that matters is likelier before the disturbance has changed, too.
        let starts = FIRST_JITTERS.into_iter().map(start).filter(|(cost, _)| is_likelier(*cost));
        let Some((_, start)) = starts.min_by(|a, b| a.0.total_cmp(&b.0)) else { return Ok(self) };
        // A descent that does not settle finds no jitter.
        let found = problem.descent(start, Tolerance::COARSE);
        if let Some(found) = found.ok().filter(|found| is_likelier(found.cost)) {
            let iterations = optimum.iterations + found.iterations;
            self.optimum = Optimum { iterations, ..found };
        }
        Ok(self)
    }

    /// Returns this fit, or that of a problem with more numbers of the actuator if twice the gain in
    /// ln-likelihood exceeds `least`.
    pub(super) fn or_if_likelier(
        self,
        problem: Problem,
        found: Optimum,
        least: f64,
    ) -> Result<Self, Error> {
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
    pub(super) fn with_drift_that_shows(mut self) -> Result<Self, Error> {
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
    pub(super) fn with_swell_that_shows(self) -> Result<Self, Error> {
        let found = self.with_swell()?;
        Ok(match found {
            Some(found) if found.explains_colour_of(&self)? => found,
            _ => self,
        })
    }

    /// Returns true if most of what colours the innovations of an axis of another fit does not colour those of
    /// this one.
    pub(super) fn explains_colour_of(&self, other: &Self) -> Result<bool, Error> {
        let (white, left) = (other.whiteness()?, self.whiteness()?);
        let explains = |dof: &Dof| {
            white(*dof) > COLOURED && left(*dof) - 1.0 < LEFT_PART * (white(*dof) - 1.0)
        };
        Ok(self.problem.structure.axes().iter().any(explains))
    }

    /// The same with a force of waves on each axis, where innovations are coloured and that is likelier by more
    /// than chance. Its frequency has no slope without a force, so that the descent begins at the likeliest of
    /// several; a band that is not narrow is none of waves.
    pub(super) fn with_swell(&self) -> Result<Option<Self>, Error> {
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
    pub(super) fn unseen_of_actuator(&self) -> Vec<usize> {
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
    pub(super) fn refined(self) -> Result<Self, Error> {
        let optimum = self.problem.descent(self.optimum.point, Tolerance::FINE)?;
        let iterations = self.optimum.iterations + optimum.iterations;
        Ok(Self { optimum: Optimum { iterations, ..optimum }, ..self })
    }

    /// Box and Pierce's statistic of each axis's innovations.
    pub(super) fn whiteness_by_axis(&self) -> Result<BTreeMap<Dof, f64>, Error> {
        whiteness(&self.problem, &self.optimum.point, self.reported.keep)
    }

    /// What the colour of an axis's innovations exaggerates likelihood by, at least 1: Box and
    /// Pierce's statistic, or of motion left to itself how many samples say as much as one.
    pub(super) fn whiteness(&self) -> Result<impl Fn(Dof) -> f64 + use<>, Error> {
        let white = if self.problem.is_free {
            self.problem.samples_per_independent(&self.optimum.point)?
        } else {
            self.whiteness_by_axis()?
        };
        Ok(move |dof: Dof| white.get(&dof).copied().unwrap_or(1.0).max(1.0))
    }

    /// The greatest of it.
    pub(super) fn colour_of_all(&self) -> Result<f64, Error> {
        let white = self.whiteness()?;
        Ok(self.problem.structure.axes().iter().map(|dof| white(*dof)).fold(1.0, f64::max))
    }

    /// The greatest of it on surge, sway and heave.
    pub(super) fn colour_of_translations(&self) -> Result<f64, Error> {
        let white = self.whiteness()?;
        let axes = self.problem.structure.axes().iter().filter(|dof| !dof.is_rotation());
        Ok(axes.map(|dof| white(*dof)).fold(1.0, f64::max))
    }

    /// The gain that a term needs, and the factor that its gain is divided by on each axis.
    pub(super) fn bar(&self) -> Result<(f64, impl Fn(Dof) -> f64), Error> {
        let is_free = self.problem.is_free;
        let needed = if is_free { search::ADMITTED_OF_FREE } else { search::ADMITTED };
        Ok((needed, self.whiteness()?))
    }

    /// Covariance of coefficients, numbers of the actuator and currents: of the scores of blocks where
    /// innovations are coloured.
    pub(super) fn covariance_by_colour(&self, whiteness: &BTreeMap<Dof, f64>) -> DMatrix<f64> {
        let Self { problem, optimum, .. } = self;
        let of_blocks = || problem.covariance_of_blocks(&optimum.point, &optimum.information);
        let of_blocks = self.is_coloured(whiteness).then(of_blocks).flatten();
        of_blocks.unwrap_or_else(|| inverse(&optimum.information))
    }

    /// Returns true if innovations are correlated, so that samples carry less information than their number.
    pub(super) fn is_coloured(&self, whiteness: &BTreeMap<Dof, f64>) -> bool {
        self.problem.is_free || whiteness.values().any(|colour| *colour > COLOURED)
    }

    /// Covariance of the coefficients.
    pub(super) fn covariance(&self) -> DMatrix<f64> {
        let p = self.problem.structure.terms().len();
        inverse(&self.optimum.information).view((0, 0), (p, p)).into_owned()
    }

    /// θ²/σ² of each term.
    pub(super) fn worths(&self) -> Result<BTreeMap<Basis, f64>, Error> {
        let plant = self.problem.plant(&self.optimum.point.free)?;
        let covariance = self.covariance();
        let terms = plant.structure().terms().iter().zip(plant.coefficients()).enumerate();
        Ok(terms.map(|(k, (term, x))| (*term, x * x / covariance[(k, k)])).collect())
    }

    /// The same with attitude as a state: from the optimum with smoothed attitude, which is near and
    /// costs less than half to find.
    pub(super) fn with_attitude(self, records: &[&TrialRecord]) -> Result<Self, Error> {
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
pub(super) const COLOURED: f64 = 1.7;

/// Parts of the disturbance of one axis beside which a descent may begin where a current changes.
const LEFT_BESIDE_DRIFT: [f64; 3] = [1.0, 0.2, 0.03];

/// Part of the colour of an axis's innovations that may be left where waves explain it.
const LEFT_PART: f64 = 0.25;

/// Periods of swell at which a descent begins, s, and parts of a disturbance's power.
const FIRST_PERIODS_S: [f64; 6] = [3.0, 4.2, 5.8, 8.0, 11.0, 15.0];
/// The same of one axis, which a small boat may have that short waves rock.
const SHORT_PERIODS_S: [f64; 3] = [1.0, 1.4, 2.0];
const FIRST_SWELL_PARTS: [f64; 3] = [0.1, 0.5, 0.9];

/// Jitter at which a descent begins, relative to the time between samples of thrust: that of changes
/// at any time is 1/√12.
const FIRST_JITTERS: [f64; 3] = [0.03, 0.1, 0.3];

/// The dead band that thrust has at 60 % of full speed as with another exponent, over that exponent less 2.
const DEAD_BAND_PER_EXPONENT: f64 = 0.38;

/// Slew times at which a descent begins, s, …
const FIRST_SLEWS_S: [f64; 3] = [0.2, 0.5, 1.2];
/// … and the least lag beside one.
const FIRST_LAG_BESIDE_SLEW_S: f64 = 0.02;
