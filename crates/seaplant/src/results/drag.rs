//! Drag as a force over speed, which is determined even if its linear and quadratic parts are not.

use nalgebra::Vector6;

use super::{Coefficient, PlantResult, Results, two_digits};
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
    /// Computes the drag of an axis by its own velocity up to a speed; `None` for an axis without
    /// drag, or without its uncertainty.
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
    /// let curve = results.plants["surge"].drag_to(Dof::Surge, 0.5).expect("it drags");
    /// let drag = curve.force.last().expect("a point");
    /// let truth = 2230.9 * 0.5 * 0.5;
    /// assert!(drag.low95 < truth && truth < drag.high95);
    /// let (usual_speed, force) = results.drag_forces(Dof::Surge)[0];
    /// assert!(force.covers(2230.9 * usual_speed * usual_speed));
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn drag_to(&self, dof: Dof, greatest: f64) -> Option<DragCurve> {
        DragCurve::new(greatest, |v| self.drag_at(dof, v))
    }

    /// Computes the drag of an axis by its own velocity at a speed; zero for an axis without drag.
    pub fn drag_at(&self, dof: Dof, speed: f64) -> Estimate {
        let own = |product: &Product| product.factors().all(|factor| factor.of == dof);
        let mut velocity = Vector6::zeros();
        velocity[dof.index()] = speed;
        let parts = self.parameters.iter().filter_map(|(name, x)| match name.parse() {
            Ok(Basis::Product(on, product)) if on == dof && own(&product) => {
                Some((product.value(&velocity), x, name))
            }
            _ => None,
        });
        let parts: Vec<(f64, &Coefficient, &String)> = parts.collect();
        let correlation = |i: &str, j: &str| self.correlation.of(i, j).unwrap_or(0.0);
        let value = parts.iter().map(|(factor, x, _)| x.value * factor).sum();
        let of = |spread: &dyn Fn(&Coefficient) -> f64| {
            let spreads: Vec<f64> = parts.iter().map(|(factor, x, _)| spread(x) * factor).collect();
            combined(&spreads, |i, j| correlation(parts[i].2, parts[j].2))
        };
        // Half intervals add up as standard deviations do, with the quantile that the coefficients have; lower ends
        // may be cut off at zero.
        let half = of(&|x| x.high95 - x.value);
        Estimate { value, std: of(&|x| x.std), low95: value - half, high95: value + half }
    }
}

impl Results {
    /// Computes the drag of an axis by its [preferred](Self::preferred) plant at the
    /// [usual and the greatest speed](Self::usual_and_greatest_speed): speeds, m/s or rad/s, and forces, N or N m.
    ///
    /// Empty where no speed was measured, and of a plant whose drag is not known.
    pub fn drag_forces(&self, dof: Dof) -> Vec<(f64, Estimate)> {
        let Some(plant) = self.preferred(dof) else { return Vec::new() };
        let speeds = self.usual_and_greatest_speed(dof).into_iter();
        let forces = speeds.map(|speed| (speed, plant.drag_at(dof, speed)));
        forces.filter(|(_, force)| force.std > 0.0 && force.std.is_finite()).collect()
    }

    /// Computes the usual speed of an axis in the fitted trials (root mean square) and the greatest of all
    /// trials, m/s or rad/s, each to two digits; one speed if they are equal, none if no speed was measured.
    pub fn usual_and_greatest_speed(&self, dof: Dof) -> Vec<f64> {
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
        speeds
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
        let plant = &results.plants["surge"];
        let own = plant.by_axis[&Dof::Surge].quadratic_drag.as_ref().expect("fitted");
        assert!(plant.by_axis[&Dof::Surge].linear_drag.is_none());
        let force = plant.drag_at(Dof::Surge, 0.5);
        for (found, expected) in [(force.low95, own.low95), (force.high95, own.high95)] {
            assert!((found - 0.25 * expected).abs() < 1e-9 * expected.abs(), "{force:?} {own:?}");
        }
        let usual = Estimate::new(force.value, force.std, 1e9);
        assert!(force.high95 - usual.high95 > 1e-3 * force.std, "the normal quantile is as good");
        // Results of other programs may state a mass as known for sure.
        let mut known = plant.clone();
        let mass = known.parameters.get_mut("mass.surge").expect("fitted");
        (mass.std, mass.low95, mass.high95) = (0.0, mass.value, mass.value);
        assert_eq!(known.drag_at(Dof::Surge, 0.5), force);
    }

    #[test]
    fn drag_of_an_axis_is_that_of_the_plant_of_several_axes() {
        let spec = TwinSpec { dofs: [Dof::Surge].into(), duration_s: 60.0, ..TwinSpec::jason2() };
        let mut results = identified(&spec);
        let (speed, alone) = results.drag_forces(Dof::Surge)[0];
        let mut several = results.plants["surge"].clone();
        several.axes.push(Dof::Sway);
        several.alone = None;
        let drag = Basis::Product(Dof::Surge, Product::quadratic(Dof::Surge)).to_string();
        let drag = several.parameters.get_mut(&drag).expect("fitted");
        drag.value *= 2.0;
        results.plants.insert(several.name(), several);
        assert_eq!(results.preferred(Dof::Surge).map(|plant| plant.axes.len()), Some(2));
        let (of_same_speed, together) = results.drag_forces(Dof::Surge)[0];
        assert_eq!(of_same_speed, speed);
        assert!((together.value - 2.0 * alone.value).abs() < 1e-9 * alone.value);
        assert_eq!(results.drag_forces(Dof::Sway), []);
        assert!(results.preferred(Dof::Heave).is_none());
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
