//! Whether the mass and drag of each axis are known, and possible.

use std::collections::BTreeMap;

use super::doubts::is_pushed;
use crate::caveat::spoken;
use crate::diagnose::impossible_mass;
use crate::estimate::CoupledFit;
use crate::plant::{Basis, Product};
use crate::results::{Coefficient, Parameter};
use crate::signal::rms;
use crate::{Caveat, CaveatCode, CoupledRecord, Dof, Estimate, Vehicle};

/// A mass interval whose ends are further apart than this factor says nothing of mass.
const WIDEST_MASS: f64 = 2.0;

/// Drag at working speed that is known no better than ± this part is not known.
const WIDEST_DRAG: f64 = 0.5;

/// Doubts about the axes that are pushed; those of others follow from what these do.
pub(super) fn doubts(
    fit: &CoupledFit,
    parameters: &BTreeMap<String, Coefficient>,
    records: &[&CoupledRecord],
    vehicle: &Vehicle,
) -> Vec<(Dof, Caveat)> {
    let pushed = fit.plant.axes().iter().filter(|dof| is_pushed(fit, records, **dof));
    let of = |&dof: &Dof| {
        let mass = parameter(parameters.get(&Basis::Mass(dof, dof).to_string())?);
        let drag = unknown_drag(fit, dof, records);
        let impossible = impossible_mass(dof, &mass, vehicle);
        Some([impossible, unknown_mass(dof, &mass), drag].map(|caveat| Some((dof, caveat?))))
    };
    let pushed: Vec<Dof> = pushed.copied().collect();
    let mut all: Vec<(Dof, Caveat)> = pushed.iter().filter_map(of).flatten().flatten().collect();
    all.extend(without_added_mass(fit, &pushed, vehicle));
    all
}

/// That every mass is that of the stated rigid body, below which a fit does not go: the trials ask
/// for less.
fn without_added_mass(
    fit: &CoupledFit,
    pushed: &[Dof],
    vehicle: &Vehicle,
) -> Option<(Dof, Caveat)> {
    let body = vehicle.rigid_body.as_ref()?.mass_matrix();
    let translations: Vec<Dof> = pushed.iter().filter(|dof| !dof.is_rotation()).copied().collect();
    let mass = fit.plant.mass_matrix_of_six();
    let has_none = |dof: &Dof| {
        let k = dof.index();
        mass[(k, k)] < (1.0 + LEAST_ADDED_PART) * body[(k, k)]
    };
    let [first, _, ..] = translations[..] else { return None };
    translations.iter().all(has_none).then(|| {
        let message = format!(
            "the trials ask for masses below that of the stated rigid body, {} kg, in {}: thrust is too small (its curve, its unit), or the stated mass too large",
            spoken(body[(0, 0)]),
            super::names(&translations)
        );
        (first, Caveat::severe(CaveatCode::Implausible, message))
    })
}

/// No body has less added mass, as a part of its own, in two directions.
const LEAST_ADDED_PART: f64 = 0.02;

fn parameter(x: &Coefficient) -> Parameter {
    let Coefficient { value, std, low95, high95, unit, .. } = x.clone();
    Parameter { value, std, low95, high95, unit }
}

fn unknown_mass(dof: Dof, mass: &Parameter) -> Option<Caveat> {
    (mass.low95 <= 0.0 || mass.high95 > WIDEST_MASS * mass.low95).then(|| {
        let message = format!(
            "the {dof} {} is anything from {} to {} {}: drive longer, faster, and at more than one frequency",
            if dof.is_rotation() { "inertia" } else { "mass" },
            spoken(mass.low95),
            spoken(mass.high95),
            mass.unit
        );
        Caveat::warning(CaveatCode::NotDetermined, message)
    })
}

/// `d_L v + d_Q v²` at a speed of an axis, N or N m; none of an axis without such terms.
pub(super) fn drag_at(fit: &CoupledFit, dof: Dof, speed: f64) -> Option<Estimate> {
    let structure = fit.plant.structure();
    let weights = [(Product::linear(dof), speed), (Product::quadratic(dof), speed * speed)];
    let place =
        |(product, weight)| Some((structure.index_of(&Basis::Product(dof, product))?, weight));
    let terms: Vec<(usize, f64)> = weights.into_iter().filter_map(place).collect();
    let drag: f64 = terms.iter().map(|(k, w)| w * fit.plant.coefficients()[*k]).sum();
    let pairs = terms.iter().flat_map(|a| terms.iter().map(move |b| (a, b)));
    let variance: f64 = pairs.map(|((i, a), (j, b))| a * b * fit.covariance[(*i, *j)]).sum();
    let std = variance.max(0.0).sqrt();
    (!terms.is_empty()).then(|| Estimate::new(drag, std, fit.samples as f64))
}

fn unknown_drag(fit: &CoupledFit, dof: Dof, records: &[&CoupledRecord]) -> Option<Caveat> {
    let speed = usual_speed(dof, records);
    let drag = drag_at(fit, dof, speed)?;
    let half = 1.96 * drag.std;
    let is_unknown = half > WIDEST_DRAG * drag.value.abs() || !half.is_finite();
    is_unknown.then(|| {
        let units = dof.units();
        let message = format!(
            "drag in {dof} at {} {} is {} ± {} {}: drive longer, and faster",
            spoken(speed),
            units.velocity,
            spoken(drag.value),
            spoken(half),
            units.force
        );
        Caveat::warning(CaveatCode::NotDetermined, message)
    })
}

/// The root mean square of an axis's velocity over all trials.
pub(super) fn usual_speed(dof: Dof, records: &[&CoupledRecord]) -> f64 {
    let series = records.iter().filter_map(|record| record.velocity[dof.index()].as_ref());
    rms(series.flat_map(|series| series.values()))
}
