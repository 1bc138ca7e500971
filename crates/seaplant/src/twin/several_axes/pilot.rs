//! Forces commanded by the pilot of a vehicle of several axes.

use std::f64::consts::TAU;

use nalgebra::Vector6;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Moves;
use super::rig::Rig;
use crate::Dof;
use crate::motion::down_body;
use crate::twin::random::{Streams, held_levels, lagged};
use crate::twin::tick_time;

/// Time for which the joystick is held, s, and the lag of the command behind it.
const JOYSTICK_DWELL_S: std::ops::Range<f64> = 3.0..15.0;
const JOYSTICK_LAG_S: f64 = 0.5;
/// Probability that it is held at zero.
const JOYSTICK_REST: f64 = 0.2;
/// Time for which each step of a held-out trial is held, s.
const STEP_DWELL_S: std::ops::Range<f64> = 8.0..25.0;
/// Share of the joystick in free driving, and of the sinusoid in sweeps; sinusoids or the joystick
/// are the rest.
const JOYSTICK_PART: f64 = 0.6;
/// Number of sinusoids in free driving, and their frequencies, Hz.
const LINES: usize = 2;
const LINE_HZ: std::ops::Range<f64> = 0.02..0.2;
/// First and last frequency of a sweep, Hz.
const SWEEP_HZ: (f64, f64) = (0.02, 0.25);
/// Bandwidth of the depth controller, rad/s: below the fitted dynamics.
const DEPTH_RAD_S: f64 = 0.05;

/// The wrench at each tick.
pub(super) struct VehiclePilot<'a> {
    rig: &'a Rig<'a>,
    /// Force at each tick on each axis; for roll and pitch the requested angle, rad.
    commands: [Vec<f64>; 6],
}

/// The measurements of the pilot.
pub(super) struct PilotInput {
    pub(super) attitude: [f64; 3],
    pub(super) velocity: Vector6<f64>,
    pub(super) sunk: f64,
    pub(super) sinking: f64,
}

impl<'a> VehiclePilot<'a> {
    pub(super) fn new(rig: &'a Rig<'a>, moves: Moves, streams: &Streams<'_>, ticks: usize) -> Self {
        let commands = Dof::ALL.map(|dof| {
            let most = rig.amplitude(dof);
            let moved = match moves {
                Moves::Alone(swept) if swept != dof => return vec![0.0; ticks],
                _ if most == 0.0 => return vec![0.0; ticks],
                Moves::Alone(_) => sweep(streams, ticks),
                Moves::Freely => free(dof, streams, ticks),
                Moves::Steps => steps(dof, streams, ticks),
            };
            moved.into_iter().map(|part| most * part).collect()
        });
        Self { rig, commands }
    }

    /// Returns the requested wrench at a tick, N and N m: the planned one, with weight compensated
    /// and roll and pitch controlled.
    pub(super) fn wrench(&self, tick: usize, measured: &PilotInput) -> Vector6<f64> {
        let [roll, pitch, _] = measured.attitude;
        let down = down_body(roll, pitch);
        let mut wrench = Vector6::from_fn(|k, _| self.commands[k][tick]);
        let resistance = self.rig.plant.resistance(&measured.velocity, &down);
        for (k, angle) in [(3, roll), (4, pitch)] {
            let (stiffness, damping) = self.rig.hold[k - 3];
            let levelling = stiffness * (wrench[k] - angle) - damping * measured.velocity[k];
            // Munk moments would capsize a vehicle with a weak righting moment.
            wrench[k] = if self.rig.force[k] > 0.0 { resistance[k] + levelling } else { 0.0 };
        }
        let mass = self.rig.plant.mass_matrix_of_six()[(2, 2)];
        let up = self.rig.weight_excess()
            + mass * DEPTH_RAD_S * (DEPTH_RAD_S * measured.sunk + 2.0 * measured.sinking);
        for k in 0..3 {
            if self.rig.force[k] > 0.0 {
                wrench[k] -= up * down[k];
            }
        }
        wrench
    }
}

impl Rig<'_> {
    /// Returns the greatest command on an axis: N or N m, for roll and pitch rad.
    fn amplitude(&self, dof: Dof) -> f64 {
        let force = self.force[dof.index()];
        match dof {
            _ if force == 0.0 => 0.0,
            Dof::Roll | Dof::Pitch => {
                force / (self.hold[dof.index() - 3].0 + self.righting.max(0.0))
            }
            _ => force,
        }
    }
}

fn stream(streams: &Streams<'_>, dof: Dof, purpose: &str) -> ChaCha8Rng {
    streams.stream(&format!("{dof} {purpose}"))
}

fn joystick(rng: ChaCha8Rng, ticks: usize) -> Vec<f64> {
    let levels = held_levels(rng, JOYSTICK_DWELL_S, ticks, |rng| {
        let rests = rng.random_bool(JOYSTICK_REST);
        let level = rng.random_range(-1.0..=1.0);
        if rests { 0.0 } else { level }
    });
    lagged(&levels, JOYSTICK_LAG_S)
}

fn free(dof: Dof, streams: &Streams<'_>, ticks: usize) -> Vec<f64> {
    let mut rng = stream(streams, dof, "lines");
    let mut line = || (TAU * rng.random_range(LINE_HZ), rng.random_range(0.0..TAU));
    let lines: [(f64, f64); LINES] = std::array::from_fn(|_| line());
    let joystick = joystick(stream(streams, dof, "joystick"), ticks);
    let at = |(tick, joystick): (usize, f64)| {
        let sines = lines.iter().map(|(omega, phase)| (omega * tick_time(tick) + phase).sin());
        let sines = sines.sum::<f64>() / LINES as f64;
        JOYSTICK_PART * joystick + (1.0 - JOYSTICK_PART) * sines
    };
    joystick.into_iter().enumerate().map(at).collect()
}

fn sweep(streams: &Streams<'_>, ticks: usize) -> Vec<f64> {
    let (from, to) = SWEEP_HZ;
    let total_s = tick_time(ticks);
    let joystick = joystick(streams.stream("joystick"), ticks);
    let at = |(tick, joystick): (usize, f64)| {
        let t = tick_time(tick);
        let turned = TAU * (from * t + 0.5 * (to - from) * t * t / total_s);
        JOYSTICK_PART * turned.sin() + (1.0 - JOYSTICK_PART) * joystick
    };
    joystick.into_iter().enumerate().map(at).collect()
}

fn steps(dof: Dof, streams: &Streams<'_>, ticks: usize) -> Vec<f64> {
    let rng = stream(streams, dof, "steps");
    held_levels(rng, STEP_DWELL_S, ticks, |rng| rng.random_range(-1.0..=1.0))
}
