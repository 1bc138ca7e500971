//! Drag as a force over speed, which is determined even if its linear and quadratic parts are not.

use nalgebra::Vector6;

use super::{CoupledPlant, Parameter, PlantResult};
use crate::plant::{Basis, Product};
use crate::{Dof, Estimate};

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
    /// # Ok::<(), seaplant::Error>(())
    /// ```
    pub fn drag_to(&self, greatest: f64) -> Option<DragCurve> {
        let parameters = &self.parameters;
        let parts =
            [(1, parameters.quadratic_drag.as_ref(), 2), (2, parameters.linear_drag.as_ref(), 1)];
        let parts: Vec<(usize, &Parameter, i32)> =
            parts.into_iter().filter_map(|(k, x, power)| Some((k, x?, power))).collect();
        DragCurve::new(greatest, |v| {
            let v_to = |power: i32| v.powi(power);
            let value = parts.iter().map(|(_, x, power)| x.value * v_to(*power)).sum();
            let mut variance = 0.0;
            for (i, x, power) in &parts {
                for (j, y, other) in &parts {
                    let r = if i == j { 1.0 } else { self.correlation[*i][*j] };
                    variance += r * x.std * y.std * v_to(power + other);
                }
            }
            Estimate::new(value, f64::max(variance, 0.0).sqrt(), self.regression.effective_samples)
        })
    }
}

impl CoupledPlant {
    /// Computes the drag of an axis by its own velocity up to a speed; `None` for an axis without
    /// drag.
    pub fn drag_to(&self, dof: Dof, greatest: f64) -> Option<DragCurve> {
        let own = |product: &Product| product.factors().all(|factor| factor.of == dof);
        let part = |(name, x): (&String, _)| match name.parse() {
            Ok(Basis::Product(on, product)) if on == dof && own(&product) => {
                let index = self.correlation.names.iter().position(|known| known == name);
                Some((product, x, index))
            }
            _ => None,
        };
        let parts: Vec<(Product, &super::Coefficient, Option<usize>)> =
            self.parameters.iter().filter_map(part).collect();
        let correlation = |i: Option<usize>, j: Option<usize>| {
            let row = |i: usize| self.correlation.value.get(i);
            i.zip(j).and_then(|(i, j)| row(i)?.get(j).copied()).unwrap_or(0.0)
        };
        DragCurve::new(greatest, |v| {
            let mut velocity = Vector6::zeros();
            velocity[dof.index()] = v;
            let value =
                parts.iter().map(|(product, x, _)| x.value * product.value(&velocity)).sum();
            let mut variance = 0.0;
            for (k, (of, x, i)) in parts.iter().enumerate() {
                for (l, (other, y, j)) in parts.iter().enumerate() {
                    let r = if k == l { 1.0 } else { correlation(*i, *j) };
                    variance += r * x.std * y.std * of.value(&velocity) * other.value(&velocity);
                }
            }
            Estimate::new(value, f64::max(variance, 0.0).sqrt(), self.samples as f64)
        })
    }
}
