//! What an identified plant says of its thrusters.

use seaplant::exchange::PlantModel;
use seaplant::results::Parameter;
use seaplant::{Dof, ThrustCurve, Thruster};

use crate::{Actuators, Error};

impl Actuators {
    /// Lag and delay as they were fitted, and the most that thrusters with measured tables give
    /// each axis the weaker way; a square law knows no greatest force.
    pub fn of_model(model: &PlantModel) -> Self {
        let mut found = Self::default();
        for dof in Dof::ALL {
            let i = dof.index();
            if let Some(actuation) = model.actuation.get(&dof) {
                let value = |x: Option<&Parameter>| x.map_or(0.0, |x| x.value.max(0.0));
                // A plant of one axis lags in propeller speed, one of several in force.
                found.lag_s[i] = value(actuation.lag.as_ref().or(actuation.force_lag.as_ref()));
                found.delay_s[i] = value(actuation.delay.as_ref());
            }
            found.limit[i] = limit(&model.thrusters, i);
        }
        found
    }
}

/// The most of all thrusters that push along an axis; none if one of them has no table.
fn limit(thrusters: &[Thruster], axis: usize) -> Option<f64> {
    let pushing = thrusters.iter().filter(|thruster| thruster.unit_wrench()[axis].abs() > 1e-9);
    let of = |thruster: &Thruster| {
        let ThrustCurve::Table { tables, .. } = &thruster.curve else { return None };
        let forces = || tables.iter().flat_map(|table| table.points().map(|(_, force)| force));
        let (least, most) = (forces().fold(f64::MAX, f64::min), forces().fold(f64::MIN, f64::max));
        Some(thruster.unit_wrench()[axis].abs() * most.min(-least).max(0.0))
    };
    let total = pushing.map(of).sum::<Option<f64>>()?;
    (total > 0.0).then_some(total)
}

/// Refuses a plant that should not be used.
///
/// # Errors
/// [`Error::DoNotUse`] with the reasons.
pub fn check_usable(model: &PlantModel) -> Result<(), Error> {
    let reasons = model.reasons_against();
    if reasons.is_empty() { Ok(()) } else { Err(Error::DoNotUse { reasons: reasons.join("; ") }) }
}
