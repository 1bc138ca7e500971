//! Forces commanded by the pilot.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::random::{Streams, held_levels, lagged};
use super::{Excitation, TICK_HZ, TwinSpec, tick_time};
use crate::Dof;

/// Time for which the joystick is held, s.
const JOYSTICK_DWELL_S: std::ops::Range<f64> = 5.0..20.0;
/// Probability that it is held at zero.
const JOYSTICK_REST: f64 = 0.3;
/// Lag of the command behind the joystick, s.
const JOYSTICK_LAG_S: f64 = 1.0;

/// Steps of a held-out trial: time for which each is held, s …
const STEP_DWELL_S: std::ops::Range<f64> = 15.0..40.0;
/// … magnitude, as a fraction of the greatest thrust in reverse …
const STEP_PART: std::ops::Range<f64> = 0.2..0.7;
/// … and the added sine: its amplitude as a fraction of the same, and its frequency as a fraction
/// of that of fitted trials.
const STEP_SINE: (f64, f64) = (0.2, 0.6);

/// The force at each tick.
pub(super) enum Pilot {
    /// Open loop: the force of each tick, N or N m.
    OpenLoop(Vec<f64>),
    /// Closed loop on depth.
    KeepDepth(DepthKeeper),
}

/// A depth controller, `τ = m (0.36 e + 0.9 ė + 0.02 ∫e dt)`.
pub(super) struct DepthKeeper {
    mass: f64,
    /// Depth below the start and its rate, at each tick.
    target: Vec<(f64, f64)>,
    integral: f64,
}

impl Pilot {
    /// Returns the requested force at a tick, for a depth `sunk` below the start and a rate `v`.
    pub(super) fn force(&mut self, tick: usize, sunk: f64, v: f64) -> f64 {
        match self {
            Self::OpenLoop(force) => force[tick],
            Self::KeepDepth(keeper) => keeper.force(tick, sunk, v),
        }
    }

    /// Creates the pilot of a fitted trial.
    pub(super) fn of_fit(spec: &TwinSpec, dof: Dof, streams: &Streams<'_>, ticks: usize) -> Self {
        let excitation = spec.excitation[&dof];
        let joystick = joystick(streams.stream("joystick"), excitation.joystick, ticks);
        let phase = phase(streams);
        let Excitation { amplitude, frequency_rad_s: omega, .. } = excitation;
        if dof != Dof::Heave {
            let sine =
                |(tick, joystick)| amplitude * (omega * tick_time(tick) + phase).sin() + joystick;
            return Self::OpenLoop(joystick.into_iter().enumerate().map(sine).collect());
        }
        let mut climbed = 0.0;
        let target = joystick.into_iter().enumerate().map(|(tick, rate)| {
            let angle = omega * tick_time(tick) + phase;
            climbed += rate / TICK_HZ;
            (amplitude * angle.sin() + climbed, amplitude * omega * angle.cos() + rate)
        });
        let target = target.collect();
        Self::KeepDepth(DepthKeeper { mass: spec.plants[&dof].mass, target, integral: 0.0 })
    }

    /// Creates the pilot of a held-out trial: steps, unlike the fitted trials.
    pub(super) fn of_hold_out(
        spec: &TwinSpec,
        dof: Dof,
        streams: &Streams<'_>,
        ticks: usize,
    ) -> Self {
        let limit = spec.reverse_limit(dof);
        let steps = held_levels(streams.stream("steps"), STEP_DWELL_S, ticks, |rng| {
            let sign = if rng.random::<bool>() { 1.0 } else { -1.0 };
            sign * rng.random_range(STEP_PART)
        });
        let (part, slower) = STEP_SINE;
        let omega = slower * spec.excitation[&dof].frequency_rad_s;
        let phase = phase(streams);
        let sine = |(tick, step)| limit * (step + part * (omega * tick_time(tick) + phase).sin());
        Self::OpenLoop(steps.into_iter().enumerate().map(sine).collect())
    }

    /// Creates the pilot of a steady run: constant thrust.
    pub(super) fn of_steady(force: f64, ticks: usize) -> Self {
        Self::OpenLoop(vec![force; ticks])
    }
}

impl DepthKeeper {
    fn force(&mut self, tick: usize, sunk: f64, v: f64) -> f64 {
        let (target, target_rate) = self.target[tick];
        let (error, error_rate) = (target - sunk, target_rate - v);
        self.integral += error / TICK_HZ;
        self.mass * (0.36 * error + 0.9 * error_rate + 0.02 * self.integral)
    }
}

fn phase(streams: &Streams<'_>) -> f64 {
    streams.stream("phase").random_range(0.0..TAU)
}

fn joystick(rng: ChaCha8Rng, most: f64, ticks: usize) -> Vec<f64> {
    let levels = held_levels(rng, JOYSTICK_DWELL_S, ticks, |rng| {
        let rests = rng.random_bool(JOYSTICK_REST);
        let level = rng.random_range(-1.0..=1.0);
        if rests { 0.0 } else { most * level }
    });
    lagged(&levels, JOYSTICK_LAG_S)
}
