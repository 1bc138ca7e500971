//! Drag as a force over speed, which is determined even if its linear and quadratic parts are not.

use nalgebra::Vector6;

use super::{FittedPlant, Parameter, PlantResult, Results, two_digits};
use crate::plant::{Basis, Product};
use crate::{Dof, Estimate, Role};

/// Number of points of a curve.
const POINTS: usize = 13;

/// Drag of an axis from rest to the greatest speed of its trials, in motion along that axis only.
#[derive(Clone, Debug, PartialEq)]
pub struct DragCurve {
    /// Speeds, m/s or rad/s.
    pub speed: Vec<f64>,
    /// Drag at each, N or N m, with its standard deviation and 95 % interval.
    pub force: Vec<Estimate>,
}

impl DragCurve {
    fn new(greatest: f64, at: impl Fn(f64) -> Estimate) -> Option<Self> {
        let is_speed = greatest.is_finite() && greatest > 0.0;
        let speed = |k: usize| greatest * k as f64 / (POINTS - 1) as f64;
        let speed: Vec<f64> = (0..POINTS).filter(|_| is_speed).map(speed).collect();
        let force: Vec<Estimate> = speed.iter().map(|v| at(*v)).collect();
        let is_known = force.last()?.std > 0.0 && force.iter().all(|x| x.std.is_finite());
        is_known.then_some(Self { speed, force })
    }
}

impl PlantResult {
    /// Computes the drag `d_Q v|v| + d_L v` up to a speed; `None` for a plant without drag, or
    /// without its uncertainty.
    ///
    /// # Example
    /// ```
    /// # use seaplant::twin::{TwinSpec, make};
    /// # use seaplant::{Dof, IdentifyOptions, Trial, TrialSetup, identify};
    /// # let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 120.0, ..TwinSpec::jason2() };
    /// # let dive = make(&spec)?;
    /// # let trials = dive.trials.iter().map(|log| {
    /// #     let setup = TrialSetup { name: log.name.clone(), role: log.role, dofs: log.dofs.clone(),
    /// #         ..TrialSetup::default() };
    /// #     Trial::new(setup, &log.recording, &dive.vehicle)
    /// # }).collect::<Result<Vec<_>, _>>()?;
    /// let results = identify(&dive.vehicle, &trials, &IdentifyOptions::default()).results;
    /// let curve = results.plants[&Dof::Surge].drag_to(0.5).expect("it drags");
    /// let drag = curve.force.last().expect("a point");
    /// let truth = 2230.9 * 0.5 * 0.5;
    /// assert!(drag.low95 < truth && truth < drag.high95);
    /// let (usual_speed, force) = results.drag_forces(Dof::Surge)[0];
    /// assert!(force.covers(2230.9 * usual_speed * usual_speed));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn drag_to(&self, greatest: f64) -> Option<DragCurve> {
        DragCurve::new(greatest, |v| self.drag_at(v))
    }

    /// Computes the drag `d_Q v|v| + d_L v` at a speed; zero for a plant without drag.
    pub fn drag_at(&self, speed: f64) -> Estimate {
        let parameters = &self.parameters;
        let parts = [
            (1, parameters.quadratic_drag.as_ref(), speed * speed.abs()),
            (2, parameters.linear_drag.as_ref(), speed),
        ];
        let parts: Vec<(usize, &Parameter, f64)> =
            parts.into_iter().filter_map(|(k, x, factor)| Some((k, x?, factor))).collect();
        let value = parts.iter().map(|(_, x, factor)| x.value * factor).sum();
        let of = |spread: &dyn Fn(&Parameter) -> f64| {
            let spreads: Vec<f64> = parts.iter().map(|(_, x, factor)| spread(x) * factor).collect();
            combined(&spreads, |i, j| self.correlation[parts[i].0][parts[j].0])
        };
        // Half intervals add up as standard deviations do, with the quantile that the parameters have.
        let half = of(&|x| 0.5 * (x.high95 - x.low95));
        Estimate { value, std: of(&|x| x.std), low95: value - half, high95: value + half }
    }
}

impl Results {
    /// Computes the drag of an axis at the usual speed of the fitted trials (root mean square) and at the
    /// greatest of all, each to two digits: speeds, m/s or rad/s, and forces, N or N m.
    ///
    /// Empty where no speed was measured, and of a plant whose drag is not known.
    pub fn drag_forces(&self, dof: Dof) -> Vec<(f64, Estimate)> {
        let several = self.coupled.values().find(|plant| plant.axes.contains(&dof));
        let at = |speed: f64| match (self.plants.get(&dof), several) {
            (Some(plant), _) => Some((speed, plant.drag_at(speed))),
            (None, plant) => Some((speed, plant?.drag_at(dof, speed))),
        };
        let fitted = self.trials.iter().filter(|trial| trial.role == Role::Fit);
        let axes = fitted.filter_map(|trial| trial.axes.get(&dof));
        let (mut sum, mut seconds) = (0.0, 0.0);
        for (axis, rms) in axes.filter_map(|axis| Some((axis, axis.speed_rms?))) {
            sum += rms * rms * (axis.to_s - axis.from_s);
            seconds += axis.to_s - axis.from_s;
        }
        let usual = (sum / seconds).sqrt();
        let greatest = self.driven().get(&dof).map_or(0.0, |driven| driven.speed_max);
        let mut speeds: Vec<f64> = [usual, greatest].into_iter().filter(|v| *v > 0.0).collect();
        speeds.iter_mut().for_each(|speed| *speed = two_digits(*speed));
        speeds.dedup();
        let is_known = |force: &Estimate| force.std > 0.0 && force.std.is_finite();
        speeds.into_iter().filter_map(at).filter(|(_, force)| is_known(force)).collect()
    }
}

impl FittedPlant {
    /// Computes the drag of an axis by its own velocity up to a speed; `None` for an axis without
    /// drag.
    pub fn drag_to(&self, dof: Dof, greatest: f64) -> Option<DragCurve> {
        DragCurve::new(greatest, |v| self.drag_at(dof, v))
    }

    /// Computes the drag of an axis by its own velocity at a speed; zero for an axis without drag.
    pub fn drag_at(&self, dof: Dof, speed: f64) -> Estimate {
        let own = |product: &Product| product.factors().all(|factor| factor.of == dof);
        let mut velocity = Vector6::zeros();
        velocity[dof.index()] = speed;
        let part = |(name, x): (&String, _)| match name.parse() {
            Ok(Basis::Product(on, product)) if on == dof && own(&product) => {
                let index = self.correlation.names.iter().position(|known| known == name);
                Some((product.value(&velocity), x, index))
            }
            _ => None,
        };
        let parts: Vec<(f64, &super::Coefficient, Option<usize>)> =
            self.parameters.iter().filter_map(part).collect();
        let correlation = |i: Option<usize>, j: Option<usize>| {
            let row = |i: usize| self.correlation.value.get(i);
            i.zip(j).and_then(|(i, j)| row(i)?.get(j).copied()).unwrap_or(0.0)
        };
        let value = parts.iter().map(|(factor, x, _)| x.value * factor).sum();
        let spreads: Vec<f64> = parts.iter().map(|(factor, x, _)| x.std * factor).collect();
        let std = combined(&spreads, |i, j| correlation(parts[i].2, parts[j].2));
        Estimate::new(value, std, self.samples as f64)
    }
}

/// Computes the spread of a sum, `√(Σ r_ij s_i s_j)`, from the spreads of its parts and their correlations.
fn combined(spreads: &[f64], correlation: impl Fn(usize, usize) -> f64) -> f64 {
    let mut variance = 0.0;
    for (i, x) in spreads.iter().enumerate() {
        for (j, y) in spreads.iter().enumerate() {
            let r = if i == j { 1.0 } else { correlation(i, j) };
            variance += r * x * y;
        }
    }
    f64::max(variance, 0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::{TwinSpec, make};
    use crate::{IdentifyOptions, Method, Trial, identify};

    fn identified(spec: &TwinSpec) -> Results {
        let dive = make(spec).expect("valid");
        let trials = dive.trials.iter().map(|log| log.trial(&dive).expect("complete"));
        let trials: Vec<Trial> = trials.collect();
        let methods = vec![Method::EquationError];
        let options = IdentifyOptions { methods, subsets: false, ..IdentifyOptions::default() };
        identify(&dive.vehicle, &trials, &options).results
    }

    #[test]
    fn drag_of_one_coefficient_has_its_interval() {
        // So short that the quantile of Student's t is far from that of the normal distribution.
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 60.0, ..TwinSpec::jason2() };
        let results = identified(&spec);
        let plant = &results.plants[&Dof::Surge];
        let own = plant.parameters.quadratic_drag.as_ref().expect("fitted");
        assert!(plant.parameters.linear_drag.is_none());
        let force = plant.drag_at(0.5);
        for (found, expected) in [(force.low95, own.low95), (force.high95, own.high95)] {
            assert!((found - 0.25 * expected).abs() < 1e-9 * expected.abs(), "{force:?} {own:?}");
        }
        let usual = Estimate::new(force.value, force.std, 1e9);
        assert!(force.high95 - usual.high95 > 1e-3 * force.std, "the normal quantile is as good");
        // Results of other programs may state a mass as known for sure.
        let mut known = plant.clone();
        (known.parameters.mass.std, known.parameters.mass.low95) =
            (0.0, known.parameters.mass.value);
        known.parameters.mass.high95 = known.parameters.mass.value;
        assert_eq!(known.drag_at(0.5), force);
    }

    #[test]
    fn greatest_speed_is_without_steady_runs_that_the_plant_is_not_fitted_to() {
        let spec = TwinSpec { dofs: [Dof::Heave].into(), ..TwinSpec::jason2() };
        let results = identified(&spec);
        let greatest = |is_counted: fn(Role) -> bool| {
            let trials = results.trials.iter().filter(|trial| is_counted(trial.role));
            let speeds = trials.filter_map(|trial| trial.axes[&Dof::Heave].speed_max);
            two_digits(speeds.fold(0.0, f64::max))
        };
        let forces = results.drag_forces(Dof::Heave);
        let (fastest, _) = forces.last().expect("it drags");
        assert_eq!(*fastest, greatest(|role| role != Role::Steady));
        assert!(greatest(|role| role == Role::Steady) > 1.5 * fastest);
    }
}
