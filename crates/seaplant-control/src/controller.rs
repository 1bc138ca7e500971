//! Runs the control laws step by step.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, UnitQuaternion, Vector3, Vector6};
use seaplant::estimate::online::Possible;
use seaplant::plant::{Basis, Instant, Plant, Product};

use crate::{Gains, Law};

/// Pose and velocity of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State {
    /// Position north, east and down, m.
    pub position_ned: Vector3<f64>,
    /// Rotation from body to world.
    pub attitude: UnitQuaternion<f64>,
    /// Velocity in body axes, m/s and rad/s, shape (6,).
    pub velocity: Vector6<f64>,
}

/// Desired pose and motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Position north, east and down, m.
    pub position_ned: Vector3<f64>,
    /// Desired velocity, m/s.
    pub velocity_ned: Vector3<f64>,
    /// Desired acceleration, m/s².
    pub acceleration_ned: Vector3<f64>,
    /// Rotation from the desired body axes to the world.
    pub attitude: UnitQuaternion<f64>,
    /// Desired angular velocity in desired body axes, rad/s.
    pub turning: Vector3<f64>,
    /// Its derivative, rad/s².
    pub turning_rate: Vector3<f64>,
}

impl Reference {
    /// Creates a reference at rest at a position and an attitude.
    pub fn at(position_ned: Vector3<f64>, attitude: UnitQuaternion<f64>) -> Self {
        let zero = Vector3::zeros();
        Self {
            position_ned,
            velocity_ned: zero,
            acceleration_ned: zero,
            attitude,
            turning: zero,
            turning_rate: zero,
        }
    }
}

/// Errors and desired accelerations, in body axes.
struct Wanted {
    error: Vector6<f64>,
    rate: Vector6<f64>,
    velocity: Vector6<f64>,
    acceleration: Vector6<f64>,
}

/// State of an adaptive model in addition to its coefficients.
#[derive(Clone, Debug)]
pub struct Adaptation {
    /// Inverse of Γ, factored.
    gain: Cholesky<f64, Dyn>,
    adaptation_s: f64,
    /// Mean of `Yᵀ K⁻¹ Y` over typical motion, and over the motion so far.
    typical: DMatrix<f64>,
    power: DMatrix<f64>,
    time_s: f64,
    next_s: f64,
    possible: Possible,
    /// Coefficients that must not be negative: an axis's own damping.
    not_negative: Vec<usize>,
    theta: Vec<f64>,
}

/// Number of instants of typical motion.
const INSTANTS: usize = 200;

/// Weight of typical motion relative to the motion so far.
const TYPICAL_PART: f64 = 0.05;

/// Ridge added to the excitation matrix, relative to its diagonal.
const RIDGE: f64 = 1e-2;

/// Time after which Γ is updated, and then after twice as long, and so on, s.
const FIRST_GAIN_S: f64 = 10.0;

impl Adaptation {
    /// Computes Γ = (T S)⁻¹ with S the mean of `Yᵀ K⁻¹ Y`: excited coefficients adapt with the time
    /// constant T.
    fn new(plant: &Plant, gains: &Gains, speed: &[f64; 6]) -> Option<Self> {
        let p = plant.coefficients().len();
        let mut typical = DMatrix::zeros(p, p);
        for k in 0..INSTANTS {
            let at = typical_motion(plant, gains, speed, k as f64);
            let columns: Vec<Vector6<f64>> =
                plant.structure().terms().iter().map(|term| term.regressor(&at)).collect();
            add_power(&mut typical, &columns, gains, 1.0 / INSTANTS as f64);
        }
        let adaptation_s = gains.adaptation_s;
        Some(Self {
            gain: factored(&typical, adaptation_s)?,
            adaptation_s,
            power: DMatrix::zeros(p, p),
            typical,
            time_s: 0.0,
            next_s: FIRST_GAIN_S,
            possible: Possible::of(plant.structure(), None),
            not_negative: own_damping(plant),
            theta: plant.coefficients().to_vec(),
        })
    }

    /// Integrates θ̂̇ = −Γ Yᵀ s over a period.
    fn follow(
        &mut self,
        columns: &[Vector6<f64>],
        slide: &Vector6<f64>,
        gains: &Gains,
        period_s: f64,
    ) {
        self.time_s += period_s;
        let part = period_s / self.time_s;
        self.power *= 1.0 - part;
        add_power(&mut self.power, columns, gains, part);
        if self.time_s >= self.next_s {
            let power = &self.power + &self.typical * TYPICAL_PART;
            if let Some(gain) = factored(&power, self.adaptation_s) {
                self.gain = gain;
            }
            self.next_s *= 2.0;
        }
        let mut slope = DVector::from_fn(columns.len(), |k, _| columns[k].dot(slide));
        self.gain.solve_mut(&mut slope);
        for (theta, slope) in self.theta.iter_mut().zip(slope.iter()) {
            *theta -= period_s * slope;
        }
        for at in 0..self.not_negative.len() {
            self.lift(self.not_negative[at]);
        }
        self.possible.project(&mut self.theta);
    }

    /// Moves a negative coefficient to zero along the shortest path in the norm of Γ⁻¹, so that
    /// correlated coefficients do not drift.
    fn lift(&mut self, k: usize) {
        let below = self.theta[k];
        if below >= 0.0 {
            return;
        }
        let mut along = DVector::zeros(self.theta.len());
        along[k] = 1.0;
        self.gain.solve_mut(&mut along);
        let own = along[k];
        for (theta, along) in self.theta.iter_mut().zip(along.iter()) {
            *theta -= below / own * along;
        }
    }
}

fn own_damping(plant: &Plant) -> Vec<usize> {
    let is_own = |term: &Basis| match term {
        Basis::Product(on, product) => {
            [Product::linear(*on), Product::quadratic(*on)].contains(product)
        }
        _ => false,
    };
    let terms = plant.structure().terms().iter().enumerate();
    terms.filter(|(_, term)| is_own(term)).map(|(k, _)| k).collect()
}

/// Adds `weight Yᵀ K⁻¹ Y` of the controlled axes.
fn add_power(power: &mut DMatrix<f64>, columns: &[Vector6<f64>], gains: &Gains, weight: f64) {
    for (&dof, axis) in &gains.axes {
        let (i, weight) = (dof.index(), weight / axis.slide());
        for (a, column) in columns.iter().enumerate().filter(|(_, column)| column[i] != 0.0) {
            for (b, other) in columns.iter().enumerate() {
                power[(a, b)] += weight * column[i] * other[i];
            }
        }
    }
}

/// Factors the inverse of Γ; coefficients without excitation do not adapt.
fn factored(power: &DMatrix<f64>, adaptation_s: f64) -> Option<Cholesky<f64, Dyn>> {
    let mut power = power * adaptation_s;
    for k in 0..power.nrows() {
        let own = power[(k, k)];
        power[(k, k)] = if own > 0.0 { own * (1.0 + RIDGE) } else { f64::MAX.sqrt() };
    }
    power.cholesky()
}

/// Returns a typical motion: a sine on every axis, at its bandwidth or close to it.
fn typical_motion(plant: &Plant, gains: &Gains, speed: &[f64; 6], k: f64) -> Instant {
    let mut at = Instant {
        acceleration: Vector6::zeros(),
        velocity: Vector6::zeros(),
        down_body: Vector3::z(),
    };
    for dof in plant.axes() {
        let i = dof.index();
        let omega =
            gains.axes.get(dof).map_or(0.5, |axis| std::f64::consts::TAU * axis.bandwidth_hz);
        let (sin, cos) = (k * (0.37 + 0.11 * i as f64) + i as f64).sin_cos();
        at.velocity[i] = speed[i] * sin;
        at.acceleration[i] = speed[i] * omega * cos;
    }
    at
}

impl crate::AxisGains {
    /// Returns K of the law of Slotine and Li, the gain of s.
    pub(crate) fn slide(&self) -> f64 {
        self.kd - self.mass * self.lambda
    }
}

/// A running controller.
///
/// ```
/// use nalgebra::{UnitQuaternion, Vector3, Vector6};
/// use seaplant::Dof;
/// use seaplant::plant::{Plant, Structure, Symmetry};
/// use seaplant_control::{Actuators, Controller, Design, Law, Reference, State, Tuning, design};
/// let plant = Plant::new(Structure::of(&[Dof::Surge], Symmetry::None)?, vec![100.0, 5.0, 20.0])?;
/// let asked = Design { law: Law::Pd, tuning: [(Dof::Surge, Tuning::new(0.1, 1.0))].into(), ..Design::default() };
/// let gains = design(&plant, &[], &Actuators::default(), &asked)?;
/// let mut controller = Controller::new(plant, gains, &asked.speed);
/// let level = UnitQuaternion::identity();
/// let state = State { position_ned: Vector3::zeros(), attitude: level, velocity: Vector6::zeros() };
/// let force = controller.command(&state, &Reference::at(Vector3::x(), level));
/// assert!(force[0] > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Controller {
    plant: Plant,
    gains: Gains,
    integral: Vector6<f64>,
    adaptation: Option<Adaptation>,
}

impl Controller {
    /// Creates a controller for a plant; `speed` is typical of each axis, m/s and rad/s.
    pub fn new(plant: Plant, gains: Gains, speed: &[f64; 6]) -> Self {
        let adapts = gains.adapts && gains.law.is_model_based();
        let adaptation = if adapts { Adaptation::new(&plant, &gains, speed) } else { None };
        Self { plant, gains, integral: Vector6::zeros(), adaptation }
    }

    /// Returns the current coefficients, shape (p,).
    pub fn coefficients(&self) -> &[f64] {
        match &self.adaptation {
            Some(adaptation) => &adaptation.theta,
            None => self.plant.coefficients(),
        }
    }

    /// Returns the gains in use.
    pub fn gains(&self) -> &Gains {
        &self.gains
    }

    /// Computes the force for the next period, within the limits, N and N m, shape (6,).
    ///
    /// While an axis is at its limit neither its integral nor the model is updated. If a number of
    /// state or reference is not finite, the force on the affected axes is zero, and neither is
    /// updated.
    pub fn command(&mut self, state: &State, reference: &Reference) -> Vector6<f64> {
        let wanted = wanted(state, reference);
        let period_s = 1.0 / self.gains.sample_hz;
        let down_body = state.attitude.inverse() * Vector3::z();
        let (columns, slide) = self.regressors(state, &wanted, down_body);
        let mut force = self.feedback(&wanted);
        for (column, theta) in columns.iter().zip(self.coefficients()) {
            force += column * *theta;
        }
        let mut is_limited = force.iter().any(|force| !force.is_finite());
        let mut limited = Vector6::zeros();
        for (&dof, axis) in &self.gains.axes {
            let i = dof.index();
            if !force[i].is_finite() {
                continue;
            }
            let most = axis.limit.unwrap_or(f64::INFINITY);
            limited[i] = force[i].clamp(-most, most);
            if force[i].abs() > most {
                is_limited = true;
            } else if axis.ki > 0.0 {
                self.integral[i] += period_s * wanted.error[i];
            }
        }
        if let Some(adaptation) = self.adaptation.as_mut().filter(|_| !is_limited) {
            adaptation.follow(&columns, &slide, &self.gains, period_s);
        }
        limited
    }

    /// Computes the part without model.
    fn feedback(&self, wanted: &Wanted) -> Vector6<f64> {
        let mut force = Vector6::zeros();
        for (&dof, axis) in &self.gains.axes {
            let i = dof.index();
            let (e, rate) = (wanted.error[i], wanted.rate[i]);
            force[i] = match self.gains.law {
                // The model's mass is already in its regressors.
                Law::Exact => 0.0,
                Law::SlotineLi => {
                    let slide = axis.slide();
                    let left = axis.kp - slide * axis.lambda;
                    -slide * (rate + axis.lambda * e) - left * e
                }
                Law::Pd | Law::Pid | Law::NonExact => {
                    -axis.kp * e - axis.kd * rate - axis.ki * self.integral[i]
                }
            };
        }
        force
    }

    /// Returns Y of the model's part on the controlled axes, and s; empty for laws without a model.
    fn regressors(
        &self,
        state: &State,
        wanted: &Wanted,
        down_body: Vector3<f64>,
    ) -> (Vec<Vector6<f64>>, Vector6<f64>) {
        if !self.gains.law.is_model_based() {
            return (Vec::new(), Vector6::zeros());
        }
        let (mut acceleration, mut velocity) = (wanted.acceleration, wanted.velocity);
        let mut slide = Vector6::zeros();
        let mut own = Vector6::zeros();
        for (&dof, axis) in &self.gains.axes {
            let i = dof.index();
            own[i] = 1.0;
            slide[i] = wanted.rate[i] + axis.lambda * wanted.error[i];
            match self.gains.law {
                Law::SlotineLi => {
                    velocity[i] -= axis.lambda * wanted.error[i];
                    acceleration[i] -= axis.lambda * wanted.rate[i];
                }
                Law::Exact => {
                    let (kp, kd) = (axis.kp / axis.mass, axis.kd / axis.mass);
                    acceleration[i] -= kd * wanted.rate[i] + kp * wanted.error[i];
                }
                Law::Pd | Law::Pid | Law::NonExact => {}
            }
        }
        // Axes without control move freely.
        let measured = |i: usize| if own[i] > 0.0 { velocity[i] } else { state.velocity[i] };
        let reference = Vector6::from_fn(|i, _| measured(i));
        let acceleration = acceleration.component_mul(&own);
        let at = |velocity| Instant { acceleration, velocity, down_body };
        let column = |term: &Basis| {
            let y = match self.gains.law {
                Law::SlotineLi => term.reference_regressor(&at(state.velocity), &reference),
                Law::Exact => term.regressor(&at(state.velocity)),
                _ => term.regressor(&at(reference)),
            };
            y.component_mul(&own)
        };
        (self.plant.structure().terms().iter().map(column).collect(), slide)
    }
}

fn joined(a: Vector3<f64>, b: Vector3<f64>) -> Vector6<f64> {
    Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
}

/// Computes errors in body axes: `Rᵀ (p − p_d)`, twice the vector part of the quaternion from the
/// desired attitude, and `ν − ν_d`.
///
/// # Source
/// [Fossen2021, ch. 15].
fn wanted(state: &State, reference: &Reference) -> Wanted {
    let to_body = state.attitude.inverse();
    let part = |from: usize| {
        Vector3::new(state.velocity[from], state.velocity[from + 1], state.velocity[from + 2])
    };
    let (v, omega) = (part(0), part(3));
    let off = reference.attitude.inverse() * state.attitude;
    let sign = if off.w < 0.0 { -2.0 } else { 2.0 };
    let turned = off.imag() * sign;
    let from_desired = off.inverse();
    let turning = from_desired * reference.turning;
    let velocity = to_body * reference.velocity_ned;
    // In body axes the desired velocity rotates relative to the body.
    let acceleration = to_body * reference.acceleration_ned - omega.cross(&velocity);
    let turning_rate = from_desired * reference.turning_rate - (omega - turning).cross(&turning);
    Wanted {
        error: joined(to_body * (state.position_ned - reference.position_ned), turned),
        rate: joined(v - velocity, omega - turning),
        velocity: joined(velocity, turning),
        acceleration: joined(acceleration, turning_rate),
    }
}
