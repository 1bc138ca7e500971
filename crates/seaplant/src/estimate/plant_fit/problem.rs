//! What is fitted: all quantities, the trials, and the likelihood with its slopes.

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{DMatrix, DVector, Matrix6};

use super::actuator::Actuator;
use super::filter::{
    Filter, Gains, Innovation, InstrumentNoise, Layout, Noise, NoiseNumber, Pass, PassInput, Slope,
    ThrustChanges,
};
use super::schedule::{Attitude, Schedule, known_together};
use super::sensor_lag::SensorLag;
use super::uncertainty::inverse;
use crate::motion::{HeldForces, KnownForce, Load};
use crate::plant::{Parameterisation, Physical, Plant, Structure};
use crate::signal::sample_noise;
use crate::{Dof, Error, ThrustUncertainty, Timed, TrialRecord, parallel};

/// All estimated quantities.
#[derive(Clone, Debug)]
pub(super) struct Point {
    /// Free parameters of the plant.
    pub(super) free: DVector<f64>,
    /// Model of the thrust between log and vehicle.
    pub(super) actuator: Actuator,
    /// Mean current of each trial, north and east, m/s.
    pub(super) currents: Vec<[f64; 2]>,
    /// Disturbance and measurement noise, common to all trials.
    pub(super) noise: Noise,
    /// The actuator whose changes of thrust have jitter: that at which a descent with its noise began.
    pub(super) jitter_of: Actuator,
}

/// Estimation problem of a plant from several trials.
#[derive(Clone)]
pub(super) struct Problem {
    pub(super) structure: Structure,
    pub(super) physical: Physical,
    /// Names of the trials.
    pub(super) trials: Arc<[String]>,
    /// The fitted data: complete trials, or pieces of them.
    pub(super) schedules: Arc<[Schedule]>,
    /// Pieces of the trials for the first steps.
    pub(super) pieces: Option<Arc<[Schedule]>>,
    forces: Arc<ForceCache>,
    noise_information: Arc<NoiseInformation>,
    rigid_body: Option<Matrix6<f64>>,
    /// True for the numbers of the actuator that are fitted.
    pub(super) fits: [bool; Actuator::COUNT],
    /// True for those that the trials can show, whether anything of them shows or not.
    pub(super) can_show: [bool; Actuator::COUNT],
    /// True for those that stay fitted whatever the trials show.
    pub(super) requires: [bool; Actuator::COUNT],
    /// Prior standard deviation of the lag of propellers, s.
    pub(super) lag_std_s: f64,
    /// Initial model of the thrust between log and vehicle.
    pub(super) first_actuator: Actuator,
    /// True if thrusters are logged; otherwise the input is a wrench.
    pub(super) has_thrusters: bool,
    /// Uncertainty of the thrusters' strength: the greatest of any thruster.
    pub(super) thrust_uncertainty: ThrustUncertainty,
    /// Time between samples of thrust that is logged so slowly that its values between them matter, the longest of all
    /// trials, s; 0 if none is.
    pub(super) slow_period_s: f64,
    /// Time between samples of thrust, the longest of all trials, s; 0 of trials without thrust.
    pub(super) thrust_period_s: f64,
    /// How far slowly logged thrust on each axis is from its neighbours, of the trial with most of it; see
    /// [`TrialRecord::thrust_beyond_neighbours`].
    pub(super) beyond_neighbours: Vec<f64>,
    /// Known forces that act together, by the index that slices refer to.
    pub(super) known: Arc<[Vec<KnownForce>]>,
    /// Their sums, by the same index.
    pub(super) loads: Arc<[Load]>,
    /// Noise of each axis estimated from differences of its samples, m/s or rad/s.
    pub(super) sample_noise: Vec<f64>,
    /// True for axes whose velocity is differentiated from positions in any trial, in SNAME order.
    pub(super) by_slope: [bool; 6],
    /// True for translations with a velocity sensor in all trials, in SNAME order.
    may_be_late: [bool; 6],
    /// True if fixes of position measure translations in all trials.
    pub(super) has_fixes: bool,
    /// True if translations are measured along the world's axes in all trials, by velocity or position.
    pub(super) is_along_world: bool,
    /// True if heading tells of turns in all trials, where their rate is not measured.
    pub(super) has_heading: bool,
    /// True if a current is fitted: at least one translation is measured over ground.
    pub(super) has_current: bool,
    /// Attitude as known input or as state.
    pub(super) attitude: Attitude,
    /// Noise of roll and pitch estimated from differences of their samples, rad.
    pub(super) attitude_noise: f64,
    /// Sensor noise of positions and accelerations, estimated from differences of their samples.
    pub(super) instruments: InstrumentNoise,
    /// True for output error: no disturbance, so that all misfit is measurement noise.
    pub(super) is_free: bool,
}

/// Cache of a quantity that depends on the actuator, by schedule, for the last actuator: most passes use
/// the same one.
struct OfActuator<T>(Mutex<Option<(Actuator, Arc<[T]>)>>);

impl<T> Default for OfActuator<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T: Send> OfActuator<T> {
    /// Returns the quantity of each schedule.
    fn get(
        &self,
        actuator: &Actuator,
        schedules: &[Schedule],
        of: impl Fn(&Schedule) -> T + Sync,
    ) -> Arc<[T]> {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match last.as_ref().filter(|(own, _)| own == actuator) {
            Some((_, found)) => Arc::clone(found),
            None => {
                let found: Arc<[T]> =
                    parallel::of_each(schedules.len(), |k| of(&schedules[k])).into();
                *last = Some((*actuator, Arc::clone(&found)));
                found
            }
        }
    }
}

/// Forces over the slices of each schedule, and their changes.
#[derive(Default)]
struct ForceCache {
    pushes: OfActuator<HeldForces>,
    thrust_changes: OfActuator<ThrustChanges>,
}

/// Fisher information of the logarithms of the noise for one measurement, for each set of numbers at the last
/// point at which it was computed. It takes longer than any gradient and hardly depends on the plant.
#[derive(Default)]
struct NoiseInformation(Mutex<Vec<InformationAt>>);

/// Information at a point of the noise.
struct InformationAt {
    numbers: Vec<NoiseNumber>,
    logarithms: DVector<f64>,
    information: DMatrix<f64>,
}

/// Change of any logarithm of the noise that leaves its information as it is.
const SAME_INFORMATION: f64 = 0.3;

impl NoiseInformation {
    fn get(
        &self,
        noise: &Noise,
        compute: impl FnOnce() -> Option<DMatrix<f64>>,
    ) -> Option<DMatrix<f64>> {
        let mut met = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (numbers, logarithms) = (noise.numbers(), noise.logarithms());
        let at = met.iter().position(|own| own.numbers == numbers);
        if let Some(own) = at.map(|at| &met[at])
            && (&own.logarithms - &logarithms).amax() <= SAME_INFORMATION
        {
            return Some(own.information.clone());
        }
        let information = compute()?;
        at.map(|at| met.swap_remove(at));
        met.push(InformationAt { numbers, logarithms, information: information.clone() });
        Some(information)
    }
}

/// Gradient and information of the likelihood by all fitted quantities and by delay, lag, lever arm
/// and misalignment of the velocity sensor.
pub(super) struct ReportSlope {
    slope: Slope,
    /// Index of the delay; the lag, if any, follows.
    late: usize,
    /// Index of the first of the three components of the lever arm; those of the misalignment follow.
    place: usize,
}

/// Number of components of lever arm and misalignment.
pub(super) const PLACE: usize = 6;

/// A Gauss–Newton step of selected numbers and its covariance, with other numbers free.
pub(super) type Step = (DVector<f64>, DMatrix<f64>);

impl ReportSlope {
    /// Computes the step of delay and lag, s; of the delay alone where there is no lag. The
    /// selected components of lever arm and misalignment are free, the others fixed.
    pub(super) fn delay_and_lag_step(&self, are_free: [bool; PLACE]) -> Step {
        let free = (0..PLACE).filter(|k| are_free[*k]).map(|k| self.place + k);
        self.step(free.collect(), (self.late..self.place).collect())
    }

    /// Computes the step of the lag, s, with delay, lever arm and misalignment fixed.
    pub(super) fn lag_step(&self) -> Step {
        self.step(Vec::new(), vec![self.late + 1])
    }

    /// Computes the step of some components of lever arm, m, and misalignment, rad, with delay and lag
    /// free.
    pub(super) fn place_step(&self, components: Range<usize>) -> Step {
        let wanted = components.map(|k| self.place + k);
        self.step((self.late..self.place).collect(), wanted.collect())
    }

    fn step(&self, free: Vec<usize>, wanted: Vec<usize>) -> Step {
        let all: Vec<usize> = (0..self.late).chain(free).chain(wanted.iter().copied()).collect();
        let first = all.len() - wanted.len();
        let information = self.slope.information.select_rows(&all).select_columns(&all);
        let covariance = inverse(&information);
        let step = -(covariance.rows(first, wanted.len()) * self.slope.gradient.select_rows(&all));
        let own = (wanted.len(), wanted.len());
        (step, covariance.view((first, first), own).into_owned())
    }
}

/// Prior standard deviation of each component of a current, m/s.
pub(super) const CURRENT_STD: f64 = 1.0;

/// Information of a held coefficient times its square: a relative standard deviation of 1e-9.
const KNOWN: f64 = 1e18;

/// Minimum number of scalar measurements per coefficient in the pieces of the trials.
const SAMPLES_PER_TERM: usize = 50;

impl Problem {
    pub(super) fn new(
        structure: &Structure,
        records: &[&TrialRecord],
        rigid_body: Option<Matrix6<f64>>,
        is_free: bool,
        attitude: Attitude,
    ) -> Self {
        let axes = structure.axes();
        let thrusters = || records.iter().flat_map(|record| &record.thrusters);
        let has_thrusters = thrusters().next().is_some();
        let uncertainties = thrusters().map(|thruster| thruster.track.uncertainty);
        let noise = |axis: usize| {
            let measured = records.iter().filter_map(|record| record.velocity[axis].as_ref());
            sample_noise(measured).unwrap_or(0.0).max(LEAST_NOISE)
        };
        let slow_period_s =
            records.iter().map(|record| record.slow_thrust_period_s()).fold(0.0, f64::max);
        let thrust_period_s =
            records.iter().map(|record| record.thrust_period_s()).fold(0.0, f64::max);
        let beyond = |dof: &Dof| {
            let slow = records.iter().filter(|_| slow_period_s > 0.0);
            slow.map(|record| record.thrust_beyond_neighbours(*dof)).fold(0.0, f64::max)
        };
        let schedules = Schedule::complete(records, structure, attitude, SensorLag::default());
        let inclinations = records.iter().flat_map(|record| record.inclination.iter().flatten());
        let pieces = Schedule::pieces(records, structure, attitude, SensorLag::default());
        let samples: usize = pieces.iter().map(Schedule::samples).sum();
        let known: Arc<[Vec<KnownForce>]> = known_together(records).into();
        let are_enough = samples >= SAMPLES_PER_TERM * structure.terms().len();
        let can_show = Actuator::shown_by(records, axes);
        let mut fits = can_show;
        // Hardly any propeller has it, and it is tried by its score.
        fits[Actuator::FALLING_LAG_RATIO] = false;
        Self {
            structure: structure.clone(),
            physical: Physical::new(structure, rigid_body),
            trials: records.iter().map(|record| record.trial.clone()).collect(),
            instruments: first_instruments(records, &schedules),
            schedules,
            pieces: are_enough.then_some(pieces),
            forces: Arc::default(),
            noise_information: Arc::default(),
            rigid_body,
            fits,
            can_show,
            requires: [false; Actuator::COUNT],
            lag_std_s: Actuator::PRIOR_STD[Actuator::LAG],
            first_actuator: Actuator::first(records),
            has_thrusters,
            thrust_uncertainty: ThrustUncertainty::greatest(uncertainties),
            slow_period_s,
            thrust_period_s,
            beyond_neighbours: axes.iter().map(beyond).collect(),
            loads: known.iter().map(|acting| Load::of(acting)).collect(),
            known,
            sample_noise: axes.iter().map(|dof| noise(dof.index())).collect(),
            by_slope: std::array::from_fn(|k| records.iter().any(|record| record.by_slope[k])),
            may_be_late: std::array::from_fn(|k| {
                records.iter().all(|record| record.may_be_late(k))
            }),
            has_fixes: records.iter().all(|record| record.fixes.is_some()),
            is_along_world: records.iter().all(|record| record.is_turned || record.fixes.is_some()),
            has_heading: records.iter().all(|record| record.heading.is_some()),
            has_current: axes.iter().any(|dof| is_measured_over_ground(*dof, records)),
            attitude,
            attitude_noise: sample_noise(inclinations).unwrap_or(0.0).max(LEAST_NOISE),
            is_free,
        }
    }

    /// Returns the problem for other records of the same trials.
    pub(super) fn of(&self, records: &[&TrialRecord]) -> Self {
        self.again(records, self.attitude)
    }

    fn again(&self, records: &[&TrialRecord], attitude: Attitude) -> Self {
        let Self { structure, rigid_body, is_free, fits, requires, first_actuator, .. } = self;
        let new = Self::new(structure, records, *rigid_body, *is_free, attitude);
        let noise_information = Arc::clone(&self.noise_information);
        let new = Self {
            fits: *fits,
            requires: *requires,
            lag_std_s: self.lag_std_s,
            first_actuator: *first_actuator,
            has_current: self.has_current,
            noise_information,
            ..new
        };
        match self.sensor() {
            SensorLag { time_s: 0.0, .. } => new,
            sensor => new.with_sensor_lag(records, sensor),
        }
    }

    /// Returns the lag of velocity sensors that have states for it.
    fn sensor(&self) -> SensorLag {
        self.schedules.first().map_or_else(SensorLag::default, |schedule| schedule.sensor)
    }

    /// Returns the problem with velocity sensors that lag.
    pub(super) fn with_sensor_lag(&self, records: &[&TrialRecord], sensor: SensorLag) -> Self {
        let Self { structure, attitude, .. } = self;
        Self {
            schedules: Schedule::complete(records, structure, *attitude, sensor),
            pieces: self
                .pieces
                .as_ref()
                .map(|_| Schedule::pieces(records, structure, *attitude, sensor)),
            forces: Arc::default(),
            ..self.clone()
        }
    }

    /// Returns the problem for other records of the same trials, without pieces of them, for passes alone.
    pub(super) fn without_pieces(&self, records: &[&TrialRecord]) -> Self {
        let schedules = Schedule::complete(records, &self.structure, self.attitude, self.sensor());
        Self { schedules, pieces: None, forces: Arc::default(), ..self.clone() }
    }

    /// Returns the problem with attitude as a state.
    pub(super) fn with_attitude(&self, records: &[&TrialRecord]) -> Self {
        self.again(records, Attitude::State)
    }

    /// Returns the problem with a known model of the thrust between log and vehicle.
    pub(super) fn with_known_actuator(self, actuator: Actuator) -> Self {
        Self { fits: [false; Actuator::COUNT], first_actuator: actuator, ..self }
    }

    /// Returns true if a sensor measures the velocity of a translation in all trials, so that a
    /// delay of that sensor can be estimated.
    pub(super) fn may_be_late(&self, dof: Dof) -> bool {
        self.may_be_late[dof.index()]
    }

    /// Returns true if a sensor measures the velocity of any translation in all trials.
    pub(super) fn measures_velocity(&self) -> bool {
        self.may_be_late.contains(&true)
    }

    /// Returns the mass matrix of the rigid body if it is stated.
    pub(super) fn rigid_body(&self) -> Option<Matrix6<f64>> {
        self.rigid_body
    }

    /// Returns the number of scalar measurements.
    pub(super) fn samples(&self) -> usize {
        self.schedules.iter().map(Schedule::samples).sum()
    }

    /// Returns the problem for the same trials and axes with other terms.
    pub(super) fn with_terms(&self, structure: Structure) -> Self {
        Self { physical: Physical::new(&structure, self.rigid_body), structure, ..self.clone() }
    }

    /// Returns the problem on pieces of the trials if these have enough samples.
    pub(super) fn in_pieces(&self) -> Option<Self> {
        let schedules = Arc::clone(self.pieces.as_ref()?);
        Some(Self { schedules, pieces: None, forces: Arc::default(), ..self.clone() })
    }

    pub(super) fn plant(&self, free: &DVector<f64>) -> Result<Plant, Error> {
        let coefficients = self.physical.coefficients(free);
        Plant::new(self.structure.clone(), coefficients.iter().copied().collect())
    }

    /// Runs one pass over each schedule in parallel; results are in the order of the schedules.
    ///
    /// # Errors
    /// [`Error::Plant`] if the mass matrix is not positive definite.
    pub(super) fn each<T: Send>(
        &self,
        point: &Point,
        work: impl Fn(usize, &dyn Pass) -> T + Sync,
    ) -> Result<Vec<T>, Error> {
        let plant = self.plant(&point.free)?;
        let filter = <dyn Filter>::of(&plant, &self.loads, self.attitude)?;
        let of = |actuator: Actuator| {
            let axes = self.structure.axes();
            move |schedule: &Schedule| actuator.pushes(&schedule.thrust, &schedule.slices, axes)
        };
        let pushes = self.forces.pushes.get(&point.actuator, &self.schedules, of(point.actuator));
        let has_log = self.thrust_period_s > 0.0;
        let thrust_changes = point.noise.jitter_s.filter(|_| has_log).map(|_| {
            let pushes = of(point.jitter_of);
            self.forces.thrust_changes.get(&point.jitter_of, &self.schedules, |schedule| {
                ThrustChanges::of(&pushes(schedule), &schedule.slices, self.thrust_period_s)
            })
        });
        Ok(parallel::of_each(self.schedules.len(), |k| {
            let (schedule, pushes) = (&self.schedules[k], &pushes[k]);
            let thrust_changes = thrust_changes.as_ref().map(|thrust_changes| &thrust_changes[k]);
            let current = point.currents[schedule.trial];
            let (noise, fits) = (&point.noise, self.fits);
            work(
                k,
                &*filter.pass(PassInput { schedule, pushes, thrust_changes, current, noise, fits }),
            )
        }))
    }

    /// Computes gradient and information by coefficients, actuator and currents, and the gains of
    /// the filter.
    pub(super) fn by_plant(&self, point: &Point) -> Option<(Slope, Vec<Gains>)> {
        let found = self.each(point, |_, pass| pass.by_plant()).ok()?;
        let (slopes, gains): (Vec<Slope>, Vec<_>) = found.into_iter().unzip();
        Some((self.summed(point, &slopes)?, gains))
    }

    /// Computes the score statistic of a number of the actuator that is not fitted: the gain in
    /// twice the log-likelihood, to second order, in addition to all that is fitted,
    /// `g² / (I_kk − I_kr I_rr⁻¹ I_rk)`. Takes one pass of the filter; `None` where it diverges.
    ///
    /// # Source
    /// \[Rao1948\].
    pub(super) fn score(&self, point: &Point, number: usize) -> Option<f64> {
        let (slope, _) = self.by_plant(point)?;
        let place = self.structure.terms().len() + number;
        let rest: Vec<usize> = (0..slope.gradient.len()).filter(|k| *k != place).collect();
        let cross = slope.information.column(place).select_rows(&rest);
        let of_rest = inverse(&slope.information.select_rows(&rest).select_columns(&rest));
        let left = slope.information[(place, place)] - cross.dot(&(&of_rest * &cross));
        Some(slope.gradient[place].powi(2) / left)
    }

    /// Computes gradient and information of all coefficients, numbers of the actuator and currents,
    /// including those that are not fitted, without priors.
    pub(super) fn slope_of_all(&self, point: &Point) -> Option<Slope> {
        let all = Self { fits: [true; Actuator::COUNT], ..self.clone() };
        let slopes = all.each(point, |_, pass| pass.by_plant().0).ok()?;
        all.gathered(&slopes)
    }

    /// Computes gradient and information including changes of the velocity sensor's delay, lag, lever
    /// arm and misalignment from their present values.
    pub(super) fn slope_by_report(&self, point: &Point, lag_s: f64) -> Option<ReportSlope> {
        let slopes = self.each(point, |_, pass| pass.by_plant_and_report(lag_s)).ok()?;
        let slope = self.summed(point, &slopes)?;
        let place = slope.gradient.len() - PLACE;
        let late = place - if lag_s > 0.0 { 2 } else { 1 };
        Some(ReportSlope { slope, late, place })
    }

    /// Sums the gradients of all schedules, with separate currents for each trial; derivatives
    /// after the current come last.
    fn gathered(&self, slopes: &[Slope]) -> Option<Slope> {
        let of_all = 2 * (self.trials.len() - 1);
        let mut sum = Slope::zeros(slopes.first()?.gradient.len() + of_all);
        for (schedule, slope) in self.schedules.iter().zip(slopes) {
            self.add(slope, schedule.trial, &mut sum);
        }
        Some(sum)
    }

    /// Adds the gradient of one schedule of a trial to the sum.
    fn add(&self, slope: &Slope, trial: usize, sum: &mut Slope) {
        let p = self.structure.terms().len() + Actuator::COUNT;
        let place = |k: usize| match k.checked_sub(p) {
            None => k,
            Some(0 | 1) => k + 2 * trial,
            Some(_) => k + 2 * (self.trials.len() - 1),
        };
        sum.cost += slope.cost;
        sum.misfit += slope.misfit;
        let count = slope.gradient.len();
        for i in 0..count {
            sum.gradient[place(i)] += slope.gradient[i];
            for j in 0..count {
                sum.information[(place(i), place(j))] += slope.information[(i, j)];
            }
        }
    }

    /// Computes the gradient of all fitted quantities, and the contribution of each trial to it.
    pub(super) fn by_trial(&self, point: &Point) -> Option<(Slope, Vec<Slope>)> {
        let slopes = self.each(point, |_, pass| pass.by_plant().0).ok()?;
        let all = self.summed(point, &slopes)?;
        let mut parts = vec![Slope::zeros(all.gradient.len()); self.trials.len()];
        for (schedule, slope) in self.schedules.iter().zip(&slopes) {
            self.add(slope, schedule.trial, &mut parts[schedule.trial]);
        }
        Some((all, parts))
    }

    /// Sums the gradients of all schedules for the fitted quantities, including priors.
    fn summed(&self, point: &Point, slopes: &[Slope]) -> Option<Slope> {
        let (terms, mut sum) = (self.structure.terms().len(), self.gathered(slopes)?);
        for k in (0..Actuator::COUNT).filter(|k| !self.fits[*k]) {
            let place = terms + k;
            sum.gradient[place] = 0.0;
            sum.information.row_mut(place).fill(0.0);
            sum.information.column_mut(place).fill(0.0);
        }
        let of_terms = self.prior_coefficients(point).into_iter();
        let of_others = self.prior_numbers(point).enumerate().map(|(k, x)| (terms + k, x));
        for (k, (x, std)) in of_terms.chain(of_others) {
            sum.gradient[k] += x / (std * std);
            sum.information[(k, k)] += 1.0 / (std * std);
        }
        self.hold(&mut sum);
        sum.cost += self.prior(point);
        sum.cost.is_finite().then_some(sum)
    }

    /// Sets the gradient of held coefficients to zero and their information to that of known
    /// values.
    pub(super) fn hold(&self, slope: &mut Slope) {
        for (k, term) in self.structure.terms().iter().enumerate() {
            let Some(value) = self.structure.held(term) else { continue };
            slope.gradient[k] = 0.0;
            slope.information.row_mut(k).fill(0.0);
            slope.information.column_mut(k).fill(0.0);
            slope.information[(k, k)] = KNOWN / value.powi(2).max(f64::MIN_POSITIVE);
        }
    }

    pub(super) fn prior(&self, point: &Point) -> f64 {
        let of_terms = self.prior_coefficients(point).into_iter().map(|(_, number)| number);
        let half_square = |(x, std): (f64, f64)| 0.5 * (x / std).powi(2);
        of_terms.chain(self.prior_numbers(point)).map(half_square).sum()
    }

    /// Returns the numbers of the actuator and the currents, each with its prior standard
    /// deviation.
    fn prior_numbers(&self, point: &Point) -> impl Iterator<Item = (f64, f64)> {
        let currents = point.currents.as_flattened().iter().map(|x| (*x, CURRENT_STD));
        let mut std = Actuator::PRIOR_STD;
        std[Actuator::LAG] = self.lag_std_s;
        let ThrustUncertainty { forward, reverse } = self.thrust_uncertainty;
        if forward.max(reverse) > 0.0 {
            std[Actuator::SCALE] = forward.max(reverse);
        }
        point.actuator.numbers().into_iter().zip(std).chain(currents)
    }

    /// Returns the coefficients that have a prior about zero: index, value and prior standard
    /// deviation.
    fn prior_coefficients(&self, point: &Point) -> Vec<(usize, (f64, f64))> {
        let terms = self.structure.terms();
        let known = |(k, term)| Some((k, self.structure.prior_std(term)?));
        let known: Vec<(usize, f64)> = terms.iter().enumerate().filter_map(known).collect();
        if known.is_empty() {
            return Vec::new();
        }
        let coefficients = self.physical.coefficients(&point.free);
        known.into_iter().map(|(k, std)| (k, (coefficients[k], std))).collect()
    }

    pub(super) fn at_gains(&self, point: &Point, gains: &[Gains]) -> f64 {
        let costs = self.each(point, |k, pass| pass.at_gains(&gains[k]));
        costs.map_or(f64::INFINITY, |costs| costs.iter().sum::<f64>() + self.prior(point))
    }

    /// Computes the negative log-likelihood, including priors.
    pub(super) fn cost(&self, point: &Point) -> f64 {
        let costs = self.each(point, |_, pass| pass.cost());
        costs.map_or(f64::INFINITY, |costs| costs.iter().sum::<f64>() + self.prior(point))
    }

    /// Computes the innovations of each schedule.
    pub(super) fn innovations(&self, point: &Point) -> Result<Vec<Vec<Innovation>>, Error> {
        self.each(point, |_, pass| pass.innovations())
    }

    /// Computes the negative log-likelihood and its gradient by the logarithms of the noise.
    pub(super) fn by_noise(&self, point: &Point) -> Option<(f64, DVector<f64>)> {
        let parts = self.each(point, |_, pass| pass.noise_gradient()).ok()?;
        let (costs, gradients): (Vec<f64>, Vec<DVector<f64>>) = parts.into_iter().unzip();
        let cost: f64 = costs.iter().sum();
        cost.is_finite().then(|| (cost, gradients.iter().sum()))
    }

    /// Returns the Fisher information of the logarithms of the noise: that of pieces of the trials, by
    /// their number of samples, at a point that may differ by some tenths.
    pub(super) fn noise_information(&self, point: &Point) -> Option<DMatrix<f64>> {
        let of_one = self.noise_information.get(&point.noise, || {
            let pieces = self.in_pieces();
            let data = pieces.as_ref().unwrap_or(self);
            let parts = data.each(point, |_, pass| pass.noise_information()).ok()?;
            Some(parts.iter().sum::<DMatrix<f64>>() / data.samples() as f64)
        })?;
        Some(of_one * self.samples() as f64)
    }

    /// Returns true if no trial has a measured velocity of the axis at an index.
    pub(super) fn is_unmeasured(&self, place: usize) -> bool {
        let Some(dof) = self.structure.axes().get(place) else { return false };
        self.schedules.iter().all(|schedule| !schedule.is_measured[dof.index()])
    }
}

impl Point {
    /// Returns the point for a filter with attitude states.
    pub(super) fn with_attitude(self, problem: &Problem) -> Self {
        let noise = Noise { attitude: Some(problem.attitude_noise), ..self.noise };
        Self { noise, ..self }
    }

    /// Returns the free parameters of the plant, the numbers of the actuator and the currents.
    pub(super) fn numbers(&self) -> DVector<f64> {
        let (free, actuator) = (self.free.iter().copied(), self.actuator.numbers());
        let all = free.chain(actuator).chain(self.currents.as_flattened().iter().copied());
        DVector::from_vec(all.collect())
    }

    /// Returns the point after a step of these numbers, within limits.
    pub(super) fn moved(&self, step: &DVector<f64>, limits: &[(f64, f64)]) -> Self {
        let numbers = clamped(self.numbers() + step, limits);
        let (p, q) = (self.free.len(), self.free.len() + Actuator::COUNT);
        let mut moved = self.clone();
        moved.free.copy_from(&numbers.rows(0, p));
        moved.actuator = self.actuator.with(std::array::from_fn(|k| numbers[p + k]));
        let currents = moved.currents.as_flattened_mut();
        currents.copy_from_slice(&numbers.as_slice()[q..]);
        moved
    }
}

/// Clamps numbers to their limits, which a step may exceed by rounding.
pub(super) fn clamped(mut numbers: DVector<f64>, limits: &[(f64, f64)]) -> DVector<f64> {
    for (x, (low, high)) in numbers.iter_mut().zip(limits) {
        *x = x.clamp(*low, *high);
    }
    numbers
}

/// Returns true if any trial measures the velocity over ground of a translation, or a horizontal
/// position.
pub(super) fn is_measured_over_ground(dof: Dof, records: &[&TrialRecord]) -> bool {
    let has_measurement = |record: &&TrialRecord| record.is_measured(dof) || record.fixes.is_some();
    matches!(dof, Dof::Surge | Dof::Sway) && records.iter().any(has_measurement)
        || dof == Dof::Heave && records.iter().any(|record| record.is_measured(dof))
}

/// Estimates the noise of the sensors that schedules read from differences of their samples.
fn first_instruments(records: &[&TrialRecord], schedules: &[Schedule]) -> InstrumentNoise {
    let mut noise = InstrumentNoise::NONE;
    let mut set = |number: usize, value: f64| {
        (noise.numbers[number], noise.active[number]) = (value, true);
    };
    let of = |series: &dyn Fn(&TrialRecord) -> Option<Timed>| {
        let all: Vec<Timed> = records.iter().filter_map(|record| series(record)).collect();
        sample_noise(&all).unwrap_or(0.0).max(LEAST_NOISE)
    };
    let needs = |of: &dyn Fn(&Layout) -> bool| schedules.iter().any(|x| of(&x.layout));
    if needs(&|layout| layout.position.is_some()) {
        set(InstrumentNoise::POSITION, of(&|record| record.fixes.as_ref()?[0].clone()));
    }
    if needs(&|layout| layout.depth.is_some()) {
        set(InstrumentNoise::DEPTH, of(&|record| record.depth.clone()));
    }
    if needs(&|layout| layout.heading.is_some()) {
        set(InstrumentNoise::HEADING, of(&|record| record.heading.clone()));
    }
    for axis in (0..3).filter(|axis| needs(&|layout| layout.gained[*axis].is_some())) {
        let felt = |record: &TrialRecord| Some(record.acceleration[axis].as_ref()?.mean.clone());
        set(InstrumentNoise::ACCELERATION + axis, of(&felt));
        set(InstrumentNoise::OFFSET, FIRST_OFFSET_M_S2);
        set(InstrumentNoise::OFFSET_CORRELATION, FIRST_OFFSET_CORRELATION_S);
    }
    noise
}

/// Initial standard deviation of the accelerometer offset, m/s²: corresponds to an attitude error
/// of a third of a degree.
const FIRST_OFFSET_M_S2: f64 = 0.05;

/// Initial correlation time of the offset, s.
const FIRST_OFFSET_CORRELATION_S: f64 = 60.0;

/// Lower limit of any sensor noise, in the sensor's unit.
const LEAST_NOISE: f64 = 1e-6;

/// Returns the initial noise of a fit: the residual of equation error on each axis counts as
/// disturbance.
pub(super) fn first_noise(problem: &Problem, residual: &[f64]) -> Noise {
    let axes = problem.structure.axes().len();
    Noise {
        disturbance: DVector::from_fn(axes, |i, _| residual[i].max(1e-9)),
        correlation_s: DVector::repeat(axes, FIRST_CORRELATION_S),
        velocity: DVector::from_column_slice(&problem.sample_noise),
        attitude: None,
        instruments: problem.instruments,
        drift: None,
        swell: None,
        jitter_s: None,
    }
}

/// Initial correlation time of disturbances, s.
const FIRST_CORRELATION_S: f64 = 3.0;
