//! Writes matrices as JSON, in Fossen's notation and as SNAME's derivatives; `seaplant` reads it
//! back.

use std::collections::BTreeMap;

use nalgebra::Matrix6;
use seaplant::Dof;
use seaplant::exchange::{
    Coriolis, Derived, FileCoefficient, FileThruster, PLANT_SCHEMA, PlantFile, PlantModel,
};
use seaplant::plant::{Basis, Product};
use seaplant::results::{BuoyancyResult, Correlation, CurveResult, RigidBodyResult};

use crate::remarks::{Frame, Remarks};
use crate::{Error, Exported, ExportedFile, Exporter};

pub(crate) struct Json;

impl Exporter for Json {
    fn name(&self) -> &'static str {
        "json"
    }

    fn about(&self) -> &'static str {
        "coefficients, matrices and SNAME derivatives as JSON, which compare and simulate read"
    }

    fn files(&self, model: &PlantModel) -> Result<Exported, Error> {
        let remarks = Remarks { model, format: "json", frame: Frame::Frd, limits: Vec::new() };
        let file = file(model, remarks.lines());
        let write = |error: serde_json::Error| Error::Write { reason: error.to_string() };
        let bytes = (serde_json::to_string_pretty(&file).map_err(write)? + "\n").into_bytes();
        let path = "plant.json".to_owned();
        Ok(Exported { files: vec![ExportedFile { path, bytes }], notes: remarks.notes() })
    }
}

fn file(model: &PlantModel, notes: Vec<String>) -> PlantFile {
    PlantFile {
        schema: PLANT_SCHEMA.to_owned(),
        name: model.name.clone(),
        source: model.origin.source.clone(),
        url: model.origin.url.clone(),
        licence: model.origin.licence.clone(),
        notes,
        axes: model.plant.axes().to_vec(),
        coriolis: Coriolis::Explicit,
        rigid_body: model.rigid_body.as_ref().map(RigidBodyResult::of),
        buoyancy: model.buoyancy.as_ref().map(BuoyancyResult::of),
        size_m: model.size_m,
        mass_matrix: None,
        added_mass: None,
        linear_damping: None,
        quadratic_damping: None,
        weight_minus_buoyancy_n: None,
        righting_lever_nm: None,
        terms: BTreeMap::new(),
        coefficients: coefficients(model),
        correlation: correlation(model),
        effects: model.plant.structure().effects().to_vec(),
        thrusters: model.thrusters.iter().map(|own| thruster(model, own)).collect(),
        actuation: model.actuation.clone(),
        driven: model.driven.clone(),
        disturbances: model.disturbances.clone(),
        derived: Some(derived(model)),
    }
}

fn coefficients(model: &PlantModel) -> BTreeMap<String, FileCoefficient> {
    let terms = model.plant.structure().terms().iter().zip(model.plant.coefficients());
    let coefficient = |(k, (term, value)): (usize, (&Basis, &f64))| {
        let interval = model.interval(k);
        let coefficient = FileCoefficient {
            value: *value,
            std: model.std(k),
            low95: interval.map(|[low, _]| low),
            high95: interval.map(|[_, high]| high),
            unit: model.plant.structure().unit_of(term),
        };
        (model.plant.structure().name_of(term), coefficient)
    };
    terms.enumerate().map(coefficient).collect()
}

fn correlation(model: &PlantModel) -> Option<Correlation> {
    let covariance = model.covariance.as_ref()?;
    let p = covariance.nrows();
    let value = |i: usize, j: usize| {
        let scale = (covariance[(i, i)] * covariance[(j, j)]).sqrt();
        let unit = if i == j { 1.0 } else { 0.0 };
        if scale > 0.0 { covariance[(i, j)] / scale } else { unit }
    };
    Some(Correlation {
        names: model.plant.structure().names(),
        value: (0..p).map(|i| (0..p).map(|j| value(i, j)).collect()).collect(),
    })
}

fn thruster(model: &PlantModel, thruster: &seaplant::Thruster) -> FileThruster {
    FileThruster {
        name: thruster.name.clone(),
        position_m: thruster.position_body.into(),
        direction: thruster.direction_body.into(),
        curve: CurveResult::of(&thruster.curve),
        max_rpm: model.max_rpm,
    }
}

/// Returns rows over six axes; entries of axes that the plant does not have are unknown.
fn rows(model: &PlantModel, matrix: &Matrix6<f64>) -> Vec<Vec<Option<f64>>> {
    let known = |dof: Dof| model.plant.axes().contains(&dof);
    let entry = |i: Dof, j: Dof| (known(i) && known(j)).then(|| matrix[(i.index(), j.index())]);
    Dof::ALL.map(|i| Dof::ALL.map(|j| entry(i, j)).to_vec()).to_vec()
}

/// Returns a damping matrix of all six axes, zero where there is no term.
pub(crate) fn damping(model: &PlantModel, product: fn(Dof) -> Product) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    for on in Dof::ALL {
        for of in Dof::ALL {
            let value = model.plant.coefficient(&Basis::Product(on, product(of)));
            matrix[(on.index(), of.index())] = value.unwrap_or(0.0);
        }
    }
    matrix
}

fn derived(model: &PlantModel) -> Derived {
    let mass = model.plant.mass_matrix_of_six();
    let rigid = model.rigid_body.as_ref().map(|body| body.mass_matrix());
    let others = model.plant.structure().terms().iter().zip(model.plant.coefficients());
    let usual = |basis: &Basis| match basis {
        Basis::Product(_, product) => Dof::ALL
            .iter()
            .any(|of| [Product::linear(*of), Product::quadratic(*of)].contains(product)),
        _ => false,
    };
    let others = others.filter(|(b, _)| !matches!(b, Basis::Mass(..)) && !usual(b));
    Derived {
        mass_matrix: rows(model, &mass),
        rigid_body_mass_matrix: rigid.map(|rigid| rows(model, &rigid)),
        added_mass: rigid.map(|rigid| rows(model, &(mass - rigid))),
        linear_damping: rows(model, &damping(model, Product::linear)),
        quadratic_damping: rows(model, &damping(model, Product::quadratic)),
        other_terms: others
            .map(|(basis, value)| (model.plant.structure().name_of(basis), *value))
            .collect(),
        sname: sname(model),
        allocation: (0..6)
            .map(|i| model.thrusters.iter().map(|t| t.unit_wrench()[i]).collect())
            .collect(),
    }
}

/// SNAME's letters of forces and velocities.
pub(crate) const FORCES: [&str; 6] = ["X", "Y", "Z", "K", "M", "N"];
pub(crate) const VELOCITIES: [&str; 6] = ["u", "v", "w", "p", "q", "r"];

/// Returns X_udot, X_u, X_u|u|, N_uv …: minus the coefficients on the left of the equation.
pub(crate) fn sname(model: &PlantModel) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::new();
    let rigid = model.rigid_body.as_ref().map(|body| body.mass_matrix());
    for (term, value) in model.plant.structure().terms().iter().zip(model.plant.coefficients()) {
        match term {
            Basis::Mass(i, j) => {
                // Without the rigid body, added mass is unknown.
                let Some(rigid) = rigid else { continue };
                let (i, j) = (i.index(), j.index());
                let added = value - rigid[(i, j)];
                all.insert(format!("{}_{}dot", FORCES[i], VELOCITIES[j]), -added);
                all.insert(format!("{}_{}dot", FORCES[j], VELOCITIES[i]), -added);
            }
            Basis::Product(on, product) => {
                // |u|u is written X_u|u|.
                let (moduli, plain): (Vec<_>, Vec<_>) = product.factors().partition(|f| f.modulus);
                let plain = plain.iter().map(|f| VELOCITIES[f.of.index()].to_owned());
                let moduli = moduli.iter().map(|f| format!("|{}|", VELOCITIES[f.of.index()]));
                let letters: String = plain.chain(moduli).collect();
                let power = usize::from(product.speed().unsigned_abs());
                let letters = match product.speed() {
                    0 => letters,
                    up if up > 0 => "U".repeat(power) + &letters,
                    _ => format!("{letters}/{}", "U".repeat(power)),
                };
                all.insert(format!("{}_{letters}", FORCES[on.index()]), -value);
            }
            Basis::One(on) => {
                all.insert(format!("{}_0", FORCES[on.index()]), -value);
            }
            Basis::WeightExcess | Basis::Lever(_) | Basis::Effect(_) => {}
        }
    }
    all
}
