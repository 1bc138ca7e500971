//! Filter error of a coupled plant: from a start to the optimum.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{DMatrix, DVector, Matrix6, SVector};

use super::actuator::Actuator;
use super::filter::{Gain, Innovation, InstrumentNoise, Layout, Noise, Pass, Slope};
use super::schedule::{Attitude, PIECES_PART, Schedule, known_together};
use super::uncertainty::inverse;
use crate::estimate::descend::Parabola;
use crate::motion::{HeldForce, KnownForce, Load, Prepared};
use crate::plant::{Parameterisation, Physical, Plant, Structure};
use crate::signal::sample_noise;
use crate::{CoupledRecord, Dof, Error, ThrustUncertainty, Timed, parallel};

/// Everything that is fitted.
#[derive(Clone, Debug)]
pub(super) struct Point<const N: usize, const M: usize> {
    /// Free numbers of the plant.
    pub(super) free: DVector<f64>,
    /// How thrust follows what is logged of it.
    pub(super) actuator: Actuator,
    /// The current of each trial, north and east, m/s.
    pub(super) currents: Vec<[f64; 2]>,
    /// Disturbance and noise of every trial.
    pub(super) noise: Noise<N, M>,
}

/// A coupled fit of N axes to some trials.
pub(super) struct Problem {
    pub(super) structure: Structure,
    pub(super) physical: Physical,
    /// Names of the trials.
    pub(super) trials: Arc<[String]>,
    /// What is fitted: each trial whole, or pieces of it.
    pub(super) schedules: Arc<[Schedule]>,
    /// Pieces of the trials, to begin with.
    pieces: Option<Arc<[Schedule]>>,
    pushed: Arc<Pushed>,
    rigid_body: Option<Matrix6<f64>>,
    /// Which numbers of the actuator are fitted.
    pub(super) fits: [bool; Actuator::COUNT],
    /// Whether thrusters push, of which any was logged; else a wrench does.
    pub(super) has_thrusters: bool,
    /// How well the strength of the thrusters is known: the least of them.
    pub(super) thrust_uncertainty: ThrustUncertainty,
    /// Known forces that act together, by the number that slices have …
    pub(super) known: Arc<[Vec<KnownForce>]>,
    /// … and their sums.
    pub(super) loads: Arc<[Load]>,
    /// What differences of the samples of each axis show of their noise, m/s or rad/s.
    pub(super) sample_noise: Vec<f64>,
    /// Whether the velocity of an axis is the slope of positions in any trial, in SNAME order.
    pub(super) by_slope: [bool; 6],
    /// Whether an instrument of its own measures each translation in all trials, likewise.
    may_be_late: [bool; 6],
    /// Whether a current is fitted: there is a translation for it to show in.
    pub(super) has_current: bool,
    /// Whether attitude is known or a state.
    pub(super) attitude: Attitude,
    /// What differences of the samples of roll and pitch show of their noise, rad.
    attitude_noise: f64,
    /// Noise of positions and accelerations, from differences of their samples.
    pub(super) instruments: InstrumentNoise,
    /// Whether the motion is left to itself: no disturbance, all misfit is of the measurement.
    pub(super) is_free: bool,
}

/// The force over every slice of all schedules, by the actuator that was asked for last: most passes
/// ask for the same.
#[derive(Default)]
struct Pushed(Mutex<Option<(Actuator, Pushes)>>);

/// The force over every slice of each schedule.
type Pushes = Arc<[Vec<HeldForce>]>;

impl Pushed {
    fn by(&self, actuator: &Actuator, schedules: &[Schedule]) -> Pushes {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match last.as_ref().filter(|(own, _)| own == actuator) {
            Some((_, pushes)) => Arc::clone(pushes),
            None => {
                let of = |k: usize| actuator.pushes(&schedules[k].thrust, &schedules[k].slices);
                let pushes: Pushes = parallel::of_each(schedules.len(), of).into();
                *last = Some((*actuator, Arc::clone(&pushes)));
                pushes
            }
        }
    }
}

/// The optimum.
#[derive(Clone, Debug)]
pub(super) struct Optimum<const N: usize, const M: usize> {
    pub(super) point: Point<N, M>,
    /// Negative log-likelihood.
    pub(super) cost: f64,
    /// Fisher information of coefficients and currents, priors included.
    pub(super) information: DMatrix<f64>,
    /// Fisher information of the logarithms of the noise; of motion left to itself, none.
    pub(super) noise_information: DMatrix<f64>,
    /// Steps made.
    pub(super) iterations: usize,
}

/// The slope of the likelihood by all that is fitted and by how translations are reported.
pub(super) struct ByReport {
    slope: Slope,
    /// Where delay and lag stand in it …
    late: usize,
    /// … and the three levers behind them.
    levers: usize,
}

/// A step of Gauss and Newton by some numbers, others being free as well, and their covariance.
pub(super) type Step = (DVector<f64>, DMatrix<f64>);

impl ByReport {
    /// By how much delay and lag are greater than they are taken to be, s: the delay alone where no
    /// lag is. Levers are free or what they are taken to be.
    pub(super) fn of_lateness(&self, are_free: [bool; 3]) -> Step {
        let free = (0..3).filter(|along| are_free[*along]).map(|along| self.levers + along);
        self.step(free.collect(), (self.late..self.levers).collect())
    }

    /// By how much the lag is greater than it is taken to be, s, where there is no delay and levers are
    /// as they are taken to be.
    pub(super) fn of_lag(&self) -> Step {
        self.step(Vec::new(), vec![self.late + 1])
    }

    /// By how much each lever is longer than it is taken to be, m, delay and lag being free.
    pub(super) fn of_levers(&self) -> Step {
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

/// What a descent does with the noise.
#[derive(Clone, Copy, Debug, PartialEq)]
enum WithNoise {
    Fitted,
    Kept,
}

/// Standard deviation of a current's component before anything is measured, m/s.
pub(super) const CURRENT_STD: f64 = 1.0;

/// Information of a coefficient that is known, by its square: 1e-9 of it is its error.
const KNOWN: f64 = 1e18;

/// Steps after which a fit is given up.
const MOST_STEPS: usize = 60;

/// How near to the optimum a fit has to come.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerance {
    /// A step that would gain less than this in log-likelihood is the last.
    plant: f64,
    /// The same of the noise, whose numbers matter less.
    pub(super) noise: f64,
    /// True where the noise may be fitted to pieces of the trials.
    is_coarse: bool,
}

impl Tolerance {
    /// No coefficient moves by more than 3 % of its standard deviation any more.
    pub(super) const FINE: Self = Self { plant: 5e-4, noise: 5e-3, is_coarse: false };
    /// No coefficient moves by more than half of its standard deviation: near enough to ask what
    /// the plant lacks, and to go on from.
    pub(super) const COARSE: Self = Self { plant: 0.1, noise: 0.5, is_coarse: true };

    /// The same of motion left to itself, of whose samples a hundred say about as much as one.
    fn of_free(self) -> Self {
        Self { plant: 100.0 * self.plant, noise: 100.0 * self.noise, ..self }
    }

    /// A step that did gain less than this is the last, whatever was expected of it.
    fn nothing(self) -> f64 {
        0.1 * self.plant
    }
}

/// Numbers measured for each coefficient in pieces of the trials, that these say enough.
const SAMPLES_PER_TERM: usize = 50;

/// The greatest step of a logarithm of the noise.
const GREATEST_LOG_STEP: f64 = 1.0;

/// The greatest step down of that of a disturbance.
const GREATEST_FALL: f64 = 3.0;

/// Correlation times of the disturbance, s: below, it could not be told from noise; above,
/// it is a constant.
const CORRELATION_S: [f64; 2] = [0.2, 300.0];

/// Standard deviations of a current's changes, m/s: more is no current that a vehicle works in.
const DRIFT_STD_M_S: [f64; 2] = [1e-4, 1.0];

/// Correlation times of a current's changes, s: below, it is turbulence or a sensor; above, it is
/// constant in a trial.
const DRIFT_CORRELATION_S: [f64; 2] = [10.0, 1000.0];

/// The noise of a velocity is not below this part of what differences of its samples show: a
/// disturbance that explains every sample would let it vanish.
const LEAST_NOISE_PART: f64 = 0.1;

/// Damping of Gauss–Newton steps: its start, how it changes, where it gives up.
const DAMPING: f64 = 1e-4;
const DAMPING_FACTOR: f64 = 8.0;
const MOST_DAMPING: f64 = 1e8;
const LEAST_DAMPING: f64 = 1e-9;

impl Problem {
    pub(super) fn new(
        structure: &Structure,
        records: &[&CoupledRecord],
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
        let schedules = Schedule::whole(records, structure, attitude);
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
            pushed: Arc::default(),
            rigid_body,
            fits: Actuator::fitted(records, axes),
            has_thrusters,
            thrust_uncertainty: ThrustUncertainty::greatest(uncertainties),
            loads: known.iter().map(|acting| Load::of(acting)).collect(),
            known,
            sample_noise: axes.iter().map(|dof| noise(dof.index())).collect(),
            by_slope: std::array::from_fn(|k| records.iter().any(|record| record.by_slope[k])),
            may_be_late: std::array::from_fn(|k| {
                records.iter().all(|record| record.may_be_late(k))
            }),
            has_current: axes.iter().any(|dof| is_seen_over_ground(*dof, records)),
            attitude,
            attitude_noise: sample_noise(inclinations).unwrap_or(0.0).max(LEAST_NOISE),
            is_free,
        }
    }

    /// The same for other records of the same trials.
    pub(super) fn of(&self, records: &[&CoupledRecord]) -> Self {
        let Self { structure, rigid_body, is_free, attitude, fits, .. } = self;
        Self { fits: *fits, ..Self::new(structure, records, *rigid_body, *is_free, *attitude) }
    }

    /// The same with attitude as a state.
    pub(super) fn with_attitude(&self, records: &[&CoupledRecord]) -> Self {
        let Self { structure, rigid_body, is_free, fits, .. } = self;
        let attitude = Attitude::State;
        Self { fits: *fits, ..Self::new(structure, records, *rigid_body, *is_free, attitude) }
    }

    /// Returns true if an instrument of its own measures a translation in all trials, and may report
    /// it late.
    pub(super) fn may_be_late(&self, dof: Dof) -> bool {
        self.may_be_late[dof.index()]
    }

    /// How many numbers were measured.
    pub(super) fn samples(&self) -> usize {
        self.schedules.iter().map(Schedule::samples).sum()
    }

    /// The same trials for other terms on the same axes.
    pub(super) fn with_terms(&self, structure: Structure) -> Self {
        Self {
            physical: Physical::new(&structure, self.rigid_body),
            structure,
            trials: Arc::clone(&self.trials),
            schedules: Arc::clone(&self.schedules),
            pieces: self.pieces.clone(),
            pushed: Arc::clone(&self.pushed),
            rigid_body: self.rigid_body,
            fits: self.fits,
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

    /// The same plant on pieces of the trials, if these say enough.
    pub(super) fn in_pieces(&self) -> Option<Self> {
        let schedules = Arc::clone(self.pieces.as_ref()?);
        let whole = self.with_terms(self.structure.clone());
        Some(Self { schedules, pieces: None, pushed: Arc::default(), ..whole })
    }

    pub(super) fn plant(&self, free: &DVector<f64>) -> Result<Plant, Error> {
        let coefficients = self.physical.coefficients(free);
        Plant::new(self.structure.clone(), coefficients.iter().copied().collect())
    }

    pub(super) fn prepared<const N: usize>(&self, free: &DVector<f64>) -> Option<Prepared<N>> {
        Prepared::with_loads(&self.plant(free).ok()?, &self.loads).ok()
    }

    /// Runs one pass over every schedule, each in its own thread; results come in their order.
    pub(super) fn each<const N: usize, const M: usize, T: Send>(
        &self,
        point: &Point<N, M>,
        plant: &Prepared<N>,
        work: impl Fn(usize, Pass<'_, N, M>) -> T + Sync,
    ) -> Vec<T> {
        let pushes = self.pushed.by(&point.actuator, &self.schedules);
        parallel::of_each(self.schedules.len(), |k| {
            let (schedule, pushes) = (&self.schedules[k], &pushes[k]);
            let current = point.currents[schedule.trial];
            work(k, Pass { plant, schedule, pushes, current, noise: &point.noise })
        })
    }

    /// Slope and information by coefficients and currents, and the gains they belong to.
    pub(super) fn by_plant<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
    ) -> Option<(Slope, Vec<Vec<Gain<N, M>>>)> {
        let plant = self.prepared(&point.free)?;
        let found = self.each(point, &plant, |_, pass| pass.by_plant());
        let (slopes, gains): (Vec<Slope>, Vec<_>) = found.into_iter().unzip();
        Some((self.summed(point, &slopes)?, gains))
    }

    /// Returns what a number of the actuator would gain in twice the ln-likelihood beside all that is
    /// fitted, to second order: `g² / (I_kk − I_kr I_rr⁻¹ I_rk)`. One pass of the filter; `None` where
    /// it diverges.
    ///
    /// # Source
    /// \[Rao1948\].
    pub(super) fn score<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
        number: usize,
    ) -> Option<f64> {
        let (slope, _) = self.by_plant(point)?;
        let place = self.structure.terms().len() + number;
        let rest: Vec<usize> = (0..slope.gradient.len()).filter(|k| *k != place).collect();
        let cross = slope.information.column(place).select_rows(&rest);
        let of_rest = inverse(&slope.information.select_rows(&rest).select_columns(&rest));
        let left = slope.information[(place, place)] - cross.dot(&(&of_rest * &cross));
        Some(slope.gradient[place].powi(2) / left)
    }

    /// The information by all coefficients, numbers of the actuator and currents, whether they are
    /// fitted or not, and without what was known of them before.
    pub(super) fn information_of_all<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
    ) -> Option<DMatrix<f64>> {
        let plant = self.prepared(&point.free)?;
        let slopes = self.each(point, &plant, |_, pass| pass.by_plant().0);
        Some(self.gathered(&slopes)?.information)
    }

    /// What the trials ask for of how translations are reported, beside what they are taken to be: by
    /// delay, lag and levers.
    pub(super) fn by_report<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
        lag_s: f64,
    ) -> Option<ByReport> {
        let plant = self.prepared(&point.free)?;
        let slopes = self.each(point, &plant, |_, pass| pass.by_plant_and_report(lag_s));
        let slope = self.summed(point, &slopes)?;
        let levers = slope.gradient.len() - 3;
        let late = levers - if lag_s > 0.0 { 2 } else { 1 };
        Some(ByReport { slope, late, levers })
    }

    /// The slopes of all schedules, with a current for each trial; what comes after the current
    /// stands last.
    fn gathered(&self, slopes: &[Slope]) -> Option<Slope> {
        let of_all = 2 * (self.trials.len() - 1);
        let mut sum = Slope::zeros(slopes.first()?.gradient.len() + of_all);
        for (schedule, slope) in self.schedules.iter().zip(slopes) {
            self.add(slope, schedule.trial, &mut sum);
        }
        Some(sum)
    }

    /// Adds the slope of a schedule of a trial to that of all.
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

    /// The slope of what is fitted, and the part of it that each trial makes.
    pub(super) fn by_trial<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
    ) -> Option<(Slope, Vec<Slope>)> {
        let plant = self.prepared(&point.free)?;
        let slopes = self.each(point, &plant, |_, pass| pass.by_plant().0);
        let all = self.summed(point, &slopes)?;
        let mut parts = vec![Slope::zeros(all.gradient.len()); self.trials.len()];
        for (schedule, slope) in self.schedules.iter().zip(&slopes) {
            self.add(slope, schedule.trial, &mut parts[schedule.trial]);
        }
        Some((all, parts))
    }

    /// The same of what is fitted, with what was known of it before.
    fn summed<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
        slopes: &[Slope],
    ) -> Option<Slope> {
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

    /// Coefficients that are known have no gradient, and no error.
    pub(super) fn hold(&self, slope: &mut Slope) {
        for (k, term) in self.structure.terms().iter().enumerate() {
            let Some(value) = self.structure.held(term) else { continue };
            slope.gradient[k] = 0.0;
            slope.information.row_mut(k).fill(0.0);
            slope.information.column_mut(k).fill(0.0);
            slope.information[(k, k)] = KNOWN / value.powi(2).max(f64::MIN_POSITIVE);
        }
    }

    fn prior<const N: usize, const M: usize>(&self, point: &Point<N, M>) -> f64 {
        let of_terms = self.prior_coefficients(point).into_iter().map(|(_, number)| number);
        let half_square = |(x, std): (f64, f64)| 0.5 * (x / std).powi(2);
        of_terms.chain(self.prior_numbers(point)).map(half_square).sum()
    }

    /// The numbers of the actuator and the currents, with the standard deviation that each has before
    /// anything is measured.
    fn prior_numbers<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
    ) -> impl Iterator<Item = (f64, f64)> {
        let currents = point.currents.as_flattened().iter().map(|x| (*x, CURRENT_STD));
        let mut std = Actuator::PRIOR_STD;
        let ThrustUncertainty { forward, reverse } = self.thrust_uncertainty;
        if forward.max(reverse) > 0.0 {
            std[Actuator::SCALE] = forward.max(reverse);
        }
        point.actuator.numbers().into_iter().zip(std).chain(currents)
    }

    /// Coefficients of which something is known before, by their places: each with its value and the
    /// standard deviation about zero.
    fn prior_coefficients<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
    ) -> Vec<(usize, (f64, f64))> {
        let terms = self.structure.terms();
        let known = |(k, term)| Some((k, self.structure.prior_std(term)?));
        let known: Vec<(usize, f64)> = terms.iter().enumerate().filter_map(known).collect();
        if known.is_empty() {
            return Vec::new();
        }
        let coefficients = self.physical.coefficients(&point.free);
        known.into_iter().map(|(k, std)| (k, (coefficients[k], std))).collect()
    }

    pub(super) fn at_gains<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
        gains: &[Vec<Gain<N, M>>],
    ) -> f64 {
        let Some(plant) = self.prepared(&point.free) else { return f64::INFINITY };
        let costs = self.each(point, &plant, |k, pass| pass.at_gains(&gains[k]));
        costs.iter().sum::<f64>() + self.prior(point)
    }

    /// The negative log-likelihood.
    pub(super) fn cost<const N: usize, const M: usize>(&self, point: &Point<N, M>) -> f64 {
        let Some(plant) = self.prepared(&point.free) else { return f64::INFINITY };
        let costs = self.each(point, &plant, |_, pass| pass.innovations().0);
        costs.iter().sum::<f64>() + self.prior(point)
    }

    /// The innovations of each schedule.
    pub(super) fn innovations<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
    ) -> Result<Vec<Vec<Innovation>>, Error> {
        let plant = Prepared::with_loads(&self.plant(&point.free)?, &self.loads)?;
        Ok(self.each(point, &plant, |_, pass| pass.innovations().1))
    }

    /// Slope and information by the logarithms of the noise.
    pub(super) fn by_noise<const N: usize, const M: usize>(
        &self,
        point: &Point<N, M>,
    ) -> Option<Slope> {
        let plant = self.prepared(&point.free)?;
        let slopes = self.each(point, &plant, |_, pass| pass.by_noise());
        let sum = slopes.iter().fold(Slope::zeros(point.noise.count()), Slope::plus);
        sum.cost.is_finite().then_some(sum)
    }

    /// Whether output error is there if this does not settle: no second try is worth its time.
    pub(super) fn has_rival(&self) -> bool {
        !self.is_free && self.structure.reads_beside_thrusters()
    }

    /// Goes from a start to the optimum, at first on pieces of the trials.
    ///
    /// # Errors
    /// [`Error::Plant`] if no step leads to an optimum.
    pub(super) fn optimum<const N: usize, const M: usize>(
        &self,
        start: Point<N, M>,
        tolerance: Tolerance,
    ) -> Result<Optimum<N, M>, Error> {
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

    /// Goes from a start to the optimum: in turn a step of plant and currents at the filter's
    /// gains, and one of the noise.
    ///
    /// # Errors
    /// [`Error::Plant`] if no step leads to an optimum.
    pub(super) fn descent<const N: usize, const M: usize>(
        &self,
        start: Point<N, M>,
        tolerance: Tolerance,
    ) -> Result<Optimum<N, M>, Error> {
        self.descend(start, tolerance, WithNoise::Fitted)
    }

    /// The same with the noise as it is: for a plant that lacks little of the one it was fitted with.
    ///
    /// # Errors
    /// As [`Self::descent`].
    pub(super) fn descent_at_noise<const N: usize, const M: usize>(
        &self,
        start: Point<N, M>,
        tolerance: Tolerance,
    ) -> Result<Optimum<N, M>, Error> {
        self.descend(start, tolerance, WithNoise::Kept)
    }

    fn descend<const N: usize, const M: usize>(
        &self,
        start: Point<N, M>,
        tolerance: Tolerance,
        noise: WithNoise,
    ) -> Result<Optimum<N, M>, Error> {
        let refuse =
            |reason: &str| Error::Plant { axes: self.structure.name(), reason: reason.to_owned() };
        let tolerance = if self.is_free { tolerance.of_free() } else { tolerance };
        let mut point = start;
        let mut damping = DAMPING;
        let count = point.noise.count();
        let mut noise_information = DMatrix::zeros(count, count);
        let mut noise_is_settled = noise == WithNoise::Kept;
        for iterations in 0..MOST_STEPS {
            if !noise_is_settled {
                noise_is_settled = self.step_noise(&mut point, tolerance, &mut noise_information);
            }
            let (slope, gains) = self
                .by_plant(&point)
                .ok_or_else(|| refuse("its simulation diverges from the start; leave out terms, or use trials with more motion"))?;
            let gain = self.step_plant(&mut point, &slope, &gains, &mut damping, tolerance);
            let is_last = gain < tolerance.plant;
            if is_last && noise_is_settled {
                let Slope { cost, information, .. } = slope;
                let iterations = iterations + 1;
                return Ok(Optimum { point, cost, information, noise_information, iterations });
            }
            noise_is_settled = noise == WithNoise::Kept
                || is_last && self.step_noise(&mut point, tolerance, &mut noise_information);
        }
        Err(refuse(
            "the fit did not converge; leave out terms, or use trials with more variation of speed and turning",
        ))
    }

    /// A damped Gauss–Newton step of plant and currents; what it would gain without damping.
    fn step_plant<const N: usize, const M: usize>(
        &self,
        point: &mut Point<N, M>,
        slope: &Slope,
        gains: &[Vec<Gain<N, M>>],
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
                // At a limit that it nears but does not reach, a step gains less than expected.
                let gained = at - there;
                return if gained < tolerance.nothing() { gained } else { expected };
            }
            if expected < tolerance.plant {
                return expected;
            }
            *damping *= DAMPING_FACTOR;
        }
        // No step however short helps: the cost is at its least, but for rounding.
        *damping = DAMPING;
        0.0
    }

    /// Between what each number of a point stays.
    fn limits<const N: usize, const M: usize>(&self, point: &Point<N, M>) -> Vec<(f64, f64)> {
        let lowest = self.physical.lowest().into_iter();
        let of_plant = lowest.map(|low| (low.unwrap_or(f64::NEG_INFINITY), f64::INFINITY));
        let of_currents = point.currents.iter().flatten();
        let of_currents = of_currents.map(|_| (f64::NEG_INFINITY, f64::INFINITY));
        of_plant.chain(Actuator::LIMITS).chain(of_currents).collect()
    }

    /// Whether a number of a point is not fitted.
    fn is_held<const N: usize, const M: usize>(&self, point: &Point<N, M>, k: usize) -> bool {
        let p = point.free.len();
        match k.checked_sub(p) {
            None => false,
            Some(k) => self.fits.get(k).map_or(!self.has_current, |fits| !fits),
        }
    }

    /// Gradient and information of coefficients and currents, by the free numbers in place of
    /// the coefficients.
    fn in_free_numbers(&self, free: &DVector<f64>, slope: &Slope) -> (DVector<f64>, DMatrix<f64>) {
        let (p, all) = (free.len(), slope.gradient.len());
        let mut jacobian = DMatrix::identity(all, all);
        jacobian.view_mut((0, 0), (p, p)).copy_from(&self.physical.jacobian(free));
        let hessian = jacobian.transpose() * &slope.information * &jacobian;
        (jacobian.transpose() * &slope.gradient, hessian)
    }

    /// One step of the noise, whose information comes with it; whether it is settled.
    fn step_noise<const N: usize, const M: usize>(
        &self,
        point: &mut Point<N, M>,
        tolerance: Tolerance,
        noise_information: &mut DMatrix<f64>,
    ) -> bool {
        if self.is_free {
            return self.step_misfit(point, tolerance);
        }
        // To come near, pieces of the trials say enough of the noise; where positions or accelerations
        // are measured its slope takes so long that they have to at the optimum, too.
        let is_enough = tolerance.is_coarse || self.instruments.count() > 0;
        let pieces = if is_enough { self.in_pieces() } else { None };
        let told_by = pieces.as_ref().unwrap_or(self);
        let needed = tolerance.noise * if pieces.is_some() { PIECES_PART } else { 1.0 };
        let Some(slope) = told_by.by_noise(point) else { return true };
        noise_information.copy_from(&slope.information);
        let mut damping = DAMPING;
        let logarithms = point.noise.logarithms();
        let limits = self.noise_limits(&point.noise);
        let (gradient, information) = (&slope.gradient, &slope.information);
        let parabola = Parabola::new((gradient, information), (&logarithms, &limits), |k| {
            k.checked_sub(2 * N).is_some_and(|place| self.is_unmeasured(place))
        });
        while damping < MOST_DAMPING {
            let Some(step) = parabola.step(damping) else {
                damping *= DAMPING_FACTOR;
                continue;
            };
            if 0.5 * parabola.promise(&step) < needed {
                return true;
            }
            // Each by itself: one that runs away must not hold the others back.
            let reached = step.iter().enumerate().map(|(k, x)| {
                // A disturbance that is not there has a long way to go.
                let down = if k < N { GREATEST_FALL } else { GREATEST_LOG_STEP };
                x.clamp(-down, GREATEST_LOG_STEP)
            });
            let step = DVector::from_iterator(step.len(), reached);
            let moved = clamped(&logarithms + step, &limits);
            let moved = Point { noise: point.noise.with_logarithms(&moved), ..point.clone() };
            let gained = slope.cost + self.prior(point) - told_by.cost(&moved);
            if gained > 0.0 {
                *point = moved;
                // A disturbance that is not there fades for ever and gains nothing by it.
                return gained < needed;
            }
            damping *= DAMPING_FACTOR;
        }
        true
    }

    /// Returns true if no trial has a measured velocity of the axis in a place.
    pub(super) fn is_unmeasured(&self, place: usize) -> bool {
        let Some(dof) = self.structure.axes().get(place) else { return false };
        self.schedules.iter().all(|schedule| !schedule.is_measured[dof.index()])
    }

    /// Between which logarithms the noise stays, shape as of these.
    fn noise_limits<const N: usize, const M: usize>(&self, noise: &Noise<N, M>) -> Vec<(f64, f64)> {
        let mut limits = vec![(f64::NEG_INFINITY, f64::INFINITY); noise.count()];
        if noise.drift.is_some() {
            let ln = |[low, high]: [f64; 2]| (low.ln(), high.ln());
            let first = noise.first_of_drift();
            limits[first] = ln(DRIFT_STD_M_S);
            limits[first + 1] = ln(DRIFT_CORRELATION_S);
        }
        for (place, number) in noise.instruments.needed().enumerate() {
            let limits = &mut limits[Noise::<N, M>::INSTRUMENTS + place];
            *limits = match number {
                InstrumentNoise::OFFSET => (OFFSET_M_S2[0].ln(), OFFSET_M_S2[1].ln()),
                InstrumentNoise::OFFSET_CORRELATION => {
                    (OFFSET_CORRELATION_S[0].ln(), OFFSET_CORRELATION_S[1].ln())
                }
                _ => ((LEAST_NOISE_PART * self.instruments.numbers[number]).ln(), limits.1),
            };
        }
        if self.attitude == Attitude::State {
            limits[Noise::<N, M>::ATTITUDE].0 = (LEAST_NOISE_PART * self.attitude_noise).ln();
        }
        for axis in 0..N {
            limits[N + axis] = (CORRELATION_S[0].ln(), CORRELATION_S[1].ln());
            let sample = self.sample_noise.get(axis).copied().unwrap_or(1.0);
            limits[2 * N + axis].0 = (LEAST_NOISE_PART * sample).ln();
        }
        limits
    }
}

impl<const N: usize> Point<N, N> {
    /// The same where attitude is a state.
    pub(super) fn with_attitude(self, problem: &Problem) -> Point<6, 9> {
        let Self { free, actuator, currents, noise } = self;
        let noise = noise.with_attitude(problem.attitude_noise);
        Point { free, actuator, currents, noise }
    }
}

impl<const N: usize, const M: usize> Point<N, M> {
    /// Free numbers of the plant, numbers of the actuator, currents.
    fn numbers(&self) -> DVector<f64> {
        let (free, actuator) = (self.free.iter().copied(), self.actuator.numbers());
        let all = free.chain(actuator).chain(self.currents.as_flattened().iter().copied());
        DVector::from_vec(all.collect())
    }

    /// The same after a step of these.
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

/// A step may end beside its limit by rounding.
fn clamped(mut numbers: DVector<f64>, limits: &[(f64, f64)]) -> DVector<f64> {
    for (x, (low, high)) in numbers.iter_mut().zip(limits) {
        *x = x.clamp(*low, *high);
    }
    numbers
}

/// Returns true if some trial measures the velocity of a translation over ground, or its position.
fn is_seen_over_ground(dof: Dof, records: &[&CoupledRecord]) -> bool {
    let is_seen = |record: &&CoupledRecord| record.is_measured(dof) || record.fixes.is_some();
    matches!(dof, Dof::Surge | Dof::Sway) && records.iter().any(is_seen)
        || dof == Dof::Heave && records.iter().any(|record| record.is_measured(dof))
}

/// Estimates the noise of the instruments that schedules read from differences of their samples.
fn first_instruments(records: &[&CoupledRecord], schedules: &[Schedule]) -> InstrumentNoise {
    let mut noise = InstrumentNoise::NONE;
    let mut set = |number: usize, value: f64| {
        (noise.numbers[number], noise.active[number]) = (value, true);
    };
    let of = |series: &dyn Fn(&CoupledRecord) -> Option<Timed>| {
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
        let felt = |record: &CoupledRecord| Some(record.acceleration[axis].as_ref()?.mean.clone());
        set(InstrumentNoise::ACCELERATION + axis, of(&felt));
        set(InstrumentNoise::OFFSET, FIRST_OFFSET_M_S2);
        set(InstrumentNoise::OFFSET_CORRELATION, FIRST_OFFSET_CORRELATION_S);
    }
    noise
}

/// Where the standard deviation of an accelerometer's offset starts, m/s²: a third of a degree of
/// attitude.
const FIRST_OFFSET_M_S2: f64 = 0.05;
/// Between which it stays.
const OFFSET_M_S2: [f64; 2] = [1e-4, 2.0];
/// Where its correlation time starts, s, …
const FIRST_OFFSET_CORRELATION_S: f64 = 60.0;
/// … and between which it stays: below, it is noise; above, it is constant.
const OFFSET_CORRELATION_S: [f64; 2] = [3.0, 3000.0];

/// A sensor is not better than that, m/s or rad/s.
const LEAST_NOISE: f64 = 1e-6;

/// The first noise of a fit: what the equation of motion misses on each axis is disturbance.
pub(super) fn first_noise<const N: usize, const M: usize>(
    problem: &Problem,
    residual: &[f64],
) -> Noise<N, M> {
    Noise {
        // What a place without an axis holds does not matter, as long as it is a number.
        disturbance: SVector::from_fn(|i, _| residual.get(i).map_or(1.0, |r| r.max(1e-9))),
        correlation_s: SVector::repeat(FIRST_CORRELATION_S),
        velocity: SVector::from_fn(|i, _| problem.sample_noise.get(i).copied().unwrap_or(1.0)),
        attitude: problem.attitude_noise,
        instruments: problem.instruments,
        drift: None,
    }
}

/// Where correlation times start, s.
const FIRST_CORRELATION_S: f64 = 3.0;
