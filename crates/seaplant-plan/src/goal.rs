//! Goals of a trial: intervals of coefficients, drag, steady speed.

use nalgebra::DVector;
use schemars::JsonSchema;
use seaplant::Dof;
use seaplant::estimate::PRECISION;
use seaplant::plant::{Basis, Plant, Product};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::allocate::Target;
use crate::rig::Rig;

/// A half-width of a 95 % interval in standard deviations.
pub(crate) const HALF_95: f64 = 1.959_964;

/// Half of the widest 95 % interval that meets a goal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Width {
    /// Half of it, relative to the value.
    Part(f64),
    /// Half of it, in SI units.
    Amount(f64),
}

/// A goal: the interval of a coefficient by its name (`mass.surge`, `yaw: |r|r`), the drag of an
/// axis (`drag.surge`), or the steady speed at half of its greatest force (`speed.surge`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Goal {
    /// The coefficient, drag or speed.
    pub name: String,
    /// Its interval.
    pub width: Width,
}

impl std::str::FromStr for Goal {
    type Err = Error;

    /// Reads `mass.surge=5%` or, in SI units, `mass.surge=2.5`.
    fn from_str(text: &str) -> Result<Self, Error> {
        let refuse =
            |reason: &str| Error::Goal { text: text.to_owned(), reason: reason.to_owned() };
        let usage = "write a name, = and half the width of its 95 % interval, as mass.surge=5% or \"surge: |u|u=12\"";
        let Some((name, width)) = text.rsplit_once('=') else { return Err(refuse(usage)) };
        let (name, width) = (name.trim(), width.trim());
        let (number, is_part) = match width.strip_suffix('%') {
            Some(part) => (part.trim(), true),
            None => (width, false),
        };
        let number: f64 = number.parse().map_err(|_| refuse(usage))?;
        if name.is_empty() || !(number > 0.0 && number.is_finite()) {
            return Err(refuse("half the width of an interval is above zero; as mass.surge=5%"));
        }
        let width = if is_part { Width::Part(number / 100.0) } else { Width::Amount(number) };
        Ok(Self { name: name.to_owned(), width })
    }
}

/// Plants, speeds and thrust that turn goals into combinations of coefficients.
pub(crate) struct Scale<'a> {
    pub(crate) plants: &'a [Plant],
    pub(crate) rig: &'a Rig,
    /// Speed and rate at which drag is evaluated, m/s and rad/s.
    pub(crate) speed: (f64, f64),
    /// Relative standard deviation of the scale of thrust, which motion alone cannot reduce.
    pub(crate) thrust_part: f64,
    /// The count of fitted numbers in addition to coefficients.
    pub(crate) more: usize,
}

/// A combination of the coefficients of a plant.
pub(crate) struct Combination {
    /// Its weights, shape (p,).
    pub(crate) weights: DVector<f64>,
    pub(crate) value: f64,
    pub(crate) unit: String,
    /// True if it is proportional to the scale of thrust.
    pub(crate) scales: bool,
    /// The variance floor of a fit however long the trial: `Σ (g_k · PRECISION · θ_k)²`.
    floor: f64,
}

impl Combination {
    /// Returns the variance that no trial reduces: of the scale of thrust, and of a fit's
    /// precision.
    pub(crate) fn irreducible(&self, thrust_part: f64) -> f64 {
        let off = if self.scales { thrust_part * self.value } else { 0.0 };
        off * off + self.floor
    }
}

/// Returns the variance of a combination of a plant's coefficients at the precision floor of fits.
fn floor(plant: &Plant, weights: &DVector<f64>) -> f64 {
    let parts = plant.coefficients().iter().zip(weights.iter());
    parts.map(|(value, weight)| (weight * PRECISION * value).powi(2)).sum()
}

impl Scale<'_> {
    /// Returns the default goals: mass and drag of every axis with thrust.
    pub(crate) fn usual(&self) -> Vec<Goal> {
        let of = |dof: Dof| {
            [("mass", MASS_PART), ("drag", DRAG_PART)].map(|(what, part)| Goal {
                name: format!("{what}.{dof}"),
                width: Width::Part(part),
            })
        };
        self.rig.pushed().flat_map(of).collect()
    }

    /// Returns the combination of coefficients whose interval the minutes reduce.
    pub(crate) fn target(&self, goal: &Goal) -> Result<Target, Error> {
        let refuse = |reason: String| Error::Goal { text: goal.name.clone(), reason };
        let believed = self.combination(&self.plants[0], &goal.name)?;
        let half = match goal.width {
            Width::Amount(half) => half,
            Width::Part(part) => part * believed.value.abs(),
        };
        if half <= 0.0 {
            return Err(refuse(format!(
                "is believed to be zero, so that a part of it is no width; give one in {}",
                believed.unit
            )));
        }
        let irreducible = believed.irreducible(self.thrust_part);
        let left = (half / HALF_95).powi(2) - irreducible;
        if left <= 0.0 {
            let least = 100.0 * HALF_95 * irreducible.sqrt() / believed.value.abs();
            return Err(refuse(match self.thrust_part > 0.0 {
                true => format!(
                    "thrust is known to {:.1} % (a standard deviation), so that no motion narrows the interval below ±{least:.1} %; measure thrust, or ask for less",
                    100.0 * self.thrust_part
                ),
                false => format!("no log narrows the interval below ±{least:.2} %; ask for less"),
            }));
        }
        let weights = |plant: &Plant| {
            let own = self.combination(plant, &goal.name)?;
            // For a relative goal, each plant's own value is used.
            let by = match goal.width {
                Width::Part(_) if own.value != 0.0 => (believed.value / own.value).abs(),
                _ => 1.0,
            };
            Ok(own.weights * by)
        };
        let weights = self.plants.iter().map(weights).collect::<Result<_, Error>>()?;
        Ok(Target { weights, std: left.sqrt() })
    }

    pub(crate) fn combination(&self, plant: &Plant, name: &str) -> Result<Combination, Error> {
        let structure = plant.structure();
        let size = structure.terms().len() + self.more;
        let refuse = |reason: String| Error::Goal { text: name.to_owned(), reason };
        let of_axis = name.split_once('.').filter(|(what, _)| ["drag", "speed"].contains(what));
        let Some((what, axis)) = of_axis else {
            let known = || structure.names().join(", ");
            let term = structure.term_named(name).ok_or_else(|| {
                refuse(format!(
                    "the plant has no such coefficient; it has {}, and drag.AXIS and speed.AXIS",
                    known()
                ))
            })?;
            let k = structure.index_of(&term).unwrap_or(0);
            let weights = DVector::from_fn(size, |i, _| f64::from(u8::from(i == k)));
            return Ok(Combination {
                floor: floor(plant, &weights),
                weights,
                value: plant.coefficients()[k],
                unit: structure.unit_of(&term),
                scales: true,
            });
        };
        let dof: Dof = axis.parse()?;
        let place = |product| structure.index_of(&Basis::Product(dof, product));
        let (linear, quadratic) = (place(Product::linear(dof)), place(Product::quadratic(dof)));
        let (Some(linear), Some(quadratic)) = (linear, quadratic) else {
            return Err(refuse(format!("the plant has no drag of its own in {dof}")));
        };
        let [d_l, d_q] = [linear, quadratic].map(|k| plant.coefficients()[k]);
        let along = |v: f64| {
            DVector::from_fn(size, |k, _| match k {
                _ if k == linear => v,
                _ if k == quadratic => v * v,
                _ => 0.0,
            })
        };
        if what == "drag" {
            let v = if dof.is_rotation() { self.speed.1 } else { self.speed.0 };
            let value = d_l * v + d_q * v * v;
            let unit = dof.units().force.to_owned();
            let (weights, scales) = (along(v), true);
            return Ok(Combination { floor: floor(plant, &weights), weights, value, unit, scales });
        }
        let force = 0.5 * self.rig.most[dof.index()];
        if force <= 0.0 || d_l + d_q <= 0.0 {
            return Err(refuse(format!("thrusters do not push {dof}, or nothing slows it")));
        }
        let root = (d_l * d_l + 4.0 * d_q * force).sqrt();
        let v = 2.0 * force / (d_l + root);
        let unit = dof.units().velocity.to_owned();
        let weights = -along(v) / (d_l + 2.0 * d_q * v);
        Ok(Combination { floor: floor(plant, &weights), weights, value: v, unit, scales: false })
    }
}

/// Default goals: half of a 95 % interval, relative to mass and drag.
const MASS_PART: f64 = 0.05;
const DRAG_PART: f64 = 0.10;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn goals_are_read_with_names_that_hold_signs() {
        let goal: Goal = "surge: |u|u = 12".parse().expect("a goal");
        assert_eq!(goal, Goal { name: "surge: |u|u".to_owned(), width: Width::Amount(12.0) });
        let goal: Goal = "mass.surge=5 %".parse().expect("a goal");
        assert_eq!(goal.width, Width::Part(0.05));
        for wrong in ["mass.surge", "mass.surge=-1%", "=5%", "mass.surge=five"] {
            let error = wrong.parse::<Goal>().expect_err(wrong).to_string();
            assert!(error.contains("mass.surge=5%"), "{error}");
        }
    }
}
