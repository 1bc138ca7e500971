//! Couplings in damping that the trials ask for, beside the usual terms.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::problem::{Point, Problem};
use super::uncertainty::inverse;
use crate::plant::{Basis, EffectForce, Parameterisation, Plant, Product, Structure, Symmetry};
use crate::{Dof, Error, TrialRecord};

/// A term that was tried, and what came of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The name of the term.
    pub name: String,
    /// Whether the plant has it.
    pub admitted: bool,
    /// Twice what the log-likelihood gains by it, beside all others that are admitted.
    pub likelihood_ratio: f64,
    /// How often chance alone would make as large a gain.
    pub p_value: f64,
}

/// Gains above this, times the whiteness statistic of their axis, admit a term, and keep it beside
/// the others: chance makes as much once in 100 000, and correlated innovations exaggerate in
/// proportion.
pub(super) const ADMITTED: f64 = 20.0;

/// Another law with as many numbers must gain this much, twice the log-likelihood, to replace the usual one:
/// odds of seven to one.
pub(super) const CLEAR_GAIN: f64 = 4.0;

/// The same of motion left to itself, by how many samples say as much as one: chance makes as much
/// once in 400.
pub(super) const ADMITTED_OF_FREE: f64 = 9.0;

/// Linear and quadratic damping of an axis by another that its mass may couple with, or the terms
/// that the structure says; and effects.
pub(super) fn candidates(structure: &Structure) -> Vec<Basis> {
    let axes = structure.axes();
    let symmetry = match structure.symmetry() {
        Symmetry::Diagonal => Symmetry::PortStarboard,
        stated => stated,
    };
    let mut all = structure.tried().map(<[Basis]>::to_vec).unwrap_or_default();
    let usual = if structure.tried().is_some() { &[] } else { axes };
    for &on in usual {
        for &of in axes.iter().filter(|of| **of != on && symmetry.couples(on, **of)) {
            all.push(Basis::Product(on, Product::linear(of)));
            all.push(Basis::Product(on, Product::quadratic(of)));
        }
    }
    all.extend((0..structure.effects().len()).map(Basis::Effect));
    // Those of which something is known before go together, and are asked for by themselves.
    all.retain(|term| structure.index_of(term).is_none() && structure.prior_std(term).is_none());
    all
}

/// The same with a constant force on each axis that thrusters push along, where the structure says
/// nothing of what is tried: a tether, a trim that is off, or a thruster that pushes at rest. Weight
/// beyond buoyancy is that of heave; a lever of weight and buoyancy that of roll and pitch.
///
/// Beside a current, only a change of course tells a force along surge and sway.
pub(super) fn with_constants(
    structure: &Structure,
    records: &[&TrialRecord],
) -> Result<Structure, Error> {
    if structure.tried().is_some() {
        return Ok(structure.clone());
    }
    let is_driven = |dof: &&Dof| records.iter().any(|record| record.force[dof.index()].is_some());
    let driven = structure.axes().iter().filter(is_driven);
    let constants: Vec<Basis> = driven
        .filter_map(|dof| match dof {
            Dof::Surge | Dof::Sway | Dof::Yaw => Some(Basis::One(*dof)),
            Dof::Heave => None,
            Dof::Roll => Some(Basis::Lever(1)),
            Dof::Pitch => Some(Basis::Lever(0)),
        })
        .filter(|term| structure.index_of(term).is_none())
        .collect();
    with_all(structure, &constants)
}

/// The slope of the likelihood by candidates beside a fitted plant.
pub(super) struct Beside {
    /// By each of them …
    pub(super) gradient: DVector<f64>,
    /// … and where all that is fitted has made its step.
    pub(super) beyond: DVector<f64>,
    /// The information on them alone …
    pub(super) information: DMatrix<f64>,
    /// … and what of it is left beside all that is fitted.
    pub(super) left: DMatrix<f64>,
}

impl Beside {
    /// The step that all of them ask for.
    pub(super) fn step(&self) -> DVector<f64> {
        -(inverse(&self.left) * &self.beyond)
    }
}

/// The slope by candidates, from one pass of the filter.
pub(super) fn beside(base: &Problem, point: &Point, candidates: &[Basis]) -> Result<Beside, Error> {
    let wide = base.with_terms(with_all(&base.structure, candidates)?);
    let (p, n) = (base.structure.terms().len(), candidates.len());
    let (slope, _) =
        wide.by_plant(&widened(&wide, base, point)).ok_or_else(|| refused(&wide.structure))?;
    let own: Vec<usize> = (p..p + n).collect();
    let rest: Vec<usize> = (0..p).chain(p + n..slope.gradient.len()).collect();
    let columns = slope.information.select_columns(&own);
    let (information, cross) = (columns.select_rows(&own), columns.select_rows(&rest));
    let of_rest = inverse(&slope.information.select_rows(&rest).select_columns(&rest));
    let gradient = slope.gradient.select_rows(&own);
    let by_rest = cross.transpose() * of_rest;
    let beyond = &gradient - &by_rest * slope.gradient.select_rows(&rest);
    let left = &information - by_rest * &cross;
    Ok(Beside { gradient, beyond, information, left })
}

/// What each candidate would gain in likelihood beside the fitted plant, to second order:
/// Rao's score test, from one pass of the filter.
///
/// # Source
/// \[Rao1948\].
pub(super) fn scores(
    base: &Problem,
    point: &Point,
    candidates: &[Basis],
) -> Result<Vec<f64>, Error> {
    let Beside { gradient, information, left, .. } = beside(base, point, candidates)?;
    let of = |(k, candidate): (usize, &Basis)| {
        let is_barred = gradient[k] > 0.0
            && matches!(candidate, Basis::Effect(k) if base.structure.effects()[*k].is_positive());
        let is_told = left[(k, k)] > COLLINEAR_PART * information[(k, k)];
        if is_told && !is_barred { gradient[k].powi(2) / left[(k, k)] } else { 0.0 }
    };
    Ok(candidates.iter().enumerate().map(of).collect())
}

/// A candidate of whose information less than this is left beside the others is not told.
const COLLINEAR_PART: f64 = 1e-4;

/// The term that may be there in the place of another: inflow of thrusters that push the way they
/// move for that of all.
pub(super) fn rival(structure: &Structure, term: &Basis) -> Option<Basis> {
    let is_ahead = |k: usize| match structure.effects()[k].force {
        EffectForce::Inflow { ahead, .. } => Some(ahead),
        _ => None,
    };
    let Basis::Effect(own) = *term else { return None };
    let own = is_ahead(own)?;
    (0..structure.effects().len()).find(|k| is_ahead(*k) == Some(!own)).map(Basis::Effect)
}

/// Two of some terms that are lift of the hull along an axis, and those at the two places that are next to where both
/// act together; `None` if these are the two already, or there are not two.
pub(super) fn nearer_lifts(
    plant: &Plant,
    terms: &[Basis],
    along: Dof,
) -> Option<([Basis; 2], [Basis; 2])> {
    let structure = plant.structure();
    let place = |term: Basis| {
        let (axis, at_m) = structure.lift_of_hull(&term)?;
        (axis == along).then_some((term, at_m))
    };
    let lifts: Vec<(Basis, f64)> = terms.iter().filter_map(|term| place(*term)).collect();
    let [(one, one_m), (two, two_m)] = lifts[..] else { return None };
    let [of_one, of_two] = [plant.coefficient(&one)?, plant.coefficient(&two)?];
    let (lift, moment) = (of_one + of_two, of_one * one_m + of_two * two_m);
    let all = || (0..structure.effects().len()).filter_map(|k| place(Basis::Effect(k)));
    let aft = all().filter(|(_, at_m)| at_m * lift <= moment);
    let fore = all().filter(|(_, at_m)| at_m * lift > moment);
    let (aft, _) = aft.max_by(|a, b| a.1.total_cmp(&b.1))?;
    let (fore, _) = fore.min_by(|a, b| a.1.total_cmp(&b.1))?;
    let are_new = [aft, fore].iter().any(|term| ![one, two].contains(term));
    are_new.then_some(([one, two], [aft, fore]))
}

/// The axis whose innovations tell of a term: that it acts on most; of a rudder, which acts on
/// surge only when it is turned, yaw.
fn main_axis(structure: &Structure, term: &Basis) -> Dof {
    if let Some(along) = lifts_along(structure, term) {
        return along;
    }
    let axes = structure.axes_of(term);
    let first = if matches!(term, Basis::Effect(_)) { axes.last() } else { axes.first() };
    first.copied().unwrap_or(structure.axes()[0])
}

/// The axis along which lift of the hull acts.
fn lifts_along(structure: &Structure, term: &Basis) -> Option<Dof> {
    structure.lift_of_hull(term).map(|(along, _)| along)
}

pub(super) fn with_all(structure: &Structure, terms: &[Basis]) -> Result<Structure, Error> {
    terms.iter().try_fold(structure.clone(), |structure, term| structure.with(*term))
}

fn refused(structure: &Structure) -> Error {
    Error::Plant {
        axes: structure.name(),
        reason: "its simulation diverges; leave terms out".to_owned(),
    }
}

/// The candidates whose scores admit them: those that pass whatever the whiteness of their axis
/// exaggerates, and of each axis the one that gains most, whose lack may be what colours it. Of places of the hull's
/// lift along an axis, which are much alike, one at a time.
pub(super) fn admitted(
    structure: &Structure,
    candidates: &[Basis],
    scores: &[f64],
    (needed, whiteness): (f64, impl Fn(Dof) -> f64),
) -> Vec<Basis> {
    let best = |axis: Dof| {
        let own =
            candidates.iter().zip(scores).filter(|(term, _)| main_axis(structure, term) == axis);
        own.map(|(_, score)| *score).fold(0.0, f64::max)
    };
    let passes = |(term, &score): (&Basis, &f64)| {
        let axis = main_axis(structure, term);
        let needed = needed.min(needed_of_place(structure, term, structure.terms()));
        let is_admitted = score > needed * whiteness(axis) || score > needed && score >= best(axis);
        is_admitted.then_some((*term, score))
    };
    let mut passing: Vec<(Basis, f64)> = candidates.iter().zip(scores).filter_map(passes).collect();
    let along = |term: &Basis| lifts_along(structure, term);
    let mut best = BTreeMap::new();
    for (axis, score) in passing.iter().filter_map(|(term, x)| Some((along(term)?, *x))) {
        let most = best.entry(axis).or_insert(score);
        *most = most.max(score);
    }
    passing.retain(|(term, score)| along(term).is_none_or(|axis| best[&axis] == *score));
    passing.into_iter().map(|(term, _)| term).collect()
}

/// The gain that lift of the hull needs beside one of the same axis at another place: the place of lift is a number of
/// it, and that between two of those that are tried has a part at both. Infinite for other terms.
fn needed_of_place(structure: &Structure, term: &Basis, beside: &[Basis]) -> f64 {
    let along = lifts_along(structure, term);
    let is_alike = |other: &&Basis| *other != term && lifts_along(structure, other) == along;
    let is_second = along.is_some() && beside.iter().filter(is_alike).count() == 1;
    if is_second { CLEAR_GAIN } else { f64::INFINITY }
}

/// The terms of a wider plant to drop: one after the other those worth least beside the others,
/// while that is too little; the least of all if one has to go anyway.
///
/// What is left when one goes follows from the covariance C, to second order of the likelihood:
/// `θ − C_k θ_k/C_kk` and `C − C_k C_kᵀ/C_kk`.
pub(super) fn dropped(
    terms: &[Basis],
    plant: &Plant,
    covariance: &DMatrix<f64>,
    (needed, whiteness): (f64, impl Fn(Dof) -> f64),
    one_must_go: bool,
) -> Vec<Basis> {
    let structure = plant.structure();
    let mut left: Vec<(usize, Basis)> =
        terms.iter().filter_map(|term| Some((structure.index_of(term)?, *term))).collect();
    let mut theta = DVector::from_column_slice(plant.coefficients());
    let (mut c, mut gone) = (covariance.clone(), Vec::<Basis>::new());
    while !left.is_empty() {
        let beside: Vec<Basis> =
            structure.terms().iter().filter(|term| !gone.contains(term)).copied().collect();
        // The part that each is worth of what it needs.
        let worth = |(k, term): &(usize, Basis)| {
            let needed = needed.min(needed_of_place(structure, term, &beside));
            theta[*k].powi(2) / c[(*k, *k)] / whiteness(main_axis(structure, term)) / needed
        };
        let worths = left.iter().map(worth).enumerate();
        let least = worths.min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((at, worth)) = least else { break };
        let is_first_of_must = one_must_go && gone.is_empty();
        if worth >= 1.0 && !is_first_of_must {
            break;
        }
        let (k, term) = left.remove(at);
        let column = c.column(k) / c[(k, k)];
        theta -= &column * theta[k];
        c -= &column * c.row(k).into_owned();
        gone.push(term);
    }
    gone
}

/// What came of every candidate.
pub(super) fn tried(
    structure: &Structure,
    candidates: &[Basis],
    scores: &BTreeMap<Basis, f64>,
    admitted: &[Basis],
    worths: &BTreeMap<Basis, f64>,
) -> Vec<Tried> {
    let of = |term: &Basis| {
        let gain = worths.get(term).or_else(|| scores.get(term));
        let likelihood_ratio = gain.copied().unwrap_or(0.0);
        Tried {
            name: structure.name_of(term),
            admitted: admitted.contains(term),
            likelihood_ratio,
            p_value: p_value(likelihood_ratio),
        }
    };
    candidates.iter().map(of).collect()
}

/// What chance alone gains as often.
fn p_value(likelihood_ratio: f64) -> f64 {
    // One degree of freedom makes a distribution.
    ChiSquared::new(1.0).map_or(1.0, |chi| chi.sf(likelihood_ratio.max(0.0)))
}

/// A start for a wider structure: what is fitted, and no more than that.
pub(super) fn widened(problem: &Problem, from: &Problem, point: &Point) -> Point {
    let old = from.physical.coefficients(&point.free);
    let structure = &problem.structure;
    let coefficients = DVector::from_fn(structure.terms().len(), |k, _| {
        from.structure.index_of(&structure.terms()[k]).map_or(0.0, |j| old[j])
    });
    let mut free = problem.physical.free(&coefficients);
    // Free numbers of terms that both have are kept to the last digit.
    for (k, term) in structure.terms().iter().enumerate() {
        if let Some(j) = from.structure.index_of(term) {
            free[k] = point.free[j];
        }
    }
    Point { free, ..point.clone() }
}

/// Whether damping takes power: D_l has no negative power at all, and all of it has none at the
/// velocities of the trials.
pub(super) fn is_dissipative(plant: &Plant, records: &[&TrialRecord]) -> bool {
    let linear = plant.linear_damping();
    let eigenvalues = (&linear + linear.transpose()).symmetric_eigenvalues();
    if eigenvalues.min() < -ROUNDING_PART * eigenvalues.max() {
        return false;
    }
    let of = |record: &&TrialRecord| {
        let (worst, greatest) = damping_power(plant, record);
        worst >= -NEGLIGIBLE_POWER * greatest
    };
    records.iter().all(of)
}

/// The least and the greatest power of damping at the velocities of a trial, W.
pub(crate) fn damping_power(plant: &Plant, record: &TrialRecord) -> (f64, f64) {
    let times = record.velocity.iter().flatten().next().map(crate::Timed::time_s);
    let mut range = (0.0_f64, 0.0_f64);
    for &t in times.into_iter().flatten() {
        let power = plant.damping_power(&record.velocity_at(t));
        range = (range.0.min(power), range.1.max(power));
    }
    range
}

/// Power below this part of the greatest is that of a term that hardly matters.
pub(crate) const NEGLIGIBLE_POWER: f64 = 1e-3;

/// An eigenvalue below this part of the greatest is rounding.
const ROUNDING_PART: f64 = 1e-9;
