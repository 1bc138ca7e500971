//! Plausibility of plants as bodies in water.

use std::collections::BTreeMap;

use crate::caveat::spoken;
use crate::results::{Parameter, Parameters, PlantResult};
use crate::{Caveat, CaveatCode, Dof, Vehicle};

/// Density of sea water, kg/m³.
const SEA_WATER: f64 = 1025.0;

/// Drag coefficients of bodies from a slender hull, end on, to a plate that oscillates in its own
/// wake [Faltinsen1990, §7], by the area of the hull's bounding box.
const DRAG_COEFFICIENTS: (f64, f64) = (0.02, 10.0);

/// Ratio of areas above which the larger one has more added mass for any shape.
const CLEARLY_LARGER: f64 = 1.3;

/// Adds caveats to implausible plants of a vehicle of known size.
pub(crate) fn implausible(plants: &mut BTreeMap<String, PlantResult>, vehicle: &Vehicle) {
    for plant in plants.values_mut() {
        let doubts = |(dof, own): (&Dof, &Parameters)| {
            let drag = drag_coefficient(*dof, own, vehicle);
            drag.into_iter().chain(impossible_mass(*dof, &own.mass, vehicle)).collect::<Vec<_>>()
        };
        let doubts: Vec<Caveat> = plant.by_axis.iter().flat_map(doubts).collect();
        plant.caveats.extend(doubts);
    }
    let doubts: Vec<(Dof, Caveat)> = Dof::ALL
        .into_iter()
        .flat_map(|narrow| Dof::ALL.map(|broad| (narrow, broad)))
        .filter_map(|(narrow, broad)| out_of_order(narrow, broad, plants, vehicle))
        .collect();
    for (dof, doubt) in doubts {
        if let Some(plant) = plants.get_mut(dof.name()) {
            plant.caveats.push(doubt);
        }
    }
}

/// Returns a caveat for a mass or inertia that is impossible for a vehicle of that weight and size.
pub(crate) fn impossible_mass(dof: Dof, mass: &Parameter, vehicle: &Vehicle) -> Option<Caveat> {
    too_heavy(dof, mass, vehicle).or_else(|| too_light(dof, mass, vehicle))
}

/// Returns a caveat for a drag coefficient `C_D = d_Q / (½ ρ A)` outside the possible range, if
/// both ends of its interval are.
fn drag_coefficient(dof: Dof, own: &Parameters, vehicle: &Vehicle) -> Option<Caveat> {
    let area = vehicle.frontal_area_m2(dof)?;
    let drag = own.quadratic_drag.as_ref()?;
    let coefficient = |drag: f64| drag / (0.5 * SEA_WATER * area);
    let (least, most) = DRAG_COEFFICIENTS;
    let is_off = coefficient(drag.high95) < least || coefficient(drag.low95) > most;
    // Negative drag has its own caveat.
    (is_off && drag.value > 0.0).then(|| {
        let message = format!(
            "the quadratic drag in {dof} gives a drag coefficient of {} for the hull's {} m²; bodies in water have {least} to {most}: check the units of thrust and speed, and the vehicle's size",
            spoken(coefficient(drag.value)),
            spoken(area)
        );
        Caveat::warning(CaveatCode::Implausible, message)
    })
}

/// Without the size of the hull: an open frame with its enclosed water has up to six times its mass
/// in air [Jason2, table 5]; more than this is doubtful …
const DOUBTFUL_TIMES_DRY: f64 = 7.0;
/// … and more than this is impossible.
const MOST_TIMES_DRY: f64 = 10.0;

/// Tolerance for parts outside the hull's bounding box, such as tanks and frames.
const FORGIVEN_TIMES: f64 = 1.5;

/// Returns a caveat for a mass that is impossible for a body of that size: well above the vehicle,
/// the water in its bounding box, and the added mass of a plate of its face, `π/4 ρ a b²` for sides
/// a ≥ b [Newman1977, ch. 4].
///
/// The limit of an inertia has the vehicle at the corners of its box, and the water in and around
/// it spread evenly.
fn too_heavy(dof: Dof, mass: &Parameter, vehicle: &Vehicle) -> Option<Caveat> {
    let (most, by) = most_mass(dof, vehicle)?;
    let (doubtful, by_doubt) = match vehicle.size_m {
        // For a hull of known size, enclosed water and added mass are known well enough.
        Some(_) => (most, by),
        None => (most * DOUBTFUL_TIMES_DRY / MOST_TIMES_DRY, "seven times the mass in air"),
    };
    let (limit, by, caveat): (f64, &str, fn(CaveatCode, String) -> Caveat) = match mass.low95 {
        low if low > most => (most, by, Caveat::severe),
        low if low > doubtful => (doubtful, by_doubt, Caveat::warning),
        _ => return None,
    };
    let message = format!(
        "the {dof} {} of {} {} is beyond {} {}, {by}: check the unit of thrust, the scale of the thrust curve, and the unit of speed",
        if dof.is_rotation() { "inertia" } else { "mass" },
        spoken(mass.value),
        mass.unit,
        spoken(limit),
        mass.unit
    );
    Some(caveat(CaveatCode::Implausible, message))
}

/// Returns the greatest effective mass of a hull along an axis, and its description.
fn most_mass(dof: Dof, vehicle: &Vehicle) -> Option<(f64, &'static str)> {
    let Some([length, width, height]) = vehicle.size_m else {
        let dry = vehicle.dry_mass_kg.filter(|_| !dof.is_rotation())?;
        return Some((MOST_TIMES_DRY * dry, "ten times the mass in air"));
    };
    let within = vehicle.dry_mass_kg.unwrap_or(0.0) + SEA_WATER * length * width * height;
    let plate = |a: f64, b: f64| {
        let (long, short) = (a.max(b), a.min(b));
        std::f64::consts::FRAC_PI_4 * SEA_WATER * long * short * short
    };
    let mass = |dof: Dof| match dof {
        Dof::Surge => within + plate(width, height),
        Dof::Sway => within + plate(length, height),
        _ => within + plate(length, width),
    };
    const HULL: &str =
        "1.5 times the greatest mass of a hull of that size with the water in it and around it";
    if !dof.is_rotation() {
        return Some((FORGIVEN_TIMES * mass(dof), HULL));
    }
    let (a, b, faces) = match dof {
        Dof::Roll => (width, height, [plate(length, height), plate(length, width)]),
        Dof::Pitch => (length, height, [plate(width, height), plate(length, width)]),
        _ => (length, width, [plate(width, height), plate(length, height)]),
    };
    // All of the vehicle at the corners, and water spread evenly.
    let square = a * a + b * b;
    let water = SEA_WATER * length * width * height + faces[0] + faces[1];
    let dry = vehicle.dry_mass_kg.unwrap_or(0.0);
    Some((FORGIVEN_TIMES * (dry * square / 4.0 + water * square / 12.0), HULL))
}

/// Least ratio of inertia to that of a box of even density, for a vehicle with its mass in its
/// middle.
const LEAST_INERTIA_PART: f64 = 0.15;

/// Returns a caveat for an inertia that is too small for a vehicle of that mass and size.
fn too_light(dof: Dof, inertia: &Parameter, vehicle: &Vehicle) -> Option<Caveat> {
    let ([length, width, height], dry) = (vehicle.size_m?, vehicle.dry_mass_kg?);
    let (a, b) = match dof {
        Dof::Roll => (width, height),
        Dof::Pitch => (length, height),
        Dof::Yaw => (length, width),
        _ => return None,
    };
    let least = LEAST_INERTIA_PART * dry * (a * a + b * b) / 12.0;
    (inertia.high95 < least).then(|| {
        let message = format!(
            "the {dof} inertia of {} {} is below {} {}, the least that a vehicle of {} kg and that size can have: check the unit of thrust, the scale of the thrust curve, and the positions of the thrusters",
            spoken(inertia.value),
            inertia.unit,
            spoken(least),
            inertia.unit,
            spoken(dry)
        );
        Caveat::severe(CaveatCode::Implausible, message)
    })
}

/// Returns a caveat if the axis of the clearly smaller area has more added mass.
fn out_of_order(
    narrow: Dof,
    broad: Dof,
    plants: &BTreeMap<String, PlantResult>,
    vehicle: &Vehicle,
) -> Option<(Dof, Caveat)> {
    let dry = vehicle.dry_mass_kg?;
    let (small, large) = (vehicle.frontal_area_m2(narrow)?, vehicle.frontal_area_m2(broad)?);
    let mass =
        |dof: Dof| -> Option<&Parameter> { Some(&plants.get(dof.name())?.by_axis.get(&dof)?.mass) };
    let (less, more) = (mass(narrow)?, mass(broad)?);
    let is_reversed =
        less.low95 > more.high95 && less.low95 - dry > CLEARLY_LARGER * (more.high95 - dry);
    (large > CLEARLY_LARGER * small && is_reversed).then(|| {
        let message = format!(
            "the added mass is {} kg in {narrow} over an area of {} m², and {} kg in {broad}, with {} m²: the larger area should have more added mass, so that one of the two is wrong; check thrust, units and the names of the thrusters",
            spoken(less.value - dry),
            spoken(small),
            spoken(more.value - dry),
            spoken(large)
        );
        (narrow, Caveat::warning(CaveatCode::Implausible, message))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Severity;

    #[test]
    fn open_frames_and_small_robots_are_possible_and_twenty_times_their_mass_is_not() {
        let jason = Vehicle {
            dry_mass_kg: Some(3400.0),
            size_m: Some([3.4, 2.2, 2.4]),
            ..Vehicle::default()
        };
        // Published effective masses [Jason2, table 5].
        let published = [
            (Dof::Surge, 12970.2),
            (Dof::Sway, 18903.6),
            (Dof::Heave, 20283.9),
            (Dof::Yaw, 11049.7),
        ];
        for (dof, mass) in published {
            let (most, _) = most_mass(dof, &jason).expect("known");
            assert!(mass < most && 20.0 * mass > most, "{dof}: {mass} and {most}");
        }
        let unsized_hull = Vehicle { size_m: None, ..jason };
        let mass = |times: f64| {
            let (value, std) = (times * 3400.0, 1.0);
            let (low95, high95, unit) = (value - 2.0, value + 2.0, "kg".to_owned());
            let mass = Parameter { value, std, low95, high95, unit };
            too_heavy(Dof::Surge, &mass, &unsized_hull).map(|caveat| caveat.severity)
        };
        // The published heave, twice the published surge, and three times that.
        let found = [5.97, 7.63, 11.4].map(mass);
        assert_eq!(found, [None, Some(Severity::Warning), Some(Severity::Severe)]);
        assert_eq!(most_mass(Dof::Surge, &unsized_hull).map(|most| most.0), Some(34000.0));
        assert_eq!(most_mass(Dof::Yaw, &unsized_hull), None);
    }

    #[test]
    fn limits_of_inertia_follow_from_mass_and_size() {
        let robot = Vehicle {
            dry_mass_kg: Some(8.6),
            size_m: Some([0.327, 0.283, 0.136]),
            ..Vehicle::default()
        };
        let (most, _) = most_mass(Dof::Yaw, &robot).expect("known");
        // A box of even density has 0.13 kg m², and about as much again of water.
        assert!(most > 4.0 * 0.13 && most < 10.0 * 0.17, "{most}");
        assert!(most_mass(Dof::Roll, &robot).expect("known").0 < most);
    }
}
