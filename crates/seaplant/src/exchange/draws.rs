//! Plants as uncertain as an identification leaves them.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::PlantModel;
use crate::Error;
use crate::plant::{Basis, Plant, Product};

/// Draws of coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Draws {
    /// How many.
    pub count: usize,
    /// Where their random numbers start.
    pub seed: u64,
}

impl Default for Draws {
    fn default() -> Self {
        Self { count: 200, seed: 1 }
    }
}

/// For one draw that a vehicle can have, so many are tried.
const TRIES: usize = 50;

impl PlantModel {
    /// Plants whose coefficients are drawn from the normal distribution of the estimate.
    ///
    /// A draw whose M is not that of a body, or whose damping of an axis by itself is below zero
    /// where the estimate's is not, is drawn again. Empty if the covariance is not known.
    ///
    /// # Errors
    /// [`Error::Plant`] if hardly any draw is a plant: the coefficients are then not known.
    pub fn draws(&self, draws: Draws) -> Result<Vec<Plant>, Error> {
        let Some(covariance) = &self.covariance else { return Ok(Vec::new()) };
        // In an order of their own: draws do not depend on that of a file.
        let terms = self.plant.structure().terms();
        let mut order: Vec<usize> = (0..terms.len()).collect();
        order.sort_by_key(|k| terms[*k]);
        let std = |k: usize| covariance[(k, k)].max(0.0).sqrt();
        let correlation = DMatrix::from_fn(order.len(), order.len(), |i, j| {
            let scale = std(order[i]) * std(order[j]);
            if scale > 0.0 { covariance[(order[i], order[j])] / scale } else { 0.0 }
        });
        // Of a correlation that is rounded, not its Cholesky factor: it need not exist.
        let eigen = correlation.symmetric_eigen();
        let scale = eigen.eigenvalues.map(|x| x.max(0.0).sqrt());
        let mut random = ChaCha8Rng::seed_from_u64(draws.seed);
        let mut plants = Vec::with_capacity(draws.count);
        for _ in 0..draws.count.saturating_mul(TRIES) {
            if plants.len() == draws.count {
                break;
            }
            let unit = DVector::from_fn(scale.len(), |k, _| {
                let x: f64 = StandardNormal.sample(&mut random);
                x * scale[k]
            });
            let correlated = &eigen.eigenvectors * unit;
            let mut by = DVector::zeros(order.len());
            for (&k, x) in order.iter().zip(correlated.iter()) {
                by[k] = std(k) * x;
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

    /// The plant with other coefficients, if a vehicle can have it.
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

/// The 2.5 % and 97.5 % points; of what is not empty.
pub(super) fn band(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    let at = |part: f64| {
        let place = part * (values.len() - 1) as f64;
        let (low, high) = (values[place.floor() as usize], values[place.ceil() as usize]);
        low + (place - place.floor()) * (high - low)
    };
    [at(0.025), at(0.975)]
}
