//! Limits on rates, bandwidths and delays, which bound the time of design and simulation to
//! seconds.

use seaplant::Dof;
use seaplant::plant::Plant;

use crate::response::duration_s;
use crate::track::steps;
use crate::{Actuators, Design, Error};

/// Slowest and fastest controller, samples per second.
const SAMPLE_HZ: (f64, f64) = (0.1, 1000.0);

/// Maximum number of integration steps of one run: a design simulates some forty runs for each
/// axis.
const MOST_STEPS: f64 = 2e5;

/// Maximum number of states of the closed loop: four for each axis, and one for each command within
/// the delay. The stability check is cubic in this, for each draw of the plant.
const MOST_STATES: usize = 250;

/// Checks that a design takes bounded time and memory.
///
/// # Errors
/// [`Error::Setting`] with the greatest or least number that is taken.
pub(crate) fn check(plant: &Plant, asked: &Design, actuators: &Actuators) -> Result<(), Error> {
    check_rates(plant, asked.sample_hz, actuators)?;
    for (dof, tuning) in &asked.tuning {
        // The duration of a step response is proportional to 1/bandwidth.
        let least_hz = steps(duration_s(1.0), asked.sample_hz) / MOST_STEPS;
        if tuning.bandwidth_hz < least_hz {
            let name = format!("the {dof} bandwidth, Hz,");
            let samples = asked.sample_hz;
            let expected = format!("at least {least_hz:.2e} with {samples} samples a second");
            return Err(Error::Setting { name, found: tuning.bandwidth_hz.to_string(), expected });
        }
    }
    Ok(())
}

/// Checks the sampling rate of a controller and the delay of every axis.
///
/// # Errors
/// [`Error::Setting`].
pub(crate) fn check_rates(
    plant: &Plant,
    sample_hz: f64,
    actuators: &Actuators,
) -> Result<(), Error> {
    let (slowest, fastest) = SAMPLE_HZ;
    if !(slowest..=fastest).contains(&sample_hz) {
        let name = "the sampling rate, Hz,".to_owned();
        let expected = format!("from {slowest} to {fastest}");
        return Err(Error::Setting { name, found: sample_hz.to_string(), expected });
    }
    let most_waiting = MOST_STATES / plant.axes().len().max(1) - 4;
    for (dof, delay_s) in Dof::ALL.into_iter().map(|dof| (dof, actuators.delay_s[dof.index()])) {
        let most_s = most_waiting as f64 / sample_hz;
        if !(0.0..=most_s).contains(&delay_s) {
            let name = format!("the {dof} delay, s,");
            let expected = format!("from 0 to {most_s} with {sample_hz} samples a second");
            return Err(Error::Setting { name, found: delay_s.to_string(), expected });
        }
    }
    Ok(())
}
