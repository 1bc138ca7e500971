//! A plant in the form of rigid-body simulators: a link with mass and inertia, its added mass, and
//! a buoyant volume.

use nalgebra::{Matrix3, Matrix6, Vector3};
use seaplant::Dof;
use seaplant::exchange::PlantModel;
use seaplant::plant::{Basis, GRAVITY, RigidBody};

use crate::Error;
use crate::remarks::{knows, short};

/// The density for which volumes are computed, kg/m³.
pub(crate) const DENSITY: f64 = 1000.0;

/// A rigid body in water; x forward, y starboard, z down.
pub(crate) struct Link {
    pub(crate) mass_kg: f64,
    pub(crate) centre_of_gravity: Vector3<f64>,
    /// About the centre of gravity, kg m².
    pub(crate) inertia: Matrix3<f64>,
    /// M minus that of the link, about the origin; zero at unknown axes.
    pub(crate) added: Matrix6<f64>,
    /// Displaced volume, m³ at [`DENSITY`].
    pub(crate) volume: f64,
    pub(crate) centre_of_buoyancy: Vector3<f64>,
    /// Assumptions made.
    pub(crate) notes: Vec<String>,
}

impl Link {
    /// # Errors
    /// [`Error::Unsuitable`] if nothing tells a mass, or the vehicle has no buoyancy.
    pub(crate) fn from_model(model: &PlantModel, format: &'static str) -> Result<Self, Error> {
        let mut notes = Vec::new();
        let body = match model.rigid_body {
            Some(body) => body,
            None => stand_in(model, format, &mut notes)?,
        };
        let own = model.plant.mass_matrix_of_six();
        let rigid = body.mass_matrix();
        let known = |k: usize| knows(model, Dof::ALL[k]);
        let added =
            Matrix6::from_fn(
                |i, j| {
                    if known(i) && known(j) { own[(i, j)] - rigid[(i, j)] } else { 0.0 }
                },
            );
        let (excess, lever) = restoring(model, &mut notes);
        let weight = GRAVITY * body.mass_kg();
        let buoyancy = weight - excess;
        if buoyancy <= 0.0 {
            let reason = format!(
                "weight minus buoyancy is {} N of a weight of {} N, so that nothing floats; state the mass in air in vehicle.toml",
                short(excess),
                short(weight)
            );
            return Err(Error::Unsuitable { format, reason });
        }
        let unknown: Vec<&str> = model.unknown_axes().iter().map(|dof| dof.name()).collect();
        if !unknown.is_empty() {
            notes.push(format!(
                "the simulator moves all six axes: {} move by the link's own mass, inertia and restoring alone, without added mass and damping, because those are not known; do not trust motion there",
                unknown.join(", ")
            ));
        }
        Ok(Self {
            mass_kg: body.mass_kg(),
            centre_of_gravity: body.centre_of_gravity_body(),
            inertia: body.inertia(),
            added,
            volume: buoyancy / (GRAVITY * DENSITY),
            centre_of_buoyancy: (weight * body.centre_of_gravity_body() - lever) / buoyancy,
            notes,
        })
    }

    /// Returns the sides of a box of the link's volume, shaped like the hull where its size is
    /// known.
    pub(crate) fn sides(&self, model: &PlantModel) -> [f64; 3] {
        let [a, b, c] = model.size_m.unwrap_or([1.0; 3]);
        let scale = (self.volume / (a * b * c)).cbrt();
        [a * scale, b * scale, c * scale]
    }
}

/// Returns a rigid body for a vehicle whose own is unknown: only the sum M matters.
fn stand_in(
    model: &PlantModel,
    format: &'static str,
    notes: &mut Vec<String>,
) -> Result<RigidBody, Error> {
    let mass = model.plant.mass_matrix_of_six();
    let least = |axes: &[Dof]| {
        let known = axes.iter().filter(|dof| knows(model, **dof));
        let values = known.map(|dof| mass[(dof.index(), dof.index())]);
        Some(values.fold(f64::INFINITY, f64::min)).filter(|least| least.is_finite())
    };
    let half = least(&Dof::ALL[..3]).map(|least| 0.5 * least);
    let Some(kg) = model.dry_mass_kg.or(half) else {
        let reason = "its mass is not known; state dry_mass_kg in vehicle.toml".to_owned();
        return Err(Error::Unsuitable { format, reason });
    };
    let told = least(&Dof::ALL[3..]).map(|least| 0.5 * least);
    let sphere = 0.4 * kg * (3.0 * kg / (4.0 * std::f64::consts::PI * DENSITY)).powf(2.0 / 3.0);
    let moment = told.unwrap_or(sphere);
    let source = if model.dry_mass_kg.is_some() {
        "the mass in air"
    } else {
        "half of the least mass that was identified"
    };
    notes.push(format!(
        "CHOSEN, not identified: the link's mass {} kg is {source}, its inertia {} kg m² about each axis is {}, its centre of gravity is the origin, because [rigid_body] is not known; link and added mass together are M as identified",
        short(kg),
        short(moment),
        if told.is_some() { "half of the least that was identified" } else { "that of a sphere of that mass" }
    ));
    let unit = [[moment, 0.0, 0.0], [0.0, moment, 0.0], [0.0, 0.0, moment]];
    RigidBody::new(kg, [0.0; 3], unit)
        .map_err(|error| Error::Unsuitable { format, reason: error.to_string() })
}

/// Returns W − B and `W r_G − B r_B`: fitted, else from the vehicle's description, else zero.
fn restoring(model: &PlantModel, notes: &mut Vec<String>) -> (f64, Vector3<f64>) {
    let described = model.rigid_body.as_ref().zip(model.buoyancy.as_ref());
    let described = described.map(|(body, buoyancy)| buoyancy.restoring(body));
    let fitted = model.plant.coefficient(&Basis::WeightExcess);
    if fitted.is_none() && described.is_none() {
        notes.push("weight minus buoyancy is not known: the link floats neutrally".to_owned());
    }
    let has_lever = (0..3).any(|axis| model.plant.coefficient(&Basis::Lever(axis)).is_some());
    if !has_lever && described.is_none() {
        notes.push(
            "the righting moment is not known: centres of gravity and buoyancy coincide".to_owned(),
        );
    }
    let lever = if has_lever { Some(Vector3::from(model.lever())) } else { None };
    (
        fitted.or(described.map(|(excess, _)| excess)).unwrap_or(0.0),
        lever.or(described.map(|(_, lever)| lever)).unwrap_or_else(Vector3::zeros),
    )
}
