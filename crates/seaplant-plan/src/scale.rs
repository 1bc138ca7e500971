//! Goals as combinations of a plant's coefficients.

use nalgebra::DMatrix;
use seaplant::Dof;
use seaplant::estimate::PRECISION;
use seaplant::plant::{Basis, Plant, Product};
use seaplant_control::Actuators;

use crate::Error;
use crate::allocate::Target;
use crate::goal::{DEGREES, Goal, HALF_95, Width};
use crate::request::Request;
use crate::rig::Rig;

/// Plants, speeds and thrust that turn goals into combinations of coefficients.
pub(crate) struct Scale<'a> {
    pub(crate) plants: &'a [Plant],
    pub(crate) rig: &'a Rig,
    /// Limits, mission and controller.
    pub(crate) request: &'a Request,
    /// Lag and delay of thrust, for margins.
    pub(crate) actuators: Actuators,
    /// Relative standard deviation of the scale of thrust, which motion alone cannot reduce.
    pub(crate) thrust_part: f64,
    /// The count of fitted numbers in addition to coefficients …
    pub(crate) more: usize,
    /// … of which the last is the logarithm of the scale of thrust, if a weight determines it.
    pub(crate) has_scale: bool,
}

/// Combinations of the coefficients of a plant, whose variances add up.
pub(crate) struct Combination {
    /// Their weights, shape (p, r).
    pub(crate) weights: DMatrix<f64>,
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
fn floor(plant: &Plant, weights: &DMatrix<f64>) -> f64 {
    let parts = plant.coefficients().iter().zip(weights.row_iter());
    parts.map(|(value, row)| row.norm_squared() * (PRECISION * value).powi(2)).sum()
}

impl Scale<'_> {
    /// Returns the default goals: velocity on the mission and margins of the controller, or else mass
    /// and drag, of every axis with thrust.
    pub(crate) fn usual(&self) -> Vec<Goal> {
        let goal = |what: &str, dof: Dof, width| Goal { name: format!("{what}.{dof}"), width };
        let driven = self.request.mission.iter().flat_map(|mission| mission.force.keys());
        let mut goals: Vec<Goal> =
            driven.map(|dof| goal("mission", *dof, Width::Part(MISSION_PART))).collect();
        if self.request.controller.is_some() {
            let of = |dof| goal("margin", dof, Width::Amount(MARGIN_DEG));
            goals.extend(self.rig.pushed().map(of));
        }
        if self.has_scale {
            goals.push(Goal { name: SCALE.to_owned(), width: Width::Part(SCALE_PART) });
        }
        if goals.iter().any(|goal| goal.name != SCALE) {
            return goals;
        }
        let of = |dof: Dof| {
            [("mass", MASS_PART), ("drag", DRAG_PART)]
                .map(|(what, part)| goal(what, dof, Width::Part(part)))
        };
        goals.extend(self.rig.pushed().flat_map(of));
        goals
    }

    /// Returns the combination of coefficients of the believed plant, and that of all plants whose
    /// interval the minutes reduce.
    pub(crate) fn target(&self, goal: &Goal) -> Result<(Combination, Target), Error> {
        let refuse = |reason: String| Error::Goal { text: goal.name.clone(), reason };
        let believed = self.combination(&self.plants[0], &goal.name)?;
        if let (Some(axis), Some(controller)) =
            (goal.name.strip_prefix("margin."), &self.request.controller)
        {
            let checked = controller.check(&self.plants[0], &self.actuators, axis.parse()?);
            checked.map_err(|error| refuse(error.to_string()))?;
        }
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
        if believed.weights.amax() == 0.0 {
            return Err(refuse("does not depend on any coefficient of the plant".to_owned()));
        }
        let others = self.plants[1..].iter().map(|plant| {
            let own = self.combination(plant, &goal.name)?;
            // For a relative goal, each plant's own value is used.
            let by = match goal.width {
                Width::Part(_) if own.value != 0.0 => (believed.value / own.value).abs(),
                _ => 1.0,
            };
            Ok(own.weights * by)
        });
        let first = std::iter::once(Ok(believed.weights.clone()));
        let weights = first.chain(others).collect::<Result<_, Error>>()?;
        Ok((believed, Target { weights, std: left.sqrt() }))
    }

    pub(crate) fn combination(&self, plant: &Plant, name: &str) -> Result<Combination, Error> {
        let structure = plant.structure();
        let size = structure.terms().len() + self.more;
        let refuse = |reason: String| Error::Goal { text: name.to_owned(), reason };
        if name == SCALE {
            if !self.has_scale {
                return Err(refuse("needs a known weight: --weight 20,2.5 (N in water and kg), or [weight] in the request".to_owned()));
            }
            let weights = DMatrix::from_fn(size, 1, |k, _| f64::from(u8::from(k + 1 == size)));
            let unit = "of the curves".to_owned();
            return Ok(Combination { floor: 0.0, weights, value: 1.0, unit, scales: false });
        }
        let of_axis = name.split_once('.').filter(|(what, _)| OF_AXIS.contains(what));
        let Some((what, axis)) = of_axis else {
            let known = || structure.names().join(", ");
            let term = structure.term_named(name).ok_or_else(|| {
                refuse(format!(
                    "the plant has no such coefficient; it has {}, and {}",
                    known(),
                    OF_AXIS.map(|what| format!("{what}.AXIS")).join(", ")
                ))
            })?;
            let k = structure.index_of(&term).unwrap_or(0);
            let weights = DMatrix::from_fn(size, 1, |i, _| f64::from(u8::from(i == k)));
            return Ok(Combination {
                floor: floor(plant, &weights),
                weights,
                value: plant.coefficients()[k],
                unit: structure.unit_of(&term),
                scales: true,
            });
        };
        let dof: Dof = axis.parse()?;
        if let "mission" | "margin" = what {
            let (found, unit) = match what {
                "mission" => (self.on_mission(plant, dof), dof.units().velocity),
                _ => (self.margin(plant, dof), DEGREES),
            };
            let (value, weights) = found.map_err(refuse)?;
            let (unit, weights) = (unit.to_owned(), weights.resize_vertically(size, 0.0));
            let floor = floor(plant, &weights);
            // Thrust, mass and drag that are off by one factor move and are controlled alike.
            return Ok(Combination { floor, weights, value, unit, scales: false });
        }
        let place = |product| structure.index_of(&Basis::Product(dof, product));
        let (linear, quadratic) = (place(Product::linear(dof)), place(Product::quadratic(dof)));
        let (Some(linear), Some(quadratic)) = (linear, quadratic) else {
            return Err(refuse(format!("the plant has no drag of its own in {dof}")));
        };
        let [d_l, d_q] = [linear, quadratic].map(|k| plant.coefficients()[k]);
        let along = |v: f64| {
            DMatrix::from_fn(size, 1, |k, _| match k {
                _ if k == linear => v,
                _ if k == quadratic => v * v,
                _ => 0.0,
            })
        };
        if what == "drag" {
            let limits = &self.request.limits;
            let most = if dof.is_rotation() { limits.rate_rad_s } else { limits.speed_m_s };
            let v = DRAG_AT * most;
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

    /// Returns the root mean square of an axis's velocity on the mission, and the weights of its error.
    fn on_mission(&self, plant: &Plant, dof: Dof) -> Result<(f64, DMatrix<f64>), String> {
        let Some(mission) = &self.request.mission else {
            return Err("needs a mission: a table of forces (--mission FILE.csv), or [mission] in the request".to_owned());
        };
        let axes = plant.axes();
        if let Some(dof) = mission.force.keys().chain([&dof]).find(|dof| !axes.contains(dof)) {
            return Err(format!("the plant has no {dof}; it has {}", listed(axes)));
        }
        mission.weights(plant, dof).map_err(|error| format!("on the mission, {error}"))
    }

    /// Returns the phase margin of an axis, and the weights of its error.
    fn margin(&self, plant: &Plant, dof: Dof) -> Result<(f64, DMatrix<f64>), String> {
        let Some(controller) = &self.request.controller else {
            return Err("needs a controller: its bandwidth (--bandwidth 0.1), or [controller] in the request".to_owned());
        };
        controller.weights(plant, &self.actuators, dof).map_err(|error| error.to_string())
    }
}

/// Lists axes with commas.
fn listed(axes: &[Dof]) -> String {
    axes.iter().map(|dof| dof.name()).collect::<Vec<_>>().join(", ")
}

/// Fraction of the greatest speed that limits and thrust allow at which drag is evaluated.
const DRAG_AT: f64 = 0.7;
/// Goals of an axis that are not coefficients.
const OF_AXIS: [&str; 4] = ["drag", "speed", "mission", "margin"];
/// The goal of the scale of thrust.
pub(crate) const SCALE: &str = "thrust.scale";
/// Default goals: half of a 95 % interval, relative to velocity, mass and drag, and in degrees.
const MISSION_PART: f64 = 0.05;
const MARGIN_DEG: f64 = 5.0;
const SCALE_PART: f64 = 0.05;
const MASS_PART: f64 = 0.05;
const DRAG_PART: f64 = 0.10;
