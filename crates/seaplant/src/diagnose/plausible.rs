//! Whether plants are those of a body in water.

use std::collections::BTreeMap;

use crate::caveat::spoken;
use crate::results::{Parameter, PlantResult};
use crate::{Caveat, CaveatCode, Dof, Vehicle};

/// Density of sea water, kg/m³.
const SEA_WATER: f64 = 1025.0;

/// Drag coefficients of bodies from a slender hull, end on, to a plate that oscillates in
/// its own wake [Faltinsen1990, §7]; the area is that of the hull's box.
const DRAG_COEFFICIENTS: (f64, f64) = (0.02, 10.0);

/// An area this much larger than another makes more added mass, whatever the shape.
const CLEARLY_LARGER: f64 = 1.3;

/// Raises doubts about the plants of a vehicle whose size is known.
pub(crate) fn implausible(plants: &mut BTreeMap<Dof, PlantResult>, vehicle: &Vehicle) {
    for (dof, plant) in plants.iter_mut() {
        plant.caveats.extend(drag_coefficient(*dof, plant, vehicle));
    }
    let doubts: Vec<(Dof, Caveat)> = Dof::ALL
        .into_iter()
        .flat_map(|narrow| Dof::ALL.map(|broad| (narrow, broad)))
        .filter_map(|(narrow, broad)| out_of_order(narrow, broad, plants, vehicle))
        .collect();
    for (dof, doubt) in doubts {
        if let Some(plant) = plants.get_mut(&dof) {
            plant.caveats.push(doubt);
        }
    }
}

/// `C_D = d_Q / (½ ρ A)` that no body has, at either end of its interval.
fn drag_coefficient(dof: Dof, plant: &PlantResult, vehicle: &Vehicle) -> Option<Caveat> {
    let area = vehicle.frontal_area_m2(dof)?;
    let drag = plant.parameters.quadratic_drag.as_ref()?;
    let of = |drag: f64| drag / (0.5 * SEA_WATER * area);
    let (least, most) = DRAG_COEFFICIENTS;
    let is_off = of(drag.high95) < least || of(drag.low95) > most;
    // Drag below zero has a caveat of its own.
    (is_off && drag.value > 0.0).then(|| {
        let message = format!(
            "the quadratic drag in {dof} makes a drag coefficient of {} on the hull's {} m², and bodies in water have {least} to {most}: check the units of thrust and speed, and the vehicle's size",
            spoken(of(drag.value)),
            spoken(area)
        );
        Caveat::warning(CaveatCode::Implausible, message)
    })
}

/// More added mass along the axis with the clearly smaller area.
fn out_of_order(
    narrow: Dof,
    broad: Dof,
    plants: &BTreeMap<Dof, PlantResult>,
    vehicle: &Vehicle,
) -> Option<(Dof, Caveat)> {
    let dry = vehicle.dry_mass_kg?;
    let (small, large) = (vehicle.frontal_area_m2(narrow)?, vehicle.frontal_area_m2(broad)?);
    let mass = |dof: Dof| -> Option<&Parameter> { Some(&plants.get(&dof)?.parameters.mass) };
    let (less, more) = (mass(narrow)?, mass(broad)?);
    let is_reversed =
        less.low95 > more.high95 && less.low95 - dry > CLEARLY_LARGER * (more.high95 - dry);
    (large > CLEARLY_LARGER * small && is_reversed).then(|| {
        let message = format!(
            "the water that moves along is {} kg in {narrow}, where the hull turns {} m² towards it, and {} kg in {broad}, with {} m²: the broader side should carry more, so one of the two is wrong (thrust, units, or a thruster that is named for another)",
            spoken(less.value - dry),
            spoken(small),
            spoken(more.value - dry),
            spoken(large)
        );
        (narrow, Caveat::warning(CaveatCode::Implausible, message))
    })
}
