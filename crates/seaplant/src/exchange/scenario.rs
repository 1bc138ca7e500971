//! Scenarios for a plant, and their outcomes.

use std::collections::BTreeMap;

use nalgebra::Vector6;

use super::{Consequence, Draws, Drive, PlantModel, Prediction};
use crate::motion::Inputs;
use crate::{Dof, Error, Timed};

/// A scenario for a plant: inputs, initial state, and the water.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scenario {
    /// Its inputs.
    pub drive: Drive,
    /// The instants of the result, s; increasing.
    pub time_s: Vec<f64>,
    /// Velocity over ground at the first instant by axis, m/s and rad/s. A translation outside the
    /// plant keeps it; a rotation outside the plant must have none, as its angle stays constant.
    pub velocity: BTreeMap<Dof, f64>,
    /// Roll, pitch and heading at the first instant, rad.
    pub attitude: [f64; 3],
    /// Velocity of the water north and east, m/s.
    pub current: [f64; 2],
    /// True if each draw has disturbances like those of the trials.
    pub disturbed: bool,
}

/// The outcome of a scenario.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// The motion, with its band.
    pub prediction: Prediction,
    /// Consequences of the plant at the greatest force on each axis.
    pub consequences: Vec<Consequence>,
    /// Limitations: unknown axes, speeds beyond those of the trials, draws that diverged.
    pub notes: Vec<String>,
}

/// Factor by which speeds and forces may exceed those of the trials without a note.
const BEYOND: f64 = 1.1;

impl PlantModel {
    /// Simulates a scenario, with a band of draws.
    ///
    /// # Errors
    /// As [`PlantModel::forces`] and [`PlantModel::predict`]; [`Error::Plant`] for an initial rate
    /// of a rotation outside the plant.
    ///
    /// # Example
    /// ```
    /// use seaplant::exchange::{Draws, Drive, PlantFile, Scenario};
    /// use seaplant::{Dof, Timed};
    /// let file: PlantFile = serde_json::from_str(r#"{
    ///     "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand",
    ///     "axes": ["surge"], "mass_matrix": [100.0], "quadratic_damping": [20.0],
    ///     "driven": { "surge": { "speed_max": 1.0, "force_max": 80.0 } } }"#).expect("a table");
    /// let thrust = Timed::new("thrust", vec![0.0], vec![80.0])?;
    /// let drive = Drive { wrench: [(Dof::Surge, thrust)].into(), ..Drive::default() };
    /// let scenario = Scenario { drive, time_s: vec![0.0, 60.0], ..Scenario::default() };
    /// let outcome = file.model()?.run(&scenario, Draws::default())?;
    /// assert!((outcome.prediction.velocity[1][0] - 2.0).abs() < 1e-6);
    /// assert!(outcome.notes.iter().any(|note| note.contains("the trials reached 1 m/s")));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn run(&self, scenario: &Scenario, draws: Draws) -> Result<Outcome, Error> {
        let (inputs, start) = self.inputs_of(scenario)?;
        let prediction = if scenario.disturbed {
            self.predict_disturbed(&inputs, &start, &scenario.time_s, draws)?
        } else {
            self.predict(&inputs, &start, &scenario.time_s, draws)?
        };
        let forces = greatest(&inputs);
        let consequences = self.consequences(&forces, draws)?;
        let mut notes = self.notes_of(&forces, draws, &prediction, scenario.disturbed);
        notes.extend(self.beyond_trials(&forces, &prediction));
        if scenario.drive.wind.is_some() && !self.reads_wind() {
            notes.push(
                "the plant has no coefficients of wind (wind.surge, wind.sway, wind.yaw), so the wind does nothing here"
                    .to_owned(),
            );
        }
        notes.extend(self.notes.iter().cloned());
        Ok(Outcome { prediction, consequences, notes })
    }

    /// Returns forces, attitude and current, and the initial velocity of the plant's axes.
    fn inputs_of(&self, scenario: &Scenario) -> Result<(Inputs, Vector6<f64>), Error> {
        let until = scenario.time_s.last().copied().unwrap_or(0.0);
        let constant = |name: &str, x: f64| Timed::new(name, vec![0.0], vec![x]);
        let mut attitude = [None, None, None];
        for (place, angle) in attitude.iter_mut().zip(scenario.attitude) {
            *place = Some(constant("attitude", angle)?);
        }
        let mut velocity: [Option<Timed>; 6] = std::array::from_fn(|_| None);
        let mut start = Vector6::zeros();
        for (&dof, &v) in &scenario.velocity {
            if self.plant.axes().contains(&dof) {
                start[dof.index()] = v;
            } else if dof.is_rotation() {
                let axes = self.plant.structure().name();
                let reason = format!(
                    "the plant has no {dof}, so that its angle stays as it is and it has no rate to begin with; leave it out"
                );
                return Err(Error::Plant { axes, reason });
            } else {
                velocity[dof.index()] = Some(constant("velocity", v)?);
            }
        }
        let force = self.forces(&scenario.drive, until)?;
        let signals = self.signals(&scenario.drive)?;
        let wind = scenario.drive.wind.clone();
        let current = scenario.current;
        Ok((Inputs { force, velocity, attitude, current, signals, wind, known: Vec::new() }, start))
    }

    fn notes_of(
        &self,
        forces: &BTreeMap<Dof, f64>,
        draws: Draws,
        prediction: &Prediction,
        disturbed: bool,
    ) -> Vec<String> {
        let mut notes = Vec::new();
        let unknown = self.unknown_axes();
        let lost: Vec<&str> =
            unknown.iter().filter(|dof| forces.contains_key(dof)).map(|dof| dof.name()).collect();
        if !lost.is_empty() {
            notes.push(format!(
                "the inputs also act on {}, where the plant is not known: no motion is computed there",
                lost.join(", ")
            ));
        }
        let count = format!("{} draws of the coefficients, seed {}", draws.count, draws.seed);
        match (self.covariance.is_some() && draws.count > 0, disturbed) {
            (true, true) => notes.push(format!(
                "the band is from {count}, each with a disturbance like that of the trials; it does not include errors of the model itself"
            )),
            (true, false) => notes.push(format!(
                "the band is from {count}; it does not include disturbances or errors of the model itself"
            )),
            (false, _) if self.covariance.is_none() => {
                notes.push("the plant states no standard deviations, so there is no band".to_owned());
            }
            (false, _) => {}
        }
        if disturbed && self.disturbances.is_empty() {
            notes.push(
                "the plant states no disturbance (the filter error method estimates it), so none is drawn"
                    .to_owned(),
            );
        }
        if prediction.lost > 0 {
            notes.push(format!("{} draws diverged and are not in the band", prediction.lost));
        }
        notes
    }

    /// Returns notes on motion and force beyond those of the trials.
    fn beyond_trials(&self, forces: &BTreeMap<Dof, f64>, prediction: &Prediction) -> Vec<String> {
        let mut notes = Vec::new();
        for &dof in self.plant.axes() {
            let Some(driven) = self.driven.get(&dof) else { continue };
            let units = dof.units();
            let speeds = prediction.velocity.iter().map(|row| row[dof.index()].abs());
            let speed = speeds.fold(0.0, f64::max);
            let force = forces.get(&dof).copied().unwrap_or(0.0).abs();
            let all =
                [(speed, driven.speed_max, units.velocity), (force, driven.force_max, units.force)];
            for (reached, known, unit) in all {
                if reached > BEYOND * known && known > 0.0 {
                    notes.push(format!(
                        "{dof} reaches {} {unit}, but the trials reached {} {unit}: the plant is extrapolated",
                        three_digits(reached),
                        three_digits(known)
                    ));
                }
            }
        }
        notes
    }
}

fn three_digits(x: f64) -> f64 {
    let scale = 10_f64.powf(2.0 - x.abs().log10().floor());
    if scale.is_finite() { (x * scale).round() / scale } else { x }
}

/// Returns the greatest force on each axis, with its sign.
fn greatest(inputs: &Inputs) -> BTreeMap<Dof, f64> {
    let greatest_on = |dof: Dof| {
        let force = inputs.force[dof.index()].as_ref()?;
        let most = force.values().iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs()))?;
        (most != 0.0).then_some((dof, most))
    };
    Dof::ALL.into_iter().filter_map(greatest_on).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::PlantFile;

    fn boat() -> PlantModel {
        let file: PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "boat", "source": "worked by hand",
            "axes": ["surge"],
            "coefficients": { "mass.surge": { "value": 100.0, "std": 1.0 },
                              "surge: |u|u": { "value": 20.0, "std": 0.1 } },
            "driven": { "surge": { "speed_max": 2.0, "force_max": 60.0 } },
            "disturbance": { "surge": { "std": 30.0, "correlation_s": 5.0 } }
        }))
        .expect("a table");
        file.model().expect("possible")
    }

    fn scenario(force: f64) -> Scenario {
        let thrust = Timed::new("thrust", vec![0.0], vec![force]).expect("one");
        let drive = Drive { wrench: [(Dof::Surge, thrust)].into(), ..Drive::default() };
        let time_s = (0..=60).map(f64::from).collect();
        Scenario { drive, time_s, ..Scenario::default() }
    }

    #[test]
    fn motion_and_force_beyond_the_trials_are_noted() {
        let notes = boat().run(&scenario(200.0), Draws::default()).expect("bounded").notes;
        let beyond: Vec<_> = notes.iter().filter(|note| note.contains("extrapolated")).collect();
        assert_eq!(beyond.len(), 2, "{notes:?}");
        assert!(beyond[0].contains("surge reaches 3.16 m/s"), "{}", beyond[0]);
        assert!(beyond[1].contains("the trials reached 60 N"), "{}", beyond[1]);
        let within = boat().run(&scenario(50.0), Draws::default()).expect("bounded").notes;
        assert!(!within.iter().any(|note| note.contains("extrapolated")), "{within:?}");
    }

    #[test]
    fn disturbances_widen_the_band_and_keep_the_estimate() {
        let draws = Draws { count: 100, seed: 5 };
        let calm = boat().run(&scenario(50.0), draws).expect("bounded").prediction;
        let rough = Scenario { disturbed: true, ..scenario(50.0) };
        let rough_once = boat().run(&rough, draws).expect("bounded").prediction;
        assert_eq!(calm.velocity, rough_once.velocity);
        let width = |of: &Prediction| of.band[60][0][1] - of.band[60][0][0];
        assert!(width(&rough_once) > 5.0 * width(&calm), "{}", width(&rough_once));
        assert_eq!(rough_once, boat().run(&rough, draws).expect("again").prediction);
    }
}
