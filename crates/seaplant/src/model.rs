//! A plant with what stands between its logged thrust and the water.

use std::collections::BTreeMap;

use crate::estimate::{Candidate, drive_over};
use crate::results::PlantResult;
use crate::simulate::{Response, State, advance, has_run_away, simulate};
use crate::{AxisRecord, Error, LumpedParameters};

/// What stands between logged thrust and the water; by default nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct ThrustModel {
    /// First-order lag of propeller speed, s.
    pub lag_s: f64,
    /// Delay of thrust, s.
    pub delay_s: f64,
    /// Reverse thrust over what the curve says.
    pub reverse_ratio: f64,
    /// Thrust lost to inflow: each thruster gives `k_in |n| v` less.
    pub inflow: f64,
    /// Lag of a propeller that slows down over that of one that speeds up.
    pub lag_ratio: f64,
    /// Time that a propeller needs from rest to `full_speed` at its greatest rate, s; 0 without
    /// a limit.
    pub slew_s: f64,
    /// Thrust lost to inflow by propellers that push the way the vehicle goes.
    pub inflow_ahead: f64,
    /// Exponent of thrust over propeller speed: 2 is what the curve says.
    pub exponent: f64,
    /// The propeller speed at which the exponent leaves thrust as it is, rad/s.
    pub full_speed: f64,
    /// Whether propeller speeds move linearly from one logged sample to the next; else they are
    /// held.
    pub linear: bool,
    /// What turning does to body velocity, as a part of what it does to a rigid body.
    pub turning: f64,
    /// Current along the degree of freedom, m/s, by trial.
    pub current: BTreeMap<String, f64>,
}

impl Default for ThrustModel {
    fn default() -> Self {
        Self {
            lag_s: 0.0,
            delay_s: 0.0,
            reverse_ratio: 1.0,
            inflow: 0.0,
            lag_ratio: 1.0,
            slew_s: 0.0,
            inflow_ahead: 0.0,
            exponent: 2.0,
            full_speed: 1.0,
            linear: false,
            turning: 0.0,
            current: BTreeMap::new(),
        }
    }
}

impl ThrustModel {
    /// Whether thrust acts as it was logged, in water at rest.
    fn is_plain(&self) -> bool {
        let plain = Self { full_speed: self.full_speed, ..Self::default() };
        *self == plain
    }

    /// The current of a trial: its own, else the mean of those that are known.
    pub fn current_of(&self, trial: &str) -> f64 {
        let mean = self.current.values().sum::<f64>() / self.current.len().max(1) as f64;
        self.current.get(trial).copied().unwrap_or(mean)
    }
}

/// A plant of one degree of freedom, ready to be driven.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// The plant.
    pub lumped: LumpedParameters,
    /// What stands between its logged thrust and the water.
    pub thrust: ThrustModel,
}

impl From<LumpedParameters> for Model {
    fn from(lumped: LumpedParameters) -> Self {
        Self { lumped, thrust: ThrustModel::default() }
    }
}

/// How results call the current of a trial.
const CURRENT_OF: &str = "current: ";

impl Model {
    /// The model that results hold.
    pub fn of_result(result: &PlantResult) -> Self {
        let value = |name: &str| result.nuisances.get(name).map(|nuisance| nuisance.value);
        let current = result.nuisances.iter().filter_map(|(name, nuisance)| {
            Some((name.strip_prefix(CURRENT_OF)?.to_owned(), nuisance.value))
        });
        let thrust = ThrustModel {
            lag_s: value("lag").unwrap_or(0.0),
            delay_s: value("delay").unwrap_or(0.0),
            reverse_ratio: value("reverse_ratio").unwrap_or(1.0),
            inflow: value("inflow").unwrap_or(0.0),
            lag_ratio: value("lag_ratio").unwrap_or(1.0),
            slew_s: value("slew").unwrap_or(0.0),
            inflow_ahead: value("inflow_ahead").unwrap_or(0.0),
            exponent: value("thrust_exponent").unwrap_or(2.0),
            full_speed: value("full_speed").unwrap_or(1.0),
            linear: result
                .structure
                .iter()
                .any(|decision| decision.candidate == Candidate::LinearThrust && decision.admitted),
            turning: value("turning").unwrap_or(0.0),
            current: current.collect(),
        };
        Self { lumped: result.lumped, thrust }
    }

    /// How results call the current of a trial.
    pub(crate) fn current_name(trial: &str) -> String {
        format!("{CURRENT_OF}{trial}")
    }

    /// How the plant moves under the thrust of a record: the states at `times_s`, which
    /// must increase, from `start` at the first of them.
    ///
    /// # Errors
    /// [`Error::Diverged`] if it runs away.
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
        for step in drive_over(&tracks, axis.turning.as_ref(), times_s, &self.thrust) {
            let turning = self.thrust.turning * step.turning;
            let acceleration = |v: f64| {
                // Drag acts on velocity through the water.
                let r = v - current;
                let [forward, backward] = step.gamma;
                let ahead = if r < 0.0 { backward } else { forward };
                let lost =
                    self.thrust.inflow * (forward + backward) + self.thrust.inflow_ahead * ahead;
                self.lumped.acceleration(step.tau, r) - self.lumped.alpha * lost * r + turning
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
