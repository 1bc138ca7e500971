//! Consistency checks of results in a file.

use super::file::{basis_of_name, is_possible_std};
use crate::plant::{Basis, Product};
use crate::results::{MatrixResult, Parameter, Parameters, PlantResult, Results};
use crate::{Dof, Error, LumpedParameters};

/// Relative rounding of a writer and a reader.
const ROUNDING: f64 = 1e-6;

/// Compares numbers that results contain twice, and refuses impossible standard deviations.
///
/// `by_axis`, the matrices and `lumped` follow from `parameters`; `plants.NAME` and `methods.NAME.METHOD` are the same
/// plant.
///
/// # Errors
/// [`Error::ResultsNumber`] with both values of the first number that contradicts another; also for
/// a number that is not finite, or a negative standard deviation.
pub fn check_results(results: &Results) -> Result<(), Error> {
    for (name, plant) in &results.plants {
        let path = format!("plants.{name}");
        check_plant(name, &path, plant)?;
        let of_method = results.methods.get(name).and_then(|methods| methods.get(&plant.method));
        if let Some(other) = of_method {
            check_same(&path, plant, &format!("methods.{name}.{}", plant.method), other)?;
        }
    }
    for (name, methods) in &results.methods {
        for (method, plant) in methods {
            check_plant(name, &format!("methods.{name}.{method}"), plant)?;
        }
    }
    Ok(())
}

fn check_plant(name: &str, path: &str, plant: &PlantResult) -> Result<(), Error> {
    if plant.name() != name {
        let own = if plant.axes.is_empty() { "no plant".to_owned() } else { plant.name() };
        let reason = format!("are those of {own}, but its name is {name}");
        return Err(contradiction(format!("{path}.axes"), &reason));
    }
    for (coefficient, x) in &plant.parameters {
        let numbers = [x.value, x.std, x.low95, x.high95];
        check_numbers(&format!("{path}.parameters.\"{coefficient}\""), numbers)?;
    }
    for (nuisance, parameter) in &plant.nuisances {
        let Parameter { value, std, low95, high95, .. } = parameter;
        check_numbers(&format!("{path}.nuisances.{nuisance}"), [*value, *std, *low95, *high95])?;
    }
    for (coefficient, x) in &plant.parameters {
        check_entries(path, plant, coefficient, x.value)?;
    }
    for dof in &plant.axes {
        check_axis(path, plant, *dof)?;
    }
    match &plant.alone {
        Some(alone) => check_lumped(path, plant, &alone.lumped),
        None => Ok(()),
    }
}

/// Returns the numbers of an axis with their names in results; those not fitted are absent.
fn named(own: &Parameters) -> [(&'static str, Option<&Parameter>); 4] {
    [
        ("mass", Some(&own.mass)),
        ("quadratic_drag", own.quadratic_drag.as_ref()),
        ("linear_drag", own.linear_drag.as_ref()),
        ("bias_force", own.bias_force.as_ref()),
    ]
}

/// Compares the numbers of an axis with the coefficients that they follow from.
fn check_axis(path: &str, plant: &PlantResult, dof: Dof) -> Result<(), Error> {
    let expected = Parameters::of(dof, &plant.parameters);
    let found = plant.by_axis.get(&dof);
    let (Some(expected), Some(found)) = (&expected, found) else {
        let key = if found.is_none() { "by_axis" } else { "parameters" };
        let reason = format!("lacks the mass of {dof}, which is one of its axes");
        return Err(contradiction(format!("{path}.{key}"), &reason));
    };
    for ((name, here), (_, there)) in named(found).into_iter().zip(named(expected)) {
        let ends = |x: Option<&Parameter>| x.map(|x| [x.value, x.std, x.low95, x.high95]);
        let are_same = match (ends(here), ends(there)) {
            (Some(here), Some(there)) => here.iter().zip(there).all(|(x, y)| are_close(*x, y)),
            (None, None) => true,
            _ => false,
        };
        if !are_same {
            let spoken = |x: Option<&Parameter>| {
                x.map_or("absent".to_owned(), |x| {
                    format!("{} ± {} ({} to {})", x.value, x.std, x.low95, x.high95)
                })
            };
            let reason = format!("is {}, but {} by {path}.parameters", spoken(here), spoken(there));
            return Err(contradiction(format!("{path}.by_axis.{dof}.{name}"), &reason));
        }
    }
    let Some(added) = &found.added_mass else { return Ok(()) };
    let mass = &found.mass;
    let off = |x: f64, y: f64| ((mass.value - added.value) - (x - y)).abs();
    if off(mass.low95, added.low95).max(off(mass.high95, added.high95))
        > ROUNDING * mass.value.abs()
        || !are_close(mass.std, added.std)
    {
        let reason = format!(
            "has another interval than the mass of {} ({} to {})",
            mass.value, mass.low95, mass.high95
        );
        return Err(contradiction(format!("{path}.by_axis.{dof}.added_mass"), &reason));
    }
    Ok(())
}

/// Checks `m = 1/α`, `d_Q = −β m`, `d_L = −μ m`, `b = −bias m`.
fn check_lumped(path: &str, plant: &PlantResult, lumped: &LumpedParameters) -> Result<(), Error> {
    let dof = plant.first_axis();
    let Some(own) = plant.by_axis.get(&dof) else { return Ok(()) };
    let LumpedParameters { alpha, beta, mu, bias } = *lumped;
    let mass = own.mass.value;
    let lumped = [("alpha", alpha), ("beta", beta), ("mu", mu), ("bias", bias)];
    for ((name, parameter), (lumped_name, lumped)) in named(own).into_iter().zip(lumped) {
        let value = parameter.map_or(0.0, |parameter| parameter.value);
        let from_parameters = if name == "mass" { 1.0 / value } else { -value / mass };
        if !are_close(from_parameters, lumped) {
            let reason = format!(
                "is {value}, which makes {lumped_name} {from_parameters}, but {path}.alone.lumped.{lumped_name} is {lumped}"
            );
            return Err(contradiction(format!("{path}.by_axis.{dof}.{name}"), &reason));
        }
    }
    Ok(())
}

/// Compares the recommended plant with the same plant among those of all methods.
fn check_same(
    path: &str,
    plant: &PlantResult,
    other_path: &str,
    other: &PlantResult,
) -> Result<(), Error> {
    for name in plant.parameters.keys().chain(other.parameters.keys()) {
        let value = |of: &PlantResult| of.parameters.get(name).map_or(0.0, |x| x.value);
        let (here, there) = (value(plant), value(other));
        if !are_close(here, there) {
            let reason = format!("is {here}, but {other_path}.parameters.\"{name}\" is {there}");
            return Err(contradiction(format!("{path}.parameters.\"{name}\""), &reason));
        }
    }
    Ok(())
}

/// Compares a coefficient with its entries in the matrices, if any.
fn check_entries(
    path: &str,
    result: &PlantResult,
    coefficient: &str,
    value: f64,
) -> Result<(), Error> {
    let Ok(term) = basis_of_name(coefficient) else { return Ok(()) };
    let axis = |dof: Dof| result.axes.iter().position(|axis| *axis == dof);
    for (key, matrix, [on, of]) in entries(result, term) {
        let entry = axis(on).zip(axis(of)).and_then(|(i, j)| matrix.value.get(i)?.get(j).copied());
        if entry.is_none_or(|entry| !are_close(entry, value)) {
            let entry = entry.map_or_else(|| "absent".to_owned(), |entry| entry.to_string());
            let reason = format!("is {value}, but {path}.{key} of {on} and {of} is {entry}");
            return Err(contradiction(format!("{path}.parameters.\"{coefficient}\""), &reason));
        }
    }
    Ok(())
}

/// A matrix by its key in results, and the row and column of an entry.
type Entry<'a> = (&'static str, &'a MatrixResult, [Dof; 2]);

/// Returns the entries of a coefficient in the matrices: two for a mass that couples two axes.
fn entries(result: &PlantResult, term: Basis) -> Vec<Entry<'_>> {
    match term {
        Basis::Mass(i, j) => {
            [[i, j], [j, i]].map(|at| ("mass_matrix", &result.mass_matrix, at)).into()
        }
        Basis::Product(on, product) => Dof::ALL
            .into_iter()
            .filter_map(|of| match product {
                product if product == Product::linear(of) => {
                    Some(("linear_damping", &result.linear_damping, [on, of]))
                }
                product if product == Product::quadratic(of) => {
                    Some(("quadratic_damping", &result.quadratic_damping, [on, of]))
                }
                _ => None,
            })
            .collect(),
        _ => Vec::new(),
    }
}

/// Checks a value, its standard deviation, and the ends of its interval.
fn check_numbers(key: &str, [value, std, low95, high95]: [f64; 4]) -> Result<(), Error> {
    let all = [("value", value), ("low95", low95), ("high95", high95)];
    if let Some((name, x)) = all.into_iter().find(|(_, x)| !x.is_finite()) {
        return Err(contradiction(
            format!("{key}.{name}"),
            &format!("is {x}, not a finite number"),
        ));
    }
    if !is_possible_std(std) {
        let reason = format!("is {std}; a standard deviation is finite and not below zero");
        return Err(contradiction(format!("{key}.std"), &reason));
    }
    Ok(())
}

fn are_close(one: f64, other: f64) -> bool {
    one == other || (one - other).abs() <= ROUNDING * one.abs().max(other.abs())
}

fn contradiction(key: String, reason: &str) -> Error {
    Error::ResultsNumber { key, reason: reason.to_owned() }
}
