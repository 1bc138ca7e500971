//! Consistency checks of results in a file.

use super::file::{basis_of_name, is_possible_std};
use crate::plant::{Basis, Product};
use crate::results::{FittedPlant, MatrixResult, Parameter, PlantResult, Results};
use crate::{Dof, Error, LumpedParameters};

/// Relative rounding of a writer and a reader.
const ROUNDING: f64 = 1e-6;

/// Compares numbers that results contain twice, and refuses impossible standard deviations.
///
/// `parameters` and `lumped` describe one plant, as do `plants.DOF` and `methods.DOF.METHOD`, and
/// the coefficients and matrices of a plant of several axes.
///
/// # Errors
/// [`Error::ResultsNumber`] with both values of the first number that contradicts another; also for
/// a number that is not finite, or a negative standard deviation.
pub fn check_results(results: &Results) -> Result<(), Error> {
    for (dof, plant) in &results.plants {
        let path = format!("plants.{dof}");
        check_plant(&path, plant)?;
        let of_method = results.methods.get(dof).and_then(|methods| methods.get(&plant.method));
        if let Some(other) = of_method {
            check_same(&path, plant, &format!("methods.{dof}.{}", plant.method), other)?;
        }
    }
    for (dof, methods) in &results.methods {
        for (method, plant) in methods {
            check_plant(&format!("methods.{dof}.{method}"), plant)?;
        }
    }
    results.coupled.iter().try_for_each(|(name, plant)| check_fitted_plant(name, plant))
}

/// Returns the parameters of a plant with their names in results; those not fitted are absent.
fn named(plant: &PlantResult) -> [(&'static str, Option<&Parameter>); 4] {
    let p = &plant.parameters;
    [
        ("mass", Some(&p.mass)),
        ("quadratic_drag", p.quadratic_drag.as_ref()),
        ("linear_drag", p.linear_drag.as_ref()),
        ("bias_force", p.bias_force.as_ref()),
    ]
}

fn check_plant(path: &str, plant: &PlantResult) -> Result<(), Error> {
    for (name, parameter) in named(plant) {
        let Some(parameter) = parameter else { continue };
        check_parameter(&format!("{path}.parameters.{name}"), parameter)?;
    }
    for (name, parameter) in &plant.nuisances {
        check_parameter(&format!("{path}.nuisances.{name}"), parameter)?;
    }
    check_lumped(path, plant)
}

/// Checks `m = 1/α`, `d_Q = −β m`, `d_L = −μ m`, `b = −bias m`.
fn check_lumped(path: &str, plant: &PlantResult) -> Result<(), Error> {
    let LumpedParameters { alpha, beta, mu, bias } = plant.lumped;
    let mass = plant.parameters.mass.value;
    let lumped = [("alpha", alpha), ("beta", beta), ("mu", mu), ("bias", bias)];
    for ((name, parameter), (lumped_name, lumped)) in named(plant).into_iter().zip(lumped) {
        let value = parameter.map_or(0.0, |parameter| parameter.value);
        let from_parameters = if name == "mass" { 1.0 / value } else { -value / mass };
        if !are_close(from_parameters, lumped) {
            let reason = format!(
                "is {value}, which makes {lumped_name} {from_parameters}, but {path}.lumped.{lumped_name} is {lumped}"
            );
            return Err(contradiction(format!("{path}.parameters.{name}"), &reason));
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
    let value = |parameter: Option<&Parameter>| parameter.map_or(0.0, |p| p.value);
    for ((name, here), (_, there)) in named(plant).into_iter().zip(named(other)) {
        let (here, there) = (value(here), value(there));
        if !are_close(here, there) {
            let reason = format!("is {here}, but {other_path}.parameters.{name} is {there}");
            return Err(contradiction(format!("{path}.parameters.{name}"), &reason));
        }
    }
    Ok(())
}

fn check_fitted_plant(name: &str, result: &FittedPlant) -> Result<(), Error> {
    let path = format!("coupled.{name}");
    for (coefficient, x) in &result.parameters {
        let numbers = [x.value, x.std, x.low95, x.high95];
        check_numbers(&format!("{path}.parameters.\"{coefficient}\""), numbers)?;
    }
    for (nuisance, parameter) in &result.nuisances {
        check_parameter(&format!("{path}.nuisances.{nuisance}"), parameter)?;
    }
    for (coefficient, x) in &result.parameters {
        check_entries(&path, result, coefficient, x.value)?;
    }
    Ok(())
}

/// Compares a coefficient with its entries in the matrices, if any.
fn check_entries(
    path: &str,
    result: &FittedPlant,
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
fn entries(result: &FittedPlant, term: Basis) -> Vec<Entry<'_>> {
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
