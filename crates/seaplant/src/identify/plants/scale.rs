//! What known forces say of the scale of thrust.

use std::cmp::Ordering;

use super::known::OtherScale;
use super::restoring::{restoring_refutes, restoring_says};
use crate::caveat::spoken;
use crate::estimate::{Actuator, PlantFit, ScaleClaim};
use crate::motion::{KnownForce, KnownKind};
use crate::{Caveat, CaveatCode, ThrustUncertainty, TrialRecord, Vehicle};

/// A scale of thrust that is not known better than that says nothing: half of its interval.
pub(in crate::identify) const WIDEST_SCALE: f64 = 0.2;

/// So many stated standard deviations from 1 is another thruster.
const CONTRADICTS: f64 = 3.0;

/// The scale of thrust by known forces, and half of its 95 % interval; none without known forces.
pub(super) fn scale(fit: &PlantFit) -> Option<(f64, f64)> {
    let std = fit.actuator_std[Actuator::SCALE];
    let scale = fit.actuator.log_scale.exp();
    Some((scale, 1.96 * scale * std?))
}

/// Returns why thrust has another scale, if two of what is stated say so: mass, weight in water and righting
/// lever. One may be wrong by itself, as with water in the hull or a guessed centre of gravity; but masses below those of
/// any body of that mass are impossible, unless known forces tell the scale.
pub(super) fn refuted(
    fit: &PlantFit,
    vehicle: &Vehicle,
    by_mass: Option<&OtherScale>,
    is_scale_known: bool,
) -> Option<&'static str> {
    if by_mass.is_some_and(|other| restoring_says(fit, vehicle, other.way)) {
        Some(SCALE_BY_MASS)
    } else if restoring_refutes(fit, vehicle) {
        Some(SCALE_BY_LEVER)
    } else {
        let is_below = by_mass.is_some_and(|other| other.way == Ordering::Less) && !is_scale_known;
        is_below.then_some(SCALE_BELOW_BODIES)
    }
}

/// Why no axis may be trusted where masses are below those of any body.
const SCALE_BELOW_BODIES: &str = "the masses of surge, sway and heave are together less than those of any body of the stated mass: thrust has another scale, and with it all masses and drags, or the stated mass is wrong";

/// Why no axis may be trusted where mass and restoring refute the scale of thrust.
const SCALE_BY_MASS: &str = "the stated mass and the stated weight and buoyancy both say that thrust has another scale, and with it all masses and drags";

/// Why no axis may be trusted where weight in water and righting lever do.
const SCALE_BY_LEVER: &str = "the stated weight in water and righting lever both say that thrust has another scale, and with it all masses and drags";

/// Reports what fixed the scale of thrust, and to what accuracy; or that nothing did.
pub(super) fn doubts(fit: &PlantFit, records: &[&TrialRecord]) -> Vec<Caveat> {
    let Some((scale, half)) = scale(fit) else { return Vec::new() };
    if let Some(caveat) = contradiction(&fit.claims) {
        return std::iter::once(caveat).chain(beside_stated(scale, records)).collect();
    }
    let by = forces(records).join(" and ");
    let (s, h) = (digits(scale), digits(half));
    if half > WIDEST_SCALE * scale {
        let message = format!(
            "{by} determine the scale of thrust only to {s} ± {h}; hang on a heavier weight, several times, and hover with and without it"
        );
        return vec![Caveat::warning(CaveatCode::ThrustScale, message)];
    }
    let message = format!(
        "{by} fix the scale of thrust: it is {s} ± {h} (95 %) times what curves and logs say, and masses, drag and forces are those of this thrust"
    );
    let told = Caveat::note(CaveatCode::ThrustScaleKnown, message);
    std::iter::once(told).chain(beside_stated(scale, records)).collect()
}

/// That known forces say different things of the scale.
fn contradiction(claims: &[ScaleClaim]) -> Option<Caveat> {
    let scales = || claims.iter().map(|claim| claim.scale);
    let (least, most) = (scales().fold(f64::INFINITY, f64::min), scales().fold(0.0, f64::max));
    let said = |claim: &ScaleClaim| {
        let (scale, half) = (digits(claim.scale), digits(1.96 * claim.std));
        format!("{scale} ± {half} by {}", in_words(&claim.force))
    };
    let all: Vec<String> = claims.iter().map(said).collect();
    (!claims.is_empty()).then(|| {
        let message = format!(
            "known forces contradict each other: thrust is {} (95 %) times what curves and logs say, each by itself, and what is fitted lies between; check the size, the times and the direction of each, and give std_n of one that is known less well",
            all.join(", and ")
        );
        match most > MOST_APART * least {
            true => Caveat::severe(CaveatCode::ThrustScale, message),
            false => Caveat::warning(CaveatCode::ThrustScale, message),
        }
    })
}

/// Known forces that are further apart than this are no help.
const MOST_APART: f64 = 1.25;

/// That the scale is not that which the vehicle file states.
fn beside_stated(scale: f64, records: &[&TrialRecord]) -> Option<Caveat> {
    let thrusters = records.iter().flat_map(|record| &record.thrusters);
    let stated = ThrustUncertainty::greatest(thrusters.map(|own| own.track.uncertainty));
    let stated = stated.forward.max(stated.reverse);
    (stated > 0.0 && scale.ln().abs() > CONTRADICTS * stated).then(|| {
        let message = format!(
            "known forces say that thrust is {} times what curves say, but thrust_uncertainty states {} % of it: check the weight, its times and the curves",
            digits(scale),
            spoken(100.0 * stated)
        );
        Caveat::warning(CaveatCode::ThrustScale, message)
    })
}

/// The known forces of trials in words, each once.
fn forces(records: &[&TrialRecord]) -> Vec<String> {
    let mut all: Vec<(&KnownForce, usize)> = Vec::new();
    for force in records.iter().flat_map(|record| &record.known) {
        match all.iter_mut().find(|(own, _)| own.is_same(force)) {
            Some((_, times)) => *times += 1,
            None => all.push((force, 1)),
        }
    }
    let said = |(force, times): (&KnownForce, usize)| {
        let times = if times > 1 { format!(", {times} times") } else { String::new() };
        format!("{}{times}", in_words(force))
    };
    all.into_iter().map(said).collect()
}

fn in_words(force: &KnownForce) -> String {
    let what = match force.kind {
        KnownKind::Weight { .. } => "weight",
        KnownKind::Line { .. } => "line",
    };
    format!("a {what} of {} N", spoken(force.size_n()))
}

fn digits(x: f64) -> String {
    format!("{x:.3}")
}
