//! Export of plants to simulators, controllers and other users.
//!
//! [`PlantModel`] holds a [`Plant`] of any set of axes with the data for its use elsewhere:
//! uncertainty of each coefficient, the rigid body, thrusters with their curves, lag and delay, the
//! source of the numbers, and reasons against their use. It is created from results
//! ([`PlantModel::of_results`]) or from a published table ([`PlantFile`]).

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
pub(crate) use actuate::{GRID_S, after};
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
use crate::{Caveat, Dof, SteeringGear, Thruster};

/// A plant with the data that a simulator or a controller needs.
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
    /// Name of the vehicle.
    pub name: String,
    /// The equation of motion; axes outside it are unknown.
    pub plant: Plant,
    /// Covariance of its coefficients, shape (p, p); `None` for a published table without errors.
    pub covariance: Option<DMatrix<f64>>,
    /// 95 % intervals by coefficient, if they differ from the symmetric ones of the covariance.
    pub intervals: BTreeMap<String, [f64; 2]>,
    /// The rigid body, if known.
    pub rigid_body: Option<RigidBody>,
    /// Mass in air, kg, if the rest of the rigid body is unknown.
    pub dry_mass_kg: Option<f64>,
    /// Length, width and height of the hull, m.
    pub size_m: Option<[f64; 3]>,
    /// Displacement and centre of buoyancy, if known.
    pub buoyancy: Option<Buoyancy>,
    /// Thrusters with known curves.
    pub thrusters: Vec<Thruster>,
    /// Largest shaft speed, rpm, if a table states it.
    pub max_rpm: Option<f64>,
    /// The actuator model by axis.
    pub actuation: BTreeMap<Dof, Actuation>,
    /// Range of motion and force in the trials, by axis; empty for published tables.
    pub driven: BTreeMap<Dof, Driven>,
    /// Disturbances by axis, if the filter error method estimated them.
    pub disturbances: BTreeMap<Dof, Disturbance>,
    /// Source of the numbers.
    pub origin: Origin,
    /// The verdict on each part of the plant; empty for published tables.
    pub judgements: Vec<Judgement>,
    /// Notes to the user, including parts of the results that are left out.
    pub notes: Vec<String>,
}

/// The fitted actuator model between a thruster's input and its force in the water.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Actuation {
    /// First-order lag of propeller speed, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lag: Option<Parameter>,
    /// Lags of single thrusters that have another, s, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub lag_of: BTreeMap<String, Parameter>,
    /// First-order lag of the force itself, s: for a logged wrench instead of thrusters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_lag: Option<Parameter>,
    /// Delay, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay: Option<Parameter>,
    /// Ratio of reverse thrust to that of the curve.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reverse_ratio: Option<Parameter>,
    /// Exponent of thrust over supply voltage, for thrusters that take a command or a pulse width and whose curves
    /// do not depend on voltage: simulations with a supply voltage have it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voltage_exponent: Option<Parameter>,
    /// Supply voltage at which curves hold that do not state their own, V.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mean_voltage: Option<Parameter>,
    /// Thrust over what curves and logs said where the plant was fitted, as known forces show: curves of
    /// thrusters have it, a logged wrench has not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thrust_scale: Option<Parameter>,
    /// Delay of rudders and fins after their orders, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering_delay: Option<Parameter>,
    /// The greatest rate of rudders and fins that follow their orders, rad/s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub steering_rate: Option<Parameter>,
}

/// Source of a plant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    /// The file, article or table.
    pub source: String,
    /// Its address.
    pub url: Option<String>,
    /// Its licence, if it is published.
    pub licence: Option<String>,
    /// The command that identified it.
    pub command: Option<String>,
    /// Version of Seaplant that identified it.
    pub version: Option<String>,
    /// The effective settings.
    pub settings: BTreeMap<String, String>,
}

/// The verdict on a part of a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Its axes.
    pub axes: Vec<Dof>,
    /// The method of identification.
    pub method: String,
    /// The verdict; for a plant of several axes that of its caveats.
    pub verdict: Verdict,
    /// Its caveats.
    pub caveats: Vec<Caveat>,
}

impl Actuation {
    /// Returns the first-order lag of a thruster's propeller speed, s: its own, otherwise that of all; 0 if none is
    /// known.
    pub fn lag_s(&self, thruster: &str) -> f64 {
        let known = self.lag_of.get(thruster).or(self.lag.as_ref());
        known.map_or(0.0, |lag| lag.value.max(0.0))
    }

    /// Returns the gear of rudders and fins.
    pub fn steering_gear(&self) -> SteeringGear {
        let value = |number: &Option<Parameter>| number.as_ref().map(|number| number.value);
        SteeringGear::new(value(&self.steering_delay), value(&self.steering_rate))
    }
}

impl PlantModel {
    /// Returns the mean first-order lag of the thrusters along an axis, each by its lever, s; that of the force where
    /// it has one, and 0 if none is known.
    pub fn lag_along(&self, dof: Dof) -> f64 {
        let Some(actuation) = self.actuation.get(&dof) else { return 0.0 };
        let lever = |own: &Thruster| own.unit_wrench()[dof.index()].abs();
        let all = self.thrusters.iter().map(|own| (lever(own), actuation.lag_s(&own.name)));
        let (levers, lags) =
            all.fold((0.0, 0.0), |(l, s), (lever, lag)| (l + lever, s + lever * lag));
        let of_all = actuation.lag.as_ref().or(actuation.force_lag.as_ref());
        if levers > 0.0 && actuation.force_lag.is_none() {
            lags / levers
        } else {
            of_all.map_or(0.0, |lag| lag.value.max(0.0))
        }
    }

    /// Returns the axes outside the plant.
    pub fn unknown_axes(&self) -> Vec<Dof> {
        Dof::ALL.into_iter().filter(|dof| !self.plant.axes().contains(dof)).collect()
    }

    /// Returns the standard deviation of a coefficient, if known.
    pub fn std(&self, k: usize) -> Option<f64> {
        self.covariance.as_ref().map(|covariance| covariance[(k, k)].max(0.0).sqrt())
    }

    /// Returns the 95 % interval of a coefficient, if known.
    pub fn interval(&self, k: usize) -> Option<[f64; 2]> {
        let name = self.plant.structure().name_of(&self.plant.structure().terms()[k]);
        let normal = || {
            let (value, std) = (self.plant.coefficients()[k], self.std(k)?);
            Some([value - 1.959_964 * std, value + 1.959_964 * std])
        };
        self.intervals.get(&name).copied().or_else(normal)
    }

    /// Returns weight in air, N: of the rigid body, or of the mass in air.
    pub fn weight(&self) -> Option<f64> {
        let mass = self.rigid_body.as_ref().map(RigidBody::mass_kg).or(self.dry_mass_kg);
        mass.map(|mass| GRAVITY * mass)
    }

    /// Returns W − B, N: fitted, or zero if the plant has no such term.
    pub fn weight_excess(&self) -> f64 {
        self.plant.coefficient(&Basis::WeightExcess).unwrap_or(0.0)
    }

    /// Returns `W r_G − B r_B`, N m; components without a term are zero.
    pub fn lever(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.plant.coefficient(&Basis::Lever(axis)).unwrap_or(0.0))
    }

    /// Formats a message for each linear and quadratic damping of an axis by its own velocity that
    /// is negative, which is unphysical.
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

    /// Returns the reasons not to use parts of the plant, if any.
    pub fn reasons_against(&self) -> Vec<String> {
        let names = |axes: &[Dof]| axes.iter().map(|dof| dof.name()).collect::<Vec<_>>().join("-");
        let bad =
            self.judgements.iter().filter(|j| j.verdict.trust == crate::results::Trust::DoNotUse);
        let judged = bad.map(|j| format!("{}: {}", names(&j.axes), j.verdict.reason));
        judged.chain(self.negative_drag()).collect()
    }
}
