//! What a fit is off by where known forces are not known exactly.

use std::sync::Arc;

use nalgebra::DMatrix;

use super::fit::{Optimum, Problem};
use crate::motion::{KnownForce, Load};

impl Problem {
    /// The covariance with what the standard deviations of known forces add: `Σ δδᵀ`, with δ what the
    /// optimum moves by where one of them is as much larger in all trials.
    ///
    /// `δ = −C (g(F + σ) − g(F))`, g being the slope of the likelihood.
    pub(super) fn with_known_uncertainty<const N: usize, const M: usize>(
        &self,
        optimum: &Optimum<N, M>,
        covariance: DMatrix<f64>,
    ) -> DMatrix<f64> {
        let unsure = self.unsure_forces();
        if unsure.is_empty() {
            return covariance;
        }
        let Some((here, _)) = self.by_plant(&optimum.point) else { return covariance };
        let mut sum = covariance.clone();
        for force in unsure {
            let Some((there, _)) = self.with_larger(&force).by_plant(&optimum.point) else {
                continue;
            };
            let by = &covariance * (here.gradient.clone() - there.gradient);
            sum += &by * by.transpose();
        }
        sum
    }

    /// Known forces with a standard deviation; one that acts several times is off alike each time.
    fn unsure_forces(&self) -> Vec<KnownForce> {
        let mut unsure: Vec<KnownForce> = Vec::new();
        for force in self.known.iter().flatten().filter(|force| force.std_n > 0.0) {
            if !unsure.iter().any(|own| own.is_same(force)) {
                unsure.push(force.clone());
            }
        }
        unsure
    }

    /// The same trials with a force that is larger by its standard deviation.
    fn with_larger(&self, unsure: &KnownForce) -> Self {
        let enlarged = |force: &KnownForce| match force.is_same(unsure) {
            true => force.with_size(force.size_n() + force.std_n),
            false => force.clone(),
        };
        let of = |acting: &Vec<KnownForce>| {
            Load::of(&acting.iter().map(enlarged).collect::<Vec<KnownForce>>())
        };
        let loads: Arc<[Load]> = self.known.iter().map(of).collect();
        let mut larger = self.with_terms(self.structure.clone());
        larger.loads = loads;
        larger
    }
}
