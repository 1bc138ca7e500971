//! Disturbances of a plant in its trials.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PlantModel;
use crate::motion::Inputs;
use crate::random::gauss_markov;
use crate::results::PlantResult;
use crate::{Dof, Error, Timed};

/// A slow unexplained force on an axis, as estimated by the filter error method: a first-order
/// Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// Standard deviation, N or N m.
    pub std: f64,
    /// Correlation time, s.
    pub correlation_s: f64,
}

/// Time step of a drawn disturbance, s, unless a short correlation time requires less.
const GRID_S: f64 = 0.1;

/// Largest number of time steps of a disturbance.
const MOST_STEPS: f64 = 1e6;

impl Disturbance {
    /// Draws the force from time 0 on.
    fn draw(&self, until_s: f64, random: ChaCha8Rng) -> Result<Timed, Error> {
        let h = GRID_S.min(0.2 * self.correlation_s).max(until_s / MOST_STEPS);
        let steps = (until_s / h).ceil().max(0.0) as usize;
        let forces = gauss_markov(random, self.std, self.correlation_s / h, steps + 1);
        let times: Vec<f64> = (0..=steps).map(|k| h * k as f64).collect();
        Timed::new("disturbance", times, forces)
    }
}

impl PlantModel {
    /// Returns inputs with a draw of the disturbances added; draw `k` of a seed is always the same.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if the plant's disturbances are not finite.
    pub(super) fn disturbed(
        &self,
        inputs: &Inputs,
        until_s: f64,
        seed: u64,
        k: usize,
    ) -> Result<Inputs, Error> {
        let mut disturbed = inputs.clone();
        for (dof, disturbance) in &self.disturbances {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            // A random stream for each axis and draw, separate from that of the coefficients.
            random.set_stream(1 + (6 * k + dof.index()) as u64);
            let drawn = disturbance.draw(until_s, random)?;
            let place = &mut disturbed.force[dof.index()];
            *place = Some(match place.take() {
                Some(force) => sum(&force, &drawn)?,
                None => drawn,
            });
        }
        Ok(disturbed)
    }
}

/// Returns the sum of two series, each held between its times.
fn sum(a: &Timed, b: &Timed) -> Result<Timed, Error> {
    let mut times: Vec<f64> = a.time_s().iter().chain(b.time_s()).copied().collect();
    times.sort_by(f64::total_cmp);
    times.dedup_by(|b, a| *b - *a < 1e-9);
    let values: Vec<f64> = times.iter().map(|&t| a.held_at(t) + b.held_at(t)).collect();
    Timed::new("force", times, values)
}

/// Returns the disturbances of a plant. That of an axis alone is an acceleration.
pub(super) fn disturbances_of(plant: &PlantResult) -> BTreeMap<Dof, Disturbance> {
    let value = |name: String| plant.nuisances.get(&name).map(|x| x.value);
    let disturbance = |&dof: &Dof| {
        let (std, correlation_s) = match plant.is_alone() {
            true => (
                value("disturbance".to_owned())? * plant.by_axis.get(&dof)?.mass.value,
                value("disturbance_correlation".to_owned())?,
            ),
            false => (
                value(format!("disturbance: {dof}"))?,
                value(format!("disturbance correlation: {dof}"))?,
            ),
        };
        Some((dof, possible(Disturbance { std, correlation_s })?))
    };
    plant.axes.iter().filter_map(disturbance).collect()
}

fn possible(of: Disturbance) -> Option<Disturbance> {
    let positive = |x: f64| x.is_finite() && x > 0.0;
    (positive(of.std) && positive(of.correlation_s)).then_some(of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_has_the_specified_spread_and_correlation_time() {
        let disturbance = Disturbance { std: 20.0, correlation_s: 2.0 };
        let random = ChaCha8Rng::seed_from_u64(3);
        let drawn = disturbance.draw(20_000.0, random).expect("finite");
        let x = drawn.values();
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let autocovariance = |lag: usize| {
            let pairs = x.iter().zip(&x[lag..]);
            pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / x.len() as f64
        };
        // 20 000 s are 5000 independent intervals of 2 T: 2 % of the deviation at two sigma.
        assert!((autocovariance(0).sqrt() - 20.0).abs() < 0.6, "{}", autocovariance(0).sqrt());
        let memory = autocovariance(20) / autocovariance(0);
        assert!((memory - (-1.0_f64).exp()).abs() < 0.04, "{memory}");
    }
}
