//! Identification while samples come in, for plants of one to six axes.
//!
//! Three estimators share one equation of motion, averaged over the step between two samples:
//! the adaptive observer of Smallwood and Whitcomb, recursive least squares with directional
//! forgetting, and the extended Kalman filter whose state holds the coefficients. None needs an
//! acceleration. [`Online`] is fed sample by sample; between its first sample and its last it
//! allocates nothing.
//!
//! The water is taken as still, or its velocity as taken off before; thrust acts as it is given.
//! Rudders, fins, propellers of unknown strength and wind are terms like any other, which read the
//! signals of a sample; a coefficient that the structure holds stays as it is.

mod acting;
mod adaptive;
mod change;
mod factor;
mod instruments;
mod joint;
pub(crate) mod logs;
mod options;
mod possible;
mod recursive;
mod sample;
mod single;
mod step;

use nalgebra::{DMatrix, Vector6};

pub use change::Change;
pub use logs::{OnlineFit, OnlineHistory, fit_online_coupled};
pub use options::{OnlineOptions, Scheme};
pub use possible::Possible;
pub use sample::{MOST_SIGNALS, Sample};
pub use single::fit_online;

use crate::Error;
use crate::motion::Whole;
use crate::plant::{Basis, Plant, RigidBody, Structure};
use adaptive::Adaptive;
use change::Changes;
use factor::Factor;
use joint::{Joint, JointNoise};
use recursive::Recursive;
use step::Step;

/// What is estimated at an instant.
#[derive(Clone, Debug, PartialEq)]
pub struct OnlineEstimate {
    /// The plant; its M is positive definite and its damping takes power.
    pub plant: Plant,
    /// Standard deviation of each coefficient, shape (p,): infinite of those that nothing told.
    pub std: Vec<f64>,
    /// What each coefficient's variance is multiplied with because others look like it,
    /// shape (p,).
    pub inflation: Vec<f64>,
    /// The least eigenvalue of the information, scaled to a unit diagonal: 1 if every
    /// coefficient is told by itself, 0 if some combination is not told at all.
    pub excitation: f64,
    /// Covariance of the coefficients, shape (p, p).
    pub covariance: DMatrix<f64>,
    /// Root mean square of what the equation misses on each axis, N and N m.
    pub residual: Vector6<f64>,
    /// Samples that would say as much if they were independent.
    pub independent_samples: f64,
    /// Motion so far, s.
    pub elapsed_s: f64,
}

/// The adaptive estimator's and the filter's own part.
enum Engine {
    Recursive,
    Adaptive(Box<Adaptive>),
    Ekf(Option<Box<Joint>>),
}

/// Identifies a plant sample by sample.
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
    /// Mean squares of third differences of velocity, of velocity, force and acceleration.
    rough: Vector6<f64>,
    speed: Vector6<f64>,
    force: Vector6<f64>,
    acceleration: Vector6<f64>,
    projected: Vec<f64>,
}

/// The variance of a third difference of white noise over that of the noise.
const THIRD_DIFFERENCE: f64 = 20.0;

/// The observer's rate is at most this times the power of velocity over that of its noise, 1/s:
/// noise biases damping by `a M σ²`.
const QUIET_RATE: f64 = 0.002;

/// … but no less than this, 1/s.
const LEAST_RATE: f64 = 0.5;

/// No start before the standard deviation of every own mass is below this part of it …
const KNOWN_PART: f64 = 0.03;

/// … but no later than after so many times the usual start.
const LONGEST_START: f64 = 10.0;

/// The variances that a filter starts from are those of least squares times this.
const START_VARIANCE: f64 = 4.0;

/// No own mass is below this part of typical force over typical acceleration.
const LEAST_MASS: f64 = 0.05;

/// What a change of the plant leaves of what was learnt.
const KEPT: f64 = 0.05;

/// The standard deviation that a change of the plant adds to a coefficient, as a part of it.
const REOPENED: f64 = 0.3;

impl Online {
    /// An estimator of a structure; M ⪰ M_RB where the dry vehicle is known, else M ≻ 0.
    ///
    /// # Errors
    /// [`Error::Setting`] for settings that cannot be; [`Error::Plant`] for a structure whose
    /// effects read more than [`MOST_SIGNALS`], or one without a free coefficient.
    pub fn new(
        structure: Structure,
        scheme: Scheme,
        options: OnlineOptions,
        rigid_body: Option<&RigidBody>,
    ) -> Result<Self, Error> {
        options.check()?;
        check_terms(&structure)?;
        let step = Step::of(&structure);
        let held: Vec<Option<f64>> =
            structure.terms().iter().map(|term| structure.held(term)).collect();
        let p = step.count();
        let memory_s = options.memory_s.unwrap_or(f64::INFINITY);
        Ok(Self {
            possible: Possible::of(&structure, rigid_body.map(RigidBody::mass_matrix)),
            recursive: Recursive::new(
                &step,
                &touched(&structure),
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
            changes: Changes::new(p, options.change_threshold),
            step,
            recent: [None; 3],
            elapsed_s: 0.0,
            is_started: false,
            rough: Vector6::zeros(),
            speed: Vector6::zeros(),
            force: Vector6::zeros(),
            acceleration: Vector6::zeros(),
            projected: vec![0.0; p],
            options,
            structure,
        })
    }

    /// The same, starting from a plant instead of least squares over its first seconds.
    ///
    /// The adaptive observer follows from there; least squares and the filter take their own
    /// start and are the same as without.
    ///
    /// # Errors
    /// [`Error::Plant`] if it has other terms.
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

    /// The terms that are identified.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Takes a sample in; tells of a change of the plant when it is noticed.
    ///
    /// A step longer than the longest counts as a gap: motion begins anew after it, and what was
    /// learnt stays.
    ///
    /// # Errors
    /// [`Error::NotFinite`] or [`Error::Setting`] for a sample that is not finite, or not after
    /// the one before; the estimator is then as it was.
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
        self.step.take(last.as_ref(), &from, sample);
        self.elapsed_s += self.step.length_s;
        self.measure(&[Some(*sample), before, last]);
        let simulates = self.elapsed_s >= self.options.start_s;
        self.recursive.update(&self.step, &self.possible, simulates);
        let change = self.changed();
        self.follow();
        if change.is_some() {
            self.recursive.forget(KEPT);
            self.reopen();
        }
        Ok(change)
    }

    /// Motion begins anew with the next sample, as after a gap; what was learnt stays.
    pub fn restart(&mut self) {
        self.recent = [None; 3];
        self.recursive.restart();
        match &mut self.engine {
            Engine::Adaptive(adaptive) => adaptive.restart(),
            Engine::Ekf(Some(joint)) => joint.restart(),
            Engine::Recursive | Engine::Ekf(None) => {}
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
        let after = self.recent[0].is_none_or(|last| sample.time_s > last.time_s);
        after.then_some(()).ok_or_else(|| Error::Setting {
            name: "the time of a sample".to_owned(),
            found: format!("{} s", sample.time_s),
            expected: "after that of the one before; restart() begins anew".to_owned(),
        })
    }

    /// Mean squares that tell the noise.
    fn measure(&mut self, recent: &[Option<Sample>; 3]) {
        let part = (self.step.length_s / self.elapsed_s).min(1.0);
        let square = |x: Vector6<f64>| x.component_mul(&x);
        self.force += (square(self.step.force) - self.force) * part;
        self.speed += (square(self.step.velocity[2]) - self.speed) * part;
        self.acceleration += (square(self.step.acceleration) - self.acceleration) * part;
        if let [Some(a), Some(b), Some(c)] = recent {
            let bend = a.velocity - 2.0 * b.velocity + c.velocity;
            // Second differences have 6 of 20 parts of what third ones have.
            self.rough += (square(bend) * (THIRD_DIFFERENCE / 6.0) - self.rough) * part;
        }
    }

    fn changed(&mut self) -> Option<Change> {
        if self.elapsed_s < self.options.start_s {
            return None;
        }
        for row in self.recursive.rows() {
            self.changes.add(&row);
        }
        let until_s = self.recent[0].map_or(0.0, |sample| sample.time_s);
        self.changes.end(until_s, self.step.length_s)
    }

    /// Lets the estimator itself follow.
    fn follow(&mut self) {
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
        if self.is_started && self.coefficients().iter().any(|x| !x.is_finite()) {
            self.stop();
        }
    }

    /// What ran away begins anew from least squares.
    fn stop(&mut self) {
        self.is_started = false;
        match &mut self.engine {
            Engine::Recursive => {}
            Engine::Adaptive(adaptive) => adaptive.restart(),
            Engine::Ekf(joint) => *joint = None,
        }
    }

    /// Whether the scheme itself works yet; until then its estimates are those of least squares,
    /// which make its start.
    pub fn has_started(&self) -> bool {
        self.is_started
    }

    /// The observer's rate that the noise of measured velocity allows, 1/s.
    fn quiet_rate(&self) -> f64 {
        let of = |i: usize| {
            let noise = self.rough[i] / THIRD_DIFFERENCE;
            if noise > 0.0 { QUIET_RATE * self.speed[i] / noise } else { f64::INFINITY }
        };
        let least = self.structure.axes().iter().map(|dof| of(dof.index()));
        let least = least.fold(f64::INFINITY, f64::min);
        least.max(LEAST_RATE).min(self.options.observer_rate)
    }

    /// Whether least squares know every own mass well enough to go on from, or have had long
    /// enough to.
    fn may_start(&mut self) -> bool {
        let (elapsed_s, start_s) = (self.elapsed_s, self.options.start_s);
        if elapsed_s < start_s || elapsed_s >= LONGEST_START * start_s {
            return elapsed_s >= start_s;
        }
        let Self { structure, recursive, projected, .. } = self;
        let mut own = structure.terms().iter().enumerate();
        own.all(|(k, term)| match term {
            Basis::Mass(i, j) if i == j => {
                recursive.white_std(k, projected) < KNOWN_PART * recursive.theta()[k]
            }
            _ => true,
        })
    }

    fn start(&mut self) {
        let rate = self.quiet_rate();
        for dof in self.structure.axes() {
            let i = dof.index();
            if self.acceleration[i] > 0.0 && self.force[i] > 0.0 {
                let typical = (self.force[i] / self.acceleration[i]).sqrt();
                self.possible.set_least(*dof, LEAST_MASS * typical);
            }
        }
        self.projected.copy_from_slice(self.recursive.theta());
        self.possible.project(&mut self.projected);
        self.is_started = match &mut self.engine {
            Engine::Recursive => true,
            Engine::Adaptive(adaptive) => {
                adaptive.set_rate(rate);
                adaptive.start(&self.projected, &self.possible);
                true
            }
            Engine::Ekf(joint) => {
                let plant = Plant::new(self.structure.clone(), self.projected.clone());
                let covariance = covariance(&self.recursive);
                let most = |k: usize| 4.0 * self.projected[k].powi(2).max(f64::EPSILON);
                let variances: Vec<f64> = (0..self.projected.len())
                    .map(|k| START_VARIANCE * covariance[(k, k)].min(most(k)))
                    .collect();
                let wander = self.options.wander_per_minute / 60.0_f64.sqrt();
                let axes: Vec<usize> =
                    self.structure.axes().iter().map(|dof| dof.index()).collect();
                let residual = residual(&self.recursive);
                let noise = (self.rough / THIRD_DIFFERENCE).map(f64::sqrt);
                let noise =
                    JointNoise::of(&axes, &noise, &residual, &self.force.map(f64::sqrt), wander);
                *joint = plant
                    .and_then(|plant| Joint::new(&plant, &variances, noise))
                    .ok()
                    .map(Box::new);
                joint.is_some()
            }
        };
    }

    /// What was learnt no longer holds.
    fn reopen(&mut self) {
        if let Engine::Ekf(Some(joint)) = &mut self.engine {
            joint.reopen(REOPENED);
        }
    }

    /// The coefficients as they are now, before projection where least squares makes them;
    /// shape (p,).
    pub fn coefficients(&self) -> &[f64] {
        match &self.engine {
            Engine::Adaptive(adaptive) if self.is_started => adaptive.theta(),
            Engine::Ekf(Some(joint)) => joint.theta(),
            _ => self.recursive.theta(),
        }
    }

    /// The velocity that the plant as it is now has after so long under the last sample's force
    /// and signals, shape (6,); `None` before the first sample.
    ///
    /// # Errors
    /// [`Error::Plant`] if the coefficients make no plant yet.
    pub fn predict(&self, duration_s: f64) -> Result<Option<Vector6<f64>>, Error> {
        let Some(last) = self.recent[0] else { return Ok(None) };
        let whole = Whole::new(&self.plant()?)?;
        let steps = (duration_s / 0.02).ceil().max(1.0);
        let h = duration_s / steps;
        let rate = |velocity: &Vector6<f64>| {
            whole.rate(velocity, &last.down_body, &last.force, &last.signals)
        };
        let mut velocity = last.velocity;
        for _ in 0..steps as usize {
            let middle = velocity + rate(&velocity) * (0.5 * h);
            velocity += rate(&middle) * h;
        }
        Ok(Some(velocity))
    }

    /// The adaptive observer's error Δ = ν̂ − ν, shape (6,); zero of other schemes.
    pub fn observer_error(&self) -> Vector6<f64> {
        match &self.engine {
            Engine::Adaptive(adaptive) => *adaptive.error(),
            Engine::Recursive | Engine::Ekf(_) => Vector6::zeros(),
        }
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

    /// What is estimated now.
    ///
    /// # Errors
    /// [`Error::Plant`] if nothing was learnt yet.
    pub fn estimate(&self) -> Result<OnlineEstimate, Error> {
        let p = self.projected.len();
        let information = self.recursive.information();
        let mut covariance = covariance(&self.recursive);
        let free: Vec<usize> = (0..p).filter(|k| self.recursive.held()[*k].is_none()).collect();
        let scaled = DMatrix::from_fn(free.len(), free.len(), |a, b| {
            let (i, j) = (free[a], free[b]);
            let (own, other) = (information[i * (p + 1)], information[j * (p + 1)]);
            if own > 0.0 && other > 0.0 {
                information[i * p + j] / (own * other).sqrt()
            } else {
                0.0
            }
        });
        let excitation = scaled.symmetric_eigenvalues().min().max(0.0);
        let inflation = (0..p).map(|k| match self.recursive.held()[k] {
            Some(_) => 1.0,
            None => covariance[(k, k)] * information[k * (p + 1)],
        });
        let inflation = inflation.collect();
        if let Engine::Ekf(Some(joint)) = &self.engine {
            for k in 0..p {
                let factor = (joint.variance(k) / covariance[(k, k)]).max(1.0).sqrt();
                covariance.row_mut(k).scale_mut(factor);
                covariance.column_mut(k).scale_mut(factor);
            }
        }
        Ok(OnlineEstimate {
            plant: self.plant()?,
            std: (0..p).map(|k| covariance[(k, k)].sqrt()).collect(),
            inflation,
            excitation,
            covariance,
            residual: residual(&self.recursive),
            independent_samples: self.recursive.independent_samples(),
            elapsed_s: self.elapsed_s,
        })
    }
}

/// A sample holds so many signals, and something is to be found.
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

/// Root mean square of the residual of each axis.
fn residual(recursive: &Recursive) -> Vector6<f64> {
    let mut residual = Vector6::zeros();
    for row in recursive.rows() {
        residual[row.axis] = row.variance.sqrt();
    }
    residual
}

/// The inverse of information; zero of coefficients that are held.
fn covariance(recursive: &Recursive) -> DMatrix<f64> {
    let (information, held) = (recursive.information(), recursive.held());
    let p = held.len();
    let mut factor = Factor::of(p);
    factor.set(&information, 1e-9);
    let mut covariance = DMatrix::zeros(p, p);
    for k in (0..p).filter(|k| held[*k].is_none()) {
        if information[k * (p + 1)] <= 0.0 {
            covariance[(k, k)] = f64::INFINITY;
            continue;
        }
        let mut unit = vec![0.0; p];
        unit[k] = 1.0;
        factor.solve(&mut unit);
        covariance.column_mut(k).copy_from_slice(&unit);
    }
    covariance
}

/// The terms that act on each axis at all.
fn touched(structure: &Structure) -> [Vec<usize>; 6] {
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
