//! Online identification of plants of one to six axes, sample by sample.
//!
//! Three estimators share one equation of motion, averaged over the step between two samples: the
//! adaptive observer of Smallwood and Whitcomb, recursive least squares with directional
//! forgetting, and the extended Kalman filter with the coefficients in its state. None needs an
//! acceleration. [`Online`] takes one sample at a time; between its first sample and its last it
//! allocates nothing.
//!
//! The samples hold velocity through the water: the water is assumed still, or its velocity
//! subtracted before. Thrust is taken as given. Rudders, fins, propellers of unknown strength and
//! wind are terms like any other, which use the signals of a sample; coefficients that the
//! structure holds stay constant.

mod acting;
mod adaptive;
mod change;
mod colour;
mod estimate;
mod factor;
mod history;
mod instruments;
mod joint;
pub(crate) mod logs;
mod noise;
mod one_axis;
mod options;
mod possible;
mod recursive;
mod sample;
mod start;
mod step;

use nalgebra::{DMatrix, Vector6};

pub use change::Change;
pub use history::{OnlineHistory, PlantChanged};
pub use logs::{CoefficientHistory, OnlineFit, fit_online_plant};
pub use one_axis::fit_online;
pub use options::{OnlineOptions, Scheme};
pub use possible::Possible;
pub use sample::{MOST_SIGNALS, Sample};

use crate::Error;
use crate::motion::Prepared;
use crate::plant::{Basis, Plant, RigidBody, Structure};
use adaptive::Adaptive;
use change::Changes;
use joint::Joint;
use recursive::Recursive;
use step::Step;

/// Estimate at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct OnlineEstimate {
    /// The plant; its M is positive definite and its damping dissipates power.
    pub plant: Plant,
    /// Standard deviation of each coefficient, shape (p,); infinite for those that the data do not
    /// determine.
    pub std: Vec<f64>,
    /// Variance inflation factor of each coefficient, shape (p,).
    pub inflation: Vec<f64>,
    /// Smallest eigenvalue of the information, scaled to a unit diagonal: 1 if the coefficients are
    /// determined independently of each other, 0 if some combination is not determined at all.
    pub excitation: f64,
    /// Covariance of the coefficients, shape (p, p).
    pub covariance: DMatrix<f64>,
    /// Root mean square residual of the equation of motion on each axis, N and N m.
    pub residual: Vector6<f64>,
    /// Effective number of independent samples.
    pub independent_samples: f64,
    /// Relative change of all masses at once that [`Online::update`] would detect within two
    /// minutes; `None` during the first two minutes, from which it learns the normal statistics.
    pub noticeable_change: Option<f64>,
    /// Duration of the motion so far, s.
    pub elapsed_s: f64,
}

/// State of the estimator beyond recursive least squares, which always runs.
enum Engine {
    Recursive,
    Adaptive(Box<Adaptive>),
    Ekf(Option<Box<Joint>>),
}

/// Online estimator of a plant.
///
/// # Example
/// ```
/// use nalgebra::Vector6;
/// use seaplant::Dof;
/// use seaplant::estimate::online::{Online, OnlineOptions, Sample, Scheme};
/// use seaplant::plant::{Structure, Symmetry};
/// let surge = Structure::of(&[Dof::Surge], Symmetry::None)?;
/// let mut online = Online::new(surge, Scheme::Adaptive, OnlineOptions::default(), None)?;
/// // A vehicle of 100 kg with 5 N/(m/s) and 20 N/(m/s)², here without noise.
/// let (mut v, h) = (0.0_f64, 0.05);
/// for k in 0..4000 {
///     let time_s = h * f64::from(k);
///     let force = Vector6::x() * (40.0 * (0.7 * time_s).sin() + 25.0 * (0.2 * time_s).sin());
///     let velocity = Vector6::x() * v;
///     online.update(&Sample { time_s, velocity, force, ..Sample::default() })?;
///     for _ in 0..10 {
///         v += 0.1 * h * (force[0] - 5.0 * v - 20.0 * v * v.abs()) / 100.0;
///     }
/// }
/// let found = online.estimate()?;
/// assert!((found.plant.mass_matrix()[(0, 0)] - 100.0).abs() < 2.0);
/// # Ok::<(), seaplant::Error>(())
/// ```
pub struct Online {
    options: OnlineOptions,
    structure: Structure,
    possible: Possible,
    step: Step,
    recent: [Option<Sample>; 3],
    recursive: Recursive,
    engine: Engine,
    changes: Changes,
    elapsed_s: f64,
    is_started: bool,
    /// Mean squares: of third differences of velocity, of velocity, of force, and of acceleration.
    rough: Vector6<f64>,
    speed: Vector6<f64>,
    force: Vector6<f64>,
    acceleration: Vector6<f64>,
    projected: Vec<f64>,
    next_noise_s: f64,
    next_races_s: f64,
}

/// Variance of the third difference of white noise relative to that of the noise.
const THIRD_DIFFERENCE: f64 = 20.0;

/// Upper limit of velocity and force in a sample, SI units.
const LARGEST_NUMBER: f64 = 1e12;

/// Longest prediction, s.
const LONGEST_PREDICTION_S: f64 = 3600.0;

/// Fraction of the information that is kept after a change of the plant.
const KEPT: f64 = 0.05;

/// Part by which the race of a fin moves before the equations are others.
const RACE_MOVED: f64 = 0.05;

/// Standard deviation added to each coefficient after a change of the plant, relative to its value.
const REOPENED: f64 = 0.3;

impl Online {
    /// Creates an estimator of a structure, with M ⪰ M_RB where the rigid body is known, else M ≻
    /// 0.
    ///
    /// # Errors
    /// [`Error::Setting`] for invalid settings; [`Error::Plant`] for a structure whose effects use
    /// more than [`MOST_SIGNALS`] signals, or one without a free coefficient.
    pub fn new(
        structure: Structure,
        scheme: Scheme,
        options: OnlineOptions,
        rigid_body: Option<&RigidBody>,
    ) -> Result<Self, Error> {
        options.check()?;
        check_terms(&structure)?;
        let step = Step::new(&structure);
        let held: Vec<Option<f64>> =
            structure.terms().iter().map(|term| structure.held(term)).collect();
        let p = step.count();
        let is_mass =
            structure.terms().iter().map(|term| matches!(term, Basis::Mass(..))).collect();
        let memory_s = options.memory_s.unwrap_or(f64::INFINITY);
        Ok(Self {
            possible: Possible::of(&structure, rigid_body.map(RigidBody::mass_matrix)),
            recursive: Recursive::new(
                &step,
                &terms_by_axis(&structure),
                held,
                (options.cutoff_hz, memory_s),
            ),
            engine: match scheme {
                Scheme::Recursive => Engine::Recursive,
                Scheme::Adaptive => {
                    let (rate, time_s) = (options.observer_rate, options.adaptation_s);
                    Engine::Adaptive(Box::new(Adaptive::new(p, rate, time_s)))
                }
                Scheme::Ekf => Engine::Ekf(None),
            },
            changes: Changes::new(is_mass, options.change_threshold),
            step,
            recent: [None; 3],
            elapsed_s: 0.0,
            is_started: false,
            rough: Vector6::zeros(),
            speed: Vector6::zeros(),
            force: Vector6::zeros(),
            acceleration: Vector6::zeros(),
            projected: vec![0.0; p],
            next_noise_s: 0.0,
            next_races_s: options.start_s,
            options,
            structure,
        })
    }

    /// Returns the estimator with a plant as its start, instead of least squares over the first
    /// seconds.
    ///
    /// Affects the adaptive observer only; recursive least squares and the extended Kalman filter
    /// start as without it.
    ///
    /// # Errors
    /// [`Error::Plant`] if the plant has other terms.
    pub fn starting_from(mut self, plant: &Plant) -> Result<Self, Error> {
        if plant.structure() != &self.structure {
            let reason = "has other terms than what is to be identified; give one with the same";
            return Err(Error::Plant { axes: plant.structure().name(), reason: reason.to_owned() });
        }
        match &mut self.engine {
            Engine::Adaptive(adaptive) => {
                adaptive.start(plant.coefficients(), &self.possible);
                self.is_started = true;
            }
            Engine::Recursive | Engine::Ekf(_) => {}
        }
        self.projected.copy_from_slice(plant.coefficients());
        Ok(self)
    }

    /// Returns the identified structure.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Processes a sample; returns a change of the plant when one is detected.
    ///
    /// A step longer than [`OnlineOptions::longest_step_s`] counts as a gap: the motion restarts
    /// after it, and the estimates are kept.
    ///
    /// # Errors
    /// [`Error::NotFinite`] or [`Error::Setting`] for a sample that is not finite, exceeds 1e12, or
    /// is not later than the previous one; the estimator is then unchanged.
    pub fn update(&mut self, sample: &Sample) -> Result<Option<Change>, Error> {
        self.check(sample)?;
        let [before, last, _] = self.recent;
        self.recent = [Some(*sample), before, last];
        let Some(from) = before else { return Ok(None) };
        if sample.time_s - from.time_s > self.options.longest_step_s {
            self.restart();
            self.recent[0] = Some(*sample);
            return Ok(None);
        }
        self.follow_races();
        self.step.take(last.as_ref(), &from, sample);
        self.elapsed_s += self.step.length_s;
        self.update_mean_squares(&[Some(*sample), before, last]);
        let simulates = self.elapsed_s >= self.options.start_s;
        self.recursive.update(&self.step, &self.possible, simulates);
        let change = self.changed();
        self.update_engine();
        if change.is_some() {
            self.recursive.forget(KEPT);
            self.reopen();
        }
        Ok(change)
    }

    /// Restarts the motion with the next sample, as after a gap; the estimates are kept.
    pub fn restart(&mut self) {
        self.recent = [None; 3];
        self.recursive.restart();
        self.changes.restart();
        match &mut self.engine {
            Engine::Adaptive(adaptive) => adaptive.restart(),
            Engine::Ekf(Some(joint)) => joint.restart(),
            Engine::Recursive | Engine::Ekf(None) => {}
        }
    }

    /// Takes the races of fins from the coefficients, each time after twice as long. With other races, the equations
    /// before were others; they count as little as those before a change of the plant.
    fn follow_races(&mut self) {
        if self.elapsed_s < self.next_races_s {
            return;
        }
        self.next_races_s = 2.0 * self.elapsed_s;
        if self.step.set_races(self.recursive.theta(), RACE_MOVED) {
            self.recursive.forget(KEPT);
            self.reopen();
        }
    }

    fn check(&self, sample: &Sample) -> Result<(), Error> {
        let numbers = sample.velocity.iter().chain(sample.force.iter()).chain(&sample.down_body);
        let numbers = numbers.chain(&sample.signals);
        if !(sample.time_s.is_finite() && numbers.into_iter().all(|x| x.is_finite())) {
            return Err(Error::NotFinite {
                name: "the sample".to_owned(),
                index: self.recursive.samples(),
            });
        }
        let greatest = sample.velocity.amax().max(sample.force.amax());
        if greatest > LARGEST_NUMBER {
            return Err(Error::Setting {
                name: "the sample's velocity or force".to_owned(),
                found: format!("{greatest:e}"),
                expected: format!("at most {LARGEST_NUMBER:e} in SI units; leave such samples out"),
            });
        }
        let after = self.recent[0].is_none_or(|last| sample.time_s > last.time_s);
        after.then_some(()).ok_or_else(|| Error::Setting {
            name: "the time of a sample".to_owned(),
            found: format!("{} s", sample.time_s),
            expected: "after that of the one before; restart() begins anew".to_owned(),
        })
    }

    /// Updates the mean squares from which the noise is estimated.
    fn update_mean_squares(&mut self, recent: &[Option<Sample>; 3]) {
        let part = (self.step.length_s / self.elapsed_s).min(1.0);
        let square = |x: Vector6<f64>| x.component_mul(&x);
        self.force += (square(self.step.force) - self.force) * part;
        self.speed += (square(self.step.velocity[2]) - self.speed) * part;
        self.acceleration += (square(self.step.acceleration) - self.acceleration) * part;
        if let [Some(a), Some(b), Some(c)] = recent {
            let bend = a.velocity - 2.0 * b.velocity + c.velocity;
            // For white noise, second differences have 6/20 of the variance of third differences.
            self.rough += (square(bend) * (THIRD_DIFFERENCE / 6.0) - self.rough) * part;
        }
    }

    fn changed(&mut self) -> Option<Change> {
        if self.elapsed_s < self.options.start_s {
            return None;
        }
        for row in self.recursive.rows() {
            self.changes.add(&row, self.step.length_s);
        }
        let until_s = self.recent[0].map_or(0.0, |sample| sample.time_s);
        self.changes.end(until_s, self.step.length_s, self.recursive.theta())
    }

    /// Updates the selected estimator.
    fn update_engine(&mut self) {
        if !self.is_started && self.may_start() {
            self.start();
        }
        match &mut self.engine {
            Engine::Recursive => {}
            Engine::Adaptive(adaptive) => {
                if self.is_started {
                    adaptive.update(&self.step, &self.possible, true);
                }
            }
            Engine::Ekf(Some(joint)) => joint.update(&self.step, &self.possible),
            Engine::Ekf(None) => {}
        }
        self.update_noise();
        if self.is_started && self.coefficients().iter().any(|x| !x.is_finite()) {
            self.return_to_least_squares();
        }
    }

    /// Returns a diverged estimator to its start from least squares.
    fn return_to_least_squares(&mut self) {
        self.is_started = false;
        match &mut self.engine {
            Engine::Recursive => {}
            Engine::Adaptive(adaptive) => adaptive.restart(),
            Engine::Ekf(joint) => *joint = None,
        }
    }

    /// Returns true if the selected scheme has started; until then the estimates are those of least
    /// squares.
    pub fn has_started(&self) -> bool {
        self.is_started
    }

    /// Increases the uncertainty of the coefficients after a change of the plant.
    fn reopen(&mut self) {
        if let Engine::Ekf(Some(joint)) = &mut self.engine {
            joint.reopen(REOPENED);
        }
    }

    /// Returns the present coefficients, shape (p,); those of least squares are not yet projected
    /// to physically possible ones.
    pub fn coefficients(&self) -> &[f64] {
        match &self.engine {
            Engine::Adaptive(adaptive) if self.is_started => adaptive.theta(),
            Engine::Ekf(Some(joint)) => joint.theta(),
            _ => self.recursive.theta(),
        }
    }

    /// Predicts the velocity after a duration, s, under the last sample's force and signals, shape
    /// (6,), with the present coefficients; `None` before the first sample.
    ///
    /// # Errors
    /// [`Error::Plant`] if the coefficients do not yet form a plant; [`Error::Setting`] unless the
    /// duration is from 0 to 3600 s.
    pub fn predict(&self, duration_s: f64) -> Result<Option<Vector6<f64>>, Error> {
        if !(0.0..=LONGEST_PREDICTION_S).contains(&duration_s) {
            return Err(Error::Setting {
                name: "the time to predict over".to_owned(),
                found: format!("{duration_s} s"),
                expected: format!("from 0 to {LONGEST_PREDICTION_S} s"),
            });
        }
        let Some(last) = self.recent[0] else { return Ok(None) };
        let six_axes = Prepared::of_six(&self.plant()?, None)?;
        let steps = (duration_s / 0.02).ceil().max(1.0);
        let h = duration_s / steps;
        let rate = |velocity: &Vector6<f64>| {
            six_axes.rate(velocity, &last.down_body, &last.force, &last.signals)
        };
        let mut velocity = last.velocity;
        for _ in 0..steps as usize {
            let middle = velocity + rate(&velocity) * (0.5 * h);
            velocity += rate(&middle) * h;
        }
        Ok(Some(velocity))
    }

    fn plant(&self) -> Result<Plant, Error> {
        if !self.is_started && self.elapsed_s < self.options.start_s {
            let (found, needed) = (self.elapsed_s, self.options.start_s);
            let reason = format!(
                "is not known yet: {found:.1} s of motion were taken in, and the start needs {needed:.1} s"
            );
            return Err(Error::Plant { axes: self.structure.name(), reason });
        }
        let mut theta = self.coefficients().to_vec();
        self.possible.project(&mut theta);
        Plant::new(self.structure.clone(), theta)
    }
}

/// Checks that a sample can hold all signals, and that at least one coefficient is free.
fn check_terms(structure: &Structure) -> Result<(), Error> {
    let refuse = |reason: String| Err(Error::Plant { axes: structure.name(), reason });
    let signals = structure.signals().len();
    if signals > MOST_SIGNALS {
        return refuse(format!(
            "reads {signals} signals of rudders, fins, propellers and wind, and a sample holds {MOST_SIGNALS}; leave some out"
        ));
    }
    if structure.terms().iter().all(|term| structure.held(term).is_some()) {
        return refuse("holds every coefficient, so that nothing is left to identify".to_owned());
    }
    Ok(())
}

/// Returns the terms that act on each axis.
fn terms_by_axis(structure: &Structure) -> [Vec<usize>; 6] {
    std::array::from_fn(|axis| {
        let acts = |term: &Basis| match term {
            // C(M) acts on every axis of a plant that turns.
            Basis::Mass(..) => true,
            _ => structure.axes_of(term).iter().any(|dof| dof.index() == axis),
        };
        let terms = structure.terms().iter().enumerate();
        terms.filter(|(_, term)| acts(term)).map(|(k, _)| k).collect()
    })
}
