//! Filter error beside output error: which plant is taken, and whether the other one is another.

use super::Scored;
use super::known::{drag_at, usual_speed};
use crate::caveat::{estimated, spoken};
use crate::estimate::PlantFit;
use crate::plant::Basis;
use crate::{Caveat, CaveatCode, Dof, Estimate, TrialRecord};

/// Masses that differ by more than this part are two masses to a user …
pub(super) const OTHER_MASS: f64 = 0.2;
/// … and drags by more than this, two drags.
const OTHER_DRAG: f64 = 0.3;
/// Plants whose masses or drags differ by this factor, and that predict alike, leave the plant
/// open.
const ANOTHER_PLANT: f64 = 1.5;
/// Plants predict alike if what the other leaves unexplained of an axis is, in the geometric mean
/// of the axes, no more than this times what the chosen one leaves.
const ALIKE: f64 = 1.5;

/// Returns whether a plant leaves about as little of the trials unexplained as another, in the mean of the axes.
pub(super) fn predicts_as_well(one: &Scored, other: &Scored) -> bool {
    let worse = (one.misfit() - other.misfit()) / one.fit.plant.axes().len() as f64;
    worse <= ALIKE.ln()
}

/// Returns a caveat if the method that is not taken, which predicts about as well, finds another plant.
pub(super) fn disagreement(
    chosen: &Scored,
    other: &Scored,
    records: &[&TrialRecord],
) -> Option<Caveat> {
    let axes = chosen.fit.plant.axes();
    let (one, rival) = (chosen.fit.of_sure_thrust(), other.fit.of_sure_thrust());
    let apart = axes.iter().filter_map(|dof| apart(&one, &rival, *dof, records));
    let apart: Vec<Apart> = apart.collect();
    let greatest = apart.iter().map(|one| one.factor).fold(0.0, f64::max);
    let named: Vec<String> = apart.into_iter().map(|one| one.message).collect();
    (!named.is_empty()).then(|| {
        let message = format!(
            "{} predicts about as well as {}, and finds another plant: {}; the trials do not show which is right, and the intervals of the plant reach to both",
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

/// What two plants disagree on.
pub(super) struct Apart {
    pub(super) message: String,
    /// How many times the one is the other.
    factor: f64,
}

/// Mass or drag of one axis, if they differ.
pub(super) fn apart(
    chosen: &PlantFit,
    other: &PlantFit,
    dof: Dof,
    records: &[&TrialRecord],
) -> Option<Apart> {
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
pub(super) fn factor(x: f64, y: f64) -> f64 {
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
