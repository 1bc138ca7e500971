//! Results as a file holds them: whether numbers that stand twice agree.

use super::file::{basis_of_name, is_possible_std};
use crate::plant::{Basis, Product};
use crate::results::{CoupledPlant, MatrixResult, Parameter, PlantResult, Results};
use crate::{Dof, Error, LumpedParameters};

/// Rounding of a writer and a reader changes less than this part of a number.
const ROUNDING: f64 = 1e-6;

/// Compares the numbers that results hold twice, and refuses standard deviations that cannot be.
///
/// `parameters` and `lumped` are one plant, as are `plants.DOF` and `methods.DOF.METHOD`, and the
/// coefficients and matrices of a plant of several axes.
///
/// # Errors
/// [`Error::ResultsNumber`] names the first number that contradicts another, with both; it also
/// names a number that is not finite, and a standard deviation below zero.
pub fn check_results(results: &Results) -> Result<(), Error> {
    for (dof, plant) in &results.plants {
        let place = format!("plants.{dof}");
        check_plant(&place, plant)?;
        let of_method = results.methods.get(dof).and_then(|methods| methods.get(&plant.method));
        if let Some(other) = of_method {
            check_same(&place, plant, &format!("methods.{dof}.{}", plant.method), other)?;
        }
    }
    for (dof, methods) in &results.methods {
        for (method, plant) in methods {
            check_plant(&format!("methods.{dof}.{method}"), plant)?;
        }
    }
    results.coupled.iter().try_for_each(|(name, plant)| check_coupled(name, plant))
}

/// The parameters of a plant with the names that results give them; those that were not fitted are
/// absent.
fn named(plant: &PlantResult) -> [(&'static str, Option<&Parameter>); 4] {
    let p = &plant.parameters;
    [
        ("mass", Some(&p.mass)),
        ("quadratic_drag", p.quadratic_drag.as_ref()),
        ("linear_drag", p.linear_drag.as_ref()),
        ("bias_force", p.bias_force.as_ref()),
    ]
}

fn check_plant(place: &str, plant: &PlantResult) -> Result<(), Error> {
    for (name, parameter) in named(plant) {
        let Some(parameter) = parameter else { continue };
        check_parameter(&format!("{place}.parameters.{name}"), parameter)?;
    }
    for (name, parameter) in &plant.nuisances {
        check_parameter(&format!("{place}.nuisances.{name}"), parameter)?;
    }
    check_lumped(place, plant)
}

/// `m = 1/α`, `d_Q = −β m`, `d_L = −μ m`, `b = −bias m`.
fn check_lumped(place: &str, plant: &PlantResult) -> Result<(), Error> {
    let LumpedParameters { alpha, beta, mu, bias } = plant.lumped;
    let mass = plant.parameters.mass.value;
    let lumped = [("alpha", alpha), ("beta", beta), ("mu", mu), ("bias", bias)];
    for ((name, parameter), (lumped_name, lumped)) in named(plant).into_iter().zip(lumped) {
        let value = parameter.map_or(0.0, |parameter| parameter.value);
        let from_parameters = if name == "mass" { 1.0 / value } else { -value / mass };
        if !are_close(from_parameters, lumped) {
            let reason = format!(
                "is {value}, which makes {lumped_name} {from_parameters}, but {place}.lumped.{lumped_name} is {lumped}"
            );
            return Err(contradiction(format!("{place}.parameters.{name}"), &reason));
        }
    }
    Ok(())
}

/// Compares the recommended plant with the same plant among those of all methods.
fn check_same(
    place: &str,
    plant: &PlantResult,
    other_place: &str,
    other: &PlantResult,
) -> Result<(), Error> {
    let value = |parameter: Option<&Parameter>| parameter.map_or(0.0, |p| p.value);
    for ((name, here), (_, there)) in named(plant).into_iter().zip(named(other)) {
        let (here, there) = (value(here), value(there));
        if !are_close(here, there) {
            let reason = format!("is {here}, but {other_place}.parameters.{name} is {there}");
            return Err(contradiction(format!("{place}.parameters.{name}"), &reason));
        }
    }
    Ok(())
}

fn check_coupled(name: &str, result: &CoupledPlant) -> Result<(), Error> {
    let place = format!("coupled.{name}");
    for (coefficient, x) in &result.parameters {
        let numbers = [x.value, x.std, x.low95, x.high95];
        check_numbers(&format!("{place}.parameters.\"{coefficient}\""), numbers)?;
    }
    for (nuisance, parameter) in &result.nuisances {
        check_parameter(&format!("{place}.nuisances.{nuisance}"), parameter)?;
    }
    for (coefficient, x) in &result.parameters {
        check_entries(&place, result, coefficient, x.value)?;
    }
    Ok(())
}

/// Compares a coefficient with its entries in the matrices, if it has any.
fn check_entries(
    place: &str,
    result: &CoupledPlant,
    coefficient: &str,
    value: f64,
) -> Result<(), Error> {
    let Ok(term) = basis_of_name(coefficient) else { return Ok(()) };
    let axis = |dof: Dof| result.axes.iter().position(|axis| *axis == dof);
    for (key, matrix, [on, of]) in entries(result, term) {
        let entry = axis(on).zip(axis(of)).and_then(|(i, j)| matrix.value.get(i)?.get(j).copied());
        if entry.is_none_or(|entry| !are_close(entry, value)) {
            let entry = entry.map_or_else(|| "absent".to_owned(), |entry| entry.to_string());
            let reason = format!("is {value}, but {place}.{key} of {on} and {of} is {entry}");
            return Err(contradiction(format!("{place}.parameters.\"{coefficient}\""), &reason));
        }
    }
    Ok(())
}

/// A matrix by its key in results, and the row and column of an entry.
type Entry<'a> = (&'static str, &'a MatrixResult, [Dof; 2]);

/// Where the matrices hold a coefficient: a mass that couples two axes stands twice.
fn entries(result: &CoupledPlant, term: Basis) -> Vec<Entry<'_>> {
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

fn check_parameter(key: &str, parameter: &Parameter) -> Result<(), Error> {
    let Parameter { value, std, low95, high95, .. } = parameter;
    check_numbers(key, [*value, *std, *low95, *high95])
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
