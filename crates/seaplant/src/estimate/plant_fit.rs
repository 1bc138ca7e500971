//! Plants of any axes: the filter error method on any set of axes, from a start by equation
//! error.

mod actuator;
mod couplings;
mod descent;
mod differences;
mod equation_error;
mod filter;
mod fitted;
mod free;
mod gains;
mod independence;
mod information;
mod known;
mod noise_descent;
mod one_axis;
mod plan;
mod problem;
mod report;
mod result;
mod schedule;
mod search;
mod sensor_lag;
mod sensor_place;
mod start;
mod steering;
mod step;
mod swing;
mod thrust;
mod uncertainty;
mod wiring;

use super::Candidate;
use crate::plant::{Plant, RigidBody, Structure, Symmetry};
use crate::{Dof, Error, Method, TrialRecord};
pub use actuator::Actuator;
use equation_error::Solved;
use fitted::{COLOURED, Fitted, SMOOTH};
pub use gains::GainBeside;
pub use information::{
    ExpectedActuator, ExpectedNoise, ExpectedNoises, Information, information, information_before,
};
pub use known::ScaleClaim;
pub(super) use one_axis::{Exchanged, FilterStart, FittedAxis, Lever, OneAxis, force_rms};
pub use plan::PlantPlan;
use problem::Problem;
use report::Reported;
pub(crate) use result::INSTRUMENTS;
pub use result::{AxisNoise, CurrentDrift, PlantFit, SwellForce};
use schedule::Attitude;
pub use search::Tried;
pub(crate) use search::{NEGLIGIBLE_POWER, damping_power};
use sensor_place::Placed;
use start::begun;
use steering::Steering;
pub(crate) use step::LikelihoodStep;
pub(crate) use swing::{Swing, is_pushed};
pub use thrust::UnseenExponent;
pub(crate) use thrust::restless_thrust;

/// Fits a structure to trials by the filter error method.
///
/// States are ν_r and a Gauss–Markov force on each axis, and where roll and pitch are axes and both
/// they and their rates were measured the world's down in body axes, `k̇ = k × ω`; else attitude is
/// taken as measured. Waves add a force in a narrow band of frequencies, and thrust may lag behind
/// its log, be delayed, or act before its log says, where the trials show it. The start is the best
/// of several fits by equation error. M ⪰ M_RB where the rigid body is known, else M ≻ 0; an axis's
/// own damping is not below zero. Where `search` says so, damping of one axis by another is added if
/// the trials ask for it and the plant still takes power out of its motion.
///
/// # Errors
/// [`Error::TooShort`] if the trials hold fewer rows than coefficients; [`Error::Plant`] if the
/// fit does not settle.
///
/// # Source
/// [Jategaonkar2015, ch. 5], with the gains of the filter taken as known in each step.
pub fn fit_plant(
    structure: &Structure,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
    search: bool,
) -> Result<PlantFit, Error> {
    fit_as(structure, records, rigid_body, (search, Method::FilterError))
}

/// Fits a structure to trials by the output error method: its motion is left to itself.
///
/// As [`fit_plant`], but without disturbances, so that the plant alone has to explain the motion
/// from start to end. Standard deviations allow for the colour of the misfit.
///
/// # Errors
/// As [`fit_plant`].
///
/// # Source
/// [Jategaonkar2015, ch. 4]; covariance of \[White1982\].
pub fn fit_plant_freely(
    structure: &Structure,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
    search: bool,
) -> Result<PlantFit, Error> {
    fit_as(structure, records, rigid_body, (search, Method::OutputError))
}

/// Fits one axis alone, with thrusters and velocity sensor as in a fit of several axes.
///
/// # Errors
/// As [`fit_plant`].
pub(crate) fn fit_alone(
    fit: &PlantFit,
    dof: Dof,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
) -> Result<PlantFit, Error> {
    let structure = Structure::of(&[dof], Symmetry::Diagonal)?;
    let corrected = |record: &&TrialRecord| {
        let prompt = record.with_translations_before(&fit.report);
        prompt.with_surfaces_behind(record, &fit.actuator.steering)
    };
    let records: Vec<TrialRecord> = records.iter().map(corrected).collect::<Result<_, Error>>()?;
    let records: Vec<&TrialRecord> = records.iter().collect();
    let rigid_body = rigid_body.map(RigidBody::mass_matrix);
    let problem = Problem::new(&structure, &records, rigid_body, false, Attitude::Known);
    let (first, least_squares, mut fitted) =
        begun(problem.with_known_actuator(fit.actuator), &records)?;
    fitted.reported = Reported { how: fit.report, ..Reported::default() };
    fitted.finished(first, &least_squares, Method::FilterError)
}

fn fit_as(
    structure: &Structure,
    records: &[&TrialRecord],
    rigid_body: Option<&RigidBody>,
    (search, method): (bool, Method),
) -> Result<PlantFit, Error> {
    let is_free = method == Method::OutputError;
    let rigid_body = rigid_body.map(RigidBody::mass_matrix);
    let with_constants = match search {
        true => search::with_constants(structure, records)?,
        false => structure.clone(),
    };
    let logged = records;
    let first_fit = |records: &[&TrialRecord]| {
        let problem = Problem::new(&with_constants, records, rigid_body, is_free, Attitude::Known);
        FirstFit::new(problem, structure, records)
    };
    let (begun, steering, steered) = match search {
        true => FirstFit::steered(structure, records, first_fit)?,
        false => (first_fit(records)?, Steering::default(), Vec::new()),
    };
    let steered: Vec<&TrialRecord> = steered.iter().collect();
    let records = if steered.is_empty() { records } else { &steered };
    let (begun, wired) = match search {
        true => begun.with_wiring_that_shows(records, first_fit)?,
        false => (begun, Vec::new()),
    };
    let wired: Vec<&TrialRecord> = wired.iter().collect();
    let records = if wired.is_empty() { records } else { &wired };
    let FirstFit { first, least_squares, fitted, prompt } = begun;
    let fitted = Fitted { steering, ..fitted };
    let prompt: Vec<&TrialRecord> = prompt.iter().collect();
    let records = if prompt.is_empty() { records } else { &prompt };
    let (fitted, acting) = match search {
        true => fitted.with_thrusters_that_act(records)?,
        false => (fitted, Vec::new()),
    };
    let acting: Vec<&TrialRecord> = acting.iter().collect();
    let records = if acting.is_empty() { records } else { &acting };
    let Placed { fitted, records: placed, other_place } = match search {
        true => {
            let cost = fitted.optimum.cost;
            let fitted = fitted.with_differences_that_show(records)?.with_load_that_shows()?;
            let fitted = fitted.with_speeds_as_they_are(records)?;
            let found = fitted.searched_with_report(records)?;
            // What a coupling explains an actuator need not.
            match found.fitted.optimum.cost == cost {
                true => found,
                false => {
                    let fitted = found.fitted.with_actuator_that_shows()?;
                    Placed { fitted: fitted.with_drift_that_shows()?, ..found }
                }
            }
        }
        false => Placed::from(fitted),
    };
    let placed: Vec<&TrialRecord> = placed.iter().collect();
    let records = if placed.is_empty() { records } else { &placed };
    let fitted = match search {
        true => fitted.with_speeds_as_they_are(records)?,
        false => fitted,
    };
    let fitted = match Attitude::of(records, structure) {
        Attitude::State if !is_free => fitted.with_attitude(records)?.with_actuator_that_shows()?,
        _ => fitted,
    };
    let fitted = fitted.without_gains_of_alike(structure)?;
    let fitted = fitted.with_steering_as_it_is(records, logged)?;
    let other_place = match other_place {
        Some(other) => Some(Box::new(other.finished(first.clone(), &least_squares, method)?)),
        None => None,
    };
    let found = fitted.refined()?.finished(first, &least_squares, method)?;
    Ok(PlantFit { other_place, ..found })
}

/// The fit of a plant before thrusters are looked at one by one.
struct FirstFit {
    /// By equation error.
    first: Plant,
    least_squares: Solved,
    fitted: Fitted,
    /// Records with velocities as prompt as their report shows; none where they are as logged.
    prompt: Vec<TrialRecord>,
}

impl FirstFit {
    fn new(
        problem: Problem,
        structure: &Structure,
        records: &[&TrialRecord],
    ) -> Result<Self, Error> {
        let (first, least_squares, fitted) = begun(problem, records)?;
        let fitted = fitted.without_unseen_beside(structure)?;
        let fitted = fitted.with_smooth_thrust_that_shows(&SMOOTH)?;
        let fitted = fitted.with_falling_lag_that_shows()?;
        let (fitted, prompt) = fitted.with_report_that_shows(records)?;
        let fitted = fitted.with_actuator_that_shows()?.with_dead_band_that_shows()?;
        let fitted = fitted.with_slew_that_shows()?;
        let fitted = fitted.with_jitter_that_shows()?;
        let fitted = fitted.with_drift_that_shows()?.with_swell_that_shows()?;
        Ok(Self { first, least_squares, fitted, prompt })
    }
}

#[cfg(test)]
mod tests;
