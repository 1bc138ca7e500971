//! What an identified plant says of its thrusters.

use seaplant::exchange::PlantModel;
use seaplant::plant::Basis;
use seaplant::results::{Parameter, Trust};
use seaplant::{Dof, Thruster};

use crate::{Actuators, Error, Gains};

impl Actuators {
    /// Lag and delay as they were fitted, and the most that thrusters give each axis the weaker way,
    /// by [`PlantModel::thrust_limits`].
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
            found.limit[i] = limit(model, i);
        }
        found
    }
}

/// The most of all thrusters that push along an axis, each the weaker way; none if one of them states
/// no greatest thrust.
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

/// Refuses a plant that should not be used.
///
/// # Errors
/// [`Error::DoNotUse`] with the reasons.
pub fn check_usable(model: &PlantModel) -> Result<(), Error> {
    let reasons = model.reasons_against();
    if reasons.is_empty() { Ok(()) } else { Err(Error::DoNotUse { reasons: reasons.join("; ") }) }
}

/// Masses that are known no better than this part are told, 95 %.
const TOLD_PART: f64 = 0.25;

/// What gains inherit from their plant: verdicts that speak against it or doubt it, and
/// controlled axes whose mass the trials hardly told.
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

/// What to say of an axis whose mass could be another.
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
