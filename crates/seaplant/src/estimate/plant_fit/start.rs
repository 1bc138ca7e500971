//! Start of a fit: the optimum from the likeliest of several initial points.

use super::actuator::Actuator;
use super::descent::{Optimum, Tolerance};
use super::equation_error::{self, Solved};
use super::problem::{Point, Problem, first_noise};
use super::{Fitted, free, search};
use crate::plant::{Basis, Parameterisation, Plant};
use crate::signal::rms;
use crate::{Error, Timed, TrialRecord};

/// Lengths of the test functions for equation error, s: short for small vehicles, long for ships.
const WINDOWS_S: [f64; 5] = [0.6, 1.2, 3.0, 8.0, 20.0];

/// A plant from which a fit may begin.
pub(super) struct FirstPlant {
    pub(super) found: Solved,
    /// How late thrust acts after its log, s.
    pub(super) late_s: f64,
}

/// A lag starts no lower, s: at its limit, zero, it could not say which way to go.
pub(super) const LEAST_LAG_S: f64 = 0.05;

/// Finds the first optimum. If the fit does not converge, starts from one with fewer terms: first
/// without products of three or more velocities, then without couplings.
///
/// # Errors
/// The error of the complete structure, if fewer terms are not possible or do not help.
pub(super) fn begun(
    problem: Problem,
    records: &[&TrialRecord],
) -> Result<(Plant, Solved, Fitted), Error> {
    begun_beside(problem, records, &[])
}

/// As [`begun`], with some starts beside those by equation error.
pub(super) fn begun_beside(
    problem: Problem,
    records: &[&TrialRecord],
    others: &[FirstPlant],
) -> Result<(Plant, Solved, Fitted), Error> {
    let refused = match first_optimum(&problem, records, others) {
        Ok((start, found, optimum)) => {
            return Ok((start, found, Fitted::new(problem, optimum)));
        }
        Err(error) => error,
    };
    let without = |is_left_out: fn(&Basis) -> bool| {
        let lower = problem.structure.without(is_left_out);
        (lower.terms().len() < problem.structure.terms().len()).then_some(lower)
    };
    for lower in [without(is_high), without(is_coupling)].into_iter().flatten() {
        let lower = problem.with_terms(lower);
        let Ok((start, found, optimum)) = first_optimum(&lower, records, &[]) else { continue };
        let start_of_complete = search::widened(&problem, &lower, &optimum.point);
        if let Ok(optimum) = problem.optimum(start_of_complete, Tolerance::COARSE) {
            return Ok((start, found, Fitted::new(problem, optimum)));
        }
    }
    Err(refused)
}

/// Returns true if a term is a product of three or more velocities.
fn is_high(term: &Basis) -> bool {
    matches!(term, Basis::Product(_, product) if product.factors().count() > 2)
}

/// Returns true if a term couples axes.
fn is_coupling(term: &Basis) -> bool {
    match term {
        Basis::Mass(a, b) => a != b,
        Basis::Product(axis, product) => product.factors().any(|factor| factor.of != *axis),
        _ => false,
    }
}

/// Finds the optimum from the likeliest of several starts; tries the next if it does not converge.
///
/// # Errors
/// The error of the likeliest start, if none converges.
fn first_optimum(
    problem: &Problem,
    records: &[&TrialRecord],
    others: &[FirstPlant],
) -> Result<(Plant, Solved, Optimum), Error> {
    // The likelihood may have several optima: of plants that are stated, the likeliest.
    let optimum = |first: &FirstPlant| {
        let point = stated_point(problem, records, first);
        let start = problem.plant(&point.free).ok()?;
        let optimum = problem.optimum(point, Tolerance::COARSE).ok()?;
        Some((start, first.found.clone(), optimum))
    };
    let stated = others.iter().filter_map(optimum);
    if let Some(best) = stated.min_by(|a, b| a.2.cost.total_cmp(&b.2.cost)) {
        return Ok(best);
    }
    let mut refused = None;
    let tries = if problem.has_rival() { 1 } else { usize::MAX };
    let mut starts = starts(problem, records, &mut refused);
    if problem.is_free {
        starts = problem.nearer(starts);
    }
    for (point, found) in starts.into_iter().take(tries) {
        let start = problem.plant(&point.free)?;
        match problem.optimum(point, Tolerance::COARSE) {
            Ok(optimum) => return Ok((start, found, optimum)),
            Err(error) => {
                refused.get_or_insert(error);
            }
        }
    }
    Err(refused.unwrap_or(Error::TooShort { name: "the fit".to_owned(), found: 0, needed: 1 }))
}

/// Computes starts by equation error with test functions of several lengths, sorted by cost.
fn starts(
    problem: &Problem,
    records: &[&TrialRecord],
    refused: &mut Option<Error>,
) -> Vec<(Point, Solved)> {
    let mut found = Vec::new();
    let pieces = problem.in_pieces();
    for window_s in WINDOWS_S {
        let (structure, physical) = (&problem.structure, &problem.physical);
        match equation_error::fits(structure, physical, records, window_s) {
            Ok(fits) => found.extend(fits.into_iter().map(|least_squares| {
                let point = first_point(problem, records, &least_squares);
                let cost = pieces.as_ref().unwrap_or(problem).cost(&point);
                if cost.is_finite() {
                    return (cost, point, least_squares);
                }
                // Noise of rates made the vehicle so light that its own drag throws it about.
                let least_squares = heavier(problem, records, least_squares);
                let point = first_point(problem, records, &least_squares);
                let cost = pieces.as_ref().unwrap_or(problem).cost(&point);
                (cost, point, least_squares)
            })),
            Err(error) => drop(refused.get_or_insert(error)),
        }
    }
    if found.iter().any(|(cost, ..)| cost.is_finite()) {
        *refused = None;
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, point, least_squares)| (point, least_squares)).collect()
}

/// A plant that is no lighter on any axis than what its logged force would accelerate as it moved, with nothing
/// else there: `rms(τ_i)/rms(ν̇_i)`.
fn heavier(problem: &Problem, records: &[&TrialRecord], mut found: Solved) -> Solved {
    for dof in problem.structure.axes() {
        let axis = dof.index();
        let force = rms(records
            .iter()
            .filter_map(|own| own.force[axis].as_ref())
            .flat_map(|own| own.values()));
        let velocities = records.iter().filter_map(|own| own.velocity[axis].as_ref());
        let acceleration = rms(velocities.flat_map(changes));
        let term = problem.structure.index_of(&Basis::Mass(*dof, *dof));
        if let Some(k) = term.filter(|_| acceleration > 0.0) {
            found.coefficients[k] = found.coefficients[k].max(force / acceleration);
        }
    }
    found
}

/// Accelerations between instants that are so far apart that noise of single samples matters little.
fn changes(velocity: &Timed) -> Vec<f64> {
    let times = velocity.time_s().iter().zip(velocity.values());
    let last_s = velocity.last_s();
    let of = |(t, value): (&f64, &f64)| (velocity.held_at(t + APART_S) - value) / APART_S;
    times.filter(|(t, _)| *t + APART_S <= last_s).map(of).collect()
}

/// Time between them, s.
const APART_S: f64 = 0.5;

/// The point of a stated plant.
fn stated_point(problem: &Problem, records: &[&TrialRecord], first: &FirstPlant) -> Point {
    let FirstPlant { found, late_s } = first;
    let mut point = first_point(problem, records, found);
    // What comes late may lag or be delayed; in doubt, half and half.
    let mut numbers = point.actuator.numbers();
    for k in [Actuator::LAG, Actuator::DELAY].into_iter().filter(|k| problem.fits[*k]) {
        numbers[k] = (0.5 * late_s).max(if k == Actuator::LAG { LEAST_LAG_S } else { 0.0 });
    }
    point.actuator = point.actuator.with(numbers);
    point
}

fn first_point(problem: &Problem, records: &[&TrialRecord], least_squares: &Solved) -> Point {
    let mut point = Point {
        free: problem.physical.free(&least_squares.coefficients),
        actuator: problem.first_actuator,
        currents: vec![[0.0; 2]; records.len()],
        noise: first_noise(problem, &least_squares.residual),
        jitter_of: problem.first_actuator,
    };
    if problem.is_free {
        point.noise = free::first_noise(problem, records);
        problem.in_pieces().as_ref().unwrap_or(problem).step_misfit(&mut point, Tolerance::COARSE);
    }
    point
}

#[cfg(test)]
mod tests {
    use super::super::schedule::Attitude;
    use super::super::tests::{planar, record};
    use super::*;

    #[test]
    fn a_start_is_as_heavy_as_what_its_force_accelerates() {
        let plant = planar();
        let record = record(&plant, "a", 1, 20, 0.005);
        let records = [&record];
        let problem = Problem::new(plant.structure(), &records, None, false, Attitude::Known);
        let mut light = equation_error::fits(plant.structure(), &problem.physical, &records, 3.0)
            .expect("a fit")
            .remove(0);
        let masses = plant.structure().terms().iter().enumerate();
        let masses: Vec<usize> = masses
            .filter(|(_, term)| matches!(term, Basis::Mass(i, j) if i == j))
            .map(|(k, _)| k)
            .collect();
        masses.iter().for_each(|k| light.coefficients[*k] *= 1e-3);
        let found = heavier(&problem, &records, light.clone());
        for (k, before) in light.coefficients.iter().enumerate() {
            let (now, truth) = (found.coefficients[k], plant.coefficients()[k]);
            match masses.contains(&k) {
                // Drag and coupling take most of the force.
                true => assert!((1.0..10.0).contains(&(now / truth)), "{k}: {now} {truth}"),
                false => assert_eq!(now, *before, "{k}"),
            }
        }
        assert_eq!(heavier(&problem, &records, found.clone()), found);
    }
}
