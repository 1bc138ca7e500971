//! Whether the mass and drag of each axis are known, and possible.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use crate::caveat::spoken;
use crate::diagnose::{below_dry_mass, impossible_mass, light_translations};
use crate::estimate::{PlantFit, fit_plant, is_pushed};
use crate::judge::{self, Known, Number, OffBecause};
use crate::plant::{Basis, Product, RigidBody, Structure};
use crate::results::{Coefficient, Parameter, PlantScore};
use crate::signal::rms;
use crate::{Caveat, CaveatCode, Dof, Estimate, Trial, TrialRecord, Vehicle};

/// Doubts about the axes that are pushed; those of others follow from what these do.
pub(super) fn doubts(
    fit: &PlantFit,
    parameters: &BTreeMap<String, Coefficient>,
    records: &[&TrialRecord],
    vehicle: &Vehicle,
) -> Vec<(Dof, Caveat)> {
    let pushed =
        fit.plant.axes().iter().filter(|dof| is_pushed(fit.plant.structure(), records, **dof));
    let of = |&dof: &Dof| {
        let mass = parameter(parameters.get(&Basis::Mass(dof, dof).to_string())?);
        let impossible = impossible_mass(dof, &mass, vehicle);
        let light = below_dry_mass(dof, mass.value, mass.high95, vehicle);
        let speed = usual_speed(dof, records);
        let Parameter { value, std, low95, high95, .. } = mass;
        let mass = Estimate { value, std, low95, high95 };
        let known = Known { dof, mass, speed, drag: drag_at(fit, dof, speed) };
        let all = impossible.into_iter().chain(light).chain(known.undetermined());
        Some(all.map(move |caveat| (dof, caveat)))
    };
    pushed.filter_map(of).flatten().collect()
}

/// That the trials by themselves, without the stated rigid body, give masses below its own; before any fit, where
/// least squares gives such masses of two translations.
///
/// The best plant above the rigid body has nothing to do with such trials, and takes minutes to find.
pub(super) fn refuted_body(
    structure: &Structure,
    records: &[&TrialRecord],
    trials: &[Trial],
    vehicle: &Vehicle,
) -> Option<Caveat> {
    let body = vehicle.rigid_body.as_ref()?.mass_kg();
    below_rigid_body(body, &light_translations(body, trials), structure, records)
}

/// The same after a fit that does not go below the rigid body, where two masses are hardly above it.
pub(super) fn hardly_above_body(
    fit: &PlantFit,
    structure: &Structure,
    records: &[&TrialRecord],
    vehicle: &Vehicle,
) -> Option<Caveat> {
    let body = vehicle.rigid_body.as_ref()?.mass_kg();
    let mass = fit.plant.mass_matrix_of_six();
    let is_light = |dof: &Dof| mass[(dof.index(), dof.index())] < (1.0 + LITTLE_ADDED) * body;
    let light: Vec<Dof> = Dof::ALL[..3].iter().copied().filter(is_light).collect();
    below_rigid_body(body, &light, structure, records)
}

fn below_rigid_body(
    body_kg: f64,
    light: &[Dof],
    structure: &Structure,
    records: &[&TrialRecord],
) -> Option<Caveat> {
    let is_told =
        |dof: &&Dof| structure.axes().contains(dof) && is_pushed(structure, records, **dof);
    let light: Vec<Dof> = light.iter().filter(is_told).copied().collect();
    if light.len() < 2 {
        return None;
    }
    let alone = fit_plant(structure, records, None, false).ok()?;
    let below = |dof: &Dof| {
        let term = Basis::Mass(*dof, *dof);
        let k = alone.plant.structure().index_of(&term)?;
        let (value, std) = (alone.plant.coefficients()[k], alone.std(&term)?);
        (value + CLEARLY * std < body_kg).then(|| (*dof, format!("{} kg in {dof}", spoken(value))))
    };
    let below: Vec<(Dof, String)> = light.iter().filter_map(below).collect();
    let said: Vec<&str> = below.iter().map(|(_, said)| said.as_str()).collect();
    (below.len() > 1).then(|| {
        let message = format!(
            "the trials by themselves give {}, less than the {} kg of the stated rigid body: thrust is too small (its curve, its unit), or the stated mass too large",
            said.join(" and "),
            spoken(body_kg)
        );
        Caveat::severe(CaveatCode::Implausible, message)
    })
}

/// Thrust of another scale, as the masses of surge, sway and heave show it.
pub(super) struct OtherScale {
    /// Too large (`Greater`) or too small.
    pub(super) way: Ordering,
    /// What masses and drags are to be multiplied by, if the vehicle is as published ones are.
    pub(super) times: f64,
    pub(super) caveat: Caveat,
}

impl OtherScale {
    /// The standard deviation of the scale of thrust whose 95 % interval holds that of published vehicles.
    pub(super) fn std(&self) -> f64 {
        ((self.times - 1.0).abs() + UNUSUAL_PART * self.times) / 1.96
    }
}

/// That the masses of surge, sway and heave are together those of no body of the stated mass, or of
/// one that holds water, which shows thrust of another scale.
///
/// ```text
/// Σ m / m_i = 2   (m_i with the added mass of an ellipsoid, of any axes, that floats)
/// ```
///
/// It is 1.59 of BlueROV2 as Wu has it, 1.75 of its heavy variant, 1.65 of RexROV, 1.89 of REMUS 100.
///
/// # Source
/// The factors of added mass of an ellipsoid, α + β + γ = 2: \[Lamb1932, § 114\].
pub(super) fn scale(
    fit: &PlantFit,
    records: &[&TrialRecord],
    vehicle: &Vehicle,
) -> Option<OtherScale> {
    let stated = vehicle.rigid_body.as_ref().map(RigidBody::mass_kg);
    let mass = stated.or(vehicle.dry_mass_kg)?;
    let along = [Dof::Surge, Dof::Sway, Dof::Heave];
    let is_known = |dof: &Dof| {
        fit.plant.axes().contains(dof) && is_pushed(fit.plant.structure(), records, *dof)
    };
    let of_six = fit.plant.mass_matrix_of_six();
    let masses = along.map(|dof| of_six[(dof.index(), dof.index())]);
    along.iter().all(is_known).then(|| of_body(mass, masses))?
}

fn of_body(mass: f64, masses: [f64; 3]) -> Option<OtherScale> {
    let each = masses.map(|of_axis| spoken(of_axis / mass)).join(", ");
    let sum: f64 = masses.iter().map(|of_axis| mass / of_axis).sum();
    let times = sum / USUAL_SUM;
    let (way, why) = if sum < LEAST_SUM {
        let why = format!(
            "much more than a body moves that holds no water: thrust is too large (its curve, its unit), about {:.1} times, or water in the hull or frame moves with it; a known weight that is hung on it tells the scale",
            1.0 / times
        );
        (Ordering::Greater, why)
    } else if sum > MOST_SUM {
        let why = format!(
            "less than any body moves: thrust is too small or velocity too large (the curve, the units), about {times:.1} times, or the stated mass too large"
        );
        (Ordering::Less, why)
    } else {
        return None;
    };
    let message = format!(
        "the masses of surge, sway and heave are {each} times the stated mass, {why} (the sum of their inverses is {}; 2 of an ellipsoid, 1.6 to 1.9 of published vehicles)",
        spoken(sum)
    );
    Some(OtherScale { way, times, caveat: Caveat::warning(CaveatCode::ThrustScale, message) })
}

/// Mean of `Σ m / m_i` of the four published vehicles.
const USUAL_SUM: f64 = 1.72;

/// A published vehicle differs from it by a tenth at most (1.59 to 1.89); twice that is allowed for.
const UNUSUAL_PART: f64 = 0.2;

/// Between these `Σ m / m_i` lies. Of published vehicles it is 1.59 or more; thrust a tenth too large and a fifth of
/// water inside leave 1.2 …
const LEAST_SUM: f64 = 1.15;
/// … and of no body it is above 2, which thrust a tenth too small makes 2.2.
const MOST_SUM: f64 = 2.25;

/// A vehicle with less added mass than this part of its own, in two directions, is asked about.
const LITTLE_ADDED: f64 = 0.3;

/// So many standard deviations below is below.
const CLEARLY: f64 = 3.0;

fn parameter(x: &Coefficient) -> Parameter {
    let Coefficient { value, std, low95, high95, unit, .. } = x.clone();
    Parameter { value, std, low95, high95, unit }
}

/// The coefficients of `d_L v + d_Q v²` at a speed of an axis, each with its weight.
pub(super) fn drag_terms(fit: &PlantFit, dof: Dof, speed: f64) -> Vec<(usize, f64)> {
    let structure = fit.plant.structure();
    let weights = [(Product::linear(dof), speed), (Product::quadratic(dof), speed * speed)];
    let place =
        |(product, weight)| Some((structure.index_of(&Basis::Product(dof, product))?, weight));
    weights.into_iter().filter_map(place).collect()
}

/// `d_L v + d_Q v²` at a speed of an axis, N or N m; none of an axis without such terms.
pub(super) fn drag_at(fit: &PlantFit, dof: Dof, speed: f64) -> Option<Estimate> {
    let terms = drag_terms(fit, dof, speed);
    let drag: f64 = terms.iter().map(|(k, w)| w * fit.plant.coefficients()[*k]).sum();
    let pairs = terms.iter().flat_map(|a| terms.iter().map(move |b| (a, b)));
    let variance: f64 = pairs.map(|((i, a), (j, b))| a * b * fit.covariance[(*i, *j)]).sum();
    let std = variance.max(0.0).sqrt();
    (!terms.is_empty()).then(|| Estimate::new(drag, std, fit.samples as f64))
}

/// Mass and drag of each axis with all that says how sure they are; `rival` is another method's plant
/// that predicts as well.
pub(super) fn numbers(
    fit: &PlantFit,
    rival: Option<&PlantFit>,
    held: Option<&PlantScore>,
    records: &[&TrialRecord],
) -> Vec<(Dof, Number)> {
    let sure = |fit: &PlantFit| fit.of_sure_thrust();
    let by_method = rival.map(|fit| (OffBecause::Method { method: fit.method }, sure(fit)));
    let other_place = fit.other_place.as_ref().map(|fit| (OffBecause::SensorPlace, sure(fit)));
    let rivals: Vec<(OffBecause, PlantFit)> = by_method.into_iter().chain(other_place).collect();
    let own = sure(fit);
    let free = |dof: &&Dof| fit.std(&Basis::Mass(**dof, **dof)).is_some_and(|std| std > 0.0);
    let of = |&dof: &Dof| {
        let speed = usual_speed(dof, records);
        let change = held.and_then(|held| held.by_axis.get(&dof)?.change);
        let mass = |fit: &PlantFit| {
            let term = Basis::Mass(dof, dof);
            let (value, std) = (fit.plant.coefficient(&term)?, fit.std(&term)?);
            Some(Estimate::new(value, std, fit.samples as f64))
        };
        let drag = |fit: &PlantFit| drag_at(fit, dof, speed);
        let other = |of: &dyn Fn(&PlantFit) -> Option<Estimate>| {
            let rivals = rivals.iter();
            rivals.filter_map(|(because, fit)| Some((because.clone(), of(fit)?.value))).collect()
        };
        let drag_name = format!("{dof}: drag at {} {}", spoken(speed), dof.units().velocity);
        let of_mass = mass(&own).map(|estimate| Number {
            name: format!("mass.{dof}"),
            is_mass: true,
            estimate,
            changes: change.iter().map(|change| change.mass).collect(),
            others: other(&mass),
        });
        let of_drag = drag(&own).map(|estimate| Number {
            name: drag_name,
            is_mass: false,
            estimate,
            changes: change.iter().map(|change| change.drag).collect(),
            others: other(&drag),
        });
        [of_mass, of_drag].into_iter().flatten().map(move |number| (dof, number))
    };
    fit.plant.axes().iter().filter(free).flat_map(of).collect()
}

/// That masses and drag are known less well than a user takes those of a usable plant for; of what is
/// not known at all [`doubts`] tells.
pub(super) fn wide(fit: &PlantFit, records: &[&TrialRecord]) -> Option<Caveat> {
    let sure = fit.of_sure_thrust();
    let known = |dof: &Dof| {
        let term = Basis::Mass(*dof, *dof);
        let (value, std) = (sure.plant.coefficient(&term)?, sure.std(&term)?);
        let (mass, speed) =
            (Estimate::new(value, std, sure.samples as f64), usual_speed(*dof, records));
        Some(Known { dof: *dof, mass, speed, drag: drag_at(&sure, *dof, speed) })
    };
    let axes = fit.plant.axes().iter();
    let pushed = axes.filter(|dof| is_pushed(fit.plant.structure(), records, **dof));
    judge::wide(&pushed.filter_map(known).collect::<Vec<Known>>())
}

/// The root mean square of an axis's velocity over all trials.
pub(super) fn usual_speed(dof: Dof, records: &[&TrialRecord]) -> f64 {
    let series = records.iter().filter_map(|record| record.velocity[dof.index()].as_ref());
    rms(series.flat_map(|series| series.values()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sphere and a long spheroid [Lamb1932, § 92 and 115], BlueROV2, its heavy variant, REMUS 100 and
    /// RexROV by their published tables.
    #[test]
    fn bodies_are_none_to_ask_about_and_thrust_of_another_scale_is() {
        let bodies = [
            (1.0, [1.5; 3]),
            (1.0, [1.02, 1.96, 1.96]),
            (11.5, [17.0, 24.2, 26.07]),
            (13.5, [19.86, 20.62, 32.18]),
            (30.48, [31.41, 65.98, 65.98]),
            (1862.87, [2642.66, 3084.87, 5522.77]),
        ];
        for (mass, masses) in bodies {
            assert!(of_body(mass, masses).is_none());
            let heavy = of_body(mass, masses.map(|x| 2.0 * x)).expect("twice the thrust");
            assert_eq!(heavy.way, Ordering::Greater);
            assert!((0.42..0.59).contains(&heavy.times), "{}", heavy.times);
            assert!(heavy.caveat.message.contains("too large"), "{}", heavy.caveat.message);
            let light = of_body(mass, masses.map(|x| 0.6 * x)).expect("less than any body");
            assert_eq!(light.way, Ordering::Less);
            assert!((1.5..2.0).contains(&light.times), "{}", light.times);
            assert!(light.caveat.message.contains("too small"), "{}", light.caveat.message);
        }
    }
}
