//! What a fit is off by where known forces are not known exactly, and what each says of the scale of thrust.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::actuator::Actuator;
use super::descent::{Optimum, Tolerance};
use super::problem::{Point, Problem};
use super::uncertainty::inverse;
use crate::motion::{KnownForce, Load};

/// The scale of thrust that one known force reveals by itself, others being of unknown size.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleClaim {
    /// The force; of one that acts several times, the first time.
    pub force: KnownForce,
    /// What acts over what curves and logs say.
    pub scale: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// Known forces that agree look as if they did not this often.
const CHANCE: f64 = 1e-3;

/// By what part of its size a force is changed to see how the likelihood changes.
const PART: f64 = 0.02;

/// Steps of Newton's method to the scale by one force.
const STEPS: usize = 3;

/// How the likelihood changes with the logarithms of the sizes of some forces.
struct BySize {
    /// Its slope by these, other numbers of the fit being as they are …
    slope: DVector<f64>,
    /// … and its curvature, others following.
    curvature: DMatrix<f64>,
    /// How the logarithm of the scale follows each.
    of_scale: DVector<f64>,
}

impl BySize {
    /// The logarithms at which it is likeliest.
    fn step(&self) -> DVector<f64> {
        -(inverse(&self.curvature) * &self.slope)
    }
}

impl Problem {
    /// What each of several known forces says of the scale of thrust, if they contradict each other by
    /// more than chance; `colour` is how many samples say as much as one.
    pub(super) fn contradictory_claims(&self, optimum: &Optimum, colour: f64) -> Vec<ScaleClaim> {
        let forces = self.distinct_forces();
        if forces.len() < 2 || self.is_free || !self.fits[Actuator::SCALE] {
            return Vec::new();
        }
        let (first, others) = (&forces[..1], &forces[1..]);
        let Some(by) = self.by_size(optimum, others) else { return Vec::new() };
        let step = by.step();
        let part = |force: &KnownForce| (force.std_n / force.size_n()).powi(2);
        let mut variance = inverse(&by.curvature) * colour;
        variance.iter_mut().for_each(|x| *x += part(&first[0]));
        for (k, force) in others.iter().enumerate() {
            variance[(k, k)] += part(force);
        }
        let off = step.dot(&(inverse(&variance) * &step));
        let needed = ChiSquared::new(others.len() as f64)
            .map_or(f64::INFINITY, |chi| chi.inverse_cdf(1.0 - CHANCE));
        if off < needed {
            return Vec::new();
        }
        let of = |k: usize| {
            let others: Vec<KnownForce> = forces
                .iter()
                .enumerate()
                .filter(|(i, _)| *i != k)
                .map(|(_, x)| x.clone())
                .collect();
            self.scale_by(&forces[k], &others, optimum, colour)
        };
        (0..forces.len()).map(of).collect::<Option<_>>().unwrap_or_default()
    }

    /// The scale by one force where others have any size.
    fn scale_by(
        &self,
        force: &KnownForce,
        others: &[KnownForce],
        optimum: &Optimum,
        colour: f64,
    ) -> Option<ScaleClaim> {
        let mut problem = self.clone();
        let mut optimum = optimum.clone();
        let mut others = others.to_vec();
        for _ in 0..STEPS {
            let step = problem.by_size(&optimum, &others)?.step();
            let resized = others.iter().zip(step.iter());
            let resized: Vec<KnownForce> =
                resized.map(|(own, log)| own.with_size(own.size_n() * log.exp())).collect();
            problem = problem.with_sizes(&others, &resized);
            others = resized;
            optimum = problem.descent(optimum.point, Tolerance::FINE).ok()?;
        }
        let by = problem.by_size(&optimum, &others)?;
        let place = problem.structure.terms().len() + Actuator::SCALE;
        let own = inverse(&optimum.information)[(place, place)];
        let of_others = by.of_scale.dot(&(inverse(&by.curvature) * &by.of_scale));
        let of_size = (force.std_n / force.size_n()).powi(2);
        let scale = optimum.point.actuator.log_scale.exp();
        let std = scale * (colour * (own + of_others) + of_size).sqrt();
        Some(ScaleClaim { force: force.clone(), scale, std })
    }

    /// How the likelihood changes with the sizes of some forces at an optimum.
    fn by_size(&self, optimum: &Optimum, forces: &[KnownForce]) -> Option<BySize> {
        let point: &Point = &optimum.point;
        let with = |k: usize, part: f64| {
            let sized = [forces[k].with_size(forces[k].size_n() * (1.0 + part))];
            self.with_sizes(&forces[k..=k], &sized).by_plant(point).map(|(slope, _)| slope)
        };
        let covariance = inverse(&optimum.information);
        let n = forces.len();
        let (mut slope, mut cross) = (DVector::zeros(n), DMatrix::zeros(covariance.nrows(), n));
        let mut own = DMatrix::zeros(n, n);
        let costs: Vec<[f64; 2]> = (0..n)
            .map(|k| {
                let (more, less) = (with(k, PART)?, with(k, -PART)?);
                slope[k] = (more.cost - less.cost) / (2.0 * PART);
                cross.set_column(k, &((more.gradient - less.gradient) / (2.0 * PART)));
                Some([more.cost, less.cost])
            })
            .collect::<Option<_>>()?;
        let here = self.by_plant(point)?.0.cost;
        for i in 0..n {
            own[(i, i)] = (costs[i][0] + costs[i][1] - 2.0 * here) / (PART * PART);
            for j in 0..i {
                let both = [i, j].map(|k| forces[k].with_size(forces[k].size_n() * (1.0 + PART)));
                let pair = [forces[i].clone(), forces[j].clone()];
                let cost = self.with_sizes(&pair, &both).by_plant(point)?.0.cost;
                own[(i, j)] = (cost - costs[i][0] - costs[j][0] + here) / (PART * PART);
                own[(j, i)] = own[(i, j)];
            }
        }
        let follows = &covariance * &cross;
        let curvature = own - cross.transpose() * &follows;
        let place = self.structure.terms().len() + Actuator::SCALE;
        let of_scale = -follows.row(place).transpose();
        Some(BySize { slope, curvature, of_scale })
    }

    /// Known forces, one that acts several times once.
    fn distinct_forces(&self) -> Vec<KnownForce> {
        let mut distinct: Vec<KnownForce> = Vec::new();
        for force in self.known.iter().flatten() {
            if !distinct.iter().any(|own| own.is_same(force)) {
                distinct.push(force.clone());
            }
        }
        distinct
    }

    /// The covariance with what the standard deviations of known forces add: `Σ δδᵀ`, with δ what the
    /// optimum moves by where one of them is as much larger in all trials.
    ///
    /// `δ = −C (g(F + σ) − g(F))`, g being the slope of the likelihood.
    pub(super) fn with_known_uncertainty(
        &self,
        optimum: &Optimum,
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
        self.distinct_forces().into_iter().filter(|force| force.std_n > 0.0).collect()
    }

    /// The same trials with a force that is larger by its standard deviation.
    fn with_larger(&self, unsure: &KnownForce) -> Self {
        let larger = unsure.with_size(unsure.size_n() + unsure.std_n);
        self.with_sizes(std::slice::from_ref(unsure), &[larger])
    }

    /// The same trials with other sizes of some forces.
    fn with_sizes(&self, forces: &[KnownForce], sized: &[KnownForce]) -> Self {
        let resized = |force: &KnownForce| {
            let same = forces.iter().zip(sized).find(|(own, _)| own.is_same(force));
            same.map_or_else(|| force.clone(), |(_, sized)| force.with_size(sized.size_n()))
        };
        let known: Arc<[Vec<KnownForce>]> =
            self.known.iter().map(|acting| acting.iter().map(resized).collect()).collect();
        let mut problem = self.clone();
        problem.loads = known.iter().map(|acting| Load::of(acting)).collect();
        problem.known = known;
        problem
    }
}
