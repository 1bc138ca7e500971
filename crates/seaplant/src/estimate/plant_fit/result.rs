//! The result of a fit of a plant.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::differences::thruster_of;
use super::equation_error::Solved;
use super::filter::{InstrumentNoise, Swell};
use super::gains::{self, OfScale, Scaled};
use super::problem::CURRENT_STD;
use super::thrust::UnseenExponent;
use super::uncertainty::{
    attitude_noise, current_drift, disturbances, inflation, instruments, inverse, of_coefficients,
    swell_force, thrust_jitter,
};
use super::{Actuator, Fitted, GainBeside, ScaleClaim, Tried};
use crate::plant::{Basis, Plant};
use crate::{Dof, Error, Method, ThrusterFault, TrialRecord, VelocityReport};

/// Names of the instruments' noise in results, and units.
pub(crate) const INSTRUMENTS: [(&str, &str); InstrumentNoise::COUNT] = InstrumentNoise::NAMES;

/// A plant fitted to trials.
#[derive(Clone, Debug)]
pub struct PlantFit {
    /// The plant.
    pub plant: Plant,
    /// The method.
    pub method: Method,
    /// Covariance of its coefficients, shape (p, p).
    pub covariance: DMatrix<f64>,
    /// The part of it that is due to the uncertain scale of thrust.
    pub thrust_covariance: DMatrix<f64>,
    /// The current of each trial, north and east, m/s, with standard deviations.
    pub currents: BTreeMap<String, [(f64, f64); 2]>,
    /// Lag, delay and deviations of thrust from its log.
    pub actuator: Actuator,
    /// Standard deviations of its numbers; none of one that is not fitted.
    pub actuator_std: [Option<f64>; Actuator::COUNT],
    /// The exponent of thrust where the trials speak for another, but too little for it to be fitted: the intervals
    /// include what it moves.
    pub unseen_exponent: Option<UnseenExponent>,
    /// True if propellers lag, false if a logged wrench does.
    pub has_thrusters: bool,
    /// Disturbance and noise of each axis.
    pub disturbances: BTreeMap<Dof, AxisNoise>,
    /// Standard deviation of a sample of roll and of pitch, rad, and that of its estimate, where
    /// attitude is a state.
    pub attitude_noise: Option<(f64, f64)>,
    /// Noise of the instruments that measure position, depth, heading and acceleration, by its name in
    /// results, and that of its estimate.
    pub instruments: BTreeMap<&'static str, (f64, f64)>,
    /// Variation of the current about its mean of a trial, if the trials support one.
    pub current_drift: Option<CurrentDrift>,
    /// Force of waves on each axis, if the trials show one.
    pub swell: Option<SwellForce>,
    /// Jitter of thrust: standard deviation of the time at which a change of thrust acts, s, and that of its
    /// estimate, if the trials show one.
    pub thrust_jitter_s: Option<(f64, f64)>,
    /// Standard deviations of delay, s, and slew, s/rad, of the steering gear; none of one that is not fitted.
    pub steering_std: [Option<f64>; 2],
    /// Delay, lag and lever arm of the velocity sensor beyond those that are stated, if the trials support
    /// them; the fit corrects for them.
    pub report: VelocityReport,
    /// Standard deviations of its delay and lag, s; none of one that is not fitted.
    pub report_std: [Option<f64>; 2],
    /// Those of its levers, m.
    pub lever_std: [Option<f64>; 3],
    /// Those of its misalignment, rad.
    pub misalignment_std: [Option<f64>; 3],
    /// True if translations are measured along the world's axes, as by a satellite receiver: a misalignment about the
    /// vertical axis is then that of heading.
    pub is_along_world: bool,
    /// The fit with another place of the velocity sensor, if that explains the trials as well or better, or has the centre
    /// of mass nearer to where it is expected.
    pub other_place: Option<Box<PlantFit>>,
    /// ln-likelihood.
    pub log_likelihood: f64,
    /// Numbers measured.
    pub samples: usize,
    /// Steps to the optimum.
    pub iterations: usize,
    /// The plant that the descent started from, by least squares on the equation of motion.
    pub start: Plant,
    /// Box and Pierce's statistic of each axis's innovations over 40 lags, divided by 40: 1 if
    /// they are white.
    pub whiteness: BTreeMap<Dof, f64>,
    /// Probability that innovations which are independent of the thrusters correlate with them as much as
    /// those of each axis do. Empty where all innovations are white; axes with too little data are
    /// missing.
    pub independence: BTreeMap<Dof, f64>,
    /// Number of combinations of coefficients that the motion determines, by least squares.
    pub rank: usize,
    /// Variance inflation of each coefficient by correlation with the others.
    pub inflation: Vec<f64>,
    /// Couplings in damping that were tried, and smooth thrust.
    pub tried: Vec<Tried>,
    /// How far slowly logged thrust on each axis is at a sample from the mean of its neighbours, relative to all
    /// thrust on it, where it moves smoothly from sample to sample: 1 − cos ωT for a sinusoid.
    pub beyond_neighbours: BTreeMap<Dof, f64>,
    /// Thrusters that stood still or pushed the other way in a trial; they were taken to do so.
    pub faults: Vec<ThrusterFault>,
    /// Pairs of thrusters that follow each other's log; the fit exchanges them.
    pub exchanged: Vec<[String; 2]>,
    /// Gain of each thruster relative to the others, where the trials determine it.
    pub gains: BTreeMap<String, GainBeside>,
    /// The scale of thrust by each known force, where they contradict each other.
    pub claims: Vec<ScaleClaim>,
}

/// Disturbance and measurement noise of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisNoise {
    /// Standard deviation of the disturbance, N or N m, and that of its estimate.
    pub disturbance: (f64, f64),
    /// Its correlation time, s, likewise.
    pub correlation_s: (f64, f64),
    /// Standard deviation of a sample of velocity, m/s or rad/s, likewise.
    pub velocity: (f64, f64),
}

/// Variation of a current in the course of a trial: a Gauss–Markov velocity north, and one east.
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

impl Fitted {
    pub(super) fn finished(
        self,
        start: Plant,
        least_squares: &Solved,
        method: Method,
    ) -> Result<PlantFit, Error> {
        let mut thrust_covariance = self.thrust_covariance()?;
        let alike = self.gains_to_first_order()?;
        let lost = self.lost_between_samples()?;
        let whiteness = self.whiteness_by_axis()?;
        let colour = whiteness.values().copied().fold(1.0, f64::max);
        let unseen = self.unseen_exponent(colour);
        if let Some(unseen) = &unseen {
            thrust_covariance += unseen.covariance();
        }
        let is_coloured = self.is_coloured(&whiteness);
        let covariance = self.steering.widened(self.covariance_by_colour(&whiteness));
        let Self { problem, optimum, mut tried, reported, steering, faults, wiring, smooth } = self;
        tried.extend(smooth);
        let plant = problem.plant(&optimum.point.free)?;
        let unseen_exponent = unseen.map(|unseen| unseen.of(&plant));
        let p = problem.structure.terms().len();
        let is_tested = is_coloured && !problem.is_free;
        let independence = is_tested.then(|| problem.independence(&optimum.point));
        let covariance = problem.with_known_uncertainty(&optimum, covariance);
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
        let scaled =
            scaled.unwrap_or(Scaled { plant, covariance: of_plant, thrust_covariance, scale: 1.0 });
        let mut noise = optimum.point.noise.clone();
        noise.disturbance *= scaled.scale;
        noise.swell = noise.swell.map(|swell| Swell { std: swell.std * scaled.scale, ..swell });
        let place = p + Actuator::SCALE;
        let of_scale = problem.fits[Actuator::SCALE].then(|| OfScale {
            scale: optimum.point.actuator.log_scale.exp(),
            covariance: covariance.column(place).rows(0, p).into_owned(),
            variance: covariance[(place, place)],
        });
        let mut gains = match gains::of_plant(&scaled.plant, &scaled.covariance, of_scale.as_ref())
        {
            Some(fitted) => fitted,
            None => {
                alike.into_iter().map(|(name, own)| (name, own.scaled(of_scale.as_ref()))).collect()
            }
        };
        let reversed = |scaled: Scaled, name: &String| {
            let std = gains.get(name).map_or(0.0, |own| own.std);
            scaled.with_reversed(name, std)
        };
        let Scaled { plant, covariance: of_plant, thrust_covariance, .. } =
            wiring.reversed.iter().try_fold(scaled, reversed)?;
        for name in &wiring.reversed {
            let beyond = gains::in_reverse(&plant, name);
            gains.entry(name.clone()).and_modify(|own| *own = own.reversed(beyond));
        }
        inflation.resize(plant.coefficients().len(), 1.0);
        let axes = problem.structure.axes().iter().copied();
        Ok(PlantFit {
            plant: plant.pruned()?,
            method,
            inflation,
            covariance: of_plant,
            thrust_covariance,
            actuator: Actuator { steering: steering.gear, ..optimum.point.actuator },
            steering_std: steering.std,
            actuator_std: std::array::from_fn(std_of_actuator),
            unseen_exponent,
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
            misalignment_std: reported.misalignment_std,
            is_along_world: problem.is_along_world,
            other_place: None,
            current_drift: current_drift(&optimum.point.noise, &noise_covariance),
            swell: swell_force(&problem.structure, &noise, &noise_covariance),
            thrust_jitter_s: thrust_jitter(&optimum.point.noise, &noise_covariance),
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
            exchanged: wiring.exchanged,
            gains,
            claims,
        })
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
    pub(super) fn instrument_noise(&self) -> InstrumentNoise {
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

    /// The same where all of thrust may be of another scale: each coefficient has this part of it as another standard
    /// deviation, but for gains, which are of thrusters beside each other.
    pub(crate) fn of_unsure_scale(mut self, part: f64) -> Self {
        let structure = self.plant.structure();
        let with_thrust = structure.terms().iter().zip(self.plant.coefficients());
        let with_thrust = with_thrust.map(|(term, value)| match thruster_of(structure, term) {
            Some(_) => 0.0,
            None => part * value,
        });
        let with_thrust = DVector::from_vec(with_thrust.collect());
        let own = &with_thrust * with_thrust.transpose();
        self.thrust_covariance += &own;
        self.covariance += own;
        self
    }

    /// The same where another plant explains the trials as well: a coefficient may be anything between its own value and
    /// the other's, zero if the other lacks it.
    pub(crate) fn or(mut self, other: &Self) -> Self {
        let theirs = other.plant.structure().names();
        let theirs: BTreeMap<&str, f64> = theirs
            .iter()
            .map(String::as_str)
            .zip(other.plant.coefficients().iter().copied())
            .collect();
        let names = self.plant.structure().names();
        let apart = names.iter().zip(self.plant.coefficients()).map(|(name, own)| {
            (theirs.get(name.as_str()).copied().unwrap_or(0.0) - own) / 3_f64.sqrt()
        });
        let apart = DVector::from_vec(apart.collect());
        self.covariance += &apart * apart.transpose();
        self
    }

    /// Standard deviation of a coefficient.
    pub fn std(&self, term: &Basis) -> Option<f64> {
        let k = self.plant.structure().index_of(term)?;
        Some(self.covariance[(k, k)].sqrt())
    }
}
