//! Consequences of a plant: top speeds, time constants, stopping distances, natural periods.

use std::collections::BTreeMap;

use nalgebra::Matrix6;

use super::draws::band;
use super::{Consequence, Draws, PlantModel};
use crate::plant::{Basis, Plant, Product};
use crate::{Dof, Error, PhysicalParameters};

impl PlantModel {
    /// Computes top speed, time constant there and stopping distance for a force on each axis, the
    /// terminal speed of free ascent or descent, and the natural periods of roll and pitch.
    ///
    /// Each axis is considered alone: `τ = d_Q v|v| + d_L v + b` with all others at rest. The
    /// period is `2π √(1/(M⁻¹)ᵢᵢ / lever)`, other axes free to move and damping neglected. `force`
    /// has N and N m by axis; intervals are those of draws.
    ///
    /// # Errors
    /// As [`PlantModel::draws`].
    pub fn consequences(
        &self,
        force: &BTreeMap<Dof, f64>,
        draws: Draws,
    ) -> Result<Vec<Consequence>, Error> {
        let drawn: Vec<Vec<Number>> =
            self.draws(draws)?.iter().map(|plant| numbers(plant, force)).collect();
        let all = numbers(&self.plant, force).into_iter().map(|number| {
            let same = |run: &Vec<Number>| {
                run.iter().find(|x| x.name == number.name && x.axis == number.axis).map(|x| x.value)
            };
            let values: Vec<f64> = drawn.iter().filter_map(same).collect();
            // Draws without the number leave the interval open.
            let is_known = !drawn.is_empty() && values.len() == drawn.len();
            Consequence {
                interval95: is_known.then(|| band(values)),
                name: number.name,
                axis: number.axis,
                value: number.value,
                unit: number.unit.to_owned(),
            }
        });
        Ok(all.collect())
    }
}

impl PlantModel {
    /// Returns the parameters of `τ = m v̇ + d_Q v|v| + d_L v + b` of one axis with all others at
    /// rest, level; `None` for an axis outside the plant.
    pub fn one_axis(&self, dof: Dof) -> Option<PhysicalParameters> {
        self.plant.axes().contains(&dof).then(|| one_axis_of(&self.plant, dof))
    }
}

fn one_axis_of(plant: &Plant, dof: Dof) -> PhysicalParameters {
    let value = |basis: Basis| plant.coefficient(&basis).unwrap_or(0.0);
    let excess = if dof == Dof::Heave { value(Basis::WeightExcess) } else { 0.0 };
    PhysicalParameters {
        mass: value(Basis::Mass(dof, dof)),
        d_quadratic: value(Basis::Product(dof, Product::quadratic(dof))),
        d_linear: value(Basis::Product(dof, Product::linear(dof))),
        bias_force: value(Basis::One(dof)) - excess,
    }
}

struct Number {
    name: String,
    axis: Dof,
    value: f64,
    unit: &'static str,
}

fn numbers(plant: &Plant, force: &BTreeMap<Dof, f64>) -> Vec<Number> {
    let mut all = Vec::new();
    for &dof in plant.axes() {
        let axis = Axis::new(plant, dof);
        if let Some(&tau) = force.get(&dof) {
            driven(&axis, tau, &mut all);
        }
        if dof == Dof::Heave {
            free(&axis, &mut all);
        }
    }
    periods(plant, &mut all);
    all
}

/// One axis alone.
struct Axis {
    dof: Dof,
    mass: f64,
    quadratic: f64,
    linear: f64,
    /// On the left side: thrust less this moves the axis.
    bias: f64,
}

impl Axis {
    fn new(plant: &Plant, dof: Dof) -> Self {
        let PhysicalParameters { mass, d_quadratic, d_linear, bias_force } =
            one_axis_of(plant, dof);
        Self { dof, mass, quadratic: d_quadratic, linear: d_linear, bias: bias_force }
    }

    /// Returns the speed at which damping balances a force; `None` without damping.
    fn speed(&self, force: f64) -> Option<f64> {
        let (d, l, f) = (self.quadratic, self.linear, force.abs());
        let speed = if d > 0.0 { ((l * l + 4.0 * d * f).sqrt() - l) / (2.0 * d) } else { f / l };
        (speed.is_finite() && speed > 0.0).then(|| speed.copysign(force))
    }

    /// Returns the distance without force from a speed to a tenth of it.
    fn distance(&self, speed: f64) -> Option<f64> {
        let (d, l, v) = (self.quadratic, self.linear, speed.abs());
        let way = if d > 0.0 {
            self.mass / d * ((d * v + l) / (0.1 * d * v + l)).ln()
        } else {
            0.9 * self.mass * v / l
        };
        way.is_finite().then_some(way)
    }
}

/// Rounds a force to four digits for its name.
fn four_digits(x: f64) -> f64 {
    let scale = 10_f64.powf(3.0 - x.abs().log10().floor());
    if scale.is_finite() && scale > 0.0 { (x * scale).round() / scale } else { x }
}

fn driven(axis: &Axis, tau: f64, all: &mut Vec<Number>) {
    let units = axis.dof.units();
    let Some(speed) = axis.speed(tau - axis.bias) else { return };
    let at = format!("{} {}", four_digits(tau), units.force);
    let constant = axis.mass / (axis.linear + 2.0 * axis.quadratic * speed.abs());
    let mut push = |name: String, value: f64, unit: &'static str| {
        all.push(Number { name, axis: axis.dof, value, unit });
    };
    push(format!("top speed at {at}"), speed, units.velocity);
    push(format!("time constant at {at}"), constant, "s");
    if let Some(way) = axis.distance(speed) {
        push(
            format!("stopping distance from the top speed at {at} (to a tenth)"),
            way,
            units.position,
        );
    }
}

fn free(axis: &Axis, all: &mut Vec<Number>) {
    if let Some(speed) = axis.speed(-axis.bias) {
        let name = "speed without thrust (down positive)".to_owned();
        all.push(Number { name, axis: axis.dof, value: speed, unit: axis.dof.units().velocity });
    }
}

fn periods(plant: &Plant, all: &mut Vec<Number>) {
    let Some(lever) = plant.coefficient(&Basis::Lever(2)).filter(|lever| *lever > 0.0) else {
        return;
    };
    let Some(inverse) = plant.mass_matrix().try_inverse() else { return };
    let mut six = Matrix6::zeros();
    for (k, i) in plant.axes().iter().enumerate() {
        six[(i.index(), i.index())] = inverse[(k, k)];
    }
    for dof in [Dof::Roll, Dof::Pitch] {
        let mobility = six[(dof.index(), dof.index())];
        if mobility > 0.0 {
            let value = std::f64::consts::TAU / (mobility * lever).sqrt();
            all.push(Number { name: "natural period".to_owned(), axis: dof, value, unit: "s" });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::PlantFile;

    fn model(coefficients: serde_json::Value) -> PlantModel {
        let file: PlantFile = serde_json::from_value(serde_json::json!({
            "schema": "seaplant/plant/1", "name": "sled", "source": "worked by hand",
            "axes": ["surge"], "coefficients": coefficients
        }))
        .expect("a table");
        file.model().expect("possible")
    }

    #[test]
    fn consequences_agree_with_closed_forms() {
        let model = model(serde_json::json!({
            "mass.surge": { "value": 100.0, "std": 1.0 },
            "surge: |u|u": { "value": 20.0, "std": 1.0 },
            "mass.heave": { "value": 100.0, "std": 1.0 },
            "heave: w": { "value": 10.0, "std": 0.1 },
            "mass.roll": { "value": 4.0, "std": 0.1 },
            "weight-minus-buoyancy": { "value": -5.0, "std": 0.1 },
            "lever.z": { "value": 16.0, "std": 0.1 },
        }));
        let force = BTreeMap::from([(Dof::Surge, 80.0)]);
        let all = model.consequences(&force, Draws::default()).expect("known");
        let named = |name: &str| all.iter().find(|x| x.name.starts_with(name)).expect(name);
        assert!((named("top speed").value - 2.0).abs() < 1e-12);
        assert!((named("time constant").value - 1.25).abs() < 1e-12);
        assert!((named("stopping").value - 5.0 * 10.0_f64.ln()).abs() < 1e-12);
        // It rises.
        assert!((named("speed without thrust").value + 0.5).abs() < 1e-12);
        assert!((named("natural period").value - std::f64::consts::PI).abs() < 1e-12);
        let [low, high] = named("top speed").interval95.expect("drawn");
        assert!(low < 1.93 && low > 1.86 && high > 2.07 && high < 2.2, "{low} {high}");
    }

    #[test]
    fn draws_are_possible_and_reproducible() {
        let model = model(serde_json::json!({
            "mass.surge": { "value": 100.0, "std": 30.0 },
            "surge: |u|u": { "value": 1.0, "std": 20.0 },
        }));
        let draws = Draws { count: 300, seed: 4 };
        let plants = model.draws(draws).expect("some are possible");
        assert_eq!(plants, model.draws(draws).expect("again"));
        assert!(plants.iter().all(|plant| plant.coefficients().iter().all(|x| *x >= 0.0)));
    }
}
