//! Comparison of simulated and measured motion.

use crate::navigation::{MeanAcceleration, MeanOver, Motion};
use crate::series::{ROUNDING_S, Reader};
use crate::trial::starting_velocity;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{AxisRecord, Dof, Error, Model, State, Timed, Trial, VelocitySource};

/// The quantity in which simulation and measurement are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ScoredMotion {
    /// Velocity, or the derivative of position.
    #[default]
    Velocity,
    /// Acceleration, if neither velocity nor position was measured.
    Acceleration,
}

impl ScoredMotion {
    /// Returns its unit in a degree of freedom.
    pub const fn unit(self, dof: Dof) -> &'static str {
        match self {
            Self::Velocity => dof.units().velocity,
            Self::Acceleration => dof.units().acceleration,
        }
    }

    /// Returns its name in sentences and on axes of charts.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
        }
    }

    /// Returns the name of the null model.
    pub const fn null_model(self) -> &'static str {
        match self {
            Self::Velocity => "a model that never moves",
            Self::Acceleration => "a model that never accelerates",
        }
    }
}

/// Simulated and measured motion of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// The quantity of `measured`, `simulated` and `velocity`.
    pub quantity: ScoredMotion,
    /// The degree of freedom.
    pub dof: Dof,
    /// Name of the trial.
    pub trial: String,
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Force at each, N or N m.
    pub force: Vec<f64>,
    /// Measured velocity, unfiltered, or the derivative of position; or mean acceleration over half
    /// a second, less its mean over twenty.
    pub measured: Vec<f64>,
    /// The same quantity, simulated with the logged force.
    pub simulated: Vec<f64>,
    /// Their agreement.
    pub velocity: Agreement,
    /// Agreement of positions, if position was measured.
    pub position: Option<PositionComparison>,
}

/// Simulated and measured position.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionComparison {
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// Measured position, m or rad.
    pub measured: Vec<f64>,
    /// Simulated position.
    pub simulated: Vec<f64>,
    /// Their agreement.
    pub agreement: Agreement,
}

/// Agreement of a simulation with a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Agreement {
    /// e = mean |model − measured|.
    pub mean_abs_error: f64,
    /// Mean absolute error of a model that never moves.
    pub null_error: f64,
    /// R² = 1 − Σ(model − measured)² / Σ(measured − mean)²; `None` if the measurement is constant.
    pub r_squared: Option<f64>,
    /// Number of compared instants.
    pub samples: usize,
}

impl Agreement {
    /// Scores a model; `rest` is the value of a model that never moves.
    pub fn of(measured: &[f64], simulated: &[f64], rest: f64) -> Self {
        Self::over(measured.iter().copied().zip(simulated.iter().copied()), rest)
    }

    /// Scores pairs of measured and simulated values as [`Agreement::of`].
    pub(crate) fn over(pairs: impl Iterator<Item = (f64, f64)> + Clone, rest: f64) -> Self {
        let n = pairs.clone().count();
        let of_n = |sum: f64| if n == 0 { 0.0 } else { sum / n as f64 };
        let mean = of_n(pairs.clone().map(|(y, _)| y).sum());
        let error: f64 = pairs.clone().map(|(y, s)| (s - y).abs()).sum();
        let null: f64 = pairs.clone().map(|(y, _)| (y - rest).abs()).sum();
        let residual: f64 = pairs.clone().map(|(y, s)| (s - y).powi(2)).sum();
        let variation: f64 = pairs.map(|(y, _)| (y - mean).powi(2)).sum();
        Self {
            mean_abs_error: of_n(error),
            null_error: of_n(null),
            r_squared: (variation > 0.0).then(|| 1.0 - residual / variation),
            samples: n,
        }
    }
}

/// Simulates a model with the logged thrust of a trial and compares it with the raw,
/// unfiltered measurement: `e = mean |v_model − v|`.
///
/// If position was measured instead of velocity, v is its derivative over half a second to either
/// side, and v_model that of the simulated position. If only acceleration was measured, means of it
/// over half a second are compared, both less their mean over twenty seconds, as an accelerometer
/// has slowly varying errors by gravity, and the simulation starts from rest. Otherwise it starts
/// from the measured velocity. It restarts after each gap in force, each half minute without
/// motion, and each gap of heading with an unknown number of turns. If the trial measured position
/// (depth, heading), positions are compared too.
///
/// # Errors
/// [`Error::Diverged`] if the simulation diverges, and those of [`Trial::axis`].
///
/// # Source
/// [Jason2, §4, fig. 3–6].
pub fn evaluate(dof: Dof, model: &Model, trial: &Trial) -> Result<Comparison, Error> {
    compare_record(model, &trial.axis(dof, VelocitySource::Measured)?)
}

/// Compares one record as [`evaluate`].
pub(crate) fn compare_record(model: &Model, axis: &AxisRecord) -> Result<Comparison, Error> {
    if !axis.knows_velocity() {
        return compare_acceleration(model, axis);
    }
    let mut all = Parts::default();
    for (from_s, to_s) in axis.parts() {
        let Some(samples) = axis.motion.series().window(from_s, to_s) else { continue };
        let is_position = matches!(axis.motion, Motion::Position(_));
        if is_position && samples.len() < 2 {
            continue;
        }
        let measured = axis.velocity_of(&samples)?;
        let start = State { position: 0.0, velocity: starting_velocity(axis, &measured)? };
        let response = model.respond(axis, start, samples.time_s())?;
        let position = axis.position.as_ref();
        let position = position.and_then(|path| path.window(samples.first_s(), samples.last_s()));
        let mut simulated = response.velocity;
        if is_position || position.is_some() {
            let path = samples.with_values("the simulated position", response.position)?;
            if let Some(position) = position {
                all.add_position(&position, &path);
            }
            // Measured and simulated positions are differentiated in the same way.
            if is_position {
                simulated = axis.velocity_of(&path)?.values().to_vec();
            }
        }
        if !is_position {
            simulated = model.sensor.shows(samples.time_s(), &simulated);
        }
        all.add_velocity(&measured, simulated, &axis.force);
    }
    Ok(all.into_comparison(axis.dof, &axis.trial))
}

/// Averaging time of acceleration for comparison, s, long enough to reduce vibration.
const COMPARED_OVER_S: f64 = 0.5;

/// Averaging time of the offset that is subtracted from acceleration, s: over longer times,
/// attitude errors contribute as much as motion.
const OFFSET_OVER_S: f64 = 20.0;

/// Compares a record of acceleration only.
fn compare_acceleration(model: &Model, axis: &AxisRecord) -> Result<Comparison, Error> {
    let mut all = Parts { quantity: ScoredMotion::Acceleration, ..Parts::default() };
    for (from_s, to_s) in axis.parts() {
        let acceleration =
            axis.acceleration.as_ref().and_then(|acceleration| acceleration.window(from_s, to_s));
        let means = acceleration.iter().flat_map(merge_windows).collect::<Vec<_>>();
        if means.is_empty() {
            continue;
        }
        let mut edges_s: Vec<f64> = means.iter().flat_map(|m| [m.from_s, m.to_s]).collect();
        edges_s.dedup_by(|b, a| *b - *a <= ROUNDING_S);
        let response = model.respond(axis, State::default(), &edges_s)?;
        let output = model.sensor.shows(&edges_s, &response.velocity);
        let velocity = Timed::new("the simulated velocity", edges_s, output)?;
        let gain =
            |m: &MeanOver| (velocity.at(m.to_s) - velocity.at(m.from_s)) / (m.to_s - m.from_s);
        let simulated: Vec<f64> = means.iter().map(gain).collect();
        all.add_means(&means, &simulated, axis.force.reader());
    }
    Ok(all.into_comparison(axis.dof, &axis.trial))
}

/// Subtracts the mean of each part.
fn subtract_means(values: &[f64], parts: usize) -> impl Iterator<Item = f64> + '_ {
    values.chunks(values.len().div_ceil(parts.max(1)).max(1)).flat_map(|part| {
        let mean = part.iter().sum::<f64>() / part.len() as f64;
        part.iter().map(move |value| value - mean)
    })
}

/// Merges neighbouring windows to at least [`COMPARED_OVER_S`], except before gaps.
fn merge_windows(acceleration: &MeanAcceleration) -> Vec<MeanOver> {
    let mut all: Vec<MeanOver> = Vec::new();
    for next in acceleration.windows() {
        match all.last_mut() {
            Some(last)
                if last.to_s - last.from_s < COMPARED_OVER_S - ROUNDING_S
                    && next.from_s - last.to_s <= ROUNDING_S =>
            {
                let (a, b) = (last.to_s - last.from_s, next.to_s - next.from_s);
                last.mean = (a * last.mean + b * next.mean) / (a + b);
                last.to_s = next.to_s;
            }
            _ => all.push(next),
        }
    }
    all
}

#[derive(Default)]
struct Parts {
    quantity: ScoredMotion,
    time_s: Vec<f64>,
    force: Vec<f64>,
    measured: Vec<f64>,
    simulated: Vec<f64>,
    position_time_s: Vec<f64>,
    position_measured: Vec<f64>,
    position_simulated: Vec<f64>,
}

impl Parts {
    fn add_velocity(&mut self, measured: &Timed, simulated: Vec<f64>, force: &Timed) {
        let mut force = force.reader();
        self.time_s.extend_from_slice(measured.time_s());
        self.force.extend(measured.time_s().iter().map(|&t| force.held_at(t)));
        self.measured.extend_from_slice(measured.values());
        if self.simulated.is_empty() {
            self.simulated = simulated;
        } else {
            self.simulated.extend(simulated);
        }
    }

    fn add_means(&mut self, means: &[MeanOver], simulated: &[f64], mut force: Reader<'_>) {
        let middle = |m: &MeanOver| 0.5 * (m.from_s + m.to_s);
        let lasts_s: f64 = means.iter().map(|m| m.to_s - m.from_s).sum();
        let parts = (lasts_s / OFFSET_OVER_S).round() as usize;
        let measured: Vec<f64> = means.iter().map(|m| m.mean).collect();
        self.time_s.extend(means.iter().map(middle));
        self.force.extend(means.iter().map(|m| force.held_at(middle(m))));
        self.measured.extend(subtract_means(&measured, parts));
        self.simulated.extend(subtract_means(simulated, parts));
    }

    /// Adds positions, with the simulated path shifted to the measured one at its start.
    fn add_position(&mut self, position: &Timed, path: &Timed) {
        let offset = position.values()[0] - path.at(position.first_s());
        let mut path = path.reader();
        self.position_time_s.extend_from_slice(position.time_s());
        self.position_measured.extend_from_slice(position.values());
        self.position_simulated.extend(position.time_s().iter().map(|&t| path.at(t) + offset));
    }

    fn into_comparison(self, dof: Dof, trial: &str) -> Comparison {
        let rest = self.position_measured.first().copied();
        let position = rest.map(|rest| PositionComparison {
            agreement: Agreement::of(&self.position_measured, &self.position_simulated, rest),
            time_s: self.position_time_s,
            measured: self.position_measured,
            simulated: self.position_simulated,
        });
        Comparison {
            quantity: self.quantity,
            dof,
            trial: trial.to_owned(),
            velocity: Agreement::of(&self.measured, &self.simulated, 0.0),
            time_s: self.time_s,
            force: self.force,
            measured: self.measured,
            simulated: self.simulated,
            position,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_agree_with_hand_calculation() {
        let scored = Agreement::of(&[1.0, 2.0, 3.0], &[1.0, 2.5, 2.5], 0.0);
        assert!((scored.mean_abs_error - 1.0 / 3.0).abs() < 1e-15);
        assert_eq!(scored.null_error, 2.0);
        assert!((scored.r_squared.expect("moved") - 0.75).abs() < 1e-15);
    }
}
