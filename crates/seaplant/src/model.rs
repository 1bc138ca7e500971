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

/// What a velocity sensor makes of velocity before it is logged; by default nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VelocitySensor {
    /// First-order lag, s.
    pub lag_s: f64,
    /// It averages over so long a time, s.
    pub window_s: f64,
    /// It reads so many times the velocity.
    pub scale: f64,
}

impl Default for VelocitySensor {
    fn default() -> Self {
        Self { lag_s: 0.0, window_s: 0.0, scale: 1.0 }
    }
}

impl VelocitySensor {
    /// What it shows of a velocity: a lag `T ẏ = v − y`, an average of v over `[t − w, t]`, times
    /// its scale.
    ///
    /// `time_s` increases, `velocity` has as many values, in m/s or rad/s; between them velocity
    /// is linear, and before them constant.
    ///
    /// ```
    /// use seaplant::VelocitySensor;
    /// let averages = VelocitySensor { window_s: 1.0, ..VelocitySensor::default() };
    /// assert_eq!(averages.shows(&[0.0, 1.0, 2.0], &[0.0, 1.0, 2.0]), [0.0, 0.5, 1.5]);
    /// ```
    pub fn shows(&self, time_s: &[f64], velocity: &[f64]) -> Vec<f64> {
        let mut shown = velocity.to_vec();
        if self.lag_s > 0.0 {
            lag(time_s, &mut shown, self.lag_s);
        }
        if self.window_s > 0.0 {
            shown = average(time_s, &shown, self.window_s);
        }
        if self.scale != 1.0 {
            shown.iter_mut().for_each(|v| *v *= self.scale);
        }
        shown
    }
}

/// A first-order lag of what is linear between samples, exactly.
fn lag(time_s: &[f64], values: &mut [f64], lag_s: f64) {
    let mut before = values.first().copied().unwrap_or(0.0);
    let mut shown = before;
    for k in 1..values.len() {
        let step = (time_s[k] - time_s[k - 1]) / lag_s;
        let (now, kept) = (values[k], (-step).exp());
        let slope = (now - before) / step;
        // y = v − slope of the lag times, once its start is forgotten.
        shown = now - slope + (shown - before + slope) * kept;
        (before, values[k]) = (now, shown);
    }
}

/// The average over the time before each sample of what is linear between samples.
fn average(time_s: &[f64], values: &[f64], window_s: f64) -> Vec<f64> {
    let mut passed = vec![0.0; values.len()];
    for k in 1..values.len() {
        let step_s = time_s[k] - time_s[k - 1];
        passed[k] = passed[k - 1] + 0.5 * step_s * (values[k] + values[k - 1]);
    }
    let mut from = 0;
    let of = |k: usize| {
        let start_s = time_s[k] - window_s;
        if start_s <= time_s[0] {
            return (passed[k] + values[0] * (time_s[0] - start_s)) / window_s;
        }
        while time_s[from + 1] < start_s {
            from += 1;
        }
        let (step_s, part_s) = (time_s[from + 1] - time_s[from], start_s - time_s[from]);
        let at_start = values[from] + (values[from + 1] - values[from]) * part_s / step_s;
        let before = passed[from] + 0.5 * part_s * (values[from] + at_start);
        (passed[k] - before) / window_s
    };
    (0..values.len()).map(of).collect()
}

/// A plant of one degree of freedom, ready to be driven.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// The plant.
    pub lumped: LumpedParameters,
    /// What stands between its logged thrust and the water.
    pub thrust: ThrustModel,
    /// What stands between its velocity and the log.
    pub sensor: VelocitySensor,
}

impl From<LumpedParameters> for Model {
    fn from(lumped: LumpedParameters) -> Self {
        Self { lumped, ..Self::default() }
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
        let sensor = VelocitySensor {
            lag_s: value("sensor_lag").unwrap_or(0.0),
            window_s: value("sensor_window").unwrap_or(0.0),
            scale: value("velocity_scale").unwrap_or(1.0),
        };
        Self { lumped: result.lumped, thrust, sensor }
    }

    /// How results call the current of a trial.
    pub(crate) fn current_name(trial: &str) -> String {
        format!("{CURRENT_OF}{trial}")
    }

    /// How the plant moves under the thrust of a record: the states at `times_s`, which
    /// must increase, from `start` at the first of them.
    ///
    /// # Errors
    /// [`Error::Diverged`] if it diverges.
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
