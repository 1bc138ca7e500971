//! The plant file, `seaplant/plant/1`, in Fossen's notation.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, Matrix6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::cancel::coriolis_products;
use super::of_results::plant_of_terms;
use super::{Actuation, Disturbance, Driven, Origin, PlantModel};
use crate::plant::{Basis, Effect, EffectForce, Product};
use crate::results::{BuoyancyResult, Correlation, CurveResult, Parameter, RigidBodyResult};
use crate::{Dof, Error, Thruster, axes_by_name, schema_of_axes};

/// Name and version of the file format.
pub const PLANT_SCHEMA: &str = "seaplant/plant/1";

/// A plant as a file: a published table, or the output of `seaplant export --to json`.
///
/// Body frame x forward, y starboard, z down; SI. Masses and damping are positive: M_A is minus the
/// SNAME derivatives X_u̇ …, damping minus X_u, X_|u|u …; all are on the left of `M ν̇_r + C(M,
/// ν_r) ν_r + D ν_r + D_q |ν_r| ν_r + … + g(η) = τ`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlantFile {
    /// `seaplant/plant/1`.
    pub schema: String,
    /// Name of the vehicle.
    pub name: String,
    /// Source of the numbers: article, table, file.
    pub source: String,
    /// Address of the source.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub url: Option<String>,
    /// Its licence.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
    /// Notes to the user.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// The known axes, in the order of rows and columns; all six if left out.
    #[serde(default = "all_axes", deserialize_with = "axes_by_name")]
    #[schemars(schema_with = "schema_of_axes")]
    pub axes: Vec<Dof>,
    /// Treatment of C(M_A) in the numbers.
    #[serde(default)]
    pub coriolis: Coriolis,
    /// The rigid body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid_body: Option<FileRigidBody>,
    /// Displacement and centre of buoyancy.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub buoyancy: Option<BuoyancyResult>,
    /// Length, width and height of the hull, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_m: Option<[f64; 3]>,
    /// M, rigid body and added mass together: its diagonal, or all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_matrix: Option<Entries>,
    /// M_A, in addition to `rigid_body`: its diagonal, or all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub added_mass: Option<Entries>,
    /// The matrix that multiplies ν_r.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub linear_damping: Option<Entries>,
    /// The matrix that multiplies |ν_k|ν_k of each axis k.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quadratic_damping: Option<Entries>,
    /// W − B, N, instead of `rigid_body` and `buoyancy`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weight_minus_buoyancy_n: Option<f64>,
    /// `W r_G − B r_B`, N m, instead of `rigid_body` and `buoyancy`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub righting_lever_nm: Option<[f64; 3]>,
    /// Further terms, such as `"yaw: |v|r" = 3.5`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub terms: BTreeMap<String, f64>,
    /// All coefficients by name, instead of every matrix, restoring force and term above.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub coefficients: BTreeMap<String, FileCoefficient>,
    /// Correlations of the coefficients.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<Correlation>,
    /// Forces of rudders, fins, propellers of unknown strength and wind, with coefficients by name
    /// among `coefficients`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<Effect>,
    /// Thrusters.
    #[serde(default, rename = "thruster", skip_serializing_if = "Vec::is_empty")]
    pub thrusters: Vec<FileThruster>,
    /// The actuator model by axis.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub actuation: BTreeMap<Dof, Actuation>,
    /// Range of motion and force in the trials, by axis.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub driven: BTreeMap<Dof, Driven>,
    /// Disturbances in the trials, by axis.
    #[serde(default, rename = "disturbance", skip_serializing_if = "BTreeMap::is_empty")]
    pub disturbances: BTreeMap<Dof, Disturbance>,
    /// The same numbers as matrices, for readers; ignored on input.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub derived: Option<Derived>,
}

/// A plant as matrices over all six axes, in SNAME order; an unknown entry is null.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Derived {
    /// M.
    pub mass_matrix: Vec<Vec<Option<f64>>>,
    /// M_RB, if the rigid body is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid_body_mass_matrix: Option<Vec<Vec<Option<f64>>>>,
    /// M − M_RB, if the rigid body is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub added_mass: Option<Vec<Vec<Option<f64>>>>,
    /// The matrix that multiplies ν_r.
    pub linear_damping: Vec<Vec<Option<f64>>>,
    /// The matrix that multiplies |ν_k|ν_k.
    pub quadratic_damping: Vec<Vec<Option<f64>>>,
    /// Products of other velocities, by name.
    pub other_terms: BTreeMap<String, f64>,
    /// Hydrodynamic derivatives in SNAME's notation and sign: X_udot, X_u, X_u|u| …; those of M
    /// only if the rigid body is known.
    pub sname: BTreeMap<String, f64>,
    /// The matrix from thrusts, N, to the wrench, N and N m; a column for each thruster.
    pub allocation: Vec<Vec<f64>>,
}

fn all_axes() -> Vec<Dof> {
    Dof::ALL.to_vec()
}

/// Treatment of the Coriolis forces of added mass in a table's numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Coriolis {
    /// The numbers exclude them: C(M) follows from M.
    #[default]
    Explicit,
    /// Derivatives such as N_uv or X_vr include them; the Munk moment must not count twice.
    InDerivatives,
}

/// The entries of a matrix by axes: its diagonal, or all rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Entries {
    /// The diagonal.
    Diagonal(Vec<f64>),
    /// Row by row.
    Matrix(Vec<Vec<f64>>),
}

/// A rigid body, with its inertia about its centre of gravity.
pub type FileRigidBody = RigidBodyResult;

/// A coefficient with its uncertainty.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileCoefficient {
    /// The value.
    pub value: f64,
    /// Its standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Lower end of its 95 % interval.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub low95: Option<f64>,
    /// Upper end of its 95 % interval.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub high95: Option<f64>,
    /// Its unit, for readers.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
}

/// A thruster.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FileThruster {
    /// Its name.
    pub name: String,
    /// Point of application of thrust, m.
    pub position_m: [f64; 3],
    /// Direction of positive thrust.
    pub direction: [f64; 3],
    /// Its curve.
    pub curve: CurveResult,
    /// Largest shaft speed in either direction, rpm, if the source states it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_rpm: Option<f64>,
}

impl PlantFile {
    /// Converts the file to a plant.
    ///
    /// # Errors
    /// [`Error::PlantTable`] with the invalid key; [`Error::PlantTerm`] for an invalid term;
    /// [`Error::Plant`] if M is not positive definite; [`Error::RigidBody`], [`Error::Thruster`] or
    /// [`Error::ThrustTable`] for a physically impossible vehicle.
    pub fn model(&self) -> Result<PlantModel, Error> {
        if self.schema != PLANT_SCHEMA {
            let reason = format!("is `{}`; this version reads `{PLANT_SCHEMA}`", self.schema);
            return Err(refuse("schema", reason));
        }
        self.check_errors()?;
        self.check_steering()?;
        let is_own = |effect: &&Effect| matches!(effect.force, EffectForce::Own { .. });
        if let Some(effect) = self.effects.iter().find(is_own) {
            let reason = format!(
                "has `{}`, a lag or dead band of one thruster; state the lag under `actuation` as `lag_of`, the dead band in its curve, and leave it out",
                effect.name
            );
            return Err(refuse("effects", reason));
        }
        let terms = if self.coefficients.is_empty() {
            self.terms_of_matrices()?
        } else {
            self.named_terms()?
        };
        let plant = plant_of_terms(&terms, &self.effects)?;
        let rigid_body = self.rigid_body.as_ref().map(RigidBodyResult::body).transpose()?;
        Ok(PlantModel {
            name: self.name.clone(),
            covariance: self.covariance(&terms),
            intervals: self.intervals(),
            plant,
            rigid_body,
            dry_mass_kg: None,
            size_m: self.size_m,
            buoyancy: self.buoyancy.as_ref().map(BuoyancyResult::buoyancy).transpose()?,
            thrusters: self.thrusters.iter().map(thruster).collect::<Result<_, _>>()?,
            max_rpm: self.max_rpm()?,
            actuation: self.actuation.clone(),
            driven: self.driven.clone(),
            disturbances: self.possible_disturbances()?,
            origin: Origin {
                source: self.source.clone(),
                url: self.url.clone(),
                licence: self.licence.clone(),
                ..Origin::default()
            },
            judgements: Vec::new(),
            notes: self.notes.clone(),
        })
    }

    /// Refuses impossible standard deviations and intervals.
    fn check_errors(&self) -> Result<(), Error> {
        for (name, x) in &self.coefficients {
            let refuse = |key: &str, reason: String| {
                Err(refuse(&format!("coefficients.\"{name}\".{key}"), reason))
            };
            if let Some(std) = x.std.filter(|std| !is_possible_std(*std)) {
                let reason = format!("is {std}; it must be finite and not below zero, or left out");
                return refuse("std", reason);
            }
            let ends = [("low95", x.low95), ("high95", x.high95)];
            let infinite = ends.into_iter().find(|(_, end)| end.is_some_and(|x| !x.is_finite()));
            if let Some((key, Some(end))) = infinite {
                return refuse(key, format!("is {end}; it must be finite, or left out"));
            }
        }
        Ok(())
    }

    /// Rejects a gear that leads its orders or does not turn.
    fn check_steering(&self) -> Result<(), Error> {
        for (dof, actuation) in &self.actuation {
            let key = |name: &str| format!("actuation.{dof}.{name}");
            let value = |number: &Option<Parameter>| number.as_ref().map(|number| number.value);
            if let Some(x) = value(&actuation.steering_delay).filter(|x| !is_possible_std(*x)) {
                let reason = format!("is {x} s; it must be finite and not below zero, or left out");
                return Err(refuse(&key("steering_delay"), reason));
            }
            let is_possible = |x: &f64| x.is_finite() && *x > 0.0;
            if let Some(x) = value(&actuation.steering_rate).filter(|x| !is_possible(x)) {
                let reason = format!("is {x} rad/s; it must be finite and above zero, or left out");
                return Err(refuse(&key("steering_rate"), reason));
            }
        }
        Ok(())
    }

    /// Returns the least of the thrusters' limits.
    fn max_rpm(&self) -> Result<Option<f64>, Error> {
        let stated = || self.thrusters.iter().filter_map(|thruster| thruster.max_rpm);
        match stated().find(|rpm| !(rpm.is_finite() && *rpm > 0.0)) {
            Some(rpm) => Err(refuse("max_rpm", format!("is {rpm}; it must be above zero"))),
            None => Ok(stated().reduce(f64::min)),
        }
    }

    fn possible_disturbances(&self) -> Result<BTreeMap<Dof, Disturbance>, Error> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        match self.disturbances.iter().find(|(_, x)| !positive(x.std) || !positive(x.correlation_s))
        {
            None => Ok(self.disturbances.clone()),
            Some((dof, _)) => {
                let reason = format!("of {dof} needs std and correlation_s above zero");
                Err(refuse("disturbance", reason))
            }
        }
    }

    fn named_terms(&self) -> Result<Vec<(Basis, f64)>, Error> {
        let others = [
            ("mass_matrix", self.mass_matrix.is_some()),
            ("added_mass", self.added_mass.is_some()),
            ("linear_damping", self.linear_damping.is_some()),
            ("quadratic_damping", self.quadratic_damping.is_some()),
            ("weight_minus_buoyancy_n", self.weight_minus_buoyancy_n.is_some()),
            ("righting_lever_nm", self.righting_lever_nm.is_some()),
            ("terms", !self.terms.is_empty()),
        ];
        if let Some((key, _)) = others.iter().find(|(_, is_there)| *is_there) {
            let reason =
                "is given beside coefficients, which hold every number; keep one of the two";
            return Err(refuse(key, reason.to_owned()));
        }
        let named = self.coefficients.iter();
        named.map(|(name, x)| Ok((self.term_of_name(name)?, x.value))).collect()
    }

    /// Returns the term of a coefficient's name, that of an effect by its index.
    fn term_of_name(&self, name: &str) -> Result<Basis, Error> {
        match self.effects.iter().position(|effect| effect.name == name) {
            Some(k) => Ok(Basis::Effect(k)),
            None => basis_of_name(name),
        }
    }

    fn terms_of_matrices(&self) -> Result<Vec<(Basis, f64)>, Error> {
        let mass = self.mass()?;
        let mut terms = Vec::new();
        for (k, &i) in self.axes.iter().enumerate() {
            for (l, &j) in self.axes.iter().enumerate().skip(k) {
                let value = symmetric("mass_matrix", &mass, k, l)?;
                if k == l || value != 0.0 {
                    terms.push((Basis::Mass(i.min(j), i.max(j)), value));
                }
            }
        }
        let products: [Products<'_>; 2] = [
            ("linear_damping", &self.linear_damping, Product::linear),
            ("quadratic_damping", &self.quadratic_damping, Product::quadratic),
        ];
        for (key, entries, product) in products {
            let Some(entries) = entries else { continue };
            let matrix = self.matrix(key, entries)?;
            for (k, &on) in self.axes.iter().enumerate() {
                for (l, &of) in self.axes.iter().enumerate() {
                    let value = matrix[(k, l)];
                    if k == l || value != 0.0 {
                        terms.push((Basis::Product(on, product(of)), value));
                    }
                }
            }
        }
        self.push_restoring(&mut terms)?;
        for (name, &value) in &self.terms {
            push(&mut terms, basis_of_name(name)?, value);
        }
        if self.coriolis == Coriolis::InDerivatives {
            self.cancel_coriolis(&mut terms)?;
        }
        Ok(terms)
    }

    /// Returns M over the axes of the file.
    fn mass(&self) -> Result<DMatrix<f64>, Error> {
        match (&self.mass_matrix, &self.added_mass, &self.rigid_body) {
            (Some(_), Some(_), _) => Err(refuse(
                "added_mass",
                "is given beside mass_matrix, which holds it; keep one".into(),
            )),
            (Some(mass), None, _) => self.matrix("mass_matrix", mass),
            (None, Some(added), Some(body)) => {
                let (added, body) = (self.matrix("added_mass", added)?, body.body()?.mass_matrix());
                Ok(DMatrix::from_fn(self.axes.len(), self.axes.len(), |k, l| {
                    added[(k, l)] + body[(self.axes[k].index(), self.axes[l].index())]
                }))
            }
            (None, Some(_), None) => Err(refuse(
                "rigid_body",
                "is missing beside added_mass; add it, or give mass_matrix".into(),
            )),
            (None, None, _) => Err(refuse(
                "mass_matrix",
                "is missing; give it, or rigid_body and added_mass".into(),
            )),
        }
    }

    fn matrix(&self, key: &str, entries: &Entries) -> Result<DMatrix<f64>, Error> {
        let n = self.axes.len();
        let (rows, square) = match entries {
            Entries::Diagonal(diagonal) => (diagonal.len(), true),
            Entries::Matrix(rows) => (rows.len(), rows.iter().all(|row| row.len() == n)),
        };
        if rows != n || !square {
            let reason = format!(
                "has {rows} {} and needs {n}, one for each of axes; an entry that the source does not state makes its axis unknown: take it out of axes",
                if square { "entries" } else { "rows, not all of that length," }
            );
            return Err(refuse(key, reason));
        }
        let matrix = match entries {
            Entries::Diagonal(diagonal) => DMatrix::from_diagonal(&diagonal.clone().into()),
            Entries::Matrix(rows) => DMatrix::from_fn(n, n, |i, j| rows[i][j]),
        };
        if matrix.iter().all(|x| x.is_finite()) {
            return Ok(matrix);
        }
        Err(refuse(key, "holds a number that is not finite".to_owned()))
    }

    fn push_restoring(&self, terms: &mut Vec<(Basis, f64)>) -> Result<(), Error> {
        let known = match (&self.rigid_body, &self.buoyancy) {
            (Some(body), Some(buoyancy)) => Some(buoyancy.buoyancy()?.restoring(&body.body()?)),
            _ => None,
        };
        let has = |dof: Dof| self.axes.contains(&dof);
        let excess = self.weight_minus_buoyancy_n.or(known.map(|(excess, _)| excess));
        if let Some(excess) = excess.filter(|_| has(Dof::Heave)) {
            terms.push((Basis::WeightExcess, excess));
        }
        let lever = self.righting_lever_nm.or(known.map(|(_, lever)| lever.into()));
        if let Some(lever) = lever.filter(|_| has(Dof::Roll) || has(Dof::Pitch)) {
            let there = (0..3).filter(|axis| *axis == 2 || lever[*axis] != 0.0);
            terms.extend(there.map(|axis| (Basis::Lever(axis), lever[axis])));
        }
        Ok(())
    }

    /// Subtracts C(M_A): [`PlantModel`] has an explicit C of all of M.
    fn cancel_coriolis(&self, terms: &mut Vec<(Basis, f64)>) -> Result<(), Error> {
        let Some(added) = &self.added_mass else {
            let reason =
                "is in-derivatives, which needs rigid_body and added_mass apart".to_owned();
            return Err(refuse("coriolis", reason));
        };
        let added = self.matrix("added_mass", added)?;
        let mut six = Matrix6::zeros();
        for (k, i) in self.axes.iter().enumerate() {
            for (l, j) in self.axes.iter().enumerate() {
                six[(i.index(), j.index())] = added[(k, l)];
            }
        }
        for (on, product, value) in coriolis_products(&six) {
            let reads = |of: Dof| self.axes.contains(&of);
            if reads(on) && product.factors().all(|factor| reads(factor.of)) {
                push(terms, Basis::Product(on, product), value);
            }
        }
        Ok(())
    }

    fn intervals(&self) -> BTreeMap<String, [f64; 2]> {
        let interval = |(name, x): (&String, &FileCoefficient)| {
            let name = match self.term_of_name(name).ok()? {
                Basis::Effect(_) => name.clone(),
                term => term.to_string(),
            };
            Some((name, [x.low95?, x.high95?]))
        };
        self.coefficients.iter().filter_map(interval).collect()
    }

    /// Returns the covariance of named coefficients, if all have a standard deviation.
    fn covariance(&self, terms: &[(Basis, f64)]) -> Option<DMatrix<f64>> {
        let std: Option<Vec<f64>> = self.coefficients.values().map(|x| x.std).collect();
        let std = std.filter(|std| !std.is_empty() && std.len() == terms.len())?;
        let place = |k: usize| {
            let correlation = self.correlation.as_ref()?;
            let name = match terms[k].0 {
                Basis::Effect(at) => self.effects.get(at)?.name.clone(),
                term => term.to_string(),
            };
            correlation.names.iter().position(|known| *known == name)
        };
        let correlation = |i: usize, j: usize| {
            let (a, b) = (place(i)?, place(j)?);
            self.correlation.as_ref()?.value.get(a)?.get(b).copied()
        };
        Some(DMatrix::from_fn(terms.len(), terms.len(), |i, j| {
            let part = if i == j { 1.0 } else { correlation(i, j).unwrap_or(0.0) };
            part * std[i] * std[j]
        }))
    }
}

/// A damping matrix: its key, its entries, and the product of velocities that each multiplies.
type Products<'a> = (&'static str, &'a Option<Entries>, fn(Dof) -> Product);

fn refuse(key: &str, reason: String) -> Error {
    Error::PlantTable { key: key.to_owned(), reason }
}

/// Returns whether a standard deviation is not negative, and its square finite.
pub(super) fn is_possible_std(std: f64) -> bool {
    std >= 0.0 && (std * std).is_finite()
}

fn thruster(thruster: &FileThruster) -> Result<Thruster, Error> {
    let FileThruster { name, position_m, direction, curve, max_rpm: _ } = thruster;
    Thruster::new(name, *position_m, *direction, curve.curve()?)
}

/// Adds a value to a term, which a table may contain twice under different names.
fn push(terms: &mut Vec<(Basis, f64)>, basis: Basis, value: f64) {
    match terms.iter_mut().find(|(known, _)| *known == basis) {
        Some((_, sum)) => *sum += value,
        None => terms.push((basis, value)),
    }
}

/// Largest relative difference of mirrored entries: published tables are rounded.
const SYMMETRY_PART: f64 = 1e-3;

fn symmetric(key: &str, matrix: &DMatrix<f64>, i: usize, j: usize) -> Result<f64, Error> {
    let (a, b) = (matrix[(i, j)], matrix[(j, i)]);
    if (a - b).abs() > SYMMETRY_PART * a.abs().max(b.abs()) {
        let reason = format!(
            "is not symmetric: row {} column {} is {a}, mirrored {b}; masses of a body in water are",
            i + 1,
            j + 1
        );
        return Err(refuse(key, reason));
    }
    Ok(0.5 * (a + b))
}

/// Parses a coefficient's name in results.
pub(super) fn basis_of_name(name: &str) -> Result<Basis, Error> {
    let unknown = || {
        Error::PlantTerm {
        text: name.to_owned(),
        at: 1,
        reason: "is not a coefficient; use names such as mass.surge, mass.surge-pitch, \"yaw: |v|r\", weight-minus-buoyancy or lever.z".to_owned(),
    }
    };
    if let Some(axes) = name.strip_prefix("mass.") {
        let mut axes = axes.split('-').map(str::parse::<Dof>);
        let first = axes.next().ok_or_else(unknown)?.map_err(|_| unknown())?;
        let second = axes.next().unwrap_or(Ok(first)).map_err(|_| unknown())?;
        return match axes.next() {
            None => Ok(Basis::Mass(first.min(second), first.max(second))),
            Some(_) => Err(unknown()),
        };
    }
    match name {
        "weight-minus-buoyancy" => Ok(Basis::WeightExcess),
        "lever.x" => Ok(Basis::Lever(0)),
        "lever.y" => Ok(Basis::Lever(1)),
        "lever.z" => Ok(Basis::Lever(2)),
        _ => name.parse(),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector3, Vector6};

    use super::*;

    fn table(value: serde_json::Value) -> PlantFile {
        serde_json::from_value(value).expect("a table")
    }

    fn remus() -> serde_json::Value {
        // [Prestero2001], the symmetric subset.
        serde_json::json!({
            "schema": PLANT_SCHEMA, "name": "REMUS 100", "source": "Prestero 2001",
            "axes": ["surge", "sway", "yaw"],
            "rigid_body": {
                "mass_kg": 30.48, "centre_of_gravity_m": [0.0, 0.0, 0.0196],
                "inertia_kg_m2": [[0.177, 0.0, 0.0], [0.0, 3.45, 0.0], [0.0, 0.0, 3.45]]
            },
            "added_mass": [[0.93, 0.0, 0.0], [0.0, 35.5, -1.93], [0.0, -1.93, 4.88]],
            "terms": { "yaw: uv": 24.0 }
        })
    }

    #[test]
    fn the_munk_moment_counts_once_in_tables_that_include_it() {
        let yaw = |coriolis: &str| {
            let mut value = remus();
            value["coriolis"] = coriolis.into();
            let plant = table(value).model().expect("possible").plant;
            let velocity = Vector6::new(1.5, 0.1, 0.0, 0.0, 0.0, 0.0);
            plant.resistance(&velocity, &Vector3::z())[5]
        };
        // N_uv is that of the table alone: the rigid body has no moment in u v.
        assert!((yaw("in-derivatives") - 24.0 * 0.15).abs() < 1e-12);
        let munk = (35.5 - 0.93) * 0.15;
        assert!((yaw("explicit") - (24.0 * 0.15 + munk)).abs() < 1e-12);
    }

    #[test]
    fn invalid_tables_are_refused_by_their_key() {
        let error = |key: &str, value: serde_json::Value| {
            let mut all = remus();
            all[key] = value;
            table(all).model().expect_err("wrong").to_string()
        };
        assert!(error("schema", "other".into()).contains("schema is `other`"));
        assert!(error("added_mass", serde_json::json!([1.0, 2.0])).contains("needs 3"));
        let skew = serde_json::json!([[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
        let message = error("mass_matrix", skew);
        assert!(message.contains("added_mass is given beside mass_matrix"), "{message}");
        assert!(error("terms", serde_json::json!({ "yaw: zz": 1.0 })).contains("no velocity `z`"));
        let named = serde_json::json!({ "mass.yar": { "value": 1.0 } });
        let message = error("coefficients", named);
        assert!(message.contains("keep one of the two"), "{message}");
        let thruster = serde_json::json!({
            "name": "a", "position_m": [0.0, 0.0, 0.0], "direction": [1.0, 0.0, 0.0]
        });
        let force = serde_json::json!({ "kind": "own", "thruster": thruster, "number": "lag" });
        for (name, x) in [("steering_delay", -0.1), ("steering_rate", 0.0)] {
            let number = serde_json::json!({
                "value": x, "std": 0.1, "low95": -0.2, "high95": 0.2, "unit": "rad/s"
            });
            let message = error("actuation", serde_json::json!({ "yaw": { name: number } }));
            assert!(message.contains(&format!("actuation.yaw.{name} is {x}")), "{message}");
        }
        let own = serde_json::json!([{ "name": "a.excess-lag", "force": force }]);
        let message = error("effects", own);
        assert!(
            message.contains("`a.excess-lag`") && message.contains("leave it out"),
            "{message}"
        );
    }
}
