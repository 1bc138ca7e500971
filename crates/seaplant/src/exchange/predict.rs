//! Prediction of motion, with bands by the uncertainty of the coefficients.

use nalgebra::Vector6;

use super::draws::band;
use super::{Draws, PlantModel};
use crate::motion::{Inputs, Simulated, simulate};
use crate::plant::Plant;
use crate::{Error, parallel};

/// The simulated motion of a plant under inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Instants, s.
    pub time_s: Vec<f64>,
    /// North, east, down, m, from the start, then roll, pitch, heading, rad: by the estimate.
    pub pose: Vec<[f64; 6]>,
    /// Velocity over ground in body axes, m/s and rad/s: by the estimate.
    pub velocity: Vec<[f64; 6]>,
    /// The 95 % band of each velocity, low and high; empty if the covariance is unknown.
    pub band: Vec<[[f64; 2]; 6]>,
    /// Number of draws that diverged, which are not part of the band.
    pub lost: usize,
}

impl PlantModel {
    /// Simulates the plant from a velocity under inputs, and draws of it for the band.
    ///
    /// `start` is velocity over ground, shape (6,); `time_s` increases. The motion is independent
    /// of the spacing of these instants.
    ///
    /// # Errors
    /// As [`simulate`] and [`PlantModel::draws`].
    ///
    /// # Example
    /// ```
    /// use nalgebra::Vector6;
    /// use seaplant::exchange::{Draws, PlantFile};
    /// use seaplant::motion::Inputs;
    /// use seaplant::Timed;
    /// let file: PlantFile = serde_json::from_str(r#"{
    ///     "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand", "axes": ["surge"],
    ///     "coefficients": { "mass.surge": { "value": 100.0, "std": 2.0 },
    ///                       "surge: |u|u": { "value": 20.0, "std": 1.0 } } }"#).expect("a table");
    /// let mut inputs = Inputs::default();
    /// inputs.force[0] = Some(Timed::new("thrust", vec![0.0], vec![80.0])?);
    /// let time_s = [0.0, 30.0, 60.0];
    /// let moved = file.model()?.predict(&inputs, &Vector6::zeros(), &time_s, Draws::default())?;
    /// // √(τ/d) with d = 20 ± 1: 2 m/s, and 5 % in drag are 2.5 % in speed.
    /// let [low, high] = moved.band[2][0];
    /// assert!((moved.velocity[2][0] - 2.0).abs() < 1e-6);
    /// assert!((low - 1.91).abs() < 0.03 && (high - 2.11).abs() < 0.04, "{low} {high}");
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn predict(
        &self,
        inputs: &Inputs,
        start: &Vector6<f64>,
        time_s: &[f64],
        draws: Draws,
    ) -> Result<Prediction, Error> {
        let plants = self.draws(draws)?;
        let runs: Vec<(Plant, Inputs)> =
            plants.into_iter().map(|plant| (plant, inputs.clone())).collect();
        self.with_band(inputs, start, time_s, &runs)
    }

    /// Simulates as [`PlantModel::predict`], with each draw disturbed as in the trials; without
    /// covariance, each draw is the estimate.
    ///
    /// # Errors
    /// As [`PlantModel::predict`].
    pub fn predict_disturbed(
        &self,
        inputs: &Inputs,
        start: &Vector6<f64>,
        time_s: &[f64],
        draws: Draws,
    ) -> Result<Prediction, Error> {
        let mut plants = self.draws(draws)?;
        if plants.is_empty() && !self.disturbances.is_empty() {
            plants = vec![self.plant.clone(); draws.count];
        }
        let until = time_s.last().copied().unwrap_or(0.0);
        let mut runs = Vec::with_capacity(plants.len());
        for (k, plant) in plants.into_iter().enumerate() {
            runs.push((plant, self.disturbed(inputs, until, draws.seed, k)?));
        }
        self.with_band(inputs, start, time_s, &runs)
    }

    /// Simulates the estimate, with the band of other runs around it.
    fn with_band(
        &self,
        inputs: &Inputs,
        start: &Vector6<f64>,
        time_s: &[f64],
        others: &[(Plant, Inputs)],
    ) -> Result<Prediction, Error> {
        let moved = simulate(&self.plant, inputs, start, time_s)?;
        let runs = parallel::map(others, |(plant, inputs)| {
            simulate(plant, inputs, start, time_s).ok().map(|moved| moved.velocity)
        });
        let kept: Vec<Vec<Vector6<f64>>> = runs.into_iter().flatten().collect();
        let band_at = |k: usize, axis: usize| band(kept.iter().map(|run| run[k][axis]).collect());
        let band = match kept.is_empty() {
            true => Vec::new(),
            false => {
                (0..time_s.len()).map(|k| std::array::from_fn(|axis| band_at(k, axis))).collect()
            }
        };
        Ok(Prediction {
            time_s: time_s.to_vec(),
            pose: poses(&moved),
            velocity: moved.velocity.iter().map(|v| (*v).into()).collect(),
            band,
            lost: others.len() - kept.len(),
        })
    }
}

fn poses(moved: &Simulated) -> Vec<[f64; 6]> {
    let both = moved.position.iter().zip(&moved.attitude);
    both.map(|(at, [roll, pitch, heading])| [at.x, at.y, at.z, *roll, *pitch, *heading]).collect()
}
