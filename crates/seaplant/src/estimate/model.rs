//! Simulation of a plant of one axis with thrust and sensor models.

use super::propellers::drive_over;
use crate::simulate::{Response, State, advance, has_run_away, simulate};
use crate::{AxisRecord, Error, LumpedParameters, ThrustModel, VelocitySensor};

/// Model of one degree of freedom for simulation.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// The plant.
    pub lumped: LumpedParameters,
    /// Model between logged thrust and force on the vehicle.
    pub thrust: ThrustModel,
    /// Model between velocity and log.
    pub sensor: VelocitySensor,
}

impl From<LumpedParameters> for Model {
    fn from(lumped: LumpedParameters) -> Self {
        Self { lumped, ..Self::default() }
    }
}

impl Model {
    /// Simulates the response to the thrust of a record: returns the states at `times_s`, which
    /// must increase, from `start` at the first of them.
    ///
    /// # Errors
    /// [`Error::Diverged`] if the simulation diverges.
    pub fn respond(
        &self,
        axis: &AxisRecord,
        start: State,
        times_s: &[f64],
    ) -> Result<Response, Error> {
        if self.thrust.is_plain() {
            return simulate(axis.dof, &self.lumped, &axis.force, start, times_s);
        }
        let Some(&first) = times_s.first() else { return Ok(Response::default()) };
        let mut response = Response::with_capacity(times_s.len());
        let current = self.thrust.current_of(&axis.trial);
        let tracks = axis.tracks();
        let mut next = times_s.iter().peekable();
        let mut state = start;
        let (turning, window_s) = (axis.turning.as_ref(), axis.common_window_s());
        for step in drive_over(&tracks, turning, window_s, times_s, &self.thrust) {
            let turning = self.thrust.turning * step.push.turning;
            let acceleration = |v: f64| {
                // Drag acts on velocity through the water.
                let r = v - current;
                let [forward, backward] = step.push.gamma;
                let ahead = if r < 0.0 { backward } else { forward };
                let lost =
                    self.thrust.inflow * (forward + backward) + self.thrust.inflow_ahead * ahead;
                self.lumped.acceleration(step.push.tau, r) - self.lumped.alpha * lost * r + turning
            };
            state = advance(acceleration, state, step.length_s);
            if has_run_away(state) {
                return Err(Error::Diverged { dof: axis.dof, after_s: step.time_s - first });
            }
            if next.next_if(|wanted| **wanted <= step.time_s).is_some() {
                response.position.push(state.position);
                response.velocity.push(state.velocity);
            }
        }
        Ok(response)
    }
}

/// Returns the root mean square speed of a model simulated from rest under some records, m/s or
/// rad/s; 0 without any.
pub(crate) fn simulated_speed(model: &Model, axes: &[AxisRecord]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for axis in axes {
        for (from_s, to_s) in axis.parts() {
            let Some(part) = axis.motion.series().window(from_s, to_s) else { continue };
            let Ok(response) = model.respond(axis, State::default(), part.time_s()) else {
                continue;
            };
            sum += response.velocity.iter().map(|v| v * v).sum::<f64>();
            count += response.velocity.len();
        }
    }
    (sum / count.max(1) as f64).sqrt()
}
