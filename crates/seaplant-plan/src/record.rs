//! The log of a simulated run.

use seaplant::motion::State;
use seaplant::quantity::{Attitude, Axis, World};
use seaplant::{Dof, Quantity, Recording, Thruster, Timed};

use crate::Error;
use crate::drive::Driven;
use crate::hold::TICK_S;
use crate::logging::Logging;
use crate::rig::Rig;

/// Highest rate at which commands are logged, Hz.
const FASTEST_HZ: f64 = 1.0 / TICK_S;

impl Logging {
    /// Returns the log of a run as measured. Velocities are those of the plant's axes: noise of
    /// others would enter by Coriolis forces that the plant lacks.
    pub(crate) fn recording(
        &self,
        rig: &Rig,
        driven: &Driven,
        axes: &[Dof],
        start_depth_m: f64,
    ) -> Result<Recording, Error> {
        let mut recording = Recording::new();
        for (thruster, inputs) in rig.thrusters.iter().zip(&driven.inputs) {
            let Thruster { name, curve, .. } = thruster;
            let quantity = Quantity::Thruster { name: name.clone(), input: curve.input() };
            let every = (FASTEST_HZ / self.thrusters_hz).round().max(1.0) as usize;
            recording.insert(quantity, every_so_many(&driven.time_s, inputs, every)?);
        }
        let mut put = |quantity: Quantity, hz: f64, of: &dyn Fn(&State) -> f64| {
            if hz <= 0.0 {
                return Ok(());
            }
            let every = (FASTEST_HZ / hz).round().max(1.0) as usize;
            let values: Vec<f64> = driven.measured.iter().map(of).collect();
            recording.insert(quantity, every_so_many(&driven.time_s, &values, every)?);
            Ok::<(), Error>(())
        };
        for (k, dof) in [Dof::Surge, Dof::Sway, Dof::Heave].into_iter().enumerate() {
            let quantity = Quantity::Velocity(dof);
            if !axes.contains(&dof) {
                continue;
            }
            put(quantity, self.velocity_hz, &|state| state[6 + k])?;
        }
        for (k, axis) in [Axis::X, Axis::Y, Axis::Z].into_iter().enumerate() {
            let quantity = Quantity::Rate(axis);
            put(quantity, self.rate_hz, &|state| state[9 + k])?;
        }
        let angles = [Attitude::Roll, Attitude::Pitch, Attitude::Heading];
        for (k, angle) in angles.into_iter().enumerate() {
            let quantity = Quantity::Attitude(angle);
            put(quantity, self.attitude_hz, &|state| state[3 + k])?;
        }
        put(Quantity::Depth, self.depth_hz, &|state| start_depth_m + state[2])?;
        for (k, way) in [World::North, World::East].into_iter().enumerate() {
            let quantity = Quantity::Position(way);
            put(quantity, self.position_hz, &|state| state[k])?;
        }
        Ok(recording)
    }
}

fn every_so_many(time_s: &[f64], values: &[f64], every: usize) -> Result<Timed, Error> {
    let take = |of: &[f64]| of.iter().step_by(every).copied().collect::<Vec<f64>>();
    Ok(Timed::new("log", take(time_s), take(values))?)
}
