//! Thruster properties of an identified plant.

use seaplant::exchange::PlantModel;
use seaplant::plant::Basis;
use seaplant::results::{Parameter, Trust};
use seaplant::{Dof, Thruster};

use crate::{Actuators, Error, Gains};

impl Actuators {
    /// Returns the fitted lag and delay, and the greatest force on each axis in the weaker
    /// direction, by [`PlantModel::thrust_limits`].
    pub fn of_model(model: &PlantModel) -> Self {
        let mut found = Self::default();
        for dof in Dof::ALL {
            let i = dof.index();
            if let Some(actuation) = model.actuation.get(&dof) {
                let value = |x: Option<&Parameter>| x.map_or(0.0, |x| x.value.max(0.0));
                found.lag_s[i] = model.lag_along(dof);
                found.delay_s[i] = value(actuation.delay.as_ref());
            }
            found.limit[i] = limit(model, i);
        }
        found
    }
}

/// Returns the greatest force of all thrusters along an axis, each in the weaker direction; `None`
/// if one of them states no greatest thrust.
fn limit(model: &PlantModel, axis: usize) -> Option<f64> {
    let lever = |thruster: &Thruster| thruster.unit_wrench()[axis].abs();
    let of = |thruster: &Thruster| {
        let [reverse, forward] = model.thrust_limits(thruster)?;
        Some(lever(thruster) * forward.min(-reverse).max(0.0))
    };
    let pushing = model.thrusters.iter().filter(|thruster| lever(thruster) > 1e-9);
    let total = pushing.map(of).sum::<Option<f64>>()?;
    (total > 0.0).then_some(total)
}

/// Rejects a plant that should not be used.
///
/// # Errors
/// [`Error::DoNotUse`] with the reasons.
pub fn check_usable(model: &PlantModel) -> Result<(), Error> {
    let reasons = model.reasons_against();
    if reasons.is_empty() { Ok(()) } else { Err(Error::DoNotUse { reasons: reasons.join("; ") }) }
}

/// Relative 95 % uncertainty of mass from which a note is made.
const TOLD_PART: f64 = 0.25;

/// Returns notes on the plant's weaknesses: verdicts against it or in doubt, and controlled axes
/// whose mass is poorly determined.
///
/// ```
/// use seaplant::Dof;
/// use seaplant_campaign::read_plant_file;
/// use seaplant_control::{Actuators, Design, Tuning, design, doubts_of_model};
/// let file = read_plant_file("published:bluerov2-wu-2018".as_ref())?.expect("a table");
/// let model = file.model()?;
/// let axes = [Dof::Surge, Dof::Sway, Dof::Heave, Dof::Yaw];
/// let tuning = axes.map(|dof| (dof, Tuning::new(0.1, 1.0))).into();
/// let gains = design(&model.plant, &[], &Actuators::default(), &Design { tuning, ..Design::default() })?;
/// // A table has neither a verdict nor standard deviations.
/// assert!(doubts_of_model(&model, &gains).is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn doubts_of_model(model: &PlantModel, gains: &Gains) -> Vec<String> {
    let judged = model.judgements.iter().filter_map(|judgement| {
        let words = match judgement.verdict.trust {
            Trust::DoNotUse => "should not be used",
            Trust::Doubtful => "is doubtful",
            Trust::UsableWithCare | Trust::Usable => return None,
        };
        let axes: Vec<&str> = judgement.axes.iter().map(|dof| dof.name()).collect();
        Some(format!("{}: the plant {words}: {}", axes.join("-"), judgement.verdict.reason))
    });
    judged.chain(gains.axes.keys().filter_map(|dof| hardly_told(model, *dof))).collect()
}

/// Returns the note on an axis with uncertain mass.
fn hardly_told(model: &PlantModel, dof: Dof) -> Option<String> {
    let k = model.plant.structure().index_of(&Basis::Mass(dof, dof))?;
    let ([low, high], mass) = (model.interval(k)?, model.plant.coefficients()[k]);
    let part = (0.5 * (high - low) / mass).abs();
    (part > TOLD_PART).then(|| {
        format!(
            "{dof}: its mass is known to ±{:.0} % (95 %), and every gain is a multiple of it; ±{:.0} % would do: log trials in which its speed changes faster",
            100.0 * part,
            100.0 * TOLD_PART
        )
    })
}
