//! Filter error estimation of a coupled plant: from a start to the optimum.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{DMatrix, DVector, Matrix6};

use super::actuator::Actuator;
use super::filter::{
    Filter, Gains, Innovation, InstrumentNoise, Layout, Noise, NoiseNumber, Over, Pass, Slope,
    Swell,
};
use super::schedule::{Attitude, PIECES_PART, Schedule, known_together};
use super::uncertainty::inverse;
use crate::estimate::descend::Parabola;
use crate::motion::{HeldForce, KnownForce, Load};
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
}

/// Estimation problem of a plant from several trials.
pub(super) struct Problem {
    pub(super) structure: Structure,
    pub(super) physical: Physical,
    /// Names of the trials.
    pub(super) trials: Arc<[String]>,
    /// The fitted data: complete trials, or pieces of them.
    pub(super) schedules: Arc<[Schedule]>,
    /// Pieces of the trials for the first steps.
    pieces: Option<Arc<[Schedule]>>,
    forces: Arc<ForceCache>,
    rigid_body: Option<Matrix6<f64>>,
    /// True for the numbers of the actuator that are fitted.
    pub(super) fits: [bool; Actuator::COUNT],
    /// Initial model of the thrust between log and vehicle.
    pub(super) first_actuator: Actuator,
    /// True if thrusters are logged; otherwise the input is a wrench.
    pub(super) has_thrusters: bool,
    /// Uncertainty of the thrusters' strength: the greatest of any thruster.
    pub(super) thrust_uncertainty: ThrustUncertainty,
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
    /// True if a current is fitted: at least one translation is measured over ground.
    pub(super) has_current: bool,
    /// Attitude as known input or as state.
    pub(super) attitude: Attitude,
    /// Noise of roll and pitch estimated from differences of their samples, rad.
    attitude_noise: f64,
    /// Sensor noise of positions and accelerations, estimated from differences of their samples.
    pub(super) instruments: InstrumentNoise,
    /// True for output error: no disturbance, so that all misfit is measurement noise.
    pub(super) is_free: bool,
}

/// Cache of the force over each slice of all schedules for the last actuator: most passes use the
/// same one.
#[derive(Default)]
struct ForceCache(Mutex<Option<(Actuator, HeldForces)>>);

/// Force over each slice of each schedule.
type HeldForces = Arc<[Vec<HeldForce>]>;

impl ForceCache {
    fn get(&self, actuator: &Actuator, schedules: &[Schedule]) -> HeldForces {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match last.as_ref().filter(|(own, _)| own == actuator) {
            Some((_, pushes)) => Arc::clone(pushes),
            None => {
                let of = |k: usize| actuator.pushes(&schedules[k].thrust, &schedules[k].slices);
                let pushes: HeldForces = parallel::of_each(schedules.len(), of).into();
                *last = Some((*actuator, Arc::clone(&pushes)));
                pushes
            }
        }
    }
}

/// Result of the optimisation.
#[derive(Clone, Debug)]
pub(super) struct Optimum {
    pub(super) point: Point,
    /// Negative log-likelihood.
    pub(super) cost: f64,
    /// Fisher information of coefficients, actuator and currents, including priors.
    pub(super) information: DMatrix<f64>,
    /// Fisher information of the logarithms of the noise; zero for output error.
    pub(super) noise_information: DMatrix<f64>,
    /// Number of iterations.
    pub(super) iterations: usize,
}

/// Gradient and information of the likelihood by all fitted quantities and by delay, lag and lever
/// arm of the velocity sensor.
pub(super) struct ReportSlope {
    slope: Slope,
    /// Index of the delay; the lag, if any, follows.
    late: usize,
    /// Index of the first of the three components of the lever arm.
    levers: usize,
}

/// A Gauss–Newton step of selected numbers and its covariance, with other numbers free.
pub(super) type Step = (DVector<f64>, DMatrix<f64>);

impl ReportSlope {
    /// Computes the step of delay and lag, s; of the delay alone where there is no lag. The
    /// selected components of the lever arm are free, the others fixed.
    pub(super) fn delay_and_lag_step(&self, are_free: [bool; 3]) -> Step {
        let free = (0..3).filter(|along| are_free[*along]).map(|along| self.levers + along);
        self.step(free.collect(), (self.late..self.levers).collect())
    }

    /// Computes the step of the lag, s, with delay and lever arm fixed.
    pub(super) fn lag_step(&self) -> Step {
        self.step(Vec::new(), vec![self.late + 1])
    }

    /// Computes the step of the lever arm, m, with delay and lag free.
    pub(super) fn lever_step(&self) -> Step {
        let levers = self.levers..self.levers + 3;
        self.step((self.late..self.levers).collect(), levers.collect())
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

/// Treatment of the noise during a descent.
#[derive(Clone, Copy, Debug, PartialEq)]
enum WithNoise {
    Fitted,
    Kept,
}

/// Prior standard deviation of each component of a current, m/s.
pub(super) const CURRENT_STD: f64 = 1.0;

/// Information of a held coefficient times its square: a relative standard deviation of 1e-9.
const KNOWN: f64 = 1e18;

/// Maximum number of iterations of a fit.
const MOST_STEPS: usize = 60;

/// Maximum number of steps of the noise between two of the plant.
const MOST_NOISE_STEPS: usize = 8;

/// Convergence tolerance of a fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerance {
    /// The iteration stops when the expected gain in log-likelihood of a step is below this.
    plant: f64,
    /// The same for a step of the noise, whose parameters matter less. At the true value of some twenty of
    /// them the log-likelihood is some ten below its maximum.
    pub(super) noise: f64,
    /// True where the noise may be fitted to pieces of the trials.
    is_coarse: bool,
}

impl Tolerance {
    /// Steps of every coefficient are below 3 % of its standard deviation.
    pub(super) const FINE: Self = Self { plant: 5e-4, noise: 0.2, is_coarse: false };
    /// Steps of every coefficient are below half of its standard deviation: sufficient for a search
    /// of missing terms and as a start for a finer fit.
    pub(super) const COARSE: Self = Self { plant: 0.1, noise: 0.5, is_coarse: true };

    /// Returns the tolerance for output error, where the correlated misfit makes about a hundred
    /// samples worth one independent sample.
    fn for_output_error(self) -> Self {
        Self { plant: 100.0 * self.plant, noise: 100.0 * self.noise, ..self }
    }

    /// Returns the actual gain below which a step is the last, whatever gain was expected.
    fn least_gain(self) -> f64 {
        0.1 * self.plant
    }
}

/// Minimum number of scalar measurements per coefficient in the pieces of the trials.
const SAMPLES_PER_TERM: usize = 50;

/// Maximum step of a logarithm of the noise.
const GREATEST_LOG_STEP: f64 = 1.0;

/// Information on the logarithm of a disturbance below which it is absent: it changes no likelihood.
const ABSENT: f64 = 1e-4;

/// Maximum downward step of the logarithm of a disturbance, …
const GREATEST_FALL: f64 = 3.0;
/// … and maximum upward step.
const GREATEST_RISE: f64 = 6.0;

/// Limits of the disturbance's correlation time, s: a shorter one is indistinguishable from
/// measurement noise, a longer one from a constant.
const CORRELATION_S: [f64; 2] = [0.2, 300.0];

/// Limits of the standard deviation of the current's variation, m/s.
const DRIFT_STD_M_S: [f64; 2] = [1e-4, 1.0];

/// Limits of the correlation time of the current's variation, s: shorter is turbulence or sensor
/// noise, longer is constant during a trial.
const DRIFT_CORRELATION_S: [f64; 2] = [10.0, 1000.0];

/// Lower limit of measurement noise as a fraction of the estimate from differences of samples:
/// otherwise a disturbance that explains every sample could reduce it to zero.
const LEAST_NOISE_PART: f64 = 0.1;

/// Damping of Gauss–Newton steps: initial value, factor, limits.
const DAMPING: f64 = 1e-4;
const DAMPING_FACTOR: f64 = 8.0;
const MOST_DAMPING: f64 = 1e8;
const LEAST_DAMPING: f64 = 1e-9;

/// Initial and least damping of steps of the noise, whose curvature is known less well.
const NOISE_DAMPING: f64 = 0.02;

/// Gain of a step of the plant above which earlier steps of the noise say nothing of its curvature.
const KEPT_BELOW: f64 = 1.0;

/// Descent of the noise: what its steps have shown carries over to the next.
struct NoiseDescent {
    damping: f64,
    /// Logarithms of the noise, and their Fisher information there.
    known: Option<(DVector<f64>, DMatrix<f64>)>,
    /// Logarithms of the noise at the last point, and the gradient there.
    last: Option<(DVector<f64>, DVector<f64>)>,
    /// Steps, and the change of the gradient over each; the latest is last.
    steps: Vec<(DVector<f64>, DVector<f64>)>,
}

/// Change of any logarithm of the noise that leaves its information as it is.
const SAME_INFORMATION: f64 = 0.3;

impl NoiseDescent {
    const fn new() -> Self {
        Self { damping: NOISE_DAMPING, known: None, last: None, steps: Vec::new() }
    }

    /// Forgets past steps, as the likelihood is another one with another plant.
    fn forget(&mut self) {
        (self.last, self.steps) = Default::default();
    }

    /// Returns the Fisher information at a point, if it was computed near it.
    fn information_at(&self, logarithms: &DVector<f64>) -> Option<DMatrix<f64>> {
        let (known, information) = self.known.as_ref()?;
        let is_near =
            known.len() == logarithms.len() && (known - logarithms).amax() <= SAME_INFORMATION;
        is_near.then(|| information.clone())
    }

    /// Estimates the Hessian at a point: its Fisher information, which is the Hessian only where the
    /// model is true, with the update of Broyden, Fletcher, Goldfarb and Shanno for each step so far.
    ///
    /// # Source
    /// [NocedalWright2006, eq. 6.19].
    fn hessian(
        &mut self,
        at: &DVector<f64>,
        gradient: &DVector<f64>,
        information: &DMatrix<f64>,
    ) -> DMatrix<f64> {
        if let Some((before, gradient_before)) = &self.last {
            let (step, change) = (at - before, gradient - gradient_before);
            if step.dot(&change) > 0.0 {
                self.steps.push((step, change));
            }
        }
        self.last = Some((at.clone(), gradient.clone()));
        let mut hessian = information.clone();
        for (step, change) in &self.steps {
            let expected = &hessian * step;
            let curvature = step.dot(&expected);
            if curvature > 0.0 {
                hessian -= &expected * expected.transpose() / curvature;
                hessian += change * change.transpose() / step.dot(change);
            }
        }
        hessian
    }
}

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
        let schedules = Schedule::complete(records, structure, attitude);
        let inclinations = records.iter().flat_map(|record| record.inclination.iter().flatten());
        let pieces = Schedule::pieces(records, structure, attitude);
        let samples: usize = pieces.iter().map(Schedule::samples).sum();
        let known: Arc<[Vec<KnownForce>]> = known_together(records).into();
        let are_enough = samples >= SAMPLES_PER_TERM * structure.terms().len();
        Self {
            structure: structure.clone(),
            physical: Physical::new(structure, rigid_body),
            trials: records.iter().map(|record| record.trial.clone()).collect(),
            instruments: first_instruments(records, &schedules),
            schedules,
            pieces: are_enough.then_some(pieces),
            forces: Arc::default(),
            rigid_body,
            fits: Actuator::fitted(records, axes),
            first_actuator: Actuator::first(records),
            has_thrusters,
            thrust_uncertainty: ThrustUncertainty::greatest(uncertainties),
            loads: known.iter().map(|acting| Load::of(acting)).collect(),
            known,
            sample_noise: axes.iter().map(|dof| noise(dof.index())).collect(),
            by_slope: std::array::from_fn(|k| records.iter().any(|record| record.by_slope[k])),
            may_be_late: std::array::from_fn(|k| {
                records.iter().all(|record| record.may_be_late(k))
            }),
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
        let Self { structure, rigid_body, is_free, fits, first_actuator, .. } = self;
        let new = Self::new(structure, records, *rigid_body, *is_free, attitude);
        Self { fits: *fits, first_actuator: *first_actuator, ..new }
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

    /// Returns the number of scalar measurements.
    pub(super) fn samples(&self) -> usize {
        self.schedules.iter().map(Schedule::samples).sum()
    }

    /// Returns the problem for the same trials and axes with other terms.
    pub(super) fn with_terms(&self, structure: Structure) -> Self {
        Self {
            physical: Physical::new(&structure, self.rigid_body),
            structure,
            trials: Arc::clone(&self.trials),
            schedules: Arc::clone(&self.schedules),
            pieces: self.pieces.clone(),
            forces: Arc::clone(&self.forces),
            rigid_body: self.rigid_body,
            fits: self.fits,
            first_actuator: self.first_actuator,
            has_thrusters: self.has_thrusters,
            thrust_uncertainty: self.thrust_uncertainty,
            known: Arc::clone(&self.known),
            loads: Arc::clone(&self.loads),
            sample_noise: self.sample_noise.clone(),
            by_slope: self.by_slope,
            may_be_late: self.may_be_late,
            has_current: self.has_current,
            attitude: self.attitude,
            attitude_noise: self.attitude_noise,
            instruments: self.instruments,
            is_free: self.is_free,
        }
    }

    /// Returns the problem on pieces of the trials if these have enough samples.
    pub(super) fn in_pieces(&self) -> Option<Self> {
        let schedules = Arc::clone(self.pieces.as_ref()?);
        let whole = self.with_terms(self.structure.clone());
        Some(Self { schedules, pieces: None, forces: Arc::default(), ..whole })
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
        let pushes = self.forces.get(&point.actuator, &self.schedules);
        Ok(parallel::of_each(self.schedules.len(), |k| {
            let (schedule, pushes) = (&self.schedules[k], &pushes[k]);
            let current = point.currents[schedule.trial];
            work(k, &*filter.pass(Over { schedule, pushes, current, noise: &point.noise }))
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

    /// Computes the information of all coefficients, numbers of the actuator and currents,
    /// including those that are not fitted, without priors.
    pub(super) fn information_of_all(&self, point: &Point) -> Option<DMatrix<f64>> {
        let slopes = self.each(point, |_, pass| pass.by_plant().0).ok()?;
        Some(self.gathered(&slopes)?.information)
    }

    /// Computes gradient and information including changes of the velocity sensor's delay, lag and
    /// lever arm from their present values.
    pub(super) fn slope_by_report(&self, point: &Point, lag_s: f64) -> Option<ReportSlope> {
        let slopes = self.each(point, |_, pass| pass.by_plant_and_report(lag_s)).ok()?;
        let slope = self.summed(point, &slopes)?;
        let levers = slope.gradient.len() - 3;
        let late = levers - if lag_s > 0.0 { 2 } else { 1 };
        Some(ReportSlope { slope, late, levers })
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

    fn prior(&self, point: &Point) -> f64 {
        let of_terms = self.prior_coefficients(point).into_iter().map(|(_, number)| number);
        let half_square = |(x, std): (f64, f64)| 0.5 * (x / std).powi(2);
        of_terms.chain(self.prior_numbers(point)).map(half_square).sum()
    }

    /// Returns the numbers of the actuator and the currents, each with its prior standard
    /// deviation.
    fn prior_numbers(&self, point: &Point) -> impl Iterator<Item = (f64, f64)> {
        let currents = point.currents.as_flattened().iter().map(|x| (*x, CURRENT_STD));
        let mut std = Actuator::PRIOR_STD;
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
        let costs = self.each(point, |_, pass| pass.innovations().0);
        costs.map_or(f64::INFINITY, |costs| costs.iter().sum::<f64>() + self.prior(point))
    }

    /// Computes the innovations of each schedule.
    pub(super) fn innovations(&self, point: &Point) -> Result<Vec<Vec<Innovation>>, Error> {
        self.each(point, |_, pass| pass.innovations().1)
    }

    /// Computes the negative log-likelihood and its gradient by the logarithms of the noise.
    pub(super) fn by_noise(&self, point: &Point) -> Option<(f64, DVector<f64>)> {
        let parts = self.each(point, |_, pass| pass.noise_gradient()).ok()?;
        let (costs, gradients): (Vec<f64>, Vec<DVector<f64>>) = parts.into_iter().unzip();
        let cost: f64 = costs.iter().sum();
        cost.is_finite().then(|| (cost, gradients.iter().sum()))
    }

    /// Computes the Fisher information of the logarithms of the noise: that of pieces of the trials, by
    /// their number of samples, as it takes far longer than the gradient.
    pub(super) fn noise_information(&self, point: &Point) -> Option<DMatrix<f64>> {
        let pieces = self.in_pieces();
        let data = pieces.as_ref().unwrap_or(self);
        let parts = data.each(point, |_, pass| pass.noise_information()).ok()?;
        let part = self.samples() as f64 / data.samples() as f64;
        Some(parts.iter().sum::<DMatrix<f64>>() * part)
    }

    /// Returns true if output error is the fallback when this fit does not converge, so that
    /// further attempts are not worth their time.
    pub(super) fn has_rival(&self) -> bool {
        !self.is_free && self.structure.reads_beside_thrusters()
    }

    /// Finds the optimum from a start, with the first steps on pieces of the trials.
    ///
    /// # Errors
    /// [`Error::Plant`] if the fit does not converge.
    pub(super) fn optimum(&self, start: Point, tolerance: Tolerance) -> Result<Optimum, Error> {
        let pieces = self.in_pieces();
        if let Some(pieces) = pieces.as_ref().filter(|_| self.has_rival()) {
            let nearer = pieces.descent(start, Tolerance::COARSE)?;
            return self.descent(nearer.point, tolerance);
        }
        let on_pieces = |pieces: Self| pieces.descent(start.clone(), Tolerance::COARSE).ok();
        let nearer = pieces.and_then(on_pieces);
        let found = nearer.and_then(|nearer| self.descent(nearer.point, tolerance).ok());
        found.map_or_else(|| self.descent(start, tolerance), Ok)
    }

    /// Finds the optimum from a start: alternates steps of plant and currents at fixed filter gains
    /// with steps of the noise.
    ///
    /// # Errors
    /// [`Error::Plant`] if the fit does not converge.
    pub(super) fn descent(&self, start: Point, tolerance: Tolerance) -> Result<Optimum, Error> {
        self.descend(start, tolerance, WithNoise::Fitted)
    }

    /// Finds the optimum at fixed noise: for a plant with few more terms than the one with which
    /// the noise was fitted.
    ///
    /// # Errors
    /// As [`Self::descent`].
    pub(super) fn descent_at_noise(
        &self,
        start: Point,
        tolerance: Tolerance,
    ) -> Result<Optimum, Error> {
        self.descend(start, tolerance, WithNoise::Kept)
    }

    fn descend(
        &self,
        start: Point,
        tolerance: Tolerance,
        noise: WithNoise,
    ) -> Result<Optimum, Error> {
        let refuse =
            |reason: &str| Error::Plant { axes: self.structure.name(), reason: reason.to_owned() };
        let tolerance = if self.is_free { tolerance.for_output_error() } else { tolerance };
        let mut point = start;
        let mut damping = DAMPING;
        let mut of_noise = NoiseDescent::new();
        let mut is_kept = noise == WithNoise::Kept;
        let mut noise_is_settled = is_kept;
        let (mut gain, mut before) = (f64::INFINITY, [f64::INFINITY; 2]);
        for iterations in 0..MOST_STEPS {
            if !noise_is_settled {
                noise_is_settled = self.settle_noise(&mut point, tolerance, &mut of_noise, gain);
            }
            let (slope, gains) = self
                .by_plant(&point)
                .ok_or_else(|| refuse("its simulation diverges from the start; leave out terms, or use trials with more motion"))?;
            is_kept |= self.has_partial_noise(tolerance) && alternate(before, slope.cost);
            before = [before[1], slope.cost];
            gain = self.step_plant(&mut point, &slope, &gains, &mut damping, tolerance);
            if gain > KEPT_BELOW {
                of_noise.forget();
            }
            let is_last = gain < tolerance.plant;
            if is_last && noise_is_settled {
                let Slope { cost, information, .. } = slope;
                let iterations = iterations + 1;
                let noise_information = self.information_of_all_noise(&point, of_noise, tolerance);
                return Ok(Optimum { point, cost, information, noise_information, iterations });
            }
            noise_is_settled =
                is_kept || is_last && self.settle_noise(&mut point, tolerance, &mut of_noise, gain);
        }
        Err(refuse(
            "the fit did not converge; leave out terms, or use trials with more variation of speed and turning",
        ))
    }

    /// Makes a damped Gauss–Newton step of plant and currents; returns the expected gain of an
    /// undamped step.
    fn step_plant(
        &self,
        point: &mut Point,
        slope: &Slope,
        gains: &[Gains],
        damping: &mut f64,
        tolerance: Tolerance,
    ) -> f64 {
        let (gradient, hessian) = self.in_free_numbers(&point.free, slope);
        let (numbers, limits) = (point.numbers(), self.limits(point));
        let parabola =
            Parabola::new((&gradient, &hessian), (&numbers, &limits), |k| self.is_held(point, k));
        let at = slope.misfit + self.prior(point);
        let whole = parabola.step(LEAST_DAMPING);
        let expected = whole.map_or(f64::INFINITY, |step| 0.5 * parabola.promise(&step));
        while *damping < MOST_DAMPING {
            let Some(step) = parabola.step(*damping) else {
                *damping *= DAMPING_FACTOR;
                continue;
            };
            let moved = point.moved(&step, &limits);
            let there = self.at_gains(&moved, gains);
            if there <= at {
                *point = moved;
                *damping = (*damping / DAMPING_FACTOR).max(LEAST_DAMPING);
                // Where a limit shortens the step, the gain is less than expected.
                let gained = at - there;
                return if gained < tolerance.least_gain() { gained } else { expected };
            }
            if expected < tolerance.plant {
                return expected;
            }
            *damping *= DAMPING_FACTOR;
        }
        // No shorter step reduces the cost: this is the minimum, within rounding.
        *damping = DAMPING;
        0.0
    }

    /// Returns the lower and upper limit of each number of a point.
    fn limits(&self, point: &Point) -> Vec<(f64, f64)> {
        let lowest = self.physical.lowest().into_iter();
        let of_plant = lowest.map(|low| (low.unwrap_or(f64::NEG_INFINITY), f64::INFINITY));
        let of_currents = point.currents.iter().flatten();
        let of_currents = of_currents.map(|_| (f64::NEG_INFINITY, f64::INFINITY));
        of_plant.chain(Actuator::LIMITS).chain(of_currents).collect()
    }

    /// Returns true if a number of a point is not fitted.
    fn is_held(&self, point: &Point, k: usize) -> bool {
        let p = point.free.len();
        match k.checked_sub(p) {
            None => false,
            Some(k) => self.fits.get(k).map_or(!self.has_current, |fits| !fits),
        }
    }

    /// Converts gradient and information from coefficients to the plant's free parameters.
    fn in_free_numbers(&self, free: &DVector<f64>, slope: &Slope) -> (DVector<f64>, DMatrix<f64>) {
        let (p, all) = (free.len(), slope.gradient.len());
        let mut jacobian = DMatrix::identity(all, all);
        jacobian.view_mut((0, 0), (p, p)).copy_from(&self.physical.jacobian(free));
        let hessian = jacobian.transpose() * &slope.information * &jacobian;
        (jacobian.transpose() * &slope.gradient, hessian)
    }

    /// Returns true if the noise is fitted to pieces of the trials, which determine it well enough for a
    /// coarse fit. With position or acceleration sensors its gradient takes so long that they have to do
    /// at the optimum as well.
    fn has_partial_noise(&self, tolerance: Tolerance) -> bool {
        let is_enough = tolerance.is_coarse || self.instruments.count() > 0;
        is_enough && self.pieces.is_some()
    }

    /// Makes steps of the noise while each gains more than the last step of the plant promised;
    /// returns true if the noise has converged.
    fn settle_noise(
        &self,
        point: &mut Point,
        tolerance: Tolerance,
        descent: &mut NoiseDescent,
        promised: f64,
    ) -> bool {
        if self.is_free {
            return self.step_misfit(point, tolerance);
        }
        for _ in 0..MOST_NOISE_STEPS {
            match self.step_noise(point, tolerance, descent) {
                None => return true,
                Some(gained) if gained <= promised => return false,
                Some(_) => {}
            }
        }
        false
    }

    /// Returns the Fisher information of the noise that a descent knows, for all samples; zero where the
    /// noise was kept.
    fn information_of_all_noise(
        &self,
        point: &Point,
        descent: NoiseDescent,
        tolerance: Tolerance,
    ) -> DMatrix<f64> {
        let count = point.noise.count();
        let Some((_, information)) = descent.known else { return DMatrix::zeros(count, count) };
        let pieces = if self.has_partial_noise(tolerance) { self.in_pieces() } else { None };
        let part = pieces.map_or(1.0, |pieces| pieces.samples() as f64 / self.samples() as f64);
        information / part
    }

    /// Makes one step of the noise; returns its gain in log-likelihood, or `None` if the noise has
    /// converged.
    fn step_noise(
        &self,
        point: &mut Point,
        tolerance: Tolerance,
        descent: &mut NoiseDescent,
    ) -> Option<f64> {
        let pieces = if self.has_partial_noise(tolerance) { self.in_pieces() } else { None };
        let data = pieces.as_ref().unwrap_or(self);
        let needed = tolerance.noise * if pieces.is_some() { PIECES_PART } else { 1.0 };
        let logarithms = point.noise.logarithms();
        let (cost, gradient) = data.by_noise(point)?;
        let information = match descent.information_at(&logarithms) {
            Some(known) => known,
            None => {
                let information = data.noise_information(point)?;
                descent.known = Some((logarithms.clone(), information.clone()));
                information
            }
        };
        let limits = self.noise_limits(&point.noise);
        let hessian = descent.hessian(&logarithms, &gradient, &information);
        let damping = &mut descent.damping;
        // A disturbance that is absent and need not grow has no correlation time either.
        let is_absent = |axis: usize| information[(axis, axis)] < ABSENT && gradient[axis] >= 0.0;
        let numbers = point.noise.numbers();
        let is_held = |k: usize| match numbers[k] {
            NoiseNumber::Disturbance(axis) | NoiseNumber::Correlation(axis) => is_absent(axis),
            NoiseNumber::Velocity(axis) => self.is_unmeasured(axis),
            _ => false,
        };
        let parabola = Parabola::new((&gradient, &hessian), (&logarithms, &limits), is_held);
        while *damping < MOST_DAMPING {
            let Some(step) = parabola.step(*damping) else {
                *damping *= DAMPING_FACTOR;
                continue;
            };
            if 0.5 * parabola.promise(&step) < needed {
                return None;
            }
            // Each component is limited separately, so that one that diverges does not slow the
            // others.
            let is_first = *damping <= NOISE_DAMPING;
            let reached = step.iter().zip(&numbers).map(|(x, number)| {
                let x = if number.is_std() { as_step_of_variance(*x) } else { *x };
                // A disturbance that was or is absent has to change by orders of magnitude.
                let [down, up] = match number {
                    NoiseNumber::Disturbance(_) if is_first => [GREATEST_FALL, GREATEST_RISE],
                    NoiseNumber::Disturbance(_) => [GREATEST_FALL, GREATEST_LOG_STEP],
                    _ => [GREATEST_LOG_STEP; 2],
                };
                x.clamp(-down, up)
            });
            let step = DVector::from_iterator(step.len(), reached);
            let moved = clamped(&logarithms + step, &limits);
            let moved = Point { noise: point.noise.with_logarithms(&moved), ..point.clone() };
            let gained = cost + self.prior(point) - data.cost(&moved);
            if gained > 0.0 {
                *point = moved;
                *damping = (*damping / DAMPING_FACTOR).max(NOISE_DAMPING);
                // An absent disturbance decreases without limit and gains nothing.
                return (gained >= needed).then_some(gained);
            }
            *damping *= DAMPING_FACTOR;
        }
        *damping = NOISE_DAMPING;
        None
    }

    /// Returns true if no trial has a measured velocity of the axis at an index.
    pub(super) fn is_unmeasured(&self, place: usize) -> bool {
        let Some(dof) = self.structure.axes().get(place) else { return false };
        self.schedules.iter().all(|schedule| !schedule.is_measured[dof.index()])
    }

    /// Returns the lower and upper limit of each logarithm of the noise.
    fn noise_limits(&self, noise: &Noise) -> Vec<(f64, f64)> {
        let least = |of_samples: f64| [LEAST_NOISE_PART * of_samples, f64::INFINITY];
        let of = |number: &NoiseNumber| match *number {
            NoiseNumber::Disturbance(_) | NoiseNumber::Swell(_) => [0.0, f64::INFINITY],
            NoiseNumber::Correlation(_) => CORRELATION_S,
            NoiseNumber::Velocity(axis) => least(self.sample_noise[axis]),
            NoiseNumber::Attitude => least(self.attitude_noise),
            NoiseNumber::Instrument(InstrumentNoise::OFFSET) => OFFSET_M_S2,
            NoiseNumber::Instrument(InstrumentNoise::OFFSET_CORRELATION) => OFFSET_CORRELATION_S,
            NoiseNumber::Instrument(number) => least(self.instruments.numbers[number]),
            NoiseNumber::Drift => DRIFT_STD_M_S,
            NoiseNumber::DriftCorrelation => DRIFT_CORRELATION_S,
            NoiseNumber::SwellFrequency => Swell::FREQUENCY,
            NoiseNumber::SwellDamping => Swell::DAMPING,
        };
        noise.numbers().iter().map(|number| of(number).map(f64::ln).into()).collect()
    }
}

impl Point {
    /// Returns the point for a filter with attitude states.
    pub(super) fn with_attitude(self, problem: &Problem) -> Self {
        let noise = Noise { attitude: Some(problem.attitude_noise), ..self.noise };
        Self { noise, ..self }
    }

    /// Returns the free parameters of the plant, the numbers of the actuator and the currents.
    fn numbers(&self) -> DVector<f64> {
        let (free, actuator) = (self.free.iter().copied(), self.actuator.numbers());
        let all = free.chain(actuator).chain(self.currents.as_flattened().iter().copied());
        DVector::from_vec(all.collect())
    }

    /// Returns the point after a step of these numbers, within limits.
    fn moved(&self, step: &DVector<f64>, limits: &[(f64, f64)]) -> Self {
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

/// Converts a step x of ln σ to the one that changes σ² by as much as x promises, `σ² (1 + 2x)`: the
/// likelihood is closer to a parabola in variances than in their logarithms.
fn as_step_of_variance(x: f64) -> f64 {
    // No variance falls below a tenth.
    let part = 1.0 + 2.0 * x;
    if part > 0.1 { 0.5 * part.ln() } else { x.min(0.5 * 0.1_f64.ln()) }
}

/// Returns true if costs alternate between two values: the last is nearly that before the one before it.
/// Noise that is fitted to pieces of the trials and a plant that is fitted to all of them do so where pieces
/// differ from the rest.
fn alternate([before, last]: [f64; 2], cost: f64) -> bool {
    let swing = (cost - last).abs();
    swing > LEAST_SWING && (cost - before).abs() < CLOSED_PART * swing
}

/// Least swing of a cost: a coarse fit that converges changes it by less than one.
const LEAST_SWING: f64 = 10.0;
/// Part of a swing by which costs may differ that count as the same.
const CLOSED_PART: f64 = 0.05;

/// Clamps numbers to their limits, which a step may exceed by rounding.
fn clamped(mut numbers: DVector<f64>, limits: &[(f64, f64)]) -> DVector<f64> {
    for (x, (low, high)) in numbers.iter_mut().zip(limits) {
        *x = x.clamp(*low, *high);
    }
    numbers
}

/// Returns true if any trial measures the velocity over ground of a translation, or a horizontal
/// position.
fn is_measured_over_ground(dof: Dof, records: &[&TrialRecord]) -> bool {
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
        set(InstrumentNoise::POSITION, of(&|record| Some(record.fixes.as_ref()?[0].clone())));
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
/// Its limits, m/s².
const OFFSET_M_S2: [f64; 2] = [1e-4, 2.0];
/// Initial correlation time of the offset, s.
const FIRST_OFFSET_CORRELATION_S: f64 = 60.0;
/// Its limits, s: shorter is measurement noise, longer is a constant.
const OFFSET_CORRELATION_S: [f64; 2] = [3.0, 3000.0];

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
    }
}

/// Initial correlation time of disturbances, s.
const FIRST_CORRELATION_S: f64 = 3.0;

#[cfg(test)]
mod tests {
    use super::{alternate, as_step_of_variance};

    #[test]
    fn costs_that_alternate_are_told_from_those_that_fall() {
        // As noise of pieces and a plant of all trials did with kicks in some pieces.
        assert!(alternate([-389_469.9, -376_993.7], -389_470.0));
        assert!(!alternate([f64::INFINITY; 2], -100.0));
        assert!(!alternate([f64::INFINITY, -100.0], -200.0));
        assert!(!alternate([-100.0, -200.0], -250.0), "falling");
        assert!(!alternate([-200.0, -100.0], -150.0), "half of the way back");
        assert!(!alternate([-200.0, -199.0], -200.0), "converged");
    }

    /// White noise of r times the variance that is assumed has a slope of 1 − r by ln σ and a Fisher
    /// information of 2, by number of samples.
    #[test]
    fn a_wrong_variance_of_white_noise_takes_one_step() {
        for ratio in [0.11_f64, 0.5, 1.0, 4.0, 1e9] {
            let found = (2.0 * as_step_of_variance(0.5 * (ratio - 1.0))).exp();
            assert!((found / ratio - 1.0).abs() < 1e-9, "{found}, not {ratio}");
        }
        let steps = [-9.0, -1.2, -0.5, -0.46, -0.44, 0.0, 3.0];
        let reached = steps.map(as_step_of_variance);
        assert!(reached.is_sorted() && reached.iter().all(|x| x.is_finite()), "{reached:?}");
    }
}
