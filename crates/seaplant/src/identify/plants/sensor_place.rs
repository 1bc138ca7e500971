//! Numbers that depend on the place of the velocity sensor, where no known force pushes an axis.
//!
//! Trials then do not distinguish a sensor elsewhere than stated from centres of mass and damping elsewhere.

use super::doubts::{DIRECTIONS, entry_of_sensor};
use super::rivals::{OTHER_MASS, apart, factor};
use crate::caveat::spoken;
use crate::estimate::{PlantFit, Swing};
use crate::plant::RigidBody;
use crate::{Caveat, CaveatCode, Dof, TrialRecord, Vehicle};

/// Returns the doubt of each axis whose numbers depend on the place of the velocity sensor.
pub(super) fn doubts(
    fit: &PlantFit,
    records: &[&TrialRecord],
    vehicle: &Vehicle,
) -> Vec<(Dof, Caveat)> {
    let told = |dof: Dof, message: String| {
        (dof, Caveat::warning(CaveatCode::InstrumentElsewhere, message))
    };
    let Some(other) = &fit.other_place else {
        let all = centred(fit, records, vehicle).into_iter();
        let far = all.filter(|one| one.factor() > 1.0 + OTHER_MASS);
        return far.map(|one| told(one.swing.by, one.message(&measure(fit)))).collect();
    };
    let (one, rival) = (fit.of_sure_thrust(), other.of_sure_thrust());
    let of = |&dof: &Dof| {
        let message = format!(
            "{} if the velocity sensor sits {}: {}",
            apart(&one, &rival, dof, records)?.message,
            place_of(other),
            measure(fit)
        );
        Some(told(dof, message))
    };
    fit.plant.axes().iter().filter_map(of).collect()
}

/// Formats where a fit has the velocity sensor, and what speaks for it.
fn place_of(fit: &PlantFit) -> String {
    let lever = fit.report.lever_m;
    let farthest = (1..3).fold(0, |k, l| if lever[l].abs() > lever[k].abs() { l } else { k });
    let (ahead, behind) = DIRECTIONS[farthest];
    let place = match lever[farthest] {
        0.0 => "where it is stated to sit, and damping couples axes instead".to_owned(),
        metres => {
            let way = if metres > 0.0 { ahead } else { behind };
            format!("{} m {way} of where it is stated to sit", spoken(metres.abs()))
        }
    };
    format!(
        "{place}, which explains the trials as well or better, or has the centre of mass nearer to where it is expected"
    )
}

/// Formats the advice that settles the place of the sensor.
fn measure(fit: &PlantFit) -> String {
    format!(
        "measure where the velocity sensor sits, state it (`position_m` of `{}`) and identify again, or push along the axes that no known force pushes",
        entry_of_sensor(fit)
    )
}

/// An inertia that depends on the place of the velocity sensor.
pub(super) struct Centred {
    pub(super) swing: Swing,
    /// Distance of the centre along its direction, m.
    metres: f64,
    /// The inertia that was found, and that with the centre of mass where it is expected.
    pub(super) inertia: [f64; 2],
}

impl Centred {
    fn factor(&self) -> f64 {
        factor(self.inertia[0], self.inertia[1])
    }

    fn message(&self, advice: &str) -> String {
        let [found, centred] = self.inertia.map(spoken);
        let (ahead, behind) = DIRECTIONS[self.swing.along()];
        format!(
            "inertia in {} is {centred} and not {found} {} if the centre of mass is where it is expected (by `rigid_body`, else at the origin) and not {} m {} of there, which trials do not tell from the place of the velocity sensor while no known force pushes {}: {advice}",
            self.swing.by,
            self.swing.by.units().mass,
            spoken(self.metres.abs()),
            if self.metres < 0.0 { behind } else { ahead },
            self.swing.of,
        )
    }
}

/// Centres of mass, with added mass, elsewhere than the rigid body has them or else the origin, in plants that have a
/// lever arm of the velocity sensor or damping that couples the same axes, one of them a translation that a sensor
/// measures and no known force pushes.
///
/// Damping about the place of a sensor and damping about another point look alike, but the centre of mass does not move
/// with that of damping.
pub(super) fn centred(fit: &PlantFit, records: &[&TrialRecord], vehicle: &Vehicle) -> Vec<Centred> {
    let body = vehicle.rigid_body.as_ref().map(RigidBody::mass_matrix).unwrap_or_default();
    let mass = fit.plant.mass_matrix_of_six();
    let structure = fit.plant.structure();
    let is_open = |swing: &Swing| {
        let is_damped = structure.terms().iter().any(|term| swing.is_damped_by(structure, term));
        is_damped || fit.report.lever_m[swing.along()] != 0.0
    };
    let of = |swing: Swing| {
        let metres = swing.centre(&mass, &body);
        let inertia = [0.0, metres].map(|back| swing.inertia_with_centre_back(&mass, back));
        Centred { swing, metres, inertia }
    };
    Swing::all(structure, records).into_iter().filter(is_open).map(of).collect()
}
