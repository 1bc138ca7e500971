//! Motion of a vehicle of several axes, and its disturbances.

use std::f64::consts::TAU;

use nalgebra::{Rotation3, Vector3, Vector6};
use rand::RngExt;

use super::pilot::{PilotInput, VehiclePilot};
use super::rig::{Rig, Thrusters};
use crate::motion::{Inputs, KnownForce, Moving};
use crate::twin::instruments::{MeasurementErrors, Path};
use crate::twin::motion::STEP_S;
use crate::twin::random::{Streams, ornstein_uhlenbeck};
use crate::twin::water::{Attitude, Sine, current, waves};
use crate::twin::{Disturbance, STEPS_PER_TICK, TwinSpec, tick_time};
use crate::{Dof, Error, Timed};

/// The velocity of the water at each tick, north and east, m/s.
pub(super) struct Currents(Vec<[f64; 2]>);

impl Currents {
    pub(super) fn new(spec: &TwinSpec, streams: &Streams<'_>, ticks: usize) -> Self {
        // The direction of the current is the same in all trials.
        let heading = Streams { seed: spec.seed, trial: "campaign" }
            .stream("set of the current")
            .random_range(0.0..TAU);
        let (east, north) = heading.sin_cos();
        let strength = current(spec, streams, ticks).into_iter();
        Self(strength.map(|speed| [speed * north, speed * east]).collect())
    }

    pub(super) fn mean(&self) -> [f64; 2] {
        let count = self.0.len() as f64;
        [0, 1].map(|k| self.0.iter().map(|current| current[k]).sum::<f64>() / count)
    }
}

/// Forces of tether and swells on each axis.
pub(super) struct DisturbanceForces {
    /// At each tick, N or N m.
    tether: [Vec<f64>; 6],
    swell: [Sine; 6],
    /// At each half step; empty if disabled.
    waves: [Vec<f64>; 6],
}

impl DisturbanceForces {
    pub(super) fn new(rig: &Rig<'_>, streams: &Streams<'_>, ticks: usize) -> Self {
        let (spec, strength) = (&rig.shared, &rig.shared.strength);
        let on = |disturbance, dof: Dof, part: f64| {
            spec.strength_of(disturbance, part) * rig.force[dof.index()]
        };
        let stream = |dof: Dof, purpose: &str| streams.stream(&format!("{dof} {purpose}"));
        Self {
            tether: Dof::ALL.map(|dof| {
                let std = on(Disturbance::Tether, dof, rig.spec.tether_part);
                let time_s = strength.tether_correlation_s;
                ornstein_uhlenbeck(stream(dof, "tether"), std, time_s, ticks)
            }),
            swell: Dof::ALL.map(|dof| Sine {
                amplitude: on(Disturbance::Swell, dof, rig.spec.swell_part),
                omega: TAU / strength.swell_period_s,
                phase: stream(dof, "swell").random_range(0.0..TAU),
            }),
            waves: Dof::ALL.map(|dof| {
                let std = on(Disturbance::SwellNarrowBand, dof, rig.spec.swell_part);
                let rng = stream(dof, "narrow-band swell");
                if std > 0.0 { waves(rng, strength, std, ticks) } else { Vec::new() }
            }),
        }
    }

    /// Returns the force in the middle of a step, N and N m.
    fn force(&self, tick: usize, middle_s: f64) -> Vector6<f64> {
        let wave_at = (2.0 * middle_s / STEP_S).round() as usize;
        Vector6::from_fn(|k, _| {
            let wave = self.waves[k].get(wave_at).copied().unwrap_or(0.0);
            self.tether[k][tick] + self.swell[k].at(middle_s) + wave
        })
    }
}

/// The motion of one trial: states at every step, inputs at every tick.
pub(super) struct SimulatedTrial {
    velocity: Vec<Vector6<f64>>,
    attitude: Vec<[f64; 3]>,
    /// Depth below the start, m.
    sunk: Vec<f64>,
    commands: Vec<Vec<f64>>,
}

impl SimulatedTrial {
    /// Simulates a trial, from rest and level.
    ///
    /// # Errors
    /// [`Error::Diverged`] if the motion diverges.
    pub(super) fn simulate(
        rig: &Rig<'_>,
        (pilot, mut thrusters, mut errors): (VehiclePilot<'_>, Thrusters<'_>, MeasurementErrors),
        (disturbed, known): (&DisturbanceForces, &[KnownForce]),
        currents: &Currents,
        streams: &Streams<'_>,
    ) -> Result<Self, Error> {
        let heading = streams.stream("start heading").random_range(0.0..TAU);
        let known = known.to_vec();
        let mut inputs = Inputs { current: currents.0[0], known, ..Inputs::default() };
        inputs.attitude[2] = Some(Timed::new("heading", vec![0.0], vec![heading])?);
        let mut moving = Moving::at_rest(&rig.plant, &inputs)?;
        let mut simulated = Self {
            velocity: Vec::new(),
            attitude: Vec::new(),
            sunk: Vec::new(),
            commands: Vec::new(),
        };
        simulated.push(&moving, 0.0);
        for (tick, current) in currents.0.iter().enumerate() {
            moving.set_current(*current);
            thrusters.allocate(&pilot.wrench(tick, &simulated.pilot_input(errors.next())));
            for step in 0..STEPS_PER_TICK {
                let t = tick_time(tick) + step as f64 * STEP_S;
                let force = thrusters.advance(t, STEP_S, moving.through_water())
                    * rig.spec.thrust_scale
                    + disturbed.force(tick, t + 0.5 * STEP_S);
                let sinking = simulated.sinking(simulated.velocity.len() - 1);
                moving.advance(&force, STEP_S)?;
                simulated.push(&moving, sinking);
            }
        }
        simulated.commands = std::mem::take(&mut thrusters.commands);
        Ok(simulated)
    }

    /// Adds a state; depth is integrated by the trapezoidal rule.
    fn push(&mut self, moving: &Moving<'_>, sinking_before: f64) {
        self.velocity.push(moving.velocity());
        self.attitude.push(moving.attitude());
        let at = self.velocity.len() - 1;
        let before = self.sunk.last().copied();
        let moved = 0.5 * STEP_S * (sinking_before + self.sinking(at));
        self.sunk.push(before.map_or(0.0, |before| before + moved));
    }

    fn sinking(&self, step: usize) -> f64 {
        let [roll, pitch, heading] = self.attitude[step];
        (Rotation3::from_euler_angles(roll, pitch, heading) * self.velocity(step)).z
    }

    /// Returns the pilot's measurement of the last state, with these errors.
    fn pilot_input(&self, (angles, velocity): ([f64; 3], Vector6<f64>)) -> PilotInput {
        let at = self.velocity.len() - 1;
        PilotInput {
            attitude: std::array::from_fn(|k| self.attitude[at][k] + angles[k]),
            velocity: self.velocity[at] + velocity,
            sunk: self.sunk[at],
            sinking: self.sinking(at),
        }
    }

    pub(super) fn check_submerged(&self, spec: &TwinSpec, trial: &str) -> Result<(), Error> {
        spec.refuse_surfacing(-self.sunk.iter().copied().fold(0.0, f64::min), trial)
    }
}

impl Path for SimulatedTrial {
    fn steps(&self) -> usize {
        self.velocity.len() - 1
    }

    fn attitude(&self, step: usize, _t_s: f64) -> Attitude {
        let [roll, pitch, _] = self.attitude[step];
        let (p, q, r) = (self.velocity[step][3], self.velocity[step][4], self.velocity[step][5]);
        let across = q * roll.sin() + r * roll.cos();
        let slopes =
            [p + pitch.tan() * across, q * roll.cos() - r * roll.sin(), across / pitch.cos()];
        Attitude { angles: self.attitude[step], slopes }
    }

    fn velocity(&self, step: usize) -> Vector3<f64> {
        self.velocity[step].fixed_rows::<3>(0).into_owned()
    }

    fn sunk(&self, step: usize) -> (f64, f64) {
        (self.sunk[step], self.sinking(step))
    }

    fn command(&self, thruster: usize, tick: usize) -> f64 {
        self.commands[thruster][tick]
    }
}
