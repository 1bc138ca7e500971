//! Random draws of plants within their uncertainty.

use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::PlantModel;
use crate::Error;
use crate::plant::{Basis, Plant, Product};
use crate::statistics::root;

/// Draws of coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draws {
    /// Number of draws.
    pub count: usize,
    /// Seed of their random numbers.
    pub seed: u64,
}

impl Default for Draws {
    fn default() -> Self {
        Self { count: 200, seed: 1 }
    }
}

/// Attempts per physically possible draw.
const TRIES: usize = 50;

impl PlantModel {
    /// Draws plants with coefficients from the normal distribution of the estimate.
    ///
    /// A draw is repeated if its M is not positive definite, or if damping of an axis by its own
    /// velocity is negative and the estimate's is not. Empty if the covariance is unknown.
    ///
    /// # Errors
    /// [`Error::Plant`] if hardly any draw is possible: the coefficients are then unknown.
    pub fn draws(&self, draws: Draws) -> Result<Vec<Plant>, Error> {
        let Some(covariance) = &self.covariance else { return Ok(Vec::new()) };
        // Terms are sorted, so that draws do not depend on their order in a file.
        let terms = self.plant.structure().terms();
        let mut order: Vec<usize> = (0..terms.len()).collect();
        order.sort_by_key(|k| terms[*k]);
        let root = root(&covariance.select_rows(&order).select_columns(&order));
        let mut random = ChaCha8Rng::seed_from_u64(draws.seed);
        let mut plants = Vec::with_capacity(draws.count);
        for _ in 0..draws.count.saturating_mul(TRIES) {
            if plants.len() == draws.count {
                break;
            }
            let unit = DVector::from_fn(order.len(), |_, _| StandardNormal.sample(&mut random));
            let mut by = DVector::zeros(order.len());
            for (&k, x) in order.iter().zip((&root * unit).iter()) {
                by[k] = *x;
            }
            plants.extend(self.moved(&by));
        }
        if plants.len() == draws.count {
            return Ok(plants);
        }
        let reason = format!(
            "only {} of {} draws of its coefficients give a physical plant; the coefficients are too uncertain for a band",
            plants.len(),
            draws.count * TRIES
        );
        Err(Error::Plant { axes: self.plant.structure().name(), reason })
    }

    /// Returns the plant with changed coefficients, if it is physically possible.
    fn moved(&self, by: &DVector<f64>) -> Option<Plant> {
        let terms = self.plant.structure().terms().iter().zip(self.plant.coefficients());
        let mut coefficients = Vec::with_capacity(by.len());
        for ((term, value), by) in terms.zip(by.iter()) {
            let moved = value + by;
            let is_own = matches!(term, Basis::Product(on, product)
                if [Product::linear(*on), Product::quadratic(*on)].contains(product));
            if is_own && moved < 0.0 && *value >= 0.0 {
                return None;
            }
            coefficients.push(moved);
        }
        Plant::new(self.plant.structure().clone(), coefficients).ok()
    }
}

/// Returns the 2.5 % and 97.5 % quantiles of values, which must not be empty.
pub(super) fn band(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let place = part * (values.len() - 1) as f64;
        let (low, high) = (values[place.floor() as usize], values[place.ceil() as usize]);
        low + (place - place.floor()) * (high - low)
    };
    [at(0.025), at(0.975)]
}
