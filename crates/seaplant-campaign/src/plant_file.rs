//! Plants of several axes in campaign.toml and vehicle.toml.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use seaplant::plant::{Basis, Buoyancy, HullModel, RigidBody, Symmetry};
use seaplant::results::RigidBodyResult;
use seaplant::{Dof, PlantPlan, Vehicle, VehicleEffect, axes_by_name, schema_of_axes};
use serde::{Deserialize, Serialize};

use crate::Error;

/// A plant of several axes: `[[plant]]` in campaign.toml.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlantEntry {
    /// Its axes: surge, sway, heave, roll, pitch, yaw; or `six`, `planar` (surge, sway, yaw) or
    /// `vertical` (surge, heave, pitch).
    #[serde(deserialize_with = "axes_by_name")]
    #[schemars(schema_with = "schema_of_axes")]
    pub axes: Vec<Dof>,
    /// The axes that the mass matrix may couple: `port-starboard` (the default), `none` for all, or
    /// `diagonal` for no two.
    #[serde(default)]
    pub symmetry: Symmetry,
    /// Hull forces of a ship in place of the usual damping: `mmg`, `abkowitz` or `modulus`; those
    /// of second order and more are tried, and kept where the trials support them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<HullModel>,
    /// Terms in addition to the usual ones, such as \"yaw: |v|r\" or \"sway: vvr/U\"; u v w p q r,
    /// U, positive on the side of damping. Also effects of the vehicle by name, such as
    /// \"wind.sway\" or \"propeller.advance\".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<String>,
    /// Known coefficients by name, which are not fitted: `{ "mass.surge" = 260 }`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub hold: BTreeMap<String, f64>,
    /// True if damping of one axis by another, and constant forces, are added where the trials
    /// support them.
    #[serde(default = "yes", skip_serializing_if = "Clone::clone")]
    pub find_couplings: bool,
}

const fn yes() -> bool {
    true
}

/// Known properties of a vehicle in air: `[rigid_body]` in vehicle.toml.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RigidBodyEntry {
    /// Mass in air, kg; `dry_mass_kg` if it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// Centre of gravity from the vehicle's origin, m.
    pub centre_of_gravity_m: [f64; 3],
    /// Inertia about the centre of gravity, kg m²; products of inertia are given twice.
    pub inertia_kg_m2: [[f64; 3]; 3],
}

/// Buoyancy: `[buoyancy]` in vehicle.toml.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BuoyancyEntry {
    /// Mass of the displaced water, kg.
    pub displaced_kg: f64,
    /// Centre of buoyancy from the vehicle's origin, m.
    pub centre_m: [f64; 3],
}

impl PlantEntry {
    /// Converts a plan to its form in a campaign file.
    pub(crate) fn from_plan(plan: &PlantPlan) -> Self {
        let terms = plan.terms.iter().map(ToString::to_string).chain(plan.effects.iter().cloned());
        Self {
            axes: plan.axes.clone(),
            symmetry: plan.symmetry,
            model: plan.model,
            terms: terms.collect(),
            hold: plan.hold.clone(),
            find_couplings: plan.search,
        }
    }

    /// Returns the axis of a plant that is equivalent to `dof` in a trial: one axis without terms,
    /// held coefficients or effects of the vehicle.
    ///
    /// Roll and pitch are left out: their restoring moment is a term.
    pub(crate) fn only_axis(&self, vehicle: &Vehicle) -> Option<Dof> {
        let [dof @ (Dof::Surge | Dof::Sway | Dof::Heave | Dof::Yaw)] = self.axes[..] else {
            return None;
        };
        let is_plain = self.model.is_none() && self.terms.is_empty() && self.hold.is_empty();
        let acts = |one: &VehicleEffect| one.is_usual && one.effect.axes().contains(&dof);
        let has_effect = || vehicle.windage.is_some() || vehicle.effects().iter().any(acts);
        (is_plain && !has_effect()).then_some(dof)
    }

    /// Returns the requested plant; messages call the file `path`.
    pub(crate) fn plan(&self, path: &Path) -> Result<PlantPlan, Error> {
        let refuse = |key: &str, error: seaplant::Error| Error::value(path, key, error.to_string());
        let (mut terms, mut effects): (Vec<Basis>, Vec<String>) = Default::default();
        for text in &self.terms {
            match text.contains(':') {
                true => terms.push(text.parse().map_err(|error| refuse("terms", error))?),
                false => effects.push(text.clone()),
            }
        }
        let plan = PlantPlan {
            axes: self.axes.clone(),
            symmetry: self.symmetry,
            model: self.model,
            terms,
            effects,
            hold: self.hold.clone(),
            search: self.find_couplings,
        };
        Ok(plan)
    }
}

/// Rejects plants that the vehicle cannot have; messages call the file `path`.
///
/// # Errors
/// [`Error::Value`] with what is wrong.
pub(crate) fn check_plans(
    path: &Path,
    plans: &[PlantPlan],
    vehicle: &Vehicle,
) -> Result<(), Error> {
    for plan in plans {
        let checked = plan.structure(vehicle, |_| true);
        checked.map_err(|error| Error::value(path, "plant", error.to_string()))?;
    }
    Ok(())
}

/// Returns the axes of each plant of several axes.
pub(crate) fn axes_of_plans(plans: &[PlantPlan]) -> Vec<Vec<Dof>> {
    plans.iter().map(|plan| plan.axes.clone()).collect()
}

/// Returns all plants that a campaign requests.
pub(crate) fn plans(path: &Path, entries: &[PlantEntry]) -> Result<Vec<PlantPlan>, Error> {
    let plans = entries.iter().map(|entry| entry.plan(path)).collect::<Result<Vec<_>, _>>()?;
    let mut axes: Vec<Dof> = plans.iter().flat_map(|plan| plan.axes.clone()).collect();
    axes.sort();
    if let Some(pair) = axes.windows(2).find(|pair| pair[0] == pair[1]) {
        let reason = format!("{} is an axis of two plants; give it to one", pair[0]);
        return Err(Error::value(path, "plant", reason));
    }
    Ok(plans)
}

impl RigidBodyEntry {
    /// Converts a body to its form in a vehicle file.
    pub(crate) fn from_body(body: &RigidBody) -> Self {
        let RigidBodyResult { mass_kg, centre_of_gravity_m, inertia_kg_m2 } =
            RigidBodyResult::of(body);
        Self { mass_kg: Some(mass_kg), centre_of_gravity_m, inertia_kg_m2 }
    }

    /// Returns the rigid body, with the mass in air if it states none of its own.
    pub(crate) fn body(&self, path: &Path, dry_mass_kg: Option<f64>) -> Result<RigidBody, Error> {
        let mass_kg = self.mass_kg.or(dry_mass_kg).ok_or_else(|| {
            let reason = "states no mass; add mass_kg, or dry_mass_kg above";
            Error::value(path, "rigid_body", reason)
        })?;
        RigidBody::new(mass_kg, self.centre_of_gravity_m, self.inertia_kg_m2)
            .map_err(|error| Error::value(path, "rigid_body", error.to_string()))
    }
}

impl BuoyancyEntry {
    pub(crate) fn buoyancy(&self, path: &Path) -> Result<Buoyancy, Error> {
        Buoyancy::new(self.displaced_kg, self.centre_m)
            .map_err(|error| Error::value(path, "buoyancy", error.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(axes: &[Dof], terms: &[&str]) -> PlantEntry {
        PlantEntry {
            axes: axes.to_vec(),
            symmetry: Symmetry::default(),
            model: None,
            terms: terms.iter().map(ToString::to_string).collect(),
            find_couplings: true,
            hold: BTreeMap::new(),
        }
    }

    fn error(entries: &[PlantEntry]) -> String {
        plans(Path::new("campaign.toml"), entries).expect_err("wrong").to_string()
    }

    #[test]
    fn a_term_that_cannot_be_read_shows_its_place() {
        let message = error(&[entry(&[Dof::Sway, Dof::Yaw], &["yaw: v|x|"])]);
        assert!(
            message.contains("campaign.toml: terms") && message.contains("character 8"),
            "{message}"
        );
    }

    #[test]
    fn axes_go_by_the_name_of_a_set() {
        let read = |text: &str| toml::from_str::<PlantEntry>(text);
        let axes = |text: &str| read(text).expect("axes").axes;
        assert_eq!(axes("axes = \"six\""), Dof::ALL);
        assert_eq!(axes("axes = \"vertical\""), [Dof::Surge, Dof::Heave, Dof::Pitch]);
        assert_eq!(axes("axes = [\"yaw\", \"sway\"]"), [Dof::Yaw, Dof::Sway]);
        let refused = |text: &str| read(text).expect_err("no axes").to_string();
        let message = refused("axes = \"sixx\"");
        assert!(message.contains("sixx") && message.contains("\"planar\""), "{message}");
        assert!(refused("axes = [\"yaw\", \"yaw\"]").contains("yaw stands twice"));
    }

    #[test]
    fn an_axis_belongs_to_one_plant() {
        let message = error(&[entry(&[Dof::Sway, Dof::Yaw], &[]), entry(&[Dof::Yaw], &[])]);
        assert!(message.contains("yaw is an axis of two plants"), "{message}");
    }

    #[test]
    fn a_rigid_body_that_cannot_be_is_refused_by_its_key() {
        let entry = RigidBodyEntry {
            mass_kg: None,
            centre_of_gravity_m: [0.0; 3],
            inertia_kg_m2: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 5.0]],
        };
        let path = Path::new("vehicle.toml");
        let message = entry.body(path, Some(10.0)).expect_err("impossible").to_string();
        assert!(
            message.contains("rigid_body") && message.contains("sum of the others"),
            "{message}"
        );
        assert!(entry.body(path, None).expect_err("no mass").to_string().contains("mass_kg"));
    }
}
