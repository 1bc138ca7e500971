//! What disturbed a plant in its trials.

use std::collections::BTreeMap;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::PlantModel;
use crate::motion::Inputs;
use crate::random::gauss_markov;
use crate::results::{CoupledPlant, PlantResult};
use crate::{Dof, Error, Timed};

/// A slow force on an axis that nothing measured explains, as the filter error method found it:
/// a first-order Gauss–Markov process.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disturbance {
    /// Its standard deviation, N or N m.
    pub std: f64,
    /// Its correlation time, s.
    pub correlation_s: f64,
}

/// How finely a disturbance is drawn, s, unless its correlation time asks for more.
const GRID_S: f64 = 0.1;

/// Steps of a disturbance over a prediction, at most.
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
    /// Inputs with a draw of the disturbances added; draw `k` of a seed is always the same.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if the plant's disturbances are not.
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
            // A stream for each axis and draw, apart from that of the coefficients.
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

/// The sum of two series, each held between its times.
fn sum(a: &Timed, b: &Timed) -> Result<Timed, Error> {
    let mut times: Vec<f64> = a.time_s().iter().chain(b.time_s()).copied().collect();
    times.sort_by(f64::total_cmp);
    times.dedup_by(|b, a| *b - *a < 1e-9);
    let values: Vec<f64> = times.iter().map(|&t| a.held_at(t) + b.held_at(t)).collect();
    Timed::new("force", times, values)
}

/// The disturbance of an axis that was identified by itself, N or N m.
pub(super) fn of_axis(plant: &PlantResult) -> Option<Disturbance> {
    let std = plant.nuisances.get("disturbance")?.value * plant.parameters.mass.value;
    let correlation_s = plant.nuisances.get("disturbance_correlation")?.value;
    possible(Disturbance { std, correlation_s })
}

/// The disturbances of a plant of several axes.
pub(super) fn of_coupled(plant: &CoupledPlant) -> BTreeMap<Dof, Disturbance> {
    let of = |&dof: &Dof| {
        let std = plant.nuisances.get(&format!("disturbance: {dof}"))?.value;
        let correlation_s = plant.nuisances.get(&format!("disturbance correlation: {dof}"))?.value;
        Some((dof, possible(Disturbance { std, correlation_s })?))
    };
    plant.axes.iter().filter_map(of).collect()
}

fn possible(of: Disturbance) -> Option<Disturbance> {
    let positive = |x: f64| x.is_finite() && x > 0.0;
    (positive(of.std) && positive(of.correlation_s)).then_some(of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_draw_has_the_spread_and_the_memory_that_were_asked_for() {
        let disturbance = Disturbance { std: 20.0, correlation_s: 2.0 };
        let random = ChaCha8Rng::seed_from_u64(3);
        let drawn = disturbance.draw(20_000.0, random).expect("finite");
        let x = drawn.values();
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let of = |lag: usize| {
            let pairs = x.iter().zip(&x[lag..]);
            pairs.map(|(a, b)| (a - mean) * (b - mean)).sum::<f64>() / x.len() as f64
        };
        // 20 000 s hold 5000 independent stretches of 2 T: 2 % of the deviation at two sigma.
        assert!((of(0).sqrt() - 20.0).abs() < 0.6, "{}", of(0).sqrt());
        let memory = of(20) / of(0);
        assert!((memory - (-1.0_f64).exp()).abs() < 0.04, "{memory}");
    }
}
