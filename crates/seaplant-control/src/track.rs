//! Simulates the closed loop: a vehicle, its thrusters, its water and its instruments.

use std::collections::{BTreeMap, VecDeque};

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use seaplant::Dof;
use seaplant::plant::Plant;

use crate::limits::check_rates;
use crate::{Actuators, Controller, Error, Reference, State};

/// Reference path along each axis by itself, relative to the start, level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Path {
    /// Station keeping.
    Hold,
    /// `amplitude · sin(ω t)`, with a soft start.
    Sine {
        /// m or rad.
        amplitude: f64,
        /// ω, rad/s.
        rate: f64,
    },
    /// A step, smoothed by a second-order filter of ω rad/s.
    Step {
        /// m or rad.
        size: f64,
        /// ω, rad/s.
        rate: f64,
    },
}

/// Duration of the soft start of a sine, s.
const SOFT_S: f64 = 10.0;

impl Path {
    /// Returns displacement and its first and second derivative.
    pub fn at(&self, t: f64) -> [f64; 3] {
        match *self {
            Self::Hold => [0.0; 3],
            Self::Sine { amplitude, rate } => {
                let (sin, cos) = (rate * t).sin_cos();
                // A smooth step from zero to one.
                let x = (t / SOFT_S).min(1.0);
                let (w, w1, w2) = if x < 1.0 {
                    let w = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
                    let w1 = 30.0 * x * x * (1.0 - x) * (1.0 - x) / SOFT_S;
                    let w2 = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x) / (SOFT_S * SOFT_S);
                    (w, w1, w2)
                } else {
                    (1.0, 0.0, 0.0)
                };
                [
                    amplitude * w * sin,
                    amplitude * (w1 * sin + w * rate * cos),
                    amplitude * (w2 * sin + 2.0 * w1 * rate * cos - w * rate * rate * sin),
                ]
            }
            Self::Step { size, rate } => {
                let x = rate * t;
                let left = (-x).exp();
                [
                    size * (1.0 - (1.0 + x) * left),
                    size * rate * x * left,
                    size * rate * rate * (1.0 - x) * left,
                ]
            }
        }
    }
}

/// Disturbances and measurement errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sea {
    /// Velocity of the water north, east and down, m/s.
    pub current_ned: [f64; 3],
    /// Standard deviation of measured velocity, m/s and rad/s.
    pub velocity_noise: f64,
    /// Standard deviation of measured position and attitude, m and rad.
    pub position_noise: f64,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Result of tracking.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tracked {
    /// Root mean square of the true error by axis, after the first tenth of the run, m and rad.
    pub rms: BTreeMap<Dof, f64>,
    /// Greatest error by axis in the same time.
    pub greatest: BTreeMap<Dof, f64>,
    /// Fraction of the time in which some axis was at its limit.
    pub saturated: f64,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// The error on all six axes at each.
    pub error: Vec<Vector6<f64>>,
}

/// The longest step of the integration, s.
const STEP_S: f64 = 0.02;

/// Returns the approximate number of integration steps of a run.
pub(crate) fn steps(duration_s: f64, sample_hz: f64) -> f64 {
    duration_s * sample_hz.max(1.0 / STEP_S)
}

/// Speed at which a vehicle counts as diverging, m/s and rad/s.
const RUNAWAY: f64 = 100.0;

struct Vehicle<'a> {
    truth: &'a Plant,
    state: State,
    force: Vector6<f64>,
    waiting: VecDeque<Vector6<f64>>,
}

/// Follows paths with a controller on a vehicle that may differ from the controller's plant.
///
/// `truth` is integrated by RK4 in steps of at most 0.02 s; commands are delayed by complete
/// periods, rounded up, and pass the lag.
///
/// # Errors
/// [`Error::Plant`] if the true plant cannot move; [`Error::RunsAway`] if its speed grows without
/// end; [`Error::Setting`] for a sampling rate or a delay that would take too many steps.
pub fn track(
    truth: &Plant,
    controller: &mut Controller,
    actuators: &Actuators,
    paths: &BTreeMap<Dof, Path>,
    sea: &Sea,
    duration_s: f64,
) -> Result<Tracked, Error> {
    check_rates(truth, controller.gains().sample_hz, actuators)?;
    let period_s = 1.0 / controller.gains().sample_hz;
    let mut random = ChaCha8Rng::seed_from_u64(sea.seed);
    let start = State {
        position_ned: Vector3::zeros(),
        attitude: UnitQuaternion::identity(),
        velocity: Vector6::zeros(),
    };
    let slowest = actuators.delay_s.iter().fold(0.0_f64, |a, b| a.max(*b));
    let late = (slowest / period_s - 1e-9).ceil().max(0.0) as usize;
    let mut vehicle = Vehicle {
        truth,
        state: start,
        force: Vector6::zeros(),
        waiting: std::iter::repeat_n(Vector6::zeros(), late).collect(),
    };
    let mut tracked = Tracked::default();
    let count = (duration_s / period_s).round() as usize;
    let mut limited = 0_usize;
    for k in 0..count {
        let t = period_s * k as f64;
        let reference = reference(paths, t);
        tracked.time_s.push(t);
        tracked.error.push(error(&vehicle.state, &reference));
        let asked = controller.command(&measured(&vehicle.state, sea, &mut random), &reference);
        let at_limit = |(dof, axis): (&Dof, &crate::AxisGains)| {
            axis.limit.is_some_and(|limit| asked[dof.index()].abs() >= limit)
        };
        limited += usize::from(controller.gains().axes.iter().any(at_limit));
        vehicle.waiting.push_back(asked);
        let command = vehicle.waiting.pop_front().unwrap_or(asked);
        vehicle.advance(&command, actuators, sea, period_s)?;
    }
    tracked.saturated = limited as f64 / count.max(1) as f64;
    let from = count / 10;
    for dof in controller.gains().axes.keys() {
        let of_axis = || tracked.error[from..].iter().map(|e| e[dof.index()]);
        let square: f64 = of_axis().map(|e| e * e).sum();
        let rms = (square / (count - from).max(1) as f64).sqrt();
        tracked.rms.insert(*dof, rms);
        tracked.greatest.insert(*dof, of_axis().fold(0.0, |a: f64, e| a.max(e.abs())));
    }
    Ok(tracked)
}

/// Evaluates all paths at a time: translations in the world, then heading, roll and pitch.
fn reference(paths: &BTreeMap<Dof, Path>, t: f64) -> Reference {
    let of = |dof: Dof| paths.get(&dof).map_or([0.0; 3], |path| path.at(t));
    let [n, e, d] = [Dof::Surge, Dof::Sway, Dof::Heave].map(of);
    let [roll, pitch, yaw] = [Dof::Roll, Dof::Pitch, Dof::Yaw].map(of);
    let part = |k: usize| Vector3::new(n[k], e[k], d[k]);
    // Angular velocity for small roll and pitch.
    let turning = |k: usize| Vector3::new(roll[k], pitch[k], yaw[k]);
    Reference {
        position_ned: part(0),
        velocity_ned: part(1),
        acceleration_ned: part(2),
        attitude: UnitQuaternion::from_euler_angles(roll[0], pitch[0], yaw[0]),
        turning: turning(1),
        turning_rate: turning(2),
    }
}

fn error(state: &State, reference: &Reference) -> Vector6<f64> {
    let place = state.attitude.inverse() * (state.position_ned - reference.position_ned);
    let turned = (reference.attitude.inverse() * state.attitude).scaled_axis();
    Vector6::new(place.x, place.y, place.z, turned.x, turned.y, turned.z)
}

fn measured(state: &State, sea: &Sea, random: &mut ChaCha8Rng) -> State {
    let mut noise = |std: f64| {
        let x: f64 = StandardNormal.sample(random);
        std * x
    };
    let mut noisy = *state;
    noisy.velocity.iter_mut().for_each(|v| *v += noise(sea.velocity_noise));
    noisy.position_ned.iter_mut().for_each(|x| *x += noise(sea.position_noise));
    let tilt = Vector3::from_fn(|_, _| noise(sea.position_noise));
    noisy.attitude *= UnitQuaternion::from_scaled_axis(tilt);
    noisy
}

/// Derivatives of position, attitude and velocity.
type Rate = (Vector3<f64>, Quaternion<f64>, Vector6<f64>);

impl Vehicle<'_> {
    fn advance(
        &mut self,
        command: &Vector6<f64>,
        actuators: &Actuators,
        sea: &Sea,
        period_s: f64,
    ) -> Result<(), Error> {
        let steps = (period_s / STEP_S).ceil().max(1.0);
        let h = period_s / steps;
        for _ in 0..steps as usize {
            for i in 0..6 {
                let lag_s = actuators.lag_s[i];
                // The mean over the step.
                let keep = if lag_s > 0.0 { (-h / lag_s).exp() } else { 0.0 };
                self.force[i] = command[i] + keep * (self.force[i] - command[i]);
            }
            self.step(sea, h)?;
        }
        let fastest = self.state.velocity.amax();
        if fastest.is_finite() && fastest < RUNAWAY {
            return Ok(());
        }
        Err(Error::RunsAway)
    }

    fn step(&mut self, sea: &Sea, h: f64) -> Result<(), Error> {
        let mut at = self.state;
        let (mut sum, mut slope) =
            ((Vector3::zeros(), Quaternion::default(), Vector6::zeros()), None);
        sum.1 = Quaternion::new(0.0, 0.0, 0.0, 0.0);
        for (part, weight) in [(0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)] {
            if let Some((v, q, a)) = slope {
                let turned: Quaternion<f64> = *self.state.attitude.quaternion() + q * (part * h);
                at.position_ned = self.state.position_ned + v * (part * h);
                at.attitude = UnitQuaternion::new_normalize(turned);
                at.velocity = self.state.velocity + a * (part * h);
            }
            let now = self.rate(&at, sea)?;
            let weight = weight * h / 6.0;
            sum = (sum.0 + now.0 * weight, sum.1 + now.1 * weight, sum.2 + now.2 * weight);
            slope = Some(now);
        }
        self.state.position_ned += sum.0;
        self.state.attitude =
            UnitQuaternion::new_normalize(*self.state.attitude.quaternion() + sum.1);
        let down = self.state.attitude.inverse() * Vector3::z();
        self.state.velocity = self.truth.with_held_angles(&(self.state.velocity + sum.2), &down);
        Ok(())
    }

    fn rate(&self, at: &State, sea: &Sea) -> Result<Rate, Error> {
        let to_body = at.attitude.inverse();
        let water = to_body * Vector3::from(sea.current_ned);
        let velocity = self.truth.with_held_angles(&at.velocity, &(to_body * Vector3::z()));
        let part = |k: usize| Vector3::new(velocity[k], velocity[k + 1], velocity[k + 2]);
        let (v, omega) = (part(0), part(3));
        let turning = omega.cross(&water);
        let own = |i: usize| self.truth.axes().iter().any(|dof| dof.index() == i);
        let mut relative = velocity;
        for i in (0..3).filter(|i| own(*i)) {
            relative[i] -= water[i];
        }
        let mut rate =
            self.truth.acceleration(&self.force, &relative, &(to_body * Vector3::z()))?;
        for i in (0..3).filter(|i| own(*i)) {
            rate[i] -= turning[i];
        }
        let spin = *at.attitude.quaternion() * Quaternion::from_imag(omega) * 0.5;
        Ok((at.attitude * v, spin, rate))
    }
}
