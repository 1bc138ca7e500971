//! Simulates a vehicle that drives a manoeuvre: excitation, station-keeping controller, limits,
//! thrusters, motion.

use nalgebra::{DVector, Rotation3, Vector3, Vector6};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use seaplant::estimate::ExpectedNoises;
use seaplant::motion::{State, StateSpace};
use seaplant::plant::{Basis, Plant};
use seaplant::random::{gauss_markov, normal};

use crate::Error;
use crate::hold::{DAMPING, TICK_S, TILTS, upright_rad_s};
use crate::limits::{Limits, Stop, Use};
use crate::logging::Logging;
use crate::manoeuvre::Manoeuvre;
use crate::rig::Rig;

/// Steps of the simulation in a tick.
const STEPS: usize = 2;
/// Length of a step, s.
const STEP_S: f64 = TICK_S / STEPS as f64;
/// Use of a limit from which the excitation is reduced …
pub(crate) const TAKEN_BACK: f64 = 0.75;
/// … and at which it is zero.
pub(crate) const TAKEN: f64 = 0.9;
/// Natural frequency of the controller that brings a vehicle back, rad/s.
const BACK: f64 = 0.5;

/// The controller that drives a manoeuvre: the same in simulations and in scripts.
#[derive(Clone, Debug)]
pub(crate) struct Pilot<'a> {
    pub(crate) rig: &'a Rig,
    pub(crate) limits: &'a Limits,
    pub(crate) manoeuvre: &'a Manoeuvre,
    /// Diagonal of M of the prior's plant, which scales controllers' gains.
    pub(crate) mass: [f64; 6],
    /// Stopping distance over squared speed, m/F of the weakest translation, and the swing of roll
    /// and pitch.
    pub(crate) stop: Stop,
    /// The vertical force that holds depth at rest: minus the believed excess of weight, N.
    pub(crate) trim_n: f64,
}

impl<'a> Pilot<'a> {
    pub(crate) fn new(
        plant: &Plant,
        rig: &'a Rig,
        limits: &'a Limits,
        manoeuvre: &'a Manoeuvre,
    ) -> Self {
        let m = plant.mass_matrix_of_six();
        let mass = std::array::from_fn(|k| m[(k, k)]);
        let stop = |k: usize| if rig.most[k] > 0.0 { 0.5 * mass[k] / rig.most[k] } else { 0.0 };
        let distance_s2 = (0..3).map(stop).fold(0.0, f64::max);
        let righting = plant.coefficient(&Basis::Lever(2)).unwrap_or(0.0).max(0.0);
        let swing = |k: usize| {
            let held = if rig.most[k] > 0.0 { upright_rad_s(rig).powi(2) } else { 0.0 };
            let rad_s = if mass[k] > 0.0 { (righting / mass[k] + held).sqrt() } else { 0.0 };
            if rad_s > 0.0 { 1.0 / rad_s } else { 0.0 }
        };
        let stop = Stop { distance_s2, swing_s: TILTS.map(swing) };
        let excess = plant.coefficient(&Basis::WeightExcess);
        let trim_n = if rig.most[2] > 0.0 { -excess.unwrap_or(0.0) } else { 0.0 };
        Self { rig, limits, manoeuvre, mass, stop, trim_n }
    }

    /// Returns the natural frequencies of the controller that brings a vehicle back, rad/s.
    pub(crate) fn back_rad_s(&self) -> [f64; 6] {
        let upright = upright_rad_s(self.rig);
        std::array::from_fn(|k| if TILTS.contains(&k) { upright } else { BACK })
    }

    /// Returns the fraction of the excitation that limits permit.
    pub(crate) fn part(&self, state: &State) -> f64 {
        let most = self.limits.most_used(state, &self.stop);
        ((TAKEN - most.part) / (TAKEN - TAKEN_BACK)).clamp(0.0, 1.0)
    }

    /// Returns the wrench that holds the initial state, with natural frequencies by axis.
    fn hold(&self, state: &State, rad_s: &[f64; 6]) -> Vector6<f64> {
        let turn = Rotation3::from_euler_angles(state[3], state[4], state[5]);
        let away = turn.inverse() * Vector3::new(state[0], state[1], state[2]);
        let heading = state[5].sin().atan2(state[5].cos());
        let error = [away.x, away.y, away.z, state[3], state[4], heading];
        Vector6::from_fn(|k, _| {
            if self.rig.most[k] == 0.0 || rad_s[k] == 0.0 {
                return 0.0;
            }
            let stiffness = self.mass[k] * rad_s[k] * rad_s[k];
            let damping = 2.0 * DAMPING * self.mass[k] * rad_s[k];
            let wanted = -stiffness * error[k] - damping * state[6 + k];
            wanted.clamp(-self.rig.most[k], self.rig.most[k])
        })
    }

    /// Returns the thrust of each thruster at a time since the start of the manoeuvre, N.
    pub(crate) fn thrusts(&self, t_s: f64, state: &State) -> DVector<f64> {
        let part = self.part(state);
        let own = self.hold(state, &self.manoeuvre.hold_rad_s);
        let back = self.hold(state, &self.back_rad_s());
        let mut hold = own * part + back * (1.0 - part);
        hold[2] += self.trim_n;
        let mut wrench = Vector6::zeros();
        for (dof, wave) in &self.manoeuvre.waves {
            wrench[dof.index()] = part * wave.at(t_s);
        }
        let mut excited = &self.rig.share * wrench;
        if let Some((thrusters, wave)) = &self.manoeuvre.opposing {
            let against = part * wave.at(t_s);
            for (thrust, x) in excited.iter_mut().zip(thrusters) {
                *thrust += against * x;
            }
        }
        self.rig.thrusts(&hold, &excited)
    }

    /// Returns the thrusts that follow `before` within the allowed slew, N.
    pub(crate) fn slewed(&self, before: &DVector<f64>, wanted: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(wanted.len(), |k, _| {
            let [reverse, ahead] = self.rig.allowed[k];
            let full = ahead.abs().max(reverse.abs()) / self.limits.thrust_part;
            let most = self.limits.slew_per_s * full * TICK_S;
            before[k] + (wanted[k] - before[k]).clamp(-most, most)
        })
    }
}

/// A simulated run.
#[derive(Clone, Debug)]
pub(crate) struct Driven {
    /// Instants, every [`TICK_S`], s.
    pub(crate) time_s: Vec<f64>,
    /// The input of each thruster from each instant on.
    pub(crate) inputs: Vec<Vec<f64>>,
    /// Pose from the beginning and velocity over ground at each.
    pub(crate) states: Vec<State>,
    /// The states as instruments measure them.
    pub(crate) measured: Vec<State>,
    /// The greatest use of a limit.
    pub(crate) worst: Use,
    /// The greatest use of each limit.
    pub(crate) uses: [Use; 6],
    /// Mean fraction of the excitation that limits permitted.
    pub(crate) part: f64,
}

/// Disturbances, noise of the instruments, and current of a run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sea<'a> {
    pub(crate) noises: &'a ExpectedNoises,
    pub(crate) logging: &'a Logging,
    /// Velocity of the water north and east, m/s.
    pub(crate) current: [f64; 2],
    pub(crate) seed: u64,
}

/// Drives a manoeuvre for some seconds from rest.
///
/// The motion is integrated by the classical Runge–Kutta method in steps of 0.05 s; the speed of
/// propellers lags, and thrust changes within a step accordingly.
///
/// # Errors
/// As [`StateSpace::new`], and where the motion runs away.
pub(crate) fn drive(
    plant: &Plant,
    pilot: &Pilot<'_>,
    seconds: f64,
    sea: Option<Sea<'_>>,
) -> Result<Driven, Error> {
    let space = StateSpace::new(plant)?;
    let known = pilot.manoeuvre.known(seconds);
    let loaded = known.first().map(|weight| StateSpace::under(plant, std::slice::from_ref(weight)));
    let loaded = loaded.transpose()?;
    let rig = pilot.rig;
    let n = rig.thrusters.len();
    let ticks = (seconds / TICK_S).round() as usize;
    let delay = (rig.delay_s / TICK_S).round() as usize;
    let mut state = State::zeros();
    let mut thrusts = DVector::zeros(n);
    let still: Vec<f64> = rig.thrusters.iter().map(|thruster| thruster.curve.neutral()).collect();
    let mut turning = still.clone();
    let disturbing = sea.map(|sea| disturbances(plant, sea, STEPS * ticks));
    let mut instruments = sea.map(Instruments::new);
    let current = sea.map_or([0.0; 2], |sea| sea.current);
    let current = Vector3::new(current[0], current[1], 0.0);
    let mut driven = Driven {
        time_s: Vec::with_capacity(ticks),
        inputs: vec![Vec::with_capacity(ticks); n],
        states: Vec::with_capacity(ticks),
        measured: Vec::with_capacity(ticks),
        worst: Use { part: 0.0, of: "none" },
        uses: pilot.limits.uses(&state, &Stop::default()),
        part: 0.0,
    };
    let h = STEP_S;
    // Fractions of a change that a lagging propeller has left after half of a step and after all of
    // it.
    let [half, whole] = [0.5, 1.0].map(|part| match rig.lag_s > 0.0 {
        true => (-part * h / rig.lag_s).exp(),
        false => 0.0,
    });
    for tick in 0..ticks {
        let t = tick as f64 * TICK_S;
        for (most, now) in driven.uses.iter_mut().zip(pilot.limits.uses(&state, &Stop::default())) {
            *most = most.or(now);
        }
        let hangs = known.iter().any(|weight| (weight.from_s..weight.to_s).contains(&t));
        let space = loaded.as_ref().filter(|_| hangs).unwrap_or(&space);
        let measured = instruments.as_mut().map_or(state, |own| own.measure(&state));
        let believed = instruments.as_mut().map_or(state, |own| own.estimate(&state, &measured));
        driven.part += pilot.part(&believed) / ticks as f64;
        driven.time_s.push(t);
        driven.states.push(state);
        driven.measured.push(measured);
        thrusts = pilot.slewed(&thrusts, &pilot.thrusts(t, &believed));
        for (k, inputs) in driven.inputs.iter_mut().enumerate() {
            inputs.push(rig.input(k, thrusts[k]));
        }
        let acting = tick.checked_sub(delay);
        let wanted = |k: usize| acting.map_or(still[k], |tick| driven.inputs[k][tick]);
        let speeds = |from: &[f64], left: f64| -> Vec<f64> {
            from.iter().enumerate().map(|(k, x)| wanted(k) + (x - wanted(k)) * left).collect()
        };
        if rig.lag_s <= 0.0 {
            turning = speeds(&turning, 0.0);
        }
        for step in 0..STEPS {
            let (middle, end) = (speeds(&turning, half), speeds(&turning, whole));
            let mut tau = [&turning, &middle, &end].map(|speeds| rig.wrench(speeds));
            if let Some(forces) = &disturbing {
                let first = 2 * (STEPS * tick + step);
                tau.iter_mut().zip(&forces[first..]).for_each(|(tau, force)| *tau += force);
            }
            state = stepped(space, &state, &tau, &current, h)?;
            turning = end;
        }
    }
    driven.worst = driven.uses.into_iter().fold(driven.worst, Use::or);
    Ok(driven)
}

fn stepped(
    space: &StateSpace,
    x: &State,
    [first, middle, last]: &[Vector6<f64>; 3],
    current: &Vector3<f64>,
    h: f64,
) -> Result<State, Error> {
    let a = space.rate(x, first, current)?;
    let b = space.rate(&(x + a * (0.5 * h)), middle, current)?;
    let c = space.rate(&(x + b * (0.5 * h)), middle, current)?;
    let d = space.rate(&(x + c * h), last, current)?;
    Ok(x + (a + (b + c) * 2.0 + d) * (h / 6.0))
}

/// Instruments with white noise, and the controller's state estimate.
///
/// A controller with the true state would feed measurement errors back differently, and a fit of
/// the log, which has only thrust and measurements, would be biased.
struct Instruments<'a> {
    logging: &'a Logging,
    random: ChaCha8Rng,
    /// North, east and down from integrated measured velocity, m.
    position: Vector3<f64>,
}

impl<'a> Instruments<'a> {
    fn new(sea: Sea<'a>) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(sea.seed);
        random.set_stream(INSTRUMENTS_STREAM);
        Self { logging: sea.logging, random, position: Vector3::zeros() }
    }

    fn measure(&mut self, state: &State) -> State {
        let Logging { velocity_std_m_s, rate_std_rad_s, attitude_std_rad, .. } = *self.logging;
        let Logging { depth_std_m, position_std_m, .. } = *self.logging;
        let std = |k: usize| match k {
            0 | 1 => position_std_m,
            2 => depth_std_m,
            3..6 => attitude_std_rad,
            6..9 => velocity_std_m_s,
            _ => rate_std_rad_s,
        };
        State::from_fn(|k, _| state[k] + std(k) * normal(&mut self.random))
    }

    /// Returns the measured state with dead-reckoned position and measured depth. Channels that are
    /// not logged are assumed to be known on board.
    fn estimate(&mut self, state: &State, measured: &State) -> State {
        let Logging { velocity_hz, rate_hz, attitude_hz, depth_hz, .. } = *self.logging;
        let is_logged = |k: usize| match k {
            2 => depth_hz > 0.0,
            3..6 => attitude_hz > 0.0,
            6..9 => velocity_hz > 0.0,
            9..12 => rate_hz > 0.0,
            _ => false,
        };
        let mut known = State::from_fn(|k, _| if is_logged(k) { measured[k] } else { state[k] });
        if velocity_hz > 0.0 {
            known.fixed_rows_mut::<2>(0).copy_from(&self.position.xy());
            let turn = Rotation3::from_euler_angles(known[3], known[4], known[5]);
            self.position += turn * Vector3::new(known[6], known[7], known[8]) * TICK_S;
        }
        known
    }
}

/// Random stream of the instruments, after those of the axes.
const INSTRUMENTS_STREAM: u64 = 6;

/// Returns the disturbing force at both ends and in the middle of every step of the simulation: a
/// first-order Gauss–Markov process on each axis, N and N m.
fn disturbances(plant: &Plant, sea: Sea<'_>, steps: usize) -> Vec<Vector6<f64>> {
    let count = 2 * steps + 1;
    let mut forces = vec![Vector6::zeros(); count];
    for dof in plant.axes() {
        let Some(own) = sea.noises.axes.get(dof) else { continue };
        let mut random = ChaCha8Rng::seed_from_u64(sea.seed);
        random.set_stream(dof.index() as u64);
        let correlation = own.correlation_s / (0.5 * STEP_S);
        let path = gauss_markov(random, own.disturbance, correlation, count);
        for (force, own) in forces.iter_mut().zip(path) {
            force[dof.index()] = own;
        }
    }
    forces
}
