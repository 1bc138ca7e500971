//! Filter error beside output error: which plant is taken, and whether the other one is another.

use super::Scored;
use super::doubts::{DIRECTIONS, is_pushed};
use super::known::{drag_at, usual_speed};
use crate::caveat::{estimated, spoken};
use crate::estimate::PlantFit;
use crate::plant::{Basis, RigidBody};
use crate::{Caveat, CaveatCode, Dof, Estimate, TrialRecord, Vehicle};

/// Masses that differ by more than this part are two masses to a user …
const OTHER_MASS: f64 = 0.2;
/// … and drags by more than this, two drags.
const OTHER_DRAG: f64 = 0.3;
/// Plants whose masses or drags differ by this factor, and that predict alike, leave the plant
/// open.
const ANOTHER_PLANT: f64 = 1.5;
/// Plants predict alike if what the other leaves unexplained of an axis is, in the geometric mean
/// of the axes, no more than this times what the chosen one leaves.
const ALIKE: f64 = 1.5;

/// That the method that is not taken predicts about as well, and finds another plant.
pub(super) fn disagreement(
    chosen: &Scored,
    other: &Scored,
    records: &[&TrialRecord],
) -> Option<Caveat> {
    let axes = chosen.fit.plant.axes();
    let worse = (other.misfit() - chosen.misfit()) / axes.len() as f64;
    if worse.is_nan() || worse > ALIKE.ln() {
        return None;
    }
    let (one, rival) = (chosen.fit.of_sure_thrust(), other.fit.of_sure_thrust());
    let apart = axes.iter().filter_map(|dof| apart(&one, &rival, *dof, records));
    let apart: Vec<Apart> = apart.collect();
    let greatest = apart.iter().map(|one| one.factor).fold(0.0, f64::max);
    let named: Vec<String> = apart.into_iter().map(|one| one.message).collect();
    (!named.is_empty()).then(|| {
        let message = format!(
            "{} predicts about as well as {}, and finds another plant: {}; the intervals do not include the cause of this, and the trials do not show which is right",
            other.fit.method,
            chosen.fit.method,
            named.join("; ")
        );
        let code = match greatest < ANOTHER_PLANT {
            true => CaveatCode::MethodsDisagree,
            false => CaveatCode::NotDetermined,
        };
        Caveat::warning(code, message)
    })
}

/// That a method that works sample by sample finds another plant than the batch.
pub(super) fn from_batch(
    batch: &PlantFit,
    online: &PlantFit,
    records: &[&TrialRecord],
) -> Option<Caveat> {
    let axes = batch.plant.axes().iter();
    let (one, rival) = (batch.of_sure_thrust(), online.of_sure_thrust());
    let apart = axes.filter_map(|dof| apart(&one, &rival, *dof, records));
    let named: Vec<String> = apart.map(|one| one.message).collect();
    (!named.is_empty()).then(|| {
        let message = format!(
            "{} finds another plant than {}, which takes all of the trials at once: {}; the intervals do not include the cause of this; use that of {}",
            online.method,
            batch.method,
            named.join("; "),
            batch.method
        );
        Caveat::warning(CaveatCode::MethodsDisagree, message)
    })
}

/// That trials in which nothing pushes a translation do not tell a velocity sensor elsewhere than stated from centres
/// of mass and damping elsewhere: of each axis whose numbers depend on it, and whether it makes the axis doubtful.
pub(super) fn sensor_place(
    fit: &PlantFit,
    records: &[&TrialRecord],
    vehicle: &Vehicle,
) -> Vec<(Dof, Caveat, bool)> {
    let told = |dof: Dof, message: String, factor: f64| {
        let caveat = Caveat::warning(CaveatCode::InstrumentElsewhere, message);
        (dof, caveat, factor >= ANOTHER_PLANT)
    };
    let Some(other) = &fit.as_stated else {
        let all = centred(fit, records, vehicle).into_iter();
        let far = all.filter(|one| one.factor() > 1.0 + OTHER_MASS);
        return far.map(|one| told(one.by, one.message(), one.factor())).collect();
    };
    let (one, rival) = (fit.of_sure_thrust(), other.of_sure_thrust());
    let of = |&dof: &Dof| {
        let Apart { message, factor } = apart(&one, &rival, dof, records)?;
        let message = format!(
            "{message} if the velocity sensor sits where it is stated to sit, and damping couples axes instead, which explains the trials as well: {MEASURE}"
        );
        Some(told(dof, message, factor))
    };
    fit.plant.axes().iter().filter_map(of).collect()
}

/// What tells a sensor elsewhere from couplings.
const MEASURE: &str = "measure where the velocity sensor sits, state it (`position_m` of `[sensor.dvl]`) and identify again, or push along the axes that nothing pushes";

/// A centre of mass that would be where it is expected if the velocity sensor sat elsewhere.
pub(super) struct Centred {
    of: Dof,
    pub(super) by: Dof,
    /// Distance of the centre, m, and its direction.
    metres: f64,
    along: usize,
    /// The inertia that was found, and that of a centre there.
    pub(super) inertia: [f64; 2],
}

impl Centred {
    fn factor(&self) -> f64 {
        factor(self.inertia[0], self.inertia[1])
    }

    fn message(&self) -> String {
        let [found, centred] = self.inertia.map(spoken);
        let (ahead, behind) = DIRECTIONS[self.along];
        format!(
            "inertia in {} is {centred} and not {found} {} if the centre of mass is where it is expected (by `rigid_body`, else at the origin) and not {} m {} of there, which trials do not tell from the place of the velocity sensor while nothing pushes {}: {MEASURE}",
            self.by,
            self.by.units().mass,
            spoken(self.metres.abs()),
            if self.metres < 0.0 { behind } else { ahead },
            self.of,
        )
    }
}

/// Centres of mass, with added mass, elsewhere than the rigid body has them or else the origin, in plants that have a
/// lever arm of the velocity sensor or damping that couples the same axes, one of them a translation that a sensor
/// measures and nothing pushes.
///
/// Damping about the place of a sensor and damping about another point look alike, but the centre of mass does not move
/// with that of damping.
///
/// ```text
/// x = (m_ij − b_ij) / m_ii,   I' = m_jj − 2 x m_ij + x² m_ii
/// ```
pub(super) fn centred(fit: &PlantFit, records: &[&TrialRecord], vehicle: &Vehicle) -> Vec<Centred> {
    let body = vehicle.rigid_body.as_ref().map(RigidBody::mass_matrix).unwrap_or_default();
    let mass = fit.plant.mass_matrix_of_six();
    let axes = fit.plant.axes();
    let is_measured = |dof: Dof| records.iter().any(|record| record.is_measured(dof));
    let is_free =
        |dof: &&Dof| !dof.is_rotation() && is_measured(**dof) && !is_pushed(fit, records, **dof);
    let couples = |of: Dof, by: Dof| {
        let is_between = |term: &Basis| {
            let Basis::Product(on, product) = term else { return false };
            product.factors().any(|factor| [(of, by), (by, of)].contains(&(*on, factor.of)))
        };
        fit.plant.structure().terms().iter().any(is_between)
    };
    let mut all = Vec::new();
    for &of in axes.iter().filter(is_free) {
        // Rolling moves nothing ahead, and so on.
        let turns = axes.iter().filter(|by| by.is_rotation() && by.index() != of.index() + 3);
        for &by in turns {
            let (i, j) = (of.index(), by.index());
            let along = 6 - i - j;
            if !couples(of, by) && fit.report.lever_m[along] == 0.0 {
                continue;
            }
            let x = (mass[(i, j)] - body[(i, j)]) / mass[(i, i)];
            let centred = mass[(j, j)] - 2.0 * x * mass[(i, j)] + x * x * mass[(i, i)];
            // (ω × r)_i = ω_j r_along, or less that.
            let metres = if (j + 1) % 3 == along { x } else { -x };
            all.push(Centred { of, by, metres, along, inertia: [mass[(j, j)], centred] });
        }
    }
    all
}

/// What two plants disagree on.
struct Apart {
    message: String,
    /// How many times the one is the other.
    factor: f64,
}

/// Mass or drag of one axis, if they differ.
fn apart(chosen: &PlantFit, other: &PlantFit, dof: Dof, records: &[&TrialRecord]) -> Option<Apart> {
    let speed = usual_speed(dof, records);
    let units = dof.units();
    let mass = |fit| Some((mass_of(fit, dof)?, OTHER_MASS));
    let drag = |fit| Some((drag_at(fit, dof, speed)?, OTHER_DRAG));
    let name = if dof.is_rotation() { "inertia" } else { "mass" };
    let at = format!("drag at {} {}", spoken(speed), units.velocity);
    let both = [
        (name.to_owned(), units.mass, mass(chosen), mass(other)),
        (at, units.force, drag(chosen), drag(other)),
    ];
    both.into_iter().find_map(|(name, unit, chosen, other)| {
        let ((x, part), (y, _)) = chosen.zip(other)?;
        let off = (x.value - y.value).abs();
        (off > part * x.value.abs() && off > 2.0 * x.std.hypot(y.std)).then(|| Apart {
            message: format!(
                "{name} in {dof} is {} and not {} {unit}",
                estimated(y.value, y.std),
                estimated(x.value, x.std)
            ),
            factor: factor(x.value, y.value),
        })
    })
}

fn mass_of(fit: &PlantFit, dof: Dof) -> Option<Estimate> {
    let term = Basis::Mass(dof, dof);
    let (value, std) = (fit.plant.coefficient(&term)?, fit.std(&term)?);
    Some(Estimate::new(value, std, fit.samples as f64))
}

/// The greater over the smaller; without bound if they differ in sign.
fn factor(x: f64, y: f64) -> f64 {
    let factor = (x / y).max(y / x);
    if factor > 0.0 { factor } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::factor;

    #[test]
    fn a_factor_goes_both_ways() {
        assert!((factor(3.0, 2.0) - 1.5).abs() < 1e-12 && (factor(2.0, 3.0) - 1.5).abs() < 1e-12);
        assert!(factor(-1.0, 2.0).is_infinite() && factor(0.0, 2.0).is_infinite());
    }
}
