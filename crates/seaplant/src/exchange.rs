//! A plant that leaves the program: for simulators, controllers and other people.
//!
//! [`PlantModel`] holds a [`Plant`] of any set of axes with what is needed to drive it elsewhere:
//! how uncertain each coefficient is, the dry vehicle, thrusters with their curves, lag and delay,
//! where the numbers come from and what speaks against them. It is made of results
//! ([`PlantModel::of_results`]) or of a published table ([`PlantFile`]).

mod actuate;
mod cancel;
mod check;
mod draws;
mod driven;
mod file;
mod follows;
mod limits;
mod manoeuvre;
mod of_results;
mod predict;
mod scenario;

use std::collections::BTreeMap;

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::results::{Consequence, Driven};
pub use actuate::Drive;
pub use check::check_results;
pub use draws::Draws;
pub use driven::Disturbance;
pub use file::{
    Coriolis, Derived, Entries, FileCoefficient, FileRigidBody, FileThruster, PLANT_SCHEMA,
    PlantFile,
};
pub use manoeuvre::{Approach, Manoeuvre, ManoeuvreNumber, SOLAS_RUDDER_RATE};
pub use predict::Prediction;
pub use scenario::{Outcome, Scenario};

use crate::plant::{Basis, Buoyancy, GRAVITY, Plant, Product, RigidBody};
use crate::results::{Parameter, Verdict};
use crate::{Caveat, Dof, Thruster};

/// A plant with what a simulator or a controller needs of it besides.
///
/// ```
/// use seaplant::exchange::{PlantFile, PlantModel};
/// let table: PlantFile = serde_json::from_value(serde_json::json!({
///     "schema": "seaplant/plant/1",
///     "name": "disc",
///     "source": "worked by hand",
///     "axes": ["surge", "sway", "yaw"],
///     "mass_matrix": [40.0, 60.0, 5.0],
///     "quadratic_damping": [30.0, 80.0, 4.0],
/// })).expect("a table");
/// let model: PlantModel = table.model()?;
/// assert_eq!(model.plant.axes().len(), 3);
/// assert_eq!(model.unknown_axes().len(), 3);
/// # Ok::<(), seaplant::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PlantModel {
    /// What the vehicle is called.
    pub name: String,
    /// The equation of motion; axes that it does not have are not known.
    pub plant: Plant,
    /// Covariance of its coefficients, shape (p, p); none of a published table without errors.
    pub covariance: Option<DMatrix<f64>>,
    /// 95 % intervals by coefficient, where they are not the symmetric ones of the covariance.
    pub intervals: BTreeMap<String, [f64; 2]>,
    /// The vehicle dry, where that is known.
    pub rigid_body: Option<RigidBody>,
    /// Its mass in air, kg, where only that is known.
    pub dry_mass_kg: Option<f64>,
    /// Length, width and height of the hull, m.
    pub size_m: Option<[f64; 3]>,
    /// What the water carries, where that is known by itself.
    pub buoyancy: Option<Buoyancy>,
    /// Thrusters, their curves in numbers.
    pub thrusters: Vec<Thruster>,
    /// The greatest speed of their shafts, rpm, where a table states it.
    pub max_rpm: Option<f64>,
    /// What stands between thrust and the water, by axis.
    pub actuation: BTreeMap<Dof, Actuation>,
    /// How far each axis was driven in the trials; empty of published tables.
    pub driven: BTreeMap<Dof, Driven>,
    /// What disturbed each axis there, where the filter error method estimated it.
    pub disturbances: BTreeMap<Dof, Disturbance>,
    /// Where the numbers come from.
    pub origin: Origin,
    /// What to make of each part of the plant; empty of published tables.
    pub judgements: Vec<Judgement>,
    /// What a reader must know beside the numbers, and what of the results is left out here.
    pub notes: Vec<String>,
}

/// What stands between a thruster's input and its force in the water, as it was fitted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Actuation {
    /// First-order lag of propeller speed, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lag: Option<Parameter>,
    /// First-order lag of the force itself, s: of a wrench that was logged in place of thrusters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_lag: Option<Parameter>,
    /// Delay, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay: Option<Parameter>,
    /// Reverse thrust over what the curve says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reverse_ratio: Option<Parameter>,
    /// Thrust over what curves and logs said where the plant was fitted, as known forces show: curves of
    /// thrusters have it, a logged wrench has not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_scale: Option<Parameter>,
}

/// Where a plant comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// The file, article or table.
    pub source: String,
    /// Where it can be read.
    pub url: Option<String>,
    /// Its licence, if it is a published one.
    pub licence: Option<String>,
    /// The command that identified it.
    pub command: Option<String>,
    /// Version of Seaplant that identified it.
    pub version: Option<String>,
    /// The settings in force.
    pub settings: BTreeMap<String, String>,
}

/// What to make of a part of a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Which axes it is of.
    pub axes: Vec<Dof>,
    /// How it was found.
    pub method: String,
    /// The verdict; a plant of several axes has that of its caveats.
    pub verdict: Verdict,
    /// Its doubts.
    pub caveats: Vec<Caveat>,
}

impl PlantModel {
    /// Axes of which nothing is known.
    pub fn unknown_axes(&self) -> Vec<Dof> {
        Dof::ALL.into_iter().filter(|dof| !self.plant.axes().contains(dof)).collect()
    }

    /// The standard deviation of each coefficient, where it is known.
    pub fn std(&self, k: usize) -> Option<f64> {
        self.covariance.as_ref().map(|covariance| covariance[(k, k)].max(0.0).sqrt())
    }

    /// The 95 % interval of a coefficient, where it is known.
    pub fn interval(&self, k: usize) -> Option<[f64; 2]> {
        let name = self.plant.structure().name_of(&self.plant.structure().terms()[k]);
        let normal = || {
            let (value, std) = (self.plant.coefficients()[k], self.std(k)?);
            Some([value - 1.959_964 * std, value + 1.959_964 * std])
        };
        self.intervals.get(&name).copied().or_else(normal)
    }

    /// Weight in air, N: of the rigid body, or of the mass in air alone.
    pub fn weight(&self) -> Option<f64> {
        let mass = self.rigid_body.as_ref().map(RigidBody::mass_kg).or(self.dry_mass_kg);
        mass.map(|mass| GRAVITY * mass)
    }

    /// W − B, N: fitted, or zero where the plant has no such term.
    pub fn weight_excess(&self) -> f64 {
        self.plant.coefficient(&Basis::WeightExcess).unwrap_or(0.0)
    }

    /// `W r_G − B r_B`, N m; components that the plant has no term for are zero.
    pub fn lever(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.plant.coefficient(&Basis::Lever(axis)).unwrap_or(0.0))
    }

    /// Drag that would drive the vehicle: linear and quadratic damping of an axis by its own
    /// velocity that is below zero, in words.
    pub fn negative_drag(&self) -> Vec<String> {
        let own = |dof: &Dof| {
            [("linear", Product::linear(*dof)), ("quadratic", Product::quadratic(*dof))]
                .map(|(name, product)| (*dof, name, Basis::Product(*dof, product)))
        };
        let in_words = |(dof, name, term): (Dof, &str, Basis)| {
            let value = self.plant.coefficient(&term).filter(|value| *value < 0.0)?;
            let unit = self.plant.structure().unit_of(&term);
            Some(format!(
                "{dof}: {name} drag is {value} {unit}, below zero, so that water would drive the vehicle; check its sign, or fit other terms or trials"
            ))
        };
        self.plant.axes().iter().flat_map(own).filter_map(in_words).collect()
    }

    /// The reasons not to use a part of the plant; none of a plant that may be used.
    pub fn reasons_against(&self) -> Vec<String> {
        let names = |axes: &[Dof]| axes.iter().map(|dof| dof.name()).collect::<Vec<_>>().join("-");
        let bad =
            self.judgements.iter().filter(|j| j.verdict.trust == crate::results::Trust::DoNotUse);
        let judged = bad.map(|j| format!("{}: {}", names(&j.axes), j.verdict.reason));
        judged.chain(self.negative_drag()).collect()
    }
}
